#include <algorithm>

#include "assem/assem.h"
#include "base/comm.h"
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

// rows that each rank adds to: those of what it works on, and its own
void form_rows(const IntVec& item, SysMatrix& A)
{
  std::vector<char> in(A.nrow, 0);
  for (int I : item) in[I] = 1;
  IntVec row;
  for (int I = 0; I < A.nrow; ++I)
    if (in[I] || A.owner[I] == comm_rank()) row.push_back(I);
  A.rows = RowSets();
  for (const IntVec& of : comm_exchange(std::vector<IntVec>(comm_size(), row))) rows_add(of, A.rows);
}

// pattern of what this rank works on
void form_pattern(Problem& p)
{
  System& s = p.sys;
  ListTable lists;
  system_lists(p, false, [&](int n, const int* row) {
    lists.item.insert(lists.item.end(), row, row + n);
    lists.off.push_back(static_cast<int>(lists.item.size()));
  });
  sys_pattern(lists, s.nrow, s.dim, s.A);
  s.A.owner = s.owner;
  if (sys_shared(s.A)) form_rows(lists.item, s.A);
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
  for (const ElemBlock& b : p.el.block) nelem += b.mine.size();
  const size_t npoint = s.my_point.size();
  s.elem_map.clear();
  s.point_map.clear();
  s.bond_map.clear();
  s.point_map_off.assign(1, 0);
  s.bond_map_off.assign(1, 0);
  system_lists(p, false, [&](int n, const int* row) {
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
  int at = 0;                  // point that mc stands at
  for (size_t own = 0; own < s.my_point.size(); ++own) {
    const int q = s.my_point[own];
    for (; at < q; ++at) mc += pair_count(pts.conn.count(at));
    const int n = g.point.count(q), nen = pts.conn.count(q), *list = g.point.begin(q);
    N.assign(static_cast<size_t>(nen) * n, 0.0);
    mN.assign(static_cast<size_t>(nen) * n, 0.0);
    for (int c = 0; c < nen; ++c) {
      const int corner = pts.conn.begin(q)[c];
      for (int j = g.corner.off[corner]; j < g.corner.off[corner + 1]; ++j)
        N[c * n + (std::find(list, list + n, g.corner.item[j]) - list)] = g.corner_w[j];
    }
    for (int c = 0; c < nen; ++c)
      for (int d = 0; d < nen; ++d) {
        const double m = mc[c >= d ? pair_place(c, d) : pair_place(d, c)];
        for (int a = 0; a < n; ++a) mN[c * n + a] += m * N[d * n + a];
      }
    size_t k = s.point_map_off[own];
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
  for (const ElemBlock& b : p.el.block) {
    const int pairs = pair_count(shape_info[b.shape].nen);
    for (int slot : b.mine) {
      const double* me = elem_mass(b, slot);
      for (int k = 0; k < pairs; ++k) s.M[s.elem_map[at++] / 2] += me[k];
    }
  }
  add_point_mass(p);
  s.M_diag.resize(s.nrow);
  for (int r = 0; r < s.nrow; ++r) s.M_diag[r] = s.M[s.A.off[r + 1] - 1];
  sys_sum(s.A, s.M_diag);
}

void mean_size(Problem& p)
{
  double volume = 0.0;
  size_t count = 0;
  for (const ElemBlock& b : p.el.block) {
    const int ngp = shape_info[b.shape].ngp;
    for (size_t slot = 0; slot < b.elem.size(); ++slot)
      for (int g = 0; g < ngp; ++g) volume += b.w[b.gauss(slot) + g] / (p.m.dim == 2 ? b.thickness : 1.0);
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
  fresh = system_divide(p, fresh) || fresh;
  if (p.st.points.npoint) grid_gradients(p.st.points, s.dim, s.my_point, p.grid);
  if (fresh) {
    Timer timer(PHASE_PATTERN);
    ++s.pattern;
    form_pattern(p);
    form_maps(p);
    s.point_rows = p.grid.point;
    s.bond_rows  = s.bond;
    s.M.clear();
    if (s.h_mean == 0.0) mean_size(p);
  } else {
    timer_skip(PHASE_PATTERN);
  }
  if (mass && (fresh || p.st.points.npoint || s.M.size() != s.A.col.size())) {
    Timer timer(PHASE_MASS);
    form_mass(p);
  } else {
    timer_skip(PHASE_MASS);
  }
}
