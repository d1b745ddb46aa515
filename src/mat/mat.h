// ---------------------------------------------------------------------------
// mat.h : constitutive laws at an integration point (doc/theory.md 2)
// ---------------------------------------------------------------------------
#ifndef MPFE_MAT_MAT_H
#define MPFE_MAT_MAT_H

#include "model/model.h"

struct BulkStep;               // elem.h

// Tangent of cohesive cracks: consistent; secant, positive definite (2.36); loading tangent of a crack at its
// largest opening (6.39); none, in explicit steps: where the width changes the stress is the mean of both
enum CrackTangent { CRACK_TANGENT, CRACK_SECANT, CRACK_ONWARD, CRACK_MEAN };

// Parameters of the time scheme for the law over a step t(n) -> t(n+1)                 (1.8)
struct KernelMode {
  bool finite = true;          // NLGEOM
  bool mid    = false;         // energy-momentum
  bool is_static = false;      // statics: broken material has a shear stiffness against wrinkling (2.16)
  double s_new = 1.0, s_old = 0.0;
  CrackTangent crack = CRACK_TANGENT;
  // viscous stress: factor of E(n+1) - E(n) in dE/dt; 1/dt, Newmark gamma/(beta dt); statics: 0     1/time
  double rate = 0.0;
  BulkStep* bulk = nullptr;          // bulk viscosity of elements (6.35), (6.49); null: none
  double cD() const { return s_new; }
  double cG() const { return !finite ? 0.0 : mid ? 0.5 : 1.0; }
};

// Cohesive crack: LAW_COHESIVE, LAW_COHESIVE_FLOW
struct CrackLaw {
  Softening softening = SOFTENING_LINEAR;
  double strength = 0.0;       // force/length^2
  double gc       = 0.0;       // toughness                                     force/length
  double scatter  = 1.0;       // factor of both
  const double* X = nullptr;   // nodes of the element [nodes*dim], relative to the first one
  int nodes = 0, dim = 0;
  // material point instead: edges of the box that opens, along the axes of space, and its F at t(n) (2.36a)
  double box[3] = {0, 0, 0}, F[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};
  double band = 0.0;           // material point: width of its band by the cells at t(n) (2.36b), 0: it stays
  double across[3] = {0, 0, 0};        // mean normal of the cracks of the element at t(n); 0: widths stay
  CrackTangent tangent = CRACK_TANGENT;      // KernelMode
};

// St.Venant-Kirchhoff: S = lam tr(E) I + 2 mu E. In plane stress lam is reduced, so that the law of the plane
// components has the same form.
struct MatLaw {
  double lam = 0, mu = 0;      // of the components of the kernel                 force/length^2
  double lam3 = 0;             // lam in three dimensions
  double beta = 0;             // viscous stress beta D : dE/dt, D of lam and mu                  time
  Plane plane = PLANE_STRAIN;
  LawKind kind = LAW_SVK;
  bool broken = false;         // det F is not checked: with an open crack it may have any value
  Split split = SPLIT_RCE;     // LAW_SPLIT
  double c = 1.0, friction = 0.0;      // degradation factor; LAW_GRANULAR: tangent of the angle
  double N[3] = {1, 0, 0};     // LAW_SPLIT: normal of the crack at t = 0, unit
  bool bar = false;            // integration points share their change of volume (1.14)
  const Material* material = nullptr;  // of the model, which is const
  CrackLaw crack;              // LAW_COHESIVE
  int initial = -1;            // index of the initial strain in the history, -1: none (2.44)
};

MatLaw mat_law(const Material& m, Plane plane);

// mat_stiffness : modulus of a laterally constrained layer: E(1-nu)/((1+nu)(1-2nu)), for nu towards 0.5 the
// bulk modulus; of a sheet in plane stress E/(1-nu^2)                              force/length^2
double mat_stiffness(const Material& m, Plane plane);

// bulk_modulus : K in three dimensions                                       force/length^2
inline double bulk_modulus(const MatLaw& law) { return law.lam3 + 2.0 / 3.0 * law.mu; }

// mode_of_law : the mode with the viscous stress of this law                         (2.19)
inline KernelMode mode_of_law(const KernelMode& mode, const MatLaw& law)
{
  KernelMode of = mode;
  of.s_new += law.beta * mode.rate;
  of.s_old -= law.beta * mode.rate;
  return of;
}

// mode_reads_old : does the kernel read the displacements at t(n)?
inline bool mode_reads_old(const KernelMode& mode, const MatLaw& law)
{
  return mode.mid || law.beta * mode.rate != 0.0;
}

// law_broken : law of broken material by fracture definition f, with the degradation factor c and the frozen
// normal N[3]: LAW_GRANULAR or LAW_SPLIT
MatLaw law_broken(const MatLaw& intact, const FractureDef& f, double c, const double* N);

// mat_full : plane components -> all six (11 22 33 12 23 31, tensor) of E and S
void mat_full(const MatLaw& law, int dim, double E[6], double S[6]);

#endif
