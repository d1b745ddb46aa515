#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "base/halo_numbers.h"
#include "base/timer.h"
#include "model/scheme.h"
#include "step/step.h"

namespace {

// Initial guess of shared rows: the mean of the velocities on the ranks that have one; these are equal
void agree_velocity(const Dofs& s, std::vector<char>& begun, RealVec& vgrid)
{
  const int dim = s.rows.dim, width = dim + 1;            // velocity and 1, or zeros
  RealVec known(static_cast<size_t>(s.rows.nrow) * width, 0.0);
  for (int r : s.rows.halo.shared) {
    if (!begun[r]) continue;
    std::copy_n(&vgrid[r * dim], dim, &known[r * width]);
    known[r * width + dim] = 1.0;
  }
  halo_sum(s.rows.halo, width, known);
  for (int r : s.rows.halo.shared) {
    const double ranks = known[r * width + dim];
    begun[r] = ranks > 0.0;
    for (int i = 0; i < dim && ranks > 0.0; ++i) vgrid[r * dim + i] = known[r * width + i] / ranks;
  }
}

// The last velocities, of the same rows. Prescribed dofs of nodes keep their more accurate values
void take_velocity(const GridVelocity& before, const Dofs& s, RealVec& vgrid)
{
  const int first = before.first * s.rows.dim, grid = s.rows.nfe * s.rows.dim;
  for (int i = first; i < s.rows.neq(); ++i)
    if (i >= grid || !s.bound.fixed[i]) vgrid[i] = before.v[i - first];
}

// copies the last velocities into the rows that still exist; returns these rows
std::vector<char> begin_velocity(const GridVelocity& before, const Dofs& s, RealVec& vgrid)
{
  std::vector<char> begun;
  if (before.pattern < 0) return begun;
  if (before.pattern == s.pattern.number) {
    take_velocity(before, s, vgrid);
    begun.assign(s.rows.nrow, 1);
    return begun;
  }
  const double* of_grid = before.v.data() + before.v.size() - before.key.size() * s.rows.dim;
  begun.assign(s.rows.nrow, 0);
  size_t k = 0;
  for (int r = s.rows.nfe; r < s.rows.nrow; ++r) {
    while (k < before.key.size() && before.key[k] > s.rows.row_key[r]) ++k;
    if (k == before.key.size() || before.key[k] != s.rows.row_key[r]) continue;
    begun[r] = 1;
    for (int i = 0; i < s.rows.dim; ++i) vgrid[r * s.rows.dim + i] = of_grid[k * s.rows.dim + i];
  }
  if (s.rows.split) agree_velocity(s, begun, vgrid);
  return begun;
}

// Are mass, points and supports the same as in the last increment? Then the projection equals the velocity at
// its end. Dependent dofs of nodes that points follow are not projected. Collective                 (3.19)
bool projection_known(const State& st, const Discretisation& d, const Dofs& s, const GridVelocity& before)
{
  if (before.pattern < 0 || (s.rows.hung && s.bound.tie.any)) return false;
  const ActiveGrid& grid = d.grid;
  bool known = before.pattern == s.pattern.number && before.first == s.rows.projected_from() &&
               before.made == d.grid.made && before.increment == st.log.inc_total &&
               std::none_of(grid.ghost_m.begin(), grid.ghost_m.end(), [](double m) { return m != 0.0; });
  const int first = before.first * s.rows.dim;
  for (int i = first; known && i < s.rows.neq(); ++i) {
    const bool at_node = i < s.rows.nfe * s.rows.dim;
    known = before.fixed[i - first] == s.bound.fixed[i] &&
            (at_node || !s.bound.fixed[i] || before.v[i - first] == s.bound.rate0[i]);
  }
  return s.rows.split ? comm_allreduce_max(static_cast<int>(!known)) == 0 : known;
}

// dof_of_nodes into memory that is there
void put_nodes(const Dofs& s, const RealVec& x, RealVec& out)
{
  const int dim = s.rows.dim;
  out.resize(s.rows.neq());
  for (int r = 0; r < s.rows.nfe; ++r)
    for (int i = 0; i < dim; ++i) out[r * dim + i] = x[s.rows.node_of_row[r] * dim + i];
  std::fill(out.begin() + static_cast<long>(s.rows.nfe) * dim, out.end(), 0.0);
}

// velocity of the grid: M-orthogonal projection of the velocities of the points    (3.13)
//   in   before     last velocity of the grid
//   out  momentum   [neq] M v of nodes, sum m S v of points
//        vgrid      [neq] velocity of nodes and of the grid
Failure velocity_at_start(const State& st, const Discretisation& d, const Dofs& dofs,
                          const GridVelocity& before, RealVec& momentum, RealVec& vgrid)
{
  const bool projects = step_on_grid(d, dofs);
  put_nodes(dofs, st.n.v, vgrid);
  if (projects && projection_known(st, d, dofs, before)) {
    timer_skip(PHASE_PROJECT);
    take_velocity(before, dofs, vgrid);
    mass_multiply(dofs, vgrid, momentum);
    return STATUS_OK;
  }
  mass_elements(dofs, vgrid, momentum);
  point_momentum(d.grid, dofs, st.n.vc, momentum);
  sys_sum(dofs.pattern.A, momentum);
  if (!projects) return STATUS_OK;
  Timer timer(PHASE_PROJECT);
  const Dofs& s = dofs;
  const int first = s.rows.projected_from();
  const std::vector<char> begun = begin_velocity(before, s, vgrid);
  for (int i = s.rows.nfe * s.rows.dim; i < s.rows.neq(); ++i)
    if (s.bound.fixed[i]) vgrid[i] = s.bound.rate0[i];
  if (mass_project(s, begun, momentum, vgrid) < 0) return MASS_FAILED;
  if (dof_all_free(s)) return STATUS_OK;
  const auto from = s.bound.fixed.begin() + static_cast<long>(first) * s.rows.dim;
  if (dof_all(s, std::find(from, s.bound.fixed.end(), DOF_FIXED) == s.bound.fixed.end())) return STATUS_OK;
  RealVec Mv;                  // supports: momentum of their motion
  mass_multiply(s, vgrid, Mv);
  for (int i = first * s.rows.dim; i < s.rows.neq(); ++i)
    if (s.bound.fixed[i] == DOF_FIXED) momentum[i] = Mv[i];
  return STATUS_OK;
}

// internal force at t(n) with the weights of this step: the grid stores no acceleration
Failure force_at_start(Problem& p, Attempt& a)
{
  const RealVec zero(p.dofs.rows.neq(), 0.0);
  KernelMode mode;
  BulkStep bulk;
  mode.finite = a.mode.finite;
  step_hold_bulk(p, a.step, bulk, mode);
  const Failure failure = assem_move(p.m, p.d, p.dofs, zero, a.t0, a.t0, p.st, a.jumps);
  return failure.ok() ? assem_internal(p.m, p.d, p.dofs, mode, a.jumps, p.st, a.fint0) : failure;
}

// Perturbation, relative to the increment, for the viscous force at t(n) by a finite difference: small
// against 1, and large against the round-off of strains  (no test)
const double DAMPER_STEP = 1e-3;

}  // namespace

void step_bulk_means(Problem& p, const Step& s)
{
  int worst;
  const auto bare = [](const ElemBlock& b) { return b.mean.empty(); };
  if (std::any_of(p.d.el.block.begin(), p.d.el.block.end(), bare))
    elem_stable(p.m, p.d.el, p.st.n, s.nlgeom, &worst);
}

void step_hold_bulk(Problem& p, const Step& s, BulkStep& bulk, KernelMode& mode)
{
  if (!s.bulk()) return;
  p.st.n.q.resize(p.m.mesh.nelem(), 0.0);
  step_bulk_means(p, s);
  bulk      = {s.bulk_linear, s.bulk_quadratic, 0.0};
  mode.bulk = &bulk;
}

bool step_damps(const Problem& p) { return p.dofs.mass.damped || model_viscous(p.m); }

// viscous force: difference of the internal forces with and without viscous stress
Failure step_damping(Problem& p, bool finite, double t_step, double dt, const RealVec& v, RealVec& f)
{
  f.assign(p.dofs.rows.neq(), 0.0);
  if (p.dofs.mass.damped) damping_multiply(p.dofs, v, f);
  if (!model_viscous(p.m)) return STATUS_OK;
  RealVec ahead = v, with, without;
  for (double& x : ahead) x *= DAMPER_STEP * dt;
  Jumps jumps;
  KernelMode mode;
  mode.finite = finite;
  Failure failure = assem_move(p.m, p.d, p.dofs, ahead, t_step, t_step, p.st, jumps);
  if (failure.ok()) failure = assem_internal(p.m, p.d, p.dofs, mode, jumps, p.st, without);
  mode.rate = 1.0 / (DAMPER_STEP * dt);
  if (failure.ok()) failure = assem_internal(p.m, p.d, p.dofs, mode, jumps, p.st, with);
  if (!failure.ok()) return failure;
  for (int i = 0; i < p.dofs.rows.neq(); ++i) f[i] += with[i] - without[i];
  return STATUS_OK;
}

namespace {

// known part of the damping at the velocity at the end of the increment                     (6.20)
Failure begin_damping(Problem& p, Attempt& a)
{
  const Scheme& scheme = scheme_of(a.step);
  if (p.dofs.mass.damped) a.cC = scheme.damping(a.step, a.dt);
  if (a.mode.mid) return STATUS_OK;
  RealVec v(p.dofs.rows.neq()), f;
  for (int i = 0; i < p.dofs.rows.neq(); ++i)
    v[i] = scheme.damping_known(a.step, a.dt, a.vgrid[i], a.agrid.empty() ? 0.0 : a.agrid[i]);
  const Failure failure = step_damping(p, a.mode.finite, a.t0, a.dt, v, f);
  for (int i = 0; i < p.dofs.rows.neq() && failure.ok(); ++i) a.g[i] -= f[i];
  return failure;
}

// M a(n): from the accelerations of the nodes; for the grid M a = fext - fint on free dofs, and that solution
// in the rows of its supports, whose reaction is not known otherwise. Where points follow nodes, all forces
// are evaluated: the accelerations of the nodes belong to the grid of the last increment.
//   out  f    with a grid: fext - fint - damping at t(n)
Failure inertia_at_start(Problem& p, Attempt& a, RealVec& f, RealVec& Ma)
{
  const Dofs& s = p.dofs;
  a.agrid = dof_of_nodes(s, p.st.n.a);
  if (step_on_grid(p.d, s)) {
    RealVec damping(s.rows.neq(), 0.0);
    if (step_damps(p)) {
      const Failure failure = step_damping(p, a.mode.finite, a.t0, a.dt, a.vgrid, damping);
      if (!failure.ok()) return failure;
    }
    Timer timer(PHASE_PROJECT);
    f.resize(s.rows.neq());
    for (int i = 0; i < s.rows.neq(); ++i) {
      f[i] = a.fext0[i] - a.fint0[i] - damping[i];
      if (s.bound.fixed[i] && i >= s.rows.nfe * s.rows.dim)
        a.agrid[i] = (s.bound.rate[i] - s.bound.rate0[i]) / a.dt;
    }
    if (mass_solve(s, s.rows.hung ? ROWS_ALL : ROWS_GRID, s.rows.nfe, f, a.agrid) < 0) return MASS_FAILED;
  }
  mass_multiply(s, a.agrid, Ma);
  return STATUS_OK;
}

// fint - fext - reactions at t(n): M a of a scheme that weights the forces of both ends
void unbalanced_at_start(const Dofs& s, const RealVec& rf, const Attempt& a, RealVec& f)
{
  f.resize(s.rows.neq());
  for (int i = 0; i < s.rows.neq(); ++i) {
    f[i] = a.fint0[i] - a.fext0[i];
    if (s.bound.fixed[i] == DOF_FIXED && i / s.rows.dim < s.rows.nfe && !rf.empty())
      f[i] -= rf[s.rows.node_of_row[i / s.rows.dim] * s.rows.dim + i % s.rows.dim];
  }
}

// Newmark, supports that move or have moved: M a + C v + fint - fext at t(n). It vanishes at free dofs but
// for the accelerations of supports, which are differences of their velocities                       (6.12)
Failure residual_before(Problem& p, const RealVec& Ma, Attempt& a)
{
  const Dofs& s = p.dofs;
  // forces that change at t(n), by contact or fracture, are not those of supports
  if (p.d.pairs.near || p.d.fm.on) return STATUS_OK;
  bool still = p.st.log.inc > 2;         // a support may jump in the first increment
  for (int i = 0; i < s.rows.neq(); ++i)
    still = still && (s.bound.fixed[i] != DOF_FIXED || (s.bound.target[i] == 0.0 && a.agrid[i] == 0.0));
  if (dof_all(s, still)) return STATUS_OK;
  RealVec damping(s.rows.neq(), 0.0);
  Failure failure = step_on_grid(p.d, s) ? Failure() : force_at_start(p, a);
  if (failure.ok() && step_damps(p)) failure = step_damping(p, a.mode.finite, a.t0, a.dt, a.vgrid, damping);
  if (!failure.ok()) return failure;
  a.before = Ma;
  for (int i = 0; i < s.rows.neq(); ++i) a.before[i] += a.fint0[i] - a.fext0[i] + damping[i];
  return STATUS_OK;
}

}  // namespace

Failure step_inertia_begin(Problem& p, Attempt& a)
{
  const Step& s = a.step;
  Failure failure = velocity_at_start(p.st, p.d, p.dofs, p.newton.grid, a.momentum, a.vgrid);
  if (!failure.ok()) return failure;

  const Scheme& scheme = scheme_of(s);
  RealVec f, Ma, force;
  if (scheme.acceleration) {
    if (step_on_grid(p.d, p.dofs) || scheme.force) failure = force_at_start(p, a);
    if (failure.ok()) failure = inertia_at_start(p, a, f, Ma);
    if (!failure.ok()) return failure;
  }
  if (scheme.force) unbalanced_at_start(p.dofs, p.st.rf, a, force);
  a.cM = scheme.mass(s, a.dt);
  a.g.resize(p.dofs.rows.neq());
  for (int i = 0; i < p.dofs.rows.neq(); ++i)
    a.g[i] = scheme.known(s, a.dt, a.momentum[i], Ma.empty() ? 0.0 : Ma[i], force.empty() ? 0.0 : force[i]);
  if (failure.ok() && scheme.acceleration && !scheme.force) failure = residual_before(p, Ma, a);
  if (failure.ok() && step_damps(p)) failure = begin_damping(p, a);
  // predictor: free flight
  for (int i = 0; i < p.dofs.rows.neq(); ++i)
    a.du[i] = p.dofs.bound.fixed[i] ? 0.0 : a.dt * a.vgrid[i];
  if (failure.ok()) step_predict(p, a);
  return failure;
}

namespace {

// stores acc [neq] as the acceleration of the nodes at t(n), halo nodes too
void put_accelerations(Problem& p, const RealVec& acc)
{
  const Dofs& s = p.dofs;
  for (int r = 0; r < s.rows.nfe; ++r)
    for (int i = 0; i < s.rows.dim; ++i)
      p.st.n.a[s.rows.node_of_row[r] * s.rows.dim + i] = acc[r * s.rows.dim + i];
  if (p.m.part.around.on()) halo_numbers(p.m.part.halo, s.rows.dim, p.st.n.a);
}

// explicit: reactions of nodes at t(n), from accelerations and forces there: half the work of the increment
void put_reactions(Problem& p, const RealVec& acc, const RealVec& f)
{
  const Dofs& s = p.dofs;
  const int dim = s.rows.dim;
  if (s.bound.free) return;
  RealVec R(s.rows.neq(), 0.0);
  for (int i = 0; i < s.rows.nfe * dim; ++i) R[i] = s.mass.lumped[i / dim] * acc[i] - f[i];
  tie_force(s, R);
  p.st.rf.resize(p.st.n.u.size(), 0.0);              // nodes without a row: of their corners
  for (int i = 0; i < s.rows.nfe * dim; ++i)
    if (s.bound.fixed[i] == DOF_FIXED) p.st.rf[s.rows.node_of_row[i / dim] * dim + i % dim] = R[i];
}

}  // namespace

Failure step_initial_acceleration(Problem& p, const Step& s, double t_step)
{
  Dofs& dofs = p.dofs;
  if (comm_allreduce_max(dofs.rows.nfe) == 0) return STATUS_OK;
  RealVec zero(dofs.rows.neq(), 0.0), fint, f, acc(dofs.rows.neq(), 0.0), momentum, v,
      damping(dofs.rows.neq(), 0.0);
  Jumps jumps;
  KernelMode mode;
  BulkStep bulk;
  mode.finite = s.nlgeom;
  step_hold_bulk(p, s, bulk, mode);
  p.st.np1 = p.st.n;
  Failure failure = dof_constrain(p.m, p.d, p.st, s, t_step, t_step, dofs, p.warned);
  if (failure.ok()) failure = assem_move(p.m, p.d, dofs, zero, t_step, t_step, p.st, jumps);
  if (failure.ok()) failure = assem_internal(p.m, p.d, dofs, mode, jumps, p.st, fint);
  if (failure.ok())
    failure = assem_loads(p.m, p.d, dofs, p.st, s, {t_step, p.st.n.time, 0.0}, p.warned, f);
  if (failure.ok() && step_damps(p))
    failure = velocity_at_start(p.st, p.d, p.dofs, p.newton.grid, momentum, v);
  if (failure.ok() && step_damps(p)) failure = step_damping(p, s.nlgeom, t_step, s.dt, v, damping);
  if (!failure.ok()) return failure;
  for (int i = 0; i < dofs.rows.neq(); ++i) f[i] -= fint[i] + damping[i];
  for (int i = 0; i < dofs.rows.nfe * dofs.rows.dim; ++i)
    if (dofs.bound.fixed[i] == DOF_FIXED)
      acc[i] = p.st.n.a[dofs.rows.node_of_row[i / dofs.rows.dim] * dofs.rows.dim + i % dofs.rows.dim];
  if (s.explicit_steps() && (dofs.bound.tie.any || !step_on_grid(p.d, dofs))) {
    failure = step_accelerations_turning(p, p.st.n.u, dof_of_nodes(dofs, p.st.n.v), f, 0.0, acc);
    if (!failure.ok()) return failure;
  } else {
    const int it = dofs.bound.tie.any ? mass_solve_tied(dofs, 0.0, f, acc)
                                      : mass_solve(dofs, ROWS_ALL, 0, f, acc);
    if (it < 0) return MASS_FAILED;
  }
  put_accelerations(p, acc);
  if (s.explicit_steps()) put_reactions(p, acc, f);
  p.stable.before.clear();     // contact as it is now is in them
  p.stable.apart = false;
  return STATUS_OK;
}

namespace {

// accelerations of the grid at t(n) from the forces
Failure accelerations_at_start(Problem& p, Attempt& a)
{
  const Dofs& s = p.dofs;
  ledger_leap(s, 0.0, p.st);             // with the accelerations before                           (6.33)
  RealVec f, Ma, ahead = p.st.n.degr;
  ahead.swap(p.st.np1.degr);                         // degradation at t(n)
  Failure failure = force_at_start(p, a);
  ahead.swap(p.st.np1.degr);
  if (failure.ok()) failure = inertia_at_start(p, a, f, Ma);
  if (!failure.ok()) return failure;
  // contact forces have changed: nodes need the same forces as the grid
  if (s.bound.tie.any) {
    failure = step_accelerations_turning(p, p.st.n.u, a.vgrid, f, 0.0, a.agrid);
    if (!failure.ok()) return failure;
  } else {
    for (int i = 0; i < s.rows.nfe * s.rows.dim; ++i)
      if (s.bound.fixed[i] == DOF_FREE) a.agrid[i] = f[i] / s.mass.lumped[i / s.rows.dim];
    step_keep_momentum(s, f, a.agrid);
  }
  step_grid_friction(p, f, a.vgrid, 0.5 * a.dt, a.agrid);
  put_accelerations(p, a.agrid);
  put_reactions(p, a.agrid, f);
  p.st.ledger.leap_grid = step_leap_of_grid(p, a.agrid);
  return failure;
}

}  // namespace

Failure step_motion_begin(Problem& p, Attempt& a)
{
  const Dofs& s = p.dofs;
  const GridVelocity& before = p.newton.grid;
  a.cM = scheme_of(a.step).mass(a.step, a.dt);
  if (!step_on_grid(p.d, s)) {
    a.vgrid = dof_of_nodes(s, p.st.n.v);
    a.agrid = dof_of_nodes(s, p.st.n.a);
    return STATUS_OK;
  }
  Failure failure;
  const bool known = projection_known(p.st, p.d, s, before);
  const bool has = known && dof_all(s, before.a.size() == before.v.size());  // a rank may have no row
  if (has && a.leap.plain) {        // nodes: explicit_nodes; their rows are not read
    timer_skip(PHASE_PROJECT);
    const auto at = static_cast<long>(before.first) * s.rows.dim;
    a.vgrid.resize(s.rows.neq());
    a.agrid.resize(s.rows.neq());
    std::copy(before.v.begin(), before.v.end(), a.vgrid.begin() + at);
    std::copy(before.a.begin(), before.a.end(), a.agrid.begin() + at);
    return STATUS_OK;
  }
  if (known) {                 // nothing here asks for the momentum
    timer_skip(PHASE_PROJECT);
    a.vgrid = dof_of_nodes(s, p.st.n.v);
    take_velocity(before, s, a.vgrid);
  } else {
    failure = velocity_at_start(p.st, p.d, s, before, a.momentum, a.vgrid);
  }
  if (!failure.ok()) return failure;
  if (has) {
    a.agrid = dof_of_nodes(s, p.st.n.a);
    std::copy(before.a.begin(), before.a.end(), a.agrid.begin() + before.first * s.rows.dim);
    return STATUS_OK;
  }
  return accelerations_at_start(p, a);
}
