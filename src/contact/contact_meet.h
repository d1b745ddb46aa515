// ---------------------------------------------------------------------------
// contact_meet.h : projection of a contact point on faces                                      (4.9)
// ---------------------------------------------------------------------------
#ifndef MPFE_CONTACT_CONTACT_MEET_H
#define MPFE_CONTACT_CONTACT_MEET_H

#include <vector>

#include "model/state.h"

// Fraction of the size of a face: a point deeper below it did not enter through this face, nor did one deeper
// than the element is high: the far side of a thin plate on another one is no overlap
// (test: Face.ContactMeetsNearTheRimAndNotTooDeep, contact/thin_plates.inp)
const double CONTACT_DEEPEST = 0.5;

struct MasterFace {
  int n = 0;                   // corners, which stand first: 2, 3 or 4
  int all = 0, kind = 0;       // nodes, more of quadratic elements; face_kind
  int node[MAX_FACE_NODES];    // nodes (corner c: nnode + c)
  double x[3 * MAX_FACE_NODES];        // their positions at t(n)
  double lo[3], hi[3];
  double size = 0.0;           // longest edge
  double deepest = 0.0;        // depth up to which a point may have entered through it                length
  double rounding = 0.0;       // round-off error of a gap measured from it             length
  int skin = -1;               // general contact: index into the skin
};

// Height of an element over its face at t = 0, mean distance of its other corners; sliver: with a node over
// the face, which says little about the thickness of the body
struct FaceHeight {
  double mean = 0.0;
  bool sliver = false;
};

// face_height : of the element or point with the face out
FaceHeight face_height(const Model& m, const Points& pts, bool body, int elem, const MasterFace& out);

// master_face : the face f in its present position; body: of a point, otherwise of a finite element; height:
// null: computed
MasterFace master_face(const Model& m, const Points& pts, bool body, const Face& f, const RealVec& u,
                       const RealVec& uc, const FaceHeight* height = nullptr);

// face_at_start : the face at t = 0
MasterFace face_at_start(const Model& m, const Points& pts, bool body, const Face& f);

// face_middle : centre and unit normal there                                                     [3]
void face_middle(const MasterFace& f, double* x, double* n);

struct Hit {                   // a face that a point meets, and its projection on it
  const MasterFace* face = nullptr;
  // shape functions at the projection, normal, vector from there to the point
  double N[MAX_FACE_NODES], n[3], r[3];
  double gap = 0.0;
  bool beside = false;         // the projection is on the rim, and the point below and beside it
};

// projection of a point on a face: none, on its rim, inside
enum Projection { PROJ_NONE, PROJ_RIM, PROJ_OVER };

// contact_meet : projection of p [3] on f: p lies over f, or beside its rim by at most a hundredth of its
// size. None beyond reach, or if p has penetrated by more than half of the size or the height of the element.
Projection contact_meet(const MasterFace& f, const double* p, double reach, Hit& hit);

// contact_nearest : the point of f closest to p; over: p lies over f. Returns the squared distance
double contact_nearest(const MasterFace& f, const double* p, bool& over, Hit& hit);

// contact_outside : hit is beside an edge shared with the neighbour, and p is in front of the neighbour: p is
// outside a convex corner, not below a concave one
bool contact_outside(const Hit& hit, const MasterFace& neighbour, const double* p);

// contact_hold : projection of p on f, or on f extended, at any depth; false: p is beside f by more than its
// size
bool contact_hold(const MasterFace& f, const double* p, Hit& hit);

// contact_nearer : adds hit to best, the hits so far; a better kind of projection replaces them
void contact_nearer(const Hit& hit, Projection k, Projection& kind, std::vector<Hit>& best);

// contact_equal : keeps in best the face with the smallest gap, or the faces of equal gap that meet at an
// angle. Equal gaps: the face with the closest projection, then the first one; round-off does not decide
void contact_equal(std::vector<Hit>& best);

#endif
