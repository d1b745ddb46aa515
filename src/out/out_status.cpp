#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <fstream>

#include "base/comm.h"
#include "base/run_lock.h"
#include "base/timer.h"
#include "base/version.h"
#include "out/out.h"

namespace {

// wall seconds between rows of explicit increments  (no test)
const double PAUSE = 1.0;

const char* const column_titles =
    "STEP     INC  ATT ITERS    TOTAL_TIME     STEP_TIME            DT   BROKEN    POINTS         WALL";

double seconds(const Output& out) { return timer_wall() - out.progress.status_start; }

bool paused(const Output& out) { return seconds(out) - out.progress.status_last >= PAUSE; }

// is a row due? There may be millions of explicit increments: one per second, the first
// and the last of a step
bool row_due(const Model& m, const State& s, const Output& out)
{
  if (s.log.step == 0 || s.log.inc <= 1) return true;
  const Step& step = m.step[s.log.step - 1];
  return !step.explicit_steps() || clock_over(step, s.clock) || paused(out);
}

void write_row(const State& s, const char* attempt, double t_step, double dt, Output& out)
{
  out.progress.status_last = seconds(out);
  std::fprintf(out.sta, "%5d %7d %4s %5d %13.6e %13.6e %13.6e %8d %9d %12.2f\n", s.log.step, s.log.inc,
               attempt, s.log.iterations, s.n.time, t_step, dt, s.frac.neroded, s.points.npoint_all(),
               out.progress.status_last);
  out_file_flush(out.sta, out.base + ".sta");
}

// ---- reading ------------------------------------------------------------------------

struct StatusRow {
  int step = 0, inc = 0, broken = 0, points = 0;
  double time = 0, dt = 0, wall = 0;
};

struct StatusFile {            // the last run in JOB.sta
  bool begun = false, ended = false;
  int code = -1;               // at its end
  int steps = 0;
  double whole = 0;            // time of all steps; 0: unknown, a RIKS step
  int rows = 0;
  StatusRow first, last;
};

bool read_status(const std::string& path, StatusFile& f)
{
  std::ifstream in(path);
  if (!in) return false;
  std::string line;
  while (std::getline(in, line)) {
    StatusRow r;
    double t_step  = 0.0;
    char attempt[16];
    int iterations = 0;
    if (line.find("SUMMARY OF JOB INFORMATION") != std::string::npos) {
      f       = StatusFile();
      f.begun = std::sscanf(line.c_str() + line.rfind("steps "), "steps %d, total time %lf", &f.steps,
                            &f.whole) >= 1;
    } else if (const char* code = std::strstr(line.c_str(), "(exit code ")) {
      f.ended = true;
      f.code  = std::atoi(code + 11);
    } else if (std::sscanf(line.c_str(), "%d %d %15s %d %lf %lf %lf %d %d %lf", &r.step, &r.inc, attempt,
                           &iterations, &r.time, &t_step, &r.dt, &r.broken, &r.points, &r.wall) == 10) {
      if (f.rows++ == 0) f.first = r;
      f.last = r;
    }
  }
  return f.begun;
}

// seconds since the file was written to
double age_of(const std::string& path)
{
  struct stat info;
  return stat(path.c_str(), &info) == 0 ? std::difftime(std::time(nullptr), info.st_mtime) : 0.0;
}

std::string base_of(std::string job)
{
  for (const char* ending : {".inp", ".sta", ".lst"}) {
    const size_t n = std::strlen(ending);
    if (job.size() > n && job.compare(job.size() - n, n, ending) == 0) return job.substr(0, job.size() - n);
  }
  return job;
}

std::string verdict(const std::string& base, const StatusFile& f, bool running, const std::string& owner)
{
  if (running) return "running (" + owner + ")";
  if (!f.ended) return "ended without a word: killed, or out of memory or disk";
  if (f.code == EXIT_GOOD) return "finished";
  if (f.code == EXIT_CHECK_FAILED)
    return "finished, but a *CHECK failed or energy is missing: see " + base + ".lst";
  if (f.code == EXIT_CONTINUE) return "ended by a signal; mpfe --restart " + base + ".rst continues it";
  return "stopped before its end, exit code " + std::to_string(f.code) + ": " + base + ".lst says why";
}

// present position and progress of the run
void print_rows(std::FILE* file, const StatusFile& f, bool running, double age)
{
  const StatusRow& r = f.last;
  if (f.rows == 0) {
    std::fprintf(file, "  no increment so far\n");
    return;
  }
  char of[60] = " (RIKS: the end is open)";
  if (f.whole > 0.0) std::snprintf(of, sizeof of, " of %.6g (%.3g %%)", f.whole, 100.0 * r.time / f.whole);
  std::fprintf(file, "  step %d of %d, increment %d, total time %.6g%s, dt %.4g\n", r.step, f.steps, r.inc,
               r.time, of, r.dt);
  std::fprintf(file, "  %d broken elements, %d points\n  %s", r.broken, r.points,
               out_clock_text(r.wall).c_str());
  const double rate = (r.time - f.first.time) / std::max(r.wall - f.first.wall, 1e-9);
  if (running && rate > 0.0 && f.whole > 0.0)
    std::fprintf(file, ", about %s left; last row %.0f s ago",
                 out_clock_text(std::max(0.0, (f.whole - r.time) / rate - age)).c_str(), age);
  std::fprintf(file, "\n");
}

}  // namespace

// ---------------------------------------------------------------------------
// out_status_open : JOB.sta, the progress of the run; goes_on: append to the existing rows
// ---------------------------------------------------------------------------
void out_status_open(const Model& m, bool goes_on, Output& out)
{
  out.progress.status_start = timer_wall();
  if (comm_rank() > 0) return;
  char host[256] = "";
  gethostname(host, sizeof host - 1);
  out.sta = out_file_open(out.base + ".sta", goes_on);
  std::fprintf(out.sta, "# SUMMARY OF JOB INFORMATION: %s, mpfe %s, process %ld on %s, steps %zu, ",
               m.job.c_str(), MPFE_VERSION, static_cast<long>(getpid()), host, m.step.size());
  if (out_whole_time(m) > 0.0) std::fprintf(out.sta, "total time %.9g\n", out_whole_time(m));
  else std::fprintf(out.sta, "total time open (RIKS)\n");
  std::fprintf(out.sta, "#%s\n", column_titles);
  out_file_flush(out.sta, out.base + ".sta");
}

void out_status_row(const Model& m, const State& s, Output& out)
{
  if (!out.sta || !row_due(m, s, out)) return;
  write_row(s, std::to_string(s.log.inc > 0 ? s.log.cuts + 1 : 0).c_str(), s.clock.t, s.log.dt, out);
}

void out_status_cut(const State& s, double dt, Output& out)
{
  if (out.sta) write_row(s, (std::to_string(s.log.cuts + 1) + "U").c_str(), s.clock.t, dt, out);
}

void out_status_end(int code, Output& out)
{
  if (!out.sta) return;
  const char* const words = code == EXIT_GOOD           ? "HAS COMPLETED SUCCESSFULLY"
                            : code == EXIT_CHECK_FAILED ? "HAS COMPLETED; A CHECK FAILED OR ENERGY IS MISSING"
                            : code == EXIT_CONTINUE     ? "WAITS TO BE CONTINUED"
                                                        : "HAS NOT BEEN COMPLETED";
  std::fprintf(out.sta, "# THE ANALYSIS %s (exit code %d)\n", words, code);
  out_file_close(out.sta, out.base + ".sta");
}

// ---------------------------------------------------------------------------
// out_status : mpfe --status JOB: whether it runs, its progress, or its end. Returns the exit code of the
// run, or STATUS_RUNNING; EXIT_RESOURCE without an end, EXIT_DECK without a run
// ---------------------------------------------------------------------------
int out_status(const std::string& job, std::FILE* file)
{
  const std::string base = base_of(job), path = base + ".sta";
  StatusFile f;
  if (!read_status(path, f)) {
    std::fprintf(stderr,
                 "mpfe --status: there is no %s of a run of mpfe; with results in a folder (-o) give it too: "
                 "mpfe --status results/beam\n",
                 path.c_str());
    return EXIT_DECK;
  }
  std::string owner;
  const bool running = !f.ended && lock_held(base + ".lock", owner);
  const int code     = running ? STATUS_RUNNING : f.ended ? f.code : EXIT_RESOURCE;
  std::fprintf(file, "%s: %s\n", base.c_str(), verdict(base, f, running, owner).c_str());
  print_rows(file, f, running, age_of(path));
  return code;
}
