#include "contact/contact_masters.h"

#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "base/gather_lists.h"
#include "base/sort_once.h"
#include "bond/bond.h"
#include "contact/contact_meet.h"
#include "point/point.h"

namespace {

// Fraction of the reach of a pair by which master faces and contact points may move before the test of
// masters_known is repeated: time only, as the search range includes it  (no test)
const double MARGIN = 0.25;

// Longest edge of the master faces of each pair, of all ranks: the search range of its contact points.
// Collective with a divided model
RealVec reaches(const Model& m, const Points& pts, const RealVec& u, const RealVec& uc, bool at_start)
{
  RealVec reach(m.bond.size(), 0.0);
  for (size_t d = 0; d < m.bond.size(); ++d) {
    if (!m.bond[d].pair()) continue;
    for (const SkinFace& f : surface_faces(m, pts, m.bond[d].contact.master, at_start))
      reach[d] = std::max(reach[d], master_face(m, pts, f.points, {f.elem, f.face}, u, uc).size);
  }
  if (m.part.on) comm_max(reach.data(), static_cast<long>(reach.size()));
  return reach;
}

// Side A on a body: each point of this rank with a corner on it, with the box of the faces at its corners
// there: the contact point at a corner may belong to the rank of any point around
void add_points(const Model& m, const Points& pts, const RealVec& u, const RealVec& uc, int def,
                std::vector<NearFace>& out)
{
  std::vector<MasterFace> face;
  for (const Face& f : pts.surface[m.bond[def].surface])
    face.push_back(master_face(m, pts, 1, {f.elem, f.face}, u, uc));
  const ListTable at = gather_lists(pts.ncorner, [&](auto use) {
    for (size_t i = 0; i < face.size(); ++i)
      for (int k = 0; k < face[i].n; ++k) use(face[i].node[k] - m.mesh.nnode(), static_cast<int>(i));
  });
  for (int q = 0; q < pts.npoint; ++q) {
    if (!point_counts(m, pts, q)) continue;
    NearFace p = {-1, 0.0, {}, def, NEAR_SLAVE};
    p.point = pts.point_number(q);
    for (int k = pts.conn.off[q]; k < pts.conn.off[q + 1]; ++k)
      for (const int* i = at.begin(pts.conn.item[k]); i != at.begin(pts.conn.item[k] + 1); ++i) {
        p.size = std::max(p.size, face[*i].size);
        box_take(p.box, face[*i].lo, face[*i].hi);
      }
    if (p.size > 0.0) out.push_back(p);
  }
}

void add_side(const Model& m, const Points& pts, const RealVec& u, const RealVec& uc, bool at_start, int def,
              NearSide side, const NearReach& reach, std::vector<NearFace>& out)
{
  std::vector<SkinFace> own;
  const BondDef& d = m.bond[def];
  for (const SkinFace& f : surface_faces(m, pts, side == NEAR_SLAVE ? d.surface : d.contact.master, at_start))
    if (point_skin_counts(m, pts, f)) own.push_back(f);
  for (NearFace f : near_faces(m, pts, own, u, uc, reach)) {
    f.def  = def;
    f.side = side;
    out.push_back(f);
  }
}

// nodes and corners of master faces and contact points of this rank, each once
IntVec moving(const Model& m, const Points& pts, const Bonds& bonds, const std::vector<char>& own)
{
  IntVec node;
  for (const BondDef& d : m.bond) {
    if (!d.pair()) continue;
    for (const SkinFace& f : surface_faces(m, pts, d.contact.master, false)) {
      if (!point_skin_counts(m, pts, f)) continue;
      const MasterFace at = face_at_start(m, pts, f.points, {f.elem, f.face});
      node.insert(node.end(), at.node, at.node + at.all);
    }
  }
  for (int b = 0; b < bonds.nbond; ++b)
    if (own[b]) node.insert(node.end(), bonds.a.begin(b), bonds.a.begin(b + 1));
  sort_once(node);
  return node;
}

// calls use(k, u) for the displacement components k of node (corner c: nnode + c)
template <class Use>
void each_motion(const IntVec& node, int nnode, int dim, const RealVec& u, const RealVec& uc, Use use)
{
  for (size_t k = 0; k < node.size(); ++k)
    for (int i = 0; i < dim; ++i)
      use(k * dim + i, node[k] < nnode ? u[node[k] * dim + i] : uc[(node[k] - nnode) * dim + i]);
}

// [nbond] contact points of pairs at nodes or corners of this rank
std::vector<char> own_points(const Model& m, const Points& pts, const Bonds& bonds)
{
  const std::vector<char> own = bond_own(m, pts);
  std::vector<char> out;
  for (int b = 0; b < bonds.nbond; ++b)
    out.push_back(m.bond[bonds.def[b]].pair() &&
                  std::any_of(bonds.a.begin(b), bonds.a.begin(b + 1), [&](int k) { return own[k] != 0; }));
  return out;
}

std::vector<NearFace> points_here(int dim, const Bonds& bonds, const RealVec& xb,
                                  const std::vector<char>& own)
{
  std::vector<NearFace> out;
  for (int b = 0; b < bonds.nbond; ++b) {
    if (!own[b]) continue;
    NearFace p = {-1, 0.0, {{0, 0, 0}, {0, 0, 0}}, bonds.def[b], NEAR_SLAVE};
    for (double* x : {p.box.lo, p.box.hi}) std::copy_n(&xb[b * dim], dim, x);
    out.push_back(p);
  }
  return out;
}

}  // namespace

std::vector<SkinFace> surface_faces(const Model& m, const Points& pts, int surface, bool at_start)
{
  std::vector<SkinFace> out;
  const Surface& s = m.surface[surface];
  for (const Face& f : s.face)
    if (at_start || !pts.converted(f.elem)) out.push_back({f.elem, f.face, 0});
  if ((at_start && s.body < 0) || pts.surface.empty()) return out;
  for (const Face& f : pts.surface[surface]) out.push_back({f.elem, f.face, 1});
  return out;
}

std::vector<NearFace> masters_and_slaves(const Model& m, const Points& pts, const RealVec& u,
                                         const RealVec& uc, bool adjusted, double* margin)
{
  std::vector<NearFace> out;
  double least = 1e300;
  const auto taken = [&](const BondDef& d) {
    return d.pair() && (!adjusted || d.contact.overlap == OVERLAP_ADJUST);
  };
  if (std::none_of(m.bond.begin(), m.bond.end(), taken)) return out;
  const RealVec reach = reaches(m, pts, u, uc, adjusted);
  for (size_t d = 0; d < m.bond.size(); ++d) {
    if (!taken(m.bond[d])) continue;
    const int def = static_cast<int>(d);
    least = std::min(least, MARGIN * reach[d]);
    if (m.surface[m.bond[d].surface].body >= 0) add_points(m, pts, u, uc, def, out);
    else add_side(m, pts, u, uc, adjusted, def, NEAR_SLAVE, {}, out);
    add_side(m, pts, u, uc, adjusted, def, NEAR_MASTER, {0.0, 2.0 * reach[d], 2.0 * MARGIN * reach[d]}, out);
  }
  if (margin) *margin = least;
  return out;
}

// A stretching face increases the reach by at most the motion of two of its nodes: factor 4
bool masters_known(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& u, const RealVec& uc,
                   const RealVec& xb, MasterWatch& watch, std::vector<NearFace>& face)
{
  if (!m.part.on || !model_has_pairs(m)) return true;
  const int nnode = m.mesh.nnode();
  double moved    = 0.0;       // largest displacement component since the last test
  bool stale = uc.size() != watch.corners || watch.own.size() != static_cast<size_t>(bonds.nbond) ||
               watch.margin == 0.0;
  if (!stale)
    each_motion(watch.node, nnode, m.dim, u, uc, [&](size_t k, double x) {
      moved = std::max(moved, std::fabs(x - watch.u[k]));
    });
  else watch.own = own_points(m, pts, bonds);
  stale = stale || 4.0 * std::sqrt(m.dim) * moved >= watch.margin;
  if (comm_allreduce_max(static_cast<int>(stale)) == 0) return true;
  watch.node    = moving(m, pts, bonds, watch.own);
  watch.corners = uc.size();
  watch.u.resize(watch.node.size() * m.dim);
  each_motion(watch.node, nnode, m.dim, u, uc, [&](size_t k, double x) { watch.u[k] = x; });
  face     = masters_and_slaves(m, pts, u, uc, false, &watch.margin);
  std::vector<NearFace> master;
  for (const NearFace& f : face)
    if (f.side == NEAR_MASTER) master.push_back(f);
  const bool known = near_known(m.part, pts, master, points_here(m.dim, bonds, xb, watch.own));
  if (known) face.clear();
  else watch = MasterWatch();
  return known;
}
