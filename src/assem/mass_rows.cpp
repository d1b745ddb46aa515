#include "assem/mass_rows.h"

#include <algorithm>
#include <iterator>
#include <map>

#include "base/forest.h"
#include "base/gather_lists.h"

namespace {

// Layers of nodes around points: the change by the projection decays by 0.27 from layer to layer, to 1e-15
// (theory 3.4)  (test: Divided.MassProjection)
const int LAYERS = 26;

// distances steps [nrow] of all rows within LAYERS of the rows from, whose steps are given
void spread(const ListTable& graph, const IntVec& from, IntVec& steps)
{
  std::vector<IntVec> list(LAYERS + 1);
  for (int r : from) list[steps[r]].push_back(r);
  for (int d = 0; d < LAYERS; ++d)
    for (int r : list[d]) {
      if (steps[r] < d) continue;
      for (int k = graph.off[r]; k < graph.off[r + 1]; ++k) {
        const int c = graph.item[k];
        if (steps[c] <= d + 1) continue;
        steps[c] = d + 1;
        list[d + 1].push_back(c);
      }
    }
}

// minimum over the ranks; returns the rows with fewer steps on another rank
IntVec agree(const Halo& h, IntVec& steps)
{
  std::vector<IntVec> to(h.common.size());
  for (size_t r = 0; r < to.size(); ++r)
    for (int k : h.common[r]) to[r].push_back(steps[k]);
  const std::vector<IntVec> from = comm_exchange(to);
  IntVec fewer;
  for (size_t r = 0; r < to.size(); ++r)
    for (size_t i = 0; i < from[r].size(); ++i) {
      int& own = steps[h.common[r][i]];
      if (from[r][i] < own) fewer.push_back(h.common[r][i]);
      own = std::min(own, from[r][i]);
    }
  return fewer;
}

// [nrow] 1: a row near points of this rank or another one, by blocks of M that may be nonzero
std::vector<char> near_points(const ActiveGrid& grid, const Dofs& s, const std::vector<char>& may)
{
  IntVec steps(s.rows.nrow, LAYERS + 1);
  std::fill(steps.begin() + s.rows.nfe, steps.end(), 0);
  for (int q : s.rows.owned_point)
    for (int k = grid.point.off[q]; k < grid.point.off[q + 1]; ++k)
      steps[s.rows.nfe + grid.point.item[k]] = 0;
  const ListTable graph = sys_graph(s.pattern.A, &may);
  IntVec from;
  for (int r = 0; r < s.rows.nrow; ++r)
    if (steps[r] == 0) from.push_back(r);
  spread(graph, from, steps);
  if (sys_shared(s.pattern.A)) {                             // across borders, with equal steps on all ranks
    spread(graph, agree(s.pattern.A.halo, steps), steps);
    agree(s.pattern.A.halo, steps);
  }
  std::vector<char> near(s.rows.nrow);
  for (int r = 0; r < s.rows.nrow; ++r) near[r] = steps[r] <= LAYERS;
  return near;
}

// the halo of chosen rows; at [nrow]: their numbers, -1: not chosen
Halo halo_of(const Halo& h, const MassRows& m, const IntVec& at)
{
  const auto chosen = [&](const IntVec& list) {
    IntVec out;
    for (int r : list)
      if (at[r] >= 0) out.push_back(at[r]);
    return out;
  };
  Halo out;
  for (const IntVec& list : h.common) out.common.push_back(chosen(list));
  out.shared = chosen(h.shared);
  std::sort(out.shared.begin(), out.shared.end());
  for (int r : m.row) out.owner.push_back(h.owner[r]);
  return out;
}

// number of the set of ranks that share a row of the border                          [Halo::shared]
IntVec sets_of_ranks(const MassRows& m)
{
  std::vector<IntVec> ranks(m.halo.shared.size());
  for (size_t r = 0; r < m.halo.common.size(); ++r)
    for (int row : m.halo.common[r]) ranks[row - m.alone].push_back(static_cast<int>(r));
  std::map<IntVec, int> number;
  IntVec set;
  for (const IntVec& of : ranks)
    set.push_back(number.emplace(of, static_cast<int>(number.size())).first->second);
  return set;
}

// A pair of rows of the border that several ranks may have
struct BorderPair {
  int row, col;                // of the border, row > col
  bool operator<(const BorderPair& o) const { return row != o.row ? row < o.row : col < o.col; }
};

// Exchanges the pairs own, ascending, with numbers all[k], between the ranks that have both rows. Collective
void join_border(const std::vector<BorderPair>& own, const IntVec& all, MassRows& m)
{
  const int ranks = comm_size(), me = comm_rank();
  const size_t n = m.halo.shared.size();
  std::vector<std::vector<BorderPair>> to(ranks);    // indices into Halo::common
  m.border_to.assign(ranks, IntVec());
  for (int r = 0; r < ranks; ++r) {
    IntVec index(n, -1);
    for (size_t i = 0; i < m.halo.common[r].size(); ++i)
      index[m.halo.common[r][i] - m.alone] = static_cast<int>(i);
    for (size_t k = 0; k < own.size(); ++k) {
      if (index[own[k].row] < 0) continue;
      to[r].push_back({index[own[k].row], index[own[k].col]});
      m.border_to[r].push_back(all[k]);
    }
    m.border_to[r].shrink_to_fit();
  }
  std::vector<std::vector<BorderPair>> of = comm_exchange(to);
  std::vector<BorderPair> pair = own, joined;        // ascending, as the pairs of other ranks
  for (int r = 0; r < ranks; ++r) {
    for (BorderPair& q : of[r])
      q = {m.halo.common[r][q.row] - m.alone, m.halo.common[r][q.col] - m.alone};
    joined.clear();
    std::set_union(pair.begin(), pair.end(), of[r].begin(), of[r].end(), std::back_inserter(joined));
    pair.swap(joined);
  }
  of[me]          = own;
  m.border_to[me] = all;
  m.border.off.assign(n + 1, 0);
  m.border.col.reserve(pair.size());
  for (const BorderPair& q : pair) {
    ++m.border.off[q.row + 1];
    m.border.col.push_back(q.col);
  }
  for (size_t b = 0; b < n; ++b) m.border.off[b + 1] += m.border.off[b];
  m.border_at.assign(ranks, IntVec());
  for (int r = 0; r < ranks; ++r) {
    int at = 0;
    m.border_at[r].reserve(of[r].size());
    for (const BorderPair& q : of[r]) {
      while (pair[at] < q) ++at;
      m.border_at[r].push_back(at);
    }
  }
}

void sort_border(MassRows& m)
{
  const IntVec& shared = m.halo.shared;
  m.alone -= static_cast<int>(shared.size());
  for (int r : shared) m.owned.push_back(m.halo.owner[r] == comm_rank() ? 1.0 : 0.0);
  const IntVec set = sets_of_ranks(m);
  std::vector<BorderPair> own;
  IntVec own_from;
  std::vector<std::array<int, 2>> row;               // of pairs: column, all
  for (int r = m.alone; r < m.size(); ++r) {
    row.clear();
    const int a = r - m.alone;
    for (int k = m.all.off[r]; k < m.all.off[r + 1]; ++k) {
      const int c = m.all.col[k], b = c - m.alone;
      if (b < 0) {
        m.cross.item.push_back(c);
        m.cross_from.push_back(k);
      } else if (set[a] == set[b]) {
        row.push_back({b, k});
      } else {
        m.edge.push_back({r, c});
        m.edge_from.push_back(k);
      }
    }
    m.cross.off.push_back(static_cast<int>(m.cross.item.size()));
    std::sort(row.begin(), row.end());
    for (const auto& q : row) {
      own.push_back({a, q[0]});
      own_from.push_back(q[1]);
    }
  }
  for (IntVec* x : {&m.cross.item, &m.cross_from, &m.edge_from}) x->shrink_to_fit();
  m.edge.shrink_to_fit();
  join_border(own, own_from, m);
}

// take [nrow]: a row is chosen; may(k): block k can be nonzero
template <class May>
void form(const Dofs& s, const std::vector<char>& take, May may, MassRows& m)
{
  IntVec at(s.rows.nrow, -1), border;
  if (sys_shared(s.pattern.A)) border = s.pattern.A.halo.shared;
  std::vector<char> last(s.rows.nrow, 0);
  for (int r : border) last[r] = 1;
  // the same order on all ranks
  std::sort(border.begin(), border.end(),
            [&](int a, int b) { return s.rows.row_key[a] < s.rows.row_key[b]; });
  const auto add = [&](int r) {
    if (!take[r]) return;
    at[r] = m.size();
    m.row.push_back(r);
  };
  for (int r = 0; r < s.rows.nrow; ++r)
    if (!last[r]) add(r);
  for (int r : border) add(r);
  const auto each = [&](auto use) {
    for (int r = 0; r < s.rows.nrow; ++r)
      for (int k = s.pattern.A.off[r]; k < s.pattern.A.off[r + 1] - 1; ++k)
        if ((take[r] || take[s.pattern.A.col[k]]) && may(k)) use(r, s.pattern.A.col[k], k);
  };
  m.alone     = m.size();
  IntVec& off = m.all.off;
  off.assign(m.size() + 1, 0);
  each([&](int r, int c, int k) {
    if (take[r] && take[c]) ++off[std::max(at[r], at[c]) + 1];
    else m.rim.push_back(take[r] ? MassRim{at[r], c, k} : MassRim{at[c], r, k});
  });
  for (int r = 0; r < m.size(); ++r) off[r + 1] += off[r];
  m.all.col.resize(off.back());
  m.all.from.resize(off.back());
  IntVec next(off.begin(), off.end() - 1);
  each([&](int r, int c, int k) {
    if (!take[r] || !take[c]) return;
    const int to = next[std::max(at[r], at[c])]++;
    m.all.col[to]  = std::min(at[r], at[c]);
    m.all.from[to] = k;
  });
  if (!sys_shared(s.pattern.A)) return;
  m.halo = halo_of(s.pattern.A.halo, m, at);
  sort_border(m);
}

// one rank: takes the islands out of the chosen rows
template <class May>
void take_islands(const Dofs& s, May may, std::vector<char>& take, MassRows& m)
{
  const SysMatrix& A = s.pattern.A;
  const int nrow = s.rows.nrow;
  if (sys_shared(A)) return;
  Forest parts(nrow);
  for (int r = 0; r < nrow; ++r)
    for (int k = A.off[r]; k < A.off[r + 1] - 1; ++k)
      if (may(k)) parts.join(r, A.col[k]);
  IntVec size(nrow, 0), number(nrow, -1), at(nrow, -1);
  for (int r = 0; r < nrow; ++r) size[parts.root(r)] += take[r] ? 1 : MAX_ISLAND + 1;
  int count = 0;
  for (int r = 0; r < nrow; ++r)
    if (parts.root(r) == r && size[r] <= MAX_ISLAND) number[r] = count++;
  m.island = gather_lists(count, [&](auto use) {
    for (int r = 0; r < nrow; ++r)
      if (number[parts.root(r)] >= 0) use(number[parts.root(r)], r);
  });
  for (int i = 0; i < count; ++i) {
    const int n = m.island.count(i), *row = m.island.begin(i);
    const size_t from = m.island_from.size();
    m.island_from.resize(from + pair_count(n), -1);
    for (int a = 0; a < n; ++a) at[row[a]] = a;
    for (int a = 0; a < n; ++a) {
      take[row[a]] = 0;
      for (int k = A.off[row[a]]; k < A.off[row[a] + 1]; ++k)
        if (may(k) || k == A.off[row[a] + 1] - 1) m.island_from[from + pair_index(a, at[A.col[k]])] = k;
    }
  }
}

std::vector<char> rows_from(const Dofs& s, int first)
{
  std::vector<char> take(s.rows.nrow, 1);
  std::fill(take.begin(), take.begin() + first, 0);
  return take;
}

// rows that may[k] couples with others; for the rest the system is a division, see mass_solve
std::vector<char> coupled_rows(const Dofs& s, const std::vector<char>& may)
{
  std::vector<char> take(s.rows.nrow, 0);
  for (int r = s.rows.nfe; r < s.rows.nrow; ++r)
    for (int k = s.pattern.A.off[r]; k < s.pattern.A.off[r + 1] - 1; ++k)
      if (may[k]) take[r] = take[s.pattern.A.col[k]] = 1;
  return take;
}

}  // namespace

std::shared_ptr<const MassRows> mass_rows_of(const Dofs& s, MassRowsOf of)
{
  auto m = std::make_shared<MassRows>();
  m->of  = of;
  const auto couples = [&](int k) { return s.mass.M[k] != 0.0; };
  std::vector<char> take = rows_from(s, of == ROWS_ALL ? 0 : s.rows.nfe);
  take_islands(s, couples, take, *m);
  form(s, take, couples, *m);
  return m;
}

std::shared_ptr<const MassRows> mass_rows_projection(const ActiveGrid& grid, const Dofs& s)
{
  std::vector<char> may(s.mass.M.size());
  // points without a map (dof_form): every block is one of theirs
  const bool all = !s.rows.owned_point.empty() && s.pattern.point_map_off.empty();
  for (size_t k = 0; k < may.size(); ++k) may[k] = all || s.mass.M[k] != 0.0;
  for (const IntVec* map : {&s.pattern.point_map, &s.pattern.ghost_map})
    for (int k : *map) may[k / 2] = 1;
  for (int r = 0; r < s.rows.nrow && s.rows.lumps; ++r)        // couplings of nodes: none       (6.47)
    for (int k = s.pattern.A.off[r]; k < s.pattern.A.off[r + 1] - 1; ++k)
      may[k] = may[k] && s.pattern.A.col[k] >= s.rows.nfe;
  auto m = std::make_shared<MassRows>();
  m->of  = s.rows.hung ? ROWS_NEAR : ROWS_GRID;
  const auto can = [&](int k) { return may[k] != 0; };
  const bool coupled = s.rows.lumps && !sys_shared(s.pattern.A);
  std::vector<char> take = coupled ? coupled_rows(s, may)
      : s.rows.hung                ? near_points(grid, s, may)
                                   : rows_from(s, s.rows.nfe);
  take_islands(s, can, take, *m);
  form(s, take, can, *m);
  return m;
}
