// ---------------------------------------------------------------------------
// vec.h : sums over long vectors
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_VEC_H
#define MPFE_BASE_VEC_H

#include <cmath>

#include "base/types.h"

// dot : a . b, in eight parts, so that the compiler can use vector registers
inline double dot(const RealVec& a, const RealVec& b)
{
  double part[8] = {};
  const size_t whole = a.size() / 8 * 8;
  for (size_t k = 0; k < whole; k += 8)
    for (size_t l = 0; l < 8; ++l) part[l] += a[k + l] * b[k + l];
  for (size_t k = whole; k < a.size(); ++k) part[0] += a[k] * b[k];
  double sum = 0.0;
  for (double p : part) sum += p;
  return sum;
}

inline double norm(const RealVec& a) { return std::sqrt(dot(a, a)); }

#endif
