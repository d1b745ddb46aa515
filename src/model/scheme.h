// ---------------------------------------------------------------------------
// scheme.h : time integration schemes (doc/theory.md 6.3), one table
//
// An increment solves  cM M du - g + C (cC du + v) + fint - fext = 0  for its displacement du. A scheme gives
// cM, g, cC, v, and the velocities and accelerations at the end of the increment. Statics have cM = cC = 0
// and no scheme.
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_SCHEME_H
#define MPFE_MODEL_SCHEME_H

#include <string>

#include "model/model.h"

struct Scheme {
  const char* name;
  // loads at the middle of the increment, stresses as discrete gradients: energy-momentum
  bool midpoint;
  bool acceleration;           // nodes store an acceleration
  bool force;                  // uses the force at t(n)
  // factor of the mass                                                                        1/time^2
  double (*mass)(const Step& s, double dt);
  // g of one unknown; at t(n): p = M v, Ma = M a, f = fint - fext - reactions                  force
  double (*known)(const Step& s, double dt, double p, double Ma, double f);
  // damping: factor of C, and the part of its velocity independent of du; v, a at t(n)           (6.20)
  double (*damping)(const Step& s, double dt);
  double (*damping_known)(const Step& s, double dt, double v, double a);
  // velocity and acceleration of a node at t(n+1); v, a at t(n)
  void (*node)(const Step& s, double dt, double du, double v, double a, double& v1, double& a1);
  // change of the grid velocity; v projected, a from the forces at t(n)
  double (*grid)(const Step& s, double dt, double du, double v, double a);
  // is it dissipative?
  bool (*dissipates)(const Step& s);
  // its parameters as text, for the listing
  std::string (*describe)(const Step& s);
};

// scheme_of : the scheme of a dynamic step
const Scheme& scheme_of(const Step& s);

#endif
