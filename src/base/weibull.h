// ---------------------------------------------------------------------------
// weibull.h : random strengths
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_WEIBULL_H
#define MPFE_BASE_WEIBULL_H

#include "base/types.h"

// weibull_draw : numbers of Weibull's distribution, from the sequence of a seed
//   in   at   position of each number in the sequence, ascending
RealVec weibull_draw(double modulus, double mean, int seed, const IntVec& at);

#endif
