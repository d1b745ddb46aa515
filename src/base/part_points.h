// ---------------------------------------------------------------------------
// part_points.h : division of items into parts of equal work, by their positions
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_PART_POINTS_H
#define MPFE_BASE_PART_POINTS_H

#include "base/types.h"

// part_points : the part of each item at X [n*3]; planes separate parts of equal work [n]                [n]
IntVec part_points(const RealVec& X, const RealVec& work, int parts);

// part_planes : the same with several kinds of work [kinds][n], each divided about equally, by planes of any
// orientation                                                                                          [n]
IntVec part_planes(const RealVec& X, const std::vector<RealVec>& work, int parts);

// part_sums : [n] the sum of all kinds of weight [kinds][n]
RealVec part_sums(const std::vector<RealVec>& weight);

#endif
