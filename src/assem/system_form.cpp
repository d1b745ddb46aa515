#include <algorithm>

#include "assem/assem.h"
#include "base/timer.h"

namespace {

// rows of finite-element nodes: those of an element that is still one
void number_nodes(Problem& p)
{
  System& s = p.sys;
  const Mesh& mesh = p.m.mesh;
  if (s.numbered) return;
  s.numbered = true;
  s.row_of_node.assign(mesh.nnode(), -1);
  s.node_of_row.clear();
  for (const ElemBlock& b : p.el.block)
    for (int slot : b.live)
      for (int k = mesh.conn.off[b.elem[slot]]; k < mesh.conn.off[b.elem[slot] + 1]; ++k) s.row_of_node[mesh.conn.item[k]] = 0;
  s.nfe = 0;
  for (int n = 0; n < mesh.nnode(); ++n)
    if (s.row_of_node[n] == 0) {
      s.row_of_node[n] = s.nfe++;
      s.node_of_row.push_back(n);
    }
}

// rows and weights of one bond: side A positive, side B negative, equal rows summed
void bond_rows(const Problem& p, int b, IntVec& row, RealVec& w)
{
  const System& s = p.sys;
  const Bonds& bonds = p.st.bonds;
  const int nnode = p.m.mesh.nnode();
  row.clear();
  w.clear();
  auto add = [&](int r, double value) {
    for (size_t i = 0; i < row.size(); ++i)
      if (row[i] == r) { w[i] += value; return; }
    row.push_back(r);
    w.push_back(value);
  };
  auto add_kin = [&](int kin, double value) {
    if (kin < nnode) {
      if (s.row_of_node[kin] >= 0) add(s.row_of_node[kin], value);
      return;
    }
    const int c = kin - nnode;
    for (int j = p.grid.corner.off[c]; j < p.grid.corner.off[c + 1]; ++j)
      add(s.nfe + p.grid.corner.item[j], value * p.grid.corner_w[j]);
  };
  if (bonds.field[b] == SIDE_CONTACT && !p.pairs.master.count(b)) return;     // nothing near
  for (int k = bonds.a.off[b]; k < bonds.a.off[b + 1]; ++k) add_kin(bonds.a.item[k], bonds.a_w[k]);
  if (bonds.field[b] == SIDE_CONTACT)
    for (int k = p.pairs.master.off[b]; k < p.pairs.master.off[b + 1]; ++k)
      add_kin(p.pairs.master.item[k], -p.pairs.master_w[k]);
  for (int j = p.grid.bond.off[b]; j < p.grid.bond.off[b + 1]; ++j)
    add(s.nfe + p.grid.bond.item[j], -p.grid.bond_w[j]);
}

void form_lists(Problem& p)
{
  System& s = p.sys;
  s.nrow = s.nfe + p.grid.nnode;
  s.row_key.assign(s.node_of_row.begin(), s.node_of_row.end());
  for (long key : p.grid.key) s.row_key.push_back(-1 - key);
  s.bond = ListTable();
  s.bond_w.clear();
  IntVec row;
  RealVec w;
  for (int b = 0; b < p.st.bonds.nbond; ++b) {
    bond_rows(p, b, row, w);
    s.bond.item.insert(s.bond.item.end(), row.begin(), row.end());
    s.bond_w.insert(s.bond_w.end(), w.begin(), w.end());
    s.bond.off.push_back(static_cast<int>(s.bond.item.size()));
  }
}

bool same(const ListTable& a, const ListTable& b) { return a.off == b.off && a.item == b.item; }

// calls use(n, rows) for every element, point and bond, in that order
template <class Use>
void each_list(const Problem& p, Use use)
{
  const System& s = p.sys;
  IntVec row;
  for (const ElemBlock& b : p.el.block)
    for (int slot : b.live) {
      const int e = b.elem[slot];
      row.clear();
      for (int k = p.m.mesh.conn.off[e]; k < p.m.mesh.conn.off[e + 1]; ++k)
        row.push_back(s.row_of_node[p.m.mesh.conn.item[k]]);
      use(static_cast<int>(row.size()), row.data());
    }
  for (int q = 0; q < p.st.points.npoint; ++q) {
    row.clear();
    for (int k = p.grid.point.off[q]; k < p.grid.point.off[q + 1]; ++k) row.push_back(s.nfe + p.grid.point.item[k]);
    use(static_cast<int>(row.size()), row.data());
  }
  for (int b = 0; b < s.bond.size(); ++b) use(s.bond.count(b), s.bond.begin(b));
}

// block pattern: lower triangle, rows sorted, the diagonal last
void form_pattern(Problem& p)
{
  System& s = p.sys;
  // rows -> lists that hold them
  IntVec count(s.nrow + 1, 0);
  ListTable lists;
  each_list(p, [&](int n, const int* row) {
    lists.item.insert(lists.item.end(), row, row + n);
    lists.off.push_back(static_cast<int>(lists.item.size()));
    for (int a = 0; a < n; ++a) ++count[row[a] + 1];
  });
  for (int r = 0; r < s.nrow; ++r) count[r + 1] += count[r];
  IntVec holder(lists.item.size()), next(count.begin(), count.end() - 1);
  for (int l = 0; l < lists.size(); ++l)
    for (int k = lists.off[l]; k < lists.off[l + 1]; ++k) holder[next[lists.item[k]]++] = l;

  s.A = SysMatrix();
  s.A.dim  = s.dim;
  s.A.nrow = s.nrow;
  s.A.off.assign(1, 0);
  IntVec stamp(s.nrow, -1);
  for (int r = 0; r < s.nrow; ++r) {
    const size_t first = s.A.col.size();
    stamp[r] = r;
    for (int h = count[r]; h < count[r + 1]; ++h)
      for (int k = lists.off[holder[h]]; k < lists.off[holder[h] + 1]; ++k) {
        const int c = lists.item[k];
        if (c >= r || stamp[c] == r) continue;
        stamp[c] = r;
        s.A.col.push_back(c);
      }
    std::sort(s.A.col.begin() + static_cast<long>(first), s.A.col.end());
    s.A.col.push_back(r);
    s.A.off.push_back(static_cast<int>(s.A.col.size()));
  }
  s.A.val.assign(s.A.col.size() * s.dim * s.dim, 0.0);
}

int block_place(const SysMatrix& A, int r, int c)
{
  const auto first = A.col.begin() + A.off[r], last = A.col.begin() + A.off[r + 1];
  return static_cast<int>(std::lower_bound(first, last, c) - A.col.begin());
}

// where every node pair goes
void form_maps(Problem& p)
{
  System& s = p.sys;
  size_t nelem = 0, list = 0;
  for (const ElemBlock& b : p.el.block) nelem += b.live.size();
  const size_t npoint = p.st.points.npoint;
  s.elem_map.clear();
  s.point_map.clear();
  s.bond_map.clear();
  s.point_map_off.assign(1, 0);
  s.bond_map_off.assign(1, 0);
  each_list(p, [&](int n, const int* row) {
    IntVec& map = list < nelem ? s.elem_map : list < nelem + npoint ? s.point_map : s.bond_map;
    for (int a = 0; a < n; ++a)
      for (int b = 0; b <= a; ++b)
        map.push_back(row[a] >= row[b] ? 2 * block_place(s.A, row[a], row[b])
                                       : 2 * block_place(s.A, row[b], row[a]) + 1);
    if (list >= nelem + npoint) s.bond_map_off.push_back(map.size());
    else if (list >= nelem) s.point_map_off.push_back(map.size());
    ++list;
  });
}

// M_vw = sum_cd m_cd N_v(x_c) N_w(x_d) over the corners of each point                (3.12)
void add_point_mass(Problem& p)
{
  System& s = p.sys;
  const ActiveGrid& g = p.grid;
  const Points& pts   = p.st.points;
  RealVec N, mN;               // [nen][n]: weights of the corners on the nodes of the point, m_c times them
  const double* mc = pts.mc.data();
  for (int q = 0; q < pts.npoint; ++q) {
    const int n = g.point.count(q), nen = pts.conn.count(q), *list = g.point.begin(q);
    N.assign(static_cast<size_t>(nen) * n, 0.0);
    mN.assign(static_cast<size_t>(nen) * n, 0.0);
    for (int c = 0; c < nen; ++c) {
      const int corner = pts.conn.begin(q)[c];
      for (int k = g.corner.off[corner]; k < g.corner.off[corner + 1]; ++k)
        N[c * n + (std::find(list, list + n, g.corner.item[k]) - list)] = g.corner_w[k];
    }
    for (int c = 0; c < nen; ++c)
      for (int d = 0; d < nen; ++d) {
        const double m = mc[c >= d ? pair_place(c, d) : pair_place(d, c)];
        for (int a = 0; a < n; ++a) mN[c * n + a] += m * N[d * n + a];
      }
    mc += pair_count(nen);
    size_t k = s.point_map_off[q];
    for (int a = 0; a < n; ++a)
      for (int b = 0; b <= a; ++b) {
        double sum = 0.0;
        for (int c = 0; c < nen; ++c) sum += N[c * n + a] * mN[c * n + b];
        s.M[s.point_map[k++] / 2] += sum;
      }
  }
}

void form_mass(Problem& p)
{
  System& s = p.sys;
  s.M.assign(s.A.col.size(), 0.0);
  size_t at = 0;
  double me[36];
  for (const ElemBlock& b : p.el.block) {
    const int pairs = pair_count(shape_info[b.shape].nen);
    for (int slot : b.live) {
      elem_mass(p.m, b, slot, me);
      for (int k = 0; k < pairs; ++k) s.M[s.elem_map[at++] / 2] += me[k];
    }
  }
  add_point_mass(p);
}

void mean_size(Problem& p)
{
  double volume = 0.0;
  size_t count = 0;
  for (const ElemBlock& b : p.el.block) {
    for (double w : b.w) volume += w / (p.m.dim == 2 ? b.thickness : 1.0);
    count += b.elem.size();
  }
  p.sys.h_mean = count ? (p.m.dim == 2 ? __builtin_sqrt(volume / count) : __builtin_cbrt(volume / count))
                       : p.m.grid.h[0];
}

}  // namespace

void system_form(Problem& p, bool mass)
{
  System& s = p.sys;
  const bool first = !s.numbered;
  s.dim = p.m.dim;
  number_nodes(p);
  form_lists(p);
  bool fresh = first || s.A.nrow != s.nrow;
  fresh = fresh || !same(s.point_rows, p.grid.point) || !same(s.bond_rows, s.bond);
  if (fresh) {
    Timer timer(PHASE_PATTERN);
    ++s.pattern;
    form_pattern(p);
    form_maps(p);
    s.point_rows = p.grid.point;
    s.bond_rows  = s.bond;
    s.M.clear();
    if (s.h_mean == 0.0) mean_size(p);
  }
  if (mass && (fresh || p.st.points.npoint || s.M.size() != s.A.col.size())) {
    Timer timer(PHASE_MASS);
    form_mass(p);
  }
}
