// ---------------------------------------------------------------------------
// law_granular.cpp : broken material with internal friction (doc/theory.md (2.30), (2.31))
//
//   pressure p = K (1 - J) where J < 1, none elsewhere; shear q <= sqrt(3) tan(angle) p; no cohesion, no
//   dilation: flow keeps the volume, so that J is that of the whole deformation
//
// While an element drops its stress, c of the intact law is still there: S = c S_intact + (1 - c) S.
// ---------------------------------------------------------------------------
#include <algorithm>
#include <cmath>

#include "mat/hencky.h"

namespace {

using Vec3 = Eigen::Vector3d;

// The law in principal logarithmic strains e
struct Grains {
  double psi;                  // stored
  double pressure, slope;      // Kirchhoff, positive in compression; its derivative to the trace of e
  double beta = 1.0;           // part of the trial deviator that is left
  double gamma = 0.0;          // increment of the equivalent plastic strain
  double q;                    // equivalent stress of the trial
  bool flows = false;
};

// v = J - 1 (without NLGEOM tr E), ss = s : s of the trial deviator
Grains flow(const MatLaw& law, bool finite, double v, double ss)
{
  const double K = law.lam3 + 2.0 / 3.0 * law.mu, J = finite ? 1.0 + v : 1.0;
  Grains g;
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

// adds the part c of the intact law
void blend(double c, const LawOutput& intact, bool tangent, LawOutput& out)
{
  out.psi = c * intact.psi + (1.0 - c) * out.psi;
  for (int i = 0; i < 6; ++i) out.S[i] = c * intact.S[i] + (1.0 - c) * out.S[i];
  for (int i = 0; tangent && i < 36; ++i) out.D[i] = c * intact.D[i] + (1.0 - c) * out.D[i];
}

void note_flow(const MatLaw& law, const Grains& g, const double* h_n, double* h_np1)
{
  h_np1[HISTORY_EQUIVALENT] = h_n[HISTORY_EQUIVALENT] + g.gamma;
  h_np1[HISTORY_DISSIPATED] = h_n[HISTORY_DISSIPATED] + (1.0 - law.c) * g.beta * g.q * g.gamma;
}

// the symmetric part                                                                   (2.31)
Moduli moduli(const MatLaw& law, const Grains& g)
{
  Moduli c{-g.slope, 2.0 * law.mu * g.beta, 0.0};
  if (!g.flows || g.q == 0.0) return c;
  c.flow  = -3.0 * law.mu * g.beta / (g.q * g.q);
  c.mixed = 0.5 * std::sqrt(3.0) * law.friction * g.slope / g.q;
  return c;
}

// increment of the plastic strain over the deviator of the trial
double flow_rate(const Grains& g) { return g.flows && g.q > 0.0 ? 1.5 * g.gamma / g.q : 0.0; }

void small_strain(const MatLaw& law, const double* E, const double* h_n, double* h_np1, bool tangent,
                  LawOutput& out)
{
  const SmallTrial t = small_trial(law, E, h_n);
  const Grains g     = flow(law, false, t.tr, t.ss);
  for (int i = 0; i < 6; ++i) out.S[i] = g.beta * t.s[i] - (i < 3 ? g.pressure : 0.0);
  out.psi = g.psi;
  small_flow(t, flow_rate(g), h_n, h_np1);
  note_flow(law, g, h_n, h_np1);
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
  const double tr = t.e.sum();
  const Vec3 s    = 2.0 * law.mu * (t.e.array() - tr / 3.0);
  const Grains g  = flow(law, true, std::expm1(tr), s.squaredNorm());
  const Vec3 tau  = g.beta * s - Vec3::Constant(g.pressure);
  out.psi = g.psi;
  hencky_stress(t, tau, out.S);
  std::copy_n(h_n, HISTORY_EQUIVALENT, h_np1);
  note_flow(law, g, h_n, h_np1);
  if (flow_rate(g) > 0.0) hencky_flow(t, t.e - flow_rate(g) * s, h_np1);
  if (tangent) hencky_tangent(t, tau, s, moduli(law, g), out.D);
  blend(law.c, intact, tangent, out);
  return true;
}

namespace {

double double_dot(const double* A, const double* B)
{
  return A[0] * B[0] + A[1] * B[1] + A[2] * B[2] + 2.0 * (A[3] * B[3] + A[4] * B[4] + A[5] * B[5]);
}

// The change of volume j = J - 1 (without NLGEOM tr E) with its derivatives to E
struct Volume {
  double j = 0.0;
  double G[6] = {1, 1, 1, 0, 0, 0}, D[36] = {0};
};

bool volume(bool finite, const double* E, Volume& v)
{
  v.j = E[0] + E[1] + E[2];
  if (!finite) return true;
  Eigen::Matrix3d C;
  C << 1 + 2 * E[0], 2 * E[3], 2 * E[5], 2 * E[3], 1 + 2 * E[1], 2 * E[4], 2 * E[5], 2 * E[4], 1 + 2 * E[2];
  const double det = C.determinant();
  if (!(det > 0.0)) return false;
  const double J = std::sqrt(det);
  const Eigen::Matrix3d B = C.inverse();
  static const int row[6] = {0, 1, 2, 0, 1, 2}, col[6] = {0, 1, 2, 1, 2, 0};
  v.j = J - 1.0;
  for (int a = 0; a < 6; ++a) {
    const int i = row[a], k = col[a];
    v.G[a] = J * B(i, k);
    for (int b = 0; b < 6; ++b) {
      const int l = row[b], m = col[b];
      v.D[a * 6 + b] = J * (B(i, k) * B(l, m) - B(i, l) * B(k, m) - B(i, m) * B(k, l));
    }
  }
  return true;
}

void add_dyad(double w, const double* A, const double* B, double* C)       // w sym(A (x) B)
{
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) C[i * 6 + j] += 0.5 * w * (A[i] * B[j] + B[i] * A[j]);
}

// discrete gradient of K/2 <j>_-^2, and its derivative unless C is null                     (2.17)
void pressure_step(double K, const Volume& v0, const Volume& vm, const Volume& v1, const double* d, double* S,
                   double* C)
{
  const double p0 = std::min(v0.j, 0.0), p1 = std::min(v1.j, 0.0), dd = double_dot(d, d);
  double q = 0.5 * K * (p0 + p1), slope = p1 < 0.0 ? 0.5 * K : 0.0;
  if ((p0 < 0.0) != (p1 < 0.0)) {
    q     = 0.5 * K * (p1 * p1 - p0 * p0) / (v1.j - v0.j);
    slope = (K * p1 - q) / (v1.j - v0.j);
  }
  const double rest = v1.j - v0.j - double_dot(vm.G, d), a = dd > 0.0 ? q * rest / dd : 0.0;
  for (int i = 0; i < 6; ++i) S[i] = q * vm.G[i] + a * d[i];
  if (!C) return;
  for (int i = 0; i < 36; ++i) C[i] = 0.5 * q * vm.D[i];
  add_dyad(slope, vm.G, v1.G, C);
  if (dd == 0.0) return;
  double g[6];
  for (int i = 0; i < 6; ++i) {
    double Dd = 0.0;
    for (int k = 0; k < 6; ++k) Dd += vm.D[i * 6 + k] * d[k] * (k < 3 ? 1.0 : 2.0);
    g[i] = (slope * rest * v1.G[i] + q * (v1.G[i] - vm.G[i] - 0.5 * Dd) - 2.0 * a * d[i]) / dd;
  }
  for (int i = 0; i < 6; ++i) C[i * 7] += a * (i < 3 ? 1.0 : 0.5);
  add_dyad(1.0, d, g, C);
}

}  // namespace

// ---------------------------------------------------------------------------
// law_granular_step : the step of the energy-momentum scheme                        (2.32)
//
// The pressure takes its discrete gradient; the shear stress is that of the end of the step. What the work of
// both is more than the change of the stored energy is dissipated: friction, and what backward Euler takes
// ---------------------------------------------------------------------------
bool law_granular_step(const MatLaw& law, bool finite, const double* E0, const double* E1, const double* h_n,
                       double* h_np1, double* S, double* C)
{
  MatLaw bare = law;
  bare.c = 0.0;
  LawOutput zero, one;
  double scratch[MAX_HISTORY], d[6], mid[6];
  for (int i = 0; i < 6; ++i) {
    d[i]   = E1[i] - E0[i];
    mid[i] = 0.5 * (E0[i] + E1[i]);
  }
  Volume v0, vm, v1;
  if (!law_granular(bare, finite, E0, h_n, scratch, false, zero) ||
      !law_granular(bare, finite, E1, h_n, h_np1, C != nullptr, one) || !volume(finite, E0, v0) ||
      !volume(finite, mid, vm) || !volume(finite, E1, v1))
    return false;
  const double K = law.lam3 + 2.0 / 3.0 * law.mu, p1 = K * std::min(v1.j, 0.0);
  pressure_step(K, v0, vm, v1, d, S, C);
  for (int i = 0; i < 6; ++i) S[i] += one.S[i] - p1 * v1.G[i];
  h_np1[HISTORY_DISSIPATED] =
      h_n[HISTORY_DISSIPATED] + (1.0 - law.c) * (double_dot(S, d) - one.psi + zero.psi);
  if (C) {
    for (int i = 0; i < 36; ++i) C[i] += one.D[i] - p1 * v1.D[i];
    add_dyad(p1 < 0.0 ? -K : 0.0, v1.G, v1.G, C);
  }
  LawOutput intact;                                    // quadratic: the middle is exact
  law_svk(law, finite, mid, nullptr, nullptr, C != nullptr, intact);
  for (int i = 0; i < 6; ++i) S[i] = law.c * intact.S[i] + (1.0 - law.c) * S[i];
  for (int i = 0; C && i < 36; ++i) C[i] = 0.5 * law.c * intact.D[i] + (1.0 - law.c) * C[i];
  return true;
}
