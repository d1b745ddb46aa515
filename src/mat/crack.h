// ---------------------------------------------------------------------------
// crack.h : traction over opening of cracks with cohesion (doc/theory.md (2.33)). Private to the files of mat/
// ---------------------------------------------------------------------------
#ifndef MPFE_MAT_CRACK_H
#define MPFE_MAT_CRACK_H

#include "mat/law.h"

// history of a crack: normal at the end of the last increment; width across, 0: not cracked; largest opening
enum { CRACK_NORMAL = 0, CRACK_WIDTH = 3, CRACK_OPENING = 4 };

// of the largest opening: what Newton's method leaves. Test: C2 (strength/snap.inp)
const double AT_LARGEST = 1e-6;
// of the opening at which nothing is left: from there on the width stays. Test: C1 (strength/band.inp): 0.97
// of Gc at 0 degrees (0.92 with 0), C3: squares and triangles dissipate 1317 and 1351 Nmm (1206 and 1310)
const double SETTLES = 0.2;

// f(k), its slope, and the integral of f up to k
struct Cohesion { double f, slope, work; };
Cohesion cohesion(const CrackLaw& c, double k);

// dissipated_to : what opening up to k has dissipated, over the area of the crack            force/length
double dissipated_to(const CrackLaw& c, double k);

#endif
