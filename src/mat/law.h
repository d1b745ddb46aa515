// ---------------------------------------------------------------------------
// law.h : what an integration point asks of its material (doc/theory.md 2.4)
//
// A law gives energy, stress and tangent at a strain, and the history that it leaves there. law_step makes of
// it the stress of a step of any time scheme; the energy-momentum scheme gets a discrete gradient, so that
//
//   stored + dissipated = work of the stress, to rounding, whatever the law                    (2.21)
//
// Intact St.Venant-Kirchhoff material has a short form of all this in elem/kernel.h, eight points at a time.
// Strains are Green-Lagrange (linear without NLGEOM). Six components 11 22 33 12 23 31, those of a tensor;
// the tangent has engineering shear columns.
// ---------------------------------------------------------------------------
#ifndef MPFE_MAT_LAW_H
#define MPFE_MAT_LAW_H

#include <vector>

#include "mat/mat.h"

// History of an integration point: first what it has dissipated so far / volume at t = 0 (force/length^2),
// which law_update keeps, then the numbers that its law keeps. At t = 0 all are zero
enum { HISTORY_DISSIPATED = 0, HISTORY_OF_LAW = 1 };
const int MAX_HISTORY = 16;    // numbers of an integration point, at most

// What the program does with some numbers of a law besides saving them
enum HistoryUse {
  HISTORY_KEPT,                // nothing
  HISTORY_DEFORMATION,         // [6] Cp^-1 - I, without NLGEOM -2 ep: zero when a domain gets a new shape;
                               // the elastic deformation is kept when gradients change (7.14)
  HISTORY_EQUIVALENT,          // output as PEEQ
  HISTORY_CRACK,               // [3] normal of a crack, whose width and opening follow
  HISTORY_FLOW_WORK            // the part of HISTORY_DISSIPATED that is flow, where a crack takes the rest
};

struct HistoryField {
  const char* name;
  int size;
  HistoryUse use;
};

// history_at : that of the k-th integration point in h, size numbers each; null when laws keep none
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
};

struct Law {
  const char* name;            // as the listing calls it
  std::vector<HistoryField> history;           // what an integration point keeps, one after the other
  bool linear;                 // the tangent never changes without NLGEOM
  // ---------------------------------------------------------------------------
  // update : the law in three dimensions at one strain
  //
  //   in   finite   NLGEOM
  //        E        strain                                    [6]
  //        h_n      history at t(n)                           [sum of the sizes of history]
  //   out  h_np1    history at this strain                    [the same]
  //        out      psi, S; dissipated when it is not 0; D when tangent is set
  //   returns       false: 2E + I is not positive definite, or no stress was found
  // ---------------------------------------------------------------------------
  bool (*update)(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
                 bool tangent, LawOutput& out);
  // step : a law_step of its own; null: law_step_any
  bool (*step)(const MatLaw& law, const KernelMode& mode, const double* E0, const double* E1,
               const double* h_n, double* h_np1, double* S, double* C);
  bool free_thickness = false; // plane stress: update is given E11, E22, E12 and finds E33 itself
};

// law_of : the row of the table
const Law& law_of(const MatLaw& law);

// law_field : place of the first number of that use in the history of an integration point, -1: none
int law_field(const Law& law, HistoryUse use);

// law_other : the row of LAW_OTHER, a law that no keyword chooses; tests fill it
Law& law_other();

// law_is_general : does intact material need law_step? false: the short form of elem/kernel.h serves
inline bool law_is_general(const MatLaw& law) { return law.kind != LAW_SVK || law.bar; }

// law_history : numbers of an integration point of this model: the most of all its materials; 0: no law keeps
// any
int law_history(const Model& m);

// law_update : the law at one strain; in plane stress E33 is found so that S33 = 0, and D is condensed
// (2.13). Arguments as Law::update, but h_n and h_np1 are the history of an integration point, null when no
// law keeps any; E is changed in plane stress
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

// law_step_any : the same from energy, stress and what is dissipated alone: in the energy-momentum scheme the
// discrete gradient of psi + dissipated (2.14)
bool law_step_any(const MatLaw& law, const KernelMode& mode, const double* E0, const double* E1,
                  const double* h_n, double* h_np1, double* S, double* C);

// law_viscous_work : dE : D : dE with the elastic D of small strains: beta/dt times it is what viscous stress
// dissipates in a step (2.20);  dE [6]
double law_viscous_work(const MatLaw& law, const double* dE);

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

// crack_width : of the element of this crack along N [3]                                          length
double crack_width(const CrackLaw& c, const double* N);

// crack_open : opening at which the traction is gone (exponential: below 0.1 % of the strength)     length
double crack_open(const CrackLaw& c);

// crack_share : stress along the axis that opens over what the crack carries at its largest opening so far;
// 0: nothing is left
//   in   S   stress [6], of the history h;   out  N  the axis [3]
double crack_share(const MatLaw& law, const double* S, const double* h, double* N);

// crack_opening, crack_normal [3] : of the history of an integration point of this law, which opens against a
// cohesion; normal 0: not cracked
double crack_opening(const MatLaw& law, const double* h);
const double* crack_normal(const MatLaw& law, const double* h);

// yield_stress : (2.26), at the equivalent plastic strain a; slope: its derivative. yield_work : its integral
double yield_stress(const Material& m, double a, double* slope);
double yield_work(const Material& m, double a);

#endif
