// ---------------------------------------------------------------------------
// key_number.h : consecutive numbers of keys that are distributed over the ranks
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_KEY_NUMBER_H
#define MPFE_BASE_KEY_NUMBER_H

#include "base/types.h"

// key_numbers : numbers of keys in the ascending order of the keys of all ranks, each counted once; -1: no
// rank has the key. Collective.
//   in   brings   keys of this rank, in any order
//        key      [n] keys whose numbers are wanted
//   out  all      number of keys of all ranks
// Returns [n].
IntVec key_numbers(const std::vector<long>& brings, const std::vector<long>& key, int& all);

#endif
