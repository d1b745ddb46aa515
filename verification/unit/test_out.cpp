// Output: quantities, history, checks, VTK files, places at t = 0.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "out/out.h"
#include "out/out_vtk_file.h"
#include "shape/shape.h"

namespace {

History ramp()                 // time 0 1 3, column q = 10 time, column w = 1 -5 2
{
  History h;
  h.names = {"time", "q", "w"};
  h.rows  = {{0, 0, 1}, {1, 10, -5}, {3, 30, 2}};
  return h;
}

Check history_check(const std::string& column, CheckAt at, double time)
{
  Check c;
  c.column = column;
  c.at     = at;
  c.time   = time;
  return c;
}

CheckResult judged(const Check& c, double target, double tolerance, bool finished = true)
{
  CheckResult r;
  r.target    = target;
  r.tolerance = tolerance;
  out_check_history(ramp(), c, finished, r);
  return r;
}

std::string file_text(const std::string& path)
{
  std::ifstream in(path, std::ios::binary);
  std::ostringstream text;
  text << in.rdbuf();
  return text.str();
}

struct Folder {                // scratch folder of one test
  std::string path = ::testing::TempDir() + "mpfe_out_test";
  ~Folder() { std::filesystem::remove_all(path); }
  std::string file(const std::string& name) const { return path + "/" + name; }
};

double big_endian_double(const std::string& bytes, std::size_t at)
{
  std::uint64_t bits = 0;
  for (int i = 0; i < 8; ++i) bits = bits << 8 | static_cast<unsigned char>(bytes[at + i]);
  double value;
  static_assert(sizeof value == sizeof bits, "double of 64 bits");
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

// unit square and the triangle right of it, one deformed state u = 0.1 x, -0.02 y
void two_elements(Model& m, Elements& el, State& s)
{
  m.mesh.X          = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 2, 0, 0};
  m.mesh.node_label = {1, 2, 3, 4, 5};
  m.mesh.elem_label = {1, 2};
  m.mesh.elem_type  = {ELEM_CPE4, ELEM_CPE3};
  m.mesh.conn.off   = {0, 4, 7};
  m.mesh.conn.item  = {0, 1, 2, 3, 1, 4, 2};
  el.block_of = {0, 1};
  for (int n = 0; n < 5; ++n) {
    s.n.u.push_back(0.1 * m.mesh.X[3 * n]);
    s.n.u.push_back(-0.02 * m.mesh.X[3 * n + 1]);
  }
}

}  // namespace

TEST(OutQuantity, WordsOfTheDeck)
{
  EXPECT_EQ(quantity_find("U2")->where, OF_MOTION);
  EXPECT_EQ(quantity_find("U2")->comp, 1);
  EXPECT_EQ(quantity_find("S12")->comp, 3);
  EXPECT_EQ(quantity_find("S13")->comp, quantity_find("S31")->comp);
  EXPECT_EQ(quantity_find("NONSENSE"), nullptr);
  EXPECT_FALSE(quantity_is_place(*quantity_find("RF1")));
  EXPECT_EQ(quantity_words(2, {OF_MOTION, OF_GRID}), "U1|U2|V1|V2|GRF1|GRF2");
  EXPECT_EQ(quantity_words(3, {OF_GRID}), "GRF1|GRF2|GRF3");
}

// each line of the table has the function of its kind
TEST(OutQuantity, EachHasItsValue)
{
  const std::string all =
      quantity_words(3, {OF_MOTION, OF_NODES, OF_SUPPORTS, OF_GRID, OF_CONTACT, OF_MODEL, OF_POINTS});
  std::istringstream words(all);
  std::string word;
  while (std::getline(words, word, '|')) {
    const Quantity& q = *quantity_find(word);
    EXPECT_EQ(q.node != nullptr, q.where == OF_MOTION || q.where == OF_NODES) << word;
    EXPECT_TRUE(q.where != OF_MOTION || q.corner) << word;
    EXPECT_EQ(q.contact != nullptr, q.where == OF_CONTACT) << word;
    EXPECT_EQ(q.model != nullptr, q.where == OF_MODEL) << word;
    EXPECT_EQ(q.point != nullptr, q.where == OF_POINTS) << word;
  }
}

TEST(OutQuantity, MisesOfShearAndPressure)
{
  const double shear[6] = {0, 0, 0, 2, 0, 0}, pressure[6] = {-3, -3, -3, 0, 0, 0};
  EXPECT_NEAR(mises_stress(shear), 2.0 * std::sqrt(3.0), 1e-14);
  EXPECT_NEAR(mises_stress(pressure), 0.0, 1e-14);
}

TEST(OutHistory, InterpolatesInTime)
{
  const History h = ramp();
  double value = 0.0;
  ASSERT_TRUE(history_at(h, 1, 2.5, value));
  EXPECT_NEAR(value, 25.0, 1e-13);
  ASSERT_TRUE(history_at(h, 2, 0.5, value));
  EXPECT_NEAR(value, -2.0, 1e-13);
  ASSERT_TRUE(history_at(h, 2, 3.0, value));
  EXPECT_EQ(value, 2.0);
  ASSERT_TRUE(history_at(h, 1, 3.0 + 1e-12, value));     // sums of dt are not exact
  EXPECT_FALSE(history_at(h, 1, 3.01, value));
  EXPECT_FALSE(history_at(h, 1, -0.1, value));
  EXPECT_FALSE(history_at(History(), 0, 0.0, value));
}

TEST(OutHistory, OneRow)
{
  History h;
  h.names = {"time", "q"};
  h.rows  = {{0, 7}};
  double value = 0.0;
  ASSERT_TRUE(history_at(h, 1, 0.0, value));
  EXPECT_EQ(value, 7.0);
}

TEST(OutHistory, Reductions)
{
  const RealVec value = {1, -4, 2}, weight = {1, 1, 2};
  EXPECT_DOUBLE_EQ(history_reduce(REDUCE_MEAN, value, weight), 0.25);
  EXPECT_DOUBLE_EQ(history_reduce(REDUCE_SUM, value, weight), 1.0);
  EXPECT_DOUBLE_EQ(history_reduce(REDUCE_MAX, value, weight), 2.0);
  EXPECT_DOUBLE_EQ(history_reduce(REDUCE_MIN, value, weight), -4.0);
  EXPECT_DOUBLE_EQ(history_reduce(REDUCE_ABSMAX, value, weight), 4.0);
  EXPECT_TRUE(std::isnan(history_reduce(REDUCE_MEAN, {}, {})));
}

TEST(OutCheck, ValuesOfAColumn)
{
  EXPECT_TRUE(judged(history_check("q", AT_TIME, 2.0), 20.0, 1e-12).pass);
  EXPECT_FALSE(judged(history_check("q", AT_TIME, 2.0), 20.1, 0.05).pass);
  EXPECT_TRUE(judged(history_check("q", AT_END, 0), 30.0, 0).pass);
  EXPECT_DOUBLE_EQ(judged(history_check("w", AT_MIN, 0), 0, 0).value, -5.0);
  EXPECT_DOUBLE_EQ(judged(history_check("w", AT_MAX, 0), 0, 0).value, 2.0);
  EXPECT_DOUBLE_EQ(judged(history_check("w", AT_ABSMAX, 0), 0, 0).value, 5.0);
  EXPECT_DOUBLE_EQ(judged(history_check("w", AT_END, 0), 3, 0).difference, -1.0);
}

TEST(OutCheck, NothingReadIsAFailure)
{
  const CheckResult late = judged(history_check("q", AT_TIME, 4.0), 40.0, 1e9);
  EXPECT_FALSE(late.pass);
  EXPECT_EQ(late.message, "time never reached");
  EXPECT_FALSE(judged(history_check("nothing", AT_END, 0), 0, 1e9).pass);
  EXPECT_FALSE(judged(history_check("q", AT_END, 0), 30, 1e9, false).pass);      // run stopped early
  EXPECT_TRUE(judged(history_check("q", AT_TIME, 1.0), 10, 1e-9, false).pass);   // this time was reached
}

TEST(OutCheck, NotANumberIsAFailure)
{
  History h = ramp();
  h.rows[1][1] = std::numeric_limits<double>::quiet_NaN();
  CheckResult r;
  r.tolerance = 1e300;
  out_check_history(h, history_check("q", AT_MAX, 0), true, r);
  EXPECT_FALSE(r.pass);
  out_check_history(h, history_check("q", AT_TIME, 1.0), true, r);
  EXPECT_FALSE(r.pass);
}

TEST(OutCheck, FieldIsDueOnce)
{
  Check c;
  c.kind = CHECK_FIELD;
  c.at   = AT_TIME;
  c.time = 0.3;
  CheckResult r;
  EXPECT_FALSE(out_check_due(c, r, 0.29));
  EXPECT_TRUE(out_check_due(c, r, 0.1 + 0.2));
  EXPECT_TRUE(out_check_due(c, r, 0.3 - 1e-13));
  r.done = true;
  EXPECT_FALSE(out_check_due(c, r, 0.4));
}

TEST(OutCheck, FieldWithoutElementsReadsNothing)
{
  Check c;
  c.kind = CHECK_FIELD;
  c.what = "U1";
  std::string message;
  EXPECT_TRUE(std::isnan(out_check_field(Model(), Elements(), State(), c, message)));
  EXPECT_FALSE(message.empty());
}

TEST(OutLocate, ElementsAtAPlace)
{
  Model m;
  Elements el;
  State s;
  two_elements(m, el, s);
  const double in_square[3] = {0.25, 0.5, 0}, on_edge[3] = {1, 0.5, 0}, outside[3] = {1.8, 0.8, 0};
  const Located a = out_locate(m, el, s.points, in_square);
  ASSERT_EQ(a.elem, IntVec({0}));
  const Quantity &u1 = *quantity_find("U1"), &x2 = *quantity_find("X2");
  EXPECT_NEAR(elem_nodal_at(m, s.n, u1, 0, a.N.data()), 0.025, 1e-14);
  EXPECT_NEAR(elem_nodal_at(m, s.n, x2, 0, a.N.data()), 0.49, 1e-14);
  EXPECT_EQ(out_locate(m, el, s.points, on_edge).elem, IntVec({0, 1}));
  EXPECT_TRUE(out_locate(m, el, s.points, outside).elem.empty());
}

TEST(OutLocate, PointsWhereNoElementIs)
{
  Model m;
  Elements el;
  State s;
  Points& p = s.points;
  p.npoint  = 1;
  p.ncorner = 4;
  p.Xc      = {0, 0, 2, 0, 2, 1, 0, 1};
  p.shape   = {SHAPE_QUAD4};
  p.conn.off  = {0, 4};
  p.conn.item = {0, 1, 2, 3};
  s.n.uc = {0, 0, 0.2, 0, 0.2, 0, 0, 0};
  s.n.vc = {3, 4, 3, 4, 3, 4, 3, 4};
  const double x[3] = {0.5, 0.5, 0};
  const Located found = out_locate(m, el, p, x);
  ASSERT_EQ(found.point, IntVec({0}));
  EXPECT_NEAR(point_nodal_at(m, p, s.n, *quantity_find("U1"), 0, found.N.data()), 0.05, 1e-14);
  EXPECT_EQ(point_nodal_at(m, p, s.n, *quantity_find("V2"), 0, found.N.data()), 4.0);
}

// a brick, a wedge or a tetrahedron far from the origin and skew: a place goes to natural coordinates and
// back
TEST(OutLocate, SolidsFarFromTheOrigin)
{
  const double unit[3][8][3] = {
    {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}},
    {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {0, 1, 1}},
    {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  const Shape shape[3] = {SHAPE_HEX8, SHAPE_WEDGE6, SHAPE_TET4};
  for (int k = 0; k < 3; ++k) {
    const int nen = shape_info[shape[k]].nen;
    double X[24], N[8], x[3] = {0, 0, 0}, xi[3];
    for (int a = 0; a < nen; ++a) {
      const double* u = unit[k][a];
      X[3 * a]     = 1e4 + 0.01 * (u[0] + 0.2 * u[1] * u[2]);
      X[3 * a + 1] = -2e4 + 0.01 * (u[1] + 0.3 * u[0]);
      X[3 * a + 2] = 3e4 + 0.02 * (u[2] - 0.1 * u[0] * u[1]);
    }
    const double inside[3] = {0.2, 0.3, 0.4};
    shape_eval(shape[k], inside, N, nullptr);
    for (int a = 0; a < nen; ++a)
      for (int i = 0; i < 3; ++i) x[i] += N[a] * X[3 * a + i];
    ASSERT_TRUE(shape_locate(shape[k], X, x, xi)) << k;
    for (int i = 0; i < 3; ++i) EXPECT_NEAR(xi[i], inside[i], 1e-8) << k;
    EXPECT_TRUE(shape_locate(shape[k], X, X, xi)) << "a corner is inside";
    x[2] += 0.03;
    EXPECT_FALSE(shape_locate(shape[k], X, x, xi)) << k;
  }
}

TEST(OutHistory, ColumnsInThreeDimensions)
{
  const Folder folder;
  Model m;
  m.dim = 3;
  Elements el;
  State s;
  s.ledger.momentum[2] = 5.0;
  s.ledger.angular[0]  = 6.0;
  s.ledger.angular[1]  = 7.0;
  Output out;
  out.base = folder.file("three");
  ASSERT_EQ(history_setup(m, el, s, out), 0);
  history_open(out);
  history_row(m, el, s, out);
  out_file_close(out.his, out.base);
  EXPECT_EQ(out.history.rows[0].size(), out.history.names.size());
  EXPECT_EQ(out.history.rows[0][history_column(out.history, "pz")], 5.0);
  EXPECT_EQ(out.history.rows[0][history_column(out.history, "lx")], 6.0);
  EXPECT_EQ(out.history.rows[0][history_column(out.history, "ly")], 7.0);
}

// uniaxial strain of a unit brick: the six in the order of CalculiX, xx yy zz xy xz yz
TEST(OutDat, SixComponentsOfABrick)
{
  const Folder folder;
  Model m;
  m.dim = 3;
  m.mesh.X = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1};
  m.mesh.node_label   = {1, 2, 3, 4, 5, 6, 7, 8};
  m.mesh.elem_label   = {9};
  m.mesh.elem_type    = {ELEM_C3D8};
  m.mesh.elem_section = {0};
  m.mesh.conn.off     = {0, 8};
  m.mesh.conn.item    = {0, 1, 2, 3, 4, 5, 6, 7};
  Material mat;
  mat.young = 1.0;
  m.material.push_back(mat);
  m.section.push_back({0, 0, 1.0, DeckLine()});
  m.elset.push_back({"E", {0}, DeckLine()});
  m.step.emplace_back();
  m.step[0].print.push_back({true, 0, {"E"}, 1, false});
  Elements el;
  int worst = -1;
  ASSERT_EQ(elem_setup(m, el, &worst), STATUS_OK);
  State s;
  s.log.step = 1;
  for (int n = 0; n < 8; ++n) {          // u1 = 0.02 y + 0.04 z, u2 = 0.06 z
    const double* X = &m.mesh.X[3 * n];
    s.n.u.insert(s.n.u.end(), {0.02 * X[1] + 0.04 * X[2], 0.06 * X[2], 0.0});
  }
  Output out;
  out.base = folder.file("brick");
  out_dat(m, el, s, out);
  out_file_close(out.dat, out.base);
  const std::string text = file_text(out.base + ".dat");
  const std::size_t at = text.find("         9   1");
  ASSERT_NE(at, std::string::npos) << text;
  double v[6];
  ASSERT_EQ(std::sscanf(text.c_str() + at + 14, "%14lf%14lf%14lf%14lf%14lf%14lf", v, v + 1, v + 2, v + 3,
                        v + 4, v + 5),
            6);
  const double strain[6] = {0, 0, 0, 0.01, 0.02, 0.03};
  for (int i = 0; i < 6; ++i) EXPECT_NEAR(v[i], strain[i], 1e-7) << i;
}

TEST(OutVtk, TextFile)
{
  const Folder folder;
  VtkFile f;
  vtk_open(f, folder.file("text.vtk"), "a title", 0.25, VTK_ASCII);
  ListTable conn;
  conn.off  = {0, 3};
  conn.item = {0, 1, 2};
  vtk_mesh(f, {0, 0, 1, 0, 0, 1}, 2, conn, {5});
  vtk_cell_data(f, 1);
  vtk_scalars(f, "S11", {2.5});
  vtk_labels(f, "label", {7});
  vtk_close(f);
  EXPECT_EQ(file_text(folder.file("text.vtk")),
            "# vtk DataFile Version 3.0\na title\nASCII\nDATASET UNSTRUCTURED_GRID\nFIELD FieldData 1\nTIME "
            "1 1 double\n0.25\n"
            "POINTS 3 double\n0 0 0\n1 0 0\n0 1 0\nCELLS 1 4\n3\n0\n1\n2\nCELL_TYPES 1\n5\n"
            "CELL_DATA 1\nSCALARS S11 float 1\nLOOKUP_TABLE default\n2.5\n"
            "SCALARS label int 1\nLOOKUP_TABLE default\n7\n");
}

TEST(OutVtk, BinaryIsBigEndian)
{
  const Folder folder;
  VtkFile f;
  vtk_open(f, folder.file("binary.vtk"), "a title", 0.25, VTK_BINARY);
  vtk_mesh(f, {1.5, -2.0}, 2, ListTable(), {});
  vtk_close(f);
  const std::string text = file_text(folder.file("binary.vtk"));
  const std::string head = "TIME 1 1 double\n", points = "POINTS 1 double\n";
  EXPECT_NE(text.find("\nBINARY\nDATASET UNSTRUCTURED_GRID\n"), std::string::npos);
  EXPECT_EQ(big_endian_double(text, text.find(head) + head.size()), 0.25);
  const std::size_t at = text.find(points) + points.size();
  EXPECT_EQ(big_endian_double(text, at), 1.5);
  EXPECT_EQ(big_endian_double(text, at + 8), -2.0);
  EXPECT_EQ(big_endian_double(text, at + 16), 0.0);
  EXPECT_EQ(text.substr(at + 24), "\nCELLS 0 0\n\nCELL_TYPES 0\n\n");
}

TEST(OutVtk, SeriesIsJson)
{
  const Folder folder;
  VtkSeries series;
  series.file = {"a_fe_000000.vtk", "a_fe_000001.vtk"};
  series.time = {0.0, 0.5};
  out_vtk_series(folder.file("a_fe.vtk.series"), series);
  EXPECT_EQ(file_text(folder.file("a_fe.vtk.series")),
            "{\n  \"file-series-version\" : \"1.0\",\n  \"files\" : [\n"
            "    { \"name\" : \"a_fe_000000.vtk\", \"time\" : 0 },\n"
            "    { \"name\" : \"a_fe_000001.vtk\", \"time\" : 0.5 }\n  ]\n}\n");
}

TEST(OutFile, MakesTheFolderAndSaysWhenItCannot)
{
  ::testing::FLAGS_gtest_death_test_style = "threadsafe";
  const Folder folder;
  std::FILE* file = out_file_open(folder.file("new/deep/x.txt"));
  ASSERT_NE(file, nullptr);
  out_file_close(file, "x.txt");
  EXPECT_EQ(file, nullptr);
  EXPECT_EXIT(out_file_open(folder.file("new/deep/x.txt/y")), ::testing::ExitedWithCode(EXIT_RESOURCE),
              "cannot open");
}
