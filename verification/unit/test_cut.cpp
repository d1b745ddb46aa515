// The model from rank 0 to other ranks: bytes and back, pieces (model_io, model_cut, model_send, dof_part)
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <set>

#include "bond/bond.h"
#include "contact/contact.h"
#include "contact/contact_masters.h"
#include "contact/contact_meet.h"
#include "dof/dof.h"
#include "model/model_cut.h"
#include "model/model_io.h"
#include "model/model_send.h"
#include "model/state_io.h"
#include "out/out.h"

namespace {

std::string bytes_of(Model& m)
{
  Archive f;
  io(f, m);
  return f.bytes;
}

Model model_of(const std::string& bytes)
{
  Archive f;
  f.reading = true;
  f.bytes   = bytes;
  Model m;
  io(f, m);
  EXPECT_TRUE(f.good);
  EXPECT_EQ(f.at, f.bytes.size());
  return m;
}

Expr function(const std::string& text)
{
  Expr e;
  std::string error;
  int position = 0;
  EXPECT_TRUE(expr_compile(text, {{"k", 0.1}, {"unused", 7.0}}, e, error, position)) << error;
  return e;
}

// n x n squares, the last node without an element; sets, a surface, loads and supports of parts of it
Model plate(int n)
{
  Model m;
  m.job = "plate";
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= n; ++x) {
      m.mesh.node_label.push_back(10 * static_cast<int>(m.mesh.node_label.size()) + 1);
      m.mesh.X.insert(m.mesh.X.end(), {0.1 * x, 0.2 * y, 0.0});
    }
  m.mesh.node_label.push_back(999999);
  m.mesh.X.insert(m.mesh.X.end(), {9.0, 9.0, 0.0});
  int type = 0;
  while (elem_table[type].shape != SHAPE_QUAD4) ++type;
  Surface left;
  Load gravity, force;
  gravity.kind = LOAD_BODY;
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const int e = m.mesh.nelem(), a = y * (n + 1) + x;
      m.mesh.elem_label.push_back(5 * e + 2);
      m.mesh.elem_type.push_back(type);
      m.mesh.elem_section.push_back(0);
      for (int k : {a, a + 1, a + n + 2, a + n + 1}) m.mesh.conn.item.push_back(k);
      m.mesh.conn.off.push_back(static_cast<int>(m.mesh.conn.item.size()));
      if (x == 0) left.face.push_back({e, 3});
      if (e % 3 == 0) gravity.elem.push_back(e);
    }
  std::reverse(gravity.elem.begin(), gravity.elem.end());          // a list keeps its order
  m.elset.push_back({"ALL", IntVec(m.mesh.nelem()), {}});
  std::iota(m.elset[0].item.begin(), m.elset[0].item.end(), 0);
  m.nset.push_back({"ALL", IntVec(m.mesh.nnode()), {}});
  std::iota(m.nset[0].item.begin(), m.nset[0].item.end(), 0);
  m.surface.push_back(left);
  m.material.resize(1);
  m.section.resize(1);
  force.node = m.nset[0].item;
  Prescribed support;
  support.node = {0, 1, 2, n, n + 1};
  m.initial.resize(1);
  m.initial[0].node = {3, 4, n * n};
  m.step.resize(2);
  for (Step& s : m.step) {
    s.load       = {gravity, force};
    s.prescribed = {support};
  }
  return m;
}

// an entry in each list, so that all structs are met
Model all_kinds()
{
  Model m = plate(3);
  m.out_dir = "out";
  m.notes.heading = "two words";
  m.notes.param["k"] = 0.1;
  m.hash       = 0x123456789abcdef0u;
  const Expr shared = function("sin(k*x)+t");
  m.surface[0].where = shared;
  m.amplitude.resize(1);
  m.amplitude[0].t    = {0.0, 1.0};
  m.amplitude[0].expr = function("t^2");
  m.body.resize(1);
  m.body[0].where = shared;
  m.body[0].hi    = {{1.0, 2.0, 3.0}};
  m.grid.n = {{4, 5, 6}};
  m.grid_bc.resize(1);
  m.grid_bc[0].value.value = 0.25;
  m.viscous.resize(1);
  m.bond.resize(1);
  m.bond[0].motion[1] = function("y");
  m.bond[0].contact.include.resize(2);
  m.bond[0].contact.property.resize(1);
  m.fracture.resize(1);
  m.conversion.resize(1);
  m.conversion[0].bond.name = "of the conversion";
  m.broken.resize(1);
  m.equation.resize(1);
  m.equation[0].term = {{1, 0, 0.5}, {2, 1, -1.0}};
  m.frame.resize(1);
  m.frame[0].axis.fill(0.5);
  m.step[0].load[0].keyword = "DLOAD";
  m.step[0].load[0].value   = shared;
  m.step[0].print.resize(1);
  m.step[0].print[0].what = {"U", "RF"};
  m.output.history.resize(1);
  m.output.check.resize(1);
  m.output.check[0].exact = function("x*y");
  m.part.halo.common = {{}, {1, 2}};
  return m;
}

TEST(ModelArchive, ModelComesBack)
{
  Model m = all_kinds();
  const std::string bytes = bytes_of(m);
  Model back = model_of(bytes);
  EXPECT_TRUE(bytes_of(back) == bytes);
  EXPECT_EQ(back.mesh.node_label, m.mesh.node_label);
  EXPECT_EQ(back.frame[0].axis[8], 0.5);
  EXPECT_EQ(back.step[0].print[0].what[1], "RF");
  EXPECT_EQ(back.notes.param, m.notes.param);
  EXPECT_EQ(back.hash, m.hash);
}

TEST(ModelArchive, FunctionsAreMadeAgain)
{
  Model m = all_kinds(), back = model_of(bytes_of(m));
  const double x[3] = {0.3, 0.7, 0.0};
  const Expr& e = back.body[0].where;
  EXPECT_EQ(expr_eval(e, x, 2.0), expr_eval(m.body[0].where, x, 2.0));
  EXPECT_TRUE(expr_same(e, m.body[0].where));
  EXPECT_NE(e.code, m.body[0].where.code);
  EXPECT_EQ(e.code, back.surface[0].where.code);
  EXPECT_EQ(e.code, back.step[0].load[0].value.code);
  EXPECT_NE(e.code, back.output.check[0].exact.code);
  EXPECT_TRUE(back.grid_bc[0].value.is_const());
  EXPECT_EQ(back.grid_bc[0].value.value, 0.25);
}

TEST(ModelArchive, BytesThatEndTooEarlyAreSeen)
{
  Model m = all_kinds();
  const std::string whole = bytes_of(m);
  for (std::size_t n = 0; n < whole.size(); n += 7) {
    Archive f;
    f.reading = true;
    f.bytes   = whole.substr(0, n);
    Model back;
    io(f, back);
    EXPECT_FALSE(f.good) << n;
  }
}

// what a piece says of the mesh of the deck
IntVec in_deck(const IntVec& item, const IntVec& here)
{
  IntVec out;
  for (int k : item) out.push_back(here.at(k));
  return out;
}

IntVec kept(const IntVec& item, const std::set<int>& here)
{
  IntVec out;
  for (int k : item)
    if (here.count(k)) out.push_back(k);
  return out;
}

// from the first number on to the largest, then from the smallest on
bool ascends(IntVec list)
{
  std::rotate(list.begin(), std::min_element(list.begin(), list.end()), list.end());
  return std::is_sorted(list.begin(), list.end());
}

// rank 0 has the left half of a plate, rank 1 the right one: columns of nodes from the left to the middle, then
// from the right; what lists and equations say of nodes stays, and so does the node without elements
TEST(ModelCut, NodesStandAsRanksEliminateThem)
{
  const int n = 8;
  const Model deck = plate(n);
  Model m = deck;
  m.equation.resize(3);
  m.equation[0].term = {{5, 0, 0.5}, {80, 1, -1.0}};
  for (int i = 0; i < 2; ++i) m.equation[1 + i].term = {{17, i, 1.0}, {81, i, -1.0}};
  m.frame.resize(1);
  m.frame[0].node     = 17;
  m.frame[0].twin     = 81;
  m.frame[0].equation = 1;
  IntVec rank;
  for (int e = 0; e < m.mesh.nelem(); ++e) rank.push_back(e % n < n / 2 ? 0 : 1);
  model_order_nodes(rank, {}, 2, m);
  const IntVec& order = m.part.deck;
  ASSERT_EQ(order.size(), deck.mesh.node_label.size());
  EXPECT_EQ(std::set<int>(order.begin(), order.end()).size(), order.size());
  const auto column = [&](int k) { return order[k] % (n + 1); };
  for (int k = 0; k < (n + 1) * (n + 1); ++k) {
    const int at = k / (n + 1);
    EXPECT_EQ(column(k), at <= n / 2 ? at : n + n / 2 + 1 - at) << k;
  }
  EXPECT_EQ(order.back(), (n + 1) * (n + 1));
  for (int k = 0; k < m.mesh.nnode(); ++k) {
    EXPECT_EQ(m.mesh.node_label[k], deck.mesh.node_label[order[k]]);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(m.mesh.X[3 * k + i], deck.mesh.X[3 * order[k] + i]);
  }
  EXPECT_EQ(in_deck(m.mesh.conn.item, order), deck.mesh.conn.item);
  EXPECT_EQ(in_deck(m.nset[0].item, order), deck.nset[0].item);
  EXPECT_EQ(in_deck(m.initial[0].node, order), deck.initial[0].node);
  EXPECT_EQ(in_deck(m.step[0].prescribed[0].node, order), deck.step[0].prescribed[0].node);
  EXPECT_EQ(order[m.equation[0].term[0].node], 5);
  EXPECT_EQ(order[m.equation[0].term[1].node], 80);
  EXPECT_EQ(order[m.frame[0].node], 17);
  EXPECT_EQ(order[m.frame[0].twin], 81);
  ModelCut cut = model_cut_open(m, rank, {}, 2);
  const Model p = model_cut_piece(cut, 1);
  for (int k = 0; k < p.mesh.nnode(); ++k) {
    EXPECT_EQ(p.mesh.node_label[k], deck.mesh.node_label[p.part.deck[k]]);
    EXPECT_EQ(p.part.node_here(p.part.node[k]), k);
  }
  // the node with directions of its own is here, with its twin and their equations
  const auto deck_node = [&](int k) { return p.part.deck.at(k); };
  ASSERT_EQ(p.frame.size(), 1u);
  EXPECT_EQ(deck_node(p.frame[0].node), 17);
  EXPECT_EQ(deck_node(p.frame[0].twin), 81);
  for (int i = 0; i < 2; ++i) {
    const std::vector<EquationTerm>& term = p.equation.at(p.frame[0].equation + i).term;
    EXPECT_EQ(deck_node(term.at(0).node), 17);
    EXPECT_EQ(deck_node(term.at(1).node), 81);
    EXPECT_EQ(term[0].dof, i);
  }
  // its own nodes first, then those of the middle, which rank 0 has too
  EXPECT_TRUE(ascends(p.part.node));
  EXPECT_EQ(p.part.deck.front(), n);
  EXPECT_EQ(p.part.deck.back() % (n + 1), n / 2);
}

TEST(ModelCut, PiecesMakeTheWhole)
{
  const int ranks = 4;
  const Model m = plate(9);
  IntVec rank;
  for (int e = 0; e < m.mesh.nelem(); ++e) rank.push_back((e * 7 + e / 9) % 5 % ranks);
  Model whole  = m;
  ModelCut cut = model_cut_open(whole, rank, {}, ranks);
  EXPECT_EQ(whole.mesh.nelem(), 0);
  IntVec times(m.mesh.nelem(), 0), alone(ranks, 0);
  for (int r = ranks - 1; r >= 0; --r) {
    const Model p = model_cut_piece(cut, r);
    const std::set<int> elem(p.part.elem.begin(), p.part.elem.end());
    const std::set<int> node(p.part.node.begin(), p.part.node.end());
    std::set<int> touched;
    ASSERT_EQ(p.mesh.nelem(), static_cast<int>(elem.size()));
    ASSERT_EQ(p.mesh.nnode(), static_cast<int>(node.size()));
    EXPECT_TRUE(p.part.on);
    EXPECT_EQ(p.part.nnode, m.mesh.nnode());
    EXPECT_EQ(p.part.nelem, m.mesh.nelem());
    EXPECT_TRUE(std::is_sorted(p.part.elem.begin(), p.part.elem.end()));
    EXPECT_TRUE(std::is_sorted(p.part.node.begin(), p.part.node.end()));
    for (int e = 0; e < p.mesh.nelem(); ++e) {
      const int old = p.part.elem[e];
      ++times[old];
      EXPECT_EQ(rank[old], r);
      EXPECT_EQ(p.mesh.elem_label[e], m.mesh.elem_label[old]);
      EXPECT_EQ(p.mesh.elem_type[e], m.mesh.elem_type[old]);
      EXPECT_EQ(p.mesh.elem_section[e], 0);
      ASSERT_EQ(p.mesh.conn.count(e), 4);
      for (int a = 0; a < 4; ++a) {
        EXPECT_EQ(p.part.node.at(p.mesh.conn.begin(e)[a]), m.mesh.conn.begin(old)[a]);
        touched.insert(m.mesh.conn.begin(old)[a]);
      }
    }
    alone[r] = static_cast<int>(node.count(m.mesh.nnode() - 1));
    if (r == 0) touched.insert(m.mesh.nnode() - 1);
    EXPECT_EQ(node, touched);
    for (int n = 0; n < p.mesh.nnode(); ++n) {
      EXPECT_EQ(p.mesh.node_label[n], m.mesh.node_label[p.part.node[n]]);
      for (int i = 0; i < 3; ++i) EXPECT_EQ(p.mesh.X[3 * n + i], m.mesh.X[3 * p.part.node[n] + i]);
    }
    EXPECT_EQ(in_deck(p.elset[0].item, p.part.elem), p.part.elem);
    EXPECT_EQ(in_deck(p.nset[0].item, p.part.node), p.part.node);
    EXPECT_EQ(in_deck(p.initial[0].node, p.part.node), kept(m.initial[0].node, node));
    IntVec face;
    for (const Face& f : p.surface[0].face) {
      face.push_back(p.part.elem.at(f.elem));
      EXPECT_EQ(f.face, 3);
    }
    IntVec left;
    for (const Face& f : m.surface[0].face) left.push_back(f.elem);
    EXPECT_EQ(face, kept(left, elem));
    for (int s = 0; s < 2; ++s) {
      EXPECT_EQ(in_deck(p.step[s].load[0].elem, p.part.elem), kept(m.step[s].load[0].elem, elem));
      EXPECT_EQ(in_deck(p.step[s].load[1].node, p.part.node), p.part.node);
      EXPECT_EQ(in_deck(p.step[s].prescribed[0].node, p.part.node), kept(m.step[s].prescribed[0].node, node));
    }
  }
  EXPECT_EQ(times, IntVec(m.mesh.nelem(), 1));
  EXPECT_EQ(alone, IntVec({1, 0, 0, 0}));
}

// rank 1 looks at elements of the others too: what breaks, pre-cracks, supports and surfaces of bonds have
// them, sets and loads do not
TEST(ModelCut, OuterElements)
{
  Model m = plate(4);
  m.fracture.resize(1);
  m.fracture[0].elset = 0;
  m.broken.resize(1);
  m.broken[0].elem = {0, 2, 12};
  m.bond.resize(1);
  m.bond[0].surface = 0;
  m.surface.push_back(m.surface[0]);                 // no bond holds this one
  IntVec rank;
  for (int e = 0; e < 16; ++e) rank.push_back(e / 8);
  OfRanks<int> outer;
  outer.off  = {0, 0, 3};
  outer.item = {2, 4, 5};
  ModelCut cut = model_cut_open(m, rank, outer, 2);
  const Model p = model_cut_piece(cut, 1);
  EXPECT_EQ(p.part.elem, IntVec({2, 4, 5, 8, 9, 10, 11, 12, 13, 14, 15}));
  EXPECT_EQ(p.part.rank, IntVec({0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1}));
  EXPECT_EQ(in_deck(p.elset[0].item, p.part.elem), IntVec({8, 9, 10, 11, 12, 13, 14, 15}));
  EXPECT_EQ(in_deck(p.broken[0].elem, p.part.elem), IntVec({2, 12}));
  ASSERT_EQ(p.fracture[0].member.size(), p.part.elem.size());
  for (const Member& x : p.fracture[0].member) EXPECT_EQ(p.part.elem[x.elem], x.at);
  EXPECT_EQ(p.surface[0].face.size(), 3u);           // of elements 4, 8, 12
  EXPECT_EQ(p.surface[1].face.size(), 2u);
  EXPECT_EQ(in_deck(p.step[0].prescribed[0].node, p.part.node), IntVec({2, 5}));       // of 0 1 2 4 5
  for (int n : in_deck(p.nset[0].item, p.part.node)) EXPECT_GE(n, 10);   // node rows of elements 8 to 15
}

// ranks 0 and 1 have 4 x 2 elements each, rank 1 looks at one of rank 0 as well. Nodes: 5 in a row.
TEST(ModelCut, TiedNodesStayTogether)
{
  Model m = plate(4);
  for (int label : {1000, 1001}) {                   // 26 and 27, without elements
    m.mesh.node_label.push_back(label);
    m.mesh.X.insert(m.mesh.X.end(), {9.0, 9.0, 0.0});
  }
  m.equation.resize(4);
  m.equation[0].term = {{0, 0, 1.0}, {26, 0, -1.0}};           // of rank 0 alone
  m.equation[1].term = {{24, 1, 1.0}, {26, 1, -2.0}};          // and, by node 26, of rank 1
  m.equation[2].term = {{23, 0, 1.0}, {22, 0, -1.0}};          // of rank 1 alone
  m.equation[3].term = {{5, 0, 1.0}, {27, 0, -1.0}};           // rank 1: of the outer element
  m.frame.resize(2);
  m.frame[0].node = 1;
  m.frame[1].node = 5;
  m.frame[1].twin = 27;
  m.frame[1].equation = 3;
  m.step[0].equation = {0, 1, 2, 3};
  m.step[1].equation = {2, 3};
  IntVec rank;
  for (int e = 0; e < 16; ++e) rank.push_back(e / 8);
  OfRanks<int> outer;
  outer.off  = {0, 0, 1};
  outer.item = {4};
  ModelCut cut = model_cut_open(m, rank, outer, 2);
  const Model a = model_cut_piece(cut, 0), b = model_cut_piece(cut, 1);
  EXPECT_TRUE(a.part.tied && b.part.tied);
  EXPECT_EQ(a.equation.size(), 3u);
  EXPECT_EQ(b.equation.size(), 4u);
  EXPECT_EQ(a.step[0].equation, IntVec({0, 1, 2}));
  EXPECT_EQ(a.step[1].equation, IntVec({2}));
  EXPECT_EQ(b.step[1].equation, IntVec({2, 3}));
  EXPECT_EQ(a.part.node[a.equation[1].term[0].node], 24);
  EXPECT_EQ(b.part.node[b.equation[0].term[0].node], 0);
  ASSERT_EQ(a.frame.size(), 2u);
  EXPECT_EQ(a.frame[1].equation, 2);
  ASSERT_EQ(b.frame.size(), 1u);
  EXPECT_EQ(b.part.node[b.frame[0].twin], 27);
  for (int n : {0, 24, 26, 27}) EXPECT_GE(b.part.node_here(n), 0) << n;
  EXPECT_LT(b.part.node_here(1), 0);
  for (int n : {0, 24})                              // they may belong to this rank
    EXPECT_TRUE(std::count(b.nset[0].item.begin(), b.nset[0].item.end(), b.part.node_here(n))) << n;
}

// ---- several ranks (unit/run_ranks) ----------------------------------------------

TEST(Divided, ModelArrivesUnchanged)
{
  if (comm_size() == 1) GTEST_SKIP();
  Model m   = all_kinds();
  Model own = all_kinds();
  for (int r = 1; r < comm_size() && comm_rank() == 0; ++r) model_send(m, r);
  if (comm_rank() > 0) m = model_receive();
  EXPECT_TRUE(bytes_of(m) == bytes_of(own));
}

// 16 elements or cells of points for each rank; a model that is too small takes fewer of them
TEST(Divided, SmallModelsTakeFewerRanks)
{
  if (comm_size() == 1) GTEST_SKIP();
  EXPECT_EQ(1, dof_ranks(plate(3)));
  EXPECT_EQ(1, dof_ranks(plate(5)));                 // 25 elements
  EXPECT_EQ(std::min(comm_size(), 2), dof_ranks(plate(6)));
  EXPECT_EQ(std::min(comm_size(), 4), dof_ranks(plate(8)));
}

TEST(Divided, RanksGetTheirPieces)
{
  if (comm_size() == 1) GTEST_SKIP();
  Model m;
  if (comm_rank() == 0) m = plate(60);               // nodes and lists take more than one message
  dof_part({}, m);
  const Model whole = plate(60);
  ASSERT_TRUE(m.part.on);
  EXPECT_TRUE(m.part.joined);
  EXPECT_EQ(m.part.nelem, whole.mesh.nelem());
  RealVec elems(whole.mesh.nelem(), 0.0), nodes(whole.mesh.nnode(), 0.0), loads(whole.mesh.nnode(), 0.0);
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    EXPECT_EQ(m.mesh.elem_label[e], whole.mesh.elem_label[m.part.elem[e]]);
    elems[m.part.elem[e]] += 1.0;
  }
  for (int n = 0; n < m.mesh.nnode(); ++n) {
    const int w = m.part.deck[n];
    EXPECT_EQ(m.mesh.node_label[n], whole.mesh.node_label[w]);
    for (int i = 0; i < 3; ++i) EXPECT_EQ(m.mesh.X[3 * n + i], whole.mesh.X[3 * w + i]);
  }
  EXPECT_TRUE(ascends(m.part.node));
  for (int n = 0; n < m.mesh.nnode(); ++n)
    if (m.part.counts(n)) nodes[m.part.deck[n]] += 1.0;
  for (int n : m.step[1].load[1].node)
    if (m.part.counts(n)) loads[m.part.deck[n]] += 1.0;
  comm_sum(elems);
  comm_sum(nodes);
  comm_sum(loads);
  EXPECT_EQ(elems, RealVec(whole.mesh.nelem(), 1.0));
  EXPECT_EQ(nodes, RealVec(whole.mesh.nnode(), 1.0));
  EXPECT_EQ(loads, nodes);
}

// a rank knows the points of two rows of elements of others, so that it can take some over; of one where two
// would be many
TEST(Divided, RowsOfPointsOfOthers)
{
  if (comm_size() == 1) GTEST_SKIP();
  for (int n : {80, 8}) {
    Model m;
    if (comm_rank() == 0) {
      m = plate(n);
      m.conversion.resize(1);
      m.conversion[0].elset = 0;
    }
    dof_part({}, m);
    ASSERT_TRUE(m.part.window);
    std::vector<char> own(m.mesh.nnode(), 0);
    for (int e = 0; e < m.mesh.nelem(); ++e)
      for (int k = m.mesh.conn.off[e]; k < m.mesh.conn.off[e + 1] && m.part.works(e); ++k)
        own[m.mesh.conn.item[k]] = 1;
    int beside = 0, with_points = 0;                 // elements of others
    for (int e = 0; e < m.mesh.nelem(); ++e) {
      if (m.part.works(e)) continue;
      beside += std::any_of(m.mesh.conn.begin(e), m.mesh.conn.begin(e + 1), [&](int i) { return own[i]; });
      with_points += m.part.stores_points(e);
    }
    EXPECT_GT(beside, 0);
    if (n == 8) EXPECT_EQ(with_points, beside);
    else EXPECT_GT(2 * with_points, 3 * beside);
  }
}

// faces of general contact in the numbers of the deck
std::vector<std::pair<int, int>> skin_in_deck(const Model& m, const IntVec& phase)
{
  Fracture fr;
  fr.phase = phase;
  std::vector<std::pair<int, int>> out;
  for (const SkinFace& f : contact_skin(m, fr, Points(), {}))
    out.push_back({m.part.elem_number(f.elem), f.face});
  return out;
}

Model touching_plate()
{
  Model m = plate(20);
  m.bond.resize(1);
  m.bond[0].contact.general = true;
  m.bond[0].contact.include.resize(1);
  m.bond[0].contact.include[0].a.elset = 0;
  return m;
}

// a rank knows the outer faces of its own elements and of those near them, as the ranks of these tell
void expect_near_skin(const Model& of_rank_zero)
{
  const Model whole = touching_plate();
  Model m;
  if (comm_rank() == 0) m = of_rank_zero;
  dof_part({}, m);
  ASSERT_TRUE(m.part.on);
  ASSERT_TRUE(m.part.window);
  EXPECT_LT(m.mesh.nelem(), whole.mesh.nelem());
  EXPECT_EQ(m.bond[0].contact.include[0].a.elem.size(), static_cast<size_t>(m.mesh.nelem()));
  std::vector<std::pair<int, int>> known;
  double own = 0.0;
  const auto at_start = skin_in_deck(whole, IntVec(whole.mesh.nelem(), AS_ELEMENT));
  EXPECT_EQ(at_start.size(), 79u);                   // one stands on a plane of symmetry
  for (const auto& f : at_start) {
    const int e = m.part.elem_here(f.first);
    if (e < 0) continue;
    own += m.part.works(e);
    known.push_back(f);
  }
  EXPECT_EQ(skin_in_deck(m, IntVec(m.mesh.nelem(), AS_ELEMENT)), known);
  EXPECT_LT(known.size(), 79u);
  EXPECT_GT(static_cast<double>(known.size()), own);
  comm_sum(&own, 1);
  EXPECT_EQ(own, 79.0);
}

TEST(Divided, SkinOfNearElements)
{
  if (comm_size() == 1) GTEST_SKIP();
  expect_near_skin(touching_plate());
}

// the same beside points from the start
TEST(Divided, SkinBesidePoints)
{
  if (comm_size() == 1) GTEST_SKIP();
  Model m = touching_plate();
  m.elset.push_back({"NONE", {}, {}});
  m.body.resize(1);
  m.body[0].fill  = FILL_ELSET;
  m.body[0].elset = static_cast<int>(m.elset.size()) - 1;
  expect_near_skin(m);
}

// a plate whose sides, in another order than the deck's, are tied to a body and held by springs
Model tied_plate(int n)
{
  Model m = plate(n);
  std::vector<Face>& face = m.surface[0].face;
  face.clear();
  for (int k = n - 1; k >= 0; --k)
    for (const Face& f : {Face{k, 0}, Face{k * n + n - 1, 1}, Face{n * n - 1 - k, 2}, Face{k * n, 3}})
      face.push_back(f);
  m.grid.given = true;
  m.grid.lo    = {{-1.0, -1.0, 0.0}};
  m.grid.h     = {{1.0, 1.0, 1.0}};
  m.grid.n     = {{n, n, 1}};
  m.elset.push_back({"NONE", {}, {}});
  m.body.resize(1);
  m.body[0].fill     = FILL_ELSET;
  m.body[0].elset    = static_cast<int>(m.elset.size()) - 1;
  m.body[0].material = 0;
  m.bond.resize(2);
  for (BondDef& d : m.bond) {
    d.kind         = BOND_MESH_GRID;
    d.surface      = 0;
    d.body         = 0;
    d.intermediate = 1;
    d.penalty      = 3.0;
  }
  m.bond[1].kind = BOND_GROUND;
  m.bond[1].body = -1;
  return m;
}

// A rank has the bonds at nodes of its elements, whole ones, and no more than these of others; each counts
// once, and their names sort as one rank has them
void expect_own_bonds(const Model& whole, const Model& m, double others)
{
  Bonds one, b;
  ASSERT_EQ(bond_form(whole, Points(), one), 0);
  ASSERT_EQ(bond_form(m, Points(), b), 0);
  const RealVec formed = b.area;
  bond_share(m, Points(), b);
  EXPECT_EQ(b.area, formed);
  EXPECT_EQ(b.nbond_all(), one.nbond);
  struct Place { long name; double X[2], area; };
  std::vector<Place> place;
  double known = b.nbond;
  for (int q = 0; q < b.nbond; ++q)
    if (b.counts(q)) place.push_back({b.name[q], {b.X[3 * q], b.X[3 * q + 1]}, b.area[q]});
  comm_allgatherv(place);
  std::sort(place.begin(), place.end(), [](const Place& p, const Place& q) { return p.name < q.name; });
  ASSERT_EQ(place.size(), static_cast<size_t>(one.nbond));
  for (int q = 0; q < one.nbond; ++q) {
    for (int i = 0; i < 2; ++i) EXPECT_EQ(place[q].X[i], one.X[3 * q + i]);
    EXPECT_NEAR(place[q].area, one.area[q], 1e-14);
  }
  comm_sum(&known, 1);
  EXPECT_GT(known, one.nbond);
  EXPECT_LT(known, one.nbond + others * comm_size());
  for (int def = 0; def < static_cast<int>(m.bond.size()); ++def) {
    const BondSums all = bond_sums(one, def), sum = bond_sums(b, def);
    EXPECT_EQ(sum.nodal, all.nodal);
    EXPECT_EQ(sum.between, all.between);
    EXPECT_NEAR(sum.area, all.area, 1e-10);
    EXPECT_NEAR(sum.penalty, all.penalty, 1e-12);
  }
}

// the piece of this rank
Model divided(Model whole)
{
  Model m;
  if (comm_rank() == 0) std::swap(m, whole);
  dof_part({}, m);
  return m;
}

TEST(Divided, TiesAreWithTheirElements)
{
  if (comm_size() == 1) GTEST_SKIP();
  const int n   = 80;
  const Model m = divided(tied_plate(n));
  ASSERT_TRUE(m.part.on);
  expect_own_bonds(tied_plate(n), m, 32.0);
  double elements = m.mesh.nelem();
  comm_sum(&elements, 1);
  EXPECT_LT(elements, n * n + 16.0 * comm_size());
}

// Through a file the bonds are those of one rank, and each rank gets what it had
TEST(Divided, BondsPassTheArchive)
{
  if (comm_size() == 1) GTEST_SKIP();
  const Model whole = tied_plate(40);
  Model m = divided(whole);
  ASSERT_TRUE(m.part.on);
  m.step.resize(1);
  m.step[0].period = m.step[0].dt = 1.0;
  Bonds one;
  State s;
  ASSERT_EQ(bond_form(whole, Points(), one), 0);
  ASSERT_EQ(bond_form(m, Points(), s.bonds), 0);
  bond_share(m, Points(), s.bonds);
  s.log.step = 1;
  s.clock.dt = 1.0;
  for (RealVec* x : {&s.n.u, &s.n.v, &s.n.a, &s.rf}) x->assign(m.mesh.nnode() * m.dim, 0.0);
  for (int q = 0; q < s.bonds.nbond; ++q) {
    for (int i = 0; i < m.dim; ++i) s.n.slip.push_back(s.bonds.X[3 * q + i]);
    s.n.lambda_n.push_back(s.bonds.def[q]);
  }
  s.n.lambda = s.n.slip;
  const Bonds before = s.bonds;
  ActiveGrid grid;
  Archive f;
  ASSERT_TRUE(out_hold(m, s, grid, f));
  EXPECT_EQ(s.bonds.nbond, before.nbond);
  EXPECT_EQ(s.bonds.nfixed, before.nfixed);
  EXPECT_EQ(s.bonds.a.item, before.a.item);
  EXPECT_EQ(s.bonds.contact.met, before.contact.met);
  if (comm_rank() == 0) {
    const CommAlone alone;
    Archive all = f;
    State t;
    io(all, t);
    EXPECT_TRUE(all.good);
    EXPECT_EQ(t.bonds.nbond, one.nbond);
    EXPECT_EQ(t.bonds.nfixed, one.nfixed);
    EXPECT_EQ(t.bonds.X, one.X);
    EXPECT_EQ(t.bonds.def, one.def);
    EXPECT_EQ(t.bonds.a.off, one.a.off);
    EXPECT_EQ(t.bonds.a_w, one.a_w);
    EXPECT_EQ(t.bonds.intermediate, one.intermediate);
    EXPECT_EQ(t.n.lambda, t.n.slip);
    for (int q = 0; q < one.nbond; ++q) EXPECT_EQ(t.n.slip[2 * q + 1], one.X[3 * q + 1]);
  }
  State t;
  Output out;
  out_resume(m, Elements(), FracMesh(), f, t, grid, out);
  EXPECT_EQ(t.bonds.nbond, before.nbond);
  EXPECT_EQ(t.bonds.nfixed, before.nfixed);
  EXPECT_EQ(t.bonds.nall, one.nbond);
  EXPECT_EQ(t.bonds.rank, before.rank);
  EXPECT_EQ(t.bonds.a.off, before.a.off);
  EXPECT_EQ(t.bonds.a.item, before.a.item);
  EXPECT_EQ(t.bonds.area, before.area);
  EXPECT_EQ(t.bonds.normal, before.normal);
  EXPECT_EQ(t.n.slip, s.n.slip);
  EXPECT_EQ(t.n.lambda_n, s.n.lambda_n);
  EXPECT_TRUE(std::is_sorted(t.bonds.name.begin(), t.bonds.name.end()));
}

// The sides of a plate may meet its upper one, at nodes and inside their faces; three elements at the left
// may meet the right one
Model paired_plate(int n)
{
  Model m = tied_plate(n);
  m.surface.resize(4, m.surface[0]);
  for (int s : {1, 2, 3}) m.surface[s].face.clear();
  for (int k = 0; k < n; ++k) m.surface[1].face.push_back({n * n - 1 - k, 2});
  for (int k : {n / 3 + 1, n / 3, n / 3 + 2}) m.surface[2].face.push_back({k * n, 3});
  for (int k = 0; k < n; ++k) m.surface[3].face.push_back({k * n + n - 1, 1});
  m.bond.resize(3);
  for (BondDef& d : m.bond) {
    d.kind   = BOND_CONTACT;
    d.body   = -1;
    d.contact.master = 1;
  }
  m.bond[1].contact.by_face = true;
  m.bond[2].surface = 2;
  m.bond[2].contact.master  = 3;
  return m;
}

// A rank has contact points at nodes of its elements, and the master faces near them: few of others
TEST(Divided, PairsAreWithTheirElements)
{
  if (comm_size() == 1) GTEST_SKIP();
  const int n = 80;
  const Model whole = paired_plate(n), m = divided(whole);
  ASSERT_TRUE(m.part.on);
  expect_own_bonds(whole, m, 48.0);
  Bonds b;
  ASSERT_EQ(bond_form(m, Points(), b), 0);
  const RealVec zero(whole.mesh.X.size(), 0.0);
  int near = 0;
  for (int q = 0; q < b.nbond; ++q)
    for (const Face& f : whole.surface[m.bond[b.def[q]].contact.master].face) {
      const MasterFace at = master_face(whole, Points(), false, f, zero, zero);
      bool apart = false;
      for (int i = 0; i < m.dim; ++i)
        apart = apart || b.X[3 * q + i] < at.lo[i] - at.size || b.X[3 * q + i] > at.hi[i] + at.size;
      near += !apart;
      EXPECT_TRUE(apart || m.part.elem_here(f.elem) >= 0) << q;
    }
  for (int def : {0, 1, 2}) {
    const std::vector<Face>& face = m.surface[m.bond[def].contact.master].face;
    const auto others = std::count_if(face.begin(), face.end(),
                                      [&](const Face& f) { return !m.part.works(f.elem); });
    EXPECT_LE(others, def < 2 ? 30 : 4) << def;
    EXPECT_TRUE(m.bond[def].contact.present || std::count(b.def.begin(), b.def.end(), def) == 0);
  }
  double sum[2] = {static_cast<double>(m.mesh.nelem()), static_cast<double>(near)};
  comm_sum(sum, 2);
  EXPECT_LT(sum[0], n * n + 36.0 * comm_size());
  EXPECT_GT(sum[1], n);
}

// A pair whose bodies come near each other from far: the faces are known where they are asked for at t = 0,
// are missed when one has come near, and both sides are told then
TEST(Divided, MastersThatComeNearAreMissed)
{
  if (comm_size() == 1) GTEST_SKIP();
  const int n = 40;
  const Model whole = paired_plate(n), m = divided(whole);
  ASSERT_TRUE(m.part.on);
  Bonds b;
  ASSERT_EQ(bond_form(m, Points(), b), 0);
  bond_share(m, Points(), b);
  RealVec u(m.mesh.nnode() * m.dim, 0.0), xb;
  MasterWatch watch;
  std::vector<NearFace> face;
  const auto known = [&] {
    bond_places(m, Points(), b, u, {}, xb);
    return masters_known(m, Points(), b, u, {}, xb, watch, face);
  };
  EXPECT_TRUE(known());
  EXPECT_TRUE(face.empty());
  // the lower left quarter goes to the upper right one: its lower side lies at the upper side there
  for (int k = 0; k < m.mesh.nnode(); ++k) {
    if (m.mesh.X[3 * k] > 0.05 * n || m.mesh.X[3 * k + 1] > 0.1 * n) continue;
    u[k * m.dim]     = 0.05 * n;
    u[k * m.dim + 1] = 0.2 * n;
  }
  EXPECT_FALSE(known());
  double sides[2] = {0.0, 0.0};
  for (const NearFace& f : face) ++sides[f.side == NEAR_MASTER];
  comm_sum(sides, 2);
  EXPECT_EQ(sides[0], 2.0 * 4 * n + 3);
  EXPECT_EQ(sides[1], 2.0 * n + n);
}

// a face of an element of unit size, its box [x, x + 1] grown by a quarter
NearFace face_at(int elem, double x)
{
  return {elem, 1.0, {{x - 0.25, 0.0, 0.0}, {x + 1.25, 1.0, 1.0}}};
}

TEST(Divided, NearElementsAreOuterOnes)
{
  // boxes are apart by 0, 2.9 and 3.1 sizes; those of one and a half sizes on both sides are added
  const std::vector<NearFace> face = {face_at(0, 0.0), face_at(1, 1.5), face_at(2, 5.9), face_at(3, 10.5)};
  NearLists list = {std::vector<IntVec>(2), std::vector<std::vector<OriginalPoint>>(2)};
  near_outer(face, {0, 1, 0, 1}, {}, list);
  EXPECT_EQ(list.elem[0], IntVec{1});
  EXPECT_EQ(list.elem[1], (IntVec{0, 2}));
  EXPECT_TRUE(list.point[0].empty() && list.point[1].empty());
}

// points from the start go by their numbers, with who works on them; each once, though two faces are near
TEST(Divided, NearPointsAreKnown)
{
  std::vector<NearFace> face = {face_at(0, 0.0), face_at(-1, 1.5), face_at(-1, 1.6), face_at(-1, 9.0)};
  face[1].point = face[2].point = 7;
  face[3].point = 3;
  NearLists list = {std::vector<IntVec>(2), std::vector<std::vector<OriginalPoint>>(2)};
  near_outer(face, {0, 1, 1, 0}, {}, list);
  ASSERT_EQ(list.point[0].size(), 1u);
  EXPECT_EQ(list.point[0][0].point, 7);
  EXPECT_EQ(list.point[0][0].rank, 1);
  EXPECT_EQ(list.elem[1], IntVec{0});
  EXPECT_TRUE(list.point[1].empty());                // the last one is too far off
}

// A slave looks at masters of its own pair alone, for the rank of its element and for others that look with it
TEST(Divided, NearMastersAreOuterOnes)
{
  std::vector<NearFace> face = {face_at(0, 0.0), face_at(1, 1.5), face_at(2, 1.5), face_at(3, 0.0)};
  for (NearFace& f : face) f.def = 0;
  face[0].side = face[3].side = NEAR_SLAVE;
  face[1].side = face[2].side = NEAR_MASTER;
  face[2].def  = face[3].def = 1;
  NearLists list = {std::vector<IntVec>(3), std::vector<std::vector<OriginalPoint>>(3)};
  near_outer(face, {0, 1, 1, 1}, {{}, {}, {0}}, list);
  EXPECT_EQ(list.elem[0], IntVec{1});
  EXPECT_EQ(list.elem[1], IntVec());
  EXPECT_EQ(list.elem[2], IntVec{1});
}

TEST(Divided, NearFacesOfOthersAreMissed)
{
  const int me = comm_rank(), next = (me + 1) % comm_size();
  if (comm_size() == 1) GTEST_SKIP();
  MeshPart part;
  part.on = true;
  part.elem = {me};
  EXPECT_TRUE(near_known(part, Points(), {face_at(me, 1.6 * me)}, {face_at(me, 1.6 * me)}));
  EXPECT_TRUE(near_known(part, Points(), {}, {}));
  EXPECT_FALSE(near_known(part, Points(), {face_at(me, 1.4 * me)}, {face_at(me, 1.4 * me)}));
  Points pts;                                        // points from the start instead
  pts.part.on    = true;
  pts.part.point = {me};
  NearFace point = face_at(-1, 1.4 * me);
  point.point    = me;
  EXPECT_FALSE(near_known(part, pts, {point}, {point}));
  pts.part.point = {std::min(me, next), std::max(me, next)};
  EXPECT_EQ(comm_size() == 2, near_known(part, pts, {point}, {point}));
  part.elem = {std::min(me, next), std::max(me, next)};
  EXPECT_EQ(comm_size() == 2, near_known(part, Points(), {face_at(me, 1.4 * me)}, {face_at(me, 1.4 * me)}));
}

}  // namespace
