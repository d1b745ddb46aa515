// ---------------------------------------------------------------------------
// grid_cell.h : cells and nodes of the grid: places, keys. Private to the files of point/
// ---------------------------------------------------------------------------
#ifndef MPFE_POINT_GRID_CELL_H
#define MPFE_POINT_GRID_CELL_H

#include <algorithm>
#include <cmath>

#include "point/point.h"

const double snap_to_face = 1e-12;     // a place this close to a cell face, in cells, lies on it
// a place this far outside the grid, in cells, lies on its boundary: debris that is pressed on a plane of
// symmetry drifts by 2e-3 in some thousand increments (verification/paper/p9_contact.inp, 2.1 ms)
const double grid_rim     = 0.02;

// where a place lies in the grid: cell and local place 0 ... 1
struct CellPlace {
  int cell[3] = {0, 0, 0};
  double xi[3] = {0, 0, 0};
};

template <int D>
bool locate(const Grid& g, const double* x, CellPlace& s)
{
  for (int i = 0; i < D; ++i) {
    const double t = (x[i] - g.lo[i]) / g.h[i];
    if (!(t > -grid_rim && t < g.n[i] + grid_rim)) return false;
    int c     = static_cast<int>(std::floor(t));
    double xi = t - c;
    if (xi < snap_to_face) xi = 0.0;
    if (xi > 1.0 - snap_to_face) { ++c; xi = 0.0; }
    if (c < 0) { c = 0; xi = 0.0; }
    if (c >= g.n[i]) { c = g.n[i] - 1; xi = 1.0; }
    s.cell[i] = c;
    s.xi[i]   = xi;
  }
  return true;
}

inline long node_key(const Grid& g, int dim, int field, const int* at)
{
  const long node = at[0] + (g.n[0] + 1L) * (at[1] + (dim == 3 ? (g.n[1] + 1L) * at[2] : 0L));
  return field * grid_nodes(g, dim) + node;
}

inline long cell_key(const Grid& g, int dim, int field, const int* at)
{
  const long cell = at[0] +
                    static_cast<long>(g.n[0]) * (at[1] + (dim == 3 ? static_cast<long>(g.n[1]) * at[2] : 0L));
  return field * grid_cells(g, dim) + cell;
}

// the weights of a place on the nodes of its cell, without those that are zero; returns how many
template <int D>
int cell_weights(const Grid& g, int field, const CellPlace& s, long* key, double* w)
{
  const long first = node_key(g, D, field, s.cell), step[3] = {1, g.n[0] + 1L, (g.n[0] + 1L) * (g.n[1] + 1L)};
  int n = 0;
  for (int k = 0; k < (1 << D); ++k) {
    double N  = 1.0;
    long node = first;
    for (int i = 0; i < D; ++i) {
      const bool up = (k >> i) & 1;
      N *= up ? s.xi[i] : 1.0 - s.xi[i];
      if (up) node += step[i];
    }
    key[n] = node;
    w[n]   = N;
    n += N != 0.0;
  }
  return n;
}

// place of a node or cell, counted in cells, from its number; more: a row has so many more than cells
inline void place_of_number(const Grid& g, int dim, int more, long number, int* at)
{
  for (int i = 0; i < 3; ++i) {
    const int per = g.n[i] + more;
    at[i] = i < dim ? static_cast<int>(number % per) : 0;
    if (i < dim) number /= per;
  }
}

// node_of_key, cell_of_key : the field, and the place counted in cells
inline int node_of_key(const Grid& g, int dim, long key, int* at)
{
  const long nn = grid_nodes(g, dim);
  place_of_number(g, dim, 1, key % nn, at);
  return static_cast<int>(key / nn);
}

inline int cell_of_key(const Grid& g, int dim, long key, int* at)
{
  const long nc = grid_cells(g, dim);
  place_of_number(g, dim, 0, key % nc, at);
  return static_cast<int>(key / nc);
}

// place of a key in an ascending list, -1: not there
inline int find_key(const std::vector<long>& sorted, long key)
{
  const auto it = std::lower_bound(sorted.begin(), sorted.end(), key);
  return it != sorted.end() && *it == key ? static_cast<int>(it - sorted.begin()) : -1;
}

// a node with so little support follows others                                      (3.10)
inline bool grid_is_weak(const Grid& g, double support) { return !(support >= g.weak && support > 0.0); }

struct KeyHalo;

const int REACH = 3;           // cells from a weak node to what it may follow

// grid_ghost : ghost stabilisation of the active cells, on node, the keys of touched nodes, ascending.
// halo: cells of this rank and of others near it, where the model is divided; null: there are none but
// g.cell.  doc/theory.md (3.16)
void grid_ghost(const Model& m, const Points& pts, const RealVec& uc, const std::vector<long>& node,
                const KeyHalo* halo, ActiveGrid& g);

// points_meet : have points that do not hang together there a node of the grid in common? For each node of
// key the points around it (point: their nodes): they hang together by their corners, or by points that share
// a corner with one of them. Nodes of the mesh and unknowns of corners do not count. halo: of key, where the
// model is divided (collective); else null
bool points_meet(const Points& pts, const GridShare& share, const std::vector<long>& key,
                 const ListTable& point, const KeyHalo* halo);

// grid_compose : lists on touched nodes become lists on unknown nodes               (3.12)
void grid_compose(const GridLists& ext, int nnode, ListTable& list, RealVec& list_w);

// point_sums : dS_pv/dX of every point from its corners (3.7), for the lists of g
void point_sums(const Points& pts, int dim, ActiveGrid& g);

// point_support : [nnode] max_p S_pv of every node (3.10), by the lists of g
RealVec point_support(const Points& pts, int nnode, const ActiveGrid& g);

#endif
