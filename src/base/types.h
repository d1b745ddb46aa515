// ---------------------------------------------------------------------------
// types.h : types used in all folders
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_TYPES_H
#define MPFE_BASE_TYPES_H

#include <string>
#include <vector>

using RealVec = std::vector<double>;
using IntVec  = std::vector<int>;

// Status of a routine of the physics. step/ decides what follows.
enum Status {
  STATUS_OK = 0,
  BAD_JACOBIAN,        // det F <= 0 in an element or a material point
  BAD_NUMBER,          // NaN or Inf in a residual
  BAD_VALUE,           // a load, support or start value of the deck is NaN or Inf
  SOLVER_SINGULAR,     // zero pivot in the factorisation
  SOLVER_FAILED,       // the linear solver gave up (text in the log)
  NOT_CONVERGED,       // Newton did not converge
  MASS_FAILED,         // no velocities or accelerations: the system of the mass matrix could not be solved
  CONTACT_DEPTH,       // a contact point went too deep into its face
  OUTSIDE_GRID,        // a corner of a material point left the grid
  HALF_RESIDUAL,       // the half-increment residual is too large
  CRITERION_EXCEEDED,  // the load at which the first element breaks was stepped over
  FACES_UNKNOWN,       // contact reaches faces that the rank does not store: the model must be divided again
  DIVISION_FAILED,     // bodies of different ranks have come close, but the model could not be divided again
  INTERRUPTED          // a signal asked the run to end
};

// Exit codes of the program
enum {
  EXIT_GOOD = 0,
  EXIT_CHECK_FAILED = 1,
  EXIT_DECK = 2,
  EXIT_PHYSICS = 3,
  EXIT_BUG = 4,
  EXIT_RESOURCE = 5,
  EXIT_CONTINUE = 6            // a signal ended the run, and a restart file continues it
};

// CSR list of lists: the items of list i are item[off[i]] ... item[off[i+1]-1]
struct ListTable {
  IntVec off{0};
  IntVec item;
  int size() const { return static_cast<int>(off.size()) - 1; }
  int count(int i) const { return off[i + 1] - off[i]; }
  const int* begin(int i) const { return item.data() + off[i]; }
};

#endif
