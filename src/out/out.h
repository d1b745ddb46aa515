// ---------------------------------------------------------------------------
// out.h : output of a run: listing, history, print tables, VTK, checks, progress
//
// The order of a run:
//   out_listing_open                     JOB.lst; messages of the set-up go there
//   out_open                             summary, history columns, first row at t = 0
//   out_step_begin .. out_step_end       around each step
//     out_listing_iteration, out_listing_cut, out_increment
//   out_close                            checks, tables; returns the number of failed checks
// A run continued from a restart file: out_restart_load, out_listing_open, out_reopen, then as above.
// On several ranks all routines with the Model as argument are collective: each rank contributes what it
// owns, history and checks are equal on all ranks, and the first one writes, except for the pieces of VTK.
// ---------------------------------------------------------------------------
#ifndef MPFE_OUT_OUT_H
#define MPFE_OUT_OUT_H

#include <cstdio>
#include <string>
#include <vector>

#include "base/archive.h"
#include "base/comm.h"
#include "contact/contact_near.h"
#include "dof/dof.h"
#include "elem/elem.h"
#include "frac/frac.h"
#include "model/quantity.h"
#include "model/state.h"
#include "point/point.h"
#include "solve/solve.h"

// ---- quantities (out_quantity.cpp) ------------------------------------------

// quantity_is_place : defined at any position of a body
inline bool quantity_is_place(const Quantity& q) { return q.where == OF_MOTION || q.where == OF_NODES; }

// elem_nodal_at : U V A X in element e, with the shape functions N at the position
double elem_nodal_at(const Model& m, const Level& level, const Quantity& q, int e, const double* N);

// point_nodal_at : U V X of material point p, weights N of its corners; points do not store A: NaN
double point_nodal_at(const Model& m, const Points& pts, const Level& level, const Quantity& q, int p,
                      const double* N);

// elem_gauss : Gauss points of an element, 0 if it is no longer an element
int elem_gauss(const Model& m, const Elements& el, int e);

// out_sum, out_max : sum and maximum over the ranks of a divided model, on all ranks; otherwise no change.
// Collective.
inline void out_sum(const Model& m, double* x, long n) { if (m.part.on) comm_sum(x, n); }
inline void out_max(const Model& m, double* x, long n) { if (m.part.on) comm_max(x, n); }

// out_nlgeom : NLGEOM of the present step
bool out_nlgeom(const Model& m, const State& s);

// out_interval : true if the time of the next output is reached, which is then advanced
bool out_interval(double interval, double time, double& next);

// ---- a material position (out_locate.cpp) -------------------------------------

struct Located {               // elements or points of this rank whose domain at t = 0 contains a position
  IntVec elem, point;          // only one of the two is filled; elements have priority
  RealVec N;                   // [items*MAX_NODES] shape functions there
};

Located out_locate(const Model& m, const Elements& el, const Points& pts, const double x[3]);

// ---- history (out_history.cpp) -------------------------------------------------

// every increment, including those skipped in the file; explicit steps: those with out_row_due
struct History {
  std::vector<std::string> names;
  std::vector<RealVec> rows;
};

struct Probe {                 // a column of *HISTORY, ready to be read
  const Quantity* q = nullptr;
  Reduce reduce = REDUCE_MEAN;
  IntVec node, elem, point;    // items that it reads on this rank; a node on one rank only
  Located at;
  int grid_bc = -1, contact = -1;
};

int history_column(const History& h, const std::string& name);      // -1: no such column

// history_at : linear interpolation in time; false when the time lies outside the rows
bool history_at(const History& h, int column, double time, double& value);

// history_reduce : one number from values with weights; SUM: sum of weight x value. NaN when empty.
double history_reduce(Reduce reduce, const RealVec& value, const RealVec& weight);

// ---- the output of a run ---------------------------------------------------------

enum VtkKind { VTK_FE, VTK_MP, VTK_BOND, VTK_GRID, VTK_KINDS };

struct VtkSeries {
  std::vector<std::string> file;
  RealVec time;
};

struct CheckResult {
  bool done = false, pass = false;
  std::string name, source, message;      // message: why a check could not be made
  double value = 0, target = 0, difference = 0, tolerance = 0;
};

struct RankLoad {              // work of one rank
  double elements = 0, points = 0, bonds = 0;        // at the end of the run
  // wall seconds; between: communication, including waiting for other ranks
  double assembly = 0, between = 0;
  double memory = 0;                                 // peak, MB
};

struct WriteTime {             // of what is written at TIME INTERVAL
  double next = 0.0;           // time of the next one
  int inc = -1;                // increment of the last one
};

struct Progress {              // of the run, in wall seconds
  bool terminal = false;       // a progress line is written
  double wall = 0.0, last = 0.0;                     // start of the run; last line
  double from = 0.0;           // simulated time at which the run started
  double status_start = 0.0, status_last = 0.0;      // start of the run; from there, last row of JOB.sta
};

struct Output {
  std::string base;            // out_dir/JOB
  std::string from;            // restart file that the run continues; empty: none
  std::FILE *lst = nullptr, *his = nullptr, *dat = nullptr, *chk = nullptr, *ero = nullptr, *frag = nullptr;
  History history;
  std::vector<Probe> probe;    // [Model::history]
  int converted = 0;           // number of converted elements when the probes were set up
  int row_written = -1;        // last row of history in the file
  VtkSeries series[VTK_KINDS];
  int vtk_frame = 0;
  WriteTime vtk_time, frag_time, restart_time;       // of frames, tables of fragments, restart files
  std::vector<NearFace> near;  // rank 0, divided model: DivideBy::near, stored in a restart file
  std::vector<CheckResult> result;        // [Model::check]
  std::vector<RankLoad> ranks; // several ranks: filled before out_close
  std::vector<MemoryUse> memory;          // for the listing
  std::size_t ero_written = 0; // entries of State::eroded that are in JOB.ero
  long ero_length = 0;         // of JOB.ero before them
  ErosionLog tip, tip_before;          // last broken element, and that before this increment
  std::FILE* sta = nullptr;    // JOB.sta, rank 0
  Progress progress;
};

// out_listing_open : JOB.lst; goes_on: append to the existing file
void out_listing_open(const Model& m, Output& out, bool goes_on = false);

// out_open : returns the number of errors (a *HISTORY or *CHECK that cannot be evaluated);
// messages in the log
int out_open(const Model& m, const Elements& el, const State& s, const ActiveGrid& grid, Output& out);
void out_step_begin(const Model& m, int step, Output& out);          // step: 0-based
void out_step_end(const Model& m, const State& s, Output& out);
void out_increment(const Model& m, const Elements& el, const State& s, const ActiveGrid& grid, Output& out);

// out_row_due : is a row of the history due at t(n)? In explicit steps at every FREQUENCY-th increment, at
// the end of the step, when elements have broken, and before and after the time of a check
// out_reads_ledger : are energies read at t(n), by a row or a line of the listing?
bool out_row_due(const Model& m, const State& s);
bool out_reads_ledger(const Model& m, const State& s);

// out_close : finished = false: the run stopped before its end (checks at the end then fail)
int out_close(const Model& m, const Elements& el, const State& s, const ActiveGrid& grid,
              const Solver& solver, bool finished, Output& out);

// ---- restart (out_restart.cpp) -------------------------------------------------------

// out_restart_load : opens a restart file, on rank 0. False: it does not fit this deck; the message gives the
// reason. Collective.
bool out_restart_load(const Model& m, const std::string& path, Archive& f);

// out_restart_pieces : the division of the model that has written the file; false: another number of ranks,
// not divided, or no such file for this deck
// out_restart_near : faces of general contact and of contact pairs as stored in the file; none: no such file
// for this deck. Neither is collective: rank 0 calls them with the whole model.
bool out_restart_pieces(const Model& m, const std::string& path, DivideBy& by);
std::vector<NearFace> out_restart_near(const Model& m, const std::string& path);

// out_reopen : instead of out_open: restores state, grid of the last frame and output from the file f; on
// entry s is the state at t = 0. Returns the number of errors.
int out_reopen(Model& m, const Elements& el, const FracMesh& fm, Archive& f, State& s, ActiveGrid& grid,
               Output& out);

// out_restart : writes JOB.rst when it is due or required now; a kill at any moment leaves a complete file
void out_restart(const Model& m, State& s, const ActiveGrid& grid, bool now, Output& out);

// out_mark : JOB.continue, which exists while a run ended by a signal waits to be continued; a launcher may
// hide the exit code (mpirun). waits = false: deletes it
void out_mark(const Output& out, bool waits);

// out_hold : writes the state of all ranks to an unnamed file, from which f then reads; false: no space for
// it.
// out_resume : instead of out_open and out_reopen: restores the state of that file in a model with another
// division; the output is continued. Both collective.
bool out_hold(const Model& m, State& s, const ActiveGrid& grid, Archive& f);
void out_resume(Model& m, const Elements& el, const FracMesh& fm, Archive& f, State& s, ActiveGrid& grid,
                Output& out);

// ---- parts -------------------------------------------------------------------------

// out_file_open : creates the folder if it is missing; append: to the existing file.
// out_file_first: the same on rank 0; on others /dev/null.
// out_file_flush, out_file_sync (to the disk itself), out_file_close detect a full disk. out_file_cut:
// truncates the file to this length.
// All stop the program with a message and EXIT_RESOURCE.
std::FILE* out_file_open(const std::string& path, bool append = false);
std::FILE* out_file_first(const std::string& path, bool append = false);
void out_file_flush(std::FILE* file, const std::string& path);
void out_file_sync(std::FILE* file, const std::string& path);
void out_file_cut(std::FILE* file, long length, const std::string& path);
void out_file_close(std::FILE*& file, const std::string& path);

// out_model_summary : summary of the model; also for mpfe --check. Collective for a divided model; file: null
// on ranks that do not write
void out_model_summary(std::FILE* file, const Model& m, const Elements& el, const Points& pts,
                       const Bonds& bonds);

void out_listing_defaults(std::FILE* file, const Model& m, const Bonds& bonds);
void out_listing_iteration(int step, int inc, int iter, double residual, double scale, double energy,
                           double line_search);
void out_listing_cut(int step, int inc, double time, double dt, double dt_new, Status why,
                     const char* detail);
void out_listing_increment(const State& s);
void out_listing_balance(std::FILE* file, const Model& m, const State& s);
void out_listing_phases(std::FILE* file);
void out_listing_solver(std::FILE* file, const Solver& solver);
void out_listing_ranks(std::FILE* file, const std::vector<RankLoad>& ranks);
double out_memory();           // peak of this rank, MB
void out_listing_skipped(std::FILE* file, const Model& m, const State& s);
void out_listing_memory(std::FILE* file, const Model& m, const std::vector<MemoryUse>& use, int equations);
void out_listing_end(std::FILE* file, bool finished, int failed);
const char* out_status_text(Status status);

int history_setup(const Model& m, const Elements& el, const State& s, Output& out);    // returns errors
void history_open(Output& out);
void history_row(const Model& m, const Elements& el, const State& s, Output& out);
bool history_shown(const Model& m, const History& h, int row);
void history_write(const Output& out, int row);

void out_vtk(const Model& m, const Elements& el, const State& s, const ActiveGrid& grid, Output& out);
void out_vtk_series(const std::string& path, const VtkSeries& series);

// out_unfinished : elements broken in an increment ended by a signal,
// in files JOB.unfinished.*; returns a message
std::string out_unfinished(const Model& m, const Elements& el, const State& s, const ActiveGrid& grid,
                           const Output& out);

// out_vtk_continue : for a continued run: removes frames from out.vtk_frame on, of a run that was killed,
// also from the series
void out_vtk_continue(const Output& out);
void out_dat(const Model& m, const Elements& el, const State& s, Output& out);

bool out_check_due(const Check& c, const CheckResult& r, double time);
double out_check_field(const Model& m, const Elements& el, const State& s, const Check& c,
                       std::string& message);
void out_check_history(const History& h, const Check& c, bool finished, CheckResult& r);
void out_check_begin(const Model& m, Output& out);
void out_check_increment(const Model& m, const Elements& el, const State& s, Output& out);
int out_check_end(const Model& m, const Elements& el, const State& s, bool finished, Output& out);

// out_erosion : JOB.ero, lines of the elements broken since the last call; they are removed
// if the increment is undone
void out_erosion(const Model& m, const State& s, Output& out);
void out_erosion_undo(Output& out);


// out_fragments : JOB.frag, one line per fragment, debris first; last: end of the run, also in the listing
void out_fragments(const Model& m, const Elements& el, const State& s, bool last, Output& out);

// ---- progress of the run (out_status.cpp, out_progress.cpp) -------------------------

// JOB.sta: out_status_open (goes_on: append to the existing file), a row for the accepted state at t(n), a
// row for an attempt that is cut, and the end with the exit code
void out_status_open(const Model& m, bool goes_on, Output& out);
void out_status_row(const Model& m, const State& s, Output& out);
void out_status_cut(const State& s, double dt, Output& out);
void out_status_end(int code, Output& out);

// out_status : reads JOB.sta for mpfe --status; returns the exit code, that of the run or:
const int STATUS_RUNNING = 7;
int out_status(const std::string& job, std::FILE* file);

// out_progress : the line on the terminal
void out_progress(const Model& m, const State& s, Output& out);
void out_progress_clear(Output& out);
std::string out_clock_text(double seconds);
double out_whole_time(const Model& m);             // of all steps; 0: a RIKS step ends when it will

#endif
