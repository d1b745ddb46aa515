#include <algorithm>
#include <cmath>

#include "base/halo_numbers.h"
#include "step/step_turn.h"

namespace {

// adds the force on side B of contact point k to nodes and corners, and the opposite one to side A
void add_push(const Bonds& b, const ContactPairs& pairs, int dim, int k, const double* push, RealVec& f)
{
  for (int i = 0; i < dim; ++i) {
    for (int j = b.a.off[k]; j < b.a.off[k + 1]; ++j) f[b.a.item[j] * dim + i] -= b.a_w[j] * push[i];
    for (int j = pairs.master.off[k]; j < pairs.master.off[k + 1]; ++j)
      f[pairs.master.item[j] * dim + i] += pairs.master_w[j] * push[i];
  }
}

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
    double push[3];
    for (int i = 0; i < dim; ++i) push[i] = press * n[i] + rub[i];   // on side B; friction is tangential
    add_push(b, pairs, dim, k, push, f);
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

// removes the accelerations of these forces from those of t(n)
void remove_turn(Problem& p, RealVec& push)
{
  for (double& x : push) x = -x;
  MPFE_CHECK(add_turn(p, push).ok(), "lumped masses could not be inverted");
}

}  // namespace

void step_turn_apart(Problem& p, const Step& s)
{
  if (!s.explicit_steps() || p.st.log.inc == 0 || p.st.bonds.nbond_all() == 0) return;
  if (step_on_grid(p.d, p.dofs)) return;
  RealVec push;
  push.swap(p.stable.before);
  if (dof_all(p.dofs, push.empty())) contact_at_start(p, push);
  p.stable.apart = true;       // where the run goes on without a division; after one: resume_run
  remove_turn(p, push);
}

void step_turn_back(Problem& p)
{
  RealVec& closing  = p.stable.before;
  const size_t size = static_cast<size_t>(p.m.mesh.nnode() + p.st.points.ncorner) * p.m.dim;
  if (step_on_grid(p.d, p.dofs) || !dof_all(p.dofs, closing.size() == size)) return;
  RealVec push;
  push.swap(closing);
  remove_turn(p, push);
}

void step_turn_begin(Problem& p, const Step& s)
{
  const ContactFound& found = p.stable.found;
  RealVec& push = p.stable.before;
  RealVec closing;                       // of step_close
  closing.swap(push);
  if (!s.explicit_steps() || found.step != p.st.log.step || found.bonds != p.st.bonds.nbond_all()) return;
  if (found.changes != p.st.frac.nconverted + p.st.frac.nreleased) return;
  contact_at_start(p, push);
  for (size_t k = 0; k < closing.size() && closing.size() == push.size(); ++k) push[k] += closing[k];
}

namespace {

// the ends of an increment of a contact point that closes or opens: normal forces of its gaps, and the one at
// t(n+1) with which their mean is the change of the energy over that of the gap                  (6.51)
struct Closing {
  double begin = 0.0, end = 0.0, meant = 0.0;
};

Closing closing_forces(const Bonds& b, int k, double g0, double g1)
{
  const double from = std::min(g0, 0.0), to = std::min(g1, 0.0), deep0 = b.beyond(k, g0),
               deep1 = b.beyond(k, g1), cn = b.cn[k], G = b.growth(k);
  const auto to4      = [](double x) { return x * x * x * x; };
  const double energy = 0.5 * cn * (to * to - from * from) + 0.25 * G * (to4(deep1) - to4(deep0));
  Closing c;
  c.begin = cn * from + G * deep0 * deep0 * deep0;
  c.end   = cn * to + G * deep1 * deep1 * deep1;
  c.meant = 2.0 * energy / (g1 - g0) - c.begin;
  return c;
}

// Friction goes with the pressure: what contact point k lacks at t(n+1), for the slip s. A point that closes
// keeps as much as sticking stores
void closing_friction(const State& st, int dim, int k, const Closing& c, const double* n, const double* s,
                      double* lack)
{
  const double *t0 = &st.n.lambda[k * dim], *t1 = &st.np1.lambda[k * dim];
  double across = 0.0, slip = 0.0, size = 0.0, sn = 0.0;
  for (int i = 0; i < dim; ++i) {
    across += t0[i] * n[i];
    sn += s[i] * n[i];
  }
  for (int i = 0; i < dim; ++i) {
    slip += (s[i] - sn * n[i]) * (s[i] - sn * n[i]);
    size += t1[i] * t1[i];
  }
  double part = 0.0;
  if (c.end < 0.0 && size > 0.0)
    part = std::min(0.0, std::max(c.meant / c.end, std::sqrt(size / slip) / st.bonds.ct[k]) - 1.0);
  for (int i = 0; i < dim; ++i)
    lack[i] = c.end < 0.0 || c.begin == 0.0 ? part * t1[i] : c.meant / c.begin * (t0[i] - across * n[i]);
}

// does contact point k close or open in the increment?  out  g0, g1: gaps at both ends
bool turns(const ContactPairs& pairs, int dim, int k, const double* slip, double& g0, double& g1)
{
  const double* n = &pairs.normal[k * dim];
  g0 = g1 = pairs.gap[k];
  for (int i = 0; i < dim; ++i) g1 += n[i] * slip[i];
  g1 = contact_gap(pairs, k, g1);
  return (g0 < 0.0) != (g1 < 0.0);
}

}  // namespace

double step_close_work(const State& st, const ContactPairs& pairs, const RealVec& slip, int dim, int k)
{
  const double* s = &slip[k * dim];
  double g0, g1, lack[3], work = 0.0;
  if (!turns(pairs, dim, k, s, g0, g1)) return 0.0;
  closing_friction(st, dim, k, closing_forces(st.bonds, k, g0, g1), &pairs.normal[k * dim], s, lack);
  for (int i = 0; i < dim; ++i) work += 0.5 * lack[i] * s[i];
  return work;
}

void step_close(Problem& p, Attempt& a)
{
  const Dofs& s             = p.dofs;
  const Bonds& b            = p.st.bonds;
  const ContactPairs& pairs = p.d.pairs;
  const int dim             = p.m.dim;
  RealVec& closing = p.stable.before;
  closing.clear();
  if (b.nbond_all() == 0) return;
  RealVec force(static_cast<size_t>(p.m.mesh.nnode() + p.st.points.ncorner) * dim, 0.0), f;
  bool none = true;
  for (int k : s.rows.bond_acts) {
    if (b.side[k] != SIDE_CONTACT || !b.counts(k)) continue;
    const double *n = &pairs.normal[k * dim], *slip = &a.jumps.contact[k * dim];
    double g0, g1, push[3];
    if (!turns(pairs, dim, k, slip, g0, g1)) continue;
    none = false;
    const Closing c = closing_forces(b, k, g0, g1);
    closing_friction(p.st, dim, k, c, n, slip, push);
    for (int i = 0; i < dim; ++i) push[i] += (c.meant - c.end) * n[i];
    add_push(b, pairs, dim, k, push, force);
  }
  if (dof_all(s, none)) return;
  to_rows(p, force, f);
  for (int i = 0; i < s.rows.neq(); ++i) a.fint[i] -= f[i];
  closing.swap(force);
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
