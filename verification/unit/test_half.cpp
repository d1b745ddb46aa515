// The half-increment residual of an oscillator against its closed form, and what follows from its size.
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "deck/deck.h"
#include "model/scheme.h"
#include "step/step.h"

namespace {

// A column of one element on the ground, displacement along y alone: stiffness and mass of its two upper
// nodes together are 1 and 1/3
struct Column {
  Model m;
  State st;
  Problem p{m, st};
  Column(const std::string& material, const std::string& step)
  {
    const auto folder = std::filesystem::temp_directory_path() / ("mpfe_test_half_" +
                                                                  std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "deck.inp")
        << "*BLOCK, TYPE=CPE4, ELSET=E\n0, 0, 1, 1\n1, 1\n*MATERIAL, NAME=M\n*ELASTIC\n1, 0\n*DENSITY\n1\n"
        << material << "*SOLID SECTION, ELSET=E, MATERIAL=M\n*BOUNDARY\nE, 1\nE_YMIN, 2\n"
        << "*INITIAL CONDITIONS, TYPE=DISPLACEMENT\nE, 2, \"0.3*y\"\n"
        << "*INITIAL CONDITIONS, TYPE=VELOCITY\nE, 2, \"-0.2*y\"\n*STEP\n" << step << "*END STEP\n";
    EXPECT_EQ(0, deck_read((folder / "deck.inp").string(), {}, m));
    std::filesystem::remove_all(folder);
    EXPECT_EQ(0, step_open(p));
    EXPECT_TRUE(step_prepare(p, m.step[0]).ok());
    if (scheme_of(m.step[0]).acceleration) {
      EXPECT_TRUE(step_initial_acceleration(p, m.step[0], 0.0).ok());
    }
  }
  // residual of both nodes after one increment
  double residual(double dt)
  {
    RealVec energy;
    HalfWatch w;
    w.on = true;
    step_increment(p, m.step[0], 0.0, dt, energy, &w);
    return 2.0 * w.residual;
  }
};

// The same by hand: M a(1) + (1 + alpha) r(1) - alpha r(0) = 0, r = K u + C v - f t^2; then the cubic through
// both ends gives the middle
double by_hand(const Step& s, double alpha_c, double beta_c, double f, double dt)
{
  const double M = 1.0 / 3.0, K = 1.0, C = alpha_c * M + beta_c * K, u0 = 0.3, v0 = -0.2;
  const bool mid = scheme_of(s).midpoint;             // linear: as Newmark's scheme, 1/4 and 1/2
  const double b = mid ? 0.25 : s.beta, g = mid ? 0.5 : s.gamma, al = s.alpha;
  const auto force = [&](double u, double v, double t) { return K * u + C * v - f * t * t; };
  const double a0 = -force(u0, v0, 0.0) / M;
  const double up = u0 + dt * v0 + dt * dt * (0.5 - b) * a0, vp = v0 + dt * (1.0 - g) * a0;
  const double a1 = -((1 + al) * force(up, vp, dt) - al * force(u0, v0, 0.0)) /
                    (M + (1 + al) * (K * b * dt * dt + C * g * dt));
  const double u1 = up + dt * dt * b * a1, v1 = vp + dt * g * a1;
  const double uh = 0.5 * (u0 + u1) + 0.125 * dt * (v0 - v1);
  const double vh = 1.5 * (u1 - u0) / dt - 0.25 * (v0 + v1);
  return (1 + al) * std::fabs(force(uh, vh, 0.5 * dt) - 0.5 * (force(u0, v0, 0.0) + force(u1, v1, dt)));
}

}  // namespace

TEST(Half, ResidualOfAnOscillator)
{
  const std::string damping = "*DAMPING, ALPHA=0.2, BETA=0.3\n", times = "\n1, 1\n";
  for (const char* scheme : {"*DYNAMIC", "*DYNAMIC, BETA=0.3, GAMMA=0.6", "*DYNAMIC, ALPHA=-0.2",
                             "*DYNAMIC, SCHEME=ENERGY-MOMENTUM"})
    for (double dt : {0.1, 0.4, 1.0}) {
      Column free("", scheme + times), damped(damping, scheme + times);
      EXPECT_NEAR(by_hand(free.m.step[0], 0.0, 0.0, 0.0, dt), free.residual(dt), 1e-12) << scheme;
      EXPECT_NEAR(by_hand(free.m.step[0], 0.2, 0.3, 0.0, dt), damped.residual(dt), 1e-12) << scheme;
    }
}

TEST(Half, ResidualOfALoad)
{
  for (double dt : {0.1, 0.4}) {
    Column c("", "*DYNAMIC\n1, 1\n*CLOAD\nE_YMAX, 2, \"0.5*t^2\"\n");
    EXPECT_NEAR(by_hand(c.m.step[0], 0.0, 0.0, 1.0, dt), c.residual(dt), 1e-12);
  }
}

// (omega dt)^2/8 of the force, to leading order
TEST(Half, ResidualIsOfSecondOrder)
{
  Column c("", "*DYNAMIC\n1, 1\n");
  const double dt = 0.02;
  EXPECT_NEAR(3.0 * dt * dt / 8.0 * 0.3, c.residual(dt), 0.02 * 3.0 * dt * dt / 8.0 * 0.3);
  EXPECT_NEAR(4.0, c.residual(2 * dt) / c.residual(dt), 0.1);
}

TEST(Half, StateAndSupportsAreLeftAlone)
{
  Column with("", "*DYNAMIC, HAFTOL=1\n1, 1\n"), without("", "*DYNAMIC\n1, 1\n");
  RealVec energy;
  with.residual(0.1);
  step_increment(without.p, without.m.step[0], 0.0, 0.1, energy);
  EXPECT_EQ(without.st.np1.u, with.st.np1.u);
  EXPECT_EQ(without.st.np1.v, with.st.np1.v);
  EXPECT_EQ(without.p.dofs.bound.target, with.p.dofs.bound.target);
  EXPECT_EQ(without.st.rf, with.st.rf);
}

// cuts in quarters that aim at the limit
TEST(Half, CutsAimAtTheLimit)
{
  Step s;
  s.dt_min = 1e-3;
  HalfWatch w;
  w.limit = 1.0;
  const auto shorter = [&](double residual) {
    w.residual = residual;
    w.before   = 0.0;
    return half_judge(s, 1.0, 0, w).status == HALF_RESIDUAL ? w.shorter : 1.0;
  };
  EXPECT_EQ(1.0, shorter(1.0));
  EXPECT_EQ(0.75, shorter(1.1));
  EXPECT_EQ(0.5, shorter(2.0));
  EXPECT_EQ(0.25, shorter(5.0));
  EXPECT_EQ(0.25, shorter(HUGE_VAL));
}

// a residual that stays: three cuts, and the increment is accepted; one that falls with dt squared is not
TEST(Half, JumpsEndAfterThreeCuts)
{
  for (const bool jumps : {true, false}) {
    Step s;
    s.dt_min = 1e-9;
    HalfWatch w;
    w.limit = 1.0;
    double dt = 1.0;
    int cuts = 0;
    for (;; ++cuts, dt = w.shorter) {
      w.residual = jumps ? 100.0 : 100.0 * dt * dt;
      if (half_judge(s, dt, cuts, w).ok()) break;
    }
    EXPECT_EQ(jumps, w.jumps);
    EXPECT_FALSE(w.least);
    if (jumps) {
      EXPECT_EQ(3, cuts);
    } else {
      EXPECT_LE(w.residual, 1.0);
    }
  }
}

// dt min and MAX CUT end it, and say so
TEST(Half, EndsWhereItMayNotBeCut)
{
  Step s;
  s.dt_min = 0.3;
  HalfWatch w;
  w.limit = 1.0;
  w.residual = 100.0;
  EXPECT_TRUE(half_judge(s, 1.0, 0, w).ok());
  EXPECT_TRUE(w.least);
  s.dt_min = 1e-6;
  EXPECT_FALSE(half_judge(s, 1.0, s.ctl.max_cut - 1, w).ok());
  EXPECT_TRUE(half_judge(s, 1.0, s.ctl.max_cut, w).ok());
  EXPECT_TRUE(w.least);
}
