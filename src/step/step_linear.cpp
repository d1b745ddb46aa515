#include <algorithm>
#include <cmath>

#include "base/timer.h"
#include "step/step.h"

namespace {

// sqrt(energy) of the error of the last correction, relative to the largest correction. Histories differ by
// 7e-8 with 3e-5 here and 3e-4 for ACCEPT  (test: speed/reuse)
const double FINAL  = 3e-10;
// the same, accepted if the correction turns out to be the last; nearly all corrections reach FINAL (no test)
const double ACCEPT = 3e-9;
// Time only, not digits: reduction in iterations that the last increment did not have (8.6); iterations after
// which tangents are factorised (theory 8.3)  (no test)
const double FIRST_REDUCTION = 1e-6;
const int SLOW_ITERATIONS = 8;
// predicted residual, relative to the tolerance, to reuse a tangent (8.11)  (no test)
const double REUSE_PART   = 0.1;
// A tangent is kept while an iteration with it reduces the residual to this part (8.18). After a failure
// within KEPT_SOON solutions it waits for increments, twice as many each time, KEPT_PAUSE at most: time only
// (no test)
const double KEPT_RATIO = 0.02;
const int KEPT_SOON = 4, KEPT_PAUSE = 64;
// increments after which (8.19) measures again  (no test)
const int BEYOND_EVERY = 8;
// relative residual with slip  (no test)
const double SLIP_TOL     = 1e-6;
// relative residual of each solution with the symmetric matrix, digits of all of them together: time only
// (no test)
const double ROUGH_TOL    = 1e-2;
const double ROUGH_DIGITS = 9.0;
// Equations in space from which on iterative solutions are faster than a factorisation. Measured:
// speed/contact_static.inp: n = 6 (5100 equations) 2.9 s for 2.0, n = 10 (11 500) 4.7 s for 7.1  (no test)
const int ROUGH_FROM = 8000;

// the last iteration reduced the residual so much that the same reduction ends this one safely (8.11)
// Not in statics, where a soft mode has a large error with a small residual.
bool near_tangent(const RealVec& gain, const Attempt& a, int it, double residual, double accepted)
{
  if (a.cM == 0.0 || it == 1 || it - 2 >= static_cast<int>(gain.size()))
    return false;
  return residual * gain[it - 2] <= REUSE_PART * accepted;
}

// required reduction of the linear residual (8.6): a third of that of Newton's method in the same iteration
// of the last increment; full accuracy if that iteration was the last
double reduction(const RealVec& gain, int it, double residual, double accepted)
{
  if (it > static_cast<int>(gain.size())) return FIRST_REDUCTION;
  const double g = gain[it - 1];
  if (residual * g <= accepted) return FINAL;
  return std::min(std::max(0.3 * g, 1e-8), 1e-2);
}

// the same where the part of the residual that remains with an exact solution is known (8.19): in the last
// iteration the error of the solution is 0.4 of that part; before, the next iteration can be the last
double shared_reduction(const RealVec& beyond, int it, double residual, double largest, double accepted)
{
  const double part = beyond[it - 1], left = std::min(KEPT_PART * accepted, ACCEPT * largest) / residual;
  if (part <= 0.8 * left) return std::max(FINAL, 0.4 * part);
  const double next = it < static_cast<int>(beyond.size()) ? beyond[it] : part;
  return std::min(std::max(0.3 * part, std::min(std::sqrt(left), 0.7 * left / next)), 1e-2);
}

// do points, bonds, contact or broken elements contribute to the tangent?
bool has_local(const Problem& p)
{
  const auto opens = [](const FractureDef& f) { return f.criterion == CRITERION_COHESIVE; };
  return p.st.points.npoint_all() || p.st.bonds.nbond_all() || p.st.frac.neroded > 0 ||
         std::any_of(p.m.fracture.begin(), p.m.fracture.end(), opens);
}

// is the part of intact elements stored? Collective
bool part_stored(const Dofs& s)
{
  return dof_all(s, s.pattern.whole.size() == s.pattern.A.val.size());
}

// may the tangent be kept?                                                              (8.18)
bool keeps_tangents(const Problem& p, const Attempt& a)
{
  return a.cM != 0.0 && p.m.solver.reuse && !a.newton.unsymmetric_flow &&
         p.dofs.rows.neq_all() >= SMALL_SYSTEM;
}

// step_supports_fix, evaluated once for each set of supports
bool supported(Problem& p)
{
  KnownRegular& h = p.newton.regular;
  if (!dof_all(p.dofs, h.pattern == p.dofs.pattern.number && h.fixed == p.dofs.bound.fixed)) {
    h.pattern = p.dofs.pattern.number;
    h.fixed   = p.dofs.bound.fixed;
    h.good    = !p.st.points.npoint_all() && !p.st.bonds.nbond_all() &&
                step_supports_fix(p.m, p.d.el, p.dofs);
  }
  return h.good;
}

// positions of the nodes of the rows, of the grid at t(n), for rigid motions                 (8.12)
RealVec row_positions(const Problem& p)
{
  const Dofs& s = p.dofs;
  const int dim = s.rows.dim;
  RealVec position(s.rows.neq());
  for (int r = 0; r < s.rows.nfe; ++r)
    for (int i = 0; i < dim; ++i)
      position[r * dim + i] = p.m.mesh.X[3 * s.rows.node_of_row[r] + i] +
          p.st.np1.u[s.rows.node_of_row[r] * dim + i];
  const ActiveGrid& grid = p.d.grid;
  for (int g = 0; g < grid.nnode; ++g) {
    double x[3];
    grid_unknown_position(p.m, p.st.points, p.st.n.uc, grid, g, x);
    const int c = grid_corner(p.st.points, grid.key[g]);
    for (int i = 0; i < dim; ++i)
      position[(s.rows.nfe + g) * dim + i] =
          c < 0 ? x[i] : p.st.points.Xc[c * dim + i] + p.st.n.uc[c * dim + i];
  }
  return position;
}

// 1 / diag where it is positive and the row is owned here, else 0
RealVec inverse_diagonal(const Dofs& s, const RealVec& diag)
{
  RealVec inverse = dof_own(s, diag);
  for (double& d : inverse) d = d > 0.0 ? 1.0 / d : 0.0;
  return inverse;
}

// (A + E) x = f, E: unsymmetric part of slipping contact; preconditioned by A^-1 to few digits        (6.23)
Status solve_slipping(Problem& p, const Attempt& a, const RealVec& pending, SolveTask& task, LinearSystem& l)
{
  const Dofs& s  = p.dofs;
  Solver& solver = p.newton.solver;
  SlipTangent slip;
  if (a.newton.slips) assem_slip(p.m, p.d.pairs, a.mode, a.jumps, p.st, s, slip);
  if (!slip.any) return solve_system(solver, s.pattern.A, task, l.f, l.dx);
  RealVec y;
  slip_multiply(slip, p.d.pairs, s, pending, y);
  for (int i = 0; i < s.rows.neq(); ++i) l.f[i] -= y[i];
  const double eta = std::min(task.eta, SLIP_TOL);
  task.exact  = task.exact || p.m.dim == 2 || s.rows.neq_all() < ROUGH_FROM;
  task.eta    = ROUGH_TOL;
  task.digits = ROUGH_DIGITS;
  task.energy = task.residual = 0.0;
  double start = -1.0;         // f M^-1 f
  SlipSystem system;
  system.weight   = inverse_diagonal(s, l.diag);
  system.multiply = [&](const RealVec& x, RealVec& Ax) {
    sys_multiply(s.pattern.A, x, Ax);
    sys_sum(s.pattern.A, Ax);
    slip_multiply(slip, p.d.pairs, s, x, y);
    for (int i = 0; i < s.rows.neq(); ++i) Ax[i] += y[i];
  };
  system.precondition = [&](const RealVec& v, RealVec& z) {
    const Status status = solve_system(solver, s.pattern.A, task, v, z);
    if (start < 0.0 && status == STATUS_OK)
      start = std::fabs(dof_dot(s, v, z)) * step_product(l.f, l.f, system.weight);
    return status;
  };
  double left;
  const Status status = step_slip(system, l.f, eta, l.dx, left);
  solver.left = left * std::sqrt(std::max(start, 0.0));
  return status;
}

}  // namespace

bool step_same_system(const ReusedTangent& z, const Dofs& dofs, const Attempt& a)
{
  const auto same = [](double before, double now) { return std::fabs(before - now) <= 1e-12 * now; };
  return (z.on || z.keeps) && z.pattern == dofs.pattern.number && z.mode.cD() == a.mode.cD() &&
         same(z.mode.rate, a.mode.rate) && same(z.cM, a.cM) && same(z.cC, a.cC) &&
         dof_all(dofs, z.fixed == dofs.bound.fixed);
}

void step_tangent(Problem& p, const Attempt& a, int it, double residual, double accepted, const RealVec& R,
                  const RealVec& pending, LinearSystem& l)
{
  Dofs& s = p.dofs;
  ReusedTangent& z = p.newton.tangent;
  if (it == 1 && z.wait > 0) {
    --z.wait;
    z.keeps = false;
  }
  z.keeps = dof_all(s, z.keeps && z.broken == p.st.frac.neroded && z.made == p.d.grid.made);
  const bool fits = step_same_system(z, s, a), same = z.on && fits, kept = z.keeps && fits;
  // material that breaks or touches changes from iteration to iteration: its part is formed again
  const bool local = kept && has_local(p), renews = local && part_stored(s);
  // the secants of smaller openings bound the energy as well
  const bool keeps = l.secant && a.mode.crack == CRACK_SECANT;
  l.secant = a.mode.crack == CRACK_SECANT;
  const bool stay = same || keeps || (kept && !local) ||
                    (p.m.solver.reuse && near_tangent(p.newton.gain, a, it, residual, accepted));
  l.f.resize(s.rows.neq());
  for (int i = 0; i < s.rows.neq(); ++i) l.f[i] = -R[i];
  const auto targets_reached = [&] {
    return dof_all(s, std::all_of(pending.begin(), pending.end(), [](double x) { return x == 0.0; }));
  };
  if (stay && (dof_all_free(s) || targets_reached())) {
    for (int i = 0; i < s.rows.neq(); ++i)
      if (s.bound.fixed[i]) l.f[i] = 0.0;
    timer_skip(PHASE_TANGENT);
    ++(same ? z.same : kept ? z.kept : z.near);
    return;
  }
  const long number = s.pattern.tangent;
  const bool stores      = !s.rows.split && keeps_tangents(p, a) && has_local(p);   // on ranks memory counts
  const TangentPart part = renews ? TANGENT_LOCAL : stores ? TANGENT_KEPT : TANGENT_ALL;
  assem_tangent(part, p.m, p.d, a.mode, a.cM, a.cC, a.jumps, p.st, s);
  if (same) s.pattern.tangent = number;
  sys_diagonal(s.pattern.A, l.diag);
  l.whole.clear();
  if (s.bound.tie.any) {
    l.whole = l.diag;
    tie_matrix(s);
    sys_diagonal(s.pattern.A, l.diag);
  }
  if (a.arc.on) step_arc_force(s, a.arc, l.g);
  assem_constrain(s, l.diag, pending, l.f);
  if (renews) {
    ++z.kept;
    return;
  }
  z.on     = a.newton.linear && p.m.solver.reuse;
  z.keeps  = !z.on && keeps_tangents(p, a);
  z.broken = p.st.frac.neroded;
  z.made   = p.d.grid.made;
  z.age    = 0;
  if (!z.on && !z.keeps) return;
  z.pattern = s.pattern.number;
  z.cM      = a.cM;
  z.cC      = a.cC;
  z.mode    = a.mode;
  z.fixed   = s.bound.fixed;
}

namespace {

// accuracy and properties of the system of iteration it
SolveTask solve_task(Problem& p, const Attempt& a, int it, double residual, double accepted,
                 const LinearSystem& l)
{
  const Dofs& s = p.dofs;
  SolveTask task{s.rows.row_key};
  task.stamp    = s.pattern.tangent;
  task.pattern  = s.pattern.number;
  const RealVec& beyond = p.newton.beyond;
  const ReusedTangent& z = p.newton.tangent;
  const bool known = z.keeps && z.age > 0 && it <= static_cast<int>(beyond.size());
  task.eta      = known ? shared_reduction(beyond, it, residual, l.residual, accepted)
                        : reduction(p.newton.gain, it, residual, accepted);
  task.repeats  = z.keeps;
  task.residual = 0.01 * accepted;
  // a nearly singular tangent needs a preconditioner that is exact there
  const bool singular = a.newton.singular;
  task.energy = (singular ? 0.5 * ACCEPT : FINAL) * l.energy;
  task.broken = singular && !a.newton.opens;
  task.exact  = it > SLOW_ITERATIONS || a.arc.on;
  // dynamics too: the grid mass may be singular in modes that no corner sees  (3.14)
  p.newton.solver.null_pivot_row = singular || (a.cM != 0.0 && p.d.grid.of_all.nodes) ? s.rows.nfe : -1;
  task.inertia   = a.cM != 0.0;
  task.known_regular = p.newton.solver.nfactor == 0 && s.rows.neq_all() >= SMALL_SYSTEM && p.m.dim == 3 &&
                  (task.inertia || (!singular && supported(p)));
  task.digits = -std::log10(std::max(task.eta, FINAL * l.residual / residual));
  task.plain  = !p.st.points.npoint_all() && !p.st.bonds.nbond_all() && !p.d.fm.on;
  if (!task.inertia || p.m.solver.kind == SOLVER_AMG) task.positions = [&p] { return row_positions(p); };
  return task;
}

}  // namespace

Failure step_solve(Problem& p, const Attempt& a, int it, double residual, double accepted,
                   const RealVec& pending, LinearSystem& l)
{
  const Dofs& s = p.dofs;
  l.residual    = std::max(l.residual, residual);
  SolveTask task  = solve_task(p, a, it, residual, accepted, l);
  const Status status = solve_slipping(p, a, pending, task, l);
  if (status != STATUS_OK) return status;
  l.own_energy = 0.0;
  const double *f = l.f.data(), *dx = l.dx.data();
  if (!s.rows.split) l.own_energy = sum_terms(s.rows.neq(), [=](size_t i) { return f[i] * dx[i]; });
  for (int i = 0; i < s.rows.neq() && s.rows.split; ++i)
    if (s.rows.counts(i)) l.own_energy += f[i] * dx[i];
  for (int i = 0; i < s.rows.neq() && !dof_all_free(s); ++i)
    if (s.bound.fixed[i]) l.dx[i] = pending[i];
  tie_follow(s, false, l.dx);
  return STATUS_OK;
}

Failure step_solve_arc(Problem& p, const Attempt& a, int it, double residual, double accepted,
                       LinearSystem& l)
{
  const Dofs& s       = p.dofs;
  SolveTask task        = solve_task(p, a, it, residual, accepted, l);
  const double left   = p.newton.solver.left;
  const Status status = solve_system(p.newton.solver, s.pattern.A, task, l.g, l.along);
  p.newton.solver.left = left;
  if (status != STATUS_OK) return status;
  for (int i = 0; i < s.rows.neq(); ++i)
    if (s.bound.fixed[i]) l.along[i] = a.arc.support[i];
  tie_follow(s, false, l.along);
  return STATUS_OK;
}

bool step_solved_well(const Solver& solver, const LinearSystem& l)
{
  return solver.left <= ACCEPT * l.energy;
}

void step_gain(NewtonMemory& memory, int it, double gain)
{
  if (it > static_cast<int>(memory.gain.size())) memory.gain.resize(it, FIRST_REDUCTION);
  memory.gain[it - 1] = gain;
}

// ---------------------------------------------------------------------------
// step_judge_tangent : does the tangent serve for further iterations?                     (8.18), (8.19)
// ---------------------------------------------------------------------------
void step_judge_tangent(Problem& p, int it, double before, const RealVec& R, double now)
{
  const Dofs& s    = p.dofs;
  ReusedTangent& z = p.newton.tangent;
  if (!z.keeps || !(before > 0.0)) return;
  RealVec& beyond = p.newton.beyond;
  // it changes slowly
  const bool measure = it > static_cast<int>(beyond.size()) || p.st.log.inc % BEYOND_EVERY == 0;
  RealVec rest(measure ? s.rows.neq() : 0);
  if (measure && dof_all(s, solve_rest(p.newton.solver, rest))) {
    const double square = dof_sum(s, [&](size_t i) {
      const double x = s.bound.fixed[i] ? 0.0 : R[i] + rest[i];
      return x * x;
    });
    if (it > static_cast<int>(beyond.size())) beyond.resize(it, 1.0);
    beyond[it - 1] = std::sqrt(square) / before;
  }
  const bool soon = z.age++ < KEPT_SOON;
  if (now <= KEPT_RATIO * before) {
    if (!soon) z.pause = 0;
    return;
  }
  // the tangent of this iteration itself: contact and broken material are formed again
  if (z.age == 1 && part_stored(s)) return;
  z.keeps = false;
  if (z.age == 1) return;
  z.pause = soon ? std::min(2 * z.pause + 1, KEPT_PAUSE) : 0;
  z.wait  = z.pause;
}
