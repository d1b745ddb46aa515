// ---------------------------------------------------------------------------
// step_turn.h : contact points that close or open in an explicit increment (doc/theory.md 6.8)
// ---------------------------------------------------------------------------
#ifndef MPFE_STEP_STEP_TURN_H
#define MPFE_STEP_STEP_TURN_H

#include "step/step.h"

// step_close : adds to the internal forces at t(n+1) what contact points that close or open in the increment
// lack, so that the mean of the forces at both ends does the work of their energy              (6.51)
//   out  a.fint;  p.stable.before  these forces, until the next increment takes them back; empty: none.
//        Collective.
void step_close(Problem& p, Attempt& a);

// step_close_work : work of the friction that step_close adds at contact point k, which has met a face
//   in   slip  relative displacements of the increment  [nbond*dim]                              (6.51)
double step_close_work(const State& st, const ContactPairs& pairs, const RealVec& slip, int dim, int k);

#endif
