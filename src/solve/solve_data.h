// ---------------------------------------------------------------------------
// solve_data.h : what the solver files share and nobody else sees
// ---------------------------------------------------------------------------
#ifndef MPFE_SOLVE_SOLVE_DATA_H
#define MPFE_SOLVE_SOLVE_DATA_H

#include "solve/solve.h"

// Profile of the upper triangle of D x D blocks, D = dim. Block column J reaches from block row first[J] to J;
// its D scalar columns lie one after the other, each of (J - first[J] + 1)*D numbers, from start[J] on.
// After the factorisation: above the diagonal U = L^T with unit diagonal, and d.
struct Skyline {
  IntVec pos;                  // [nrow] new position of each block row
  IntVec first;                // [nrow]
  std::vector<long> start;     // [nrow+1]
  RealVec a;                   // [start[nrow]]
  RealVec d;                   // [neq] pivots
  RealVec x;                   // [neq] right-hand side in the new order
};

struct MumpsData;              // private to solve_mumps.cpp

struct SolverData {
  int dim = 0;                 // pattern that was analysed
  IntVec off, col;
  bool analysed = false, factored = false;
  Skyline sky;
  std::shared_ptr<MumpsData> mumps;
};

// sys_graph : neighbours of each block row, without itself, ascending
ListTable sys_graph(const SysMatrix& A);

Status skyline_analyse(Solver& s, const SysMatrix& A);
Status skyline_factor(Solver& s, const SysMatrix& A);
Status skyline_back(Solver& s, RealVec& x);    // x: right-hand side in, solution out

#ifdef MPFE_MUMPS
void mumps_open(Solver& s);
Status mumps_analyse(Solver& s, const SysMatrix& A);
Status mumps_factor(Solver& s, const SysMatrix& A);
Status mumps_back(Solver& s, RealVec& x);
void mumps_close(Solver& s);
#endif

// solve_fail : keeps the message and returns the status
Status solve_fail(Solver& s, Status status, const char* format, ...) __attribute__((format(printf, 3, 4)));

#endif
