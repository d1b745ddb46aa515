#include "contact/contact_masters.h"

#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "bond/bond.h"
#include "contact/contact_meet.h"
#include "point/point.h"

namespace {

// of the reach of a pair: what master faces and contact points may move before it is asked again who is near
const double MARGIN = 0.25;

// Longest edge of the master faces of each pair, of all ranks: how far its contact points look. Zero where no
// pair is near alone. Collective with a divided model
RealVec reaches(const Model& m, const Points& pts, const RealVec& u, const RealVec& uc, bool at_start)
{
  RealVec reach(m.bond.size(), 0.0);
  for (size_t d = 0; d < m.bond.size(); ++d) {
    if (!masters_near_alone(m, m.bond[d])) continue;
    for (const SkinFace& f : surface_faces(m, pts, m.bond[d].master, at_start))
      reach[d] = std::max(reach[d], master_face(m, pts, f.points, {f.elem, f.face}, u, uc).size);
  }
  if (m.part.on) comm_max(reach.data(), static_cast<long>(reach.size()));
  return reach;
}

void add_side(const Model& m, const Points& pts, const RealVec& u, const RealVec& uc, bool at_start, int def,
              NearSide side, const NearReach& reach, std::vector<NearFace>& out)
{
  std::vector<SkinFace> own;
  const BondDef& d = m.bond[def];
  for (const SkinFace& f : surface_faces(m, pts, side == NEAR_SLAVE ? d.surface : d.master, at_start))
    if (point_skin_counts(m, pts, f)) own.push_back(f);
  for (NearFace f : near_faces(m, pts, own, u, uc, reach)) {
    f.def  = def;
    f.side = side;
    out.push_back(f);
  }
}

double largest_change(const RealVec& a, const RealVec& b)
{
  double most = 0.0;
  for (size_t i = 0; i < a.size(); ++i) most = std::max(most, std::fabs(a[i] - b[i]));
  return most;
}

// [nbond] contact points of such pairs at nodes or corners of this rank
std::vector<char> own_points(const Model& m, const Points& pts, const Bonds& bonds)
{
  const std::vector<char> own = bond_own(m, pts);
  std::vector<char> out;
  for (int b = 0; b < bonds.nbond; ++b)
    out.push_back(masters_near_alone(m, m.bond[bonds.def[b]]) &&
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

bool masters_near_alone(const Model& m, const BondDef& d)
{
  return d.master >= 0 && m.surface[d.master].body < 0 && m.surface[d.surface].body < 0;
}

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
                                         const RealVec& uc, bool adjusted, double& margin)
{
  std::vector<NearFace> out;
  margin = 1e300;
  const auto taken = [&](const BondDef& d) {
    return masters_near_alone(m, d) && (!adjusted || d.overlap == OVERLAP_ADJUST);
  };
  if (std::none_of(m.bond.begin(), m.bond.end(), taken)) return out;
  const RealVec reach = reaches(m, pts, u, uc, adjusted);
  for (size_t d = 0; d < m.bond.size(); ++d) {
    if (!taken(m.bond[d])) continue;
    const int def = static_cast<int>(d);
    margin = std::min(margin, MARGIN * reach[d]);
    add_side(m, pts, u, uc, adjusted, def, NEAR_SLAVE, {}, out);
    add_side(m, pts, u, uc, adjusted, def, NEAR_MASTER, {0.0, 2.0 * reach[d], 2.0 * MARGIN * reach[d]}, out);
  }
  return out;
}

// The reach grows with faces that stretch, by as much as two of their nodes move
bool masters_known(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& u, const RealVec& uc,
                   const RealVec& xb, MasterWatch& watch, std::vector<NearFace>& face)
{
  const auto near = [&](const BondDef& d) { return masters_near_alone(m, d); };
  if (!m.part.on || std::none_of(m.bond.begin(), m.bond.end(), near)) return true;
  const bool other = u.size() != watch.u.size() || uc.size() != watch.uc.size() ||
                     watch.own.size() != static_cast<size_t>(bonds.nbond);
  if (other) watch.own = own_points(m, pts, bonds);
  const bool stale = other || 4.0 * std::sqrt(m.dim) * std::max(largest_change(u, watch.u),
                                                                largest_change(uc, watch.uc)) >= watch.margin;
  if (comm_allreduce_max(static_cast<int>(stale)) == 0) return true;
  watch.u  = u;
  watch.uc = uc;
  face     = masters_and_slaves(m, pts, u, uc, false, watch.margin);
  std::vector<NearFace> master;
  for (const NearFace& f : face)
    if (f.side == NEAR_MASTER) master.push_back(f);
  const bool known = near_known(m.part, master, points_here(m.dim, bonds, xb, watch.own));
  if (known) face.clear();
  else watch = MasterWatch();
  return known;
}
