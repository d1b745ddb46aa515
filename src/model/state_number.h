// ---------------------------------------------------------------------------
// state_number.h : converts indices of the state between the piece of a rank and the mesh of the deck
// (doc/theory.md 5.1)
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_STATE_NUMBER_H
#define MPFE_MODEL_STATE_NUMBER_H

#include "model/state.h"

// deck_order : nodes of the piece in the order of the deck                            [nnode]
IntVec deck_order(const MeshPart& part);

// state_to_deck : replaces node and element indices in points, bonds and fracture lists by deck numbers; no
// change in an undivided model
void state_to_deck(const MeshPart& part, State& st);

// state_from_deck : the inverse. Elements under release that are not on this rank are removed from the list;
// of all others the index is -1.
void state_from_deck(const MeshPart& part, State& st);

#endif
