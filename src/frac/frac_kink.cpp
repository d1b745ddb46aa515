#include "frac/frac_kink.h"

#include <algorithm>
#include <cmath>

namespace {

const double pi = 3.14159265358979323846;

// coefficients of F_pq(m) in powers of m^2, F_12 and F_21 over m.
// Source: M. Amestoy, J.-B. Leblond, Crack paths in plane situations II, Int. J. Solids Structures 29 (1992)
// 465-501
const double p1 = pi, p2 = pi * pi, p3 = pi * p2, p4 = p2 * p2, p5 = p4 * pi, p6 = p4 * p2;
const double F11[11] = {1, -3 * p2 / 8, p2 - 5 * p4 / 128, p2 / 9 - 11 * p4 / 72 + 119 * p6 / 15360,
                        5.07790, -2.88312, -0.0925, 2.996, -4.059, 1.63, 4.1};
const double F12[10] = {-1.5 * p1, 10 * p1 / 3 + p3 / 16, -2 * p1 - 133 * p3 / 180 + 59 * p5 / 1280,
                        12.313906, -7.32433, 1.5793, 4.0216, -6.915, 4.21, 4.56};
const double F21[10] = {0.5 * p1, -4 * p1 / 3 - p3 / 48, -2 * p1 / 3 + 13 * p3 / 30 - 59 * p5 / 3840,
                        -6.176023, 4.44112, -1.5340, -2.0700, 4.684, -3.95, -1.32};
const double F22[11] = {1, -4 - 3 * p2 / 8, 8.0 / 3 + 29 * p2 / 18 - 5 * p4 / 128,
                        -32.0 / 15 - 4 * p2 / 9 - 1159 * p4 / 7200 + 119 * p6 / 15360,
                        10.58254, -4.78511, -1.8804, 7.280, -7.591, 0.25, 12.5};

template <int N>
double series(const double (&c)[N], double x)
{
  double sum = 0.0;
  for (int k = N - 1; k >= 0; --k) sum = sum * x + c[k];
  return sum;
}

// G after an infinitesimal kink by the angle pi m, over K_I^2 + K_II^2 + K_III^2/(1 - nu) before.
// Source of the last: G. C. Sih, J. Appl. Mech. 32 (1965) 51-58
//   in   K3   K_III/sqrt(1 - nu)
double release(double m, double K1, double K2, double K3)
{
  const double m2 = m * m, bend = std::fabs(m);
  const double k1 = series(F11, m2) * K1 + m * series(F12, m2) * K2;
  const double k2 = m * series(F21, m2) * K1 + series(F22, m2) * K2;
  const double k3 = std::pow((1.0 - bend) / (1.0 + bend), 0.5 * bend) * K3;
  return (k1 * k1 + k2 * k2 + k3 * k3) / (K1 * K1 + K2 * K2 + K3 * K3);
}

}  // namespace

// (test: Fracture.KinksReleaseMost)
Kink kink_of(double ratio, double out)
{
  const double K2 = std::fabs(ratio);
  Kink best;
  for (int k = 1; k <= 170; ++k) {                   // half degrees
    const double gain = release(-k / 360.0, 1.0, K2, out);
    if (gain > best.gain) best = {-k * pi / 360.0, gain};
  }
  if (ratio < 0.0) best.angle = -best.angle;
  return best;
}

double kink_share(double angle) { return release(std::min(std::fabs(angle) / pi, 0.5), 1.0, 0.0, 0.0); }
