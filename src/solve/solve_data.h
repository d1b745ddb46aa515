// ---------------------------------------------------------------------------
// solve_data.h : data private to the solver files
// ---------------------------------------------------------------------------
#ifndef MPFE_SOLVE_SOLVE_DATA_H
#define MPFE_SOLVE_SOLVE_DATA_H

#include <algorithm>
#include <cstdint>
#include <functional>
#include <type_traits>
#include <unordered_map>

#include "base/comm.h"
#include "base/log.h"
#include "base/sum.h"
#include "base/timer.h"
#include "solve/solve.h"

// skyline, CHOLMOD: relative to the diagonal of A in the same equation
// (test: Solve.SingularIsTold, Solve.SoftBesideStiff)
const double ZERO_PIVOT = 3e-12;

// with_dim : calls use(integral constant) for blocks of this size
template <class Use>
auto with_dim(int dim, Use use)
{
  MPFE_CHECK(dim >= 1 && dim <= 3, "blocks are 1 x 1, 2 x 2 or 3 x 3");
  return dim == 1   ? use(std::integral_constant<int, 1>())
         : dim == 2 ? use(std::integral_constant<int, 2>())
                    : use(std::integral_constant<int, 3>());
}

// Profile of the upper triangle of D x D blocks, D = dim. Block column J extends from block row first[J] to
// J; its D scalar columns are stored consecutively, each with (J - first[J] + 1)*D numbers, from start[J] on.
// After the factorisation: above the diagonal U = L^T with unit diagonal, and d.
struct Skyline {
  IntVec pos;                  // [nrow] new position of each block row
  IntVec first;                // [nrow]
  std::vector<long> start;     // [nrow+1]
  RealVec a;                   // [start[nrow]]
  RealVec d;                   // [neq] pivots
  RealVec x;                   // [neq] right-hand side in the new order
};

struct AmgData;                // private to precond_amg.cpp
struct MumpsData;              // private to solve_mumps.cpp
struct ChmData;                // private to solve_cholmod.cpp

struct Cholesky {              // incomplete, on the pattern of A
  double shift = 0.0;          // added to the diagonal, relative
  long stamp = -1;             // of its matrix, -1: there is no factor
  long pattern = 0;            // of its pattern (SolveTask)
  // since it was formed: iterations spent, including the cost of forming it; digits gained
  double spent = 0.0, digits = 0.0;
  bool stale = false;          // the last solution cost more than the mean: the next one gets a new factor
  // [col.size()*dim*dim], order of A.val; diagonal blocks: inverse of their factor. Several ranks: as
  // OwnBlock::col
  std::vector<float> L;
  double border_shift = 0.0;
  std::vector<float> border;   // several ranks: factor of the Schur complement of the border
};

// Several ranks: data of conjugate gradients in addition to A; A x is the contribution of this rank. The
// border is the rows shared with other ranks (Halo::shared)
struct OwnBlock {
  std::uint64_t pattern = 0;   // checksum of the pattern of A and of the owners
  long number = 0;             // of that pattern, 0: none
  RealVec once;                // [neq] 1 in owned rows, else 0
  // rows of A in the order of elimination: first the rows of this rank alone, then the border; blocks outside
  // the border by row, columns in the same order, the diagonal last
  int inner = 0;               // number of rows of this rank alone
  bool in_order = false;       // rows of A are in that order
  IntVec order, at;            // [nrow] row of A; the inverse
  IntVec off, col;             // [nrow+1]; columns in the order of elimination
  IntVec from;                 // 2 k: block k of A, 2 k + 1: transposed
  // couplings of the rows of the border, from elements of all ranks that have both rows
  SysMatrix border;            // [Halo::shared] rows; no values
  IntVec border_from;          // [border.col] 2 k: block k of A, 2 k + 1: transposed; -1: of other ranks only
  std::vector<IntVec> to;      // [ranks] blocks shared with a rank: 2 k, 2 k + 1: transposed there
  RealVec diag;                // [border.neq] diagonal of A, of all ranks
  RealVec weight;              // [border] 1/sqrt of the number of ranks that have the row
  bool alike = false;          // all ranks have the same border, in the same order
};

struct ReusedFactors {         // factors of an earlier matrix as preconditioner
  std::vector<long> key;       // [rows of the factors] their keys
  IntVec owner;                // divided model: [rows of the factors] their former owners
  bool same = false;           // the rows have not changed
  IntVec old;                  // [nrow] row in the factors, -1: none
  RealVec inverse;             // [nrow*dim*dim] of the diagonal blocks of rows without one
  RealVec x;                   // [neq of the factors]
};

struct GridBlock;              // private to precond_changed.cpp
struct FirstAlone;             // private to solve_first.cpp

// factors of an earlier matrix, corrected in the rows that have changed since then  (8.9)
struct Changed {
  bool on = false;             // can be used
  SysMatrix A0;                // the matrix that was factorised
  int nfe = 0;                 // its rows of elements, followed by rows of the grid
  RealVec size;                // [nfe] stiffness of the elements at its rows
  std::unordered_map<long, int> row_of;      // its row of a key
  std::shared_ptr<GridBlock> grid0, grid;    // its rows of the grid; the present rows of the grid
  long stamp = -1;             // of the matrix for which the rest is valid
  IntVec old, now;             // rows of elements: [present] row of A0; [A0] present row, -1: removed
  int columns = 0;             // of V added last
  IntVec set, in_set;          // old rows that have changed or were removed; [nfe] index into set, -1: none
  // columns A0^-1 e of the set, [A0.neq] each; rows added at the same time are in one vector
  std::vector<std::vector<float>> V;
  RealVec F, G;                // rows of V in the set, double; their inverse            [set*dim][set*dim]
  RealVec C0, Q;               // of the set: A0 without its grid; inverse of the dense matrix
  RealVec y;                   // [A0.neq]
};

struct CgWork {
  RealVec r, z, p, q;          // [neq]
  RealVec y;                   // [neq] several ranks: of the incomplete factor
};

// A scaled to unit diagonal, in single precision, with the vectors of conjugate gradients           (8.17)
struct ScaledMatrix {
  long stamp = -1;             // of its matrix, -1: none
  std::vector<float> val;      // order of A.val
  std::vector<float> root;     // [neq] square roots of the diagonal
  std::vector<float> x, r, p, q;         // [neq], scaled, relative to size
  double size = 1.0;
};

// b - A x of the last system
enum Rest {
  REST_UNKNOWN,
  REST_NONE,                   // solved directly
  REST_CG,                     // CgWork::r
  REST_SCALED,                 // ScaledMatrix::r
};

struct CgDone {
  int iterations = 0;
  double start = 0.0, first = 0.0, end = 0.0;   // sqrt(r M^-1 r) of b, of the first and of the last iterate
  bool good = false;
  bool indefinite = false;     // a direction of no or negative curvature, or no incomplete factor
};

struct CgGoal {                // both norms must converge
  double eta = 0.0;            // tolerance relative to b, in either norm
  double energy = 0.0;         // or absolute, of sqrt(r M^-1 r)
  double residual = 0.0;       // or absolute, of the norm of r
  int max_iterations = 0;
  double initial_energy = 0.0; // b x of the initial x, 0: x = 0
  bool any_sign = false;       // continue in directions of negative curvature
};

// z = M^-1 r, rho = r z; false: failed
using Precondition = std::function<bool(const RealVec& r, RealVec& z, double& rho)>;

// System of conjugate gradients. Several ranks: A is the contribution of this rank
struct CgSystem {
  const SysMatrix& A;
  OwnBlock* own = nullptr;     // several ranks
  Precondition precondition;
};

// Cost of a path of CG in this run
struct PathCost {
  bool known = false;
  double setup = 0.0, iteration = 0.0;   // seconds of counted work, smoothed
  double rate  = 1.0;          // decimal digits per iteration
  bool good    = true;         // the last solution converged
  long last    = 0;            // number of the solution that tried it last
  long pause   = 0;            // solutions until it is tried again
};

// The pattern that was analysed
struct AnalysedPattern {
  int dim = 0;
  IntVec off, col;
  // divided model: owners of the rows, and their numbers over all ranks
  bool divided = false;
  Halo halo;
  RowNumbers numbers;
};

// Costs for the choice of the solution method                                               (8.5)
struct SolverCosts {
  PathCost path[PATHS];
  // in dynamics, after the incomplete factor has found a matrix indefinite: the solution at which it is tried
  // again; number of solutions skipped; factors made meanwhile are deleted once it works
  long again = 0, left_out = 0;
  bool spare = false;
  double direct_factor = 0.0, direct_back = 0.0, direct_analyse = 0.0;   // seconds of counted work, smoothed
  double guess = 0.0;          // estimated seconds of the first factorisation, 0: no estimate
  long rows = 0;               // rows of the present matrix, of all ranks
  long counted = 0;            // its SolveTask::pattern
  double entries = 0.0, entries_all = 0.0;       // numbers in it: maximum over the ranks, sum
  double factor_entries = 0.0; // numbers in the last factors, of all ranks
  long age = 0;                // solutions with the factors as preconditioner
  double fresh_rate = 0.0;     // rate of the first of them, smoothed
  // seconds and digits since the factorisation, including it
  double cycle_seconds = 0.0, cycle_digits = 0.0;
  bool corrected = false;      // the factors have been corrected in changed rows since then
  // factorisations until corrections are tried again after they have not paid; its length
  long correct_wait = 0, correct_pause = 0;
};

struct SolverData {
  AnalysedPattern pattern;
  SolverCosts cost;
  std::vector<char> soft;      // rank 0 factorises alone: rows whose zero pivots are fixed; else empty
  bool analysed = false, factored = false;
  bool first_only = false;     // several ranks: rank 0 factorises the whole matrix alone
  bool narrow = false;         // factorised by the skyline, although MUMPS is available
  bool by_chm = false;         // factorised by CHOLMOD
  bool for_mumps = false;      // MUMPS has analysed this pattern
  bool unfit = false;          // the skyline has failed for this pattern
  Skyline sky;
  long stamp = -1;             // of the matrix that was factorised
  ReusedFactors reused;
  Changed changed;
  Cholesky cholesky;
  OwnBlock own;                // several ranks: rows and border for cholesky
  RealVec diagonal;            // inverse diagonal blocks
  std::shared_ptr<AmgData> amg;
  long amg_wait = 0, amg_pause = 0;      // solutions until multigrid is tried again after it has failed
  CgWork work;
  ScaledMatrix scaled;
  Rest rest = REST_UNKNOWN;
  std::vector<RealVec> past;   // solutions of the last systems, of the same size
  std::shared_ptr<FirstAlone> first;     // several ranks: systems that rank 0 solves alone
  std::shared_ptr<MumpsData> mumps;
  std::shared_ptr<ChmData> chm;    // null: CHOLMOD is not tried with this pattern
  int chm_wait = 0, chm_pause = 0; // factorisations until CHOLMOD is tried again; after its next failure
};

// solve_same_pattern : is the pattern of A that of the last analysis, on all ranks?
bool solve_same_pattern(const Solver& s, const SysMatrix& A);

// equation_here : several ranks: index of an equation of the whole matrix on ranks that have it, on others
// the last equation plus one; number [nrow]: rows of this rank in the whole matrix
int equation_here(const IntVec& number, int dim, int equation);

// solve_drop : deletes the factors and their analysis. Collective
void solve_drop(Solver& s);

// sys_rows : rows of all ranks. Collective
long sys_rows(const SysMatrix& A);

// pivot_fixed : is a zero pivot in block row I fixed instead of an error?
inline bool pivot_fixed(const Solver& s, int I)
{
  const std::vector<char>& soft = s.data->soft;
  return soft.empty() ? s.null_pivot_row >= 0 && I >= s.null_pivot_row : soft[I] != 0;
}

Status skyline_analyse(Solver& s, const SysMatrix& A);
Status skyline_factor(Solver& s, const SysMatrix& A);
Status skyline_back(Solver& s, RealVec& x);    // x: right-hand side in, solution out

// solve_room : can mb MB be allocated for factors, plus the buffer of OpenBLAS?
bool solve_room(double mb);

// solve_cholmod.cpp; SOLVER_SINGULAR: CHOLMOD cannot factorise the matrix, or is not built in
Status chm_analyse(Solver& s, const SysMatrix& A);
Status chm_factor(Solver& s, const SysMatrix& A);
Status chm_back(Solver& s, double* x, int count);       // count right-hand sides, one after the other
Status chm_rough(Solver& s, double* x);        // by factors in single precision, for preconditioners

#ifdef MPFE_MUMPS
Status mumps_analyse(Solver& s, const SysMatrix& A);
Status mumps_factor(Solver& s, const SysMatrix& A);
Status mumps_back(Solver& s, double* x, int count);     // count right-hand sides, one after the other
void mumps_close(Solver& s);
double mumps_memory(const Solver& s);          // bytes of the numbers of the entries
double mumps_factors_mb(const Solver& s);      // of this rank; Solver::memory_mb is that of all
#endif

// precond.cpp
bool diagonal_form(const SysMatrix& A, RealVec& inverse);
void diagonal_apply(const SysMatrix& A, const RealVec& inverse, const RealVec& r, RealVec& z);
bool cholesky_form(const SysMatrix& A, Cholesky& c, OwnBlock* own = nullptr);
void cholesky_apply(const SysMatrix& A, const Cholesky& c, RealVec& z);    // z: r in, M^-1 r out
double cholesky_apply(const SysMatrix& A, const Cholesky& c, const OwnBlock& own, RealVec& y, RealVec& z);
bool reused_form(const SysMatrix& A, const std::vector<long>& key, ReusedFactors& k);
Status reused_apply(Solver& s, const SysMatrix& A, ReusedFactors& k, const RealVec& r, RealVec& z);

// precond_amg.cpp; without MPFE_PETSC all fail
bool amg_there();
bool amg_form(const SysMatrix& M, OwnBlock* own, const Cholesky& L, const std::function<RealVec()>& positions,
              long stamp, std::shared_ptr<AmgData>& data);
bool amg_apply(AmgData& d, const RealVec& r, RealVec& z, double& rho);
bool amg_count(AmgData& d, const CgDone& done);
double amg_memory(const AmgData& d);

// solve_first.cpp: on several ranks, rank 0 solves small systems and statics of broken material alone, with
// CHOLMOD and corrected factors, which work on one rank only. Collective
bool first_pays(const Solver& s, const SysMatrix& A, const SolveTask& task);
Status first_solve(Solver& s, const SysMatrix& A, const SolveTask& task, const RealVec& b, RealVec& x);
void first_memory(const FirstAlone& f, std::vector<MemoryUse>& out);
void first_close(FirstAlone& f);

// precond_changed.cpp
void changed_begin(const SysMatrix& A, const std::vector<long>& key, int nfe, Changed& c);
bool changed_form(Solver& s, const SysMatrix& A, const std::vector<long>& key, int nfe, long stamp,
                  Changed& c);
Status changed_apply(Solver& s, const SysMatrix& A, Changed& c, const RealVec& r, RealVec& z);

// Seconds since its construction, for the listing: CPU time if less than wall time (other programs ran too);
// on several ranks wall time, since waiting for other ranks counts
struct Clock {
  double wall = timer_wall(), cpu = timer_cpu();
  double seconds() const
  {
    const double passed = timer_wall() - wall;
    return comm_size() > 1 ? passed : std::min(passed, timer_cpu() - cpu);
  }
};

// cg_begin : x = the best combination of earlier solutions in the energy norm.
// Returns its energy b x, 0: x is not used
double cg_begin(const CgSystem& s, const RealVec& b, const std::vector<RealVec>& past, RealVec& x);

CgDone cg_solve(const CgSystem& s, const RealVec& b, const CgGoal& goal, CgWork& w, RealVec& x);

// solve_scaled.cpp: one rank
bool scaled_form(const SysMatrix& A, long stamp, ScaledMatrix& s);
CgDone scaled_solve(const SysMatrix& A, const RealVec& b, const CgGoal& goal, ScaledMatrix& s, RealVec& x);
void scaled_multiply(const SysMatrix& A, ScaledMatrix& s, const RealVec& x, RealVec& y);

// own_dot : a b in owned rows
inline double own_dot(const OwnBlock& own, const RealVec& a, const RealVec& b)
{
  const double *x = a.data(), *y = b.data(), *once = own.once.data();
  return sum_terms(a.size(), [=](size_t k) { return once[k] * x[k] * y[k]; });
}

// own_form : border and order of elimination from the pattern of A; number: of the pattern (SolveTask).
// Collective, as the routines below.
void own_form(const SysMatrix& A, long number, OwnBlock& own);
// own_border : own.diag, and val [own.border.col.size()*dim*dim], the contribution of this rank to A there
void own_border(const SysMatrix& A, OwnBlock& own, std::vector<float>& val);
// own_sum : sums val of the border over the ranks
void own_sum(const OwnBlock& own, int D, std::vector<float>& val);

// solve_fail : keeps the message and returns the status
Status solve_fail(Solver& s, Status status, const char* format, ...) __attribute__((format(printf, 3, 4)));

#endif
