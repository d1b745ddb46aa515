#include <algorithm>
#include <cmath>

#include "contact/contact.h"
#include "shape/face.h"

namespace {

// Test of all three: Face.ContactMeetsNearTheRimAndNotTooDeep (unit)
const double DEEPEST = 0.5;    // of the size of a face: a point deeper below it has come from elsewhere
// 1 + (1/4)^2, on squared distances: a point below an edge belongs to the face while it lies beside it by no
// more than a quarter of its depth (14 degrees)
const double BESIDE2 = 1.0625;
const double RIM2    = 1e-4;   // of the squared size: a hundredth of the face beside its rim still meets it

struct MasterFace {
  int n = 0;
  int kin[4];
  double x[12];                // places at t(n)
  double lo[3], hi[3];
  double size = 0.0;           // longest edge
};

// body: points own the face, otherwise a finite element
MasterFace master_face(const Model& m, const Points& pts, bool body, const Face& f, const RealVec& u,
                       const RealVec& uc)
{
  MasterFace out;
  const ShapeInfo& info = shape_info[body ? pts.shape[f.elem] : elem_table[m.mesh.elem_type[f.elem]].shape];
  const int* conn       = body ? pts.conn.begin(f.elem) : m.mesh.conn.begin(f.elem);
  out.n = info.nfnode[f.face];
  for (int k = 0; k < out.n; ++k) {
    const int c = conn[info.face[f.face][k]];
    out.kin[k]  = body ? m.mesh.nnode() + c : c;
    for (int i = 0; i < 3; ++i) {
      double x = 0.0;
      if (i < m.dim)
        x = body ? pts.Xc[c * m.dim + i] + uc[c * m.dim + i] : m.mesh.X[3 * c + i] + u[c * m.dim + i];
      out.x[3 * k + i] = x;
      out.lo[i] = k ? std::min(out.lo[i], x) : x;
      out.hi[i] = k ? std::max(out.hi[i], x) : x;
    }
  }
  for (int k = 0; k < out.n; ++k) {
    const double *a = out.x + 3 * k, *b = out.x + 3 * ((k + 1) % out.n);
    out.size = std::max(out.size, std::hypot(b[0] - a[0], b[1] - a[1], b[2] - a[2]));
  }
  return out;
}

// local place of the point of the face nearest to p: Newton on the two tangents (one step for flat faces)
void project(const MasterFace& f, const double* p, double* xi)
{
  double N[4], dN[8];
  xi[0] = xi[1] = f.n == 3 ? 1.0 / 3 : 0.0;
  for (int it = 0; it < 10; ++it) {
    double r[3] = {p[0], p[1], p[2]}, t[2][3] = {{0, 0, 0}, {0, 0, 0}};
    face_eval(f.n, xi, N, dN);
    for (int k = 0; k < f.n; ++k)
      for (int i = 0; i < 3; ++i) {
        r[i] -= N[k] * f.x[3 * k + i];
        t[0][i] += dN[2 * k] * f.x[3 * k + i];
        t[1][i] += dN[2 * k + 1] * f.x[3 * k + i];
      }
    double a = 0, b = 0, c = 0, p0 = 0, p1 = 0;
    for (int i = 0; i < 3; ++i) {
      a += t[0][i] * t[0][i];
      b += t[0][i] * t[1][i];
      c += t[1][i] * t[1][i];
      p0 += t[0][i] * r[i];
      p1 += t[1][i] * r[i];
    }
    if (f.n == 2) { b = p1 = 0.0; c = 1.0; }
    const double det = a * c - b * b, d0 = (c * p0 - b * p1) / det, d1 = (a * p1 - b * p0) / det;
    xi[0] += d0;
    xi[1] += d1;
    if (std::fabs(d0) + std::fabs(d1) < 1e-12) return;
  }
}

bool on_face(const MasterFace& f, const double* xi)
{
  const double tol = 1e-6;     // of the face: neighbours overlap by as much, so nothing slips through an edge
  if (f.n == 3) return xi[0] > -tol && xi[1] > -tol && xi[0] + xi[1] < 1.0 + tol;
  return std::fabs(xi[0]) < 1.0 + tol && std::fabs(xi[1]) < 1.0 + tol;
}

// the place of the face nearest to xi
void clamp(const MasterFace& f, double* xi)
{
  if (f.n != 3) {
    for (int k = 0; k < 2; ++k) xi[k] = std::min(std::max(xi[k], -1.0), 1.0);
    return;
  }
  for (int k = 0; k < 2; ++k) xi[k] = std::max(xi[k], 0.0);
  const double sum = xi[0] + xi[1];
  if (sum > 1.0)
    for (int k = 0; k < 2; ++k) xi[k] /= sum;
}

struct Hit {                   // a face that is met, and where
  const MasterFace* face = nullptr;
  double N[4], n[3], r[3];     // shape functions of the place, normal, from the place to the point
  double gap = 0.0;
};

// how a point projects on a face: not, on its rim, inside
enum Projection { PROJ_NONE, PROJ_RIM, PROJ_OVER };

// the place of f that p meets: p lies over f, or beside its rim by no more than a hundredth of its size. None
// beyond reach or when p has entered by more than half of its size.
Projection meet(const MasterFace& f, const double* p, double reach, Hit& hit)
{
  for (int i = 0; i < 3; ++i)
    if (p[i] < f.lo[i] - reach || p[i] > f.hi[i] + reach) return PROJ_NONE;
  double xi[2], distance2 = 0.0;
  project(f, p, xi);
  const bool over = on_face(f, xi);
  if (!over) clamp(f, xi);
  face_eval(f.n, xi, hit.N, nullptr);
  const double norm = face_area(f.n, f.x, xi, hit.n);
  hit.face = &f;
  hit.gap  = 0.0;
  for (int i = 0; i < 3; ++i) {
    hit.r[i] = p[i];
    for (int k = 0; k < f.n; ++k) hit.r[i] -= hit.N[k] * f.x[3 * k + i];
    hit.n[i] /= norm;
    hit.gap += hit.n[i] * hit.r[i];
    distance2 += hit.r[i] * hit.r[i];
  }
  if (hit.gap > reach || hit.gap < -DEEPEST * f.size) return PROJ_NONE;
  // behind a dent a point may lie over no face at all: it belongs to the face whose edge it is behind
  const double gap2 = hit.gap * hit.gap;
  if (over || (hit.gap <= 0.0 && distance2 <= BESIDE2 * gap2)) return PROJ_OVER;
  return distance2 - gap2 <= RIM2 * f.size * f.size ? PROJ_RIM : PROJ_NONE;
}

// the nearest face that p lies over, or else the nearest with p beside its rim: nodes on the edge of both
// surfaces stay in contact under small oscillations. More than one when p stands over the edge or the node
// where they meet at an angle.
void nearest(const std::vector<MasterFace>& faces, const double* p, double reach, std::vector<Hit>& best)
{
  Projection kind = PROJ_NONE;
  best.clear();
  for (const MasterFace& f : faces) {
    Hit hit;
    const Projection k = meet(f, p, reach, hit);
    if (k == PROJ_NONE || k < kind) continue;
    if (k > kind) best.clear();
    kind = k;
    if (best.empty() || std::fabs(hit.gap) >= std::fabs(best[0].gap)) best.push_back(hit);
    else best.insert(best.begin(), hit);
  }
  bool flat = true;
  size_t n  = 0;
  for (const Hit& hit : best) {
    const double *a = best[0].n, cosine = a[0] * hit.n[0] + a[1] * hit.n[1] + a[2] * hit.n[2];
    if (std::fabs(hit.gap) > std::fabs(best[0].gap) + 1e-8 * hit.face->size) continue;
    if (cosine < 0.5) continue;                         // back to back, or around a sharp corner
    flat = flat && cosine > 1.0 - 1e-12;
    best[n++] = hit;
  }
  if (!best.empty()) best.resize(flat ? 1 : n);
}

struct Box {
  double lo[3] = {1e300, 1e300, 1e300}, hi[3] = {-1e300, -1e300, -1e300};
  void add(const double* low, const double* high, int dim)
  {
    for (int i = 0; i < dim; ++i) {
      lo[i] = std::min(lo[i], low[i]);
      hi[i] = std::max(hi[i], high[i]);
    }
  }
  bool apart(const Box& b, double reach, int dim) const
  {
    for (int i = 0; i < dim; ++i)
      if (lo[i] > b.hi[i] + reach || hi[i] < b.lo[i] - reach) return true;
    return false;
  }
};

// what the bond meets: the mean of the faces                                       (4.9)
void take_hits(const std::vector<Hit>& hits, int dim, double offset, int b, ContactPairs& pairs)
{
  const double share = 1.0 / static_cast<double>(hits.size());
  double n[3] = {0, 0, 0}, r[3] = {0, 0, 0};
  for (const Hit& hit : hits) {
    for (int i = 0; i < 3; ++i) {
      n[i] += share * hit.n[i];
      r[i] += share * hit.r[i];
    }
    for (int k = 0; k < hit.face->n; ++k) {
      pairs.master.item.push_back(hit.face->kin[k]);
      pairs.master_w.push_back(share * hit.N[k]);
    }
  }
  const double norm = std::hypot(n[0], n[1], n[2]);
  ++pairs.near;
  pairs.gap[b]  = (n[0] * r[0] + n[1] * r[1] + n[2] * r[2]) / norm - offset;
  pairs.size[b] = hits[0].face->size;
  for (int i = 0; i < dim; ++i) pairs.normal[b * dim + i] = n[i] / norm;
}

// faces of a master surface: elements that became points have left faces of points, but not yet at the start
void master_faces(const Model& m, const Points& pts, int surface, bool at_start, const RealVec& u,
                  const RealVec& uc, std::vector<MasterFace>& faces)
{
  const Surface& s = m.surface[surface];
  for (const Face& f : s.face)
    if (at_start || !pts.converted(f.elem)) faces.push_back(master_face(m, pts, false, f, u, uc));
  if (at_start && s.body < 0) return;
  for (const Face& f : pts.surface[surface]) faces.push_back(master_face(m, pts, true, f, u, uc));
}

// bonds first ... last-1 of one definition. The boxes of both surfaces come first: bodies apart end here.
void search_pair(const Model& m, const Points& pts, const Bonds& bonds, int first, int last, bool at_start,
                 const RealVec& u, const RealVec& uc, const RealVec& xb, ContactPairs& pairs)
{
  const int dim = m.dim, master = m.bond[bonds.def[first]].master;
  std::vector<MasterFace> faces;
  std::vector<Hit> hits;
  Box slave_box, master_box;
  double reach = 0.0;
  master_faces(m, pts, master, at_start, u, uc, faces);
  for (const MasterFace& f : faces) {
    reach = std::max(reach, f.size);
    master_box.add(f.lo, f.hi, dim);
  }
  for (int b = first; b < last; ++b) slave_box.add(&xb[b * dim], &xb[b * dim], dim);
  const bool apart = slave_box.apart(master_box, reach, dim);
  ++(apart ? pairs.skipped : pairs.searched);
  for (int b = first; b < last; ++b) {
    Box place;
    place.add(&xb[b * dim], &xb[b * dim], dim);
    hits.clear();
    // no area: a node that is lost
    if (!apart && bonds.area[b] > 0.0 && !place.apart(master_box, reach, dim)) {
      double p[3] = {0, 0, 0};
      std::copy(&xb[b * dim], &xb[b * dim] + dim, p);
      nearest(faces, p, reach, hits);
    }
    if (!hits.empty()) take_hits(hits, dim, bonds.offset[b], b, pairs);
    pairs.master.off.push_back(static_cast<int>(pairs.master.item.size()));
  }
}

}  // namespace

namespace {

void search(const Model& m, const Points& pts, const Bonds& bonds, bool at_start, const RealVec& u,
            const RealVec& uc, const RealVec& xb, ContactPairs& pairs)
{
  pairs = ContactPairs();
  pairs.normal.assign(static_cast<size_t>(bonds.nbond) * m.dim, 0.0);
  pairs.gap.assign(bonds.nbond, 1e300);
  pairs.size.assign(bonds.nbond, 0.0);
  for (int first = 0, last; first < bonds.nbond; first = last) {       // bonds of a definition stand together
    for (last = first; last < bonds.nbond && bonds.def[last] == bonds.def[first]; ++last) {}
    if (bonds.field[first] == SIDE_CONTACT)
      search_pair(m, pts, bonds, first, last, at_start, u, uc, xb, pairs);
    else
      pairs.master.off.insert(pairs.master.off.end(), last - first,
                              static_cast<int>(pairs.master.item.size()));
  }
}

}  // namespace

void contact_search(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& u,
                    const RealVec& uc, const RealVec& xb, ContactPairs& pairs)
{
  search(m, pts, bonds, false, u, uc, xb, pairs);
}

void contact_search_start(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& u,
                          const RealVec& uc, const RealVec& xb, ContactPairs& pairs)
{
  search(m, pts, bonds, true, u, uc, xb, pairs);
}

// In motion the gap of a place that pushes goes on from where the step left it: what the measurement says
// otherwise comes from a face that has turned, from facets that are no smooth surface, or from another face
// that is met, and is no compression. A place that was open, or met no face, and now is behind one came in
// from the side; what it has moved out since does not come back.
void contact_initial(const Level& l, int dim, bool moves, Bonds& bonds, ContactPairs& pairs)
{
  for (int b = 0; b < bonds.nbond; ++b) {
    double &initial = bonds.initial_penetration[b], &gap = pairs.gap[b];
    const double was = l.slip[b * dim];
    if (!pairs.master.count(b)) initial = 0.0;
    else if (moves && was < 0.0) initial = gap - was;
    else if (moves && gap < std::min(initial, 0.0)) initial = gap;
    else initial = std::max(std::min(initial, 0.0), std::min(gap, 0.0));
    gap -= initial;
  }
}
