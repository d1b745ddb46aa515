// ---------------------------------------------------------------------------
// frac_gates.h : which elements are compared with the toughness. Private to frac_test.cpp
// ---------------------------------------------------------------------------
#ifndef MPFE_FRAC_GATES_H
#define MPFE_FRAC_GATES_H

#include "frac/frac_scan.h"

// threshold : of one element: Gc h t                                                   (7.1)
double threshold(const Scan& s, int e);

// near_crack : has the ball of e cracked elements?
bool near_crack(const Scan& s, int e);

// start_allowed : a crack may start without a broken neighbour: at removed elements always, elsewhere with
// START
bool start_allowed(const Scan& s, int e);

// may_start : may a crack start at e: no crack reaches it, and its relative drive exceeds that of its
// neighbours and of the competitors in its ball, but for flanks of the notch at whose end it lies
//   in   margin   factor of the drive of e
bool may_start(Scan& s, int e, double margin);

// behind_tip : is the drive small compared with the strongest competitor: FORCE: in its ball, BALL in
// dynamics: within SPACING? G of the ball, and |J|, are similar for all elements near a tip, also behind it;
// on an aligned mesh the neighbours of the tip element have a third of its energy, those behind it a tenth.
// FORCE compares the energies as well: a weak element ahead makes no tip behind it
// (test: fracture/weak_ahead.inp)
bool behind_tip(Scan& s, int e);

// spacing_of : SPACING of e                                                                        length
double spacing_of(const Scan& s, int e);

// force_rank : the order: J along the direction from the broken elements of the ball, so that the path does
// not follow mesh lines; a kink by its own direction, not that of the crack before it; in 3D without the
// component along the front: elements of a plane front have equal rank (7.8)
double force_rank(const Scan& s, int e, const double* J, double G);

// may_fall_back : has any definition a fallback?
bool may_fall_back(const Scan& s);

// fallback_of : part of Gc h at which e breaks where no candidate does: given, or of a ligament
double fallback_of(const Scan& s, int e);

#endif
