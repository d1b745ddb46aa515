// ---------------------------------------------------------------------------
// deck_check.h : parts of deck_check. Private to deck_check*.cpp and deck_split.cpp
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_CHECK_H
#define MPFE_DECK_CHECK_H

#include "deck/deck_state.h"

inline const double* deck_node_X(const Model& m, int n) { return &m.mesh.X[3 * static_cast<std::size_t>(n)]; }

// ---- deck_check_mesh.cpp
void deck_check_element(Deck& d, const Model& m, int e);   // its form
void deck_check_elements(Deck& d, const Model& m);         // form of the first wrong ones
void deck_check_sets(Deck& d, const Model& m);             // none is empty
void deck_check_lumped(Deck& d, const Model& m);           // no quadratic elements with lumped mass
// body of each element that becomes points, -1: remains an element
IntVec deck_body_of_elements(Deck& d, const Model& m);
void deck_check_sections(Deck& d, const Model& m, const IntVec& body);

// ---- deck_check_steps.cpp
IntVec deck_removed_elements(const Model& m);              // [nelem] 1: *MODEL CHANGE, REMOVE
//   in   read_well   nodes that lines with errors would give an element are no further errors
void deck_check_steps(Deck& d, const Model& m, const IntVec& body, bool read_well);

#endif
