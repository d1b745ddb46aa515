// ---------------------------------------------------------------------------
// point.h : material points: fill, active grid, results (doc/theory.md 3)
// ---------------------------------------------------------------------------
#ifndef MPFE_POINT_POINT_H
#define MPFE_POINT_POINT_H

#include <array>

#include "elem/elem.h"
#include "model/state.h"

// The part of the grid that exists in this step, and what corners see of it
struct ActiveGrid {
  int nnode = 0;               // unknown grid nodes
  int ncell = 0;               // cells that hold a corner or a bond
  int nweak = 0;               // touched nodes that follow others (extended basis)
  int nlone = 0;               // weak nodes without a good cell near: kept as unknowns
  std::vector<long> key;       // [nnode] field * (nodes of the grid) + node number, ascending
  std::vector<long> cell;      // [ncell] field * (cells of the grid) + cell number, ascending
  ListTable corner;            // [ncorner] unknown grid nodes that a corner follows
  RealVec corner_w;            // [corner.item] weights, sum 1
  ListTable point;             // [npoint] unknown grid nodes of a point
  RealVec S;                   // [point.item] S_pv
  RealVec dS;                  // [point.item*dim] dS_pv/dX                         1/length
  ListTable bond;              // [nbond] unknown grid nodes of side B
  RealVec bond_w;
};

// grid_node_place : position of a grid node from its key
void grid_node_place(const Grid& g, int dim, long key, double x[3]);

// point_fill : material points of all bodies (block, element set, region), their boundary and surfaces.
// Messages go to the log; returns the number of errors.
int point_fill(const Model& m, Points& pts);

// point_ip_fields : results of a point; xc [ncorner*dim]
void point_ip_fields(const Model& m, const Points& pts, const RealVec& xc, int p, IpFields& out);

double point_energy(const Model& m, const Points& pts, const RealVec& xc);

#endif
