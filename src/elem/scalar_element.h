// ---------------------------------------------------------------------------
// scalar_element.h : a scalar field in an element at rest: stiffness lam + 2 mu along each gradient, and
// lumped mass                                                                                (6.30), (6.46)
// ---------------------------------------------------------------------------
#ifndef MPFE_ELEM_SCALAR_ELEMENT_H
#define MPFE_ELEM_SCALAR_ELEMENT_H

#include "elem/elem.h"

// scalar_masses : row sums of the mass of this kind                                      [nen]
inline void scalar_masses(const ElemBlock& b, int kind, double* mass)
{
  const int nen    = shape_info[b.shape].nen;
  const double* me = &b.me[static_cast<size_t>(kind) * pair_count(nen)];
  std::fill_n(mass, nen, 0.0);
  for (int a = 0, k = 0; a < nen; ++a)
    for (int c = 0; c <= a; ++c, ++k) {
      mass[a] += me[k];
      if (c < a) mass[c] += me[k];
    }
}

// scalar_stiffness : calls use(a, c, k) with the part k of each Gauss point in the stiffness of nodes a >= c
template <class Use>
void scalar_stiffness(const ElemBlock& b, int kind, Use use)
{
  const ShapeInfo& info = shape_info[b.shape];
  const int nen = info.nen, dim = info.dim;
  for (int g = 0; g < info.ngp; ++g) {
    const size_t at  = static_cast<size_t>(kind) * info.ngp + g;
    const double* dN = &b.dNdX[at * nen * dim];
    const double w   = b.w[at] * (b.law.lam + 2.0 * b.law.mu);
    for (int a = 0; a < nen; ++a)
      for (int c = 0; c <= a; ++c) {
        double sum = 0.0;
        for (int i = 0; i < dim; ++i) sum += dN[a * dim + i] * dN[c * dim + i];
        use(a, c, w * sum);
      }
  }
}

#endif
