// Equations between dofs: condensed in place as T^T A T
#include <gtest/gtest.h>

#include <cmath>

#include "assem/assem.h"

namespace {

const int D = 2, ROWS = 6;

// rows 1, 4 and direction 1 of row 5 depend on others; row 2 is a master of all, row 0 belongs to nothing
// that depends
Ties ties()
{
  Ties t;
  const auto add = [&](int dof, std::vector<std::pair<int, double>> master) {
    t.dof.push_back(dof);
    for (const auto& m : master) {
      t.master.item.push_back(m.first);
      t.coef.push_back(m.second);
    }
    t.master.off.push_back(static_cast<int>(t.master.item.size()));
  };
  add(2, {{4, 0.5}, {6, 0.5}});
  add(3, {{5, -2.0}});
  add(8, {{4, 1.0}, {11, 3.0}});
  add(10, {{11, -1.0}});
  t.gap.assign(t.dof.size(), 0.0);
  t.gap[1] = 0.25;
  return t;
}

Dofs sample()
{
  Dofs s;
  s.rows.dim  = D;
  s.rows.nrow = s.rows.nfe = ROWS;
  s.bound.tie  = ties();
  ListTable lists;
  for (const IntVec& l : {IntVec{0, 1, 2}, IntVec{1, 3, 4}, IntVec{4, 5}, IntVec{2, 5}}) {
    lists.item.insert(lists.item.end(), l.begin(), l.end());
    lists.off.push_back(static_cast<int>(lists.item.size()));
  }
  tie_extend(s, lists);
  sys_pattern(lists, ROWS, D, s.pattern.A);
  double x = 0.3;
  const auto number = [&] { x = 3.9 * x * (1.0 - x); return x; };
  for (int I = 0; I < ROWS; ++I)
    for (int k = s.pattern.A.off[I]; k < s.pattern.A.off[I + 1]; ++k)
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < (s.pattern.A.col[k] == I ? i + 1 : D); ++j)
          s.pattern.A.val[(static_cast<size_t>(k) * D + i) * D + j] = number();
  return s;
}

RealVec wave(double phase)
{
  RealVec x(ROWS * D);
  for (size_t i = 0; i < x.size(); ++i) x[i] = std::sin(phase + 1.7 * static_cast<double>(i));
  return x;
}

double product(const RealVec& a, const RealVec& b)
{
  double sum = 0.0;
  for (size_t i = 0; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

}  // namespace

TEST(Tie, forces_do_the_same_work)
{
  const Dofs s = sample();
  RealVec x = wave(0.1), f = wave(0.7), g = f;
  tie_follow(s, false, x);
  tie_force(s, g);
  EXPECT_NEAR(product(x, f), product(x, g), 1e-14);
  for (int d : s.bound.tie.dof) EXPECT_EQ(g[d], 0.0);
}

TEST(Tie, matrix_is_condensed)
{
  Dofs s = sample();
  const SysMatrix before = s.pattern.A;
  tie_matrix(s);
  for (double phase : {0.2, 1.1, 2.5}) {
    RealVec x = wave(phase), y, z;
    tie_follow(s, false, x);
    sys_multiply(before, x, y);
    tie_force(s, y);
    for (int d : s.bound.tie.dof) x[d] = 0.0;      // rows and columns of dependent dofs are zero
    sys_multiply(s.pattern.A, x, z);
    for (size_t i = 0; i < y.size(); ++i) EXPECT_NEAR(y[i], z[i], 1e-13) << i;
  }
}

TEST(Tie, increments_close_the_gap)
{
  const Dofs s = sample();
  RealVec x = wave(0.4);
  tie_follow(s, true, x);
  EXPECT_DOUBLE_EQ(x[3], 0.25 - 2.0 * x[5]);
  EXPECT_DOUBLE_EQ(x[2], 0.5 * (x[4] + x[6]));
}

TEST(Tie, chains_end_in_masters)
{
  Model m;
  m.dim = 2;
  m.equation.resize(3);
  m.equation[0].term = {{0, 0, 2.0}, {1, 0, -1.0}, {2, 1, -1.0}};     // u0 = (u1 + u2)/2
  m.equation[1].term = {{1, 0, 1.0}, {3, 0, -4.0}};                   // u1 = 4 u3
  m.equation[2].term = {{2, 1, 1.0}, {1, 0, 1.0}};                    // u2 = -u1: u0 = 0
  std::vector<EquationSolved> out;
  int bad = -1;
  ASSERT_TRUE(equations_resolve(m, {0, 1, 2}, out, bad));
  EXPECT_TRUE(out[0].master.empty());
  ASSERT_EQ(out[2].master.size(), 1u);
  EXPECT_EQ(out[2].master[0].node, 3);
  EXPECT_DOUBLE_EQ(out[2].master[0].coef, -4.0);
  ASSERT_TRUE(equations_resolve(m, {0, 2}, out, bad));                // without the second one u1 is a master
  EXPECT_TRUE(out[0].master.empty());
  EXPECT_EQ(out[1].master[0].node, 1);
  m.equation[1].term.push_back({0, 0, 1.0});
  EXPECT_FALSE(equations_resolve(m, {0, 1, 2}, out, bad));
}
