// ---------------------------------------------------------------------------
// state_fits.h : does a state that was read fit this model?
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_STATE_FITS_H
#define MPFE_MODEL_STATE_FITS_H

#include "model/state.h"

// state_fault : checks the length of all arrays, the range of all indices, and that numbers are finite;
// begin: the points at t = 0. Returns the name of the wrong part, null: none. All indices of the state are
// valid afterwards.
const char* state_fault(const Model& m, const Points& begin, const State& s);

#endif
