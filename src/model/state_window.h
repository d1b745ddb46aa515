// ---------------------------------------------------------------------------
// state_window.h : divided model: material points and bonds for a restart file, which has those of all ranks
// in the order of one rank
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_STATE_WINDOW_H
#define MPFE_MODEL_STATE_WINDOW_H

#include "base/archive.h"
#include "model/state.h"

struct WindowState {           // of a state
  bool in_parts = false;       // state_in_parts; else bonds alone, with slip, lambda, lambda_n and laid
  Points points;
  Bonds bonds;
  RealVec uc, vc, hp, slip, lambda, lambda_n;        // of the level n
  GridLaid laid;
  IntVec rank;                 // Division::point
  IntVec converted, released, released_at;
  ListTable left;
};

// state_in_parts : do ranks know points that others do not, of elements that have become points?
inline bool state_in_parts(const Model& m, const State& s)
{
  return m.part.window && s.frac.nconverted > 0;
}

// state_swap : these parts of a state for others
void state_swap(WindowState& kept, State& s);

// state_bring : from a state in numbers of the deck (state_to_deck). Collective.
//   out  kept   what this rank has
//        s      bonds: on rank 0 those of all ranks. With state_in_parts points and corners that this rank
//               brings, each by one rank, ascending by their numbers of all ranks (PointPart::point, corner),
//               which the lists of them have; npoint and ncorner of all ranks; the first point of each
//               element that it works on
void state_bring(const Model& m, WindowState& kept, State& s);

// state_takes : f is read in parts, points and corners by ArchivePart::takes
inline bool state_takes(const Archive& f) { return f.reading && f.part && f.part[PER_POINT].takes; }

// state_read_outline : of all points those that this rank takes, and their corners, in numbers of all ranks;
// what follows in f is read for them
void state_read_outline(Archive& f, Points& x);

// state_find_corners : the corners that this rank takes: of its points, also before they were released, and
// those that were there at the start. Corners in the lists of points and of left become places among them
// (PointPart::corner), released points places in PointPart::point; those that are not here leave the lists
void state_find_corners(Archive& f, State& s);

#endif
