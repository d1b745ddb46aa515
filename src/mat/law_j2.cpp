// ---------------------------------------------------------------------------
// law_j2.cpp : von Mises plasticity with isotropic hardening at finite strain (doc/theory.md (2.24) - (2.29))
//
// F = Fe Fp, the energy is quadratic in the logarithmic elastic strains (Hencky), plastic flow is integrated
// with the exponential map: radial return of the logarithms. The history variable is Cp^-1 = (Fp^T Fp)^-1.
// ---------------------------------------------------------------------------
#include <algorithm>
#include <cmath>

#include "mat/hencky.h"

namespace {

using Vec3 = Eigen::Vector3d;

// relative to the yield stress: round-off of a state on the yield surface  (no test)
const double ON_SURFACE = 1e-12;

// Return to the yield surface of the deviatoric part s of a trial stress
struct Return {
  double q;                    // equivalent stress of the trial
  double gamma = 0.0;          // increment of the equivalent plastic strain
  double beta  = 1.0;          // factor of s
  double slope = 0.0;          // of the yield stress after the return
  bool plastic = false;
};

// q - 3 mu gamma = yield(a + gamma): the table is piecewise linear, Newton's method needs a few steps
Return radial_return(const MatLaw& law, double q, double a)
{
  Return r;
  r.q = q;
  double slope, y = yield_stress(*law.material, a, &slope);
  if (q - y <= ON_SURFACE * y) return r;
  r.plastic = true;
  for (int it = 0; it < 100; ++it) {
    const double f    = q - 3.0 * law.mu * r.gamma - y;
    const double step = f / (3.0 * law.mu + slope);
    r.gamma += step;
    y = yield_stress(*law.material, a + r.gamma, &slope);
    if (std::fabs(step) <= 1e-15 * r.gamma) break;
  }
  r.slope = slope;
  r.beta  = 1.0 - 3.0 * law.mu * r.gamma / q;
  return r;
}

Moduli moduli(const MatLaw& law, double K, const Return& r)
{
  const double flow = (r.slope / (3.0 * law.mu + r.slope) - r.beta) * 3.0 * law.mu / (r.q * r.q);
  return {K, 2.0 * law.mu * r.beta, r.plastic ? flow : 0.0};
}

void note_flow(const MatLaw& law, const Return& r, const double* h_n, double* h_np1, LawOutput& out)
{
  const double a = h_n[FLOW_EQUIVALENT];
  h_np1[FLOW_EQUIVALENT] = a + r.gamma;
  if (r.plastic) out.dissipated = yield_work(*law.material, a + r.gamma) - yield_work(*law.material, a);
}

// without NLGEOM: additive strains
bool j2_small_strain(const MatLaw& law, const double* E, const double* h_n, double* h_np1, bool tangent,
                     LawOutput& out)
{
  const double K = bulk_modulus(law);
  const SmallTrial t = small_trial(law, E, h_n);
  const Return r = radial_return(law, std::sqrt(1.5 * t.ss), h_n[FLOW_EQUIVALENT]);
  for (int i = 0; i < 6; ++i) out.S[i] = r.beta * t.s[i] + (i < 3 ? K * t.tr : 0.0);
  out.psi = 0.5 * K * t.tr * t.tr + 0.25 / law.mu * r.beta * r.beta * t.ss;
  small_flow(t, r.plastic ? 1.5 * r.gamma / r.q : 0.0, h_n, h_np1);
  note_flow(law, r, h_n, h_np1, out);
  if (tangent) small_tangent(t, moduli(law, K, r), out.D);
  return true;
}

}  // namespace

double yield_stress(const Material& m, double a, double* slope)
{
  const size_t n = m.yield.size();
  size_t k = 1;
  while (k < n && m.plastic_strain[k] <= a) ++k;
  *slope = 0.0;
  if (k >= n) return m.yield[n - 1];
  *slope = (m.yield[k] - m.yield[k - 1]) / (m.plastic_strain[k] - m.plastic_strain[k - 1]);
  return m.yield[k - 1] + *slope * (a - m.plastic_strain[k - 1]);
}

double yield_work(const Material& m, double a)
{
  double sum = 0.0, slope;
  for (size_t k = 1; k <= m.yield.size(); ++k) {
    const double from = m.plastic_strain[k - 1];
    if (a <= from) break;
    const double to = k < m.yield.size() ? std::min(a, m.plastic_strain[k]) : a;
    sum += 0.5 * (m.yield[k - 1] + yield_stress(m, to, &slope)) * (to - from);
  }
  return sum;
}

bool law_j2(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1, bool tangent,
            LawOutput& out)
{
  if (!finite) return j2_small_strain(law, E, h_n, h_np1, tangent, out);
  const double K = bulk_modulus(law);
  // 1. trial
  HenckyTrial t;
  if (!hencky_trial(E, h_n, t)) return false;
  double tr;
  const Vec3 s = hencky_deviator(law, t, tr);
  // 2. return
  const Return r = radial_return(law, std::sqrt(1.5) * s.norm(), h_n[FLOW_EQUIVALENT]);
  const Vec3 tau = r.beta * s + Vec3::Constant(K * tr);
  out.psi = 0.5 * K * tr * tr + 0.25 / law.mu * r.beta * r.beta * s.squaredNorm();
  hencky_stress(t, tau, out.S);
  // 3. history
  std::copy_n(h_n, FLOW_EQUIVALENT, h_np1);
  note_flow(law, r, h_n, h_np1, out);
  if (r.plastic) hencky_flow(t, t.e - 1.5 * r.gamma / r.q * s, h_np1);
  // 4. tangent                                                                        (2.27)
  if (tangent) hencky_tangent(t, tau, s, moduli(law, K, r), out.D);
  return true;
}
