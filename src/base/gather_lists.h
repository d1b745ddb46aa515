// ---------------------------------------------------------------------------
// gather_lists.h : a list of lists from pairs in any order
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_GATHER_LISTS_H
#define MPFE_BASE_GATHER_LISTS_H

#include "base/types.h"

// gather_lists : n lists of items; each(use) calls use(list, item) for all pairs, and is called twice. Items
// of a list keep the sequence of the calls.
template <class Each>
ListTable gather_lists(int n, Each each)
{
  ListTable out;
  out.off.assign(n + 1, 0);
  each([&](int list, int) { ++out.off[list + 1]; });
  for (int i = 0; i < n; ++i) out.off[i + 1] += out.off[i];
  out.item.resize(out.off.back());
  IntVec next(out.off.begin(), out.off.end() - 1);
  each([&](int list, int item) { out.item[next[list]++] = item; });
  return out;
}

#endif
