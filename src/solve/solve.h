// ---------------------------------------------------------------------------
// solve.h : the system matrix and its solvers: open, solve (analyse, factor, back, conjugate gradients),
// close
//
// Symmetric matrix of dim x dim blocks, lower block triangle, rows sorted.
// Block k of row I, column J = col[k] <= I, holds val[k*dim*dim + i*dim + j] = A(I*dim+i, J*dim+j).
// In a diagonal block only i >= j is meant; the others are zero.
//
// On several ranks A is the sum of their matrices: each holds what its elements, points and bonds add, in the
// rows of this rank alone, and so do vectors. The solver routines are then collective.
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
  // several ranks: rows are those of this rank, numbered by it, and vectors hold these alone, whole (with
  // what all ranks add); A and products with it are parts, which sys_sum adds up
  Halo halo;
  IntVec tied;                 // rows that bonds tie to the grid, and those of the grid: eliminated late
  int neq() const { return dim * nrow; }
};

// sys_shared : is A the sum of the matrices of several ranks?
inline bool sys_shared(const SysMatrix& A) { return A.halo.on(); }

// sys_number : several ranks: numbers of the rows over all ranks, those that belong to the first rank first.
// Collective, as sys_collect and sys_sum.
struct RowNumbers {
  IntVec number;               // [nrow]
  IntVec first;                // [ranks+1] first number of each rank
};
RowNumbers sys_number(const SysMatrix& A);

// sys_collect : the whole matrix on rank 0 (values: or its pattern alone), an empty one on the others.
// Several ranks: rows are numbered by sys_number
SysMatrix sys_collect(const SysMatrix& A, bool values);

// sys_pattern : pattern of a matrix of nrow block rows that couples the rows of each list
void sys_pattern(const ListTable& lists, int nrow, int dim, SysMatrix& A);

// sys_graph : neighbours of each block row, without itself, ascending
ListTable sys_graph(const SysMatrix& A);

// sys_sum : v [n*nrow] plus some numbers, of which each rank has what it adds to its rows, becomes the sum
// over the ranks
void sys_sum(const SysMatrix& A, RealVec& v, int extra = 0);

// sys_multiply : y = A x, A as it is on this rank
void sys_multiply(const SysMatrix& A, const RealVec& x, RealVec& y);

// sys_multiply : with val instead of the values of A
void sys_multiply(const SysMatrix& A, const RealVec& val, const RealVec& x, RealVec& y);
void sys_multiply(const SysMatrix& A, const std::vector<float>& val, const double* x, double* y);

// sys_diagonal : diagonal of A [neq]
void sys_diagonal(const SysMatrix& A, RealVec& d);

// part_mesh : elements of a mesh in parts of equal work of each kind; dim: nodes that neighbours have in
// common
IntVec part_mesh(const Mesh& mesh, int dim, const std::vector<RealVec>& work, int parts);

// order_rcm, order_metis : new position of each block row, [nrow]; reverse Cuthill-McKee on the block graph
// (every connected part from a pseudo-peripheral node), nested dissection by METIS
IntVec order_rcm(const SysMatrix& A);
IntVec order_metis(const SysMatrix& A);

// order_least : operations of a factorisation, at least: those of the separators of nested dissection, as the
// first of them tells. 0: not known, there is no METIS. Collective.
double order_least(const SysMatrix& A);

// part_shared : how many of n things several parts have; each(use) calls use(thing, part) as often as they
// stand in parts
template <class Each>
int part_shared(int n, Each each)
{
  IntVec of(n, -1);            // part, -2: of several
  int shared = 0;
  each([&](int thing, int part) {
    int& p = of[thing];
    if (p == -1) p = part;
    if (p < 0 || p == part) return;
    p = -2;
    ++shared;
  });
  return shared;
}

// part_weights : weights as whole numbers from 1 on, the largest near 1000; less where METIS, which adds them
// up as integers of 32 bits, could not count them
IntVec part_weights(const RealVec& weight);

struct SolverData;             // private to the solver files

// equations; below, a factorisation takes a few milliseconds and nothing needs to be chosen.
// Test: Krylov.ChosenPathsAgree (unit), with 4800 of them
const int SMALL_SYSTEM = 2000;

// Ways to a solution                                                          doc/theory.md 8
enum SolvePath {
  PATH_FACTOR,                 // analysis when the pattern is new, factorisation, back substitution
  PATH_BACK,                   // the matrix is the one that was factorised: back substitution
  PATH_REUSED,                   // CG with the factors of an earlier matrix
  // CG with the factors of an earlier matrix, corrected in the rows that have changed
  PATH_CHANGED,
  PATH_CHOLESKY,               // CG with an incomplete Cholesky factor
  PATH_DIAGONAL,               // CG with the diagonal blocks
  PATH_AMG,                    // CG with algebraic multigrid, whose smoother is the incomplete factor
  PATHS
};

struct PathLog {
  long solves = 0, iterations = 0, failed = 0;
  double seconds = 0.0;
  double digits = 0.0;         // decimal digits that the iterations have brought
};

// What a solver has done so far
struct SolveCounts {
  long fixed_null_pivots = 0;       // zero pivots whose unknowns were fixed
  long nfactor = 0, nback = 0, nanalyse = 0;
  long ncholmod = 0;                // factorisations by CHOLMOD
  double seconds_factor = 0, seconds_back = 0, seconds_analyse = 0;   // wall
  PathLog path[PATHS];
};

struct Solver : SolveCounts {
  SolverKind kind = SOLVER_AUTO;    // of the factorisation; solve_open settles AUTO
  SolverDef def;                    // what the deck asks for
  std::shared_ptr<SolverData> data;
  std::string message;              // of the last failure, in words with a remedy
  // of the first zero pivot, -1: none. Divided model: on ranks that do not have it one behind their last one
  int zero_equation = -1;
  bool masses = false;              // the matrix holds masses: no zero pivots are expected
  // MUMPS: zero pivots in this block row and later ones are no error, their unknowns are fixed; Newton's
  // residual judges. -1: all are errors. Divided model: row of this rank; all ranks have one, or none
  int null_pivot_row = -1;
  double flops = 0, memory_mb = 0;  // of the last factorisation, as far as known
  double flops_ahead = 0;           // what the analysis expects
  int negative = 0;                 // negative pivots of the last factorisation
  double left = 0.0;                // of the last solution: sqrt(energy) of the error, 0: solved directly
};

// What solve_system wants to know of a matrix and of the accuracy
struct SolveAsk {
  const std::vector<long>& key;     // [nrow] who a row is; the same node has the same key in every matrix
  long stamp = 0;                   // matrices with the same number are equal
  long pattern = 0;                 // so are patterns and who has which row; 0: not known
  // the residual may be eta of b, in the norm of the energy and in that of the force,
  double eta = 0.0;
  double energy = 0.0, residual = 0.0;   // or as small as these
  double digits = 10.0;             // how many decimals this will be, for the choice of the path
  bool exact = false;               // AUTO: nothing but a factorisation is good enough
  // statics with broken material: few rows change much, some are nearly singular
  bool broken = false;
  bool inertia = false;             // A holds masses
  bool known_regular = false;       // A is not singular, without being factorised
  bool plain = false;               // A is that of elements alone: no points, bonds, contact, fracture
  std::function<RealVec()> place = nullptr;      // [neq] positions of the nodes of the rows; empty: not known
};

// solve_open : AUTO and CG factorise by MUMPS when it was built in, else SKYLINE. Returns false when the kind
// is not built in.
// On several ranks rank 0 factorises alone when it is SKYLINE, and with REUSE=NO: MUMPS sums what ranks send
// each other as it comes, so that two runs differ in their last bits.
bool solve_open(Solver& s, const SolverDef& def);
const char* solve_name(const Solver& s);

// solve_analyse : ordering and symbolic work; again only when the pattern of A has changed
Status solve_analyse(Solver& s, const SysMatrix& A);

// solve_factor : SOLVER_SINGULAR (zero pivot), SOLVER_FAILED (memory, MUMPS INFOG in words)
Status solve_factor(Solver& s, const SysMatrix& A);

// solve_back : x = A^-1 b, b and x [neq], may be the same vector
Status solve_back(Solver& s, const RealVec& b, RealVec& x);

// solve_back_rough : to single precision where that is faster, for preconditioners
Status solve_back_rough(Solver& s, const RealVec& b, RealVec& x);

// solve_back_many : the same for count right-hand sides, one after the other [count*neq], on one rank
Status solve_back_many(Solver& s, double* x, int count);

// solve_system : A x = b on the path that the deck asks for, or that is the fastest as far as this run knows
Status solve_system(Solver& s, const SysMatrix& A, const SolveAsk& ask, const RealVec& b, RealVec& x);

// solve_memory : adds what the solver holds
struct MemoryUse {
  const char* what;
  double bytes;
};
void solve_memory(const Solver& s, std::vector<MemoryUse>& out);

void solve_close(Solver& s);

#endif
