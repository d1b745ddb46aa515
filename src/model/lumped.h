// ---------------------------------------------------------------------------
// lumped.h : which masses are lumped (doc/theory.md 1.1, 3.4)
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_LUMPED_H
#define MPFE_MODEL_LUMPED_H

#include "model/model.h"

// model_lumps : the default: lumped masses in motion where something can break or touch, and where a step is
// explicit. In a consistent mass waves as short as an element run ahead, and break or hit what they meet
bool model_lumps(const Model& m);

// points_lumped : are the masses of points lumped that were element e? As those of the element; -1, of no
// element: they are not
bool points_lumped(const Model& m, int e);

// lump_mass : m [pairs a >= b]: the sums of the rows on the diagonal
void lump_mass(int nen, double* m);

#endif
