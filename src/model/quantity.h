// ---------------------------------------------------------------------------
// quantity.h : the output quantities that *HISTORY and *CHECK name, one line of one table each (quantity.cpp)
//
// deck/ reads the words from here, out/ the values. A new quantity needs a line of the table and its words in
// doc/keywords/HISTORY.md.
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_QUANTITY_H
#define MPFE_MODEL_QUANTITY_H

#include <functional>
#include <string>
#include <vector>

#include "model/state.h"

// Fields of an integration point, for output and checks. Plane problems set component 33 too.
// Order of the six: 11 22 33 12 23 31, tensor components.
struct IpFields {
  double X[3] = {0, 0, 0}, x[3] = {0, 0, 0};   // position at t = 0 and now
  double F[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};   // row by row
  double sig[6] = {0, 0, 0, 0, 0, 0};          // Cauchy stress
  double E[6]   = {0, 0, 0, 0, 0, 0};          // Green-Lagrange strain (linear strain without NLGEOM)
  double psi = 0.0;                            // strain energy / volume at t = 0
  double plastic = 0.0;                        // equivalent plastic strain
  double opening = 0.0;                        // largest opening of a cohesive crack
  double Fbar[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};        // laws with history: F of the law (1.14)
  double V0  = 0.0;                            // volume of the point at t = 0
};

double mises_stress(const double sig[6]);

enum QuantityWhere {
  OF_MOTION,                   // nodes, and any position in elements and points
  OF_NODES,                    // nodes
  OF_SUPPORTS,                 // reaction at nodes
  OF_GRID,                     // reaction at a line of *GRID BOUNDARY
  OF_CONTACT,                  // a contact pair
  OF_MODEL,                    // the whole model: no target
  OF_POINTS                    // integration points of elements, material points
};

// The model at the end of an increment. fragments: counts them (frac/) for a quantity that needs it
struct ModelNow {
  const Model& m;
  const State& s;
  bool first;                  // the first of several positions, not the last one (reduction MIN)
  std::function<double()> fragments;
};

// The value functions of its where are set; c: component
struct Quantity {
  const char* word;
  QuantityWhere where;
  int comp;                    // direction, or index among six components
  int dim;                     // 3: not in plane models
  double (*node)(const Model& m, const Level& l, int n, int c);
  double (*corner)(const Points& pts, const Level& l, int dim, int k, int c);      // null: not at points
  double (*contact)(const ContactLog& log);
  double (*model)(const ModelNow& now, int c);         // collective
  double (*point)(const IpFields& f, int c);
};

// quantity_find : null when the word is unknown
const Quantity* quantity_find(const std::string& word);

// quantity_words : words of these kinds in a model of this dimension: "U1|U2|V1 ..."
std::string quantity_words(int dim, const std::vector<QuantityWhere>& where);

#endif
