// ---------------------------------------------------------------------------
// halo.h : things that several ranks have (nodes, rows), each with a key that is the same on all of them
// (doc/theory.md 5.1)
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_HALO_H
#define MPFE_BASE_HALO_H

#include <algorithm>

#include "base/comm.h"
#include "base/log.h"

struct Halo {
  // [ranks] index of what that rank has too, in ascending order of the keys on both sides; its own is empty
  std::vector<IntVec> common;
  IntVec shared;               // index of what any other rank has too, ascending
  IntVec owner;                // [n] rank that it belongs to: one of those that have it
  bool on() const { return !common.empty(); }
};

// halo_form : which things of the keys key [n], each once, other ranks have too. Collective, as all below.
void halo_form(const std::vector<long>& key, Halo& h);

// halo_renumber : things are counted anew: thing k is number index[k]; without owners
void halo_renumber(const IntVec& index, Halo& h);

// halo_sum : v [n*D] of all ranks that have a thing, and m numbers of all ranks, summed in their order;
// several vectors in one message
void halo_sum(const Halo& h, int D, const std::vector<RealVec*>& v, double* number = nullptr, int m = 0);
inline void halo_sum(const Halo& h, int D, RealVec& v, double* number = nullptr, int m = 0)
{
  halo_sum(h, D, std::vector<RealVec*>{&v}, number, m);
}

// halo_copy : v [n*D] of the owner to all that have a thing; halo_copy_all: several of them in one message
template <class T>
void halo_copy_all(const Halo& h, int D, const std::vector<std::vector<T>*>& v)
{
  const int me = comm_rank();
  const auto numbers = [&](std::size_t with, int owner) {      // of a message
    const IntVec& list = h.common[with];
    const auto things  = std::count_if(list.begin(), list.end(), [&](int k) { return h.owner[k] == owner; });
    return static_cast<std::size_t>(things) * v.size() * static_cast<std::size_t>(D);
  };
  std::vector<std::vector<T>> to(h.common.size());
  for (std::size_t r = 0; r < h.common.size(); ++r) {
    to[r].reserve(numbers(r, me));
    for (int k : h.common[r])
      for (std::size_t i = 0; i < v.size() && h.owner[k] == me; ++i)
        to[r].insert(to[r].end(), v[i]->begin() + long(k) * D, v[i]->begin() + long(k + 1) * D);
  }
  const std::vector<std::vector<T>> from = comm_exchange(to);
  for (std::size_t r = 0; r < h.common.size(); ++r) {
    auto next = from[r].begin();
    MPFE_CHECK(from[r].size() == numbers(r, static_cast<int>(r)), "ranks disagree on whose things are");
    for (int k : h.common[r]) {
      if (h.owner[k] != static_cast<int>(r)) continue;
      for (std::vector<T>* x : v) {
        std::copy(next, next + D, x->begin() + long(k) * D);
        next += D;
      }
    }
  }
}

template <class T>
void halo_copy(const Halo& h, int D, std::vector<T>& v)
{
  halo_copy_all(h, D, std::vector<std::vector<T>*>{&v});
}

#endif
