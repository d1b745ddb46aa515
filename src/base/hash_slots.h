// ---------------------------------------------------------------------------
// hash_slots.h : hash table whose slots hold the numbers of items, -1: free
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_HASH_SLOTS_H
#define MPFE_BASE_HASH_SLOTS_H

#include "base/hash.h"
#include "base/types.h"

// hash_find : the slot of the number with same(number), or the free slot for it
template <class Same>
std::size_t hash_find(const IntVec& slot, std::uint64_t hash, Same same)
{
  const std::size_t mask = slot.size() - 1;
  std::size_t i = hash & mask;
  while (slot[i] >= 0 && !same(slot[i])) i = (i + 1) & mask;
  return i;
}

// hash_room : enlarges the table, if it would be more than half full with n + 1 numbers; has(number): the
// number is in the table, hash_of(number): its hash
template <class Has, class HashOf>
void hash_room(IntVec& slot, int n, Has has, HashOf hash_of)
{
  if (2 * (static_cast<std::size_t>(n) + 1) <= slot.size()) return;
  slot.assign(slot.empty() ? 16 : 2 * slot.size(), -1);
  for (int number = 0; number < n; ++number)
    if (has(number)) slot[hash_find(slot, hash_of(number), [](int) { return false; })] = number;
}

#endif
