#include <algorithm>
#include <numeric>

#include "base/comm.h"
#include "base/forest.h"
#include "frac/frac.h"
#include "shape/shape.h"

namespace {

bool intact_elem(const Elements& el, int e) { return el.block_of[e] >= 0 && el.broken(e) < 0; }

// the same for elements of other ranks as well
bool known_intact(const Model& m, const Elements& el, const Fracture& fr, int e)
{
  if (m.part.works(e)) return intact_elem(el, e);
  return m.mesh.elem_section[e] >= 0 && (fr.empty() || (fr.phase[e] == AS_ELEMENT && fr.broken[e] < 0));
}

void join_elements(const Model& m, const Elements& el, Forest& forest)
{
  for (int e = 0; e < m.mesh.nelem(); ++e)
    for (int a = 1; intact_elem(el, e) && a < m.mesh.conn.count(e); ++a)
      forest.join(m.mesh.conn.begin(e)[0], m.mesh.conn.begin(e)[a]);
}

void join_points(const Model& m, const Points& pts, Forest& forest)
{
  for (int p = 0; p < pts.npoint; ++p)
    for (int a = 1; pts.broken[p] < 0 && a < pts.conn.count(p); ++a)
      forest.join(m.mesh.nnode() + pts.conn.begin(p)[0], m.mesh.nnode() + pts.conn.begin(p)[a]);
  // corners at nodes of elements  (7.14)
  for (int c = 0; c < static_cast<int>(pts.hangs.size()); ++c)
    if (pts.hangs[c] == HANG_NODE) forest.join(pts.hang.begin(c)[0], m.mesh.nnode() + c);
}

ListTable elements_of_nodes(const Model& m)
{
  ListTable t;
  IntVec at(m.mesh.nnode() + 1, 0);
  for (int n : m.mesh.conn.item) ++at[n + 1];
  std::partial_sum(at.begin(), at.end(), at.begin());
  t.off = at;
  t.item.resize(m.mesh.conn.item.size());
  for (int e = 0; e < m.mesh.nelem(); ++e)
    for (int k = m.mesh.conn.off[e]; k < m.mesh.conn.off[e + 1]; ++k) t.item[at[m.mesh.conn.item[k]]++] = e;
  return t;
}

// does element e have all nodes that bond q hangs on?
bool holds(const Model& m, const Bonds& b, int q, int e)
{
  const int *first = m.mesh.conn.begin(e), *last = first + m.mesh.conn.count(e);
  for (int k = b.a.off[q]; k < b.a.off[q + 1]; ++k)
    if (std::find(first, last, b.a.item[k]) == last) return false;
  return true;
}

// a bond that ties the mesh to a grid, and whose place an intact element holds
bool ties(const Model& m, const Elements& el, const Fracture& fr, const Bonds& b, const ListTable& of_node,
          int q)
{
  if (b.field[q] < 0 || (b.cn[q] == 0.0 && b.ct[q] == 0.0)) return false;
  const int n = b.a.item[b.a.off[q]];
  for (int k = of_node.off[n]; k < of_node.off[n + 1]; ++k)
    if (known_intact(m, el, fr, of_node.item[k]) && holds(m, b, q, of_node.item[k])) return true;
  return false;
}

// joins bond q with point p when that is intact and its domain at t = 0 contains or touches the place of the
// bond
void join_bond(const Model& m, const Points& pts, const Bonds& b, int q, int p, Forest& forest)
{
  if (pts.broken[p] >= 0) return;
  double X[24], xi[3];
  for (int a = 0; a < pts.conn.count(p); ++a)
    for (int i = 0; i < m.dim; ++i) X[a * m.dim + i] = pts.Xc[pts.conn.begin(p)[a] * m.dim + i];
  if (!shape_locate(static_cast<Shape>(pts.shape[p]), X, &b.X[3 * q], xi)) return;
  forest.join(b.a.item[b.a.off[q]], m.mesh.nnode() + pts.conn.begin(p)[0]);
}

// bonds of conversion: the points of the elements that were at the bond
void join_converted(const Model& m, const Points& pts, const Bonds& b, const ListTable& of_node, int q,
                    Forest& forest)
{
  const int n = b.a.item[b.a.off[q]];
  for (int k = of_node.off[n]; k < of_node.off[n + 1]; ++k) {
    const int e = of_node.item[k];
    if (!pts.converted(e) || !holds(m, b, q, e)) continue;
    for (int p = pts.of_elem[e]; p < pts.npoint && pts.parent[p] == e; ++p)
      if (m.body[pts.body[p]].field == b.field[q]) join_bond(m, pts, b, q, p, forest);
  }
}

// bonds of the deck, sorted by X1: the points of their body
void join_of_deck(const Model& m, const Points& pts, const Bonds& b, const IntVec& bond, Forest& forest)
{
  RealVec x;
  for (int q : bond) x.push_back(b.X[3 * q]);
  for (int p = 0; p < pts.npoint && !bond.empty(); ++p) {
    double lo = 1e300, hi = -1e300;
    for (int a = 0; a < pts.conn.count(p); ++a) {
      lo = std::min(lo, pts.Xc[pts.conn.begin(p)[a] * m.dim]);
      hi = std::max(hi, pts.Xc[pts.conn.begin(p)[a] * m.dim]);
    }
    const double margin = 1e-5 * (hi - lo);
    for (size_t k = std::lower_bound(x.begin(), x.end(), lo - margin) - x.begin();
         k < x.size() && x[k] <= hi + margin; ++k)
      if (m.bond[b.def[bond[k]]].body == pts.body[p]) join_bond(m, pts, b, bond[k], p, forest);
  }
}

void join_bonds(const Model& m, const Elements& el, const State& st, Forest& forest)
{
  const Points& pts = st.points;
  const Bonds& b    = st.bonds;
  if (pts.npoint == 0 || b.nbond == 0) return;
  const ListTable of_node = elements_of_nodes(m);
  IntVec of_deck;
  for (int q = 0; q < b.nbond; ++q) {
    if (!ties(m, el, st.frac, b, of_node, q)) continue;
    if (q < b.nfixed) of_deck.push_back(q);
    else join_converted(m, pts, b, of_node, q, forest);
  }
  std::sort(of_deck.begin(), of_deck.end(), [&](int i, int j) { return b.X[3 * i] < b.X[3 * j]; });
  join_of_deck(m, pts, b, of_deck, forest);
}

// divided model: the names of all ranks, ascending
void gather_names(const MeshPart& part, IntVec& name)
{
  const auto each_once = [&] {
    std::sort(name.begin(), name.end());
    name.erase(std::unique(name.begin(), name.end()), name.end());
  };
  each_once();
  if (!part.on) return;
  comm_allgatherv(name);
  each_once();
}

// the new number of each piece: by falling mass, pieces of the same mass by their smallest label
IntVec order_pieces(const std::vector<Fragment>& item)
{
  IntVec by(item.size() - 1), number(item.size(), 0);
  std::iota(by.begin(), by.end(), 1);
  std::stable_sort(by.begin(), by.end(), [&](int i, int j) { return item[i].mass > item[j].mass; });
  for (size_t i = 0, j; i < by.size(); i = j) {      // masses of equal pieces differ by rounding
    for (j = i + 1; j < by.size() && item[by[j]].mass > item[by[i]].mass * (1.0 - 1e-9); ++j) {}
    std::sort(by.begin() + i, by.begin() + j, [&](int k, int l) {
      return item[k].of_mesh != item[l].of_mesh ? item[k].of_mesh : item[k].label < item[l].label;
    });
  }
  for (size_t i = 0; i < by.size(); ++i) number[by[i]] = static_cast<int>(i) + 1;
  return number;
}

}  // namespace

int frac_connect(const Model& m, const Elements& el, const State& st, Fragments& f)
{
  const Points& pts = st.points;
  Forest forest(m.mesh.nnode() + pts.ncorner);       // nodes, then corners
  join_elements(m, el, forest);
  join_points(m, pts, forest);
  join_bonds(m, el, st, forest);
  IntVec root;
  for (int i = 0; i < static_cast<int>(forest.up.size()); ++i) root.push_back(forest.root(i));
  if (m.part.on) model_join_ranks(m.part, pts.part, root);

  const auto of_elem  = [&](int e) { return root[m.mesh.conn.begin(e)[0]]; };
  const auto of_point = [&](int p) { return root[m.mesh.nnode() + pts.conn.begin(p)[0]]; };
  IntVec name;
  for (int e = 0; e < m.mesh.nelem(); ++e)
    if (intact_elem(el, e)) name.push_back(of_elem(e));
  for (int p = 0; p < pts.npoint; ++p)
    if (pts.broken[p] < 0) name.push_back(of_point(p));
  gather_names(m.part, name);
  const auto number = [&](int root_of) {
    return static_cast<int>(std::lower_bound(name.begin(), name.end(), root_of) - name.begin()) + 1;
  };
  f.of_elem.assign(m.mesh.nelem(), -1);
  f.of_point.assign(pts.npoint, 0);
  for (int e = 0; e < m.mesh.nelem(); ++e)
    if (el.block_of[e] >= 0) f.of_elem[e] = intact_elem(el, e) ? number(of_elem(e)) : 0;
  for (int p = 0; p < pts.npoint; ++p)
    if (pts.broken[p] < 0) f.of_point[p] = number(of_point(p));
  return static_cast<int>(name.size());
}

void frac_fragments(const Model& m, const Elements& el, const State& st, Fragments& f)
{
  const int n = frac_connect(m, el, st, f);
  frac_measure(m, el, st, n, f);
  const IntVec number = order_pieces(f.item);
  for (int& k : f.of_elem)
    if (k > 0) k = number[k];
  for (int& k : f.of_point) k = number[k];
  std::vector<Fragment> sorted(f.item.size());
  for (size_t k = 0; k < f.item.size(); ++k) sorted[number[k]] = f.item[k];
  f.item.swap(sorted);
}
