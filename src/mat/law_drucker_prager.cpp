// ---------------------------------------------------------------------------
// law_drucker_prager.cpp : pressure-dependent plasticity (doc/theory.md 2.6)
//
//   q - tan(friction) p - d(a) <= 0,  p = -tr(tau)/3                                               (2.37)
//   flow: deviator as von Mises, volume increase tan(dilation) per unit of it                       (2.38)
//
// APEX=GAP: the volume that the apex gives is a gap, which closes before the material carries pressure again:
//
//   e = e_trial + gap/3 1, and at the apex the new gap is the volume by which the return enlarges it (2.45)
//
// In logarithmic elastic strains as law_j2.cpp, with a cone as yield surface: a return beyond the apex ends
// at the apex. If friction and dilation differ, the tangent is not symmetric; its symmetric part is used.
// ---------------------------------------------------------------------------
#include <algorithm>
#include <cmath>

#include "mat/hencky.h"

namespace {

using Vec3 = Eigen::Vector3d;

// relative to the cohesion: round-off of a state on the yield surface  (no test)
const double ON_CONE = 1e-12;
// relative to the elastic stiffness, at the apex, where the tangent is zero  (test: strength/dp_apex.inp)
const double APEX = 1e-3;

// history of APEX=GAP: volume strain of the gap
enum { FLOW_GAP = FLOW_EQUIVALENT + 1 };

// Return to the cone of a trial stress
struct ConeReturn {
  double p, q;                 // pressure and equivalent stress of the trial
  double gamma  = 0.0;         // amount of flow
  double volume = 0.0;         // plastic volume strain
  double beta   = 1.0;         // factor of the trial deviator
  double end = 0.0;            // pressure after the return
  double stiff = 0.0;          // d f/d gamma
  double gap   = 0.0;          // volume strain of the gap before
  bool flows = false, apex = false;
};

// plastic strain of the test of the hardening table, per amount of flow                          (2.39)
double strain_rate(const Material& m)
{
  const double third = m.dilation / 3.0;
  return m.hardening == HARDENING_SHEAR ? 1.0 : m.hardening == HARDENING_TENSION ? 1.0 + third : 1.0 - third;
}

// q at p = 0 after the equivalent plastic strain a
double cohesion(const Material& m, double a, double* slope)
{
  const double y = yield_stress(m, a, slope), part = cone_part(m);
  *slope *= part;
  return part * y;
}

// return to the apex: no deviator
void to_apex(const MatLaw& law, double K, double a, ConeReturn& r)
{
  const Material& m = *law.material;
  double slope;
  r.apex   = true;
  r.gamma  = r.q / (3.0 * law.mu);
  r.beta   = 0.0;
  r.end    = -cohesion(m, a + strain_rate(m) * r.gamma, &slope) / m.friction;
  r.volume = (r.end - r.p) / K;
}

// q - 3 mu gamma - tan(friction) (p + K tan(dilation) gamma) = d(a + rate gamma); the table is piecewise
// linear
ConeReturn cone_return(const MatLaw& law, double K, double p, double q, double a, double gap = 0.0)
{
  const Material& m = *law.material;
  ConeReturn r;
  p -= K * gap;
  r.p = r.end = p;
  r.q   = q;
  r.gap = gap;
  double slope, d = cohesion(m, a, &slope);
  if (q - m.friction * p - d <= ON_CONE * d) return r;
  r.flows = true;
  const double rate = strain_rate(m), elastic = 3.0 * law.mu + m.friction * K * m.dilation;
  for (int it = 0; it < 100; ++it) {
    const double f    = q - m.friction * p - elastic * r.gamma - d;
    const double step = f / (elastic + rate * slope);
    r.gamma += step;
    d = cohesion(m, a + rate * r.gamma, &slope);
    if (std::fabs(step) <= 1e-15 * r.gamma) break;
  }
  r.stiff = elastic + rate * slope;
  if (3.0 * law.mu * r.gamma > q) {
    to_apex(law, K, a, r);
    return r;
  }
  r.beta   = q > 0.0 ? 1.0 - 3.0 * law.mu * r.gamma / q : 1.0;
  r.volume = m.dilation * r.gamma;
  r.end    = p + K * r.volume;
  return r;
}

// the symmetric part                                                                             (2.40)
Moduli moduli(const MatLaw& law, double K, const ConeReturn& r)
{
  if (!r.flows) return {K, 2.0 * law.mu, 0.0};
  if (r.apex) return {APEX * K, APEX * 2.0 * law.mu, 0.0};
  const Material& m = *law.material;
  const double part = 3.0 * law.mu / r.stiff, bulk = K / r.stiff;
  Moduli c{K - K * bulk * m.friction * m.dilation, 2.0 * law.mu * r.beta, 0.0};
  if (r.q == 0.0) return c;
  c.flow  = (1.0 - r.beta - part) * 3.0 * law.mu / (r.q * r.q);
  c.mixed = -0.5 * part * K * (m.friction + m.dilation) / r.q;
  return c;
}

// dissipation: by the cohesion with its hardening, and by friction minus dilation; at the apex the work of
// the tension, less that on a gap before
void note_flow(const MatLaw& law, const ConeReturn& r, const double* h_n, double* h_np1, LawOutput& out)
{
  const Material& m = *law.material;
  const double a = h_n[FLOW_EQUIVALENT], rate = strain_rate(m);
  double slope;
  h_np1[FLOW_EQUIVALENT] = a + rate * r.gamma;
  h_np1[FLOW_GAP]        = m.gap && r.apex ? r.volume : 0.0;
  if (r.flows)
    out.dissipated = r.apex ? -r.end * r.volume
                            : (yield_work(m, a + rate * r.gamma) - yield_work(m, a)) * cone_part(m) / rate +
                                  (m.friction - m.dilation) * r.end * r.gamma;
  if (r.gap > 0.0) out.dissipated -= cohesion(m, a, &slope) / m.friction * r.gap;
}

// the gap before, if there can be one
double gap_of(const MatLaw& law, const double* h_n) { return law.material->gap ? h_n[FLOW_GAP] : 0.0; }

// increment of the plastic strain over the trial deviator
double flow_rate(const ConeReturn& r) { return r.flows && r.q > 0.0 ? 1.5 * r.gamma / r.q : 0.0; }

// the deviator of principal strains, as a stress
Vec3 deviator(const MatLaw& law, const Vec3& e) { return 2.0 * law.mu * (e.array() - e.sum() / 3.0); }

// without NLGEOM: additive strains
bool cone_small_strain(const MatLaw& law, const double* E, const double* h_n, double* h_np1, bool tangent,
                  LawOutput& out)
{
  const double K     = bulk_modulus(law);
  const SmallTrial t = small_trial(law, E, h_n);
  const ConeReturn r     = cone_return(law, K, -K * t.tr, std::sqrt(1.5 * t.ss), h_n[FLOW_EQUIVALENT],
                                 gap_of(law, h_n));
  for (int i = 0; i < 6; ++i) out.S[i] = r.beta * t.s[i] - (i < 3 ? r.end : 0.0);
  out.psi = 0.5 * r.end * r.end / K + 0.25 / law.mu * r.beta * r.beta * t.ss;
  small_flow(t, flow_rate(r), h_n, h_np1);
  for (int i = 0; i < 3; ++i) h_np1[FLOW_DEFORMATION + i] -= 2.0 / 3.0 * (r.volume - r.gap);
  note_flow(law, r, h_n, h_np1, out);
  if (tangent) small_tangent(t, moduli(law, K, r), out.D);
  return true;
}

}  // namespace

ConeState cone_state(const MatLaw& law, const Vec3& e, double a)
{
  const double K = bulk_modulus(law);
  const Vec3 s   = deviator(law, e);
  const ConeReturn r = cone_return(law, K, -K * e.sum(), std::sqrt(1.5) * s.norm(), a);
  double h[FLOW_GAP + 1] = {}, flowed[FLOW_GAP + 1];
  h[FLOW_EQUIVALENT] = a;
  LawOutput out;
  out.dissipated = 0.0;
  note_flow(law, r, h, flowed, out);
  return {r.beta * s - Vec3::Constant(r.end),
          e - flow_rate(r) * s - Vec3::Constant(r.volume / 3.0),
          0.5 * r.end * r.end / K + 0.25 / law.mu * r.beta * r.beta * s.squaredNorm(),
          out.dissipated,
          flowed[FLOW_EQUIVALENT],
          r.flows,
          principal_moduli(moduli(law, K, r), s)};
}

bool law_drucker_prager(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
                        bool tangent, LawOutput& out)
{
  if (!finite) return cone_small_strain(law, E, h_n, h_np1, tangent, out);
  const double K = bulk_modulus(law);
  // 1. trial
  HenckyTrial t;
  if (!hencky_trial(E, h_n, t)) return false;
  double tr;
  const Vec3 s = hencky_deviator(law, t, tr);
  // 2. return
  const ConeReturn r = cone_return(law, K, -K * tr, std::sqrt(1.5) * s.norm(), h_n[FLOW_EQUIVALENT],
                                   gap_of(law, h_n));
  const Vec3 tau = r.beta * s - Vec3::Constant(r.end);
  out.psi = 0.5 * r.end * r.end / K + 0.25 / law.mu * r.beta * r.beta * s.squaredNorm();
  hencky_stress(t, tau, out.S);
  // 3. history
  std::copy_n(h_n, FLOW_EQUIVALENT, h_np1);
  note_flow(law, r, h_n, h_np1, out);
  if (r.flows || r.gap > 0.0)
    hencky_flow(t, t.e - flow_rate(r) * s - Vec3::Constant((r.volume - r.gap) / 3.0), h_np1);
  // 4. tangent
  if (tangent) hencky_tangent(t, tau, s, moduli(law, K, r), out.D);
  return true;
}
