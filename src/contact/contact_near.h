// ---------------------------------------------------------------------------
// contact_near.h : contact of a divided model: elements of other ranks that are near     (doc/theory.md 5.1)
//
// MeshPart::window: a rank works on places of general contact of faces of its own elements. Elements of
// others whose faces may be met are outer elements; when others come near, the model is divided again.
// Contact pairs: contact_masters.h.
// ---------------------------------------------------------------------------
#ifndef MPFE_CONTACT_CONTACT_NEAR_H
#define MPFE_CONTACT_CONTACT_NEAR_H

#include "contact/contact_tree.h"
#include "model/state.h"

// How far lists of near faces look: part of the size of each of two faces, what both may move in an
// increment, and what they may have moved since the lists were made
struct NearReach { double part, most, margin; };

// side of a contact pair; NEAR_BOTH: a face of general contact
enum NearSide { NEAR_BOTH, NEAR_SLAVE, NEAR_MASTER };

// A face that contact may meet, or one that looks for such faces, where it is now
struct NearFace {
  // that has it, or had it before it became points: in the mesh of the deck; -1: of a point from the start
  int elem;
  double size;                 // longest edge                                                       length
  ContactBox box;              // half of what may lie between it and a face that it may meet is added
  int def = -1;                // contact pair, index into Model::bond; -1: general contact
  int side = NEAR_BOTH;
  int point = -1;              // from the start, that has it: number among those of all ranks
};

// What ranks must know of others, each once, ascending
struct NearLists {
  std::vector<IntVec> elem;                          // [ranks] in the mesh of the deck
  std::vector<std::vector<PointHome>> point;         // [ranks] points from the start
};

// When it was asked last whether all master faces are known that contact points may meet
struct MasterWatch {
  IntVec kin;                  // nodes and corners (nnode + c) of faces and points of this rank
  RealVec u;                   // [kin*dim] their displacements then
  size_t corners = 0;          // corners that were here
  std::vector<char> own;       // [nbond] at nodes or corners of this rank
  double margin = 0.0;         // the answer holds for motions below a quarter of it     length
};

// near_faces : those of skin, in that order
std::vector<NearFace> near_faces(const Model& m, const Points& pts, const std::vector<SkinFace>& skin,
                                 const RealVec& u, const RealVec& uc, const NearReach& reach);

// near_reach : of lists that are made now; size: of the faces
NearReach near_reach(bool is_static, double travel, const RealVec& size);

// near_now : near_faces for lists that are made now
std::vector<NearFace> near_now(const Model& m, const Points& pts, const std::vector<SkinFace>& skin,
                               const RealVec& u, const RealVec& uc, bool is_static, double travel);

// near_own : those of near_faces that this rank works on
std::vector<NearFace> near_own(const Model& m, const Points& pts, const std::vector<SkinFace>& skin,
                               const std::vector<NearFace>& face);

// near_known : are all elements and points of other ranks here with faces that those of look may meet?
// Collective.
//   in   own   faces of elements and points of this rank
//        look  those that look for faces: in general contact the same
bool near_known(const MeshPart& part, const Points& pts, const std::vector<NearFace>& own,
                const std::vector<NearFace>& look);

// near_outer : elements and points near those of each rank that belong to others, from further off, so that
// bodies have to move before others come near
//   in     face    of all ranks
//          rank    [face] of its element or point
//          slaves  [ranks] elements of others whose faces, slaves of pairs, look for a rank too; or empty
//   inout  out     added to
void near_outer(const std::vector<NearFace>& face, const IntVec& rank, const std::vector<IntVec>& slaves,
                NearLists& out);

#endif
