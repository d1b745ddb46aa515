#include "base/box_tree.h"

#include <algorithm>
#include <numeric>

#include "base/comm.h"

namespace {

const int LEAF = 8;            // boxes of a leaf: time only  (no test)

}  // namespace

void box_join(BoundingBox& b)
{
  double most[6];
  for (int i = 0; i < 3; ++i) {
    most[i]     = -b.lo[i];
    most[3 + i] = b.hi[i];
  }
  comm_max(most, 6);
  for (int i = 0; i < 3; ++i) {
    b.lo[i] = -most[i];
    b.hi[i] = most[3 + i];
  }
}

BoxTree::BoxTree(const std::vector<BoundingBox>& box) : box_(box), item_(box.size())
{
  std::iota(item_.begin(), item_.end(), 0);
  if (!box.empty()) split(0, static_cast<int>(box.size()));
}

void BoxTree::split(int first, int last)
{
  Node n{box_[item_[first]], first, last, 0};
  for (int k = first; k < last; ++k) box_take(n.box, box_[item_[k]].lo, box_[item_[k]].hi);
  const size_t at = node_.size();
  node_.push_back(n);
  if (last - first <= LEAF) return;
  int axis = 0;
  for (int i = 1; i < 3; ++i)
    if (n.box.hi[i] - n.box.lo[i] > n.box.hi[axis] - n.box.lo[axis]) axis = i;
  const int middle = (first + last) / 2;
  std::nth_element(item_.begin() + first, item_.begin() + middle, item_.begin() + last, [&](int a, int b) {
    const double x = box_[a].lo[axis] + box_[a].hi[axis], y = box_[b].lo[axis] + box_[b].hi[axis];
    return x != y ? x < y : a < b;
  });
  split(first, middle);
  node_[at].right = static_cast<int>(node_.size());
  split(middle, last);
}

void BoxTree::overlap(const BoundingBox& b, IntVec& found) const
{
  int stack[64], n = 0;
  if (!node_.empty()) stack[n++] = 0;
  while (n > 0) {
    const int at = stack[--n];
    const Node& node = node_[at];
    if (!boxes_meet(node.box, b)) continue;
    if (node.right) {
      stack[n++] = node.right;
      stack[n++] = at + 1;
      continue;
    }
    for (int k = node.first; k < node.last; ++k)
      if (boxes_meet(box_[item_[k]], b)) found.push_back(item_[k]);
  }
}
