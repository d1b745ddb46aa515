#include <unistd.h>

#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "base/log.h"
#include "base/timer.h"
#include "out/out.h"

namespace {

const int EVERY = 100;         // explicit increments per line of the listing  (no test)

bool leaps(const Model& m, const State& s)
{
  return s.log.step > 0 && m.step[s.log.step - 1].explicit_steps();
}

bool line_due(const Model& m, const State& s)
{
  return !leaps(m, s) || s.log.inc % EVERY == 0 || !s.eroded.empty();
}

bool vtk_due(const Model& m, const State& s, Output& out)
{
  const VtkDef& v = m.output.vtk;
  if (!v.on) return false;
  const bool by_number = v.frequency > 0 && s.log.inc_total % v.frequency == 0;
  const bool every     = v.frequency <= 0 && v.interval <= 0.0;
  const bool by_time   = out_interval(v.interval, s.n.time, out.vtk_time.next);
  return by_number || every || by_time;
}

}  // namespace

bool out_row_due(const Model& m, const State& s)
{
  if (!leaps(m, s) || s.log.inc == 0 || !s.eroded.empty()) return true;
  if (s.log.inc_total % m.output.history_at.every_explicit() == 0) return true;
  if (clock_over(m.step[s.log.step - 1], s.clock)) return true;
  return std::any_of(m.output.check.begin(), m.output.check.end(), [&](const Check& c) {
    return c.kind == CHECK_HISTORY && c.at == AT_TIME && std::fabs(s.n.time - c.time) <= 1.01 * s.log.dt;
  });
}

bool out_reads_ledger(const Model& m, const State& s) { return out_row_due(m, s) || line_due(m, s); }

// ---------------------------------------------------------------------------
// out_open : summary, columns, first row and frame at t = 0
// ---------------------------------------------------------------------------
int out_open(const Model& m, const Elements& el, const State& s, const ActiveGrid& grid, Output& out)
{
  if (!out.lst) out_listing_open(m, out);
  out_model_summary(out.lst, m, el, s.points, s.bonds);
  out_listing_defaults(out.lst, m, s.bonds);
  out.chk = out_file_first(out.base + ".chk");
  out_check_begin(m, out);
  const int errors = history_setup(m, el, s, out);
  if (errors > 0) return errors;
  history_open(out);
  out.progress.terminal      = comm_rank() == 0 && isatty(STDERR_FILENO) == 1;
  out.progress.wall = timer_wall();
  out_increment(m, el, s, grid, out);
  return 0;
}

// ---------------------------------------------------------------------------
// out_increment : all output due for the accepted state at t(n)
// ---------------------------------------------------------------------------
void out_increment(const Model& m, const Elements& el, const State& s, const ActiveGrid& grid, Output& out)
{
  Timer timer(PHASE_OUTPUT);
  if (s.log.inc_total > 0 && line_due(m, s)) out_listing_increment(s);
  if (out_row_due(m, s)) history_row(m, el, s, out);
  out_check_increment(m, el, s, out);
  if (vtk_due(m, s, out)) out_vtk(m, el, s, grid, out);
  else timer_skip(PHASE_OUTPUT);
  out_dat(m, el, s, out);
  out_erosion(m, s, out);
  out.ero_written = 0;
  out_fragments(m, el, s, false, out);
  out_status_row(m, s, out);
  out_progress(m, s, out);
  out_file_flush(out.lst, out.base + ".lst");
}

// ---------------------------------------------------------------------------
// out_close : last row and frame, checks, tables of time and solver
// ---------------------------------------------------------------------------
int out_close(const Model& m, const Elements& el, const State& s, const ActiveGrid& grid,
              const Solver& solver, bool finished, Output& out)
{
  out_progress_clear(out);
  const int last = static_cast<int>(out.history.rows.size()) - 1;
  if (out.row_written < last) history_write(out, last);
  out_file_close(out.his, out.base + ".his");
  if (m.output.vtk.on && out.vtk_time.inc != s.log.inc_total) out_vtk(m, el, s, grid, out);
  out_fragments(m, el, s, true, out);
  if (out.ero) out_file_close(out.ero, out.base + ".ero");
  if (out.dat) out_file_close(out.dat, out.base + ".dat");

  if (!finished) out_listing_balance(out.lst, m, s);      // else printed by the last step
  const int failed = out_check_end(m, el, s, finished, out);
  out_listing_phases(out.lst);
  out_listing_solver(out.lst, solver);
  out_listing_ranks(out.lst, out.ranks);
  out_listing_skipped(out.lst, m, s);
  out_listing_memory(out.lst, m, out.memory, s.log.equations);
  out_listing_end(out.lst, finished, failed);
  log_open(nullptr);
  out_file_close(out.lst, out.base + ".lst");
  return failed;
}
