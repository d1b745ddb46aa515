#include "model/scheme.h"

#include <cstdio>

namespace {

std::string text_of(const char* form, double a, double b = 0.0, double c = 0.0)
{
  char text[100];
  std::snprintf(text, sizeof text, form, a, b, c);
  return text;
}

// ---- Newmark                                                                            (6.7), (6.8)

double newmark_mass(const Step& s, double dt) { return 1.0 / (s.beta * dt * dt); }

double newmark_known(const Step& s, double dt, double p, double Ma, double)
{
  return p / (s.beta * dt) + (1.0 - 2.0 * s.beta) / (2.0 * s.beta) * Ma;
}

double newmark_damping(const Step& s, double dt) { return s.gamma / (s.beta * dt); }

double newmark_damping_known(const Step& s, double dt, double v, double a)
{
  return (1.0 - s.gamma / s.beta) * v + dt * (1.0 - s.gamma / (2.0 * s.beta)) * a;
}

void newmark_node(const Step& s, double dt, double du, double v, double a, double& v1, double& a1)
{
  a1 = (du - dt * v) / (s.beta * dt * dt) - (1.0 - 2.0 * s.beta) / (2.0 * s.beta) * a;
  v1 = v + dt * ((1.0 - s.gamma) * a + s.gamma * a1);
}

double newmark_grid(const Step& s, double dt, double du, double v, double a)
{
  return s.gamma / s.beta * (du / dt - v) + dt * (1.0 - s.gamma / (2.0 * s.beta)) * a;
}

bool newmark_dissipates(const Step& s) { return s.gamma > 0.5; }

std::string newmark_describe(const Step& s) { return text_of("beta %g, gamma %g", s.beta, s.gamma); }

// ---- Simo and Tarnow                                                                           (6.9)

double momentum_mass(const Step&, double dt) { return 2.0 / (dt * dt); }

double momentum_known(const Step&, double dt, double p, double, double) { return p * (2.0 / dt); }

double momentum_damping(const Step&, double dt) { return 1.0 / dt; }

double momentum_damping_known(const Step&, double, double, double) { return 0.0; }

void momentum_node(const Step&, double dt, double du, double v, double, double& v1, double& a1)
{
  v1 = 2.0 * du / dt - v;
  a1 = (v1 - v) / dt;
}

double momentum_grid(const Step&, double dt, double du, double v, double) { return 2.0 * (du / dt - v); }

bool momentum_dissipates(const Step& s) { return s.dissipation > 0.0; }

std::string momentum_describe(const Step& s) { return text_of("dissipation %g", s.dissipation); }

// ---- Hilber, Hughes and Taylor: Newmark's motion, forces at n + 1 + alpha; divided by 1 + alpha  (6.17)

double hht_mass(const Step& s, double dt) { return newmark_mass(s, dt) / (1.0 + s.alpha); }

double hht_known(const Step& s, double dt, double p, double Ma, double f)
{
  return (newmark_known(s, dt, p, Ma, 0.0) + s.alpha * f) / (1.0 + s.alpha);
}

double hht_damping_known(const Step& s, double dt, double v, double a)
{
  return newmark_damping_known(s, dt, v, a) - s.alpha / (1.0 + s.alpha) * v;
}

bool hht_dissipates(const Step& s) { return s.alpha < 0.0; }

std::string hht_describe(const Step& s)
{
  return text_of("alpha %g, beta %g, gamma %g", s.alpha, s.beta, s.gamma);
}

// ---- central differences: Newmark with beta = 0, gamma = 1/2; the acceleration at t(n+1) follows from the
// forces there (step_explicit.cpp)                                                      (6.28)

double central_mass(const Step&, double dt) { return 2.0 / (dt * dt); }

double central_known(const Step&, double, double, double, double) { return 0.0; }

double central_damping(const Step&, double dt) { return 1.0 / dt; }

double central_damping_known(const Step&, double, double, double) { return 0.0; }

void central_node(const Step&, double dt, double du, double v, double a, double& v1, double& a1)
{
  v1 = 2.0 * du / dt - v;
  a1 = a;
}

double central_grid(const Step&, double dt, double du, double v, double) { return 2.0 * (du / dt - v); }

bool central_dissipates(const Step&) { return false; }

std::string central_describe(const Step& s)
{
  return text_of("explicit, %g of the largest stable increment", s.safety);
}

//   name, mid, accel, force, mass, known, damping, damping_known, node, grid, dissipates, describe
const Scheme table[] = {
    {"Newmark", false, true, false, newmark_mass, newmark_known, newmark_damping, newmark_damping_known,
     newmark_node, newmark_grid, newmark_dissipates, newmark_describe},
    {"energy-momentum", true, false, false, momentum_mass, momentum_known, momentum_damping,
     momentum_damping_known, momentum_node, momentum_grid, momentum_dissipates, momentum_describe},
    {"Hilber, Hughes and Taylor", false, true, true, hht_mass, hht_known, newmark_damping,
     hht_damping_known, newmark_node, newmark_grid, hht_dissipates, hht_describe},
    {"central differences", false, true, false, central_mass, central_known, central_damping,
     central_damping_known, central_node, central_grid, central_dissipates, central_describe},
};

}  // namespace

const Scheme& scheme_of(const Step& s) { return table[s.scheme]; }
