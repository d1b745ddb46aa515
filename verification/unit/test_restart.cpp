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

// of a divided model: the items of this rank by their place among all, zeros where nobody has one; elements
// with several places each; nothing that another rank brings
TEST(Archive, DividedArraysAreThoseOfTheWhole)
{
  ArchivePart part[ARCHIVE_KINDS];
  part[PER_NODE].whole = 70000;                        // more than a window
  part[PER_NODE].item  = {1, 3, 69999};
  part[PER_NODE].brings = {1, 0, 1};
  part[PER_ELEM].whole = 3;
  part[PER_ELEM].item  = {0, 2};
  part[PER_GAUSS] = part[PER_ELEM];
  part[PER_GAUSS].ragged = true;
  part[PER_GAUSS].units  = {1, 2};
  RealVec u = {1, 2, 3, 4, 5, 6}, he = {7, 8, 9}, none;
  IntVec phase = {4, 5};
  int after = 17;
  Archive f;
  f.part = part;
  io_all(f, of_nodes(u), of_gauss(he), of_elems(phase), of_nodes(none), after);
  RealVec u_all(140000, 0.0), he_all = {7, 8, 9}, none_all;
  u_all[2]      = 1;
  u_all[3]      = 2;
  u_all[139998] = 5;
  u_all[139999] = 6;
  IntVec phase_all = {4, 0, 5};
  Archive whole;
  io_all(whole, u_all, he_all, phase_all, none_all, after);
  EXPECT_TRUE(f.bytes == whole.bytes);

  Archive back;
  back.reading = back.filed = true;
  back.part = part;
  back.size = whole.bytes.size();
  back.head = 5;
  back.file = std::tmpfile();
  ASSERT_TRUE(back.file);
  std::fputs("head ", back.file);
  std::fwrite(whole.bytes.data(), 1, whole.bytes.size(), back.file);
  RealVec u2, he2, none2 = {1};
  IntVec phase2;
  int after2 = 0;
  io_all(back, of_nodes(u2), of_gauss(he2), of_elems(phase2), of_nodes(none2), after2);
  std::fclose(back.file);
  EXPECT_TRUE(back.good);
  EXPECT_EQ(back.at, back.end());
  EXPECT_EQ(u2, RealVec({1, 2, 0, 0, 5, 6}));
  EXPECT_EQ(he2, he);
  EXPECT_EQ(phase2, phase);
  EXPECT_TRUE(none2.empty());
  EXPECT_EQ(after2, 17);
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
