// ---------------------------------------------------------------------------
// grid_cell.h : cells and nodes of the grid: positions, keys. Private to the files of point/
// ---------------------------------------------------------------------------
#ifndef MPFE_POINT_GRID_CELL_H
#define MPFE_POINT_GRID_CELL_H

#include <algorithm>
#include <cmath>

#include "point/point.h"

const double snap_to_face = 1e-12;     // a point this close to a cell face, in cells, is put on it
// a point this far outside the grid, in cells, is put on its boundary: debris pressed onto a plane of
// symmetry drifts by 2e-3 in a few thousand increments (verification/paper/p9_contact.inp, 2.1 ms)
const double grid_rim     = 0.02;

// position in the grid: cell and local coordinates 0 ... 1
struct CellPosition {
  int cell[3] = {0, 0, 0};
  double xi[3] = {0, 0, 0};
};

template <int D>
bool locate(const Grid& g, const double* x, CellPosition& s)
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

// nonzero weights of a position on the nodes of its cell; returns their number
template <int D>
int cell_weights(const Grid& g, int field, const CellPosition& s, long* key, double* w)
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

// grid indices of a node (extra = 1) or a cell (extra = 0) from its number
inline void indices_of_number(const Grid& g, int dim, int extra, long number, int* at)
{
  for (int i = 0; i < 3; ++i) {
    const int row = g.n[i] + extra;
    at[i] = i < dim ? static_cast<int>(number % row) : 0;
    if (i < dim) number /= row;
  }
}

// node_of_key, cell_of_key : the field, and the grid indices
inline int node_of_key(const Grid& g, int dim, long key, int* at)
{
  const long nn = grid_nodes(g, dim);
  indices_of_number(g, dim, 1, key % nn, at);
  return static_cast<int>(key / nn);
}

inline int cell_of_key(const Grid& g, int dim, long key, int* at)
{
  const long nc = grid_cells(g, dim);
  indices_of_number(g, dim, 0, key % nc, at);
  return static_cast<int>(key / nc);
}

// index of a key in an ascending list, -1: not found
inline int find_key(const std::vector<long>& sorted, long key)
{
  const auto it = std::lower_bound(sorted.begin(), sorted.end(), key);
  return it != sorted.end() && *it == key ? static_cast<int>(it - sorted.begin()) : -1;
}

// a node with this little support is interpolated from others                       (3.10)
inline bool grid_is_weak(const Grid& g, double support) { return !(support >= g.weak && support > 0.0); }

struct KeyHalo;

// cells from a weak node to the nodes that it may be interpolated from (theory 3.3)  (no test)
const int REACH = 3;

// grid_ghost : ghost stabilisation of the active cells; node: keys of touched nodes, ascending.
// halo: owned and halo cells of a divided model; null: the cells are g.cell.  doc/theory.md (3.16)
void grid_ghost(const Model& m, const Points& pts, const RealVec& uc, const std::vector<long>& node,
                const KeyHalo* halo, ActiveGrid& g);

// points_meet : do points that are not connected there share a node of the grid? The points around a node of
// key (point: their nodes) are connected by common corners, or by points that share a corner with one of
// them. Mesh nodes and corner unknowns do not count. halo: of key, in a divided model (collective); else null
bool points_meet(const Points& pts, const GridShare& share, const std::vector<long>& key,
                 const ListTable& point, const KeyHalo* halo);

// grid_compose : converts lists on touched nodes to lists on unknown nodes          (3.12)
void grid_compose(const GridLists& ext, int nnode, ListTable& list, RealVec& list_w);

// point_sums : dS_pv/dX of every point from its corners (3.7), for the lists of g
void point_sums(const Points& pts, int dim, ActiveGrid& g);

// point_support : [nnode] max_p S_pv of every node (3.10), by the lists of g
RealVec point_support(const Points& pts, int nnode, const ActiveGrid& g);

#endif
