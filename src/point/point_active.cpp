#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/comm.h"
#include "base/grow.h"
#include "base/halo_numbers.h"
#include "base/sort_once.h"
#include "point/grid_halo.h"

namespace {

// Bodies that meet through the grid share nodes between them: the grid is then laid anew after this fraction
// of KEEP  (test: Grid.StaysUntilACornerHasGone, contact/g3_pf.inp)
const double KEEP_OF_MEETING = 0.1;

// the multilinear weights of a cell at xi (outside 0 ... 1: extrapolation); zero weights are left out
template <class Use>
void each_node(const Grid& g, int dim, int field, const int* cell, const double* xi, Use use)
{
  for (int k = 0; k < (1 << dim); ++k) {
    double N = 1.0;
    int at[3] = {0, 0, 0};
    for (int i = 0; i < dim; ++i) {
      const int up = (k >> i) & 1;
      N *= up ? xi[i] : 1.0 - xi[i];
      at[i] = cell[i] + up;
    }
    if (N != 0.0) use(node_key(g, dim, field, at), N);
  }
}

// The distinct keys of a list, ascending, and their numbers. Grid keys of a narrow range are numbered in a
// table over the range, which is faster than sorting.
struct KeyNumbers {
  std::vector<long> key;
  long low = 0;
  IntVec number;               // of low, low + 1, ...; empty: search key
  int of(long k) const { return number.empty() || k >= key_own ? find_key(key, k) : number[k - low]; }
};

void number_keys(const std::vector<long>& all, KeyNumbers& out)
{
  std::vector<long> own;
  long low = key_own, high = -1;
  for (long k : all) {
    if (k >= key_own) {
      own.push_back(k);
    } else {
      low  = std::min(low, k);
      high = std::max(high, k);
    }
  }
  out.key.clear();
  out.number.clear();
  out.low = low;
  if (high - low >= 8 * static_cast<long>(all.size())) {
    out.key = all;
    sort_once(out.key);
    return;
  }
  if (high >= low) {
    out.number.assign(high - low + 1, -1);
    for (long k : all)
      if (k < key_own) out.number[k - low] = 0;
    for (size_t i = 0; i < out.number.size(); ++i) {
      if (out.number[i] < 0) continue;
      out.number[i] = static_cast<int>(out.key.size());
      out.key.push_back(low + static_cast<long>(i));
    }
  }
  sort_once(own);
  out.key.insert(out.key.end(), own.begin(), own.end());
}

// Nodes and weights of positions, appended one by one. There is always room for one more whole cell.
struct Touched {
  std::vector<long>& key;
  ListTable& list;
  RealVec& w;
  int n = 0, rows = 0, width;
  Touched(int max_rows, int cell, std::vector<long>& k, ListTable& l, RealVec& weight)
      : key(k), list(l), w(weight), width(cell)
  {
    make_room();
    list.off.resize(max_rows + 1);
    list.off[0] = 0;
  }
  void make_room()
  {
    size_to(w, static_cast<size_t>(n) + width);
    key.resize(w.size());
  }
  void next(int count)
  {
    n += count;
    list.off[++rows] = n;
    make_room();
  }
  void end()
  {
    key.resize(n);
    w.resize(n);
    list.item.resize(n);
  }
};

// corners between nodes are interpolated from the unknowns of the corners at these nodes  (7.14)
void follow_corners(const Points& pts, const GridShare& share, int nnode, ActiveGrid& g)
{
  if (std::find(pts.hangs.begin(), pts.hangs.end(), HANG_CORNERS) == pts.hangs.end()) return;
  ListTable out;
  RealVec out_w;
  IntVec last(nnode, -1);      // [unknown] index of its last item in out
  for (int c = 0; c < pts.ncorner; ++c) {
    const int first  = out.off.back();
    const auto add = [&](int from, double w) {
      for (int k = g.corner.off[from]; k < g.corner.off[from + 1]; ++k) {
        const int n = g.corner.item[k];
        if (last[n] < first) {
          last[n] = static_cast<int>(out.item.size());
          append(out.item, n);
          append(out_w, 0.0);
        }
        out_w[last[n]] += w * g.corner_w[k];
      }
    };
    if (pts.carrier(c) != HANG_CORNERS) add(c, 1.0);
    else
      for (int k = pts.hang.off[c]; k < pts.hang.off[c + 1] && share.has_corner(c); ++k)
        add(-1 - pts.hang.item[k], pts.hang_w[k]);
    out.off.push_back(static_cast<int>(out.item.size()));
  }
  g.corner.off.swap(out.off);
  g.corner.item.swap(out.item);
  g.corner_w.swap(out_w);
}

// Cells and nodes under the corners
//   in   x      positions                                                      [ncorner*D]
//   out  key    of the nodes, which g.corner.item refers to;   cell: keys, some twice
//        worst  OUTSIDE_GRID: the corner
template <int D>
Status touch_corners(const Grid& grid, const Points& pts, const GridShare& share, const RealVec& x,
                     std::vector<long>& key, std::vector<long>& cell, ActiveGrid& g, int* worst)
{
  CellPosition s;
  std::vector<char> owned(pts.ncorner, 0);           // corners of points; released points have left theirs
  for (int c : pts.conn.item) owned[c] = share.has_corner(c);
  Touched corner(pts.ncorner, 1 << D, key, g.corner, g.corner_w);
  for (int c = 0; c < pts.ncorner; ++c) {
    int n = 0;
    const int on = owned[c] ? pts.carrier(c) : HANG_CORNERS;
    if (on == HANG_NODE || on == HANG_OWN) {
      key[corner.n] = on == HANG_NODE ? key_node + pts.hang.begin(c)[0] : key_own + pts.corner_number(c);
      g.corner_w[corner.n] = 1.0;
      n = 1;
    } else if (on == HANG_GRID) {
      if (!locate<D>(grid, &x[static_cast<size_t>(c) * D], s)) {
        *worst = c;
        return OUTSIDE_GRID;
      }
      n = cell_weights<D>(grid, pts.field[c], s, &key[corner.n], &g.corner_w[corner.n]);
      // a corner on a cell face belongs to no single cell
      if (n == 1 << D) cell.push_back(cell_key(grid, D, pts.field[c], s.cell));
    }
    corner.next(n);
  }
  corner.end();
  return STATUS_OK;
}

// The same for the bonds at xb;  worst: -1 - bond
template <int D>
Status touch_bonds(const Grid& grid, const Bonds& bonds, const GridShare& share, const RealVec& xb,
                   std::vector<long>& key, ActiveGrid& g, int* worst)
{
  CellPosition s;
  Touched bond(bonds.nbond, 1 << D, key, g.bond, g.bond_w);
  for (int b = 0; b < bonds.nbond; ++b) {
    int n = 0;
    if (bonds.field[b] >= 0 && share.has_bond(b)) {
      if (!locate<D>(grid, &xb[static_cast<size_t>(b) * D], s)) {
        *worst = -1 - b;
        return OUTSIDE_GRID;
      }
      n = cell_weights<D>(grid, bonds.field[b], s, &key[bond.n], &g.bond_w[bond.n]);
    }
    bond.next(n);
  }
  bond.end();
  return STATUS_OK;
}

// Cells under the centres of points whose corners are all carried by the grid
template <int D>
void touch_centres(const Grid& grid, const Points& pts, const GridShare& share, const RealVec& x,
                   std::vector<long>& cell)
{
  CellPosition s;
  for (int p = 0; p < pts.npoint; ++p) {
    if (pts.released[p] || !share.has_point(p)) continue;
    double mid[D] = {};
    bool follows = false;      // a corner is not carried by the grid, which need not exist around the centre
    const double* w = pts.w(p);
    for (int a = 0; a < pts.conn.count(p); ++a) {
      const int c = pts.conn.begin(p)[a];
      follows = follows || pts.carrier(c) != HANG_GRID;
      for (int i = 0; i < D; ++i) mid[i] += w[a] * x[c * D + i];
    }
    if (follows) continue;
    if (!locate<D>(grid, mid, s)) continue;
    const long key = cell_key(grid, D, pts.field[pts.conn.begin(p)[0]], s.cell);
    if (cell.empty() || cell.back() != key) cell.push_back(key);
  }
}

// 1. cells and nodes under every corner and bond: their keys, ascending; lists
// and weights refer to these by index
template <int D>
Status touch(const Model& m, const Points& pts, const Bonds& bonds, const GridShare& share, const RealVec& uc,
             const RealVec& xb, std::vector<long>& node, ActiveGrid& g, int* worst)
{
  std::vector<long> corner_key, bond_key, cell;
  RealVec x(pts.Xc.size());
  for (size_t i = 0; i < x.size(); ++i) x[i] = pts.Xc[i] + uc[i];
  Status status = touch_corners<D>(m.grid, pts, share, x, corner_key, cell, g, worst);
  if (status == STATUS_OK) status = touch_bonds<D>(m.grid, bonds, share, xb, bond_key, g, worst);
  if (status != STATUS_OK) return status;
  touch_centres<D>(m.grid, pts, share, x, cell);
  KeyNumbers numbers;
  number_keys(cell, numbers);
  g.cell.swap(numbers.key);
  const size_t ncorner_key = corner_key.size();
  corner_key.insert(corner_key.end(), bond_key.begin(), bond_key.end());
  number_keys(corner_key, numbers);
  for (size_t i = 0; i < corner_key.size(); ++i)
    (i < ncorner_key ? g.corner.item[i] : g.bond.item[i - ncorner_key]) = numbers.of(corner_key[i]);
  node.swap(numbers.key);
  return STATUS_OK;
}

// Nodes of points: the nodes of their corners. A point with the same nodes as the previous one, as in a
// converted element, lists them in the same order: such points have the same entries of the matrix.
struct PointNodes {
  const Points& pts;
  ActiveGrid& g;
  IntVec last;                 // [nnode] index of the last item with the node
  int from = 0, to = 0;        // the list that the previous points share
  IntVec seen;                 // [to - from] the last point that has the node
  int used = 0;
  size_t slots = 0;

  PointNodes(const Points& points, int nnode, ActiveGrid& grid) : pts(points), g(grid), last(nnode, -1) {}

  template <class Use>
  bool each(int p, Use use)
  {
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) {
      const int c = pts.conn.item[k];
      for (int j = g.corner.off[c]; j < g.corner.off[c + 1]; ++j)
        if (!use(g.corner.item[j])) return false;
    }
    return true;
  }

  bool same(int p)
  {
    int* slot = g.slot.data() + slots;
    int found = 0;
    const bool known = each(p, [&](int n) {
      const int at = last[n] - from;
      if (at < 0 || at >= to - from) return false;
      found += seen[at] != p;
      seen[at] = p;
      *slot++  = at;
      return true;
    });
    if (!known || found < to - from) return false;
    std::copy_n(g.point.item.data() + from, to - from, g.point.item.data() + used);
    used += to - from;
    slots = slot - g.slot.data();
    return true;
  }

  void list(int p)
  {
    int *item = g.point.item.data(), *slot = g.slot.data();
    from = used;
    each(p, [&](int n) {
      if (last[n] < from) {
        last[n]      = used;
        item[used++] = n;
      }
      slot[slots++] = last[n] - from;
      return true;
    });
    to = used;
    seen.assign(to - from, -1);
  }
};

// 2. the nodes of every point
void point_lists(const Points& pts, const GridShare& share, int nnode, ActiveGrid& g)
{
  PointNodes nodes(pts, nnode, g);
  g.point.off.resize(pts.npoint + 1);
  g.point.off[0] = 0;
  for (int p = 0; p < pts.npoint; ++p) {
    g.point.off[p + 1] = nodes.used;
    if (!share.has_point(p)) continue;
    size_t added = 0;          // nodes at most
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) added += g.corner.count(pts.conn.item[k]);
    const size_t item = nodes.used + added, slot = nodes.slots + added;
    size_to(g.point.item, item);
    size_to(g.slot, slot);
    if (!nodes.same(p)) nodes.list(p);
    g.point.off[p + 1] = nodes.used;
  }
  g.point.item.resize(nodes.used);
  g.slot.resize(nodes.slots);
}

// does cell c touch all planes of *GRID BOUNDARY on which the node lies? Then the node is interpolated from
// nodes of the plane alone, and the prescribed values hold for it too
bool keeps_planes(const Model& m, const int* at, const int* c)
{
  for (const GridBc& b : m.grid_bc) {
    const Grid& g = m.grid;
    const double plane = (b.position - g.lo[b.axis]) / g.h[b.axis];
    if (std::fabs(plane - at[b.axis]) < 1e-6 && c[b.axis] != at[b.axis] && c[b.axis] != at[b.axis] - 1)
      return false;
  }
  return true;
}

// Indices of ascending keys: a table over their range, or a search where that is wide
struct KeyTable {
  const std::vector<long>& key;
  long low = 0;
  IntVec number;               // of low, low + 1, ...; -1: no key; empty: search key

  explicit KeyTable(const std::vector<long>& keys) : key(keys)
  {
    const auto end = std::lower_bound(key.begin(), key.end(), key_own);        // keys of the grid
    if (end == key.begin()) return;
    low = key.front();
    const long range = *(end - 1) - low + 1;
    if (range >= 64 * static_cast<long>(key.size())) return;
    number.assign(range, -1);
    for (auto k = key.begin(); k != end; ++k) number[*k - low] = static_cast<int>(k - key.begin());
  }
  int find(long k) const
  {
    if (number.empty() || k >= key_own) return find_key(key, k);
    return k < low || k - low >= static_cast<long>(number.size()) ? -1 : number[k - low];
  }
};

// 3. the nearest cells whose nodes are all strong, averaged over cells at equal distance
bool extend_node(const Model& m, const KeyTable& cells, const std::vector<long>& key, const KeyTable& nodes,
                 const std::vector<char>& strong, int weak, GridLists& out)
{
  const Grid& g = m.grid;
  const int dim = m.dim;
  int at[3];
  const int field = node_of_key(g, dim, key[weak], at);

  const int reach = 2;         // cells between the node and the cell that it is extrapolated from, max. REACH
  double best = 1e30;
  std::vector<std::array<int, 3>> chosen;
  for (int k = dim == 3 ? -reach - 1 : 0; k <= (dim == 3 ? reach : 0); ++k)
    for (int j = -reach - 1; j <= reach; ++j)
      for (int i = -reach - 1; i <= reach; ++i) {
        const int c[3] = {at[0] + i, at[1] + j, at[2] + k};
        bool good = true;
        for (int d = 0; d < dim; ++d) good = good && c[d] >= 0 && c[d] < g.n[d];
        const double dist = (i + 0.5) * (i + 0.5) + (j + 0.5) * (j + 0.5) +
                            (dim == 3 ? (k + 0.5) * (k + 0.5) : 0.0);
        if (!good || dist > best || cells.find(cell_key(g, dim, field, c)) < 0) continue;
        if (!keeps_planes(m, at, c)) continue;
        const double mid[3] = {0.5, 0.5, 0.5};
        each_node(g, dim, field, c, mid, [&](long n, double) {
          const int r = nodes.find(n);
          good        = good && r >= 0 && strong[r];
        });
        if (!good) continue;
        if (dist < best) chosen.clear();
        best = dist;
        chosen.push_back({{c[0], c[1], c[2]}});
      }
  const long first = static_cast<long>(out.list.item.size());
  for (const auto& c : chosen) {
    double xi[3] = {0, 0, 0};
    for (int d = 0; d < dim; ++d) xi[d] = at[d] - c[d];
    each_node(g, dim, field, c.data(), xi, [&](long n, double N) {
      const int r       = nodes.find(n);
      IntVec& to        = out.list.item;
      const size_t seen = std::find(to.begin() + first, to.end(), r) - to.begin();
      if (seen == to.size()) {
        to.push_back(r);
        out.w.push_back(0.0);
      }
      out.w[seen] += N / static_cast<double>(chosen.size());
    });
  }
  return !chosen.empty();
}

// The mean of the nearest strong nodes. For nodes with so little mass that as unknowns they would make the
// mass matrix singular to round-off; the planes of *GRID BOUNDARY do not matter for them.
bool follow_nearest(const Model& m, const std::vector<long>& key, const std::vector<char>& strong, int weak,
                    GridLists& out)
{
  const Grid& g = m.grid;
  int at[3];
  const int field = node_of_key(g, m.dim, key[weak], at), reach = 2, deep = m.dim == 3 ? reach : 0;
  int best = 1 << 20;
  IntVec chosen;
  for (int k = -deep; k <= deep; ++k)
    for (int j = -reach; j <= reach; ++j)
      for (int i = -reach; i <= reach; ++i) {
        const int to[3] = {at[0] + i, at[1] + j, at[2] + k}, dist = i * i + j * j + k * k;
        bool good = dist <= best;
        for (int d = 0; d < m.dim; ++d) good = good && to[d] >= 0 && to[d] <= g.n[d];
        const int r = good ? find_key(key, node_key(g, m.dim, field, to)) : -1;
        if (r < 0 || !strong[r]) continue;
        if (dist < best) chosen.clear();
        best = dist;
        chosen.push_back(r);
      }
  out.list.item.insert(out.list.item.end(), chosen.begin(), chosen.end());
  out.w.insert(out.w.end(), chosen.size(), 1.0 / static_cast<double>(std::max<size_t>(chosen.size(), 1)));
  return !chosen.empty();
}

// 4. number the unknown nodes and list the unknowns that each touched node follows. cell: keys of active
// cells; needed: nodes to be listed, unknowns that none of them follows are left out; empty: all
void find_extension(const Model& m, const std::vector<long>& cell, const std::vector<long>& key,
                    const std::vector<char>& strong, const RealVec& support, const std::vector<char>& needed,
                    ActiveGrid& g, GridLists& ext)
{
  const double tiny = 1e-2;    // support up to which a node is not an unknown
  const int n = static_cast<int>(key.size());
  std::vector<char> unknown = strong;
  GridLists follow;             // in the numbers of touched nodes
  const KeyTable cells(cell), nodes(key);
  for (int r = 0; r < n; ++r) {
    const bool listed = needed.empty() || needed[r];
    if (listed && !strong[r] && !extend_node(m, cells, key, nodes, strong, r, follow)) {
      ++g.nlone;
      unknown[r] = support[r] > tiny || !follow_nearest(m, key, strong, r, follow);
    }
    if (listed && unknown[r]) {
      follow.list.item.push_back(r);
      follow.w.push_back(1.0);
    }
    follow.list.off.push_back(static_cast<int>(follow.list.item.size()));
  }
  IntVec number(n, -1);
  for (int r : follow.list.item) number[r] = 0;
  g.key.clear();
  for (int r = 0; r < n; ++r)
    if (number[r] == 0 || (needed.empty() && unknown[r])) {
      number[r] = static_cast<int>(g.key.size());
      g.key.push_back(key[r]);
    }
  ext = std::move(follow);
  for (int& item : ext.list.item) item = number[item];
}

// Mesh nodes, whose keys are the last ones, are not unknowns of the grid: in the lists they become -1 - node
void name_mesh_nodes(ActiveGrid& g)
{
  const int n = static_cast<int>(std::lower_bound(g.key.begin(), g.key.end(), key_node) - g.key.begin());
  const auto name = [&](IntVec& list, std::vector<MeshItem>& mesh) {
    mesh.clear();
    mesh.reserve(std::count_if(list.begin(), list.end(), [n](int i) { return i >= n; }));
    for (int k = 0; k < static_cast<int>(list.size()); ++k) {
      if (list[k] < n) continue;
      mesh.push_back({k, static_cast<int>(g.key[list[k]] - key_node)});
      list[k] = -1 - mesh.back().node;
    }
  };
  name(g.corner.item, g.corner_mesh);
  name(g.point.item, g.point_mesh);
  g.key.resize(n);
}

// empties the grid, but keeps the numbers of its lists and weights
Status no_grid(Status status, ActiveGrid& g)
{
  const long lists = g.lists, made = g.made;
  g       = ActiveGrid();
  g.lists = lists;
  g.made  = made;
  return status;
}

// converts lists on touched nodes to lists on the unknown nodes that these follow
template <int D>
void follow_unknowns(const Points& pts, const GridShare& share, const GridLists& extend, ActiveGrid& g)
{
  const int nnode = static_cast<int>(g.key.size());
  grid_compose(extend, nnode, g.corner, g.corner_w);
  grid_compose(extend, nnode, g.bond, g.bond_w);
  grid_compose(extend, nnode, g.ghost, g.ghost_w);
  point_lists(pts, share, nnode, g);
  point_sums(pts, D, g);
}

std::vector<char> strong_nodes(const Grid& grid, const std::vector<long>& node, const RealVec& support)
{
  std::vector<char> strong(node.size());
  for (size_t r = 0; r < node.size(); ++r)
    strong[r] = node[r] >= key_own || !grid_is_weak(grid, support[r]);
  return strong;
}

// Divided model: lists on the unknowns that points, bonds and ghosts of this rank follow. The halo gives the
// support of a node, and the active cells. False: a rank has failed.
template <int D>
bool activate_part(const Model& m, const Points& pts, const GridShare& share, const RealVec& uc,
                   Status status, std::vector<long>& node, ActiveGrid& g)
{
  const bool ghosts = m.grid.ghost_stiffness > 0.0 || m.grid.ghost_mass > 0.0;
  const auto end    = std::lower_bound(node.begin(), node.end(), key_own);
  const std::vector<long> others(end, node.end());   // corner unknowns, mesh nodes
  node.erase(end, node.end());
  const int touched = static_cast<int>(node.size());
  GridHalo halo;
  const int reach = ghosts ? 2 * REACH : REACH;
  if (!grid_halo(m.grid, D, status == STATUS_OK, node, g.cell, reach, halo)) return false;
  const KeyHalo& of = halo.node;
  const int in_grid = static_cast<int>(of.key.size());
  node = of.key;
  node.insert(node.end(), others.begin(), others.end());
  for (ListTable* list : {&g.corner, &g.bond})
    for (int& item : list->item) item = item < touched ? of.here[item] : item - touched + in_grid;
  const int nnode = static_cast<int>(node.size());
  follow_corners(pts, share, nnode, g);
  point_lists(pts, share, nnode, g);
  RealVec support = point_support(pts, nnode, g);
  key_max(of, support);
  g.meets = m.grid.keep > 0.0 && points_meet(pts, share, node, g.point, &of);
  const std::vector<char> strong = strong_nodes(m.grid, node, support);
  grid_ghost(m, pts, uc, node, &halo.cell, g);
  std::vector<char> needed = of.own;
  needed.resize(nnode, 1);
  for (int r : g.ghost.item) needed[r] = 1;
  GridLists extend;
  g.nlone = 0;
  find_extension(m, halo.cell.key, node, strong, support, needed, g, extend);
  follow_unknowns<D>(pts, share, extend, g);
  std::vector<long> cell;
  for (size_t c = 0; c < halo.cell.key.size(); ++c)
    if (halo.cell.counts(static_cast<int>(c))) cell.push_back(halo.cell.key[c]);
  g.cell.swap(cell);
  double sum[3] = {0.0, 0.0, static_cast<double>(g.cell.size())};
  for (int r = 0; r < nnode; ++r) {
    if (r < in_grid ? !of.counts(r)
                    : node[r] >= key_node || share.owner[grid_corner(pts, node[r])] != comm_rank())
      continue;
    sum[0] += find_key(g.key, node[r]) >= 0;
    sum[1] += !strong[r];
  }
  comm_sum(sum, 3);
  name_mesh_nodes(g);
  g.of_all = {static_cast<int>(sum[0]), static_cast<int>(sum[2]), static_cast<int>(sum[1])};
  return true;
}

// this rank stores all points
template <int D>
void activate_all(const Model& m, const Points& pts, const RealVec& uc, std::vector<long>& node,
                  ActiveGrid& g)
{
  const GridShare all;
  follow_corners(pts, all, static_cast<int>(node.size()), g);
  point_lists(pts, all, static_cast<int>(node.size()), g);
  const RealVec support = point_support(pts, static_cast<int>(node.size()), g);
  g.meets = m.grid.keep > 0.0 && points_meet(pts, all, node, g.point, nullptr);
  const std::vector<char> strong = strong_nodes(m.grid, node, support);
  const int weak = static_cast<int>(std::count(strong.begin(), strong.end(), 0));
  g.nlone = 0;
  grid_ghost(m, pts, uc, node, nullptr, g);
  if (weak == 0) {             // touched nodes are the unknowns
    point_sums(pts, D, g);
    g.key.swap(node);
  } else {
    GridLists extend;
    find_extension(m, g.cell, node, strong, support, {}, g, extend);
    follow_unknowns<D>(pts, all, extend, g);
  }
  name_mesh_nodes(g);
  g.of_all = {static_cast<int>(g.key.size()), static_cast<int>(g.cell.size()), weak};
}

template <int D>
Status activate(const Model& m, const Points& pts, const Bonds& bonds, const GridShare& share,
                const RealVec& uc, const RealVec& xb, ActiveGrid& g, int* worst)
{
  std::vector<long> node;
  const Status status = touch<D>(m, pts, bonds, share, uc, xb, node, g, worst);
  if (share.on) {
    if (!activate_part<D>(m, pts, share, uc, status, node, g)) return no_grid(status, g);
  } else {
    if (status != STATUS_OK) return no_grid(status, g);
    activate_all<D>(m, pts, uc, node, g);
  }
  for (IntVec* x : {&g.corner.item, &g.point.item, &g.slot}) give_back(*x);
  give_back(g.corner_w);
  ++g.lists;
  g.nnode = static_cast<int>(g.key.size());
  g.ncell = static_cast<int>(g.cell.size());
  return STATUS_OK;
}

}  // namespace

long grid_nodes(const Grid& g, int dim)
{
  return (g.n[0] + 1L) * (g.n[1] + 1L) * (dim == 3 ? g.n[2] + 1L : 1L);
}

long grid_cells(const Grid& g, int dim)
{
  return static_cast<long>(g.n[0]) * g.n[1] * (dim == 3 ? g.n[2] : 1);
}

void grid_node_position(const Grid& g, int dim, long key, double x[3])
{
  if (key >= key_own) {
    x[0] = x[1] = x[2] = 1e300;
    return;
  }
  int at[3];
  node_of_key(g, dim, key, at);
  for (int i = 0; i < 3; ++i) x[i] = i < dim ? g.lo[i] + g.h[i] * at[i] : 0.0;
}

void grid_unknown_position(const Model& m, const Points& pts, const RealVec& uc, const ActiveGrid& g,
                           int node, double x[3])
{
  grid_node_position(m.grid, m.dim, g.key[node], x);
  const int c = grid_corner(pts, g.key[node]);
  if (c < 0 || pts.field[c] == FIELD_OWN) return;
  for (int i = 0; i < 3; ++i) x[i] = i < m.dim ? pts.Xc[c * m.dim + i] + uc[c * m.dim + i] : 0.0;
}

void grid_cell_position(const Grid& g, int dim, long key, double x[3])
{
  int at[3];
  cell_of_key(g, dim, key, at);
  for (int i = 0; i < 3; ++i) x[i] = i < dim ? g.lo[i] + g.h[i] * at[i] : 0.0;
}

bool grid_stays(const Model& m, const Points& pts, const Bonds& bonds, const GridLaid& laid, bool meets,
                const RealVec& uc, const RealVec& xb)
{
  const int dim = m.dim;
  // in free flight the distance can equal KEEP exactly: the tolerance keeps round-off from deciding
  const double max_way = m.grid.keep * (meets ? KEEP_OF_MEETING : 1.0) * (1.0 + 1e-9);       // in cells
  if (laid.uc.size() != uc.size() || laid.xb.size() != xb.size()) return false;
  const auto stays = [&](const double* from, const double* to) {
    double way = 0.0;
    for (int i = 0; i < dim; ++i) way += std::fabs(to[i] - from[i]) / m.grid.h[i];
    return way <= max_way;
  };
  const auto carried = [&](int c) { return pts.field[c] >= 0 && pts.carrier(c) == HANG_GRID; };
  if (m.grid.keep == 0.0) return false;
  for (int c = 0; c < pts.ncorner; ++c)
    if (!stays(&laid.uc[c * dim], &uc[c * dim]) && carried(c)) return false;
  for (int b = 0; b < bonds.nbond; ++b)
    if (bonds.field[b] >= 0 && !stays(&laid.xb[b * dim], &xb[b * dim])) return false;
  return true;
}

bool grid_covers(const Points& pts, const Bonds& bonds, const GridShare& share, const ActiveGrid& g)
{
  if (!share.on) return true;
  const auto has = [](const ListTable& lists, int i) { return lists.count(i) > 0; };
  for (int p = 0; p < pts.npoint; ++p)
    if ((share.point[p] != 0) != has(g.point, p)) return false;
  for (int c = 0; c < pts.ncorner; ++c)
    if ((share.corner[c] != 0) != has(g.corner, c)) return false;
  for (int b = 0; b < bonds.nbond; ++b)
    if ((share.bond[b] && bonds.field[b] >= 0) != has(g.bond, b)) return false;
  return true;
}

Status grid_activate(const Model& m, const Points& pts, const Bonds& bonds, const GridShare& share,
                     const RealVec& uc, const RealVec& xb, ActiveGrid& g, int* worst)
{
  ++g.made;
  return m.dim == 2 ? activate<2>(m, pts, bonds, share, uc, xb, g, worst)
                    : activate<3>(m, pts, bonds, share, uc, xb, g, worst);
}

void point_copy_corners(const Points& pts, int dim, const std::vector<RealVec*>& x)
{
  if (!pts.part.lone_corners) return;
  for (RealVec* v : x) halo_numbers(pts.part.halo, dim, *v);      // one by one: the messages are long
}
