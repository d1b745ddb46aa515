#include <cmath>
#include <limits>

#include "base/comm.h"
#include "base/log.h"
#include "solve/solve_data.h"

namespace {

// Limits of the choice of the solution method. They decide which method solves a system, and so, within the
// required accuracy, the last digits of the results (theory 8.3). That the results stay is tested by
// speed/reuse; a choice that is slow only is noticed by no test, except where one is named
// (no test)
const long PAUSE    = 50;      // solutions until a slower method is tried again; doubled if it fails
// of conjugate gradients  (test: Krylov.ArrivesWithEachPreconditioner)
const int MAX_ITERATIONS = 5000;
// iterations with the incomplete factor for a cube of elements: times cbrt(nodes)  (no test)
const double CUBE_ITERATIONS = 3.6;
// iterations with the incomplete factor for 8 digits, above which multigrid is faster; cost of a multigrid
// solution in such iterations (3.7 per iteration, set-up 100 to 150 for all systems that share it). Measured:
// theory 8.4  (no test)
const double AMG_FROM = 130.0, AMG_WORK = 70.0;
const int AMG_ITERATIONS = 200;        // maximum with multigrid, which takes 10 to 30 where it is suitable
// solutions until multigrid is tried again after a failure; doubled each time
// (test: Krylov.MultigridThatFailsWaits)
const long AMG_WAIT = 8;
// maximum with corrected factors: then a factorisation is cheaper  (no test)
const int CHANGED_ITERATIONS = 30;
// factorisations until corrections that cost more are tried again; doubled each time, up to the second: the
// panel of decks/lpanel.inp with h = 6.25 took 1.6 times as long without  (no test)
const long CORRECT_WAIT = 4, CORRECT_WAIT_MAX = 256;
const size_t PAST   = 6;       // solutions stored for the initial guess of the next one (8.8)
const double SMOOTH = 0.5;     // weight of the newest measurement
const double NEVER  = std::numeric_limits<double>::infinity();

void smooth(double& mean, double value)
{
  mean = mean > 0.0 ? (1.0 - SMOOTH) * mean + SMOOTH * value : value;
}

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
// set-up of the factor, by dimension, in the decision whether to keep an earlier one               (8.14)
// (test: Krylov.IncompleteFactorIsKept)
const double KEPT_FORM[4] = {0.0, 1.0, 1.0, 2.5};
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

// forms the preconditioner of the matrix; false: failed.  z = M^-1 r and rho = r z
using FormWay  = bool(Solver& s, const SysMatrix& A, const SolveTask& task, CgSystem& c);
using ApplyWay = bool(Solver& s, const SysMatrix& A, const CgSystem& c, const RealVec& r, RealVec& z,
                      double& rho);
FormWay cholesky_form_way, diagonal_form_way, reused_form_way, changed_form_way, amg_form_way,
    scaled_form_way;
ApplyWay cholesky_apply_way, diagonal_apply_way, reused_apply_way, changed_apply_way, amg_apply_way;

struct CgWay {
  FormWay* form;
  ApplyWay* apply;
  double (*iteration)(const SolverData& d);          // seconds of counted work
  double (*setup)(const SolverData& d);
  int iterations;                                    // at most
  // factor on the tolerance: M^-1 underestimates the error in smooth modes, where it differs much
  // from A^-1; factors do not
  double safety;
};

// one row for each SolvePath; the first two do not use conjugate gradients
const CgWay way[] = {
    {},
    {},
    {reused_form_way, reused_apply_way, reused_iteration, cholesky_iteration, MAX_ITERATIONS, 1.0},
    {changed_form_way, changed_apply_way, changed_iteration, changed_setup, CHANGED_ITERATIONS, 1.0},
    {cholesky_form_way, cholesky_apply_way, cholesky_iteration, cholesky_setup, MAX_ITERATIONS, 0.1},
    {diagonal_form_way, diagonal_apply_way, diagonal_iteration, cholesky_iteration, MAX_ITERATIONS, 0.1},
    {amg_form_way, amg_apply_way, amg_iteration, amg_setup, AMG_ITERATIONS, 0.1},
    {scaled_form_way, nullptr, scaled_iteration, scaled_setup, MAX_ITERATIONS, 0.3},
};
static_assert(sizeof way / sizeof *way == PATHS, "a path without a row in the table");

// iterations within so many seconds, at least one
int counted_limit(const SolverData& d, SolvePath path, double seconds)
{
  const double iterations = (seconds - way[path].setup(d)) / way[path].iteration(d);
  return 1 + static_cast<int>(std::min(1.0 * MAX_ITERATIONS, std::max(0.0, iterations)));
}

// In dynamics the first systems are solved without a factorisation, which in 3D is expensive and whose
// factors would take most of the memory; more iterations mean that dt is so large that inertia no longer
// conditions the matrix  (test: Krylov.ExactInMotionWithoutFactors)
const int FIRST_ITERATIONS = 60;
// the same in 2D on one rank, where factors are cheap and soon pay off
// (test: Increment.ProjectionIsKnownWhereTheGridGoesOn)
const int FIRST_ITERATIONS_2D = 15;

int first_limit(int dim) { return dim == 2 && !several() ? FIRST_ITERATIONS_2D : FIRST_ITERATIONS; }

bool inertia_dominates(const SolverData& d, const SolveTask& task, int dim)
{
  const PathCost& c = d.cost.path[PATH_CHOLESKY];
  return task.inertia && !d.factored && (!c.known || c.rate * first_limit(dim) >= task.digits);
}

// relative residual: in dynamics conjugate gradients reach the accuracy of a factorisation with enough
// iterations, and need no memory for factors  (test: Krylov.ExactInMotionWithoutFactors)
const double EXACT = 1e-12;

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

// digits an iteration with the incomplete factor before any are counted: bonds have 1.1, elements alone 2
// (no test)
const double CHOLESKY_DIGITS = 1.2;
// least digits an iteration in single precision: where inertia dominates there are 0.5 to 1; with stiff bonds
// 0.3, and their forces would lose digits  (test: speed/reuse)
const double SCALED_DIGITS = 0.4;

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

// seconds of a solution by factorisation
double direct_seconds(const SolverData& d, bool pattern_known)
{
  return (d.cost.direct_factor > 0.0 ? d.cost.direct_factor : d.cost.guess) + d.cost.direct_back +
         (pattern_known ? 0.0 : d.cost.direct_analyse);
}

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

// before a factorisation: have the corrections since the last one paid?
void judge_corrections(double direct, SolverCosts& c)
{
  if (c.correct_wait > 0) --c.correct_wait;
  if (!c.corrected) return;
  const bool paid = c.cycle_seconds <= static_cast<double>(c.age + 1) * direct;
  c.correct_pause = paid ? 0 : std::min(std::max(CORRECT_WAIT, 2 * c.correct_pause), CORRECT_WAIT_MAX);
  c.correct_wait  = c.correct_pause;
  c.corrected     = false;
}

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

SolvePath choose(Solver& s, const SysMatrix& A, const SolveTask& task, long now, double& limit)
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

// ---- the paths ---------------------------------------------------------------

void remember_solution(std::vector<RealVec>& past, const RealVec& x)
{
  if (past.size() == PAST) past.erase(past.begin());
  past.push_back(x);
}

Status by_factor(Solver& s, const SysMatrix& A, const SolveTask& task, const RealVec& b, RealVec& x)
{
  SolverData& d = *s.data;
  judge_corrections(direct_seconds(d, true), d.cost);
  {
    Timer timer(PHASE_ANALYSIS);
    const long before   = s.nanalyse;
    const Status status = solve_analyse(s, A);
    if (status != STATUS_OK) return status;
    if (s.nanalyse > before) smooth(d.cost.direct_analyse, rate_of.analysis_entry * d.cost.entries_all);
  }
  {
    Timer timer(PHASE_FACTOR);
    const Status status = solve_factor(s, A);
    if (status != STATUS_OK) return status;
    smooth(d.cost.direct_factor, counted_factor(s));
  }
  d.stamp    = task.stamp;
  // earlier solutions belong to other rows
  if (d.pattern.divided && comm_allreduce_max(static_cast<int>(d.reused.key != task.key))) d.past.clear();
  d.reused.key = task.key;
  if (d.pattern.divided) d.reused.owner = A.halo.owner;
  d.changed.on = false;
  if (task.broken && s.null_pivot_row >= 0 && s.def.reuse && d.cost.rows * A.dim >= SMALL_SYSTEM &&
      !sys_shared(A))
    changed_begin(A, task.key, s.null_pivot_row, d.changed);
  d.cost.age      = 0;
  if (d.cost.fresh_rate > 0.0) d.cost.path[PATH_REUSED].rate = d.cost.fresh_rate;
  Timer timer(PHASE_SOLVE);
  const Status status = solve_back(s, b, x);
  smooth(d.cost.direct_back, counted_back(d));
  if (status == STATUS_OK && s.def.reuse && d.cost.rows * A.dim >= SMALL_SYSTEM) remember_solution(d.past, x);
  d.cost.cycle_seconds = direct_seconds(d, true);
  d.cost.cycle_digits  = task.digits;
  return status;
}

// ---- z = M^-1 r and rho = r z by each method

bool cholesky_apply_way(Solver& s, const SysMatrix&, const CgSystem& c, const RealVec& r, RealVec& z,
                        double& rho)
{
  SolverData& d = *s.data;
  z = r;
  if (c.own) {
    rho = cholesky_apply(c.A, d.cholesky, *c.own, d.work.y, z);
    return true;
  }
  cholesky_apply(c.A, d.cholesky, z);
  rho = dot(r, z);
  return true;
}

// r z of all ranks
double cg_product(const CgSystem& c, const RealVec& r, const RealVec& z)
{
  if (!c.own) return dot(r, z);
  double rho = own_dot(*c.own, r, z);
  comm_sum(&rho, 1);
  return rho;
}

bool diagonal_apply_way(Solver& s, const SysMatrix&, const CgSystem& c, const RealVec& r, RealVec& z,
                        double& rho)
{
  diagonal_apply(c.A, s.data->diagonal, r, z);
  rho = cg_product(c, r, z);
  return true;
}

// the factors belong to the whole matrix A
bool reused_apply_way(Solver& s, const SysMatrix& A, const CgSystem& c, const RealVec& r, RealVec& z,
                      double& rho)
{
  const Status status = reused_apply(s, A, s.data->reused, r, z);
  rho = cg_product(c, r, z);
  return status == STATUS_OK;
}

bool changed_apply_way(Solver& s, const SysMatrix& A, const CgSystem&, const RealVec& r, RealVec& z,
                       double& rho)
{
  const Status status = changed_apply(s, A, s.data->changed, r, z);
  rho = dot(r, z);
  return status == STATUS_OK;
}

bool amg_apply_way(Solver& s, const SysMatrix&, const CgSystem&, const RealVec& r, RealVec& z,
                   double& rho)
{
  return amg_apply(*s.data->amg, r, z, rho);
}

// the incomplete factor of the matrix of task, on all ranks
bool cholesky_ready(SolverData& d, const SysMatrix& A, OwnBlock* own, const SolveTask& task)
{
  Cholesky& c = d.cholesky;
  if (c.stamp == task.stamp) return true;
  c.stamp = -1;
  if (!cholesky_form(A, c, own)) return false;
  c.stamp   = task.stamp;
  c.pattern = task.pattern;
  c.spent   = KEPT_FORM[A.dim];
  c.digits  = 0.0;
  c.stale   = false;
  return true;
}

// decimal digits gained by a solution
double digits_of(const CgDone& done) { return done.end > 0.0 ? std::log10(done.first / done.end) : 16.0; }

// ---- the incomplete factor of an earlier matrix is kept as long as a digit costs no more than on average
// since it was formed, including that                                                     (8.14)

// is the incomplete factor of an earlier matrix used?
bool cholesky_kept(const Solver& s, const SolveTask& task)
{
  const Cholesky& c = s.data->cholesky;
  return s.def.reuse && c.stamp >= 0 && c.stamp != task.stamp && task.pattern > 0 &&
         c.pattern == task.pattern && !c.stale && c.digits > 0.0;
}

// iterations after which a kept factor is given up
int kept_limit(int dim, const Cholesky& c, const SolveTask& task)
{
  return static_cast<int>(KEPT_FORM[dim] + 2.0 * (task.digits + 1.0) * c.spent / c.digits);
}

void cholesky_judge(const CgDone& done, Cholesky& c)
{
  const double gained = digits_of(done);
  c.spent += done.iterations;
  c.digits += gained;
  c.stale = !done.good || done.iterations * c.digits > c.spent * gained;
}

bool reused_form_way(Solver& s, const SysMatrix& A, const SolveTask& task, CgSystem&)
{
  return reused_form(A, task.key, s.data->reused);
}

bool changed_form_way(Solver& s, const SysMatrix& A, const SolveTask& task, CgSystem&)
{
  return changed_form(s, A, task.key, s.null_pivot_row, task.stamp, s.data->changed);
}

bool cholesky_form_way(Solver& s, const SysMatrix&, const SolveTask& task, CgSystem& c)
{
  if (!cholesky_kept(s, task)) return cholesky_ready(*s.data, c.A, c.own, task);
  timer_skip(PHASE_PRECOND);
  return true;
}

bool amg_form_way(Solver& s, const SysMatrix&, const SolveTask& task, CgSystem& c)
{
  SolverData& d = *s.data;
  return cholesky_ready(d, c.A, c.own, task) &&
         amg_form(c.A, c.own, d.cholesky, task.positions, task.stamp, d.amg);
}

bool scaled_form_way(Solver& s, const SysMatrix& A, const SolveTask& task, CgSystem&)
{
  if (s.data->scaled.stamp == task.stamp) timer_skip(PHASE_PRECOND);
  return scaled_form(A, task.stamp, s.data->scaled);
}

bool diagonal_form_way(Solver& s, const SysMatrix&, const SolveTask&, CgSystem& c)
{
  return !comm_allreduce_max(!diagonal_form(c.A, s.data->diagonal));
}

// stores the cost of the path for the next choice; kept: with an earlier incomplete factor
void remember(Solver& s, SolvePath path, const CgDone& done, bool kept, long now)
{
  SolverData& d = *s.data;
  PathCost& c   = d.cost.path[path];
  const double gained  = digits_of(done);
  const double setup   = kept ? 0.0 : way[path].setup(d);
  const double seconds = done.iterations * way[path].iteration(d);
  c.last = now;
  c.good = done.good;
  smooth(c.setup, setup);
  if (done.iterations > 0) {
    smooth(c.iteration, seconds / done.iterations);
    const double rate = std::max(1e-3, gained / done.iterations);
    c.rate = c.known && done.good ? (1.0 - SMOOTH) * c.rate + SMOOTH * rate : rate;
  } else if (!done.good) {
    c.rate = 1e-3;                       // no preconditioner, or an indefinite matrix
  }
  c.known = true;
  c.pause = done.good ? PAUSE : std::max(PAUSE, 2 * c.pause);
  if (path == PATH_CHANGED) {
    if (!done.good) d.changed.on = false;
    d.cost.corrected = true;
    // set-up and iterations together; only the first iterations of an increment add rows
    c.setup = d.cost.age++ == 0 ? setup + seconds : (1.0 - SMOOTH) * c.setup + SMOOTH * (setup + seconds);
    d.cost.cycle_seconds += setup + seconds;
    return;
  }
  if (path != PATH_REUSED) return;
  if (!done.good || done.iterations == 0) return;
  if (d.cost.age++ == 0) smooth(d.cost.fresh_rate, gained / done.iterations);
  d.cost.cycle_seconds += seconds;
  d.cost.cycle_digits += gained;
}

// after a failure multigrid gets a new hierarchy; after another it pauses, each time for longer
void amg_judge(SolverData& d, const CgDone& done)
{
  if (d.amg && amg_count(*d.amg, done)) return;
  if (done.good) {
    d.amg_pause = 0;
    return;
  }
  d.amg.reset();
  d.amg_pause = d.amg_pause > 0 ? 2 * d.amg_pause : AMG_WAIT;
  d.amg_wait  = d.amg_pause;
  log_note("NOTE  multigrid did not converge in %d iterations: the next %ld systems are solved without it",
           done.iterations, d.amg_wait);
}

// forms the preconditioner and solves by conjugate gradients
CgDone form_and_solve(Solver& s, const SysMatrix& A, const SolveTask& task, SolvePath path, double limit,
                      const RealVec& b, RealVec& x)
{
  SolverData& d  = *s.data;
  OwnBlock* own  = sys_shared(A) ? &d.own : nullptr;
  const bool old = path == PATH_CHOLESKY && cholesky_kept(s, task);
  CgDone done;
  CgSystem c{A, own, nullptr};
  {
    Timer timer(PHASE_PRECOND);
    if (own) own_form(A, task.pattern, *own);
    done.indefinite = path == PATH_CHOLESKY;         // if forming the factor fails
    if (!way[path].form(s, A, task, c)) return done;
    if (path != PATH_SCALED) c.precondition = [&](const RealVec& r, RealVec& z, double& rho) {
      return way[path].apply(s, A, c, r, z, rho);
    };
  }
  Timer timer(PHASE_CG);
  const double safety = way[path].safety;
  int iterations      = way[path].iterations;        // at most
  if (limit < NEVER) iterations = std::min(iterations, counted_limit(d, path, limit));
  if (s.def.kind == SOLVER_AUTO && path == PATH_CHOLESKY && inertia_dominates(d, task, A.dim))
    iterations = std::min(iterations, first_limit(A.dim) + 1);
  if (old && path == PATH_CHOLESKY)
    iterations = std::min(iterations, kept_limit(A.dim, d.cholesky, task));
  if (path == PATH_SCALED) iterations = 2 + static_cast<int>(task.digits / SCALED_DIGITS);
  CgGoal goal{safety * task.eta, safety * task.energy, task.residual, iterations};
  if (path == PATH_SCALED) return scaled_solve(A, b, goal, d.scaled, x);
  const bool same = path == PATH_REUSED && d.reused.same;    // a product with A costs little compared with M
  goal.any_sign = task.inertia;
  if (same) goal.initial_energy = cg_begin(c, b, d.past, x);
  done = cg_solve(c, b, goal, d.work, x);
  if (same && done.good) remember_solution(d.past, x);
  if (path == PATH_CHOLESKY) cholesky_judge(done, d.cholesky);
  return done;
}

// In dynamics a matrix may be indefinite in some iterations of an increment, but not in later ones: the
// incomplete factor is tried again, each time after twice as many solutions
void wait_indefinite(SolverData& d, long now)
{
  d.cost.again    = now + 1 + d.cost.left_out;
  d.cost.left_out = d.cost.left_out > 0 ? std::min(2 * d.cost.left_out, 2 * PAUSE) : 1;
  d.cost.spare    = true;
}

Status by_cg(Solver& s, const SysMatrix& A, const SolveTask& task, SolvePath path, double limit, long now,
             const RealVec& b, RealVec& x)
{
  const Clock clock;
  SolverData& d  = *s.data;
  const bool old = (path == PATH_CHOLESKY && cholesky_kept(s, task)) ||
                   (path == PATH_SCALED && d.scaled.stamp == task.stamp);
  const Cholesky& c    = d.cholesky;
  const double shift[] = {c.shift, c.border_shift};
  CgDone done = form_and_solve(s, A, task, path, limit, b, x);
  bool indefinite = done.indefinite;
  if (old && !done.good && path == PATH_CHOLESKY) done = form_and_solve(s, A, task, path, limit, b, x);
  indefinite = indefinite || done.indefinite;        // equal on all ranks, unlike the shifts
  if (path == PATH_CHOLESKY && task.inertia && indefinite) {
    d.cholesky = Cholesky();             // the next factor begins with the same shifts as this one
    d.cholesky.shift        = shift[0];
    d.cholesky.border_shift = shift[1];
    if (!done.good) wait_indefinite(d, now);
  } else {
    remember(s, path, done, old, now);
  }
  if (path == PATH_CHOLESKY && done.good) {
    if (d.cost.spare) solve_drop(s);
    d.cost.spare = false;
    d.cost.left_out /= 2;
  }
  PathLog& log = s.path[path];
  log.iterations += done.iterations;
  if (done.good && done.end > 0.0) log.digits += digits_of(done);
  log.seconds += clock.seconds();
  if (!done.good) ++log.failed;
  s.left = done.end;
  d.rest = !done.good ? REST_UNKNOWN : path == PATH_SCALED ? REST_SCALED : REST_CG;
  if (path == PATH_AMG) amg_judge(d, done);
  return done.good ? STATUS_OK : SOLVER_FAILED;
}

// the path of the deck, or the best one; if it does not converge, the next one, finally a factorisation
Status by_best(Solver& s, const SysMatrix& A, const SolveTask& task, const RealVec& b, RealVec& x)
{
  SolverData& d = *s.data;
  d.amg_wait    = std::max(0L, d.amg_wait - 1);
  long now = 1;
  for (const PathLog& l : s.path) now += l.solves;
  bool tried[PATHS] = {};
  double limit;
  SolvePath path = choose(s, A, task, now, limit);
  while (path >= PATH_REUSED && !tried[path]) {
    tried[path] = true;
    if (by_cg(s, A, task, path, limit, now, b, x) == STATUS_OK) {
      ++s.path[path].solves;
      return STATUS_OK;
    }
    tried[path] = path != PATH_AMG || d.amg_wait > 0;      // once more with a new hierarchy
    path = choose(s, A, task, now, limit);
  }
  if (path != PATH_BACK) path = PATH_FACTOR;
  Status status;
  const Clock clock;
  s.left = 0.0;
  if (path == PATH_BACK) {
    Timer timer(PHASE_SOLVE);
    status = solve_back(s, b, x);
  } else {
    status = by_factor(s, A, task, b, x);
  }
  d.rest = REST_NONE;
  ++s.path[path].solves;
  s.path[path].seconds += clock.seconds();
  return status;
}

// counts rows and numbers of the matrix, of all ranks, unless the pattern is unchanged
void count_entries(const SysMatrix& A, long pattern, SolverData& d)
{
  if (pattern > 0 && pattern == d.cost.counted) return;
  d.cost.counted = pattern;
  d.cost.rows    = A.nrow;
  d.cost.entries = d.cost.entries_all = static_cast<double>(A.val.size());
  if (!sys_shared(A)) return;
  const int ranks = comm_size(), me = comm_rank();
  RealVec of(2 * ranks, 0.0);
  of[2 * me]     = static_cast<double>(std::count(A.halo.owner.begin(), A.halo.owner.end(), me));
  of[2 * me + 1] = d.cost.entries;
  comm_sum(of);
  d.cost.rows        = 0;
  d.cost.entries_all = 0.0;
  for (int r = 0; r < ranks; ++r) {
    d.cost.rows += static_cast<long>(of[2 * r]);
    d.cost.entries = std::max(d.cost.entries, of[2 * r + 1]);
    d.cost.entries_all += of[2 * r + 1];
  }
}

}  // namespace

// ---------------------------------------------------------------------------
// solve_system : one linear system of Newton's method                      doc/theory.md 8
//
//   in   A, b   b [neq]; task: keys of the rows, stamp of A, required accuracy
//   out  x      [neq], another vector than b; s.left: bound of its error
//   status      SOLVER_SINGULAR, SOLVER_FAILED, BAD_NUMBER of the factorisation
//
// If conjugate gradients do not converge, the next best path follows, finally a factorisation. The choice is
// based on counted work: two runs take the same paths.
// ---------------------------------------------------------------------------
Status solve_system(Solver& s, const SysMatrix& A, const SolveTask& task, const RealVec& b, RealVec& x)
{
  MPFE_CHECK(&x != &b, "solve_system: x and b are one vector");
  MPFE_CHECK(static_cast<int>(task.key.size()) == A.nrow, "solve_system: one key for each row");
  s.masses = task.inertia;
  SolverData& d  = *s.data;
  d.rest = REST_UNKNOWN;
  count_entries(A, task.pattern, d);
  const long analysed = s.nanalyse, factored = s.nfactor;
  const Status status = first_pays(s, A, task) ? first_solve(s, A, task, b, x)
                                              : by_best(s, A, exact_in_motion(s, task, A.dim), b, x);
  if (s.nanalyse == analysed) timer_skip(PHASE_ANALYSIS);
  if (s.nfactor == factored) timer_skip(PHASE_FACTOR);
  return status;
}
