#include "mat/hencky.h"

#include <algorithm>
#include <cmath>

#include "mat/voigt.h"

namespace {

using Mat3 = Eigen::Matrix3d;
using Vec3 = Eigen::Vector3d;

// relative difference of squares of stretches, below which the limit is taken (2.28): the quotient has lost
// half of its digits  (no test)
const double EQUAL_STRETCH = 1e-6;

void six(const Mat3& M, double* a)
{
  a[0] = M(0, 0);
  a[1] = M(1, 1);
  a[2] = M(2, 2);
  a[3] = 0.5 * (M(0, 1) + M(1, 0));
  a[4] = 0.5 * (M(1, 2) + M(2, 1));
  a[5] = 0.5 * (M(2, 0) + M(0, 2));
}

// l of the Cholesky factor I + l of I + 2 E, without cancellation at small strains
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

// L^-T A, a quarter of the time of Eigen's triangular solution
Mat3 back(const Mat3& L, const Mat3& A)
{
  Mat3 X;
  X.row(2) = A.row(2) / L(2, 2);
  X.row(1) = (A.row(1) - L(2, 1) * X.row(2)) / L(1, 1);
  X.row(0) = (A.row(0) - L(1, 0) * X.row(1) - L(2, 0) * X.row(2)) / L(0, 0);
  return X;
}

}  // namespace

bool hencky_trial(const double* E, const double* h_n, HenckyTrial& t)
{
  Mat3 l;
  if (!cholesky(E, l)) return false;
  t.L  = Mat3::Identity() + l;
  t.LL = l + l.transpose() + l.transpose() * l;
  Mat3 X = t.LL;                                       // be - I
  if (std::any_of(h_n + FLOW_DEFORMATION, h_n + FLOW_DEFORMATION + 6, [](double x) { return x != 0.0; }))
    X += t.L.transpose() * full_tensor(h_n + FLOW_DEFORMATION) * t.L;
  const Eigen::SelfAdjointEigenSolver<Mat3> spectrum(X);
  t.x = spectrum.eigenvalues();
  t.n = spectrum.eigenvectors();
  if (!(t.x.minCoeff() > -1.0)) return false;
  for (int i = 0; i < 3; ++i) t.e(i) = 0.5 * std::log1p(t.x(i));
  t.M = back(t.L, t.n);
  return true;
}

void hencky_small(const double* E, const double* h_n, HenckyTrial& t)
{
  t.finite = false;
  t.L.setIdentity();
  t.LL = 2.0 * full_tensor(E);
  const Eigen::SelfAdjointEigenSolver<Mat3> spectrum(t.LL + full_tensor(h_n + FLOW_DEFORMATION));
  t.x = spectrum.eigenvalues();
  t.e = 0.5 * t.x;
  t.n = t.M = spectrum.eigenvectors();
}

void hencky_stress(const HenckyTrial& t, const Vec3& tau, double* S)
{
  six(t.M * tau.asDiagonal() * t.M.transpose(), S);
}

void hencky_flow(const HenckyTrial& t, const Vec3& e, double* h_np1)
{
  Vec3 be;                                             // minus I
  for (int i = 0; i < 3; ++i) be(i) = t.finite ? std::expm1(2.0 * e(i)) : 2.0 * e(i);
  const Mat3 change = t.n * be.asDiagonal() * t.n.transpose() - t.LL;
  six(back(t.L, back(t.L, change).transpose()), h_np1 + FLOW_DEFORMATION);
}

Mat3 principal_moduli(const Moduli& c, const Vec3& s)
{
  Mat3 of;
  for (int a = 0; a < 3; ++a)
    for (int b = 0; b < 3; ++b)
      of(a, b) = c.bulk + c.dev * ((a == b) - 1.0 / 3.0) + c.flow * s(a) * s(b) + c.mixed * (s(a) + s(b));
  return of;
}

void hencky_tangent(const HenckyTrial& t, const Vec3& tau, const Vec3& s, const Moduli& moduli, double* D)
{
  hencky_tangent(t, tau, principal_moduli(moduli, s), D);
}

void hencky_tangent(const HenckyTrial& t, const Vec3& tau, const Mat3& of, double* D, double most)
{
  const double finite = t.finite ? 1.0 : 0.0;
  double W[6][6], c[6][6] = {};                        // W: M_A (x) M_A and M_A (x) M_B + M_B (x) M_A
  for (int a = 0; a < 3; ++a) {
    six(t.M.col(a) * t.M.col(a).transpose(), W[a]);
    for (int b = 0; b < 3; ++b) c[a][b] = of(a, b) - (a == b ? 2.0 * finite * tau(a) : 0.0);
  }
  for (int k = 0; k < 3; ++k) {
    const int a = k, b = (k + 1) % 3;
    const double ba = 1.0 + finite * t.x(a), bb = 1.0 + finite * t.x(b), d = t.x(a) - t.x(b);
    six(2.0 * t.M.col(a) * t.M.col(b).transpose(), W[3 + k]);
    c[3 + k][3 + k] = std::fabs(d) > EQUAL_STRETCH * (ba + bb)
                          ? std::clamp((tau(a) * bb - tau(b) * ba) / d, -most, most)
                          : 0.25 * (of(a, a) + of(b, b) - 2.0 * of(a, b)) - 0.5 * finite * (tau(a) + tau(b));
  }
  for (int i = 0; i < 36; ++i) D[i] = 0.0;
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) {
      if (c[a][b] == 0.0) continue;
      for (int i = 0; i < 6; ++i)
        for (int j = 0; j < 6; ++j) D[i * 6 + j] += c[a][b] * W[a][i] * W[b][j];
    }
}

SmallTrial small_trial(const MatLaw& law, const double* E, const double* h_n)
{
  SmallTrial t;
  double e[6];
  for (int i = 0; i < 6; ++i) e[i] = E[i] + 0.5 * h_n[FLOW_DEFORMATION + i];
  t.tr = e[0] + e[1] + e[2];
  t.ss = 0.0;
  for (int i = 0; i < 6; ++i) {
    t.s[i] = 2.0 * law.mu * (e[i] - (i < 3 ? t.tr / 3.0 : 0.0));
    t.ss += t.s[i] * t.s[i] * (i < 3 ? 1.0 : 2.0);
  }
  return t;
}

void small_flow(const SmallTrial& t, double w, const double* h_n, double* h_np1)
{
  for (int i = 0; i < 6; ++i) h_np1[FLOW_DEFORMATION + i] = h_n[FLOW_DEFORMATION + i] - 2.0 * w * t.s[i];
}

void small_tangent(const SmallTrial& t, const Moduli& c, double* D)
{
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) {
      const double dev = (i == j ? (i < 3 ? 1.0 : 0.5) : 0.0) - (i < 3 && j < 3 ? 1.0 / 3.0 : 0.0);
      D[i * 6 + j] = (i < 3 && j < 3 ? c.bulk : 0.0) + c.dev * dev + c.flow * t.s[i] * t.s[j] +
                     c.mixed * (t.s[i] * (j < 3) + t.s[j] * (i < 3)) +
                     c.skew * (t.s[i] * (j < 3) - t.s[j] * (i < 3));
    }
}
