// ---------------------------------------------------------------------------
// grow.h : arrays that grow through a run
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_GROW_H
#define MPFE_BASE_GROW_H

#include <algorithm>
#include <cstddef>
#include <vector>

#include "base/heap.h"

// reserve_apart : large ones on pages of their own rather than behind the heap (PagesApart)
template <class T>
void reserve_apart(std::vector<T>& x, std::size_t n)
{
  const PagesApart apart(n * sizeof(T));
  x.reserve(n);
}

// room_for : room for more items. Arrays of points and corners grow by a few at a time and then stay: half as
// much again is taken, or another part, where std::vector takes twice as much.
template <class T>
void room_for(std::vector<T>& x, std::size_t more, std::size_t part = 2)
{
  const std::size_t n = x.size() + more;
  if (n > x.capacity()) reserve_apart(x, n + n / part);
}

// size_to : n items at least; called again with few more, it need not do it again
template <class T>
void size_to(std::vector<T>& x, std::size_t n)
{
  if (n <= x.size()) return;
  room_for(x, n - x.size());
  x.resize(std::min(x.capacity(), n + n / 16));
}

// too_large : is there more room than n items need, by a quarter?
template <class T>
bool too_large(const std::vector<T>& x, std::size_t n)
{
  return n + n / 4 < x.capacity();
}

// fit_size : n items, whatever they are. Arrays that are made anew through the run, a little larger or
// smaller each time: an eighth more is taken, and what is too large by more than a quarter is given back.
template <class T>
void fit_size(std::vector<T>& x, std::size_t n)
{
  if (n > x.capacity() || too_large(x, n)) {
    std::vector<T>().swap(x);            // before others are taken
    reserve_apart(x, n + n / 8);
  }
  x.resize(n);
}

// fit_room : room for an eighth more items than there are
template <class T>
void fit_room(std::vector<T>& x)
{
  std::vector<T> fit;
  reserve_apart(fit, x.size() + x.size() / 8);
  fit.insert(fit.end(), x.begin(), x.end());
  x.swap(fit);
}

// give_back : what is too large by more than a quarter
template <class T>
void give_back(std::vector<T>& x)
{
  if (too_large(x, x.size())) fit_room(x);
}

// append : one item, n equal ones, or those from first to last
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
