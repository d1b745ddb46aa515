#include <algorithm>
#include <array>
#include <cmath>

#include "base/comm.h"
#include "contact/contact_tree.h"
#include "frac/frac.h"
#include "shape/face.h"

namespace {

// of the size of a cell: an overlap that is none.  Test: verification/contact/g4_box, debris in each other
const double NEAR   = 1e-6;
const int BISECTIONS = 12;

// An element, or the domain of a point, where it is now: the hull of its corners
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

// normals of the faces and directions of the edges: what may separate two convex cells
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

// size and directions; a cell that is inside out has size 0: nothing can be told of it
void finish(Shape shape, int dim, HullCell& c)
{
  double X[24], w[8], G[24];
  for (int a = 0; a < c.n; ++a) std::copy_n(c.x[a], dim, &X[a * dim]);
  const double V = cpdi_weights(shape, X, w, G);
  c.size = V > 0.0 ? std::pow(V, 1.0 / dim) : 0.0;
  if (c.size > 0.0) directions(shape, dim, c);
}

ContactBox box_of(int n, const double (*x)[3])
{
  ContactBox b;
  for (int i = 0; i < 3; ++i) {
    b.lo[i] = b.hi[i] = x[0][i];
    for (int a = 1; a < n; ++a) {
      b.lo[i] = std::min(b.lo[i], x[a][i]);
      b.hi[i] = std::max(b.hi[i], x[a][i]);
    }
  }
  return b;
}

HullCell cell_of_point(const Points& pts, int dim, const RealVec& uc, int p)
{
  HullCell c;
  c.n = pts.conn.count(p);
  for (int a = 0; a < c.n; ++a)
    for (int i = 0; i < 3; ++i) {
      const int k = pts.conn.begin(p)[a] * dim + i;
      c.x[a][i]   = i < dim ? pts.Xc[k] + uc[k] : 0.0;
    }
  finish(static_cast<Shape>(pts.shape[p]), dim, c);
  return c;
}

// where an element is now
struct ElementNow {
  int number;                  // in the mesh of the deck
  Shape shape;
  double x[8][3];
};

ElementNow element_now(const Model& m, const RealVec& u, int e)
{
  const Mesh& mesh = m.mesh;
  ElementNow now{m.part.elem_number(e), shape_info[elem_table[mesh.elem_type[e]].shape].linear, {}};
  for (int a = 0; a < shape_info[now.shape].nen; ++a)
    for (int i = 0; i < 3; ++i) {
      const int node = mesh.conn.begin(e)[a];
      now.x[a][i]    = mesh.X[3 * node + i] + (i < m.dim ? u[node * m.dim + i] : 0.0);
    }
  return now;
}

HullCell cell_of_element(int dim, const ElementNow& now)
{
  HullCell c;
  c.n = shape_info[now.shape].nen;
  for (int a = 0; a < c.n; ++a) std::copy_n(now.x[a], 3, c.x[a]);
  finish(now.shape, dim, c);
  return c;
}

// Elements whose boxes overlap one of tree, in the order of the deck. Divided model: each rank looks at those
// that it works on.
std::vector<HullCell> elements_near(const Model& m, const ContactTree& tree, const State& st)
{
  std::vector<ElementNow> near;
  IntVec found;
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    if (m.mesh.elem_section[e] < 0 || st.frac.phase[e] != AS_ELEMENT || !m.part.works(e)) continue;
    const ElementNow now = element_now(m, st.n.u, e);
    found.clear();
    tree.overlap(box_of(shape_info[now.shape].nen, now.x), found);
    if (!found.empty()) near.push_back(now);
  }
  if (m.part.on) comm_allgatherv(near);
  std::sort(near.begin(), near.end(),
            [](const ElementNow& a, const ElementNow& b) { return a.number < b.number; });
  std::vector<HullCell> cell;
  for (const ElementNow& now : near) cell.push_back(cell_of_element(m.dim, now));
  return cell;
}

// the shape of a grain, drawn towards its centre
HullCell cell_of_grain(const GrainShape& g, const Points& pts, int dim, double scale)
{
  HullCell c;
  c.n = pts.conn.count(g.point);
  for (int a = 0; a < c.n; ++a)
    for (int i = 0; i < 3; ++i) c.x[a][i] = g.centre[i] + scale * (g.corner[a][i] - g.centre[i]);
  finish(static_cast<Shape>(pts.shape[g.point]), dim, c);
  return c;
}

// cells that stay as they are: points but for the grains, and elements near the grains (box)
std::vector<HullCell> other_cells(const Model& m, const std::vector<GrainShape>& grain,
                                  const std::vector<ContactBox>& box, const State& st)
{
  IntVec is_grain(st.points.npoint, 0);
  for (const GrainShape& g : grain) is_grain[g.point] = 1;
  std::vector<HullCell> cell;
  for (int p = 0; p < st.points.npoint; ++p)
    if (!is_grain[p]) cell.push_back(cell_of_point(st.points, m.dim, st.n.uc, p));
  const std::vector<HullCell> element = elements_near(m, ContactTree(box), st);
  cell.insert(cell.end(), element.begin(), element.end());
  return cell;
}

// by how much a and b overlap along n: the shorter of the two ways out
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

// do convex cells overlap? Apart along a normal of one of them or, in space, across an edge of each: no
bool overlap(const HullCell& a, const HullCell& b)
{
  if (a.size == 0.0 || b.size == 0.0) return false;
  const double none = NEAR * std::min(a.size, b.size);
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

// a grain gets smaller until it does not overlap the cell, or is as small as it may be
void draw_back(const HullCell& other, const Points& pts, int dim, double least, GrainShape& g)
{
  if (!overlap(other, cell_of_grain(g, pts, dim, g.scale))) return;
  double lo = least, hi = g.scale;
  for (int k = 0; k < BISECTIONS; ++k) {
    const double s = 0.5 * (lo + hi);
    (overlap(other, cell_of_grain(g, pts, dim, s)) ? hi : lo) = s;
  }
  g.scale = lo;
}

}  // namespace

void frac_room(const Model& m, const State& st, double least, std::vector<GrainShape>& grain)
{
  const Points& pts = st.points;
  if (grain.empty()) return;
  std::vector<HullCell> own;
  std::vector<ContactBox> box;
  for (const GrainShape& g : grain) {
    own.push_back(cell_of_grain(g, pts, m.dim, g.scale));
    box.push_back(box_of(own.back().n, own.back().x));
  }
  std::vector<HullCell> cell = other_cells(m, grain, box, st);
  const int others = static_cast<int>(cell.size());
  cell.insert(cell.end(), own.begin(), own.end());
  box.clear();
  for (const HullCell& c : cell) box.push_back(box_of(c.n, c.x));
  const ContactTree tree(box);
  for (size_t i = 0; i < grain.size(); ++i) {
    const int self = others + static_cast<int>(i);
    IntVec found;
    tree.overlap(box[self], found);
    std::sort(found.begin(), found.end());
    for (int j : found)
      if (j != self) draw_back(cell[j], pts, m.dim, least, grain[i]);
    cell[self] = cell_of_grain(grain[i], pts, m.dim, grain[i].scale);
  }
}
