// ---------------------------------------------------------------------------
// contact_masters.h : contact pairs of a divided model: master faces near the contact points of a rank
// (doc/theory.md 5.1)
//
// Of a pair a rank knows the master faces near its contact points. When others come near, the model is
// divided again, as with general contact (contact_near.h).
// ---------------------------------------------------------------------------
#ifndef MPFE_CONTACT_CONTACT_MASTERS_H
#define MPFE_CONTACT_CONTACT_MASTERS_H

#include "contact/contact_near.h"

// surface_faces : faces of a surface as they are now: of elements, and of the points that some of these have
// become; at_start: those of t = 0
std::vector<SkinFace> surface_faces(const Model& m, const Points& pts, int surface, bool at_start);

// masters_and_slaves : faces of both sides of pairs that this rank works on; adjusted: of pairs with
// OVERLAP=ADJUST alone, at t = 0. For side A on a body: points with a corner on it, and the faces around.
// Collective with a divided model.
//   out  margin  motion for which the boxes hold; null: not asked for                  length
std::vector<NearFace> masters_and_slaves(const Model& m, const Points& pts, const RealVec& u,
                                         const RealVec& uc, bool adjusted, double* margin = nullptr);

// masters_known : are all master faces here that contact points of this rank may meet? Collective.
//   in     xb     [nbond*dim] places of side A
//   inout  watch  when it was asked last
//   out    face   where they are not: masters_and_slaves
bool masters_known(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& u, const RealVec& uc,
                   const RealVec& xb, MasterWatch& watch, std::vector<NearFace>& face);

#endif
