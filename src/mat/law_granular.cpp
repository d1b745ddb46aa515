// ---------------------------------------------------------------------------
// law_granular.cpp : broken material with internal friction (doc/theory.md (2.30), (2.31))
//
//   pressure p = K (1 - J) for J < 1, else 0; shear q <= sqrt(3) tan(angle) p; no cohesion, no dilation: flow
//   is isochoric, so that J is the determinant of the total deformation
//
// During the release of an element the intact law has the weight c: S = c S_intact + (1 - c) S.
// ---------------------------------------------------------------------------
#include <algorithm>
#include <cmath>

#include "mat/hencky.h"
#include "mat/split_step.h"

namespace {

using Vec3 = Eigen::Vector3d;

// The law in principal logarithmic strains e
struct GranularState {
  double psi;                  // stored
  double pressure, slope;      // Kirchhoff, positive in compression; derivative by the trace of e
  double beta = 1.0;           // factor of the trial deviator
  double gamma = 0.0;          // increment of the equivalent plastic strain
  double q;                    // equivalent stress of the trial
  bool flows = false;
};

// v = J - 1 (without NLGEOM tr E), ss = s : s of the trial deviator
GranularState flow(const MatLaw& law, bool finite, double v, double ss)
{
  const double K = bulk_modulus(law), J = finite ? 1.0 + v : 1.0;
  GranularState g;
  const double closed = std::min(v, 0.0);
  g.pressure = -K * closed * J;
  g.slope    = v < 0.0 ? -K * (finite ? (1.0 + 2.0 * v) * J : 1.0) : 0.0;
  g.q        = std::sqrt(1.5 * ss);
  const double y = std::sqrt(3.0) * law.friction * g.pressure;
  g.flows = g.q > y;
  if (g.flows) {
    g.beta  = g.q > 0.0 ? y / g.q : 0.0;
    g.gamma = (g.q - y) / (3.0 * law.mu);
  }
  g.psi = 0.5 * K * closed * closed + 0.25 / law.mu * g.beta * g.beta * ss;
  return g;
}

// adds the intact law with the weight c
void blend(double c, const LawOutput& intact, bool tangent, LawOutput& out)
{
  out.psi = c * intact.psi + (1.0 - c) * out.psi;
  for (int i = 0; i < 6; ++i) out.S[i] = c * intact.S[i] + (1.0 - c) * out.S[i];
  for (int i = 0; tangent && i < 36; ++i) out.D[i] = c * intact.D[i] + (1.0 - c) * out.D[i];
}

void note_flow(const MatLaw& law, const GranularState& g, const double* h_n, double* h_np1, LawOutput& out)
{
  h_np1[FLOW_EQUIVALENT] = h_n[FLOW_EQUIVALENT] + g.gamma;
  out.dissipated         = (1.0 - law.c) * g.beta * g.q * g.gamma;
}

// the symmetric part                                                                   (2.31)
Moduli moduli(const MatLaw& law, const GranularState& g)
{
  Moduli c{-g.slope, 2.0 * law.mu * g.beta, 0.0};
  if (!g.flows || g.q == 0.0) return c;
  c.flow  = -3.0 * law.mu * g.beta / (g.q * g.q);
  c.mixed = 0.5 * std::sqrt(3.0) * law.friction * g.slope / g.q;
  return c;
}

// increment of the plastic strain over the trial deviator
double flow_rate(const GranularState& g) { return g.flows && g.q > 0.0 ? 1.5 * g.gamma / g.q : 0.0; }

void small_strain(const MatLaw& law, const double* E, const double* h_n, double* h_np1, bool tangent,
                  LawOutput& out)
{
  const SmallTrial t = small_trial(law, E, h_n);
  const GranularState g     = flow(law, false, t.tr, t.ss);
  for (int i = 0; i < 6; ++i) out.S[i] = g.beta * t.s[i] - (i < 3 ? g.pressure : 0.0);
  out.psi = g.psi;
  small_flow(t, flow_rate(g), h_n, h_np1);
  note_flow(law, g, h_n, h_np1, out);
  if (tangent) small_tangent(t, moduli(law, g), out.D);
}

}  // namespace

bool law_granular(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
                  bool tangent, LawOutput& out)
{
  LawOutput intact;
  law_svk(law, finite, E, h_n, h_np1, tangent, intact);
  if (!finite) {
    small_strain(law, E, h_n, h_np1, tangent, out);
    blend(law.c, intact, tangent, out);
    return true;
  }
  HenckyTrial t;
  if (!hencky_trial(E, h_n, t)) return false;
  double tr;
  const Vec3 s = hencky_deviator(law, t, tr);
  const GranularState g  = flow(law, true, std::expm1(tr), s.squaredNorm());
  const Vec3 tau  = g.beta * s - Vec3::Constant(g.pressure);
  out.psi = g.psi;
  hencky_stress(t, tau, out.S);
  std::copy_n(h_n, FLOW_EQUIVALENT, h_np1);
  note_flow(law, g, h_n, h_np1, out);
  if (flow_rate(g) > 0.0) hencky_flow(t, t.e - flow_rate(g) * s, h_np1);
  if (tangent) hencky_tangent(t, tau, s, moduli(law, g), out.D);
  blend(law.c, intact, tangent, out);
  return true;
}

// ---------------------------------------------------------------------------
// law_granular_step : the step of the energy-momentum scheme                        (2.32)
//
// The pressure uses its discrete gradient, as broken material with the law PRESSURE; the shear stress is
// taken at the end of the step. Work minus the change of the stored energy is dissipated: by friction and by
// the numerical damping of backward Euler
// ---------------------------------------------------------------------------
bool law_granular_step(const MatLaw& law, const KernelMode& mode, const double* E0, const double* E1,
                       const double* h_n, double* h_np1, double* S, double* C)
{
  using V = VoigtIndex<3>;
  if (!mode.mid || law.plane == PLANE_STRESS) return law_step_any(law, mode, E0, E1, h_n, h_np1, S, C);
  MatLaw bare = law;
  bare.c = 0.0;
  MatLaw pressure = bare;                              // the part without history
  pressure.split  = SPLIT_PRESSURE;
  LawOutput zero, one;
  double scratch[MAX_HISTORY], mid[6], start[9], end[9], Sp[9], Sp1[9], Cp[36], Cp1[36], psi, work = 0.0;
  const double* flow_n = h_n + HISTORY_OF_LAW;
  if (!law_granular(bare, mode.finite, E0, flow_n, scratch, false, zero) ||
      !law_granular(bare, mode.finite, E1, flow_n, h_np1 + HISTORY_OF_LAW, C != nullptr, one))
    return false;
  full_tensor<3>(E0, start);
  full_tensor<3>(E1, end);
  split_discrete_kink<3>(pressure, mode, start, end, Sp, C ? Cp : nullptr);
  split_eroded(law, 3, SPLIT_PRESSURE, mode.finite, 0.0, end, pressure.N, &psi, Sp1, C ? Cp1 : nullptr);
  if (std::isnan(Sp[0])) return false;
  for (int i = 0; i < 6; ++i) {
    const int at = 3 * V::row[i] + V::col[i];
    S[i]   = Sp[at] + one.S[i] - Sp1[at];
    mid[i] = 0.5 * (E0[i] + E1[i]);
    work += S[i] * (E1[i] - E0[i]) * (i < 3 ? 1.0 : 2.0);
  }
  for (int i = 0; C && i < 36; ++i) C[i] = Cp[i] + one.D[i] - Cp1[i];
  h_np1[HISTORY_DISSIPATED] = h_n[HISTORY_DISSIPATED] + (1.0 - law.c) * (work - one.psi + zero.psi);
  LawOutput intact;                                    // quadratic: the middle is exact
  law_svk(law, mode.finite, mid, nullptr, nullptr, C != nullptr, intact);
  for (int i = 0; i < 6; ++i) S[i] = law.c * intact.S[i] + (1.0 - law.c) * S[i];
  for (int i = 0; C && i < 36; ++i) C[i] = 0.5 * law.c * intact.D[i] + (1.0 - law.c) * C[i];
  return true;
}
