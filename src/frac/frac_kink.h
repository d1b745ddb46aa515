// ---------------------------------------------------------------------------
// frac_kink.h : where a crack in mixed mode goes in the plane (doc/theory.md 7.35)
// ---------------------------------------------------------------------------
#ifndef MPFE_FRAC_FRAC_KINK_H
#define MPFE_FRAC_FRAC_KINK_H

// The kink with the largest energy release
struct Kink {
  double angle = 0.0;          // from the direction of the crack, counterclockwise
  double gain  = 1.0;          // its energy release over that of growth straight on
};

// kink_of : of a crack whose K_II/K_I is ratio. K_II > 0: shear stress ahead of the tip is positive, with the
// crack along x
Kink kink_of(double ratio);

// kink_share : energy release of a crack of mode I that kinks by angle, over that of growth straight on.
// Beyond 90 degrees the expansions end: that of 90
double kink_share(double angle);

#endif
