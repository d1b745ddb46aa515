#include <algorithm>

#include "assem/assem.h"
#include "assem/mass_rows.h"
#include "base/timer.h"

namespace {

// values of WIDE consecutive nodes in a vector register; unaligned
const int WIDE = 8;
typedef double Wide __attribute__((vector_size(8 * WIDE), aligned(8), may_alias));

// adds the mass of a point to M, with the map of its node pairs. N [nen][width]: weights of its corners on
// its n nodes, width a multiple of WIDE; mN: scratch of the same size; mc: mass on the corners. NEN = 0:
// number of corners given at run time
template <int NEN>
inline void add_domain(int corners, int n, int width, const double* mc, const double* N, double* mN,
                       const int* map, double* M)
{
  const int nen = NEN ? NEN : corners;
  for (int c = 0; c < nen; ++c)
    for (int first = 0; first < width; first += WIDE) {
      Wide row = {};
      for (int d = 0; d < nen; ++d)
        row += mc[c >= d ? pair_index(c, d) : pair_index(d, c)] *
               *reinterpret_cast<const Wide*>(N + d * width + first);
      *reinterpret_cast<Wide*>(mN + c * width + first) = row;
    }
  for (int a = 0; a < n; ++a)
    for (int first = 0; first <= a; first += WIDE) {
      Wide row = {};
      for (int c = 0; c < nen; ++c)
        row += N[c * width + a] * *reinterpret_cast<const Wide*>(mN + c * width + first);
      for (int b = first; b <= a && b < first + WIDE; ++b) M[*map++ / 2] += row[b - first];
    }
}

// the same for NEN corners on at most WIDE nodes, N [NEN][WIDE], which stay in registers
template <int NEN>
inline void add_narrow_domain(int n, const double* mc, const double* N, const int* map, double* M)
{
  Wide weight[NEN], mN[NEN];
  for (int c = 0; c < NEN; ++c) weight[c] = *reinterpret_cast<const Wide*>(N + c * WIDE);
  for (int c = 0; c < NEN; ++c) {
    mN[c] = Wide{};
    for (int d = 0; d < NEN; ++d) mN[c] += mc[c >= d ? pair_index(c, d) : pair_index(d, c)] * weight[d];
  }
  for (int a = 0; a < n; ++a) {
    Wide row = {};
    for (int c = 0; c < NEN; ++c) row += N[c * WIDE + a] * mN[c];
    for (int b = 0; b <= a; ++b) M[*map++ >> 1] += row[b];
  }
}

// M_vw = sum_cd m_cd N_v(x_c) N_w(x_d) over the corners of each point                (3.12)
// damping: factor alpha [body] of m_cd; null: 1
void add_point_mass(const Points& pts, const ActiveGrid& g, const RealVec* alpha, const Dofs& s, RealVec& M)
{
  RealVec N, mN;
  const int* slot = g.slot.data();
  int at = 0;                  // point to which slot points
  for (size_t own = 0; own < s.rows.owned_point.size(); ++own) {
    const int q = s.rows.owned_point[own];
    for (; at < q; ++at)
      for (int c = 0; c < pts.conn.count(at) && g.point.count(at); ++c)
        slot += g.corner.count(pts.conn.begin(at)[c]);
    const double* mc    = pts.mc(q);
    const double factor = alpha ? (*alpha)[pts.body[q]] : 1.0;
    if (factor == 0.0) continue;
    const int n = g.point.count(q), nen = pts.conn.count(q), width = (n + WIDE - 1) / WIDE * WIDE;
    const int* to = slot;
    const auto weights = [&](double* at_node) {
      for (int c = 0; c < nen; ++c) {
        const int corner = pts.conn.begin(q)[c];
        for (int j = g.corner.off[corner]; j < g.corner.off[corner + 1]; ++j)
          at_node[c * width + *to++] = g.corner_w[j];
      }
    };
    const int* map = &s.pattern.point_map[s.pattern.point_map_off[own]];
    double scaled[36];
    for (int k = 0; k < pair_count(nen) && alpha; ++k) scaled[k] = factor * mc[k];
    const double* of_point = alpha ? scaled : mc;
    if (nen == 4 && width == WIDE) {
      double narrow[4 * WIDE] = {};
      weights(narrow);
      add_narrow_domain<4>(n, of_point, narrow, map, M.data());
      continue;
    }
    N.assign(static_cast<size_t>(nen) * width, 0.0);
    mN.resize(N.size());
    weights(N.data());
    if (nen == 4) add_domain<4>(nen, n, width, of_point, N.data(), mN.data(), map, M.data());
    else if (nen == 8) add_domain<8>(nen, n, width, of_point, N.data(), mN.data(), map, M.data());
    else add_domain<0>(nen, n, width, of_point, N.data(), mN.data(), map, M.data());
  }
}

// index of block (r, c) or (c, r) of A; rows are short, and counting avoids mispredicted branches
int block_of(const SysMatrix& A, int r, int c)
{
  const int row = std::max(r, c), column = std::min(r, c), first = A.off[row], n = A.off[row + 1] - first;
  const int* col = A.col.data() + first;
  int before = 0;
  for (int k = 0; k < n; ++k) before += col[k] < column;
  return first + before;
}

// Blocks of A of the pairs of unknowns of a corner: corners with the same unknowns, as those in one cell, are
// looked up once
struct CornerBlocks {
  const ActiveGrid& g;
  const Dofs& s;
  IntVec last;                 // [unknown] corner with blocks whose list begins with it, -1
  std::vector<size_t> at;      // [unknown] its blocks in block
  IntVec room;                 // [unknown] number of these
  IntVec block;                // row after row, columns at most the row; -1: above the diagonal

  CornerBlocks(const ActiveGrid& grid, const Dofs& dofs)
      : g(grid), s(dofs), last(dofs.rows.nrow, -1), at(dofs.rows.nrow, 0), room(dofs.rows.nrow, 0)
  {
  }

  const int* of(int c)
  {
    const int n = g.corner.count(c), *item = g.corner.begin(c), nfe = s.rows.nfe, r = nfe + item[0];
    const int before = last[r];
    if (before >= 0 && g.corner.count(before) == n && std::equal(item, item + n, g.corner.begin(before)))
      return &block[at[r]];
    last[r] = c;
    if (n * n > room[r]) {
      at[r]   = block.size();
      room[r] = n * n;
      block.resize(at[r] + static_cast<size_t>(n) * n);
    }
    int* to = &block[at[r]];
    for (int j = 0; j < n; ++j)
      for (int k = 0; k < n; ++k)
        *to++ = item[k] > item[j] ? -1 : block_of(s.pattern.A, nfe + item[j], nfe + item[k]);
    return &block[at[r]];
  }
};

// explicit, with corners that follow others: their mass acts at these                 (6.47)
void add_corner_mass(const ActiveGrid& g, const Dofs& s, RealVec& M)
{
  const CornerMass& m = s.mass.corner_mass;
  const int ncorner   = static_cast<int>(m.carried.size());
  CornerBlocks blocks(g, s);
  RealVec value;
  const auto add_own = [&](int c, double mass) {               // N_c mass N_c, lower part
    const int n = g.corner.count(c);
    if (n == 0) return;
    const double* w = &g.corner_w[g.corner.off[c]];
    value.resize(n);
    for (const int *to = blocks.of(c), *row = to; row < to + n * n; row += n) {
      const double part = mass * w[(row - to) / n];
      for (int k = 0; k < n; ++k) value[k] = part * w[k];
      for (int k = 0; k < n; ++k)
        if (row[k] >= 0) M[row[k]] += value[k];
    }
  };
  const auto add = [&](int c, int d, double mass) {            // N_c mass N_d and its mirror image
    for (int j = g.corner.off[c]; j < g.corner.off[c + 1]; ++j)
      for (int k = g.corner.off[d]; k < g.corner.off[d + 1]; ++k) {
        const int r = s.rows.nfe + g.corner.item[j], q = s.rows.nfe + g.corner.item[k];
        const double part = mass * g.corner_w[j] * g.corner_w[k];
        M[block_of(s.pattern.A, r, q)] += r == q ? 2.0 * part : part;
      }
  };
  for (int c = 0; c < ncorner; ++c) {
    if (m.carried[c] != 0.0) add_own(c, m.carried[c]);
    for (int k = m.off[c]; k < m.off[c + 1]; ++k)
      if (m.val[k] != 0.0) add(c, m.col[k], m.val[k]);
  }
}

// do corners follow nodes or other corners?
bool followers(const Points& pts)
{
  return std::any_of(pts.hangs.begin(), pts.hangs.end(), [](int on) { return on != HANG_GRID; });
}

// ghost mass                                                                       (3.16)
void add_ghost_mass(const ActiveGrid& grid, Dofs& s)
{
  const size_t* at = s.pattern.ghost_map_off.data();
  for (int q = 0; q < grid.ghost.size(); ++q) {
    const int n = grid.ghost.count(q), *map = &s.pattern.ghost_map[*at++];
    const double* w = &grid.ghost_w[grid.ghost.off[q]];
    for (int a = 0; a < n; ++a)
      for (int b = 0; b <= a; ++b) s.mass.M[*map++ / 2] += grid.ghost_m[q] * w[a] * w[b];
  }
}

// damping: alpha times the mass
void add_element_mass(const Elements& el, bool damping, const Dofs& s, RealVec& M)
{
  const int* map = s.pattern.elem_map.data();
  for (const ElemBlock& b : el.block) {
    const int pairs     = pair_count(shape_info[b.shape].nen);
    const double factor = damping ? b.alpha : 1.0;
    for (int slot : b.live) {
      const double* me = elem_mass(b, slot);
      for (int k = 0; k < pairs; ++k) M[*map++ / 2] += factor * me[k];
    }
  }
}

void form_mass(const Points& pts, const Discretisation& d, Dofs& s)
{
  if (s.rows.hung && s.mass.mass_of == s.pattern.number) {
    s.mass.M = s.mass.M_elem;
  } else {
    s.mass.M.assign(s.pattern.A.col.size(), 0.0);
    add_element_mass(d.el, false, s, s.mass.M);
    s.mass.M_elem.clear();
    if (s.rows.hung) s.mass.M_elem = s.mass.M;
  }
  if (s.rows.lumps && followers(pts)) add_corner_mass(d.grid, s, s.mass.M);
  else add_point_mass(pts, d.grid, nullptr, s, s.mass.M);
  add_ghost_mass(d.grid, s);
  mass_diagonals(s);
}

}  // namespace

void mass_diagonals(Dofs& s)
{
  s.mass.M_here.resize(s.rows.nrow);
  s.mass.coupled.clear();
  const double* M = s.mass.M.data();
  for (int r = 0; r < s.rows.nrow; ++r) {
    const int first = s.pattern.A.off[r], last = s.pattern.A.off[r + 1] - 1;
    s.mass.M_here[r] = M[last];
    if (std::any_of(M + first, M + last, [](double m) { return m != 0.0; })) s.mass.coupled.push_back(r);
  }
  s.mass.M_diag = s.mass.M_here;
  sys_sum(s.pattern.A, s.mass.M_diag);
}

void assem_mass(const Points& pts, const Discretisation& d, Dofs& s)
{
  const long made = d.grid.made;
  if (s.mass.mass_of == s.pattern.number && s.mass.mass_made == made) return timer_skip(PHASE_MASS);
  Timer timer(PHASE_MASS);
  form_mass(pts, d, s);
  if (s.mass.mass_of != s.pattern.number)
    s.mass.mass_rows = pts.npoint_all() ? mass_rows_projection(d.grid, s) : nullptr;
  s.mass.mass_of   = s.pattern.number;
  s.mass.mass_made = made;
}

void assem_lumped(Dofs& s)
{
  RealVec sums;
  mass_multiply(s, RealVec(s.rows.neq(), 1.0), sums);
  s.mass.lumped.resize(s.rows.nrow);
  for (int r = 0; r < s.rows.nrow; ++r) s.mass.lumped[r] = sums[r * s.rows.dim];
}

void mass_damping(const Model& m, const Points& pts, const Discretisation& d, const Dofs& s, RealVec& M)
{
  RealVec alpha;
  for (const Body& b : m.body) alpha.push_back(m.material[b.material].alpha);
  M.assign(s.pattern.A.col.size(), 0.0);
  add_element_mass(d.el, true, s, M);
  add_point_mass(pts, d.grid, &alpha, s, M);
}
