// ---------------------------------------------------------------------------
// timer.h : seconds and calls of the phases of a run
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_TIMER_H
#define MPFE_BASE_TIMER_H

enum Phase {
  PHASE_INPUT,
  PHASE_SETUP,
  PHASE_BEGIN,                 // start of an increment
  PHASE_GRID,
  PHASE_BOND,
  PHASE_CONTACT,
  PHASE_PATTERN,
  PHASE_MASS,
  PHASE_PROJECT,
  PHASE_RESIDUAL,
  PHASE_TANGENT,
  PHASE_VECTORS,               // of Newton's method
  PHASE_ANALYSIS,
  PHASE_FACTOR,
  PHASE_SOLVE,
  PHASE_PRECOND,
  PHASE_CG,
  PHASE_COMMIT,
  PHASE_FRACTURE,
  PHASE_ESTIMATE,
  PHASE_OUTPUT,
  PHASE_COMM,
  PHASES
};

extern const char* const phase_name[PHASES];

struct PhaseTime {
  long calls = 0, skipped = 0;    // skipped: checked, and not needed
  double wall = 0.0, cpu = 0.0;   // seconds
};

double timer_wall();
double timer_cpu();               // of all threads of this process
PhaseTime& timer_phase(Phase p);
PhaseTime timer_sum();            // of all phases
inline void timer_skip(Phase p, long n = 1) { timer_phase(p).skipped += n; }

// Timer timer(PHASE_X); adds the time until the end of its block, without communication
struct Timer {
  explicit Timer(Phase p) : phase(p), comm(timer_phase(PHASE_COMM)), wall0(timer_wall()), cpu0(timer_cpu()) {}
  ~Timer()
  {
    PhaseTime& t = timer_phase(phase);
    ++t.calls;
    const PhaseTime now = timer_phase(PHASE_COMM);
    t.wall += timer_wall() - wall0 - (now.wall - comm.wall);
    t.cpu += timer_cpu() - cpu0 - (now.cpu - comm.cpu);
  }
  Timer(const Timer&) = delete;
  Timer& operator=(const Timer&) = delete;
  Phase phase;
  PhaseTime comm;               // at the start of the block
  double wall0, cpu0;
};

// TimerAround timer(PHASE_X); the same without the phases inside its block
struct TimerAround {
  explicit TimerAround(Phase p) : phase(p), wall0(timer_wall()), cpu0(timer_cpu()), inside(timer_sum()) {}
  ~TimerAround()
  {
    const PhaseTime now = timer_sum();
    PhaseTime& t = timer_phase(phase);
    ++t.calls;
    t.wall += timer_wall() - wall0 - (now.wall - inside.wall);
    t.cpu += timer_cpu() - cpu0 - (now.cpu - inside.cpu);
  }
  TimerAround(const TimerAround&) = delete;
  TimerAround& operator=(const TimerAround&) = delete;
  Phase phase;
  double wall0, cpu0;
  PhaseTime inside;            // of all phases, at the start of the block
};

#endif
