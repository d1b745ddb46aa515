// ---------------------------------------------------------------------------
// state_window.h : MeshPart::window: material points and bonds of all ranks for a restart file, which has
// them in the order of one rank
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_STATE_WINDOW_H
#define MPFE_MODEL_STATE_WINDOW_H

#include "model/state.h"

struct WindowState {           // of a state
  Points points;
  Bonds bonds;
  RealVec uc, vc, hp, slip, lambda, lambda_n;        // of the level n
  GridLaid laid;
  IntVec converted, released, released_at;
  ListTable left;
};

// state_in_parts : do ranks know points or bonds that others do not?
inline bool state_in_parts(const Model& m, const State& s)
{
  return m.part.window && (s.frac.nconverted > 0 || model_general_contact(m) >= 0);
}

// state_swap : these parts of a state for others
void state_swap(WindowState& kept, State& s);

// state_gather : from a state in numbers of the deck (state_to_deck) where elements have become points, or
// with general contact. Collective.
//   out  kept   what this rank has
//        s      rank 0: that of all ranks, as one rank has it; other ranks: nothing; on all ranks the first
//               point of each element that they work on, in numbers of all ranks
void state_gather(const Model& m, WindowState& kept, State& s);

#endif
