// the clock of a step, and when an increment is too long
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <numeric>

#include <gtest/gtest.h>

#include "base/timer.h"
#include "deck/deck.h"
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
  EXPECT_TRUE(clock_over(s, c));
}

// a table that rises, jumps, rests and falls; automatic increments of statics end before the jump as well
TEST(Clock, IncrementsEndAtTurnsOfTables)
{
  Model m;
  Amplitude a;
  a.t = {0.0, 0.1, 0.3, 0.3, 0.5, 0.6, 0.7, 2.0};
  a.y = {0.0, 0.5, 1.5, 1.0, 1.0, 0.0, -1.0, -2.0};
  m.amplitude.push_back(a);
  Step s = automatic(1.0, 0.4);
  s.dt_min = 0.01;
  EXPECT_EQ(0u, clock_stops(m, s, 0.0).size());      // not used
  s.load.resize(1);
  s.load[0].amplitude = 0;
  const auto expect = [&](const RealVec& stops, double start) {
    const RealVec found = clock_stops(m, s, start);
    ASSERT_EQ(stops.size(), found.size());
    for (size_t k = 0; k < stops.size(); ++k) EXPECT_NEAR(stops[k], found[k], 1e-14);
  };
  expect({0.3 - 0.4e-3, 0.3, 0.5}, 0.0);
  expect({0.3 - 0.4e-3, 0.3, 0.5}, 7.0);             // time of the step
  m.amplitude[0].total_time = true;
  expect({0.1}, 0.4);
  m.amplitude[0].total_time = false;
  s.proc = PROC_DYNAMIC;
  expect({0.3, 0.5}, 0.0);
  s.direct = true;
  EXPECT_EQ(0u, clock_stops(m, s, 0.0).size());
}

// grow_back of step_clock.cpp, as doc/theory.md 6.5 tells it: 2^-16 of dt is back at dt within a nominal increment,
// which ends on the multiple of dt; a hard increment does not grow, and the end of a nominal increment doubles
TEST(Clock, CutIncrementsOfDirectGrowBack)
{
  Step s   = automatic(1.0, 0.125);
  s.direct = true;
  StepClock c = started(s);
  c.dt = std::ldexp(s.dt, -16);
  int n = 0;
  for (; c.nominal == 1 && n < 1000; ++n) clock_accept(s, clock_next(s, c, {}), 1, 0.0, c);
  EXPECT_LT(n, 20);                                  // 65536 of the length that was cut
  EXPECT_DOUBLE_EQ(0.125, c.t);
  EXPECT_DOUBLE_EQ(0.125, c.dt);
  c.dt = 0.125 / 8;
  clock_accept(s, c.dt, 9, 0.0, c);                  // hard
  EXPECT_DOUBLE_EQ(0.125 / 8, c.dt);
  clock_accept(s, c.dt, 6, 0.0, c);                  // neither easy nor hard: two in a row
  EXPECT_DOUBLE_EQ(0.125 / 8, c.dt);
  clock_accept(s, 0.001, 1, 0.0, c);                 // ended on an output time
  EXPECT_DOUBLE_EQ(0.125 / 8, c.dt);
  clock_accept(s, c.dt, 6, 0.0, c);
  EXPECT_DOUBLE_EQ(0.125 / 4, c.dt);
  while (c.nominal == 2) clock_accept(s, clock_next(s, c, {}), 9, 0.0, c);
  EXPECT_DOUBLE_EQ(0.25, c.t);
  EXPECT_DOUBLE_EQ(0.125 / 2, c.dt);
}

TEST(Increment, PointsThatEnterTooDeep)
{
  Bonds bonds;
  bonds.contact.deep = {0.0};
  bonds.nbond = 1;
  bonds.side = {SIDE_CONTACT};
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
  const auto size = [](const RealVec& a) { return std::hypot(std::hypot(a[0], a[1]), std::hypot(a[2], a[3]));
      };
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

namespace {

void read_deck_text(const std::string& text, Model& m)
{
  const auto folder = std::filesystem::temp_directory_path() / ("mpfe_test_step_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "deck.inp") << text;
  EXPECT_EQ(0, deck_read((folder / "deck.inp").string(), {}, m));
  std::filesystem::remove_all(folder);
}

// a sheet of 40 x 25 cells that swings, held at its foot, of material points or of elements; more than 2000
// equations
struct Swing {
  Model m;
  State st;
  Problem p{m, st};
  Swing(const std::string& sheet)
  {
    read_deck_text("*MATERIAL, NAME=M\n*ELASTIC\n100, 0.2\n*DENSITY\n1\n*GRID, KEEP=0.5\n-5.3, 0, 45.7, 35\n"
                   "1, 1\n" + sheet + "*INITIAL CONDITIONS, TYPE=VELOCITY\nB, 1, \"0.02*y\"\n*STEP, NLGEOM\n"
                   "*DYNAMIC, DIRECT, SCHEME=ENERGY-MOMENTUM\n0.05, 1\n*END STEP\n",
                   m);
    EXPECT_EQ(0, step_open(p));
    EXPECT_TRUE(step_prepare(p, m.step[0]).ok());
  }
  void increment()
  {
    RealVec energy;
    EXPECT_TRUE(step_increment(p, m.step[0], 0.05 * st.log.inc_total, 0.05, energy).ok());
  }
  void accept()
  {
    std::swap(st.n, st.np1);
    ++st.log.inc_total;
    p.ready = false;
    EXPECT_TRUE(step_prepare(p, m.step[0]).ok());
  }
  void convert(int from, int to)
  {
    IntVec elem(to - from);
    std::iota(elem.begin(), elem.end(), from);
    frac_convert(m, p.d.el, p.d.fm, elem, p.d.share, st);
    p.dofs.rows.numbered = false;
    st.laid = GridLaid();
    p.ready = false;
    EXPECT_TRUE(step_prepare(p, m.step[0]).ok());
  }
  // velocities after an increment more, for which the velocity of the grid is known or not
  RealVec next(bool known)
  {
    const GridVelocity kept = p.newton.grid;
    const long skipped      = timer_phase(PHASE_PROJECT).skipped;
    if (!known) p.newton.grid = GridVelocity();
    // both begin alike: predictor and tangent are not kept, and the accuracy of solutions is the same
    p.newton.motion = Motion();
    p.newton.tangent.keeps = false;
    const RealVec gain = p.newton.gain, beyond = p.newton.beyond;
    increment();
    p.newton.gain   = gain;
    p.newton.beyond = beyond;
    EXPECT_EQ(known ? 1 : 0, timer_phase(PHASE_PROJECT).skipped - skipped);
    p.newton.grid = kept;
    return st.np1.vc;
  }
};

const std::string points = "*MATERIAL POINTS, BODY=B, MATERIAL=M, POINTS=2\n0, 0, 40, 25\n40, 25\n"
                           "*GRID BOUNDARY\nYMIN, 1, 2",
                  elements = "*BLOCK, TYPE=CPE4, ELSET=B\n0, 0, 40, 25\n40, 25\n"
                             "*SOLID SECTION, ELSET=B, MATERIAL=M\n*BOUNDARY\nB_YMIN, 1, 2\n"
                             "*CONVERSION, ELSET=B, TRIGGER=TIME, TIME=100\n";

double difference(const RealVec& a, const RealVec& b)
{
  double most = 0.0;
  for (size_t i = 0; i < a.size(); ++i) most = std::max(most, std::fabs(a[i] - b[i]));
  return most;
}

}  // namespace

// (3.19): velocities are up to 0.5, and (3.14) leaves 1e-14 of the momentum
TEST(Increment, ProjectionIsKnownWhereTheGridGoesOn)
{
  Swing s(points + "\n");
  for (int k = 0; k < 6; ++k) {
    s.increment();
    s.accept();
  }
  ASSERT_GT(s.p.dofs.rows.neq(), 2000);
  EXPECT_LT(difference(s.next(true), s.next(false)), 1e-12);
  const long skipped = timer_phase(PHASE_PROJECT).skipped;
  s.increment();
  s.increment();                           // that before was not accepted
  EXPECT_EQ(skipped + 1, timer_phase(PHASE_PROJECT).skipped);
  s.accept();
  s.m.grid_bc.clear();                     // other supports
  s.increment();
  EXPECT_EQ(skipped + 1, timer_phase(PHASE_PROJECT).skipped);
}

// nodes that points follow keep what no unknown sees, as corners do                          (3.15), 7.4
TEST(Increment, ProjectionIsKnownWherePointsFollowNodes)
{
  Swing s(elements);
  s.increment();
  s.accept();
  s.convert(10 * 40, 14 * 40);
  ASSERT_TRUE(s.p.dofs.rows.hung);
  for (int k = 0; k < 6; ++k) {
    s.increment();
    s.accept();
  }
  ASSERT_GT(s.p.dofs.rows.neq(), 2000);
  EXPECT_LT(difference(s.next(true), s.next(false)), 1e-12);
  const RealVec u = s.st.np1.u;
  s.next(true);
  EXPECT_LT(difference(s.st.np1.u, u), 1e-12);
  s.convert(14 * 40, 15 * 40);
  s.next(false);
}

// A thin sheet of tetrahedra as points, in cells as large as they are: the grid has more nodes than the sheet has
// corners, and motions that no corner sees, with neither mass nor stiffness. They stay as small as what the corners do
TEST(Increment, GridMotionsThatNoCornerSeesStaySmall)
{
  Model m;
  read_deck_text("*BLOCK, TYPE=C3D4, ELSET=SHEET\n0, 0, 0, 6, 6, 0.8\n6, 6, 1\n*MATERIAL, NAME=M\n"
                 "*HYPERELASTIC, NEO HOOKE\n20, 0.05\n*DENSITY\n1\n"
                 "*MATERIAL POINTS, BODY=B, FILL=ELSET, ELSET=SHEET, MATERIAL=M, POINTS=1\n"
                 "*GRID\n-4.3, -4.4, -8.55, 12, 12, 8\n1.3\n*INITIAL CONDITIONS, TYPE=VELOCITY\n"
                 "B, 1, \"0.3*sin(x)*cos(y)\"\nB, 3, \"cos(x*1.1)*cos(y*1.1)\"\n"
                 "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n0.05, 5\n*END STEP\n",
                 m);
  State st;
  Problem p{m, st};
  ASSERT_EQ(0, step_open(p));
  for (int k = 0; k < 20; ++k) {
    ASSERT_TRUE(step_prepare(p, m.step[0]).ok());
    RealVec energy;
    ASSERT_TRUE(step_increment(p, m.step[0], 0.05 * k, 0.05, energy).ok());
    EXPECT_LE(st.log.residual, 2e-8 * st.log.scale);
    double grid = 0.0;         // way that the grid goes in an increment
    for (double v : p.newton.grid.v) grid = std::max(grid, 0.05 * std::fabs(v));
    EXPECT_LT(grid, 10.0 * difference(st.np1.uc, st.n.uc));
    std::swap(st.n, st.np1);
    ++st.log.inc_total;
    p.ready = false;
  }
  EXPECT_EQ(0, p.newton.solver.fixed_null_pivots);
}

// a support whose rate jumps sets other nodes in motion
TEST(Increment, ProjectionIsNotKnownWhereASupportJumps)
{
  Swing s(points + ", \"0.1*max(t-0.15,0)\"\n");
  long skipped = 0;
  for (int k = 0; k < 4; ++k) {
    skipped = timer_phase(PHASE_PROJECT).skipped;
    s.increment();
    EXPECT_EQ(k == 0 || k == 3 ? 0 : 1, timer_phase(PHASE_PROJECT).skipped - skipped) << k;
    s.accept();
  }
}
