// ---------------------------------------------------------------------------
// part_places.h : things in parts of equal work, by their places alone
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_PART_PLACES_H
#define MPFE_BASE_PART_PLACES_H

#include "base/types.h"

// part_places : the part of each thing at X [n*3], parts of equal work [n] by planes                     [n]
IntVec part_places(const RealVec& X, const RealVec& work, int parts);

#endif
