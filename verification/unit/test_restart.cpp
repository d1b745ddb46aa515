// Restart: values to bytes and back, the state whole, corners that conversion shares.
#include <gtest/gtest.h>

#include <cmath>

#include "frac/frac.h"
#include "model/state_fits.h"
#include "model/state_io.h"

namespace {

std::string bytes_of(State& s)
{
  Archive f;
  io(f, s);
  return f.bytes;
}

TEST(Archive, ValuesComeBack)
{
  Archive f;
  int i = -7;
  double x = 0.1, y[3] = {1, 2, 3};
  std::string text = "weak, <bond>";
  std::vector<std::string> names = {"", "a", "bb"};
  std::vector<std::vector<Face>> faces = {{}, {{3, 1}, {4, 0}}};
  io_all(f, i, x, y, text, names, faces);
  f.reading = true;
  int i2;
  double x2, y2[3];
  std::string text2 = "something else";
  std::vector<std::string> names2;
  std::vector<std::vector<Face>> faces2;
  io_all(f, i2, x2, y2, text2, names2, faces2);
  EXPECT_TRUE(f.good);
  EXPECT_EQ(f.at, f.bytes.size());
  EXPECT_EQ(i2, -7);
  EXPECT_EQ(x2, 0.1);
  EXPECT_EQ(y2[2], 3.0);
  EXPECT_EQ(text2, text);
  EXPECT_EQ(names2, names);
  ASSERT_EQ(faces2.size(), 2u);
  EXPECT_EQ(faces2[1][1].elem, 4);
}

TEST(Archive, BytesThatEndTooEarlyAreSeen)
{
  State s;
  s.n.u = {1, 2, 3};
  const std::string whole = bytes_of(s);
  for (size_t n = 0; n < whole.size(); ++n) {
    Archive f;
    f.reading = true;
    f.bytes   = whole.substr(0, n);
    State back;
    io(f, back);
    EXPECT_FALSE(f.good) << n;
  }
}

TEST(Archive, AStateThatDoesNotFitTheModelIsSeen)
{
  Model m;
  m.step.resize(1);
  m.step[0].period = 1.0;
  m.step[0].dt     = 0.5;
  State good;
  good.log.step = 1;
  good.clock.dt = 0.5;
  EXPECT_EQ(state_fault(m, good.points, good), nullptr);
  const auto fault = [&](void (*change)(State&)) {
    State s = good;
    change(s);
    const char* text = state_fault(m, good.points, s);
    return std::string(text ? text : "");
  };
  EXPECT_EQ(fault([](State& s) { s.log.step = 2; }), "times and increments");
  EXPECT_EQ(fault([](State& s) { s.clock.t = std::nan(""); }), "times and increments");
  EXPECT_EQ(fault([](State& s) { s.clock.dt = 0.0; }), "times and increments");
  EXPECT_EQ(fault([](State& s) { s.n.u = {1.0}; }), "displacements and velocities");
  EXPECT_EQ(fault([](State& s) { s.points.npoint = 1; }), "material points");
  EXPECT_EQ(fault([](State& s) { s.points.conn.item = {3}; }), "material points");
  EXPECT_EQ(fault([](State& s) { s.bonds.nbond = -1; }), "bonds");
  EXPECT_EQ(fault([](State& s) { s.frac.converted = {0}; }), "broken and converted elements");
  EXPECT_EQ(fault([](State& s) { s.rf = {0.0}; }), "reactions");
  EXPECT_EQ(fault([](State& s) { s.division.ranks = 0; }), "division among ranks");
}

TEST(Archive, StateComesBackWhole)
{
  State s;
  s.n.time = 0.3;
  s.n.u = s.n.v = {1, 2, 3};
  s.points.npoint = 2;
  s.points.conn.off = {0, 3, 6};
  s.points.surface = {{{1, 2}}, {}};
  s.bonds.normal = {0, 1};
  s.frac.converted = {5, 3};
  s.contact.resize(2);
  s.contact[1].peak = 4.0;
  s.ledger.angular[2] = -1.0;
  s.clock.nominal = 12;
  s.log.contact_skipped = 9;
  Archive f;
  f.bytes   = bytes_of(s);
  f.reading = true;
  State back;
  io(f, back);
  EXPECT_TRUE(f.good);
  EXPECT_EQ(bytes_of(back), f.bytes);
  EXPECT_EQ(back.np1.u, s.n.u);
  EXPECT_EQ(back.clock.nominal, 12);
}

}  // namespace
