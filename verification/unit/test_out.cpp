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
  EXPECT_EQ(quantity_find("U2").kind, Q_U);
  EXPECT_EQ(quantity_find("U2").comp, 1);
  EXPECT_EQ(quantity_find("S12").comp, 3);
  EXPECT_EQ(quantity_find("S13").comp, quantity_find("S31").comp);
  EXPECT_EQ(quantity_find("NONSENSE").kind, Q_NONE);
  EXPECT_TRUE(quantity_is_nodal(quantity_find("RF1")));
  EXPECT_FALSE(quantity_is_place(quantity_find("RF1")));
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
  Quantity u1 = quantity_find("U1"), x2 = quantity_find("X2");
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
  EXPECT_NEAR(point_nodal_at(m, p, s.n, quantity_find("U1"), 0, found.N.data()), 0.05, 1e-14);
  EXPECT_EQ(point_nodal_at(m, p, s.n, quantity_find("V2"), 0, found.N.data()), 4.0);
}

TEST(OutVtk, TextFile)
{
  const Folder folder;
  VtkFile f;
  vtk_open(f, folder.file("text.vtk"), "a title", 0.25, true);
  vtk_points(f, {0, 0, 1, 0, 0, 1}, 2);
  ListTable conn;
  conn.off  = {0, 3};
  conn.item = {0, 1, 2};
  vtk_cells(f, conn, {5});
  vtk_cell_data(f, 1);
  vtk_scalars(f, "S11", {2.5});
  vtk_labels(f, "label", {7});
  vtk_close(f);
  EXPECT_EQ(file_text(folder.file("text.vtk")),
            "# vtk DataFile Version 3.0\na title\nASCII\nDATASET UNSTRUCTURED_GRID\nFIELD FieldData 1\nTIME 1 1 double\n0.25\n"
            "POINTS 3 double\n0 0 0\n1 0 0\n0 1 0\nCELLS 1 4\n3\n0\n1\n2\nCELL_TYPES 1\n5\n"
            "CELL_DATA 1\nSCALARS S11 float 1\nLOOKUP_TABLE default\n2.5\n"
            "SCALARS label int 1\nLOOKUP_TABLE default\n7\n");
}

TEST(OutVtk, BinaryIsBigEndian)
{
  const Folder folder;
  VtkFile f;
  vtk_open(f, folder.file("binary.vtk"), "a title", 0.25, false);
  vtk_points(f, {1.5, -2.0}, 2);
  vtk_close(f);
  const std::string text = file_text(folder.file("binary.vtk"));
  const std::string head = "TIME 1 1 double\n", points = "POINTS 1 double\n";
  EXPECT_NE(text.find("\nBINARY\nDATASET UNSTRUCTURED_GRID\n"), std::string::npos);
  EXPECT_EQ(big_endian_double(text, text.find(head) + head.size()), 0.25);
  const std::size_t at = text.find(points) + points.size();
  EXPECT_EQ(big_endian_double(text, at), 1.5);
  EXPECT_EQ(big_endian_double(text, at + 8), -2.0);
  EXPECT_EQ(big_endian_double(text, at + 16), 0.0);
  EXPECT_EQ(text.size(), at + 25);
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
  EXPECT_EXIT(out_file_open(folder.file("new/deep/x.txt/y")), ::testing::ExitedWithCode(EXIT_RESOURCE), "cannot open");
}
