// ---------------------------------------------------------------------------
// timer.h : seconds and calls of the phases of a run
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_TIMER_H
#define MPFE_BASE_TIMER_H

enum Phase {
  PHASE_INPUT, PHASE_SETUP, PHASE_GRID, PHASE_BOND, PHASE_CONTACT, PHASE_PATTERN, PHASE_MASS, PHASE_PROJECT,
  PHASE_RESIDUAL, PHASE_TANGENT, PHASE_ANALYSIS, PHASE_FACTOR, PHASE_SOLVE, PHASE_PRECOND, PHASE_CG, PHASE_COMMIT,
  PHASE_FRACTURE, PHASE_OUTPUT,
  PHASES
};

extern const char* const phase_name[PHASES];

struct PhaseTime {
  long calls = 0;
  double wall = 0.0, cpu = 0.0;   // seconds
};

double timer_wall();
double timer_cpu();               // of all threads of this process
PhaseTime& timer_phase(Phase p);

// Timer timer(PHASE_X); adds the time until the end of its block
struct Timer {
  explicit Timer(Phase p) : phase(p), wall0(timer_wall()), cpu0(timer_cpu()) {}
  ~Timer()
  {
    PhaseTime& t = timer_phase(phase);
    ++t.calls;
    t.wall += timer_wall() - wall0;
    t.cpu += timer_cpu() - cpu0;
  }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;
  Phase phase;
  double wall0, cpu0;
};

#endif
