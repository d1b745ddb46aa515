// ---------------------------------------------------------------------------
// sort_once.h : sorted lists without duplicates
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_SORT_ONCE_H
#define MPFE_BASE_SORT_ONCE_H

#include <algorithm>
#include <vector>

// sort_once : sorts ascending and removes duplicates
template <class T>
void sort_once(std::vector<T>& list)
{
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

#endif
