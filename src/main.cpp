// ---------------------------------------------------------------------------
// mpfe : implicit material points and finite elements for brittle fracture.
// The run on one screen: read, check, open, steps, close.
// ---------------------------------------------------------------------------
#include <gsl/gsl_errno.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <new>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/blas_core.h"
#include "base/comm.h"
#include "base/heap.h"
#include "base/interrupt.h"
#include "base/log.h"
#include "base/run_lock.h"
#include "base/std_streams.h"
#include "base/timer.h"
#include "base/version.h"
#include "deck/deck.h"
#include "mat/law.h"
#include "out/out.h"
#include "step/step.h"

namespace {

struct Options {
  std::string deck, out_dir = ".", restart, help_word, status;
  std::vector<std::pair<std::string, double>> defines;
  bool check = false, help = false, version = false, list = false;
};

const char* const usage =
    "mpfe [options] deck.inp\n"
    "  -o DIR           write results to DIR (created if missing; default: current folder)\n"
    "  -D name=value    set a parameter of the deck (*PARAMETER)\n"
    "  --restart FILE   continue from a restart file (*RESTART, WRITE) with the same deck\n"
    "  --status JOB     how far the run JOB (DIR/JOB with -o DIR) is; its exit code, or 7 while it runs\n"
    "  --check          read and check the deck, print the model, compute nothing\n"
    "  --list-keywords  list all keywords, one line each\n"
    "  --help KEYWORD   print the page of a keyword: parameters, data lines, example, notes\n"
    "  --version, --help\n"
    "Exit codes: 0 success, 1 a *CHECK failed, 2 error in the deck or the restart file, 3 no convergence,\n"
    "4 internal error, 5 out of memory or disk, solver error, or another run in this folder,\n"
    "6 ended by a signal, JOB.rst continues the run (JOB.continue stands as long as it waits).\n";

int usage_error(const char* what, const char* word)
{
  if (comm_rank() == 0) std::fprintf(stderr, "mpfe: %s: %s\n%s", what, word, usage);
  return EXIT_DECK;
}

// -D name=value
bool read_define(const std::string& text, Options& o)
{
  const size_t eq = text.find('=');
  if (eq == std::string::npos || eq == 0) return false;
  char* end          = nullptr;
  const char* number = text.c_str() + eq + 1;
  const double value = std::strtod(number, &end);
  if (end == number || *end) return false;
  o.defines.emplace_back(text.substr(0, eq), value);
  return true;
}

bool needs_no_deck(const Options& o) { return o.help || o.version || o.list || !o.status.empty(); }

int read_options(int argc, char** argv, Options& o)
{
  for (int i = 1; i < argc; ++i) {
    const std::string a = argv[i];
    const bool glued    = a.size() > 2 && (a.compare(0, 2, "-D") == 0 || a.compare(0, 2, "-o") == 0);
    std::string value;
    if (a == "--check") o.check = true;
    else if (a == "--help" || a == "-h") {
      o.help = true;
      for (; i + 1 < argc && argv[i + 1][0] != '-'; ++i)      // *SOLID SECTION may come as two words
        o.help_word += (o.help_word.empty() ? "" : " ") + std::string(argv[i + 1]);
    }
    else if (a == "--version") o.version = true;
    else if (a == "--list-keywords") o.list = true;
    else if (a == "-D" || a == "-o" || glued) {
      if (!glued && ++i >= argc) return usage_error("a value must follow", argv[i - 1]);
      value = glued ? a.substr(2) : argv[i];
      if (a[1] == 'o' && value.empty()) return usage_error("a folder must follow", "-o");
      if (a[1] == 'o') o.out_dir = value;
      else if (!read_define(value, o)) return usage_error("-D needs name=number", value.c_str());
    } else if (a == "--restart") {
      if (++i >= argc) return usage_error("a file must follow", argv[i - 1]);
      o.restart = argv[i];
      if (o.restart.empty()) return usage_error("a file must follow", "--restart");
    } else if (a == "--status") {
      if (++i >= argc) return usage_error("a job must follow", argv[i - 1]);
      o.status = argv[i];
    } else if (a[0] == '-') return usage_error("unknown option", a.c_str());
    else if (o.deck.empty()) o.deck = a;
    else return usage_error("only one deck can be run", a.c_str());
  }
  if (o.deck.empty() && !needs_no_deck(o)) return usage_error("no deck", "give a file");
  return EXIT_GOOD;
}

// has a rank errors?
bool failed(int errors) { return comm_allreduce_max(errors) > 0; }

// the file of --restart, or JOB.rst when the deck asks for it; empty: the run begins
std::string restart_path(const Model& m, const Options& o)
{
  if (!o.restart.empty() || !m.output.restart.read) return o.restart;
  return m.out_dir + "/" + m.job + ".rst";
}

// rank 0 reads and checks the deck. False: errors
bool read_deck(const Options& o, Model& m)
{
  Timer timer(PHASE_INPUT);
  const int errors = comm_bcast(comm_rank() > 0 ? 0 : deck_read(o.deck, o.defines, m));
  if (errors == 0) law_place_initial(m);
  return errors == 0;
}

// a small model takes fewer ranks than there are; false: this one waits for the others
bool works(const Options& o, const Model& m)
{
  return comm_keep(comm_bcast(o.check ? 1 : comm_rank() > 0 ? 0 : dof_ranks(m)));
}

// each rank gets what it needs of the model of rank 0
//   out  near   Output
void divide_model(const Options& o, Model& m, std::vector<NearFace>& near)
{
  Timer timer(PHASE_INPUT);
  m.out_dir = o.out_dir;
  DivideBy by;
  if (comm_rank() == 0 && !out_restart_pieces(m, restart_path(m, o), by))
    by.near = out_restart_near(m, restart_path(m, o));
  dof_part(by, m);
  near.swap(by.near);
  log_keep(m.part.on);
}

struct Run {                   // what the ranks work on
  Model model;
  State state;
  Problem problem{model, state};
};

// The work of a run is divided again: deck and state go to the ranks as other pieces. False: the deck is not
// what it was, or there is no room for the state; the run goes on as it is
bool divide_again(const Options& o, std::unique_ptr<Run>& run, Archive& state, std::vector<NearFace>& near)
{
  Timer timer(PHASE_INPUT);
  const Model& old  = run->model;
  DivideBy by = step_divide_by(run->problem);
  step_free_memory(run->problem);
  Model m;
  bool good = true;
  log_repeat(true);
  if (comm_rank() == 0)
    good = deck_read(o.deck, o.defines, m) == 0 && m.hash == old.hash && m.step.size() == old.step.size() &&
           m.step.back().hash == old.step.back().hash &&
           m.output.history.size() == old.output.history.size();
  law_place_initial(m);
  log_repeat(false);
  good = comm_bcast(static_cast<int>(good)) && out_hold(old, run->state, run->problem.d.grid, state);
  if (!good) {
    log_warn("the model cannot be divided among the ranks again: the deck has changed since the run began, "
             "or there is no room for temporary files; the run goes on as it is");
    run->problem.next.stays = true;
    return false;
  }
  Warned warned = run->problem.warned;
  solve_close(run->problem.newton.solver);
  run.reset();                                       // before others come
  run = std::make_unique<Run>();
  run->model         = std::move(m);
  run->model.out_dir = o.out_dir;
  dof_part(by, run->model);
  near.swap(by.near);
  run->problem.warned = std::move(warned);
  return true;
}

// set-up and messages are those that the user knows
void open_again(Problem& p)
{
  log_repeat(true);
  MPFE_CHECK(step_open(p) == 0, "re-opening a checked model failed");
  log_repeat(false);
}

// what the deck leaves open or the program changes in it: cards without effect, split elements, tied nodes
std::vector<std::string> note_lines(const DeckNotes& notes)
{
  std::vector<std::string> lines = notes.tied;
  if (!notes.passed.empty())
    lines.insert(lines.begin(), "NOTE  cards that change nothing here: " + notes.passed);
  return lines;
}

int check_only(Problem& p)
{
  if (failed(step_open(p))) return EXIT_DECK;
  Output out;
  if (failed(history_setup(p.m, p.d.el, p.st, out))) return EXIT_DECK;
  out_model_summary(stdout, p.m, p.d.el, p.st.points, p.st.bonds);
  for (const std::string& line : note_lines(p.m.notes)) std::printf("  %s\n", line.c_str());
  return EXIT_GOOD;
}

// nobody else writes JOB.*; rank 0 sees to it. taken: what a crash has left behind
bool lock_job(const Model& m, std::string& taken)
{
  const bool good = comm_rank() > 0 ||
                    lock_take((m.out_dir.empty() ? "." : m.out_dir) + "/" + m.job + ".lock", taken);
  if (!good) log_error("%s", taken.c_str());
  return !comm_allreduce_max(!good);
}

int run(const Options& o)
{
  std::unique_ptr<Run> run = std::make_unique<Run>();
  Model& model     = run->model;
  Problem& problem = run->problem;
  Output out;
  if (!read_deck(o, model)) return EXIT_DECK;
  if (!works(o, model)) return EXIT_GOOD;
  divide_model(o, model, out.near);
  out.from = restart_path(model, o);
  std::string taken;
  if (!o.check && !lock_job(model, taken)) return EXIT_RESOURCE;
  Archive state;
  if (!out.from.empty() && !out_restart_load(model, out.from, state)) return EXIT_DECK;
  if (o.check) return check_only(problem);
  out_listing_open(model, out, state.reading);
  for (const std::string& line : note_lines(model.notes)) log_note("%s", line.c_str());
  if (!taken.empty()) log_warn("%s", taken.c_str());
  const int wrong = step_open(problem);
  log_gather();
  if (failed(wrong)) return EXIT_DECK;
  RunFrom from = state.reading ? RUN_FILE : RUN_BEGIN;
  int code     = step_run(problem, from, state, out);
  while (run->problem.again) {
    from = divide_again(o, run, state, out.near) ? RUN_DIVIDED : RUN_ON;
    if (from == RUN_DIVIDED) open_again(run->problem);
    code = step_run(run->problem, from, state, out);
  }
  log_gather();
  solve_close(run->problem.newton.solver);
  return code;
}

// memory that is not there shows anywhere, and on one rank alone
int run_guarded(const Options& o)
{
  const char* const words =
      "the memory of this machine is not enough for this model: take a coarser mesh or grid, or fewer "
      "points, or a machine with more memory";
  try {
    return run(o);
  } catch (const std::bad_alloc&) {
  } catch (const std::length_error&) {
  }
  log_mute(false);
  log_error("%s", words);
  if (comm_started() > 1) comm_stop(EXIT_RESOURCE);
  return EXIT_RESOURCE;
}

// what needs no deck
int tell(const Options& o)
{
  if (comm_rank() > 0) return EXIT_GOOD;
  if (!o.help_word.empty()) return deck_help(o.help_word, stdout) ? EXIT_GOOD : EXIT_DECK;
  if (o.help) std::fputs(usage, stdout);
  if (o.version) std::printf("mpfe %s\n", MPFE_VERSION);
  if (o.list) deck_list_keywords(stdout);
  if (!o.status.empty()) return out_status(o.status, stdout);
  return EXIT_GOOD;
}

int start(int argc, char** argv)
{
  Options o;
  const int wrong = read_options(argc, argv, o);
  if (wrong) return wrong;
  if (needs_no_deck(o)) return tell(o);
  interrupt_watch();
  return run_guarded(o);
}

}  // namespace

int main(int argc, char** argv)
{
  streams_open();
  blas_choose(argc, argv);
  comm_open(&argc, &argv);
  heap_keep();
  log_mute(comm_rank() > 0);
  gsl_set_error_handler_off();                       // it would abort; who calls GSL looks at what comes back
  int code = start(argc, argv);
  if (!streams_good() && (code == EXIT_GOOD || code == EXIT_CHECK_FAILED)) code = EXIT_RESOURCE;
  lock_release();
  code = comm_end(code);
  comm_close();
  if (code != EXIT_CONTINUE) interrupt_finish();
  return code;
}
