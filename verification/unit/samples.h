// samples.h : what several unit tests start from
#ifndef MPFE_UNIT_SAMPLES_H
#define MPFE_UNIT_SAMPLES_H

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "elem/kernel.h"
#include "mat/law.h"
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

// a law at an integration point: at a strain, and on to one, whose history and output it keeps
struct LawPoint {
  MatLaw law;
  bool finite;
  double h[MAX_HISTORY] = {0};
  LawOutput out = {};
  bool at(const double* E, LawOutput& o, double* h1 = nullptr) const
  {
    double e[6], none[MAX_HISTORY];
    std::copy(E, E + 6, e);
    return law_update(law, finite, e, h, h1 ? h1 : none, true, o);
  }
  void go(const double* E)
  {
    double h1[MAX_HISTORY] = {0};
    ASSERT_TRUE(at(E, out, h1));
    std::copy(h1, h1 + MAX_HISTORY, h);
  }
};

// a strain with components of this size
inline void random_strain(std::mt19937& gen, double size, Plane plane, double* E)
{
  std::uniform_real_distribution<double> any(-size, size);
  for (int i = 0; i < 6; ++i) E[i] = any(gen);
  if (plane == PLANE_NONE) return;
  E[2] = E[4] = E[5] = 0.0;
}

inline RealVec right_hand_side(const SysMatrix& A)
{
  RealVec b(A.neq());
  for (int k = 0; k < A.neq(); ++k) b[k] = std::sin(1.0 + k);
  return b;
}

#endif
