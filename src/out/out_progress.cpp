#include <algorithm>
#include <cmath>

#include "base/timer.h"
#include "out/out.h"

namespace {

const double LINE_PAUSE = 0.2; // seconds between two lines

double whole_time(const Model& m)
{
  double sum = 0.0;
  for (const Step& s : m.step) sum += s.period;
  return sum;
}

std::string clock_text(double seconds)
{
  char text[60];
  const long t = std::lround(seconds);
  if (t >= 3600)
    std::snprintf(text, sizeof text, "%ld h %02ld min", t / 3600, t / 60 % 60);
  else
    std::snprintf(text, sizeof text, "%ld min %02ld s", t / 60, t % 60);
  return text;
}

// what has broken, and where the crack is
std::string crack_text(const Model& m, const State& s, const Output& out)
{
  if (s.frac.neroded == 0) return "";
  char text[120];
  const double* x = out.tip.X;
  int n = std::snprintf(text, sizeof text, "  %d broken", s.frac.neroded);
  if (out.tip.elem < 0) return text;                 // a run that goes on: nothing has broken since
  n += std::snprintf(text + n, sizeof text - n, ", tip (%.4g, %.4g", x[0], x[1]);
  std::snprintf(text + n, sizeof text - n, m.dim == 3 ? ", %.4g)" : ")", x[2]);
  return text;
}

}  // namespace

// ---------------------------------------------------------------------------
// out_progress : one line on the terminal, written over the last one
// ---------------------------------------------------------------------------
void out_progress(const Model& m, const State& s, Output& out)
{
  if (!out.terminal) return;
  const double now = timer_wall();
  if (now - out.progress_last < LINE_PAUSE) return;
  out.progress_last = now;
  const double part = std::min(1.0, s.n.time / std::max(whole_time(m), 1e-300));
  const double done = part - out.progress_from / std::max(whole_time(m), 1e-300);
  const double rest = done > 0.0 ? (now - out.progress_wall) * (1.0 - part) / done : 0.0;
  std::fprintf(stderr,
               "%s  step %d of %zu  increment %d  time %.5g (%.0f %%)  dt %.3g  %d iterations%s  about %s "
               "left\033[K\r",
               m.job.c_str(), s.log.step, m.step.size(), s.log.inc, s.n.time, 100.0 * part, s.log.dt,
               s.log.iterations, crack_text(m, s, out).c_str(), clock_text(rest).c_str());
  std::fflush(stderr);
}

void out_progress_clear(Output& out)
{
  if (out.terminal) std::fprintf(stderr, "\033[K\r");
}
