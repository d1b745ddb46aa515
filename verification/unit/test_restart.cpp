// Restart: values to bytes and back, the state whole, corners that conversion shares.
#include <gtest/gtest.h>

#include <cmath>

#include "base/picked.h"
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

// seven nodes and three corners of all ranks; bonds 3 and 4 are of conversion, 1 and 4 on faces of contact
Bonds some_bonds()
{
  Bonds b;
  b.nbond  = 5;
  b.nfixed = 3;
  b.a.off  = {0, 1, 3, 4, 6, 7};
  b.a.item = {4, 0, 2, 6, 1 + 7, 2, 2 + 7};
  b.a_w    = {1, 0.5, 0.25, 1, 0.125, 2, 3};
  b.def = b.side = b.field = b.intermediate = {0, 1, 2, 3, 4};
  b.area = b.cn = b.ct = {0.5, 1.5, 2.5, 3.5, 4.5};
  b.contact.offset = b.contact.initial_penetration = b.contact.deep = b.contact.friction = b.area;
  for (int i = 0; i < 15; ++i) b.X.push_back(i);
  for (int i = 0; i < 10; ++i) b.normal.push_back(-i);
  b.contact.skin         = {{0, 1, 0}, {2, 0, 0}, {3, 2, 1}};
  b.contact.skin_penalty = {10, 11, 12};
  b.contact.skin_of      = {-1, 2, -1, -1, 1};
  b.contact.met          = {-1, 0, -1, -1, 2};
  b.contact.wall         = {1, -1, -1, 0, -1};
  return b;
}

void io_bonds(Archive& f, Bonds& b, RealVec& slip)
{
  Points points;
  points.ncorner = 3;
  io_outline(f, points, b);
  io_all(f, of_bonds(slip), b);
}

// a rank writes what it has in its own order, and what nobody brings (number -1) stays away
TEST(Archive, BondsOfARankAreWrittenInTheOrderOfAll)
{
  Bonds all = some_bonds(), b;
  RealVec slip_all(10), slip;
  for (int i = 0; i < 10; ++i) slip_all[i] = i;
  const IntVec order = {3, 0, 4, 2, 1, 0};             // the last one is another rank's
  b.nbond  = all.nbond;
  b.nfixed = all.nfixed;
  b.a      = picked(order, all.a);
  b.a_w    = picked(order, all.a.off, 1, all.a_w);
  for (IntVec Bonds::* x : {&Bonds::def, &Bonds::side, &Bonds::field, &Bonds::intermediate})
    b.*x = picked(order, 1, all.*x);
  for (RealVec Bonds::* x : {&Bonds::area, &Bonds::cn, &Bonds::ct}) b.*x = picked(order, 1, all.*x);
  using C = ContactState;
  for (IntVec C::* x : {&C::skin_of, &C::met, &C::wall}) b.contact.*x = picked(order, 1, all.contact.*x);
  for (RealVec C::* x : {&C::offset, &C::initial_penetration, &C::deep, &C::friction})
    b.contact.*x = picked(order, 1, all.contact.*x);
  b.X      = picked(order, 3, all.X);
  b.normal = picked(order, 2, all.normal);
  slip     = picked(order, 2, slip_all);
  b.contact.skin         = {all.contact.skin[2], all.contact.skin[0], all.contact.skin[1]};
  b.contact.skin_penalty = {12, 10, 11};
  b.area[5] = slip[10] = -1;
  ArchivePart part[ARCHIVE_KINDS];
  part[PER_BOND].whole  = 5;
  part[PER_BOND].item   = {-1, 0, 1, 2, 3, 4};
  part[PER_BOND].at     = {5, 1, 4, 3, 0, 2};
  part[PER_BOND].brings = {0, 1, 1, 1, 1, 1};
  part[PER_SIDE]        = part[PER_BOND];
  part[PER_SIDE].ragged = true;
  part[PER_SIDE].at     = picked(part[PER_BOND].at, 1, b.a.off);
  for (int q : part[PER_BOND].at) part[PER_SIDE].units.push_back(b.a.count(q));
  part[PER_SKIN].whole  = 3;
  part[PER_SKIN].item   = {0, 1, 2};
  part[PER_SKIN].at     = {1, 2, 0};
  Archive f, whole;
  f.part = part;
  io_bonds(f, b, slip);
  io_bonds(whole, all, slip_all);
  EXPECT_TRUE(f.bytes == whole.bytes);
}

// a rank reads the bonds that tie only what it has, and the faces of its elements and points; a file with bonds
// that no rank takes is no good
TEST(Archive, BondsOfARankAreThoseOfItsNodes)
{
  Bonds all = some_bonds(), b;
  RealVec slip_all(10), slip;
  for (int i = 0; i < 10; ++i) slip_all[i] = i;
  Archive whole;
  io_bonds(whole, all, slip_all);
  ArchivePart part[ARCHIVE_KINDS];
  part[PER_NODE].whole   = 7;
  part[PER_NODE].item    = {0, 2, 5};
  part[PER_CORNER].whole = 3;
  part[PER_CORNER].item  = {1, 2};
  part[PER_ELEM].item    = {1, 2};
  part[PER_POINT].item   = {3};
  Archive f;
  f.reading = f.filed = true;
  f.part = part;
  f.file = std::tmpfile();
  ASSERT_TRUE(f.file);
  f.size = whole.bytes.size();
  std::fwrite(whole.bytes.data(), 1, whole.bytes.size(), f.file);
  Points points;
  points.ncorner = 3;
  io_outline(f, points, b);
  io(f, of_bonds(slip));
  EXPECT_TRUE(f.good);
  io(f, b);
  EXPECT_FALSE(f.good);
  std::fclose(f.file);
  b.contact.skin_of = {2, -1, 1};
  b.contact.met     = {0, -1, 2};
  state_find_faces(f, b);
  EXPECT_EQ(b.nbond, 3);
  EXPECT_EQ(b.nfixed, 1);
  EXPECT_EQ(b.name, (std::vector<long>{-2, 0, 1}));
  EXPECT_EQ(b.a.off, (IntVec{0, 2, 4, 5}));
  EXPECT_EQ(b.a.item, (IntVec{0, 2, 8, 2, 9}));
  EXPECT_EQ(slip, (RealVec{2, 3, 6, 7, 8, 9}));
  EXPECT_EQ(b.contact.skin.size(), 2u);
  EXPECT_EQ(b.contact.skin_of, (IntVec{1, -1, 0}));
  EXPECT_EQ(b.contact.met, (IntVec{FACE_ELSEWHERE, -1, 1}));

  Bonds damaged = some_bonds();                        // a node that the deck has not; a number of bonds
  damaged.a.item[0] = 10;
  for (int more : {0, 1}) {
    damaged.nbond += more;
    Archive bytes, g;
    io_bonds(bytes, damaged, slip_all);
    g.reading = true;
    g.bytes   = bytes.bytes;
    g.part    = part;
    Bonds back;
    io_outline(g, Points(), back);
    EXPECT_FALSE(g.good) << more;
    damaged.a.item[0] = 4;
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
