#include <cmath>

#include "base/log.h"
#include "shape/shape.h"

namespace {

// points of the tensor rule in the order of CalculiX: x varies fastest
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

// three points along each axis, exact to the fifth degree
GaussRule tensor_rule_3(int dim)
{
  const double g = std::sqrt(0.6), at[3] = {-g, 0.0, g}, w[3] = {5.0 / 9, 8.0 / 9, 5.0 / 9};
  GaussRule r{};
  r.n = dim == 2 ? 9 : 27;
  for (int k = 0; k < r.n; ++k) {
    const int i = k % 3, j = k / 3 % 3, l = k / 9;
    r.xi[k][0] = at[i];
    r.xi[k][1] = at[j];
    r.xi[k][2] = dim == 3 ? at[l] : 0.0;
    r.w[k]     = w[i] * w[j] * (dim == 3 ? w[l] : 1.0);
  }
  return r;
}

// exact to the first, second, fourth degree: 1, 3, 6 points
GaussRule tri_rule(int n)
{
  if (n == 1) return {1, {{1.0 / 3, 1.0 / 3, 0}}, {0.5}};
  if (n == 6) {
    const double a[2] = {0.44594849091596488632, 0.09157621350977074346},
                 w[2] = {0.22338158967801146570, 0.10995174365532186764};
    GaussRule r{};
    r.n = 6;
    for (int k = 0; k < 6; ++k) {
      r.xi[k][0] = r.xi[k][1] = a[k / 3];
      if (k % 3) r.xi[k][k % 3 - 1] = 1.0 - 2.0 * a[k / 3];
      r.w[k] = 0.5 * w[k / 3];
    }
    return r;
  }
  const double a = 1.0 / 6, b = 2.0 / 3;
  return {3, {{a, a, 0}, {b, a, 0}, {a, b, 0}}, {a, a, a}};
}

// exact to the fifth degree (Walkington)
GaussRule tet_rule_14()
{
  const double a[2] = {0.31088591926330060980, 0.09273525031089122640},
               w[2] = {0.11268792571801585080, 0.07349304311636194954};
  const double b = 0.04550370412564964949, v = 0.04254602077708146644;
  GaussRule r{};
  r.n = 14;
  for (int k = 0; k < 8; ++k) {
    for (double& x : r.xi[k]) x = a[k / 4];
    if (k % 4) r.xi[k][k % 4 - 1] = 1.0 - 3.0 * a[k / 4];
    r.w[k] = w[k / 4] / 6.0;
  }
  for (int k = 0, i = 0; i < 4; ++i)               // on the lines between midpoints of opposite edges
    for (int j = 0; j < i; ++j, ++k) {
      for (int c = 0; c < 3; ++c) r.xi[8 + k][c] = c == i || c == j ? 0.5 - b : b;
      r.w[8 + k] = v / 6.0;
    }
  return r;
}

// exact to the first, second, fifth degree: 1, 4, 14 points
GaussRule tet_rule(int n)
{
  if (n == 1) return {1, {{0.25, 0.25, 0.25}}, {1.0 / 6}};
  if (n == 14) return tet_rule_14();
  const double a = 0.13819660112501052, b = 1.0 - 3.0 * a, w = 1.0 / 24;
  return {4, {{a, a, a}, {b, a, a}, {a, b, a}, {a, a, b}}, {w, w, w, w}};
}

// a rule of the triangle at each of 2 or 3 points of the axis, from the bottom
GaussRule wedge_rule(int triangle, int axis)
{
  const GaussRule t = tri_rule(triangle);
  const double g = axis == 2 ? 1.0 / std::sqrt(3.0) : std::sqrt(0.6);
  GaussRule r{};
  r.n = triangle * axis;
  for (int k = 0; k < r.n; ++k) {
    const int i = k % triangle, layer = k / triangle;
    r.xi[k][0] = t.xi[i][0];
    r.xi[k][1] = t.xi[i][1];
    r.xi[k][2] = g * (layer == 0 ? -1.0 : layer == axis - 1 ? 1.0 : 0.0);
    r.w[k]     = t.w[i] * (axis == 2 ? 1.0 : layer == 1 ? 8.0 / 9 : 5.0 / 9);
  }
  return r;
}

// Points of a square that shrinks towards the apex, 2 by 2 on each of 1 or 2 levels (Gauss-Jacobi, weight
// (1-t)^2): exact for the stiffness, and for N_a N_b, on pyramids with a parallelogram as base
GaussRule pyramid_rule(int levels)
{
  const double r = std::sqrt(2.0 / 45.0);            // roots 1/3 -+ r of t^2 - 2t/3 + 1/15
  const double t[2] = {levels == 1 ? 0.25 : 1.0 / 3 - r, 1.0 / 3 + r};
  // weights from the moments 1/3 and 1/12 of 1 and t
  const double upper = levels == 1 ? 0.0 : (1.0 / 12 - t[0] / 3) / (t[1] - t[0]);
  const double w[2]  = {1.0 / 3 - upper, upper};
  const GaussRule square = tensor_rule(2);
  GaussRule rule{};
  rule.n = 4 * levels;
  for (int k = 0; k < rule.n; ++k) {
    const int level = k / 4;
    for (int i = 0; i < 2; ++i) rule.xi[k][i] = square.xi[k % 4][i] * (1.0 - t[level]);
    rule.xi[k][2] = t[level];
    rule.w[k]     = w[level];
  }
  return rule;
}

}  // namespace

const GaussRule& gauss_rule(Shape s)
{
  static const GaussRule tri = tri_rule(1), quad = tensor_rule(2), tet = tet_rule(1),
                         wedge = wedge_rule(3, 2), hex = tensor_rule(3), pyramid = pyramid_rule(1);
  static const GaussRule tri3 = tri_rule(3), tet4 = tet_rule(4), quad9 = tensor_rule_3(2),
                         wedge9 = wedge_rule(3, 3), hex27 = tensor_rule_3(3);
  switch (s) {
    case SHAPE_TRI3: return tri;
    case SHAPE_QUAD4: return quad;
    case SHAPE_TET4: return tet;
    case SHAPE_WEDGE6: return wedge;
    case SHAPE_TRI6: return tri3;
    case SHAPE_QUAD8: return quad9;
    case SHAPE_QUAD8R: return quad;
    case SHAPE_TET10: return tet4;
    case SHAPE_WEDGE15: return wedge9;
    case SHAPE_HEX20: return hex27;
    case SHAPE_PYR5: return pyramid;
    case SHAPE_HEX8: case SHAPE_HEX20R: return hex;
    case SHAPES: break;
  }
  MPFE_CHECK(false, "gauss_rule: no shape");
}

const GaussRule& gauss_rule_mass(Shape s)
{
  static const GaussRule tri = tri_rule(3), tet = tet_rule(4), tri6 = tri_rule(6), tet10 = tet_rule(14),
                         wedge18 = wedge_rule(6, 3), pyramid8 = pyramid_rule(2);
  switch (s) {
    case SHAPE_TRI3: return tri;
    case SHAPE_TET4: return tet;
    case SHAPE_TRI6: return tri6;
    case SHAPE_TET10: return tet10;
    case SHAPE_WEDGE15: return wedge18;
    case SHAPE_QUAD8R: return gauss_rule(SHAPE_QUAD8);
    case SHAPE_HEX20R: return gauss_rule(SHAPE_HEX20);
    case SHAPE_PYR5: return pyramid8;
    case SHAPE_QUAD4: case SHAPE_WEDGE6: case SHAPE_HEX8: case SHAPE_QUAD8: case SHAPE_HEX20: case SHAPES:
      break;
  }
  return gauss_rule(s);
}

void shape_mass(Shape s, const double* X, double density, double* m)
{
  const int nen = shape_info[s].nen;
  const GaussRule& rule = gauss_rule_mass(s);
  double N[MAX_NODES], dN[3 * MAX_NODES], dNdX[3 * MAX_NODES];
  for (int k = 0; k < nen * (nen + 1) / 2; ++k) m[k] = 0.0;
  for (int g = 0; g < rule.n; ++g) {
    shape_eval(s, rule.xi[g], N, dN);
    const double dm = density * rule.w[g] * shape_jacobian(s, dN, X, dNdX);
    for (int a = 0, k = 0; a < nen; ++a)
      for (int b = 0; b <= a; ++b, ++k) m[k] += dm * N[a] * N[b];
  }
}
