// ---------------------------------------------------------------------------
// far_first.h : items by their distance from a border
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_FAR_FIRST_H
#define MPFE_BASE_FAR_FIRST_H

#include <algorithm>

#include "base/types.h"

// far_first : sorts order, stably, by decreasing distance from the border;
// items not connected to it are first
//   in   items    number of items;   border: items at distance 0
//        near     near(i, use) calls use(j) for the neighbours of i
template <class Near>
void far_first(int items, const IntVec& border, Near near, IntVec& order)
{
  IntVec list = border, steps(items, -1);
  for (int i : list) steps[i] = 0;
  for (size_t k = 0; k < list.size(); ++k) {
    const int from = list[k];
    near(from, [&](int j) {
      if (steps[j] >= 0) return;
      steps[j] = steps[from] + 1;
      list.push_back(j);
    });
  }
  for (int& n : steps)
    if (n < 0) n = items;
  std::stable_sort(order.begin(), order.end(), [&](int i, int j) { return steps[i] > steps[j]; });
}

#endif
