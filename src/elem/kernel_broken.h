// ---------------------------------------------------------------------------
// kernel_broken.h : the integration-point kernel for broken material, whose law is psi = c psi+ + psi-
//
// Force and tangent have the form of (1.5), (1.6) with the general D of the law. Energy-momentum takes the discrete
// gradient, so that the energy is that of the law whatever the strain does in a step:
//
//   S = S(Em) + a dE,  a = [psi(n+1) - psi(n) - S(Em) : dE] / (dE : dE),  Em the middle strain      (2.14)
//   D = 1/2 C(Em) + a I + sym(dE (x) da/dE),  the symmetric part of its derivative                  (2.15)
// ---------------------------------------------------------------------------
#ifndef MPFE_ELEM_KERNEL_BROKEN_H
#define MPFE_ELEM_KERNEL_BROKEN_H

#include <algorithm>
#include <cmath>

#include "elem/kernel.h"
#include "mat/split.h"

// Statics: a broken band carries stress along the crack, but no shear; under compression it wrinkles at once, and Newton's
// method finds no minimum. A shear stiffness k = 2 |smallest principal stress| across the crack holds it:
//
//   psi = k/2 sum_a (2 E_na)^2,  a: the directions in the crack plane                                      (2.16)

template <int D>
struct VoigtPlace {            // tensor components of the nv strains, engineering shear last
  static constexpr int nv = D == 2 ? 3 : 6;
  static constexpr int row[6] = {0, 1, D == 2 ? 0 : 2, 0, 1, 2};
  static constexpr int col[6] = {0, 1, D == 2 ? 1 : 2, 1, 2, 0};
};

// S of the step and, unless C is null, its derivative C [nv*nv]; E0, E1 strains at t(n), t(n+1)   [D*D]
template <int D>
inline void ip_stress_broken(const MatLaw& law, const ErodedLaw& er, const KernelMode& mode, const double* E0,
                             const double* E1, double* S, double* C)
{
  using V = VoigtPlace<D>;
  constexpr int nv = V::nv;
  double psi1, C1[nv * nv];
  if (!mode.mid) {
    split_eroded(law, D, er.split, mode.finite, er.c, E1, er.N, &psi1, S, C ? C : C1);
    return;
  }
  double Em[D * D], dE[D * D], S1[D * D], S0[D * D], Cm[nv * nv], psi0, psim, dd = 0.0, mm = 0.0, work = 0.0;
  for (int k = 0; k < D * D; ++k) {
    Em[k] = 0.5 * (E0[k] + E1[k]);
    dE[k] = E1[k] - E0[k];
    dd += dE[k] * dE[k];
    mm += Em[k] * Em[k];
  }
  split_eroded(law, D, er.split, mode.finite, er.c, Em, er.N, &psim, S, Cm);
  split_eroded(law, D, er.split, mode.finite, er.c, E1, er.N, &psi1, S1, C1);
  split_eroded(law, D, er.split, mode.finite, er.c, E0, er.N, &psi0, S0, C ? C : C1);
  if (C)
    for (int k = 0; k < nv * nv; ++k) C[k] = 0.5 * Cm[k];
  if (dd > 1e-10 * mm) {                             // below that the middle stress is exact to rounding
    for (int k = 0; k < D * D; ++k) work += S[k] * dE[k];
    const double a = (psi1 - psi0 - work) / dd;
    if (C) {
      double d[nv], g[nv], Cd[nv];
      for (int i = 0; i < nv; ++i) d[i] = dE[V::row[i] * D + V::col[i]];
      for (int i = 0; i < nv; ++i) {
        Cd[i] = 0.0;
        for (int j = 0; j < nv; ++j) Cd[i] += Cm[i * nv + j] * d[j] * (j < D ? 1.0 : 2.0);
        const int k = V::row[i] * D + V::col[i];
        g[i] = (S1[k] - S[k] - 0.5 * Cd[i] - 2.0 * a * d[i]) / dd;
      }
      for (int i = 0; i < nv; ++i) {
        C[i * nv + i] += a * (i < D ? 1.0 : 0.5);
        for (int j = 0; j < nv; ++j) C[i * nv + j] += 0.5 * (d[i] * g[j] + g[i] * d[j]);
      }
    }
    for (int k = 0; k < D * D; ++k) S[k] += a * dE[k];
  }
  const double more = mode.s_new - 0.5;              // dissipation on demand
  if (more == 0.0) return;
  for (int k = 0; k < D * D; ++k) S[k] += more * (S1[k] - S0[k]);
  if (C)
    for (int k = 0; k < nv * nv; ++k) C[k] += more * C1[k];
}

// largest compressive principal value of a symmetric tensor, at least 0
template <int D>
inline double ip_compression(const double* S)
{
  if (D == 2) return std::max(0.0, std::hypot(0.5 * (S[0] - S[3]), S[1]) - 0.5 * (S[0] + S[3]));
  double least = 0.0;                                // 3D: Gershgorin's bound is enough for a stiffness that holds
  for (int i = 0; i < D; ++i) {
    double off = 0.0;
    for (int j = 0; j < D; ++j) off += j != i ? std::fabs(S[i * D + j]) : 0.0;
    least = std::min(least, S[i * D + i] - off);
  }
  return -least;
}

// adds the shear stiffness k across the crack                                        (2.16)
template <int D>
inline void ip_hold_shear(const double* N, double k, const double* E, double* S, double* C)
{
  using V = VoigtPlace<D>;
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
      C[a * nv + b] += k * (N[i] * N[m] * P(j, l) + N[i] * N[l] * P(j, m) + N[j] * N[m] * P(i, l) + N[j] * N[l] * P(i, m));
    }
}

// Fb, S and, unless C is null, C from the displacement gradients at t(n) and t(n+1)
template <int D>
inline void ip_broken(const MatLaw& law, const ErodedLaw& er, const KernelMode& mode, const double* H0,
                      const double* H1, double* Fb, double* S, double* C)
{
  double E0[D * D] = {0}, E1[D * D];
  ip_strain<D>(mode.finite, H1, E1);
  if (mode.mid) ip_strain<D>(mode.finite, H0, E0);
  ip_stress_broken<D>(law, er, mode, E0, E1, S, C);
  if (mode.steady && mode.finite && (er.split == SPLIT_RCE || er.split == SPLIT_VD)) {
    ip_hold_shear<D>(er.N, 2.0 * ip_compression<D>(S), E1, S, C);
  }
  for (int k = 0; k < D * D; ++k) Fb[k] = !mode.finite ? 0.0 : mode.mid ? 0.5 * (H0[k] + H1[k]) : H1[k];
  for (int i = 0; i < D; ++i) Fb[i * D + i] += 1.0;
}

// ke [pairs a >= b][D*D] += w [ B_a^T C B_b + cG (dN_a/dX . S dN_b/dX) I ]; scratch B, CB [n*nv*D]
template <int D, int N>
inline void ip_tangent_general(const double* dNdX, int n, double w, const double* C, double cG, const double* Fb,
                               const double* S, double* B, double* CB, double* ke)
{
  using V = VoigtPlace<D>;
  constexpr int nv = V::nv;
  const int nn = N ? N : n;
  for (int a = 0; a < nn; ++a)
    for (int i = 0; i < nv; ++i)
      for (int k = 0; k < D; ++k) {
        const int r = V::row[i], c = V::col[i];
        const double* g = dNdX + a * D;
        B[(a * nv + i) * D + k] = r == c ? Fb[k * D + r] * g[r] : Fb[k * D + r] * g[c] + Fb[k * D + c] * g[r];
      }
  for (int a = 0; a < nn; ++a)
    for (int i = 0; i < nv; ++i)
      for (int k = 0; k < D; ++k) {
        double sum = 0.0;
        for (int j = 0; j < nv; ++j) sum += C[i * nv + j] * B[(a * nv + j) * D + k];
        CB[(a * nv + i) * D + k] = w * sum;
      }
  for (int a = 0; a < nn; ++a)
    for (int b = 0; b <= a; ++b) {
      double* k = ke + pair_place(a, b) * D * D;
      double geo = 0.0;
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) geo += dNdX[a * D + i] * S[i * D + j] * dNdX[b * D + j];
      for (int i = 0; i < D; ++i) {
        for (int j = 0; j < D; ++j) {
          double sum = 0.0;
          for (int v = 0; v < nv; ++v) sum += B[(a * nv + v) * D + i] * CB[(b * nv + v) * D + j];
          k[i * D + j] += sum;
        }
        k[i * D + i] += w * cG * geo;
      }
    }
}

#endif
