#include <sys/resource.h>
#include <sys/utsname.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <ctime>

#include "base/comm.h"
#include "base/log.h"
#include "base/timer.h"
#include "base/version.h"
#include "model/scheme.h"
#include "out/out.h"

namespace {

const double program_start = timer_wall();

std::string date_text()
{
  const std::time_t now = std::time(nullptr);
  char text[40];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", std::localtime(&now));
  return text;
}

const char* environment(const char* name)
{
  const char* value = std::getenv(name);
  return value ? value : "not set";
}

const char* mode_text()
{
#if defined(__AVX512F__)
  return "AVX-512";
#elif defined(__AVX2__)
  return "AVX2";
#else
  return "baseline";
#endif
}

// 0 means the default in numbers of the deck
std::string or_default(double value, const char* meaning)
{
  char text[80];
  if (value > 0.0)
    std::snprintf(text, sizeof text, "%g", value);
  else
    std::snprintf(text, sizeof text, "%s", meaning);
  return text;
}

void dynamic_defaults(std::FILE* file, const Step& s)
{
  const char* origin = s.scheme_given ? "" : " (default for this model)";
  const Scheme& scheme = scheme_of(s);
  std::fprintf(file, "  scheme          %s, %s%s\n", scheme.name, scheme.describe(s).c_str(), origin);
  if (s.bulk() || s.bulk_mid())
    std::fprintf(file, "  bulk viscosity  linear %g, quadratic %g\n", s.bulk_linear, s.bulk_quadratic);
  if (s.half_force > 0.0)
    std::fprintf(file, "  half increment  residual at most %g\n", s.half_force);
  else if (s.half_part > 0.0)
    std::fprintf(file, "  half increment  residual at most %g of the force of inertia\n", s.half_part);
}

void step_defaults(std::FILE* file, const Model& m, int i)
{
  const Step& s = m.step[i];
  std::fprintf(file, "\nSTEP %d of %zu: %s, %s geometry, %s increments\n", i + 1, m.step.size(),
               s.proc == PROC_STATIC ? "static" : "dynamic", s.nlgeom ? "nonlinear" : "linear",
               s.direct ? "fixed" : "automatic");
  std::fprintf(file, "  period %g, dt %g, dt min %s, dt max %s, at most %d increments\n", s.period, s.dt,
               or_default(s.dt_min, "not given").c_str(), or_default(s.dt_max, "not given").c_str(),
               s.max_inc);
  if (s.proc == PROC_DYNAMIC) dynamic_defaults(file, s);
  if (s.balance > 0.0)
    std::fprintf(file, "  balance         %g of the largest energy in the step, or exit code 1\n",
                 s.balance);
  std::fprintf(
      file,
      "  Newton          force tolerance %g, energy tolerance %g, %d iterations, %d cuts, line search %s\n",
      s.ctl.tol_force, s.ctl.tol_energy, s.ctl.max_iter, s.ctl.max_cut, s.ctl.line_search ? "yes" : "no");
  std::fprintf(file, "  acting          %zu loads, %zu boundary conditions\n", s.load.size(),
               s.prescribed.size());
}

double phase_wall(Phase p) { return timer_phase(p).wall; }

struct NamedBytes {            // sent between ranks
  char what[40];
  double bytes;
};

NamedBytes named_bytes(const char* what, double bytes)
{
  NamedBytes u;
  std::snprintf(u.what, sizeof u.what, "%s", what);
  u.bytes = bytes;
  return u;
}

// memory of all ranks by purpose, summed on rank 0, in the order of first occurrence
void add_ranks(std::vector<NamedBytes>& use)
{
  std::vector<NamedBytes> sum;
  for (const std::vector<NamedBytes>& of_rank : comm_gather(use))
    for (const NamedBytes& u : of_rank) {
      const auto same = [&u](const NamedBytes& k) { return std::strcmp(k.what, u.what) == 0; };
      const auto at = std::find_if(sum.begin(), sum.end(), same);
      if (at == sum.end()) sum.push_back(u);
      else at->bytes += u.bytes;
    }
  use = sum;
}

}  // namespace

const char* out_status_text(Status status)
{
  switch (status) {
    case STATUS_OK:       return "good";
    case BAD_JACOBIAN:    return "an element or a material point turned inside out (det F <= 0)";
    case BAD_NUMBER:      return "the residual contains a NaN or an infinity";
    case BAD_VALUE:       return "a load or a support is not a number";
    case SOLVER_SINGULAR: return "the matrix is singular (a body without support?)";
    case SOLVER_FAILED:   return "the linear solver failed";
    case NOT_CONVERGED:   return "Newton's method did not converge";
    case MASS_FAILED:     return "the mass system was not solved";
    case CONTACT_DEPTH:   return "a contact point penetrates its face too deeply";
    case OUTSIDE_GRID:    return "a material point left the grid";
    case HALF_RESIDUAL:   return "the half-increment residual is too large";
    case CRITERION_EXCEEDED: return "the load of the first break lies within the increment";
    case FACES_UNKNOWN:   return "contact faces owned by other ranks have come within search range";
    case DIVISION_FAILED: return "bodies of different ranks approach each other, and the model cannot be "
                                 "divided again: restore the deck as it was at the start of the run, or "
                                 "free space for temporary files, then start again or continue from a "
                                 "restart file";
    case INTERRUPTED:     return "a signal ended the run";
  }
  return "unknown";
}

// ---------------------------------------------------------------------------
// out_listing_open : JOB.lst with its header; from now on messages are also written there
// ---------------------------------------------------------------------------
void out_listing_open(const Model& m, Output& out, bool goes_on)
{
  out.base = m.out_dir.empty() ? m.job : m.out_dir + "/" + m.job;
  out.lst  = out_file_first(out.base + ".lst", goes_on);
  out_status_open(m, goes_on, out);
  if (comm_rank() > 0) return;
  log_open(out.lst);
  if (goes_on) std::fprintf(out.lst, "\n\n---- continued from %s ----\n\n", out.from.c_str());
  utsname machine;
  uname(&machine);
  std::fprintf(out.lst, "mpfe %s   implicit material points and finite elements\n\n", MPFE_VERSION);
  if (!m.notes.heading.empty()) std::fprintf(out.lst, "%s\n\n", m.notes.heading.c_str());
  std::fprintf(out.lst, "  job             %s\n  deck            %s\n  date            %s\n", m.job.c_str(),
               m.deck.c_str(), date_text().c_str());
  std::fprintf(out.lst, "  machine         %s %s, %ld processors\n", machine.sysname, machine.machine,
               sysconf(_SC_NPROCESSORS_ONLN));
  std::fprintf(out.lst, "  ranks           %d", comm_size());
  if (comm_started() > comm_size())
    std::fprintf(out.lst, " of %d; the model is too small for more", comm_started());
  std::fprintf(out.lst, "\n");
  std::fprintf(out.lst, "  threads         OMP_NUM_THREADS %s, OPENBLAS_NUM_THREADS %s\n",
               environment("OMP_NUM_THREADS"), environment("OPENBLAS_NUM_THREADS"));
  std::fprintf(out.lst, "  compiled        by C++ compiler %s, vector instructions %s\n", __VERSION__,
               mode_text());
  for (const auto& p : m.notes.param)
    std::fprintf(out.lst, "  parameter       %s = %.15g\n", p.first.c_str(), p.second);
}

// out_listing_defaults : defaults for everything that the deck does not specify
void out_listing_defaults(std::FILE* file, const Model& m, const Bonds& bonds)
{
  std::fprintf(file, "\nSETTINGS (also those the deck leaves to the program)\n");
  const char* const solver[] = {"automatic", "skyline", "MUMPS", "conjugate gradients",
                               "algebraic multigrid"};
  const char* const precond[] = {"incomplete Cholesky", "diagonal blocks", "incomplete Cholesky",
                                 "earlier factors"};
  std::fprintf(file, "  solver          %s%s%s\n", solver[m.solver.kind],
               m.solver.kind == SOLVER_CG ? ", preconditioner " : "",
               m.solver.kind == SOLVER_CG ? precond[m.solver.precond]
               : m.solver.reuse           ? ""
                                          : ", a factorisation in each iteration");
  if (m.part.on)
    std::fprintf(file, "  model           divided: each rank has its elements and their nodes%s alone\n",
                 m.part.points ? ", its points and their corners" : "");
  if (m.grid.given)
    std::fprintf(file, "  grid            nodes weaker than %g follow others (extended basis%s)\n",
                 m.grid.weak, m.grid.weak > 0.0 ? "" : ", off");
  for (std::size_t i = 0; i < m.bond.size(); ++i) {
    const BondDef& d = m.bond[i];
    const double formed = bond_sums(bonds, static_cast<int>(i)).penalty,
                 per_area = d.penalty > 0.0 ? d.penalty : formed;
    std::fprintf(file, "  bond %-10s penalty %s (%s), %s between nodes, %d augmentations, %s\n",
                 d.name.c_str(), or_default(per_area, "set when bonds form").c_str(),
                 d.penalty > 0.0 ? "given"
                 : d.alpha > 0.0 ? "alpha M/h, alpha given"
                                 : "alpha M/h, alpha of the program",
                 d.intermediate < 0 && d.contact.by_face ? "at points inside the slave faces, none"
                 : d.intermediate < 0            ? "as close as the corners of the body"
                                                 : std::to_string(d.intermediate).c_str(),
                 d.augment, d.normal_only ? "one direction" : "all directions");
  }
  const HistoryOutput& at = m.output.history_at;
  const bool rapid = std::any_of(m.step.begin(), m.step.end(),
                                 [](const Step& x) { return x.explicit_steps(); });
  std::fprintf(file, "  history         every %d increments%s\n", at.every(),
               rapid && at.every_explicit() != at.every()
                   ? (", in explicit steps every " + std::to_string(at.every_explicit())).c_str() : "");
  if (m.output.vtk.on)
    std::fprintf(file, "  VTK             %s, every %s increments, time interval %s\n",
                 m.part.on     ? ".pvtu and a .vtu of each rank, since the model is divided"
                 : m.output.vtk.xml   ? ".vtu"
                 : m.output.vtk.ascii ? "text"
                               : "binary",
                 or_default(m.output.vtk.frequency, m.output.vtk.interval > 0.0 ? "-" : "1").c_str(),
                 or_default(m.output.vtk.interval, "-").c_str());
  const RestartDef& r = m.output.restart;
  if (r.write)
    std::fprintf(file,
                 "  restart         every %s increments, time interval %s, at the end of each step; %s\n",
                 or_default(r.frequency, "-").c_str(), or_default(r.interval, "-").c_str(),
                 r.overlay ? "the last file stays" : "all files stay");
}

void out_step_begin(const Model& m, int step, Output& out)
{
  if (!m.step[step].change.empty()) out.converted = -1;        // items of columns are found again
  step_defaults(out.lst, m, step);
  std::fprintf(
      out.lst,
      "\n   step    inc   iter      residual   force scale         ratio        energy  line search\n");
}

void out_step_end(const Model& m, const State& s, Output& out)
{
  std::fprintf(out.lst, "\nend of step %d after %d increments at time %.9g\n", s.log.step, s.log.inc,
               s.n.time);
  out_listing_balance(out.lst, m, s);
}

// ---- lines of the increments ---------------------------------------------------

void out_listing_iteration(int step, int inc, int iter, double residual, double scale, double energy,
                           double line_search)
{
  log_note("%7d%7d%7d%14.4e%14.4e%14.4e%14.4e%13.4f", step, inc, iter, residual, scale,
           scale > 0.0 ? residual / scale : 0.0, energy, line_search);
}

void out_listing_cut(int step, int inc, double time, double dt, double dt_new, Status why, const char* detail)
{
  log_note("  step %d, increment %d, time %.9g, dt %.6g %s: %s%s%s", step, inc, time, dt,
           why == CRITERION_EXCEEDED || why == HALF_RESIDUAL ? "is cut" : "failed", out_status_text(why),
           detail && *detail ? "; " : "", detail ? detail : "");
  if (dt_new > 0.0) log_note("  back to time %.9g, next try with dt %.6g", time, dt_new);
}

void out_listing_increment(const State& s)
{
  const StepLog& l = s.log;
  log_note("  increment %d done: time %.9g, dt %.6g, %d iterations, %d cuts, %d equations, balance %.3e",
           l.inc, s.n.time, l.dt, l.iterations, l.cuts, l.equations, s.ledger.balance);
  if (l.half_limit > 0.0)
    log_note("  half-increment residual %.4e, %.3g of the %.4e allowed", l.half, l.half / l.half_limit,
             l.half_limit);
  if (!s.eroded.empty())
    log_note("  broken: %zu elements in this increment, %d so far, %d under release; %d points, %d bonds",
             s.eroded.size(), s.frac.neroded, s.frac.nreleasing, s.points.npoint_all(), s.bonds.nbond_all());
  if (l.grid_cells > 0)
    log_note("  grid: %d cells, %d nodes, %d weak; slip max %.4e, rms %.4e", l.grid_cells, l.grid_nodes,
             l.weak_nodes, s.ledger.slip_max, s.ledger.slip_rms);
}

// ---- tables ------------------------------------------------------------------------

void out_listing_balance(std::FILE* file, const Model& m, const State& s)
{
  const Ledger& l = s.ledger;
  std::fprintf(file, "\nENERGY at time %.9g\n", s.n.time);
  std::fprintf(file, "  kinetic         %18.10e\n  strain          %18.10e\n  bonds           %18.10e\n",
               l.kinetic, l.strain, l.bond);
  if (l.fracture + l.cohesive != 0.0 || s.frac.neroded > 0)
    std::fprintf(file, "  fracture        %18.10e   (%d elements, crack area %.6g)\n",
                 l.fracture + l.cohesive, s.frac.neroded, s.frac.area);
  if (s.frac.nconverted > 0)
    std::fprintf(file, "  conversion      %18.10e   (%d elements)\n", l.conversion, s.frac.nconverted);
  if (s.frac.nreleased > 0)
    std::fprintf(file, "  released points    %18d   (their shape was made anew %d times)\n",
                 s.frac.nreleased, s.frac.renewed);
  if (l.plastic != 0.0) std::fprintf(file, "  plastic flow    %18.10e\n", l.plastic);
  if (l.friction != 0.0) std::fprintf(file, "  friction        %18.10e\n", l.friction);
  if (l.ghost != 0.0) std::fprintf(file, "  ghosts          %18.10e\n", l.ghost);
  if (l.viscous != 0.0) std::fprintf(file, "  viscous         %18.10e\n", l.viscous);
  if (l.renewal != 0.0) std::fprintf(file, "  grid renewed    %18.10e\n", l.renewal);
  if (l.overlap != 0.0)
    std::fprintf(file, "  overlap         %18.10e   (of contact at the start)\n", l.overlap);
  if (l.released != 0.0)
    std::fprintf(file, "  supports freed  %18.10e   (by *BOUNDARY, OP=NEW)\n", l.released);
  if (l.sudden != 0.0)
    std::fprintf(file, "  sudden loads    %18.10e   (at the start of static steps)\n", l.sudden);
  if (l.removed != 0.0)
    std::fprintf(file, "  removed         %18.10e   (elements, by *MODEL CHANGE)\n", l.removed);
  if (l.stopped != 0.0) std::fprintf(file, "  motion stopped  %18.10e   (by static steps)\n", l.stopped);
  std::fprintf(file, "  at the start    %18.10e\n  external work   %18.10e\n", l.total0, l.external);
  std::fprintf(file, "  balance         %18.10e   (%.3e of the largest energy)\n", l.balance,
               l.scale > l.rounding ? l.balance / l.scale : 0.0);
  std::fprintf(file, "  momentum        %18.10e %18.10e", l.momentum[0], l.momentum[1]);
  if (m.dim == 3) std::fprintf(file, " %18.10e", l.momentum[2]);
  std::fprintf(file, "\n  angular         ");
  for (int i = m.dim == 3 ? 0 : 2; i < 3; ++i) std::fprintf(file, "%18.10e ", l.angular[i]);
  std::fprintf(file, "\n");
  if (s.bonds.nbond_all() > 0)
    std::fprintf(file, "  slip            %18.10e largest, %.10e rms\n", l.slip_max, l.slip_rms);
}

// out_listing_phases : calls and seconds of each phase since the start of the program
void out_listing_phases(std::FILE* file)
{
  const double total = timer_wall() - program_start;
  double wall = 0.0, cpu = 0.0;
  std::fprintf(file, "\nTIME\n  %-20s %10s %12s %12s %8s\n", "phase", "calls", "wall s", "cpu s", "share");
  for (int p = 0; p < PHASES; ++p) {
    const PhaseTime& t = timer_phase(static_cast<Phase>(p));
    if (t.calls == 0 || p == PHASE_ESTIMATE) continue;     // part of fracture, counted separately
    std::fprintf(file, "  %-20s %10ld %12.4f %12.4f %6.1f %%\n", phase_name[p], t.calls, t.wall, t.cpu,
                 100.0 * t.wall / total);
    wall += t.wall;
    cpu  += t.cpu;
  }
  std::fprintf(file, "  %-20s %10s %12.4f %12.4f %6.1f %%\n", "other", "", total - wall, timer_cpu() - cpu,
               100.0 * (total - wall) / total);
  std::fprintf(file, "  %-20s %10s %12.4f %12.4f\n", "whole run", "", total, timer_cpu());
}

const char* const path_name[PATHS] = {"factorisation",
                                      "factors of the same matrix",
                                      "CG, factors of an earlier matrix",
                                      "CG, the same, changed rows corrected",
                                      "CG, incomplete Cholesky",
                                      "CG, diagonal blocks",
                                      "CG, algebraic multigrid",
                                      "CG, single precision"};

// ---------------------------------------------------------------------------
// out_listing_solver : work of the linear solver, and the other cost of a Newton iteration
// ---------------------------------------------------------------------------
void out_listing_solver(std::FILE* file, const Solver& s)
{
  std::fprintf(file, "\nSOLVER  %s\n", solve_name(s));
  long solves = 0;
  for (const PathLog& l : s.path) solves += l.solves;
  if (solves == 0) {
    std::fprintf(file, "  not used\n");
    return;
  }
  const auto each = [](double seconds, long n) { return n > 0 ? seconds / static_cast<double>(n) : 0.0; };
  std::fprintf(file, "  analyses        %8ld   %12.6f s each\n", s.nanalyse,
               each(s.seconds_analyse, s.nanalyse));
  std::fprintf(file, "  factorisations  %8ld   %12.6f s each\n", s.nfactor,
               each(s.seconds_factor, s.nfactor));
  if (s.ncholmod) std::fprintf(file, "  by CHOLMOD      %8ld   of them, the others by MUMPS\n", s.ncholmod);
  if (s.fixed_null_pivots)
    std::fprintf(file, "  zero pivots     %8ld   unknowns of broken material that were fixed\n",
                 s.fixed_null_pivots);
  std::fprintf(file, "  back            %8ld   %12.6f s each\n", s.nback, each(s.seconds_back, s.nback));
  std::fprintf(file, "  %-34s %8s %12s %10s %10s %8s\n", "solutions by", "number", "cpu s each", "iterations",
               "each", "given up");
  for (int k = 0; k < PATHS; ++k) {
    const PathLog& l = s.path[k];
    if (l.solves + l.failed == 0) continue;
    std::fprintf(file, "  %-34s %8ld %12.6f %10ld %10.1f %8ld\n", path_name[k], l.solves,
                 each(l.seconds, l.solves + l.failed), l.iterations,
                 each(static_cast<double>(l.iterations), l.solves + l.failed), l.failed);
  }
  const double solve = phase_wall(PHASE_FACTOR) + phase_wall(PHASE_SOLVE) + phase_wall(PHASE_PRECOND) +
                       phase_wall(PHASE_CG);
  const double newton = solve + phase_wall(PHASE_RESIDUAL) + phase_wall(PHASE_TANGENT);
  std::fprintf(file, "  Newton iteration           %12.6f s each (residual, tangent, solution)\n",
               each(newton, solves));
  std::fprintf(file, "  Newton iteration / solution  %.3f\n", solve > 0.0 ? newton / solve : 0.0);
  if (s.flops > 0.0) std::fprintf(file, "  operations      %12.4e of the last factorisation\n", s.flops);
  if (s.memory_mb > 0.0) std::fprintf(file, "  memory          %12.1f MB of the factors\n", s.memory_mb);
  if (s.negative > 0) std::fprintf(file, "  negative pivots %12d in the last factorisation\n", s.negative);
}

// ---------------------------------------------------------------------------
// out_listing_skipped : phases that were not needed: how often each was done, or checked and skipped, and why
// ---------------------------------------------------------------------------
void out_listing_skipped(std::FILE* file, const Model& m, const State& s)
{
  struct Line {
    Phase phase;
    const char *what, *why;
  };
  const Line lines[] = {
    {PHASE_GRID, "active grid", "no material points, or it moves with them"},
    {PHASE_PROJECT, "projection", "no material points, or the grid is unchanged"},
    {PHASE_BOND, "bonds", "there are none"},
    {PHASE_CONTACT, "contact search", "no contact"},
    {PHASE_PATTERN, "pattern", "no list has changed"},
    {PHASE_MASS, "mass", "statics, or nothing has changed"},
    {PHASE_TANGENT, "tangent", "linear, or the previous one is close enough"},
    {PHASE_ANALYSIS, "analysis", "the pattern is unchanged, or conjugate gradients"},
    {PHASE_FACTOR, "factorisation", "earlier factors, or conjugate gradients"},
    {PHASE_PRECOND, "preconditioner", "the incomplete factor of an earlier matrix is reused"},
    {PHASE_FRACTURE, "test of fracture", "nothing can break, or not due"},
    {PHASE_ESTIMATE, "estimates of fracture", "the threshold is out of reach (elements)"},
    {PHASE_OUTPUT, "VTK frame", m.output.vtk.on ? "not due" : "not requested"},
  };
  std::fprintf(file, "\nSKIPPED\n  %-22s %10s %12s   %s\n", "what", "done", "skipped", "because");
  for (const Line& l : lines) {
    const PhaseTime& t = timer_phase(l.phase);
    if (t.skipped == 0) continue;
    const bool counted = l.phase == PHASE_OUTPUT || l.phase == PHASE_PRECOND;      // also when skipped
    const long done = counted ? t.calls - t.skipped : t.calls;
    std::fprintf(file, "  %-22s %10ld %12ld   %s\n", l.what, done, t.skipped, l.why);
  }
  if (s.log.contact_searched + s.log.contact_skipped > 0)
    std::fprintf(file, "  contact search: %ld of %ld, the surfaces were apart\n", s.log.contact_skipped,
                 s.log.contact_searched + s.log.contact_skipped);
}

// ---------------------------------------------------------------------------
// out_listing_memory : permanent memory of the run, in MB and in bytes per equation;
// of all ranks of a divided model
// ---------------------------------------------------------------------------
void out_listing_memory(std::FILE* file, const Model& m, const std::vector<MemoryUse>& use, int equations)
{
  rusage peak;
  getrusage(RUSAGE_SELF, &peak);
  std::vector<MemoryUse> all(use);
  all.push_back({"peak of the process", 1024.0 * static_cast<double>(peak.ru_maxrss)});
  std::vector<NamedBytes> named;
  for (const MemoryUse& u : all) named.push_back(named_bytes(u.what, u.bytes));
  if (m.part.on) add_ranks(named);
  std::fprintf(file, "\nMEMORY%s\n  %-34s %10s %20s\n", m.part.on ? " of all ranks" : "", "what", "MB",
               "bytes an equation");
  for (const NamedBytes& u : named)
    if (u.bytes > 0.0)
      std::fprintf(file, "  %-34s %10.2f %20.0f\n", u.what, 1e-6 * u.bytes,
                   u.bytes / std::max(1, equations));
}

double out_memory()
{
  rusage use;
  getrusage(RUSAGE_SELF, &use);
  return static_cast<double>(use.ru_maxrss) / 1024.0;
}

// out_listing_ranks : load balance, and contents of each rank; nothing on one rank
void out_listing_ranks(std::FILE* file, const std::vector<RankLoad>& ranks)
{
  if (ranks.empty()) return;
  double most = 0.0, all = 0.0;
  std::fprintf(file, "\nRANKS\n  %4s %10s %10s %10s %12s %12s %12s\n", "rank", "elements", "points", "bonds",
               "assembly s", "between s", "memory MB");
  for (std::size_t r = 0; r < ranks.size(); ++r) {
    const RankLoad& k = ranks[r];
    std::fprintf(file, "  %4zu %10.0f %10.0f %10.0f %12.4f %12.4f %12.1f\n", r, k.elements, k.points, k.bonds,
                 k.assembly, k.between, k.memory);
    most = std::max(most, k.assembly);
    all += k.assembly;
  }
  if (all > 0.0)
    std::fprintf(file, "  assembly: the slowest rank took %.2f of the mean\n",
                 most * static_cast<double>(ranks.size()) / all);
}

void out_listing_end(std::FILE* file, bool finished, int failed)
{
  std::fprintf(file, "\n  memory peak     %.1f MB\n", out_memory());
  std::fprintf(file, "  warnings        %d\n  failed checks   %d\n", log_warnings(), failed);
  std::fprintf(file, "\n%s\n", finished ? "end of the run" : "the run stopped before its end");
}
