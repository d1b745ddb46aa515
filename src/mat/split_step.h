// ---------------------------------------------------------------------------
// split_step.h : stress of broken material without history over a step: the discrete gradients (2.14), (2.17)
// of psi = c psi+ + psi- (doc/theory.md 2.2)
//
// The energy-momentum scheme uses the discrete gradient, so that the energy of the law is exact for any
// strain increment:
//
//   S = S(Em) + a dE,  a = [psi(n+1) - psi(n) - S(Em) : dE] / (dE : dE),  Em the middle strain      (2.14)
//   D = 1/2 C(Em) + a I + sym(dE (x) da/dE),  the symmetric part of its derivative                  (2.15)
//
// RCE, VD and PRESSURE have a kink in one variable j (normal stress of the crack, change of volume):
//
//   S = S(Em) + [q - f'(j(Em))] G(Em) + a dE,  q = [f(j(n+1)) - f(j(n))] / [j(n+1) - j(n)],  G = dj/dE (2.17)
// ---------------------------------------------------------------------------
#ifndef MPFE_MAT_SPLIT_STEP_H
#define MPFE_MAT_SPLIT_STEP_H

#include <algorithm>
#include <cmath>

#include "mat/split.h"
#include "mat/voigt.h"

// the step of the strains E0 -> E1 [D*D]
template <int D>
struct StrainStep {
  double mid[D * D], d[D * D], dd = 0.0;             // middle, difference, its square
  bool small = true;                                 // the middle stress is exact to round-off
  StrainStep(const double* E0, const double* E1)
  {
    double mm = 0.0;
    for (int k = 0; k < D * D; ++k) {
      mid[k] = 0.5 * (E0[k] + E1[k]);
      d[k]   = E1[k] - E0[k];
      dd += d[k] * d[k];
      mm += mid[k] * mid[k];
    }
    small = dd <= 1e-10 * mm;
  }
};

// C += w sym(A (x) B); engineering shear columns
template <int D>
inline void add_dyad(double w, const double* A, const double* B, double* C)
{
  using V = VoigtIndex<D>;
  constexpr int nv = V::nv;
  for (int i = 0; i < nv; ++i)
    for (int j = 0; j < nv; ++j) {
      const int k = V::row[i] * D + V::col[i], l = V::row[j] * D + V::col[j];
      C[i * nv + j] += 0.5 * w * (A[k] * B[l] + B[k] * A[l]);
    }
}

// C += a I
template <int D>
inline void add_identity(double a, double* C)
{
  constexpr int nv = VoigtIndex<D>::nv;
  for (int i = 0; i < nv; ++i) C[i * nv + i] += a * (i < D ? 1.0 : 0.5);
}

// out = C : d                                                                          [D*D]
template <int D>
inline void tangent_times(const double* C, const double* d, double* out)
{
  using V = VoigtIndex<D>;
  constexpr int nv = V::nv;
  for (int i = 0; i < nv; ++i) {
    double sum = 0.0;
    for (int j = 0; j < nv; ++j) sum += C[i * nv + j] * d[V::row[j] * D + V::col[j]] * (j < D ? 1.0 : 2.0);
    out[V::row[i] * D + V::col[i]] = out[V::col[i] * D + V::row[i]] = sum;
  }
}

// discrete gradient of any law                                                         (2.14), (2.15)
template <int D>
inline void split_discrete(const MatLaw& law, const KernelMode& mode, const double* E0,
                        const double* E1, double* S, double* C)
{
  constexpr int nv = VoigtIndex<D>::nv;
  const StrainStep<D> e(E0, E1);
  double S1[D * D], S0[D * D], Cm[nv * nv], psi0, psi1, psim, work = 0.0;
  split_eroded(law, D, law.split, mode.finite, law.c, e.mid, law.N, &psim, S, C ? Cm : nullptr);
  for (int k = 0; C && k < nv * nv; ++k) C[k] = 0.5 * Cm[k];
  if (e.small) return;
  split_eroded(law, D, law.split, mode.finite, law.c, E1, law.N, &psi1, S1, nullptr);
  split_eroded(law, D, law.split, mode.finite, law.c, E0, law.N, &psi0, S0, nullptr);
  for (int k = 0; k < D * D; ++k) work += S[k] * e.d[k];
  const double a = (psi1 - psi0 - work) / e.dd;
  if (C) {
    double Cd[D * D], g[D * D];
    tangent_times<D>(Cm, e.d, Cd);
    for (int k = 0; k < D * D; ++k) g[k] = (S1[k] - S[k] - 0.5 * Cd[k] - 2.0 * a * e.d[k]) / e.dd;
    add_identity<D>(a, C);
    add_dyad<D>(1.0, e.d, g, C);
  }
  for (int k = 0; k < D * D; ++k) S[k] += a * e.d[k];
}

// w/2 <side j>_+^2 from j0 to j1: its discrete derivative and the derivative of that with respect to j1
inline void one_sided(double w, int side, double j0, double j1, double& q, double& slope)
{
  const double p0 = std::max(side * j0, 0.0), p1 = std::max(side * j1, 0.0);
  q     = 0.5 * w * side * (p0 + p1);
  slope = p1 > 0.0 ? 0.5 * w : 0.0;
  if ((p0 > 0.0) == (p1 > 0.0)) return;
  q     = 0.5 * w * (p1 * p1 - p0 * p0) / (j1 - j0);
  slope = (w * side * p1 - q) / (j1 - j0);
}

// discrete gradient of a law with a kink in one variable: closing in a step adds a normal stress or a
// pressure only (2.17)
template <int D>
inline void split_discrete_kink(const MatLaw& law, const KernelMode& mode, const double* E0,
                             const double* E1, double* S, double* C)
{
  constexpr int nv = VoigtIndex<D>::nv;
  const StrainStep<D> e(E0, E1);
  double psi, Cm[nv * nv];
  SplitKink k0, m, k1;
  split_eroded(law, D, law.split, mode.finite, law.c, e.mid, law.N, &psi, S, C ? Cm : nullptr);
  const auto kink = [&](const double* E, int order, SplitKink& k) {
    return split_kink(law, D, law.split, mode.finite, law.c, E, law.N, order, k);
  };
  if (!kink(E0, 0, k0) || !kink(e.mid, 0, m) || !kink(E1, 0, k1)) {
    for (int k = 0; k < D * D; ++k) S[k] = std::nan("");
    return;
  }
  if (!(m.side * k0.j > 0.0 || m.side * m.j > 0.0 || m.side * k1.j > 0.0)) {       // never one-sided
    for (int k = 0; k < nv * nv && C; ++k) C[k] = 0.5 * Cm[k];
    return;
  }
  kink(e.mid, C ? 2 : 1, m);
  if (C) kink(E1, 1, k1);
  // q replaces the one-sided part of the middle state
  const double had = m.side * m.j > 0.0 ? m.w : 0.0;
  double q, slope;
  one_sided(m.w, m.side, k0.j, k1.j, q, slope);
  const double more = q - had * m.j;
  if (C) {
    for (int k = 0; k < nv * nv; ++k) C[k] = 0.5 * (Cm[k] + more * m.D[k]);
    add_dyad<D>(slope, m.G, k1.G, C);
    add_dyad<D>(-0.5 * had, m.G, m.G, C);
  }
  for (int k = 0; k < D * D; ++k) S[k] += more * m.G[k];
  if (!(mode.finite && (law.split == SPLIT_PRESSURE || law.split == SPLIT_CRACK)) || e.small) return;
  double rest = k1.j - k0.j, Gd[D * D], g[D * D];    // j is not linear in E
  for (int k = 0; k < D * D; ++k) rest -= m.G[k] * e.d[k];
  const double a = q * rest / e.dd;
  for (int k = 0; k < D * D; ++k) S[k] += a * e.d[k];
  if (!C) return;
  tangent_times<D>(m.D, e.d, Gd);
  for (int k = 0; k < D * D; ++k)
    g[k] = (slope * rest * k1.G[k] + q * (k1.G[k] - m.G[k] - 0.5 * Gd[k]) - 2.0 * a * e.d[k]) / e.dd;
  add_identity<D>(a, C);
  add_dyad<D>(1.0, e.d, g, C);
}

// Statics: a broken band carries stress along the crack, but no shear; in compression it buckles, and
// Newton's method does not converge. It is stabilised by a shear stiffness k = 2 |smallest principal stress|
// across the crack:
//
//   psi = k/2 sum_a (2 E_na)^2,  a: the directions in the crack plane          (2.16)

// largest compressive principal value of a symmetric tensor, at least 0
template <int D>
inline double compression(const double* S)
{
  if (D == 2) return std::max(0.0, std::hypot(0.5 * (S[0] - S[3]), S[1]) - 0.5 * (S[0] + S[3]));
  // 3D: Gershgorin's bound is sufficient for stabilisation
  double least = 0.0;
  for (int i = 0; i < D; ++i) {
    double off = 0.0;
    for (int j = 0; j < D; ++j) off += j != i ? std::fabs(S[i * D + j]) : 0.0;
    least = std::min(least, S[i * D + i] - off);
  }
  return -least;
}

// adds the shear stiffness k across the crack                                        (2.16)
template <int D>
inline void add_shear_stiffness(const double* N, double k, const double* E, double* S, double* C)
{
  using V = VoigtIndex<D>;
  constexpr int nv = V::nv;
  double v[D], en = 0.0;
  for (int i = 0; i < D; ++i) {
    v[i] = 0.0;
    for (int j = 0; j < D; ++j) v[i] += E[i * D + j] * N[j];
    en += v[i] * N[i];
  }
  for (int i = 0; i < D; ++i) v[i] -= en * N[i];
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) S[i * D + j] += 2.0 * k * (v[i] * N[j] + N[i] * v[j]);
  if (!C) return;
  auto P = [N](int i, int j) { return (i == j) - N[i] * N[j]; };
  for (int a = 0; a < nv; ++a)
    for (int b = 0; b < nv; ++b) {
      const int i = V::row[a], j = V::col[a], m = V::row[b], l = V::col[b];
      C[a * nv + b] += k * (N[i] * N[m] * P(j, l) + N[i] * N[l] * P(j, m) + N[j] * N[m] * P(i, l) +
                            N[j] * N[l] * P(i, m));
    }
}

// S of the step and, unless C is null, its derivative C [nv*nv]; E0, E1 strains at t(n), t(n+1)   [D*D]
template <int D>
inline void split_stress(const MatLaw& law, const KernelMode& mode, const double* E0,
                             const double* E1, double* S, double* C)
{
  constexpr int nv = VoigtIndex<D>::nv;
  double psi, S0[D * D], S1[D * D], C1[nv * nv];
  if (!mode.mid) {
    split_eroded(law, D, law.split, mode.finite, law.c, E1, law.N, &psi, S, C);
    if (mode.is_static && mode.finite && (law.split == SPLIT_RCE || law.split == SPLIT_VD))
      add_shear_stiffness<D>(law.N, 2.0 * compression<D>(S), E1, S, C);
    return;
  }
  if (split_has_kink(law, law.split)) split_discrete_kink<D>(law, mode, E0, E1, S, C);
  else split_discrete<D>(law, mode, E0, E1, S, C);
  const double more = mode.s_new - 0.5;              // numerical damping
  if (more == 0.0) return;
  split_eroded(law, D, law.split, mode.finite, law.c, E0, law.N, &psi, S0, nullptr);
  split_eroded(law, D, law.split, mode.finite, law.c, E1, law.N, &psi, S1, C ? C1 : nullptr);
  for (int k = 0; k < D * D; ++k) S[k] += more * (S1[k] - S0[k]);
  if (C)
    for (int k = 0; k < nv * nv; ++k) C[k] += more * C1[k];
}

#endif
