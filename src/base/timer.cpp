#include "base/timer.h"

#include <ctime>

const char* const phase_name[PHASES] = {
  "input", "set-up", "start of increment", "active grid", "bonds", "contact search", "pattern", "mass",
  "projection", "residual", "tangent", "vectors of Newton", "analysis", "factorisation",
  "back substitution", "preconditioner", "conjugate gradients", "commit", "fracture",
  "estimates of fracture", "output", "between ranks"};

namespace {

PhaseTime table[PHASES];

double seconds(clockid_t clock)
{
  timespec t;
  clock_gettime(clock, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

}  // namespace

double timer_wall() { return seconds(CLOCK_MONOTONIC); }
double timer_cpu() { return seconds(CLOCK_PROCESS_CPUTIME_ID); }
PhaseTime& timer_phase(Phase p) { return table[p]; }

PhaseTime timer_sum()
{
  PhaseTime sum;
  for (int p = 0; p < PHASES; ++p) {
    if (p == PHASE_ESTIMATE) continue;               // part of fracture
    sum.wall += table[p].wall;
    sum.cpu += table[p].cpu;
  }
  return sum;
}
