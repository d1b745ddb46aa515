// ---------------------------------------------------------------------------
// grow.h : arrays that grow through a run
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_GROW_H
#define MPFE_BASE_GROW_H

#include <algorithm>
#include <cstddef>
#include <vector>

#include "base/heap.h"

// reserve_apart : reserves large arrays on pages of their own instead of on the heap (PagesApart)
template <class T>
void reserve_apart(std::vector<T>& x, std::size_t n)
{
  const PagesApart apart(n * sizeof(T));
  x.reserve(n);
}

// room_for : reserves memory for more items. Arrays of points and corners grow by a few items at a time and
// then keep their size: the capacity grows by a half, or another fraction, instead of by a factor of two.
template <class T>
void room_for(std::vector<T>& x, std::size_t more, std::size_t part = 2)
{
  const std::size_t n = x.size() + more;
  if (n > x.capacity()) reserve_apart(x, n + n / part);
}

// size_to : resizes to n items or more, so that calls with slightly larger n have nothing to do
template <class T>
void size_to(std::vector<T>& x, std::size_t n)
{
  if (n <= x.size()) return;
  room_for(x, n - x.size());
  x.resize(std::min(x.capacity(), n + n / 16));
}

// too_large : does the capacity exceed n items by more than a quarter?
template <class T>
bool too_large(const std::vector<T>& x, std::size_t n)
{
  return n + n / 4 < x.capacity();
}

// fit_size : resizes to n items of any value. For arrays that are rebuilt during the run with slightly
// different sizes: an eighth more is reserved, and an excess of more than a quarter is freed.
template <class T>
void fit_size(std::vector<T>& x, std::size_t n)
{
  if (n > x.capacity() || too_large(x, n)) {
    std::vector<T>().swap(x);            // frees the old memory first
    reserve_apart(x, n + n / 8);
  }
  x.resize(n);
}

// fit_room : reserves memory for an eighth more items
template <class T>
void fit_room(std::vector<T>& x)
{
  std::vector<T> fit;
  reserve_apart(fit, x.size() + x.size() / 8);
  fit.insert(fit.end(), x.begin(), x.end());
  x.swap(fit);
}

// give_back : frees an excess capacity of more than a quarter
template <class T>
void give_back(std::vector<T>& x)
{
  if (too_large(x, x.size())) fit_room(x);
}

// append : appends one item, n equal items, or the range from first to last
template <class T>
void append(std::vector<T>& x, T item)
{
  room_for(x, 1);
  x.push_back(item);
}

template <class T>
void append(std::vector<T>& x, std::size_t n, T item)
{
  room_for(x, n);
  x.insert(x.end(), n, item);
}

template <class T>
void append(std::vector<T>& x, const T* first, const T* last)
{
  room_for(x, static_cast<std::size_t>(last - first));
  x.insert(x.end(), first, last);
}

#endif
