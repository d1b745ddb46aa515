// ---------------------------------------------------------------------------
// voigt.h : symmetric tensors by components: 11 22 33 12 23 31, in the plane 11 22 12
// ---------------------------------------------------------------------------
#ifndef MPFE_MAT_VOIGT_H
#define MPFE_MAT_VOIGT_H

#include <Eigen/Core>

template <int D>
struct VoigtIndex {            // row and column of the nv components
  static constexpr int nv = D == 2 ? 3 : 6;
  static constexpr int row[6] = {0, 1, D == 2 ? 0 : 2, 0, 1, 2};
  static constexpr int col[6] = {0, 1, D == 2 ? 1 : 2, 1, 2, 0};
};

constexpr int six_at[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};     // index of ij among the six

// E [D*D] as six components; in the plane 33, 23 and 31 are zero
template <int D>
inline void six_components(const double* E, double* six)
{
  if (D == 2) {
    six[0] = E[0];
    six[1] = E[3];
    six[3] = E[1];
    six[2] = six[4] = six[5] = 0.0;
    return;
  }
  using V = VoigtIndex<3>;
  for (int i = 0; i < 6; ++i) six[i] = E[(V::row[i] * D + V::col[i]) % (D * D)];
}

// six components of a tensor as D x D
template <int D>
inline void full_tensor(const double* six, double* S)
{
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) S[i * D + j] = six[six_at[i][j]];
}

inline Eigen::Matrix3d full_tensor(const double* six)
{
  Eigen::Matrix3d S;
  full_tensor<3>(six, S.data());
  return S;
}

// A : B of six tensor components
inline double six_dot(const double* A, const double* B)
{
  return A[0] * B[0] + A[1] * B[1] + A[2] * B[2] + 2.0 * (A[3] * B[3] + A[4] * B[4] + A[5] * B[5]);
}

// out = C : E of six components
inline void six_times(const double* C, const double* E, double* out)
{
  for (int i = 0; i < 6; ++i) {
    out[i] = 0.0;
    for (int j = 0; j < 6; ++j) out[i] += C[i * 6 + j] * E[j] * (j < 3 ? 1.0 : 2.0);
  }
}

#endif
