// ---------------------------------------------------------------------------
// halo.h : items shared by several ranks (nodes, rows), each with a key that is equal on all of them
// (doc/theory.md 5.1)
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_HALO_H
#define MPFE_BASE_HALO_H

#include <algorithm>

#include "base/comm.h"
#include "base/log.h"

struct Halo {
  // [ranks] indices of the items shared with that rank, by ascending key on both sides; empty for this rank
  std::vector<IntVec> common;
  IntVec shared;               // indices of the items shared with any rank, ascending
  IntVec owner;                // [n] owner of the item: one of the ranks that have it
  bool on() const { return !common.empty(); }
};

// halo_form : finds the items shared with other ranks, by their distinct keys key [n].
// Collective, as all below.
void halo_form(const std::vector<long>& key, Halo& h);

// halo_renumber : renumbers the items: item k becomes number index[k]; without owners
void halo_renumber(const IntVec& index, Halo& h);

// halo_sum : sums v [n*D] over the ranks that have an item, and m numbers over all ranks, in the order of the
// ranks; several vectors in one message
void halo_sum(const Halo& h, int D, const std::vector<RealVec*>& v, double* number = nullptr, int m = 0);
inline void halo_sum(const Halo& h, int D, RealVec& v, double* number = nullptr, int m = 0)
{
  halo_sum(h, D, std::vector<RealVec*>{&v}, number, m);
}

// halo_copy : copies v [n*D] from the owner to all ranks with the item; halo_copy_all:
// several vectors in one message
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
    MPFE_CHECK(from[r].size() == numbers(r, static_cast<int>(r)), "ranks disagree on owners of items");
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
