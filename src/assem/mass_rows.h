// ---------------------------------------------------------------------------
// mass_rows.h : rows in which a system of masses is solved, and where its numbers stand in M. Private to the
// files of assem/
// ---------------------------------------------------------------------------
#ifndef MPFE_ASSEM_MASS_ROWS_H
#define MPFE_ASSEM_MASS_ROWS_H

#include <array>
#include <memory>

#include "assem/assem.h"
#include "dof/dof.h"

// couplings of each row with earlier ones, and where their values are
struct MassCouplings {
  IntVec off{0}, col, from;
  int size() const { return static_cast<int>(off.size()) - 1; }
};

// of rows with others that stay as they are
struct MassRim {
  int row, beyond, from;       // here, of the system, block of M
};

struct MassRows {
  MassRowsOf of = ROWS_ALL;
  IntVec row;                  // [n] of the system, ascending; several ranks: the border behind the others
  MassCouplings all;           // rows count here; from: blocks of M
  std::vector<MassRim> rim;
  // several ranks: the couplings of this one, sorted. The border is the rows that other ranks have too
  Halo halo;                   // of these rows
  // rows of this rank alone (one rank: all rows); their couplings are those of all
  int alone = 0;
  ListTable cross;             // [Halo::shared] rows of this rank alone that are coupled to one of the border
  IntVec cross_from;           // all
  // rows of the border with earlier ones that the same ranks have; all of these know the whole value
  MassCouplings border;        // [Halo::shared] rows of the border count; from: not used
  std::vector<IntVec> border_to;       // [ranks] all: the values that a rank gets of this one
  std::vector<IntVec> border_at;       // [ranks] border: where the values of a rank are added
  std::vector<std::array<int, 2>> edge;      // other pairs of rows of the border
  IntVec edge_from;            // all
  RealVec owned;               // [Halo::shared] 1 for rows that belong to this rank
  int size() const { return static_cast<int>(row.size()); }
};

// mass_rows_of : all rows, or those of the grid. Collective.
std::shared_ptr<const MassRows> mass_rows_of(const Dofs& s, MassRowsOf of);

// mass_rows_projection : those of the projection, for M of this pattern: the rows of the grid; where points
// follow nodes, these and the nodes near points. Collective.                                         (3.14)
std::shared_ptr<const MassRows> mass_rows_projection(const ActiveGrid& grid, const Dofs& s);

// mass_factor : M x = f as mass_solve, by a factorisation: 1; -1: not solved. Collective.            (3.14)
int mass_factor(const Dofs& s, MassRowsOf of, const RealVec& f, RealVec& x);

#endif
