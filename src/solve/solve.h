// ---------------------------------------------------------------------------
// solve.h : the system matrix and its solvers: open, solve (analyse, factor, back, conjugate gradients),
// close
//
// Symmetric matrix of dim x dim blocks, lower block triangle, rows sorted.
// Block k of row I, column J = col[k] <= I, holds val[k*dim*dim + i*dim + j] = A(I*dim+i, J*dim+j).
// In a diagonal block only i >= j is stored; the others are zero.
//
// On several ranks A is the sum of their matrices: each rank assembles its elements, points and bonds, in its
// own rows only. The solver routines are then collective.
// ---------------------------------------------------------------------------
#ifndef MPFE_SOLVE_SOLVE_H
#define MPFE_SOLVE_SOLVE_H

#include <functional>
#include <memory>
#include <string>

#include "base/halo.h"
#include "base/types.h"
#include "model/model.h"

struct SysMatrix {
  int dim = 0;
  int nrow = 0;                // block rows
  IntVec off{0};               // [nrow+1]
  IntVec col;                  // block columns, ascending in a row; the last one is the diagonal
  RealVec val;                 // [col.size()*dim*dim]
  // several ranks: only rows of this rank, in its numbering; vectors on these rows are summed over the ranks,
  // A and products with it are the contribution of this rank, which sys_sum adds up
  Halo halo;
  IntVec tied;                 // rows tied to the grid by bonds, and rows of the grid: eliminated late
  int neq() const { return dim * nrow; }
};

// sys_shared : is A the sum of the matrices of several ranks?
inline bool sys_shared(const SysMatrix& A) { return A.halo.on(); }

// sys_number : several ranks: numbers of the rows over all ranks, ordered by their owner. Collective, as
// sys_collect and sys_sum.
struct RowNumbers {
  IntVec number;               // [nrow]
  IntVec first;                // [ranks+1] first number of each rank
};
RowNumbers sys_number(const SysMatrix& A);

// sys_collect : the whole matrix on rank 0 (values = false: its pattern only), an empty one on the others.
// Several ranks: rows are numbered by sys_number
SysMatrix sys_collect(const SysMatrix& A, bool values);

// sys_pattern : pattern of a matrix of nrow block rows that couples the rows of each list
void sys_pattern(const ListTable& lists, int nrow, int dim, SysMatrix& A);

// sys_graph : neighbours of each block row, excluding itself, ascending
//   in   may   [blocks of A] 0: a block that does not count; null: all count
ListTable sys_graph(const SysMatrix& A, const std::vector<char>* may = nullptr);

// sys_sum : sums v [n*nrow] over the ranks; each rank enters its contribution to its rows
void sys_sum(const SysMatrix& A, RealVec& v);

// sys_multiply : y = A x, with the contribution of this rank to A
void sys_multiply(const SysMatrix& A, const RealVec& x, RealVec& y);

// sys_multiply : with val instead of the values of A
void sys_multiply(const SysMatrix& A, const RealVec& val, const RealVec& x, RealVec& y);
void sys_multiply(const SysMatrix& A, const std::vector<float>& val, const double* x, double* y);

// sys_diagonal : diagonal of A [neq]
void sys_diagonal(const SysMatrix& A, RealVec& d);

// part_mesh : divides the elements of a mesh into parts of equal work of each kind; dim: number of common
// nodes of neighbours
IntVec part_mesh(const Mesh& mesh, int dim, const std::vector<RealVec>& work, int parts);

// order_rcm, order_metis : new position of each block row, [nrow]; reverse Cuthill-McKee on the block graph
// (every connected part from a pseudo-peripheral node), nested dissection by METIS
IntVec order_rcm(const SysMatrix& A);
IntVec order_metis(const SysMatrix& A);

// order_least : lower bound of the operations of a factorisation, estimated from the first separator of
// nested dissection. 0: unknown, without METIS. Collective.
double order_least(const SysMatrix& A);

// part_shared : number of the n items that belong to several parts; each(use) calls use(item, part) for each
// item of each part
template <class Each>
int part_shared(int n, Each each)
{
  IntVec of(n, -1);            // part, -2: several
  int shared = 0;
  each([&](int item, int part) {
    int& p = of[item];
    if (p == -1) p = part;
    if (p < 0 || p == part) return;
    p = -2;
    ++shared;
  });
  return shared;
}

// part_weights : weights as integers >= 1, the largest about 1000; smaller where the sum, which METIS forms
// in 32 bits, would overflow
IntVec part_weights(const RealVec& weight);

struct SolverData;             // private to the solver files

// equations; below, a factorisation takes a few milliseconds and no choice is needed
// (test: Krylov.ChosenPathsAgree), with 4800 of them
const int SMALL_SYSTEM = 2000;

// Solution methods                                                            doc/theory.md 8
enum SolvePath {
  PATH_FACTOR,                 // analysis if the pattern is new, factorisation, back substitution
  PATH_BACK,                   // the matrix is already factorised: back substitution
  PATH_REUSED,                 // CG with the factors of an earlier matrix
  // CG with the factors of an earlier matrix, corrected in the rows that have changed
  PATH_CHANGED,
  PATH_CHOLESKY,               // CG with an incomplete Cholesky factor
  PATH_DIAGONAL,               // CG with the diagonal blocks
  PATH_AMG,                    // CG with algebraic multigrid, whose smoother is the incomplete factor
  PATH_SCALED,                 // CG in single precision, the matrix scaled to unit diagonal
  PATHS
};

struct PathLog {
  long solves = 0, iterations = 0, failed = 0;
  double seconds = 0.0;
  double digits = 0.0;         // decimal digits gained by the iterations
};

// Work of a solver so far
struct SolveCounts {
  long fixed_null_pivots = 0;       // zero pivots whose unknowns were fixed
  long nfactor = 0, nback = 0, nanalyse = 0;
  long ncholmod = 0;                // factorisations by CHOLMOD
  double seconds_factor = 0, seconds_back = 0, seconds_analyse = 0;   // wall
  PathLog path[PATHS];
};

struct Solver : SolveCounts {
  SolverKind kind = SOLVER_AUTO;    // of the factorisation; solve_open replaces AUTO
  SolverDef def;                    // options of the deck
  std::shared_ptr<SolverData> data;
  std::string message;              // of the last failure, with a remedy
  // of the first zero pivot, -1: none. Divided model: on ranks without it the last equation plus one
  int zero_equation = -1;
  bool masses = false;              // the matrix includes masses: no zero pivots are expected
  // MUMPS: zero pivots from this block row on are no error, their unknowns are fixed; the residual of
  // Newton's method decides. -1: all are errors. Divided model: row of this rank; all ranks have one, or none
  int null_pivot_row = -1;
  double flops = 0, memory_mb = 0;  // of the last factorisation, 0: unknown
  double flops_ahead = 0;           // estimate of the analysis
  int negative = 0;                 // negative pivots of the last factorisation
  double left = 0.0;                // of the last solution: sqrt(energy) of the error, 0: solved directly
};

// Accuracy required of solve_system, and properties of the matrix
struct SolveTask {
  const std::vector<long>& key;     // [nrow] identity of a row; a node has the same key in every matrix
  long stamp = 0;                   // matrices with the same number are equal
  long pattern = 0;                 // the same for patterns and owners of rows; 0: unknown
  // largest residual relative to b, in the energy norm and in the norm of the force,
  double eta = 0.0;
  double energy = 0.0, residual = 0.0;   // or absolute, in these norms
  double digits = 10.0;             // decimal digits that this means, for the choice of the path
  bool exact = false;               // AUTO: only a factorisation is accurate enough
  // statics with broken material: few rows change much, some are nearly singular
  bool broken = false;
  bool inertia = false;             // A includes masses
  bool known_regular = false;       // A is known to be regular before it is factorised
  bool plain = false;               // only elements contribute to A: no points, bonds, contact, fracture
  bool repeats = false;             // a correction of Newton's method: single precision may be enough
  std::function<RealVec()> positions = nullptr;  // [neq] of the nodes of the rows; empty: unknown
};

// solve_open : AUTO and CG factorise by MUMPS if it is built in, else by SKYLINE. Returns false if the kind
// is not built in.
// On several ranks rank 0 factorises alone with SKYLINE, and with REUSE=NO: MUMPS adds the messages of ranks
// in the order of their arrival, so that two runs differ in their last bits.
bool solve_open(Solver& s, const SolverDef& def);
const char* solve_name(const Solver& s);

// solve_analyse : ordering and symbolic factorisation; repeated only if the pattern of A has changed
Status solve_analyse(Solver& s, const SysMatrix& A);

// solve_factor : factorisation; SOLVER_SINGULAR (zero pivot), SOLVER_FAILED (memory, MUMPS INFOG in words)
Status solve_factor(Solver& s, const SysMatrix& A);

// solve_back : x = A^-1 b; b and x [neq] may be the same vector
Status solve_back(Solver& s, const RealVec& b, RealVec& x);

// solve_back_rough : in single precision where that is faster, for preconditioners
Status solve_back_rough(Solver& s, const RealVec& b, RealVec& x);

// solve_back_many : the same for count right-hand sides, one after the other [count*neq], on one rank
Status solve_back_many(Solver& s, double* x, int count);

// solve_system : A x = b by the method of the deck, or by the fastest one according to the costs of this run
Status solve_system(Solver& s, const SysMatrix& A, const SolveTask& task, const RealVec& b, RealVec& x);

// solve_rest : b - A x of the last system as conjugate gradients left it [neq]; false: not known
bool solve_rest(const Solver& s, RealVec& rest);

// solve_multiply : y = A x as the last solution of the matrix with this stamp had it, on one rank; false: not
// known in single precision
bool solve_multiply(const Solver& s, const SysMatrix& A, long stamp, const RealVec& x, RealVec& y);

// solve_memory : adds the memory of the solver
struct MemoryUse {
  const char* what;
  double bytes;
};
void solve_memory(const Solver& s, std::vector<MemoryUse>& out);

void solve_close(Solver& s);

#endif
