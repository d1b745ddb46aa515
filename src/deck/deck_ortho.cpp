#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "deck/deck_state.h"

// Orthotropic elastic constants: matrix, rotation, equivalent isotropic constants

namespace {

const int voigt[3][3] = {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}};

using Matrix6 = Eigen::Matrix<double, 6, 6>;

// largest eigenvalue of n.D.n over directions n: density times square of the fastest wave speed
double fastest_wave(const RealVec& D)
{
  const int steps = 24;
  const double turn = 3.14159265358979323846 / steps;
  double largest = 0.0;
  for (int a = 0; a <= steps; ++a)
    for (int b = 0; b < steps; ++b) {
      const double n[3] = {std::sin(a * turn) * std::cos(b * turn), std::sin(a * turn) * std::sin(b * turn),
                           std::cos(a * turn)};
      Eigen::Matrix3d Q = Eigen::Matrix3d::Zero();
      for (int i = 0; i < 3; ++i)
        for (int k = 0; k < 3; ++k)
          for (int j = 0; j < 3; ++j)
            for (int l = 0; l < 3; ++l) Q(i, k) += n[j] * D[6 * voigt[i][j] + voigt[k][l]] * n[l];
      largest = std::max(largest, Q.selfadjointView<Eigen::Lower>().eigenvalues()(2));
    }
  return largest;
}

}  // namespace

// ---------------------------------------------------------------------------
// ortho_matrix : D of E1 E2 E3 nu12 nu13 nu23 G12 G13 G23; false: not positive definite
//                                                                                doc/theory.md (2.42)
// ---------------------------------------------------------------------------
bool ortho_matrix(const double* c, RealVec& D)
{
  Eigen::Matrix3d S;
  S << 1.0 / c[0], -c[3] / c[0], -c[4] / c[0],
       -c[3] / c[0], 1.0 / c[1], -c[5] / c[1],
       -c[4] / c[0], -c[5] / c[1], 1.0 / c[2];
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(S);
  if (eigen.eigenvalues()(0) <= 1e-9 * eigen.eigenvalues()(2)) return false;
  const Eigen::Matrix3d D3 = S.inverse();
  D.assign(36, 0.0);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) D[6 * i + j] = 0.5 * (D3(i, j) + D3(j, i));
  D[21] = c[6];                // 12
  D[28] = c[8];                // 23
  D[35] = c[7];                // 31
  return true;
}

// ---------------------------------------------------------------------------
// ortho_turn : D rotated from the directions of the material to those of the model
//   in   axis   unit vectors 1, 2, 3 of the material                    [9]       doc/theory.md (2.43)
// ---------------------------------------------------------------------------
RealVec ortho_turn(const RealVec& D, const std::array<double, 9>& axis)
{
  RealVec out(36, 0.0);
  Matrix6 T;                   // strains of the model -> of the material, engineering shear
  const int row[6] = {0, 1, 2, 0, 1, 2}, col[6] = {0, 1, 2, 1, 2, 0};
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) {
      const double *p = &axis[3 * row[a]], *q = &axis[3 * col[a]];
      const int i = row[b], j = col[b];
      T(a, b) = b < 3 ? p[i] * q[i] * (a < 3 ? 1.0 : 2.0)
                      : (p[i] * q[j] + p[j] * q[i]) * (a < 3 ? 0.5 : 1.0);
    }
  const Matrix6 turned = T.transpose() * Eigen::Map<const Matrix6>(D.data()) * T;
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) out[6 * i + j] = 0.5 * (turned(i, j) + turned(j, i));
  return out;
}

// ---------------------------------------------------------------------------
// ortho_isotropic : young and poisson of an isotropic material with the fastest pressure wave of D and about
// its fastest shear wave, for penalties, stable increments and viscous boundaries
// ---------------------------------------------------------------------------
void ortho_isotropic(const RealVec& D, double& young, double& poisson)
{
  const double M = fastest_wave(D);
  const double mu = std::clamp(std::max({D[21], D[28], D[35]}), 0.05 * M, 0.45 * M);
  poisson = (M - 2.0 * mu) / (2.0 * (M - mu));
  young   = 2.0 * mu * (1.0 + poisson);
}
