#include <algorithm>
#include <bitset>
#include <cmath>
#include <numeric>

#include "base/comm.h"
#include "dof/dof.h"

namespace {

// The work of elements and the work of points are balanced separately: rows and iterations scale with
// elements, active grid and projection with points
enum WorkKind { WORK_ELEM, WORK_POINT, WORK_KINDS };

// Work of broken relative to intact material, measured in paper/p9_griffith (doc/benchmarks.md, "What two
// ranks lose"): a broken C3D8 is formed outside packs and costs as much as 13 intact ones; a broken point
// costs 0.66 of an intact one for each node pair, plus PAIRS_OF_LAW pairs for its law  (no test)
const double BROKEN_ELEM = 13.0, BROKEN_POINT = 0.66, PAIRS_OF_LAW = 110.0;

// work of an element (half for a pack of eight) and of a point with this number
// of node pairs, in the same unit
double elem_work(Shape shape, bool broken)
{
  return (broken ? BROKEN_ELEM : 1.0) * 0.5 * pair_count(shape_info[shape].nen) * shape_info[shape].ngp;
}
double point_work(double pairs, bool broken)
{
  return 2.0 * (broken ? BROKEN_POINT * (pairs + PAIRS_OF_LAW) : pairs);
}

// Number of distinct grid nodes of the cells that contain positions x (in cells, [n*3]); a position on a grid
// line has only the nodes of the line. Nodes of distant positions are not compared
int nodes_around(int dim, int n, const double* x)
{
  const int max_nodes = 6;     // in a direction, for the comparison
  int low[3] = {0, 0, 0}, size[3] = {1, 1, 1};
  bool small = true;
  for (int i = 0; i < dim; ++i) {
    double lo = 1e300, hi = -1e300;
    for (int k = 0; k < n; ++k) {
      lo = std::min(lo, std::floor(x[3 * k + i]));
      hi = std::max(hi, std::ceil(x[3 * k + i]));
    }
    small   = small && hi - lo + 1.0 <= max_nodes;
    low[i]  = small ? static_cast<int>(lo) : 0;
    size[i] = small ? static_cast<int>(hi - lo) + 1 : 1;
  }
  if (!small) return n << dim;
  std::bitset<max_nodes * max_nodes * max_nodes> seen;
  for (int k = 0; k < n; ++k)
    for (int a = 0; a < 1 << dim; ++a) {
      int at[3] = {0, 0, 0};
      for (int i = 0; i < dim; ++i) {
        const double xi = x[3 * k + i];
        at[i] = static_cast<int>(a >> i & 1 ? std::ceil(xi) : std::floor(xi)) - low[i];
      }
      seen[(at[2] * size[1] + at[1]) * size[0] + at[0]] = true;
    }
  return static_cast<int>(seen.count());
}

// Node pairs of a point, estimated without its lists: grid nodes around the corners that the grid carries,
// and one node for each hanging corner
//   in   uc   displacements of the corners
double pairs_of_point(const Model& m, const Points& pts, const RealVec& uc, int q)
{
  const int corners = pts.conn.count(q), dim = m.dim;
  int free = 0;                // corners on the grid
  double x[24];                // positions of these, in cells
  for (int k = pts.conn.off[q]; k < pts.conn.off[q + 1]; ++k) {
    const int c = pts.conn.item[k];
    if (pts.carrier(c) != HANG_GRID) continue;
    for (int i = 0; i < dim; ++i) {
      const size_t at = static_cast<size_t>(c) * dim + i;
      x[3 * free + i] = (pts.Xc[at] + uc[at] - m.grid.lo[i]) / m.grid.h[i];
    }
    ++free;
  }
  const int nodes = free > 0 ? nodes_around(dim, free, x) : 0;
  return pair_count(nodes + corners - free);
}

// Work of a point: rows and iterations, as of an element with the same number of node pairs, and its own
struct PointWork { double rows, material; };
PointWork work_of_point(const Model& m, const Points& pts, const RealVec& uc, int q)
{
  const double pairs = pairs_of_point(m, pts, uc, q);
  const int e = pts.parent[q];
  PointWork w = {0.0, point_work(pairs, pts.eroded(q))};
  if (e < 0) return w;
  int points = 1;
  for (int p = pts.next[q]; p != q; p = pts.next[p]) ++points;
  const Shape shape = elem_table[m.mesh.elem_type[e]].shape;
  w.rows = elem_work(shape, false) / points * pairs / pair_count(shape_info[shape].nen);
  return w;
}

// ---- transfer of the points of elements between ranks ----

// work of a rank, and its centre
struct RankWork { double all = 0.0, centre[3] = {0, 0, 0}; };

double mean_work(const std::vector<RankWork>& rank)
{
  double mean = 0.0;
  for (const RankWork& r : rank) mean += r.all / static_cast<double>(rank.size());
  return mean;
}

bool less_work(const RankWork& a, const RankWork& b) { return a.all < b.all; }

std::vector<RankWork> work_of_ranks(const Model& m, const Elements& el)
{
  RankWork own;
  double count = 0.0;
  for (const ElemBlock& b : el.block)
    for (int slot : b.live) {
      own.all += elem_work(b.shape, el.broken(b.elem[slot]) >= 0);
      for (int i = 0; i < 3; ++i) own.centre[i] += m.mesh.X[3 * m.mesh.conn.begin(b.elem[slot])[0] + i];
      count += 1.0;
    }
  for (double& x : own.centre) x /= std::max(count, 1.0);
  std::vector<RankWork> all(1, own);
  comm_allgatherv(all);
  return all;
}

double largest_part(const std::vector<RankWork>& rank)
{
  return std::max_element(rank.begin(), rank.end(), less_work)->all / mean_work(rank);
}

// points and groups of this rank; rank [npoint]: the owner of each, empty: this rank
void take_points(const IntVec& rank, const ActiveGrid& grid, Dofs& s)
{
  const auto owned = [&](int q) { return rank.empty() || rank[q] == comm_rank(); };
  s.rows.owned_point.clear();
  for (int q = 0; q < grid.point.size(); ++q)
    if (owned(q)) s.rows.owned_point.push_back(q);
  s.rows.owned_group.clear();
  for (int k = 0; k < s.rows.group.size(); ++k)
    if (owned(s.rows.group_first[k])) s.rows.owned_group.push_back(k);
}

// largest work of a rank over the mean, above which it transfers points to another one. P9 on two ranks,
// whole run: 80.9 s with 1.05, 79.7 with 1.02, 80.7 with 1.005  (no test)
const double TRANSFER_ABOVE = 1.02;

// an element whose points move to another rank, by the number of its first point
struct Handed { int point, rank; };

// [nelem] 1: another rank stores the points of e and of all elements around it, and there is no contact
// point. Only then can that rank own them: all ranks with a corner of e then share an element containing it
// with that rank, and agree on the owner of the corner.
//   in   common   elements whose points both ranks store; this rank stores all elements around e
std::vector<char> inside(const Model& m, const IntVec& common)
{
  const Mesh& mesh = m.mesh;
  std::vector<char> both(mesh.nelem(), 0), rim(mesh.nnode(), 0);
  for (int e : common) both[e] = 1;
  const auto each = [&](int e, auto use) {
    std::for_each(mesh.conn.begin(e), mesh.conn.begin(e + 1), use);
  };
  for (const ConversionDef& c : m.conversion)
    for (int e : c.elem)
      if (!both[e]) each(e, [&](int n) { rim[n] = 1; });
  // contact points stay on the ranks that store the master faces near them
  for (const BondDef& d : m.bond)
    if (d.pair())
      for (const Face& f : m.surface[d.surface].face) each(f.elem, [&](int n) { rim[n] = 1; });
  for (int e : common) each(e, [&](int n) { both[e] = both[e] && !rim[n]; });
  return both;
}

// Points that the rank with the most work transfers to the least loaded one among the ranks that store points
// of it: elements furthest in its direction first
std::vector<Handed> hand_over(const Model& m, const Points& pts, const RealVec& work,
                              const std::vector<RankWork>& rank, const IntVec& of)
{
  const Halo& around = m.part.around_points;
  const int me = comm_rank();
  const double mean = mean_work(rank);
  const auto movable = [&](int e) { return pts.converted(e) && of[pts.of_elem[e]] == me; };
  std::vector<Handed> out;
  int to = -1;
  for (int r = 0; r < static_cast<int>(rank.size()) && around.on(); ++r)
    if (r != me && (to < 0 || rank[r].all < rank[to].all) &&
        std::any_of(around.common[r].begin(), around.common[r].end(), movable))
      to = r;
  if (to < 0) return out;
  std::vector<std::pair<double, int>> list;          // minus the distance in its direction, element
  const std::vector<char> known = inside(m, around.common[to]);
  for (int e : around.common[to])
    if (movable(e) && known[e]) {
      double along = 0.0, X[3];
      point_centre(pts, m.dim, pts.of_elem[e], X);
      for (int i = 0; i < 3; ++i)
        along += X[i] * (rank[to].centre[i] - rank[me].centre[i]);
      list.emplace_back(-along, e);
    }
  std::sort(list.begin(), list.end());
  double had = rank[to].all, left = rank[me].all;
  for (const auto& [along, e] : list) {
    double all = 0.0;
    for (int p = pts.of_elem[e]; p < pts.npoint && pts.parent[p] == e; ++p) all += work[p];
    if (had + all > mean || left - all < mean) break;
    had += all;
    left -= all;
    out.push_back({pts.part.point[pts.of_elem[e]], to});
  }
  return out;
}

}  // namespace

void dof_share_points(const Model& m, const Elements& el, const RealVec& uc, Points& pts, Division& d)
{
  const int made = pts.part.npoint + pts.part.ncorner;         // new corners have new owners
  if (d.made == made && d.ranks == comm_size()) return;
  if (d.ranks != comm_size()) d = Division();
  d.elem.clear();
  d.ranks  = comm_size();
  d.pieces = true;
  d.made   = made;
  const IntVec rank_of = point_ranks(m.part, pts);
  d.point.insert(d.point.end(), rank_of.begin() + static_cast<long>(d.point.size()), rank_of.end());
  RealVec work(pts.npoint, 0.0);                     // of points of this rank
  const auto take = [&](int q) { work[q] = point_work(pairs_of_point(m, pts, uc, q), pts.eroded(q)); };
  for (int q = 0; q < pts.npoint; ++q)
    if (d.point[q] == comm_rank()) take(q);
  const std::vector<RankWork> elements = work_of_ranks(m, el);
  const auto loads = [&] {
    std::vector<RankWork> rank(1, elements[comm_rank()]);
    for (int q = 0; q < pts.npoint; ++q)
      if (d.point[q] == comm_rank()) rank[0].all += work[q];
    comm_allgatherv(rank);
    return rank;
  };
  std::vector<RankWork> rank = loads();
  const bool even = largest_part(rank) <= TRANSFER_ABOVE * std::max(1.0, d.excess);
  for (int k = 0; k < 4 * comm_size() && !even; ++k) {
    const int from = static_cast<int>(std::max_element(rank.begin(), rank.end(), less_work) - rank.begin());
    std::vector<Handed> handed;
    if (from == comm_rank() && rank[from].all > TRANSFER_ABOVE * mean_work(rank))
      handed = hand_over(m, pts, work, rank, d.point);
    comm_allgatherv(handed);
    if (handed.empty()) break;
    d.handed = true;
    for (const Handed& h : handed) {
      const int here = pts.point_here(h.point);
      for (int q = here; here >= 0 && q < pts.npoint && pts.parent[q] == pts.parent[here]; ++q) {
        d.point[q] = h.rank;
        if (h.rank == comm_rank()) take(q);
      }
    }
    rank = loads();
  }
  if (!even) d.excess = largest_part(rank);
  if (d.handed) point_find_common(m.part, d.point, pts);
}

std::vector<RealVec> dof_work(const Model& m, const Elements& el, const Points& pts, const RealVec& uc)
{
  std::vector<RealVec> work(WORK_KINDS, RealVec(m.mesh.nelem(), 0.0));
  for (const ElemBlock& b : el.block)
    for (int slot : b.live) {
      const int e = b.elem[slot];
      work[WORK_ELEM][e]  = elem_work(b.shape, false);
      work[WORK_POINT][e] = elem_work(b.shape, el.broken(e) >= 0) - work[WORK_ELEM][e];
    }
  for (int q = 0; q < pts.npoint; ++q) {
    const int e = pts.parent[q];
    if (e < 0 || !m.part.works(e)) continue;
    const PointWork w = work_of_point(m, pts, uc, q);
    work[WORK_ELEM][e]  += w.rows;
    work[WORK_POINT][e] += w.material;
  }
  return work;
}

double dof_excess(const Model& m, const Elements& el, const Points& pts, const RealVec& uc,
                  const IntVec& rank)
{
  const int me = comm_rank();
  double load[WORK_KINDS] = {}, largest[WORK_KINDS];
  for (const ElemBlock& b : el.block)
    for (int slot : b.live) {
      load[WORK_ELEM] += elem_work(b.shape, false);
      load[WORK_POINT] += elem_work(b.shape, el.broken(b.elem[slot]) >= 0) - elem_work(b.shape, false);
    }
  for (int q = 0; q < pts.npoint; ++q) {
    if (rank[q] != me) continue;
    const PointWork w = work_of_point(m, pts, uc, q);
    load[WORK_ELEM]  += w.rows;
    load[WORK_POINT] += w.material;
  }
  std::copy(load, load + WORK_KINDS, largest);
  comm_max(largest, WORK_KINDS);
  comm_sum(load, WORK_KINDS);
  return std::accumulate(largest, largest + WORK_KINDS, 0.0) * comm_size() /
         std::max(std::accumulate(load, load + WORK_KINDS, 0.0), 1e-300);
}

namespace {

// owners of the points; MeshPart::points without window: each rank has its own, and no element is converted
const IntVec& ranks_of_points(const MeshPart& part, const Points& pts, const Division& d)
{
  return part.points && !part.window ? pts.part.rank : d.point;
}

// points of this rank; the owners of corners follow from those of the points
void share_points(const Points& pts, const IntVec& rank_of, GridShare& g)
{
  const int me = comm_rank();
  for (int q = pts.npoint - 1; q >= 0; --q) {
    const int rank = rank_of[q];
    g.point[q] = rank == me;
    for (int k = pts.conn.off[q]; k < pts.conn.off[q + 1]; ++k) g.owner[pts.conn.item[k]] = rank;
  }
  if (pts.part.lone_corners) g.owner = pts.part.halo.owner;
}

}  // namespace

void dof_share_grid(const Model& m, const Points& pts, const Bonds& bonds, const ContactPairs& pairs,
                    const Division& d, GridShare& g)
{
  // points of each rank, their corners and bonds do not change, except for contact
  const bool same = g.on && g.point.size() == static_cast<size_t>(pts.npoint) && pairs.gap.empty();
  if (m.part.points && !m.part.window && same) return;
  g    = GridShare();
  g.on = m.part.on;
  if (!g.on) return;
  g.point.assign(pts.npoint, 0);
  g.corner.assign(pts.ncorner, 0);
  g.bond.assign(bonds.nbond, 0);
  g.owner.assign(pts.ncorner, -1);
  share_points(pts, ranks_of_points(m.part, pts, d), g);
  for (int q = 0; q < pts.npoint; ++q)
    for (int k = pts.conn.off[q]; k < pts.conn.off[q + 1] && g.point[q]; ++k) g.corner[pts.conn.item[k]] = 1;
  const int nnode = m.mesh.nnode();
  const auto take = [&](const ListTable& list, int b) {
    for (int k = list.off[b]; k < list.off[b + 1]; ++k)
      if (list.item[k] >= nnode) g.corner[list.item[k] - nnode] = 1;
  };
  for (int b = 0; b < bonds.nbond; ++b) {
    g.bond[b] = bonds.counts(b);
    if (!g.bond[b] || !contact_acts(bonds, pairs, b)) continue;
    take(bonds.a, b);
    if (bonds.side[b] == SIDE_CONTACT) take(pairs.master, b);
  }
  for (int c = 0; c < static_cast<int>(pts.hangs.size()); ++c)
    for (int k = pts.hang.off[c]; k < pts.hang.off[c + 1]; ++k)
      if (g.corner[c] && pts.hangs[c] == HANG_CORNERS) g.corner[-1 - pts.hang.item[k]] = 1;
}

bool dof_divide(const Model& m, const Points& pts, const ActiveGrid& grid, Division& d, Dofs& s)
{
  if (!m.part.window) d = Division();
  d.ranks  = comm_size();
  d.pieces = m.part.on;
  const IntVec& rank = ranks_of_points(m.part, pts, d);
  const bool other   = s.pattern.point_rank != rank;
  take_points(rank, grid, s);
  s.pattern.point_rank = rank;
  return other;
}
