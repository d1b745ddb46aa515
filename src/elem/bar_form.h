// ---------------------------------------------------------------------------
// bar_form.h : integration points that share one change of volume (doc/theory.md 1.1)
//
// Full integration of (nearly) incompressible flow constrains the volume at each integration point, more
// constraints than the nodes can satisfy: the mesh locks. The points of a group, an element or the material
// points of an initial cell, use the mean of the logarithm of their volumes instead (F-bar, selective reduced
// integration):
//
//   Fbar = exp[(thetabar - theta)/3] F,  theta = ln J,  thetabar = sum w theta / sum w      (1.14)
//
// The force is the derivative of the energy of Fbar, and over a step of the energy-momentum scheme its
// discrete gradient: f . du = sum w S : dEbar exactly                                        (1.16)
// volume_penalty k adds the energy sum w k (theta - thetabar)^2 / 2                          (1.14a)
// ---------------------------------------------------------------------------
#ifndef MPFE_ELEM_BAR_FORM_H
#define MPFE_ELEM_BAR_FORM_H

#include "elem/kernel_general.h"

struct BarGroup {
  int dim, ngp, nn;            // integration points, nodes
  // [ngp][nn][dim] of the nodes that the force acts on; not needed for strains               1/length
  const double* dNdX;
  const double* w;             // [ngp]                                                       length^3
  const MatLaw* law;
  double volume_penalty = 0.0; // stiffness of theta - thetabar at each point                   force/length^2
};

// bar_strains : strains Ebar of a group
//   in   H        displacement gradients               [ngp][dim*dim]
//   out  E        [ngp][6]
//        scale    (Jbar/J)^(1/3), unless null          [ngp]
//   returns       false: det F <= 0 at an integration point
bool bar_strains(const BarGroup& g, bool finite, const double* H, double* E, double* scale);

// bar_form : force and, unless ke is null, tangent of a group
//   in   H0, H1   displacement gradients at t(n), t(n+1) [ngp][dim*dim]; H0: when mode_reads_old
//        h        history of each integration point     [ngp]
//   out  re       [nn*dim];  ke [pairs a >= b][dim*dim]
//   BAD_JACOBIAN: det F(n+1) <= 0
Status bar_form(const BarGroup& g, const KernelMode& mode, const double* H0, const double* H1,
                const HistoryStep* h, double* re, double* ke);

#endif
