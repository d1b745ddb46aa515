// ---------------------------------------------------------------------------
// hash_places.h : hash table whose slots hold the numbers of items, -1: free
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_HASH_PLACES_H
#define MPFE_BASE_HASH_PLACES_H

#include "base/hash.h"
#include "base/types.h"

// hash_find : the slot of the number with same(number), or the free slot for it
template <class Same>
std::size_t hash_find(const IntVec& place, std::uint64_t hash, Same same)
{
  const std::size_t mask = place.size() - 1;
  std::size_t i = hash & mask;
  while (place[i] >= 0 && !same(place[i])) i = (i + 1) & mask;
  return i;
}

// hash_room : enlarges the table, if it would be more than half full with n + 1 numbers; has(number): the
// number is in the table, hash_of(number): its hash
template <class Has, class HashOf>
void hash_room(IntVec& place, int n, Has has, HashOf hash_of)
{
  if (2 * (static_cast<std::size_t>(n) + 1) <= place.size()) return;
  place.assign(place.empty() ? 16 : 2 * place.size(), -1);
  for (int number = 0; number < n; ++number)
    if (has(number)) place[hash_find(place, hash_of(number), [](int) { return false; })] = number;
}

#endif
