// ---------------------------------------------------------------------------
// sort_once.h : lists in which each item stands once
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_SORT_ONCE_H
#define MPFE_BASE_SORT_ONCE_H

#include <algorithm>
#include <vector>

// sort_once : ascending, each item once
template <class T>
void sort_once(std::vector<T>& list)
{
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

#endif
