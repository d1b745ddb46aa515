// ---------------------------------------------------------------------------
// filler.h : filling of bodies with material points. Private to the files of point/
// ---------------------------------------------------------------------------
#ifndef MPFE_POINT_FILLER_H
#define MPFE_POINT_FILLER_H

#include <algorithm>

#include "base/comm.h"
#include "point/point.h"

// A planned domain of an element that is material points from the start
struct Domain {
  int point = -1;              // number among the points of all ranks
  int rank = 0;                // its owner
  int elem = -1;               // element that contains it, on the owner
  int shape = 0;               // Shape
  int corner[8] = {};          // index into FillPlan::number
};

// Several ranks: the domains of such elements that this rank stores: owned ones, domains of other ranks that
// share a corner with them, halo domains that contact needs, and the domains that share a corner with these
struct FillPlan {
  std::vector<std::vector<Domain>> domain;           // [body] ascending by their numbers
  IntVec npoint, ncorner;      // [body] of all ranks
  IntVec number;               // [corner] number among the corners of all ranks
  RealVec X;                   // [corner*dim] at t = 0
  IntVec index;                // [corner] index of the corner on this rank, -1: none
  IntVec used;                 // corners of domains that this rank creates, ascending by number
};

struct Filler {
  const Model& m;
  Points& pts;
  CornerShare& share;
  int parent = -1;             // element that is converted to points during the run
  int before = 0;              // points of all ranks before the conversion
  int errors = 0;
  int at_node[8] = {};         // corners at the nodes of the element, which hanging corners interpolate
  FillPlan* plan = nullptr;    // points are planned only, not created
  const IntVec* known = nullptr;         // numbers of halo points (of other ranks, stored here), ascending
  // does this rank store the point with this number and owner?
  bool has(int number, int rank) const
  {
    return rank == comm_rank() || std::binary_search(known->begin(), known->end(), number);
  }
};

// fill_corner : adds a corner, returns its index
int fill_corner(Filler& f, const double* X, int field);

// fill_point : adds one domain with the given corners; an error when its volume is not positive
void fill_point(Filler& f, int body, Shape shape, const int* corner);

// fill_element : fills element e with a lattice of points of a body
void fill_element(Filler& f, int body, int e);

// fill_accepts : WHERE of a body or a surface at X; a value that is not finite is an error,
// reported once per body or surface
bool fill_accepts(const Expr& where, const double* X, int dim, const char* kind, const std::string& name,
                  const DeckLine& deck_line, int& faults);

// share_corners : PointPart::lone_corners and halo: corners shared with other ranks, and their owners: a rank
// that owns a point with the corner (own [ncorner]), -1: there is none. Collective.
void share_corners(const std::vector<char>& own, PointPart& part);

// fill_box : the points of a body in a box. ranks: Body::rank; empty: this rank owns all points. Else owned
// and halo points are created; numbers, PointPart::rank, outer_conn and outer_corner (numbers of all ranks,
// not sorted yet) are continued.
void fill_box(Filler& f, int body, const CellRanks& ranks);

// fill_box_counts : adds the points and corners of a body in a box, of all ranks, to PointPart::npoint and
// ncorner
void fill_box_counts(Filler& f, int body);

// fill_plan : the domains of bodies with FILL=ELSET in the elements that this rank stores. Returns the number
// of errors, maximum over the ranks. Collective.
int fill_plan(const Model& m, FillPlan& plan);

// fill_plan_halo : adds the domains of these points of other ranks, and the domains that share a corner with
// them, received from their owners. Collective.
void fill_plan_halo(const std::vector<OriginalPoint>& point, int dim, FillPlan& plan);

// fill_plan_begin : marks the corners of the plan that this rank will create; none is created yet
void fill_plan_begin(const Filler& f, FillPlan& plan);

// fill_planned : creates the planned points of a body, as fill_box
void fill_planned(Filler& f, int body, FillPlan& plan);

#endif
