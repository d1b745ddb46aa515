// explicit steps: the largest stable increments of elements and points
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include <gtest/gtest.h>

#include "deck/deck.h"
#include "step/step.h"

namespace {

struct Scene {
  Model m;
  State st;
  Problem p{m, st};
  explicit Scene(const std::string& body)
  {
    const auto folder =
        std::filesystem::temp_directory_path() / ("mpfe_test_explicit_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "deck.inp") << "*MATERIAL, NAME=M\n*ELASTIC\n4, 0.2\n*DENSITY\n2\n" + body +
                                              "*STEP, NLGEOM\n*DYNAMIC, EXPLICIT\n, 1\n*END STEP\n";
    EXPECT_EQ(0, deck_read((folder / "deck.inp").string(), {}, m));
    std::filesystem::remove_all(folder);
    EXPECT_EQ(0, step_open(p));
    EXPECT_TRUE(step_prepare(p, m.step[0]).ok());
  }
  double elements()
  {
    int worst;
    return elem_stable(m, p.d.el, st.n, true, &worst);
  }
  double points()
  {
    int worst;
    return point_stable(st.points, m.dim, p.d.point_law, st.n, p.dofs.rows.owned_point, &worst);
  }
};

std::string block(const char* type, const char* box, const char* cells)
{
  return std::string("*BLOCK, TYPE=") + type + ", ELSET=B\n" + box + "\n" + cells +
         "\n*SOLID SECTION, ELSET=B, MATERIAL=M\n";
}

// speed of a pressure wave
double speed() { return std::sqrt(4.0 * 0.8 / (1.2 * 0.6) / 2.0); }

}  // namespace

// (6.30): travel time of a wave through a square and a cube; a triangle with legs h has 3c/h, a bar of 2:1 a
// little less than the short side
TEST(Explicit, StableIncrementOfElementsAtRest)
{
  EXPECT_NEAR(Scene(block("CPE4", "0,0,1,0.5", "4,2")).elements(), 0.25 / speed(), 1e-12);
  EXPECT_NEAR(Scene(block("C3D8", "0,0,0,1,0.5,0.5", "4,2,2")).elements(), 0.25 / speed(), 1e-12);
  EXPECT_NEAR(Scene(block("CPE3", "0,0,1,0.5", "4,2")).elements(), 2.0 / 3.0 * 0.25 / speed(), 1e-12);
  const double flat = Scene(block("CPE4", "0,0,1,0.25", "2,1")).elements();
  EXPECT_LE(flat, 0.25 / speed() * (1.0 + 1e-12));
  EXPECT_GE(flat, 0.2 / speed());
}

// (6.31): a bar that is stretched by 20 % along x
TEST(Explicit, StretchMakesTheIncrementShorter)
{
  Scene s(block("CPE4", "0,0,1,0.5", "4,2"));
  const double before = s.elements();
  for (int n = 0; n < s.m.mesh.nnode(); ++n) s.st.n.u[2 * n] = 0.2 * s.m.mesh.X[3 * n];
  EXPECT_NEAR(s.elements(), before / std::sqrt(1.0 + 1.5 * 0.44), 1e-12);
}

// (6.34): domains of half a cell with consistent mass
TEST(Explicit, StableIncrementOfPoints)
{
  Scene s("*GRID\n-1, -1, 3, 3\n0.5, 0.5\n*MATERIAL POINTS, BODY=P, MATERIAL=M, POINTS=2\n0, 0, 2, 2\n");
  EXPECT_NEAR(s.points(), 0.25 / (std::sqrt(3.0) * speed()), 1e-12);
}

// lumped masses, whose sum is that of the body
TEST(Explicit, MassesAreLumped)
{
  Scene s(block("CPE4", "0,0,1,0.5", "4,2"));
  double sum = 0.0;
  for (double m : s.p.dofs.mass.lumped) sum += m;
  EXPECT_NEAR(sum, 1.0, 1e-12);
  for (const Section& q : s.m.section) EXPECT_TRUE(q.lumped);
}
