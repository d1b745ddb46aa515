#include <algorithm>
#include <array>
#include <cmath>

#include "base/box_tree.h"
#include "base/comm.h"
#include "frac/frac.h"
#include "shape/face.h"

namespace {

// overlap to ignore, relative to the smaller of two cells; trials of the scale that fits between others, to
// 2^-12 of the range  (test: contact/g4_box)
const double OVERLAP_TOL   = 1e-6;
const int BISECTIONS = 12;

// An element, or the domain of a point, in its present position: the hull of its corners
struct HullCell {
  int n = 0;
  double size = 0.0;
  double x[8][3];
  std::vector<std::array<double, 3>> normal, edge;
};

void cross(const double* a, const double* b, double* c)
{
  for (int i = 0; i < 3; ++i) c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

// normals of the faces and directions of the edges, which may separate two convex cells
void directions(Shape shape, int dim, HullCell& c)
{
  const ShapeInfo& info = shape_info[shape];
  for (int s = 0; s < info.nface; ++s) {
    double X[12] = {0}, n[3] = {0, 0, 0};
    const int nf = info.nfnode[s];
    for (int k = 0; k < nf; ++k) std::copy_n(c.x[info.face[s][k]], 3, &X[3 * k]);
    const double third = nf == 3 ? 1.0 / 3.0 : 0.0, middle[2] = {third, third};
    const double area = face_area(nf, X, middle, n);
    if (area > 0.0) c.normal.push_back({n[0] / area, n[1] / area, n[2] / area});
    for (int k = 0; dim == 3 && k < nf; ++k) {
      const int a = info.face[s][k], b = info.face[s][(k + 1) % nf];
      if (a < b) c.edge.push_back({c.x[b][0] - c.x[a][0], c.x[b][1] - c.x[a][1], c.x[b][2] - c.x[a][2]});
    }
  }
}

// size and directions; an inverted cell has size 0 and is ignored
void finish(Shape shape, int dim, HullCell& c)
{
  double X[24], w[8], G[24];
  for (int a = 0; a < c.n; ++a) std::copy_n(c.x[a], dim, &X[a * dim]);
  const double V = cpdi_weights(shape, X, w, G);
  c.size = V > 0.0 ? std::pow(V, 1.0 / dim) : 0.0;
  if (c.size > 0.0) directions(shape, dim, c);
}

BoundingBox box_of(int n, const double (*x)[3])
{
  BoundingBox b;
  for (int a = 0; a < n; ++a) box_take(b, x[a]);
  return b;
}

// present position of an element, or of the domain of a point
struct CellNow {
  int number;                  // in the mesh of the deck; of points of all ranks
  Shape shape;
  double x[8][3];
};

CellNow point_now(const Points& pts, int dim, const RealVec& uc, int p)
{
  CellNow now{pts.point_number(p), static_cast<Shape>(pts.shape[p]), {}};
  for (int a = 0; a < pts.conn.count(p); ++a)
    for (int i = 0; i < dim; ++i) {
      const int k = pts.conn.begin(p)[a] * dim + i;
      now.x[a][i] = pts.Xc[k] + uc[k];
    }
  return now;
}

CellNow element_now(const Model& m, const RealVec& u, int e)
{
  const Mesh& mesh = m.mesh;
  CellNow now{m.part.elem_number(e), shape_info[elem_table[mesh.elem_type[e]].shape].linear, {}};
  for (int a = 0; a < shape_info[now.shape].nen; ++a)
    for (int i = 0; i < 3; ++i) {
      const int node = mesh.conn.begin(e)[a];
      now.x[a][i]    = mesh.X[3 * node + i] + (i < m.dim ? u[node * m.dim + i] : 0.0);
    }
  return now;
}

HullCell hull(int dim, const CellNow& now)
{
  HullCell c;
  c.n = shape_info[now.shape].nen;
  for (int a = 0; a < c.n; ++a) std::copy_n(now.x[a], 3, c.x[a]);
  finish(now.shape, dim, c);
  return c;
}

// adds cells in the order of their numbers; gather: from all ranks
void add_hulls(int dim, bool gather, std::vector<CellNow>& own, std::vector<HullCell>& cell)
{
  if (gather) comm_allgatherv(own);
  std::sort(own.begin(), own.end(), [](const CellNow& a, const CellNow& b) { return a.number < b.number; });
  for (const CellNow& now : own) cell.push_back(hull(dim, now));
}

// the shape of a released point, scaled about its centre
HullCell released_cell(const ReleasedShape& g, int dim, double scale)
{
  HullCell c;
  c.n = shape_info[g.shape].nen;
  for (int a = 0; a < c.n; ++a)
    for (int i = 0; i < 3; ++i) c.x[a][i] = g.centre[i] + scale * (g.corner[a][i] - g.centre[i]);
  finish(g.shape, dim, c);
  return c;
}

// Fixed cells near the released points (box): other points, and elements. Divided model: each rank searches
// its own elements, and its own points if no rank stores all.
std::vector<HullCell> other_cells(const Model& m, const std::vector<ReleasedShape>& released,
                                  const std::vector<BoundingBox>& box, const State& st)
{
  const BoxTree tree(box);
  const Points& pts = st.points;
  IntVec found, numbers;
  for (const ReleasedShape& g : released) numbers.push_back(g.number);
  std::sort(numbers.begin(), numbers.end());
  const auto is_near = [&](const CellNow& now) {
    found.clear();
    tree.overlap(box_of(shape_info[now.shape].nen, now.x), found);
    return !found.empty();
  };
  std::vector<HullCell> cell;
  std::vector<CellNow> own;
  for (int p = 0; p < pts.npoint; ++p) {
    if (m.part.window && !point_counts(m, pts, p)) continue;
    const CellNow now = point_now(pts, m.dim, st.n.uc, p);
    if (is_near(now) && !std::binary_search(numbers.begin(), numbers.end(), now.number)) own.push_back(now);
  }
  add_hulls(m.dim, m.part.window, own, cell);
  own.clear();
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    if (m.mesh.elem_section[e] < 0 || st.frac.phase[e] != AS_ELEMENT || !m.part.works(e)) continue;
    const CellNow now = element_now(m, st.n.u, e);
    if (is_near(now)) own.push_back(now);
  }
  add_hulls(m.dim, m.part.on, own, cell);
  return cell;
}

// overlap of a and b along n: the smaller of the two separations
double overlap_along(const HullCell& a, const HullCell& b, const double* n)
{
  double lo[2] = {1e300, 1e300}, hi[2] = {-1e300, -1e300};
  for (int s = 0; s < 2; ++s) {
    const HullCell& c = s ? b : a;
    for (int k = 0; k < c.n; ++k) {
      const double y = n[0] * c.x[k][0] + n[1] * c.x[k][1] + n[2] * c.x[k][2];
      lo[s] = std::min(lo[s], y);
      hi[s] = std::max(hi[s], y);
    }
  }
  return std::min(hi[0] - lo[1], hi[1] - lo[0]);
}

// do convex cells overlap? Not if separated along a normal of either or, in 3D, across an edge of each
bool overlap(const HullCell& a, const HullCell& b)
{
  if (a.size == 0.0 || b.size == 0.0) return false;
  const double none = OVERLAP_TOL * std::min(a.size, b.size);
  for (const HullCell* c : {&a, &b})
    for (const auto& n : c->normal)
      if (overlap_along(a, b, n.data()) <= none) return false;
  for (const auto& s : a.edge)
    for (const auto& t : b.edge) {
      double n[3];
      cross(s.data(), t.data(), n);
      const double length = std::hypot(n[0], n[1], n[2]);
      if (length < 1e-3 * a.size * b.size) continue;
      for (double& x : n) x /= length;
      if (overlap_along(a, b, n) <= none) return false;
    }
  return true;
}

// reduces the scale until the released point does not overlap a fixed cell, or another released point of the
// same scale; the result does not depend on the order of the two
template <class Meets>
void shrink(double least, double& scale, Meets meets)
{
  if (!meets(scale)) return;
  double lo = least, hi = 1.0;                         // the same trial scales for each cell
  for (int k = 0; k < BISECTIONS; ++k) {
    const double s = 0.5 * (lo + hi);
    (meets(s) ? hi : lo) = s;
  }
  scale = lo;
}

}  // namespace

void frac_room(const Model& m, const State& st, double least, std::vector<ReleasedShape>& released)
{
  if (released.empty()) return;
  std::vector<HullCell> own;
  std::vector<BoundingBox> box;
  for (const ReleasedShape& g : released) {
    own.push_back(released_cell(g, m.dim, 1.0));
    box.push_back(box_of(own.back().n, own.back().x));
  }
  std::vector<HullCell> cell = other_cells(m, released, box, st);
  const int others = static_cast<int>(cell.size());
  cell.insert(cell.end(), own.begin(), own.end());
  box.clear();
  for (const HullCell& c : cell) box.push_back(box_of(c.n, c.x));
  const BoxTree tree(box);
  for (size_t i = 0; i < released.size(); ++i) {
    const int self = others + static_cast<int>(i);
    IntVec found;
    tree.overlap(box[self], found);
    std::sort(found.begin(), found.end());
    ReleasedShape& g = released[i];
    for (int j : found)
      if (j < others)
        shrink(least, g.scale, [&](double s) { return overlap(cell[j], released_cell(g, m.dim, s)); });
      else if (j != self)
        shrink(least, g.scale, [&](double s) {
          return overlap(released_cell(released[j - others], m.dim, s), released_cell(g, m.dim, s));
        });
  }
}
