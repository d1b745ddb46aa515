#include "assem/mass_rows.h"

#include <algorithm>

namespace {

// Layers of nodes around points: what the projection changes falls to 0.27 from one to the next
const int NEAR = 26;

// steps [nrow] of all rows that are near those with 0, the others have more than NEAR
void spread(const ListTable& graph, IntVec& steps)
{
  std::vector<IntVec> list(NEAR + 1);
  for (int r = 0; r < graph.size(); ++r)
    if (steps[r] <= NEAR) list[steps[r]].push_back(r);
  for (int d = 0; d < NEAR; ++d)
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

// the fewest of all ranks
void agree(const Halo& h, IntVec& steps)
{
  std::vector<IntVec> to(h.common.size());
  for (size_t r = 0; r < to.size(); ++r)
    for (int k : h.common[r]) to[r].push_back(steps[k]);
  const std::vector<IntVec> from = comm_exchange(to);
  for (size_t r = 0; r < to.size(); ++r)
    for (size_t i = 0; i < from[r].size(); ++i)
      steps[h.common[r][i]] = std::min(steps[h.common[r][i]], from[r][i]);
}

// [nrow] a row near points that this rank or another works on
std::vector<char> near_points(const ActiveGrid& grid, const Dofs& s)
{
  IntVec steps(s.nrow, NEAR + 1);
  std::fill(steps.begin() + s.nfe, steps.end(), 0);
  for (int q : s.owned_point)
    for (int k = grid.point.off[q]; k < grid.point.off[q + 1]; ++k) steps[s.nfe + grid.point.item[k]] = 0;
  const ListTable graph = sys_graph(s.A);
  spread(graph, steps);
  for (int again = 0; again < 2 && sys_shared(s.A); ++again) {     // far enough, and border rows as agreed
    agree(s.A.halo, steps);
    if (again == 0) spread(graph, steps);
  }
  std::vector<char> near(s.nrow);
  for (int r = 0; r < s.nrow; ++r) near[r] = steps[r] <= NEAR;
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
  for (int r : m.row) out.owner.push_back(h.owner[r]);
  return out;
}

void sort_border(MassRows& m)
{
  const IntVec& shared = m.halo.shared;
  m.alone = m.size() - static_cast<int>(shared.size());
  for (int r : shared) m.owned.push_back(m.halo.owner[r] == comm_rank() ? 1.0 : 0.0);
  std::vector<std::vector<std::array<int, 2>>> cross(shared.size());
  for (int r = 0; r < m.size(); ++r) {
    for (int k = m.all.off[r]; k < m.all.off[r + 1]; ++k) {
      const int c = m.all.col[k];
      if (c >= m.alone) {
        m.edge.push_back({r, c});
        m.edge_from.push_back(k);
      } else if (r >= m.alone) {
        cross[r - m.alone].push_back({c, k});
      } else {
        m.inner.col.push_back(c);
        m.inner.from.push_back(k);
      }
    }
    m.inner.off.push_back(static_cast<int>(m.inner.col.size()));
  }
  for (const auto& row : cross) {
    for (const auto& q : row) {
      m.cross.item.push_back(q[0]);
      m.cross_from.push_back(q[1]);
    }
    m.cross.off.push_back(static_cast<int>(m.cross.item.size()));
  }
}

// take [nrow]: a row is chosen; may(k): block k can be other than 0
template <class May>
void form(const Dofs& s, const std::vector<char>& take, May may, MassRows& m)
{
  IntVec at(s.nrow, -1);
  std::vector<char> border(s.nrow, 0);
  if (sys_shared(s.A))
    for (int r : s.A.halo.shared) border[r] = 1;
  for (const char behind : {0, 1})
    for (int r = 0; r < s.nrow; ++r) {
      if (!take[r] || border[r] != behind) continue;
      at[r] = m.size();
      m.row.push_back(r);
    }
  const auto each = [&](auto use) {
    for (int r = 0; r < s.nrow; ++r)
      for (int k = s.A.off[r]; k < s.A.off[r + 1] - 1; ++k)
        if ((take[r] || take[s.A.col[k]]) && may(k)) use(r, s.A.col[k], k);
  };
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
  if (!sys_shared(s.A)) return;
  m.halo = halo_of(s.A.halo, m, at);
  sort_border(m);
}

std::vector<char> behind(const Dofs& s, int first)
{
  std::vector<char> take(s.nrow, 1);
  std::fill(take.begin(), take.begin() + first, 0);
  return take;
}

}  // namespace

std::shared_ptr<const MassRows> mass_rows_from(const Dofs& s, int first)
{
  auto m = std::make_shared<MassRows>();
  m->first = first;
  form(s, behind(s, first), [&](int k) { return s.M[k] != 0.0; }, *m);
  return m;
}

std::shared_ptr<const MassRows> mass_rows_projection(const ActiveGrid& grid, const Dofs& s)
{
  std::vector<char> may(s.M.size());
  for (size_t k = 0; k < may.size(); ++k) may[k] = s.M[k] != 0.0;
  for (const IntVec* map : {&s.point_map, &s.ghost_map})
    for (int k : *map) may[k / 2] = 1;
  auto m = std::make_shared<MassRows>();
  if (!s.hung) m->first = s.nfe;
  form(s, s.hung ? near_points(grid, s) : behind(s, s.nfe), [&](int k) { return may[k]; }, *m);
  return m;
}
