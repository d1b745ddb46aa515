// ---------------------------------------------------------------------------
// contact.h : contact as a bond activated by the gap condition (doc/theory.md 4.2)
//
// Side A of a contact bond is a point of the slave surface. Side B is the master face that it meets, found at
// t(n) and kept over the increment: projection on the face, normal, gap. Faces belong to finite elements or
// to the boundary of a body.
// ---------------------------------------------------------------------------
#ifndef MPFE_CONTACT_CONTACT_H
#define MPFE_CONTACT_CONTACT_H

#include "elem/kernel.h"
#include "model/state.h"

// Fraction of the size of the face: at larger depth the contact stiffness grows (4.21). Ordinary contact
// stays linear: with growth from zero depth, discs of points separate 2 % faster
// (test: contact/deep_discs.inp)
const double CONTACT_DEEP = 0.05;

// The faces that contact bonds meet in this increment
struct ContactPairs {
  // [nbond] kinematic points of the master face (corner c: nnode + c), empty: no face met
  ListTable master;
  RealVec master_w;            // [master.item] shape functions of the face, sum 1
  RealVec normal;              // [nbond*dim] outward normal of the master face at t(n)
  // [nbond] at t(n), without offset and initial penetration of the bond; negative: pushes   length
  RealVec gap;
  RealVec size;                // [nbond] longest edge of the master face             length
  RealVec rounding;            // [nbond] round-off error of gap                      length
  RealVec deep;                // [nbond] depth from which the pressure grows, 0: none     length
  // [nbond] general contact: penalty per area and friction of the two faces, where a face is met
  RealVec penalty, friction, stick;
  IntVec face;                 // [nbond] general contact: index into Bonds::skin of the master face, -1: none
  IntVec wall;                 // [nbond] general contact: the *GRID BOUNDARY that is met, -1: none
  int near = 0;                // bonds that meet a face; several ranks: maximum over the ranks
  int searched = 0, skipped = 0;    // definitions; skipped: the boxes of their surfaces do not overlap
};

// contact_acts : is bond b a tie, or a contact point that meets a face?
inline bool contact_acts(const Bonds& bonds, const ContactPairs& pairs, int b)
{
  return bonds.side[b] != SIDE_CONTACT || pairs.master.count(b);
}

// contact_touch : gap of bond b up to which surfaces touch                         length
inline double contact_touch(const ContactPairs& pairs, int b)
{
  return 1e-9 * pairs.size[b] + pairs.rounding[b];
}

// contact_gap : a gap of bond b as stored in the history: penetration within round-off is zero
inline double contact_gap(const ContactPairs& pairs, int b, double gap)
{
  return gap < 0.0 && gap >= -pairs.rounding[b] ? 0.0 : gap;
}

// contact_skin : outer faces of elements and points that take part in general contact, without faces tied to
// a body by bonds (interface: faces in addition to those of *BOND) and faces where points hang on elements.
// Collective with MeshPart::window.
std::vector<SkinFace> contact_skin(const Model& m, const Fracture& fr, const Points& pts,
                                   const std::vector<Face>& interface);

// contact_skin_at_start : outer faces of elements of the whole mesh at t = 0, none without general contact
std::vector<Face> contact_skin_at_start(const Model& m);

// A plane that *GRID BOUNDARY holds in its normal direction: a wall for points that are not on the grid
struct ContactWall {
  int grid_bc = -1, axis = 0;
  double at = 0.0, side = 0.0;         // position; +1, -1: the body is above, below
  bool sticks = false;         // fixed in its plane too: friction
};

// contact_walls : planes at the ends of the grid whose normal displacement is zero
std::vector<ContactWall> contact_walls(const Model& m);

struct ContactScene;

// contact_search : nearest master face of every owned contact point, within reach; bodies that are far apart
// cost only a test of their boxes. Collective.
//   in   l  displacements of nodes and corners, gaps;  xb [nbond*dim] positions of side A;
//        scene  neighbouring faces of general contact, from scene_update
void contact_search(const Model& m, const Points& pts, const Bonds& bonds, const Level& l,
                    const RealVec& xb, const ContactScene& scene, ContactPairs& pairs);

// contact_search_start : the same for contact pairs with the master faces of t = 0, even if their elements
// have broken since, and for all contact points of this rank; u, uc, xb of t = 0. Collective
// with a divided model.
void contact_search_start(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& u,
                          const RealVec& uc, const RealVec& xb, ContactPairs& pairs);

// contact_initial : initial penetrations, and gaps without them; in motion (moves) gaps continue those at the
// end of the last step                                                             (4.16)
//   in   l: level n;  bonds.initial_penetration and pairs.gap are updated
void contact_initial(const Level& l, int dim, bool moves, Bonds& bonds, ContactPairs& pairs);

// contact_forget : contact points without a face are open and without force over the increment
void contact_forget(const Bonds& bonds, const ContactPairs& pairs, int dim, Level& l);

// contact_stiffness : points of general contact take the friction of the face that they meet. Points that do
// not push take in dynamics (moves) the depth from which their stiffness grows, and in general contact the
// penalty of the face
void contact_stiffness(const Level& l, int dim, bool moves, const ContactPairs& pairs, Bonds& bonds);

// contact_start : surfaces that overlap at the start: reports size and position, and pushes, takes the gaps
// as offsets (bonds.offset), or counts an error, as the deck demands                                (4.13)
//   in   pairs of t = 0;   returns the number of errors. Collective.
int contact_start(const Model& m, Bonds& bonds, const ContactPairs& pairs, const RealVec& xb);

// contact_offsets : contact points created by conversion take the offset
// that they would have had at t = 0 (4.13)
//   in   added: these bonds;   bonds.offset is set for owned points only, whose master faces are stored here.
//        Collective with a divided model.
void contact_offsets(const Model& m, const Points& pts, const IntVec& added, Bonds& bonds);

// contact_displacements : the displacements that the deck prescribes at t = 0, also of corners that
// conversion has created since
void contact_displacements(const Model& m, const Points& pts, RealVec& u, RealVec& uc);

// contact_force : force on side A minus side B and, unless K is null, its tangent: symmetric part K and
// remainder across n^T   (4.9) - (4.12)
//   in   s [dim]     relative displacement over the increment;  t0 [dim] friction force at t(n);
//        lambda multiplier of the normal force, <= 0
//   out  f [dim], K [dim*dim], t1 [dim] friction force at t(n+1), slipped [1] distance slipped,
//        across [dim] unless null, zero where nothing slips; returns the gap at t(n+1),
//        zero where it is within round-off
double contact_force(const Model& m, const Bonds& bonds, const ContactPairs& pairs, int b,
                     const KernelMode& mode, const double* s, const double* t0, double lambda, double* f,
                     double* K, double* t1, double* slipped, double* across = nullptr);

// contact_multiplier : the normal multiplier after an update, never tensile  (4.15)
double contact_multiplier(const KernelMode& mode, double C, double gap, double lambda);

#endif
