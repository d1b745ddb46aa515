#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/comm.h"
#include "base/forest.h"
#include "base/sort_once.h"
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

// points of the deck that other ranks own count there: their history is not known here
bool intact_point(const Model& m, const State& st, int p)
{
  const bool cracks = m.body[st.points.body[p]].fracture >= 0;
  if (cracks && m.part.on && !point_counts(m, st.points, p)) return false;
  return st.points.broken[p] < 0 && !point_open(m, st.points, st.n, p);
}

void join_points(const Model& m, const State& st, Forest& forest)
{
  const Points& pts = st.points;
  for (int p = 0; p < pts.npoint; ++p)
    for (int a = 1; intact_point(m, st, p) && a < pts.conn.count(p); ++a)
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

// does element e have all nodes of bond q?
bool holds(const Model& m, const Bonds& b, int q, int e)
{
  const int *first = m.mesh.conn.begin(e), *last = first + m.mesh.conn.count(e);
  for (int k = b.a.off[q]; k < b.a.off[q + 1]; ++k)
    if (std::find(first, last, b.a.item[k]) == last) return false;
  return true;
}

// a bond between mesh and grid, at an intact element
bool ties(const Model& m, const Elements& el, const Fracture& fr, const Bonds& b, const ListTable& of_node,
          int q)
{
  if (b.field[q] < 0 || (b.cn[q] == 0.0 && b.ct[q] == 0.0)) return false;
  const int n = b.a.item[b.a.off[q]];
  for (int k = of_node.off[n]; k < of_node.off[n + 1]; ++k)
    if (known_intact(m, el, fr, of_node.item[k]) && holds(m, b, q, of_node.item[k])) return true;
  return false;
}

// joins item with point p if p is intact and its domain at t = 0 contains or touches the bond
//   in   at   position of the bond, item   at its side A
void join_bond(const Model& m, const State& st, const double* at, int item, int p, Forest& forest)
{
  if (!intact_point(m, st, p)) return;
  const Points& pts = st.points;
  double X[24], xi[3];
  for (int a = 0; a < pts.conn.count(p); ++a)
    for (int i = 0; i < m.dim; ++i) X[a * m.dim + i] = pts.Xc[pts.conn.begin(p)[a] * m.dim + i];
  if (!shape_locate(static_cast<Shape>(pts.shape[p]), X, at, xi)) return;
  forest.join(item, m.mesh.nnode() + pts.conn.begin(p)[0]);
}

// bonds of conversion: the points of the elements at the bond
void join_converted(const Model& m, const State& st, const ListTable& of_node, int q, Forest& forest)
{
  const Points& pts = st.points;
  const Bonds& b    = st.bonds;
  const int n = b.a.item[b.a.off[q]];
  for (int k = of_node.off[n]; k < of_node.off[n + 1]; ++k) {
    const int e = of_node.item[k];
    if (!pts.converted(e) || !holds(m, b, q, e)) continue;
    for (int p = pts.of_elem[e]; p < pts.npoint && pts.parent[p] == e; ++p)
      if (m.body[pts.body[p]].field == b.field[q]) join_bond(m, st, &b.X[3 * q], n, p, forest);
  }
}

// A bond of the deck that ties the mesh to points of a body
struct TiedBond {
  double X[3];
  int body;
  int node;                    // side A: its first node, -1: of another rank
  long name;
};

// adds bonds of other ranks that may be at points of this one
void exchange_bonds(const Model& m, const Points& pts, std::vector<TiedBond>& bond)
{
  std::array<double, 6> box = {1e300, 1e300, 1e300, 1e300, 1e300, 1e300};   // lower, -upper
  for (std::size_t k = 0; k < pts.Xc.size(); ++k) {
    double &lo = box[k % m.dim], &hi = box[3 + k % m.dim];
    lo = std::min(lo, pts.Xc[k]);
    hi = std::min(hi, -pts.Xc[k]);
  }
  std::vector<std::array<double, 6>> of_rank(1, box);
  comm_allgatherv(of_rank);
  std::vector<std::vector<TiedBond>> send(comm_size());
  for (int r = 0; r < comm_size(); ++r) {
    double largest = 0.0;
    for (double x : of_rank[r]) largest = std::max(largest, std::fabs(x));
    const double margin = 1e-5 * largest;
    for (TiedBond p : bond) {
      bool meets = r != comm_rank();
      for (int i = 0; i < m.dim; ++i)
        meets = meets && p.X[i] > of_rank[r][i] - margin && -p.X[i] > of_rank[r][3 + i] - margin;
      p.node = -1;
      if (meets) send[r].push_back(p);
    }
  }
  for (const std::vector<TiedBond>& received : comm_exchange(send))
    bond.insert(bond.end(), received.begin(), received.end());
}

// bonds of the deck between the mesh and points of a body, by X1: in a divided model owned ones, and those of
// other ranks that may be at points of this one
std::vector<TiedBond> tied_bonds(const Model& m, const Elements& el, const State& st,
                                   const ListTable& of_node)
{
  const Bonds& b = st.bonds;
  std::vector<TiedBond> bond;
  for (int q = 0; q < b.nfixed; ++q)
    if (b.counts(q) && ties(m, el, st.frac, b, of_node, q))
      bond.push_back({{b.X[3 * q], b.X[3 * q + 1], b.X[3 * q + 2]}, m.bond[b.def[q]].body,
                       b.a.item[b.a.off[q]], m.part.on ? b.name[q] : q});
  if (m.part.on) exchange_bonds(m, st.points, bond);
  std::sort(bond.begin(), bond.end(),
            [](const TiedBond& x, const TiedBond& y) { return x.X[0] < y.X[0]; });
  return bond;
}

// joins side A of each bond, item first + k of the forest, with the points of its body
void join_tied(const Model& m, const State& st, const std::vector<TiedBond>& bond, int first, Forest& forest)
{
  const Points& pts = st.points;
  for (std::size_t k = 0; k < bond.size(); ++k)
    if (bond[k].node >= 0) forest.join(bond[k].node, first + static_cast<int>(k));
  for (int p = 0; p < pts.npoint && !bond.empty(); ++p) {
    double lo = 1e300, hi = -1e300;
    for (int a = 0; a < pts.conn.count(p); ++a) {
      lo = std::min(lo, pts.Xc[pts.conn.begin(p)[a] * m.dim]);
      hi = std::max(hi, pts.Xc[pts.conn.begin(p)[a] * m.dim]);
    }
    const double margin = 1e-5 * (hi - lo);
    const auto below    = [](const TiedBond& t, double x) { return t.X[0] < x; };
    for (auto t = std::lower_bound(bond.begin(), bond.end(), lo - margin, below);
         t != bond.end() && t->X[0] <= hi + margin; ++t)
      if (t->body == pts.body[p])
        join_bond(m, st, t->X, first + static_cast<int>(t - bond.begin()), p, forest);
  }
}

// bonds of conversion
void join_bonds(const Model& m, const Elements& el, const State& st, const ListTable& of_node, Forest& forest)
{
  const Bonds& b = st.bonds;
  for (int q = b.nfixed; q < b.nbond && st.points.npoint > 0; ++q)
    if (ties(m, el, st.frac, b, of_node, q)) join_converted(m, st, of_node, q, forest);
}

// divided model: names of all ranks, ascending
void gather_names(const MeshPart& part, IntVec& name)
{
  sort_once(name);
  if (!part.on) return;
  comm_allgatherv(name);
  sort_once(name);
}

// the new number of each fragment: by decreasing mass, then by smallest label
IntVec order_pieces(const std::vector<Fragment>& item)
{
  IntVec by(item.size() - 1), number(item.size(), 0);
  std::iota(by.begin(), by.end(), 1);
  std::stable_sort(by.begin(), by.end(), [&](int i, int j) { return item[i].mass > item[j].mass; });
  for (size_t i = 0, j; i < by.size(); i = j) {      // masses of equal fragments differ by round-off
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
  const ListTable of_node = st.bonds.nbond > 0 ? elements_of_nodes(m) : ListTable();
  const std::vector<TiedBond> bond = tied_bonds(m, el, st, of_node);
  const int first = m.mesh.nnode() + pts.ncorner;
  Forest forest(first + static_cast<int>(bond.size()));     // nodes, corners, bonds
  join_elements(m, el, forest);
  join_points(m, st, forest);
  join_tied(m, st, bond, first, forest);
  join_bonds(m, el, st, of_node, forest);
  IntVec root;
  for (int i = 0; i < static_cast<int>(forest.up.size()); ++i) root.push_back(forest.root(i));
  if (m.part.on) {
    Halo halo;
    std::vector<long> name;
    for (const TiedBond& p : bond) name.push_back(p.name);
    halo_form(name, halo);
    model_join_ranks(m.part, pts.part, halo, root);
  }

  const auto of_elem  = [&](int e) { return root[m.mesh.conn.begin(e)[0]]; };
  const auto of_point = [&](int p) { return root[m.mesh.nnode() + pts.conn.begin(p)[0]]; };
  IntVec name;
  for (int e = 0; e < m.mesh.nelem(); ++e)
    if (intact_elem(el, e)) name.push_back(of_elem(e));
  for (int p = 0; p < pts.npoint; ++p)
    if (intact_point(m, st, p)) name.push_back(of_point(p));
  gather_names(m.part, name);
  const auto number = [&](int root_of) {
    return static_cast<int>(std::lower_bound(name.begin(), name.end(), root_of) - name.begin()) + 1;
  };
  f.of_elem.assign(m.mesh.nelem(), -1);
  f.of_point.assign(pts.npoint, 0);
  for (int e = 0; e < m.mesh.nelem(); ++e)
    if (el.block_of[e] >= 0) f.of_elem[e] = intact_elem(el, e) ? number(of_elem(e)) : 0;
  for (int p = 0; p < pts.npoint; ++p)
    if (intact_point(m, st, p)) f.of_point[p] = number(of_point(p));
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
