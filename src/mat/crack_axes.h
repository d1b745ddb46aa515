// ---------------------------------------------------------------------------
// crack_axes.h : parts that one and several cohesive openings share. Private to law_cohesive*.cpp
// ---------------------------------------------------------------------------
#ifndef MPFE_MAT_CRACK_AXES_H
#define MPFE_MAT_CRACK_AXES_H

#include <Eigen/Dense>

#include "mat/crack.h"

// The crack along one axis, at one strain
struct Opening {
  Eigen::Vector3d N;           // normal
  double width;
  double t;                    // stress along N without this crack
  double beside;               // stiffness of the adjacent material                force/length^3
  double w = 0.0, k = 0.0;     // opening, the largest so far
  double s = 0.0;              // traction/w
  double flexible = 0.0;       // dw/dt
};

// crack_no_stress : below it stresses have no axes of their own: round-off and residuals of Newton's method
// in an unloaded body  (test: strength/unloaded.inp)                              force/length^2
inline double crack_no_stress(const CrackLaw& c) { return 1e-6 * crack_strength(c); }

// crack_open_along : w, k, s and dw/dt of (2.33);  k: the largest opening so far
void crack_open_along(const CrackLaw& c, double k, Opening& o);

// crack_stress : stress of a unit strain sym(N a): C : sym(N a)                          [6]
void crack_stress(const MatLaw& law, const Eigen::Vector3d& N, const Eigen::Vector3d& a, double* S);

// crack_subtract : D -= share S S^T, S of the strain sym(N a)
void crack_subtract(const MatLaw& law, const Eigen::Vector3d& N, const Eigen::Vector3d& a, double share,
                    double* D);

// crack_turn : turns the axes first and second of equal strain in their plane, the first towards a; false,
// unchanged: a is normal to both
bool crack_turn(const Eigen::Vector3d& a, Eigen::Ref<Eigen::Vector3d> first,
                Eigen::Ref<Eigen::Vector3d> second);

// crack_store : writes a crack into its history [CRACK_SIZE]; returns the place of the next one
double* crack_store(const Eigen::Vector3d& N, double width, double k, double* h);

// One of several cracks of a point at the end of an increment
struct CrackBand {
  Eigen::Vector3d N;           // normal at t = 0
  double before = 0.0, k = 0.0;        // largest opening at t(n), at t(n+1)
  double width  = 0.0;         // inout
};

// crack_next_widths : widths of n cracks in the next increment. Of an element: along its mean normal for the
// crack next to it, normal to that for the others; of a point: that of the cells for the crack that has
// opened widest. false: none changes
bool crack_next_widths(const CrackLaw& c, int n, CrackBand* band);

// ---------------------------------------------------------------------------
// law_cohesive_axes : cracks along all principal axes, each with its own history          (2.36e), (2.36f)
//
//   in   h_n, h_np1   CRACK_AXES cracks, h_np1 as h_n
//        out          of the intact law at this strain
//   out  h_np1, out   of the cracked one
// ---------------------------------------------------------------------------
bool law_cohesive_axes(const MatLaw& law, const double* h_n, double* h_np1, bool tangent, LawOutput& out);

#endif
