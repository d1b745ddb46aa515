// ---------------------------------------------------------------------------
// domain_kinds.h : what domains of points have that are equal but for their place (doc/theory.md 3.1)
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_DOMAIN_KINDS_H
#define MPFE_MODEL_DOMAIN_KINDS_H

#include <cstddef>

#include "base/types.h"

// Weights w_c, sum 1, gradients G_c, sum 0, and the consistent mass of a domain on its corners, pairs a >= b.
// Domains whose numbers are the same have them once: those of a box, or of equal elements that became points.
// A released point, which changes its shape, has numbers of its own.
struct DomainKinds {
  int dim = 0;                 // 0: there are none yet
  RealVec number;              // kind after kind: w [n], G [n*dim], mc [n*(n+1)/2]
  std::vector<std::size_t> first;    // [kind] place in number
  IntVec users;                // [kind] points that have it
  std::vector<char> alone;     // [kind] 1: of one point, which may change it
  IntVec place;                // hash table of the others in use, -1: free; a power of two
  IntVec unused;               // kinds that no point has any more
  const double* at(int kind) const { return &number[first[kind]]; }
};

// domain_numbers : how many numbers a domain with n corners has
constexpr int domain_numbers(int n, int dim) { return n * (1 + dim) + n * (n + 1) / 2; }

// domain_kind : the kind with these numbers, bit for bit, for one more point; a new one when there is none
int domain_kind(int n, int dim, const double* number, DomainKinds& k);

// domain_change : the same for a point that has had this kind
int domain_change(int kind, int n, const double* number, DomainKinds& k);

// domain_gradients : the same for one whose gradients alone become others, G [n*dim]
int domain_gradients(int kind, int n, const double* G, DomainKinds& k);

// domain_own : a kind with the numbers of this one, which the point that has had this one may change
int domain_own(int kind, DomainKinds& k);

#endif
