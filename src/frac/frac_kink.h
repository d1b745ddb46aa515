// ---------------------------------------------------------------------------
// frac_kink.h : direction of a crack in mixed mode (doc/theory.md 7.35)
// ---------------------------------------------------------------------------
#ifndef MPFE_FRAC_FRAC_KINK_H
#define MPFE_FRAC_FRAC_KINK_H

// The kink with the largest energy release
struct Kink {
  double angle = 0.0;          // from the direction of the crack, counterclockwise
  double gain  = 1.0;          // its energy release over that of straight growth
};

// kink_of : kink of a crack with ratio = K_II/K_I and out = K_III/K_I/sqrt(1 - nu). K_II > 0: positive shear
// stress ahead of the tip, with the crack along x
Kink kink_of(double ratio, double out = 0.0);

// kink_share : energy release of a mode I crack that kinks by angle, over that of straight growth. Angles
// above 90 degrees, outside of the expansions: the value at 90
double kink_share(double angle);

#endif
