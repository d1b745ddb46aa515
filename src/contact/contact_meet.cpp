#include "contact/contact_meet.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "shape/face.h"

namespace {

// 1 + (1/4)^2, on squared distances: a point below an edge belongs to the face if it lies beside it by at
// most a quarter of its depth (14 degrees). RIM2, relative to the squared size of the face: a point beside
// the rim by 1 % of the size is in contact  (test: Face.ContactMeetsNearTheRimAndNotTooDeep)
const double BESIDE2 = 1.0625;
const double RIM2    = 1e-4;
// relative to the squared size: a point that pushes and meets no other face keeps its face while it is
// beside it by less than the size, so that its energy is recovered  (test: contact/g3_glance.inp)
const double HELD2   = 1.0;
// Round-off of a gap, relative to the size of the face, and to its coordinates. Smaller gaps of either sign
// are equal. Each alone is enough for Contact.RoundingIsNoPenetration  (no test)
const double ROUNDING = 1e-12, DIGITS = 8.0 * std::numeric_limits<double>::epsilon();

// height of slivers, relative to the size of their face  (test: contact/thin_plates.inp)
const double SLIVER = 0.1;

double largest_coordinate(const MasterFace& f)
{
  double largest = 0.0;
  for (int i = 0; i < 3; ++i) largest = std::max({largest, std::fabs(f.lo[i]), std::fabs(f.hi[i])});
  return largest;
}

}  // namespace

FaceHeight face_height(const Model& m, const Points& pts, bool body, int elem, const MasterFace& out)
{
  const ShapeInfo& info = shape_info[body ? pts.shape[elem] : elem_table[m.mesh.elem_type[elem]].shape];
  const int* conn       = body ? pts.conn.begin(elem) : m.mesh.conn.begin(elem);
  const int nnode       = body ? m.mesh.nnode() : 0;
  const auto start = [&](int c, double* x) {
    for (int i = 0; i < 3; ++i) x[i] = !body ? m.mesh.X[3 * c + i] : i < m.dim ? pts.Xc[c * m.dim + i] : 0.0;
  };
  double x[12], n[3], p[3], sum = 0.0, centre = 0.0;
  for (int k = 0; k < out.n; ++k) start(out.node[k] - nnode, x + 3 * k);
  const double xi[2] = {out.n == 3 ? 1.0 / 3 : 0.0, out.n == 3 ? 1.0 / 3 : 0.0};
  const double norm  = face_area(out.n, x, xi, n);
  for (int k = 0; k < 3 * out.n; ++k) centre += x[k] * n[k % 3] / out.n;
  int others = 0;
  for (int k = 0; k < shape_info[info.linear].nen; ++k) {
    if (std::find(out.node, out.node + out.n, conn[k] + nnode) != out.node + out.n) continue;
    start(conn[k], p);
    sum += centre - (p[0] * n[0] + p[1] * n[1] + p[2] * n[2]);
    ++others;
  }
  return {sum / (others * norm), others < out.n};
}

namespace {

// move(k): displacement k of the nodes or the corners
template <class Move>
MasterFace face_of(const Model& m, const Points& pts, bool body, const Face& f, Move move,
                   const FaceHeight* known)
{
  MasterFace out;
  const ShapeInfo& info = shape_info[body ? pts.shape[f.elem] : elem_table[m.mesh.elem_type[f.elem]].shape];
  const int* conn       = body ? pts.conn.begin(f.elem) : m.mesh.conn.begin(f.elem);
  out.n    = face_corners(info, f.face);
  out.all  = info.nfnode[f.face];
  out.kind = face_kind(m.dim, out.all);
  for (int k = 0; k < out.all; ++k) {
    const int c = conn[info.face[f.face][k]];
    out.node[k]  = body ? m.mesh.nnode() + c : c;
    for (int i = 0; i < 3; ++i) {
      double x = 0.0;
      if (i < m.dim) x = (body ? pts.Xc[c * m.dim + i] : m.mesh.X[3 * c + i]) + move(c * m.dim + i);
      out.x[3 * k + i] = x;
      out.lo[i] = k ? std::min(out.lo[i], x) : x;
      out.hi[i] = k ? std::max(out.hi[i], x) : x;
    }
  }
  for (int k = 0; k < out.n; ++k) {
    const double *a = out.x + 3 * k, *b = out.x + 3 * ((k + 1) % out.n);
    out.size = std::max(out.size, std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]));
  }
  const FaceHeight h = known ? *known : face_height(m, pts, body, f.elem, out);
  const double height = h.sliver ? std::max(h.mean, SLIVER * out.size) : h.mean;
  out.deepest  = std::min(CONTACT_DEEPEST * out.size, height);
  out.rounding = ROUNDING * out.size + DIGITS * largest_coordinate(out);
  return out;
}

}  // namespace

MasterFace master_face(const Model& m, const Points& pts, bool body, const Face& f, const RealVec& u,
                       const RealVec& uc, const FaceHeight* height)
{
  const RealVec& moved = body ? uc : u;
  return face_of(m, pts, body, f, [&](int k) { return moved[k]; }, height);
}

MasterFace face_at_start(const Model& m, const Points& pts, bool body, const Face& f)
{
  return face_of(m, pts, body, f, [](int) { return 0.0; }, nullptr);
}

void face_middle(const MasterFace& f, double* x, double* n)
{
  const double xi[2] = {f.n == 3 ? 1.0 / 3 : 0.0, f.n == 3 ? 1.0 / 3 : 0.0};
  double N[4];
  face_eval(f.n, xi, N, nullptr);
  const double norm = face_area(f.n, f.x, xi, n);
  for (int i = 0; i < 3; ++i) {
    n[i] /= norm;
    x[i] = 0.0;
    for (int k = 0; k < f.n; ++k) x[i] += N[k] * f.x[3 * k + i];
  }
}

namespace {

// local coordinates of the normal projection of p: Newton's method on the two tangents (one iteration for
// edges, triangles and parallelograms, and one to confirm). x = m + a xi + b eta + h xi eta; a triangle from
// its first node, h = 0
//   in   all   false: it ends as soon as p lies beside f, by four times the last correction
void project(const MasterFace& f, const double* p, bool all, double* xi)
{
  double r0[3], a[3], b[3] = {0, 0, 0}, h[3] = {0, 0, 0};
  const double* x = f.x;
  for (int i = 0; i < 3; ++i) {
    if (f.n == 4) {
      r0[i] = p[i] - 0.25 * (x[i] + x[3 + i] + x[6 + i] + x[9 + i]);
      a[i]  = 0.25 * (x[3 + i] + x[6 + i] - x[i] - x[9 + i]);
      b[i]  = 0.25 * (x[6 + i] + x[9 + i] - x[i] - x[3 + i]);
      h[i]  = 0.25 * (x[i] + x[6 + i] - x[3 + i] - x[9 + i]);
    } else if (f.n == 3) {
      r0[i] = p[i] - x[i];
      a[i]  = x[3 + i] - x[i];
      b[i]  = x[6 + i] - x[i];
    } else {
      r0[i] = p[i] - 0.5 * (x[i] + x[3 + i]);
      a[i]  = 0.5 * (x[3 + i] - x[i]);
    }
  }
  xi[0] = xi[1] = 0.0;
  for (int it = 0; it < 10; ++it) {
    double aa = 0, ab = 0, bb = 0, p0 = 0, p1 = 0;
    for (int i = 0; i < 3; ++i) {
      const double t0 = a[i] + h[i] * xi[1], t1 = b[i] + h[i] * xi[0], r = r0[i] - t0 * xi[0] - b[i] * xi[1];
      aa += t0 * t0;
      ab += t0 * t1;
      bb += t1 * t1;
      p0 += t0 * r;
      p1 += t1 * r;
    }
    if (f.n == 2) bb = 1.0;
    const double det = aa * bb - ab * ab, d0 = (bb * p0 - ab * p1) / det, d1 = (aa * p1 - ab * p0) / det;
    xi[0] += d0;
    xi[1] += d1;
    const double moved = std::fabs(d0) + std::fabs(d1);
    if (moved < 1e-12) return;
    if (!all && f.n == 4 && std::max(std::fabs(xi[0]), std::fabs(xi[1])) > 1.0 + 4.0 * moved) return;
  }
}

bool on_face(const MasterFace& f, const double* xi)
{
  const double tol = 1e-6;     // local: neighbours overlap by this, so that no point slips through an edge
  if (f.n == 3) return xi[0] > -tol && xi[1] > -tol && xi[0] + xi[1] < 1.0 + tol;
  return std::fabs(xi[0]) < 1.0 + tol && std::fabs(xi[1]) < 1.0 + tol;
}

// local coordinates of the corners of an edge, a triangle, a quadrilateral
const double CORNER[5][4][2] = {
    {}, {}, {{-1, 0}, {1, 0}}, {{0, 0}, {1, 0}, {0, 1}}, {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}}};

// parameter 0 ... 1 of the point of the line from a to b that is closest to p
double nearest_on_line(const double* a, const double* b, const double* p)
{
  double along = 0.0, length2 = 0.0;
  for (int i = 0; i < 3; ++i) {
    along += (b[i] - a[i]) * (p[i] - a[i]);
    length2 += (b[i] - a[i]) * (b[i] - a[i]);
  }
  return length2 > 0.0 ? std::min(std::max(along / length2, 0.0), 1.0) : 0.0;
}

// local coordinates of the point of the (straight) edges of f closest to p; 2D: of the ends of f
void nearest_on_rim(const MasterFace& f, const double* p, double* xi)
{
  double least = 1e300;
  for (int k = 0; k < (f.n == 2 ? 1 : f.n); ++k) {
    const int l = (k + 1) % f.n;
    const double *a = f.x + 3 * k, *b = f.x + 3 * l, t = nearest_on_line(a, b, p);
    double distance2 = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double r = p[i] - a[i] - t * (b[i] - a[i]);
      distance2 += r * r;
    }
    if (distance2 >= least) continue;
    least = distance2;
    for (int i = 0; i < 2; ++i) xi[i] = CORNER[f.n][k][i] + t * (CORNER[f.n][l][i] - CORNER[f.n][k][i]);
  }
}

// local coordinates of the projection on a face of a quadratic element, from those on its corners: Newton's
// method without the curvature, which converges by a factor of curvature times distance
void project_bent(const MasterFace& f, const double* p, double* xi)
{
  for (int it = 0; it < 30; ++it) {
    double N[MAX_FACE_NODES], dN[2 * MAX_FACE_NODES], t[2][3] = {{0, 0, 0}, {0, 0, 0}}, r[3];
    double g[2] = {0, 0}, aa = 0, ab = 0, bb = 0;
    face_eval(f.kind, xi, N, dN);
    for (int i = 0; i < 3; ++i) {
      r[i] = p[i];
      for (int k = 0; k < f.all; ++k) {
        r[i] -= N[k] * f.x[3 * k + i];
        for (int j = 0; j < 2; ++j) t[j][i] += dN[2 * k + j] * f.x[3 * k + i];
      }
      for (int j = 0; j < 2; ++j) g[j] += t[j][i] * r[i];
      aa += t[0][i] * t[0][i];
      ab += t[0][i] * t[1][i];
      bb += t[1][i] * t[1][i];
    }
    if (f.n == 2) bb = 1.0;
    const double det = aa * bb - ab * ab, d0 = (bb * g[0] - ab * g[1]) / det,
                 d1  = (aa * g[1] - ab * g[0]) / det;
    xi[0] += d0;
    xi[1] += d1;
    if (std::fabs(d0) + std::fabs(d1) < 1e-12) return;
  }
}

// hit of p at the local coordinates xi of f. Returns the squared distance
double hit_at(const MasterFace& f, const double* p, const double* xi, Hit& hit)
{
  double distance2 = 0.0;
  face_eval(f.kind, xi, hit.N, nullptr);
  const double norm = face_area(f.kind, f.x, xi, hit.n);
  hit.face = &f;
  hit.gap  = 0.0;
  for (int i = 0; i < 3; ++i) {
    hit.r[i] = p[i];
    for (int k = 0; k < f.all; ++k) hit.r[i] -= hit.N[k] * f.x[3 * k + i];
    hit.n[i] /= norm;
    hit.gap += hit.n[i] * hit.r[i];
    distance2 += hit.r[i] * hit.r[i];
  }
  return distance2;
}

}  // namespace

// (test: Contact.TheNearestPlaceOfAFaceIsTheNearest)
double contact_nearest(const MasterFace& f, const double* p, bool& over, Hit& hit)
{
  double xi[2];
  project(f, p, false, xi);
  if (f.all > f.n) project_bent(f, p, xi);
  over = on_face(f, xi);
  if (over) {
    const double distance2 = hit_at(f, p, xi, hit);
    // far from a distorted face Newton's method may fail to converge, and end inside by chance
    over = distance2 - hit.gap * hit.gap <= RIM2 * f.size * f.size;
    if (over) return distance2;
  }
  nearest_on_rim(f, p, xi);
  return hit_at(f, p, xi, hit);
}

Projection contact_meet(const MasterFace& f, const double* p, double reach, Hit& hit)
{
  for (int i = 0; i < 3; ++i)
    if (p[i] < f.lo[i] - reach || p[i] > f.hi[i] + reach) return PROJ_NONE;
  bool over;
  const double distance2 = contact_nearest(f, p, over, hit);
  if (hit.gap > reach || hit.gap < -f.deepest) return PROJ_NONE;
  const double gap2 = hit.gap * hit.gap, rim2 = RIM2 * f.size * f.size;
  // below a concave edge a point may lie over no face at all: it belongs to the face whose edge is closest
  hit.beside = !over && hit.gap <= 0.0 && distance2 <= BESIDE2 * gap2;
  if (over || hit.beside) return PROJ_OVER;
  return distance2 - gap2 <= rim2 ? PROJ_RIM : PROJ_NONE;
}

// (no test)
bool contact_outside(const Hit& hit, const MasterFace& neighbour, const double* p)
{
  const MasterFace& f = *hit.face;
  for (int k = 0; k < f.all; ++k)
    if (std::fabs(hit.N[k]) > 1e-6 && std::find(neighbour.node, neighbour.node + neighbour.all, f.node[k]) ==
                                          neighbour.node + neighbour.all)
      return false;
  double x[3], n[3], gap = 0.0;
  face_middle(neighbour, x, n);
  for (int i = 0; i < 3; ++i) gap += n[i] * (p[i] - x[i]);
  return gap > 1e-8 * neighbour.size + neighbour.rounding;
}

bool contact_hold(const MasterFace& f, const double* p, Hit& hit)
{
  bool over;
  const double distance2 = contact_nearest(f, p, over, hit);
  if (distance2 - hit.gap * hit.gap > HELD2 * f.size * f.size) return false;
  if (over) return true;
  double xi[2];
  Hit beside;
  project(f, p, true, xi);
  if (f.all > f.n) project_bent(f, p, xi);
  const double beside2 = hit_at(f, p, xi, beside) - beside.gap * beside.gap;
  if (beside2 <= RIM2 * f.size * f.size) hit = beside;       // else Newton's method did not converge
  return true;
}

void contact_nearer(const Hit& hit, Projection k, Projection& kind, std::vector<Hit>& best)
{
  if (k == PROJ_NONE || k < kind) return;
  if (k > kind) best.clear();
  kind = k;
  best.push_back(hit);
}

namespace {

// is a equal to the minimum least, to round-off?
bool equals(double a, double least, const Hit& hit)
{
  return a <= least + 1e-8 * hit.face->size + hit.face->rounding;
}

double distance(const Hit& hit) { return std::hypot(hit.r[0], hit.r[1], hit.r[2]); }

}  // namespace

// (test: Contact.EquallyNearFacesKeepTheirOrder)
void contact_equal(std::vector<Hit>& best)
{
  if (best.size() < 2) return;
  double gap = 1e300, closest = 1e300;
  bool flat = true;
  size_t n  = 0;
  for (const Hit& hit : best) gap = std::min(gap, std::fabs(hit.gap));
  best.erase(std::remove_if(best.begin(), best.end(),
                            [&](const Hit& hit) { return !equals(std::fabs(hit.gap), gap, hit); }),
             best.end());
  for (const Hit& hit : best) closest = std::min(closest, distance(hit));
  const auto first = std::find_if(best.begin(), best.end(),
                                  [&](const Hit& hit) { return equals(distance(hit), closest, hit); });
  std::rotate(best.begin(), first, first + 1);
  for (const Hit& hit : best) {
    const double *a = best[0].n, cosine = a[0] * hit.n[0] + a[1] * hit.n[1] + a[2] * hit.n[2];
    if (cosine < 0.5) continue;                         // back to back, or around a sharp corner
    flat = flat && cosine > 1.0 - 1e-12;
    best[n++] = hit;
  }
  best.resize(flat ? 1 : n);
}
