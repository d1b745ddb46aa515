// ---------------------------------------------------------------------------
// picked.h : chosen items of an array
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_PICKED_H
#define MPFE_BASE_PICKED_H

#include "base/types.h"

// picked : items of x, D numbers each; of lists with off [n+1], D numbers for each of their items
template <class T>
std::vector<T> picked(const IntVec& item, int D, const std::vector<T>& x)
{
  std::vector<T> out;
  out.reserve(item.size() * static_cast<std::size_t>(D));
  for (int i : item) out.insert(out.end(), x.begin() + long(i) * D, x.begin() + long(i + 1) * D);
  return out;
}

template <class T>
std::vector<T> picked(const IntVec& item, const IntVec& off, int D, const std::vector<T>& x)
{
  std::vector<T> out;
  for (int i : item) out.insert(out.end(), x.begin() + long(off[i]) * D, x.begin() + long(off[i + 1]) * D);
  return out;
}

inline ListTable picked(const IntVec& item, const ListTable& x)
{
  ListTable out;
  out.item = picked(item, x.off, 1, x.item);
  for (int i : item) out.off.push_back(out.off.back() + x.count(i));
  return out;
}

#endif
