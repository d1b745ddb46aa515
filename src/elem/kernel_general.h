// ---------------------------------------------------------------------------
// kernel_general.h : the integration-point kernel for laws with a general tangent D (doc/theory.md 2.4)
//
// Force and tangent have the form of (1.5), (1.6); the law is three-dimensional, with six components.
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

// Fb, S [D*D] and, unless C is null, C [nv*nv] from the displacement gradients at t(n), if mode_reads_old,
// and t(n+1)
template <int D>
inline Status ip_general(const MatLaw& law, const KernelMode& mode, const double* H0, const double* H1,
                         const double* h_n, double* h_np1, double* Fb, double* S, double* C)
{
  constexpr int nv = VoigtIndex<D>::nv;
  double E[D * D], E0[6] = {0}, E1[6], S6[6], C6[36];
  if (mode.finite && !law.broken && !(ip_det<D>(H1) > 0.0)) return BAD_JACOBIAN;
  ip_strain<D>(mode.finite, H1, E);
  six_components<D>(E, E1);
  if (mode_reads_old(mode, law)) {
    ip_strain<D>(mode.finite, H0, E);
    six_components<D>(E, E0);
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

// d(Fb S)/dH with the law's tangent C: A [D][D][D*D], w times the block i, j of dP_iJ / dH_jL at (J, L)
template <int D>
inline void ip_moduli(double w, const double* C, double cG, const double* Fb, const double* S, double* A)
{
  using V = VoigtIndex<D>;
  constexpr int nv = V::nv, DD = D * D;
  double B[nv * DD] = {0}, CB[nv * DD];              // dE_v / dH_iJ                               (1.5)
  for (int v = 0; v < nv; ++v)
    for (int i = 0; i < D; ++i) {
      const int r = V::row[v], c = V::col[v];
      B[v * DD + i * D + r] = Fb[i * D + c];
      B[v * DD + i * D + c] = Fb[i * D + r];
    }
  for (int v = 0; v < nv; ++v)
    for (int k = 0; k < DD; ++k) {
      double sum = 0.0;
      for (int u = 0; u < nv; ++u) sum += C[v * nv + u] * B[u * DD + k];
      CB[v * DD + k] = w * sum;
    }
  for (int J = 0; J < D; ++J)
    for (int L = 0; L < D; ++L)
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
          double sum = i == j ? w * cG * S[J * D + L] : 0.0;
          for (int v = 0; v < nv; ++v) sum += B[v * DD + i * D + J] * CB[v * DD + j * D + L];
          A[(J * D + L) * DD + i * D + j] = sum;
        }
}

// ke [pairs a >= b][D*D] += w [ B_a^T C B_b + cG (dN_a/dX . S dN_b/dX) I ], by the moduli A: D products of a
// block with a scalar per pair, in vector registers
template <int D, int N>
inline void ip_tangent_general(const double* dNdX, int n, double w, const double* C, double cG,
                               const double* Fb, const double* S, double* ke)
{
  constexpr int DD = D * D;
  const int nn = N ? N : n;
  double A[DD * DD];
  ip_moduli<D>(w, C, cG, Fb, S, A);
  double* k = ke;
  for (int a = 0; a < nn; ++a) {
    double M[D * DD] = {0};                          // sum_J dN_a/dX_J A_JL
    for (int L = 0; L < D; ++L)
      for (int J = 0; J < D; ++J)
        for (int m = 0; m < DD; ++m) M[L * DD + m] += dNdX[a * D + J] * A[(J * D + L) * DD + m];
    if constexpr (D == 3) {                          // 9 values of a block as 8 and 1
      constexpr int R = 8 / PACK;
      Pack M0[R], M1[R], M2[R];
      for (int r = 0; r < R; ++r) {
        M0[r] = *reinterpret_cast<const PackRow*>(M + r * PACK);
        M1[r] = *reinterpret_cast<const PackRow*>(M + DD + r * PACK);
        M2[r] = *reinterpret_cast<const PackRow*>(M + 2 * DD + r * PACK);
      }
      const double m0 = M[8], m1 = M[DD + 8], m2 = M[2 * DD + 8];
      for (int b = 0; b <= a; ++b, k += DD) {
        const double* g = dNdX + b * D;
        for (int r = 0; r < R; ++r) {
          PackRow& to = *reinterpret_cast<PackRow*>(k + r * PACK);
          to = to + g[0] * M0[r] + g[1] * M1[r] + g[2] * M2[r];
        }
        k[8] += g[0] * m0 + g[1] * m1 + g[2] * m2;
      }
    } else {
      for (int b = 0; b <= a; ++b, k += DD) {
        const double* g = dNdX + b * D;
        for (int m = 0; m < DD; ++m) {
          double sum = k[m];
          for (int L = 0; L < D; ++L) sum += M[L * DD + m] * g[L];
          k[m] = sum;
        }
      }
    }
  }
}

#endif
