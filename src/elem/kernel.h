// ---------------------------------------------------------------------------
// kernel.h : the integration-point kernel: one for Gauss points and material points
//
// An integration point is a list of nodes, the reference gradients dNdX[n][D] of their
// shape functions and a reference weight w. Internal force and tangent follow from the
// displacement gradients at both ends of the step, total Lagrangian (doc/theory.md 1):
//
//   f_a  = w P dN_a/dX,  P = Fb S                                             (1.5)
//   K_ab = w [ cD B_a^T D B_b + cG (dN_a/dX . S dN_b/dX) I ],  B of Fb        (1.6)
//
// Static, Newmark: Fb = F(n+1), S = S(n+1), cD = cG = 1.
// Energy-momentum: Fb = F(n+1/2), S = s_new S(n+1) + s_old S(n), cD = s_new, cG = 1/2.
// Without NLGEOM:  E = sym(grad u), Fb = I, cG = 0.
// A law with beta (2.19): eta = beta rate adds to s_new and cD, and is subtracted from s_old.
//
// D dimension, N nodes (0: n given at run time). Matrices D x D row by row.
// T is double, or Pack: a value of each of PACK elements. G, the type of gradients and weights, may be double
// for equal elements.
// ---------------------------------------------------------------------------
#ifndef MPFE_ELEM_KERNEL_H
#define MPFE_ELEM_KERNEL_H

#include "mat/mat.h"

// width of a vector register of the processor: longer vectors would be stored in memory
#if defined(__AVX512F__)
const int PACK = 8;
#elif defined(__AVX__)
const int PACK = 4;
#else
const int PACK = 2;
#endif
typedef double Pack __attribute__((vector_size(8 * PACK), may_alias));

// PACK consecutive values, unaligned
typedef double PackRow __attribute__((vector_size(8 * PACK), aligned(8), may_alias));

// pack_turn : x [PACK] transposed, rows to columns
inline void pack_turn(Pack* x)
{
  typedef long Lanes __attribute__((vector_size(8 * PACK)));
#if defined(__AVX512F__)
  const Lanes low[3]  = {{0, 8, 2, 10, 4, 12, 6, 14},
                          {0, 1, 8, 9, 4, 5, 12, 13},
                          {0, 1, 2, 3, 8, 9, 10, 11}},
               high[3] = {{1, 9, 3, 11, 5, 13, 7, 15},
                          {2, 3, 10, 11, 6, 7, 14, 15},
                          {4, 5, 6, 7, 12, 13, 14, 15}};
#elif defined(__AVX__)
  const Lanes low[2]  = {{0, 4, 2, 6}, {0, 1, 4, 5}},
               high[2] = {{1, 5, 3, 7}, {2, 3, 6, 7}};
#else
  const Lanes low[1] = {{0, 2}}, high[1] = {{1, 3}};
#endif
#pragma GCC unroll 3
  for (int s = 0; 1 << s < PACK; ++s)
#pragma GCC unroll 8
    for (int i = 0; i < PACK; ++i) {
      const int j = i + (1 << s);
      if ((i >> s) & 1) continue;
      const Pack a = x[i], b = x[j];
      x[i] = __builtin_shuffle(a, b, low[s]);
      x[j] = __builtin_shuffle(a, b, high[s]);
    }
}

// pack_gather : element i of each of PACK arrays
inline Pack pack_gather(const double* const* x, int i)
{
#if defined(__AVX512F__)
  return Pack{x[0][i], x[1][i], x[2][i], x[3][i], x[4][i], x[5][i], x[6][i], x[7][i]};
#elif defined(__AVX__)
  return Pack{x[0][i], x[1][i], x[2][i], x[3][i]};
#else
  return Pack{x[0][i], x[1][i]};
#endif
}

// pack_gather_two : out [2] from the first two elements of each of PACK arrays
inline void pack_gather_two(const double* const* x, Pack* out)
{
#if defined(__AVX__) && !defined(__AVX512F__)
  typedef long Lanes __attribute__((vector_size(8 * PACK)));
  const Pack a = {x[0][0], x[0][1], x[2][0], x[2][1]}, b = {x[1][0], x[1][1], x[3][0], x[3][1]};
  out[0] = __builtin_shuffle(a, b, Lanes{0, 4, 2, 6});
  out[1] = __builtin_shuffle(a, b, Lanes{1, 5, 3, 7});
#else
  for (int i = 0; i < 2; ++i) out[i] = pack_gather(x, i);
#endif
}

// pack_rows : out [n] from n consecutive elements of each of PACK arrays
inline void pack_rows(const double* const* x, int n, Pack* out)
{
  const int whole = n / PACK * PACK;
  for (int k = 0; k < whole; k += PACK) {
    for (int l = 0; l < PACK; ++l) out[k + l] = *reinterpret_cast<const PackRow*>(x[l] + k);
    pack_turn(out + k);
  }
  for (int k = whole; k < n; ++k) out[k] = pack_gather(x, k);
}

// number of node pairs a >= b, and the index of a pair
constexpr int pair_count(int n) { return n * (n + 1) / 2; }
constexpr int pair_index(int a, int b) { return a * (a + 1) / 2 + b; }

// H = sum_a u_a (x) dN_a/dX
template <int D, int N, class G, class T>
inline void ip_gradient(const G* dNdX, int n, const T* u, T* H)
{
  const int nn = N ? N : n;
  for (int k = 0; k < D * D; ++k) H[k] = T{};
  for (int a = 0; a < nn; ++a)
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j) H[i * D + j] += u[a * D + i] * dNdX[a * D + j];
}

// E from H                                                                         (1.2)
template <int D, class T>
inline void ip_strain(bool finite, const T* H, T* E)
{
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      T e = H[i * D + j] + H[j * D + i];
      if (finite)
        for (int k = 0; k < D; ++k) e += H[k * D + i] * H[k * D + j];
      E[i * D + j] = 0.5 * e;
    }
}

template <int D, class T>
inline T ip_det(const T* H)
{
  if (D == 2) return (1.0 + H[0]) * (1.0 + H[3]) - H[1] * H[2];
  const T a = 1.0 + H[0], b = 1.0 + H[4], c = 1.0 + H[D * D - 1];
  return a * (b * c - H[5] * H[7]) - H[1] * (H[3] * c - H[5] * H[6]) + H[2] * (H[3] * H[7] - b * H[6]);
}

// cof [D*D] = det F F^-T of F = I + H
template <int D, class T>
inline void ip_cofactor(const T* H, T* cof)
{
  T F[D * D];
  for (int k = 0; k < D * D; ++k) F[k] = H[k];
  for (int i = 0; i < D; ++i) F[i * D + i] += 1.0;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      if constexpr (D == 2) {
        cof[i * 2 + j] = (i == j ? 1.0 : -1.0) * F[(1 - i) * 2 + 1 - j];
      } else {
        const int i1 = (i + 1) % 3, i2 = (i + 2) % 3, j1 = (j + 1) % 3, j2 = (j + 2) % 3;
        cof[i * 3 + j] = F[i1 * 3 + j1] * F[i2 * 3 + j2] - F[i1 * 3 + j2] * F[i2 * 3 + j1];
      }
    }
}

// S = lam tr(E) I + 2 mu E                                                         (2.1)
template <int D, class T>
inline void ip_law(const MatLaw& law, const T* E, T* S)
{
  T tr{};
  for (int i = 0; i < D; ++i) tr += E[i * D + i];
  for (int k = 0; k < D * D; ++k) S[k] = 2.0 * law.mu * E[k];
  for (int i = 0; i < D; ++i) S[i * D + i] += law.lam * tr;
}

// Fb and the strain E of the step, averaged in time as the stress, from the displacement gradients at t(n)
// and t(n+1); mode: of the law; returns det F(n+1)
template <int D, class T>
inline T ip_kinematics(const KernelMode& mode, const T* H0, const T* H1, T* Fb, T* E)
{
  ip_strain<D>(mode.finite, H1, E);
  if (mode.s_old != 0.0) {
    T E0[D * D];
    ip_strain<D>(mode.finite, H0, E0);
    for (int k = 0; k < D * D; ++k) E[k] = mode.s_new * E[k] + mode.s_old * E0[k];
  }
  for (int k = 0; k < D * D; ++k) Fb[k] = !mode.finite ? T{} : mode.mid ? 0.5 * (H0[k] + H1[k]) : H1[k];
  for (int i = 0; i < D; ++i) Fb[i * D + i] += 1.0;
  return mode.finite ? ip_det<D>(H1) : T{} + 1.0;
}

// Fb and S of the step; returns det F(n+1)
template <int D, class T>
inline T ip_stress(const MatLaw& law, const KernelMode& mode, const T* H0, const T* H1, T* Fb, T* S)
{
  T E[D * D];
  const T det = ip_kinematics<D>(mode_of_law(mode, law), H0, H1, Fb, E);
  ip_law<D>(law, E, S);
  return det;
}

// re [n*D] += w P dN_a/dX
template <int D, int N, class G, class T>
inline void ip_force(const G* dNdX, int n, G w, const T* Fb, const T* S, T* re)
{
  const int nn = N ? N : n;
  T P[D * D];
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      T p{};
      for (int k = 0; k < D; ++k) p += Fb[i * D + k] * S[k * D + j];
      P[i * D + j] = w * p;
    }
  for (int a = 0; a < nn; ++a)
    for (int i = 0; i < D; ++i) {
      T f{};
      for (int j = 0; j < D; ++j) f += P[i * D + j] * dNdX[a * D + j];
      re[a * D + i] += f;
    }
}

// ke [pairs a >= b][D*D] += tangent; FRESH: = tangent. For the isotropic law B_a^T D B_b is, with
// f_a = Fb dN_a/dX,
//   lam f_a f_b^T + mu [ f_b f_a^T + (dN_a/dX . dN_b/dX) Fb Fb^T ]                (1.7)
// scratch f: [n*D]
template <int D, int N, bool FRESH = false, class G, class T>
inline void ip_tangent(const G* dNdX, int n, G w, const MatLaw& law, const KernelMode& mode, const T* Fb,
                       const T* S, T* f, T* ke)
{
  const int nn = N ? N : n;
  const double cD = mode_of_law(mode, law).cD();
  const G lam = w * cD * law.lam, mu = w * cD * law.mu, cg = w * mode.cG();
  T b[D * D], Sg[D * D];
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      T sum{};
      for (int k = 0; k < D; ++k) sum += Fb[i * D + k] * Fb[j * D + k];
      b[i * D + j]  = mu * sum;
      Sg[i * D + j] = cg * S[i * D + j];
    }
  for (int a = 0; a < nn; ++a)
    for (int i = 0; i < D; ++i) {
      T sum{};
      for (int j = 0; j < D; ++j) sum += Fb[i * D + j] * dNdX[a * D + j];
      f[a * D + i] = sum;
    }
  for (int a = 0; a < nn; ++a) {
    T h[D], fl[D], fm[D];
    for (int i = 0; i < D; ++i) {
      h[i] = T{};
      for (int j = 0; j < D; ++j) h[i] += Sg[i * D + j] * dNdX[a * D + j];
      fl[i] = lam * f[a * D + i];
      fm[i] = mu * f[a * D + i];
    }
    for (int c = 0; c <= a; ++c) {
      G gg{};
      T geo{};
      for (int j = 0; j < D; ++j) {
        gg += dNdX[a * D + j] * dNdX[c * D + j];
        geo += h[j] * dNdX[c * D + j];
      }
      T* k = ke + pair_index(a, c) * D * D;
      for (int i = 0; i < D; ++i) {
        for (int j = 0; j < D; ++j) {
          const T part = fl[i] * f[c * D + j] + f[c * D + i] * fm[j] + b[i * D + j] * gg;
          k[i * D + j] = FRESH ? part : k[i * D + j] + part;
        }
        k[i * D + i] += geo;
      }
    }
  }
}

#endif
