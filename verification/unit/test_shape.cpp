// Shape functions, rules and faces of all elements: sums, derivatives, exactness, the order of nodes.
#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

#include "shape/face.h"
#include "shape/shape.h"

namespace {

bool is_simplex(Shape s) { return shape_info[s].linear == SHAPE_TRI3 || shape_info[s].linear == SHAPE_TET4; }

// natural coordinates of node a
void node_at(Shape s, int a, double xi[3])
{
  static const double tri[3][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}},
                      tet[4][3] = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}},
                      wedge[6][3] = {{0, 0, -1}, {1, 0, -1}, {0, 1, -1}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}},
                      pyramid[5][3] = {{-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0}, {0, 0, 1}},
                      hex[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
                                   {-1, -1, 1},  {1, -1, 1},  {1, 1, 1},  {-1, 1, 1}};
  const Shape corners = shape_info[s].linear;
  const double(*x)[3] = corners == SHAPE_TRI3     ? tri
                        : corners == SHAPE_TET4   ? tet
                        : corners == SHAPE_WEDGE6 ? wedge
                        : corners == SHAPE_PYR5   ? pyramid
                                                  : hex;
  int end[2] = {a, a};
  if (a >= shape_info[corners].nen) shape_edge(s, a, end);
  for (int i = 0; i < 3; ++i) xi[i] = i < shape_info[s].dim ? 0.5 * (x[end[0]][i] + x[end[1]][i]) : 0.0;
}

double power(const double* x, const int p[3])
{
  return std::pow(x[0], p[0]) * std::pow(x[1], p[1]) * std::pow(x[2], p[2]);
}

// the first axes of the reference cell that make a triangle or a tetrahedron; the others run from -1 to 1
int simplex_axes(Shape s)
{
  if (s == SHAPE_PYR5) return 3;                     // as complete
  return is_simplex(s) ? shape_info[s].dim : shape_info[s].linear == SHAPE_WEDGE6 ? 2 : 0;
}

// int x^i y^j z^k over the reference cell
double exact(Shape s, const int p[3])
{
  if (s == SHAPE_PYR5)                               // 4 / ((i+1)(j+1)) int t^k (1-t)^(i+j+2) dt
    return p[0] % 2 || p[1] % 2 ? 0.0
                                : 4.0 / ((p[0] + 1) * (p[1] + 1)) * std::tgamma(p[2] + 1.0) *
                                      std::tgamma(p[0] + p[1] + 3.0) /
                                      std::tgamma(p[0] + p[1] + p[2] + 4.0);
  const int axes = simplex_axes(s);
  double value = 1.0;
  int n = axes;
  for (int i = 0; i < axes; ++i) {
    for (int k = 1; k <= p[i]; ++k) value *= k;                // i! j! k! / (i + j + k + axes)!
    n += p[i];
  }
  for (; n > 1; --n) value /= n;
  for (int i = axes; i < shape_info[s].dim; ++i) value *= p[i] % 2 ? 0.0 : 2.0 / (p[i] + 1);
  return value;
}

// largest error of a rule over polynomials of the degree: complete in the axes of a simplex, in each direction
// else
double rule_error(Shape s, const GaussRule& rule, int degree)
{
  double worst = 0.0;
  const int dim = shape_info[s].dim;
  for (int i = 0; i <= degree; ++i)
    for (int j = 0; j <= degree; ++j)
      for (int k = 0; k <= (dim == 3 ? degree : 0); ++k) {
        const int p[3] = {i, j, k}, axes = simplex_axes(s);
        if (std::accumulate(p, p + axes, 0) > degree) continue;
        double sum = 0.0;
        for (int g = 0; g < rule.n; ++g) sum += rule.w[g] * power(rule.xi[g], p);
        worst = std::fmax(worst, std::fabs(sum - exact(s, p)));
      }
  return worst;
}

const int face_kinds[] = {2, 3, 4, FACE_EDGE3, 6, 8};
int face_nodes(int kind) { return kind == FACE_EDGE3 ? 3 : kind; }

}  // namespace

TEST(Shape, FunctionsAreOneAtTheirNodeAndSumToOne)
{
  std::mt19937 gen(3);
  std::uniform_real_distribution<double> rnd(0.0, 0.3);
  for (int k = 0; k < SHAPES; ++k) {
    const Shape s = static_cast<Shape>(k);
    const int nen = shape_info[s].nen, dim = shape_info[s].dim;
    double N[MAX_NODES], dN[3 * MAX_NODES], up[MAX_NODES], down[MAX_NODES], xi[3];
    for (int a = 0; a < nen; ++a) {
      node_at(s, a, xi);
      shape_eval(s, xi, N, nullptr);
      for (int b = 0; b < nen; ++b) EXPECT_NEAR(a == b, N[b], 1e-15) << s << " " << a;
    }
    for (double& x : xi) x = rnd(gen);
    shape_eval(s, xi, N, dN);
    double sum = 0.0;
    for (int a = 0; a < nen; ++a) sum += N[a];
    EXPECT_NEAR(1.0, sum, 1e-14) << s;
    const double h = 1e-5;
    for (int i = 0; i < dim; ++i) {
      double slope = 0.0, at[3] = {xi[0], xi[1], xi[2]};
      for (int a = 0; a < nen; ++a) slope += dN[a * dim + i];
      EXPECT_NEAR(0.0, slope, 1e-14) << s;
      at[i] = xi[i] + h;
      shape_eval(s, at, up, nullptr);
      at[i] = xi[i] - h;
      shape_eval(s, at, down, nullptr);
      for (int a = 0; a < nen; ++a) EXPECT_NEAR((up[a] - down[a]) / (2 * h), dN[a * dim + i], 1e-9) << s << a;
    }
  }
}

// quadratic shapes contain all polynomials of the second degree
TEST(Shape, QuadraticFieldsAreExact)
{
  for (int k = 0; k < SHAPES; ++k) {
    const Shape s = static_cast<Shape>(k);
    if (!shape_quadratic(s)) continue;
    const int dim = shape_info[s].dim;
    double N[MAX_NODES], at[3] = {0.21, 0.17, dim == 3 ? 0.29 : 0.0}, xi[3];
    shape_eval(s, at, N, nullptr);
    for (int i = 0; i <= 2; ++i)
      for (int j = 0; i + j <= 2; ++j)
        for (int l = 0; i + j + l <= (dim == 3 ? 2 : i + j); ++l) {
          const int p[3] = {i, j, l};
          double value = 0.0;
          for (int a = 0; a < shape_info[s].nen; ++a) {
            node_at(s, a, xi);
            value += N[a] * power(xi, p);
          }
          EXPECT_NEAR(power(at, p), value, 1e-15) << s;
        }
  }
}

TEST(Shape, RulesAreExactToTheirDegree)
{
  struct Case { Shape s; int stiffness, mass; };
  for (const Case& c : {Case{SHAPE_TRI3, 1, 2}, Case{SHAPE_QUAD4, 3, 3}, Case{SHAPE_TET4, 1, 2},
                        Case{SHAPE_HEX8, 3, 3}, Case{SHAPE_TRI6, 2, 4}, Case{SHAPE_QUAD8, 5, 5},
                        Case{SHAPE_QUAD8R, 3, 5}, Case{SHAPE_TET10, 2, 5}, Case{SHAPE_HEX20, 5, 5},
                        Case{SHAPE_HEX20R, 3, 5}, Case{SHAPE_WEDGE6, 2, 2}, Case{SHAPE_WEDGE15, 2, 4},
                        Case{SHAPE_PYR5, 1, 3}}) {
    EXPECT_EQ(shape_info[c.s].ngp, gauss_rule(c.s).n);
    EXPECT_LT(rule_error(c.s, gauss_rule(c.s), c.stiffness), 2e-15) << c.s;
    EXPECT_GT(rule_error(c.s, gauss_rule(c.s), c.stiffness + 1), 1e-4) << c.s;
    EXPECT_LT(rule_error(c.s, gauss_rule_mass(c.s), c.mass), 2e-15) << c.s;
    for (int g = 0; g < gauss_rule_mass(c.s).n; ++g) EXPECT_GT(gauss_rule_mass(c.s).w[g], 0.0);
  }
}

// nodes of a face: the middle after two corners lies between them, and the normal points outward
TEST(Shape, FacesOfTheTable)
{
  for (int k = 0; k < SHAPES; ++k) {
    const Shape s = static_cast<Shape>(k);
    const ShapeInfo& info = shape_info[s];
    double centre[3] = {0, 0, 0};
    const int corners = shape_info[info.linear].nen;
    for (int a = 0; a < corners; ++a) {
      double xi[3];
      node_at(s, a, xi);
      for (int i = 0; i < 3; ++i) centre[i] += xi[i] / corners;
    }
    for (int f = 0; f < info.nface; ++f) {
      const int n = info.nfnode[f], c = face_corners(info, f), kind = face_kind(info.dim, n);
      double x[3 * MAX_FACE_NODES], normal[3], mid[3] = {0, 0, 0}, out = 0.0;
      for (int a = 0; a < n; ++a) node_at(s, info.face[f][a], x + 3 * a);
      for (int a = c; a < n; ++a)
        for (int i = 0; i < 3; ++i)
          EXPECT_EQ(0.5 * (x[3 * (a - c) + i] + x[3 * ((a - c + 1) % c) + i]), x[3 * a + i]) << s << f << a;
      const double at[2] = {0.2, 0.1};
      face_area(kind, x, at, normal);
      for (int a = 0; a < c; ++a)
        for (int i = 0; i < 3; ++i) mid[i] += x[3 * a + i] / c;
      for (int i = 0; i < 3; ++i) out += normal[i] * (mid[i] - centre[i]);
      EXPECT_GT(out, 0.0) << s << " " << f;
    }
  }
}

TEST(Face, FunctionsAndRules)
{
  for (int kind : face_kinds) {
    const int n = face_nodes(kind);
    double N[MAX_FACE_NODES], dN[2 * MAX_FACE_NODES], up[MAX_FACE_NODES], down[MAX_FACE_NODES], sum = 0.0;
    const double xi[2] = {0.3, kind == 2 || kind == FACE_EDGE3 ? 0.0 : 0.2}, h = 1e-5;
    face_eval(kind, xi, N, dN);
    for (int a = 0; a < n; ++a) sum += N[a];
    EXPECT_NEAR(1.0, sum, 1e-15);
    for (int i = 0; i < (kind == 2 || kind == FACE_EDGE3 ? 1 : 2); ++i) {
      double at[2] = {xi[0], xi[1]};
      at[i] += h;
      face_eval(kind, at, up, nullptr);
      at[i] -= 2 * h;
      face_eval(kind, at, down, nullptr);
      for (int a = 0; a < n; ++a) EXPECT_NEAR((up[a] - down[a]) / (2 * h), dN[2 * a + i], 1e-10) << kind;
    }
  }
}

// nodal forces of unit pressure on a flat face: 1/6, 4/6 on an edge; 0, 1/3 on a triangle; -1/12, 1/3 on a
// square
TEST(Face, NodalForcesOfUnitPressure)
{
  struct Case { int kind; double x[24], corner, middle; };
  const Case all[] = {
      {FACE_EDGE3, {0, 0, 0, 1, 0, 0, 0.5, 0, 0}, 1.0 / 6, 4.0 / 6},
      {6, {0, 0, 0, 1, 0, 0, 0, 2, 0, 0.5, 0, 0, 0.5, 1, 0, 0, 1, 0}, 0.0, 1.0 / 3},
      {8, {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0.5, 0, 0, 1, 0.5, 0, 0.5, 1, 0, 0, 0.5, 0}, -1.0 / 12,
       1.0 / 3}};
  for (const Case& c : all) {
    const FaceRule& rule = face_rule(c.kind);
    const int n = face_nodes(c.kind), corners = c.kind == FACE_EDGE3 ? 2 : n / 2;
    double f[MAX_FACE_NODES] = {0}, N[MAX_FACE_NODES], normal[3];
    for (int g = 0; g < rule.n; ++g) {
      face_eval(c.kind, rule.xi[g], N, nullptr);
      const double dA = rule.w[g] * face_area(c.kind, c.x, rule.xi[g], normal);
      for (int a = 0; a < n; ++a) f[a] += N[a] * dA;
    }
    for (int a = 0; a < n; ++a) EXPECT_NEAR(a < corners ? c.corner : c.middle, f[a], 1e-15) << c.kind << a;
  }
}

// a place in a quadratic cell with bent edges is found again, also where an edge bulges beyond the nodes
TEST(Shape, PlacesInBentCells)
{
  for (Shape s : {SHAPE_TRI6, SHAPE_QUAD8, SHAPE_TET10, SHAPE_WEDGE15, SHAPE_HEX20}) {
    const int dim = shape_info[s].dim, nen = shape_info[s].nen;
    double X[3 * MAX_NODES], N[MAX_NODES], xi[3], at[3], x[3] = {0, 0, 0};
    for (int a = 0; a < nen; ++a) {
      node_at(s, a, xi);
      for (int i = 0; i < dim; ++i) X[a * dim + i] = xi[i] + 0.1 * xi[(i + 1) % dim] * xi[(i + 1) % dim];
    }
    const double want[3] = {is_simplex(s) || s == SHAPE_WEDGE15 ? 0.05 : 0.98, 0.4, 0.3};
    shape_eval(s, want, N, nullptr);
    for (int a = 0; a < nen; ++a)
      for (int i = 0; i < dim; ++i) x[i] += N[a] * X[a * dim + i];
    ASSERT_TRUE(shape_locate(s, X, x, at)) << s;
    for (int i = 0; i < dim; ++i) EXPECT_NEAR(want[i], at[i], 1e-10) << s;
    x[0] += 3.0;
    EXPECT_FALSE(shape_locate(s, X, x, at)) << s;
  }
}

// a pyramid: positions inside and at the apex are found again, those beside it are not; its rule integrates
// the stiffness of a pyramid with a parallelogram as base as a rule of eight points does
TEST(Shape, Pyramid)
{
  const double X[15] = {0, 0, 0, 1.2, 0.1, 0, 1.0, 1.1, 0.1, -0.1, 0.8, 0, 0.4, 0.5, 0.9};
  double xi[3], N[5];
  const double inside[2][3] = {{0.2, -0.3, 0.5}, {0.0, 0.0, 0.999999}};
  const double beside[2][3] = {{0.4, 0.5, 0.95}, {0, 0.1, 0.5}};
  for (const auto& at : inside) {
    double x[3] = {0, 0, 0};
    shape_eval(SHAPE_PYR5, at, N, nullptr);
    for (int a = 0; a < 5; ++a)
      for (int i = 0; i < 3; ++i) x[i] += N[a] * X[3 * a + i];
    ASSERT_TRUE(shape_locate(SHAPE_PYR5, X, x, xi));
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(at[i], xi[i], 1e-9);
  }
  EXPECT_TRUE(shape_locate(SHAPE_PYR5, X, X + 12, xi));
  for (const auto& x : beside) EXPECT_FALSE(shape_locate(SHAPE_PYR5, X, x, xi));
  const double flat[15] = {0, 0, 0, 1, 0.2, 0, 1.1, 1.3, 0.1, 0.1, 1.1, 0.1, 0.3, 0.5, 0.8};
  double sum[2][25] = {};
  for (int k = 0; k < 2; ++k) {
    const GaussRule& rule = k ? gauss_rule_mass(SHAPE_PYR5) : gauss_rule(SHAPE_PYR5);
    for (int g = 0; g < rule.n; ++g) {
      double dN[15], d[15];
      shape_eval(SHAPE_PYR5, rule.xi[g], N, dN);
      const double w = rule.w[g] * shape_jacobian(SHAPE_PYR5, dN, flat, d);
      for (int a = 0; a < 5; ++a)
        for (int b = 0; b < 5; ++b) sum[k][5 * a + b] += w * d[3 * a] * d[3 * b + 1];
    }
  }
  for (int k = 0; k < 25; ++k) EXPECT_NEAR(sum[0][k], sum[1][k], 1e-14);
}
