// ---------------------------------------------------------------------------
// free_face.h : faces of the mesh with nothing behind them: the surface of the bodies at t = 0
// ---------------------------------------------------------------------------
#ifndef MPFE_FRAC_FREE_FACE_H
#define MPFE_FRAC_FREE_FACE_H

#include "model/model.h"

// the surface of the body, and what was removed at the start
struct FreeFace {
  int elem, n, node[4];
  bool removed;                // an element was there
  double mid[3], area[3], size;
};

// face_of : a face at t = 0: middle, area (length of an edge in the plane) times outward normal
void face_of(const Mesh& mesh, int e, int f, double* mid, double* area);

// free_face : face f of element e; removed: an element was behind it
FreeFace free_face(const Mesh& mesh, int e, int f, bool removed);

// look_at : two free faces with nothing but void between them; opposed: and 120 degrees or more between their
// normals. h: size of the mesh
bool facing(const FreeFace& a, const FreeFace& b, double h, bool opposed);

// notch_among : the end of a notch lies among the free faces of a ball: two are opposed, others lead from one
// to the other, and on out of the ball (around a hole that lies in it whole J says nothing)
bool notch_among(const std::vector<FreeFace>& face, double h);

// hollow_elements : elements at which the surface of a body turns inwards: a free face of theirs and one that
// shares a node with it look at each other. Where free faces that look at each other are joined by others, as
// at the end of a notch, there is such a place among these.                              doc/theory.md (7.7)
//   in   of_node   elements of each node
//        removed   [nelem] 1: *MODEL CHANGE, REMOVE takes it away
IntVec hollow_elements(const Mesh& mesh, const ListTable& of_node, const IntVec& removed);

#endif
