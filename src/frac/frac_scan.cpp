#include "frac/frac_scan.h"

#include <algorithm>
#include <cmath>

#include "shape/shape.h"

Estimate estimate_of(const Scan& s, int e)
{
  const Estimate given = s.def(e).estimate;
  return given != ESTIMATE_AUTO ? given : s.dynamic() ? ESTIMATE_BALL : ESTIMATE_FORCE;
}

double radius_of(const Scan& s, int e)
{
  const double given = s.def(e).epsilon;
  const bool force   = estimate_of(s, e) == ESTIMATE_FORCE;
  return (given > 0.0 ? given : force ? FRAC_RADIUS_FORCE : FRAC_RADIUS_BALL) * s.fm.local[e];
}

// mean strain of an intact element                                                  [dim*dim]
void mean_strain(const Scan& s, int e, double* E)
{
  const ElemBlock& b    = s.el.block[s.el.initial_block[e]];
  const ShapeInfo& info = shape_info[b.shape];
  const int d2 = s.m.dim * s.m.dim;
  double all[72], volume = 0.0;
  elem_strains(s.m, s.el, e, s.l.u, &s.l.he, s.step.nlgeom, all);
  for (int k = 0; k < d2; ++k) E[k] = 0.0;
  for (int g = 0; g < info.ngp; ++g) {
    const double w = b.w[b.gauss(s.el.slot_of[e]) + g];
    volume += w;
    for (int k = 0; k < d2; ++k) E[k] += w * all[g * d2 + k];
  }
  for (int k = 0; k < d2; ++k) E[k] /= volume;
}

// mean initial strain of an intact element                                          [dim*dim]
void mean_initial(const Scan& s, int e, double* E)
{
  const ElemBlock& b = s.el.block[s.el.initial_block[e]];
  const int d2 = s.m.dim * s.m.dim;
  double with[72], without[72], volume = 0.0;
  elem_strains(s.m, s.el, e, s.l.u, &s.l.he, s.step.nlgeom, with);
  elem_strains(s.m, s.el, e, s.l.u, nullptr, s.step.nlgeom, without);
  std::fill_n(E, d2, 0.0);
  for (int g = 0; g < shape_info[b.shape].ngp; ++g) {
    const double w = b.w[b.gauss(s.el.slot_of[e]) + g];
    volume += w;
    for (int i = 0; i < d2; ++i) E[i] += w * (with[g * d2 + i] - without[g * d2 + i]);
  }
  for (int i = 0; i < d2; ++i) E[i] /= volume;
}

// what a mean initial strain E33 in plane strain adds to all normal stresses               force/length^2
double stress_of_33(const Scan& s, int e)
{
  const ElemBlock& b = s.el.block[s.el.initial_block[e]];
  double sum = 0.0, volume = 0.0;
  for (int g = 0; g < shape_info[b.shape].ngp; ++g) {
    const double w = b.w[b.gauss(s.el.slot_of[e]) + g];
    sum += w * elem_initial33(s.el, s.l.he, e, g);
    volume += w;
  }
  return b.law.lam * sum / volume;
}

namespace {

double drive_by(const Scan& s, int e, Split split)
{
  return frac_drive(s.m, s.step, s.el, s.fm, s.l, e, split);
}

}  // namespace

// psi+ / volume of an intact element by the law of its definition, in dynamics its average over time
double drive_of(Scan& s, int e)
{
  if (s.drive[e] >= 0.0) return s.drive[e];
  if (s.averaged(e)) return s.drive[e] = s.fr.mean[e];
  return s.drive[e] = drive_by(s, e, s.def(e).drive);
}

// the same of a neighbour o of e; if o cannot break: by the law of e
double drive_beside(Scan& s, int e, int o)
{
  return s.fm.def[o] >= 0 ? drive_of(s, o) : drive_by(s, o, s.def(e).drive);
}

double largest_stress(const Scan& s, int e)
{
  double E[9];
  mean_strain(s, e, E);
  return split_normal(s.law(e), s.m.dim, E, nullptr) + stress_of_33(s, e);
}

bool at_removed(const Scan& s, int e) { return beside(s, e, [&](int o) { return s.removed(o); }); }

bool at_initial(const Scan& s, int e)
{
  return beside(s, e, [&](int o) { return s.cracked(o) && !s.grown(o); });
}

// a broken element that shares a node: a crack also grows across corners, off the mesh lines
bool touches_broken(const Scan& s, int e)
{
  const int nen = s.m.mesh.conn.count(e), *node = s.m.mesh.conn.begin(e);
  for (int a = 0; a < nen; ++a)
    for (int k = 0; k < s.fm.of_node.count(node[a]); ++k)
      if (s.broken(s.fm.of_node.begin(node[a])[k])) return true;
  return false;
}

// FORCE: adjacent at a face to a broken or removed element; BALL: at a node of a broken element, or at a
// removed element
bool at_crack(const Scan& s, int e)
{
  if (estimate_of(s, e) == ESTIMATE_FORCE) return beside(s, e, [&](int o) { return s.cracked(o); });
  return touches_broken(s, e);
}

// weight of a cracked element o in the ball of e; a removed element has no volume
double crack_share(const Scan& s, int e, int o) { return s.fm.volume[s.fm.volume[o] > 0.0 ? o : e]; }

// unit vector to x from the centre of the cracked elements within radius; false: none, or nearer than least
bool grown_along(const Scan& s, int e, const double* x, double radius, double least, double* d)
{
  double mid[3] = {0, 0, 0}, volume = 0.0, norm = 0.0;
  frac_in_ball(s.fm, &s.fm.centre[3 * e], radius * AT_RADIUS, [&](int o, double) {
    if (!s.cracked(o)) return;
    const double v = crack_share(s, e, o);
    volume += v;
    for (int i = 0; i < 3; ++i) mid[i] += v * s.fm.centre[3 * o + i];
  });
  if (volume == 0.0) return false;
  for (int i = 0; i < 3; ++i) {
    d[i] = x[i] - mid[i] / volume;
    norm += d[i] * d[i];
  }
  for (int i = 0; i < 3; ++i) d[i] /= std::sqrt(norm);
  return norm > least * least;
}
