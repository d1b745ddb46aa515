// ---------------------------------------------------------------------------
// mortar.h : two surfaces whose faces do not match, tied by dual shape functions (doc/theory.md 5.2)
// ---------------------------------------------------------------------------
#ifndef MPFE_SHAPE_MORTAR_H
#define MPFE_SHAPE_MORTAR_H

#include <utility>
#include <vector>

#include "base/types.h"
#include "model/element_table.h"

struct MortarFace {            // an edge (2 corners), a triangle, a quadrilateral
  int n;                       // corners
  int node[MAX_FACE_NODES];    // corners, then nodes on the edges
  int mid = 0;                 // nodes on the edges, of quadratic elements
  int all() const { return n + mid; }
};

// A row is w[node] = sum of coef u[master]; the coefficients sum to 1, and reproduce linear functions where
// the surfaces meet. At corners w = u, at a node on an edge u = w/2 + (u[end 0] + u[end 1])/4         (5.15)
struct MortarRow {
  int node;
  double area;                 // D: its shape function over what the master covers           length^(dim-1)
  std::vector<std::pair<int, double>> master;        // node, coef
  int end[2] = {-1, -1};       // corners at the ends of the edge; -1: the node is a corner
};

// mortar_rows : a row for each node of the slave faces that the master faces cover, ascending     (5.10)
//   in   X      [nnode*3]
//        reach  largest distance along the normal between points that are opposite each other     length
std::vector<MortarRow> mortar_rows(const RealVec& X, const std::vector<MortarFace>& slave,
                                   const std::vector<MortarFace>& master, double reach);

// mortar_distances : from each node to the nearest of the faces, at most limit                        length
RealVec mortar_distances(const RealVec& X, const IntVec& node, const std::vector<MortarFace>& face,
                         double limit);

// mortar_size : mean size of the faces: lengths, or roots of the areas
double mortar_size(int dim, const RealVec& X, const std::vector<MortarFace>& face);

#endif
