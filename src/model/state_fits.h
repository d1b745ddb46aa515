// ---------------------------------------------------------------------------
// state_fits.h : can a state that was read belong to this model?
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_STATE_FITS_H
#define MPFE_MODEL_STATE_FITS_H

#include "model/state.h"

// state_fault : looks at the length of all arrays, at the range of all indices, and whether numbers are
// finite; begin: the points of t = 0. Returns the part that cannot be right, null: none. What follows may
// trust all indices of the state.
const char* state_fault(const Model& m, const Points& begin, const State& s);

#endif
