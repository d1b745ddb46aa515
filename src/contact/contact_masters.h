// ---------------------------------------------------------------------------
// contact_masters.h : contact pairs of a divided model: master faces near the contact points of a rank
// (doc/theory.md 5.1)
//
// A rank stores those master faces of a pair that are near its contact points. When others come within search
// range, the model is divided again, as with general contact (contact_near.h).
// ---------------------------------------------------------------------------
#ifndef MPFE_CONTACT_CONTACT_MASTERS_H
#define MPFE_CONTACT_CONTACT_MASTERS_H

#include "contact/contact_near.h"

// surface_faces : present faces of a surface: of elements, and of points of converted elements; at_start:
// the faces of t = 0
std::vector<SkinFace> surface_faces(const Model& m, const Points& pts, int surface, bool at_start);

// masters_and_slaves : owned faces of both sides of pairs; adjusted: of pairs with OVERLAP=ADJUST only, at
// t = 0. For side A on a body: points with a corner on it, with the box of the faces around.
// Collective with a divided model.
//   out  margin  motion for which the boxes remain valid; null: not needed             length
std::vector<NearFace> masters_and_slaves(const Model& m, const Points& pts, const RealVec& u,
                                         const RealVec& uc, bool adjusted, double* margin = nullptr);

// masters_known : does this rank store all master faces that its contact points may meet? Collective.
//   in     xb     [nbond*dim] positions of side A
//   inout  watch  state of the last test
//   out    face   if not: masters_and_slaves
bool masters_known(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& u, const RealVec& uc,
                   const RealVec& xb, MasterWatch& watch, std::vector<NearFace>& face);

#endif
