// connected pieces: their sums against the ledger, and what connects
#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "deck/deck.h"
#include "step/step.h"

namespace {

struct Solved {                   // a deck that has run
  Model m;
  State st;
  Fragments f;
  double mass = 0.0;           // of all elements and points
};

void run_deck(const std::string& text, Solved& r)
{
  const auto folder = std::filesystem::temp_directory_path() /
                      ("mpfe_test_fragments_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  std::ofstream(folder / "deck.inp") << text;
  ASSERT_EQ(deck_read((folder / "deck.inp").string(), {}, r.m), 0);
  r.m.out_dir = (folder / "out").string();
  Problem p(r.m, r.st);
  Output out;
  out_listing_open(r.m, out);
  ASSERT_EQ(step_open(p), 0);
  Archive fresh;
  ASSERT_EQ(step_run(p, RUN_BEGIN, fresh, out), EXIT_GOOD);
  frac_fragments(r.m, p.d.el, r.st, r.f);
  for (int e = 0; e < r.m.mesh.nelem(); ++e)
    if (p.d.el.block_of[e] >= 0) r.mass += p.d.fm.volume[e] * p.d.el.block[p.d.el.block_of[e]].density;
  for (double k : r.st.points.mass) r.mass += k;
  std::filesystem::remove_all(folder);
}

void expect_sums(const Solved& r)
{
  double mass = 0.0, kinetic = 0.0, q[3] = {0, 0, 0}, L[3] = {0, 0, 0};
  for (const Fragment& k : r.f.item) {
    mass += k.mass;
    kinetic += k.kinetic;
    EXPECT_NEAR(k.kinetic, k.translation + k.rotation + k.rest, 1e-14 * std::fabs(k.kinetic));
    EXPECT_GE(k.rest, -1e-13 * k.kinetic);
    for (int i = 0; i < 3; ++i) {
      const int j = (i + 1) % 3, l = (i + 2) % 3;
      q[i] += k.momentum[i];
      L[i] += k.angular[i] + k.centre[j] * k.momentum[l] - k.centre[l] * k.momentum[j];
    }
  }
  const Ledger& g = r.st.ledger;
  const double size = std::sqrt(2.0 * g.kinetic * r.mass);      // of a momentum
  EXPECT_NEAR(mass, r.mass, 1e-12 * r.mass);
  EXPECT_NEAR(kinetic, g.kinetic, 1e-12 * g.kinetic);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(q[i], g.momentum[i], 1e-12 * size) << i;
    EXPECT_NEAR(L[i], g.angular[i], 1e-12 * size * 10.0) << i;   // the bodies lie within 10 of the origin
  }
}

// elements 0 to 6 and points 6 to 8; a column of broken elements at 2, points at 4 to 6 after two increments
const char* const plane =
    "*BLOCK, TYPE=CPE4, ELSET=BAR\n0, 0, 6, 2\n12, 4\n"
    "*ELSET, ELSET=BROKEN, WHERE=\"x > 2 && x < 2.5\"\n*ELSET, ELSET=CONV, WHERE=\"x > 4\"\n"
    "*MATERIAL, NAME=M\n*ELASTIC\n1000, 0.2\n*DENSITY\n1.3\n*SOLID SECTION, ELSET=BAR, MATERIAL=M\n"
    "*EIGENFRACTURE, ELSET=BROKEN, START=NO\n1e9\n*INITIAL CONDITIONS, TYPE=BROKEN\nBROKEN\n"
    "*CONVERSION, ELSET=CONV, TRIGGER=TIME, TIME=2e-3\n*GRID\n-1, -3, 10, 5\n0.5, 0.5\n"
    "*MATERIAL POINTS, BODY=B, MATERIAL=M\n6, 0, 8, 2\n*BOND, NAME=J, SURFACE=BAR_XMAX, BODY=B\n"
    "*NSET, NSET=ALL, WHERE=\"1\"\n*INITIAL CONDITIONS, TYPE=VELOCITY\nALL, 1, \"0.3*sin(x) - 0.2*y\"\nALL, "
    "2, \"0.5*x\"\nB, 1, \"0.3*sin(x) - 0.2*y\"\nB, 2, \"0.5*x\"\n"
    "*STEP, NLGEOM\n*DYNAMIC, DIRECT\n1e-3, ";

std::string bricks(const char* conversion)
{
  return std::string("*BLOCK, TYPE=C3D8, ELSET=BAR\n0, 0, 0, 4, 1, 1\n8, 2, 2\n") +
         "*ELSET, ELSET=BROKEN, WHERE=\"x > 2 && x < 2.5\"\n*ELSET, ELSET=CONV, WHERE=\"x > 3\"\n"
         "*MATERIAL, NAME=M\n*ELASTIC\n1000, 0.2\n*DENSITY\n1.3\n*SOLID SECTION, ELSET=BAR, MATERIAL=M\n"
         "*EIGENFRACTURE, ELSET=BROKEN, START=NO\n1e9\n*INITIAL CONDITIONS, TYPE=BROKEN\nBROKEN\n" +
         conversion +
         "*NSET, NSET=ALL, WHERE=\"1\"\n*INITIAL CONDITIONS, TYPE=VELOCITY\nALL, 1, \"0.3*sin(x) - "
         "0.2*y\"\nALL, 2, \"0.5*x*z\"\nALL, 3, \"0.1 + y\"\n"
         "*STEP, NLGEOM\n*DYNAMIC, DIRECT, SCHEME=ENERGY-MOMENTUM\n1e-3, 4e-3\n*END STEP\n";
}

// elements 0 and 1 share node 3 alone, or nothing but a broken element between them
Fragments two_corners(bool broken_between)
{
  Model m;
  m.mesh.X          = {0, 0, 0, 1, 0, 0, 0, 1, 0, 1, 1, 0, 2, 1, 0, 1, 2, 0, 2, 2, 0, 2, 0, 0};
  m.mesh.node_label = {1, 2, 3, 4, 5, 6, 7, 8};
  m.mesh.elem_label = {1, 2, 3};
  m.mesh.elem_type.assign(3, ELEM_CPE4);
  m.mesh.elem_section.assign(3, 0);
  m.mesh.conn.off  = {0, 4, 8, 12};
  m.mesh.conn.item = {0, 1, 3, 2, 3, 4, 6, 5, 1, 7, 4, 3};
  if (broken_between) m.mesh.conn.item[4] = 5;       // the second element turns away from node 3
  Elements el;
  el.block_of = el.initial_block = el.slot_of = {0, 0, 0};
  Fracture frac;
  frac.phase.assign(3, AS_ELEMENT);
  frac.broken = {-1, -1, 0};
  el.frac = &frac;
  State st;
  Fragments f;
  frac_connect(m, el, st, f);
  return f;
}

}  // namespace

TEST(Fragments, one_node_connects_and_a_broken_element_does_not)
{
  const Fragments touching = two_corners(false), apart = two_corners(true);
  EXPECT_EQ(touching.of_elem, (IntVec{1, 1, 0}));
  EXPECT_EQ(apart.of_elem, (IntVec{1, 2, 0}));
}

TEST(Fragments, sums_are_the_ledger_before_conversion)
{
  Solved r;
  run_deck(std::string(plane) + "1e-3\n*END STEP\n", r);
  ASSERT_EQ(r.f.count(), 2);
  EXPECT_EQ(r.f.item[0].nelem, 4);
  EXPECT_EQ(r.f.item[1].nelem, 28);            // 2.5 to 6, and the body by its bond
  EXPECT_EQ(r.f.item[1].npoint, 16 * 4);
  EXPECT_EQ(r.f.item[2].nelem, 16);
  expect_sums(r);
}

TEST(Fragments, sums_are_the_ledger_after_conversion)
{
  // the bond of the deck has lost its nodes: the body is a piece of its own
  Solved r;
  run_deck(std::string(plane) + "5e-3\n*END STEP\n", r);
  ASSERT_EQ(r.f.count(), 3);
  EXPECT_EQ(r.f.item[1].nelem, 12);            // 2.5 to 4 elements, 4 to 6 points
  EXPECT_EQ(r.f.item[1].npoint, 16 * 4);
  EXPECT_EQ(r.f.item[2].npoint + r.f.item[3].npoint, 16 * 4);
  expect_sums(r);
}

TEST(Fragments, sums_are_the_ledger_in_three_dimensions)
{
  Solved r;
  run_deck(
      bricks("*CONVERSION, ELSET=CONV, TRIGGER=TIME, TIME=2e-3\n*GRID\n-1, -1, -1, 5, 2, 2\n0.5, 0.5, 0.5\n"),
      r);
  ASSERT_EQ(r.f.count(), 2);
  EXPECT_EQ(r.f.item[0].nelem, 4);
  EXPECT_EQ(r.f.item[1].nelem, 16);
  EXPECT_EQ(r.f.item[2].nelem, 4);
  EXPECT_EQ(r.f.item[2].npoint, 64);
  expect_sums(r);
}
