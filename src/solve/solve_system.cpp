#include <cmath>

#include "base/comm.h"
#include "base/log.h"
#include "solve/solve_choose.h"

namespace {

// time only, as the limits of solve_choose.cpp  (no test)
const long PAUSE    = 50;      // solutions until a slower method is tried again; doubled if it fails
// of conjugate gradients  (test: Krylov.ArrivesWithEachPreconditioner)
const int MAX_ITERATIONS = 5000;
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
// set-up of the factor, by dimension, in the decision whether to keep an earlier one               (8.14)
// (test: Krylov.IncompleteFactorIsKept)
const double KEPT_FORM[4] = {0.0, 1.0, 1.0, 2.5};
// least digits an iteration in single precision: where inertia dominates there are 0.5 to 1; with stiff bonds
// 0.3, and their forces would lose digits  (test: speed/reuse)
const double SCALED_DIGITS = 0.4;

void smooth(double& mean, double value)
{
  mean = mean > 0.0 ? (1.0 - SMOOTH) * mean + SMOOTH * value : value;
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
  int iterations;                                    // at most
  // factor on the tolerance: M^-1 underestimates the error in smooth modes, where it differs much
  // from A^-1; factors do not
  double safety;
};

// one row for each SolvePath; the first two do not use conjugate gradients
const CgWay way[] = {
    {},
    {},
    {reused_form_way, reused_apply_way, MAX_ITERATIONS, 1.0},
    {changed_form_way, changed_apply_way, CHANGED_ITERATIONS, 1.0},
    {cholesky_form_way, cholesky_apply_way, MAX_ITERATIONS, 0.1},
    {diagonal_form_way, diagonal_apply_way, MAX_ITERATIONS, 0.1},
    {amg_form_way, amg_apply_way, AMG_ITERATIONS, 0.1},
    {scaled_form_way, nullptr, MAX_ITERATIONS, 0.3},
};
static_assert(sizeof way / sizeof *way == PATHS, "a path without a row in the table");

// iterations within so many seconds, at least one
int counted_limit(const SolverData& d, SolvePath path, double seconds)
{
  const double iterations = (seconds - counted_setup(d, path)) / counted_iteration(d, path);
  return 1 + static_cast<int>(std::min(1.0 * MAX_ITERATIONS, std::max(0.0, iterations)));
}

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
    if (s.nanalyse > before) smooth(d.cost.direct_analyse, counted_analysis(d));
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
  const double setup   = kept ? 0.0 : counted_setup(d, path);
  const double seconds = done.iterations * counted_iteration(d, path);
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
  SolvePath path = solve_choose(s, A, task, now, limit);
  while (path >= PATH_REUSED && !tried[path]) {
    tried[path] = true;
    if (by_cg(s, A, task, path, limit, now, b, x) == STATUS_OK) {
      ++s.path[path].solves;
      return STATUS_OK;
    }
    tried[path] = path != PATH_AMG || d.amg_wait > 0;      // once more with a new hierarchy
    path = solve_choose(s, A, task, now, limit);
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
