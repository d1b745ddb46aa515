#include <cmath>

#include "shape/shape.h"

namespace {

void tri3(const double* xi, double* N, double* dN)
{
  N[0] = 1.0 - xi[0] - xi[1];
  N[1] = xi[0];
  N[2] = xi[1];
  if (!dN) return;
  const double d[6] = {-1, -1, 1, 0, 0, 1};
  for (int i = 0; i < 6; ++i) dN[i] = d[i];
}

void tet4(const double* xi, double* N, double* dN)
{
  N[0] = 1.0 - xi[0] - xi[1] - xi[2];
  for (int i = 0; i < 3; ++i) N[i + 1] = xi[i];
  if (!dN) return;
  const double d[12] = {-1, -1, -1, 1, 0, 0, 0, 1, 0, 0, 0, 1};
  for (int i = 0; i < 12; ++i) dN[i] = d[i];
}

const double corner_sign[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                  {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};

void quad4(const double* xi, double* N, double* dN)
{
  for (int a = 0; a < 4; ++a) {
    const double r = 1.0 + corner_sign[a][0] * xi[0], s = 1.0 + corner_sign[a][1] * xi[1];
    N[a] = 0.25 * r * s;
    if (!dN) continue;
    dN[2 * a]     = 0.25 * corner_sign[a][0] * s;
    dN[2 * a + 1] = 0.25 * corner_sign[a][1] * r;
  }
}

void hex8(const double* xi, double* N, double* dN)
{
  for (int a = 0; a < 8; ++a) {
    const double* c = corner_sign[a];
    const double r = 1.0 + c[0] * xi[0], s = 1.0 + c[1] * xi[1], t = 1.0 + c[2] * xi[2];
    N[a] = 0.125 * r * s * t;
    if (!dN) continue;
    dN[3 * a]     = 0.125 * c[0] * s * t;
    dN[3 * a + 1] = 0.125 * c[1] * r * t;
    dN[3 * a + 2] = 0.125 * c[2] * r * s;
  }
}

void wedge6(const double* xi, double* N, double* dN)
{
  double L[3], dL[6];
  tri3(xi, L, dL);
  for (int a = 0; a < 6; ++a) {
    const double sign = a < 3 ? -1.0 : 1.0, t = 0.5 * (1.0 + sign * xi[2]);
    N[a] = L[a % 3] * t;
    if (!dN) continue;
    dN[3 * a]     = dL[2 * (a % 3)] * t;
    dN[3 * a + 1] = dL[2 * (a % 3) + 1] * t;
    dN[3 * a + 2] = 0.5 * sign * L[a % 3];
  }
}

// t = 0 at the base, 1 at the apex; N = (1-t + r_a r) (1-t + s_a s) / (4 (1-t)) at the base            (1.22)
void pyr5(const double* xi, double* N, double* dN)
{
  const double open = 1.0 - xi[2], least = 1e-15;    // at the apex the derivatives depend on the direction
  const double z = std::fabs(open) > least ? open : least, r = xi[0] / z, s = xi[1] / z;
  for (int a = 0; a < 4; ++a) {
    const double* c = corner_sign[a];
    const double f = 1.0 + c[0] * r, g = 1.0 + c[1] * s;
    N[a] = 0.25 * z * f * g;
    if (!dN) continue;
    dN[3 * a]     = 0.25 * c[0] * g;
    dN[3 * a + 1] = 0.25 * c[1] * f;
    dN[3 * a + 2] = 0.25 * (c[0] * c[1] * r * s - 1.0);
  }
  N[4] = xi[2];
  if (!dN) return;
  dN[12] = dN[13] = 0.0;
  dN[14] = 1.0;
}

// serendipity family of the wedge, s = -1 at the bottom and 1 at the top: corners, midpoints of the edges of
// the triangles, midpoints of the edges between them
// (1.21)
void wedge15(const double* xi, double* N, double* dN)
{
  static const int edge[3][2] = {{0, 1}, {1, 2}, {2, 0}};
  double L[3], dL[6];
  tri3(xi, L, dL);
  const double z = xi[2];
  for (int a = 0; a < 6; ++a) {
    const int i = a % 3, j = edge[i][0], k = edge[i][1];
    const double s = a < 3 ? -1.0 : 1.0, t = 1.0 + s * z;
    N[a]     = 0.5 * L[i] * t * (2.0 * L[i] + s * z - 2.0);
    N[6 + a] = 2.0 * L[j] * L[k] * t;
    if (!dN) continue;
    for (int c = 0; c < 2; ++c) {
      dN[3 * a + c]       = 0.5 * t * (4.0 * L[i] + s * z - 2.0) * dL[2 * i + c];
      dN[3 * (6 + a) + c] = 2.0 * t * (L[j] * dL[2 * k + c] + L[k] * dL[2 * j + c]);
    }
    dN[3 * a + 2]       = 0.5 * s * L[i] * (2.0 * L[i] + 2.0 * s * z - 1.0);
    dN[3 * (6 + a) + 2] = 2.0 * s * L[j] * L[k];
  }
  for (int i = 0; i < 3; ++i) {
    N[12 + i] = L[i] * (1.0 - z * z);
    if (!dN) continue;
    for (int c = 0; c < 2; ++c) dN[3 * (12 + i) + c] = dL[2 * i + c] * (1.0 - z * z);
    dN[3 * (12 + i) + 2] = -2.0 * z * L[i];
  }
}

// the midpoint of the edge of corners i and j of a simplex: 4 L_i L_j; a corner: L_i (2 L_i - 1)
void simplex_quadratic(int dim, int edges, const int edge[][2], const double* L, const double* dL, double* N,
                       double* dN)
{
  for (int a = 0; a <= dim; ++a) {
    N[a] = L[a] * (2.0 * L[a] - 1.0);
    for (int k = 0; k < dim && dN; ++k) dN[a * dim + k] = (4.0 * L[a] - 1.0) * dL[a * dim + k];
  }
  for (int q = 0; q < edges; ++q) {
    const int i = edge[q][0], j = edge[q][1], a = dim + 1 + q;
    N[a] = 4.0 * L[i] * L[j];
    for (int k = 0; k < dim && dN; ++k)
      dN[a * dim + k] = 4.0 * (L[i] * dL[j * dim + k] + L[j] * dL[i * dim + k]);
  }
}

void tri6(const double* xi, double* N, double* dN)
{
  static const int edge[3][2] = {{0, 1}, {1, 2}, {2, 0}};
  double L[3], dL[6];
  tri3(xi, L, dL);
  simplex_quadratic(2, 3, edge, L, dL, N, dN);
}

void tet10(const double* xi, double* N, double* dN)
{
  static const int edge[6][2] = {{0, 1}, {1, 2}, {2, 0}, {0, 3}, {1, 3}, {2, 3}};
  double L[4], dL[12];
  tet4(xi, L, dL);
  simplex_quadratic(3, 6, edge, L, dL, N, dN);
}

// natural coordinates of the nodes of the quadrilateral of 8 and the brick of 20 nodes
const double quad8_node[8][2] = {{-1, -1}, {1, -1}, {1, 1}, {-1, 1}, {0, -1}, {1, 0}, {0, 1}, {-1, 0}};
const double hex20_node[20][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1}, {-1, -1, 1}, {1, -1, 1},
                                  {1, 1, 1},    {-1, 1, 1},  {0, -1, -1}, {1, 0, -1}, {0, 1, -1}, {-1, 0, -1},
                                  {0, -1, 1},   {1, 0, 1},   {0, 1, 1},   {-1, 0, 1}, {-1, -1, 0}, {1, -1, 0},
                                  {1, 1, 0},    {-1, 1, 0}};

// a node of the serendipity family at c [dim]; N = prod_i f_i: 1 + c_i xi_i, or 1 - xi_i^2 where c_i = 0;
// a corner also has the factor sum_i c_i xi_i - (dim - 1)                                           (1.19)
void serendipity(int dim, const double* c, const double* xi, double* N, double* dN)
{
  double f[3], d[3], g = 1.0, scale = 1.0;
  bool corner = true;
  for (int i = 0; i < dim; ++i) {
    corner = corner && c[i] != 0.0;
    scale *= c[i] != 0.0 ? 0.5 : 1.0;
    f[i] = c[i] != 0.0 ? 1.0 + c[i] * xi[i] : 1.0 - xi[i] * xi[i];
    d[i] = c[i] != 0.0 ? c[i] : -2.0 * xi[i];
  }
  if (corner) {
    g = 1.0 - dim;
    for (int i = 0; i < dim; ++i) g += c[i] * xi[i];
  }
  double all = scale;
  for (int i = 0; i < dim; ++i) all *= f[i];
  *N = all * g;
  for (int k = 0; k < dim && dN; ++k) {
    double rest = scale;
    for (int i = 0; i < dim; ++i)
      if (i != k) rest *= f[i];
    dN[k] = rest * (d[k] * g + (corner ? f[k] * c[k] : 0.0));
  }
}

double invert(int dim, const double* J, double* inv)
{
  if (dim == 2) {
    const double det = J[0] * J[3] - J[1] * J[2];
    inv[0] = J[3] / det;
    inv[1] = -J[1] / det;
    inv[2] = -J[2] / det;
    inv[3] = J[0] / det;
    return det;
  }
  const double c0 = J[4] * J[8] - J[5] * J[7], c1 = J[5] * J[6] - J[3] * J[8], c2 = J[3] * J[7] - J[4] * J[6];
  const double det = J[0] * c0 + J[1] * c1 + J[2] * c2;
  inv[0] = c0 / det;
  inv[1] = (J[2] * J[7] - J[1] * J[8]) / det;
  inv[2] = (J[1] * J[5] - J[2] * J[4]) / det;
  inv[3] = c1 / det;
  inv[4] = (J[0] * J[8] - J[2] * J[6]) / det;
  inv[5] = (J[2] * J[3] - J[0] * J[5]) / det;
  inv[6] = c2 / det;
  inv[7] = (J[1] * J[6] - J[0] * J[7]) / det;
  inv[8] = (J[0] * J[4] - J[1] * J[3]) / det;
  return det;
}

}  // namespace

void shape_eval(Shape s, const double* xi, double* N, double* dN)
{
  switch (s) {
    case SHAPE_TRI3: tri3(xi, N, dN); break;
    case SHAPE_QUAD4: quad4(xi, N, dN); break;
    case SHAPE_TET4: tet4(xi, N, dN); break;
    case SHAPE_WEDGE6: wedge6(xi, N, dN); break;
    case SHAPE_HEX8: hex8(xi, N, dN); break;
    case SHAPE_PYR5: pyr5(xi, N, dN); break;
    case SHAPE_TRI6: tri6(xi, N, dN); break;
    case SHAPE_TET10: tet10(xi, N, dN); break;
    case SHAPE_WEDGE15: wedge15(xi, N, dN); break;
    case SHAPE_QUAD8: case SHAPE_QUAD8R:
      for (int a = 0; a < 8; ++a) serendipity(2, quad8_node[a], xi, N + a, dN ? dN + 2 * a : nullptr);
      break;
    case SHAPE_HEX20: case SHAPE_HEX20R:
      for (int a = 0; a < 20; ++a) serendipity(3, hex20_node[a], xi, N + a, dN ? dN + 3 * a : nullptr);
      break;
    case SHAPES: break;
  }
}

double shape_jacobian(Shape s, const double* dN, const double* X, double* dNdX)
{
  const int dim = shape_info[s].dim, nen = shape_info[s].nen;
  double J[9] = {0}, inv[9];              // J[i*dim+j] = dX_i/dxi_j
  for (int a = 0; a < nen; ++a)
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j) J[i * dim + j] += X[a * dim + i] * dN[a * dim + j];
  const double det = invert(dim, J, inv);
  for (int a = 0; a < nen; ++a)
    for (int i = 0; i < dim; ++i) {
      double sum = 0.0;
      for (int j = 0; j < dim; ++j) sum += dN[a * dim + j] * inv[j * dim + i];
      dNdX[a * dim + i] = sum;
    }
  return det;
}

namespace {

// the apex of a pyramid, where its map has no derivative
bool at_apex(const double* X, const double* x)
{
  double size = 0.0, off = 0.0;
  for (int i = 0; i < 3; ++i) {
    off  = std::fmax(off, std::fabs(x[i] - X[12 + i]));
    size = std::fmax(size, std::fabs(X[i] - X[12 + i]));
  }
  return off <= 1e-12 * size;
}

}  // namespace

bool shape_inverse(Shape s, const double* X, const double* x, double* xi)
{
  const int dim = shape_info[s].dim, nen = shape_info[s].nen;
  double N[MAX_NODES], dN[3 * MAX_NODES];
  const Shape corners = shape_info[s].linear;
  const double start  = (corners == SHAPE_TRI3 || corners == SHAPE_TET4) ? 0.25 : 0.0;
  for (int i = 0; i < dim; ++i) xi[i] = start;
  if (corners == SHAPE_PYR5) {
    const bool apex = at_apex(X, x);
    xi[2] = apex ? 1.0 : 0.25;
    if (apex) return true;
  }
  for (int it = 0; it < 25; ++it) {
    shape_eval(s, xi, N, dN);
    // r relative to the first node, since a distant origin would cost digits
    double J[9] = {0}, inv[9], r[3] = {0, 0, 0};
    for (int a = 0; a < nen; ++a)
      for (int i = 0; i < dim; ++i) {
        r[i] += N[a] * (X[a * dim + i] - X[i]);
        for (int j = 0; j < dim; ++j) J[i * dim + j] += (X[a * dim + i] - X[i]) * dN[a * dim + j];
      }
    invert(dim, J, inv);
    double step = 0.0;
    for (int i = 0; i < dim; ++i) {
      double d = 0.0;
      for (int j = 0; j < dim; ++j) d += inv[i * dim + j] * (x[j] - X[j] - r[j]);
      xi[i] += d;
      step = std::fmax(step, std::fabs(d));
    }
    if (!(step < 1e6)) return false;
    if (step < 1e-13) return true;
  }
  return false;
}

bool shape_inside(Shape shape, const double* xi, double tolerance)
{
  const Shape s = shape_info[shape].linear;      // the natural coordinates are the same
  const auto within = [&](int i, double most) { return std::fabs(xi[i]) <= most + tolerance; };
  const auto above  = [&](double x) { return x >= -tolerance; };
  switch (s) {
    case SHAPE_TRI3: return above(xi[0]) && above(xi[1]) && above(1.0 - xi[0] - xi[1]);
    case SHAPE_TET4:
      return above(xi[0]) && above(xi[1]) && above(xi[2]) && above(1.0 - xi[0] - xi[1] - xi[2]);
    case SHAPE_WEDGE6: return above(xi[0]) && above(xi[1]) && above(1.0 - xi[0] - xi[1]) && within(2, 1.0);
    case SHAPE_QUAD4: return within(0, 1.0) && within(1, 1.0);
    case SHAPE_HEX8: return within(0, 1.0) && within(1, 1.0) && within(2, 1.0);
    case SHAPE_PYR5: return above(xi[2]) && within(0, 1.0 - xi[2]) && within(1, 1.0 - xi[2]);
    case SHAPE_TRI6: case SHAPE_QUAD8: case SHAPE_QUAD8R: case SHAPE_TET10: case SHAPE_WEDGE15:
    case SHAPE_HEX20: case SHAPE_HEX20R: case SHAPES: break;       // not a linear shape
  }
  return false;
}
