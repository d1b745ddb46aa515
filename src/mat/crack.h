// ---------------------------------------------------------------------------
// crack.h : traction-separation laws of cohesive cracks (doc/theory.md (2.33)). Private to mat/
// ---------------------------------------------------------------------------
#ifndef MPFE_MAT_CRACK_H
#define MPFE_MAT_CRACK_H

#include <cmath>

#include "mat/law.h"

// history of a crack: normal at the end of the last increment; band width, 0: not cracked; largest opening.
// Crack along a line (2.36c): minus the width, and the normal has the length p; shut: the normal is 0.
// One for each of three axes; one alone is the first
enum { CRACK_NORMAL = 0, CRACK_WIDTH = 3, CRACK_OPENING = 4, CRACK_SIZE = 5, CRACK_AXES = 3 };

// relative to the largest opening: tolerance of Newton's method  (test: strength/snap.inp)
const double OPENING_TOL = 1e-6;
// relative to the opening at zero traction: above, the band width is constant. C1: 0.99 of Gc at 0 degrees
// (0.92 with 0), C3: squares and triangles dissipate 1317 and 1351 Nmm (1206 and 1310)
// (test: strength/band.inp, strength/l_panel.inp)
const double SETTLED = 0.2;
// of the width of a point: larger changes are followed above SETTLED too. They are those of the cells that
// open; smaller ones those of the normal  (test: strength/band_points.inp)
const double OTHER_WIDTH = 0.1;

// smallest p of a crack along a line: its element is cut at a corner                             (2.36c)
// (no test)
const double LEAST_COSINE = 0.3;

// f(k), its slope, and the integral of f up to k
struct Cohesion { double f, slope, work; };
Cohesion cohesion(const CrackLaw& c, double k);

// dissipated_to : energy dissipated by opening up to k, per area of the crack                force/length
double dissipated_to(const CrackLaw& c, double k);

#endif
