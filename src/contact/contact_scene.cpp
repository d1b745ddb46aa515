#include "contact/contact_scene.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "base/comm.h"
#include "base/forest.h"
#include "contact/contact.h"
#include "contact/contact_near.h"
#include "model/model_cut.h"
#include "shape/face.h"

namespace {

// Search range in an increment of statics, relative to the size of each of two faces
// (test: contact/g1_compare)
const double REACH_STATIC = 0.5;
// the same in dynamics, in addition to the motion in the increment  (test: contact/g2_explicit.inp)
const double REACH_MOTION = 0.125;
// relative to the mean size of faces: lists of near faces hold for half of this motion: time only  (no test)
const double SCENE_MARGIN = 0.25;
// relative to the size of a face: a face at least this far below it at t = 0, and at most BACK_REACH sizes
// away, is the back of its own body (theory 4.3)  (no test)
const double BACK       = 1e-6;
const double BACK_REACH = 2.0;
// ContactScene::body of points of the deck: added to their grid field  (no test)
const int OF_GRID = std::numeric_limits<int>::min();

// parts of the mesh at t = 0 that share nodes, by node. Collective with a divided model.
IntVec parts_of_mesh(const Mesh& mesh, const MeshPart& part)
{
  Forest parts(mesh.nnode());
  for (int e = 0; e < mesh.nelem(); ++e)
    for (int k = mesh.conn.off[e] + 1; k < mesh.conn.off[e + 1]; ++k)
      parts.join(mesh.conn.item[k], mesh.conn.item[mesh.conn.off[e]]);
  IntVec root(mesh.nnode());
  for (int n = 0; n < mesh.nnode(); ++n) root[n] = parts.root(n);
  if (part.on) model_join_ranks(part, PointPart(), Halo(), root);
  return root;
}

// grid field of the corners of a face that are on the grid, -1: there are none
int grid_field(const Points& pts, const SkinFace& f)
{
  if (!f.points) return -1;
  const ShapeInfo& info = shape_info[pts.shape[f.elem]];
  for (int k = 0; k < info.nfnode[f.face]; ++k) {
    const int c = pts.conn.begin(f.elem)[info.face[f.face][k]];
    if (pts.carrier(c) == HANG_GRID) return pts.field[c];
  }
  return -1;
}

// faces of a side of a rule that is a surface, ascending
struct SideFaces {
  std::vector<std::pair<int, int>> mesh, points;     // element or point, its face
};

std::vector<std::pair<int, int>> sorted_faces(const std::vector<Face>& face)
{
  std::vector<std::pair<int, int>> out;
  for (const Face& f : face) out.push_back({f.elem, f.face});
  std::sort(out.begin(), out.end());
  return out;
}

SideFaces side_faces(const Model& m, const Points& pts, const ContactSide& side)
{
  if (side.surface < 0) return {};
  return {sorted_faces(m.surface[side.surface].face), sorted_faces(pts.surface[side.surface])};
}

bool on_side(const Model& m, const Points& pts, const SkinFace& f, const ContactSide& side,
             const SideFaces& faces)
{
  const int element = f.element(pts);
  if (side.elset >= 0) {
    const IntVec& set = m.part.on ? side.elem : m.elset[side.elset].item;
    return element >= 0 && std::binary_search(set.begin(), set.end(), element);
  }
  if (side.body >= 0) return f.points && pts.body[f.elem] == side.body;
  if (side.surface < 0) return true;
  const auto& list = f.points ? faces.points : faces.mesh;
  return std::binary_search(list.begin(), list.end(), std::make_pair(f.elem, f.face));
}

using RuleList = std::vector<ContactRule>;

// calls use(list, rule, bit of its side a, bit of its side b)
template <class Use>
void each_rule(const BondDef& d, Use use)
{
  int bit = 0;
  for (const std::vector<ContactRule>* list : {&d.contact.include, &d.contact.exclude, &d.contact.property})
    for (const ContactRule& r : *list) {
      use(*list, r, SideBits(1) << bit, SideBits(1) << (bit + 1));
      bit += 2;
    }
}

bool fits(SideBits a, SideBits b, SideBits x, SideBits y)
{
  return ((x & a) && (y & b)) || ((x & b) && (y & a));
}

bool allowed(const BondDef& d, SideBits x, SideBits y)
{
  bool in = false, out = false;
  each_rule(d, [&](const RuleList& list, const ContactRule&, SideBits a, SideBits b) {
    if (&list == &d.contact.include) in = in || fits(a, b, x, y);
    if (&list == &d.contact.exclude) out = out || fits(a, b, x, y);
  });
  return in && !out;
}

// [now] index of each face in the faces before, -1: new; both ascending, those of elements first
IntVec faces_before(const std::vector<SkinFace>& before, const std::vector<SkinFace>& now)
{
  const auto order = [](const SkinFace& f) { return std::make_tuple(f.points > 0, f.elem, f.face); };
  IntVec from(now.size(), -1);
  size_t k = 0;
  for (size_t i = 0; i < now.size(); ++i) {
    while (k < before.size() && order(before[k]) < order(now[i])) ++k;
    if (k < before.size() && before[k] == now[i]) from[i] = static_cast<int>(k);
  }
  return from;
}

// position of face i at t = 0
void take_start(const Model& m, const Points& pts, const SkinFace& f, ContactScene& s)
{
  const MasterFace at_start = face_at_start(m, pts, f.points, {f.elem, f.face});
  double X[3], n[3];
  face_middle(at_start, X, n);
  s.X.insert(s.X.end(), X, X + 3);
  s.normal.insert(s.normal.end(), n, n + 3);
  s.size.push_back(at_start.size);
  s.height.push_back(face_height(m, pts, f.points, f.elem, at_start));
}

// the same as that of face k before
void copy_start(const ContactScene& before, int k, ContactScene& s)
{
  const auto at = static_cast<long>(3) * k;
  s.X.insert(s.X.end(), before.X.begin() + at, before.X.begin() + at + 3);
  s.normal.insert(s.normal.end(), before.normal.begin() + at, before.normal.begin() + at + 3);
  s.size.push_back(before.size[k]);
  s.height.push_back(before.height[k]);
}

// the data of the faces that do not depend on their motion
//   in   before, from   faces_before
void describe(const Model& m, const Points& pts, const Bonds& bonds, const ContactScene& before,
              const IntVec& from, ContactScene& s)
{
  const BondDef& d = m.bond[model_general_contact(m)];
  std::vector<SideFaces> side;           // two a rule
  each_rule(d, [&](const RuleList&, const ContactRule& r, SideBits, SideBits) {
    side.push_back(side_faces(m, pts, r.a));
    side.push_back(side_faces(m, pts, r.b));
  });
  s.skin = bonds.contact.skin;
  IntVec outer(pts.npoint, 0);           // faces of a point in the skin
  for (const SkinFace& f : s.skin)
    if (f.points) ++outer[f.elem];
  for (size_t i = 0; i < s.skin.size(); ++i) {
    const SkinFace& f = s.skin[i];
    const int element = f.element(pts);
    s.field.push_back(grid_field(pts, f));
    if (f.points && pts.released[f.elem]) s.body.push_back(-1 - f.elem);       // a body by itself
    else if (element >= 0) s.body.push_back(s.part_of_node[m.mesh.conn.begin(element)[0]]);
    else s.body.push_back(OF_GRID + m.body[pts.body[f.elem]].field);
    s.alone.push_back(f.points && outer[f.elem] == shape_info[pts.shape[f.elem]].nface);
    SideBits sides = 0;
    auto faces = side.begin();
    each_rule(d, [&](const RuleList&, const ContactRule& r, SideBits a, SideBits b) {
      if (on_side(m, pts, f, r.a, *faces++)) sides |= a;
      if (on_side(m, pts, f, r.b, *faces++)) sides |= b;
    });
    s.sides.push_back(sides);
    if (from[i] < 0) take_start(m, pts, f, s);
    else copy_start(before, from[i], s);
  }
}

// was a close behind b at t = 0: the two sides of a thin part
bool back_of(const ContactScene& s, int a, int b)
{
  const double *x = &s.X[3 * a], *y = &s.X[3 * b], *n = &s.normal[3 * b];
  const double r[3] = {x[0] - y[0], x[1] - y[1], x[2] - y[2]};
  if (std::hypot(r[0], r[1], r[2]) > BACK_REACH * std::max(s.size[a], s.size[b])) return false;
  return n[0] * r[0] + n[1] * r[1] + n[2] * r[2] < -BACK * s.size[b];
}

bool may_meet(const BondDef& d, const ContactScene& s, int a, int b)
{
  if (a == b || (s.field[a] >= 0 && s.field[a] == s.field[b])) return false;
  if (!allowed(d, s.sides[a], s.sides[b])) return false;
  return s.body[a] != s.body[b] || !back_of(s, a, b);
}

}  // namespace

double contact_largest_way(int dim, const RealVec& a, const RealVec& b)
{
  double largest = 0.0;
  for (size_t k = 0; k < a.size(); k += dim) {
    double way = 0.0;
    for (int i = 0; i < dim; ++i) way += (a[k + i] - b[k + i]) * (a[k + i] - b[k + i]);
    largest = std::max(largest, way);
  }
  return std::sqrt(largest);
}

namespace {

double mean_of(const RealVec& size)
{
  double mean = 0.0;
  for (double s : size) mean += s / static_cast<double>(size.size());
  return mean;
}

// face i at the displacements of the lists, enlarged by half of the search range
BoundingBox reach_of(const Model& m, const Points& pts, const ContactScene& s, int i)
{
  const SkinFace& k  = s.skin[i];
  const MasterFace f = master_face(m, pts, k.points, {k.elem, k.face}, s.u, s.uc, &s.height[i]);
  BoundingBox box;
  box_take(box, f.lo, f.hi);
  box_grow(box, s.part * f.size + 0.5 * (s.max_travel + s.margin));
  return box;
}

// Faces that follow each other in the skin are mostly close: they search the tree together, up to GROUP of
// them while their box is not larger than SPREAD of the first one: time only  (no test)
const int GROUP     = 8;
const double SPREAD = 2.0;

// the box of the faces from i to end - 1
BoundingBox box_of_group(const ContactScene& s, int i, int& end)
{
  const BoundingBox& one = s.box[i];
  BoundingBox all = one;
  for (end = i + 1; end < static_cast<int>(s.box.size()) && end < i + GROUP; ++end) {
    BoundingBox more = all;
    bool close = true;
    box_take(more, s.box[end].lo, s.box[end].hi);
    for (int k = 0; k < 3; ++k) close = close && more.hi[k] - more.lo[k] <= SPREAD * (one.hi[k] - one.lo[k]);
    if (!close) break;
    all = more;
  }
  return all;
}

void find_near(const Model& m, const Points& pts, const RealVec& u, const RealVec& uc, ContactScene& s)
{
  const BondDef& d = m.bond[model_general_contact(m)];
  const int n = static_cast<int>(s.skin.size());
  s.margin = SCENE_MARGIN * mean_of(s.size);
  s.u  = u;
  s.uc = uc;
  s.box.clear();
  for (int i = 0; i < n; ++i) s.box.push_back(reach_of(m, pts, s, i));
  const BoxTree tree(s.box);
  s.near = ListTable();
  IntVec found;
  for (int i = 0, end; i < n; i = end) {
    found.clear();
    tree.overlap(box_of_group(s, i, end), found);
    std::sort(found.begin(), found.end());
    for (int k = i; k < end; ++k) {
      for (int j : found)
        if (boxes_meet(s.box[k], s.box[j]) && may_meet(d, s, k, j)) s.near.item.push_back(j);
      s.near.off.push_back(static_cast<int>(s.near.item.size()));
    }
  }
  ++s.built;
}

// Pairs of new faces with all others that may meet; the first of a pair: the face with the list
std::vector<std::pair<int, int>> pairs_of_new(const BondDef& d, const IntVec& from, const ContactScene& s)
{
  std::vector<std::pair<int, int>> pair;
  std::vector<BoundingBox> box;
  IntVec fresh, found;
  for (size_t i = 0; i < from.size(); ++i) {
    if (from[i] >= 0) continue;
    fresh.push_back(static_cast<int>(i));
    box.push_back(s.box[i]);
  }
  const BoxTree tree(box);
  for (int i = 0; i < static_cast<int>(from.size()); ++i) {
    found.clear();
    tree.overlap(s.box[i], found);
    for (int k : found) {
      const int j = fresh[k];
      if (may_meet(d, s, i, j)) pair.emplace_back(i, j);
      if (from[i] >= 0 && may_meet(d, s, j, i)) pair.emplace_back(j, i);
    }
  }
  std::sort(pair.begin(), pair.end());
  return pair;
}

// near where faces were added or removed, at the displacements of the lists
//   in   before, from   faces_before
void renew_near(const Model& m, const Points& pts, const RealVec& uc, const ContactScene& before,
                const IntVec& from, ContactScene& s)
{
  const int n = static_cast<int>(s.skin.size());
  s.uc.insert(s.uc.end(), uc.begin() + static_cast<long>(s.uc.size()), uc.end());
  IntVec now(before.skin.size(), -1);
  for (int i = 0; i < n; ++i) {
    if (from[i] >= 0) now[from[i]] = i;
    s.box.push_back(from[i] >= 0 ? before.box[from[i]] : reach_of(m, pts, s, i));
  }
  const std::vector<std::pair<int, int>> pair = pairs_of_new(m.bond[model_general_contact(m)], from, s);
  auto next = pair.begin();
  s.near.item.reserve(before.near.item.size() + pair.size());
  for (int i = 0; i < n; ++i) {
    const auto first = static_cast<long>(s.near.item.size());
    for (int k = 0; from[i] >= 0 && k < before.near.count(from[i]); ++k)
      if (now[before.near.begin(from[i])[k]] >= 0) s.near.item.push_back(now[before.near.begin(from[i])[k]]);
    const auto middle = static_cast<long>(s.near.item.size());
    for (; next != pair.end() && next->first == i; ++next) s.near.item.push_back(next->second);
    std::inplace_merge(s.near.item.begin() + first, s.near.item.begin() + middle, s.near.item.end());
    s.near.off.push_back(static_cast<int>(s.near.item.size()));
  }
  ++s.built;
}

// nodes and corners of the faces
void take_nodes(const Model& m, const Points& pts, ContactScene& s)
{
  std::vector<char> node(m.mesh.nnode(), 0), corner(pts.ncorner, 0);
  for (const SkinFace& f : s.skin) {
    const ShapeInfo& info =
        shape_info[f.points ? pts.shape[f.elem] : elem_table[m.mesh.elem_type[f.elem]].shape];
    const int* conn = f.points ? pts.conn.begin(f.elem) : m.mesh.conn.begin(f.elem);
    for (int k = 0; k < info.nfnode[f.face]; ++k) (f.points ? corner : node)[conn[info.face[f.face][k]]] = 1;
  }
  for (size_t n = 0; n < node.size(); ++n)
    if (node[n]) s.node.push_back(static_cast<int>(n));
  for (size_t c = 0; c < corner.size(); ++c)
    if (corner[c]) s.corner.push_back(static_cast<int>(c));
}

// largest distance between positions a and b of the items of a list, those that a has
double way_of(int dim, const IntVec& list, const RealVec& a, const RealVec& b)
{
  double largest = 0.0;
  for (int n : list) {
    double way = 0.0;
    if (static_cast<size_t>(n) * dim >= a.size()) break;
    for (int k = n * dim; k < (n + 1) * dim; ++k) way += (a[k] - b[k]) * (a[k] - b[k]);
    largest = std::max(largest, way);
  }
  return std::sqrt(largest);
}

// the faces have changed. Returns index of each in the faces before whose list of near faces holds, -1: new
//   in   keeps   faces with equal numbers are the same
IntVec take_faces(const Model& m, const Points& pts, const Bonds& bonds, bool keeps, ContactScene& before,
                  ContactScene& s)
{
  std::swap(before, s);
  s.part_of_node.swap(before.part_of_node);
  s.u.swap(before.u);
  s.uc.swap(before.uc);
  s.margin     = before.margin;
  s.part       = before.part;
  s.max_travel = before.max_travel;
  s.built      = before.built;
  IntVec from(bonds.contact.skin.size(), -1);
  if (keeps) from = faces_before(before.skin, bonds.contact.skin);
  describe(m, pts, bonds, before, from, s);
  take_nodes(m, pts, s);
  for (size_t i = 0; i < from.size(); ++i) {         // pairs of bodies and rules
    const int k = from[i];
    const bool meets = k >= 0 && s.field[i] == before.field[k] && s.body[i] == before.body[k] &&
                       s.sides[i] == before.sides[k];
    if (!meets) from[i] = -1;
  }
  return from;
}

}  // namespace

NearReach near_reach(bool is_static, double travel, const RealVec& size)
{
  return {is_static ? REACH_STATIC : REACH_MOTION, 1.5 * travel, SCENE_MARGIN * mean_of(size)};
}

void scene_update(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& u, const RealVec& uc,
                  bool is_static, double travel, ContactScene& s)
{
  if (model_general_contact(m) < 0) return;
  const double part = is_static ? REACH_STATIC : REACH_MOTION;
  if (s.part_of_node.empty()) s.part_of_node = parts_of_mesh(m.mesh, m.part);
  // the conversion of elements inside a body adds corners, but does not change the skin
  const bool same = s.skin == bonds.contact.skin && s.uc.size() == uc.size() && s.built > 0;
  const bool keeps = !m.part.on && !s.skin.empty() && s.u.size() == u.size() && s.uc.size() <= uc.size();
  ContactScene before;
  IntVec from;
  if (!same) from = take_faces(m, pts, bonds, keeps, before, s);
  const bool reaches = part == s.part && travel <= s.max_travel;
  s.part   = part;
  s.travel = travel;
  if (reaches && (same || keeps) &&
      2.0 * std::max(way_of(m.dim, s.node, s.u, u), way_of(m.dim, s.corner, s.uc, uc)) < s.margin) {
    if (!same) renew_near(m, pts, uc, before, from, s);
    return;
  }
  s.max_travel = 1.5 * travel; // margin for growing increments
  find_near(m, pts, u, uc, s);
}

void scene_forget(ContactScene& s)
{
  s.skin.clear();
  s.box.clear();
}

double scene_reach(const MeshPart& part, const ContactScene& s)
{
  double least = 1e300;
  for (double size : s.size) least = std::min(least, size);
  if (part.window) least = -comm_allreduce_max(-least);
  return least == 1e300 ? 0.0 : 2.0 * s.part * least + s.travel;
}

const ContactRule* scene_property(const BondDef& d, const ContactScene& s, int a, int b)
{
  const ContactRule* last = nullptr;
  each_rule(d, [&](const RuleList& list, const ContactRule& r, SideBits x, SideBits y) {
    if (&list == &d.contact.property && fits(x, y, s.sides[a], s.sides[b])) last = &r;
  });
  return last;
}
