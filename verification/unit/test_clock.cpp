// the clock of a step: lengths of automatic increments, times that must be hit
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
  clock_accept(s, c.dt, 4, c);
  EXPECT_DOUBLE_EQ(1.0, c.dt);
  clock_accept(s, c.dt, 4, c);
  EXPECT_DOUBLE_EQ(1.5, c.dt);
  clock_accept(s, c.dt, 4, c);
  clock_accept(s, c.dt, 5, c);                       // neither easy nor hard: the count begins again
  EXPECT_DOUBLE_EQ(1.5, c.dt);
  clock_accept(s, c.dt, 8, c);
  EXPECT_DOUBLE_EQ(1.5, c.dt);
  clock_accept(s, c.dt, 9, c);
  EXPECT_DOUBLE_EQ(1.125, c.dt);
}

TEST(Clock, EndsOnStopsAndOnTheStepWithoutASliver)
{
  const Step s = automatic(1.0, 0.4);
  StepClock c  = started(s);
  EXPECT_DOUBLE_EQ(0.25, clock_next(s, c, {0.25}));
  EXPECT_DOUBLE_EQ(0.4, clock_next(s, c, {}));
  clock_accept(s, 0.4, 6, c);
  EXPECT_DOUBLE_EQ(0.3, clock_next(s, c, {}));       // 0.6 are left: two halves
  clock_accept(s, 0.3, 6, c);
  clock_accept(s, clock_next(s, c, {}), 6, c);
  EXPECT_TRUE(clock_done(s, c));
}
