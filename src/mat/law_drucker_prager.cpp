// ---------------------------------------------------------------------------
// law_drucker_prager.cpp : pressure-dependent plasticity (doc/theory.md 2.6)
//
//   q^b - friction p - d(a) <= 0,  p = -tr(tau)/3                                                  (2.37)
//   flow: deviator as von Mises, volume increase t = tan(dilation) per unit of it, at most dq/dp     (2.38)
//
// Straight: b = 1, friction is the tangent of its angle. EXPONENT FORM: b > 1, friction is 1/a.
//
// APEX=GAP: the volume that the apex gives is a gap, which closes before the material carries pressure again:
//
//   e = e_trial + gap/3 1, and at the apex the new gap is the volume by which the return enlarges it (2.45)
//
// In logarithmic elastic strains as law_j2.cpp, with a cone as yield surface: a return beyond the apex ends
// at the apex. If dq/dp and dilation differ, the tangent is not symmetric; its symmetric part is used.
// ---------------------------------------------------------------------------
#include <algorithm>
#include <cmath>

#include "mat/hencky.h"
#include "mat/root.h"

namespace {

using Vec3 = Eigen::Vector3d;

// relative to the cohesion: round-off of a state on the yield surface  (no test)
const double ON_CONE = 1e-12;
// relative to the elastic stiffness, at the apex, where the tangent is zero  (test: strength/dp_apex.inp)
const double APEX = 1e-3;

// history of APEX=GAP: volume strain of the gap
enum { FLOW_GAP = FLOW_EQUIVALENT + 1 };

// A state between the trial stress and the cone, after an amount gamma of flow
struct ConeFlow {
  double gamma = 0.0;
  double q = 0.0, power = 0.0, steep = 0.0;      // equivalent stress, q^b, its derivative b q^(b-1)
  double rate = 0.0, turn = 0.0;                 // dilation; minus its derivative by q
  double a = 0.0, d = 0.0, hardens = 0.0;        // equivalent plastic strain, cohesion, its derivative by a
};

// Return to the cone of a trial stress
struct ConeReturn {
  double p, q;                 // pressure and equivalent stress of the trial
  ConeFlow flow;
  double volume = 0.0;         // plastic volume strain
  double beta   = 1.0;         // factor of the trial deviator
  double end = 0.0;            // pressure after the return
  double gap   = 0.0;          // volume strain of the gap before
  bool flows = false, apex = false;
};

// volume strain of the test of the hardening table that is part of its plastic strain                (2.39)
double test_share(const Material& m)
{
  return m.hardening == HARDENING_SHEAR ? 0.0 : m.hardening == HARDENING_TENSION ? 1.0 / 3.0 : -1.0 / 3.0;
}

// plastic strain of this test, per amount of flow with the given dilation
double strain_rate(const Material& m, double dilation) { return 1.0 + test_share(m) * dilation; }

// d of (2.37) after the equivalent plastic strain a; slope: its derivative
double cohesion(const Material& m, double a, double* slope)
{
  double steep;
  const double d = cone_cohesion(m, yield_stress(m, a, slope), &steep);
  *slope *= steep;
  return d;
}

// the state after gamma of flow; the dilation is at most that of associated flow
ConeFlow cone_flow(const MatLaw& law, double q, double a, double gamma)
{
  const Material& m = *law.material;
  ConeFlow f;
  f.gamma = gamma;
  f.q     = std::max(0.0, q - 3.0 * law.mu * gamma);
  f.power = cone_power(m, f.q);
  f.steep = m.exponent == 1.0 ? 1.0 : f.q > 0.0 ? m.exponent * f.power / f.q : 0.0;
  f.rate  = m.dilation;
  if (m.dilation * f.steep > m.friction) {
    f.rate = m.friction / f.steep;
    f.turn = f.rate * (m.exponent - 1.0) / f.q;
  }
  f.a = a + strain_rate(m, f.rate) * gamma;
  f.d = cohesion(m, f.a, &f.hardens);
  return f;
}

// derivative of friction (p + K volume) + d by the plastic volume strain
double by_volume(const Material& m, double K, const ConeFlow& f)
{
  return m.friction * K + test_share(m) * f.hardens;
}

// return to the apex, if it has no deviator
bool to_apex(const MatLaw& law, double K, double a, ConeReturn& r)
{
  if (r.p >= 0.0) return false;
  const Material& m  = *law.material;
  const double gamma = r.q / (3.0 * law.mu);
  const ConeFlow f   = cone_flow(law, r.q, a, gamma);
  if (-m.friction * (r.p + K * f.rate * gamma) - f.d <= 0.0) return false;
  r.apex   = true;
  r.flow   = f;
  r.beta   = 0.0;
  r.end    = -f.d / m.friction;
  r.volume = (r.end - r.p) / K;
  return true;
}

// (q - 3 mu gamma)^b - friction (p + K t gamma) = d(a_n + gamma + share t gamma), by Newton's method
ConeReturn cone_return(const MatLaw& law, double K, double p, double q, double a, double gap = 0.0)
{
  const Material& m = *law.material;
  ConeReturn r;
  p -= K * gap;
  r.p = r.end = p;
  r.q   = q;
  r.gap = gap;
  double slope;
  const double d = cohesion(m, a, &slope);
  if (cone_power(m, q) - m.friction * p - d <= ON_CONE * d) return r;
  r.flows = true;
  if (to_apex(law, K, a, r)) return r;
  ConeFlow& f = r.flow;                                // ends as the last one, at the root to 1e-14 of q/3 mu
  const auto excess = [&](double gamma, double* by_gamma) {
    f = cone_flow(law, q, a, gamma);
    *by_gamma = -3.0 * law.mu * f.steep - f.hardens -
                by_volume(m, K, f) * (f.rate + 3.0 * law.mu * f.turn * gamma);
    return f.power - m.friction * (p + K * f.rate * gamma) - f.d;
  };
  decreasing_root(0.0, 0.0, q / (3.0 * law.mu), excess);
  r.beta   = q > 0.0 ? f.q / q : 1.0;
  r.volume = f.rate * f.gamma;
  r.end    = p + K * r.volume;
  return r;
}

// the symmetric part, and skew                                                                   (2.40)
Moduli moduli(const MatLaw& law, double K, const ConeReturn& r)
{
  if (!r.flows) return {K, 2.0 * law.mu, 0.0};
  if (r.apex) return {APEX * K, APEX * 2.0 * law.mu, 0.0};
  const Material& m  = *law.material;
  const ConeFlow& f  = r.flow;
  // volume that the fall of the dilation takes, per pressure
  const double falls = f.turn > 0.0 ? f.rate * f.turn * f.gamma : 0.0, volume = by_volume(m, K, f);
  const double g     = f.turn > 0.0 ? 1.0 + volume / m.friction * falls : 1.0;
  const double rate  = f.turn > 0.0 ? (f.rate - falls * f.hardens / m.friction) / g : f.rate;
  const double stiff = 3.0 * law.mu * f.steep * g + volume * f.rate + f.hardens;
  const double part = 3.0 * law.mu / stiff, bulk = K / stiff;
  Moduli c{K * (1.0 - K * falls / g) - K * bulk * m.friction * rate, 2.0 * law.mu * r.beta, 0.0};
  if (r.q == 0.0) return c;
  c.flow  = (1.0 - r.beta - part * f.steep * g) * 3.0 * law.mu / (r.q * r.q);
  c.mixed = -0.5 * part * K * (m.friction + rate * f.steep * g) / r.q;
  c.skew  = -0.5 * part * K * (m.friction - rate * f.steep * g) / r.q;
  return c;
}

// of a sheet with the skew part, which the condensation of S33 = 0 needs; else the symmetric part alone
Moduli moduli_of_sheet(const MatLaw& law, double K, const ConeReturn& r)
{
  Moduli c = moduli(law, K, r);
  if (law.plane != PLANE_STRESS) c.skew = 0.0;
  return c;
}

// derivatives of the principal stresses with the skew part
Eigen::Matrix3d full_moduli(const Moduli& c, const Vec3& s)
{
  return principal_moduli(c, s) + c.skew * (s.replicate<1, 3>() - s.transpose().replicate<3, 1>());
}

// q on the cone of the end pressure, with the cohesion averaged over the flow
double mean_strength(const Material& m, double a, const ConeReturn& r)
{
  double slope, steep;
  const double from = yield_stress(m, a, &slope), to = yield_stress(m, r.flow.a, &slope);
  if (from == to) return r.flow.q;
  const double mean = (yield_work(m, r.flow.a) - yield_work(m, a)) / (r.flow.a - a);
  const double x    = m.friction * r.end + cone_cohesion(m, std::min(std::max(mean, from), to), &steep);
  return m.exponent == 1.0 ? x : std::pow(std::max(0.0, x), 1.0 / m.exponent);
}

// dissipation: work of the mean strength, less that of the pressure on the volume; at the apex the work of
// the tension, less that on a gap before
void note_flow(const MatLaw& law, const ConeReturn& r, const double* h_n, double* h_np1, LawOutput& out)
{
  const Material& m = *law.material;
  const double a = h_n[FLOW_EQUIVALENT];
  double slope;
  h_np1[FLOW_EQUIVALENT] = r.flows ? r.flow.a : a;
  h_np1[FLOW_GAP]        = m.gap && r.apex ? r.volume : 0.0;
  if (r.flows)
    out.dissipated = r.apex ? -r.end * r.volume : mean_strength(m, a, r) * r.flow.gamma - r.end * r.volume;
  if (r.gap > 0.0) out.dissipated -= cohesion(m, a, &slope) / m.friction * r.gap;
}

// the gap before, if there can be one
double gap_of(const MatLaw& law, const double* h_n) { return law.material->gap ? h_n[FLOW_GAP] : 0.0; }

// increment of the plastic strain over the trial deviator
double flow_rate(const ConeReturn& r) { return r.flows && r.q > 0.0 ? 1.5 * r.flow.gamma / r.q : 0.0; }

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
  if (tangent) small_tangent(t, moduli_of_sheet(law, K, r), out.D);
  return true;
}

}  // namespace

ConeState cone_state(const MatLaw& law, const Vec3& e, double a)
{
  const double K = bulk_modulus(law);
  const Vec3 s   = deviator(law, e);
  const ConeReturn r = cone_return(law, K, -K * e.sum(), std::sqrt(1.5) * s.norm(), a);
  if (!r.flows)
    return {s - Vec3::Constant(r.end), e, 0.5 * r.end * r.end / K + 0.25 / law.mu * s.squaredNorm(), 0.0, a,
            false, principal_moduli({K, 2.0 * law.mu, 0.0}, s)};
  double h[FLOW_GAP + 1] = {}, flowed[FLOW_GAP + 1];
  h[FLOW_EQUIVALENT] = a;
  LawOutput out;
  out.dissipated = 0.0;
  note_flow(law, r, h, flowed, out);
  const Moduli c = moduli(law, K, r);
  return {r.beta * s - Vec3::Constant(r.end),
          e - flow_rate(r) * s - Vec3::Constant(r.volume / 3.0),
          0.5 * r.end * r.end / K + 0.25 / law.mu * r.beta * r.beta * s.squaredNorm(),
          out.dissipated,
          flowed[FLOW_EQUIVALENT],
          r.flows,
          full_moduli(c, s)};
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
  if (tangent) hencky_tangent(t, tau, full_moduli(moduli_of_sheet(law, K, r), s), out.D);
  return true;
}
