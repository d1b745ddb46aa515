#include <algorithm>

#include "base/comm.h"
#include "base/far_first.h"
#include "base/gather_lists.h"
#include "base/grow.h"
#include "base/sort_once.h"
#include "base/timer.h"
#include "dof/dof.h"

namespace {

// present elements around each node
ListTable elements_around(const Mesh& mesh, const Elements& el)
{
  return gather_lists(mesh.nnode(), [&](auto use) {
    for (const ElemBlock& b : el.block)
      for (int slot : b.live)
        for (int k = mesh.conn.off[b.elem[slot]]; k < mesh.conn.off[b.elem[slot] + 1]; ++k)
          use(mesh.conn.item[k], b.elem[slot]);
  });
}

// [nnode] number of present elements at each node
RealVec elements_at(const Mesh& mesh, const Elements& el)
{
  RealVec count(mesh.nnode(), 0.0);
  for (const ElemBlock& b : el.block)
    for (int slot : b.live)
      for (int k = mesh.conn.off[b.elem[slot]]; k < mesh.conn.off[b.elem[slot] + 1]; ++k)
        count[mesh.conn.item[k]] += 1.0;
  return count;
}

// calls use(neighbour) for the nodes of the elements of node n
template <class Use>
void each_neighbour(const Mesh& mesh, const ListTable& around, int n, Use use)
{
  for (int k = around.off[n]; k < around.off[n + 1]; ++k)
    for (int j = mesh.conn.off[around.item[k]]; j < mesh.conn.off[around.item[k] + 1]; ++j)
      use(mesh.conn.item[j]);
}

// Nodes in use, those far from bonds to the grid and from points first: nodes tied to the grid are then
// eliminated after their neighbours, and the incomplete factor need not drop the fill of a stiff bond
// doc/theory.md (8.3)
IntVec order_nodes(const Mesh& mesh, const Bonds& bonds, const Points& pts, const ListTable& around)
{
  std::vector<char> waits(mesh.nnode());
  for (int n = 0; n < mesh.nnode(); ++n) waits[n] = around.count(n) > 0;
  IntVec reached;              // from the bonds outwards
  const auto reach = [&](int n) {
    if (waits[n]) reached.push_back(n);
    waits[n] = 0;
  };
  for (int k = 0; k < bonds.nbond; ++k)
    for (int j = bonds.a.off[k]; j < bonds.a.off[k + 1]; ++j)
      if (bonds.field[k] >= 0 && bonds.a.item[j] < mesh.nnode()) reach(bonds.a.item[j]);
  for (int c = 0; c < static_cast<int>(pts.hangs.size()); ++c)
    if (pts.hangs[c] == HANG_NODE) reach(pts.hang.begin(c)[0]);
  for (size_t i = 0; i < reached.size(); ++i) each_neighbour(mesh, around, reached[i], reach);
  IntVec order;
  for (int n = 0; n < mesh.nnode(); ++n)
    if (waits[n]) order.push_back(n);
  order.insert(order.end(), reached.rbegin(), reached.rend());
  return order;
}

// divided model: the order in which the incomplete factor eliminates nodes                            (8.7)
void order_from_border(const Model& m, const ListTable& around, IntVec& order)
{
  IntVec border;
  for (int n : m.part.halo.shared)
    if (around.count(n)) border.push_back(n);
  far_first(m.mesh.nnode(), border, [&](int n, auto use) { each_neighbour(m.mesh, around, n, use); }, order);
}

// rows of finite-element nodes: the nodes of present elements; lean: no matrix is factorised, and in the
// order of the mesh nodes are read in sequence
void number_nodes(const Model& m, const State& st, const Elements& el, bool lean, Dofs& s)
{
  if (s.rows.numbered && lean == s.pattern.lean) return;
  s.rows.numbered = true;
  RealVec elements = elements_at(m.mesh, el);
  s.rows.node_of_row.clear();
  if (lean) {
    for (int n = 0; n < m.mesh.nnode(); ++n)
      if (elements[n] > 0.0) s.rows.node_of_row.push_back(n);
  } else {
    const ListTable around = elements_around(m.mesh, el);
    s.rows.node_of_row = order_nodes(m.mesh, st.bonds, st.points, around);
    if (m.part.on) order_from_border(m, around, s.rows.node_of_row);
  }
  s.bound.bare.assign(s.rows.node_of_row.size(), 0);
  std::vector<char> known(m.mesh.nnode(), 0);      // nodes of equations without elements come last
  for (int n : s.rows.node_of_row) known[n] = 1;
  if (m.part.tied) halo_sum(m.part.halo, 1, elements);
  for (const Equation& e : m.equation)
    for (const EquationTerm& t : e.term) {
      if (known[t.node]) continue;
      known[t.node] = 1;
      s.rows.node_of_row.push_back(t.node);
      s.bound.bare.push_back(elements[t.node] == 0.0);
    }
  s.rows.nfe         = static_cast<int>(s.rows.node_of_row.size());
  s.rows.nguest      = 0;
  s.rows.row_of_node.assign(m.mesh.nnode(), -1);
  for (int r = 0; r < s.rows.nfe; ++r) s.rows.row_of_node[s.rows.node_of_row[r]] = r;
}

// divided model: rows of nodes without elements on this rank, to which its bonds are attached, or which
// corners with lists follow. True: they have changed
bool add_guests(const Model& m, const Bonds& bonds, const Discretisation& d, Dofs& s)
{
  const int own = s.rows.nfe - s.rows.nguest, nnode = m.mesh.nnode();
  IntVec guest;
  const auto add = [&](int n) {
    if (n < nnode && (s.rows.row_of_node[n] < 0 || s.rows.row_of_node[n] >= own)) guest.push_back(n);
  };
  const auto take = [&](const ListTable& list, int b) {
    for (int k = list.off[b]; k < list.off[b + 1]; ++k) add(list.item[k]);
  };
  for (const MeshItem& q : d.grid.corner_mesh) add(q.node);
  for (int b = 0; b < bonds.nbond; ++b) {
    // the bond of a lost node no longer ties
    if (bonds.cn[b] == 0.0 && bonds.ct[b] == 0.0) continue;
    if (!d.owned.bond[b] || !contact_acts(bonds, d.pairs, b)) continue;
    take(bonds.a, b);
    if (bonds.side[b] == SIDE_CONTACT) take(d.pairs.master, b);
  }
  sort_once(guest);
  if (std::equal(guest.begin(), guest.end(), s.rows.node_of_row.begin() + own, s.rows.node_of_row.end()))
    return false;
  for (int r = own; r < s.rows.nfe; ++r) s.rows.row_of_node[s.rows.node_of_row[r]] = -1;
  s.rows.node_of_row.resize(own);
  s.rows.node_of_row.insert(s.rows.node_of_row.end(), guest.begin(), guest.end());
  s.rows.nguest = static_cast<int>(guest.size());
  s.rows.nfe    = own + s.rows.nguest;
  s.bound.bare.resize(s.rows.nfe, 0);
  for (int r = own; r < s.rows.nfe; ++r) s.rows.row_of_node[s.rows.node_of_row[r]] = r;
  return true;
}

// rows and weights of one bond: side A positive, side B negative, equal rows summed
//   at [nrow]   scratch, all -1 before and after
void bond_rows(const Bonds& bonds, const Discretisation& d, const Dofs& s, int b, IntVec& at, IntVec& row,
               RealVec& w)
{
  const int nnode = static_cast<int>(s.rows.row_of_node.size());
  row.clear();
  w.clear();
  auto add = [&](int r, double value) {
    if (at[r] >= 0) {
      w[at[r]] += value;
      return;
    }
    at[r] = static_cast<int>(row.size());
    row.push_back(r);
    w.push_back(value);
  };
  auto add_node = [&](int node, double value) {      // corner c: nnode + c
    if (node < nnode) {
      if (s.rows.row_of_node[node] >= 0) add(s.rows.row_of_node[node], value);
      return;
    }
    const int c = node - nnode;
    for (int j = d.grid.corner.off[c]; j < d.grid.corner.off[c + 1]; ++j)
      add(s.rows.nfe + d.grid.corner.item[j], value * d.grid.corner_w[j]);
  };
  for (int k = bonds.a.off[b]; k < bonds.a.off[b + 1]; ++k) add_node(bonds.a.item[k], bonds.a_w[k]);
  if (bonds.side[b] == SIDE_CONTACT)
    for (int k = d.pairs.master.off[b]; k < d.pairs.master.off[b + 1]; ++k)
      add_node(d.pairs.master.item[k], -d.pairs.master_w[k]);
  for (int j = d.grid.bond.off[b]; j < d.grid.bond.off[b + 1]; ++j)
    add(s.rows.nfe + d.grid.bond.item[j], -d.grid.bond_w[j]);
  for (int r : row) at[r] = -1;
}

// corners and points that follow nodes of the mesh: their rows, counted from the first of the grid  (7.14)
void find_mesh_rows(ActiveGrid& grid, Dofs& s)
{
  s.rows.hung = !s.rows.lumps && !grid.corner_mesh.empty();
  for (const MeshItem& q : grid.corner_mesh) grid.corner.item[q.at] = s.rows.row_of_node[q.node] - s.rows.nfe;
  for (const MeshItem& q : grid.point_mesh) grid.point.item[q.at] = s.rows.row_of_node[q.node] - s.rows.nfe;
}

// rows of the points that share their change of volume, each once
void form_groups(const ListTable& group, const ActiveGrid& grid, Dofs& s)
{
  s.rows.group = ListTable();
  s.rows.group_first.clear();
  IntVec row;
  for (int k = 0; k < group.size(); ++k) {
    row.clear();
    for (int i = group.off[k]; i < group.off[k + 1]; ++i)
      for (int j = grid.point.off[group.item[i]]; j < grid.point.off[group.item[i] + 1]; ++j)
        row.push_back(s.rows.nfe + grid.point.item[j]);
    sort_once(row);
    s.rows.group.item.insert(s.rows.group.item.end(), row.begin(), row.end());
    s.rows.group.off.push_back(static_cast<int>(s.rows.group.item.size()));
    s.rows.group_first.push_back(group.begin(k)[0]);
  }
}

void form_lists(const MeshPart& part, const Bonds& bonds, Discretisation& d, Dofs& s)
{
  find_mesh_rows(d.grid, s);
  form_groups(d.point_law.group, d.grid, s);
  s.rows.nrow = s.rows.nfe + d.grid.nnode;
  s.rows.row_key.assign(s.rows.node_of_row.begin(), s.rows.node_of_row.end());
  for (long& key : s.rows.row_key) key = part.node_number(static_cast<int>(key));
  for (long key : d.grid.key) s.rows.row_key.push_back(-1 - key);
  s.rows.bond.off.assign(1, 0);
  s.rows.bond.off.resize(bonds.nbond + 1);
  s.rows.bond.item.clear();
  s.rows.bond_w.clear();
  s.rows.bond_acts.clear();
  IntVec at(s.rows.nrow, -1), row;
  RealVec w;
  for (int b = 0; b < bonds.nbond; ++b) {
    if (contact_acts(bonds, d.pairs, b) && d.owned.has_bond(b)) {
      bond_rows(bonds, d, s, b, at, row, w);
      s.rows.bond.item.insert(s.rows.bond.item.end(), row.begin(), row.end());
      s.rows.bond_w.insert(s.rows.bond_w.end(), w.begin(), w.end());
      s.rows.bond_acts.push_back(b);
    }
    s.rows.bond.off[b + 1] = static_cast<int>(s.rows.bond.item.size());
  }
}

bool same(const ListTable& a, const ListTable& b) { return a.off == b.off && a.item == b.item; }

// rows tied to the grid by bonds of this rank, and the grid rows of these bonds
IntVec tied_rows(const Dofs& s)
{
  IntVec tied;
  for (int b : s.rows.bond_acts) {
    const auto first = s.rows.bond.begin(b), last = first + s.rows.bond.count(b);
    const auto on_grid = [&](int row) { return row >= s.rows.nfe; };
    if (std::any_of(first, last, on_grid) && !std::all_of(first, last, on_grid))
      tied.insert(tied.end(), first, last);
  }
  sort_once(tied);
  return tied;
}

// explicit steps on one rank: elements have their lumped masses in the matrix, and nothing else
bool elements_lumped(const Model& m, const Elements& el, const Dofs& s)
{
  return s.pattern.lean && m.viscous.empty() &&
         std::none_of(m.material.begin(), m.material.end(),
                      [](const Material& a) { return a.alpha > 0.0; }) &&
         std::all_of(el.block.begin(), el.block.end(), [](const ElemBlock& b) { return b.lumped; });
}

size_t live_elements(const Elements& el)
{
  size_t n = 0;
  for (const ElemBlock& b : el.block) n += b.live.size();
  return n;
}

// pattern of the contributions of this rank
void form_pattern(const Mesh& mesh, const Elements& el, const ActiveGrid& grid, bool lumped, Dofs& s)
{
  ListTable lists;
  IntVec like(s.rows.nrow, -1);          // the last list that begins with a row
  size_t left = lumped ? live_elements(el) : 0;
  dof_lists(mesh, el, grid, s, [&](int n, const int* row) {
    if (left > 0) {
      --left;
      return;
    }
    if (n == 0) return;
    int& last = like[row[0]];
    if (last >= 0 && lists.count(last) == n && std::equal(row, row + n, lists.begin(last))) return;
    last = lists.size();
    lists.item.insert(lists.item.end(), row, row + n);
    lists.off.push_back(static_cast<int>(lists.item.size()));
  });
  tie_extend(s, lists);
  sys_pattern(lists, s.rows.nrow, lumped ? 0 : s.rows.dim, s.pattern.A);       // lumped: without numbers
  s.pattern.A.dim  = s.rows.dim;
  s.pattern.A.halo = s.rows.halo;
  s.pattern.A.tied = tied_rows(s);
}

// marks the rows that count on this rank
void count_rows(Dofs& s)
{
  s.rows.once.assign(s.rows.neq(), 0);
  double rows = 0.0;
  for (int r = 0; r < s.rows.nrow; ++r) {
    if (!s.rows.owns(r)) continue;
    std::fill_n(s.rows.once.begin() + static_cast<long>(r) * s.rows.dim, s.rows.dim, 1);
    rows += 1.0;
  }
  comm_sum(&rows, 1);
  s.rows.all = static_cast<long>(rows);
}

// index of the block in row r, column c; rows are short, and counting avoids mispredicted branches
int block_index(const SysMatrix& A, int r, int c)
{
  int index = A.off[r];
  for (int k = A.off[r], last = A.off[r + 1]; k < last; ++k) index += A.col[k] < c;
  return index;
}

// explicit, with corners that follow nodes: the mass is formed corner by corner (6.47), and no matrix is, so
// points need no map. Every block couples rows of a point, of a ghost, or is a diagonal one
bool points_unmapped(const ActiveGrid& grid, bool lumped, const Dofs& s)
{
  return lumped && s.rows.lumps && !grid.corner_mesh.empty() && s.rows.owned_group.empty() &&
      !s.bound.tie.any;
}

// block of A of every node pair; points with the same nodes as the previous one share its entries. lumped:
// elements have the diagonal block of a node for all its pairs; point_map_off empty: points have none
void form_maps(const Mesh& mesh, const Elements& el, const ActiveGrid& grid, bool lumped, Dofs& s)
{
  const bool unmapped = points_unmapped(grid, lumped, s);
  size_t nelem = 0, list = 0, pairs[5] = {};
  for (const ElemBlock& b : el.block) {
    nelem += b.live.size();
    pairs[0] += b.live.size() * pair_count(shape_info[b.shape].nen);
  }
  s.pattern.point_map_off.clear();
  s.pattern.bond_map_off.assign(1, 0);
  s.pattern.ghost_map_off.assign(1, 0);
  s.pattern.group_map_off.assign(1, 0);
  const auto same_nodes = [&](int p, int q) {
    const int n = grid.point.count(p), *node = grid.point.begin(p);
    return n == grid.point.count(q) && std::equal(node, node + n, grid.point.begin(q));
  };
  int before = -1;
  for (size_t k = 0; k < s.rows.owned_point.size() && !unmapped; ++k) {
    const int q       = s.rows.owned_point[k];
    const bool shared = before >= 0 && same_nodes(before, q);
    s.pattern.point_map_off.push_back(shared ? s.pattern.point_map_off.back() : pairs[1]);
    if (!shared) pairs[1] += pair_count(grid.point.count(q));
    before = q;
  }
  const size_t nbond = s.pattern.lean ? 0 : s.rows.bond_acts.size();
  for (size_t k = 0; k < nbond; ++k)
    s.pattern.bond_map_off.push_back(pairs[2] += pair_count(s.rows.bond.count(s.rows.bond_acts[k])));
  for (int q = 0; q < grid.ghost.size(); ++q)
    s.pattern.ghost_map_off.push_back(pairs[3] += pair_count(grid.ghost.count(q)));
  for (int k : s.rows.owned_group)
    s.pattern.group_map_off.push_back(pairs[4] += pair_count(s.rows.group.count(k)));
  fit_size(s.pattern.elem_map, pairs[0]);
  fit_size(s.pattern.point_map, pairs[1]);
  fit_size(s.pattern.bond_map, pairs[2]);
  fit_size(s.pattern.ghost_map, pairs[3]);
  fit_size(s.pattern.group_map, pairs[4]);
  const size_t npoint = s.rows.owned_point.size(), nghost = grid.ghost.size();
  int* map = s.pattern.elem_map.data();
  dof_lists(mesh, el, grid, s, [&](int n, const int* row) {
    if (list == nelem) map = s.pattern.point_map.data();
    if (list == nelem + npoint) map = s.pattern.bond_map.data();
    if (list == nelem + npoint + nbond) map = s.pattern.ghost_map.data();
    if (list == nelem + npoint + nbond + nghost) map = s.pattern.group_map.data();
    if (lumped && list < nelem) {
      ++list;
      for (int a = 0; a < n; ++a)
        for (int b = 0; b <= a; ++b) *map++ = 2 * (s.pattern.A.off[row[a] + 1] - 1);
      return;
    }
    const size_t point = list++ - nelem;
    if (point < npoint && unmapped) return;
    if (point > 0 && point < npoint && s.pattern.point_map_off[point] == s.pattern.point_map_off[point - 1])
      return;
    for (int a = 0; a < n; ++a)
      for (int b = 0; b <= a; ++b)
        *map++ = row[a] >= row[b] ? 2 * block_index(s.pattern.A, row[a], row[b])
                                  : 2 * block_index(s.pattern.A, row[b], row[a]) + 1;
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

// rows, lists, equations and owners; true: something has changed
bool form_rows(const Model& m, const Step& step, State& st, Discretisation& d, Dofs& s)
{
  const bool first = !s.rows.numbered;
  const int before = s.rows.nrow;
  const bool lean  = step.explicit_steps() && comm_size() == 1;
  s.rows.dim = m.dim;
  number_nodes(m, st, d.el, lean, s);
  bool fresh = m.part.on && add_guests(m, st.bonds, d, s);
  fresh  = fresh || s.pattern.lean != lean || s.rows.lumps != step.explicit_steps();
  s.pattern.lean = lean;
  s.rows.lumps   = step.explicit_steps();
  // the grid has moved along, nothing else changes lists, and contact points keep their faces
  const bool meets = !d.pairs.gap.empty() && d.pairs.searched + d.pairs.skipped > 0;
  const bool stay  = !first && !fresh && !meets && s.pattern.lists_of == d.grid.made &&
      d.point_law.group.size() == 0;
  if (!stay) {
    form_lists(m.part, st.bonds, d, s);
    fresh = fresh || first || s.rows.nrow != before;
    fresh = fresh || !same(s.pattern.point_rows, d.grid.point) ||
            (!lean && !same(s.pattern.bond_rows, s.rows.bond)) ||          // the acting bonds have changed
            !same(s.pattern.ghost_rows, d.grid.ghost) || !same(s.pattern.group_rows, s.rows.group);
    s.pattern.lists_of = d.grid.made;
  }
  fresh = dof_tie(m, step, st.n.u, s) || fresh;
  fresh = dof_divide(m, st.points, d.grid, st.division, s) || fresh;
  if (!fresh) return false;
  s.pattern.point_rows = d.grid.point;
  s.pattern.bond_rows  = lean ? ListTable() : s.rows.bond;
  s.pattern.ghost_rows = d.grid.ghost;
  s.pattern.group_rows = s.rows.group;
  return true;
}

// elements alone, without ties: the rows stay until elements go, on all ranks alike
bool rows_stay(const Model& m, const Step& step, const State& st, const Dofs& s)
{
  return s.rows.numbered && s.rows.lumps == step.explicit_steps() && st.points.npoint_all() == 0 &&
      st.bonds.nbond_all() == 0 && !m.part.tied && m.equation.empty();
}

// several ranks: rows shared between them
bool form_split(const Model& m, const Step& step, State& st, Discretisation& d, Dofs& s)
{
  s.rows.split = true;
  if (rows_stay(m, step, st, s)) {
    MPFE_CHECK(!form_rows(m, step, st, d, s), "rows have changed although elements stay");
    return false;
  }
  double any[2] = {static_cast<double>(form_rows(m, step, st, d, s)), static_cast<double>(s.rows.hung)};
  comm_max(any, 2);
  s.rows.hung = any[1] > 0.0;
  if (any[0] == 0.0) return false;
  halo_form(s.rows.row_key, s.rows.halo);
  for (int r = 0; r < s.rows.nfe; ++r) s.rows.halo.owner[r] = m.part.halo.owner[s.rows.node_of_row[r]];
  s.rows.owner = s.rows.halo.owner;
  return true;
}

}  // namespace

void dof_form(const Model& m, const Step& step, State& st, Discretisation& d, Dofs& s)
{
  const bool fresh = comm_size() > 1 ? form_split(m, step, st, d, s) : form_rows(m, step, st, d, s);
  if (fresh || s.mass.corner_mass_made != d.grid.made)
    point_corner_mass(st.points, s.rows.owned_point, s.rows.lumps, s.mass.corner_mass);
  s.mass.corner_mass_made = d.grid.made;
  if (!fresh) return timer_skip(PHASE_PATTERN);
  Timer timer(PHASE_PATTERN);
  ++s.pattern.number;
  s.rows.renumbered = true;
  s.mass.mass_rows.reset();                   // of the previous pattern
  const bool lumped = elements_lumped(m, d.el, s);
  form_pattern(m.mesh, d.el, d.grid, lumped, s);
  if (s.rows.split) count_rows(s);
  form_maps(m.mesh, d.el, d.grid, lumped, s);
  s.mass.M.clear();
  RealVec().swap(s.pattern.whole);
  s.mass.C.clear();
  s.mass.damped = false;
  if (s.rows.h_mean == 0.0) s.rows.h_mean = mean_size(m, d.el);
}
