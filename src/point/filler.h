// ---------------------------------------------------------------------------
// filler.h : what fills bodies with material points. Private to the files of point/
// ---------------------------------------------------------------------------
#ifndef MPFE_POINT_FILLER_H
#define MPFE_POINT_FILLER_H

#include <algorithm>

#include "base/comm.h"
#include "point/point.h"

// A domain of an element that is material points from the start, before it is made
struct Domain {
  int point = -1;              // number among the points of all ranks
  int rank = 0;                // who works on it
  int elem = -1;               // element that it is a part of, on its own rank
  int shape = 0;               // Shape
  int corner[8] = {};          // index into FillPlan::number
};

// Several ranks: domains of such elements that this one knows: its own, those of others that share a corner
// with them, and what contact holds with those that share a corner with it
struct FillPlan {
  std::vector<std::vector<Domain>> domain;           // [body] ascending by their numbers
  IntVec npoint, ncorner;      // [body] of all ranks
  IntVec number;               // [corner] number among those of all ranks
  RealVec X;                   // [corner*dim] at t = 0
  IntVec index;                // [corner] index of the corner that was made here, -1: none
  IntVec used;                 // corners of domains that are made here, ascending by their numbers
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
  const IntVec* known = nullptr;         // numbers of points of others that are known here, ascending
  // is the point with this number, which that rank works on, here?
  bool has(int number, int rank) const
  {
    return rank == comm_rank() || std::binary_search(known->begin(), known->end(), number);
  }
};

// fill_corner : adds a corner, returns its index
int fill_corner(Filler& f, const double* X, int field);

// fill_point : adds one domain with the given corners; an error when its volume is not positive
void fill_point(Filler& f, int body, Shape shape, const int* corner);

// fill_element : the lattice of element e becomes points of a body
void fill_element(Filler& f, int body, int e);

// fill_accepts : WHERE of a body or a surface at X; a value that is no number is a mistake, told once for
// each
bool fill_accepts(const Expr& where, const double* X, int dim, const char* kind, const std::string& name,
                  const Place& place, int& faults);

// share_corners : PointPart::held and halo: which corners other ranks have too, and whose they are: of a rank
// with a point that has it (own [ncorner]), -1: there is none. Collective.
void share_corners(const std::vector<char>& own, PointPart& part);

// fill_box : the points of a body in a box. ranks: Body::rank; empty: all of them are of this rank, as on
// one rank. Else those of this rank and known ones; numbers, PointPart::rank, near and foreign
// (numbers of all ranks, not sorted yet) go on.
void fill_box(Filler& f, int body, const CellRanks& ranks);

// fill_box_counts : adds the points and corners of a body in a box, of all ranks, to PointPart::npoint and
// ncorner
void fill_box_counts(Filler& f, int body);

// fill_plan : the domains of bodies with FILL=ELSET that this rank knows of itself. Returns the number of
// errors on any rank. Collective.
int fill_plan(const Model& m, FillPlan& plan);

// fill_plan_near : adds the domains of these points of other ranks, and those that share a corner with them,
// as their ranks tell. Collective.
void fill_plan_near(const std::vector<PointHome>& point, int dim, FillPlan& plan);

// fill_plan_begin : nothing of the plan is made yet; which corners will be
void fill_plan_begin(const Filler& f, FillPlan& plan);

// fill_planned : the points of a body that were planned, as fill_box
void fill_planned(Filler& f, int body, FillPlan& plan);

#endif
