#include <algorithm>
#include <cmath>

#include "contact/contact.h"

namespace {

// normal force (negative: pressure) of the penalty C, and its slope, from the gaps at both ends of the
// increment, shifted by lambda/C. The energy-momentum scheme takes the discrete gradient of 1/2 C <g>^2, so
// that a contact returns the energy it has stored  (4.10)
//   in   touch: in statics gaps up to it are closed (the slope has a jump there, the force has not):
//        otherwise a body that rests on another would be unsupported in the first iteration
void normal_law(const KernelMode& mode, double C, double touch, double g0, double g1, double& p,
                double& slope)
{
  const double n0 = std::min(g0, 0.0), n1 = std::min(g1, 0.0), dg = g1 - g0;
  if (!mode.mid) {
    p     = C * n1;
    slope = g1 < 0.0 || (mode.is_static && g1 <= touch) ? C : 0.0;
  } else if (mode.s_new > 0.5) {                       // dissipation on demand, as for the stress
    p     = C * (mode.s_new * n1 + mode.s_old * n0);
    slope = g1 < 0.0 ? mode.s_new * C : 0.0;
  } else if ((g0 < 0.0) == (g1 < 0.0)) {
    p     = 0.5 * C * (n0 + n1);
    slope = g1 < 0.0 ? 0.5 * C : 0.0;
  } else {
    p     = 0.5 * C * (n1 * n1 - n0 * n0) / dg;
    slope = (C * n1 - p) / dg;
  }
}

// adds to p and slope the stiffening of a deep contact: energy 1/4 G <g>^4, with g the gap beyond the depth
// where it begins                                                                  (4.21)
void add_growth(const KernelMode& mode, double G, double g0, double g1, double& p, double& slope)
{
  const double a = std::min(g0, 0.0), b = std::min(g1, 0.0), dg = g1 - g0;
  if (!mode.mid || mode.s_new > 0.5) {
    p += G * (mode.s_new * b * b * b + mode.s_old * a * a * a);
    slope += 3.0 * mode.s_new * G * b * b;
  } else if ((g0 < 0.0) == (g1 < 0.0)) {
    p += 0.25 * G * (a + b) * (a * a + b * b);
    slope += 0.25 * G * (a * a + 2.0 * a * b + 3.0 * b * b);
  } else {
    const double grown = 0.25 * G * (b * b * b * b - a * a * a * a) / dg;
    p += grown;
    slope += (G * b * b * b - grown) / dg;
  }
}

}  // namespace

double contact_force(const Model& m, const Bonds& bonds, const ContactPairs& pairs, int b,
                     const KernelMode& mode, const double* s, const double* t0, double lambda, double* f,
                     double* K, double* t1, double* slipped, double* across)
{
  const int dim     = m.dim;
  const double *n = &pairs.normal[b * dim], C = bonds.cn[b], Ct = bonds.ct[b],
               mu = bonds.contact.friction[b];
  const double g0 = pairs.gap[b], shift = lambda < 0.0 ? lambda / C : 0.0;   // C = 0: a lost bond    (4.14)
  double p, slope, sn = 0.0, tn = 0.0;
  for (int i = 0; i < dim; ++i) {
    sn += n[i] * s[i];
    tn += n[i] * t0[i];
  }
  const double g1 = g0 + sn;
  normal_law(mode, C, contact_touch(pairs, b), g0 + shift, g1 + shift, p, slope);
  add_growth(mode, bonds.growth(b), g0 + bonds.contact.deep[b], g1 + bonds.contact.deep[b], p, slope);
  for (int i = 0; i < dim; ++i) {
    f[i]  = p * n[i];
    t1[i] = 0.0;
    if (across) across[i] = 0.0;
    for (int j = 0; K && j < dim; ++j) K[i * dim + j] = slope * n[i] * n[j];
  }
  const double gap = contact_gap(pairs, b, g1);
  *slipped = 0.0;
  if (mu == 0.0) return gap;
  // contact without pressure: sticks until Newton's method has found the pressure
  if (p >= 0.0) {
    for (int i = 0; K && slope > 0.0 && i < dim; ++i)
      for (int j = 0; j < dim; ++j) K[i * dim + j] += Ct * ((i == j) - n[i] * n[j]);
    return gap;
  }
  // return mapping: sticking trial force, its norm limited to mu |p|                 (4.11)
  double size = 0.0, trial[3];
  for (int i = 0; i < dim; ++i) {
    trial[i] = t0[i] - tn * n[i] + Ct * (s[i] - sn * n[i]);
    size += trial[i] * trial[i];
  }
  size = std::sqrt(size);
  const double limit = -mu * p, cut = size > limit ? limit / size : 1.0;
  *slipped = (1.0 - cut) * size / Ct;
  for (int i = 0; i < dim; ++i) {
    t1[i] = cut * trial[i];
    f[i] += t1[i];
    if (across && cut < 1.0) across[i] = -mu * slope * trial[i] / size;
    for (int j = 0; K && j < dim; ++j) {
      double k = (i == j) - n[i] * n[j];
      if (cut < 1.0) k -= trial[i] * trial[j] / (size * size);
      K[i * dim + j] += cut * Ct * k;
    }
  }
  return gap;
}

double contact_multiplier(const KernelMode& mode, double C, double gap, double lambda)
{
  return std::min(0.0, lambda + mode.s_new * C * gap);
}
