// ---------------------------------------------------------------------------
// turn.h : displacements of a small rotation
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_TURN_H
#define MPFE_BASE_TURN_H

// turn_coef : coefficient of the rotation theta_k in (theta x r)_i, r [3]; the plane has one rotation, k = 0
inline double turn_coef(int dim, const double* r, int i, int k)
{
  if (dim == 2) return i == 0 ? -r[1] : r[0];
  if (i == k) return 0.0;
  const int j = 3 - i - k;
  return (k + 1) % 3 == j ? r[j] : -r[j];
}

#endif
