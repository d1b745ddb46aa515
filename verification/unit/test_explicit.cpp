// explicit steps: the largest stable increments of elements and points
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include <Eigen/Dense>
#include <gtest/gtest.h>

#include "deck/deck.h"
#include "elem/elem_share.h"
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

// 2/omega of a scalar field in the whole mesh, with the stiffness of a pressure wave and lumped masses
double stable_of_mesh(const Scene& s)
{
  const int nnode   = s.m.mesh.nnode();
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(nnode, nnode);
  Eigen::VectorXd mass = Eigen::VectorXd::Zero(nnode);
  for (const ElemBlock& b : s.p.d.el.block)
    for (size_t slot = 0; slot < b.elem.size(); ++slot) {
      const int *node = s.m.mesh.conn.begin(b.elem[slot]), nen = shape_info[b.shape].nen;
      const double* me = &b.me[static_cast<size_t>(b.kind[slot]) * pair_count(nen)];
      for (int a = 0, k = 0; a < nen; ++a)
        for (int c = 0; c <= a; ++c, ++k) {
          mass[node[a]] += me[k];
          if (c < a) mass[node[c]] += me[k];
        }
      for (int g = 0; g < shape_info[b.shape].ngp; ++g)
        for (int a = 0; a < nen; ++a)
          for (int c = 0; c < nen; ++c)
            for (int i = 0; i < 2; ++i)
              K(node[a], node[c]) += b.w[b.gauss(slot) + g] * (b.law.lam + 2.0 * b.law.mu) *
                                     b.dNdX[((b.gauss(slot) + g) * nen + a) * 2 + i] *
                                     b.dNdX[((b.gauss(slot) + g) * nen + c) * 2 + i];
    }
  const Eigen::MatrixXd M = mass.asDiagonal();
  const Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd> eigen(K, M, Eigen::EigenvaluesOnly);
  return 2.0 / std::sqrt(eigen.eigenvalues()(nnode - 1));
}

// (6.46): elements that share the masses of their nodes: a bound of the mesh, nearer than that of the worst
// element; equal elements keep theirs
TEST(Explicit, SharedMassesBoundTheMesh)
{
  for (const char* type : {"CPE4", "CPE3"}) {
    Scene s(block(type, "0,0,1,0.5",
                  "8,4\n\"x + 0.03*sin(40*x + 17*y)\", \"y + 0.03*cos(13*x + 50*y)\""));
    const double own = s.elements(), mesh = stable_of_mesh(s);
    elem_share(s.m, s.p.d.el);
    const double shared = s.elements();
    EXPECT_GT(shared, own + 0.5 * (mesh - own));
    EXPECT_LE(shared, mesh * (1.0 + 1e-12));
    elem_share_end(s.p.d.el);
    EXPECT_EQ(own, s.elements());
  }
  Scene equal(block("CPE4", "0,0,1,0.5", "4,2"));
  const double own = equal.elements();
  elem_share(equal.m, equal.p.d.el);
  EXPECT_EQ(own, equal.elements());
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

// what the end of an increment writes beside the levels does not survive when the increment is undone
TEST(Explicit, ResultsOfAnUndoneIncrementAreForgotten)
{
  Scene s(block("CPE4", "0,0,1,0.5", "4,2") +
          "*BLOCK, TYPE=CPE4, ELSET=C\n0,0.6,1,1\n4,2\n*SOLID SECTION, ELSET=C, MATERIAL=M\n*CONTACT\n"
          "*EIGENFRACTURE, ELSET=B\n1\n");
  State& st = s.st;
  ASSERT_FALSE(st.bonds.contact.met.empty());
  UndoPoint u;
  step_undo_later(st, u);
  const Bonds before = st.bonds;
  st.bonds.contact.met[0]  = 0;
  st.bonds.contact.wall[0] = 0;
  st.bonds.normal[0] += 1.0;
  st.contact.resize(s.m.bond.size());
  st.contact[0].work = 3.0;
  st.rf.assign(st.n.u.size(), 2.0);
  s.p.stable.rf.assign(st.n.u.size(), 1.0);
  st.np1 = st.n;
  step_undo_keep(st, u);
  std::swap(st.n, st.np1);
  step_undo_state(st, u);
  step_undo(s.p, u);
  EXPECT_EQ(before.contact.met, st.bonds.contact.met);
  EXPECT_EQ(before.contact.wall, st.bonds.contact.wall);
  EXPECT_EQ(before.normal, st.bonds.normal);
  EXPECT_TRUE(st.contact.empty());
  EXPECT_EQ(1.0, st.rf[0]);
}
