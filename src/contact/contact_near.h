// ---------------------------------------------------------------------------
// contact_near.h : contact of a divided model: elements of other ranks that are near     (doc/theory.md 5.1)
//
// MeshPart::window: a rank owns the points of general contact on the faces of its elements. Elements of other
// ranks that these may meet are outer elements; when others come within search range, the model is divided
// again. Contact pairs: contact_masters.h.
// ---------------------------------------------------------------------------
#ifndef MPFE_CONTACT_CONTACT_NEAR_H
#define MPFE_CONTACT_CONTACT_NEAR_H

#include "base/box_tree.h"
#include "model/state.h"

// Search range of the lists of near faces: fraction of the size of each of the two faces, their largest
// motion in an increment, and their motion since the lists were built
struct NearReach { double fraction, motion, margin; };

// side of a contact pair; NEAR_BOTH: a face of general contact
enum NearSide { NEAR_BOTH, NEAR_SLAVE, NEAR_MASTER };

// A face that contact may meet, or that searches for such faces, in its present position
struct NearFace {
  // its element, or parent element of its point, in the mesh of the deck; -1: of a point from the start
  int elem;
  double size;                 // longest edge                                                       length
  BoundingBox box;              // enlarged by half of the search range
  int def = -1;                // contact pair, index into Model::bond; -1: general contact
  int side = NEAR_BOTH;
  int point = -1;              // its point, if from the start: number among the points of all ranks
  bool converted = false;      // of a point that was its element
};

// Elements and points of other ranks that ranks must store, each once, ascending
struct NearLists {
  std::vector<IntVec> elem;                          // [ranks] in the mesh of the deck
  std::vector<std::vector<OriginalPoint>> point;         // [ranks] points from the start
};

// State of the last test whether a rank stores all master faces that its contact points may meet
struct MasterWatch {
  IntVec node;                 // nodes and corners (nnode + c) of faces and points of this rank
  RealVec u;                   // [node*dim] their displacements then
  size_t corners = 0;          // number of corners then
  std::vector<char> own;       // [nbond] at nodes or corners of this rank
  double margin = 0.0;         // the result holds for motions below a quarter of it     length
};

// near_faces : the faces of skin, in that order
std::vector<NearFace> near_faces(const Model& m, const Points& pts, const std::vector<SkinFace>& skin,
                                 const RealVec& u, const RealVec& uc, const NearReach& reach);

// near_reach : search range of lists built now; size: of the faces
NearReach near_reach(bool is_static, double travel, const RealVec& size);

// near_now : near_faces for lists built now
std::vector<NearFace> near_now(const Model& m, const Points& pts, const std::vector<SkinFace>& skin,
                               const RealVec& u, const RealVec& uc, bool is_static, double travel);

// near_own : the owned faces of near_faces
std::vector<NearFace> near_own(const Model& m, const Points& pts, const std::vector<SkinFace>& skin,
                               const std::vector<NearFace>& face);

// near_known : does this rank store all elements and points of other ranks whose faces look may meet?
// Collective.
//   in   own   faces of elements and points of this rank
//        look  faces that search for others: in general contact the same
bool near_known(const MeshPart& part, const Points& pts, const std::vector<NearFace>& own,
                const std::vector<NearFace>& look);

// near_outer : elements and points of other ranks near those of each rank, in a wider range than near_known,
// so that bodies have to move before near_known fails
//   in     face    of all ranks
//          rank    [face] of its element or point
//          slaves  [ranks] elements of other ranks whose slave faces a rank searches for too; or empty
//   inout  out     added to
void near_outer(const std::vector<NearFace>& face, const IntVec& rank, const std::vector<IntVec>& slaves,
                NearLists& out);

#endif
