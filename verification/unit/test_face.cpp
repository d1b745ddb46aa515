// Faces: areas, outward normals, lattices of bonds; fill of bricks and tetrahedra.
#include <gtest/gtest.h>

#include <cmath>

#include "bond/bond.h"
#include "contact/contact.h"
#include "contact/contact_scene.h"
#include "point/point.h"
#include "shape/face.h"

namespace {

double lattice_area(int nen, const double* x, int parts, int* count)
{
  double sum = 0.0;
  const auto points = face_lattice(nen, x, parts);
  for (const FacePoint& p : points) {
    int all = 0;
    for (int w : p.iw) all += w;
    EXPECT_EQ(parts * parts, all);
    sum += p.share;
  }
  *count = static_cast<int>(points.size());
  return sum;
}

// a model of bricks in a row along x, one section, FILL=ELSET ready
Model brick_row(int n)
{
  Model m;
  m.dim = 3;
  Material mat;
  mat.young = mat.density = 1.0;
  m.material.push_back(mat);
  Section s{0, 0, 1.0, {}};
  m.section.push_back(s);
  for (int i = 0; i <= n; ++i)
    for (int k = 0; k < 2; ++k)
      for (int j = 0; j < 2; ++j) {
        m.mesh.node_label.push_back(static_cast<int>(m.mesh.node_label.size()) + 1);
        m.mesh.X.insert(m.mesh.X.end(), {1.0 * i, 1.0 * j, 1.0 * k});
      }
  Set all{"E", {}, {}};
  for (int e = 0; e < n; ++e) {
    const int a = 4 * e, b = 4 * e + 4;
    m.mesh.conn.item.insert(m.mesh.conn.item.end(), {a, b, b + 1, a + 1, a + 2, b + 2, b + 3, a + 3});
    m.mesh.conn.off.push_back(8 * (e + 1));
    m.mesh.elem_label.push_back(e + 1);
    m.mesh.elem_type.push_back(ELEM_C3D8);
    m.mesh.elem_section.push_back(0);
    all.item.push_back(e);
  }
  m.elset.push_back(all);
  return m;
}

// what one contact point at x meets of surface 0 of a model that has not moved
ContactPairs pairs_of_point(Model m, const RealVec& x)
{
  m.bond.resize(1);
  m.bond[0].kind   = BOND_CONTACT;
  m.bond[0].contact.master = 0;
  Bonds bonds;
  bonds.nbond  = 1;
  bonds.def    = {0};
  bonds.side  = {SIDE_CONTACT};
  bonds.contact.offset = {0.0};
  bonds.area   = {1.0};
  Points points;
  points.surface.resize(1);
  ContactPairs pairs;
  Level l;
  l.u.assign(m.mesh.X.size(), 0.0);
  l.slip.assign(m.dim, 0.0);
  contact_search(m, points, bonds, l, x, ContactScene(), pairs);
  return pairs;
}

}  // namespace

TEST(Face, LatticeSharesSumToTheArea)
{
  const double edge[6] = {0, 0, 0, 3, 4, 0}, tri[9] = {0, 0, 0, 2, 0, 0, 0, 2, 0};
  const double quad[12] = {0, 0, 0, 2, 0.1, 0, 1.8, 1.5, 0, -0.1, 1.1, 0};
  int count = 0;
  for (int parts : {1, 2, 3, 5}) {
    EXPECT_NEAR(5.0, lattice_area(2, edge, parts, &count), 1e-14);
    EXPECT_EQ(parts + 1, count);
    EXPECT_NEAR(2.0, lattice_area(3, tri, parts, &count), 1e-14);
    EXPECT_EQ((parts + 1) * (parts + 2) / 2, count);
    EXPECT_NEAR(0.5 * std::fabs((0 - 1.8) * (0.1 - 1.1) - (2 + 0.1) * (0 - 1.5)),
                lattice_area(4, quad, parts, &count), 1e-13);
    EXPECT_EQ((parts + 1) * (parts + 1), count);
  }
}

TEST(Face, NormalsOfAllShapesPointOut)
{
  static const double unit[5][24] = {
    {0, 0, 1, 0, 0, 1}, {0, 0, 1, 0, 1, 1, 0, 1}, {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1},
    {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 0, 1, 1},
    {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0, 0, 1, 1, 0, 1, 1, 1, 1, 0, 1, 1}};
  for (int s = 0; s < 5; ++s) {
    const ShapeInfo& info = shape_info[s];
    double centre[3] = {0, 0, 0}, closed[3] = {0, 0, 0};
    for (int a = 0; a < info.nen; ++a)
      for (int i = 0; i < info.dim; ++i) centre[i] += unit[s][a * info.dim + i] / info.nen;
    for (int f = 0; f < info.nface; ++f) {
      const int nen = info.nfnode[f];
      double x[12] = {0}, mid[3] = {0, 0, 0}, n[3], out = 0.0;
      for (int k = 0; k < nen; ++k)
        for (int i = 0; i < info.dim; ++i) {
          x[3 * k + i] = unit[s][info.face[f][k] * info.dim + i];
          mid[i] += x[3 * k + i] / nen;
        }
      const FaceRule& rule = face_rule(nen);
      for (int g = 0; g < rule.n; ++g) {
        face_area(nen, x, rule.xi[g], n);
        for (int i = 0; i < 3; ++i) closed[i] += rule.w[g] * n[i];
      }
      for (int i = 0; i < 3; ++i) out += n[i] * (mid[i] - centre[i]);
      EXPECT_GT(out, 0.0) << s << " face " << f;
    }
    for (double c : closed) EXPECT_NEAR(0.0, c, 1e-14) << s;
  }
}

TEST(Face, LatticeOfFourByFourHasNoBondTwice)
{
  Model m = brick_row(3);
  Surface s;
  s.name = "TOP";
  for (int e = 0; e < 3; ++e) s.face.push_back({e, 1});         // z = 1
  m.surface.push_back(s);
  BondDef d;
  d.kind = BOND_GROUND;
  d.surface = 0;
  d.intermediate = 2;
  m.bond.push_back(d);
  Bonds bonds;
  ASSERT_EQ(0, bond_form(m, Points(), bonds));
  EXPECT_EQ(10 * 4, bonds.nbond);
  double area = 0.0;
  int nodal = 0;
  for (int b = 0; b < bonds.nbond; ++b) {
    area += bonds.area[b];
    nodal += !bonds.intermediate[b];
    EXPECT_NEAR(1.0, bonds.normal[3 * b + 2], 1e-14);
    EXPECT_NEAR(1.0, bonds.X[3 * b + 2], 1e-14);
  }
  EXPECT_NEAR(3.0, area, 1e-13);
  EXPECT_EQ(8, nodal);
}

// A point straight over the node where four faces of a roof or of a dent meet: the mean of the four, so what
// is symmetric stays so
TEST(Face, ContactOverASharedNodeIsSymmetric)
{
  for (double top : {0.1, -0.1}) {
    Model m;
    m.dim = 3;
    for (int layer = 0; layer < 2; ++layer)
      for (int j = 0; j < 3; ++j)
        for (int i = 0; i < 3; ++i)
          m.mesh.X.insert(m.mesh.X.end(), {i - 1.0, j - 1.0, layer ? (i == 1 && j == 1 ? top : 0.0) : -1.0});
    m.mesh.X.insert(m.mesh.X.end(), {0.0, 0.0, top - 0.05});             // the point, a node of its own
    for (int n = 0; n < 19; ++n) m.mesh.node_label.push_back(n + 1);
    Surface s;
    for (int e = 0; e < 4; ++e) {
      const int a = e % 2 + 3 * (e / 2);
      m.mesh.conn.item.insert(m.mesh.conn.item.end(),
                              {a, a + 1, a + 4, a + 3, a + 9, a + 10, a + 13, a + 12});
      m.mesh.conn.off.push_back(8 * (e + 1));
      m.mesh.elem_label.push_back(e + 1);
      m.mesh.elem_type.push_back(ELEM_C3D8);
      s.face.push_back({e, 1});
    }
    m.surface.push_back(s);
    const ContactPairs pairs = pairs_of_point(m, {0.0, 0.0, top - 0.05});
    EXPECT_EQ(16, pairs.master.count(0));
    EXPECT_NEAR(0.0, pairs.normal[0], 1e-12);
    EXPECT_NEAR(0.0, pairs.normal[1], 1e-12);
    EXPECT_NEAR(1.0, pairs.normal[2], 1e-12);
    EXPECT_NEAR(-0.05, pairs.gap[0], 1e-3);
    double place[3] = {0, 0, 0}, sum = 0.0;
    for (int k = 0; k < pairs.master.count(0); ++k) {
      const int n = pairs.master.item[k];
      sum += pairs.master_w[k];
      for (int i = 0; i < 3; ++i) place[i] += pairs.master_w[k] * m.mesh.X[3 * n + i];
    }
    EXPECT_NEAR(1.0, sum, 1e-14);
    EXPECT_NEAR(0.0, place[0], 1e-12);
    EXPECT_NEAR(0.0, place[1], 1e-12);
    // a little aside one face is enough again
    EXPECT_EQ(4, pairs_of_point(m, {0.1, 0.2, top - 0.05}).master.count(0));
  }
}

// What a face meets (RIM2, BESIDE2, DEEPEST of contact_search.cpp): points over it, beside its rim by less than
// a hundredth of its size, below its edge by less than 14 degrees aside, to half of its size deep
TEST(Face, ContactMeetsNearTheRimAndNotTooDeep)
{
  Model m;
  m.dim = 3;
  m.mesh.X = {0, 0, -1, 1, 0, -1, 1, 1, -1, 0, 1, -1, 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0, 0.5, 0.5, 1};
  for (int n = 0; n < 9; ++n) m.mesh.node_label.push_back(n + 1);
  m.mesh.conn.item = {0, 1, 2, 3, 4, 5, 6, 7};
  m.mesh.conn.off  = {0, 8};
  m.mesh.elem_label = {1};
  m.mesh.elem_type  = {ELEM_C3D8};
  m.surface.resize(1);
  m.surface[0].face = {{0, 1}};
  const auto meets = [&](double beside, double gap) {
    return pairs_of_point(m, {1.0 + beside, 0.5, gap}).master.count(0) > 0;
  };
  EXPECT_TRUE(meets(-0.1, 0.1));
  EXPECT_TRUE(meets(0.009, 0.1));                    // rim
  EXPECT_FALSE(meets(0.02, 0.1));
  EXPECT_TRUE(meets(0.24 * 0.2, -0.2));              // below the edge
  EXPECT_FALSE(meets(0.26 * 0.2, -0.2));
  EXPECT_TRUE(meets(-0.1, -0.49));                   // depth
  EXPECT_FALSE(meets(-0.1, -0.51));
}

// in motion a gap goes on from where the step left it; a place that comes in from the side pushes only when
// it goes deeper, and what it has moved out does not come back  (4.16)
TEST(Face, ContactFromTheSideBringsNoDepth)
{
  Bonds bonds;
  bonds.nbond = 1;
  bonds.contact.initial_penetration = {0.0};
  Level l;
  ContactPairs met;
  met.master.item = {0};
  met.master.off  = {0, 1};
  auto gap = [&](double before, double now, bool may_come) {
    ContactPairs pairs = met;
    pairs.gap = {now};
    pairs.size = {1.0};
    l.slip = {before, 0.0, 0.0};
    contact_initial(l, 3, may_come, bonds, pairs);
    return pairs.gap[0];
  };
  EXPECT_EQ(-0.5, gap(1e300, -0.5, false));            // statics
  EXPECT_EQ(-0.4, gap(-0.4, -0.4005, true));           // was closed, slides over the edge of a facet
  EXPECT_NEAR(-0.4, gap(-0.4, -0.3995, true), 1e-15);
  EXPECT_NEAR(0.0005, bonds.contact.initial_penetration[0], 1e-15);
  EXPECT_EQ(-0.3995, gap(-0.4, -0.3995, false));       // statics measure
  EXPECT_EQ(0.0, bonds.contact.initial_penetration[0]);
  EXPECT_NEAR(-0.4, gap(-0.4, -0.5, true), 1e-15);     // was closed, meets another face
  EXPECT_EQ(0.0, gap(1e300, -0.5, true));              // met no face before
  EXPECT_EQ(-0.5, bonds.contact.initial_penetration[0]);
  EXPECT_NEAR(-0.1, gap(-0.1, -0.6, true), 1e-15);     // pressed deeper
  EXPECT_NEAR(-1e-9, gap(-1e-9, -0.3, true), 1e-15);   // moves out
  EXPECT_NEAR(-0.1, gap(-0.1, -0.4, true), 1e-15);     // and in again
  EXPECT_EQ(0.2, gap(0.1, 0.2, true));
  EXPECT_EQ(0.0, bonds.contact.initial_penetration[0]);
  EXPECT_EQ(-0.1, gap(-0.1, -0.1, true));
  EXPECT_EQ(0.0, gap(0.1, -0.3, true));                // was open over another face
  met.master.off = {0, 0};
  gap(-0.1, 1e300, true);
  EXPECT_EQ(0.0, bonds.contact.initial_penetration[0]);                      // meets nothing: forgotten
}

TEST(Fill, BricksAndTetrahedra)
{
  for (int per_cell : {1, 2, 3}) {
    Model m = brick_row(2);
    m.mesh.elem_section = {-1, -1};
    Body b;
    b.fill = FILL_ELSET;
    b.elset = 0;
    b.material = 0;
    b.per_cell = per_cell;
    m.body.push_back(b);
    Points p;
    ASSERT_EQ(0, point_fill(m, p));
    EXPECT_EQ(2 * per_cell * per_cell * per_cell, p.npoint);
    EXPECT_EQ((2 * per_cell + 1) * (per_cell + 1) * (per_cell + 1), p.ncorner);
    EXPECT_EQ(static_cast<size_t>(10 * per_cell * per_cell), p.boundary.size());
    double V = 0.0;
    for (double v : p.V0) V += v;
    EXPECT_NEAR(2.0, V, 1e-13);
    if (per_cell == 3) continue;
    m.mesh.conn.item = {0, 4, 1, 2};                             // one tetrahedron of volume 1/6
    m.mesh.conn.off = {0, 4};
    m.mesh.elem_label = {1};
    m.mesh.elem_type = {ELEM_C3D4};
    m.mesh.elem_section = {-1};
    m.elset[0].item = {0};
    ASSERT_EQ(0, point_fill(m, p));
    EXPECT_EQ(per_cell == 1 ? 1 : 8, p.npoint);
    EXPECT_EQ(per_cell == 1 ? 4u : 16u, p.boundary.size());
    V = 0.0;
    for (double v : p.V0) V += v;
    EXPECT_NEAR(1.0 / 6, V, 1e-14);
  }
}
