// ---------------------------------------------------------------------------
// contact_near.h : general contact of a divided model: elements of other ranks that are near
// (doc/theory.md 5.1)
//
// MeshPart::window: a rank works on places of faces of its own elements. Elements of others whose faces may
// be met are outer elements; when others come near, the model is divided again.
// ---------------------------------------------------------------------------
#ifndef MPFE_CONTACT_CONTACT_NEAR_H
#define MPFE_CONTACT_CONTACT_NEAR_H

#include "contact/contact_tree.h"
#include "model/state.h"

// How far lists of near faces look: part of the size of each of two faces, what both may move in an
// increment, and what they may have moved since the lists were made
struct NearReach { double part, most, margin; };

// A face of general contact where it is now
struct NearFace {
  // that has it, or had it before it became points: in the mesh of the deck; -1: of a point from the start
  int elem;
  double size;                 // longest edge                                                       length
  ContactBox box;              // half of what may lie between it and a face that it may meet is added
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

// near_known : are all elements of other ranks here that may meet a face of own? Collective.
bool near_known(const MeshPart& part, const std::vector<NearFace>& own);

// near_outer : elements near those of each rank that belong to others, from further off, so that bodies have
// to move before others come near; what is near a point from the start all ranks get
//   in     face   of all ranks;   rank [nelem]
//   inout  list   [ranks] added to
void near_outer(const std::vector<NearFace>& face, const IntVec& rank, std::vector<IntVec>& list);

#endif
