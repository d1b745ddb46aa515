// Surfaces tied by dual shape functions: sums, linear functions, forces of a uniform traction, partly covered
// faces.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "shape/face.h"
#include "shape/mortar.h"

namespace {

// part of the force of a node that 36 Gauss points miss on faces that are no parallelograms; measured: 4e-10
const double QUADRATURE = 1e-9;

// a slave surface of n x n quadrilaterals over the unit square, a master of m x m, both a little distorted
// and on the plane z = 0.2 x + 0.1 y; the master is moved along x and is as wide as it is long
struct Pair {
  RealVec X;
  std::vector<MortarFace> slave, master;
};

void add_surface(int n, double shift, double width, bool up, Pair& p, std::vector<MortarFace>& face)
{
  const int first = static_cast<int>(p.X.size()) / 3;
  for (int j = 0; j <= n; ++j)
    for (int i = 0; i <= n; ++i) {
      const bool inside = i > 0 && i < n && j > 0 && j < n;
      const double x = shift + width * (i + (inside ? 0.13 * std::sin(3.0 * i + j) : 0.0)) / n;
      const double y = width * (j + (inside ? 0.11 * std::cos(2.0 * i + 5.0 * j) : 0.0)) / n;
      p.X.insert(p.X.end(), {x, y, 0.2 * x + 0.1 * y});
    }
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      const int a = first + j * (n + 1) + i, b = a + 1, c = b + n + 1, d = c - 1;
      face.push_back(up ? MortarFace{4, {a, b, c, d}} : MortarFace{4, {a, d, c, b}});
    }
}

Pair pair_of(int n, int m, double shift, double width)
{
  Pair p;
  add_surface(n, 0.0, 1.0, true, p, p.slave);
  add_surface(m, shift, width, false, p, p.master);
  return p;
}

// a surface of 2 x 2 quadrilaterals, or of 8 triangles, with a node in the middle of each edge
void add_quadratic(int n, bool triangles, bool up, Pair& p, std::vector<MortarFace>& face)
{
  const std::size_t first = face.size();
  add_surface(n, 0.0, 1.0, up, p, face);
  std::vector<MortarFace> linear(face.begin() + first, face.end());
  face.resize(first);
  if (triangles) {
    std::vector<MortarFace> both;
    for (const MortarFace& f : linear) {
      both.push_back({3, {f.node[0], f.node[1], f.node[2]}});
      both.push_back({3, {f.node[0], f.node[2], f.node[3]}});
    }
    linear.swap(both);
  }
  std::map<std::pair<int, int>, int> middle;
  for (MortarFace f : linear) {
    for (int a = 0; a < f.n; ++a) {
      const auto ends = std::minmax(f.node[a], f.node[(a + 1) % f.n]);
      const auto made = middle.emplace(ends, static_cast<int>(p.X.size()) / 3);
      for (int i = 0; i < 3 && made.second; ++i)
        p.X.push_back(0.5 * (p.X[3 * ends.first + i] + p.X[3 * ends.second + i]));
      f.node[f.n + a] = made.first->second;
    }
    f.mid = f.n;
    face.push_back(f);
  }
}

Pair quadratic_pair(bool triangles)
{
  Pair p;
  add_quadratic(2, triangles, true, p, p.slave);
  add_quadratic(3, !triangles, false, p, p.master);
  return p;
}

// largest error of sum c = 1 and of sum c X = X
double linear_error(const Pair& p, const std::vector<MortarRow>& rows)
{
  double worst = 0.0;
  for (const MortarRow& r : rows)
    for (int i = -1; i < 3; ++i) {
      double sum = i < 0 ? 1.0 : p.X[3 * r.node + i];
      for (const auto& q : r.master) sum -= q.second * (i < 0 ? 1.0 : p.X[3 * q.first + i]);
      worst = std::max(worst, std::fabs(sum));
    }
  return worst;
}

// integral of N over faces, by nodes
std::map<int, double> areas(const Pair& p, const std::vector<MortarFace>& face)
{
  std::map<int, double> out;
  for (const MortarFace& f : face) {
    double x[3 * MAX_FACE_NODES], N[MAX_FACE_NODES], n[3];
    for (int k = 0; k < 3 * f.all(); ++k) x[k] = p.X[3 * f.node[k / 3] + k % 3];
    const FaceRule& rule = face_rule(f.all());
    for (int g = 0; g < rule.n; ++g) {
      face_eval(f.all(), rule.xi[g], N, nullptr);
      for (int a = 0; a < f.all(); ++a)
        out[f.node[a]] += rule.w[g] * face_area(f.all(), x, rule.xi[g], n) * N[a];
    }
  }
  return out;
}

}  // namespace

TEST(Mortar, LinearFunctions)
{
  const Pair p = pair_of(3, 4, 0.0, 1.0);
  const std::vector<MortarRow> rows = mortar_rows(p.X, p.slave, p.master, 0.1);
  ASSERT_EQ(rows.size(), 16u);
  EXPECT_LT(linear_error(p, rows), 1e-12);
}

TEST(Mortar, UniformTraction)
{
  for (int m : {2, 4, 7}) {
    const Pair p = pair_of(3, m, 0.0, 1.0);
    std::map<int, double> force, own = areas(p, p.slave);
    for (const MortarRow& r : mortar_rows(p.X, p.slave, p.master, 0.1)) {
      EXPECT_NEAR(r.area, own[r.node], QUADRATURE * own[r.node]);
      for (const auto& q : r.master) force[q.first] += q.second * own[r.node];
    }
    for (const auto& a : areas(p, p.master)) EXPECT_NEAR(force[a.first], a.second, QUADRATURE * a.second);
  }
}

// faces of quadratic elements (5.15): the equations reproduce linear functions; one multiplier for all rows
// gives the nodes of both surfaces the forces of a uniform traction
TEST(Mortar, QuadraticFaces)
{
  for (const bool triangles : {false, true}) {
    const Pair p = quadratic_pair(triangles);
    std::map<int, double> force, own = areas(p, p.slave), other = areas(p, p.master);
    const std::vector<MortarRow> rows = mortar_rows(p.X, p.slave, p.master, 0.1);
    ASSERT_EQ(rows.size(), triangles ? 25u : 21u);
    EXPECT_LT(linear_error(p, rows), 1e-12);
    for (const MortarRow& r : rows) {
      EXPECT_GT(r.area, 0.0);
      force[r.node] += (r.end[0] < 0 ? 1.0 : 2.0) * r.area;
      for (int k = 0; k < 2 && r.end[0] >= 0; ++k) force[r.end[k]] -= 0.5 * r.area;
      for (const auto& q : r.master) force[q.first] += r.area * q.second;
    }
    for (const auto& a : own) EXPECT_NEAR(force[a.first], a.second, 1e-10);
    for (const auto& a : other) EXPECT_NEAR(force[a.first], a.second, 1e-10);
  }
}

// the master covers a part of the slave faces: the equations still reproduce linear functions
TEST(Mortar, PartlyCovered)
{
  const Pair p = pair_of(3, 4, 0.45, 0.7);
  const std::vector<MortarRow> rows = mortar_rows(p.X, p.slave, p.master, 0.1);
  EXPECT_LT(rows.size(), 16u);
  EXPECT_GT(rows.size(), 6u);
  EXPECT_LT(linear_error(p, rows), 1e-9);
  double sum = 0.0;
  for (const MortarRow& r : rows) sum += r.area;
  EXPECT_NEAR(sum, 0.55 * 0.7 * std::sqrt(1.0 + 0.04 + 0.01), 1e-9);
}

TEST(Mortar, FarAndTurned)
{
  Pair p = pair_of(2, 2, 0.0, 1.0);
  EXPECT_EQ(mortar_rows(p.X, p.slave, p.master, 0.1).size(), 9u);
  std::vector<MortarFace> turned = p.master;                   // the same faces from behind
  for (MortarFace& f : turned) std::swap(f.node[1], f.node[3]);
  EXPECT_TRUE(mortar_rows(p.X, p.slave, turned, 0.1).empty());
  for (size_t k = 3 * 9; k < p.X.size(); k += 3) p.X[k + 2] += 0.5;
  EXPECT_TRUE(mortar_rows(p.X, p.slave, p.master, 0.1).empty());
  const RealVec d = mortar_distances(p.X, {0, 4}, p.master, 2.0);
  EXPECT_NEAR(d[1], 0.5 / std::sqrt(1.05), 1e-12);
}
