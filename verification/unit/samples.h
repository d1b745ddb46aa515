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

// E 200; yield: stresses at the plastic strains
inline Material material_of(LawKind kind, double poisson, const RealVec& yield, const RealVec& plastic_strain)
{
  Material m;
  m.law            = kind;
  m.young          = 200.0;
  m.poisson        = poisson;
  m.yield          = yield;
  m.plastic_strain = plastic_strain;
  m.used           = true;
  return m;
}

inline RealVec right_hand_side(const SysMatrix& A)
{
  RealVec b(A.neq());
  for (int k = 0; k < A.neq(); ++k) b[k] = std::sin(1.0 + k);
  return b;
}

#endif
