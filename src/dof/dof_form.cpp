#include <algorithm>

#include "base/comm.h"
#include "base/far_first.h"
#include "base/gather_lists.h"
#include "base/grow.h"
#include "base/sort_once.h"
#include "base/timer.h"
#include "dof/dof.h"

namespace {

// elements around each node, of those that still are elements
ListTable elements_around(const Mesh& mesh, const Elements& el)
{
  return gather_lists(mesh.nnode(), [&](auto use) {
    for (const ElemBlock& b : el.block)
      for (int slot : b.live)
        for (int k = mesh.conn.off[b.elem[slot]]; k < mesh.conn.off[b.elem[slot] + 1]; ++k)
          use(mesh.conn.item[k], b.elem[slot]);
  });
}

// calls use(neighbour) for the nodes of the elements of node n
template <class Use>
void each_neighbour(const Mesh& mesh, const ListTable& around, int n, Use use)
{
  for (int k = around.off[n]; k < around.off[n + 1]; ++k)
    for (int j = mesh.conn.off[around.item[k]]; j < mesh.conn.off[around.item[k] + 1]; ++j)
      use(mesh.conn.item[j]);
}

// Nodes that are in use, those far from bonds to the grid and from points first. A node that is tied to the
// grid then comes when its own neighbours have gone, and the incomplete factor need not drop what a stiff
// bond would make of them  doc/theory.md (8.3)
IntVec order_nodes(const Mesh& mesh, const Bonds& bonds, const Points& pts, const ListTable& around)
{
  std::vector<char> waits(mesh.nnode());
  for (int n = 0; n < mesh.nnode(); ++n) waits[n] = around.count(n) > 0;
  IntVec near;                 // from the bonds outwards
  const auto reach = [&](int n) {
    if (waits[n]) near.push_back(n);
    waits[n] = 0;
  };
  for (int k = 0; k < bonds.nbond; ++k)
    for (int j = bonds.a.off[k]; j < bonds.a.off[k + 1]; ++j)
      if (bonds.field[k] >= 0 && bonds.a.item[j] < mesh.nnode()) reach(bonds.a.item[j]);
  for (int c = 0; c < static_cast<int>(pts.hangs.size()); ++c)
    if (pts.hangs[c] == HANG_NODE) reach(pts.hang.begin(c)[0]);
  for (size_t i = 0; i < near.size(); ++i) each_neighbour(mesh, around, near[i], reach);
  IntVec order;
  for (int n = 0; n < mesh.nnode(); ++n)
    if (waits[n]) order.push_back(n);
  order.insert(order.end(), near.rbegin(), near.rend());
  return order;
}

// divided model: as the incomplete factor eliminates them                                             (8.7)
void order_from_border(const Model& m, const ListTable& around, IntVec& order)
{
  IntVec border;
  for (int n : m.part.halo.shared)
    if (around.count(n)) border.push_back(n);
  far_first(m.mesh.nnode(), border, [&](int n, auto use) { each_neighbour(m.mesh, around, n, use); }, order);
}

// rows of finite-element nodes: those of an element that is still one
void number_nodes(const Model& m, const State& st, const Elements& el, Dofs& s)
{
  if (s.numbered) return;
  s.numbered    = true;
  const ListTable around = elements_around(m.mesh, el);
  s.node_of_row = order_nodes(m.mesh, st.bonds, st.points, around);
  if (m.part.on) order_from_border(m, around, s.node_of_row);
  s.bare.assign(s.node_of_row.size(), 0);
  RealVec held(m.mesh.nnode());                    // by elements, of all ranks
  for (int n = 0; n < m.mesh.nnode(); ++n) held[n] = around.count(n);
  if (m.part.tied) halo_sum(m.part.halo, 1, held);
  std::vector<char> known(m.mesh.nnode(), 0);      // nodes of equations without elements come last
  for (const Equation& e : m.equation)
    for (const EquationTerm& t : e.term) {
      if (around.count(t.node) || known[t.node]) continue;
      known[t.node] = 1;
      s.node_of_row.push_back(t.node);
      s.bare.push_back(held[t.node] == 0.0);
    }
  s.nfe         = static_cast<int>(s.node_of_row.size());
  s.nguest      = 0;
  s.row_of_node.assign(m.mesh.nnode(), -1);
  for (int r = 0; r < s.nfe; ++r) s.row_of_node[s.node_of_row[r]] = r;
}

// divided model: rows of nodes without elements of this rank, which bonds of it hold now, or corners with
// lists follow. True: they are others than before
bool add_guests(const Model& m, const Bonds& bonds, const Discretisation& d, Dofs& s)
{
  const int own = s.nfe - s.nguest, nnode = m.mesh.nnode();
  IntVec guest;
  const auto add = [&](int n) {
    if (n < nnode && (s.row_of_node[n] < 0 || s.row_of_node[n] >= own)) guest.push_back(n);
  };
  const auto take = [&](const ListTable& list, int b) {
    for (int k = list.off[b]; k < list.off[b + 1]; ++k) add(list.item[k]);
  };
  for (const MeshItem& q : d.grid.corner_mesh) add(q.node);
  for (int b = 0; b < bonds.nbond; ++b) {
    // one of a node that has been lost ties nothing any more
    if (bonds.cn[b] == 0.0 && bonds.ct[b] == 0.0) continue;
    if (!d.mine.bond[b] || !contact_acts(bonds, d.pairs, b)) continue;
    take(bonds.a, b);
    if (bonds.side[b] == SIDE_CONTACT) take(d.pairs.master, b);
  }
  sort_once(guest);
  if (std::equal(guest.begin(), guest.end(), s.node_of_row.begin() + own, s.node_of_row.end())) return false;
  for (int r = own; r < s.nfe; ++r) s.row_of_node[s.node_of_row[r]] = -1;
  s.node_of_row.resize(own);
  s.node_of_row.insert(s.node_of_row.end(), guest.begin(), guest.end());
  s.nguest = static_cast<int>(guest.size());
  s.nfe    = own + s.nguest;
  s.bare.resize(s.nfe, 0);
  for (int r = own; r < s.nfe; ++r) s.row_of_node[s.node_of_row[r]] = r;
  return true;
}

// rows and weights of one bond: side A positive, side B negative, equal rows summed
void bond_rows(const Bonds& bonds, const Discretisation& d, const Dofs& s, int b, IntVec& row, RealVec& w)
{
  const int nnode = static_cast<int>(s.row_of_node.size());
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
    for (int j = d.grid.corner.off[c]; j < d.grid.corner.off[c + 1]; ++j)
      add(s.nfe + d.grid.corner.item[j], value * d.grid.corner_w[j]);
  };
  if (!contact_acts(bonds, d.pairs, b)) return;
  for (int k = bonds.a.off[b]; k < bonds.a.off[b + 1]; ++k) add_kin(bonds.a.item[k], bonds.a_w[k]);
  if (bonds.side[b] == SIDE_CONTACT)
    for (int k = d.pairs.master.off[b]; k < d.pairs.master.off[b + 1]; ++k)
      add_kin(d.pairs.master.item[k], -d.pairs.master_w[k]);
  for (int j = d.grid.bond.off[b]; j < d.grid.bond.off[b + 1]; ++j)
    add(s.nfe + d.grid.bond.item[j], -d.grid.bond_w[j]);
}

// corners and points that follow nodes of the mesh: their rows, counted from the first of the grid  (7.14)
void find_mesh_rows(ActiveGrid& grid, Dofs& s)
{
  s.hung = !grid.corner_mesh.empty();
  for (const MeshItem& q : grid.corner_mesh) grid.corner.item[q.at] = s.row_of_node[q.node] - s.nfe;
  for (const MeshItem& q : grid.point_mesh) grid.point.item[q.at] = s.row_of_node[q.node] - s.nfe;
}

// rows of the points that share their change of volume, each once
void form_groups(const ListTable& group, const ActiveGrid& grid, Dofs& s)
{
  s.group = ListTable();
  s.group_first.clear();
  IntVec row;
  for (int k = 0; k < group.size(); ++k) {
    row.clear();
    for (int i = group.off[k]; i < group.off[k + 1]; ++i)
      for (int j = grid.point.off[group.item[i]]; j < grid.point.off[group.item[i] + 1]; ++j)
        row.push_back(s.nfe + grid.point.item[j]);
    sort_once(row);
    s.group.item.insert(s.group.item.end(), row.begin(), row.end());
    s.group.off.push_back(static_cast<int>(s.group.item.size()));
    s.group_first.push_back(group.begin(k)[0]);
  }
}

void form_lists(const MeshPart& part, const Bonds& bonds, Discretisation& d, Dofs& s)
{
  find_mesh_rows(d.grid, s);
  form_groups(d.point_law.group, d.grid, s);
  s.nrow = s.nfe + d.grid.nnode;
  s.row_key.assign(s.node_of_row.begin(), s.node_of_row.end());
  for (long& key : s.row_key) key = part.node_number(static_cast<int>(key));
  for (long key : d.grid.key) s.row_key.push_back(-1 - key);
  s.bond = ListTable();
  s.bond_w.clear();
  s.bond_acts.clear();
  IntVec row;
  RealVec w;
  for (int b = 0; b < bonds.nbond; ++b) {
    if (!d.mine.has_bond(b)) {
      s.bond.off.push_back(static_cast<int>(s.bond.item.size()));
      continue;
    }
    bond_rows(bonds, d, s, b, row, w);
    s.bond.item.insert(s.bond.item.end(), row.begin(), row.end());
    s.bond_w.insert(s.bond_w.end(), w.begin(), w.end());
    s.bond.off.push_back(static_cast<int>(s.bond.item.size()));
    if (contact_acts(bonds, d.pairs, b)) s.bond_acts.push_back(b);
  }
}

bool same(const ListTable& a, const ListTable& b) { return a.off == b.off && a.item == b.item; }

// rows that bonds of this rank tie to the grid, and those of the grid
IntVec tied_rows(const Dofs& s)
{
  IntVec tied;
  for (int b : s.bond_acts) {
    const auto first = s.bond.begin(b), last = first + s.bond.count(b);
    const auto on_grid = [&](int row) { return row >= s.nfe; };
    if (std::any_of(first, last, on_grid) && !std::all_of(first, last, on_grid))
      tied.insert(tied.end(), first, last);
  }
  sort_once(tied);
  return tied;
}

// pattern of what this rank works on
void form_pattern(const Mesh& mesh, const Elements& el, const ActiveGrid& grid, Dofs& s)
{
  ListTable lists;
  dof_lists(mesh, el, grid, s, [&](int n, const int* row) {
    const int last = lists.size() - 1;
    if (last >= 0 && lists.count(last) == n && std::equal(row, row + n, lists.begin(last))) return;
    lists.item.insert(lists.item.end(), row, row + n);
    lists.off.push_back(static_cast<int>(lists.item.size()));
  });
  tie_extend(s, lists);
  sys_pattern(lists, s.nrow, s.dim, s.A);
  s.A.halo = s.halo;
  s.A.tied = tied_rows(s);
}

// which rows count on this rank
void count_rows(Dofs& s)
{
  s.once.assign(s.neq(), 0);
  double rows = 0.0;
  for (int r = 0; r < s.nrow; ++r) {
    if (s.owner[r] != comm_rank()) continue;
    std::fill_n(s.once.begin() + static_cast<long>(r) * s.dim, s.dim, 1);
    rows += 1.0;
  }
  comm_sum(&rows, 1);
  s.rows = static_cast<long>(rows);
}

// the place of column c in row r; rows are short, and counting needs no guess of the processor
int block_place(const SysMatrix& A, int r, int c)
{
  int place = A.off[r];
  for (int k = A.off[r], last = A.off[r + 1]; k < last; ++k) place += A.col[k] < c;
  return place;
}

// where every node pair goes; points with the nodes of the one before share its places
void form_maps(const Mesh& mesh, const Elements& el, const ActiveGrid& grid, Dofs& s)
{
  size_t nelem = 0, list = 0, pairs[5] = {};
  for (const ElemBlock& b : el.block) {
    nelem += b.live.size();
    pairs[0] += b.live.size() * pair_count(shape_info[b.shape].nen);
  }
  s.point_map_off.clear();
  s.bond_map_off.assign(1, 0);
  s.ghost_map_off.assign(1, 0);
  s.group_map_off.assign(1, 0);
  const auto same_nodes = [&](int p, int q) {
    const int n = grid.point.count(p), *node = grid.point.begin(p);
    return n == grid.point.count(q) && std::equal(node, node + n, grid.point.begin(q));
  };
  int before = -1;
  for (int q : s.owned_point) {
    const bool shared = before >= 0 && same_nodes(before, q);
    s.point_map_off.push_back(shared ? s.point_map_off.back() : pairs[1]);
    if (!shared) pairs[1] += pair_count(grid.point.count(q));
    before = q;
  }
  const size_t nbond = s.lean ? 0 : s.bond_acts.size();
  for (size_t k = 0; k < nbond; ++k)
    s.bond_map_off.push_back(pairs[2] += pair_count(s.bond.count(s.bond_acts[k])));
  for (int q = 0; q < grid.ghost.size(); ++q)
    s.ghost_map_off.push_back(pairs[3] += pair_count(grid.ghost.count(q)));
  for (int k : s.owned_group) s.group_map_off.push_back(pairs[4] += pair_count(s.group.count(k)));
  fit_size(s.elem_map, pairs[0]);
  fit_size(s.point_map, pairs[1]);
  fit_size(s.bond_map, pairs[2]);
  fit_size(s.ghost_map, pairs[3]);
  fit_size(s.group_map, pairs[4]);
  const size_t npoint = s.owned_point.size(), nghost = grid.ghost.size();
  int* map = s.elem_map.data();
  dof_lists(mesh, el, grid, s, [&](int n, const int* row) {
    if (list == nelem) map = s.point_map.data();
    if (list == nelem + npoint) map = s.bond_map.data();
    if (list == nelem + npoint + nbond) map = s.ghost_map.data();
    if (list == nelem + npoint + nbond + nghost) map = s.group_map.data();
    const size_t point = list++ - nelem;
    if (point > 0 && point < npoint && s.point_map_off[point] == s.point_map_off[point - 1]) return;
    for (int a = 0; a < n; ++a)
      for (int b = 0; b <= a; ++b)
        *map++ = row[a] >= row[b] ? 2 * block_place(s.A, row[a], row[b])
                                  : 2 * block_place(s.A, row[b], row[a]) + 1;
  });
}

double mean_size(const Model& m, const Elements& el)
{
  double volume = 0.0, count = 0.0;
  for (const ElemBlock& b : el.block) {
    const int ngp = shape_info[b.shape].ngp;
    for (size_t slot = 0; slot < b.elem.size(); ++slot) {
      if (!m.part.works(b.elem[slot])) continue;
      for (int g = 0; g < ngp; ++g) volume += b.w[b.gauss(slot) + g] / (m.dim == 2 ? b.thickness : 1.0);
      count += 1.0;
    }
  }
  if (m.part.on) {
    comm_sum(&volume, 1);
    comm_sum(&count, 1);
  }
  if (count == 0.0) return m.grid.h[0];
  return m.dim == 2 ? __builtin_sqrt(volume / count) : __builtin_cbrt(volume / count);
}

// rows, lists, equations and whose work is what; true: something has changed
bool form_rows(const Model& m, const Step& step, State& st, Discretisation& d, Dofs& s)
{
  const bool first = !s.numbered;
  const int before = s.nrow;
  s.dim = m.dim;
  number_nodes(m, st, d.el, s);
  bool fresh = m.part.on && add_guests(m, st.bonds, d, s);
  const bool lean = step.explicit_steps() && comm_size() == 1;
  fresh  = fresh || s.lean != lean;
  s.lean = lean;
  bool bonds = false;          // other ones act
  // the grid has moved along, nothing else makes lists, and places of contact keep what they meet
  const bool meets = !d.pairs.gap.empty() && d.pairs.searched + d.pairs.skipped > 0;
  const bool stay  = !first && !fresh && !meets && s.lists_of == d.grid.made && d.point_law.group.size() == 0;
  if (!stay) {
    form_lists(m.part, st.bonds, d, s);
    fresh = fresh || first || s.nrow != before;
    bonds = !same(s.bond_rows, s.bond);
    fresh = fresh || !same(s.point_rows, d.grid.point) || (bonds && !lean) ||
            !same(s.ghost_rows, d.grid.ghost) || !same(s.group_rows, s.group);
    s.lists_of = d.grid.made;
  }
  fresh = dof_tie(m, step, s) || fresh;
  fresh = dof_divide(m, st.points, d.grid, st.division, s) || fresh;
  if (bonds) s.bond_rows = s.bond;
  if (!fresh) return false;
  s.point_rows = d.grid.point;
  s.bond_rows  = s.bond;
  s.ghost_rows = d.grid.ghost;
  s.group_rows = s.group;
  return true;
}

// several ranks: rows that they have in common
bool form_split(const Model& m, const Step& step, State& st, Discretisation& d, Dofs& s)
{
  s.split = true;
  double any[2] = {static_cast<double>(form_rows(m, step, st, d, s)), static_cast<double>(s.hung)};
  comm_max(any, 2);
  s.hung = any[1] > 0.0;
  if (any[0] == 0.0) return false;
  halo_form(s.row_key, s.halo);
  for (int r = 0; r < s.nfe; ++r) s.halo.owner[r] = m.part.halo.owner[s.node_of_row[r]];
  s.owner = s.halo.owner;
  return true;
}

}  // namespace

void dof_form(const Model& m, const Step& step, State& st, Discretisation& d, Dofs& s)
{
  const bool fresh = comm_size() > 1 ? form_split(m, step, st, d, s) : form_rows(m, step, st, d, s);
  if (fresh || s.corner_mass_made != d.grid.made) point_corner_mass(st.points, s.owned_point, s.corner_mass);
  s.corner_mass_made = d.grid.made;
  if (!fresh) return timer_skip(PHASE_PATTERN);
  Timer timer(PHASE_PATTERN);
  ++s.pattern;
  s.renumbered = true;
  s.mass_rows.reset();                   // of the pattern before
  form_pattern(m.mesh, d.el, d.grid, s);
  if (s.split) count_rows(s);
  form_maps(m.mesh, d.el, d.grid, s);
  s.M.clear();
  s.C.clear();
  s.damped = false;
  if (s.h_mean == 0.0) s.h_mean = mean_size(m, d.el);
}
