// ---------------------------------------------------------------------------
// corner_names.h : index of the corners of points by name; elements that share a corner give it the same name
// ---------------------------------------------------------------------------
#ifndef MPFE_POINT_CORNER_NAMES_H
#define MPFE_POINT_CORNER_NAMES_H

#include <utility>

#include "base/types.h"

// Name of a corner: the mesh nodes that it interpolates and their integer weights, in an order that is the
// same in all elements
using CornerKey = std::vector<std::pair<int, int>>;

struct CornerNames {
  IntVec field, corner;        // [name] grid field; the corner, -1: no corner has the name now
  ListTable node;              // [name] mesh nodes
  IntVec weight;               // [node.item]
  IntVec table;                // hash table of names, -1: free; a power of two
};

// corner_named : the corner of a field with this name, -1: none (the caller may store one). The reference is
// valid until the next call
int& corner_named(int field, const CornerKey& key, CornerNames& names);

#endif
