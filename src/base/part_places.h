// ---------------------------------------------------------------------------
// part_places.h : things in parts of equal work, by their places alone
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_PART_PLACES_H
#define MPFE_BASE_PART_PLACES_H

#include "base/types.h"

// part_places : the part of each thing at X [n*3], parts of equal work [n] by planes                     [n]
IntVec part_places(const RealVec& X, const RealVec& work, int parts);

// part_planes : the same with several kinds of work [kinds][n], each in parts that are about equal, by planes
// that may stand obliquely                                                                             [n]
IntVec part_planes(const RealVec& X, const std::vector<RealVec>& work, int parts);

// part_sums : [n] the sum of all kinds of weight [kinds][n]
RealVec part_sums(const std::vector<RealVec>& weight);

#endif
