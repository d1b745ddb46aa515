#include <cmath>

#include "base/comm.h"
#include "solve/solve_choose.h"

namespace {

// Limits of the choice of the solution method. They decide which method solves a system, and so, within the
// required accuracy, the last digits of the results (theory 8.3). That the results stay is tested by
// speed/reuse; a choice that is slow only is noticed by no test, except where one is named

// iterations with the incomplete factor for a cube of elements: times cbrt(nodes)  (no test)
const double CUBE_ITERATIONS = 3.6;
// iterations with the incomplete factor for 8 digits, above which multigrid is faster; cost of a multigrid
// solution in such iterations (3.7 per iteration, set-up 100 to 150 for all systems that share it). Measured:
// theory 8.4  (no test)
const double AMG_FROM = 130.0, AMG_WORK = 70.0;

// expected seconds of a path of CG for a number of digits                         (8.5)
double expected(const PathCost& c, double digits)
{
  return c.setup + c.iteration * std::max(1.0, digits / c.rate);
}

// Machine rates used for the choice instead of a clock, so that two runs, and all ranks of a run, choose
// alike (8.5). Assumed, not measured at run time: one core of the machine of doc/benchmarks.md, cube and
// cantilever. Only their ratios matter: a wrong ratio selects a slower method  (no test)
struct MachineRates {
  double factor = 2e10;        // operations of a factorisation                           1/second
  double cg = 3e9;             // bytes of matrix read by conjugate gradients             1/second
  double factor_entry       = 1.5e-8;  // a number in the factors, one rank               seconds
  double factor_entry_ranks = 3e-8;    // the same, several ranks                         seconds
  double analysis_entry     = 2e-7;    // a number of the matrix in the analysis          seconds
  double changed_number     = 2.5e-10; // a number of changed columns                     seconds
  double message            = 1e-4;    // messages of an iteration, several ranks         seconds
  double back_message       = 1e-3;    // messages of a back substitution                 seconds
};
const MachineRates rate_of;

// Work in units of one iteration with the incomplete factor (theory 8.3, 8.4)  (no test)
const double CHOLESKY_FORM = 4.0, AMG_FORM = 120.0;  // set-up of the factor, and of multigrid
const double AMG_ITERATION = 3.7, PRODUCT = 0.4;     // an iteration with multigrid; a product A p
const double SCALED_ITERATION = 0.25, SCALED_FORM = 0.5;       // in single precision
// in units of one back substitution: one of many at once, one in single precision  (no test)
const double BATCHED_COLUMN = 0.5, SINGLE_PRECISION = 0.5;
// iterations with the incomplete factor, before any are counted  (no test)
const int GUESS = 200;

double cholesky_guess(const SolverData& d, double iterations = GUESS)
{
  return iterations * 8.0 * d.cost.entries / rate_of.cg;
}

bool several() { return comm_size() > 1; }

double workers(const SolverData& d) { return d.first_only ? 1.0 : comm_size(); }

}  // namespace

double counted_factor(const Solver& s)
{
  const SolverData& d = *s.data;
  const double entry  = several() ? rate_of.factor_entry_ranks : rate_of.factor_entry;
  return (s.flops / rate_of.factor + entry * d.cost.factor_entries) / workers(d);
}

double counted_back(const SolverData& d)
{
  return (several() ? rate_of.back_message : 0.0) + 8.0 * d.cost.factor_entries / rate_of.cg / workers(d);
}

namespace {

double changed_numbers(const SolverData& d)
{
  const double D = d.pattern.dim;
  return static_cast<double>(d.changed.set.size()) * static_cast<double>(d.cost.rows) * D * D;
}

// ---- methods by conjugate gradients                                                    (8.5)

double messages() { return several() ? rate_of.message : 0.0; }

double cholesky_iteration(const SolverData& d) { return messages() + cholesky_guess(d, 1.0); }
double diagonal_iteration(const SolverData& d) { return messages() + PRODUCT * cholesky_guess(d, 1.0); }
double amg_iteration(const SolverData& d) { return AMG_ITERATION * cholesky_iteration(d); }
double scaled_iteration(const SolverData& d) { return SCALED_ITERATION * cholesky_iteration(d); }

double reused_iteration(const SolverData& d)
{
  return diagonal_iteration(d) + (d.by_chm ? SINGLE_PRECISION : 1.0) * counted_back(d);
}

double changed_iteration(const SolverData& d)
{
  return reused_iteration(d) + rate_of.changed_number * changed_numbers(d);
}

double cholesky_setup(const SolverData& d) { return CHOLESKY_FORM * cholesky_iteration(d); }
double amg_setup(const SolverData& d) { return AMG_FORM * cholesky_iteration(d); }
double scaled_setup(const SolverData& d) { return SCALED_FORM * cholesky_iteration(d); }

// of the changed rows: new columns of the inverse, solved together, and the dense factorisation
double changed_setup(const SolverData& d)
{
  const double m = static_cast<double>(d.changed.set.size()) * d.pattern.dim;
  return cholesky_iteration(d) +
         (BATCHED_COLUMN * d.changed.columns * counted_back(d) + 3.0 * m * m * m / rate_of.factor);
}

// seconds of counted work of each SolvePath: an iteration, and the set-up; the first two do not use conjugate
// gradients
struct CountedWork {
  double (*iteration)(const SolverData& d);
  double (*setup)(const SolverData& d);
};
const CountedWork work_of[] = {
    {},
    {},
    {reused_iteration, cholesky_iteration},
    {changed_iteration, changed_setup},
    {cholesky_iteration, cholesky_setup},
    {diagonal_iteration, cholesky_iteration},
    {amg_iteration, amg_setup},
    {scaled_iteration, scaled_setup},
};
static_assert(sizeof work_of / sizeof *work_of == PATHS, "a path without a row in the table");

}  // namespace

double counted_analysis(const SolverData& d) { return rate_of.analysis_entry * d.cost.entries_all; }
double counted_iteration(const SolverData& d, SolvePath path) { return work_of[path].iteration(d); }
double counted_setup(const SolverData& d, SolvePath path) { return work_of[path].setup(d); }

namespace {

// In dynamics the first systems are solved without a factorisation, which in 3D is expensive and whose
// factors would take most of the memory; more iterations mean that dt is so large that inertia no longer
// conditions the matrix  (test: Krylov.ExactInMotionWithoutFactors)
const int FIRST_ITERATIONS = 60;
// the same in 2D on one rank, where factors are cheap and soon pay off
// (test: Increment.ProjectionIsKnownWhereTheGridGoesOn)
const int FIRST_ITERATIONS_2D = 15;

// relative residual: in dynamics conjugate gradients reach the accuracy of a factorisation with enough
// iterations, and need no memory for factors  (test: Krylov.ExactInMotionWithoutFactors)
const double EXACT = 1e-12;

}  // namespace

int first_limit(int dim) { return dim == 2 && !several() ? FIRST_ITERATIONS_2D : FIRST_ITERATIONS; }

bool inertia_dominates(const SolverData& d, const SolveTask& task, int dim)
{
  const PathCost& c = d.cost.path[PATH_CHOLESKY];
  return task.inertia && !d.factored && (!c.known || c.rate * first_limit(dim) >= task.digits);
}

SolveTask exact_in_motion(const Solver& s, const SolveTask& task, int dim)
{
  if (!task.exact || task.broken || s.def.kind != SOLVER_AUTO || !s.def.reuse) return task;
  SolveTask by = task;
  by.exact    = false;
  by.eta      = EXACT;
  by.energy = by.residual = 0.0;
  by.digits = -std::log10(EXACT);
  return inertia_dominates(*s.data, by, dim) ? by : task;
}

namespace {

// digits an iteration with the incomplete factor before any are counted: bonds have 1.1, elements alone 2
// (no test)
const double CHOLESKY_DIGITS = 1.2;

// expected seconds with the incomplete factor, to compare with
double cholesky_expected(const SolverData& d, double digits)
{
  const PathCost& c = d.cost.path[PATH_CHOLESKY];
  return c.known ? expected(c, digits) : cholesky_iteration(d) * (CHOLESKY_FORM + digits / CHOLESKY_DIGITS);
}

// is it time to try a path that is not the best?
bool due(const PathCost& c, long now) { return !c.known || now - c.last > c.pause; }

// single precision without a factor: corrections of Newton's method, where it costs less; one rank
bool scaled_pays(const SolverData& d, const SysMatrix& A, const SolveTask& task, long now)
{
  const PathCost& c = d.cost.path[PATH_SCALED];
  if (!task.repeats || !task.inertia || A.dim < 2 || comm_size() > 1) return false;
  return due(c, now) || (c.good && expected(c, task.digits) < cholesky_expected(d, task.digits));
}

}  // namespace

double direct_seconds(const SolverData& d, bool pattern_known)
{
  return (d.cost.direct_factor > 0.0 ? d.cost.direct_factor : d.cost.guess) + d.cost.direct_back +
         (pattern_known ? 0.0 : d.cost.direct_analyse);
}

namespace {

// factors of an indefinite matrix cannot serve as preconditioner
bool have_factors(const Solver& s) { return s.data->factored && s.negative == 0; }

// a new factorisation is faster, or a digit costs more than the average since the last one (including it), so
// that the average would grow from here on
bool stale(const SolverData& d, double digits)
{
  const PathCost& c = d.cost.path[PATH_REUSED];
  return c.known && (expected(c, digits) > direct_seconds(d, true) ||
                     (d.cost.age > 0 && c.iteration / c.rate > d.cost.cycle_seconds / d.cost.cycle_digits));
}

// the matrix is already factorised
bool factors_fit(const SolverData& d, const SolveTask& task) { return d.factored && d.stamp == task.stamp; }

// the incomplete factor of this matrix exists, and is faster than a back substitution
bool cholesky_fits(const SolverData& d, const SolveTask& task)
{
  return d.cholesky.stamp == task.stamp && d.cost.path[PATH_CHOLESKY].known &&
         expected(d.cost.path[PATH_CHOLESKY], task.digits) < d.cost.direct_back;
}

// ---- broken material in statics: the changed rows are known                            (8.9)

// factors corrected in the changed rows: as long as a solution costs less than the mean since the
// factorisation, including it
bool changed_pays(const Solver& s)
{
  const SolverData& d = *s.data;
  const PathCost& c   = d.cost.path[PATH_CHANGED];
  if (!d.changed.on || !have_factors(s) || d.cost.correct_wait > 0) return false;
  return d.cost.age == 0 || c.setup < d.cost.cycle_seconds / (d.cost.age + 1);
}

// Broken material in 3D: factors cost so much more than the incomplete factor that conjugate gradients take
// less than half of their time, even with parts that the residual stiffness alone supports
bool broken_by_cg(const Solver& s, const SysMatrix& A, const SolveTask& task, long now, double& limit)
{
  const SolverData& d = *s.data;
  const PathCost& c   = d.cost.path[PATH_CHOLESKY];
  if (A.dim != 3 || s.def.kind != SOLVER_AUTO || now < d.cost.again) return false;
  const double direct = d.factored || d.cost.guess > 0.0 ? direct_seconds(d, solve_same_pattern(s, A)) : 0.0;
  const bool known    = c.known && !due(c, now);
  const double cg     = known ? expected(c, task.digits)
                              : cholesky_guess(d, CUBE_ITERATIONS * std::cbrt(d.cost.rows));
  limit = 2.0 * direct;
  return cg < 0.5 * direct;
}

// ---- the choice ------------------------------------------------------------

// methods other than a factorisation that the deck allows
bool allowed(const Solver& s, SolvePath path, long now)
{
  if (path == PATH_REUSED) return have_factors(s);
  return s.def.kind == SOLVER_AUTO && now >= s.data->cost.again;
}

// before the first factorisation: are conjugate gradients certainly faster?
bool without_factors(Solver& s, const SysMatrix& A, const SolveTask& task)
{
  SolverData& d = *s.data;
  if (!task.known_regular) return false;
  if (d.cost.guess == 0.0) {
    Timer timer(PHASE_ANALYSIS);
    s.flops_ahead = order_least(A);
    d.cost.guess       = s.flops_ahead / (rate_of.factor * comm_size());
    if (cholesky_guess(d) < 0.5 * d.cost.guess) return true;
    if (solve_analyse(s, A) != STATUS_OK) return false;
    d.cost.guess = std::max(1e-9, s.flops_ahead / (rate_of.factor * comm_size()));
  }
  return cholesky_guess(d) < 0.5 * d.cost.guess;
}

// is an untried path worth a trial? With inertia conjugate gradients converge fast; without, compare by size
bool promising(const SolverData& d, const SolveTask& task, SolvePath path, const PathCost& c, double least)
{
  return path != PATH_CHOLESKY || c.known || task.inertia || cholesky_guess(d) < least;
}

// ---- algebraic multigrid in statics                                                    (8.12)

bool amg_waits(const SolverData& d) { return d.amg_wait > 0; }

// Iterations with the incomplete factor for 8 digits: as counted in this run, else as for a cube with the
// same number of nodes
double cholesky_iterations(const Solver& s)
{
  const PathLog& l = s.path[PATH_CHOLESKY];
  return l.digits > 0.0 ? 8.0 * static_cast<double>(l.iterations) / l.digits
      : CUBE_ITERATIONS * std::cbrt(s.data->cost.rows);
}

// 3D elements, where the incomplete factor needs so many iterations that multigrid is faster, and a
// factorisation takes more than twice the time of multigrid
bool amg_pays(Solver& s, const SysMatrix& A, const SolveTask& task)
{
  const SolverData& d = *s.data;
  if (A.dim != 3 || task.inertia || !task.plain || !task.positions || amg_waits(d) || factors_fit(d, task) ||
      cholesky_iterations(s) < AMG_FROM)
    return false;
  if (!d.factored && !without_factors(s, A, task)) return false;
  const double factor = s.flops_ahead / (rate_of.factor * comm_size());
  return cholesky_guess(d, AMG_WORK) < 0.5 * factor && amg_there();
}

// the fastest path by the counts of this run; a path that is unknown, or was not tried for a long time, gets
// a trial that ends when the best one would have been faster
SolvePath fastest(const Solver& s, const SolveTask& task, bool pattern_known, long now, double& limit)
{
  const SolverData& d = *s.data;
  const double direct = direct_seconds(d, pattern_known);
  limit = 2.0 * direct;
  if (factors_fit(d, task)) return cholesky_fits(d, task) ? PATH_CHOLESKY : PATH_BACK;
  SolvePath best = PATH_FACTOR;
  double least   = direct;
  for (SolvePath path : {PATH_REUSED, PATH_CHOLESKY}) {
    const PathCost& c = d.cost.path[path];
    if (!allowed(s, path, now) || !c.known || expected(c, task.digits) >= least) continue;
    best  = path;
    least = expected(c, task.digits);
  }
  limit = least;
  for (SolvePath path : {PATH_REUSED, PATH_CHOLESKY})
    if (path != best && allowed(s, path, now) && due(d.cost.path[path], now) &&
        promising(d, task, path, d.cost.path[path], least))
      return path;
  limit = 2.0 * direct;
  return best == PATH_REUSED && stale(d, task.digits) ? PATH_FACTOR : best;
}

}  // namespace

SolvePath solve_choose(Solver& s, const SysMatrix& A, const SolveTask& task, long now, double& limit)
{
  const SolverData& d = *s.data;
  limit = NEVER;
  if (!s.def.reuse) return PATH_FACTOR;
  const bool small = d.cost.rows * A.dim < SMALL_SYSTEM;
  if (factors_fit(d, task) && (s.def.kind != SOLVER_AUTO || small || task.exact || task.broken))
    return PATH_BACK;
  if (s.def.kind == SOLVER_AMG) return amg_waits(d) || d.cost.rows == 0 ? PATH_FACTOR : PATH_AMG;
  if (s.def.kind == SOLVER_CG) {
    if (s.def.precond == PRECOND_FACTORS)
      return have_factors(s) && !stale(d, task.digits) ? PATH_REUSED : PATH_FACTOR;
    return s.def.precond == PRECOND_DIAGONAL ? PATH_DIAGONAL : PATH_CHOLESKY;
  }
  if (task.broken && !task.exact && !small) {
    if (broken_by_cg(s, A, task, now, limit)) return PATH_CHOLESKY;
    limit = NEVER;
    if (changed_pays(s)) return PATH_CHANGED;
  }
  if (small || task.exact || task.broken) return PATH_FACTOR;
  if (amg_pays(s, A, task)) return PATH_AMG;
  if (inertia_dominates(d, task, A.dim)) {
    if (!scaled_pays(d, A, task, now)) return PATH_CHOLESKY;
    return PATH_SCALED;
  }
  if (!d.factored && !without_factors(s, A, task)) return PATH_FACTOR;
  return fastest(s, task, solve_same_pattern(s, A), now, limit);
}
