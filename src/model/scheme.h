// ---------------------------------------------------------------------------
// scheme.h : time integration schemes (doc/theory.md 6.3), one table
//
// An increment solves  cM M du - g + C (cC du + v) + fint - fext = 0  for du, its displacement. A scheme says
// what cM, g, cC and v are, and which velocities and accelerations the increment ends with. In statics
// cM = cC = 0 and there is no scheme.
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_SCHEME_H
#define MPFE_MODEL_SCHEME_H

#include <string>

#include "model/model.h"

struct Scheme {
  const char* name;
  // loads of the middle of the increment, stresses as discrete gradients: energy-momentum
  bool midpoint;
  bool acceleration;           // nodes keep an acceleration from one increment to the next
  bool force;                  // asks for the force at t(n)
  // factor of the mass                                                                        1/time^2
  double (*mass)(const Step& s, double dt);
  // g of one unknown; at t(n): p = M v, Ma = M a, f = fint - fext - reactions                  force
  double (*known)(const Step& s, double dt, double p, double Ma, double f);
  // damping: factor of C, and what of its velocity does not depend on du; v, a at t(n)           (6.20)
  double (*damping)(const Step& s, double dt);
  double (*damping_known)(const Step& s, double dt, double v, double a);
  // velocity and acceleration of a node at t(n+1); v, a at t(n)
  void (*node)(const Step& s, double dt, double du, double v, double a, double& v1, double& a1);
  // change of the velocity of the grid; v projected, a from its forces at t(n)
  double (*grid)(const Step& s, double dt, double du, double v, double a);
  // does it lose energy on purpose?
  bool (*dissipates)(const Step& s);
  // its numbers in words, for the listing
  std::string (*describe)(const Step& s);
};

// scheme_of : the scheme of a dynamic step
const Scheme& scheme_of(const Step& s);

#endif
