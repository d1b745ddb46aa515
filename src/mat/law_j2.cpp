// ---------------------------------------------------------------------------
// law_j2.cpp : von Mises plasticity with isotropic hardening at finite strain (doc/theory.md (2.24) - (2.29))
//
// F = Fe Fp, the energy is quadratic in the logarithmic elastic strains (Hencky), plastic flow is integrated
// with the exponential map: radial return of the logarithms. What is kept is Cp^-1 = (Fp^T Fp)^-1.
// The law depends on F through C alone: any L^T with L L^T = C takes the place of F.
// ---------------------------------------------------------------------------
#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "mat/law.h"

namespace {

using Mat3 = Eigen::Matrix3d;
using Vec3 = Eigen::Vector3d;

const double ON_SURFACE = 1e-12;     // of the yield stress: rounding of a state that has just yielded
const double EQUAL_STRETCH = 1e-6;   // relative difference of squares of stretches: below it the limit (2.28)

Mat3 tensor(const double* a)
{
  Mat3 M;
  M << a[0], a[3], a[5], a[3], a[1], a[4], a[5], a[4], a[2];
  return M;
}

void six(const Mat3& M, double* a)
{
  a[0] = M(0, 0);
  a[1] = M(1, 1);
  a[2] = M(2, 2);
  a[3] = 0.5 * (M(0, 1) + M(1, 0));
  a[4] = 0.5 * (M(1, 2) + M(2, 1));
  a[5] = 0.5 * (M(2, 0) + M(0, 2));
}

// l of the Cholesky factor I + l of I + 2 E, written so that small strains lose no digits
bool cholesky(const double* E, Mat3& l)
{
  const auto root = [](double x) { return x / (1.0 + std::sqrt(1.0 + x)); };
  l.setZero();
  double x = 2.0 * E[0];
  if (!(x > -1.0)) return false;
  l(0, 0) = root(x);
  l(1, 0) = 2.0 * E[3] / (1.0 + l(0, 0));
  l(2, 0) = 2.0 * E[5] / (1.0 + l(0, 0));
  x = 2.0 * E[1] - l(1, 0) * l(1, 0);
  if (!(x > -1.0)) return false;
  l(1, 1) = root(x);
  l(2, 1) = (2.0 * E[4] - l(2, 0) * l(1, 0)) / (1.0 + l(1, 1));
  x = 2.0 * E[2] - l(2, 0) * l(2, 0) - l(2, 1) * l(2, 1);
  if (!(x > -1.0)) return false;
  l(2, 2) = root(x);
  return true;
}

// Return to the yield surface of the deviatoric part s of a trial stress
struct Return {
  double q;                    // equivalent stress of the trial
  double gamma = 0.0;          // increment of the equivalent plastic strain
  double beta  = 1.0;          // part of s that is left
  double slope = 0.0;          // of the yield stress where it ends
  bool plastic = false;
};

// q - 3 mu gamma = yield(a + gamma): the table is piecewise linear, so Newton's method ends in a few steps
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

// factor of s (x) s in the derivative of the returned stress                           (2.27)
double flow_factor(const MatLaw& law, const Return& r)
{
  return r.plastic ? (r.slope / (3.0 * law.mu + r.slope) - r.beta) * 3.0 * law.mu / (r.q * r.q) : 0.0;
}

void note_flow(const MatLaw& law, const Return& r, const double* h_n, double* h_np1)
{
  const double a = h_n[HISTORY_EQUIVALENT];
  h_np1[HISTORY_EQUIVALENT] = a + r.gamma;
  h_np1[HISTORY_DISSIPATED] = h_n[HISTORY_DISSIPATED] + (r.plastic ? yield_work(*law.material, a + r.gamma) -
                                                                     yield_work(*law.material, a)
                                                                   : 0.0);
}

// without NLGEOM: additive strains
bool small_strain(const MatLaw& law, const double* E, const double* h_n, double* h_np1, bool tangent,
                  LawOutput& out)
{
  const double K = law.lam3 + 2.0 / 3.0 * law.mu;
  double e[6], s[6], ss = 0.0;
  for (int i = 0; i < 6; ++i) e[i] = E[i] + 0.5 * h_n[HISTORY_PLASTIC + i];
  const double tr = e[0] + e[1] + e[2];
  for (int i = 0; i < 6; ++i) {
    s[i] = 2.0 * law.mu * (e[i] - (i < 3 ? tr / 3.0 : 0.0));
    ss += s[i] * s[i] * (i < 3 ? 1.0 : 2.0);
  }
  const Return r = radial_return(law, std::sqrt(1.5 * ss), h_n[HISTORY_EQUIVALENT]);
  for (int i = 0; i < 6; ++i) {
    out.S[i] = r.beta * s[i] + (i < 3 ? K * tr : 0.0);
    h_np1[HISTORY_PLASTIC + i] =
        h_n[HISTORY_PLASTIC + i] - (r.plastic ? 3.0 * r.gamma / r.q * s[i] : 0.0);
  }
  out.psi = 0.5 * K * tr * tr + 0.25 / law.mu * r.beta * r.beta * ss;
  note_flow(law, r, h_n, h_np1);
  if (!tangent) return true;
  const double flow = flow_factor(law, r);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      const double dev = (i == j ? (i < 3 ? 2.0 : 1.0) : 0.0) - (i < 3 && j < 3 ? 2.0 / 3.0 : 0.0);
      out.D[i * 6 + j] = (i < 3 && j < 3 ? K : 0.0) + law.mu * r.beta * dev + flow * s[i] * s[j];
    }
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
  if (!finite) return small_strain(law, E, h_n, h_np1, tangent, out);
  const double K = law.lam3 + 2.0 / 3.0 * law.mu;
  // 1. trial: be - I = L^T Cp^-1 L - I, its logarithms
  Mat3 l;
  if (!cholesky(E, l)) return false;
  const Mat3 L = Mat3::Identity() + l, LL = l + l.transpose() + l.transpose() * l;     // L^T L - I
  const Mat3 X = LL + L.transpose() * tensor(h_n + HISTORY_PLASTIC) * L;
  const Eigen::SelfAdjointEigenSolver<Mat3> spectrum(X);
  const Vec3 x = spectrum.eigenvalues();
  const Mat3& n = spectrum.eigenvectors();
  if (!(x.minCoeff() > -1.0)) return false;
  Vec3 e;
  for (int i = 0; i < 3; ++i) e(i) = 0.5 * std::log1p(x(i));
  const double tr = e.sum();
  const Vec3 s    = 2.0 * law.mu * (e.array() - tr / 3.0);
  // 2. return
  const Return r = radial_return(law, std::sqrt(1.5) * s.norm(), h_n[HISTORY_EQUIVALENT]);
  const Vec3 tau = r.beta * s + Vec3::Constant(K * tr);
  out.psi = 0.5 * K * tr * tr + 0.25 / law.mu * r.beta * r.beta * s.squaredNorm();
  note_flow(law, r, h_n, h_np1);
  // 3. stress: S = L^-T tau L^-1
  const Mat3 M = L.transpose().triangularView<Eigen::Upper>().solve(n);                // L^-T n_A
  six(M * tau.asDiagonal() * M.transpose(), out.S);
  // 4. history
  for (int i = 0; i < 6; ++i) h_np1[HISTORY_PLASTIC + i] = h_n[HISTORY_PLASTIC + i];
  if (r.plastic) {
    Vec3 be;                                           // of the elastic strains that are left, minus I
    for (int i = 0; i < 3; ++i) be(i) = std::expm1(2.0 * (e(i) - 1.5 * r.gamma * s(i) / r.q));
    const Mat3 change = n * be.asDiagonal() * n.transpose() - LL;
    const Mat3 half   = L.transpose().triangularView<Eigen::Upper>().solve(change);
    six(L.transpose().triangularView<Eigen::Upper>().solve(half.transpose()), h_np1 + HISTORY_PLASTIC);
  }
  if (!tangent) return true;
  // 5. tangent in principal directions                                               (2.27), (2.28)
  const double flow = flow_factor(law, r);
  double W[6][6], c[6][6] = {};                        // W: M_A (x) M_A and M_A (x) M_B + M_B (x) M_A
  for (int a = 0; a < 3; ++a) {
    six(M.col(a) * M.col(a).transpose(), W[a]);
    for (int b = 0; b < 3; ++b)
      c[a][b] = K + 2.0 * law.mu * r.beta * ((a == b) - 1.0 / 3.0) + flow * s(a) * s(b);
  }
  for (int k = 0; k < 3; ++k) {
    const int a = k, b = (k + 1) % 3;
    const double ba = 1.0 + x(a), bb = 1.0 + x(b);
    six(2.0 * M.col(a) * M.col(b).transpose(), W[3 + k]);
    c[3 + k][3 + k] = std::fabs(x(a) - x(b)) > EQUAL_STRETCH * (ba + bb)
                          ? (tau(a) * bb - tau(b) * ba) / (x(a) - x(b))
                          : 0.25 * (c[a][a] + c[b][b] - 2.0 * c[a][b]) - 0.5 * (tau(a) + tau(b));
  }
  for (int a = 0; a < 3; ++a) c[a][a] -= 2.0 * tau(a);
  for (int i = 0; i < 36; ++i) out.D[i] = 0.0;
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) {
      if (c[a][b] == 0.0) continue;
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) out.D[i * 6 + j] += c[a][b] * W[a][i] * W[b][j];
    }
  return true;
}
