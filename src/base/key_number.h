// ---------------------------------------------------------------------------
// key_number.h : numbers of things that the ranks have, in one order, and no rank has all of them
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_KEY_NUMBER_H
#define MPFE_BASE_KEY_NUMBER_H

#include "base/types.h"

// key_numbers : numbers of keys in the ascending order of all keys that ranks bring, each counted once; -1:
// no rank brings it. Collective.
//   in   brings   keys that this rank brings, in any order
//        key      [n] keys that it asks for
//   out  all      keys that the ranks bring
// Returns [n].
IntVec key_numbers(const std::vector<long>& brings, const std::vector<long>& key, int& all);

#endif
