#include "frac/frac_kink.h"

#include <cmath>

namespace {

const double pi = 3.14159265358979323846;

// G after an infinitesimal kink by the angle pi m over K_I^2 + K_II^2 before it.
// Source: M. Amestoy, J.-B. Leblond, Crack paths in plane situations II, Int. J. Solids Structures 29 (1992)
// 465-501, the expansions of F_pq(m)
double release(double m, double K1, double K2)
{
  const double p2 = pi * pi, p4 = p2 * p2, p6 = p4 * p2, m2 = m * m;
  const double F11 =
      1 + m2 * (-3 * p2 / 8 + m2 * (p2 - 5 * p4 / 128 + m2 * (p2 / 9 - 11 * p4 / 72 + 119 * p6 / 15360 +
      m2 * (5.07790 + m2 * (-2.88312 + m2 * (-0.0925 + m2 * (2.996 + m2 * (-4.059 + m2 * (1.63 + m2 * 4.1)))))))));
  const double F12 =
      m * (-1.5 * pi + m2 * (10 * pi / 3 + pi * p2 / 16 + m2 * (-2 * pi - 133 * pi * p2 / 180 + 59 * pi * p4 / 1280 +
      m2 * (12.313906 + m2 * (-7.32433 + m2 * (1.5793 + m2 * (4.0216 + m2 * (-6.915 + m2 * (4.21 + m2 * 4.56)))))))));
  const double F21 =
      m * (0.5 * pi + m2 * (-4 * pi / 3 - pi * p2 / 48 + m2 * (-2 * pi / 3 + 13 * pi * p2 / 30 - 59 * pi * p4 / 3840 +
      m2 * (-6.176023 + m2 * (4.44112 + m2 * (-1.5340 + m2 * (-2.0700 + m2 * (4.684 + m2 * (-3.95 - m2 * 1.32)))))))));
  const double F22 =
      1 + m2 * (-4 - 3 * p2 / 8 + m2 * (8.0 / 3 + 29 * p2 / 18 - 5 * p4 / 128 + m2 * (-32.0 / 15 - 4 * p2 / 9 -
      1159 * p4 / 7200 + 119 * p6 / 15360 + m2 * (10.58254 + m2 * (-4.78511 + m2 * (-1.8804 + m2 * (7.280 +
      m2 * (-7.591 + m2 * (0.25 + m2 * 12.5)))))))));
  const double k1 = F11 * K1 + F12 * K2, k2 = F21 * K1 + F22 * K2;
  return (k1 * k1 + k2 * k2) / (K1 * K1 + K2 * K2);
}

}  // namespace

// Test: unit Fracture.KinksReleaseMost
Kink kink_of(double ratio)
{
  const double K2 = std::fabs(ratio);
  Kink best;
  for (int k = 1; k <= 170; ++k) {                   // half degrees
    const double gain = release(-k / 360.0, 1.0, K2);
    if (gain > best.gain) best = {-k * pi / 360.0, gain};
  }
  if (ratio < 0.0) best.angle = -best.angle;
  return best;
}

bool in_element(const Mesh& mesh, int e, const double* x)
{
  const int n = mesh.conn.count(e), *node = mesh.conn.begin(e);
  for (int a = 0; a < n; ++a) {
    const double *p = &mesh.X[3 * node[a]], *q = &mesh.X[3 * node[(a + 1) % n]];
    if ((q[0] - p[0]) * (x[1] - p[1]) - (q[1] - p[1]) * (x[0] - p[0]) < 0.0) return false;
  }
  return true;
}
