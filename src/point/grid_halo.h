// ---------------------------------------------------------------------------
// grid_halo.h : nodes and cells of the grid near each other, of ranks with points of their own. Private to
// the files of point/
// ---------------------------------------------------------------------------
#ifndef MPFE_POINT_GRID_HALO_H
#define MPFE_POINT_GRID_HALO_H

#include "point/grid_cell.h"

struct KeyHalo {
  std::vector<long> key;       // those of this rank, and those of others near them, ascending
  IntVec mine;                 // places in key of those of this rank
  IntVec first;                // [key] the first rank that has it
  std::vector<char> own;       // [key] this rank has it
  std::vector<char> shared;    // [key] another rank has it
  std::vector<IntVec> to, from;    // [ranks] places in key: that rank has been told of, and has told of
  bool counts(int k) const { return own[k] && first[k] == comm_rank(); }
};

struct GridHalo {
  KeyHalo node, cell;
};

// grid_halo : the touched nodes and cells of this rank, and those of others within reach cells of the box
// around them. False: good is false on some rank. Collective.
bool grid_halo(const Grid& g, int dim, bool good, const std::vector<long>& node,
               const std::vector<long>& cell, int reach, GridHalo& h);

// key_max : x [key*D] becomes the largest of all ranks that have the key. Collective.
void key_max(const KeyHalo& h, int D, RealVec& x);

#endif
