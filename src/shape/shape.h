// ---------------------------------------------------------------------------
// shape.h : shape functions, Gauss rules, CPDI2 weights (doc/theory.md 1, 3)
// ---------------------------------------------------------------------------
#ifndef MPFE_SHAPE_SHAPE_H
#define MPFE_SHAPE_SHAPE_H

#include "model/element_table.h"

struct GaussRule {
  int n;
  double xi[MAX_GAUSS][3];
  double w[MAX_GAUSS];
};

// gauss_rule      : rule of the stiffness: full (exact for parallelograms), or reduced (shapes R)
// gauss_rule_mass : rule that integrates N_a N_b exactly on parallelograms and straight simplices
const GaussRule& gauss_rule(Shape s);
const GaussRule& gauss_rule_mass(Shape s);

// shape_eval : N [nen] and, unless null, dN/dxi [nen*dim] at the local coordinates xi
//   triangles, tetrahedra: xi >= 0, sum <= 1; quadrilaterals, bricks: -1 ... 1; pyramids: t >= 0, |r| and |s|
//   at most 1-t
void shape_eval(Shape s, const double* xi, double* N, double* dN);

// shape_jacobian : dN/dX [nen*dim] from dN/dxi and the nodal coordinates X [nen*dim]; returns det(dX/dxi)
double shape_jacobian(Shape s, const double* dN, const double* X, double* dNdX);

// shape_inverse : local coordinates of x in a cell with nodes X [nen*dim] by Newton's method; false: not
// converged. The caller tests whether x is inside (shape_inside).
bool shape_inverse(Shape s, const double* X, const double* x, double* xi);
bool shape_inside(Shape s, const double* xi, double tolerance);

// shape_locate : local coordinates xi[3] of x in a cell with corners X [nen*dim]; false: x is outside
bool shape_locate(Shape s, const double* X, const double x[3], double xi[3]);

// shape_mass : m [pairs a >= b] = density int N_a N_b dV of a cell with nodes X [nen*dim]
void shape_mass(Shape s, const double* X, double density, double* m);

// cpdi_weights : domain of a material point with corners X [nen*dim]
//   out  w [nen]      int M_c dV / V              sum 1
//        G [nen*dim]  int dM_c/dX dV / V          sum 0, sum_c G_c (x) X_c = I
//   returns V (area in 2D); V <= 0: inverted. doc/theory.md (3.2) - (3.4)
double cpdi_weights(Shape s, const double* X, double* w, double* G);

#endif
