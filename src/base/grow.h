// ---------------------------------------------------------------------------
// grow.h : arrays that grow through a run
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_GROW_H
#define MPFE_BASE_GROW_H

#include <algorithm>
#include <cstddef>
#include <vector>

// room_for : room for more items. Arrays of points and corners grow by a few at a time and then stay: half as
// much again is taken, where std::vector takes twice as much.
template <class T>
void room_for(std::vector<T>& x, std::size_t more)
{
  const std::size_t n = x.size() + more;
  if (n > x.capacity()) x.reserve(n + n / 2);
}

// size_to : n items at least; called again with few more, it need not do it again
template <class T>
void size_to(std::vector<T>& x, std::size_t n)
{
  if (n <= x.size()) return;
  room_for(x, n - x.size());
  x.resize(std::min(x.capacity(), n + n / 16));
}

// fit_size : n items, whatever they are. Arrays that are made anew through the run, a little larger or
// smaller each time: an eighth more is taken, and what is too large by more than a quarter is given back.
template <class T>
void fit_size(std::vector<T>& x, std::size_t n)
{
  if (n > x.capacity() || n + n / 4 < x.capacity()) {
    std::vector<T>().swap(x);            // before others are taken
    x.reserve(n + n / 8);
  }
  x.resize(n);
}

// fit_room : the same for an array as it is
template <class T>
void fit_room(std::vector<T>& x)
{
  const std::size_t n = x.size();
  if (n + n / 4 >= x.capacity() && n + n / 16 <= x.capacity()) return;
  std::vector<T> fit;
  fit.reserve(n + n / 8);
  fit.insert(fit.end(), x.begin(), x.end());
  x.swap(fit);
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
