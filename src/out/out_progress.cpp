#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "base/timer.h"
#include "out/out.h"

namespace {

const double LINE_PAUSE = 1.0; // wall seconds between two lines on a terminal  (no test)

// number of broken elements, and position of the crack tip
std::string crack_text(const Model& m, const State& s, const Output& out)
{
  if (s.frac.neroded == 0 || out.tip.elem < 0) return "";      // a continued run: nothing has broken since
  char text[120];
  const double* x = out.tip.X;
  const int n = std::snprintf(text, sizeof text, "  tip (%.4g, %.4g", x[0], x[1]);
  std::snprintf(text + n, sizeof text - n, m.dim == 3 ? ", %.4g)" : ")", x[2]);
  return text;
}

// columns of the terminal, so that the line does not wrap
int width()
{
  winsize size;
  return ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1 ? size.ws_col - 1 : 79;
}

std::string counts_text(const State& s)
{
  std::string text;
  if (s.frac.neroded > 0) text += "  " + std::to_string(s.frac.neroded) + " broken";
  if (s.points.npoint_all() > 0) text += "  " + std::to_string(s.points.npoint_all()) + " points";
  return text;
}

}  // namespace

double out_whole_time(const Model& m)
{
  double sum = 0.0;
  for (const Step& s : m.step) {
    if (s.arc.on) return 0.0;
    sum += s.period;
  }
  return sum;
}

std::string out_clock_text(double seconds)
{
  char text[60];
  const long t = std::lround(seconds);
  if (t >= 3600) std::snprintf(text, sizeof text, "%ld h %02ld min", t / 3600, t / 60 % 60);
  else if (t >= 60) std::snprintf(text, sizeof text, "%ld min %02ld s", t / 60, t % 60);
  else std::snprintf(text, sizeof text, "%ld s", t);
  return text;
}

// ---------------------------------------------------------------------------
// out_progress : one line per second on the terminal, overwriting the last one
// ---------------------------------------------------------------------------
void out_progress(const Model& m, const State& s, Output& out)
{
  if (!out.progress.terminal) return;
  const double now = timer_wall();
  if (now - out.progress.last < LINE_PAUSE) return;
  out.progress.last = now;
  const double whole = out_whole_time(m), part = whole > 0.0 ? std::min(1.0, s.n.time / whole) : 0.0;
  const double done = whole > 0.0 ? part - out.progress.from / whole : 0.0;
  const double rest = done > 0.0 ? (now - out.progress.wall) * (1.0 - part) / done : 0.0;
  char head[200], percent[20] = "";
  if (whole > 0.0) std::snprintf(percent, sizeof percent, " (%.0f %%)", 100.0 * part);
  std::snprintf(head, sizeof head, "step %d/%zu  increment %d  time %.5g%s  dt %.3g", s.log.step,
                m.step.size(), s.log.inc, s.n.time, percent, s.log.dt);
  std::string line = m.job + "  " + head + counts_text(s);
  if (done > 0.0) line += "  about " + out_clock_text(rest) + " left";
  line += crack_text(m, s, out);
  std::fprintf(stderr, "%.*s\033[K\r", width(), line.c_str());
  std::fflush(stderr);
}

void out_progress_clear(Output& out)
{
  if (out.progress.terminal) std::fprintf(stderr, "\033[K\r");
}
