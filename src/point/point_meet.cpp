#include <algorithm>

#include "base/comm.h"
#include "base/forest.h"
#include "base/gather_lists.h"
#include "base/sort_once.h"
#include "point/grid_halo.h"

namespace {

// Points of this rank, followed by the points of other ranks that share corners with them
struct Around {
  const Points& pts;
  IntVec known;                // the points in the list; empty: all points are owned
  int own = 0;                 // owned points
  Around(const Points& p, const GridShare& share) : pts(p), own(p.npoint)
  {
    if (!share.on || std::find(share.point.begin(), share.point.end(), 0) == share.point.end()) return;
    std::vector<char> here(pts.ncorner, 0);
    const auto any = [&](int q) {
      return std::any_of(pts.conn.begin(q), pts.conn.begin(q) + pts.conn.count(q),
                         [&](int c) { return here[c] != 0; });
    };
    for (int q = 0; q < pts.npoint; ++q) {
      if (!share.point[q]) continue;
      known.push_back(q);
      for (int k = pts.conn.off[q]; k < pts.conn.off[q + 1]; ++k) here[pts.conn.item[k]] = 1;
    }
    own = static_cast<int>(known.size());
    for (int q = 0; q < pts.npoint; ++q)
      if (!share.point[q] && any(q)) known.push_back(q);
  }
  bool all() const { return own == pts.npoint; }     // all points are owned
  int here() const { return all() ? own : static_cast<int>(known.size()); }
  int number(int q) const { return all() ? q : known[q]; }       // index into Points, q < here()
  int count() const { return here() + pts.part.outer_conn.size(); }
  int ncorner() const { return pts.ncorner + static_cast<int>(pts.part.outer_corner.size()); }
  // calls use(corner) for the corners of point q; outer corners are numbered after the others
  template <class Use>
  void each(int q, Use use) const
  {
    const bool outer = q >= here();
    const ListTable& list = outer ? pts.part.outer_conn : pts.conn;
    const int at = outer ? q - here() : number(q);
    for (int k = list.off[at]; k < list.off[at + 1]; ++k)
      use(list.item[k] >= 0 ? list.item[k] : pts.ncorner - 1 - list.item[k]);
  }
  // number of a corner among the corners of all ranks
  int corner_number(int c) const
  {
    return c < pts.ncorner ? pts.corner_number(c) : pts.part.outer_corner[c - pts.ncorner];
  }
};

// Points connected by common corners
struct Patch {
  const Around& all;
  IntVec last, first;          // [ncorner] the last call that saw the corner, and the last item with it
  int counts = 0;              // calls
  explicit Patch(const Around& a) : all(a), last(a.ncorner(), -1), first(a.ncorner()) {}

  // joins points of list that share corners; returns the number of connected parts
  int join(const int* list, int n, Forest& parts)
  {
    int pieces = n;
    ++counts;
    for (int k = 0; k < n; ++k)
      all.each(list[k], [&](int c) {
        if (last[c] == counts) {
          pieces -= parts.root(k) != parts.root(first[c]);
          parts.join(k, first[c]);
        }
        last[c]  = counts;
        first[c] = k;
      });
    return pieces;
  }
  bool whole(const int* list, int n)
  {
    Forest parts(n);
    return join(list, n, parts) == 1;
  }
};

// points around a node and the points that share a corner with one of them
struct Wide {
  const Around& all;
  ListTable of_corner;         // points around each corner, built at the first use
  IntVec list(const int* point, int n)
  {
    if (of_corner.size() == 0)
      of_corner = gather_lists(all.ncorner(), [&](auto use) {
        for (int q = 0; q < all.count(); ++q) all.each(q, [&](int c) { use(c, q); });
      });
    IntVec out;
    for (int k = 0; k < n; ++k)
      all.each(point[k], [&](int c) {
        out.insert(out.end(), of_corner.begin(c), of_corner.begin(c) + of_corner.count(c));
      });
    sort_once(out);
    return out;
  }
};

// The connected parts of the points at nodes that several ranks touch, sent to the first of these: key of the
// node, the number of corners of the part that another rank may have in a part of its own (wider: may store),
// and their numbers. Are the parts of a node connected by them?
struct Shared {
  const Around& all;
  std::vector<char> border;    // [ncorner] such corners
  IntVec last;                 // [ncorner] the last call of add that saw the corner
  int counts = 0;              // calls of add
  std::vector<std::vector<long>> send;
  Shared(const Around& around, bool wider)
      : all(around), border(all.ncorner(), 0), last(all.ncorner(), -1), send(comm_size())
  {
    const PointPart& part = all.pts.part;
    if (part.window && !wider) {
      std::copy(part.several.begin(), part.several.end(), border.begin());
      return;
    }
    for (int c : part.halo.shared) border[c] = 1;
    for (int q = all.own; q < all.count(); ++q) all.each(q, [&](int c) { border[c] = 1; });
    if (!wider) return;
    IntVec beside;             // points of this rank with a border corner
    for (int q = 0; q < all.own; ++q) {
      bool shares = false;
      all.each(q, [&](int c) { shares = shares || border[c]; });
      if (shares) beside.push_back(q);
    }
    for (int q : beside) all.each(q, [&](int c) { border[c] = 1; });
  }

  // parts: of the points of list; no two parts have a corner in common
  void add(int rank, long key, const IntVec& list, Forest& parts)
  {
    std::vector<std::pair<int, long>> corner;          // root of the part, number; -1: the part itself
    ++counts;
    for (size_t k = 0; k < list.size(); ++k) {
      const int root = parts.root(static_cast<int>(k));
      if (root == static_cast<int>(k)) corner.emplace_back(root, -1);
      all.each(list[k], [&](int c) {
        if (!border[c] || last[c] == counts) return;
        last[c] = counts;
        corner.emplace_back(root, all.corner_number(c));
      });
    }
    std::sort(corner.begin(), corner.end());
    std::vector<long>& to = send[rank];
    size_t count = 0;          // index of the count in the message
    for (const auto& [root, number] : corner) {
      if (number < 0) {
        to.insert(to.end(), {key, 0});
        count = to.size() - 1;
      } else {
        to.push_back(number);
        ++to[count];
      }
    }
  }

  struct Part {
    long key;
    const long* corner;
    long n;
    int rank;
  };

  // keys of the nodes of this rank where the parts are not connected, ascending. Collective
  std::vector<long> unconnected() const
  {
    const std::vector<std::vector<long>> received = comm_exchange(send);
    std::vector<Part> part;
    for (size_t r = 0; r < received.size(); ++r)
      for (size_t i = 0; i < received[r].size(); i += 2 + static_cast<size_t>(received[r][i + 1]))
        part.push_back({received[r][i], &received[r][i] + 2, received[r][i + 1], static_cast<int>(r)});
    std::stable_sort(part.begin(), part.end(), [](const Part& a, const Part& b) { return a.key < b.key; });
    std::vector<std::pair<long, int>> corner;          // number, part
    std::vector<std::vector<long>> found(received.size());
    for (size_t first = 0, end; first < part.size(); first = end) {
      corner.clear();
      for (end = first; end < part.size() && part[end].key == part[first].key; ++end)
        for (long k = 0; k < part[end].n; ++k)
          corner.emplace_back(part[end].corner[k], static_cast<int>(end - first));
      std::sort(corner.begin(), corner.end());
      int pieces = static_cast<int>(end - first);
      Forest joined(pieces);
      for (size_t k = 1; k < corner.size(); ++k) {
        if (corner[k].first != corner[k - 1].first) continue;
        pieces -= joined.root(corner[k].second) != joined.root(corner[k - 1].second);
        joined.join(corner[k].second, corner[k - 1].second);
      }
      for (size_t k = first; k < end && pieces > 1; ++k) {
        std::vector<long>& to = found[part[k].rank];
        if (to.empty() || to.back() != part[k].key) to.push_back(part[k].key);
      }
    }
    std::vector<long> here;
    for (const std::vector<long>& list : comm_exchange(found))
      here.insert(here.end(), list.begin(), list.end());
    std::sort(here.begin(), here.end());
    return here;
  }
};

// are points unconnected at a node of this rank alone, or, where all ranks have all points,
// at a node of its share?
bool meet_here(const Around& all, long nnode, const ListTable& around, const KeyHalo* halo)
{
  const int ranks = comm_size(), me = comm_rank();
  Patch patch(all);
  Wide wide{all, {}};
  for (int n = 0; n < nnode; ++n) {
    if (halo ? halo->shared[n] != 0 : n % ranks != me) continue;
    if (around.count(n) < 2 || patch.whole(around.begin(n), around.count(n))) continue;
    const IntVec list = wide.list(around.begin(n), around.count(n));
    if (!patch.whole(list.data(), static_cast<int>(list.size()))) return true;
  }
  return false;
}

// Keys of the nodes shared with other ranks where the points around them are not connected. wider: including
// the points that share a corner, at the nodes of keys
std::vector<long> meet_between(const Around& all, const ListTable& around, const KeyHalo& halo, bool wider,
                               const std::vector<long>& keys)
{
  Shared shared(all, wider);
  Patch patch(all);
  Wide wide{all, {}};
  for (int n : halo.here) {
    if (!halo.shared[n] || around.count(n) == 0) continue;
    if (wider && !std::binary_search(keys.begin(), keys.end(), halo.key[n])) continue;
    const IntVec list = wider ? wide.list(around.begin(n), around.count(n))
                              : IntVec(around.begin(n), around.begin(n) + around.count(n));
    Forest parts(static_cast<int>(list.size()));
    patch.join(list.data(), static_cast<int>(list.size()), parts);
    shared.add(halo.first[n], halo.key[n], list, parts);
  }
  return shared.unconnected();
}

}  // namespace

bool points_meet(const Points& pts, const GridShare& share, const std::vector<long>& key,
                 const ListTable& point, const KeyHalo* halo)
{
  const long nnode = std::lower_bound(key.begin(), key.end(), key_own) - key.begin();
  const Around all(pts, share);
  const ListTable around = gather_lists(static_cast<int>(key.size()), [&](auto use) {
    for (int i = 0; i < all.own; ++i) {
      const int q = all.number(i);
      for (int k = point.off[q]; k < point.off[q + 1]; ++k) use(point.item[k], i);
    }
  });
  const bool here = meet_here(all, nnode, around, halo);
  const auto any  = [](bool found) { return comm_allreduce_max(static_cast<int>(found)) > 0; };
  if (!halo) return any(here);
  if (any(here)) return true;
  const std::vector<long> apart = meet_between(all, around, *halo, false, {});
  return any(!apart.empty()) && any(!meet_between(all, around, *halo, true, apart).empty());
}
