// ---------------------------------------------------------------------------
// axes.h : unit vectors of local directions (*TRANSFORM, *ORIENTATION)
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_AXES_H
#define MPFE_DECK_AXES_H

#include <array>
#include <cmath>

using Vec = std::array<double, 3>;

inline Vec cross(const Vec& a, const Vec& b)
{
  return {{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]}};
}

// normalises v; false: its length does not exceed the limit
inline bool unit(Vec& v, double limit)
{
  const double length = std::sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
  if (!(length > limit)) return false;
  for (double& x : v) x /= length;
  return true;
}

inline double size_of(const Vec& v) { return std::fabs(v[0]) + std::fabs(v[1]) + std::fabs(v[2]); }

// writes the unit vectors as the rows of axis
inline void set_axes(const Vec& e1, const Vec& e2, const Vec& e3, std::array<double, 9>& axis)
{
  for (int j = 0; j < 3; ++j) {
    axis[j]     = e1[j];
    axis[3 + j] = e2[j];
    axis[6 + j] = e3[j];
  }
}

#endif
