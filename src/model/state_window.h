// ---------------------------------------------------------------------------
// state_window.h : divided model: material points and bonds for a restart file, which has those of all ranks
// in the order of one rank
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_STATE_WINDOW_H
#define MPFE_MODEL_STATE_WINDOW_H

#include <limits>

#include "base/archive.h"
#include "model/state.h"

struct WindowState {           // of a state
  int nbond = 0, nfixed = 0;
  IntVec skin_of, met;
  std::vector<SkinFace> skin;
  bool in_parts = false;       // state_in_parts; else nothing follows
  Points points;
  RealVec uc, vc, hp;          // of the level n
  RealVec laid;                // GridLaid::uc
  IntVec rank;                 // Division::point
  IntVec converted, released, released_at;
  ListTable left;
};

// Bonds::skin_of, met of a state that was read: a face that is not here
const int FACE_ELSEWHERE = std::numeric_limits<int>::min();

// state_in_parts : do ranks know points that others do not, of elements that have become points?
inline bool state_in_parts(const Model& m, const State& s)
{
  return m.part.window && s.frac.nconverted > 0;
}

// state_swap : these parts of a state for others
void state_swap(WindowState& kept, State& s);

// state_bring : from a state in numbers of the deck (state_to_deck). Collective.
//   out  kept   what this rank has
//        s      what bonds say of points and of faces of general contact in numbers of all ranks; nbond and
//               nfixed of all ranks. With state_in_parts points and corners that this rank brings, each by
//               one rank, ascending by their numbers of all ranks (PointPart::point, corner), which the lists
//               of them have; npoint and ncorner of all ranks; the first point of each element that it works
//               on
//        part   [ARCHIVE_KINDS] of bonds and faces: numbers of all that are here, and what this rank brings
void state_bring(const Model& m, WindowState& kept, State& s, std::vector<ArchivePart>& part);

// state_takes : f is read in parts, points and corners by ArchivePart::takes
inline bool state_takes(const Archive& f) { return f.reading && f.part && f.part[PER_POINT].takes; }

// state_read_outline : of all points those that this rank takes, and their corners, in numbers of all ranks;
// what follows in f is read for them
void state_read_outline(Archive& f, Points& x);

// state_find_corners : the corners that this rank takes: of its points, also before they were released, and
// those that were there at the start. Corners in the lists of points and of left become places among them
// (PointPart::corner), released points places in PointPart::point; those that are not here leave the lists
void state_find_corners(Archive& f, State& s);

// state_read_bonds : of all bonds those that tie only what is here, and the faces of general contact that are
// here, in numbers of all ranks; what follows in f is read for them. Bonds get their numbers as names, bonds
// of the deck those before 0
void state_read_bonds(Archive& f, const Points& p, Bonds& x);

// state_find_faces : numbers of faces in skin_of and met become places in skin, or FACE_ELSEWHERE
void state_find_faces(const Archive& f, Bonds& x);

#endif
