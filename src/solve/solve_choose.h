// ---------------------------------------------------------------------------
// solve_choose.h : work of the solution methods, counted instead of timed, so that two runs and all ranks of
// a run choose alike; the choice of one                                              doc/theory.md 8.3, (8.5)
// ---------------------------------------------------------------------------
#ifndef MPFE_SOLVE_SOLVE_CHOOSE_H
#define MPFE_SOLVE_SOLVE_CHOOSE_H

#include <limits>

#include "solve/solve_data.h"

// a path without a limit on its seconds
const double NEVER  = std::numeric_limits<double>::infinity();

// counted_factor, counted_back, counted_analysis : seconds of the last factorisation, of a back substitution,
// of an analysis; counted_iteration, counted_setup : of conjugate gradients on a path
double counted_factor(const Solver& s);
double counted_back(const SolverData& d);
double counted_analysis(const SolverData& d);
double counted_iteration(const SolverData& d, SolvePath path);
double counted_setup(const SolverData& d, SolvePath path);

// direct_seconds : of a solution by factorisation
double direct_seconds(const SolverData& d, bool pattern_known);

// first_limit : iterations of the first systems in dynamics, without a factorisation; more mean that dt is so
// large that inertia does not condition the matrix: inertia_dominates
int first_limit(int dim);
bool inertia_dominates(const SolverData& d, const SolveTask& task, int dim);

// exact_in_motion : the task, by conjugate gradients where inertia dominates although it is to be exact
SolveTask exact_in_motion(const Solver& s, const SolveTask& task, int dim);

// solve_choose : the path for a system
//   in   now     number of the solution
//   out  limit   seconds after which the path is given up
SolvePath solve_choose(Solver& s, const SysMatrix& A, const SolveTask& task, long now, double& limit);

#endif
