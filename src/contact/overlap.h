// ---------------------------------------------------------------------------
// overlap.h : bodies that overlap, touch, or pass through each other without bond or contact (doc/theory.md
// 4.3)
//
// A part is a body of material points, or all finite elements of a section. Parts without common unknowns,
// bond or contact pair do not interact.
// ---------------------------------------------------------------------------
#ifndef MPFE_CONTACT_OVERLAP_H
#define MPFE_CONTACT_OVERLAP_H

#include "elem/elem.h"
#include "model/state.h"

struct OverlapWatch {
  std::vector<UncoupledPair> pair;
  int rest = 0;                // increments until the next check
};

// overlap_pairs : finds the pairs of parts that do not interact; once, at the start,
// of a divided model before it is cut
void overlap_pairs(const Model& m, OverlapWatch& w);

// overlap_start : warns of such pairs that overlap or touch at the start. Collective, as overlap_look.
//   in   el, u, uc at t = 0
void overlap_start(const Model& m, const Elements& el, const Points& pts, const RealVec& u, const RealVec& uc,
                   OverlapWatch& w);

// overlap_look : warns of such pairs that have begun to overlap, once per pair
void overlap_look(const Model& m, const Elements& el, const State& st, OverlapWatch& w);

#endif
