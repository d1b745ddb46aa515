#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>

#include "base/comm.h"
#include "base/interrupt.h"
#include "base/log.h"
#include "base/timer.h"
#include "model/scheme.h"
#include "step/step.h"

namespace {

// Contact, parts of the size of a face: a point that enters by more than ENTERED in one increment may have
// missed a face; at 0.5 the search would lose it (contact_search), so TOO_DEEP ends the increment before
const double ENTERED = 0.25, TOO_DEEP = 0.45;
// Automatic increments: two in a row of at most EASY iterations, and the next is longer by GROWS; more than
// HARD, and it is shorter by SHRINKS. Newton's method that takes 4 iterations has converged quadratically
const int EASY = 4, EASY_ONES = 2, HARD = 8;
const double GROWS = 1.5, SHRINKS = 0.75;
// Parts of the largest energy that are told when they are missing: in motion; in statics, where the work of
// a few large increments is taken by the trapezoidal rule
const double TOLD_MOTION = 0.01, TOLD_STATICS = 0.2;

// S of energy-momentum, or everything at t(n+1)
KernelMode mode_of(const Step& s)
{
  KernelMode mode;
  mode.finite = s.nlgeom;
  mode.steady = s.proc == PROC_STATIC;
  mode.mid    = s.proc == PROC_DYNAMIC && scheme_of(s).midpoint;
  mode.s_new  = mode.mid ? 0.5 + s.dissipation : 1.0;
  mode.s_old  = mode.mid ? 0.5 - s.dissipation : 0.0;
  return mode;
}

// augmented Lagrange: the bond force becomes the multiplier (4.6), the pressure of a contact as well (4.15).
// k: updates so far in this step. False: none is due.
bool update_multipliers(Problem& p, const KernelMode& mode, int k)
{
  const int dim = p.m.dim;
  const Bonds& b = p.st.bonds;
  Level& l = p.st.np1;
  double C[9];
  bool changed = false;
  for (int q = 0; q < b.nbond; ++q) {
    if (p.m.bond[b.def[q]].augment <= k) continue;
    if (b.field[q] == SIDE_CONTACT) {
      const double next = contact_multiplier(mode, b.cn[q], l.slip[q * dim], l.lambda_n[q]);
      changed = changed || next != l.lambda_n[q];
      l.lambda_n[q] = next;
      continue;
    }
    changed = true;
    bond_stiffness(b, dim, q, C);
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j) l.lambda[q * dim + i] += C[i * dim + j] * l.slip[q * dim + j];
  }
  return changed;
}

Failure augment(Problem& p, Attempt& a)
{
  for (int k = 0; update_multipliers(p, a.mode, k); ++k) {
    const Failure failure = step_newton(p, a);
    if (!failure.ok()) return failure;
  }
  return STATUS_OK;
}

// a point that entered a face by more than a quarter of its size in one step may have missed it: shorter
// steps see it.
// Beyond half of its size the search would lose the point: the penalty is far too soft then.
Failure contact_depth(const Problem& p)
{
  const Bonds& b = p.st.bonds;
  for (int q = 0; q < b.nbond; ++q) {
    if (b.field[q] != SIDE_CONTACT || !p.d.pairs.master.count(q)) continue;
    const double gap = p.st.np1.slip[q * p.m.dim] / p.d.pairs.size[q],
                 before = p.d.pairs.gap[q] / p.d.pairs.size[q];
    if (gap > -TOO_DEEP && (gap > -ENTERED || before - gap < ENTERED)) continue;
    return {CONTACT_DEPTH, AT_BOND, q};
  }
  return STATUS_OK;
}

// the clock of a step: nominal increments, cuts, and times that must be hit
double clock_goal(const Step& s, const StepClock& c)
{
  return s.direct ? std::min(s.period, static_cast<double>(c.nominal) * s.dt) : s.period;
}

bool clock_done(const Step& s, const StepClock& c) { return c.t >= s.period * (1.0 - 1e-10); }

// the next attempt; stops: times that must be hit
double clock_next(const Step& s, const StepClock& c, const std::vector<double>& stops)
{
  double end = clock_goal(s, c);
  for (double stop : stops)
    if (stop > c.t + 1e-9 * s.dt && stop < end) end = stop;
  if (c.aim > c.t) return std::min(c.aim, end) - c.t;
  const double left = end - c.t;
  // the last piece is not left as a sliver
  return c.dt >= left * (1.0 - 1e-9) ? left : c.dt > 0.5 * left && c.dt < left ? 0.5 * left : c.dt;
}

void clock_accept(const Step& s, double used, int iterations, StepClock& c)
{
  c.t += used;
  if (std::fabs(c.t - clock_goal(s, c)) < 1e-9 * s.dt) {
    c.t = clock_goal(s, c);
    ++c.nominal;
    if (s.direct) c.dt = s.dt;
  }
  if (s.direct) return;
  c.easy = iterations <= EASY ? c.easy + 1 : 0;
  if (c.easy >= EASY_ONES) {
    c.dt   = std::min(c.most > 0.0 ? c.most : s.dt_max, c.dt * GROWS);
    c.easy = 0;
  } else if (iterations > HARD) {
    c.dt *= SHRINKS;
  }
}

// times of field checks and of conversions: automatic increments end on them
std::vector<double> stops_of(const Model& m, double start, const Step& s)
{
  std::vector<double> out;
  for (const Check& c : m.check)
    if (c.at == AT_TIME && c.time > start && c.time < start + s.period) out.push_back(c.time - start);
  for (const ConversionDef& c : m.conversion)
    if (c.trigger == TRIGGER_TIME && c.limit > start && c.limit < start + s.period)
      out.push_back(c.limit - start);
  std::sort(out.begin(), out.end());
  return out;
}

// statics know no velocity: what moves is stopped, and its energy leaves the ledger as external work
void stop_motion(Problem& p)
{
  State& st = p.st;
  if (st.ledger.kinetic == 0.0) return;
  log_warn("step %d is static: the kinetic energy of %g is dropped", st.log.step, st.ledger.kinetic);
  st.ledger.external -= st.ledger.kinetic;
  for (RealVec* v : {&st.n.v, &st.n.a, &st.n.vc, &st.n.vp}) std::fill(v->begin(), v->end(), 0.0);
}

// ---------------------------------------------------------------------------
// break_time : the part of an increment after which the criterion has a value, since its root grows with the
// load  (7.25)
// ---------------------------------------------------------------------------
double break_time(const BreakWatch& w, double value)
{
  const double from = std::sqrt(w.value0), to = std::sqrt(w.first.value), goal = std::sqrt(value);
  return from < goal && goal < to ? (goal - from) / (to - from) : 0.5;
}

// how large the increment is that ends just before the first break; and where the one after it, in which it
// breaks, ends.
// False: it cannot be cut any more.
bool cut_to_break(const Problem& p, const Step& s, const BreakWatch& w, double dt, StepClock& clock,
                  double& shorter)
{
  const double half = 0.5 * p.m.fracture[p.d.fm.def[w.first.elem]].tolerance;
  const bool near   = w.value0 >= 1.0 - 2.0 * half;
  const double aim  = dt * break_time(w, 1.0 + half);
  shorter = near ? aim : dt * break_time(w, 1.0 - half);
  if (p.st.log.cuts < s.ctl.max_cut && shorter >= s.dt_min) {
    clock.aim = near || aim <= shorter ? 0.0 : clock.t + aim;
    return true;
  }
  log_note("  the increment is not cut any more: the criterion is exceeded by %.3g %% when the first element "
           "breaks",
           100.0 * (w.first.value - 1.0));
  return false;
}

// elements alone, without NLGEOM, contact or fracture: the tangent does not depend on displacements
bool linear_scene(const Problem& p, const Step& s)
{
  if (s.nlgeom || p.d.fm.on || p.st.points.npoint) return false;
  for (const BondDef& b : p.m.bond)
    if (b.kind == BOND_CONTACT) return false;
  return true;
}

NewtonControls newton_controls(const Problem& p, const Step& s, double dt)
{
  NewtonControls c;
  c.linear   = linear_scene(p, s);
  c.breaks   = p.d.fm.on;
  c.singular = s.proc == PROC_STATIC && p.d.fm.on && p.st.frac.neroded > 0;
  // equilibrium after elements broke (dt = 0) opens and closes many cracks: it may take longer
  c.max_iter = dt > 0.0 ? s.ctl.max_iter : 4 * s.ctl.max_iter;
  return c;
}

// what the next increment may begin with
void note_rate(const Step& s, double dt, State& st)
{
  if (s.proc != PROC_STATIC || !s.extrapolate) return;
  st.rate.resize(st.n.u.size());
  for (size_t i = 0; i < st.rate.size(); ++i) st.rate[i] = (st.np1.u[i] - st.n.u[i]) / dt;
}

void begin_step(Problem& p, const Step& s)
{
  p.st.clock       = StepClock();
  p.st.clock.start = p.st.n.time;
  p.st.clock.dt    = s.dt;
  p.st.log.inc     = 0;
  p.st.rate.clear();
  if (s.proc == PROC_STATIC) stop_motion(p);
}

// can a shorter increment do better? Not without memory or a number, outside the grid, when the velocities at
// t(n) are not found, or after a signal
bool cut_helps(Status status)
{
  return status != SOLVER_FAILED && status != BAD_VALUE && status != OUTSIDE_GRID && status != MASS_FAILED &&
         status != INTERRUPTED;
}

// how often increments were cut before the run stopped, and why they are not cut again
std::string cuts_text(const Problem& p, const Failure& f)
{
  if (f.status == INTERRUPTED) return "stopped";
  const StepLog& log = p.st.log;
  const Step& s      = p.m.step[log.step - 1];
  std::string text   = "stopped after " + std::to_string(log.cuts) + " cuts of this increment";
  if (p.st.clock.cuts != log.cuts) text += ", " + std::to_string(p.st.clock.cuts) + " in this step";
  char limit[80] = "";
  if (f.note.compare(0, 4, "INC=") != 0 && cut_helps(f.status) && log.cuts < s.ctl.max_cut &&
      0.5 * p.st.clock.dt < s.dt_min)
    std::snprintf(limit, sizeof limit, "; half of dt = %g is less than dt min = %g", p.st.clock.dt, s.dt_min);
  return text + limit;
}

// ranks take decisions from numbers that are the same on all of them; when they are not, the machines differ
void check_ranks(const Problem& p)
{
  if (comm_size() == 1) return;
  const double mine[4] = {p.st.log.residual, p.st.ledger.strain, p.st.ledger.balance,
                          static_cast<double>(p.st.log.iterations)};
  double first[4];
  std::memcpy(first, mine, sizeof first);
  comm_share(first, 4);
  MPFE_CHECK(std::memcmp(first, mine, sizeof first) == 0,
             "the ranks have different numbers: run on machines of one kind");
}

Failure interrupted(Problem& p, Output& out)
{
  std::string note = "signal " + std::to_string(interrupt_signal()) +
                     " has ended the run; the files are complete up to here";
  out_restart(p.m, p.st, p.d.grid, true, out);
  if (p.m.restart.write)
    note += ". mpfe --restart " + out.base + ".rst, or *RESTART, READ in the deck, continues it";
  return {INTERRUPTED, note};
}

// within an increment: it is forgotten, and the run goes on with it
Failure interrupted_inside(Problem& p, const StepLog& done, const UndoPoint& undo, Output& out)
{
  if (p.d.fm.on) step_undo(p, undo);
  out_erosion_undo(out);
  p.st.log = done;
  return interrupted(p, out);
}

// one step of the deck, in the order of doc/theory.md 6.5
Failure run_step(Problem& p, const Step& s, Output& out)
{
  State& st = p.st;
  StepClock& clock = st.clock;
  const double start = clock.start;
  const std::vector<double> stops = stops_of(p.m, start, s);
  UndoPoint undo;
  RealVec energy;
  p.ready = false;
  while (!clock_done(s, clock)) {
    if (step_signalled()) return interrupted(p, out);
    const StepLog done = st.log;
    st.log.cuts = 0;
    if (++st.log.inc > s.max_inc)
      return {NOT_CONVERGED, "INC=" + std::to_string(s.max_inc) +
                                 " increments are used up before the end of the step: raise INC, or dt"};
    // 1., 2. grid, rows, pattern, mass
    const int cuts = clock.cuts;
    if (p.d.fm.on && s.proc == PROC_STATIC) step_undo_point(p, undo);
    Failure failure = step_prepare(p, s);
    if (failure.ok() && st.log.inc == 1 && s.proc == PROC_DYNAMIC && scheme_of(s).acceleration)
      failure = step_initial_acceleration(p, s, 0.0);
    // 3., 4., 5. attempts, each half as long as the one before
    double dt = clock_next(s, clock, stops);
    if (p.d.fm.on && s.proc == PROC_DYNAMIC) step_undo_point(p, undo);      // with the first acceleration
    clock.aim = 0.0;
    BreakWatch watch;
    watch.on = s.proc == PROC_STATIC && !s.direct;
    while (failure.ok()) {
      const Ledger before = st.ledger;
      double shorter = 0.5 * dt;
      failure = step_increment(p, s, clock.t, dt, energy);
      const int iterations = st.log.iterations;
      if (failure.ok()) {
        note_rate(s, dt, st);
        st.n      = st.np1;
        st.n.time = start + clock.t + dt;
        p.ready   = false;
        if (p.d.fm.on) failure = step_fracture(p, s, clock.t + dt, undo.state, watch, energy, out);
        else timer_skip(PHASE_FRACTURE);
        if (failure.status == CRITERION_EXCEEDED && !cut_to_break(p, s, watch, dt, clock, shorter)) {
          watch.on = false;
          failure  = step_fracture(p, s, clock.t + dt, undo.state, watch, energy, out);
        }
        st.log.iterations = iterations;
      }
      if (failure.ok() || !cut_helps(failure.status)) break;
      failure.note = step_explain(p, failure);       // in the words of the state that is undone
      const StepClock now = clock;
      if (p.d.fm.on) step_undo(p, undo);
      out_erosion_undo(out);
      clock     = now;
      st.ledger = before;
      if (!step_prepare(p, s).ok()) break;
      if ((p.d.fm.on || !p.m.restart.write) && step_signalled()) failure = INTERRUPTED;
      if (failure.status == INTERRUPTED) break;
      if (st.log.cuts >= s.ctl.max_cut || shorter < s.dt_min) break;
      out_listing_cut(st.log.step, st.log.inc, start + clock.t, dt, shorter, failure.status,
                        failure.note.c_str());
      ++st.log.cuts;
      clock.cuts = cuts + st.log.cuts;
      dt = shorter;
      if (failure.status != CRITERION_EXCEEDED) clock.dt = shorter;
      failure = STATUS_OK;
    }
    if (failure.status == INTERRUPTED) return interrupted_inside(p, done, undo, out);
    if (!failure.ok()) return failure;
    // 6. write
    if (clock.most == 0.0 && !st.eroded.empty()) clock.most = clock.dt;
    clock_accept(s, dt, st.log.iterations, clock);
    st.n.time = start + clock.t;
    ++st.log.inc_total;
    st.log.dt     = dt;
    st.log.t_step = clock.t;
    check_ranks(p);
    if (s.proc == PROC_STATIC || st.log.inc_total % 10 == 0 || clock_done(s, clock)) step_limit(p, s);
    if (p.d.fm.on) step_remainder(p, s);
    if (!p.d.watch.pair.empty()) overlap_look(p.m, p.d.el, st, p.d.watch);
    out_increment(p.m, p.d.el, st, p.d.grid, out);
    st.eroded.clear();
    out_restart(p.m, st, p.d.grid, false, out);
  }
  return STATUS_OK;
}

// does a scheme of the steps dissipate on purpose?
bool lossy(const Model& m)
{
  for (const Step& s : m.step)
    if (s.proc == PROC_DYNAMIC && scheme_of(s).dissipates(s)) return true;
  return false;
}

// more than a percent of energy from nowhere: say so. A dissipating scheme loses energy on purpose; in
// statics the work of a few large increments is taken by the trapezoidal rule, so only a gross error counts.
void warn_balance(const Problem& p)
{
  const Ledger& g = p.st.ledger;
  if (g.conversion < -TOLD_MOTION * g.scale)
    log_warn("conversion to points has won %.1f %% of the energy (ECONV %.4g): elements and cells of one "
             "size, or smaller "
             "increments make it smaller",
             -100.0 * g.conversion / g.scale, g.conversion);
  bool moves = false;
  for (const Step& s : p.m.step) moves = moves || s.proc == PROC_DYNAMIC;
  if (lossy(p.m) || std::fabs(g.balance) <= (moves ? TOLD_MOTION : TOLD_STATICS) * g.scale) return;
  log_warn("the energy balance is off by %.1f %% (%.4g of %.4g): smaller increments show whether the answer "
           "can be trusted",
           100.0 * std::fabs(g.balance) / g.scale, g.balance, g.scale);
}

// is more energy come from nowhere, or lost, than the steps allow? Loss is what a dissipating scheme is for.
bool balance_failed(const Problem& p)
{
  const Ledger& g = p.st.ledger;
  double limit = 0.0;
  for (const Step& s : p.m.step) limit = std::max(limit, s.balance);
  if (limit == 0.0 || g.balance <= limit * g.scale) {
    if (limit == 0.0 || lossy(p.m) || g.balance >= -limit * g.scale) return false;
  }
  log_error("the energy balance is off by %.1f %% of the largest energy (%.4g of %.4g), more than the %.3g "
            "%% that *STEP, BALANCE= allows: "
            "the answer is wrong. Smaller increments, or SCHEME=ENERGY-MOMENTUM",
            100.0 * std::fabs(g.balance) / g.scale, g.balance, g.scale, 100.0 * limit);
  return true;
}

// what each rank did, for the listing; nothing on one rank
void load_of_ranks(const Problem& p, std::vector<RankLoad>& ranks)
{
  if (comm_size() == 1) return;
  RankLoad mine;
  for (const ElemBlock& b : p.d.el.block) mine.elements += static_cast<double>(b.mine.size());
  mine.points = static_cast<double>(p.dofs.my_point.size());
  mine.bonds  = static_cast<double>(p.dofs.my_bond.size());
  for (Phase phase : {PHASE_RESIDUAL, PHASE_TANGENT, PHASE_MASS}) mine.assembly += timer_phase(phase).wall;
  mine.between = timer_phase(PHASE_COMM).wall;
  mine.memory  = out_memory();
  ranks.assign(1, mine);
  comm_join(ranks);
}

// where Newton's method begins in statics: the last increment goes on at its rate, prescribed dofs
// arrive  (6.14)
// Only where nothing but elements acts that are whole, and not after a cut.
void extrapolate(const Problem& p, double dt, Attempt& a)
{
  const State& st = p.st;
  if (!a.step.extrapolate || st.rate.empty() || st.log.cuts > 0 || !p.m.bond.empty() || st.points.npoint ||
      st.frac.neroded > 0)
    return;
  a.guess = p.dofs.target;
  const int dim = p.dofs.dim;
  for (int r = 0; r < p.dofs.nfe; ++r)
    for (int i = 0; i < dim; ++i)
      if (!p.dofs.fixed[r * dim + i]) a.guess[r * dim + i] = dt * st.rate[p.dofs.node_of_row[r] * dim + i];
}

// one point a cell sees only the mean gradient: the cell can deform as an hourglass without any stress
void warn_few_points(const Problem& p)
{
  if (p.st.points.npoint > 1.5 * p.d.grid.ncell) return;
  log_warn("%d material points in %d cells: with about one point a cell the grid can move as an hourglass "
           "without any "
           "stress, and statics may be singular or wrong; take POINTS=2 or more, or larger cells",
           p.st.points.npoint, p.d.grid.ncell);
}

// energies at the start need the mass of the first step
void open_ledger(Problem& p)
{
  if (!step_prepare(p, p.m.step.front()).ok()) return;
  if (p.st.points.npoint) warn_few_points(p);
  ledger_update(p, p.st.n, p.m.step.front().nlgeom);
  Ledger& g = p.st.ledger;
  g.total0  = g.kinetic + g.strain + g.bond;
  g.balance = 0.0;
  g.scale   = g.total0;
}

int begin_run(Problem& p, Output& out)
{
  open_ledger(p);
  return out_open(p.m, p.d.el, p.st, p.d.grid, out);
}

// state and output of the restart file; what follows from the state is made again
int continue_run(Problem& p, Archive& f, Output& out)
{
  const Points begin = p.st.points;
  const int errors   = out_reopen(p.m, p.d.el, f, p.st, p.d.grid, out);
  if (errors) return errors;
  if (p.d.fm.on && !frac_replay(p.m, p.d.fm, p.st, begin, p.d.share)) {
    log_error("the restart file does not fit this model (conversion made again gives other points): it is "
              "damaged, although its checksum "
              "is right, or another machine has written it; take an earlier one");
    return 1;
  }
  elem_refresh(p.d.el);
  p.ready = false;
  return 0;
}

}  // namespace

bool step_signalled()
{
  const int number = comm_most(interrupt_signal());
  if (number && !interrupt_signal()) interrupt_note(number);
  return number != 0;
}

Failure step_increment(Problem& p, const Step& s, double t0, double dt, RealVec& energy)
{
  State& st = p.st;
  const double total0 = st.n.time;
  const bool mid = mode_of(s).mid;
  const double load = mid ? 0.5 : 1.0;               // where in the increment the loads are taken
  Attempt a{s, mode_of(s), t0, t0 + dt, dt, total0, total0 + dt, {t0 + load * dt, total0 + load * dt, load},
            newton_controls(p, s, dt)};
  st.np1 = st.n;
  if (p.d.fm.on) frac_degrade(p.m, s, p.d.fm, st.frac, st.n, dt, st.np1);
  // in motion a multiplier of the step before would push a contact that opens: energy from nothing (4.2)
  if (s.proc == PROC_DYNAMIC) std::fill(st.np1.lambda_n.begin(), st.np1.lambda_n.end(), 0.0);
  // of this attempt: an error before the first one tells so
  st.log.iterations = 0;
  st.log.residual   = 0.0;
  a.du.assign(p.dofs.neq(), 0.0);
  Failure failure = dof_constrain(p.m, p.d, st, s, a.t0, a.t1, p.dofs, p.warned);
  if (failure.ok() && !mid)
    failure = assem_loads(p.m, p.d, p.dofs, st, s, {a.t0, a.total0, 0.0}, p.warned, a.fext0);
  if (failure.ok() && s.proc == PROC_DYNAMIC) failure = step_inertia_begin(p, a);
  if (failure.status == BAD_VALUE) return failure;
  if (dt > 0.0 && s.proc == PROC_STATIC) extrapolate(p, dt, a);
  const bool guessed = !a.guess.empty();
  if (failure.ok()) failure = step_newton(p, a);
  if (!failure.ok() && failure.status != BAD_VALUE && guessed) {
    a.du.assign(p.dofs.neq(), 0.0);
    a.guess.clear();
    failure = step_newton(p, a);
  }
  if (failure.ok() && st.bonds.nbond) failure = augment(p, a);
  if (failure.ok() && p.d.pairs.near) failure = contact_depth(p);
  if (failure.ok()) step_finish(p, a, energy);
  if (failure.ok() && !std::isfinite(st.ledger.balance)) failure = BAD_NUMBER;
  return failure;
}

int step_run(Problem& p, Archive& f, Output& out)
{
  if (comm_most(f.reading ? continue_run(p, f, out) : begin_run(p, out))) return EXIT_DECK;
  Failure failure;
  const size_t first = f.reading ? p.st.log.step - 1 : 0;
  for (size_t k = first; k < p.m.step.size() && failure.ok(); ++k) {
    p.st.log.step = static_cast<int>(k) + 1;
    out_step_begin(p.m, static_cast<int>(k), out);
    if (!f.reading || k > first) {
      begin_step(p, p.m.step[k]);
      step_missed(p, p.m.step[k], mode_of(p.m.step[k]).mid);
    }
    failure = run_step(p, p.m.step[k], out);
    out_step_end(p.m, p.st, out);
  }
  const Status status = failure.status;
  if (!failure.ok())
    log_error("step %d, increment %d, time %.8g: %s. %s", p.st.log.step, p.st.log.inc, p.st.n.time,
              cuts_text(p, failure).c_str(), step_explain(p, failure).c_str());
  const bool unbalanced = status == STATUS_OK && balance_failed(p);
  if (!unbalanced) warn_balance(p);
  load_of_ranks(p, out.ranks);
  step_memory(p, out.memory);
  const int failed =
      comm_share(out_close(p.m, p.d.el, p.st, p.d.grid, p.newton.solver, status == STATUS_OK, out));
  if (status == SOLVER_FAILED) return EXIT_RESOURCE;
  if (status == BAD_VALUE) return EXIT_DECK;
  if (status == INTERRUPTED && p.m.restart.write) return EXIT_CONTINUE;
  if (status != STATUS_OK) return EXIT_PHYSICS;
  return failed || unbalanced ? EXIT_CHECK_FAILED : EXIT_GOOD;
}
