#include <algorithm>
#include <array>
#include <cmath>

#include "point/point.h"

namespace {

const double snap = 1e-12;     // a place this close to a cell face, in cells, lies on it
const double rim  = 1e-9;      // a place this far outside the grid, in cells, lies on its boundary

// where a place lies in the grid: cell and local place 0 ... 1
struct Spot {
  int cell[3] = {0, 0, 0};
  double xi[3] = {0, 0, 0};
};

bool locate(const Grid& g, int dim, const double* x, Spot& s)
{
  for (int i = 0; i < dim; ++i) {
    const double t = (x[i] - g.lo[i]) / g.h[i];
    if (!(t > -rim && t < g.n[i] + rim)) return false;
    int c     = static_cast<int>(std::floor(t));
    double xi = t - c;
    if (xi < snap) xi = 0.0;
    if (xi > 1.0 - snap) { ++c; xi = 0.0; }
    if (c < 0) { c = 0; xi = 0.0; }
    if (c >= g.n[i]) { c = g.n[i] - 1; xi = 1.0; }
    s.cell[i] = c;
    s.xi[i]   = xi;
  }
  return true;
}

long node_key(const Grid& g, int dim, int field, const int* at)
{
  const long node = at[0] + (g.n[0] + 1L) * (at[1] + (dim == 3 ? (g.n[1] + 1L) * at[2] : 0L));
  return field * grid_nodes(g, dim) + node;
}

long cell_key(const Grid& g, int dim, int field, const int* at)
{
  const long cell = at[0] + static_cast<long>(g.n[0]) * (at[1] + (dim == 3 ? static_cast<long>(g.n[1]) * at[2] : 0L));
  return field * grid_cells(g, dim) + cell;
}

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

// touched grid nodes before the extended basis: keys, and lists of corners and bonds on them
struct Raw {
  std::vector<long> key;
  ListTable corner, bond;
  RealVec corner_w, bond_w;
  RealVec support;             // max_p S_pv
};

int find_key(const std::vector<long>& sorted, long key)
{
  const auto it = std::lower_bound(sorted.begin(), sorted.end(), key);
  return it != sorted.end() && *it == key ? static_cast<int>(it - sorted.begin()) : -1;
}

void sort_unique(std::vector<long>& v)
{
  std::sort(v.begin(), v.end());
  v.erase(std::unique(v.begin(), v.end()), v.end());
}

// The different keys of a list, ascending, and their numbers. Keys that lie close together are counted in a table over their
// range, which is faster than sorting them.
struct KeyNumbers {
  std::vector<long> key;
  long low = 0;
  IntVec number;               // of low, low + 1, ...; empty: look it up in key
  int of(long k) const { return number.empty() ? find_key(key, k) : number[k - low]; }
};

KeyNumbers number_keys(const std::vector<long>& all)
{
  KeyNumbers out;
  if (all.empty()) return out;
  const auto ends  = std::minmax_element(all.begin(), all.end());
  const long range = *ends.second - *ends.first + 1;
  out.low = *ends.first;
  if (range > 8 * static_cast<long>(all.size())) {
    out.key = all;
    sort_unique(out.key);
    return out;
  }
  out.number.assign(range, -1);
  for (long k : all) out.number[k - out.low] = 0;
  for (long i = 0; i < range; ++i) {
    if (out.number[i] < 0) continue;
    out.number[i] = static_cast<int>(out.key.size());
    out.key.push_back(out.low + i);
  }
  return out;
}

// 1. cells and nodes under every corner and bond
Status touch(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& uc, const RealVec& xb,
             Raw& raw, ActiveGrid& g, int* worst)
{
  const Grid& grid = m.grid;
  std::vector<long> corner_key, bond_key;
  Spot s;
  auto add = [&](const double* x, int field, ListTable& list, RealVec& w, std::vector<long>& keys) {
    if (!locate(grid, m.dim, x, s)) return false;
    each_node(grid, m.dim, field, s.cell, s.xi, [&](long key, double N) {
      keys.push_back(key);
      w.push_back(N);
    });
    list.off.push_back(static_cast<int>(w.size()));
    return true;
  };
  double x[3];
  std::vector<char> owned(pts.ncorner, 0);           // points that came off have left corners behind
  for (int c : pts.conn.item) owned[c] = 1;
  for (int c = 0; c < pts.ncorner; ++c) {
    if (!owned[c]) {
      raw.corner.off.push_back(static_cast<int>(raw.corner_w.size()));
      continue;
    }
    if (pts.field[c] == FIELD_OWN) {
      corner_key.push_back(key_own + c);
      raw.corner_w.push_back(1.0);
      raw.corner.off.push_back(static_cast<int>(raw.corner_w.size()));
      continue;
    }
    for (int i = 0; i < m.dim; ++i) x[i] = pts.Xc[c * m.dim + i] + uc[c * m.dim + i];
    if (!add(x, pts.field[c], raw.corner, raw.corner_w, corner_key)) {
      *worst = c;
      return OUTSIDE_GRID;
    }
    bool inside = true;        // a corner on a cell face leaves open which cell it is in
    for (int i = 0; i < m.dim; ++i) inside = inside && s.xi[i] > 0.0 && s.xi[i] < 1.0;
    if (inside) g.cell.push_back(cell_key(grid, m.dim, pts.field[c], s.cell));
  }
  for (int b = 0; b < bonds.nbond; ++b) {
    if (bonds.field[b] < 0) {
      raw.bond.off.push_back(static_cast<int>(raw.bond_w.size()));
      continue;
    }
    if (!add(&xb[b * m.dim], bonds.field[b], raw.bond, raw.bond_w, bond_key)) {
      *worst = -1 - b;
      return OUTSIDE_GRID;
    }
  }
  for (int p = 0; p < pts.npoint; ++p) {
    if (pts.loose[p]) continue;
    for (double& xi : x) xi = 0.0;
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k)
      for (int i = 0; i < m.dim; ++i) {
        const int dof = pts.conn.item[k] * m.dim + i;
        x[i] += pts.w[k] * (pts.Xc[dof] + uc[dof]);
      }
    if (locate(grid, m.dim, x, s)) g.cell.push_back(cell_key(grid, m.dim, pts.field[pts.conn.begin(p)[0]], s.cell));
  }
  g.cell = number_keys(g.cell).key;
  const size_t ncorner_key = corner_key.size();
  corner_key.insert(corner_key.end(), bond_key.begin(), bond_key.end());
  const KeyNumbers numbers = number_keys(corner_key);
  raw.key = numbers.key;
  for (size_t i = 0; i < corner_key.size(); ++i) (i < ncorner_key ? raw.corner : raw.bond).item.push_back(numbers.of(corner_key[i]));
  return STATUS_OK;
}

// sums weights by node, in the order of first sight
struct Gather {
  IntVec stamp, place;
  int now = 0;
  IntVec node;
  RealVec value;               // [node]
  void start(int nnode)
  {
    if (static_cast<int>(stamp.size()) < nnode) {
      stamp.assign(nnode, 0);
      place.assign(nnode, 0);
      now = 0;
    }
    ++now;
    node.clear();
    value.clear();
  }
  double& at(int n)
  {
    if (stamp[n] != now) {
      stamp[n] = now;
      place[n] = static_cast<int>(node.size());
      node.push_back(n);
      value.push_back(0.0);
    }
    return value[place[n]];
  }
};

// 2. how well each node is supported: max_p S_pv
void find_support(const Points& pts, Raw& raw)
{
  Gather sum;
  raw.support.assign(raw.key.size(), 0.0);
  for (int p = 0; p < pts.npoint; ++p) {
    sum.start(static_cast<int>(raw.key.size()));
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) {
      const int c = pts.conn.item[k];
      for (int j = raw.corner.off[c]; j < raw.corner.off[c + 1]; ++j)
        sum.at(raw.corner.item[j]) += pts.w[k] * raw.corner_w[j];
    }
    for (size_t i = 0; i < sum.node.size(); ++i)
      raw.support[sum.node[i]] = std::max(raw.support[sum.node[i]], sum.value[i]);
  }
}

// what a touched node follows: strong nodes and weights
struct Extend {
  ListTable to;
  RealVec w;
};

// does a cell c touch all planes of *GRID BOUNDARY that the node lies on? Then the node follows nodes of the plane alone,
// and what is prescribed there holds for it too
bool keeps_planes(const Model& m, const int* at, const int* c)
{
  for (const GridBc& b : m.grid_bc) {
    const Grid& g = m.grid;
    const double plane = (b.position - g.lo[b.axis]) / g.h[b.axis];
    if (std::fabs(plane - at[b.axis]) < 1e-6 && c[b.axis] != at[b.axis] && c[b.axis] != at[b.axis] - 1) return false;
  }
  return true;
}

// 3. the nearest cells whose nodes are all strong; ties share
bool extend_node(const Model& m, const std::vector<long>& cells, const std::vector<long>& key,
                 const std::vector<char>& strong, int weak, Gather& out)
{
  const Grid& g   = m.grid;
  const int dim   = m.dim;
  const long nn   = grid_nodes(g, dim);
  const int field = static_cast<int>(key[weak] / nn);
  long rest = key[weak] % nn;
  int at[3] = {0, 0, 0};
  at[0] = static_cast<int>(rest % (g.n[0] + 1));
  rest /= g.n[0] + 1;
  at[1] = static_cast<int>(dim == 3 ? rest % (g.n[1] + 1) : rest);
  if (dim == 3) at[2] = static_cast<int>(rest / (g.n[1] + 1));

  const int reach = 2;         // cells between the node and the cell it may follow
  double best = 1e30;
  std::vector<std::array<int, 3>> chosen;
  for (int k = dim == 3 ? -reach - 1 : 0; k <= (dim == 3 ? reach : 0); ++k)
    for (int j = -reach - 1; j <= reach; ++j)
      for (int i = -reach - 1; i <= reach; ++i) {
        const int c[3] = {at[0] + i, at[1] + j, at[2] + k};
        bool good = true;
        for (int d = 0; d < dim; ++d) good = good && c[d] >= 0 && c[d] < g.n[d];
        if (!good || find_key(cells, cell_key(g, dim, field, c)) < 0) continue;
        const double dist = (i + 0.5) * (i + 0.5) + (j + 0.5) * (j + 0.5) + (dim == 3 ? (k + 0.5) * (k + 0.5) : 0.0);
        if (dist > best || !keeps_planes(m, at, c)) continue;
        const double mid[3] = {0.5, 0.5, 0.5};
        each_node(g, dim, field, c, mid, [&](long n, double) {
          const int r = find_key(key, n);
          good        = good && r >= 0 && strong[r];
        });
        if (!good) continue;
        if (dist < best) chosen.clear();
        best = dist;
        chosen.push_back({{c[0], c[1], c[2]}});
      }
  out.start(static_cast<int>(key.size()));
  for (const auto& c : chosen) {
    double xi[3] = {0, 0, 0};
    for (int d = 0; d < dim; ++d) xi[d] = at[d] - c[d];
    each_node(g, dim, field, c.data(), xi,
              [&](long n, double N) { out.at(find_key(key, n)) += N / static_cast<double>(chosen.size()); });
  }
  return !chosen.empty();
}

// 4. number the unknown nodes and say what each touched node follows
void find_extension(const Model& m, const Raw& raw, ActiveGrid& g, Extend& ext)
{
  const int n = static_cast<int>(raw.key.size());
  std::vector<char> strong(n), unknown;
  for (int r = 0; r < n; ++r) strong[r] = raw.key[r] >= key_own || (raw.support[r] >= m.grid.weak && raw.support[r] > 0.0);
  unknown = strong;
  ListTable follow;            // of weak nodes, in raw numbers
  RealVec follow_w;
  Gather out;
  g.nweak = g.nlone = 0;
  for (int r = 0; r < n; ++r) {
    if (!strong[r]) {
      ++g.nweak;
      if (extend_node(m, g.cell, raw.key, strong, r, out)) {
        follow.item.insert(follow.item.end(), out.node.begin(), out.node.end());
        follow_w.insert(follow_w.end(), out.value.begin(), out.value.end());
      } else {
        ++g.nlone;
        unknown[r] = 1;
      }
    }
    follow.off.push_back(static_cast<int>(follow.item.size()));
  }
  IntVec number(n, -1);
  for (int r = 0; r < n; ++r)
    if (unknown[r]) {
      number[r] = static_cast<int>(g.key.size());
      g.key.push_back(raw.key[r]);
    }
  g.nnode = static_cast<int>(g.key.size());
  for (int r = 0; r < n; ++r) {
    if (unknown[r]) {
      ext.to.item.push_back(number[r]);
      ext.w.push_back(1.0);
    } else {
      for (int k = follow.off[r]; k < follow.off[r + 1]; ++k) {
        ext.to.item.push_back(number[follow.item[k]]);
        ext.w.push_back(follow_w[k]);
      }
    }
    ext.to.off.push_back(static_cast<int>(ext.to.item.size()));
  }
}

// lists on touched nodes -> lists on unknown nodes
void compose(const ListTable& raw, const RealVec& raw_w, const Extend& ext, int nnode, ListTable& out, RealVec& out_w)
{
  Gather sum;
  for (int i = 0; i < raw.size(); ++i) {
    sum.start(nnode);
    for (int k = raw.off[i]; k < raw.off[i + 1]; ++k)
      for (int j = ext.to.off[raw.item[k]]; j < ext.to.off[raw.item[k] + 1]; ++j)
        sum.at(ext.to.item[j]) += raw_w[k] * ext.w[j];
    out.item.insert(out.item.end(), sum.node.begin(), sum.node.end());
    out_w.insert(out_w.end(), sum.value.begin(), sum.value.end());
    out.off.push_back(static_cast<int>(out.item.size()));
  }
}

// 5. nodes of every point, in the order in which its corners name them
void point_lists(const Points& pts, ActiveGrid& g)
{
  IntVec stamp(g.nnode, -1);
  for (int p = 0; p < pts.npoint; ++p) {
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) {
      const int c = pts.conn.item[k];
      for (int j = g.corner.off[c]; j < g.corner.off[c + 1]; ++j) {
        if (stamp[g.corner.item[j]] == p) continue;
        stamp[g.corner.item[j]] = p;
        g.point.item.push_back(g.corner.item[j]);
      }
    }
    g.point.off.push_back(static_cast<int>(g.point.item.size()));
  }
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

void grid_node_place(const Grid& g, int dim, long key, double x[3])
{
  if (key >= key_own) {
    x[0] = x[1] = x[2] = 1e300;
    return;
  }
  long rest = key % grid_nodes(g, dim);
  x[2] = 0.0;
  for (int i = 0; i < dim; ++i) {
    x[i] = g.lo[i] + g.h[i] * static_cast<double>(rest % (g.n[i] + 1));
    rest /= g.n[i] + 1;
  }
}

void grid_cell_place(const Grid& g, int dim, long key, double x[3])
{
  long rest = key % grid_cells(g, dim);
  x[2] = 0.0;
  for (int i = 0; i < dim; ++i) {
    x[i] = g.lo[i] + g.h[i] * static_cast<double>(rest % g.n[i]);
    rest /= g.n[i];
  }
}

Status grid_activate(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& uc, const RealVec& xb,
                     ActiveGrid& g, int* worst)
{
  g = ActiveGrid();
  Raw raw;
  Extend ext;
  const Status status = touch(m, pts, bonds, uc, xb, raw, g, worst);
  if (status != STATUS_OK) return status;
  find_support(pts, raw);
  find_extension(m, raw, g, ext);
  compose(raw.corner, raw.corner_w, ext, g.nnode, g.corner, g.corner_w);
  compose(raw.bond, raw.bond_w, ext, g.nnode, g.bond, g.bond_w);
  point_lists(pts, g);
  g.ncell = static_cast<int>(g.cell.size());
  return STATUS_OK;
}

// ---------------------------------------------------------------------------
// grid_gradients : dS_pv/dX = sum_c G_pc N_v(x_c) of some points from their corners                             (3.7)
// ---------------------------------------------------------------------------
void grid_gradients(const Points& pts, int dim, const IntVec& list, ActiveGrid& g)
{
  g.dS.assign(g.point.item.size() * dim, 0.0);
  IntVec place(g.nnode);                 // of a node in the list of the point at hand
  for (int p : list) {
    for (int a = g.point.off[p]; a < g.point.off[p + 1]; ++a) place[g.point.item[a]] = a;
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) {
      const int c = pts.conn.item[k];
      for (int j = g.corner.off[c]; j < g.corner.off[c + 1]; ++j) {
        double* dS = &g.dS[static_cast<size_t>(place[g.corner.item[j]]) * dim];
        for (int i = 0; i < dim; ++i) dS[i] += pts.G[k * dim + i] * g.corner_w[j];
      }
    }
  }
}
