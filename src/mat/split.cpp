#include "mat/split.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Eigenvalues>

#include "mat/voigt.h"

namespace {

using V = VoigtIndex<3>;

const double Id[6]   = {1, 1, 1, 0, 0, 0};

// C += w A (x) A; add_dyad and add_identity: no action if C is null
void add_dyad(double w, const double A[6], double* C)
{
  for (int m = 0; m < 6 && C; ++m)
    for (int n = 0; n < 6; ++n) C[6 * m + n] += w * A[m] * A[n];
}

void add_identity(double w, double* C)        // C += w times the identity of symmetric tensors
{
  for (int m = 0; m < 6 && C; ++m) C[7 * m] += m < 3 ? w : 0.5 * w;
}

// plane components -> six
void six_of(int dim, const double* E, double E6[6])
{
  if (dim == 2) six_components<2>(E, E6);
  else six_components<3>(E, E6);
}

// indices of the kernel components among the six
const int* seen_by(int dim)
{
  static const int plane[3] = {0, 1, 3}, space[6] = {0, 1, 2, 3, 4, 5};
  return dim == 2 ? plane : space;
}

// principal strains and, unless v is null, their unit vectors: closed form if 33 is a principal axis, else
// the iterative solver: the direct one of Eigen loses half of the digits near equal values.
void principal(const double E[6], double e[3], double (*v)[3])
{
  if (E[4] == 0.0 && E[5] == 0.0) {
    const double mean = 0.5 * (E[0] + E[1]), half = 0.5 * (E[0] - E[1]);
    const double radius = std::hypot(half, E[3]);
    e[0] = mean + radius;
    e[1] = mean - radius;
    e[2] = E[2];
    if (!v) return;
    const double angle = 0.5 * std::atan2(E[3], half), c = std::cos(angle), s = std::sin(angle);
    const double vectors[3][3] = {{c, s, 0}, {-s, c, 0}, {0, 0, 1}};
    std::copy(vectors[0], vectors[0] + 9, v[0]);
    return;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(
      full_tensor(E), v ? Eigen::ComputeEigenvectors : Eigen::EigenvaluesOnly);
  for (int a = 0; a < 3; ++a) {
    e[a] = solver.eigenvalues()[a];
    for (int i = 0; i < 3 && v; ++i) v[a][i] = solver.eigenvectors()(i, a);
  }
}

// the largest principal strain, by the trigonometric form of the roots; near a double root, where that loses
// half of the digits, by the solver
double largest_principal(const double E[6])
{
  const double mean = (E[0] + E[1] + E[2]) / 3.0, a = E[0] - mean, b = E[1] - mean, c = E[2] - mean;
  const double xx = E[3] * E[3], yy = E[4] * E[4], zz = E[5] * E[5];
  const double p  = std::sqrt((a * a + b * b + c * c + 2.0 * (xx + yy + zz)) / 6.0);
  const double det = a * (b * c - yy) - E[3] * (E[3] * c - E[4] * E[5]) + E[5] * (E[3] * E[4] - b * E[5]);
  const double r  = 0.5 * det / (p * p * p);
  if (r > -0.9) return mean + 2.0 * p * std::cos(std::acos(std::min(r, 1.0)) / 3.0);
  double e[3];
  principal(E, e, nullptr);
  return std::max({e[0], e[1], e[2]});
}

// the intact law (2.1) in three dimensions, added to psi, S and, unless it is null, C
void add_intact(const MatLaw& law, const double E[6], double& psi, double S[6], double* C)
{
  const double tr = E[0] + E[1] + E[2];
  psi += 0.5 * law.lam3 * tr * tr + law.mu * six_dot(E, E);
  for (int m = 0; m < 6; ++m) S[m] += law.lam3 * tr * Id[m] + 2.0 * law.mu * E[m];
  add_dyad(law.lam3, Id, C);
  add_identity(2.0 * law.mu, C);
}

// the other part: intact law minus this part
void add_rest(const MatLaw& law, const double E[6], double psi, const double S[6], const double* C,
              double& psi_rest, double S_rest[6], double* C_rest)
{
  add_intact(law, E, psi_rest, S_rest, C_rest);
  psi_rest -= psi;
  for (int m = 0; m < 6; ++m) S_rest[m] -= S[m];
  for (int m = 0; m < 36 && C; ++m) C_rest[m] -= C[m];
}

// representative crack element                                                       (2.6), (2.7)
void split_rce(const MatLaw& law, const double E[6], const double N[3], SplitOut& o)
{
  const double mu = law.mu, M = law.lam3 + 2.0 * mu, p = law.lam3 * (E[0] + E[1] + E[2]);
  double A[3][3];
  full_tensor<3>(E, A[0]);
  double tau[3], sn = 0.0, G[6];
  for (int i = 0; i < 3; ++i) {
    tau[i] = p * N[i] + 2.0 * mu * (A[i][0] * N[0] + A[i][1] * N[1] + A[i][2] * N[2]);
    sn += tau[i] * N[i];
  }
  for (int i = 0; i < 3; ++i) tau[i] -= sn * N[i];
  const bool open = sn > 0.0;
  for (int m = 0; m < 6; ++m) {
    const int i = V::row[m], j = V::col[m];
    G[m]    = law.lam3 * Id[m] + 2.0 * mu * N[i] * N[j];
    o.Sp[m] = N[i] * tau[j] + tau[i] * N[j] + (open ? sn / M * G[m] : 0.0);
  }
  o.psi_plus = 0.5 * (tau[0] * tau[0] + tau[1] * tau[1] + tau[2] * tau[2]) / mu +
               (open ? 0.5 * sn * sn / M : 0.0);
  auto P = [N](int i, int j) { return (i == j) - N[i] * N[j]; };
  double *Cp = o.of_plus(), *Cm = o.of_minus();
  for (int m = 0; m < 6 && Cp; ++m)
    for (int n = 0; n < 6; ++n) {
      const int i = V::row[m], j = V::col[m], k = V::row[n], l = V::col[n];
      Cp[6 * m + n] = mu * (N[i] * N[k] * P(j, l) + N[i] * N[l] * P(j, k) + N[j] * N[k] * P(i, l) +
                            N[j] * N[l] * P(i, k));
    }
  if (open) add_dyad(1.0 / M, G, Cp);
  add_rest(law, E, o.psi_plus, o.Sp, Cp, o.psi_minus, o.Sm, Cm);
}

// volumetric - deviatoric                                                                  (2.8)
void split_vd(const MatLaw& law, const double E[6], SplitOut& o)
{
  const double K = bulk_modulus(law), tr = E[0] + E[1] + E[2];
  double dev[6];
  for (int m = 0; m < 6; ++m) dev[m] = E[m] - tr / 3.0 * Id[m];
  (tr > 0.0 ? o.psi_plus : o.psi_minus) = 0.5 * K * tr * tr;
  o.psi_plus += law.mu * six_dot(dev, dev);
  for (int m = 0; m < 6; ++m) {
    (tr > 0.0 ? o.Sp : o.Sm)[m] = K * tr * Id[m];
    o.Sp[m] += 2.0 * law.mu * dev[m];
  }
  add_dyad(K, Id, tr > 0.0 ? o.of_plus() : o.of_minus());
  add_identity(2.0 * law.mu, o.of_plus());
  add_dyad(-2.0 / 3.0 * law.mu, Id, o.of_plus());
}

// spectral                                                                                 (2.9)
void split_spectral(const MatLaw& law, const double E[6], SplitOut& o)
{
  const double tr = E[0] + E[1] + E[2];
  double e[3], v[3][3], vv[6], *Cp = o.of_plus(), *Cm = o.of_minus();
  principal(E, e, v);
  (tr > 0.0 ? o.psi_plus : o.psi_minus) = 0.5 * law.lam3 * tr * tr;
  for (int m = 0; m < 6; ++m) (tr > 0.0 ? o.Sp : o.Sm)[m] = law.lam3 * tr * Id[m];
  add_dyad(law.lam3, Id, tr > 0.0 ? Cp : Cm);
  for (int a = 0; a < 3; ++a) {
    const bool plus = e[a] > 0.0;
    (plus ? o.psi_plus : o.psi_minus) += law.mu * e[a] * e[a];
    for (int m = 0; m < 6; ++m) vv[m] = v[a][V::row[m]] * v[a][V::col[m]];
    for (int m = 0; m < 6; ++m) (plus ? o.Sp : o.Sm)[m] += 2.0 * law.mu * e[a] * vv[m];
    add_dyad(2.0 * law.mu, vv, plus ? Cp : Cm);
    for (int b = 0; b < a && Cp; ++b) {
      for (int m = 0; m < 6; ++m)
        vv[m] = v[a][V::row[m]] * v[b][V::col[m]] + v[b][V::row[m]] * v[a][V::col[m]];
      const double hi = std::max(e[a], e[b]), lo = std::min(e[a], e[b]);
      const double theta = hi <= 0.0 ? 0.0 : lo >= 0.0 ? 1.0 : hi / (hi - lo);
      add_dyad(law.mu * theta, vv, Cp);
      add_dyad(law.mu * (1.0 - theta), vv, Cm);
    }
  }
}

// j = J - 1 (finite) or tr E, gradient G and second derivative D, unless null; D needs G; false: 2E + I is
// not positive definite
bool volume(bool finite, const double E[6], double& j, double* G, double* D)
{
  const double I1 = E[0] + E[1] + E[2];
  j = I1;
  if (D) std::fill(D, D + 36, 0.0);
  if (G) {
    // not std::copy(Id, Id + 6, G): GCC 12.2 with AVX-512 copies the constants 1 1 1 0 as 1 1 1 1 (-O1; -O2
    // if not inlined), and broken material would bear shear (test: Split.PressureBearsNoShear)
    for (int m = 0; m < 6; ++m) G[m] = Id[m];
  }
  if (!finite) return true;
  const double c11 = 1.0 + 2.0 * E[0], c22 = 1.0 + 2.0 * E[1], c33 = 1.0 + 2.0 * E[2];
  const double c12 = 2.0 * E[3], c23 = 2.0 * E[4], c31 = 2.0 * E[5];
  // det C - 1 from the invariants of E, without cancellation at small strains
  const double I2 = E[0] * E[1] + E[1] * E[2] + E[2] * E[0] - E[3] * E[3] - E[4] * E[4] - E[5] * E[5];
  const double I3 = E[0] * (E[1] * E[2] - E[4] * E[4]) - E[3] * (E[3] * E[2] - E[4] * E[5]) +
                    E[5] * (E[3] * E[4] - E[1] * E[5]);
  const double det1 = 2.0 * I1 + 4.0 * I2 + 8.0 * I3, det = 1.0 + det1;
  if (!(c11 > 0.0 && c11 * c22 - c12 * c12 > 0.0 && det > 0.0)) return false;
  const double J = std::sqrt(det);
  j = det1 / (1.0 + J);
  if (!G) return true;
  const double inv[3][3] = {
    {(c22 * c33 - c23 * c23) / det, (c31 * c23 - c12 * c33) / det, (c12 * c23 - c31 * c22) / det},
    {(c31 * c23 - c12 * c33) / det, (c11 * c33 - c31 * c31) / det, (c12 * c31 - c11 * c23) / det},
    {(c12 * c23 - c31 * c22) / det, (c12 * c31 - c11 * c23) / det, (c11 * c22 - c12 * c12) / det}};
  for (int m = 0; m < 6; ++m) {
    const int a = V::row[m], b = V::col[m];
    G[m] = J * inv[a][b];
    for (int n = 0; n < 6 && D; ++n) {
      const int k = V::row[n], l = V::col[n];
      D[6 * m + n] = J * (inv[a][b] * inv[k][l] - inv[a][k] * inv[b][l] - inv[a][l] * inv[b][k]);
    }
  }
  return true;
}

// j = change of the thickness of the crack, h - 1 with h^2 = 1/(N.C^-1 N) (finite) or N.E.N, gradient G and
// second derivative D, unless null; D needs G; false: C = 2E + I is not positive definite (2.18)
bool thickness(bool finite, const double E[6], const double N[3], double& j, double* G, double* D)
{
  double NN[6];
  for (int m = 0; m < 6; ++m) NN[m] = N[V::row[m]] * N[V::col[m]];
  j = six_dot(NN, E);
  if (D) std::fill(D, D + 36, 0.0);
  if (G) std::copy(NN, NN + 6, G);
  if (!finite) return true;
  const double cof[6] = {E[1] * E[2] - E[4] * E[4], E[0] * E[2] - E[5] * E[5], E[0] * E[1] - E[3] * E[3],
                         E[5] * E[4] - E[3] * E[2], E[3] * E[5] - E[0] * E[4], E[3] * E[4] - E[5] * E[1]};
  const double I1 = E[0] + E[1] + E[2], I2 = cof[0] + cof[1] + cof[2],
               I3 = E[0] * cof[0] + E[3] * cof[3] + E[5] * cof[5], NcofN = six_dot(NN, cof);
  const double det = 1.0 + 2.0 * I1 + 4.0 * I2 + 8.0 * I3, area2 = 1.0 + 2.0 * (I1 - j) + 4.0 * NcofN;
  const double c11 = 1.0 + 2.0 * E[0], c22 = 1.0 + 2.0 * E[1], c12 = 2.0 * E[3];
  if (!(c11 > 0.0 && c11 * c22 - c12 * c12 > 0.0 && det > 0.0)) return false;
  const double h = std::sqrt(det / area2);
  j = (2.0 * j + 4.0 * (I2 - NcofN) + 8.0 * I3) / area2 / (1.0 + h);       // h - 1 without cancellation
  if (!G) return true;
  double inv[3][3], a[3];                            // C^-1 and C^-1 N
  for (int m = 0; m < 6; ++m) {
    const int r = V::row[m], s = V::col[m];
    inv[r][s] = inv[s][r] = ((1.0 + 2.0 * I1) * Id[m] - 2.0 * E[m] + 4.0 * cof[m]) / det;
  }
  for (int i = 0; i < 3; ++i) a[i] = inv[i][0] * N[0] + inv[i][1] * N[1] + inv[i][2] * N[2];
  const double h3 = h * h * h, h5 = h3 * h * h;
  for (int m = 0; m < 6; ++m) {
    const int r = V::row[m], s = V::col[m];
    G[m] = h3 * a[r] * a[s];
    for (int k = 0; k <= m && D; ++k) {
      const int t = V::row[k], u = V::col[k];
      D[6 * m + k] = D[6 * k + m] = 3.0 * h5 * a[r] * a[s] * a[t] * a[u] -
                                    h3 * ((inv[r][t] * a[u] + inv[r][u] * a[t]) * a[s] +
                                          (inv[s][t] * a[u] + inv[s][u] * a[t]) * a[r]);
    }
  }
  return true;
}

// keeps what M j^2/2 stores where j < 0, and releases the rest                       (2.10), (2.18)
//   in   measure   j with gradient and second derivative, unless null; false: E is not admissible
template <class Measure>
void split_closed(const MatLaw& law, double M, const double E[6], Measure measure, SplitOut& o)
{
  double j, G[6], D[36], *Cp = o.of_plus(), *Cm = o.of_minus();
  if (!measure(j, nullptr, nullptr)) {
    o.psi_plus = o.psi_minus = std::numeric_limits<double>::quiet_NaN();
    return;
  }
  if (!(j > 0.0)) {
    measure(j, G, Cm ? D : nullptr);
    o.psi_minus = 0.5 * M * j * j;
    for (int m = 0; m < 6; ++m) o.Sm[m] = M * j * G[m];
    for (int m = 0; m < 36 && Cm; ++m) Cm[m] = M * j * D[m];
    add_dyad(M, G, Cm);
  }
  add_rest(law, E, o.psi_minus, o.Sm, Cm, o.psi_plus, o.Sp, Cp);
}

// pressure in compression                                                                 (2.10)
void split_pressure(const MatLaw& law, bool finite, const double E[6], SplitOut& o)
{
  split_closed(law, bulk_modulus(law), E,
               [&](double& j, double* G, double* D) { return volume(finite, E, j, G, D); }, o);
}

// normal pressure on the crack only                                                        (2.18)
void split_crack(const MatLaw& law, bool finite, const double E[6], const double N[3], SplitOut& o)
{
  split_closed(law, law.lam + 2.0 * law.mu, E,
               [&](double& j, double* G, double* D) { return thickness(finite, E, N, j, G, D); }, o);
}

// plane stress (2.13): E33 from c S33+ + S33- = 0, and the law there. S33 of every split is a concave
// increasing function of E33, and the intact E33 lies below the root, so that Newton's method converges from
// below
void release_thickness(const MatLaw& law, Split split, bool finite, double c, const double N[3], double E[6],
                       SplitOut& o)
{
  const bool has_floor = finite && split == SPLIT_PRESSURE && c < 1.0;     // a root with E33 > -1/2 exists
  E[2] = -law.lam3 / (law.lam3 + 2.0 * law.mu) * (E[0] + E[1]);
  if (has_floor && E[2] <= -0.5) E[2] = -0.25;
  for (int it = 0; it < 50; ++it) {
    split_full(law, split, finite, E, N, o);
    const double S33 = c * o.Sp[2] + o.Sm[2];
    if (S33 == 0.0 || std::isnan(o.psi_plus)) return;
    double next = E[2] - S33 / (c * o.Cp[14] + o.Cm[14]);
    if (has_floor && next <= -0.5) next = 0.5 * (E[2] - 0.5);
    const double step = next - E[2], size = std::max({std::fabs(E[0]), std::fabs(E[1]), std::fabs(E[2])});
    E[2] = next;
    // converged to round-off
    if (std::fabs(step) <= 1e-14 * size) break;
  }
  split_full(law, split, finite, E, N, o);
}

}  // namespace

void split_full(const MatLaw& law, Split split, bool finite, const double E[6], const double N[3],
                SplitOut& out, bool tangent)
{
  out = SplitOut{};
  out.tangent = tangent;
  switch (split) {
    case SPLIT_RCE:      split_rce(law, E, N, out); break;
    case SPLIT_VD:       split_vd(law, E, out); break;
    case SPLIT_SPECTRAL: split_spectral(law, E, out); break;
    case SPLIT_PRESSURE: split_pressure(law, finite, E, out); break;
    case SPLIT_CRACK:    split_crack(law, finite, E, N, out); break;
    case SPLIT_NONE:     add_intact(law, E, out.psi_plus, out.Sp, out.of_plus()); break;
    case SPLIT_GRANULAR: break;          // has a history: law_granular
  }
}

double split_normal(const MatLaw& law, int dim, const double* E, double* N)
{
  double E6[6], e[3], v[3][3];
  six_of(dim, E, E6);
  if (!N && dim == 3)
    return law.lam * (E6[0] + E6[1] + E6[2]) + 2.0 * law.mu * largest_principal(E6);
  principal(E6, e, N ? v : nullptr);
  const int a = static_cast<int>(std::max_element(e, e + dim) - e);      // in 2D e[2] belongs to 33
  if (N) std::copy(v[a], v[a] + 3, N);
  return law.lam * (E6[0] + E6[1] + E6[2]) + 2.0 * law.mu * e[a];
}

double split_drive(const MatLaw& law, int dim, Split split, bool finite, const double* E)
{
  if (split == SPLIT_RCE) {                  // no shear stress on the principal plane      (2.11)
    const double s = split_normal(law, dim, E, nullptr);
    return s > 0.0 ? 0.5 * s * s / (law.lam + 2.0 * law.mu) : 0.0;
  }
  const double none[3] = {0, 0, 0};
  double E6[6], S6[6];
  SplitOut o;
  six_of(dim, E, E6);
  mat_full(law, dim, E6, S6);
  split_full(law, split, finite, E6, none, o, false);
  return o.psi_plus;
}

void split_eroded(const MatLaw& law, int dim, Split split, bool finite, double c, const double* E,
                  const double N[3], double* psi, double* S, double* C)
{
  const int nv = dim == 2 ? 3 : 6, *seen = seen_by(dim);
  const bool release = dim == 2 && law.plane == PLANE_STRESS;
  double E6[6];
  SplitOut o;
  six_of(dim, E, E6);
  if (release) release_thickness(law, split, finite, c, N, E6, o);
  else split_full(law, split, finite, E6, N, o, C != nullptr);

  *psi = c * o.psi_plus + o.psi_minus;
  for (int m = 0; m < nv; ++m) {
    const int k = seen[m], i = V::row[k], j = V::col[k];
    S[dim * i + j] = S[dim * j + i] = c * o.Sp[k] + o.Sm[k];
  }
  if (!C) return;
  double D[36];
  for (int m = 0; m < 36; ++m) D[m] = c * o.Cp[m] + o.Cm[m];
  for (int m = 0; m < nv; ++m)
    for (int n = 0; n < nv; ++n) {
      const int k = seen[m], l = seen[n];
      C[nv * m + n] = D[6 * k + l];
      if (release && D[14] > 0.0) C[nv * m + n] -= D[6 * k + 2] * D[12 + l] / D[14];
    }
}

bool split_has_kink(const MatLaw& law, Split split)
{
  return split == SPLIT_CRACK ||
         (law.plane != PLANE_STRESS && (split == SPLIT_RCE || split == SPLIT_VD || split == SPLIT_PRESSURE));
}

bool split_kink(const MatLaw& law, int dim, Split split, bool finite, double c, const double* E,
                const double N[3], int order, SplitKink& kink)
{
  const int nv = dim == 2 ? 3 : 6, *seen = seen_by(dim);
  double E6[6], G6[6], D6[36] = {0};
  double *G = order > 0 ? G6 : nullptr, *D = order > 1 ? D6 : nullptr;
  six_of(dim, E, E6);
  if (split == SPLIT_RCE) {
    for (int m = 0; m < 6; ++m) G6[m] = law.lam3 * Id[m] + 2.0 * law.mu * N[V::row[m]] * N[V::col[m]];
    kink.j    = six_dot(G6, E6);
    kink.side = 1;
    kink.w    = -(1.0 - c) / (law.lam3 + 2.0 * law.mu);
  } else if (split == SPLIT_CRACK) {
    if (!thickness(finite, E6, N, kink.j, G, D)) return false;
    kink.side = -1;
    kink.w    = (1.0 - c) * (law.lam + 2.0 * law.mu);
  } else {
    if (!volume(finite && split == SPLIT_PRESSURE, E6, kink.j, G, D)) return false;
    kink.side = -1;
    kink.w    = (1.0 - c) * bulk_modulus(law);
  }
  for (int m = 0; m < nv && order > 0; ++m) {
    const int i = V::row[seen[m]], k = V::col[seen[m]];
    kink.G[dim * i + k] = kink.G[dim * k + i] = G6[seen[m]];
    for (int n = 0; n < nv && order > 1; ++n) kink.D[nv * m + n] = D6[6 * seen[m] + seen[n]];
  }
  return true;
}
