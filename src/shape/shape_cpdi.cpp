#include "shape/shape.h"

namespace {

// closed form, doc/theory.md (3.2): w_c = (V + A_c) / (6 V), A_c the triangle of a corner and its neighbours
double cpdi_quad(const double* X, double* w, double* G)
{
  const double V = 0.5 * ((X[0] - X[4]) * (X[3] - X[7]) - (X[2] - X[6]) * (X[1] - X[5]));
  for (int c = 0; c < 4; ++c) {
    const double *x = X + 2 * c, *n = X + 2 * ((c + 1) % 4), *p = X + 2 * ((c + 3) % 4);
    const double A = 0.5 * ((n[0] - x[0]) * (p[1] - x[1]) - (p[0] - x[0]) * (n[1] - x[1]));
    w[c]         = (V + A) / (6.0 * V);
    G[2 * c]     = (n[1] - p[1]) / (2.0 * V);
    G[2 * c + 1] = (p[0] - n[0]) / (2.0 * V);
  }
  return V;
}

}  // namespace

// Gauss rule of the element: exact for bricks (2 x 2 x 2) and wedges, and for simplices
double cpdi_weights(Shape s, const double* X, double* w, double* G)
{
  if (s == SHAPE_QUAD4) return cpdi_quad(X, w, G);
  const int dim = shape_info[s].dim, nen = shape_info[s].nen;
  const GaussRule& rule = gauss_rule(s);
  double N[8], dN[24], dNdX[24], V = 0.0;
  for (int c = 0; c < nen; ++c) w[c] = 0.0;
  for (int i = 0; i < nen * dim; ++i) G[i] = 0.0;
  for (int g = 0; g < rule.n; ++g) {
    shape_eval(s, rule.xi[g], N, dN);
    const double dv = shape_jacobian(s, dN, X, dNdX) * rule.w[g];
    V += dv;
    for (int c = 0; c < nen; ++c) w[c] += N[c] * dv;
    for (int i = 0; i < nen * dim; ++i) G[i] += dNdX[i] * dv;
  }
  for (int c = 0; c < nen; ++c) w[c] /= V;
  for (int i = 0; i < nen * dim; ++i) G[i] /= V;
  return V;
}
