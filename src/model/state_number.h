// ---------------------------------------------------------------------------
// state_number.h : indices of the state in the piece of a rank, or numbers in the mesh of the deck
// (doc/theory.md 5.1)
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_STATE_NUMBER_H
#define MPFE_MODEL_STATE_NUMBER_H

#include "model/state.h"

// deck_order : nodes of the piece as they follow one another in the mesh of the deck        [nnode]
IntVec deck_order(const MeshPart& part);

// state_to_deck : nodes and elements that points, bonds and lists of fracture name become numbers in the mesh
// of the deck; nothing happens where the model is whole
void state_to_deck(const MeshPart& part, State& st);

// state_from_deck : the way back. Elements under release that are not here leave the list; of all others,
// what is not here is -1.
void state_from_deck(const MeshPart& part, State& st);

#endif
