#include <algorithm>
#include <cmath>
#include <numeric>

#include <Eigen/Dense>

#include "base/comm.h"
#include "base/log.h"
#include "base/timer.h"
#include "model/scheme.h"
#include "step/step_turn.h"

namespace {

// [nrow][dim*dim] the blocks of the lumped C, summed over ranks
RealVec damping_blocks(const Dofs& s)
{
  const int width = s.rows.dim * s.rows.dim;
  RealVec all(static_cast<size_t>(s.rows.nrow) * width);
  for (int r = 0; r < s.rows.nrow; ++r)
    std::copy_n(&s.mass.C[static_cast<size_t>(s.pattern.A.off[r + 1] - 1) * width], width,
                &all[static_cast<size_t>(r) * width]);
  if (s.rows.split) halo_sum(s.rows.halo, width, all);
  return all;
}

// (M + dt/2 C) a = f in the rows of nodes, both lumped: a scalar or a small block for each node     (6.29)
void node_accelerations(const Dofs& s, double half, const RealVec& f, RealVec& acc)
{
  const int dim = s.rows.dim;
  const RealVec blocks = s.mass.damped ? damping_blocks(s) : RealVec();
  for (int r = 0; r < s.rows.nfe; ++r) {
    if (!s.mass.damped) {
      for (int i = r * dim; i < (r + 1) * dim; ++i)
        if (s.bound.fixed[i] == DOF_FREE) acc[i] = f[i] / s.mass.lumped[r];
      continue;
    }
    Eigen::Matrix3d A = Eigen::Matrix3d::Identity();
    Eigen::Vector3d b = Eigen::Vector3d::Zero();
    const double* C   = &blocks[static_cast<size_t>(r) * dim * dim];
    for (int i = 0; i < dim; ++i) {
      if (s.bound.fixed[r * dim + i] == DOF_FIXED) continue;
      b(i) = f[r * dim + i];
      A(i, i) = s.mass.lumped[r];
      for (int j = 0; j < dim; ++j) {
        A(i, j) += half * C[i * dim + j] * (s.bound.fixed[r * dim + j] != DOF_FIXED);
        b(i) -= half * C[i * dim + j] * acc[r * dim + j] * (s.bound.fixed[r * dim + j] == DOF_FIXED);
      }
    }
    const Eigen::Vector3d x = A.fullPivLu().solve(b);
    for (int i = 0; i < dim; ++i)
      if (s.bound.fixed[r * dim + i] == DOF_FREE) acc[r * dim + i] = x(i);
  }
}

}  // namespace

Failure step_accelerations(const Problem& p, const RealVec& f, double half, RealVec& acc)
{
  const Dofs& s = p.dofs;
  if (!s.bound.tie.any) node_accelerations(s, half, f, acc);
  else if (mass_solve_tied(s, half, f, acc) < 0) return MASS_FAILED;
  if (!step_on_grid(p.d, s)) return STATUS_OK;
  Timer timer(PHASE_PROJECT);
  const std::vector<char> begun(s.rows.nrow, 1);
      // initial guess of grid rows: acceleration at t(n)
  if (mass_project(s, begun, f, acc) < 0) return MASS_FAILED;
  step_keep_momentum(s, f, acc);
  return STATUS_OK;
}

Failure step_accelerations_turning(const Problem& p, const RealVec& u, const RealVec& v, const RealVec& f,
                                   double half, RealVec& acc)
{
  const Dofs& s = p.dofs;
  if (s.bound.tie.rigid.empty()) return step_accelerations(p, f, half, acc);
  RealVec inward(s.rows.neq(), 0.0), rest = f;
  rigid_centripetal(p.m, u, s, v, inward);
  for (int i = 0; i < s.rows.neq(); ++i) rest[i] -= s.mass.lumped[i / s.rows.dim] * inward[i];
  const Failure failure = step_accelerations(p, rest, half, acc);
  for (int i = 0; i < s.rows.neq(); ++i) acc[i] += inward[i];
  return failure;
}

namespace {

// forces at t(n+1): internal forces, loads, and damping at the mid-increment velocity
Failure form_forces(Problem& p, Attempt& a, RealVec& f)
{
  const Dofs& s   = p.dofs;
  Failure failure = assem_move(p.m, p.d, s, a.du, a.t0, a.t1, p.st, a.jumps);
  if (failure.ok()) failure = assem_internal(p.m, p.d, s, a.mode, a.jumps, p.st, a.fint, nullptr, a.energy);
  if (failure.ok()) step_close(p, a);
  if (failure.ok()) failure = assem_loads(p.m, p.d, s, p.st, a.step, a.load, p.warned, a.fext);
  if (!failure.ok()) return failure;
  f.resize(s.rows.neq());
  for (int i = 0; i < s.rows.neq(); ++i) f[i] = a.fext[i] - a.fint[i];
  if (!s.mass.damped) return STATUS_OK;
  RealVec v(s.rows.neq()), Cv;
  // supports: with half their acceleration this is their velocity at t(n+1)
  for (int i = 0; i < s.rows.neq(); ++i)
    v[i] = s.bound.fixed[i] == DOF_FIXED ? 0.5 * (a.vgrid[i] + s.bound.rate[i])
                                         : a.vgrid[i] + 0.5 * a.dt * a.agrid[i];
  damping_multiply(s, v, Cv);
  for (int i = 0; i < s.rows.neq(); ++i) f[i] -= Cv[i];
  return STATUS_OK;
}

// accelerations at t(n+1)
Failure accelerations_at_end(Problem& p, Attempt& a, const RealVec& f)
{
  const Dofs& s = p.dofs;
  if (s.bound.tie.rigid.empty()) return step_accelerations(p, f, 0.5 * a.dt, a.leap.acc);
  rigid_arms(p.m, p.st.np1.u, p.dofs.bound.tie);
  RealVec v(s.rows.neq());
  for (int i = 0; i < s.rows.neq(); ++i)
    v[i] = s.bound.fixed[i] == DOF_FIXED ? s.bound.rate[i] : a.vgrid[i] + a.dt * a.agrid[i];
  return step_accelerations_turning(p, p.st.np1.u, v, f, 0.5 * a.dt, a.leap.acc);
}

// adds (f - Ma) / lumped to the accelerations of the rows of the grid: with r = f - M a the sum of
// M (r / lumped) over the rows equals that of r
void add_residual(const Dofs& s, const RealVec& f, const RealVec& Ma, RealVec& acc)
{
  for (int i = s.rows.nfe * s.rows.dim; i < s.rows.neq(); ++i) {
    const int r = i / s.rows.dim;
    if (s.bound.fixed[i] != DOF_FREE || s.mass.lumped[r] <= MIN_ROW_SUM * s.mass.M_diag[r]) continue;
    acc[i] += (f[i] - Ma[i]) / s.mass.lumped[r];
  }
}

}  // namespace

void step_keep_momentum(const Dofs& s, const RealVec& f, RealVec& acc)
{
  RealVec Ma;
  mass_multiply(s, acc, Ma);
  add_residual(s, f, Ma, acc);
}

namespace {

// displacement of nodes, without dampers                                                          (6.28)
template <int D>
void leap_nodes(const Dofs& s, const Level& n, Attempt& a)
{
  a.du.resize(s.rows.neq());
  const double *v = n.v.data(), *acc = n.a.data(), dt = a.dt;
  double* du = a.du.data();
  for (int r = 0; r < s.rows.nfe; ++r) {
    const int first = s.rows.node_of_row[r] * D;
    for (int i = 0; i < D; ++i)
      du[r * D + i] = s.bound.fixed[r * D + i] == DOF_FIXED ? s.bound.target[r * D + i]
          : dt * (v[first + i] + 0.5 * dt * acc[first + i]);
  }
}

// acceleration and velocity at t(n+1), reactions, work of this rank (6.12); false: a number is not finite
// here                                                                                            (6.29)
//   in   rf0   reactions at t(n)  [nnode*dim]
template <int D>
bool accelerate_nodes(const Dofs& s, const RealVec& rf0, const Level& n, Attempt& a, Level& l)
{
  a.R.resize(s.rows.neq());
  const double *fext0 = a.fext0.data(), *fext = a.fext.data(), *fint = a.fint.data(), *du = a.du.data(),
               *v0 = n.v.data(), *acc0 = n.a.data(), dt = a.dt;
  double *v = l.v.data(), *acc = l.a.data(), sum = 0.0, work = 0.0;
  for (int r = 0; r < s.rows.nfe; ++r) {
    const int first   = s.rows.node_of_row[r] * D;
    const double mass = s.mass.lumped[r];
    for (int i = 0; i < D; ++i) {
      const int dof = r * D + i, k = first + i;
      const double f = fext[dof] - fint[dof];
      double a1 = f / mass, v1 = v0[k] + 0.5 * dt * (acc0[k] + a1), load = fext0[dof] + fext[dof];
      double gain = 0.0;       // kinetic energy of the support
      if (s.bound.fixed[dof] == DOF_FIXED) {
        v1 = s.bound.rate[dof];
        a1 = (v1 - v0[k]) / dt;
        a.R[dof] = mass * a1 - f;
        load += rf0[k] - mass * acc0[k] - f;
        gain = 0.5 * mass * (v1 * v1 - v0[k] * v0[k]);
      }
      acc[k] = a1;
      v[k]   = v1;
      sum += a1;
      if (s.rows.counts(dof)) work += 0.5 * load * du[dof] + gain;
    }
  }
  a.leap.work = work;
  return std::isfinite(sum);
}

// sums the work over ranks, and books what the fall of stresses releases, in one message; false: a number of
// a rank is not finite
//   in   finite   numbers of this rank
bool sum_work(Problem& p, bool finite, Attempt& a)
{
  Timer timer(PHASE_COMMIT);
  State& st     = p.st;
  double sum[4] = {finite ? 0.0 : 1.0, a.leap.work, 0.0, a.leap.leap_grid};
  if (p.d.fm.on && finite)
    sum[2] = frac_degraded(p.m, a.step, p.d.el, st.points, st.frac, st.n, st.np1);
  comm_sum(sum, 4);
  a.leap.work = sum[1];
  st.ledger.fracture += sum[2];
  st.ledger.leap_grid = sum[3];
  return sum[0] == 0.0;
}

// x [neq] with zeros in the rows of the grid; the rows of nodes are not read, nor written on one rank
void clear_grid(const Dofs& s, RealVec& x)
{
  x.resize(s.rows.neq());
  std::fill(x.begin() + (s.rows.split ? 0 : static_cast<long>(s.rows.nfe) * s.rows.dim), x.end(), 0.0);
}

// displacement of the rows of the grid                                                            (6.28)
void leap_grid(const Dofs& s, Attempt& a)
{
  for (int i = s.rows.nfe * s.rows.dim; i < s.rows.neq(); ++i)
    a.du[i] = s.bound.fixed[i] == DOF_FIXED ? s.bound.target[i]
        : a.dt * (a.vgrid[i] + 0.5 * a.dt * a.agrid[i]);
}

// y = M x in the rows of the grid, which no mass couples to nodes                                  (6.47)
void multiply_grid(const Dofs& s, const RealVec& x, RealVec& y)
{
  if (s.rows.split) return mass_multiply(s, x, y);
  const SysMatrix& A = s.pattern.A;
  const int dim      = s.rows.dim;
  clear_grid(s, y);
  for (int r = s.rows.nfe; r < s.rows.nrow; ++r) {
    const int diag = A.off[r + 1] - 1;
    for (int i = 0; i < dim; ++i) y[r * dim + i] += s.mass.M[diag] * x[r * dim + i];
    for (int k = A.off[r]; k < diag; ++k)
      for (int i = 0, c = A.col[k]; i < dim && c >= s.rows.nfe; ++i) {
        y[r * dim + i] += s.mass.M[k] * x[c * dim + i];
        y[c * dim + i] += s.mass.M[k] * x[r * dim + i];
      }
  }
}

// step_leap_of_grid of the rows owned by this rank, from f = M a, where a is that of free dofs alone
double leap_of_grid(const Dofs& s, const RealVec& acc, const RealVec& f)
{
  double sum = 0.0;
  for (int i = s.rows.nfe * s.rows.dim; i < s.rows.neq(); ++i)
    if (s.bound.fixed[i] == DOF_FREE && s.rows.counts(i)) sum += acc[i] * f[i];
  return 0.125 * sum;
}

// the same from all accelerations
double leap_of_free(const Dofs& s, const RealVec& acc)
{
  RealVec free(s.rows.neq(), 0.0), Ma;
  for (int i = s.rows.nfe * s.rows.dim; i < s.rows.neq(); ++i)
    if (s.bound.fixed[i] == DOF_FREE) free[i] = acc[i];
  multiply_grid(s, free, Ma);
  return leap_of_grid(s, free, Ma);
}

// does no plane of the grid accelerate on this rank?
bool still_planes(const Dofs& s, const RealVec& acc)
{
  for (int i = s.rows.nfe * s.rows.dim; i < s.rows.neq(); ++i)
    if (s.bound.fixed[i] == DOF_FIXED && acc[i] != 0.0) return false;
  return true;
}

// work of planes of the grid that move, of this rank: the mean of the forces at both ends, and of the inertia
// between them
//   in   force0   loads less internal forces at t(n) of the rows from the grid on; empty: those at t(n+1)
double work_of_planes(const Dofs& s, const Attempt& a, const RealVec& f, const RealVec& force0)
{
  const int first = s.rows.nfe * s.rows.dim;
  RealVec mean(s.rows.neq(), 0.0), Ma;
  for (int i = first; i < s.rows.neq(); ++i)
    mean[i] = s.bound.fixed[i] == DOF_FREE ? 0.5 * (a.agrid[i] + a.leap.acc[i]) : a.leap.acc[i];
  multiply_grid(s, mean, Ma);
  double work = 0.0;
  for (int i = first; i < s.rows.neq(); ++i) {
    if (s.bound.fixed[i] != DOF_FIXED || !s.rows.counts(i)) continue;
    work += (Ma[i] - 0.5 * (f[i] + (force0.empty() ? f[i] : force0[i - first]))) * a.du[i];
  }
  return work;
}

// what a change of the velocity of planes adds to the kinetic energy of points beside them, of this rank:
// these also have a velocity that the grid does not see                                          (6.12)
double work_on_unseen(const Problem& p, const Attempt& a)
{
  const Dofs& s   = p.dofs;
  const int first = s.rows.nfe * s.rows.dim;
  RealVec v(s.rows.neq(), 0.0), momentum(s.rows.neq(), 0.0), Mv;
  std::copy(a.vgrid.begin() + first, a.vgrid.end(), v.begin() + first);
  point_momentum(p.d.grid, s, p.st.n.vc, momentum);
  sys_sum(s.pattern.A, momentum);
  multiply_grid(s, v, Mv);
  double work = 0.0;
  for (int i = first; i < s.rows.neq(); ++i)
    if (s.bound.fixed[i] == DOF_FIXED && s.rows.counts(i))
      work += (s.bound.rate[i] - a.vgrid[i]) * (momentum[i] - Mv[i]);
  return work;
}

// loads less internal forces at t(n) of the rows of the grid: of the last increment, or those from which its
// accelerations started anew
RealVec force_before(const Problem& p, const Attempt& a)
{
  const int first = p.dofs.rows.nfe * p.dofs.rows.dim;
  RealVec f;
  for (size_t i = first; i < a.fint0.size(); ++i) f.push_back(a.fext0[i] - a.fint0[i]);
  const GridVelocity& grid = p.newton.grid;
  const size_t rows = p.dofs.rows.neq() - first;
  if (f.empty() && grid.f.size() >= rows) f.assign(grid.f.end() - static_cast<long>(rows), grid.f.end());
  return f;
}

// work of the planes of the grid over the increment, of this rank                                (6.12)
//   in   f   loads less internal forces at t(n+1)
double work_of_grid(const Problem& p, const Attempt& a, const RealVec& f)
{
  const Dofs& s = p.dofs;
  bool none = true, still = true, steady = true;     // no plane; none moves; none changes its velocity
  for (int i = s.rows.nfe * s.rows.dim; i < s.rows.neq(); ++i) {
    if (s.bound.fixed[i] != DOF_FIXED) continue;
    none   = false;
    still  = still && a.du[i] == 0.0;
    steady = steady && s.bound.rate[i] == a.vgrid[i];
  }
  if (dof_all(s, none)) return 0.0;
  double work = 0.0;
  if (!dof_all(s, still)) work += work_of_planes(s, a, f, force_before(p, a));
  if (!dof_all(s, steady)) work += work_on_unseen(p, a);
  return work;
}

// acceleration of the rows of the grid at t(n+1), reactions, work (6.12); no mass couples them to nodes
//                                                                                               (6.47)
Failure accelerate_grid(Problem& p, Attempt& a)
{
  const Dofs& s   = p.dofs;
  const int first = s.rows.nfe * s.rows.dim;
  RealVec f, Ma;
  const Borrowed borrowed(p.newton.spare, {&f, &Ma});
  clear_grid(s, f);
  clear_grid(s, a.leap.acc);
  for (int i = first; i < s.rows.neq(); ++i) {
    f[i]     = a.fext[i] - a.fint[i];
    a.leap.acc[i] = s.bound.fixed[i] == DOF_FIXED ? (s.bound.rate[i] - a.vgrid[i]) / a.dt : a.agrid[i];
  }
  {
    Timer timer(PHASE_PROJECT);
    const std::vector<char> begun(s.rows.nrow, 1);       // initial guess: acceleration at t(n)
    if (mass_project(s, begun, f, a.leap.acc) < 0) return MASS_FAILED;
    multiply_grid(s, a.leap.acc, Ma);
    add_residual(s, f, Ma, a.leap.acc);
  }
  const auto fixed = s.bound.fixed.begin() + first;
  const bool bound  = !dof_all(s, std::find(fixed, s.bound.fixed.end(), DOF_FIXED) == s.bound.fixed.end());
  if (bound) multiply_grid(s, a.leap.acc, Ma);
  double sum = 0.0, work = 0.0;
  for (int i = first; i < s.rows.neq(); ++i) {
    if (s.bound.fixed[i] == DOF_FIXED) a.R[i] = Ma[i] - f[i];
    sum += a.leap.acc[i];
    if (s.rows.counts(i)) work += 0.5 * (a.fext0[i] + a.fext[i]) * a.du[i];
  }
  a.leap.work += bound ? work + work_of_grid(p, a, f) : work;
  if (bound && !dof_all(s, still_planes(s, a.leap.acc))) {
    a.leap.leap_grid = leap_of_free(s, a.leap.acc);
  } else {
    a.leap.leap_grid = leap_of_grid(s, a.leap.acc, f);         // f = M a
  }
  return dof_all(s, std::isfinite(sum)) ? Status(STATUS_OK) : BAD_NUMBER;
}

Failure explicit_nodes(Problem& p, Attempt& a)
{
  State& st     = p.st;
  const Dofs& s = p.dofs;
  a.cM = scheme_of(a.step).mass(a.step, a.dt);
  const bool plane = s.rows.dim == 2, on_grid = step_on_grid(p.d, s);
  if (plane) leap_nodes<2>(s, st.n, a);
  else leap_nodes<3>(s, st.n, a);
  if (on_grid) leap_grid(s, a);
  Failure failure = assem_move(p.m, p.d, s, a.du, a.t0, a.t1, st, a.jumps);
  if (failure.ok()) failure = assem_internal(p.m, p.d, s, a.mode, a.jumps, st, a.fint, nullptr, a.energy);
  if (failure.ok()) step_close(p, a);
  if (failure.ok()) failure = assem_loads(p.m, p.d, s, st, a.step, a.load, p.warned, a.fext);
  if (failure.ok()) {
    const bool finite = plane ? accelerate_nodes<2>(s, st.rf, st.n, a, st.np1)
                              : accelerate_nodes<3>(s, st.rf, st.n, a, st.np1);
    if (on_grid) failure = accelerate_grid(p, a);
    if (!sum_work(p, finite, a)) return BAD_NUMBER;
  }
  st.log.iterations = 1;
  if (failure.ok()) assem_share_bonds(p.st, p.m.dim, a.jumps);
  return failure;
}

// M a - f at t(n+1), where anything is prescribed; false: a number is not finite
bool reactions(const Problem& p, const RealVec& f, Attempt& a)
{
  const Dofs& s     = p.dofs;
  const bool lumped = !step_on_grid(p.d, s);
  const double sum  = std::accumulate(a.leap.acc.begin(), a.leap.acc.end(), 0.0);
  if (!dof_all(s, std::isfinite(sum))) return false;
  if (s.bound.free && !s.bound.tie.any && s.bound.corner_support.empty()) {
    a.R.assign(s.rows.neq(), 0.0);
    return true;
  }
  if (lumped) a.R = a.leap.acc;
  else mass_multiply(s, a.leap.acc, a.R);
  for (int i = 0; i < s.rows.neq(); ++i)
    a.R[i] = (lumped ? s.mass.lumped[i / s.rows.dim] : 1.0) * a.R[i] - f[i];
  if (!s.mass.damped) return true;
  RealVec Ca;                  // f has the damping of the mid-increment velocity
  damping_multiply(s, a.leap.acc, Ca);
  for (int i = 0; i < s.rows.neq(); ++i) a.R[i] += 0.5 * a.dt * Ca[i];
  return true;
}

}  // namespace

double step_leap_of_grid(const Problem& p, const RealVec& acc)
{
  return dof_total(p.dofs, leap_of_free(p.dofs, acc));
}

// ---------------------------------------------------------------------------
// step_explicit : one increment of central differences                            doc/theory.md 6.8
// ---------------------------------------------------------------------------
Failure step_explicit(Problem& p, Attempt& a)
{
  const Dofs& s = p.dofs;
  if (a.step.bulk()) {
    a.bulk      = {a.step.bulk_linear, a.step.bulk_quadratic, a.dt};
    a.mode.bulk = &a.bulk;
  }
  const bool on_grid = step_on_grid(p.d, s);
  a.leap.plain = !s.bound.tie.any && !s.mass.damped && !step_grid_rubs(p.m);
  if (!on_grid)                          // memory of earlier increments
    for (RealVec* x : {&a.vgrid, &a.agrid, &a.leap.acc}) x->clear();
  // 1. velocity and acceleration at t(n)
  rigid_arms(p.m, p.st.n.u, p.dofs.bound.tie);
  Failure failure = step_turn(p);
  if (failure.ok() && (on_grid || !a.leap.plain)) failure = step_motion_begin(p, a);
  if (!failure.ok()) return failure;
  if (!on_grid && p.st.ledger.leap_grid != 0.0) {      // its last point is gone
    ledger_leap(s, 0.0, p.st);
    p.st.ledger.leap_grid = 0.0;
  }
  ledger_leap(s, a.dt, p.st);
  if (a.leap.plain) return explicit_nodes(p, a);
  RealVec f;
  // 2. displacement, by the mid-increment velocity                                           (6.28)
  for (int i = 0; i < s.rows.neq(); ++i)
    a.du[i] = s.bound.fixed[i] == DOF_FIXED ? s.bound.target[i]
        : a.dt * (a.vgrid[i] + 0.5 * a.dt * a.agrid[i]);
  tie_follow(s, true, a.du);
  rigid_leap(p.m, p.st.n.u, s, a.du);
  // 3. forces at t(n+1) and the acceleration                                                 (6.29)
  failure = form_forces(p, a, f);
  if (!failure.ok()) return failure;
  a.leap.acc = a.agrid;
  for (int i = 0; i < s.rows.neq(); ++i)
    if (s.bound.fixed[i] == DOF_FIXED) a.leap.acc[i] = (s.bound.rate[i] - a.vgrid[i]) / a.dt;
  failure = accelerations_at_end(p, a, f);
  if (!failure.ok()) return failure;
  if (step_grid_rubs(p.m)) {
    RealVec v(a.vgrid);
    for (int i = 0; i < s.rows.neq(); ++i) v[i] += 0.5 * a.dt * a.agrid[i];
    a.leap.friction = a.dt * step_grid_friction(p, f, v, a.dt, a.leap.acc);
  }
  // 4. reactions: the residual, as in an implicit increment
  if (!reactions(p, f, a)) return BAD_NUMBER;
  tie_force(s, a.R);
  if (on_grid) a.leap.work = work_of_grid(p, a, f);
  p.st.ledger.leap_grid = on_grid ? step_leap_of_grid(p, a.leap.acc) : 0.0;
  p.st.log.iterations = 1;
  assem_share_bonds(p.st, p.m.dim, a.jumps);
  return STATUS_OK;
}
