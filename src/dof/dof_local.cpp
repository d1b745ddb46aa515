#include <algorithm>

#include "base/comm.h"
#include "base/log.h"
#include "dof/dof.h"

namespace {

// rows that this rank works on or that belong to it; those of equations are on all ranks
std::vector<char> rows_here(const Mesh& mesh, const Elements& el, const ActiveGrid& grid, const Dofs& w)
{
  std::vector<char> here(w.nrow, 0);
  dof_lists(mesh, el, grid, w, false, [&](int n, const int* row) {
    for (int a = 0; a < n; ++a) here[row[a]] = 1;
  });
  for (int r = 0; r < w.nrow; ++r) here[r] |= w.owner[r] == comm_rank();
  for (int dof : w.tie.dof) here[dof / w.dim] = 1;
  for (int dof : w.tie.master.item) here[dof / w.dim] = 1;
  for (int r = 0; r < w.nfe; ++r) here[r] |= w.bare[r];
  return here;
}

void number_rows(const Mesh& mesh, const std::vector<char>& here, Dofs& s)
{
  const Dofs& w = *s.whole;
  s.whole_row.clear();
  s.node_of_row.clear();
  s.bare.clear();
  s.row_key.clear();
  s.row_of_node.assign(mesh.nnode(), -1);
  s.local_row.assign(w.nrow, -1);
  for (int r = 0; r < w.nrow; ++r) {
    if (!here[r]) continue;
    s.local_row[r] = static_cast<int>(s.whole_row.size());
    s.whole_row.push_back(r);
    s.row_key.push_back(w.row_key[r]);
    if (r >= w.nfe) continue;
    s.row_of_node[w.node_of_row[r]] = s.local_row[r];
    s.node_of_row.push_back(w.node_of_row[r]);
    s.bare.push_back(w.bare[r]);
  }
  s.nfe  = static_cast<int>(s.node_of_row.size());
  s.nrow = static_cast<int>(s.whole_row.size());
}

// list i of the whole in the rows of this rank, or an empty one
void add_list(const ListTable& whole, int i, bool keep, int from, int to, const IntVec& local, ListTable& own)
{
  for (int k = whole.off[i]; k < whole.off[i + 1] && keep; ++k)
    own.item.push_back(local[from + whole.item[k]] - to);
  own.off.push_back(static_cast<int>(own.item.size()));
}

// of a list with D numbers for each of its items
void add_numbers(const ListTable& whole, const RealVec& w, int i, bool keep, int D, RealVec& own)
{
  if (keep && !w.empty())
    own.insert(own.end(), w.begin() + static_cast<long>(whole.off[i]) * D,
               w.begin() + static_cast<long>(whole.off[i + 1]) * D);
}

// corners and points that this rank works on, also those of its groups
void localise_points(const Points& pts, const ListTable& group, const ActiveGrid& g, const Dofs& s,
                     ActiveGrid& own)
{
  const int from = s.whole->nfe, to = s.nfe;
  std::vector<char> point(pts.npoint, 0), corner(pts.ncorner, 0);
  const auto take = [&](int q) {
    point[q] = 1;
    for (int k = pts.conn.off[q]; k < pts.conn.off[q + 1]; ++k) corner[pts.conn.item[k]] = 1;
  };
  for (int q : s.owned_point) take(q);
  for (int k : s.owned_group)
    for (int i = group.off[k]; i < group.off[k + 1]; ++i) take(group.item[i]);
  for (int c = 0; c < g.corner.size(); ++c) {
    add_list(g.corner, c, corner[c], from, to, s.local_row, own.corner);
    add_numbers(g.corner, g.corner_w, c, corner[c], 1, own.corner_w);
  }
  const int* slot = g.slot.data();
  for (int p = 0; p < g.point.size(); ++p) {
    add_list(g.point, p, point[p], from, to, s.local_row, own.point);
    add_numbers(g.point, g.dS, p, point[p], s.dim, own.dS);
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) {
      const int c = pts.conn.item[k], n = g.corner.count(c);
      if (point[p]) own.slot.insert(own.slot.end(), slot, slot + n);
      slot += n;
    }
  }
  own.dS.insert(own.dS.end(), PACK, 0.0);            // as point_sums leaves it
}

void localise_grid(const Points& pts, const ListTable& group, const ActiveGrid& g, const Dofs& s,
                   ActiveGrid& own)
{
  const Dofs& w = *s.whole;
  own       = ActiveGrid();
  own.lists = g.lists;
  own.made  = g.made;
  own.nnode = s.nrow - s.nfe;
  for (int r = s.nfe; r < s.nrow; ++r) own.key.push_back(g.key[s.whole_row[r] - w.nfe]);
  localise_points(pts, group, g, s, own);
  std::vector<char> mine(g.ghost.size(), 0);
  for (int q : s.owned_ghost) mine[q] = 1;
  for (int q = 0; q < g.ghost.size(); ++q) {
    add_list(g.ghost, q, mine[q], w.nfe, s.nfe, s.local_row, own.ghost);
    add_numbers(g.ghost, g.ghost_w, q, mine[q], 1, own.ghost_w);
  }
  own.ghost_k = g.ghost_k;
  own.ghost_m = g.ghost_m;
}

// list i of whole is that of own, or own has none: D numbers for each item
void take_numbers(const ListTable& whole, const RealVec& w, int D, const ListTable& own, RealVec& numbers)
{
  for (int i = 0; i < own.size() && !w.empty(); ++i)
    std::copy_n(w.begin() + static_cast<long>(whole.off[i]) * D, own.count(i) * D,
                numbers.begin() + static_cast<long>(own.off[i]) * D);
}

// weights on lists that stay
void localise_weights(const ActiveGrid& g, int dim, ActiveGrid& own)
{
  take_numbers(g.corner, g.corner_w, 1, own.corner, own.corner_w);
  take_numbers(g.point, g.dS, dim, own.point, own.dS);
  take_numbers(g.ghost, g.ghost_w, 1, own.ghost, own.ghost_w);
  own.ghost_k = g.ghost_k;
  own.ghost_m = g.ghost_m;
  own.made    = g.made;
}

void localise_bonds(Dofs& s)
{
  const Dofs& w = *s.whole;
  s.bond = ListTable();
  s.bond_w.clear();
  for (int b = 0; b < w.bond.size(); ++b) {
    add_list(w.bond, b, w.bond_owned[b], 0, 0, s.local_row, s.bond);
    add_numbers(w.bond, w.bond_w, b, w.bond_owned[b], 1, s.bond_w);
  }
  s.bond_acts  = w.owned_bond;
  s.bond_owned = w.bond_owned;
  s.group      = ListTable();
  for (int k = 0; k < w.group.size(); ++k) {
    const bool mine = std::binary_search(w.owned_group.begin(), w.owned_group.end(), k);
    add_list(w.group, k, mine, 0, 0, s.local_row, s.group);
  }
  s.group_first = w.group_first;
}

// the rows of whole that belong to each rank
ListTable rows_of_ranks(const Dofs& s)
{
  IntVec own;
  for (int r = 0; r < s.nrow; ++r)
    if (s.owner[r] == comm_rank()) own.push_back(s.whole_row[r]);
  ListTable all;
  for (const IntVec& list : comm_exchange(std::vector<IntVec>(comm_size(), own))) {
    all.item.insert(all.item.end(), list.begin(), list.end());
    all.off.push_back(static_cast<int>(all.item.size()));
  }
  return all;
}

}  // namespace

void dof_local(const Model& m, const Points& pts, bool fresh, Discretisation& d, Dofs& s)
{
  const Dofs& w = *s.whole;
  const Mesh& mesh = m.mesh;
  s.hung = w.hung;
  if (fresh) {
    number_rows(mesh, rows_here(mesh, d.el, d.grid, w), s);
    halo_form(s.row_key, s.halo);
    s.owner       = s.halo.owner;
    s.of_rank     = rows_of_ranks(s);
    s.owned_point = w.owned_point;
    s.owned_bond  = w.owned_bond;
    s.owned_ghost = w.owned_ghost;
    s.owned_group = w.owned_group;
    s.elem_rank   = w.elem_rank;
    s.point_rank  = w.point_rank;
  }
  s.owned_group = w.owned_group;
  if (fresh || d.own.lists != d.grid.lists) localise_grid(pts, d.point_law.group, d.grid, s, d.own);
  else if (d.own.made != d.grid.made) localise_weights(d.grid, s.dim, d.own);
  localise_bonds(s);
}

std::vector<RealVec> dof_gather(const Dofs& s, const std::vector<const RealVec*>& x, int first)
{
  const int D = s.dim, n = static_cast<int>(x.size()), me = comm_rank(), ranks = comm_size();
  // rows of each rank ascend
  const auto begin = [&](int r) {
    const auto of = s.of_rank.item.begin();
    return static_cast<int>(std::lower_bound(of + s.of_rank.off[r], of + s.of_rank.off[r + 1], first) - of);
  };
  IntVec count(ranks), from(ranks);
  size_t all = 0, mine = 0;
  for (int r = 0; r < ranks; ++r) {
    from[r] = begin(r);
    if (r == me) mine = all;
    count[r] = (s.of_rank.off[r + 1] - from[r]) * D * n;
    all += count[r];
  }
  RealVec message(all);
  double* to = message.data() + mine;
  for (int k = from[me]; k < s.of_rank.off[me + 1]; ++k)
    for (const RealVec* v : x)
      to = std::copy_n(v->begin() + static_cast<long>(s.local_row[s.of_rank.item[k]]) * D, D, to);
  comm_allgatherv(message, count);
  std::vector<RealVec> whole(n, RealVec(s.whole->neq()));
  const double* value = message.data();
  for (int r = 0; r < ranks; ++r)
    for (int k = from[r]; k < s.of_rank.off[r + 1]; ++k)
      for (RealVec& v : whole) {
        std::copy_n(value, D, v.begin() + static_cast<long>(s.of_rank.item[k]) * D);
        value += D;
      }
  return whole;
}
