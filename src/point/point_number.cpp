#include <algorithm>
#include <numeric>

#include "base/comm.h"
#include "base/log.h"
#include "point/filler.h"

namespace {

// Number of points and corners that the conversion of an element created, sent by the owner of the element
struct Made { int turn, points, corners; };

// numbers of the first point and the first corner of each converted element, by turn; adds to npoint and
// ncorner of all ranks
std::vector<Made> first_numbers(std::vector<Made> made, PointPart& part)
{
  comm_allgatherv(made);
  std::vector<Made> first(made.size());
  for (const Made& x : made) first[x.turn] = x;
  for (Made& x : first) {
    const Made count = x;
    x = {count.turn, part.npoint, part.ncorner};
    part.npoint += count.points;
    part.ncorner += count.corners;
  }
  return first;
}

// calls use(point) for the points of element e, if it is converted
template <class Use>
void each_point(const Points& pts, int e, Use use)
{
  if (!pts.converted(e)) return;
  for (int p = pts.of_elem[e]; p < pts.npoint && pts.parent[p] == e; ++p) use(p);
}

// calls use(corner) for their corners, point by point
template <class Use>
void each_corner(const Points& pts, int e, Use use)
{
  each_point(pts, e, [&](int p) {
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) use(pts.conn.item[k]);
  });
}

// sends the numbers of the corners of owned elements to all ranks that store their points; numbers that are
// not known here yet (-1) are ignored there
void send_numbers(const Model& m, const std::vector<char>& fresh, Points& pts)
{
  const Halo& around = m.part.around_points;
  const int ranks = comm_size(), me = comm_rank();
  IntVec& number = pts.part.corner;
  std::vector<IntVec> send(ranks);
  for (int r = 0; r < ranks && around.on(); ++r)
    for (int e : around.common[r])
      if (fresh[e] && around.owner[e] == me)
        each_corner(pts, e, [&](int c) { send[r].push_back(number[c]); });
  const std::vector<IntVec> received = comm_exchange(send);
  for (int r = 0; r < ranks && around.on(); ++r) {
    const int* next = received[r].data();
    for (int e : around.common[r]) {
      if (!fresh[e] || around.owner[e] != r) continue;
      each_corner(pts, e, [&](int c) {
        if (*next >= 0) number[c] = *next;
        ++next;
      });
    }
  }
}

}  // namespace

IntVec point_ranks(const MeshPart& part, const Points& pts)
{
  IntVec rank = pts.part.rank;
  for (int p = static_cast<int>(rank.size()); p < pts.npoint; ++p) rank.push_back(part.rank[pts.parent[p]]);
  return rank;
}

void point_number(const Model& m, const IntVec& elem, const IntVec& turn, const ListTable& made, Points& pts)
{
  PointPart& part = pts.part;
  std::vector<Made> own;
  std::vector<char> fresh(m.mesh.nelem(), 0);
  const auto count = [&](int e) {
    int p = pts.of_elem[e];
    while (p < pts.npoint && pts.parent[p] == e) ++p;
    return p - pts.of_elem[e];
  };
  for (size_t k = 0; k < elem.size(); ++k) {
    fresh[elem[k]] = 1;
    if (m.part.works(elem[k])) own.push_back({turn[k], count(elem[k]), made.count(static_cast<int>(k))});
  }
  const std::vector<Made> first = first_numbers(std::move(own), part);
  part.point.resize(pts.npoint, -1);
  part.corner.resize(pts.ncorner, -1);
  for (size_t k = 0; k < elem.size(); ++k) {
    const int e = elem[k], at = static_cast<int>(k);
    int number = first[turn[k]].points, corner = first[turn[k]].corners;
    for (int p = pts.of_elem[e]; p < pts.npoint && pts.parent[p] == e; ++p) {
      part.point[p] = number++;
      pts.label[p]  = number;
    }
    for (int i = made.off[at]; i < made.off[at + 1] && m.part.works(e); ++i)
      part.corner[made.item[i]] = corner++;
  }
  // first the corners that an element created, which elements of other ranks may share; then all
  send_numbers(m, fresh, pts);
  send_numbers(m, fresh, pts);
  point_find_common(m.part, point_ranks(m.part, pts), pts);
}

void point_number_released(const Model& m, const IntVec& which, const IntVec& turn, const IntVec& fresh,
                           Points& pts)
{
  PointPart& part = pts.part;
  std::vector<Made> own;
  IntVec made;                 // [which] corners
  for (size_t k = 0, next = 0; k < which.size(); ++k) {
    const bool is_fresh = next < fresh.size() && fresh[next] == which[k];
    next += is_fresh;
    made.push_back(is_fresh ? pts.conn.count(which[k]) : 0);
    if (m.part.works(pts.parent[which[k]])) own.push_back({turn[k], 0, made.back()});
  }
  const std::vector<Made> first = first_numbers(std::move(own), part);
  for (size_t k = 0; k < which.size(); ++k)
    for (int a = 0; a < made[k]; ++a) part.corner.push_back(first[turn[k]].corners + a);
  point_find_common(m.part, point_ranks(m.part, pts), pts);
  pts.unshared_since.resize(pts.ncorner, 0);
  halo_copy(part.halo, 1, pts.unshared_since);     // also from elements that this rank does not store
}

void point_copy_history(const MeshPart& part, const IntVec& rank, const Points& pts, int n, Level& l)
{
  const int ranks = comm_size(), me = comm_rank();
  if (n == 0 || !part.around_points.on()) return;
  std::vector<RealVec> send(ranks);
  for (int r = 0; r < ranks; ++r)
    for (int e : part.around_points.common[r])
      each_point(pts, e, [&](int p) {
        const double* h = &l.hp[static_cast<size_t>(p) * n];
        if (rank[p] == me) send[r].insert(send[r].end(), h, h + n);
      });
  const std::vector<RealVec> received = comm_exchange(send);
  for (int r = 0; r < ranks; ++r) {
    const double* next = received[r].data();
    for (int e : part.around_points.common[r])
      each_point(pts, e, [&](int p) {
        if (rank[p] != r) return;
        std::copy_n(next, n, &l.hp[static_cast<size_t>(p) * n]);
        next += n;
      });
  }
}

namespace {

// sorts the corners by number; those added since the last call are merged in
void sort_numbers(PointPart& part)
{
  IntVec& list = part.numbered;
  const auto before = [&](int a, int b) { return part.corner[a] < part.corner[b]; };
  const size_t known = list.size();
  list.resize(part.corner.size());
  std::iota(list.begin() + static_cast<long>(known), list.end(), static_cast<int>(known));
  std::sort(list.begin() + static_cast<long>(known), list.end(), before);
  std::inplace_merge(list.begin(), list.begin() + static_cast<long>(known), list.end(), before);
}

// [ranks] corners of the elements and of the original points that this rank and that one store, ascending by
// number: the two ranks have no other corners in common
std::vector<IntVec> common_corners(const MeshPart& mesh, const Points& pts)
{
  const int ranks = comm_size();
  std::vector<IntVec> common(ranks);
  IntVec mark(pts.ncorner, -1);
  const Halo &around = mesh.around_points, &start = pts.part.start;
  for (int r = 0; r < ranks && (around.on() || start.on()); ++r) {
    for (int e : around.on() ? around.common[r] : IntVec()) each_corner(pts, e, [&](int c) { mark[c] = r; });
    for (int c : start.on() ? start.common[r] : IntVec()) mark[c] = r;
    for (int c : pts.part.numbered)
      if (mark[c] == r) common[r].push_back(c);
    common[r].shrink_to_fit();
  }
  return common;
}

}  // namespace

void point_find_common(const MeshPart& mesh, const IntVec& rank, Points& pts)
{
  const int ranks = comm_size(), me = comm_rank();
  PointPart& part = pts.part;
  MPFE_CHECK(std::find(part.corner.begin(), part.corner.end(), -1) == part.corner.end(),
             "a corner created on another rank has no number");
  sort_numbers(part);
  std::vector<char> own(pts.ncorner, 0);
  for (int p = 0; p < pts.npoint; ++p)
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1] && rank[p] == me; ++k) own[pts.conn.item[k]] = 1;
  Halo halo;
  halo.common = common_corners(mesh, pts);
  std::vector<std::vector<char>> send(ranks);
  for (int r = 0; r < ranks; ++r)
    for (int c : halo.common[r]) send[r].push_back(own[c]);
  const std::vector<std::vector<char>> received = comm_exchange(send);
  // of the ranks that own a point with the corner: number and sum, which give the owner as in halo_form
  IntVec nowner(own.begin(), own.end()), sum(pts.ncorner, 0);
  std::vector<char> shared(pts.ncorner, 0);
  for (int c = 0; c < pts.ncorner; ++c) sum[c] = own[c] * me;
  for (int r = 0; r < ranks; ++r)
    for (size_t i = 0; i < halo.common[r].size(); ++i) {
      const int c = halo.common[r][i];
      shared[c] = 1;
      nowner[c] += received[r][i];
      sum[c] += received[r][i] * r;
    }
  part.several.resize(pts.ncorner);
  for (int c = 0; c < pts.ncorner; ++c) part.several[c] = nowner[c] > 1;
  halo.owner.assign(pts.ncorner, -1);
  IntVec turns(pts.ncorner, 0);          // ranks to be skipped before the owner, ascending
  for (int c = 0; c < pts.ncorner; ++c)
    if (nowner[c]) turns[c] = sum[c] % nowner[c];
  const auto take = [&](int c, int r) {
    if (turns[c]-- == 0) halo.owner[c] = r;
  };
  for (int r = 0; r < ranks; ++r) {
    for (int c = 0; c < pts.ncorner && r == me; ++c)
      if (own[c]) take(c, me);
    for (size_t i = 0; i < halo.common[r].size(); ++i)
      if (received[r][i]) take(halo.common[r][i], r);
  }
  for (int c = 0; c < pts.ncorner; ++c)
    if (shared[c]) halo.shared.push_back(c);
  halo.shared.shrink_to_fit();
  part.lone_corners = true;
  part.halo = std::move(halo);
}

void share_corners(const std::vector<char>& own, PointPart& part)
{
  const int ranks = comm_size();
  Halo halo;
  std::vector<long> key;
  for (size_t c = 0; c < own.size(); ++c)
    if (own[c]) key.push_back(part.corner[c]);
  halo_form(key, halo);
  part.lone_corners = comm_allreduce_max(static_cast<int>(key.size() < own.size())) > 0;
  if (!part.lone_corners) {
    part.halo = std::move(halo);                     // owned points have all corners
    return;
  }
  IntVec owner(own.size(), -1);
  for (size_t c = 0, k = 0; c < own.size(); ++c)
    if (own[c]) owner[c] = halo.owner[k++];
  key.assign(part.corner.begin(), part.corner.end());
  halo_form(key, halo);
  std::vector<IntVec> send(ranks);
  for (int r = 0; r < ranks; ++r)
    for (int c : halo.common[r]) send[r].push_back(owner[c]);
  const std::vector<IntVec> received = comm_exchange(send);
  for (int r = 0; r < ranks; ++r)
    for (size_t i = 0; i < received[r].size(); ++i) {
      int& of = owner[halo.common[r][i]];
      of = std::max(of, received[r][i]);
    }
  halo.owner.swap(owner);
  part.halo = std::move(halo);
}
