#include <algorithm>

#include "base/halo_numbers.h"
#include "step/step.h"

namespace {

// forces at t(n) of the owned contact points, on nodes and corners of both sides
void contact_at_start(const Problem& p, RealVec& f)
{
  const State& st           = p.st;
  const Bonds& b            = st.bonds;
  const ContactPairs& pairs = p.d.pairs;
  const int dim             = p.m.dim;
  f.assign(static_cast<size_t>(p.m.mesh.nnode() + st.points.ncorner) * dim, 0.0);
  if (pairs.master.size() != b.nbond) return;        // no contact, or found for other bonds
  for (int k = 0; k < b.nbond; ++k) {
    if (!pairs.master.count(k) || b.side[k] != SIDE_CONTACT || !b.counts(k)) continue;
    const double gap = st.n.slip[k * dim], deep = b.beyond(k, gap);
    if (!(gap < 0.0)) continue;
    const double *n = &pairs.normal[k * dim], *rub = &st.n.lambda[k * dim];
    double press = b.cn[k] * gap + b.growth(k) * deep * deep * deep;
    for (int i = 0; i < dim; ++i) press -= rub[i] * n[i];
    for (int i = 0; i < dim; ++i) {
      const double push = press * n[i] + rub[i];     // on side B; friction is tangential
      for (int j = b.a.off[k]; j < b.a.off[k + 1]; ++j) f[b.a.item[j] * dim + i] -= b.a_w[j] * push;
      for (int j = pairs.master.off[k]; j < pairs.master.off[k + 1]; ++j)
        f[pairs.master.item[j] * dim + i] += pairs.master_w[j] * push;
    }
  }
}

// sums forces on nodes and corners [(nnode + ncorner)*dim] over ranks, into the rows of the system
void to_rows(const Problem& p, const RealVec& force, RealVec& f)
{
  const Dofs& s     = p.dofs;
  const Points& pts = p.st.points;
  const int dim     = s.rows.dim;
  const auto middle = force.begin() + static_cast<long>(p.m.mesh.nnode()) * dim;
  RealVec node(force.begin(), middle), corner(middle, force.end());
  if (p.m.part.on) halo_sum(p.m.part.halo, dim, node);
  f.assign(s.rows.neq(), 0.0);
  if (pts.npoint_all() > 0) {
    const bool shared = step_corners_shared(pts);
    if (shared) halo_sum(pts.part.halo, dim, corner);
    for (int c = 0; c < pts.ncorner && shared; ++c)
      if (pts.part.halo.owner[c] != comm_rank()) std::fill_n(&corner[c * dim], dim, 0.0);
    assem_scatter_corners(p.d.grid, s, corner, f);
    sys_sum(s.pattern.A, f);
  }
  for (int r = 0; r < s.rows.nfe; ++r)
    for (int i = 0; i < dim; ++i) f[r * dim + i] += node[s.rows.node_of_row[r] * dim + i];
}

// adds the accelerations of forces on nodes and corners, in parts, to those of t(n)
Failure add_turn(Problem& p, const RealVec& of_place)
{
  const Dofs& s      = p.dofs;
  GridVelocity& grid = p.newton.grid;
  RealVec f, acc(s.rows.neq(), 0.0);
  if (dof_all(s, std::all_of(of_place.begin(), of_place.end(), [](double x) { return x == 0.0; })))
    return STATUS_OK;
  to_rows(p, of_place, f);
  const Failure failure = step_accelerations(p, f, 0.0, acc);
  if (!failure.ok()) return failure;
  ledger_leap(s, 0.0, p.st);             // with the accelerations before                           (6.33)
  for (int i = 0; i < s.rows.nfe * s.rows.dim; ++i) {
    const int k = s.rows.node_of_row[i / s.rows.dim] * s.rows.dim + i % s.rows.dim;
    if (s.bound.fixed[i] == DOF_FREE) p.st.n.a[k] += acc[i];
    else if (s.bound.fixed[i] == DOF_FIXED && !p.st.rf.empty()) p.st.rf[k] -= f[i];
  }
  const int first = grid.first * s.rows.dim;
  for (size_t i = 0; i < grid.a.size(); ++i)
    if (s.bound.fixed[first + i] == DOF_FREE) grid.a[i] += acc[first + i];
  if (p.m.part.around.on()) halo_numbers(p.m.part.halo, s.rows.dim, p.st.n.a);
  if (!step_on_grid(p.d, s)) return STATUS_OK;
  RealVec all(s.rows.neq(), 0.0);
  std::copy(grid.a.begin(), grid.a.end(), all.begin() + first);
  p.st.ledger.leap_grid = step_leap_of_grid(p, all);
  return STATUS_OK;
}

}  // namespace

void step_turn_apart(Problem& p, const Step& s)
{
  if (!s.explicit_steps() || p.st.log.inc == 0 || p.st.bonds.nbond_all() == 0) return;
  if (step_on_grid(p.d, p.dofs)) return;
  RealVec push = p.stable.before;
  if (dof_all(p.dofs, push.empty())) contact_at_start(p, push);
  for (double& x : push) x = -x;
  p.stable.before.clear();
  p.stable.apart = true;       // where the run goes on without a division; after one: resume_run
  MPFE_CHECK(add_turn(p, push).ok(), "lumped masses could not be inverted");
}

void step_turn_begin(Problem& p, const Step& s)
{
  const ContactFound& found = p.stable.found;
  RealVec& push = p.stable.before;
  push.clear();
  if (!s.explicit_steps() || found.step != p.st.log.step || found.bonds != p.st.bonds.nbond_all()) return;
  if (found.changes == p.st.frac.nconverted + p.st.frac.nreleased) contact_at_start(p, push);
}

Failure step_turn(Problem& p)
{
  const Dofs& s            = p.dofs;
  RealVec &before          = p.stable.before, now;
  const GridVelocity& grid = p.newton.grid;
  const bool apart = p.stable.apart;
  const bool anew  = step_on_grid(p.d, p.dofs) &&
      (grid.a.size() != grid.v.size() || grid.pattern != s.pattern.number || grid.made != p.d.grid.made);
  p.stable.apart = false;
  if (p.st.bonds.nbond_all() == 0) return STATUS_OK;
  if ((dof_all(s, before.empty()) && !apart) || !dof_all(s, !anew)) return STATUS_OK;
  contact_at_start(p, now);
  for (size_t k = 0; k < now.size() && !apart; ++k) now[k] -= before[k];
  before.clear();
  return add_turn(p, now);
}
