// ---------------------------------------------------------------------------
// box_tree.h : search for the boxes that overlap a box: a binary tree of boxes, split at the median along
// the longest axis; n log n to build, log n plus the number of hits to query
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_BOX_TREE_H
#define MPFE_BASE_BOX_TREE_H

#include <algorithm>
#include <vector>

#include "base/types.h"

struct BoundingBox {           // at first of nothing
  double lo[3] = {1e300, 1e300, 1e300}, hi[3] = {-1e300, -1e300, -1e300};
};

// box_take : enlarges b to contain the position x, or the box from lo to hi                   [dim]
inline void box_take(BoundingBox& b, const double* lo, const double* hi, int dim = 3)
{
  for (int i = 0; i < dim; ++i) {
    b.lo[i] = std::min(b.lo[i], lo[i]);
    b.hi[i] = std::max(b.hi[i], hi[i]);
  }
}
inline void box_take(BoundingBox& b, const double* x, int dim = 3) { box_take(b, x, x, dim); }

// box_grow : moves all sides outwards
inline void box_grow(BoundingBox& b, double by, int dim = 3)
{
  for (int i = 0; i < dim; ++i) {
    b.lo[i] -= by;
    b.hi[i] += by;
  }
}

inline bool boxes_meet(const BoundingBox& a, const BoundingBox& b, int dim = 3)
{
  for (int i = 0; i < dim; ++i)
    if (a.lo[i] > b.hi[i] || b.lo[i] > a.hi[i]) return false;
  return true;
}

// box_join : the box of the boxes of all ranks. Collective.
void box_join(BoundingBox& b);

class BoxTree {
public:
  explicit BoxTree(const std::vector<BoundingBox>& box);
  // overlap : adds the indices of the boxes that overlap b to found, in no particular order
  void overlap(const BoundingBox& b, IntVec& found) const;

private:
  struct Node {
    BoundingBox box;
    int first, last;           // items of a leaf
    int right;                 // node of the second half, 0: a leaf; the first half follows its node
  };
  const std::vector<BoundingBox>& box_;
  IntVec item_;
  std::vector<Node> node_;
  void split(int first, int last);
};

#endif
