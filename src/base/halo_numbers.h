// ---------------------------------------------------------------------------
// halo_numbers.h : halo_copy of numbers, in each increment
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_HALO_NUMBERS_H
#define MPFE_BASE_HALO_NUMBERS_H

#include "base/halo.h"

// halo_numbers : copies each of v [n*D] from the owner to all ranks with the item, in one message to each
// rank. Both sides know its length from the lists of the halo, so that no counts are exchanged. Collective.
void halo_numbers(const Halo& h, int D, const std::vector<RealVec*>& v);
inline void halo_numbers(const Halo& h, int D, RealVec& v) { halo_numbers(h, D, std::vector<RealVec*>{&v}); }

#endif
