// ---------------------------------------------------------------------------
// corner_names.h : corners of points by what names them, the same in all elements that share one
// ---------------------------------------------------------------------------
#ifndef MPFE_POINT_CORNER_NAMES_H
#define MPFE_POINT_CORNER_NAMES_H

#include <utility>

#include "base/types.h"

// The mesh nodes that a corner hangs on and their integer weights, in an order that all elements have
using CornerKey = std::vector<std::pair<int, int>>;

struct CornerNames {
  IntVec field, corner;        // [name] grid field; the corner, -1: none has the name now
  ListTable node;              // [name] mesh nodes
  IntVec weight;               // [node.item]
  IntVec place;                // hash table of names, -1: free; a power of two
};

// corner_named : the corner of a field with this name, -1: none, and it may become one; until the next call
int& corner_named(int field, const CornerKey& key, CornerNames& names);

#endif
