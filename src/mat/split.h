// ---------------------------------------------------------------------------
// split.h : energy splits for fracture, psi = c psi+ + psi- (doc/theory.md 2.1)
//
// psi+ is released by a crack and drives it, psi- remains in broken material. c = 1: intact law (2.1); eroded
// material has a small c. Driving split (split_drive) and residual law (split_eroded) are independent.
// ---------------------------------------------------------------------------
#ifndef MPFE_MAT_SPLIT_H
#define MPFE_MAT_SPLIT_H

#include "mat/mat.h"

// Energy, stress and tangent at one strain. Six components in the order 11 22 33 12 23 31; S tensor
// components, C[6][6] = dS/dE for engineering shear columns (Voigt stiffness), symmetric.
struct SplitOut {
  double psi_plus, psi_minus;  // force/length^2
  double Sp[6], Sm[6];         // force/length^2
  double Cp[36], Cm[36];       // force/length^2; zero without tangent
  bool tangent = true;
  double* of_plus() { return tangent ? Cp : nullptr; }
  double* of_minus() { return tangent ? Cm : nullptr; }
};

// ---------------------------------------------------------------------------
// split_full : the two parts of energy, stress and tangent in three dimensions
//
//   in   law      lam3 and mu are used
//        finite   NLGEOM: SPLIT_PRESSURE takes J - 1 of E, otherwise tr E
//        E        strain, tensor components           [6]; plane strain: E33 = 0
//        N        unit normal of the crack            [3]; used by SPLIT_RCE and SPLIT_CRACK
//        tangent  compute it?
//   out  out      at a kink (tr E, E_a, s_n or J - 1 = 0) the tangent of the closed side
//   theory        doc/theory.md: (2.5) - (2.10), (2.18)
//   fails         SPLIT_PRESSURE with finite, 2E + I not positive definite: both psi NaN, all S and C zero
// ---------------------------------------------------------------------------
void split_full(const MatLaw& law, Split split, bool finite, const double E[6], const double N[3],
                SplitOut& out, bool tangent = true);

// ---------------------------------------------------------------------------
// split_normal : direction of the largest principal stress of the intact law, in the plane for dim 2
//
//   in   E        plane components                    [dim*dim]
//   out  N        unit vector                         [3]; any if principal stresses are equal; or null
//   returns       largest principal stress            force/length^2
// ---------------------------------------------------------------------------
double split_normal(const MatLaw& law, int dim, const double* E, double* N);

// ---------------------------------------------------------------------------
// split_drive : psi+ of the intact state, for the fracture criterion
//
//   in   E        plane components                    [dim*dim]; plane stress: E33 of (2.2)
//   returns       psi+, with the normal of split_normal         force/length^2
//   theory        doc/theory.md: (2.5) - (2.11). SPLIT_PRESSURE may give psi+ < 0 under strong compression
//   fails         as split_full: NaN; also for E33 of (2.2) below -1/2
// ---------------------------------------------------------------------------
double split_drive(const MatLaw& law, int dim, Split split, bool finite, const double* E);

// ---------------------------------------------------------------------------
// split_eroded : energy, stress and tangent of psi = c psi+ + psi- in the components of the kernel
//
//   in   c        residual fraction of the stiffness, 0 ... 1
//        E        plane components                    [dim*dim]
//        N        unit normal of the crack            [3]; used by SPLIT_RCE and SPLIT_CRACK
//   out  psi      energy per volume at t = 0          force/length^2
//        S        stress                              [dim*dim]  force/length^2
//        C        dS/dE, engineering shear columns    [nv*nv], nv = 3 (11 22 12) or 6 (11 22 33 12 23 31);
//                 or null
//   theory        doc/theory.md: (2.12), (2.13). Plane stress: S33 = 0, C condensed
//   fails         as split_full: psi NaN, S and C zero; plane stress: if the plane part of 2E + I is not
//                 positive definite, and with c = 1 if E33 of (2.2) is below -1/2. The caller rejects the
//                 step
// ---------------------------------------------------------------------------
void split_eroded(const MatLaw& law, int dim, Split split, bool finite, double c, const double* E,
                  const double N[3], double* psi, double* S, double* C);

// ---------------------------------------------------------------------------
// split_kink : the law of broken material as a quadratic form and a function of one variable j with a kink
//
//   psi = quadratic + w/2 <side j>_+^2       RCE: j = s_n, side 1;  VD: j = tr E;
//                                            PRESSURE with NLGEOM: j = J - 1;  CRACK: j = N.E.N, side -1
//
//   in   as split_eroded;   order: 0: j, 1: and dj/dE, 2: and d2j/dE2
//   out  kink     j, dj/dE, d2j/dE2 (engineering shear columns), w, side
//   returns       false: 2E + I is not positive definite
//   theory        doc/theory.md: (2.6), (2.8), (2.10), (2.17), (2.18)
//
// split_has_kink : has the law this form? Not SPECTRAL; in plane stress only CRACK
// ---------------------------------------------------------------------------
struct SplitKink {
  double j, w;
  int side;
  double G[9], D[36];          // [dim*dim], [nv*nv]
};

bool split_has_kink(const MatLaw& law, Split split);
bool split_kink(const MatLaw& law, int dim, Split split, bool finite, double c, const double* E,
                const double N[3], int order, SplitKink& kink);

#endif
