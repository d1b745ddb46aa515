// ---------------------------------------------------------------------------
// forest.h : connected parts of a set whose items are joined in pairs (union-find)
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_FOREST_H
#define MPFE_BASE_FOREST_H

#include <algorithm>
#include <numeric>

#include "base/types.h"

struct Forest {
  IntVec up;                   // [items] an item of the same part, itself at the root

  explicit Forest(int items) : up(items) { std::iota(up.begin(), up.end(), 0); }
  // root : the item that represents the part of i
  int root(int i)
  {
    while (up[i] != i) i = up[i] = up[up[i]];
    return i;
  }
  void join(int i, int j)
  {
    i = root(i);
    j = root(j);
    up[std::max(i, j)] = std::min(i, j);
  }
};

#endif
