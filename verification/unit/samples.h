// samples.h : what several unit tests start from
#ifndef MPFE_UNIT_SAMPLES_H
#define MPFE_UNIT_SAMPLES_H

#include <cmath>

#include "elem/kernel.h"
#include "solve/solve.h"

inline KernelMode energy_momentum(double dissipation)
{
  KernelMode mode;
  mode.mid   = true;
  mode.s_new = 0.5 + dissipation;
  mode.s_old = 0.5 - dissipation;
  return mode;
}

inline RealVec right_hand_side(const SysMatrix& A)
{
  RealVec b(A.neq());
  for (int k = 0; k < A.neq(); ++k) b[k] = std::sin(1.0 + k);
  return b;
}

#endif
