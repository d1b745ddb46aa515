// ---------------------------------------------------------------------------
// filler.h : what fills bodies with material points. Private to the files of point/
// ---------------------------------------------------------------------------
#ifndef MPFE_POINT_FILLER_H
#define MPFE_POINT_FILLER_H

#include "point/point.h"

struct Filler {
  const Model& m;
  Points& pts;
  CornerShare& share;
  int parent = -1;             // element that becomes points during the run
  int errors = 0;
  int at_node[8] = {};         // corners at the nodes of the element, of those that hang
};

// fill_corner : adds a corner, returns its index
int fill_corner(Filler& f, const double* X, int field);

// fill_point : adds one domain with the given corners; an error when its volume is not positive
void fill_point(Filler& f, int body, Shape shape, const int* corner);

// fill_accepts : WHERE of a body or a surface at X; a value that is no number is a mistake, told once for
// each
bool fill_accepts(const Expr& where, const double* X, int dim, const char* kind, const std::string& name,
                  const Place& place, int& faults);

// fill_box_ranks : which rank has the points of each cell of the boxes of bodies; all bodies are filled in
// boxes                                                                                      [body][cells]
std::vector<IntVec> fill_box_ranks(const Model& m);

// fill_box : the points of a body in a box. rank: of fill_box_ranks; empty: all of them are of this rank, as
// on one rank. Else numbers, PointPart::near and foreign (numbers of all ranks, not sorted yet) go on.
void fill_box(Filler& f, int body, const IntVec& rank);

#endif
