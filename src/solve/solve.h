// ---------------------------------------------------------------------------
// solve.h : the system matrix and its solvers: open, analyse, factor, back, close
//
// Symmetric matrix of dim x dim blocks, lower block triangle, rows sorted.
// Block k of row I, column J = col[k] <= I, holds val[k*dim*dim + i*dim + j] = A(I*dim+i, J*dim+j).
// In a diagonal block only i >= j is meant; the others are zero.
// ---------------------------------------------------------------------------
#ifndef MPFE_SOLVE_SOLVE_H
#define MPFE_SOLVE_SOLVE_H

#include <memory>
#include <string>

#include "base/types.h"
#include "model/model.h"

struct SysMatrix {
  int dim = 0;
  int nrow = 0;                // block rows
  IntVec off{0};               // [nrow+1]
  IntVec col;                  // block columns, ascending in a row; the last one is the diagonal
  RealVec val;                 // [col.size()*dim*dim]
  int neq() const { return dim * nrow; }
};

// sys_multiply : y = A x
void sys_multiply(const SysMatrix& A, const RealVec& x, RealVec& y);

// order_rcm, order_metis : new position of each block row, [nrow]; reverse Cuthill-McKee on the block graph
// (every connected part from a pseudo-peripheral node), nested dissection by METIS
IntVec order_rcm(const SysMatrix& A);
IntVec order_metis(const SysMatrix& A);

struct SolverData;             // private to the solver files

struct Solver {
  SolverKind kind = SOLVER_AUTO;    // what the deck asks for; solve_open settles AUTO
  std::shared_ptr<SolverData> data;
  std::string message;              // of the last failure, in words with a remedy
  int zero_equation = -1;           // of the first zero pivot, -1: none
  long nfactor = 0, nback = 0, nanalyse = 0;
  double seconds_factor = 0, seconds_back = 0, seconds_analyse = 0;   // wall
  double flops = 0, memory_mb = 0;  // of the last factorisation, as far as known
  int negative = 0;                 // negative pivots of the last factorisation
};

// solve_open : AUTO becomes MUMPS when it was built in, else SKYLINE. Returns false when the kind is not built in.
bool solve_open(Solver& s, SolverKind kind);
const char* solve_name(const Solver& s);

// solve_analyse : ordering and symbolic work; again only when the pattern of A has changed
Status solve_analyse(Solver& s, const SysMatrix& A);

// solve_factor : SOLVER_SINGULAR (zero pivot), SOLVER_FAILED (memory, MUMPS INFOG in words)
Status solve_factor(Solver& s, const SysMatrix& A);

// solve_back : x = A^-1 b, b and x [neq], may be the same vector
Status solve_back(Solver& s, const RealVec& b, RealVec& x);

void solve_close(Solver& s);

#endif
