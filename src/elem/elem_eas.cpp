// ---------------------------------------------------------------------------
// elem_eas.cpp : quadrilateral and brick with enhanced strains (doc/theory.md 1, enhanced strains)
//
// The strain is E + sum_k M_k alpha_k. The St.Venant-Kirchhoff energy is quadratic in it, so its minimum over
// alpha is a linear function of the strains of the element: no iteration, no variable stored from step to
// step, and the energy-momentum scheme stays exact. The modes have zero mean, so the patch test holds.
// ---------------------------------------------------------------------------
#include <Eigen/Dense>

#include "elem/elem.h"
#include "shape/shape.h"

namespace {

// modes in local coordinates: strain component (i, j) times local coordinate k
struct Mode { int i, j, k; };
const Mode modes2[4] = {{0, 0, 0}, {1, 1, 1}, {0, 1, 0}, {0, 1, 1}};
const Mode modes3[9] = {{0, 0, 0}, {1, 1, 1}, {2, 2, 2}, {0, 1, 0}, {0, 1, 1},
                        {1, 2, 1}, {1, 2, 2}, {0, 2, 0}, {0, 2, 2}};

constexpr int mode_count(int dim) { return dim == 2 ? 4 : 9; }

// M_k at Gauss point g
inline const double* mode_at(const double* eas, int dim, int g, int k)
{
  return eas + (g * mode_count(dim) + k) * dim * dim;
}

// (sum_g w M : D : M)^-1, stored after the modes
inline const double* inverse_at(const double* eas, int dim, int ngp) { return mode_at(eas, dim, ngp, 0); }

template <int D>
double contract(const double* A, const double* B)
{
  double sum = 0.0;
  for (int k = 0; k < D * D; ++k) sum += A[k] * B[k];
  return sum;
}

// alpha = -H^-1 sum_g w M_g : D : E_g                                               (1.11)
template <int D>
void amplitudes(const double* eas, int ngp, const double* w, const MatLaw& law, const double* E,
                double* alpha)
{
  constexpr int n = mode_count(D);
  double r[n] = {0}, S[D * D];
  for (int g = 0; g < ngp; ++g) {
    ip_law<D>(law, E + g * D * D, S);
    for (int k = 0; k < n; ++k) r[k] += w[g] * contract<D>(mode_at(eas, D, g, k), S);
  }
  const double* inv = inverse_at(eas, D, ngp);
  for (int k = 0; k < n; ++k) {
    alpha[k] = 0.0;
    for (int l = 0; l < n; ++l) alpha[k] -= inv[k * n + l] * r[l];
  }
}

template <int D>
void setup(Shape s, const double* X, const double* w, const MatLaw& law, double* out)
{
  constexpr int n = mode_count(D);
  using Mat = Eigen::Matrix<double, D, D>;
  const int nen         = shape_info[s].nen;
  const GaussRule& rule = gauss_rule(s);
  const Mode* mode      = D == 2 ? modes2 : modes3;
  double N[8], dN[24];
  auto jacobian = [&](const double* xi) {
    Mat J = Mat::Zero();
    shape_eval(s, xi, N, dN);
    for (int a = 0; a < nen; ++a)
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) J(i, j) += X[a * D + i] * dN[a * D + j];
    return J;
  };
  const double centre[3] = {0, 0, 0};
  const Mat J0 = jacobian(centre), T = J0.inverse();
  Eigen::Matrix<double, n, n> H = Eigen::Matrix<double, n, n>::Zero();
  for (int g = 0; g < rule.n; ++g) {
    const double scale = J0.determinant() / jacobian(rule.xi[g]).determinant();
    double S[n][D * D];
    for (int k = 0; k < n; ++k) {
      Mat local = Mat::Zero();
      local(mode[k].i, mode[k].j) = local(mode[k].j, mode[k].i) = rule.xi[g][mode[k].k];
      const Mat M = scale * T.transpose() * local * T;                              // (1.10)
      double* m   = out + (g * n + k) * D * D;
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) m[i * D + j] = M(i, j);
      ip_law<D>(law, m, S[k]);
    }
    for (int k = 0; k < n; ++k)
      for (int l = 0; l < n; ++l) H(k, l) += w[g] * contract<D>(mode_at(out, D, g, k), S[l]);
  }
  const Eigen::Matrix<double, n, n> inv = H.inverse();
  double* at = out + rule.n * n * D * D;
  for (int k = 0; k < n; ++k)
    for (int l = 0; l < n; ++l) at[k * n + l] = inv(k, l);
}

// L_k += w Fb (D : M_k) dN_a/dX                                                    (1.12)
template <int D, int N>
void add_coupling(const double* eas, int g, const MatLaw& law, double w, const double* Fb, const double* dN,
                  double* L)
{
  for (int k = 0; k < mode_count(D); ++k) {
    double S[D * D], P[D * D];
    ip_law<D>(law, mode_at(eas, D, g, k), S);
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j) {
        P[i * D + j] = 0.0;
        for (int l = 0; l < D; ++l) P[i * D + j] += w * Fb[i * D + l] * S[l * D + j];
      }
    for (int a = 0; a < N; ++a)
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) L[(k * N + a) * D + i] += P[i * D + j] * dN[a * D + j];
  }
}

// ke -= cD L^T H^-1 L                                                              (1.13)
template <int D, int N>
void condense(const double* inv, double cD, const double* L, double* ke)
{
  constexpr int n = mode_count(D);
  double IL[n * N * D];
  for (int k = 0; k < n; ++k)
    for (int q = 0; q < N * D; ++q) {
      double sum = 0.0;
      for (int l = 0; l < n; ++l) sum += inv[k * n + l] * L[l * N * D + q];
      IL[k * N * D + q] = cD * sum;
    }
  for (int a = 0; a < N; ++a)
    for (int b = 0; b <= a; ++b)
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
          double sum = 0.0;
          for (int k = 0; k < n; ++k) sum += L[(k * N + a) * D + i] * IL[(k * N + b) * D + j];
          ke[pair_index(a, b) * D * D + i * D + j] -= sum;
        }
}

//   in   S0   initial stresses [NGP][D*D], which work on the compatible strain alone; null: none   (2.46)
template <int D, int N, int NGP>
Status form_start(const ElemBlock& b, size_t slot, const KernelMode& mode, const double* u0, const double* u1,
                  const double* S0, double* re, double* ke)
{
  constexpr int n = mode_count(D), DD = D * D;
  const size_t first = b.gauss(slot);
  const double *dNdX = &b.dNdX[first * N * D], *w = &b.w[first],
               *eas = &b.eas[b.kind[slot] * eas_size(b.shape)];
  const KernelMode of_law = mode_of_law(mode, b.law);
  double Fb[NGP * DD], E[NGP * DD], alpha[n], L[n * N * D] = {0}, det_min = 1.0;
  for (int k = 0; k < N * D; ++k) re[k] = 0.0;
  if (ke)
    for (int k = 0; k < pair_count(N) * DD; ++k) ke[k] = 0.0;
  // 1. strains of all Gauss points, and amplitudes of the enhanced modes
  for (int g = 0; g < NGP; ++g) {
    double H0[DD] = {0}, H1[DD];
    ip_gradient<D, N>(dNdX + g * N * D, N, u1, H1);
    if (mode_reads_old(mode, b.law)) ip_gradient<D, N>(dNdX + g * N * D, N, u0, H0);
    const double det = ip_kinematics<D>(of_law, H0, H1, Fb + g * DD, E + g * DD);
    det_min          = det < det_min ? det : det_min;
  }
  amplitudes<D>(eas, NGP, w, b.law, E, alpha);
  // 2. force and tangent with the enhanced strain
  for (int g = 0; g < NGP; ++g) {
    const double* dN = dNdX + g * N * D;
    double S[DD], f[N * D];
    for (int k = 0; k < n; ++k)
      for (int i = 0; i < DD; ++i) E[g * DD + i] += alpha[k] * mode_at(eas, D, g, k)[i];
    ip_law<D>(b.law, E + g * DD, S);
    for (int i = 0; i < DD && S0; ++i) S[i] += S0[g * DD + i];
    ip_force<D, N>(dN, N, w[g], Fb + g * DD, S, re);
    if (!ke) continue;
    ip_tangent<D, N>(dN, N, w[g], b.law, mode, Fb + g * DD, S, f, ke);
    add_coupling<D, N>(eas, g, b.law, w[g], Fb + g * DD, dN, L);
  }
  if (ke) condense<D, N>(inverse_at(eas, D, NGP), of_law.cD(), L, ke);
  return det_min > 0.0 ? STATUS_OK : BAD_JACOBIAN;
}

template <int D, int N, int NGP>
Status form(const ElemBlock& b, size_t slot, const KernelMode& mode, const double* u0, const double* u1,
            double* re, double* ke)
{
  return form_start<D, N, NGP>(b, slot, mode, u0, u1, nullptr, re, ke);
}

template <int D>
void strain(const double* eas, int ngp, const double* w, const MatLaw& law, const double* E, int g,
            double* out)
{
  double alpha[mode_count(D)];
  amplitudes<D>(eas, ngp, w, law, E, alpha);
  for (int i = 0; i < D * D; ++i) {
    out[i] = 0.0;
    for (int k = 0; k < mode_count(D); ++k) out[i] += alpha[k] * mode_at(eas, D, g, k)[i];
  }
}

}  // namespace

int eas_size(Shape s)
{
  const int dim = shape_info[s].dim, n = mode_count(dim);
  return shape_info[s].ngp * n * dim * dim + n * n;
}

void eas_setup(Shape s, const double* X, const double* w, const MatLaw& law, double* out)
{
  if (shape_info[s].dim == 2) setup<2>(s, X, w, law, out);
  else setup<3>(s, X, w, law, out);
}

void eas_strain(Shape s, const double* eas, const double* w, const MatLaw& law, const double* E, int g,
                double* out)
{
  if (shape_info[s].dim == 2) strain<2>(eas, shape_info[s].ngp, w, law, E, g, out);
  else strain<3>(eas, shape_info[s].ngp, w, law, E, g, out);
}

ElemForm eas_form(Shape s) { return s == SHAPE_QUAD4 ? form<2, 4, 4> : form<3, 8, 8>; }

ElemFormStart eas_form_start(Shape s)
{
  return s == SHAPE_QUAD4 ? form_start<2, 4, 4> : form_start<3, 8, 8>;
}
