#include <algorithm>
#include <cmath>

#include "base/box_tree.h"
#include "base/comm.h"
#include "bond/bond.h"
#include "contact/contact.h"
#include "contact/contact_masters.h"
#include "contact/contact_scene.h"

namespace {

// the nearest face that p lies over, or else the nearest with p beside its rim, so that nodes on the edge of
// both surfaces stay in contact under small oscillations. Several faces if p is over an edge or a node where
// they meet at an angle.
//   in   near   indices of faces, ascending, whose boxes contain p within reach
void nearest(const std::vector<MasterFace>& face, const IntVec& near, const double* p, double reach,
             std::vector<Hit>& best)
{
  Projection kind = PROJ_NONE;
  best.clear();
  for (int i : near) {
    Hit hit;
    const Projection k = contact_meet(face[i], p, reach, hit);
    if (hit.beside && std::any_of(near.begin(), near.end(),
                                  [&](int j) { return j != i && contact_outside(hit, face[j], p); }))
      continue;
    contact_nearer(hit, k, kind, best);
  }
  contact_equal(best);
}

// the nearest face that a point p with contact pressure may keep
void nearest_held(const std::vector<MasterFace>& face, const IntVec& near, const double* p,
                  std::vector<Hit>& best)
{
  double least = 1e300;
  for (int i : near) {
    Hit hit;
    bool over;
    const double distance2 = contact_nearest(face[i], p, over, hit);
    if (distance2 >= least || !contact_hold(face[i], p, hit)) continue;
    least = distance2;
    best.assign(1, hit);
  }
}

// stores the contact of a bond: the mean of the faces                              (4.9)
void take_hits(const std::vector<Hit>& hits, int dim, double offset, int b, ContactPairs& pairs)
{
  const double share = 1.0 / static_cast<double>(hits.size());
  double n[3] = {0, 0, 0}, r[3] = {0, 0, 0};
  for (const Hit& hit : hits) {
    for (int i = 0; i < 3; ++i) {
      n[i] += share * hit.n[i];
      r[i] += share * hit.r[i];
    }
    for (int k = 0; k < hit.face->all; ++k) {
      pairs.master.item.push_back(hit.face->node[k]);
      pairs.master_w.push_back(share * hit.N[k]);
    }
  }
  const double norm = std::hypot(n[0], n[1], n[2]);
  double size = 1e300;
  for (const Hit& hit : hits) size = std::min(size, hit.face->size);
  ++pairs.near;
  pairs.gap[b]  = (n[0] * r[0] + n[1] * r[1] + n[2] * r[2]) / norm - offset;
  pairs.size[b] = size;
  pairs.rounding[b] = hits[0].face->rounding;
  for (int i = 0; i < dim; ++i) pairs.normal[b * dim + i] = n[i] / norm;
}

// The master surface of a pair: the faces of this rank; box and longest edge of all ranks
struct Masters {
  std::vector<MasterFace> face;
  BoundingBox box;
  double reach = 0.0;
};

// Both sides of each pair [bond]: boxes of the contact points, and masters. at_start: faces of t = 0, even if
// their elements have broken since. Collective with a divided model
void pair_sides(const Model& m, const Points& pts, const Bonds& bonds, bool at_start, const RealVec& u,
                const RealVec& uc, const RealVec& xb, std::vector<BoundingBox>& slave,
                std::vector<Masters>& master)
{
  slave.resize(m.bond.size());
  master.resize(m.bond.size());
  if (!model_has_pairs(m)) return;
  for (int b = 0; b < bonds.nbond; ++b)
    if (m.bond[bonds.def[b]].pair()) box_take(slave[bonds.def[b]], &xb[b * m.dim], m.dim);
  RealVec all;
  for (size_t d = 0; d < m.bond.size(); ++d) {
    Masters& s = master[d];
    if (!m.bond[d].pair()) continue;
    for (const SkinFace& f : surface_faces(m, pts, m.bond[d].contact.master, at_start))
      s.face.push_back(master_face(m, pts, f.points, {f.elem, f.face}, u, uc));
    for (const MasterFace& f : s.face) {
      s.reach = std::max(s.reach, f.size);
      box_take(s.box, f.lo, f.hi, m.dim);
    }
    for (const BoundingBox& box : {slave[d], s.box})
      for (int i = 0; i < 3; ++i) all.insert(all.end(), {-box.lo[i], box.hi[i]});
    all.push_back(s.reach);
  }
  if (!m.part.on) return;
  comm_max(all.data(), static_cast<long>(all.size()));
  const double* x = all.data();
  for (size_t d = 0; d < m.bond.size(); ++d) {
    if (!m.bond[d].pair()) continue;
    for (BoundingBox* box : {&slave[d], &master[d].box})
      for (int i = 0; i < 3; ++i) {
        box->lo[i] = -*x++;
        box->hi[i] = *x++;
      }
    master[d].reach = *x++;
  }
}

// Searches for bonds first ... last-1 of one definition, unless the boxes of the two surfaces do not overlap;
// returns true in that case. all: include contact points that other ranks own; given: the deck specifies the
// penalty; slip: gaps at the end of the last increment
bool search_pair(const Bonds& bonds, int dim, int first, int last, const BoundingBox& slave,
                 const Masters& master, bool all, bool given, const RealVec& xb, const RealVec& slip,
                 ContactPairs& pairs)
{
  std::vector<Hit> hits;
  std::vector<BoundingBox> box;
  IntVec near;
  BoundingBox around = master.box;
  box_grow(around, master.reach, dim);
  const bool apart = !boxes_meet(slave, around, dim);
  for (const MasterFace& f : master.face) {
    if (apart) break;
    box.emplace_back();
    for (int i = 0; i < 3; ++i) {
      box.back().lo[i] = f.lo[i] - master.reach;
      box.back().hi[i] = f.hi[i] + master.reach;
    }
  }
  const BoxTree tree(box);
  for (int b = first; b < last; ++b) {
    BoundingBox point = {{0, 0, 0}, {0, 0, 0}};
    for (double* x : {point.lo, point.hi}) std::copy_n(&xb[b * dim], dim, x);
    hits.clear();
    // zero area: a node without elements
    if (!apart && bonds.area[b] > 0.0 && (all || bonds.counts(b))) {
      near.clear();
      tree.overlap(point, near);
      std::sort(near.begin(), near.end());
      nearest(master.face, near, point.lo, master.reach, hits);
      if (hits.empty() && slip[b * dim] < 0.0) nearest_held(master.face, near, point.lo, hits);
    }
    if (!hits.empty()) {
      take_hits(hits, dim, bonds.contact.offset[b], b, pairs);
      pairs.deep[b] = given ? 0.0 : CONTACT_DEEP * pairs.size[b];
    }
    pairs.master.off.push_back(static_cast<int>(pairs.master.item.size()));
  }
  return apart;
}

// Faces oppose each other if the cosine of their normals is below this. A face perpendicular to another, as
// the side of a block on a floor, does not push on it  (test: contact/touch_statics.inp)
const double OPPOSED = -0.2;
// the same where one of the faces belongs to a single free point: no face of it points ahead at its corners.
// (test: contact/g5_debris)
const double OPPOSED_ALONE = 0.5;

// Relative to the size of a face: bounds of a face are wider by this much, for round-off, corners a little
// outside of the edges and the 1 % beside the rim at which a point is in contact (contact_meet): too small a
// value loses contacts, a larger one costs time only  (test: contact/g2_stack.inp)
const double BOUND_TOL = 0.03;
// tangent of the angle between normals of a face above which it has no bounds: time only  (no test)
const double MAX_TILT = 0.5;
// a point below a face meets it if it is beside it by at most this part of its depth (contact_meet)
const double BESIDE = 0.25;            // (no test)

// Present position of a face, and bounds of the points that meet it (contact_meet): heights over the plane
// through its centre, and planes through its edges (in the plane: its ends). None with nodes between corners
struct FaceNow {
  MasterFace f;                // n = 0: not computed yet
  double x[3], n[3];           // centre, unit normal
  double warp = 1e300;         // largest height of the face itself; 1e300: no bounds
  double tilt = 0.0;           // tangent of the largest angle between n and its normals
  // convex faces: outward unit normal of each edge in the plane of n, and its position
  double out[4][3] = {}, at[4] = {1e300, 1e300, 1e300, 1e300};
};

void cross(const double* a, const double* b, double* c)
{
  for (int i = 0; i < 3; ++i) c[i] = a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3];
}

double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// planes through the edges, or the ends; a corner outside of one of them: none
void take_edges(FaceNow& a)
{
  const int n = a.f.n;
  double out[4][3], at[4];
  for (int k = 0; k < n; ++k) {
    const double *p = a.f.x + 3 * k, *q = a.f.x + 3 * ((k + 1) % n);
    const double t[3] = {q[0] - p[0], q[1] - p[1], q[2] - p[2]},
                 r[3] = {a.x[0] - p[0], a.x[1] - p[1], a.x[2] - p[2]};
    double* o = out[k];
    if (n == 2) std::copy_n(t, 3, o);
    else cross(t, a.n, o);
    const double norm = std::copysign(std::sqrt(dot(o, o)), -dot(o, r));
    for (int i = 0; i < 3; ++i) o[i] /= norm;
    at[k] = dot(o, p);
    for (int c = 0; c < n; ++c)
      if (!(dot(o, a.f.x + 3 * c) - at[k] <= 0.01 * a.f.size)) return;
  }
  std::copy_n(out[0], 3 * n, a.out[0]);
  std::copy_n(at, n, a.at);
}

// x = m + a xi + b eta + h xi eta: the corners are n.h above and below the plane, and the normal is
// a x b + xi a x h + eta h x b; both are largest at corners
void take_bounds(FaceNow& a)
{
  if (a.f.all > a.f.n) return;
  double warp = 0.0;
  if (a.f.n == 4) {
    const double* x = a.f.x;
    double p[3], q[3], h[3], c[3], sum[3], difference[3];
    for (int i = 0; i < 3; ++i) {
      p[i] = 0.25 * (x[3 + i] + x[6 + i] - x[i] - x[9 + i]);
      q[i] = 0.25 * (x[6 + i] + x[9 + i] - x[i] - x[3 + i]);
      h[i] = 0.25 * (x[i] + x[6 + i] - x[3 + i] - x[9 + i]);
      sum[i] = p[i] + q[i];
      difference[i] = p[i] - q[i];
    }
    warp = std::fabs(dot(a.n, h));
    cross(p, q, c);
    double least = dot(c, a.n);
    cross(p, h, c);
    least -= std::fabs(dot(c, a.n));
    cross(h, q, c);
    least -= std::fabs(dot(c, a.n));
    const double tilt = 1.01 * warp * std::sqrt(std::max(dot(sum, sum), dot(difference, difference)));
    if (!(tilt < MAX_TILT * least)) return;
    a.tilt = tilt / least;
  }
  a.warp = warp;
  take_edges(a);
}

// Bounds of the points that meet face a within reach. Gap g of a point at height h:
// |g| (cos - BESIDE sin) <= |h| + warp
struct Bounds {
  double tol, flat, highest, lowest, most, factor, tilt;
  Bounds(const FaceNow& a, double reach) : tol(BOUND_TOL * a.f.size), flat(a.warp + tol), tilt(a.tilt)
  {
    const double deepest = a.f.deepest;
    highest = flat + reach;
    lowest  = -flat - (1.0 + BESIDE * tilt) * deepest;
    most    = std::max(reach, deepest);
    factor  = 1.0 / (1.0 - 0.5 * tilt * tilt - BESIDE * tilt);
  }
  // largest distance outside of an edge of a point between heights low and high (in find_heights too)
  double beside(double low, double high) const
  {
    const double g = std::min(most, (std::max(high, -low) + flat) * factor);
    return tol + g * tilt + (low <= flat ? BESIDE * g : 0.0);
  }
};

// are all points of face b out of the bounds of face a? They lie between its corners
bool all_out_of_range(const FaceNow& a, const MasterFace& b, double reach)
{
  if (a.warp == 1e300 || b.all > b.n) return false;
  double low = 1e300, high = -1e300;
  for (int c = 0; c < b.n; ++c) {
    const double *x = b.x + 3 * c, r[3] = {x[0] - a.x[0], x[1] - a.x[1], x[2] - a.x[2]}, h = dot(r, a.n);
    low  = std::min(low, h);
    high = std::max(high, h);
  }
  const Bounds bounds(a, reach);
  if (low > bounds.highest || high < bounds.lowest) return true;
  const double most = bounds.beside(low, high);
  for (int k = 0; k < 4; ++k) {
    double least = 1e300;
    for (int c = 0; c < b.n; ++c) least = std::min(least, dot(a.out[k], b.x + 3 * c) - a.at[k]);
    if (least > most) return true;
  }
  return false;
}

// what the test of two faces reads
struct FaceBox {
  double lo[3], hi[3], n[3], size = 0.0;     // 0: not computed yet
};

// A face that the points of another one may meet
struct Facing {
  int face;
  double reach;
};

// search of general contact
struct GeneralSearch {
  const Model& m;
  const Points& pts;
  const Bonds& bonds;
  const RealVec &u, &uc, &xb;
  const ContactScene& scene;
  std::vector<FaceNow> face;         // [skin]
  std::vector<FaceBox> box;          // [skin]
  std::vector<ContactWall> wall;
  // of the face whose points are searched for
  std::vector<Facing> facing, close;     // close: by their boxes
  RealVec x;                         // [3][width] their positions
  RealVec height;                    // [facing][width] heights over the face; 1e300: out of its bounds
  int width = 0;                     // number of points, rounded up
};

const FaceNow& face_now(GeneralSearch& g, int i)
{
  FaceNow& a = g.face[i];
  if (a.f.n) return a;
  const SkinFace& s = g.scene.skin[i];
  a.f = master_face(g.m, g.pts, s.points, {s.elem, s.face}, g.u, g.uc, &g.scene.height[i]);
  a.f.skin = i;
  face_middle(a.f, a.x, a.n);
  take_bounds(a);
  FaceBox& b = g.box[i];
  std::copy_n(a.f.lo, 3, b.lo);
  std::copy_n(a.f.hi, 3, b.hi);
  std::copy_n(a.n, 3, b.n);
  b.size = a.f.size;
  return a;
}

const FaceBox& box_now(GeneralSearch& g, int i)
{
  if (g.box[i].size == 0.0) face_now(g, i);
  return g.box[i];
}

// the faces that oppose face i and whose boxes are within reach
void find_facing(GeneralSearch& g, int i)
{
  g.facing.clear();
  if (g.scene.near.count(i) == 0) return;
  const FaceNow& of = face_now(g, i);
  const FaceBox a   = g.box[i];
  const int *near = g.scene.near.begin(i), count = g.scene.near.count(i);
  g.close.resize(count);
  int n = 0;
  for (int k = 0; k < count; ++k) {      // without branches, which would be mispredicted
    const int j = near[k];
    const FaceBox& b     = box_now(g, j);
    const double reach   = g.scene.part * (a.size + b.size) + g.scene.travel;
    const double opposed = g.scene.alone[i] | g.scene.alone[j] ? OPPOSED_ALONE : OPPOSED;
    bool apart = dot(a.n, b.n) > opposed;
    for (int c = 0; c < g.m.dim; ++c) apart |= (a.lo[c] > b.hi[c] + reach) | (b.lo[c] > a.hi[c] + reach);
    g.close[n] = {j, reach};
    n += !apart;
  }
  for (int k = 0; k < n; ++k)
    if (!all_out_of_range(g.face[g.close[k].face], of.f, g.close[k].reach)) g.facing.push_back(g.close[k]);
}

// heights of n points over face a, 1e300 out of its bounds; n: a multiple of PACK
//   in   x [3][n]
void find_heights(const FaceNow& a, double reach, int n, const double* x, double* height)
{
  const Bounds b(a, reach);
  const Pack zero = {}, far = zero + 1e300, most = zero + b.most;
  for (int q = 0; q < n; q += PACK) {
    const auto take = [&](int i) { return *reinterpret_cast<const PackRow*>(x + i * n + q); };
    const Pack x0 = take(0), x1 = take(1), x2 = take(2);
    const auto along = [&](const double* d) { return d[0] * x0 + d[1] * x1 + d[2] * x2; };
    const Pack h = along(a.n) - dot(a.n, a.x), size = h > zero ? h : -h, gap = (size + b.flat) * b.factor,
               g = gap < most ? gap : most, limit = b.tol + g * b.tilt + (h <= b.flat ? BESIDE * g : zero);
    Pack found = h > b.highest ? far : h < b.lowest ? far : h;
    for (int k = 0; k < 4; ++k) found = along(a.out[k]) - a.at[k] > limit ? far : found;
    *reinterpret_cast<PackRow*>(height + q) = found;
  }
}

// points first ... last-1, of face i
void open_face(GeneralSearch& g, int i, int first, int last)
{
  const int n = last - first, dim = g.m.dim, width = (n + PACK - 1) / PACK * PACK;
  find_facing(g, i);
  if (g.facing.empty()) return;
  g.x.assign(3 * static_cast<size_t>(width), 0.0);
  for (int q = 0; q < n; ++q)
    for (int c = 0; c < dim; ++c) g.x[c * width + q] = g.xb[(first + q) * dim + c];
  g.height.resize(g.facing.size() * width);
  g.width = width;
  for (size_t k = 0; k < g.facing.size(); ++k)
    find_heights(g.face[g.facing[k].face], g.facing[k].reach, width, g.x.data(), &g.height[k * width]);
}

// A point that pushes on a face and lies over it stays with it, even where another face is nearer: otherwise
// it would enter a small body through one side and leave it through another  (test: contact/g4_box)
bool stays(GeneralSearch& g, int i, int met, const double* p, double nearest, Hit& hit)
{
  const FaceNow& b   = face_now(g, met);
  const double reach = g.scene.part * (g.face[i].f.size + b.f.size) + g.scene.travel;
  return contact_meet(b.f, p, reach, hit) == PROJ_OVER && hit.gap < nearest - 1e-8 * b.f.size - b.f.rounding;
}

// a point of face i is below another face and beside its rim: is it in front of a neighbour of that face?
bool outside_corner(GeneralSearch& g, int i, const Hit& hit, const double* p)
{
  for (int k = g.scene.near.off[i]; k < g.scene.near.off[i + 1]; ++k) {
    const int j = g.scene.near.item[k];
    if (j != hit.face->skin && contact_outside(hit, face_now(g, j).f, p)) return true;
  }
  return false;
}

// A face whose |gap| exceeds that to a face that the point lies over is of no interest
bool is_farther(const FaceNow& a, double height, double gap)
{
  const double flat = a.warp + BOUND_TOL * a.f.size;
  return height > flat + gap || height < -flat - (1.0 + BESIDE * a.tilt) * gap;
}

// the face whose plane is nearest to the q-th point, -1: it is out of the bounds of all
int nearest_plane(const GeneralSearch& g, int q)
{
  double least = 1e300;
  int nearest  = -1;
  for (size_t k = 0; k < g.facing.size(); ++k) {
    const double height = std::fabs(g.height[k * g.width + q]);
    if (height >= least) continue;
    least   = height;
    nearest = static_cast<int>(k);
  }
  return nearest;
}

// faces that point b meets, the q-th of face i. The face of the nearest plane comes first, since others that
// are farther then need no projection; the result does not depend on this
void search_point(GeneralSearch& g, int b, int i, int q, std::vector<Hit>& hits)
{
  double p[3] = {0, 0, 0};
  Projection kind = PROJ_NONE;
  hits.clear();
  std::copy_n(&g.xb[b * g.m.dim], g.m.dim, p);
  double least = 1e300;        // |gap| to faces that p lies over
  const int first = nearest_plane(g, q);
  const auto meet = [&](int k) {
    Hit hit;
    const FaceNow& a = g.face[g.facing[k].face];
    if (is_farther(a, g.height[k * g.width + q], least)) return;
    const Projection found = contact_meet(a.f, p, g.facing[k].reach, hit);
    if (hit.beside && outside_corner(g, i, hit, p)) return;
    contact_nearer(hit, found, kind, hits);
    if (found == PROJ_OVER) least = std::min(least, std::fabs(hit.gap));
  };
  if (first >= 0) meet(first);
  for (int k = 0; k < static_cast<int>(g.facing.size()) && first >= 0; ++k)
    if (k != first && g.height[k * g.width + q] != 1e300) meet(k);
  std::sort(hits.begin(), hits.end(), [](const Hit& x, const Hit& y) { return x.face->skin < y.face->skin; });
  contact_equal(hits);
  const int met = g.bonds.contact.met[b];
  if (met < 0) return;
  Hit hit;
  if (hits.empty()) {
    if (contact_hold(face_now(g, met).f, p, hit)) hits.push_back(hit);
  } else if (std::any_of(g.facing.begin(), g.facing.end(), [&](const Facing& f) { return f.face == met; }) &&
             stays(g, i, met, p, hits[0].gap, hit)) {
    hits.assign(1, hit);
  }
}

// Contact point b of face i, of points off the grid, meets a wall if that is nearer than the face it met: a
// fixed face, with no share in the jump. A point that pushes on a wall stays with it when its face has turned
// away  (test: contact/g3_walls.inp)
void meet_wall(GeneralSearch& g, int b, int i, ContactPairs& pairs)
{
  const FaceNow& a = face_now(g, i);
  const size_t first = pairs.master.off.back();
  for (const ContactWall& w : g.wall) {
    const double gap = w.side * (g.xb[b * g.m.dim + w.axis] - w.at);
    const bool meets = pairs.master.item.size() > first;
    const bool pushes = g.bonds.contact.wall[b] == w.grid_bc;
    if (w.side * a.n[w.axis] > OPPOSED && !pushes) continue;
    if (gap > g.scene.part * a.f.size + g.scene.travel) continue;
    if (meets && gap > pairs.gap[b]) continue;
    if (!meets) ++pairs.near;
    pairs.master.item.resize(first);
    pairs.master_w.resize(first);
    pairs.master.item.push_back(*g.bonds.a.begin(b));
    pairs.master_w.push_back(0.0);
    pairs.gap[b]  = gap;
    pairs.size[b] = a.f.size;
    pairs.rounding[b] = a.f.rounding;
    pairs.deep[b] = g.m.bond[g.bonds.def[b]].penalty > 0.0 ? 0.0 : CONTACT_DEEP * a.f.size;
    std::fill_n(&pairs.normal[b * g.m.dim], g.m.dim, 0.0);
    pairs.normal[b * g.m.dim + w.axis] = w.side;
    pairs.face[b]     = -1;
    pairs.wall[b]     = w.grid_bc;
    pairs.penalty[b]  = g.bonds.contact.skin_penalty[i];
    pairs.friction[b] = w.sticks ? g.m.bond[g.bonds.def[b]].contact.friction : 0.0;
    pairs.stick[b]    = g.m.bond[g.bonds.def[b]].contact.stick;
  }
}

// stores the faces that contact point b of face i meets
void take_general(const GeneralSearch& g, int b, int i, const std::vector<Hit>& hits, ContactPairs& pairs)
{
  const RealVec& alone = g.bonds.contact.skin_penalty;
  const BondDef& d = g.m.bond[g.bonds.def[b]];
  const int j      = hits[0].face->skin;
  const ContactRule* r = scene_property(d, g.scene, i, j);
  take_hits(hits, g.m.dim, g.bonds.contact.offset[b], b, pairs);
  pairs.face[b]     = j;
  pairs.deep[b]     = d.penalty > 0.0 || (r && r->penalty > 0.0) ? 0.0 : CONTACT_DEEP * pairs.size[b];
  pairs.penalty[b]  = r && r->penalty > 0.0 ? r->penalty : std::min(alone[i], alone[j]);
  pairs.friction[b] = r ? r->friction : d.contact.friction;
  pairs.stick[b]    = r && r->stick > 0.0 ? r->stick : d.contact.stick;
}

void search_general(GeneralSearch& g, int first, int last, ContactPairs& pairs)
{
  const ContactState& c = g.bonds.contact;
  std::vector<Hit> hits;
  g.face.resize(g.scene.skin.size());
  g.box.resize(g.scene.skin.size());
  for (RealVec* v : {&pairs.penalty, &pairs.friction, &pairs.stick}) v->assign(g.bonds.nbond, 0.0);
  pairs.face.assign(g.bonds.nbond, -1);
  pairs.wall.assign(g.bonds.nbond, -1);
  for (int open = first, end; open < last; open = end) {       // points of a face
    const int i = c.skin_of[open];
    for (end = open; end < last && c.skin_of[end] == i; ++end) {}
    open_face(g, i, open, end);
    for (int b = open; b < end; ++b) {
      hits.clear();
      if (!g.facing.empty() || c.met[b] >= 0) search_point(g, b, i, b - open, hits);
      if (!hits.empty()) take_general(g, b, i, hits, pairs);
      if (g.scene.skin[i].points == 2) meet_wall(g, b, i, pairs);
      pairs.master.off.push_back(static_cast<int>(pairs.master.item.size()));
    }
  }
}

// Number of pairs searched and skipped, and of points that meet a face: maximum over the ranks
//   state   [bond] 0: no contact points here, 1: the boxes do not overlap, 2: searched
void count_searches(const Model& m, RealVec state, ContactPairs& pairs)
{
  if (m.part.on) {
    state.push_back(pairs.near);
    comm_max(state.data(), static_cast<long>(state.size()));
    pairs.near = static_cast<int>(state.back());
    state.pop_back();
  }
  pairs.skipped  = std::count(state.begin(), state.end(), 1.0);
  pairs.searched = std::count(state.begin(), state.end(), 2.0);
}

// no bond meets a face; in the memory of the last search
void clear_pairs(int nbond, int dim, ContactPairs& p)
{
  p.master.off.assign(1, 0);
  p.master.off.reserve(static_cast<size_t>(nbond) + 1);
  for (IntVec* v : {&p.master.item, &p.face, &p.wall}) v->clear();
  for (RealVec* v : {&p.master_w, &p.penalty, &p.friction, &p.stick}) v->clear();
  p.normal.assign(static_cast<size_t>(nbond) * dim, 0.0);
  p.gap.assign(nbond, 1e300);
  for (RealVec* v : {&p.size, &p.rounding, &p.deep}) v->assign(nbond, 0.0);
  p.near = p.searched = p.skipped = 0;
}

// scene: null: without general contact, contact points are not counted, and those
// of other ranks are searched too. Collective
void search(const Model& m, const Points& pts, const Bonds& bonds, bool at_start, const RealVec& u,
            const RealVec& uc, const RealVec& slip, const RealVec& xb, const ContactScene* scene,
            ContactPairs& pairs)
{
  clear_pairs(bonds.nbond, m.dim, pairs);
  RealVec state(m.bond.size(), 0.0);
  const int all = model_general_contact(m);
  if (all >= 0 && scene) state[all] = scene->near.item.empty() ? 1.0 : 2.0;
  std::vector<BoundingBox> slave;
  std::vector<Masters> master;
  pair_sides(m, pts, bonds, at_start, u, uc, xb, slave, master);
  for (int first = 0, last; first < bonds.nbond; first = last) {       // bonds are sorted by definition
    for (last = first; last < bonds.nbond && bonds.def[last] == bonds.def[first]; ++last) {}
    const bool general = !bonds.contact.skin.empty() && bonds.contact.skin_of[first] >= 0;
    if (general && scene) {
      GeneralSearch g{m, pts, bonds, u, uc, xb, *scene, {}, {}, contact_walls(m), {}, {}, {}, {}, 0};
      search_general(g, first, last, pairs);
    } else if (!general && bonds.side[first] == SIDE_CONTACT) {
      const int d      = bonds.def[first];
      const bool apart = search_pair(bonds, m.dim, first, last, slave[d], master[d], !scene,
                                     m.bond[d].penalty > 0.0, xb, slip, pairs);
      double& s = state[d];
      s = std::max(s, apart ? 1.0 : 2.0);
    } else {
      pairs.master.off.insert(pairs.master.off.end(), last - first,
                              static_cast<int>(pairs.master.item.size()));
    }
  }
  if (scene) count_searches(m, state, pairs);
}

}  // namespace

void contact_search(const Model& m, const Points& pts, const Bonds& bonds, const Level& l,
                    const RealVec& xb, const ContactScene& scene, ContactPairs& pairs)
{
  search(m, pts, bonds, false, l.u, l.uc, l.slip, xb, &scene, pairs);
}

void contact_search_start(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& u,
                          const RealVec& uc, const RealVec& xb, ContactPairs& pairs)
{
  const RealVec open(static_cast<size_t>(bonds.nbond) * m.dim, 0.0);
  search(m, pts, bonds, true, u, uc, open, xb, nullptr, pairs);
}

void contact_forget(const Bonds& bonds, const ContactPairs& pairs, int dim, Level& l)
{
  for (int b = 0; b < bonds.nbond; ++b) {
    if (contact_acts(bonds, pairs, b) || l.slip[b * dim] == CONTACT_OPEN) continue;
    l.slip[b * dim] = CONTACT_OPEN;
    l.lambda_n[b]   = 0.0;
    std::fill_n(&l.lambda[b * dim], dim, 0.0);
  }
}

// A point that pushes keeps its stiffness: a change would change its energy. Friction stores no energy, and
// its coefficient is that of the face on which the point slides
void contact_stiffness(const Level& l, int dim, bool moves, const ContactPairs& pairs, Bonds& bonds)
{
  for (int b = 0; b < bonds.nbond; ++b) {
    if (!pairs.master.count(b)) continue;
    const bool general = !bonds.contact.skin.empty() && bonds.contact.skin_of[b] >= 0;
    if (general) bonds.contact.friction[b] = pairs.friction[b];
    if (l.slip[b * dim] < 0.0) continue;
    bonds.contact.deep[b] = moves ? pairs.deep[b] : 0.0;
    if (!general) continue;
    bonds.cn[b] = pairs.penalty[b] * bonds.area[b];
    bonds.ct[b] = pairs.stick[b] > 0.0 ? pairs.stick[b] * bonds.area[b] : bonds.cn[b];
  }
}

// In dynamics the gap of a point that pushes continues from the end of the last increment: a different
// measured gap is due to a rotated face, to the facets of a curved surface, or to another face, and is no
// compression. A point that was open or met no face, and is now below one, came in from the side; its initial
// penetration only decreases as it moves out.
void contact_initial(const Level& l, int dim, bool moves, Bonds& bonds, ContactPairs& pairs)
{
  for (int b = 0; b < bonds.nbond; ++b) {
    double &initial = bonds.contact.initial_penetration[b], &gap = pairs.gap[b];
    if (!pairs.master.count(b)) {
      initial = 0.0;
      continue;
    }
    const double was = l.slip[b * dim];
    if (moves && was < 0.0) initial = gap - was;
    else if (moves && gap < std::min(initial, 0.0)) initial = gap;
    else initial = std::max(std::min(initial, 0.0), std::min(gap, 0.0));
    gap -= initial;
  }
}
