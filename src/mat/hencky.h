// ---------------------------------------------------------------------------
// hencky.h : laws in logarithmic elastic strains, F = Fe Fp with isochoric plastic flow
// (doc/theory.md (2.24) - (2.28)). Private to the files of mat/
//
// Such a law depends on F through C only: F is replaced by any L^T with L L^T = C, and the stress has the
// principal axes of be = L^T Cp^-1 L.
// ---------------------------------------------------------------------------
#ifndef MPFE_MAT_HENCKY_H
#define MPFE_MAT_HENCKY_H

#include <cmath>

#include <Eigen/Dense>

#include "mat/law.h"

struct HenckyTrial {
  Eigen::Matrix3d L, LL;       // factor, L^T L - I
  Eigen::Matrix3d n, M;        // axes n_A of be in columns; L^-T n_A
  Eigen::Vector3d x, e;        // eigenvalues of be - I; logarithmic strains ln(1 + x)/2
  bool finite = true;          // false: small strains (2.29), x = 2 e, L = I, L^T L - I = 2 E
};

// history of plastic laws: Cp^-1 - I of the plastic deformation [6], without NLGEOM -2 ep; equivalent plastic
// strain
enum { FLOW_DEFORMATION = 0, FLOW_EQUIVALENT = 6 };

// hencky_trial : elastic strains without further flow. false: 2E + I is not positive definite
bool hencky_trial(const double* E, const double* h_n, HenckyTrial& t);

// hencky_small : the same in principal values without NLGEOM                                     (2.29)
void hencky_small(const double* E, const double* h_n, HenckyTrial& t);

// hencky_deviator : of its principal stresses; the trace of the elastic strains
inline Eigen::Vector3d hencky_deviator(const MatLaw& law, const HenckyTrial& t, double& trace)
{
  trace = t.e.sum();
  return 2.0 * law.mu * (t.e.array() - trace / 3.0);
}

// hencky_stress : S of the principal Kirchhoff stresses tau                               [6]
void hencky_stress(const HenckyTrial& t, const Eigen::Vector3d& tau, double* S);

// hencky_flow : history for the elastic strains e after the return
void hencky_flow(const HenckyTrial& t, const Eigen::Vector3d& e, double* h_np1);

// Derivative of the returned stress with respect to the elastic trial strain, s: trial deviator:
//   bulk 1 1 + dev (I - 1 1/3) + flow s s + mixed (s 1 + 1 s)                        (2.27), (2.31)
// skew: half the difference of the parts s 1 and 1 s, of flow that is not associated
struct Moduli { double bulk, dev, flow, mixed = 0.0, skew = 0.0; };

// principal_moduli : symmetric part of the derivatives of the principal stresses with respect to the
// principal strains; s: principal trial deviator
Eigen::Matrix3d principal_moduli(const Moduli& c, const Eigen::Vector3d& s);

// hencky_tangent : D of the principal stresses tau and their derivatives c                   (2.28) [36]
//   in   most   largest shear modulus of two axes
void hencky_tangent(const HenckyTrial& t, const Eigen::Vector3d& tau, const Eigen::Matrix3d& c, double* D,
                    double most = HUGE_VAL);
// ... from the moduli and s, the principal trial deviator
void hencky_tangent(const HenckyTrial& t, const Eigen::Vector3d& tau, const Eigen::Vector3d& s,
                    const Moduli& c, double* D);

// ---- without NLGEOM: additive strains                                                   (2.29)
struct SmallTrial {
  double s[6], ss, tr;         // deviator of the stress, s : s, trace of the elastic strain
};
SmallTrial small_trial(const MatLaw& law, const double* E, const double* h_n);

// small_flow : history after the plastic strain increment w s
void small_flow(const SmallTrial& t, double w, const double* h_n, double* h_np1);

void small_tangent(const SmallTrial& t, const Moduli& c, double* D);

// ---- the cone of Drucker and Prager in principal strains                          (2.37) - (2.40)
struct ConeState {
  Eigen::Vector3d tau, e;      // stress; elastic strain after the return
  double psi, dissipated;      // / volume                                                 force/length^2
  double equivalent;           // equivalent plastic strain
  bool flows;
  Eigen::Matrix3d c;           // derivative of tau with respect to the trial strain, not symmetric
};

// cone_state : return of the trial strains e, with the equivalent plastic strain a at t(n)
ConeState cone_state(const MatLaw& law, const Eigen::Vector3d& e, double a);

#endif
