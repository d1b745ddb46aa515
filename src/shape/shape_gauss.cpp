#include <cmath>

#include "shape/shape.h"

namespace {

// points of the tensor rule in the order of the nodes of CalculiX: x runs first
GaussRule tensor_rule(int dim)
{
  const double g = 1.0 / std::sqrt(3.0), at[2] = {-g, g};
  GaussRule r{};
  r.n = dim == 2 ? 4 : 8;
  for (int k = 0; k < r.n; ++k) {
    r.xi[k][0] = at[k & 1];
    r.xi[k][1] = at[(k >> 1) & 1];
    r.xi[k][2] = dim == 3 ? at[(k >> 2) & 1] : 0.0;
    r.w[k]     = 1.0;
  }
  return r;
}

GaussRule tri_rule(int n)
{
  if (n == 1) return {1, {{1.0 / 3, 1.0 / 3, 0}}, {0.5}};
  const double a = 1.0 / 6, b = 2.0 / 3;
  return {3, {{a, a, 0}, {b, a, 0}, {a, b, 0}}, {a, a, a}};
}

GaussRule tet_rule(int n)
{
  if (n == 1) return {1, {{0.25, 0.25, 0.25}}, {1.0 / 6}};
  const double a = 0.13819660112501052, b = 1.0 - 3.0 * a, w = 1.0 / 24;
  return {4, {{a, a, a}, {b, a, a}, {a, b, a}, {a, a, b}}, {w, w, w, w}};
}

GaussRule wedge_rule()
{
  const GaussRule t = tri_rule(3);
  const double g = 1.0 / std::sqrt(3.0);
  GaussRule r{};
  r.n = 6;
  for (int k = 0; k < 6; ++k) {
    r.xi[k][0] = t.xi[k % 3][0];
    r.xi[k][1] = t.xi[k % 3][1];
    r.xi[k][2] = k < 3 ? -g : g;
    r.w[k]     = t.w[k % 3];
  }
  return r;
}

}  // namespace

const GaussRule& gauss_rule(Shape s)
{
  static const GaussRule tri = tri_rule(1), quad = tensor_rule(2), tet = tet_rule(1), wedge = wedge_rule(),
                         hex = tensor_rule(3);
  switch (s) {
    case SHAPE_TRI3: return tri;
    case SHAPE_QUAD4: return quad;
    case SHAPE_TET4: return tet;
    case SHAPE_WEDGE6: return wedge;
    default: return hex;
  }
}

const GaussRule& gauss_rule_mass(Shape s)
{
  static const GaussRule tri = tri_rule(3), tet = tet_rule(4);
  if (s == SHAPE_TRI3) return tri;
  if (s == SHAPE_TET4) return tet;
  return gauss_rule(s);
}

void shape_mass(Shape s, const double* X, double density, double* m)
{
  const int nen = shape_info[s].nen;
  const GaussRule& rule = gauss_rule_mass(s);
  double N[8], dN[24], dNdX[24];
  for (int k = 0; k < nen * (nen + 1) / 2; ++k) m[k] = 0.0;
  for (int g = 0; g < rule.n; ++g) {
    shape_eval(s, rule.xi[g], N, dN);
    const double dm = density * rule.w[g] * shape_jacobian(s, dN, X, dNdX);
    for (int a = 0, k = 0; a < nen; ++a)
      for (int b = 0; b <= a; ++b, ++k) m[k] += dm * N[a] * N[b];
  }
}
