#include <algorithm>
#include <cmath>

#include "step/step.h"

namespace {

// Automatic increments grow by GROWS after EASY_ONES in a row with EASY iterations at most, and shrink by
// SHRINKS after more than HARD. Four iterations of Newton's method show quadratic convergence.
// (test: Clock.TwoEasyIncrementsGrowAndOneHardShrinks, Clock.CutIncrementsOfDirectGrowBack)
const int EASY = 4, EASY_ONES = 2, HARD = 8;
const double GROWS = 1.5, SHRINKS = 0.75;

// Dynamics: the half-increment residual falls with the square of the increment. After SMALL_ONES in a row of
// SMALL of the limit at most each increment grows, until one is larger. Number and factor are those of
// Abaqus; 0.8 of the limit is expected of a longer increment.
// (test: Clock.SmallResidualsGrow)
const int SMALL_ONES = 3;
const double GROWS_BY = 1.25, SMALL = 0.8 / (GROWS_BY * GROWS_BY);

// Statics: an increment ends dt_min before a jump of an amplitude, at most BEFORE_JUMP dt, which changes the
// value before the jump by this part of its change in an increment
// (test: Clock.IncrementsEndAtTurnsOfTables)
const double BEFORE_JUMP = 1e-3;

// DIRECT: the length after cuts doubles after an increment of EASY iterations at most, after two in a row of
// HARD at most, and at multiples of dt (whole). A difficult phase costs few rejected attempts
// (test: Clock.CutIncrementsOfDirectGrowBack)
void grow_back(const Step& s, double used, int iterations, bool whole, StepClock& c)
{
  if (!whole && used < c.dt * (1.0 - 1e-9)) return;          // shortened by an output time
  c.easy = iterations <= EASY ? EASY_ONES : iterations <= HARD ? c.easy + 1 : 0;
  if (!whole && c.easy < EASY_ONES) return;
  c.dt   = std::min(s.dt, 2.0 * c.dt);
  c.easy = 0;
}

// the end of the nominal increment, or of the step
double clock_goal(const Step& s, const StepClock& c)
{
  return s.direct ? std::min(s.period, static_cast<double>(c.nominal) * s.dt) : s.period;
}

// the next length; part: half-increment residual over its limit                                  (6.27)
void choose_by_half(const Step& s, double used, int iterations, double part, StepClock& c)
{
  const double ratio = c.dt / used, expected = part * ratio * ratio;      // at the full length
  c.easy = expected <= SMALL && iterations <= HARD ? c.easy + 1 : 0;
  if (iterations > HARD)
    c.dt *= SHRINKS;
  else if (c.easy >= SMALL_ONES)
    c.dt = std::min(s.dt_max, c.dt * GROWS_BY);
}

// amplitudes of loads, supports, bonds and grid boundaries of this step; -1: none
IntVec amplitudes_of(const Model& m, const Step& s)
{
  IntVec used;
  for (const Load& l : s.load)
    if (l.ramp != RAMP_OUT) used.push_back(l.amplitude);
  for (const Prescribed& b : s.prescribed) used.push_back(b.amplitude);
  for (const BondDef& d : m.bond) used.push_back(d.amplitude);
  for (const GridBc& g : m.grid_bc) used.push_back(g.amplitude);
  std::sort(used.begin(), used.end());
  used.erase(std::unique(used.begin(), used.end()), used.end());
  return used;
}

// -1, 0, 1: the table falls, stays, rises after point i; 0 before the first and after the last point
int way_after(const Amplitude& a, int i)
{
  if (i < 0 || i + 1 >= static_cast<int>(a.t.size())) return 0;
  return (a.y[i + 1] > a.y[i]) - (a.y[i + 1] < a.y[i]);
}

// does the table jump at point i + 1?
bool jumps_after(const Amplitude& a, int i)
{
  return i >= 0 && i + 1 < static_cast<int>(a.t.size()) && a.t[i + 1] == a.t[i];
}

// appends the times of the run at which a table turns, begins or ceases to change, and jumps. before: time
// by which an increment ends before a jump, so that the value before it acts too; 0: none does
void add_turns(const Amplitude& a, double origin, double before, std::vector<double>& out)
{
  for (int i = 0; i < static_cast<int>(a.t.size()); ++i) {
    if (jumps_after(a, i)) {
      if (before > 0.0) out.push_back(origin + a.t[i] - before);
    } else if (jumps_after(a, i - 1) || way_after(a, i) != way_after(a, i - 1)) {
      out.push_back(origin + a.t[i]);
    }
  }
}

}  // namespace

double clock_next(const Step& s, const StepClock& c, const std::vector<double>& stops)
{
  if (s.arc.on) return c.dt;
  double end = clock_goal(s, c);
  for (double stop : stops)
    if (stop > c.t + 1e-9 * s.dt && stop < end) end = stop;
  if (c.aim > c.t) return std::min(c.aim, end) - c.t;
  const double left = end - c.t;
  // no tiny last increment: halve the rest
  return c.dt >= left * (1.0 - 1e-9) ? left : c.dt > 0.5 * left && c.dt < left ? 0.5 * left : c.dt;
}

void clock_accept(const Step& s, double used, int iterations, double half, StepClock& c)
{
  c.t += used;
  const bool whole = !s.arc.on && std::fabs(c.t - clock_goal(s, c)) < 1e-9 * s.dt;
  if (whole) {
    c.t = clock_goal(s, c);
    ++c.nominal;
  }
  if (s.explicit_steps()) return;        // step_stable sets the next length
  if (s.direct) return grow_back(s, used, iterations, whole, c);
  if (s.half_force > 0.0 || s.half_part > 0.0) return choose_by_half(s, used, iterations, half, c);
  c.easy = iterations <= EASY ? c.easy + 1 : 0;
  if (c.easy >= EASY_ONES) {
    c.dt   = std::min(c.most > 0.0 ? c.most : s.dt_max, c.dt * GROWS);
    c.easy = 0;
  } else if (iterations > HARD) {
    c.dt *= SHRINKS;
  }
}

std::vector<double> clock_stops(const Model& m, const Step& s, double start)
{
  std::vector<double> at, out;                           // times of the run; of the step
  for (const Check& c : m.output.check)
    if (c.at == AT_TIME) at.push_back(c.time);
  for (const ConversionDef& c : m.conversion)
    if (c.trigger == TRIGGER_TIME) at.push_back(c.limit);
  const double before = s.proc == PROC_STATIC ? std::min(s.dt_min, BEFORE_JUMP * s.dt) : 0.0;
  if (!s.direct && !s.explicit_steps())
    for (int k : amplitudes_of(m, s))
      if (k >= 0) add_turns(m.amplitude[k], m.amplitude[k].total_time ? 0.0 : start, before, at);
  for (double t : at)
    if (t > start && t < start + s.period) out.push_back(t - start);
  std::sort(out.begin(), out.end());
  return out;
}
