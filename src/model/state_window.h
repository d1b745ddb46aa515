// ---------------------------------------------------------------------------
// state_window.h : divided model: material points and bonds in a restart file, which has those of all ranks
// in the order of a single rank
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_STATE_WINDOW_H
#define MPFE_MODEL_STATE_WINDOW_H

#include <limits>

#include "base/archive.h"
#include "model/state.h"

struct WindowState {           // parts of a state replaced during writing
  int nbond = 0, nfixed = 0;
  IntVec skin_of, met;
  std::vector<SkinFace> skin;
  bool in_parts = false;       // state_in_parts; else the rest is not used
  Points points;
  RealVec uc, vc, hp;          // of the level n
  RealVec laid;                // GridLaid::uc
  IntVec rank;                 // Division::point
  IntVec converted, released, released_at;
  ListTable left;
};

// Bonds::skin_of, met of a state that was read: the face is not on this rank
const int FACE_ELSEWHERE = std::numeric_limits<int>::min();

// state_in_parts : do ranks store different converted points?
inline bool state_in_parts(const Model& m, const State& s)
{
  return m.part.window && s.frac.nconverted > 0;
}

// state_swap : exchanges these parts of a state
void state_swap(WindowState& kept, State& s);

// state_for_file : the part of the state that this rank writes, from a state in deck numbers (state_to_deck).
// Collective.
//   out  kept   the replaced parts
//        s      bonds with global numbers of points and faces of general contact; nbond and nfixed of all
//               ranks. With state_in_parts: points and corners that this rank writes, each from one rank,
//               ascending by their global numbers (PointPart::point, corner), which their lists contain;
//               npoint and ncorner of all ranks; the first point of each owned element
//        part   [ARCHIVE_KINDS] of bonds and faces: global numbers on this rank, and those that it writes
void state_for_file(const Model& m, WindowState& kept, State& s, std::vector<ArchivePart>& part);

// state_takes : is f read in parts, points and corners by ArchivePart::takes?
inline bool state_takes(const Archive& f) { return f.reading && f.part && f.part[PER_POINT].takes; }

// state_read_outline : reads the points that this rank takes and their corners, in global numbers; the rest
// of f is read for these
void state_read_outline(Archive& f, Points& x);

// state_find_corners : the corners that this rank takes: of its points, also before their release, and those
// of the start. Corners in the lists of points and of left become indices into PointPart::corner, released
// points indices into PointPart::point; those not on this rank are removed from the lists
void state_find_corners(Archive& f, State& s);

// state_read_bonds : reads the bonds with all items on this rank, and its faces of general contact, in global
// numbers; the rest of f is read for these. Names of bonds are their numbers, negative for those of the deck
void state_read_bonds(Archive& f, const Points& p, Bonds& x);

// state_find_faces : replaces face numbers in skin_of and met by indices into skin, or FACE_ELSEWHERE
void state_find_faces(const Archive& f, Bonds& x);

#endif
