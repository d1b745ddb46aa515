// the clock of a step, and when an increment is too long
#include <cmath>

#include <gtest/gtest.h>

#include "step/step.h"

namespace {

Step automatic(double period, double dt)
{
  Step s;
  s.period = period;
  s.dt     = dt;
  s.dt_max = period;
  s.direct = false;
  return s;
}

StepClock started(const Step& s)
{
  StepClock c;
  c.dt = s.dt;
  return c;
}

}  // namespace

// EASY, EASY_ONES, GROWS, HARD, SHRINKS of step_clock.cpp, as doc/theory.md 6.5 tells them
TEST(Clock, TwoEasyIncrementsGrowAndOneHardShrinks)
{
  const Step s = automatic(100.0, 1.0);
  StepClock c  = started(s);
  clock_accept(s, c.dt, 4, 0.0, c);
  EXPECT_DOUBLE_EQ(1.0, c.dt);
  clock_accept(s, c.dt, 4, 0.0, c);
  EXPECT_DOUBLE_EQ(1.5, c.dt);
  clock_accept(s, c.dt, 4, 0.0, c);
  clock_accept(s, c.dt, 5, 0.0, c);                       // neither easy nor hard: the count begins again
  EXPECT_DOUBLE_EQ(1.5, c.dt);
  clock_accept(s, c.dt, 8, 0.0, c);
  EXPECT_DOUBLE_EQ(1.5, c.dt);
  clock_accept(s, c.dt, 9, 0.0, c);
  EXPECT_DOUBLE_EQ(1.125, c.dt);
}

// GROWS_BY, SMALL, SMALL_ONES of step_clock.cpp, as doc/theory.md 6.7 tells them
TEST(Clock, SmallResidualsGrow)
{
  Step s = automatic(100.0, 1.0);
  s.proc = PROC_DYNAMIC;
  s.half_part = 0.05;
  s.dt_max    = 1.5;
  StepClock c = started(s);
  clock_accept(s, c.dt, 6, 0.5, c);
  clock_accept(s, c.dt, 6, 0.5, c);
  EXPECT_DOUBLE_EQ(1.0, c.dt);
  clock_accept(s, c.dt, 6, 0.5, c);
  EXPECT_DOUBLE_EQ(1.25, c.dt);
  clock_accept(s, c.dt, 6, 0.7, c);                  // not small: the count begins again
  EXPECT_DOUBLE_EQ(1.25, c.dt);
  for (int k = 0; k < 3; ++k) clock_accept(s, 0.5 * c.dt, 6, 0.2, c);
  EXPECT_DOUBLE_EQ(1.25, c.dt);                      // 0.8 at the full length
  for (int k = 0; k < 3; ++k) clock_accept(s, c.dt, 6, 0.0, c);
  EXPECT_DOUBLE_EQ(1.5, c.dt);                       // dt max
  clock_accept(s, c.dt, 9, 0.0, c);
  EXPECT_DOUBLE_EQ(1.125, c.dt);
}

TEST(Clock, EndsOnStopsAndOnTheStepWithoutASliver)
{
  const Step s = automatic(1.0, 0.4);
  StepClock c  = started(s);
  EXPECT_DOUBLE_EQ(0.25, clock_next(s, c, {0.25}));
  EXPECT_DOUBLE_EQ(0.4, clock_next(s, c, {}));
  clock_accept(s, 0.4, 6, 0.0, c);
  EXPECT_DOUBLE_EQ(0.3, clock_next(s, c, {}));       // 0.6 are left: two halves
  clock_accept(s, 0.3, 6, 0.0, c);
  clock_accept(s, clock_next(s, c, {}), 6, 0.0, c);
  EXPECT_TRUE(clock_done(s, c));
}

TEST(Increment, PointsThatEnterTooDeep)
{
  Bonds bonds;
  bonds.nbond = 1;
  bonds.field = {SIDE_CONTACT};
  ContactPairs pairs;
  pairs.master.item = {0};
  pairs.master.off  = {0, 1};
  pairs.size = {2.0};
  Level l;
  const auto status = [&](double before, double now) {       // gaps, parts of the size
    pairs.gap = {2.0 * before};
    l.slip    = {2.0 * now, 0.0, 0.0};
    return step_contact_depth(bonds, pairs, l, 3).status;
  };
  EXPECT_EQ(STATUS_OK, status(0.2, -0.2));           // not a quarter deep
  EXPECT_EQ(CONTACT_DEPTH, status(0.2, -0.3));       // in one increment
  EXPECT_EQ(STATUS_OK, status(-0.2, -0.3));          // in several
  EXPECT_EQ(CONTACT_DEPTH, status(-0.4, -0.46));     // nearly half of the size
  EXPECT_EQ(AT_BOND, step_contact_depth(bonds, pairs, l, 3).at);
}

// a linear force whose matrix is known but for its skew part: alone it diverges, with secants it ends exactly
TEST(Newton, SecantsFindTheSkewPartOfTheTangent)
{
  const int n = 4;
  const double skew[n][n] = {{0, 1.5, 0, 0.2}, {-1.5, 0, 0.4, 0}, {0, -0.4, 0, 1.2}, {-0.2, 0, -1.2, 0}};
  const RealVec diag = {1.0, 2.0, 1.0, 3.0}, f = {1.0, -2.0, 0.5, 3.0};
  const auto correction = [&](const RealVec& u) {
    RealVec dx(n);
    for (int i = 0; i < n; ++i) {
      double r = f[i] - diag[i] * u[i];
      for (int j = 0; j < n; ++j) r -= skew[i][j] * u[j];
      dx[i] = r / diag[i];
    }
    return dx;
  };
  const auto size = [](const RealVec& a) { return std::hypot(std::hypot(a[0], a[1]), std::hypot(a[2], a[3])); };
  for (bool with : {false, true}) {
    Secants h;
    RealVec u(n, 0.0), dx;
    for (int it = 0; it < n + 2; ++it) {
      dx = correction(u);
      if (with) step_secant(h, u, diag, dx);
      for (int i = 0; i < n; ++i) u[i] += dx[i];
    }
    if (with) EXPECT_LT(size(correction(u)), 1e-10);
    else EXPECT_GT(size(correction(u)), 1.0);
  }
}
