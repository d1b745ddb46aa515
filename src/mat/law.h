// ---------------------------------------------------------------------------
// law.h : interface of the material laws at an integration point (doc/theory.md 2.4)
//
// A law gives energy, stress, tangent and updated history at a strain. law_step derives the stress of a step
// of any time scheme; for the energy-momentum scheme a discrete gradient, so that
//
//   stored + dissipated = work of the stress, to round-off, for every law                      (2.21)
//
// Intact St.Venant-Kirchhoff material has a short form in elem/kernel.h, eight points at a time. Strains are
// Green-Lagrange (linear without NLGEOM). Six tensor components 11 22 33 12 23 31; the tangent has
// engineering shear columns.
// ---------------------------------------------------------------------------
#ifndef MPFE_MAT_LAW_H
#define MPFE_MAT_LAW_H

#include <vector>

#include "mat/mat.h"

// History of an integration point: energy dissipated so far / volume at t = 0 (force/length^2), which
// law_update integrates, then the variables of the law. Zero at t = 0
enum { HISTORY_DISSIPATED = 0, HISTORY_OF_LAW = 1 };
const int MAX_HISTORY = 32;    // maximum number of history variables of an integration point

// Use of history variables outside their law
enum HistoryUse {
  HISTORY_KEPT,                // none
  HISTORY_DEFORMATION,         // [6] Cp^-1 - I, without NLGEOM -2 ep: reset with the shape of a domain; the
                               // elastic deformation is preserved if gradients change (7.14)
  HISTORY_EQUIVALENT,          // output as PEEQ
  HISTORY_CRACK,               // [3] normal of a crack, followed by its width and opening
  HISTORY_FLOW_WORK            // plastic part of HISTORY_DISSIPATED; the rest is dissipated by the crack
};

struct HistoryField {
  const char* name;
  int size;
  HistoryUse use;
};

// history_at : history of the k-th integration point in h, size variables each; null if size is 0
inline double* history_at(RealVec& h, size_t size, int k) { return size ? &h[k * size] : nullptr; }
inline const double* history_at(const RealVec& h, size_t size, int k)
{
  return size ? &h[k * size] : nullptr;
}

struct LawOutput {
  double psi;                  // stored energy / volume at t = 0                     force/length^2
  double dissipated;           // energy / volume dissipated since t(n); 0 unless set   force/length^2
  double S[6];                 // stress                                              force/length^2
  double D[36];                // dS/dE                                               force/length^2
  double E33;                  // strain across a sheet in plane stress, of a law that computes it
};

struct Law {
  const char* name;            // in the listing
  std::vector<HistoryField> history;           // in the order of storage
  bool linear;                 // without NLGEOM the tangent is constant
  // ---------------------------------------------------------------------------
  // update : the law in three dimensions at one strain
  //
  //   in   finite   NLGEOM
  //        E        strain                                    [6]
  //        h_n      history at t(n)                           [sum of the sizes of history]
  //   out  h_np1    history at this strain                    [the same]
  //        out      psi, S; dissipated if not 0; D if tangent is set
  //   returns       false: 2E + I is not positive definite, or the iteration failed
  // ---------------------------------------------------------------------------
  bool (*update)(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
                 bool tangent, LawOutput& out);
  // step : law_step of this law; null: law_step_any
  bool (*step)(const MatLaw& law, const KernelMode& mode, const double* E0, const double* E1,
               const double* h_n, double* h_np1, double* S, double* C);
  bool free_thickness = false; // plane stress: update computes E33 from E11, E22, E12 and condenses D
};

// law_of : the row of the table
const Law& law_of(const MatLaw& law);

// law_field : index of the first variable of that use in the history of an integration point, -1: none
int law_field(const Law& law, HistoryUse use);

// law_other : the row of LAW_OTHER, which no keyword selects; for tests
Law& law_other();

// law_is_general : does intact material need law_step? false: it has the short form of elem/kernel.h
inline bool law_is_general(const MatLaw& law) { return law.kind != LAW_SVK || law.bar || law.initial >= 0; }

// law_history : history variables of an integration point: maximum over the materials of the model; with
// cohesive bodies one more, the last, for their points, and with WEIBULL of such a body one before it
int law_history(const Model& m);

// law_place_initial : sets the index of the initial strain in the history, in all materials that have one
void law_place_initial(Model& m);

// law_initial : initial strain E [6] at which the stress is S [6], of material at rest without history h
// [size]; in plane stress with its E33. false: there is none without plastic flow or a crack     (2.44)
bool law_initial(const MatLaw& law, bool finite, const double* S, const double* h, double* E);

// law_total : adds the initial strain in h to E [6], or takes it away (-1)
inline void law_total(const MatLaw& law, const double* h, double sign, double* E)
{
  for (int k = 0; k < 6 && law.initial >= 0; ++k) E[k] += sign * h[law.initial + k];
}

// law_update : the law at one strain; in plane stress E33 is computed from S33 = 0, and D is condensed
// (2.13). Arguments as Law::update, but h_n and h_np1 are the whole history of an integration point, null if
// there is none; in plane stress E33 is changed
bool law_update(const MatLaw& law, bool finite, double* E, const double* h_n, double* h_np1, bool tangent,
                LawOutput& out);

// ---------------------------------------------------------------------------
// law_step : stress of material over a step, intact or broken
//
//   in   E0, E1   strains at t(n), t(n+1)                   [6]
//        h_n      history at t(n) of the integration point
//   out  h_np1    history at t(n+1)
//        S        stress of table (1.8), with viscosity     [6]
//        C        its derivative to E1, unless null         [36]
//   theory        doc/theory.md: (2.14), (2.15), (2.21)
//   returns       as Law::update
// ---------------------------------------------------------------------------
bool law_step(const MatLaw& law, const KernelMode& mode, const double* E0, const double* E1,
              const double* h_n, double* h_np1, double* S, double* C);

// law_step_any : the same from energy, stress and dissipation only: in the energy-momentum scheme the
// discrete gradient of psi + dissipated (2.14)
bool law_step_any(const MatLaw& law, const KernelMode& mode, const double* E0, const double* E1,
                  const double* h_n, double* h_np1, double* S, double* C);

// law_viscous_work : dE : D : dE with the elastic D of small strains; times beta/dt: viscous dissipation of a
// step (2.20);  dE [6]
double law_viscous_work(const MatLaw& law, const double* dE);

// law_stiffening : factor of the stiffness at large stretches                                      (6.31)
//   in   above   largest square stretch - 1;   least   the smallest
double law_stiffening(LawKind kind, double above, double least);

// the laws, one file each
bool law_svk(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1, bool tangent,
             LawOutput& out);
bool law_ortho(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
               bool tangent, LawOutput& out);
bool law_neo_hooke(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
                   bool tangent, LawOutput& out);
bool law_granular(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
                  bool tangent, LawOutput& out);
bool law_granular_step(const MatLaw& law, const KernelMode& mode, const double* E0, const double* E1,
                       const double* h_n, double* h_np1, double* S, double* C);
bool law_split(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
               bool tangent, LawOutput& out);
bool law_split_step(const MatLaw& law, const KernelMode& mode, const double* E0, const double* E1,
                    const double* h_n, double* h_np1, double* S, double* C);
bool law_j2(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1, bool tangent,
            LawOutput& out);

bool law_drucker_prager(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
                        bool tangent, LawOutput& out);
bool law_cohesive(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
                  bool tangent, LawOutput& out);
bool law_cohesive_flow(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
                       bool tangent, LawOutput& out);

// crack_of : the cohesive law of a fracture definition
CrackLaw crack_of(const FractureDef& d);

// crack_strength : stress at which this crack begins to open                      force/length^2
inline double crack_strength(const CrackLaw& c) { return c.strength * c.scatter; }

// crack_width : extent of the element, or of the box of the point, of this crack along N [3]      length
double crack_width(const CrackLaw& c, const double* N);

// crack_next_width : of the next increment: along the mean normal of the element, until the crack has opened
// by SETTLED of its final opening; of a point: CrackLaw::band, while the crack grows
//   in   width            of this increment                                                       length
//        before, opening  at both ends of it                                                      length
double crack_next_width(const CrackLaw& c, double width, double before, double opening);

// crack_traction : of a crack that grows, at the opening k                                  force/length^2
double crack_traction(const CrackLaw& c, double k);

// crack_max_width : width beyond which the law snaps back                                  (2.34) length
double crack_max_width(const MatLaw& law);

// crack_open : opening at zero traction (exponential: below 0.1 % of the strength)                  length
double crack_open(const CrackLaw& c);

// crack_share : normal stress on the crack over the cohesive traction at its largest opening so far; 0: no
// traction left. Of several cracks, and of an axis that has not opened, the largest
//   in   S   stress [6];  h  history;   out  N  normal of the crack [3];  k  its largest opening so far
double crack_share(const MatLaw& law, const double* S, const double* h, double* N, double* k);

// crack_opening, crack_band, crack_normal [3] : largest opening, width of the band and normal, of the
// history h of a cohesive law; opening 0: not cracked. Of several cracks: that which has opened widest. Where
// the crack may begin on a line alone the normal has the length p of (2.36c), and the width of a shut point
// has no meaning
double crack_opening(const MatLaw& law, const double* h);
double crack_band(const MatLaw& law, const double* h);
const double* crack_normal(const MatLaw& law, const double* h);

// crack_normal_like : normal of the crack in h that is nearest to the axis N [3], and its largest opening k
const double* crack_normal_like(const MatLaw& law, const double* h, const double* N, double* k);

// Marks of an integration point that has not begun to crack, in its history h                  (2.36c)
// crack_line : cracks along a line only; G [3]: sum of the gradients of the shape functions of the nodes on
//   the side of the unit normal N [3] of the line, not 0
// crack_shut : does not crack
// crack_free : cracks as (2.33)
// crack_begin : a crack along a line that is open in h_np1 begins in h_n, with next to no opening. False: it
// is not along a line, or has begun already
void crack_line(const MatLaw& law, const double* G, const double* N, double* h);
bool crack_begin(const MatLaw& law, const double* h_np1, double* h_n);
void crack_shut(const MatLaw& law, double* h);
void crack_free(const MatLaw& law, double* h);

// yield_stress : (2.26), at the equivalent plastic strain a; slope: its derivative. yield_work : its integral
double yield_stress(const Material& m, double a, double* slope);
double yield_work(const Material& m, double a);

#endif
