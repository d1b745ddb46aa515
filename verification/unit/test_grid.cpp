// Active grid: partition, linear exactness, weak nodes, fill. Cases A1, S1.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "base/comm.h"
#include "base/weibull.h"
#include "bond/bond.h"
#include "contact/contact_near.h"
#include "dof/dof.h"
#include "mat/law.h"
#include "point/grid_cell.h"

namespace {

// a block of points [lo, lo + n h] on a grid from 0 with cells h
Model block_model(double lo, int cells, int per_cell, double weak)
{
  Model m;
  Material mat;
  mat.young   = 1.0;
  mat.density = 2.0;
  m.material.push_back(mat);
  m.grid.given = true;
  m.grid.h     = {{0.5, 0.25, 1.0}};
  m.grid.n     = {{20, 20, 1}};
  m.grid.weak  = weak;
  Body b;
  b.lo       = {{lo, lo, 0}};
  b.hi       = {{lo + 0.5 * cells, lo + 0.25 * cells, 0}};
  b.cells    = {{cells, cells, 0}};
  b.per_cell = per_cell;
  b.material = 0;
  m.body.push_back(b);
  return m;
}

struct Active {
  Points pts;
  ActiveGrid g;
  Active(const Model& m)
  {
    int worst = -1;
    EXPECT_EQ(0, point_fill(m, pts));
    EXPECT_EQ(STATUS_OK, grid_activate(m, pts, Bonds(), GridShare(), RealVec(pts.Xc.size(), 0.0), RealVec(), g, &worst));
  }
};

}  // namespace

// the numbers are those of elements (FracMesh.WeibullKeepsTheMeanAndTheSeedTheNumbers)
TEST(Fill, WeibullIsDrawnOnceForAllPointsOfACell)
{
  Model m = block_model(0.5, 15, 2, 0.05);
  FractureDef f;
  f.body    = 0;
  f.weibull = 3.0;
  f.seed    = 5;
  m.fracture.push_back(f);
  m.body[0].fracture = 0;
  Points pts;
  ASSERT_EQ(0, point_fill(m, pts));
  const int history = law_history(m), at = history - 2;
  RealVec hp(static_cast<size_t>(pts.npoint) * history, 0.0);
  point_scatter(m, pts, hp);
  IntVec numbers;
  for (int p = 0; p < pts.npoint; ++p) numbers.push_back(p);
  const RealVec drawn = weibull_draw(3.0, 1.0, 5, numbers);
  std::set<double> values;
  for (int p = 0; p < pts.npoint; ++p) {
    for (int k = 0; k < history; ++k) {
      if (k != at) { EXPECT_EQ(0.0, hp[p * history + k]); }
    }
    int first = p;
    for (int q = pts.next[p]; q != p; q = pts.next[q]) first = std::min(first, q);
    EXPECT_EQ(drawn[first], hp[p * history + at]);
    values.insert(hp[p * history + at]);
  }
  EXPECT_EQ(225u, values.size());
}

TEST(Fill, BlockSharesCornersAndKeepsMass)
{
  const Model m = block_model(0.5, 3, 2, 0.05);
  Points pts;
  ASSERT_EQ(0, point_fill(m, pts));
  EXPECT_EQ(36, pts.npoint);
  EXPECT_EQ(49, pts.ncorner);
  EXPECT_EQ(24u, pts.boundary.size());
  double mass = 0.0;
  for (double x : pts.mass) mass += x;
  EXPECT_NEAR(2.0 * 1.5 * 0.75, mass, 1e-14);
}

TEST(Fill, ElementSetOfQuadAndTriangleSharesTheEdge)
{
  Model m = block_model(0.0, 1, 3, 0.05);
  m.body[0].fill = FILL_ELSET;
  const double X[5][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}, {2, 0.5}};
  for (int n = 0; n < 5; ++n) {
    m.mesh.node_label.push_back(n + 1);
    m.mesh.X.insert(m.mesh.X.end(), {X[n][0], X[n][1], 0.0});
  }
  m.mesh.conn.item = {0, 1, 2, 3, 1, 4, 2};
  m.mesh.conn.off  = {0, 4, 7};
  m.mesh.elem_label = {1, 2};
  m.mesh.elem_type  = {ELEM_CPE4, ELEM_CPE3};
  m.mesh.elem_section = {-1, -1};
  m.elset.push_back({"E", {0, 1}, {}});
  m.body[0].elset = 0;
  Points pts;
  ASSERT_EQ(0, point_fill(m, pts));
  EXPECT_EQ(9 + 9, pts.npoint);
  EXPECT_EQ(16 + 10 - 4, pts.ncorner);
  double V = 0.0;
  for (double v : pts.V0) V += v;
  EXPECT_NEAR(1.5, V, 1e-14);
  EXPECT_EQ(9u + 6u, pts.boundary.size());
}

TEST(Grid, LinearFieldsAreExactWhereverTheBodyLies)
{
  for (double shift : {0.0, 1e-17, 1e-12, 1e-9, 1e-4, 0.05, 0.185, 0.25, 0.4999999999})
    for (double weak : {0.0, 0.05}) {
      const Model m = block_model(1.0 + shift, 4, 3, weak);
      const Active a(m);
      for (int p = 0; p < a.pts.npoint; ++p) {
        double sum = 0.0, grad[4] = {0}, none[2] = {0};
        for (int k = a.pts.conn.off[p]; k < a.pts.conn.off[p + 1]; ++k)
          for (int c = a.pts.conn.item[k], j = a.g.corner.off[c]; j < a.g.corner.off[c + 1]; ++j)
            sum += a.pts.w(p)[k - a.pts.conn.off[p]] * a.g.corner_w[j];
        for (int k = a.g.point.off[p]; k < a.g.point.off[p + 1]; ++k) {
          double x[3];
          grid_node_position(m.grid, 2, a.g.key[a.g.point.item[k]], x);
          for (int j = 0; j < 2; ++j) {
            none[j] += a.g.dS[2 * k + j];
            for (int i = 0; i < 2; ++i) grad[2 * i + j] += x[i] * a.g.dS[2 * k + j];
          }
        }
        EXPECT_NEAR(1.0, sum, 1e-13) << shift;
        EXPECT_NEAR(1.0, grad[0], 1e-11);
        EXPECT_NEAR(1.0, grad[3], 1e-11);
        EXPECT_NEAR(0.0, grad[1], 1e-11);
        EXPECT_NEAR(0.0, grad[2], 1e-11);
        EXPECT_NEAR(0.0, none[0], 1e-11);
      }
    }
}

TEST(Grid, AlignedBodyActivatesItsOwnCellsOnly)
{
  const Model m = block_model(1.0, 4, 2, 0.05);
  const Active a(m);
  EXPECT_EQ(16, a.g.ncell);
  EXPECT_EQ(25, a.g.nnode);
  EXPECT_EQ(0, a.g.of_all.weak);
}

TEST(Grid, BarelyTouchedNodesFollow)
{
  const Model m = block_model(1.0 + 1e-4, 4, 2, 0.05);
  const Active a(m);
  EXPECT_EQ(11, a.g.of_all.weak);          // the upper row and the right column of the 6 x 6 touched nodes
  EXPECT_EQ(25, a.g.nnode);
  EXPECT_EQ(0, a.g.nlone);
}

// The grid moves along until a corner that it carries has gone a tenth of a cell, summed over the directions
TEST(Grid, StaysUntilACornerHasGone)
{
  Model m = block_model(0.63, 4, 2, 0.05);
  Active a(m);
  RealVec uc(a.pts.Xc.size(), 0.3);
  const GridLaid laid{uc, {}, 0, a.g.made};
  bool meets = false;
  const auto stays = [&]() { return grid_stays(m, a.pts, Bonds(), laid, meets, uc, RealVec()); };
  EXPECT_TRUE(stays());
  // a way of KEEP itself, with the rounding of many equal increments, on either side
  for (double rounding : {-1e-13, 1e-13}) {
    uc[0] = 0.3 + 0.1 * m.grid.h[0] * (1.0 + rounding);
    EXPECT_TRUE(stays());
  }
  uc[0] = 0.3 + 0.1 * m.grid.h[0] * (1.0 + 1e-6);
  EXPECT_FALSE(stays());
  uc[0] = 0.3 + 0.06 * m.grid.h[0];
  uc[1] -= 0.035 * m.grid.h[1];
  EXPECT_TRUE(stays());
  uc[1] -= 0.01 * m.grid.h[1];
  EXPECT_FALSE(stays());
  uc.assign(uc.size(), 0.3);
  meets = true;                // bodies meet through it: a tenth of the way
  uc[0] += 0.009 * m.grid.h[0];
  EXPECT_TRUE(stays());
  uc[0] += 0.002 * m.grid.h[0];
  EXPECT_FALSE(stays());
  meets = false;
  uc[0] += 0.1 * m.grid.h[0];
  a.pts.field[0] = FIELD_OWN;
  EXPECT_TRUE(stays());
  m.grid.keep = 0.0;
  EXPECT_FALSE(stays());
  EXPECT_FALSE(grid_stays(m, a.pts, Bonds(), GridLaid(), false, uc, RealVec()));
}

// Two blocks have nodes of one grid field in common when the cells of their corners are neighbours
TEST(Grid, KnowsWhatMeetsThroughIt)
{
  Model m = block_model(0.63, 4, 2, 0.05);
  EXPECT_FALSE(Active(m).g.meets);
  Body b = m.body[0];
  for (double gap : {2.2, 0.6, 0.0}) {               // in cells
    b.lo[0] = m.body[0].hi[0] + gap * m.grid.h[0];
    b.hi[0] = b.lo[0] + 2.0;
    Model two = m;
    two.body.push_back(b);
    EXPECT_EQ(gap < 1.0, Active(two).g.meets) << gap;
    two.body[1].field = 1;
    EXPECT_FALSE(Active(two).g.meets) << gap;
  }
}

TEST(Grid, LeavingTheGridIsReported)
{
  const Model m = block_model(9.0, 4, 2, 0.05);
  Points pts;
  ActiveGrid g;
  int worst = -1;
  point_fill(m, pts);
  EXPECT_EQ(OUTSIDE_GRID, grid_activate(m, pts, Bonds(), GridShare(), RealVec(pts.Xc.size(), 0.0), RealVec(), g, &worst));
  EXPECT_GE(worst, 0);
}

namespace {

// what each point sees of the grid, by its label: keys of nodes, gradients
using Seen = std::map<long, std::vector<double>>;

Seen seen_by(const Points& pts, const ActiveGrid& g, int dim, int p)
{
  Seen out;
  for (int k = g.point.off[p]; k < g.point.off[p + 1]; ++k)
    for (int i = 0; i < dim; ++i) out[g.key[g.point.item[k]]].push_back(g.dS[static_cast<size_t>(k) * dim + i]);
  for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) {
    const int c = pts.conn.item[k];
    for (int i = 0; i < dim; ++i) out[-1 - (k - pts.conn.off[p])].push_back(pts.Xc[c * dim + i]);
  }
  return out;
}

// a motion that spreads the points over the grid unevenly
RealVec moved(const Points& pts, int dim)
{
  RealVec uc(pts.Xc.size());
  for (size_t i = 0; i < uc.size(); ++i)
    uc[i] = 0.07 * std::sin(3.0 * pts.Xc[i] + static_cast<double>(i % dim)) + 0.021;
  return uc;
}

void expect_parts_of_whole(Model m, bool meets)
{
  Points whole, part;
  ActiveGrid of_whole, of_part;
  int worst = -1;
  ASSERT_EQ(0, point_fill(m, whole));
  ASSERT_EQ(STATUS_OK, grid_activate(m, whole, Bonds(), GridShare(), moved(whole, m.dim), {}, of_whole, &worst));
  m.part.on = m.part.points = true;
  IntVec none;
  point_fill_ranks(none, m);
  ASSERT_EQ(0, point_fill(m, part));
  GridShare own;
  own.on = true;
  own.corner.assign(part.ncorner, 0);
  own.owner = part.part.halo.owner;
  double points = 0.0, faces = 0.0;
  for (int p = 0; p < part.npoint; ++p) {
    own.point.push_back(part.part.rank[p] == comm_rank());
    points += own.point[p];
    for (int k = part.conn.off[p]; k < part.conn.off[p + 1] && own.point[p]; ++k) own.corner[part.conn.item[k]] = 1;
  }
  for (const Face& f : part.boundary) faces += own.point[f.elem];
  EXPECT_NE(part.boundary.size(), whole.boundary.size());
  ASSERT_EQ(STATUS_OK, grid_activate(m, part, Bonds(), own, moved(part, m.dim), {}, of_part, &worst));
  double sum[4] = {points, faces, double(of_part.ghost.size()), double(of_part.ncell)};
  comm_sum(sum, 4);
  EXPECT_EQ(whole.npoint, sum[0]);
  EXPECT_EQ(whole.boundary.size(), sum[1]);
  EXPECT_EQ(of_whole.ghost.size(), sum[2]);
  EXPECT_EQ(of_whole.ncell, sum[3]);
  EXPECT_EQ(whole.npoint, part.npoint_all());
  EXPECT_EQ(whole.ncorner, part.part.ncorner);
  EXPECT_EQ(of_whole.of_all.nodes, of_part.of_all.nodes);
  EXPECT_EQ(of_whole.of_all.cells, of_part.of_all.cells);
  EXPECT_EQ(of_whole.of_all.weak, of_part.of_all.weak);
  EXPECT_EQ(meets, of_whole.meets);
  EXPECT_EQ(meets, of_part.meets);
  for (int p = 0; p < part.npoint; ++p) {
    ASSERT_EQ(part.part.point[p] + 1, part.label[p]);
    if (!own.point[p]) continue;
    const Seen here = seen_by(part, of_part, m.dim, p), there = seen_by(whole, of_whole, m.dim, part.part.point[p]);
    ASSERT_EQ(there.size(), here.size()) << "point " << part.label[p];
    for (const auto& [key, value] : there) {
      ASSERT_EQ(1u, here.count(key));
      for (size_t i = 0; i < value.size(); ++i) EXPECT_NEAR(value[i], here.at(key)[i], 1e-12);
    }
    EXPECT_EQ(whole.V0[part.part.point[p]], part.V0[p]);
  }
}

}  // namespace

// each rank has points of its own, and sees of the grid what one rank with all of them sees there
TEST(Divided, PointsOfEachRank)
{
  if (comm_size() == 1) GTEST_SKIP() << "several ranks";
  Model m = block_model(0.5, 3, 2, 0.3);
  const long cells = point_fill_cells(m);
  EXPECT_EQ(std::max(1L, std::min<long>(comm_size(), cells / 16)), dof_ranks(m));
  expect_parts_of_whole(m, false);
  m.grid.ghost_stiffness = m.grid.ghost_mass = 0.1;
  expect_parts_of_whole(m, false);
  m = block_model(0.5, 3, 2, 0.0);
  m.body.push_back(m.body[0]);           // a second block, less than a cell above the first one
  m.body[1].lo[1] = m.body[0].hi[1] + 0.1;
  m.body[1].hi[1] += m.body[1].lo[1] - m.body[0].lo[1];
  expect_parts_of_whole(m, true);
}

namespace {

// A row of 32 x 4 x 4 bricks: finite elements, and two bodies of points with nodes in common; a box of points
// between them in the deck, and springs at the end
Model row_of_bricks()
{
  Model m = block_model(0.5, 3, 2, 0.0);
  const int n[3] = {32, 4, 4};
  m.dim    = 3;
  m.grid.n = {{40, 40, 10}};
  m.elset.resize(2);
  for (int z = 0; z <= n[2]; ++z)
    for (int y = 0; y <= n[1]; ++y)
      for (int x = 0; x <= n[0]; ++x) {
        m.mesh.node_label.push_back(m.mesh.nnode() + 1);
        m.mesh.X.insert(m.mesh.X.end(), {0.3 * x + 0.01 * y, 0.1 * y + 0.003 * x, 0.07 * z});
      }
  int type = 0;
  while (elem_table[type].shape != SHAPE_HEX8) ++type;
  const int up = n[0] + 1, over = up * (n[1] + 1);
  for (int z = 0; z < n[2]; ++z)
    for (int y = 0; y < n[1]; ++y)
      for (int x = 0; x < n[0]; ++x) {
        const int e = m.mesh.nelem(), a = z * over + y * up + x, b = a + over;
        m.mesh.elem_label.push_back(e + 1);
        m.mesh.elem_type.push_back(type);
        m.mesh.elem_section.push_back(x < 8 ? 0 : -1);
        for (int k : {a, a + 1, a + up + 1, a + up, b, b + 1, b + up + 1, b + up}) m.mesh.conn.item.push_back(k);
        m.mesh.conn.off.push_back(static_cast<int>(m.mesh.conn.item.size()));
        if (x >= 8) m.elset[x < 20].item.push_back(e);
      }
  m.section.resize(1);
  m.body[0].hi[2]    = 1.0;
  m.body[0].cells[2] = 1;
  m.body[0].field    = 1;
  m.body = {m.body[0], m.body[0], m.body[0]};
  for (int b : {0, 2}) {
    m.body[b].fill  = FILL_ELSET;
    m.body[b].elset = b / 2;
    m.body[b].field = 0;
  }
  m.surface.resize(1);
  m.surface[0].body = 0;
  std::string error;
  int position = 0;
  EXPECT_TRUE(expr_compile("x > 9.4 && z < 0.01", {}, m.surface[0].where, error, position)) << error;
  m.bond.resize(1);
  m.bond[0].kind    = BOND_GROUND;
  m.bond[0].surface = 0;
  return m;
}

}  // namespace

// of elements that are points from the start each rank has its own and those around them, and numbers, places
// and boundary are those of one rank; of points that springs hold it knows those at its corners, and forms the
// springs there
TEST(Divided, PointsOfElementsNearby)
{
  if (comm_size() == 1) GTEST_SKIP() << "several ranks";
  const Model of_all = row_of_bricks();
  Model m;
  if (comm_rank() == 0) m = row_of_bricks();
  dof_part({}, m);
  ASSERT_TRUE(m.part.on && m.part.points);
  Points whole, pts;
  ASSERT_EQ(0, point_fill(of_all, whole));
  ASSERT_EQ(0, point_fill(m, pts));
  const int known = pts.npoint + pts.part.outer_conn.size(), layer = 16;
  RealVec elems(of_all.mesh.nelem(), 0.0), points(whole.npoint, 0.0);
  int outer = 0;
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    elems[m.part.elem[e]] += m.part.works(e);
    outer += !m.part.works(e);
  }
  EXPECT_LE(outer, 3 * layer);                       // of 24 that are points; cuts are ragged
  EXPECT_LE(known, whole.npoint / comm_size() + 3 * 8 * layer + 100);
  EXPECT_EQ(whole.npoint, pts.npoint_all());
  EXPECT_EQ(whole.ncorner, pts.part.ncorner);
  std::set<std::pair<int, int>> boundary;            // number of a point, its face
  for (const Face& f : whole.boundary) boundary.insert({f.elem, f.face});
  const std::vector<char> own = bond_own(m, pts);
  const auto is_own = [&](const Face& f) {
    const ShapeInfo& info = shape_info[pts.shape[f.elem]];
    return std::any_of(info.face[f.face], info.face[f.face] + info.nfnode[f.face],
                       [&](int a) { return own[m.mesh.nnode() + pts.conn.begin(f.elem)[a]]; });
  };
  for (const Face& f : pts.boundary)
    EXPECT_TRUE(!is_own(f) || boundary.count({pts.part.point[f.elem], f.face}));
  for (int p = 0; p < pts.npoint; ++p) {
    const int w = pts.part.point[p];
    points[w] += pts.part.rank[p] == comm_rank();
    ASSERT_EQ(whole.body[w], pts.body[p]);
    EXPECT_EQ(whole.V0[w], pts.V0[p]);
    for (int a = 0; a < pts.conn.count(p); ++a) {
      const int c = pts.conn.begin(p)[a], of_whole = whole.conn.begin(w)[a];
      ASSERT_EQ(of_whole, pts.part.corner[c]);
      for (int i = 0; i < 3; ++i) EXPECT_EQ(whole.Xc[3 * of_whole + i], pts.Xc[3 * c + i]);
    }
  }
  comm_sum(elems);
  comm_sum(points);
  EXPECT_EQ(elems, RealVec(of_all.mesh.nelem(), 1.0));
  EXPECT_EQ(points, RealVec(whole.npoint, 1.0));
  ASSERT_FALSE(whole.surface[0].empty());
  Bonds one, b;
  ASSERT_EQ(0, bond_form(of_all, whole, one));
  ASSERT_EQ(0, bond_form(m, pts, b));
  bond_share(m, pts, b);
  EXPECT_EQ(b.nbond_all(), one.nbond);
  EXPECT_NEAR(bond_sums(b, 0).area, bond_sums(one, 0).area, 1e-12);
  double springs = b.nbond, held = 0.0;
  for (int q = 0; q < pts.npoint; ++q) held += pts.part.rank[q] != comm_rank();
  comm_sum(&springs, 1);
  comm_sum(&held, 1);
  EXPECT_LE(springs, one.nbond + 10.0 * (comm_size() - 1));          // five corners between two ranks
  EXPECT_LE(held, 16.0 * comm_size());
}

// contact: a rank knows the points of others that its own faces may meet, by their numbers and who works on
// them, with the faces that are outer ones; few of all
TEST(Divided, PointsNearContact)
{
  if (comm_size() == 1) GTEST_SKIP() << "several ranks";
  Model of_all = row_of_bricks();
  of_all.bond.resize(2);
  of_all.bond[1].contact.general = true;
  Model m;
  if (comm_rank() == 0) m = of_all;
  dof_part({}, m);
  ASSERT_TRUE(m.part.on && m.part.points && m.part.window);
  Points whole, pts;
  ASSERT_EQ(0, point_fill(of_all, whole));
  ASSERT_EQ(0, point_fill(m, pts));
  RealVec home(whole.npoint, 0.0);
  for (int q = 0; q < pts.npoint; ++q)
    if (pts.part.rank[q] == comm_rank()) home[pts.part.point[q]] = comm_rank();
  comm_sum(home);
  for (const OriginalPoint& p : m.part.near_point) {
    EXPECT_EQ(p.rank, home[p.point]);
    EXPECT_NE(p.rank, comm_rank());
    EXPECT_GE(pts.point_here(p.point), 0);
  }
  std::vector<SkinFace> skin;
  for (const Face& f : whole.boundary) skin.push_back({f.elem, f.face, 1});
  const RealVec u(3 * of_all.mesh.nnode(), 0.0), uc(whole.Xc.size(), 0.0);
  const std::vector<NearFace> face = near_now(of_all, whole, skin, u, uc, true, 0.0);
  std::vector<BoundingBox> box;
  for (const NearFace& f : face) box.push_back(f.box);
  const BoxTree tree(box);
  std::set<std::pair<int, int>> boundary;            // number of a point, its face
  for (const Face& f : pts.boundary) boundary.insert({pts.part.point[f.elem], f.face});
  double met = 0.0;
  for (size_t i = 0; i < skin.size(); ++i) {
    if (home[skin[i].elem] != comm_rank()) continue;
    IntVec found;
    tree.overlap(box[i], found);
    for (int j : found) {
      EXPECT_TRUE(boundary.count({skin[j].elem, skin[j].face}));
      met += home[skin[j].elem] != comm_rank();
    }
  }
  comm_sum(&met, 1);
  EXPECT_GT(met, 0.0);
  std::set<std::pair<int, int>> all;
  for (const Face& f : whole.boundary) all.insert({f.elem, f.face});
  size_t outer = 0;
  for (const auto& f : boundary) {
    EXPECT_TRUE(all.count(f) || std::none_of(m.part.near_point.begin(), m.part.near_point.end(),
                                             [&](const OriginalPoint& p) { return p.point == f.first; }));
    outer += all.count(f);
  }
  EXPECT_LT(outer, all.size());
  EXPECT_LT(m.part.near_point.size(), all.size() / 2);
}

// kinds of domains against a plain list: points come, change and get numbers of their own, in any order
TEST(Domain, KindsHaveTheNumbersOfTheirPoints)
{
  const int dim = 2, numbers = domain_numbers(4, dim), most = 400;
  DomainKinds k;
  IntVec kind;
  std::vector<RealVec> want;
  std::vector<char> own;
  unsigned seed = 1;
  const auto roll = [&](unsigned n) { return (seed = seed * 1664525u + 1013904223u) / 65536u % n; };
  const auto some = [&] { return RealVec(numbers, 0.1 * roll(60)); };
  for (int turn = 0; turn < 4000; ++turn) {
    const RealVec x = some();
    const unsigned what = roll(4), p = kind.empty() ? 0 : roll(static_cast<unsigned>(kind.size()));
    if (kind.empty() || (what == 0 && kind.size() < most)) {
      kind.push_back(domain_kind(4, dim, x.data(), k));
      want.push_back(x);
      own.push_back(0);
    } else if (what == 1) {
      kind[p] = domain_own(kind[p], k);
      k.number[k.first[kind[p]] + 3] = want[p][3] = 7.0 + turn;
      own[p] = 1;
    } else {
      kind[p] = domain_change(kind[p], 4, x.data(), k);
      want[p] = x;
      own[p]  = 0;
    }
    std::set<RealVec> different;
    for (size_t q = 0; q < kind.size(); ++q) {
      ASSERT_TRUE(std::equal(want[q].begin(), want[q].end(), k.at(kind[q]))) << turn << " " << q;
      if (!own[q]) different.insert(want[q]);
    }
    const size_t in_use = k.first.size() - k.unused.size(), alone = std::count(own.begin(), own.end(), 1);
    ASSERT_EQ(different.size() + alone, in_use) << turn;
  }
  EXPECT_GT(k.first.size(), 60u);
}

// a box of equal cells far from the origin: rounding of places does not make kinds
TEST(Domain, EqualCellsAreOfFewKinds)
{
  for (double shift : {0.0, 0.1, 12.3, 1234.5}) {
    Points pts;
    ASSERT_EQ(0, point_fill(block_model(1.0 + shift, 4, 3, 0.05), pts));
    EXPECT_LE(pts.kinds.first.size(), 16u) << shift;
    for (int p = 0; p < pts.npoint; ++p) {
      const double *w = pts.w(p), *mc = pts.mc(p);
      double sum = 0.0, mass = 0.0;
      for (int c = 0; c < 4; ++c) sum += w[c];
      for (int c = 0; c < 4; ++c)
        for (int d = 0; d < 4; ++d) mass += mc[c >= d ? pair_index(c, d) : pair_index(d, c)];
      EXPECT_NEAR(1.0, sum, 1e-15);
      EXPECT_NEAR(pts.mass[p], mass, 1e-15 * mass);
    }
  }
}
