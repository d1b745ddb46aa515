// ---------------------------------------------------------------------------
// free_face.h : faces of the mesh without an adjacent element: the surface of the bodies at t = 0
// ---------------------------------------------------------------------------
#ifndef MPFE_FRAC_FREE_FACE_H
#define MPFE_FRAC_FREE_FACE_H

#include "model/model.h"

// a face of the surface of a body, or to an element removed at the start
struct FreeFace {
  int elem, n, node[4];
  bool removed;                // the adjacent element was removed
  double mid[3], area[3], size;
};

// face_of : a face at t = 0: centre, area (2D: length) times outward normal
void face_of(const Mesh& mesh, int e, int f, double* mid, double* area);

// free_face : face f of element e; removed: the adjacent element was removed
FreeFace free_face(const Mesh& mesh, int e, int f, bool removed);

// facing : do two free faces face each other across a void? opposed: with 120 degrees or more between their
// normals. h: size of the mesh
bool facing(const FreeFace& a, const FreeFace& b, double h, bool opposed);

// notch_among : do the free faces of a ball contain the end of a notch? Two are opposed, and connected by
// others that extend out of the ball (J is meaningless around a hole inside the ball)
bool notch_among(const std::vector<FreeFace>& face, double h);

// hollow_elements : elements at a re-entrant part of the surface of a body: a free face of the element and
// another one at a common node face each other. The end of a notch contains such an element.
// doc/theory.md (7.7)
//   in   of_node   elements of each node
//        removed   [nelem] 1: removed by *MODEL CHANGE, REMOVE
IntVec hollow_elements(const Mesh& mesh, const ListTable& of_node, const IntVec& removed);

#endif
