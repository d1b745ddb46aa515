// ---------------------------------------------------------------------------
// filler.h : what fills bodies with material points. Private to the files of point/
// ---------------------------------------------------------------------------
#ifndef MPFE_POINT_FILLER_H
#define MPFE_POINT_FILLER_H

#include <algorithm>

#include "base/comm.h"
#include "point/point.h"

// Domains of all ranks that are not made yet: corners by their numbers among those of all ranks
struct FillPlan {
  IntVec cell;                 // [point] cell of the fill that it is in
  IntVec shape;                // [point] Shape
  ListTable conn;              // [point] numbers of its corners
  RealVec X;                   // [corner*dim] from the first one of the body on
  std::vector<char> common;    // [corner] other bodies may have it, too
  int first = 0;               // number of that one
};

struct Filler {
  const Model& m;
  Points& pts;
  CornerShare& share;
  int parent = -1;             // element that becomes points during the run; points of all ranks before
  int before = 0;
  int errors = 0;
  int at_node[8] = {};         // corners at the nodes of the element, of those that hang
  FillPlan* plan = nullptr;    // nothing is made, but planned
  const IntVec* known = nullptr;         // numbers of points that all ranks know, ascending
  std::vector<char> common = {};         // [node] elements of several bodies on one field have it
  // is the point with this number here, when its rank has its cell?
  bool has(int number, int rank) const
  {
    return rank == comm_rank() || std::binary_search(known->begin(), known->end(), number);
  }
};

// fill_corner : adds a corner, returns its index
int fill_corner(Filler& f, const double* X, int field);

// fill_point : adds one domain with the given corners; an error when its volume is not positive
void fill_point(Filler& f, int body, Shape shape, const int* corner);

// fill_accepts : WHERE of a body or a surface at X; a value that is no number is a mistake, told once for
// each
bool fill_accepts(const Expr& where, const double* X, int dim, const char* kind, const std::string& name,
                  const Place& place, int& faults);

// share_corners : PointPart::held and halo: which corners other ranks have too, and whose they are: of a rank
// with a point that has it (own [ncorner]), -1: there is none. Collective.
void share_corners(const std::vector<char>& own, PointPart& part);

// fill_ranks : which rank has the points of each cell of a fill: of a box, or element of a set [body][cells]
std::vector<IntVec> fill_ranks(const Model& m);

// fill_box : the points of a body in a box. rank: of fill_ranks; empty: all of them are of this rank, as on
// one rank. Else those of this rank and those that all know; numbers, PointPart::rank, near and foreign
// (numbers of all ranks, not sorted yet) go on.
void fill_box(Filler& f, int body, const IntVec& rank);

// fill_planned : the points of a body that were planned, as fill_box. Corners that other bodies may have are
// made on all ranks.
void fill_planned(Filler& f, int body, const FillPlan& plan, const IntVec& rank);

#endif
