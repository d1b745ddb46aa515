// ---------------------------------------------------------------------------
// mass_rows.h : rows in which a system of masses is solved, and positions of its values in M. Private to the
// files of assem/
// ---------------------------------------------------------------------------
#ifndef MPFE_ASSEM_MASS_ROWS_H
#define MPFE_ASSEM_MASS_ROWS_H

#include <array>
#include <memory>

#include "assem/assem.h"
#include "dof/dof.h"

// couplings of each row with earlier ones, and positions of their values
struct MassCouplings {
  IntVec off{0}, col, from;
  int size() const { return static_cast<int>(off.size()) - 1; }
};

// couplings of rows with rows that do not change
struct MassRim {
  int row, beyond, from;       // here, of the system, block of M
};

// largest number of rows of an island: corners of a point  (no test)
const int MAX_ISLAND = 8;

struct MassRows {
  MassRowsOf of = ROWS_ALL;
  IntVec row;                  // [n] of the system, ascending; several ranks: the border after the others
  MassCouplings all;           // rows count here; from: blocks of M
  std::vector<MassRim> rim;
  // one rank: at most MAX_ISLAND rows that couple with each other only, as the corners of a released point or
  // a lumped node: solved by elimination, and not among the rows above
  ListTable island;            // rows of the system
  IntVec island_from;          // [pairs of rows of each island] blocks of M, -1: none
  // several ranks: the couplings of this one, sorted. The border is the rows shared with other ranks
  Halo halo;                   // of these rows
  // rows of this rank alone (one rank: all rows); they use the couplings in all
  int alone = 0;
  ListTable cross;             // [Halo::shared] rows of this rank alone that are coupled to a border row
  IntVec cross_from;           // all
  // couplings of border rows with earlier ones of the same ranks; all of these ranks have the summed value
  MassCouplings border;        // [Halo::shared] rows of the border count; from: not used
  std::vector<IntVec> border_to;       // [ranks] all: the values sent to a rank
  std::vector<IntVec> border_at;       // [ranks] border: where the values of a rank are added
  std::vector<std::array<int, 2>> edge;      // other pairs of rows of the border
  IntVec edge_from;            // all
  RealVec owned;               // [Halo::shared] 1 for rows that this rank owns
  int size() const { return static_cast<int>(row.size()); }
};

// mass_rows_of : all rows, or those of the grid. Collective.
std::shared_ptr<const MassRows> mass_rows_of(const Dofs& s, MassRowsOf of);

// mass_rows_projection : rows of the projection, for M of this pattern: the rows of the grid; if points
// follow nodes, also the nodes near points. Collective.
// (3.14)
std::shared_ptr<const MassRows> mass_rows_projection(const ActiveGrid& grid, const Dofs& s);

// mass_factor : M x = f as mass_solve, by a factorisation. Returns 1; -1: not solved. Collective.    (3.14)
int mass_factor(const Dofs& s, MassRowsOf of, const RealVec& f, RealVec& x);

#endif
