#include <map>

#include "base/comm.h"
#include "base/forest.h"
#include "base/gather_lists.h"
#include "point/grid_halo.h"

namespace {

// Points of this rank, and behind them those near that are not
struct Around {
  const Points& pts;
  IntVec known;                // all ranks know all points: numbers of those that are meant
  int own = 0;                 // of this rank
  Around(const Points& p, const GridShare& share) : pts(p), own(p.npoint)
  {
    if (!share.on || pts.part.on) return;
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
  bool all() const { return own == pts.npoint; }     // nothing is known of others but what PointPart has
  int number(int q) const { return all() ? q : known[q]; }       // of a point of this rank
  int count() const { return all() ? pts.npoint + pts.part.near.size() : static_cast<int>(known.size()); }
  int ncorner() const { return pts.ncorner + static_cast<int>(pts.part.foreign.size()); }
  // calls use(corner) for the corners of point q
  template <class Use>
  void each(int q, Use use) const
  {
    const bool near = all() && q >= own;
    const ListTable& list = near ? pts.part.near : pts.conn;
    const int at = near ? q - own : number(q);
    for (int k = list.off[at]; k < list.off[at + 1]; ++k) use(list.item[k]);
  }
  // number of a corner among those of all ranks
  int corner_number(int c) const
  {
    const PointPart& part = pts.part;
    return !part.on ? c : c < pts.ncorner ? part.corner[c] : part.foreign[c - pts.ncorner];
  }
};

// Points that hang together by their corners
struct Patch {
  const Around& all;
  IntVec last, first;          // [ncorner] for which count a corner was seen last, and the item that has it
  int counts = 0;
  explicit Patch(const Around& a) : all(a), last(a.ncorner(), -1), first(a.ncorner()) {}

  // joins points of list that hang together; returns how many parts they are
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

// points around a node and those that share a corner with one of them
struct Wide {
  const Around& all;
  ListTable of_corner;         // when it was asked for
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
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    return out;
  }
};

// The parts of the points at nodes that several ranks have, told to the first of these: key, number of parts,
// and of each part how many corners it has that another rank may know, and their numbers. Do the parts of one
// node hang together by them? Collective.
struct Shared {
  const Around& all;
  std::vector<char> border;    // [ncorner] another rank has it
  std::vector<std::vector<long>> tell;
  explicit Shared(const Around& around) : all(around), border(all.ncorner(), 0), tell(comm_size())
  {
    for (int c : all.pts.part.halo.shared) border[c] = 1;
    for (int q = all.own; q < all.count(); ++q) all.each(q, [&](int c) { border[c] = 1; });
  }

  void add(int rank, long key, const IntVec& list, Forest& parts)
  {
    std::map<int, std::vector<long>> corners;          // by the root of the part
    for (size_t k = 0; k < list.size(); ++k) {
      std::vector<long>& of = corners[parts.root(static_cast<int>(k))];
      all.each(list[k], [&](int c) {
        if (border[c]) of.push_back(all.corner_number(c));
      });
    }
    std::vector<long>& to = tell[rank];
    to.insert(to.end(), {key, static_cast<long>(corners.size())});
    for (auto& [root, of] : corners) {
      std::sort(of.begin(), of.end());
      of.erase(std::unique(of.begin(), of.end()), of.end());
      to.push_back(static_cast<long>(of.size()));
      to.insert(to.end(), of.begin(), of.end());
    }
  }

  // is a node among those told to this rank where they do not?
  bool apart() const
  {
    const std::vector<std::vector<long>> told = comm_exchange(tell);
    std::map<long, std::vector<std::vector<long>>> of_node;
    for (const std::vector<long>& list : told)
      for (size_t i = 0; i < list.size();) {
        std::vector<std::vector<long>>& parts = of_node[list[i]];
        long n = list[i + 1];
        for (i += 2; n > 0; --n) {
          const auto from = list.begin() + static_cast<long>(i) + 1;
          parts.emplace_back(from, from + list[i]);
          i += 1 + static_cast<size_t>(list[i]);
        }
      }
    for (const auto& [key, parts] : of_node) {
      Forest joined(static_cast<int>(parts.size()));
      std::map<long, int> seen;
      int pieces = static_cast<int>(parts.size());
      for (int k = 0; k < static_cast<int>(parts.size()); ++k)
        for (long c : parts[k]) {
          const int other = seen.emplace(c, k).first->second;
          pieces -= joined.root(k) != joined.root(other);
          joined.join(k, other);
        }
      if (pieces > 1) return true;
    }
    return false;
  }
};

// nodes of this rank alone, or all when there is one: points that do not hang together
bool meet_here(const Around& all, long nnode, const ListTable& around, const KeyHalo* halo)
{
  Patch patch(all);
  Wide wide{all, {}};
  for (int n = 0; n < nnode; ++n) {
    if (halo && halo->shared[n]) continue;
    if (around.count(n) < 2 || patch.whole(around.begin(n), around.count(n))) continue;
    const IntVec list = wide.list(around.begin(n), around.count(n));
    if (!patch.whole(list.data(), static_cast<int>(list.size()))) return true;
  }
  return false;
}

// nodes that other ranks have too; wider: with the points that share a corner
bool meet_between(const Around& all, const ListTable& around, const KeyHalo& halo, bool wider)
{
  Shared shared(all);
  Patch patch(all);
  Wide wide{all, {}};
  for (int n : halo.mine) {
    if (!halo.shared[n] || around.count(n) == 0) continue;
    const IntVec list = wider ? wide.list(around.begin(n), around.count(n))
                              : IntVec(around.begin(n), around.begin(n) + around.count(n));
    Forest parts(static_cast<int>(list.size()));
    patch.join(list.data(), static_cast<int>(list.size()), parts);
    shared.add(halo.first[n], halo.key[n], list, parts);
  }
  return shared.apart();
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
  if (!halo) return here;
  enum { NO, PERHAPS, YES };
  const bool between = meet_between(all, around, *halo, false);
  const int found    = comm_allreduce_max(here ? YES : between ? PERHAPS : NO);
  if (found != PERHAPS) return found == YES;
  return comm_allreduce_max(static_cast<int>(meet_between(all, around, *halo, true))) > 0;
}
