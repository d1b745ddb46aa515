#include <algorithm>
#include <array>
#include <cmath>

#include "base/timer.h"
#include "mat/law.h"
#include "step/step.h"

namespace {

// Max. bisections of a correction that inverts an element; with fewer the increment is cut
// (test: Half.ResidualOfAnOscillator)
const int MAX_BISECTIONS = 6;
// Line search: max. trials; more with fracture, since broken material kinks the line (P7). Ratio to |g(0)|
// below which no search is needed (6.6); smallest part of the correction, or of the bracket. A1 misses its
// tolerance without a search  (test: patch/a1_bond_default.inp)
const int TRIALS = 4, TRIALS_BROKEN = 6;
const double SEARCH_TOL = 0.8;
const double MIN_PART = 0.1;

// With displacement loading alone there is no force scale at free dofs, and conjugate gradients stop above
// round-off. A residual above this part of the one before stalls  (no test)
const double STALL_RATIO = 0.5;

// residual and its scales                                                           (6.3)
struct Residual {
  RealVec R, inertia, Mdu, Cdu;        // inertia: with damping
  double free_norm = 0.0;      // of R at free dofs
  double external  = 0.0;
  double scale     = 0.0;      // largest of internal, external, inertia force
};

const size_t LANES = 8;         // of a sum, as in sum_terms  (no test)
typedef double FourLanes[4][LANES];

// four sums over i < n in one pass; add(i, l, part) adds the terms of i to lane l of each
template <class Add>
void four_sums(size_t n, double* sum, Add add)
{
  FourLanes part = {};
  const size_t whole = n / LANES * LANES;
  for (size_t i = 0; i < whole; i += LANES)
    for (size_t l = 0; l < LANES; ++l) add(i + l, l, part);
  for (size_t i = whole; i < n; ++i) add(i, 0, part);
  for (int k = 0; k < 4; ++k) {
    sum[k] = 0.0;
    for (double p : part[k]) sum[k] += p;
  }
}

// squared norms of the vectors over owned rows; of the first one over free dofs only. In one pass, each with
// the sums of sum_terms
template <bool SPLIT>
void own_squares(const Dofs& s, const std::array<const RealVec*, 4>& v, double* sum)
{
  const double* x[4] = {v[0]->data(), v[1]->data(), v[2]->data(), v[3]->data()};
  const int* fixed   = s.bound.fixed.data();
  const char* once   = s.rows.once.data();
  four_sums(s.rows.neq(), sum, [&](size_t i, size_t l, FourLanes& part) {
    const bool here = !SPLIT || once[i];
    part[0][l] += fixed[i] || !here ? 0.0 : x[0][i] * x[0][i];
    for (int k = 1; k < 4; ++k) part[k][l] += here ? x[k][i] * x[k][i] : 0.0;
  });
}

// inertia, R and its scales of one rank without damping and equations, in one pass: norm as own_squares
void join_forces(const Attempt& a, const Dofs& s, Residual& b, double* norm)
{
  const double *Mdu = b.Mdu.data(), *g = a.g.data(), *fint = a.fint.data(), *fext = a.fext.data();
  const int* fixed = s.bound.fixed.data();
  double *R = b.R.data(), *inertia = b.inertia.data();
  const double cM = a.cM;
  four_sums(s.rows.neq(), norm, [&](size_t i, size_t l, FourLanes& part) {
    const double f = cM * Mdu[i] - g[i], r = fint[i] - fext[i] + f;
    inertia[i] = f;
    R[i]       = r;
    part[0][l] += fixed[i] ? 0.0 : r * r;
    part[1][l] += fint[i] * fint[i];
    part[2][l] += fext[i] * fext[i];
    part[3][l] += f * f;
  });
}

// fint, M du, on several ranks in one message; fext of loads that follow the body
Failure form_forces(Problem& p, Attempt& a, const RealVec& du, Residual& b)
{
  const Dofs& s    = p.dofs;
  const bool loads = !a.arc.on && assem_has_followers(a.step);
  if (a.cM != 0.0) mass_part(s, du, b.Mdu);
  const Failure failure =
      assem_internal(p.m, p.d, s, a.mode, a.jumps, p.st, a.fint, a.cM != 0.0 ? &b.Mdu : nullptr);
  if (!failure.ok() || !loads) return failure;
  return assem_loads(p.m, p.d, s, p.st, a.step, a.load, p.warned, a.fext);
}

// R from fint, fext and M du
Failure sum_residual(Problem& p, const Attempt& a, const RealVec& du, Residual& b)
{
  const Dofs& s = p.dofs;
  double norm[4];              // in one message
  b.R.resize(s.rows.neq());
  b.inertia.resize(s.rows.neq());
  const bool plain = a.cM != 0.0 && a.cC == 0.0 && !s.bound.tie.any && !s.rows.split;
  if (plain) join_forces(a, s, b, norm);
  else if (a.cM == 0.0) std::fill(b.inertia.begin(), b.inertia.end(), 0.0);
  else
    for (int i = 0; i < s.rows.neq(); ++i) b.inertia[i] = a.cM * b.Mdu[i] - a.g[i];
  if (a.cC != 0.0) {
    damping_multiply(s, du, b.Cdu);
    for (int i = 0; i < s.rows.neq(); ++i) b.inertia[i] += a.cC * b.Cdu[i];
  }
  for (int i = 0; i < s.rows.neq() && !plain; ++i) b.R[i] = a.fint[i] - a.fext[i] + b.inertia[i];
  tie_force(s, b.R);
  const std::array<const RealVec*, 4> forces = {&b.R, &a.fint, &a.fext, &b.inertia};
  if (s.rows.split) own_squares<true>(s, forces, norm);
  else if (!plain) own_squares<false>(s, forces, norm);
  dof_total(s, norm, 4);
  for (double& x : norm) x = std::sqrt(x);
  const double internal = norm[1];
  b.free_norm = norm[0];
  b.external  = norm[2];
  b.scale     = std::max({internal, b.external, norm[3]});
  return std::isfinite(b.free_norm) && std::isfinite(internal + b.external) ? STATUS_OK : BAD_NUMBER;
}

// R(du); moves the state n+1
Failure form_residual(Problem& p, Attempt& a, const RealVec& du, Residual& b)
{
  Failure failure = assem_move(p.m, p.d, p.dofs, du, a.t0, a.t1, p.st, a.jumps);
  if (failure.ok()) failure = form_forces(p, a, du, b);
  return failure.ok() ? sum_residual(p, a, du, b) : failure;
}

// R of the predictor from the forces of the last increment and the kept tangent (6.45); a.jumps and st.np1
// belong to the predictor. false: not possible
bool linear_residual(Problem& p, Attempt& a, Residual& b, Failure& failure)
{
  Dofs& s = p.dofs;
  if (!step_linear_force(p, a)) return false;
  tie_follow(s, true, a.du);
  failure = assem_move(p.m, p.d, s, a.du, a.t0, a.t1, p.st, a.jumps);
  if (failure.ok() && assem_has_followers(a.step))
    failure = assem_loads(p.m, p.d, s, p.st, a.step, a.load, p.warned, a.fext);
  if (!failure.ok()) return true;
  mass_part(s, a.du, b.Mdu);
  failure = sum_residual(p, a, a.du, b);
  return true;
}

// the strain part of the diagonal, through which round-off of F acts. Mass, damping and bonds depend on du
// alone; their large stiffness would hide the loads for a small dt or a large penalty.
RealVec strain_diagonal(const Model& m, const Bonds& bonds, const ActiveGrid& grid, const Dofs& s,
                        const RealVec& diag, double cM, double cC)
{
  RealVec d = diag;
  if (cM != 0.0)
    for (int i = 0; i < s.rows.neq(); ++i) d[i] -= cM * s.mass.M_diag[i / s.rows.dim];
  if (cC != 0.0)
    for (int i = 0; i < s.rows.neq(); ++i) d[i] -= cC * s.mass.C_diag[i];
  RealVec other;               // several ranks: bonds and ghosts of this rank, negative
  const bool ghosts = m.grid.ghost_stiffness > 0.0 || m.grid.ghost_mass > 0.0,
             shared = s.rows.split && (bonds.nbond_all() || ghosts);
  if (shared) other.assign(s.rows.neq(), 0.0);
  RealVec& to = shared ? other : d;
  const DofRows& rows = s.rows;
  const int dim       = rows.dim;
  double C[9];
  for (int b : rows.bond_acts) {
    if (m.bond[bonds.def[b]].kind == BOND_CONTACT) continue;
    bond_stiffness(bonds, dim, b, C);
    for (int k = rows.bond.off[b]; k < rows.bond.off[b + 1]; ++k)
      for (int i = 0; i < dim; ++i)
        to[rows.bond.item[k] * dim + i] -= rows.bond_w[k] * rows.bond_w[k] * C[i * dim + i];
  }
  const ListTable& ghost = grid.ghost;
  for (int q = 0; q < ghost.size(); ++q)
    for (int k = ghost.off[q]; k < ghost.off[q + 1]; ++k)
      for (int i = 0; i < dim; ++i)
        to[(rows.nfe + ghost.item[k]) * dim + i] -= grid.ghost_k[q] * grid.ghost_w[k] * grid.ghost_w[k];
  if (shared) sys_sum(s.pattern.A, other);
  for (size_t i = 0; i < other.size(); ++i) d[i] += other[i];
  return d;
}

}  // namespace

double step_largest_move(const State& st)
{
  double largest = 0.0;
  for (size_t i = 0; i < st.n.u.size(); ++i) largest = std::max(largest, std::fabs(st.np1.u[i] - st.n.u[i]));
  for (size_t i = 0; i < st.n.uc.size(); ++i)
    largest = std::max(largest, std::fabs(st.np1.uc[i] - st.n.uc[i]));
  return largest;
}

namespace {

// force of round-off: the stiffness times 1e-15 of the displacement and of the element size (6.5). Grid
// displacements count up to those of the material: modes that no corner sees may have any size.
double rounding_floor(const Problem& p, const RealVec& diag, const Attempt& a)
{
  const RealVec& du    = a.du;
  const RealVec strain =
      strain_diagonal(p.m, p.st.bonds, p.d.grid, p.dofs, diag, a.cM, a.cC);
  const Ties& t = p.dofs.bound.tie;
  const double largest = p.d.grid.of_all.nodes > 0 ? dof_largest(p.dofs, step_largest_move(p.st)) : 0.0;
  const int grid    = p.dofs.rows.nfe * p.dofs.rows.dim;
  const auto square = [&](int i) {
    const double move = i < grid ? std::fabs(du[i]) : std::min(largest, std::fabs(du[i]));
    const double f    = std::max(0.0, strain[i]) * 2e-15 * p.dofs.rows.h_mean + diag[i] * 1e-14 * move;
    return f * f;
  };
  double sum = 0.0;
  for (size_t i = 0; i < diag.size(); ++i)
    if (p.dofs.rows.counts(i)) sum += square(static_cast<int>(i));
  for (size_t k = 0; k < t.dof.size(); ++k)          // of dependent dofs, at their masters
    for (int q = t.master.off[k]; q < t.master.off[k + 1] && p.dofs.rows.counts(t.dof[k]); ++q)
      sum += t.coef[q] * t.coef[q] * square(t.dof[k]);
  return std::sqrt(dof_total(p.dofs, sum));
}

// residual against the force scale, and both in the energy norm of the diagonal    (6.4)
//   in   stalls   the residual has stopped falling: reactions count in the energy too
bool balanced(const Problem& p, const Attempt& a, const Residual& b, const RealVec& diag, bool stalls)
{
  const Dofs& s  = p.dofs;
  const Controls& c = a.step.ctl;
  const ReusedTangent& z = p.newton.tangent;
  const double part = z.keeps && z.age > 1 ? KEPT_PART : 1.0;
  if (b.free_norm > part * c.tol_force * b.scale) return false;
  // fixed null pivots leave a residual, which is compared with the reactions too (theory 8.1)
  const Solver& solver    = p.newton.solver;
  const bool fixed_pivots = a.cM == 0.0 && solver.null_pivot_row >= 0 && solver.zero_equation >= 0;
  double energy[2] = {};       // of the residual, of the forces
  double least = 0.0;
  // lower bound for broken material, which has hardly any stiffness
  if (a.newton.breaks) {
    for (size_t i = 0; i < diag.size(); ++i)
      if (s.rows.counts(i)) least += diag[i];
    least = dof_total(s, least) * 1e-3 / s.rows.neq_all();
  }
  for (int i = 0; i < s.rows.neq(); ++i) {
    if ((s.bound.fixed[i] && !fixed_pivots && !stalls) || !(diag[i] > 0.0)) continue;
    if (!s.rows.counts(i)) continue;
    const double k = std::max(diag[i], least);
    if (!s.bound.fixed[i]) energy[0] += b.R[i] * b.R[i] / k;
    const double f = std::max({std::fabs(a.fint[i]), std::fabs(a.fext[i]), std::fabs(b.inertia[i])});
    energy[1] += f * f / k;
  }
  dof_total(s, energy, 2);
  return energy[0] <= c.tol_energy * energy[1] || energy[1] == 0.0;
}

bool by_rounding(const Problem& p, const Attempt& a, const Residual& b, const LinearSystem& l)
{
  return b.free_norm <= rounding_floor(p, l.whole.empty() ? l.diag : l.whole, a);
}

bool converged(const Problem& p, const Attempt& a, const Residual& b, const LinearSystem& l, bool rounds,
               bool stalls)
{
  return balanced(p, a, b, l.diag, stalls) || (rounds && by_rounding(p, a, b, l));
}

// largest part of the correction that keeps every det F positive
Failure back_off(Problem& p, Attempt& a, const RealVec& du, const RealVec& dx, RealVec& trial, Residual& b,
                 double& s)
{
  Failure failure = BAD_JACOBIAN;
  for (int k = 0; k < MAX_BISECTIONS && !failure.ok(); ++k, s *= 0.5) {
    for (size_t i = 0; i < du.size(); ++i) trial[i] = du[i] + s * dx[i];
    failure = form_residual(p, a, trial, b);
    if (failure.ok()) return failure;
  }
  return failure;
}

// line search on dx . R = 0 when the full correction overshoots                    (6.6)
Failure line_search(Problem& p, Attempt& a, const RealVec& du, const RealVec& dx, double g0, RealVec& trial,
                    Residual& b, double& s)
{
  double g1 = dof_dot(p.dofs, dx, b.R), lo = 0.0, glo = g0, hi = s, ghi = g1;
  // opening and closing broken material kinks the line: a smaller part may be the right one
  const int trials = a.newton.breaks ? TRIALS_BROKEN : TRIALS;
  for (int k = 0; k < trials && std::fabs(g1) > SEARCH_TOL * std::fabs(g0); ++k) {
    double next = glo * ghi < 0.0 ? lo - glo * (hi - lo) / (ghi - glo) : 0.5 * (lo + hi);
    next = std::min(std::max(next, a.newton.breaks ? lo + MIN_PART * (hi - lo) : MIN_PART), 1.0);
    for (size_t i = 0; i < du.size(); ++i) trial[i] = du[i] + next * dx[i];
    const Failure failure = form_residual(p, a, trial, b);
    if (!failure.ok()) return failure;
    s  = next;
    g1 = dof_dot(p.dofs, dx, b.R);
    if (g1 * glo > 0.0) { lo = next; glo = g1; } else { hi = next; ghi = g1; }
  }
  return STATUS_OK;
}

// R of the predictor; if free flight inverts an element, from rest
Failure begin_at_predictor(Problem& p, Attempt& a, Residual& b)
{
  tie_follow(p.dofs, true, a.du);
  Failure failure = form_residual(p, a, a.du, b);
  if (failure.status == BAD_JACOBIAN) {
    std::fill(a.du.begin(), a.du.end(), 0.0);
    tie_follow(p.dofs, true, a.du);
    failure = form_residual(p, a, a.du, b);
  }
  if (failure.ok() && a.cM == 0.0 && a.fint0.empty()) a.fint0 = a.fint;     // statics start from du = 0
  return failure;
}

// R of the guess; guessed: its energy                                              (6.14)
Failure begin_at_guess(Problem& p, Attempt& a, Residual& b, double& guessed)
{
  const RealVec R0 = b.R;
  a.du.swap(a.start.guess);
  a.start.guesses = false;
  tie_follow(p.dofs, true, a.du);
  const Failure failure = form_residual(p, a, a.du, b);
  if (!failure.ok()) return failure;
  for (int i = 0; i < p.dofs.rows.neq(); ++i)
    if (p.dofs.rows.counts(i)) guessed += (b.R[i] - R0[i]) * a.du[i];
  guessed = std::fabs(dof_total(p.dofs, guessed));
  return STATUS_OK;
}

// R of the predictor or guess; loads that do not follow the body are formed once
//   out   guessed   energy of the guess;   linear   R is that of the kept tangent                (6.45)
Failure begin_residual(Problem& p, Attempt& a, Residual& b, double& guessed, bool& linear)
{
  Failure failure;
  if (!a.arc.on && !assem_has_followers(a.step))
    failure = assem_loads(p.m, p.d, p.dofs, p.st, a.step, a.load, p.warned, a.fext);
  if (failure.ok()) linear = linear_residual(p, a, b, failure);
  a.start.left = true;
  if (failure.ok() && !linear) failure = begin_at_predictor(p, a, b);
  if (failure.ok() && a.start.guesses) failure = begin_at_guess(p, a, b, guessed);
  return failure;
}

// remaining displacements of prescribed dofs; true: all have reached their targets
bool find_pending(const Dofs& s, const RealVec& du, RealVec& pending)
{
  bool reached = true;
  if (dof_all_free(s)) return true;
  for (int i = 0; i < s.rows.neq(); ++i) {
    pending[i] = s.bound.fixed[i] == DOF_FIXED ? s.bound.target[i] - du[i] : 0.0;
    reached    = reached && std::fabs(pending[i]) <= 1e-14 * std::fabs(s.bound.target[i]);
  }
  return dof_all(s, reached);
}

bool targets_reached(const Dofs& s, const RealVec& du)
{
  bool reached = true;
  if (dof_all_free(s)) return true;
  for (int i = 0; i < s.rows.neq(); ++i)
    if (s.bound.fixed[i] == DOF_FIXED)
      reached = reached && std::fabs(s.bound.target[i] - du[i]) <= 1e-12 * std::fabs(s.bound.target[i]);
  return dof_all(s, reached);
}

// du += part * dx, part < 1 if an element inverts or the residual overshoots
//   in   search   a line search is allowed;   g0 = dx R at free dofs
//   out  trial    du before
Failure correct(Problem& p, Attempt& a, const RealVec& dx, double g0, bool search, RealVec& trial,
                Residual& b, double& part)
{
  Failure failure = back_off(p, a, a.du, dx, trial, b, part);
  if (failure.ok() && search && part == 1.0 && b.free_norm > a.step.ctl.tol_force * b.scale)
    failure = line_search(p, a, a.du, dx, g0, trial, b, part);
  if (failure.ok()) a.du.swap(trial);
  return failure;
}

// dx R at free dofs, and with it the energy of the correction; whole: dx solves for -R
double first_slope(const Dofs& s, const RealVec& R, bool whole, LinearSystem& l)
{
  double sum[2] = {whole ? -l.own_energy : 0.0, l.own_energy};
  for (int i = 0; i < s.rows.neq() && !whole; ++i)
    if (!s.bound.fixed[i] && s.rows.counts(i)) sum[0] += l.dx[i] * R[i];
  dof_total(s, sum, 2);
  l.energy = std::max(l.energy, std::sqrt(std::fabs(sum[1])));
  return sum[0];
}

// Cohesive cracks: where the tangent does not reduce the residual, its correction is undone, and a secant
// stiffness that lowers the energy is used, for twice as many iterations each time          (6.38)
struct Descent {
  int left = 0, next = 4;      // iterations with the secant: left, next time
};
// reduction of the residual to accept the tangent  (no test)
const double FALL_RATIO = 0.7;
// factor of the secant correction: the energy falls below 2. C3 with h = 10 converges with it, not with 1 or
// Anderson's method  (test: strength/l_panel.inp), with h=10
const double RELAXATION = 1.8;

// Statics with loads that follow the body, whose stiffness the matrix does not have: first iteration that
// Anderson's method corrects, and the residual over its scale below which it does. Before, Newton's method
// falls fast enough; above, stress/last_bit.inp does not converge  (test: analytic/pressed_rubber.inp)
const int FOLLOWS_FROM = 3;
const double FOLLOWS_BELOW = 0.01;

// the secant has been tried this often in vain: cracks that have begun stay open  (no test)
const int MANY_ITERATIONS = 32;

// Cracks on lines that have begun in this iteration count as begun at the start of the increment: where they
// begin, and where they are pressed before, the traction changes by a jump (2.36c), over which iterations may
// hop for ever
void keep_open(const Elements& el, State& st)
{
  for (const ElemBlock& b : el.block) {
    if (!b.opens() || b.law.kind != LAW_COHESIVE) continue;
    for (int e : b.elem) {
      if (!elem_cracked(st.np1, e) || el.broken(e) >= 0) continue;
      for (int g = el.gauss_of[e]; g < el.gauss_of[e + 1]; ++g)
        if (crack_begin(b.law, history_at(st.np1.he, el.history, g), history_at(st.n.he, el.history, g)))
          st.n.cracked[e] = 1;
    }
  }
}

//   in   before   residual of the last iteration; 0: supports have moved since
//        du       before the correction;   advance  RIKS: of the load time in it
Failure descend(Problem& p, Attempt& a, double before, double advance, RealVec& du, Descent& d, Residual& b)
{
  if (a.mode.crack == CRACK_SECANT) {
    a.mode.crack = --d.left > 0 ? CRACK_SECANT : CRACK_TANGENT;
    return STATUS_OK;
  }
  if (before == 0.0 || b.free_norm <= FALL_RATIO * before) return STATUS_OK;
  a.mode.crack = CRACK_SECANT;
  d.left = d.next;
  d.next = 2 * d.next;
  if (b.free_norm <= before) return STATUS_OK;
  a.du.swap(du);
  if (a.arc.on) step_arc_load(p, a, -advance);
  return form_residual(p, a, a.du, b);
}

// RIKS: changes loads and correction so that the extensions reach their prescribed value              (6.39)
Failure follow_arc(Problem& p, Attempt& a, int it, double residual, double accepted, LinearSystem& l,
                   double& advance)
{
  const Failure failure = step_solve_arc(p, a, it, residual, accepted, l);
  if (!failure.ok()) return failure;
  advance = step_arc_advance(p, a, it, l.dx, l.along);
  for (int i = 0; i < p.dofs.rows.neq(); ++i) l.dx[i] += advance * l.along[i];
  step_arc_load(p, a, advance);
  return STATUS_OK;
}

// judges tangent and predictor by the correction of iteration it, of which part was applied
//   in   linear   the first residual was that of the kept tangent;   before   norm of R before it
void judge_correction(Problem& p, int it, bool linear, double before, double part, const Residual& b)
{
  if (before > 0.0) step_gain(p.newton, it, b.free_norm / before);
  if (it == 1 && linear) step_judge_linear(p, b.free_norm / before, b.free_norm / b.scale);
  if (part == 1.0) step_judge_tangent(p, it, before, b.R, b.free_norm);
  else p.newton.tangent.keeps = false;
}

void report_iteration(StepLog& log, int it, const Residual& b, double energy, double part)
{
  log.iterations = it;
  if (it > 0) {
    log.residual = b.free_norm;
    log.scale    = b.scale;
  }
  out_listing_iteration(log.step, log.inc, it, b.free_norm, b.scale, energy, part);
}

// Data of the iterations
struct Iterations {
  Residual b;
  LinearSystem l;
  Secants secants;
  Descent descent;
  RealVec trial, pending;
  double guessed = 0.0;        // energy of the guess
  bool linear    = false;      // R of the predictor is that of the kept tangent
  double least   = 1e300;      // norm of R so far
  int stale      = 0;          // iterations since least
  explicit Iterations(ReusedTangent& t) : l(t) {}
};

// One iteration
struct Correction {
  int it;
  bool reached;                // prescribed dofs have reached their targets
  double before;               // norm of R
  double accepted;             // norm of R that is accepted
  double advance = 0.0;        // RIKS: of the load time
  double g0      = 0.0;        // dx R at free dofs
};

// Is the predictor the solution? Loads below the round-off floor are solved for once; without loads the floor
// ends the iterations
bool predictor_solves(const Problem& p, const Attempt& a, const Correction& c, const Iterations& n)
{
  if (c.it > 1 || !c.reached || n.guessed != 0.0 || n.linear || a.arc.on) return false;
  const bool still = n.b.external == 0.0;
  return a.start.predicted == 0.0 ? converged(p, a, n.b, n.l, still, false)
                                  : still && by_rounding(p, a, n.b, n.l);
}

// 3. solve
Failure find_correction(Problem& p, Attempt& a, Correction& c, Iterations& n)
{
  LinearSystem& l = n.l;
  Failure failure = step_solve(p, a, c.it, c.before, c.accepted, n.pending, l);
  if (!failure.ok()) return failure;
  const bool follows = a.cM == 0.0 && !a.arc.on && assem_has_followers(a.step);
  const bool near    = c.it >= FOLLOWS_FROM && n.b.free_norm < FOLLOWS_BELOW * n.b.scale;
  const bool secant  = a.newton.unsymmetric_flow || (follows && near);
  if (secant && c.reached) step_secant(n.secants, a.du, dof_own(p.dofs, l.diag), l.dx);
  if (a.mode.crack == CRACK_SECANT && c.reached)
    for (double& x : l.dx) x *= RELAXATION;
  if (a.arc.on) failure = follow_arc(p, a, c.it, c.before, c.accepted, l, c.advance);
  if (!failure.ok()) return failure;
  const bool whole = c.reached && !a.arc.on && !secant && a.mode.crack != CRACK_SECANT && !a.newton.slips;
  c.g0 = first_slope(p.dofs, n.b.R, whole, l);
  return c.it == 1 && n.guessed > 0.0 && std::fabs(c.g0) > n.guessed ? NOT_CONVERGED   // bad guess (6.14)
                                                                     : STATUS_OK;
}

// 4. correct                                                                         (6.6)
//   out   part   of the correction
Failure take_correction(Problem& p, Attempt& a, const Correction& c, Iterations& n, double& part)
{
  const bool search = a.step.ctl.line_search && c.reached && !a.arc.on && n.stale >= a.newton.patience;
  Failure failure = correct(p, a, n.l.dx, c.g0, search, n.trial, n.b, part);
  if (failure.ok() && a.arc.on && part < 1.0) failure = BAD_JACOBIAN;
  if (!failure.ok() || !a.newton.opens) return failure;
  // RIKS: the first residual belongs to the last load
  const bool judged = c.reached && (c.it > 1 || !a.arc.on);
  failure = descend(p, a, judged ? c.before : 0.0, c.advance, n.trial, n.descent, n.b);
  if (n.descent.next >= MANY_ITERATIONS && !a.start.guesses)
    keep_open(p.d.el, p.st);                         // a failed guess leaves t(n) as it is
  return failure;
}

Failure accept_solution(Problem& p, Attempt& a, const Residual& b)
{
  a.R = b.R;
  assem_share_bonds(p.st, p.m.dim, a.jumps);
  return STATUS_OK;
}

}  // namespace

// ---------------------------------------------------------------------------
// step_newton : du of the attempt, from the predictor or the guess                 doc/theory.md 6.2
// ---------------------------------------------------------------------------
Failure step_newton(Problem& p, Attempt& a)
{
  const Dofs& s = p.dofs;
  StepLog& log  = p.st.log;
  TimerAround timer(PHASE_VECTORS);
  Iterations n(p.newton.tangent);
  Residual& b = n.b;
  n.pending.resize(dof_all_free(s) && !a.newton.slips ? 0 : s.rows.neq());
  const Borrowed borrowed(p.newton.spare, {&b.R, &b.inertia, &b.Mdu, &n.l.f, &n.l.dx, &n.trial});
  n.trial.resize(s.rows.neq());
  a.mode.crack = a.arc.on ? CRACK_ONWARD : CRACK_TANGENT;
  // 1. predictor or guess
  Failure failure = begin_residual(p, a, b, n.guessed, n.linear);
  if (!failure.ok()) return failure;
  n.l.energy = std::sqrt(n.guessed + a.start.predicted);
  report_iteration(log, 0, b, 0.0, 0.0);
  for (int it = 1; it <= a.newton.max_iter; ++it) {
    // 2. tangent, prescribed dofs                                                  (6.2)
    Correction c{it, find_pending(s, a.du, n.pending), b.free_norm, 0.0};
    // the inertia of the predictor is large
    const double scale = log.scale > 0.0 ? std::min(b.scale, log.scale) : b.scale;
    c.accepted = a.step.ctl.tol_force * scale;
    step_tangent(p, a, it, c.before, c.accepted, b.R, n.pending, n.l);
    if (predictor_solves(p, a, c, n)) return accept_solution(p, a, b);
    // 3., 4. solve, correct                                                        (6.6)
    double part = 1.0;
    failure = find_correction(p, a, c, n);
    if (failure.ok()) failure = take_correction(p, a, c, n, part);
    if (!failure.ok()) return failure;
    n.stale = b.free_norm < n.least ? 0 : n.stale + 1;
    n.least = std::min(n.least, b.free_norm);
    report_iteration(log, it, b, std::fabs(c.g0), part);
    // 5. converged?                                                                (6.4)
    judge_correction(p, it, n.linear, c.before, part, b);
    const bool stalls = b.free_norm > STALL_RATIO * c.before;
    if (targets_reached(s, a.du) && step_solved_well(p.newton.solver, n.l) &&
        converged(p, a, b, n.l, true, stalls))
      return accept_solution(p, a, b);
  }
  return NOT_CONVERGED;
}
