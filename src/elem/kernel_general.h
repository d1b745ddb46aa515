// ---------------------------------------------------------------------------
// kernel_general.h : the integration-point kernel for laws with a general tangent D (doc/theory.md 2.4)
//
// Force and tangent have the form of (1.5), (1.6); the law is three-dimensional and sees six components.
// ---------------------------------------------------------------------------
#ifndef MPFE_ELEM_KERNEL_GENERAL_H
#define MPFE_ELEM_KERNEL_GENERAL_H

#include "elem/kernel.h"
#include "mat/law.h"
#include "mat/voigt.h"

// history of an integration point
struct HistoryStep {
  const double* n = nullptr;   // at t(n)
  double* np1     = nullptr;   // at t(n+1)
};

// Fb, S [D*D] and, unless C is null, C [nv*nv] of intact or granular material from the displacement
// gradients at t(n), when mode_reads_old, and t(n+1); det F of granular material is not asked for
template <int D>
inline Status ip_general(const MatLaw& law, const KernelMode& mode, const double* H0, const double* H1,
                         const double* h_n, double* h_np1, double* Fb, double* S, double* C)
{
  constexpr int nv = VoigtPlace<D>::nv;
  double E[D * D], E0[6] = {0}, E1[6], S6[6], C6[36];
  if (mode.finite && law.kind != LAW_GRANULAR && !(ip_det<D>(H1) > 0.0)) return BAD_JACOBIAN;
  ip_strain<D>(mode.finite, H1, E);
  six_components<D>(E, 0.0, E1);
  if (mode_reads_old(mode, law)) {
    ip_strain<D>(mode.finite, H0, E);
    six_components<D>(E, 0.0, E0);
  }
  if (!law_step(law, mode, E0, E1, h_n, h_np1, S6, C ? C6 : nullptr)) return BAD_JACOBIAN;
  full_tensor<D>(S6, S);
  if (C) {
    static const int in_plane[6] = {0, 1, 3, 0, 1, 3};
    for (int i = 0; i < nv; ++i)
      for (int j = 0; j < nv; ++j)
        C[i * nv + j] = D == 3 ? C6[i * 6 + j] : C6[in_plane[i] * 6 + in_plane[j]];
  }
  for (int k = 0; k < D * D; ++k) Fb[k] = !mode.finite ? 0.0 : mode.mid ? 0.5 * (H0[k] + H1[k]) : H1[k];
  for (int i = 0; i < D; ++i) Fb[i * D + i] += 1.0;
  return STATUS_OK;
}

// ke [pairs a >= b][D*D] += w [ B_a^T C B_b + cG (dN_a/dX . S dN_b/dX) I ]; scratch B, CB [n*nv*D]
template <int D, int N>
inline void ip_tangent_general(const double* dNdX, int n, double w, const double* C, double cG,
                               const double* Fb, const double* S, double* B, double* CB, double* ke)
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
