// ---------------------------------------------------------------------------
// kernel_broken.h : the integration-point kernel for broken material, whose law is psi = c psi+ + psi-
//
// Force and tangent have the form of (1.5), (1.6) with the general D of the law; its stress over a step:
// mat/split_step.h
// ---------------------------------------------------------------------------
#ifndef MPFE_ELEM_KERNEL_BROKEN_H
#define MPFE_ELEM_KERNEL_BROKEN_H

#include <algorithm>
#include <cmath>

#include "elem/kernel_general.h"
#include "mat/split_step.h"

// Statics: a broken band carries stress along the crack, but no shear; under compression it wrinkles at once,
// and Newton's method finds no minimum. A shear stiffness k = 2 |smallest principal stress| across the crack
// holds it:
//
//   psi = k/2 sum_a (2 E_na)^2,  a: the directions in the crack plane          (2.16)

// largest compressive principal value of a symmetric tensor, at least 0
template <int D>
inline double ip_compression(const double* S)
{
  if (D == 2) return std::max(0.0, std::hypot(0.5 * (S[0] - S[3]), S[1]) - 0.5 * (S[0] + S[3]));
  // 3D: Gershgorin's bound is enough for a stiffness that holds
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
      C[a * nv + b] += k * (N[i] * N[m] * P(j, l) + N[i] * N[l] * P(j, m) + N[j] * N[m] * P(i, l) +
                            N[j] * N[l] * P(i, m));
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
  if (mode.is_static && mode.finite && (er.split == SPLIT_RCE || er.split == SPLIT_VD)) {
    ip_hold_shear<D>(er.N, 2.0 * ip_compression<D>(S), E1, S, C);
  }
  for (int k = 0; k < D * D; ++k) Fb[k] = !mode.finite ? 0.0 : mode.mid ? 0.5 * (H0[k] + H1[k]) : H1[k];
  for (int i = 0; i < D; ++i) Fb[i * D + i] += 1.0;
}

#endif
