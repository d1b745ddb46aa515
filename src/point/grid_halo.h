// ---------------------------------------------------------------------------
// grid_halo.h : halo of the nodes and cells of the grid, in a model whose points are divided among ranks.
// Private to the files of point/
// ---------------------------------------------------------------------------
#ifndef MPFE_POINT_GRID_HALO_H
#define MPFE_POINT_GRID_HALO_H

#include "point/grid_cell.h"

struct KeyHalo {
  std::vector<long> key;       // touched by this rank, and by other ranks close to its own, ascending
  IntVec here;                 // indices into key of the keys that this rank touches
  IntVec first;                // [key] the first rank that touches it
  std::vector<char> own;       // [key] this rank touches it
  std::vector<char> shared;    // [key] another rank touches it
  std::vector<IntVec> to, from;    // [ranks] indices into key: sent to that rank, received from it
  bool counts(int k) const { return own[k] && first[k] == comm_rank(); }
};

struct GridHalo {
  KeyHalo node, cell;
};

// grid_halo : the touched nodes and cells of this rank, and those of other ranks within reach cells of its
// bounding box. False: good is false on some rank. Collective.
bool grid_halo(const Grid& g, int dim, bool good, const std::vector<long>& node,
               const std::vector<long>& cell, int reach, GridHalo& h);

// key_max : sets x [key] to the maximum over the ranks that touch the key. Collective.
void key_max(const KeyHalo& h, RealVec& x);

#endif
