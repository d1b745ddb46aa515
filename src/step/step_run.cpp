#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/comm.h"
#include "base/heap.h"
#include "base/interrupt.h"
#include "base/log.h"
#include "base/timer.h"
#include "model/scheme.h"
#include "step/step.h"

namespace {

// Energy imbalance, relative to the peak energy, above which to warn in dynamics
// (test: stress/balance_limit)
const double WARN_DYNAMIC = 0.01;
// the same in statics, where the work of a few large increments follows the trapezoidal rule  (no test)
const double WARN_STATIC = 0.2;

// A run crawls when this number of increments in a row is shorter than this part of dt
// (test: stress/direct_crawls)
const int CRAWL_INCREMENTS = 100;
const double CRAWL_PART = 1e-3;

// TRACK: an increment is not cut below this part of its step, in motion of its dt, for the advance of a crack
// (test: strength/l_panel_track.inp)
const double LEAST_OF_STEP = 0.005;

// Explicit increments between two checks for compressed elements: time only  (no test)
const int COMPRESSED_EVERY = 100;

// statics have no velocity: motion is stopped, and its energy is lost
void stop_motion(State& st)
{
  st.ledger.leap = 0.0;
  if (st.ledger.kinetic == 0.0) return;
  log_warn("step %d is static: the kinetic energy of %g is discarded", st.log.step, st.ledger.kinetic);
  st.ledger.stopped += st.ledger.kinetic;
  st.ledger.kinetic = 0.0;
  for (RealVec* v : {&st.n.v, &st.n.a, &st.n.vc}) std::fill(v->begin(), v->end(), 0.0);
}

// ---------------------------------------------------------------------------
// break_time : the part of an increment at which the criterion reaches value; its root is proportional to the
// load  (7.25)
// ---------------------------------------------------------------------------
double break_time(const BreakWatch& w, double value)
{
  const double from = std::sqrt(w.value0), to = std::sqrt(w.first.value), goal = std::sqrt(value);
  return from < goal && goal < to ? (goal - from) / (to - from) : 0.5;
}

// cuts the increment to end just below the first fracture, and sets the end of the next one, in which the
// element breaks. False: no further cut is allowed.
bool cut_to_break(const Model& m, const Step& s, const BreakWatch& w, double dt, int cuts, StepClock& clock,
                  double& shorter)
{
  const double half = 0.5 * m.fracture[w.first.def].tolerance;
  const bool near   = w.value0 >= 1.0 - 2.0 * half;
  const double aim  = dt * break_time(w, 1.0 + half);
  shorter = near ? aim : dt * break_time(w, 1.0 - half);
  if (cuts < s.ctl.max_cut && shorter >= s.dt_min) {
    clock.aim = near || aim <= shorter ? 0.0 : clock.t + aim;
    return true;
  }
  log_note("  the increment is not cut further: the criterion is exceeded by %.3g %% when the first element "
           "breaks",
           100.0 * (w.first.value - 1.0));
  return false;
}

// stores the rate for the predictor of the next increment
void note_rate(const Step& s, double dt, State& st)
{
  if (s.proc != PROC_STATIC || !s.extrapolate) return;
  st.rate.resize(st.n.u.size());
  for (size_t i = 0; i < st.rate.size(); ++i) st.rate[i] = (st.np1.u[i] - st.n.u[i]) / dt;
}

void begin_step(const Step& s, State& st)
{
  st.clock       = StepClock();
  st.clock.start = st.n.time;
  st.clock.dt    = s.dt;
  st.log.inc     = 0;
  st.log.begin   = ELEMENTS_DUE;
  st.rate.clear();
  st.ledger.beta_power = 0.0;
  if (s.proc == PROC_STATIC) stop_motion(st);
  ledger_begin_step(st.ledger);
}

// Supports that begin with step k. They work on the kinetic energy that they change at once. FACES_UNKNOWN:
// nothing has changed
Failure begin_supports(Problem& p, int k)
{
  State& st  = p.st;
  RealVec v  = st.n.v;
  const Step& s = p.m.step[k];
  if (k == 0 || !step_supports(p.m, k, st.n.time, v)) return Failure();
  const Failure prepared = step_prepare(p, s);
  if (prepared.status == FACES_UNKNOWN) return prepared;
  const bool known    = prepared.ok();
  const Ledger before = st.ledger;
  const auto kinetic  = [&]() {
    if (known) ledger_update(p.m, p.d.el, p.dofs, st.n, s.nlgeom, st);
    return st.ledger.kinetic;
  };
  const double was = kinetic();
  st.n.v.swap(v);
  for (size_t i = 0; i < v.size(); ++i)
    if (v[i] != st.n.v[i]) st.n.a[i] = 0.0;
  const double change = kinetic() - was;
  st.ledger = before;
  st.ledger.kinetic += change;
  st.ledger.external += change;
  return Failure();
}

// can a shorter increment help? Not without memory or a finite value, outside the grid, without velocities at
// t(n), or after a signal
bool cut_helps(Status status)
{
  return status != SOLVER_FAILED && status != BAD_VALUE && status != OUTSIDE_GRID && status != MASS_FAILED &&
         status != INTERRUPTED && status != FACES_UNKNOWN;
}

// number of cuts before the run stopped, and why there is no further cut
std::string cuts_text(const Model& m, const State& st, const Failure& f)
{
  if (f.status == INTERRUPTED) return "stopped";
  const StepLog& log = st.log;
  const Step& s      = m.step[log.step - 1];
  std::string text   = "stopped after " + std::to_string(log.cuts) + " cuts of this increment";
  if (st.clock.cuts != log.cuts) text += ", " + std::to_string(st.clock.cuts) + " in this step";
  char limit[80] = "";
  if (f.note.compare(0, 4, "INC=") != 0 && cut_helps(f.status) && log.cuts < s.ctl.max_cut &&
      0.5 * st.clock.dt < s.dt_min)
    std::snprintf(limit, sizeof limit, "; half of dt = %g is less than dt min = %g", st.clock.dt, s.dt_min);
  return text + limit;
}

// other ranks do not repeat a warning. Collective with a divided model
void share_warned(Problem& p)
{
  std::string own;
  for (const std::string& text : p.warned) own += text + '\0';
  for (const std::string& all : comm_exchange(std::vector<std::string>(comm_size(), own)))
    for (size_t at = 0; at < all.size(); at = all.find('\0', at) + 1) p.warned.insert(all.c_str() + at);
  p.warned_all = p.warned.size();
}

// Several ranks: was a signal received on any of them? The same message checks that results are equal on all
// ranks, since ranks decide by them, and finds new warnings
bool check_ranks(Problem& p)
{
  if (comm_size() == 1) return false;
  const State& st     = p.st;
  const double own[4] = {st.log.residual, st.ledger.strain, st.ledger.balance,
                          static_cast<double>(st.log.iterations)};
  double largest[10] = {static_cast<double>(interrupt_signal())};
  for (int k = 0; k < 4; ++k) {
    largest[1 + k] = own[k];
    largest[5 + k] = -own[k];
  }
  largest[9] = p.m.part.on && p.warned.size() != p.warned_all;
  comm_max(largest, 10);
  for (int k = 0; k < 4; ++k)
    MPFE_CHECK(own[k] == largest[1 + k] && own[k] == -largest[5 + k],
               "ranks computed different results: run all ranks on the same CPU type and build");
  if (largest[9] > 0.0) share_warned(p);
  if (largest[0] != 0.0 && !interrupt_signal()) interrupt_note(static_cast<int>(largest[0]));
  return largest[0] != 0.0;
}

Failure interrupted(Problem& p, Output& out)
{
  std::string note = "signal " + std::to_string(interrupt_signal()) +
                     " ended the run; the files are complete up to this point";
  out_restart(p.m, p.st, p.d.grid, true, out);
  if (p.m.output.restart.write)
    note += ". mpfe --restart " + out.base + ".rst, or *RESTART, READ in the deck, continues it";
  return {INTERRUPTED, note};
}

// Data of the present increment
struct Increment {
  StepLog before;              // of the last increment
  StepClock clock;             // at its start
  Ledger ledger;
  int cuts = 0;                // cuts of the step before it
  double dt = 0.0;             // of this attempt
  double shorter = 0.0;        // of the next attempt, if this one fails
  int starts = 0;              // repetitions for cracks that start at corners
  UndoPoint undo;              // with fracture, from the start of the first attempt
  bool undoes = false;         // undo belongs to this increment
  BreakWatch watch;
  HalfWatch half;
  RealVec energy;              // of step_increment
  bool known = false;          // explicit: energy belongs to t(n), formed for a fracture test
  bool spoilt = false;         // t(n) has new shapes of points, or other elements, that failed: no way back
  int crawling = 0;            // increments in a row that are much shorter than dt
  Status limit = STATUS_OK;    // reason of the last cut, and its text
  std::string limit_text;
};

// restores the state before the increment
void discard_attempt(Problem& p, Increment& inc, Output& out)
{
  if (inc.undoes) step_undo(p, inc.undo);
  out_erosion_undo(out);
  p.st.log    = inc.before;
  p.st.ledger = inc.ledger;
}

// The run ends with an error: keeps the state of the last good increment, and writes it to a restart file if
// the deck requests such files. Returns a text on how to continue
std::string keep_good_state(Problem& p, Increment& inc, Output& out)
{
  if (inc.spoilt || (inc.undoes && !step_can_undo(p.st, inc.undo))) return "";
  discard_attempt(p, inc, out);
  p.st.clock = inc.clock;
  if (!p.m.output.restart.write || p.st.log.inc_total == 0) return "";
  out_restart(p.m, p.st, p.d.grid, true, out);
  return ". " + out.base + ".rst has the state before this increment: mpfe --restart " + out.base +
         ".rst continues from it, also with other *NEWTON and *SOLVER cards, another INC of *STEP, on other "
         "ranks or another machine";
}

// a signal within an increment: the increment is discarded, but for files of its fracture, and repeated when
// the run continues
Failure interrupted_inside(Problem& p, Increment& inc, Output& out)
{
  const std::string broke = out_unfinished(p.m, p.d.el, p.st, p.d.grid, out);
  discard_attempt(p, inc, out);
  Failure failure = interrupted(p, out);
  if (!broke.empty()) failure.note += ". " + broke;
  return failure;
}

// The run stops at the start of the increment, to be repartitioned with the near faces
Failure stop_for_faces(Problem& p, const Step& s, const StepLog& before, const StepClock& clock)
{
  if (p.next.stays) return DIVISION_FAILED;
  log_note("  contact faces owned by other ranks have come within search range: the model is divided again");
  p.st.log   = before;
  p.st.clock = clock;
  p.again    = AGAIN_FACES;
  step_turn_apart(p, s);
  return STATUS_OK;
}

// Between explicit and implicit increments the kinetic energy is that of other masses, where corners follow
// nodes (6.47). Collective.
Failure change_masses(Problem& p, int k)
{
  if (k == 0) return Failure();
  const Step &last = p.m.step[k - 1], &s = p.m.step[k];
  if (last.proc != PROC_DYNAMIC || s.proc != PROC_DYNAMIC || last.explicit_steps() == s.explicit_steps())
    return Failure();
  State& st = p.st;
  double energy[2];
  for (const Step* of : {&last, &s}) {
    p.ready = false;
    Failure failure = step_prepare(p, *of);
    const double t_step = of == &s ? 0.0 : of->period;
    if (failure.ok()) failure = dof_constrain(p.m, p.d, st, *of, t_step, t_step, p.dofs, p.warned);
    if (!failure.ok()) return failure;
    ledger_update(p.m, p.d.el, p.dofs, st.n, s.nlgeom, st);
    energy[of == &s] = ledger_energy(st.ledger);
  }
  st.ledger.conversion += energy[0] - energy[1];
  return Failure();
}

// What changes with step k: masses, elements that go and come, then supports. The run may stop before each,
// to be repartitioned
Failure enter_step(Problem& p, int k, Increment& inc)
{
  State& st     = p.st;
  const Step& s = p.m.step[k];
  Failure failure;
  inc.before = st.log;
  inc.clock  = st.clock;
  inc.ledger = st.ledger;
  if (st.log.begin == ELEMENTS_DUE) {
    failure = change_masses(p, k);
    if (failure.status == FACES_UNKNOWN) return stop_for_faces(p, s, st.log, st.clock);
    if (!failure.ok()) return failure;
    if (!s.change.empty() && step_prepare(p, s).status == FACES_UNKNOWN)
      return stop_for_faces(p, s, st.log, st.clock);
    failure      = step_change(p, k);
    inc.spoilt   = !failure.ok();
    st.log.begin = SUPPORTS_DUE;
    inc.before   = st.log;
    inc.ledger   = st.ledger;
  }
  if (failure.ok()) failure = begin_supports(p, k);
  if (failure.status == FACES_UNKNOWN && !inc.spoilt) return stop_for_faces(p, s, st.log, st.clock);
  st.log.begin = STEP_BEGUN;
  step_warn_missed(p.m, s, st.clock.start, step_mode(s).mid);
  return failure;
}

void begin_undo(State& st, bool copy, Increment& inc)
{
  step_undo_point(st, copy, inc.undo);
  inc.undoes = true;
}

// grid, rows, pattern and mass at t(n), the length of the first attempt, and the undo point
Failure begin_increment(Problem& p, const Step& s, const std::vector<double>& stops, Increment& inc)
{
  State& st  = p.st;
  inc.before = st.log;
  inc.clock  = st.clock;
  inc.ledger = st.ledger;
  inc.cuts   = st.clock.cuts;
  inc.undoes = false;
  st.log.cuts = 0;
  if (++st.log.inc > s.max_inc)
    return {NOT_CONVERGED, "INC=" + std::to_string(s.max_inc) +
                               " increments do not reach the end of the step: increase INC or dt"};
  const bool moves = s.proc == PROC_DYNAMIC;
  if (p.d.fm.on && !moves) begin_undo(st, true, inc);
  Failure failure = step_prepare(p, s);
  if (failure.ok() && !step_contact_faces_known(p)) failure = FACES_UNKNOWN;
  if (failure.status == FACES_UNKNOWN) return stop_for_faces(p, s, inc.before, inc.clock);
  if (failure.ok() && s.explicit_steps()) failure = step_stable(p, s);   // penalties of the forces at t(n)
  if (failure.ok() && st.log.inc == 1 && moves && scheme_of(s).acceleration) {
    p.newton.grid.a.clear();   // other loads begin
    failure = step_initial_acceleration(p, s, 0.0);
  }
  inc.dt = clock_next(s, st.clock, stops);
  if (p.d.fm.on && s.explicit_steps()) {
    step_undo_later(st, inc.undo);
    inc.undoes = true;
  } else if (p.d.fm.on && moves) {
    begin_undo(st, step_tracks(p.m), inc);           // after the initial acceleration
  }
  st.clock.aim = 0.0;
  inc.watch    = BreakWatch();
  inc.watch.on = !moves && !s.direct && !s.arc.on;
  inc.half     = HalfWatch();
  inc.half.on  = moves && !s.direct && (s.half_force > 0.0 || s.half_part > 0.0);
  return failure;
}

Failure reshape(Problem& p, const Step& s, double t_step, Increment& inc)
{
  const Failure failure = step_reshape(p, s, t_step);
  inc.spoilt = !failure.ok();
  return failure;
}

// Warns once of cracks of points that begin and open in one increment, at the end of which their widths would
// follow the cells                                                                               (2.36b)
void warn_snapped(Problem& p, const Level& before)
{
  const double YOUNG = 0.2;                          // of the opening of zero traction
  const State& st    = p.st;
  const size_t n     = point_history_size(st.points, st.n);
  double sum[2] = {};                                // cracks, and their E Gc/ft^2
  for (int q = 0; q < st.points.npoint; ++q) {
    const Body& body = p.m.body[st.points.body[q]];
    if (body.fracture < 0 || !point_counts(p.m, st.points, q) || !point_open(p.m, st.points, st.n, q) ||
        point_opening(p.m, st.points, before, n, q) >= YOUNG)
      continue;
    const FractureDef& f = p.m.fracture[body.fracture];
    sum[0] += 1.0;
    sum[1] += p.m.material[body.material].young * f.gc / (f.ft * f.ft);
  }
  comm_sum(sum, 2);
  if (sum[0] == 0.0 || !p.warned.insert("cracks of points snapped").second) return;
  log_warn("time %.8g: the cracks of %.0f material points open in one increment, and may dissipate up to "
           "twice the toughness. Use smaller increments; statics of a body longer than 2 E Gc/ft^2 = %.3g "
           "snap back at any dt: use *DYNAMIC, EXPLICIT",
           st.n.time, sum[0], 2.0 * sum[1] / sum[0]);
}

// TRACK: an increment is not cut below this for the advance of a crack                                  time
double least_increment(const Step& s)
{
  return std::max(s.dt_min, LEAST_OF_STEP * (s.proc == PROC_DYNAMIC ? s.dt : s.period));
}

// one attempt over inc.dt; if it converges, its end becomes t(n), and elements break
Failure attempt(Problem& p, const Step& s, Increment& inc, Output& out)
{
  State& st = p.st;
  StepClock& clock = st.clock;
  inc.shorter = 0.5 * inc.dt;
  inc.watch.track = TrackResult();
  Failure failure = step_increment(p, s, s.arc.on ? clock.load : clock.t, inc.dt, inc.energy, &inc.half);
  if (failure.status == HALF_RESIDUAL) inc.shorter = inc.half.shorter;
  inc.known = false;
  if (!failure.ok()) return failure;
  const int iterations = st.log.iterations;
  note_rate(s, inc.dt, st);
  if (p.d.fm.on) step_undo_keep(st, inc.undo);
  std::swap(st.n, st.np1);
  st.n.time = clock.start + clock.t + inc.dt;
  p.ready   = false;
  if (!p.d.fm.on) {
    timer_skip(PHASE_FRACTURE);
    return reshape(p, s, clock.t + inc.dt, inc);
  }
  const double t = s.arc.on ? clock.load : clock.t + inc.dt;
  inc.known = s.explicit_steps() && frac_uses_energy(p.m) && step_tests(p, s, st.n.time);
  inc.watch.shortens = !s.direct && !s.explicit_steps() && st.log.cuts < s.ctl.max_cut &&
                       inc.shorter >= least_increment(s);
  failure = step_fracture(p, s, t, inc.undo, inc.watch, inc.energy, out);
  if (failure.status == CRITERION_EXCEEDED && inc.watch.track.advance == 0.0 &&
      !cut_to_break(p.m, s, inc.watch, inc.dt, st.log.cuts, clock, inc.shorter)) {
    inc.watch.on = false;
    inc.shorter  = 0.5 * inc.dt;
    failure = step_fracture(p, s, t, inc.undo, inc.watch, inc.energy, out);
  }
  st.log.iterations = iterations;
  if (!failure.ok()) return failure;
  const std::vector<ErosionLog> open = frac_points_open(p.m, st.points, inc.undo.n, st.n, st.frac);
  st.eroded.insert(st.eroded.end(), open.begin(), open.end());
  if (!open.empty() && !s.explicit_steps()) warn_snapped(p, inc.undo.n);
  return reshape(p, s, t, inc);
}

// restores t(n) after a failed attempt, with the ledger of before. True: a shorter attempt follows
bool cut(Problem& p, const Step& s, const Ledger& before, Increment& inc, Failure& failure, Output& out)
{
  if (inc.spoilt || !cut_helps(failure.status)) return false;
  State& st = p.st;
  failure.note = step_explain(p, failure);           // explains the state before it is undone
  const StepClock clock = st.clock;
  if (p.d.fm.on) step_undo(p, inc.undo);
  out_erosion_undo(out);
  st.clock  = clock;
  st.clock.load      = inc.clock.load;
  st.clock.load_most = inc.clock.load_most;
  st.clock.ended     = inc.clock.ended;
  st.ledger = before;
  if (!step_prepare(p, s).ok()) return false;
  if ((p.d.fm.on || !p.m.output.restart.write) && step_signalled()) failure = INTERRUPTED;
  if (failure.status == INTERRUPTED || st.log.cuts >= s.ctl.max_cut || inc.shorter < s.dt_min) return false;
  out_listing_cut(st.log.step, st.log.inc, clock.start + clock.t, inc.dt, inc.shorter, failure.status,
                  failure.note.c_str());
  out_status_cut(st, inc.dt, out);
  inc.limit      = failure.status;
  inc.limit_text = failure.note;
  ++st.log.cuts;
  st.clock.cuts = inc.cuts + st.log.cuts;
  inc.dt = inc.shorter;
  if (s.direct) st.clock.easy = 0;
  if (failure.status != CRITERION_EXCEEDED || inc.watch.track.advance > 0.0) st.clock.dt = inc.shorter;
  return true;
}

// cracks that start at corners in one increment  (no test)
const int MOST_STARTS = 32;

// TRACK: cracks start at corners: the increment is repeated from t(n), with the ledger of before, and with
// the lines of these cracks. False: the increment failed for another reason
bool start_cracks(Problem& p, const Step& s, const Ledger& before, Increment& inc, const Failure& failure,
                  Output& out)
{
  if (failure.status != CRITERION_EXCEEDED || inc.watch.track.start.empty()) return false;
  if (++inc.starts > MOST_STARTS) return false;
  State& st = p.st;
  StepClock clock = st.clock;
  step_undo(p, inc.undo);
  out_erosion_undo(out);
  clock.load      = inc.clock.load;
  clock.load_most = inc.clock.load_most;
  clock.ended     = inc.clock.ended;
  st.clock  = clock;
  st.ledger = before;
  TrackResult first;
  frac_start(p.m, s, p.d.el, p.d.fm, inc.watch.track.start, st, first);
  step_warn_lost(p, first.lost);
  begin_undo(st, true, inc);
  log_note("  %s: the increment is repeated with its line", failure.note.c_str());
  return step_prepare(p, s).ok();
}

// half-increment residual relative to its limit; 0: not requested, or nothing moves
double half_part(const HalfWatch& half) { return half.residual > 0.0 ? half.residual / half.limit : 0.0; }

// updates the reference values of later half-increment residuals
void note_forces(double dt, const HalfWatch& half, const Ledger& ledger, StepClock& c)
{
  c.impulse += half.force * dt;
  c.square += half.force * half.force * dt;
  c.energy = std::max(c.energy, ledger.strain + ledger.bond);
}

// Factor of the iterations of Anderson's method for an unsymmetric flow tangent, compared with the full
// tangent  (test: strength/dp_triaxial.inp)
const int UNSYMMETRIC_ITERATIONS = 3;
// The same for cohesive cracks in statics: where the tangent fails, at least four iterations follow (6.38),
// in a shorter increment too  (no test)
const int OPENING_SLOWNESS = 2;

// factor of the iterations of an increment, compared with those of an exact tangent
int slowness(const Model& m, const Step& s)
{
  if (step_flow_unsymmetric(m)) return UNSYMMETRIC_ITERATIONS;
  return s.proc == PROC_STATIC && step_opens(m) ? OPENING_SLOWNESS : 1;
}

// advances clock and log after a converged increment
void accept(const Model& m, const Step& s, double dt, const HalfWatch& half, State& st)
{
  const bool broken = std::any_of(st.eroded.begin(), st.eroded.end(),
                                  [](const ErosionLog& e) { return e.elem >= 0; });
  if (st.clock.most == 0.0 && broken && frac_uses_energy(m)) st.clock.most = st.clock.dt;
  clock_accept(s, dt, st.log.iterations / slowness(m, s), half_part(half), st.clock);
  if (half.on) note_forces(dt, half, st.ledger, st.clock);
  st.log.half       = half.residual;
  st.log.half_limit = half.limit;
  st.n.time = st.clock.start + st.clock.t;
  ++st.log.inc_total;
  st.log.dt     = dt;
  st.log.t_step = st.clock.t;
}

// advice against repeated cuts by this failure
const char* crawl_advice(Status limit)
{
  if (limit == HALF_RESIDUAL) return "a larger dt min or HAFTOL accepts longer increments";
  if (limit == BAD_JACOBIAN)
    return "check the mesh there: refine it, or use *CONVERSION and *EIGENFRACTURE for crushed material";
  return "check the motion there (*VTK) for a mechanism or an instability; *NEWTON, MAX ITER= and LINE "
         "SEARCH= help a slow iteration; dt min of *STATIC or *DYNAMIC ends such a run";
}

// warns once a step of increments much shorter than dt, with the cause
void warn_of_crawl(const Step& s, const State& st, Increment& inc, Warned& warned)
{
  if (s.explicit_steps()) return;
  inc.crawling = inc.dt < CRAWL_PART * s.dt && st.clock.dt < CRAWL_PART * s.dt ? inc.crawling + 1 : 0;
  if (inc.crawling < CRAWL_INCREMENTS) return;
  if (!warned.insert("crawl " + std::to_string(st.log.step)).second) return;
  const std::string why =
      inc.limit == STATUS_OK ? "none of them was cut by this run"
                             : "the last cut: " + (inc.limit_text.empty()
                                                       ? std::string(out_status_text(inc.limit))
                                                       : inc.limit_text);
  log_warn("step %d, time %.8g: %d increments in a row are shorter than a thousandth of dt = %.4g, the last "
           "%.3g: the run crawls; %s. %s",
           st.log.step, st.n.time, inc.crawling, s.dt, inc.dt, why.c_str(), crawl_advice(inc.limit));
}

// warnings on the new state
void warn_of_state(Problem& p, const Step& s)
{
  const State& st = p.st;
  const int every = s.explicit_steps() ? COMPRESSED_EVERY : 10;
  if (s.proc == PROC_STATIC || st.log.inc_total % every == 0 || clock_over(s, st.clock)) {
    step_warn_compressed(p.m, p.d.el, p.d.point_law, st, s, p.warned);
    if (p.d.fm.on) step_warn_bridged(p.m, p.d, st, s, p.warned);
  }
  if (p.d.fm.on) step_warn_loose(p.m, p.d, p.dofs, st, s, p.warned);
  if (!p.d.watch.pair.empty()) overlap_look(p.m, p.d.el, st, p.d.watch);
}

// notes an increment less accurate than requested; warns of the first one of a step that may not be cut
void report_half(const State& st, const HalfWatch& half, Warned& warned)
{
  if (half.jumps)
    log_note("  accepted: the force jumps within the increment, and shorter increments have the same "
             "residual");
  if (half.least) log_note("  accepted: the increment may not be cut any more");
  if (!half.least || !warned.insert("half " + std::to_string(st.log.step)).second) return;
  log_warn("step %d, time %.8g: the half-increment residual is %.3g, %.3g times its limit, and the "
           "increment is not cut any more (dt min, MAX CUT); the listing has the residuals of all increments",
           st.log.step, st.n.time, half.residual, half_part(half));
}

// explicit: a run restarted from the file just written has neither velocity nor acceleration of the grid.
// This run discards them too, so that both continue bitwise alike. Collective.
void discard_grid(Problem& p, const Output& out)
{
  if (comm_bcast(static_cast<int>(out.restart_time.inc == p.st.log.inc_total)) == 0) return;
  p.newton.grid = GridVelocity();
  p.stable.step = 0;
  p.stable.found = ContactFound();
  p.stable.before.clear();
}

// ---------------------------------------------------------------------------
// run_step : one step of the deck                                              doc/theory.md 6.5
// ---------------------------------------------------------------------------
Failure run_step(Problem& p, const Step& s, Increment& inc, Output& out)
{
  State& st = p.st;
  const std::vector<double> stops = clock_stops(p.m, s, st.clock.start);
  p.ready = false;
  bool signal = check_ranks(p);        // several ranks
  while (!clock_over(s, st.clock)) {
    if (signal || (comm_size() == 1 && step_signalled())) return interrupted(p, out);
    if (step_divides_again(p, s)) {
      if (!p.stable.before.empty()) step_turn_begin(p, s);
      step_turn_apart(p, s);
      p.again = AGAIN_WORK;
      return STATUS_OK;
    }
    // 1., 2. grid, rows, pattern, mass
    Failure failure = begin_increment(p, s, stops, inc);
    if (p.again) return STATUS_OK;
    // 3., 4., 5. attempts, each shorter than the one before
    while (failure.ok()) {
      const Ledger before = st.ledger;
      failure = attempt(p, s, inc, out);
      if (!start_cracks(p, s, before, inc, failure, out) &&
          (failure.ok() || !cut(p, s, before, inc, failure, out)))
        break;
      p.stable.before.clear();           // forces of the attempt
      failure = STATUS_OK;
    }
    if (failure.status == INTERRUPTED) return interrupted_inside(p, inc, out);
    if (failure.status == FACES_UNKNOWN) {
      discard_attempt(p, inc, out);
      p.stable.before.clear();           // forces of the attempt
      return stop_for_faces(p, s, inc.before, inc.clock);
    }
    if (!failure.ok()) return failure;
    accept(p.m, s, inc.dt, inc.half, st);
    if (s.explicit_steps() && out_reads_ledger(p.m, st)) {
      if (inc.known) ledger_known(p.m, p.d.el, p.dofs, st.n, s.nlgeom, inc.energy, st);
      else ledger_update(p.m, p.d.el, p.dofs, st.n, s.nlgeom, st);
    }
    warn_of_state(p, s);
    warn_of_crawl(s, st, inc, p.warned);
    log_gather();
    signal = check_ranks(p);
    // 6. write
    out_increment(p.m, p.d.el, st, p.d.grid, out);
    report_half(st, inc.half, p.warned);
    st.eroded.clear();
    // other forces and supports may begin with the next step: the energies then are those of t(n)      (6.33)
    const bool follows = st.log.step < static_cast<int>(p.m.step.size());
    if (s.explicit_steps() && follows && clock_over(s, st.clock)) ledger_leap(p.dofs, 0.0, st);
    if (s.explicit_steps() && p.m.output.restart.write) step_turn_back(p);
    out_restart(p.m, st, p.d.grid, false, out);
    if (s.explicit_steps() && p.m.output.restart.write) discard_grid(p, out);
  }
  return STATUS_OK;
}

void warn_conversion(const Ledger& g)
{
  if (g.conversion < -WARN_DYNAMIC * g.scale)
    log_warn("conversion to points, or an explicit step after an implicit one, added %.1f %% of the energy "
             "(ECONV %.4g): use elements and cells of equal size, smaller increments, or steps of one kind",
             -100.0 * g.conversion / g.scale, g.conversion);
}

// ---------------------------------------------------------------------------
// judge_balance : compares the energy imbalance of a step with *STEP, BALANCE=: above it an error, else a
// warning. Loss is intended in a dissipating scheme. In statics the work of a few large increments follows
// the trapezoidal rule, so only a gross error counts.                                doc/theory.md (6.13)
//   in   noise   noise_of_work
// ---------------------------------------------------------------------------
void judge_balance(const Step& s, int number, double noise, Ledger& g)
{
  const bool moves   = s.proc == PROC_DYNAMIC;
  const double change = g.balance - g.balance0, off = std::fabs(change);
  if (!std::isfinite(change)) {
    log_error("step %d: energies are no longer finite (NaN or infinity): the results are wrong. Check "
              "the deck for a value out of proportion (units, sizes, stiffness, density, penalty, dt)%s",
              number, s.explicit_steps() ? ", or use a smaller SCALE FACTOR= of *DYNAMIC" : "");
    ++g.off;
    return;
  }
  // energies of a step without motion are residuals of Newton's method in earlier steps
  if (g.step_scale <= std::max(noise, s.ctl.tol_force * g.scale)) return;
  if (change < 0.0 && moves && scheme_of(s).dissipates(s)) return;
  const double part = off / g.step_scale;
  if (s.balance > 0.0 && part > s.balance) {
    log_error("step %d: the energy balance is off by %.1f %% of the largest energy (%.4g of %.4g), more than "
              "the %.3g %% that *STEP, BALANCE= allows: the results are wrong. %s",
              number, 100.0 * part, change, g.step_scale, 100.0 * s.balance,
              s.explicit_steps() ? "Use a smaller SCALE FACTOR= of *DYNAMIC"
                  : moves ? "Use smaller increments, or SCHEME=ENERGY-MOMENTUM" : "Use smaller increments");
    ++g.off;
  } else if (part > (moves ? WARN_DYNAMIC : WARN_STATIC)) {
    log_warn("step %d: the energy balance is off by %.1f %% (%.4g of %.4g): repeat with smaller increments "
             "to see whether the results are reliable",
             number, 100.0 * part, change, g.step_scale);
  }
}

// Work of round-off of the forces along the displacements u, relative to Ledger::rounding (u/h)^2: 1e-16 E V
// for (1e-14)^2 E V  (no test)
const double FORCE_ROUNDING = 1e12;

// energies below are round-off: of strains, and of the work of forces in statics. Collective.
double noise_of_work(const Problem& p, const Step& s)
{
  if (s.proc == PROC_DYNAMIC || p.dofs.rows.h_mean <= 0.0) return p.st.ledger.rounding;
  double u = 0.0;
  for (double x : p.st.n.u) u = std::max(u, std::fabs(x));
  const double turn = comm_allreduce_max(u) / p.dofs.rows.h_mean;
  return std::max(1.0, FORCE_ROUNDING * turn * turn) * p.st.ledger.rounding;
}

// work of each rank, for the listing; nothing on one rank
void load_of_ranks(const Elements& el, const Dofs& dofs, std::vector<RankLoad>& ranks)
{
  if (comm_size() == 1) return;
  RankLoad own;
  for (const ElemBlock& b : el.block) own.elements += static_cast<double>(b.live.size());
  own.points = static_cast<double>(dofs.rows.owned_point.size());
  own.bonds  = static_cast<double>(dofs.rows.bond_acts.size());
  for (Phase phase : {PHASE_RESIDUAL, PHASE_TANGENT, PHASE_MASS}) own.assembly += timer_phase(phase).wall;
  own.between = timer_phase(PHASE_COMM).wall;
  own.memory  = out_memory();
  ranks.assign(1, own);
  comm_allgatherv(ranks);
}

// one point a cell sees only the mean gradient: the cell can deform as an hourglass without any stress
void warn_few_points(const Points& pts, const ActiveGrid& grid)
{
  if (pts.npoint_all() > 1.5 * grid.of_all.cells) return;
  log_warn("%d material points in %d cells: with about one point a cell the grid has hourglass modes "
           "without stress, and static solutions may be singular or wrong; use POINTS=2 or more, or larger "
           "cells",
           pts.npoint_all(), grid.of_all.cells);
}

// why the run has stopped, and how to continue it
void report_failure(Problem& p, const Failure& failure, Increment& inc, Output& out)
{
  const StepLog log = p.st.log;
  const double time = p.st.n.time;
  std::string text  = cuts_text(p.m, p.st, failure) + ". " + step_explain(p, failure);
  if (failure.status != INTERRUPTED) text += keep_good_state(p, inc, out);
  log_error("step %d, increment %d, time %.8g: %s", log.step, log.inc, time, text.c_str());
}

// energies at the start need the mass of the first step
void open_ledger(Problem& p)
{
  if (!step_prepare(p, p.m.step.front()).ok()) return;
  if (p.st.points.npoint_all()) warn_few_points(p.st.points, p.d.grid);
  ledger_open(p.m, p.d.el, p.dofs, p.st);
  const Step& s = p.m.step.front();
  if (!s.explicit_steps() || p.st.ledger.bond == 0.0) return;
  // surfaces overlap: their energy is that of the penalties with which the first increment begins
  const StepClock clock = p.st.clock;
  if (step_stable(p, s).ok()) ledger_open(p.m, p.d.el, p.dofs, p.st);
  p.st.clock = clock;
}

int begin_run(Problem& p, Output& out)
{
  open_ledger(p);
  return out_open(p.m, p.d.el, p.st, p.d.grid, out);
}

// state and output of the restart file; derived data are rebuilt
int continue_run(Problem& p, Archive& f, Output& out)
{
  const Points begin = p.st.points;
  const int errors   = out_reopen(p.piece, p.d.el, p.d.fm, f, p.st, p.d.grid, out);
  if (errors) return errors;
  if (p.d.fm.on && !frac_replay(p.m, p.d.fm, p.st, begin, p.d.share)) {
    log_error("the restart file does not fit this model (the repeated conversion gives other points): it is "
              "damaged although its checksum is correct, or was written by another kind of machine; use an "
              "earlier one");
    return 1;
  }
  elem_refresh(p.d.el);
  p.ready = false;
  return 0;
}

// the same in a repartitioned model
void resume_run(Problem& p, Archive& f, Output& out)
{
  const Points begin = p.st.points;
  out_resume(p.piece, p.d.el, p.d.fm, f, p.st, p.d.grid, out);
  MPFE_CHECK(!p.d.fm.on || frac_replay(p.m, p.d.fm, p.st, begin, p.d.share),
             "the repeated conversion gives other points");
  p.stable.apart = p.m.step[p.st.log.step - 1].explicit_steps() && p.st.log.inc > 0;
  elem_refresh(p.d.el);
  p.ready = false;
  heap_give_back();                      // memory of reading the deck and the state
}

int enter_run(Problem& p, RunFrom from, Archive& f, Output& out)
{
  p.again = AGAIN_NOT;
  out_mark(out, false);
  if (from == RUN_BEGIN) return begin_run(p, out);
  if (from == RUN_FILE) return continue_run(p, f, out);
  if (from == RUN_DIVIDED) resume_run(p, f, out);
  return 0;
}

// exit code of a run; off: a check failed, or energy is missing
int exit_code(const Model& m, Status status, bool off)
{
  if (status == SOLVER_FAILED || status == DIVISION_FAILED) return EXIT_RESOURCE;
  if (status == BAD_VALUE) return EXIT_DECK;
  if (status == INTERRUPTED && m.output.restart.write) return EXIT_CONTINUE;
  if (status != STATUS_OK) return EXIT_PHYSICS;
  return off ? EXIT_CHECK_FAILED : EXIT_GOOD;
}

}  // namespace

bool step_signalled()
{
  const int number = comm_allreduce_max(interrupt_signal());
  if (number && !interrupt_signal()) interrupt_note(number);
  return number != 0;
}

int step_run(Problem& p, RunFrom from, Archive& f, Output& out)
{
  if (comm_allreduce_max(enter_run(p, from, f, out))) return EXIT_DECK;
  Failure failure;
  const size_t first = from == RUN_BEGIN ? 0 : p.st.log.step - 1;
  for (size_t k = first; k < p.m.step.size() && failure.ok(); ++k) {
    p.st.log.step = static_cast<int>(k) + 1;
    if (from == RUN_BEGIN || from == RUN_FILE || k > first) out_step_begin(p.m, static_cast<int>(k), out);
    Increment inc;
    if (from == RUN_BEGIN || k > first) begin_step(p.m.step[k], p.st);
    if (p.st.log.begin != STEP_BEGUN) failure = enter_step(p, static_cast<int>(k), inc);
    if (failure.ok() && !p.again) failure = run_step(p, p.m.step[k], inc, out);
    if (p.again) return EXIT_GOOD;
    if (!failure.ok()) report_failure(p, failure, inc, out);
    out_step_end(p.m, p.st, out);
    if (failure.ok()) judge_balance(p.m.step[k], p.st.log.step, noise_of_work(p, p.m.step[k]), p.st.ledger);
  }
  const Status status = failure.status;
  warn_conversion(p.st.ledger);
  load_of_ranks(p.d.el, p.dofs, out.ranks);
  step_memory(p, out.memory);
  const int failed =
      comm_bcast(out_close(p.m, p.d.el, p.st, p.d.grid, p.newton.solver, status == STATUS_OK, out));
  const int code = exit_code(p.m, status, failed || p.st.ledger.off > 0);
  if (code == EXIT_CONTINUE) out_mark(out, true);
  out_status_end(code, out);
  return code;
}
