#include <algorithm>
#include <cmath>
#include <cstdio>

#include "model/scheme.h"
#include "step/step.h"

namespace {

// Lower bounds of the limit of the residual: this part of the force that would stop the fastest mass within
// the increment, and this multiple of the residual of Newton's method. In free flight only round-off remains.
// (no test)
const double MOMENTUM_PART = 1e-8, NEWTON_FACTOR = 10.0;

// A cut aims at the limit with the factor of Abaqus, in quarters of the increment, so that round-off does not
// change it. Cuts that hardly change the residual indicate a jump of the force; after MAX_JUMP_CUTS in a row
// the increment with the jump is short enough (theory 6.7)
// (test: Half.CutsAimAtTheLimit, Half.JumpsEndAfterThreeCuts)
const double CUT = 0.85;
const int MAX_JUMP_CUTS = 3;

// Inertia forces below this part of the largest force are neglected; without it slow motion costs more
// increments  (no test)
const double FORCE_PART = 1e-3;

// Forces within the increment, in balance with inertia
struct Forces {
  RealVec r;                   // [neq] internal force less loads
  double typical = 0.0;        // largest entry at free dofs, or a small part of the largest force
};

double largest(const Dofs& s, const RealVec& f)
{
  double peak = 0.0;
  for (double x : f) peak = std::max(peak, std::fabs(x));
  return dof_largest(s, peak);
}

// largest entry at free dofs
double largest_free(const Dofs& s, const RealVec& R)
{
  double peak = 0.0;
  for (int i = 0; i < s.rows.neq(); ++i)
    if (!s.bound.fixed[i]) peak = std::max(peak, std::isfinite(R[i]) ? std::fabs(R[i]) : HUGE_VAL);
  return dof_largest(s, peak);
}

Forces difference(const Dofs& s, RealVec fint, const RealVec& fext)
{
  Forces f;
  f.typical = FORCE_PART * std::max(largest(s, fint), largest(s, fext));
  f.r.swap(fint);
  for (size_t i = 0; i < f.r.size(); ++i) f.r[i] -= fext[i];
  f.typical = std::max(f.typical, largest_free(s, f.r));
  return f;
}

// linear interpolation from t(n) to the end: bond multipliers, degradation factors
void blend(const RealVec& from, const RealVec& to, double part, RealVec& out)
{
  if (from.size() != to.size()) return;
  for (size_t i = 0; i < to.size(); ++i) out[i] = (1.0 - part) * from[i] + part * to[i];
}

// forces at a part of the increment, du [neq] from t(n); end: state at the end of the increment
Failure forces_at(Problem& p, const Attempt& a, const Level& end, double part, const RealVec& du, Forces& f)
{
  State& st = p.st;
  st.np1    = end;
  blend(st.n.lambda, end.lambda, part, st.np1.lambda);
  blend(st.n.lambda_n, end.lambda_n, part, st.np1.lambda_n);
  blend(st.n.degr, end.degr, part, st.np1.degr);
  const double t = a.t0 + part * a.dt;
  KernelMode mode;
  mode.finite = a.mode.finite;
  Jumps jumps;
  RealVec fint, fext;
  Failure failure = assem_move(p.m, p.d, p.dofs, du, a.t0, t, st, jumps);
  if (failure.ok()) failure = assem_internal(p.m, p.d, p.dofs, mode, jumps, st, fint);
  if (failure.ok())
    failure = assem_loads(p.m, p.d, p.dofs, st, a.step, {t, a.total0 + part * a.dt, 1.0}, p.warned, fext);
  if (failure.ok()) f = difference(p.dofs, std::move(fint), fext);
  return failure;
}

// change of the velocities over the increment                                              [neq]
RealVec velocity_change(const Dofs& s, const Attempt& a)
{
  const Scheme& scheme = scheme_of(a.step);
  RealVec dv(s.rows.neq());
  for (int i = 0; i < s.rows.neq(); ++i)
    dv[i] = s.bound.fixed[i] == DOF_FIXED
              ? s.bound.rate[i] - a.vgrid[i]
              : scheme.grid(a.step, a.dt, a.du[i], a.vgrid[i], a.agrid.empty() ? 0.0 : a.agrid[i]);
  tie_follow(s, false, dv);
  return dv;
}

// displacement from t(n) to the middle: linear acceleration (6.24), supports as prescribed
Failure half_motion(Problem& p, const Attempt& a, const RealVec& dv, RealVec& du)
{
  Dofs& s = p.dofs;
  du.resize(s.rows.neq());
  for (int i = 0; i < s.rows.neq(); ++i) du[i] = 0.5 * a.du[i] - 0.125 * a.dt * dv[i];
  Failure failure =
      dof_constrain(p.m, p.d, p.st, a.step, a.t0, a.t0 + 0.5 * a.dt, s, p.warned);
  for (int i = 0; i < s.rows.neq() && failure.ok(); ++i)
    if (s.bound.fixed[i] == DOF_FIXED) du[i] = s.bound.target[i];
  if (failure.ok()) tie_follow(s, true, du);
  const Failure back = dof_constrain(p.m, p.d, p.st, a.step, a.t0, a.t1, s, p.warned);
  return failure.ok() ? back : failure;
}

// forces at t(n) and t(n+1): those of Newton's method where it evaluates the ends
Failure forces_at_ends(Problem& p, const Attempt& a, const Level& end, Forces& f0, Forces& f1)
{
  const bool known = !a.mode.mid && !model_viscous(p.m), at_start = known && !a.fint0.empty();
  Failure failure;
  if (at_start) f0 = difference(p.dofs, a.fint0, a.fext0);
  else failure = forces_at(p, a, end, 0.0, RealVec(p.dofs.rows.neq(), 0.0), f0);
  if (!failure.ok()) return failure;
  if (known) f1 = difference(p.dofs, a.fint, a.fext);
  else failure = forces_at(p, a, end, 1.0, a.du, f1);
  return failure;
}

// R at half the increment                                                                        (6.24)
Failure half_residual(Problem& p, const Attempt& a, const Level& end, HalfWatch& w, RealVec& R)
{
  const Dofs& s = p.dofs;
  Forces f0, fh, f1;
  RealVec du, damping;
  const RealVec dv = velocity_change(s, a);
  Failure failure  = half_motion(p, a, dv, du);
  if (failure.ok()) failure = forces_at_ends(p, a, end, f0, f1);
  if (failure.ok()) failure = forces_at(p, a, end, 0.5, du, fh);
  if (failure.ok() && step_damps(p)) {
    RealVec v(s.rows.neq());        // velocity at the middle less the mean of the ends
    for (int i = 0; i < s.rows.neq(); ++i)
      v[i] = 1.5 * a.du[i] / a.dt - 0.75 * (2.0 * a.vgrid[i] + dv[i]);
    failure = step_damping(p, a.mode.finite, a.t0, a.dt, v, damping);
  }
  if (!failure.ok()) return failure;
  w.force = std::max(f0.typical, f1.typical);
  R.resize(s.rows.neq());
  for (int i = 0; i < s.rows.neq(); ++i) {
    const double damped = damping.empty() ? 0.0 : damping[i];
    R[i] = (1.0 + a.step.alpha) * (fh.r[i] - 0.5 * (f0.r[i] + f1.r[i]) + damped);
  }
  tie_force(s, R);
  return STATUS_OK;
}

// Reference force of the residual: of this attempt, or the mean over time so far, weighted with the force
// itself                                                                                         (6.25)
double typical_force(const StepClock& c, double dt, double force)
{
  const double impulse = c.impulse + force * dt;
  return impulse > 0.0 ? std::max(force, (c.square + force * force * dt) / impulse) : 0.0;
}

// kinetic energy of bodies at rest after the residual has acted over the increment
double half_energy(const Dofs& s, double dt, const RealVec& R)
{
  double sum = 0.0;
  for (int i = 0; i < s.rows.neq(); ++i)
    if (!s.bound.fixed[i] && s.mass.M_diag[i / s.rows.dim] > 0.0 && s.rows.counts(i))
      sum += R[i] * R[i] / s.mass.M_diag[i / s.rows.dim];
  return 0.5 * dt * dt * dof_total(s, sum);
}

// limit of the largest entry                                                              (6.25), (6.26)
double half_limit(const Problem& p, const Attempt& a, const HalfWatch& w, const RealVec& R)
{
  const StepClock& c = p.st.clock;
  const double part  = a.step.half_part;
  const double noise = std::max(MOMENTUM_PART * largest(p.dofs, a.momentum) / a.dt,
                                NEWTON_FACTOR * largest_free(p.dofs, a.R));
  if (a.step.half_force > 0.0) return std::max(a.step.half_force, noise);
  const double limit = std::max(part * typical_force(c, a.dt, w.force), noise);
  // the residual of an oscillator of this energy reaches limit
  const double energy = half_energy(p.dofs, a.dt, R);
  if (energy <= 0.0) return limit;
  return std::max(limit, w.residual * std::sqrt(8.0 * part * part * part * c.energy / energy));
}

}  // namespace

// ---------------------------------------------------------------------------
// step_half : half-increment residual of a converged attempt                       doc/theory.md (6.24)
// ---------------------------------------------------------------------------
Failure step_half(Problem& p, const Attempt& a, HalfWatch& w)
{
  const Level end = p.st.np1;
  RealVec R;
  const Failure failure = half_residual(p, a, end, w, R);
  p.st.np1 = end;
  if (failure.status == BAD_VALUE) return failure;
  // an element inverts at the middle: infinite residual
  w.residual = failure.ok() ? largest_free(p.dofs, R) : HUGE_VAL;
  if (!std::isfinite(w.residual)) w.force = w.limit = 0.0;
  else w.limit = half_limit(p, a, w, R);
  return STATUS_OK;
}

Failure half_judge(const Step& s, double dt, int cuts, HalfWatch& w)
{
  // does the residual hardly fall with the increment?
  const double fell = w.dt_before > 0.0 ? dt / w.dt_before : 0.0;
  w.kept = w.before > 0.0 && w.residual > 0.5 * (1.0 + fell) * w.before ? w.kept + 1 : 0;
  w.before    = w.residual;
  w.dt_before = dt;
  w.jumps = w.least = false;
  if (w.residual <= w.limit) return STATUS_OK;
  const double quarters = std::floor(4.0 * CUT * std::sqrt(w.limit / w.residual));
  w.shorter = 0.25 * dt * std::min(3.0, std::max(1.0, quarters));
  w.jumps   = w.kept >= MAX_JUMP_CUTS;
  w.least   = !w.jumps && (cuts >= s.ctl.max_cut || w.shorter < s.dt_min);
  if (w.jumps || w.least) return STATUS_OK;
  char text[120];
  std::snprintf(text, sizeof text, "%.4e, the limit is %.4e", w.residual, w.limit);
  return {HALF_RESIDUAL, text};
}
