// ---------------------------------------------------------------------------
// sum.h : long sums
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_SUM_H
#define MPFE_BASE_SUM_H

#include <cmath>

#include "base/types.h"

// sum_terms : sum of n terms, in eight partial sums for vector registers
template <class Term>
double sum_terms(size_t n, Term term)
{
  double part[8] = {};
  const size_t whole = n / 8 * 8;
  for (size_t k = 0; k < whole; k += 8)
    for (size_t l = 0; l < 8; ++l) part[l] += term(k + l);
  for (size_t k = whole; k < n; ++k) part[0] += term(k);
  double sum = 0.0;
  for (double p : part) sum += p;
  return sum;
}

// dot, norm : a . b, sqrt(a . a)
inline double dot(const RealVec& a, const RealVec& b)
{
  const double *x = a.data(), *y = b.data();
  return sum_terms(a.size(), [=](size_t k) { return x[k] * y[k]; });
}

inline double norm(const RealVec& a) { return std::sqrt(dot(a, a)); }

#endif
