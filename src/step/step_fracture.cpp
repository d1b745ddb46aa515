#include <algorithm>
#include <cmath>
#include <cstdio>

#include "base/comm.h"
#include "base/halo_numbers.h"
#include "base/log.h"
#include "base/timer.h"
#include "model/model_cut.h"
#include "model/scheme.h"
#include "step/step.h"

namespace {

// have points been converted or released since the saved state?
bool points_changed(const State& st, const UndoPoint& u)
{
  return st.frac.nconverted != u.state.frac.nconverted || st.frac.nreleased != u.state.frac.nreleased;
}

// Interval of explicit fracture tests, relative to the wave transit time of the smallest mean size in a ball,
// unless the deck gives one: that of the implicit increments with which AVERAGE and RELEASE were chosen. An
// element that breaks takes its energy out of the estimates beside it, so in shorter intervals fewer elements
// break together  (test: paper/p8_compare)
const double TEST_INTERVAL = 0.75;

// Explicit: domains are reshaped only every so many increments, for the same reason
// (no test)
const int RESHAPE_EVERY = 10;

double test_interval(const Model& m, const Step& s, double crossing)
{
  double interval = 0.0;
  if (s.proc != PROC_DYNAMIC) return interval;
  for (const FractureDef& f : m.fracture) interval = std::max(interval, f.interval);
  return interval == 0.0 && s.explicit_steps() ? TEST_INTERVAL * crossing : interval;
}

// elements that break now; dynamics: sets the time of the next test
//   in   crossing   StableIncrement
void find_erosions(const Model& m, const Discretisation& d, const Step& s, double crossing,
                   const RealVec& energy, State& st, std::vector<Erosion>& erode, FirstBreak& first)
{
  Timer timer(PHASE_FRACTURE);
  Fracture& fr = st.frac;
  erode.clear();
  frac_average(m, s, d.el, d.fm, st.n, energy, fr);
  const double interval = test_interval(m, s, crossing);
  if (interval > 0.0) fr.next_test = std::max(fr.next_test + interval, st.n.time + 0.5 * interval);
  frac_test(m, s, d.el, d.fm, fr, st.n, st.clock.start, energy, erode, first);
}

// Explicit: averages of psi+ at t(n) of the increment, linear between the last test and now; 0, which stands
// for the actual value, where there was none at the last test                                    (7.15)
//   in   before, now   averages of the last test and of now, t1
RealVec averages_between(const RealVec& before, const RealVec& now, double last, double t, double t1)
{
  RealVec mean(before);
  const double part = (t - last) / (t1 - last);
  for (size_t e = 0; e < mean.size(); ++e)
    if (mean[e] > 0.0) mean[e] += part * (now[e] - mean[e]);
  return mean;
}

// times of breaking since the last test: in implicit steps at t(n) of the increment, from l0 on; in explicit
// ones they may lie before it
//   in   mean    averages at the last test; empty: none
void find_times(const Problem& p, const Step& s, double last, RealVec mean, const Level& l0, State& st,
                std::vector<Erosion>& erode)
{
  if (erode.empty()) return;
  if (s.explicit_steps()) {
    mean = averages_between(mean, st.frac.mean, last, l0.time, st.n.time);
    st.frac.mean.swap(mean);
  }
  frac_when(p.m, s, p.d.el, p.d.fm, st.frac, l0, st.clock.start, st.n, erode);
  if (s.explicit_steps()) st.frac.mean.swap(mean);
  for (Erosion& x : erode) x.time = std::max(x.time, s.explicit_steps() ? last : l0.time);
}

// Explicit: elements that break and lose their stress over a time do not change forces and energies at once;
// bulk viscosity does
bool breaks_smoothly(const Model& m, const Step& s, const std::vector<Erosion>& erode)
{
  return s.explicit_steps() && !s.bulk() && std::all_of(erode.begin(), erode.end(), [&](const Erosion& e) {
           return m.fracture[e.def].release > 0.0;
         });
}

// Explicit: cohesive elements that break are open and have no bulk viscosity: forces change at their nodes
// only
bool breaks_open(const Problem& p, const Step& s, const std::vector<Erosion>& erode)
{
  return s.explicit_steps() && !step_on_grid(p.d, p.dofs) && !p.dofs.bound.tie.any && !step_damps(p) &&
         std::all_of(erode.begin(), erode.end(), [&](const Erosion& e) {
           const FractureDef& f = p.m.fracture[e.def];
           return f.criterion == CRITERION_COHESIVE && f.release == 0.0;
         });
}

// what a fracture changes of the forces of an explicit increment: nothing at once; those of the elements that
// break; all. Implicit steps: all
enum ForceChange { FORCES_STAY, FORCES_OF_BROKEN, FORCES_ANEW };

ForceChange force_change(const Problem& p, const Step& s, const std::vector<Erosion>& erode, bool alone)
{
  if (alone && breaks_smoothly(p.m, s, erode)) return FORCES_STAY;
  return alone && breaks_open(p, s, erode) ? FORCES_OF_BROKEN : FORCES_ANEW;
}

// adds the accelerations of forces [nnode*dim] to those of t(n). The kinetic energy of the half step changes
// with them: fracture energy                                                                    (6.33)
void jump_forces(Problem& p, RealVec& force)
{
  const Dofs& s = p.dofs;
  const int dim = s.rows.dim;
  double change = 0.0;
  if (p.m.part.on) halo_sum(p.m.part.halo, dim, force);
  for (int i = 0; i < s.rows.nfe * dim; ++i) {
    const int k = s.rows.node_of_row[i / dim] * dim + i % dim;
    if (force[k] == 0.0 || s.bound.fixed[i] != DOF_FREE) continue;
    const double mass = s.mass.lumped[i / dim], before = p.st.n.a[k], after = before + force[k] / mass;
    p.st.n.a[k] = after;
    if (s.rows.counts(i)) change += mass * (after * after - before * before);
  }
  comm_sum(&change, 1);
  p.st.ledger.fracture += 0.125 * p.st.ledger.leap * p.st.ledger.leap * change;
  if (p.m.part.around.on()) halo_numbers(p.m.part.halo, dim, p.st.n.a);
}

// energies of all elements at t(n) that were intact before something broke are in energy, not empty
void update_ledger(Problem& p, const Step& s, const RealVec& energy)
{
  if (energy.empty()) ledger_update(p.m, p.d.el, p.dofs, p.st.n, s.nlgeom, p.st);
  else ledger_known(p.m, p.d.el, p.dofs, p.st.n, s.nlgeom, energy, p.st);
}

// releases points, breaks elements and converts those that are due. The released energy is booked separately.
//   in   convert   numbers in the mesh of the deck
//        energy    of update_ledger
Failure apply(Problem& p, const Step& s, double t_step, const std::vector<Erosion>& erode, const IntVec& torn,
              IntVec convert, ForceChange change, const RealVec& energy, UndoPoint& u)
{
  State& st = p.st;
  double released = 0.0;
  const bool open = change == FORCES_OF_BROKEN;
  RealVec jump(open ? st.n.u.size() : 0, 0.0);
  if (s.explicit_steps() && change == FORCES_ANEW) update_ledger(p, s, energy);
  const double before = ledger_energy(st.ledger);
  step_undo_state(st, u);
  // dynamics without accelerations: nothing can fail after this that a shorter increment would mend
  if (s.proc == PROC_STATIC || scheme_of(s).acceleration) step_undo_points(st, p.d.share, u);
  {
    Timer timer(PHASE_FRACTURE);
    if (!convert.empty() || !torn.empty()) bond_copy_contact(p.m, st.bonds, st.n);
    if (!torn.empty()) frac_release(p.m, p.d.fm, torn, convert.empty(), st);
    RealVec gain;
    if (open) frac_forces(p.m, s, p.d.el, erode, st.n, 1.0, jump);
    frac_erode(p.m, s, p.d.el, p.d.fm, erode, st.frac, st.n, gain);
    if (open) frac_forces(p.m, s, p.d.el, erode, st.n, -1.0, jump);
    for (size_t k = 0; k < erode.size(); ++k) {
      const Erosion& e = erode[k];
      released += gain[k];
      st.eroded.push_back({e.number, e.label, e.time, e.value, gain[k], {e.X[0], e.X[1], e.X[2]}});
    }
    // elements that lose their stress at once
    if (step_converts(s, st.log)) frac_open(p.m, p.d.fm, st.n, st.frac, convert);
    frac_convert(p.m, p.d.el, p.d.fm, convert, p.d.share, st);
    if (p.m.part.on && !convert.empty()) model_owners(frac_gone(st.frac), p.piece);
    if (!convert.empty() || !torn.empty()) bond_share(p.m, st.points, st.bonds);
  }
  if (!convert.empty() || !torn.empty()) {
    p.dofs.rows.numbered = false;             // other nodes or bonds
    st.laid         = GridLaid();
  }
  p.ready = false;
  Failure failure = step_prepare(p, s);
  if (failure.ok() && open) {
    st.ledger.fracture += released;
    jump_forces(p, jump);
  }
  if (!failure.ok() || change != FORCES_ANEW) return failure;
  // other rows, of which the ledger asks what is prescribed                                       (6.33)
  if (s.explicit_steps()) failure = dof_constrain(p.m, p.d, st, s, t_step, t_step, p.dofs, p.warned);
  if (!failure.ok()) return failure;
  update_ledger(p, s, energy);
  st.ledger.fracture += released;
  st.ledger.conversion += before - ledger_energy(st.ledger) - released;
  ledger_balance(p.m.dim, st.n, st);
  return STATUS_OK;
}

// statics: equilibrium at the same load; the energy loss is fracture energy
Failure settle(Problem& p, const Step& s, double t_step, RealVec& energy)
{
  State& st = p.st;
  const Ledger before = st.ledger;
  if (s.arc.on) {                             // no residual: the next increment finds equilibrium
    ledger_update(p.m, p.d.el, p.dofs, st.n, s.nlgeom, st, &energy);
    st.ledger.fracture += ledger_energy(before) - ledger_energy(st.ledger);
    return STATUS_OK;
  }
  const Failure failure = step_increment(p, s, t_step, 0.0, energy);
  if (!failure.ok()) return failure;
  const double time = st.n.time;
  std::swap(st.n, st.np1);
  st.n.time = time;
  p.ready   = false;
  const double work = st.ledger.external - before.external;
  st.ledger.fracture += ledger_energy(before) + work - ledger_energy(st.ledger);
  const Failure prepared = step_prepare(p, s);
  if (prepared.ok()) ledger_update(p.m, p.d.el, p.dofs, st.n, s.nlgeom, st, &energy);
  return prepared;
}

// explicit: the kinetic energy of the half step changes with the jump of the forces: goes to account (6.33)
void book_leap(Problem& p, const Step& s, double& account)
{
  Ledger& g = p.st.ledger;
  const double before = g.kinetic;
  ledger_update(p.m, p.d.el, p.dofs, p.st.n, s.nlgeom, p.st);
  account += before - g.kinetic;
  ledger_balance(p.m.dim, p.st.n, p.st);
}

// warns once of a front under shear along it: its elements break at G = Gc, but the crack stays in its plane
void warn_twisted(Problem& p, const std::vector<Erosion>& erode)
{
  const auto twisted = [](const Erosion& e) { return e.twist > 0.0; };
  const auto first   = std::find_if(erode.begin(), erode.end(), twisted);
  if (first == erode.end() || !p.warned.insert("front under shear along it").second) return;
  log_warn("time %.8g: element %d breaks at a front under shear along it (K_III): it has %.0f %% of the "
           "energy release. The load of the break includes it; the crack does not turn about its direction "
           "of growth, into facets, as it may in a test",
           p.st.n.time, first->label, 100.0 * first->twist);
}

// the largest principal stress in the plane of an element, mean of its integration points, over its strength
double over_strength(const Problem& p, const Step& s, int e)
{
  const Elements& el = p.d.el;
  const int ngp      = el.gauss_of[e + 1] - el.gauss_of[e];
  double S[3]        = {0, 0, 0};
  for (int g = 0; g < ngp; ++g) {
    IpFields f;
    elem_ip_fields(p.m, el, p.st.n, s.nlgeom, e, g, f);
    S[0] += f.sig[0] / ngp;
    S[1] += f.sig[1] / ngp;
    S[2] += f.sig[3] / ngp;
  }
  const double largest = 0.5 * (S[0] + S[1]) + std::hypot(0.5 * (S[0] - S[1]), S[2]);
  return largest / crack_strength(el.block[el.initial_block[e]].law.crack);
}

// TRACK: warns once of stress far above the strength, in an element that may break and that a crack near it
// keeps from opening                                                                               (2.36c)
void warn_stressed(Problem& p, const Step& s)
{
  const double STRESSED = 1.5;         // strengths  (no test)
  const char* ONCE      = "stress beside a crack";
  if (p.warned.count(ONCE)) return;
  struct Hot { double over; int label; } most{0.0, -1};
  for (int e = 0; e < p.m.mesh.nelem(); ++e) {
    const int def = p.d.fm.def[e];
    if (def < 0 || !p.m.fracture[def].track || !p.m.part.works(e)) continue;
    if (p.st.frac.phase[e] != AS_ELEMENT || p.d.el.broken(e) >= 0 || elem_cracked(p.st.n, e)) continue;
    const double over = over_strength(p, s, e);
    if (over > most.over) most = {over, p.m.mesh.elem_label[e]};
  }
  std::vector<Hot> all = {most};
  comm_allgatherv(all);
  for (const Hot& hot : all)
    if (hot.over > most.over || (hot.over == most.over && hot.label < most.label)) most = hot;
  if (most.over < STRESSED || !p.warned.insert(ONCE).second) return;
  log_warn("time %.8g: at element %d the largest principal stress is %.3g of the strength, and a crack near "
           "it (TRACK) keeps it from opening: what the body carries may be too large; compare with TRACK=NO",
           p.st.n.time, most.label, most.over);
}

// TRACK: where cracks may grow in the next increment. CRITERION_EXCEEDED: the increment is too long,
// or is to be repeated with cracks that start at corners
Failure track_cracks(Problem& p, const Step& s, UndoPoint& before, BreakWatch& w)
{
  w.track = TrackResult();
  if (!step_tracks(p.m)) return STATUS_OK;
  Timer timer(PHASE_FRACTURE);
  step_undo_state(p.st, before);
  frac_track(p.m, s, p.d.el, p.d.fm, p.st, w.track);
  if (w.shortens && w.track.advance > 1.0) {
    w.track.start.clear();
    char text[100];
    std::snprintf(text, sizeof text, "a crack grows by %.3g of its largest advance in an increment",
                  w.track.advance);
    return {CRITERION_EXCEEDED, text};
  }
  if (s.explicit_steps() && !w.track.start.empty()) {  // what has opened since the last test is negligible
    TrackResult first;
    frac_start(p.m, s, p.d.el, p.d.fm, w.track.start, p.st, first);
    step_warn_lost(p, first.lost);
  } else if (!w.track.start.empty()) {
    const TrackStart& first = w.track.start.front();
    const std::string at    = first.node >= 0 ? "node " + std::to_string(p.m.mesh.node_label[first.node])
                                              : "element " + std::to_string(p.m.mesh.elem_label[first.root]);
    return {CRITERION_EXCEEDED, "a crack starts at " + at};
  }
  step_warn_lost(p, w.track.lost);
  warn_stressed(p, s);
  return STATUS_OK;
}

// CRITERION_EXCEEDED: the load of the first fracture lies well inside the increment                (7.25)
Failure stepped_over(const Model& m, const Discretisation& d, const Step& s, const UndoPoint& before,
                     BreakWatch& w)
{
  if (!w.on || w.first.number < 0) return STATUS_OK;
  const double tolerance = m.fracture[w.first.def].tolerance;
  if (tolerance <= 0.0) return STATUS_OK;
  w.value0 = frac_value(m, s, d.el, d.fm, before.state.frac, before.n, before.state.clock.start, w.first);
  if (w.first.value <= 1.0 + tolerance && w.value0 >= 1.0 - tolerance) return STATUS_OK;
  char text[100];
  std::snprintf(text, sizeof text, "element %d: criterion %.5g, at the start %.5g",
                w.first.label, w.first.value, w.value0);
  return {CRITERION_EXCEEDED, text};
}

}  // namespace

void step_warn_lost(Problem& p, int elem)
{
  const int label = comm_allreduce_max(elem >= 0 ? p.m.mesh.elem_label[elem] : -1);
  if (label < 0 || !p.warned.insert("line of a crack lost").second) return;
  log_warn("time %.8g: at element %d a crack has no room to turn, or meets elements that are stronger, "
           "cannot break or have no TRACK: there it grows as without it, and may follow the rows of the mesh",
           p.st.n.time, label);
}

Failure step_fracture(Problem& p, const Step& s, double t_step, UndoPoint& before, BreakWatch& watch,
                      RealVec& energy, Output& out)
{
  std::vector<Erosion> erode;
  IntVec convert, torn;
  FirstBreak later;
  const double last = p.st.frac.mean.empty() ? p.st.clock.start
                                             : std::max(p.st.frac.drive_time, p.st.clock.start);
  RealVec mean;                // explicit: at the last test
  // explicit: the energies of a test are those of t(n)
  const RealVec none;
  const bool known = s.explicit_steps() && frac_uses_energy(p.m) && step_tests(p, s, p.st.n.time);
  for (bool start = true;; start = false) {
    const bool due = step_tests(p, s, p.st.n.time), tests = due || !s.explicit_steps();
    if (s.proc == PROC_STATIC || due) {
      if (s.explicit_steps()) mean = p.st.frac.mean;
      find_erosions(p.m, p.d, s, p.stable.crossing, energy, p.st, erode, start ? watch.first : later);
    } else if (s.explicit_steps()) {
      timer_skip(PHASE_FRACTURE);
      if (!step_converts(s, p.st.log)) return STATUS_OK;
    } else {
      Timer timer(PHASE_FRACTURE);
      frac_average(p.m, s, p.d.el, p.d.fm, p.st.n, energy, p.st.frac);
      timer_skip(PHASE_FRACTURE);
    }
    if (start) {
      const Failure over = stepped_over(p.m, p.d, s, before, watch);
      if (!over.ok()) return over;
    }
    convert.clear();
    torn.clear();
    const bool converts = step_converts(s, p.st.log);
    if (converts) frac_due(p.m, p.d.el, p.d.fm, p.st.frac, p.st.n, convert);
    if (s.explicit_steps() && !(erode.empty() && convert.empty())) step_undo_state(p.st, before);
    if (converts) frac_open(p.m, p.d.fm, p.st.n, p.st.frac, convert);
    find_times(p, s, last, mean, before.n, p.st, erode);
    std::stable_sort(erode.begin(), erode.end(),
                     [](const Erosion& a, const Erosion& b) { return a.time < b.time; });
    if (converts && s.proc == PROC_DYNAMIC)
      frac_to_release(p.m, p.d.fm, p.st.frac, p.st.points, p.st.n, torn);
    // statics: in equilibrium, when nothing breaks any more
    const bool rests = erode.empty() && convert.empty() && torn.empty();
    if ((s.proc == PROC_DYNAMIC && tests) || rests) {
      const Failure tracked = tests ? track_cracks(p, s, before, watch) : Failure();
      if (rests || !tracked.ok()) return tracked;
    }
    warn_twisted(p, erode);
    const ForceChange change = force_change(p, s, erode, convert.empty() && torn.empty());
    Failure failure =
        apply(p, s, t_step, erode, torn, convert, change, known ? energy : none, before);
    if (!failure.ok()) return failure;
    if (s.proc == PROC_DYNAMIC) {
      if (!scheme_of(s).acceleration || change != FORCES_ANEW) return STATUS_OK;
      p.newton.grid.a.clear();             // the forces have jumped
      // where points follow nodes, step_motion_begin evaluates all forces
      const bool followed = s.explicit_steps() && step_on_grid(p.d, p.dofs) &&
          !dof_all(p.dofs, p.d.grid.corner_mesh.empty());
      if (followed) return STATUS_OK;
      failure = step_initial_acceleration(p, s, t_step);
      if (failure.ok() && s.explicit_steps()) book_leap(p, s, p.st.ledger.fracture);
      return failure;
    }
    failure = settle(p, s, t_step, energy);
    if (!failure.ok()) return failure;
    out_erosion(p.m, p.st, out);
    out_progress(p.m, p.st, out);
    if (step_signalled()) return INTERRUPTED;        // a running crack may exceed the time limit of a queue
  }
}

namespace {

// explicit: corners of bodies with RESHAPE take the velocity of the grid: what it cannot represent is lost;
// the projection conserves linear and angular momentum                                               (3.13)
void take_grid_velocity(Problem& p)
{
  const GridVelocity& grid = p.newton.grid;
  Points& pts   = p.st.points;
  const int dim = p.m.dim;
  if (grid.v.empty() || grid.pattern != p.dofs.pattern.number || grid.made != p.d.grid.made) return;
  RealVec v(p.dofs.rows.neq(), 0.0), still(p.st.n.vc.size(), 0.0), vc(still.size());
  std::copy(grid.v.begin(), grid.v.end(), v.begin() + grid.first * dim);
  assem_gather_corners(p.d.grid, p.dofs, v, still, vc);
  for (int q = 0; q < pts.npoint; ++q)
    for (int k = pts.conn.off[q]; k < pts.conn.off[q + 1] && p.m.body[pts.body[q]].reshape > 0.0; ++k)
      std::copy_n(&vc[static_cast<size_t>(pts.conn.item[k]) * dim], dim,
                  &p.st.n.vc[static_cast<size_t>(pts.conn.item[k]) * dim]);
}

}  // namespace

Failure step_reshape(Problem& p, const Step& s, double t_step)
{
  State& st = p.st;
  if (std::none_of(p.m.body.begin(), p.m.body.end(), [](const Body& b) { return b.reshape > 0.0; }) ||
      (s.explicit_steps() && st.log.inc % RESHAPE_EVERY != 0))
    return STATUS_OK;
  if (s.explicit_steps()) ledger_update(p.m, p.d.el, p.dofs, st.n, s.nlgeom, st);
  const double before = ledger_energy(st.ledger);
  if (s.explicit_steps()) take_grid_velocity(p);
  const IntVec which = point_stretched(p.m, st.points, st.n.uc);
  if (which.empty()) {
    ledger_update(p.m, p.d.el, p.dofs, st.n, s.nlgeom, st);
    st.ledger.conversion += before - ledger_energy(st.ledger);
    return STATUS_OK;
  }
  point_reshape(p.m, which, st.points, st.n);
  st.laid = GridLaid();
  p.ready = false;
  Failure failure = step_prepare(p, s);
  if (failure.ok() && s.explicit_steps())
    failure = dof_constrain(p.m, p.d, st, s, t_step, t_step, p.dofs, p.warned);
  if (!failure.ok()) return failure;
  ledger_update(p.m, p.d.el, p.dofs, st.n, s.nlgeom, st);
  st.ledger.conversion += before - ledger_energy(st.ledger);
  ledger_balance(p.m.dim, st.n, st);
  if (s.proc != PROC_DYNAMIC || !scheme_of(s).acceleration) return STATUS_OK;
  p.newton.grid.a.clear();               // the forces have jumped
  failure = step_initial_acceleration(p, s, t_step);
  if (failure.ok() && s.explicit_steps()) book_leap(p, s, st.ledger.conversion);
  return failure;
}

namespace {

// saves all but levels and points
void copy_state(State& st, UndoPoint& u)
{
  Level n, np1;                // not copied
  Points points;
  std::swap(n, st.n);
  std::swap(np1, st.np1);
  std::swap(points, st.points);
  u.state = st;                // into the memory of the last copy
  std::swap(n, st.n);
  std::swap(np1, st.np1);
  std::swap(points, st.points);
  u.whole = true;
}

}  // namespace

void step_undo_point(State& st, bool copy, UndoPoint& u)
{
  copy_state(st, u);
  u.share  = CornerShare();
  u.later  = false;
  u.points = false;
  u.kept   = false;
  u.copy   = copy;
  if (copy) u.n = st.n;
}

void step_undo_later(const State& st, UndoPoint& u)
{
  u.whole = u.points = u.kept = u.copy = false;
  u.contact = {st.bonds.contact.met, st.bonds.contact.wall, st.bonds.normal, st.grid_rf, st.contact};
  u.later   = true;
}

void step_undo_state(State& st, UndoPoint& u)
{
  if (!u.whole) copy_state(st, u);
}

void step_undo_points(const State& st, const CornerShare& share, UndoPoint& u)
{
  if (u.points) return;
  u.state.points = st.points;
  u.share        = share;
  u.points       = true;
}

void step_undo_keep(State& st, UndoPoint& u)
{
  if (u.copy) return;
  std::swap(u.n, st.n);
  u.kept = true;
}

bool step_tests(const Problem& p, const Step& s, double time)
{
  const double interval = test_interval(p.m, s, p.stable.crossing);
  return interval == 0.0 || time >= p.st.frac.next_test - 1e-6 * interval;
}

bool step_can_undo(const State& st, const UndoPoint& u)
{
  return u.points || !u.whole || !points_changed(st, u);
}

namespace {

// explicit: what step_finish wrote before the state was saved
void undo_results(Problem& p, const UndoPoint& u)
{
  State& st = p.st;
  st.bonds.contact.met  = u.contact.met;
  st.bonds.contact.wall = u.contact.wall;
  st.bonds.normal       = u.contact.normal;
  st.grid_rf            = u.contact.grid_rf;
  st.contact            = u.contact.log;
  if (!p.stable.rf.empty()) st.rf.swap(p.stable.rf);
}

}  // namespace

void step_undo(Problem& p, UndoPoint& u)
{
  const StepLog log  = p.st.log;
  const bool changed = u.whole && points_changed(p.st, u), ended = u.kept;
  Level n;
  if (u.copy) n = u.n;
  else std::swap(n, u.kept ? u.n : p.st.n);
  u.kept = false;
  if (!u.whole) {
    // only level n has changed
  } else if (u.points) {
    p.d.share = u.share;
    p.st      = u.state;
  } else {
    MPFE_CHECK(!changed, "undo requested after points were changed");
    std::swap(p.st.points, u.state.points);
    p.st = u.state;
    u.state.points = Points();
  }
  if (u.later && ended) undo_results(p, u);
  p.st.n   = std::move(n);
  p.st.np1 = p.st.n;
  p.st.log = log;
  elem_refresh(p.d.el);
  if (changed && p.m.part.on) model_owners(frac_gone(p.st.frac), p.piece);
  if (changed) {
    p.dofs.rows.numbered = false;
    scene_forget(p.d.scene);
  }
  p.ready = false;
}
