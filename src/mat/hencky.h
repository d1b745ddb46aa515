// ---------------------------------------------------------------------------
// hencky.h : laws in logarithmic elastic strains, F = Fe Fp with plastic flow that keeps the volume
// (doc/theory.md (2.24) - (2.28)). Private to the files of mat/
//
// Such a law depends on F through C alone: any L^T with L L^T = C takes the place of F, and the principal
// axes of be = L^T Cp^-1 L are those of the stress.
// ---------------------------------------------------------------------------
#ifndef MPFE_MAT_HENCKY_H
#define MPFE_MAT_HENCKY_H

#include <Eigen/Dense>

#include "mat/law.h"

struct HenckyTrial {
  Eigen::Matrix3d L, LL;       // factor, L^T L - I
  Eigen::Matrix3d n, M;        // axes n_A of be in columns; L^-T n_A
  Eigen::Vector3d x, e;        // eigenvalues of be - I; logarithmic strains ln(1 + x)/2
};

// hencky_trial : elastic strains without further flow. false: 2E + I is not positive definite
bool hencky_trial(const double* E, const double* h_n, HenckyTrial& t);

// hencky_stress : S of the principal Kirchhoff stresses tau                               [6]
void hencky_stress(const HenckyTrial& t, const Eigen::Vector3d& tau, double* S);

// hencky_flow : history after the elastic strains have become e
void hencky_flow(const HenckyTrial& t, const Eigen::Vector3d& e, double* h_np1);

// hencky_tangent : D of c_AB = d tau_A / d e_B                                    (2.27), (2.28) [36]
void hencky_tangent(const HenckyTrial& t, const Eigen::Vector3d& tau, const Eigen::Matrix3d& c, double* D);

#endif
