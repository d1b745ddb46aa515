// ---------------------------------------------------------------------------
// contact_meet.h : one place of contact and the faces that it may meet                         (4.9)
// ---------------------------------------------------------------------------
#ifndef MPFE_CONTACT_CONTACT_MEET_H
#define MPFE_CONTACT_CONTACT_MEET_H

#include <vector>

#include "model/state.h"

// Part of the size of a face: a point deeper below it has come from elsewhere.
// Test: Face.ContactMeetsNearTheRimAndNotTooDeep (unit)
const double CONTACT_DEEPEST = 0.5;

struct MasterFace {
  int n = 0;
  int kin[4];                  // nodes (corner c: nnode + c)
  double x[12];                // places at t(n)
  double lo[3], hi[3];
  double size = 0.0;           // longest edge
  double rounding = 0.0;       // error of a gap that is measured from it               length
  int skin = -1;               // general contact: index into the skin
};

// master_face : the face f where it is; body: points own it, otherwise a finite element
MasterFace master_face(const Model& m, const Points& pts, bool body, const Face& f, const RealVec& u,
                       const RealVec& uc);

// face_at_start : where it was at t = 0
MasterFace face_at_start(const Model& m, const Points& pts, bool body, const Face& f);

// face_middle : its middle and unit normal there                                                 [3]
void face_middle(const MasterFace& f, double* x, double* n);

struct Hit {                   // a face that is met, and where
  const MasterFace* face = nullptr;
  double N[4], n[3], r[3];     // shape functions of the place, normal, from the place to the point
  double gap = 0.0;
  bool beside = false;         // the place is on the rim, and the point behind it
};

// how a point projects on a face: not, on its rim, inside
enum Projection { PROJ_NONE, PROJ_RIM, PROJ_OVER };

// contact_meet : the place of f that p [3] meets: p lies over f, or beside its rim by no more than a
// hundredth of its size. None beyond reach or when p has entered by more than half of its size.
Projection contact_meet(const MasterFace& f, const double* p, double reach, Hit& hit);

// contact_nearest : the place of f nearest to p; in over: does p lie over f. Returns the squared distance
double contact_nearest(const MasterFace& f, const double* p, bool& over, Hit& hit);

// contact_outside : hit is beside a rim that the neighbour has too, and p is in front of the neighbour: it is
// outside of a corner, not behind a dent
bool contact_outside(const Hit& hit, const MasterFace& neighbour, const double* p);

// contact_hold : the foot of p on f, or on f extended, whatever its depth; false: further beside f than its
// size
bool contact_hold(const MasterFace& f, const double* p, Hit& hit);

// contact_nearer : takes the face of hit into best, the faces so far, of one kind of projection
void contact_nearer(const Hit& hit, Projection k, Projection& kind, std::vector<Hit>& best);

// contact_equal : leaves in best the nearest face, or those that are equally near and meet at an angle. Of
// equally near ones that with the nearest place counts, then the first: rounding does not choose
void contact_equal(std::vector<Hit>& best);

#endif
