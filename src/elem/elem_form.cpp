#include "elem/elem.h"
#include "elem/kernel_broken.h"

namespace {

// one element with NGP Gauss points and N nodes in D dimensions
template <int D, int N, int NGP>
Status form(const ElemBlock& b, size_t slot, const KernelMode& mode,
            const double* u0, const double* u1, double* re, double* ke)
{
  const double *dNdX = &b.dNdX[slot * NGP * N * D], *w = &b.w[slot * NGP];
  double det_min = 1.0;
  for (int k = 0; k < N * D; ++k) re[k] = 0.0;
  if (ke)
    for (int k = 0; k < pair_count(N) * D * D; ++k) ke[k] = 0.0;
  for (int g = 0; g < NGP; ++g) {
    const double* dN = dNdX + g * N * D;
    double H0[D * D] = {0}, H1[D * D], Fb[D * D], S[D * D], f[N * D];
    ip_gradient<D, N>(dN, N, u1, H1);
    if (mode.mid) ip_gradient<D, N>(dN, N, u0, H0);
    const double det = ip_stress<D>(b.law, mode, H0, H1, Fb, S);
    det_min          = det < det_min ? det : det_min;
    ip_force<D, N>(dN, N, w[g], Fb, S, re);
    if (ke) ip_tangent<D, N>(dN, N, w[g], b.law, mode, Fb, S, f, ke);
  }
  return det_min > 0.0 ? STATUS_OK : BAD_JACOBIAN;
}

template <int D, int N, int NGP>
Status form_broken(const ElemBlock& b, size_t slot, const ErodedLaw& law, const KernelMode& mode,
                   const double* u0, const double* u1, double* re, double* ke)
{
  constexpr int nv = VoigtPlace<D>::nv;
  const double *dNdX = &b.dNdX[slot * NGP * N * D], *w = &b.w[slot * NGP];
  for (int k = 0; k < N * D; ++k) re[k] = 0.0;
  if (ke)
    for (int k = 0; k < pair_count(N) * D * D; ++k) ke[k] = 0.0;
  for (int g = 0; g < NGP; ++g) {
    const double* dN = dNdX + g * N * D;
    double H0[D * D] = {0}, H1[D * D], Fb[D * D], S[D * D], C[nv * nv], B[N * nv * D], CB[N * nv * D];
    ip_gradient<D, N>(dN, N, u1, H1);
    if (mode.mid) ip_gradient<D, N>(dN, N, u0, H0);
    ip_broken<D>(b.law, law, mode, H0, H1, Fb, S, ke ? C : nullptr);
    ip_force<D, N>(dN, N, w[g], Fb, S, re);
    if (ke) ip_tangent_general<D, N>(dN, N, w[g], C, mode.cG(), Fb, S, B, CB, ke);
  }
  return STATUS_OK;
}

}  // namespace

Status elem_form_broken(const ElemBlock& b, size_t slot, const ErodedLaw& law, const KernelMode& mode,
                        const double* u0, const double* u1, double* re, double* ke)
{
  switch (b.shape) {
    case SHAPE_TRI3: return form_broken<2, 3, 1>(b, slot, law, mode, u0, u1, re, ke);
    case SHAPE_QUAD4: return form_broken<2, 4, 4>(b, slot, law, mode, u0, u1, re, ke);
    case SHAPE_TET4: return form_broken<3, 4, 1>(b, slot, law, mode, u0, u1, re, ke);
    case SHAPE_WEDGE6: return form_broken<3, 6, 6>(b, slot, law, mode, u0, u1, re, ke);
    default: return form_broken<3, 8, 8>(b, slot, law, mode, u0, u1, re, ke);
  }
}

ErodedLaw elem_broken_law(const Model& m, const Elements& el, int e)
{
  return eroded_law(m, el.frac->broken[e], &el.frac->normal[3 * static_cast<size_t>(e)]);
}

ElemForm elem_form(const ElemBlock& b)
{
  if (elem_table[b.type].enhanced) return eas_form(b.shape);
  switch (b.shape) {
    case SHAPE_TRI3: return form<2, 3, 1>;
    case SHAPE_QUAD4: return form<2, 4, 4>;
    case SHAPE_TET4: return form<3, 4, 1>;
    case SHAPE_WEDGE6: return form<3, 6, 6>;
    default: return form<3, 8, 8>;
  }
}
