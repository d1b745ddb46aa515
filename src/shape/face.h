// ---------------------------------------------------------------------------
// face.h : edges of 2D cells, faces of 3D cells (doc/theory.md 4, 5)
//
// A face has 2 nodes (edge), 3 (triangle) or 4 (quadrilateral), ordered so that its normal points out of the
// cell. Faces of quadratic elements also have a node on each edge, after the corners: FACE_EDGE3, 6, 8.
// Local coordinates: edge -1 ... 1, triangle xi >= 0 with sum <= 1, quadrilateral -1 ... 1.
// nen below is the number of nodes, except for the edge of three nodes: face_kind.
// ---------------------------------------------------------------------------
#ifndef MPFE_SHAPE_FACE_H
#define MPFE_SHAPE_FACE_H

#include <vector>

#include "shape/shape.h"

const int FACE_EDGE3 = 5;

inline int face_kind(int dim, int nodes) { return dim == 2 && nodes == 3 ? FACE_EDGE3 : nodes; }

struct FaceRule {
  int n;
  double xi[9][2];
  double w[9];
};

// face_rule : Gauss points of a face with nen nodes (2: two points, 3: three, 4: two by two; FACE_EDGE3:
// three, 6: six, 8: three by three)
const FaceRule& face_rule(int nen);

// face_eval : N [nodes] and, unless null, dN/dxi [nodes*2]
void face_eval(int nen, const double* xi, double* N, double* dN);

// face_area : outward area vector per unit of local coordinates: x [nodes*3]; returns its norm and, in n[3],
// the vector.
// In two dimensions (an edge) the face has unit thickness.
double face_area(int nen, const double* x, const double* xi, double* n);

// face_whole_area : area of the face (length of an edge) by Gauss integration. x [nen*3]
double face_whole_area(int nen, const double* x);

// A lattice point of a face: integer weights on its nodes (their sum is parts^2), and its share of the area
struct FacePoint {
  int iw[4] = {0, 0, 0, 0};
  double xi[2] = {0, 0};
  double share = 0.0;          // area, by the trapezoidal rule; the shares sum to the area of the face
};

// A Gauss point inside a face, with its share of the area
struct FaceSample {
  double xi[2] = {0, 0};
  double N[MAX_FACE_NODES] = {0};
  double area  = 0.0;
};

// face_samples : divides every edge into parts, with Gauss points in each piece (edge: 2 per piece,
// quadrilateral: 4, triangle: 3), so that constant and linear pressures give the exact nodal forces of the
// face. nen: face_kind; faces of quadratic elements have the points of the linear face, with their own N.
// x [nodes*3] at t = 0. doc/theory.md (4.17)
std::vector<FaceSample> face_samples(int nen, const double* x, int parts);

// face_lattice : parts + 1 points along every edge, corners included. x [nen*3] at t = 0. doc/theory.md (4.5)
std::vector<FacePoint> face_lattice(int nen, const double* x, int parts);

#endif
