// the deck reader: what it makes of a deck, and what it says when the deck is wrong

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "deck/deck.h"

namespace {

using Defines = std::vector<std::pair<std::string, double>>;

struct Answer {
  int errors = 0;
  Model m;
  std::string text;            // what went to stderr
};

std::filesystem::path folder()
{
  const auto f = std::filesystem::temp_directory_path() / ("mpfe_test_deck_" + std::to_string(getpid()));
  std::filesystem::create_directories(f);
  return f;
}

void write(const std::string& name, const std::string& text)
{
  std::ofstream(folder() / name, std::ios::binary) << text;
}

Answer read(const std::string& text, const Defines& defines = Defines())
{
  Answer a;
  write("deck.inp", text);
  testing::internal::CaptureStderr();
  a.errors = deck_read((folder() / "deck.inp").string(), defines, a.m);
  a.text = testing::internal::GetCapturedStderr();
  std::filesystem::remove_all(folder());
  return a;
}

bool says(const Answer& a, const std::string& text) { return a.text.find(text) != std::string::npos; }

const std::string block =
  "*BLOCK, TYPE=CPE4, ELSET=PLATE\n0, 0, 2, 1\n4, 2\n"
  "*MATERIAL, NAME=STEEL\n*ELASTIC\n210e9, 0.3\n*DENSITY\n7800\n"
  "*SOLID SECTION, ELSET=PLATE, MATERIAL=STEEL\n";
const std::string held = "*BOUNDARY\nPLATE_XMIN, 1, 2\n";
const std::string step = "*STEP\n*STATIC\n0.5, 1\n*END STEP\n";

double value_of(const Model& m, int k, const Load& l, double t)
{
  const double x[3] = {0, 0, 0};
  return load_value(m, m.step[k], l, x, t, t);
}

// by a table of labels, or by a search where they are far beyond the number of nodes
TEST(Deck, labels_far_apart_are_found)
{
  const std::string nodes = "*NODE\n2000000000, 0, 0\n1500, 1, 0\n3, 1, 1\n4, 0, 1\n5, 2, 0\n1001, 2, 1\n";
  const std::string elems = "*ELEMENT, TYPE=CPE4, ELSET=PLATE\n9, 2000000000, 1500, 3, 4\n"
                            "2147483647, 1500, 5, 1001, 3\n";
  const std::string rest = block.substr(block.find("*MATERIAL")) +
                           "*BOUNDARY\n2000000000, 1, 2\n4, 1, 2\n" + step;
  const Answer a = read(nodes + elems + rest);
  EXPECT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.m.mesh.conn.item, IntVec({0, 1, 2, 3, 1, 4, 5, 2}));
  const Answer twice = read(nodes + "*NODE\n1500, 5, 5\n2000000000, 6, 6\n" + elems + rest);
  EXPECT_TRUE(says(twice, "node 1500 is defined already")) << twice.text;
  EXPECT_TRUE(says(twice, "node 2000000000 is defined already")) << twice.text;
  const Answer none = read(nodes + elems + "*ELEMENT, TYPE=CPE4\n10, 2, 1500, 3, 1999999999\n" + rest);
  EXPECT_TRUE(says(none, "node 2 of element 10 is not defined")) << none.text;
}

TEST(Deck, block_has_labels_sets_and_surfaces)
{
  const Answer a = read(block + held + step);
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.text, "");
  EXPECT_EQ(a.m.job, "deck");
  EXPECT_EQ(a.m.mesh.nnode(), 15);
  EXPECT_EQ(a.m.mesh.nelem(), 8);
  EXPECT_EQ(a.m.mesh.node_label[5], 6);
  EXPECT_DOUBLE_EQ(a.m.mesh.X[3 * 5 + 1], 0.5);
  EXPECT_EQ(a.m.nset[model_find_nset(a.m, "PLATE_YMAX")].item, IntVec({10, 11, 12, 13, 14}));
  EXPECT_EQ(a.m.elset[model_find_elset(a.m, "PLATE")].item.size(), 8u);
  EXPECT_EQ(a.m.mesh.elem_section[7], 0);
  EXPECT_TRUE(a.m.material[0].used);
}

// outward normal of every face of a surface must point to its side
void expect_outward(const Model& m, const char* name, double nx, double ny)
{
  const int s = model_find_surface(m, name);
  ASSERT_GE(s, 0) << name;
  double length = 0.0;
  for (const Face& f : m.surface[s].face) {
    const ShapeInfo& info = shape_info[elem_table[m.mesh.elem_type[f.elem]].shape];
    const double* a = &m.mesh.X[3 * m.mesh.conn.begin(f.elem)[info.face[f.face][0]]];
    const double* b = &m.mesh.X[3 * m.mesh.conn.begin(f.elem)[info.face[f.face][1]]];
    const double l = std::hypot(b[0] - a[0], b[1] - a[1]);
    EXPECT_NEAR((b[1] - a[1]) / l, nx, 1e-12) << name;
    EXPECT_NEAR((a[0] - b[0]) / l, ny, 1e-12) << name;
    length += l;
  }
  EXPECT_NEAR(length, nx != 0.0 ? 1.0 : 2.0, 1e-12);
}

TEST(Deck, surfaces_of_blocks_point_outwards)
{
  for (const char* type : {"CPE4", "CPS3"}) {
    std::string text = block + held + step;
    text.replace(text.find("CPE4"), 4, type);
    const Answer a = read(text);
    ASSERT_EQ(a.errors, 0) << a.text;
    expect_outward(a.m, "PLATE_XMIN", -1, 0);
    expect_outward(a.m, "PLATE_XMAX", 1, 0);
    expect_outward(a.m, "PLATE_YMIN", 0, -1);
    expect_outward(a.m, "PLATE_YMAX", 0, 1);
  }
}

TEST(Deck, blocks_merge_and_map)
{
  const std::string second =
      "*BLOCK, TYPE=CPE4, ELSET=RIGHT, MERGE\n2, 0, 3, 1\n2, 2\n\"x + 0.1*(x - 2)\", \"y\"\n";
  const Answer a = read(block + second + "*SOLID SECTION, ELSET=RIGHT, MATERIAL=STEEL\n" + held + step);
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.m.mesh.nnode(), 15 + 6);
  EXPECT_NEAR(a.m.mesh.X[3 * 20], 3.1, 1e-14);
  EXPECT_EQ(a.m.nset[model_find_nset(a.m, "RIGHT_XMIN")].item,
            a.m.nset[model_find_nset(a.m, "PLATE_XMAX")].item);
}

TEST(Deck, parameters_and_command_line)
{
  const std::string text =
      "*PARAMETER\nn = 2\nE = 3*n^2\n*BLOCK, TYPE=CPE4, ELSET=PLATE\n0, 0, 1, 1\n<n>, <n+1>\n"
      "*MATERIAL, NAME=M\n*ELASTIC\n<E/7>, 0.\n*SOLID SECTION, ELSET=PLATE, MATERIAL=M\n" +
      held + step;
  const Answer a = read(text);
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.m.mesh.nelem(), 6);
  EXPECT_EQ(a.m.material[0].young, 12.0 / 7.0);
  const Answer b = read(text, Defines{{"n", 4.0}, {"spare", 1.0}});
  EXPECT_EQ(b.m.mesh.nelem(), 20);
  EXPECT_EQ(b.m.material[0].young, 48.0 / 7.0);
  EXPECT_TRUE(says(b, "-D spare is not used in this deck"));
  EXPECT_EQ(b.m.notes.param.at("n"), 4.0);
}

TEST(Deck, includes_crlf_tabs_comments_case_and_continuation)
{
  write("nodes.txt", "2, 1, 0\r\n** a comment\r\n\t3,\t1.0d0, +1.\r\n");
  const Answer a = read("*node , nset = all\r\n1, 0, 0,\r\n\r\n*INCLUDE, INPUT=nodes.txt\r\n4, 0, 1\r\n"
                        "*Element, type=cpe4,\r\n elset=Sheet\r\n1, 1, 2,\r\n3, 4\r\n"
                        "*MATERIAL, NAME=m\n*ELASTIC\n1.e5, .3\n*SOLIDSECTION, ELSET=SHEET, "
                        "MATERIAL=M\n*BOUNDARY\nall, 1, 2\n" +
                        step);
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.m.mesh.nnode(), 4);
  EXPECT_EQ(a.m.mesh.X[3 * 2 + 1], 1.0);
  EXPECT_EQ(a.m.nset[0].item.size(), 4u);
  EXPECT_EQ(a.m.mesh.nelem(), 1);
}

TEST(Deck, sets_by_range_name_and_place)
{
  const Answer a = read(
      block +
      "*NSET, NSET=ODD, GENERATE\n1, 5, 2\n*NSET, NSET=MORE\nODD, 2\n*NSET, NSET=TOP, WHERE=\"y > 0.99\"\n3\n"
      "*ELSET, ELSET=LEFT, WHERE=\"x < 1\"\n" +
      held + step);
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.m.nset[model_find_nset(a.m, "ODD")].item, IntVec({0, 2, 4}));
  EXPECT_EQ(a.m.nset[model_find_nset(a.m, "MORE")].item, IntVec({0, 1, 2, 4}));
  EXPECT_EQ(a.m.nset[model_find_nset(a.m, "TOP")].item, IntVec({2, 10, 11, 12, 13, 14}));
  EXPECT_EQ(a.m.elset[model_find_elset(a.m, "LEFT")].item, IntVec({0, 1, 4, 5}));
}

TEST(Deck, surfaces_by_where_are_free_faces)
{
  const Answer a = read(
      block +
      "*SURFACE, NAME=ALL, ELSET=PLATE\n*SURFACE, NAME=TOP, ELSET=PLATE, WHERE=\"abs(y - 1) < 1e-9\"\n"
      "*SURFACE, NAME=ONE\n3, S2\n" +
      held + step);
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.m.surface[model_find_surface(a.m, "ALL")].face.size(), 12u);
  const Surface& top = a.m.surface[model_find_surface(a.m, "TOP")];
  ASSERT_EQ(top.face.size(), 4u);
  EXPECT_EQ(top.face[0].elem, 4);
  EXPECT_EQ(top.face[0].face, 2);
  EXPECT_EQ(a.m.surface[model_find_surface(a.m, "ONE")].face[0].face, 1);
}

TEST(Deck, loads_stay_ramp_and_are_replaced)
{
  const Answer a = read(block + held +
    "*STEP\n*STATIC\n0.5, 1\n*CLOAD\nPLATE_XMAX, 2, 10\nPLATE_XMAX, 1, 5\n*END STEP\n"
    "*STEP\n*STATIC\n0.5, 2\n*CLOAD\nPLATE_XMAX, 2, 30\n*END STEP\n"
    "*STEP\n*STATIC\n0.5, 1\n*CLOAD, OP=NEW\nPLATE_XMAX, 2, 40\n*END STEP\n");
  ASSERT_EQ(a.errors, 0) << a.text;
  ASSERT_EQ(a.m.step[0].load.size(), 2u);
  EXPECT_DOUBLE_EQ(value_of(a.m, 0, a.m.step[0].load[0], 0.5), 5.0);
  ASSERT_EQ(a.m.step[1].load.size(), 3u);
  EXPECT_EQ(a.m.step[1].load[0].dof, 0);                                    // stays at 5
  EXPECT_DOUBLE_EQ(value_of(a.m, 1, a.m.step[1].load[0], 0.5), 5.0);
  EXPECT_DOUBLE_EQ(value_of(a.m, 1, a.m.step[1].load[1], 0.5), 7.5);        // 10 -> 30
  EXPECT_DOUBLE_EQ(value_of(a.m, 1, a.m.step[1].load[2], 0.5), 7.5);
  ASSERT_EQ(a.m.step[2].load.size(), 3u);                                   // OP=NEW: 5 leaves, 30 -> 40
  EXPECT_DOUBLE_EQ(value_of(a.m, 2, a.m.step[2].load[0], 0.5), 2.5);
  EXPECT_DOUBLE_EQ(value_of(a.m, 2, a.m.step[2].load[1], 0.5) + value_of(a.m, 2, a.m.step[2].load[2], 0.5),
                   35.0);
}

TEST(Deck, step_time_amplitudes_keep_their_end_value)
{
  const Answer a = read(
      block + held +
      "*AMPLITUDE, NAME=A\n0, 0, 1, 0.5, 2, 9\n*AMPLITUDE, NAME=B, TIME=TOTAL TIME\n0, 0, 4, 4\n"
      "*STEP\n*STATIC\n0.5, 1\n*CLOAD, AMPLITUDE=A\nPLATE_XMAX, 2, 10\n*CLOAD, AMPLITUDE=B\nPLATE_XMAX, 1, "
      "10\n*CLOAD, AMPLITUDE=A\nPLATE_YMAX, 2, \"6*x\"\n*END STEP\n" +
      step);
  ASSERT_EQ(a.errors, 0) << a.text;
  const Step& s = a.m.step[1];
  EXPECT_EQ(s.load[0].amplitude, -1);
  EXPECT_DOUBLE_EQ(value_of(a.m, 1, s.load[0], 0.3), 5.0);
  EXPECT_EQ(s.load[1].amplitude, 1);
  const double x[3] = {2.0, 1.0, 0.0};
  EXPECT_DOUBLE_EQ(load_value(a.m, s, s.load[2], x, 0.3, 1.3), 6.0);
}

TEST(Deck, supports_stay_ramp_and_are_replaced)
{
  const Answer a = read(block + held +
    "*STEP\n*STATIC\n0.5, 1\n*BOUNDARY\nPLATE_XMAX, 2, 2, 0.1\n*END STEP\n"
    "*STEP\n*STATIC\n0.5, 1\n*BOUNDARY\nPLATE_XMAX, 2, 2, 0.3\n*END STEP\n"
    "*STEP\n*STATIC\n0.5, 1\n*BOUNDARY, OP=NEW\nPLATE_XMIN, 1, 2\n*END STEP\n");
  ASSERT_EQ(a.errors, 0) << a.text;
  ASSERT_EQ(a.m.step[0].prescribed.size(), 3u);
  ASSERT_EQ(a.m.step[1].prescribed.size(), 3u);
  EXPECT_FALSE(a.m.step[1].prescribed[0].ramp);
  const Prescribed& b = a.m.step[1].prescribed[2];
  EXPECT_TRUE(b.ramp);
  const double x[3] = {0, 0, 0};
  EXPECT_DOUBLE_EQ(prescribed_value(a.m, b, x, 0.5, 1.5), 0.3);
  EXPECT_EQ(a.m.step[2].prescribed.size(), 2u);
}

TEST(Deck, a_node_and_direction_has_one_support)
{
  const Answer a = read(block + held +
                        "*STEP\n*STATIC\n0.5, 1\n*BOUNDARY\nPLATE_XMAX, 1, 1, 0.1\n10, 1, 1, 0.2\n*END STEP\n"
                        "*STEP\n*STATIC\n0.5, 1\n*BOUNDARY\n5, 1, 1, 0.3\n*END STEP\n");
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_TRUE(says(a, "for node 10, direction 1 in this step; the last value is used"));
  const std::vector<Prescribed>& one = a.m.step[0].prescribed;
  ASSERT_EQ(one.size(), 4u);
  EXPECT_EQ(one[2].node, IntVec({4, 14}));
  EXPECT_EQ(one[3].node, IntVec({9}));
  const std::vector<Prescribed>& two = a.m.step[1].prescribed;
  ASSERT_EQ(two.size(), 5u);
  EXPECT_EQ(two[2].node, IntVec({14}));
  EXPECT_EQ(two[4].node, IntVec({4}));
}

TEST(Deck, dload_kinds)
{
  const Answer a = read(block + held +
                        "*SURFACE, NAME=TOP, ELSET=PLATE, WHERE=\"y > 0.99\"\n*STEP\n*STATIC\n1, 1\n"
                        "*DLOAD\nPLATE, GRAV, 9.81, 0, -2\n4, P2, 3\nPLATE, BX, \"x\"\n4, TRVEC2, 7, 3, "
                        "4\n*DSLOAD\nTOP, P, 5\n*END STEP\n");
  ASSERT_EQ(a.errors, 0) << a.text;
  const std::vector<Load>& l = a.m.step[0].load;
  ASSERT_EQ(l.size(), 5u);
  EXPECT_TRUE(l[0].per_mass && l[0].dir[1] == -1.0 && l[0].elem.size() == 8u);
  EXPECT_TRUE(l[1].kind == LOAD_PRESSURE && a.m.surface[l[1].surface].face[0].elem == 3 &&
              a.m.surface[l[1].surface].face[0].face == 1);
  EXPECT_TRUE(l[2].kind == LOAD_BODY && !l[2].per_mass && l[2].dir[0] == 1.0);
  EXPECT_NEAR(l[3].dir[0], 0.6, 1e-15);
  EXPECT_TRUE(l[4].surface >= 0 && l[4].face.empty());
}

const std::string points =
  "*BLOCK, TYPE=CPE4, ELSET=SOFT\n0, 0, 1, 1\n2, 2\n*MATERIAL, NAME=M\n*ELASTIC\n1e5, 0.3\n*DENSITY\n1000\n"
  "*MATERIAL POINTS, BODY=SOFT, MATERIAL=M, FILL=ELSET, ELSET=SOFT, POINTS=3\n*GRID\n-1, -1, 2.4, 2\n0.5\n";
const std::string point_step = "*STEP, NLGEOM\n*DYNAMIC\n0.1, 1\n*END STEP\n";

TEST(Deck, surfaces_of_a_body_share_faces)
{
  const std::string skin = "*SURFACE, NAME=SKIN, TYPE=BODY, BODY=SOFT\n*SURFACE, NAME=LEFT, TYPE=BODY, "
                           "BODY=SOFT, WHERE=\"x < 1e-9\"\n";
  const auto step_of = [](const char* s) {
    return std::string("*STEP, NLGEOM\n*STATIC\n0.5, 1\n*DSLOAD\n") + s + "\n*END STEP\n";
  };
  const Answer a = read(points + skin + step_of("SKIN, P, 1") + step_of("LEFT, P, 3"));
  ASSERT_EQ(a.errors, 0) << a.text;
  const std::vector<Load>& l = a.m.step[1].load;
  ASSERT_EQ(l.size(), 3u);
  EXPECT_EQ(l[0].except, IntVec({l[2].surface}));
  EXPECT_EQ(l[1].only, IntVec({l[2].surface}));
  EXPECT_EQ(l[1].ramp, RAMP_OUT);
}

TEST(Deck, material_points_grid_and_bonds)
{
  const Answer a = read(points +
                        "*BOND, NAME=GLUE, TYPE=GROUND, SURFACE=SKIN, DOF=2, ALPHA=20\n0, \"0.1*t\"\n"
                        "*SURFACE, NAME=SKIN, TYPE=BODY, BODY=SOFT, WHERE=\"y < 1e-9\"\n*GRID "
                        "BOUNDARY\nXMIN, 1, 1\nY=-0.5, 2, 2, 0.1\n" +
                        point_step + "*HISTORY\nu, U2, SOFT\nr, GRF2, 2\n");
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.m.grid.n[0], 7);
  EXPECT_EQ(a.m.grid.n[1], 6);
  EXPECT_EQ(a.m.body[0].per_cell, 3);
  EXPECT_EQ(a.m.bond[0].surface, model_find_surface(a.m, "SKIN"));
  EXPECT_EQ(a.m.surface[a.m.bond[0].surface].body, 0);
  EXPECT_TRUE(a.m.bond[0].normal_only && a.m.bond[0].direction[1] == 1.0);
  EXPECT_DOUBLE_EQ(a.m.grid_bc[0].position, -1.0);
  EXPECT_DOUBLE_EQ(a.m.grid_bc[1].position, -0.5);
  EXPECT_EQ(a.m.step[0].scheme, SCHEME_ENERGY_MOMENTUM);
  EXPECT_EQ(a.m.output.history[0].body, 0);
  EXPECT_EQ(a.m.output.history[1].grid_bc, 1);
}

TEST(Deck, gravity_on_elements_that_become_points_acts_on_the_body)
{
  const Answer a = read(
      points +
      "*STEP, NLGEOM\n*DYNAMIC\n0.1, 1\n*DLOAD\nSOFT, GRAV, 9.81, 0, -1\n, GRAV, 1, 0, -1\n*END STEP\n");
  ASSERT_EQ(a.errors, 0) << a.text;
  for (const Load& l : a.m.step[0].load) {
    EXPECT_TRUE(l.elem.empty());
    EXPECT_EQ(l.body, IntVec({0}));
  }
}

TEST(Deck, scheme_follows_from_what_is_given)
{
  const std::string head = block + held + "*STEP\n*DYNAMIC", tail = "\n0.1, 1\n*END STEP\n";
  EXPECT_EQ(read(head + tail).m.step[0].scheme, SCHEME_NEWMARK);
  EXPECT_EQ(read(head + ", BETA=0.3" + tail).m.step[0].scheme, SCHEME_NEWMARK);
  EXPECT_EQ(read(head + ", DISSIPATION=0.1" + tail).m.step[0].scheme, SCHEME_ENERGY_MOMENTUM);
  EXPECT_EQ(read(head + ", SCHEME=ENERGY-MOMENTUM" + tail).m.step[0].scheme, SCHEME_ENERGY_MOMENTUM);
  // nothing linear: energy-momentum
  const std::string large = block + held + "*STEP, NLGEOM, BALANCE=0.2\n*DYNAMIC";
  EXPECT_EQ(read(large + tail).m.step[0].scheme, SCHEME_ENERGY_MOMENTUM);
  EXPECT_EQ(read(large + ", SCHEME=NEWMARK" + tail).m.step[0].scheme, SCHEME_NEWMARK);
  EXPECT_EQ(read(large + ", GAMMA=0.6" + tail).m.step[0].scheme, SCHEME_NEWMARK);
  const std::string contact =
      "*BLOCK, TYPE=CPE4, ELSET=BALL\n0, 1.1, 1, 2\n1, 1\n*SOLID SECTION, ELSET=BALL, MATERIAL=STEEL\n"
      "*CONTACT PAIR, NAME=C\nBALL_YMIN, PLATE_YMAX\n";
  const Answer a = read(block + held + contact + "*STEP\n*DYNAMIC" + tail);
  EXPECT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.m.step[0].scheme, SCHEME_ENERGY_MOMENTUM);
  EXPECT_EQ(a.m.step[0].balance, 0.05);
  EXPECT_EQ(read(large + tail).m.step[0].balance, 0.2);
  EXPECT_EQ(read(block + held + "*STEP\n*STATIC" + tail).m.step[0].balance, 0.0);
}

TEST(Deck, checks_and_history)
{
  const Answer a = read("*CHECK, TYPE=HISTORY, SOURCE=PUBLISHED, AT=MAX\ntip, -4, 2%\nKinetic, 0, 1e-3\n" +
                        block + held + step +
                        "*HISTORY, FREQUENCY=5\ntip, U2, 15\nr, RF1, PLATE_XMIN\ns, SMISES, AT, 0.5, 0.5\n"
                        "*CHECK, TYPE=FIELD, SOURCE=ANALYTIC, TIME=1, SCALE=3\nS11, \"x*y\", 5%\n");
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.m.output.history_at.frequency, 5);
  EXPECT_EQ(a.m.nset[a.m.output.history[0].nset].item, IntVec({14}));
  EXPECT_EQ(a.m.output.history[1].reduce, REDUCE_SUM);
  EXPECT_TRUE(a.m.output.history[2].at_point);
  ASSERT_EQ(a.m.output.check.size(), 3u);
  EXPECT_EQ(a.m.output.check[0].column, "TIP");
  EXPECT_DOUBLE_EQ(a.m.output.check[0].tolerance, 0.08);
  EXPECT_EQ(a.m.output.check[0].at, AT_MAX);
  EXPECT_EQ(a.m.output.check[1].column, "kinetic");
  EXPECT_DOUBLE_EQ(a.m.output.check[2].tolerance, 0.05);
}

TEST(Deck, output_requests)
{
  const Answer a = read(block + held +
                        "*STEP\n*STATIC\n0.5, 1\n*NODE FILE, FREQUENCY=3\nU, RF\n*EL FILE\nS\n*NODE PRINT, "
                        "NSET=PLATE_XMIN, TOTALS=YES\nRF, U\n*END STEP\n" +
                        step);
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_TRUE(a.m.output.vtk.on);
  EXPECT_EQ(a.m.output.vtk.frequency, 1);
  ASSERT_EQ(a.m.step[1].print.size(), 1u);
  EXPECT_TRUE(a.m.step[1].print[0].totals);
  EXPECT_EQ(a.m.step[1].print[0].what.size(), 2u);
}

// as gmsh writes it, but for the number of its elements
const char* const mesh_of_gmsh =
    "*Heading\n plate.inp\n*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 1, 1, 0\n4, 0, 1, 0\n"
    "******* E L E M E N T S *************\n*ELEMENT, type=T3D2, ELSET=Line1\n1, 1, 2\n"
    "*ELEMENT, type=T3D2, ELSET=Line3\n2, 3, 4\n*ELEMENT, type=T3D2, ELSET=Line7\n3, 1, 3\n"
    "*ELEMENT, type=CPS3, ELSET=Surface1\n11, 1, 2, 3\n12, 1, 3, 4\n"
    "*ELSET,ELSET=SIDES\n1, 2, \n*ELSET,ELSET=PLATE\n11, 12, \n";

TEST(Deck, elements_of_a_lower_dimension_become_sets_and_surfaces)
{
  const Answer a = read(std::string(mesh_of_gmsh) +
                        "*MATERIAL, NAME=A\n*ELASTIC\n1, 0.2\n*SOLID SECTION, ELSET=PLATE, MATERIAL=A\n"
                        "*BOUNDARY\nLINE1, 1, 2\n" +
                        step);
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.m.mesh.nelem(), 2);
  EXPECT_EQ(a.m.nset[model_find_nset(a.m, "SIDES")].item, (IntVec{0, 1, 2, 3}));
  EXPECT_EQ(a.m.nset[model_find_nset(a.m, "LINE3")].item, (IntVec{2, 3}));
  const int s = model_find_surface(a.m, "SIDES");
  ASSERT_GE(s, 0);
  ASSERT_EQ(a.m.surface[s].face.size(), 2u);
  EXPECT_EQ(a.m.surface[s].face[0].elem, 0);
  EXPECT_EQ(a.m.surface[s].face[1].face, 1);
  EXPECT_LT(model_find_surface(a.m, "LINE7"), 0);            // between two elements
}

TEST(Deck, elements_of_a_lower_dimension_carry_nothing)
{
  const Answer a = read(std::string(mesh_of_gmsh) +
                        "*MATERIAL, NAME=A\n*ELASTIC\n1, 0.2\n*SOLID SECTION, ELSET=PLATE, MATERIAL=A\n"
                        "*SOLID SECTION, ELSET=LINE1, MATERIAL=A\n" +
                        step);
  EXPECT_TRUE(says(a, "the elements of set LINE1 are of a lower dimension than the model")) << a.text;
}

TEST(Deck, words_of_calculix_that_change_no_answer)
{
  const Answer a = read("*NODE\n1\n2, 1.\n3, 1., 1.\n4, , 1.\n*ELEMENT, TYPE=CPE4, ELSET=PLATE\n1, 1, 2, 3, "
                        "4\n*MATERIAL, NAME=A\n"
                        "*ELASTIC\n1, 0.2, 293.\n*DENSITY\n1, 293.\n*SOLID SECTION, ELSET=PLATE, "
                        "MATERIAL=A\n*BOUNDARY\n1, 1, 6\n2, 2, 3\n4, 4\n"
                        "*STEP\n*STATIC, SOLVER=SPOOLES\n*NODE FILE, OUTPUT=2D\nU\n*NODE PRINT, NSET=1, "
                        "TOTALS=ONLY\nRF\n*END STEP\n");
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.m.mesh.X, (RealVec{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0}));
  ASSERT_EQ(a.m.step[0].prescribed.size(), 3u);      // 1 and 2 of node 1, 2 of node 2
  EXPECT_TRUE(says(a, "direction 4 is a rotation")) << a.text;
  EXPECT_TRUE(a.m.step[0].print[0].only);
}

TEST(Deck, an_error_shows_the_line_and_a_caret)
{
  const Answer a = read(block + "*ELASTIC\n1, 0.2\n*MATERIAL, NAME=B\n*ELASTIC\n\t 210.0e9,  0.52\n" + held +
                        step);
  EXPECT_EQ(a.errors, 2);
  EXPECT_TRUE(says(a, "line 14, *ELASTIC, field 2\n    210.0e9,  0.52\n              ^^^^\n  poisson = 0.52 "
                      "must lie between -1 and 0.5  (doc/keywords/ELASTIC.md)"))
      << a.text;
}

namespace {

std::size_t errors_printed(const Answer& a)
{
  std::size_t count = 0;
  for (std::size_t i = a.text.find("ERROR"); i != std::string::npos; i = a.text.find("ERROR", i + 1)) ++count;
  return count;
}

}  // namespace

TEST(Deck, all_mistakes_in_one_run_but_at_most_fifty_printed)
{
  std::string text = block + held + step;
  for (int i = 0; i < 120; ++i)
    text += "*NOTHING" + std::string(1, static_cast<char>('A' + i % 26)) +
            std::string(1, static_cast<char>('A' + i / 26)) + "\n";
  const Answer a = read(text);
  EXPECT_GE(a.errors, 120);
  EXPECT_TRUE(says(a, "70 more errors are not shown")) << a.text;
  EXPECT_EQ(errors_printed(a), 51u);
}

TEST(Deck, mistakes_of_one_kind_do_not_hide_others)
{
  std::string text = "*NODE\n" + block + held + step + "*NSET, NSET=A\n1\n";
  for (int i = 0; i < 1200; ++i) text.insert(6, std::to_string(i) + "x, 1, 1\n");
  const Answer a = read(text);
  EXPECT_TRUE(says(a, "and 1195 more of this kind")) << a.text;
  EXPECT_TRUE(says(a, "*NSET must precede the first *STEP")) << a.text;
  EXPECT_LT(errors_printed(a), 12u);
}

TEST(Deck, what_is_said_twice_is_a_warning)
{
  const std::string twice = "*MATERIAL, NAME=M\n*ELASTIC\n1, 0\n*DENSITY\n1\n*ELASTIC\n2, 0\n*DENSITY\n3\n"
                            "*BLOCK, TYPE=CPE4, ELSET=P\n0, 0, 1, 1\n<n>, 1\n*SOLID SECTION, ELSET=P, "
                            "MATERIAL=M\n*BOUNDARY\nP, 1, 2\n"
                            "*INITIAL CONDITIONS, TYPE=VELOCITY\nP, 1, 1\nP_XMIN, 1, 2\nP, 2, 1\n1, 2, 1\n";
  const Answer a = read("*PARAMETER\nn = 1\nn = 2\n" + twice + step);
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_TRUE(says(a, "replaces the value of n in "));
  EXPECT_TRUE(says(a, "material M has an *ELASTIC already; this one replaces it"));
  EXPECT_TRUE(says(a, "material M has a *DENSITY already; this one replaces it"));
  EXPECT_TRUE(says(a, "for node 1, direction 1; the last value is used"));
  EXPECT_FALSE(says(a, "direction 2; the last value is used"));     // the same value
  const Answer b = read("*PARAMETER\nn = 1\n" + twice + step, Defines{{"n", 2.0}});
  EXPECT_FALSE(says(b, "replaces the value of n"));
}

TEST(Deck, nearly_incompressible_material_locks)
{
  const auto text = [](const char* type, const char* nu) {
    return "*BLOCK, TYPE=" + std::string(type) +
           ", ELSET=P\n0, 0, 1, 1\n1, 1\n*MATERIAL, NAME=M\n*ELASTIC\n1, " + nu +
           "\n*SOLID SECTION, ELSET=P, MATERIAL=M\n" + "*BOUNDARY\nP, 1, 2\n" + step;
  };
  EXPECT_FALSE(says(read(text("CPE4", "0.4999")), "too stiff"));
  EXPECT_TRUE(says(read(text("CPE3", "0.499")), "too stiff"));
  EXPECT_FALSE(says(read(text("CPE4", "0.489")), "too stiff"));
  EXPECT_FALSE(says(read(text("CPE4I", "0.499")), "too stiff"));
  EXPECT_FALSE(says(read(text("CPS4", "0.499")), "too stiff"));
}

TEST(Deck, what_flows_and_may_break_locks)
{
  const auto text = [](const char* type, bool breaks) {
    return "*BLOCK, TYPE=" + std::string(type) +
           ", ELSET=P\n0, 0, 0, 1, 1, 1\n1, 1, 1\n*MATERIAL, NAME=M\n*ELASTIC\n1000, 0\n*DRUCKER PRAGER\n40, 1, 0\n"
           "*DRUCKER PRAGER HARDENING\n10, 0\n*SOLID SECTION, ELSET=P, MATERIAL=M\n" +
           (breaks ? "*EIGENFRACTURE, ELSET=P, CRITERION=COHESIVE\n0.01, 1\n" : "") + "*BOUNDARY\nP, 1, 3\n" + step;
  };
  EXPECT_FALSE(says(read(text("C3D8", false)), "too stiff"));
  EXPECT_TRUE(says(read(text("C3D4", false)), "use C3D20R or C3D8"));
  for (const char* type : {"C3D4", "C3D8"}) {
    const Answer a = read(text(type, true));
    EXPECT_TRUE(says(a, "material that may break has no F-bar")) << a.text;
    EXPECT_FALSE(says(a, "use C3D20R"));
    EXPECT_FALSE(says(a, "Poisson"));
  }
}

TEST(Deck, warnings_do_not_stop_the_run)
{
  const Answer a = read(block + "*MATERIAL, NAME=SPARE\n*ELASTIC\n1, 0\n" + held +
                        "*STEP\n*STATIC\n1, 1\n*CLOAD\n1, 1, 5\n*END STEP\n");
  EXPECT_EQ(a.errors, 0) << a.text;
  EXPECT_TRUE(says(a, "material SPARE is not used"));
  EXPECT_TRUE(says(a, "prescribed and loaded"));
}

// ---- three dimensions --------------------------------------------------------

std::string solid_block(const std::string& type)
{
  return "*BLOCK, TYPE=" + type +
         ", ELSET=B\n0, 0, 0, 2, 1, 3\n2, 3, 1\n*MATERIAL, NAME=M\n*ELASTIC\n1000, 0.3\n*DENSITY\n1\n"
         "*SOLID SECTION, ELSET=B, MATERIAL=M\n";
}

struct Vec { double v[3]; };

Vec cross_of(const Mesh& mesh, int a, int b, int c)       // (b - a) x (c - a)
{
  const double *A = &mesh.X[3 * a], *B = &mesh.X[3 * b], *C = &mesh.X[3 * c];
  const double p[3] = {B[0] - A[0], B[1] - A[1], B[2] - A[2]}, q[3] = {C[0] - A[0], C[1] - A[1], C[2] - A[2]};
  return {{p[1] * q[2] - p[2] * q[1], p[2] * q[0] - p[0] * q[2], p[0] * q[1] - p[1] * q[0]}};
}

// area vector of a surface of flat faces: sum of normal x area
Vec area_of(const Model& m, const char* name)
{
  Vec sum{{0, 0, 0}};
  const int s = model_find_surface(m, name);
  EXPECT_GE(s, 0) << name;
  for (const Face& f : m.surface[s].face) {
    const ShapeInfo& info = shape_info[elem_table[m.mesh.elem_type[f.elem]].shape];
    const int *conn = m.mesh.conn.begin(f.elem), *face = info.face[f.face];
    for (int a = 1; a + 1 < info.nfnode[f.face]; ++a) {
      const Vec c = cross_of(m.mesh, conn[face[0]], conn[face[a]], conn[face[a + 1]]);
      for (int i = 0; i < 3; ++i) sum.v[i] += 0.5 * c.v[i];
    }
  }
  return sum;
}

// volume inside the free faces: 1/3 of the sum of place x area over triangles; it is that of the mesh only
// when the faces of neighbours match
double volume_inside(const std::vector<Face>& faces, const Mesh& mesh)
{
  double volume = 0.0;
  for (const Face& f : faces) {
    const ShapeInfo& info = shape_info[elem_table[mesh.elem_type[f.elem]].shape];
    const int *conn = mesh.conn.begin(f.elem), *face = info.face[f.face];
    for (int a = 1; a + 1 < info.nfnode[f.face]; ++a) {
      const Vec c = cross_of(mesh, conn[face[0]], conn[face[a]], conn[face[a + 1]]);
      for (int i = 0; i < 3; ++i) volume += mesh.X[3 * conn[face[0]] + i] * c.v[i] / 6.0;
    }
  }
  return volume;
}

TEST(Deck3, blocks_of_bricks_wedges_and_tetrahedra)
{
  const struct {
    const char* type;
    int cut, faces;
  } kind[3] = {{"C3D8", 1, 22}, {"C3D6", 2, 34}, {"C3D4", 6, 44}};
  for (const auto& k : kind) {
    const Answer a = read(solid_block(k.type) +
                          "*SURFACE, NAME=SKIN, ELSET=B\n*BOUNDARY\nB_XMIN, ENCASTRE\n" + step);
    ASSERT_EQ(a.errors, 0) << a.text;
    EXPECT_EQ(a.m.dim, 3);
    EXPECT_EQ(a.m.mesh.nnode(), 24);
    EXPECT_EQ(a.m.mesh.nelem(), 6 * k.cut);
    const double side[6][3] = {{-3, 0, 0}, {3, 0, 0}, {0, -6, 0}, {0, 6, 0}, {0, 0, -2}, {0, 0, 2}};
    const char* const name[6] = {"B_XMIN", "B_XMAX", "B_YMIN", "B_YMAX", "B_ZMIN", "B_ZMAX"};
    std::size_t faces = 0;
    for (int s = 0; s < 6; ++s) {
      const Vec area = area_of(a.m, name[s]);
      for (int i = 0; i < 3; ++i) EXPECT_NEAR(area.v[i], side[s][i], 1e-13) << k.type << " " << name[s];
      faces += a.m.surface[model_find_surface(a.m, name[s])].face.size();
    }
    const Surface& skin = a.m.surface[model_find_surface(a.m, "SKIN")];
    EXPECT_EQ(skin.face.size(), faces) << k.type;
    EXPECT_EQ(static_cast<int>(faces), k.faces) << k.type;
    EXPECT_NEAR(volume_inside(skin.face, a.m.mesh), 6.0, 1e-13);
    EXPECT_EQ(a.m.nset[model_find_nset(a.m, "B_ZMAX")].item.size(), 12u);
    ASSERT_EQ(a.m.step[0].prescribed.size(), 3u);
    EXPECT_EQ(a.m.step[0].prescribed[2].first, 2);
  }
}

TEST(Deck3, blocks_merge_and_map)
{
  const Answer a = read(
      solid_block("C3D8") +
      "*BLOCK, TYPE=C3D4, ELSET=UP, MERGE\n0, 0, 3, 2, 1, 4\n2, 3, 1\n\"x\", \"y\", \"z + (z - 3)*x\"\n"
      "*SOLID SECTION, ELSET=UP, MATERIAL=M\n*BOUNDARY\nB_ZMIN, ZSYMM\n" +
      step);
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.m.mesh.nnode(), 24 + 12);
  EXPECT_EQ(a.m.nset[model_find_nset(a.m, "UP_ZMIN")].item, a.m.nset[model_find_nset(a.m, "B_ZMAX")].item);
  EXPECT_NEAR(a.m.mesh.X[3 * 26 + 2], 6.0, 1e-14);
  EXPECT_EQ(a.m.step[0].prescribed[0].first, 2);
}

TEST(Deck3, the_quarter_cylinder_of_135_bricks)
{
  const char* const lines[2] = {"1, 9, 3", "3, 5, 3"};
  for (const char* line : lines) {
    const Answer a = read(
        std::string("*CYLINDER, TYPE=C3D8, ELSET=I, QUARTER\n1, 2, 3, 25, 100\n") + line +
        "\n*MATERIAL, NAME=M\n*ELASTIC\n1000, 0.3\n*SOLID SECTION, ELSET=I, MATERIAL=M\n"
        "*SURFACE, NAME=SKIN, ELSET=I\n*BOUNDARY\nI_XSYM, XSYMM\nI_YSYM, YSYMM\nI_ZMIN, 3\n" +
        step);
    ASSERT_EQ(a.errors, 0) << a.text;
    EXPECT_EQ(a.m.mesh.nelem(), 135);
    const double section = 0.5 * 25 * 25 * 6 * std::sin(std::acos(-1.0) / 12);      // six triangles
    EXPECT_NEAR(area_of(a.m, "I_ZMIN").v[2], -section, 1e-10);
    EXPECT_NEAR(area_of(a.m, "I_ZMAX").v[2], section, 1e-10);
    EXPECT_NEAR(area_of(a.m, "I_XSYM").v[0], -2500, 1e-9);
    EXPECT_NEAR(area_of(a.m, "I_YSYM").v[1], -2500, 1e-9);
    EXPECT_NEAR(area_of(a.m, "I_R").v[0], 2500, 1e-9);
    EXPECT_NEAR(volume_inside(a.m.surface[model_find_surface(a.m, "SKIN")].face, a.m.mesh), 100 * section,
                1e-8);
    for (int n : a.m.nset[model_find_nset(a.m, "I_XSYM")].item) EXPECT_EQ(a.m.mesh.X[3 * n], 1.0);
    for (int n : a.m.nset[model_find_nset(a.m, "I_R")].item)
      EXPECT_NEAR(std::hypot(a.m.mesh.X[3 * n] - 1, a.m.mesh.X[3 * n + 1] - 2), 25.0, 1e-13);
  }
}

TEST(Deck3, full_cylinders_of_bricks_and_wedges)
{
  for (const char* type : {"C3D8", "C3D6"})
    for (int nsq : {1, 2, 5}) {
      const Answer a = read(std::string("*CYLINDER, TYPE=") + type + ", ELSET=I\n0, 0, 0, 2, 3\n2, 2, " +
                            std::to_string(nsq) +
                            "\n*MATERIAL, NAME=M\n*ELASTIC\n1000, 0.3\n*SOLID SECTION, ELSET=I, "
                            "MATERIAL=M\n*SURFACE, NAME=SKIN, ELSET=I\n*BOUNDARY\nI_ZMIN, PINNED\n" +
                            step);
      ASSERT_EQ(a.errors, 0) << a.text;
      EXPECT_EQ(a.m.mesh.nelem(), (type[3] == '8' ? 1 : 2) * 2 * (4 * nsq * nsq + 2 * 8 * nsq));
      const double section = 0.5 * 4 * 8 * nsq * std::sin(std::acos(-1.0) / (4 * nsq));
      EXPECT_NEAR(volume_inside(a.m.surface[model_find_surface(a.m, "SKIN")].face, a.m.mesh), 3 * section,
                  1e-12);
      const Vec mantle = area_of(a.m, "I_R");
      EXPECT_NEAR(std::fabs(mantle.v[0]) + std::fabs(mantle.v[1]) + std::fabs(mantle.v[2]), 0.0, 1e-12);
    }
}

TEST(Deck3, elements_by_hand_loads_and_history)
{
  const Answer a = read("*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 1, 1, 0\n4, 0, 1, 0\n5, 0, 0, 1\n6, 1, 0, 1\n7, "
                        "1, 1, 1\n8, 0, 1, 1\n9, 2, 0, 0\n"
                        "*ELEMENT, TYPE=C3D8, ELSET=E\n1, 1, 2, 3, 4,\n5, 6, 7, 8\n*ELEMENT, TYPE=C3D4, "
                        "ELSET=E\n2, 2, 9, 3, 6\n"
                        "*MATERIAL, NAME=M\n*ELASTIC\n1000, 0.3\n*DENSITY\n2\n*SOLID SECTION, ELSET=E, "
                        "MATERIAL=M\n*SURFACE, NAME=TOP, ELSET=E, WHERE=\"z > 0.99\"\n"
                        "*BOUNDARY\n1, 1, 3\n*INITIAL CONDITIONS, TYPE=VELOCITY\n7, 3, -2\n"
                        "*STEP\n*DYNAMIC\n1, 1\n*DLOAD\nE, GRAV, 9.81, 0, 0, -2\n1, P6, 3\nE, BZ, \"z\"\n2, "
                        "TRVEC3, 7, 0, 3, 4\n*DSLOAD\nTOP, TRVEC, 5, 0, 0, 1\n*CLOAD\n7, 3, 1\n*END STEP\n"
                        "*HISTORY\nu, U3, 7\nw, S31, E\np, E23, AT, 0.1, 0.2, 0.3\nr, RF3, 1\n*CHECK, "
                        "TYPE=FIELD, SOURCE=ANALYTIC, SCALE=1\nS23, \"z\", 1\nU3, 0, 1\n");
  ASSERT_EQ(a.errors, 0) << a.text;
  const std::vector<Load>& l = a.m.step[0].load;
  ASSERT_EQ(l.size(), 6u);
  EXPECT_TRUE(l[0].per_mass && l[0].dir[2] == -1.0);
  const auto is_on = [&](const Load& load, int elem, int face) {     // a surface of this face alone
    const std::vector<Face>& f = a.m.surface.at(load.surface).face;
    return f.size() == 1 && f[0].elem == elem && f[0].face == face;
  };
  EXPECT_TRUE(l[1].kind == LOAD_PRESSURE && is_on(l[1], 0, 5));
  EXPECT_TRUE(l[2].kind == LOAD_BODY && l[2].dir[2] == 1.0);
  EXPECT_NEAR(l[3].dir[2], 0.8, 1e-15);
  EXPECT_TRUE(l[3].kind == LOAD_TRACTION && is_on(l[3], 1, 2));
  EXPECT_TRUE(l[4].kind == LOAD_TRACTION && is_on(l[4], 0, 1));
  EXPECT_EQ(l[5].dof, 2);
  EXPECT_EQ(a.m.surface[0].face.size(), 1u);
  EXPECT_EQ(a.m.initial[0].dof, 2);
  ASSERT_EQ(a.m.output.history.size(), 4u);
  EXPECT_EQ(a.m.output.history[2].X[2], 0.3);
}

TEST(Deck3, grid_points_and_bonds_without_elements)
{
  const Answer a = read(
      "*MATERIAL, NAME=M\n*ELASTIC\n1000, 0.3\n*DENSITY\n1\n*GRID\n-1, -1, 0, 2, 2, 3.1\n0.5, 0.25\n"
      "*MATERIAL POINTS, BODY=A, MATERIAL=M\n0, 0, 1, 1, 1, 2\n4, 5, 6\n*SURFACE, NAME=LOW, TYPE=BODY, "
      "BODY=A, WHERE=\"z < 1.01\"\n"
      "*BOND, NAME=F, TYPE=GROUND, SURFACE=LOW, DOF=3, LATTICE=4\n0, 0, \"0.1*t\"\n*GRID BOUNDARY\nZMAX, "
      "3\nZ=0.5, 1, 3\n" +
      point_step + "*HISTORY\ng, GRF3, 2\n");
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.m.dim, 3);
  EXPECT_EQ(a.m.grid.n, (std::array<int, 3>{{6, 12, 7}}));
  EXPECT_EQ(a.m.grid.h[2], 0.5);
  EXPECT_EQ(a.m.body[0].cells[2], 6);
  EXPECT_EQ(a.m.body[0].plane, PLANE_NONE);
  EXPECT_EQ(a.m.bond[0].intermediate, 2);
  EXPECT_EQ(a.m.bond[0].direction[2], 1.0);
  const double x[3] = {0, 0, 0};
  EXPECT_DOUBLE_EQ(expr_eval(a.m.bond[0].motion[2], x, 2.0), 0.2);
  EXPECT_EQ(a.m.grid_bc[0].axis, 2);
  EXPECT_DOUBLE_EQ(a.m.grid_bc[0].position, 3.5);
  EXPECT_EQ(a.m.grid_bc[1].last, 2);
}

TEST(Deck3, the_dimension_is_seen_through_includes_and_continued_lines)
{
  write("mesh.txt", "*Block, elset=B,\n type = c3d8\n0, 0, 0, <w>, 1, 1\n1, 1, 1\n");
  const Answer a = read(
      "*PARAMETER\nw = 2\n*NODE\n100, 5, 5, 5\n*INCLUDE, INPUT=mesh.txt\n*MATERIAL, NAME=M\n*ELASTIC\n1, 0\n"
      "*SOLID SECTION, ELSET=B, MATERIAL=M\n*BOUNDARY\nB_XMIN, PINNED\n" +
      step);
  ASSERT_EQ(a.errors, 0) << a.text;
  EXPECT_EQ(a.m.dim, 3);
  EXPECT_EQ(a.m.mesh.X[2], 5.0);
  EXPECT_EQ(read(block + held + step).m.dim, 2);
}

}  // namespace
