// ---------------------------------------------------------------------------
// lumped.h : which masses are lumped (doc/theory.md 1.1, 3.4)
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_LUMPED_H
#define MPFE_MODEL_LUMPED_H

#include "model/model.h"

// model_lumps : default: lumped masses in dynamics with fracture or contact, and with an explicit step. With
// a consistent mass waves of the element size run ahead and break or hit material
bool model_lumps(const Model& m);

// points_lumped : do points of the converted element e have lumped masses? -1, no element: no
bool points_lumped(const Model& m, int e);

// lump_mass : m [pairs a >= b]: puts the row sums on the diagonal
void lump_mass(int nen, double* m);

#endif
