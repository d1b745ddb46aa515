// ---------------------------------------------------------------------------
// domain_kinds.h : shared data of congruent domains of points (doc/theory.md 3.1)
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_DOMAIN_KINDS_H
#define MPFE_MODEL_DOMAIN_KINDS_H

#include <cstddef>

#include "base/types.h"

// Weights w_c, sum 1, gradients G_c, sum 0, and consistent mass of a domain at its corners, pairs a >= b.
// Domains with equal numbers share them: those of a box, or of equal converted elements. A released point,
// which changes its shape, has its own.
struct DomainKinds {
  int dim = 0;                 // 0: there are none yet
  RealVec number;              // kind after kind: w [n], G [n*dim], mc [n*(n+1)/2]
  std::vector<std::size_t> first;    // [kind] index into number
  IntVec users;                // [kind] number of points
  std::vector<char> alone;     // [kind] 1: of one point, which may change it
  IntVec table;                // hash table of the shared kinds, -1: free; a power of two
  IntVec unused;               // kinds without points
  const double* at(int kind) const { return &number[first[kind]]; }
};

// domain_numbers : count of the numbers of a domain with n corners
constexpr int domain_numbers(int n, int dim) { return n * (1 + dim) + n * (n + 1) / 2; }

// domain_kind : the kind with exactly these numbers, for one more point; a new one if there is none
int domain_kind(int n, int dim, const double* number, DomainKinds& k);

// domain_change : the same for a point that had this kind
int domain_change(int kind, int n, const double* number, DomainKinds& k);

// domain_gradients : the same when only the gradients change, G [n*dim]
int domain_gradients(int kind, int n, const double* G, DomainKinds& k);

// domain_own : a kind with the numbers of this one for one point, which may change it
int domain_own(int kind, DomainKinds& k);

#endif
