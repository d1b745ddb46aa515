// ---------------------------------------------------------------------------
// root.h : zero of a decreasing function of one unknown. Private to mat/
// ---------------------------------------------------------------------------
#ifndef MPFE_MAT_ROOT_H
#define MPFE_MAT_ROOT_H

#include <cmath>

// decreasing_root : zero of excess(x, slope) between lo and hi, from x: Newton's method, 1 to 6 iterations,
// safeguarded by bisection
template <class Excess>
double decreasing_root(double x, double lo, double hi, Excess excess)
{
  const int MAX_TRIALS = 200;
  const double ROUND   = 1e-14;        // of hi
  for (int i = 0; i < MAX_TRIALS && hi - lo > ROUND * hi; ++i) {
    double slope;
    const double more = excess(x, &slope);
    (more > 0.0 ? lo : hi) = x;
    const double next = slope < 0.0 ? x - more / slope : lo - 1.0;
    if (std::fabs(next - x) <= ROUND * hi) return next;
    x = next > lo && next < hi ? next : 0.5 * (lo + hi);
  }
  return x;
}

#endif
