#include "elem/elem.h"

namespace {

// an element with NGP Gauss points and N nodes in D dimensions, or a pack of them; re or ke may be null.
// Returns the minimum of det F(n+1); ENERGY: energy; STRESS: SS_max, the maximum of S : S
template <int D, int N, int NGP, bool ENERGY = false, bool STRESS = false, class G, class T>
T form(const G* dNdX, const G* w, const MatLaw& law, const KernelMode& mode, const T* u0, const T* u1, T* re,
       T* ke, T* energy = nullptr, T* SS_max = nullptr)
{
  T det_min = T{} + 1.0;
  if (ENERGY) *energy = T{};
  if (re)
    for (int k = 0; k < N * D; ++k) re[k] = T{};
  if (ke)
    for (int k = 0; k < pair_count(N) * D * D; ++k) ke[k] = T{};
  for (int g = 0; g < NGP; ++g) {
    const G* dN = dNdX + g * N * D;
    T H0[D * D] = {}, H1[D * D], Fb[D * D], S[D * D], f[N * D];
    ip_gradient<D, N>(dN, N, u1, H1);
    if (mode_reads_old(mode, law)) ip_gradient<D, N>(dN, N, u0, H0);
    const T det = ip_stress<D>(law, mode, H0, H1, Fb, S);
    det_min     = det < det_min ? det : det_min;
    if (STRESS) {
      T SS = {};
      for (int k = 0; k < D * D; ++k) SS += S[k] * S[k];
      *SS_max = SS > *SS_max ? SS : *SS_max;
    }
    if (ENERGY) {
      T E[D * D], Snew[D * D], psi = {};
      ip_strain<D>(mode.finite, H1, E);
      ip_law<D>(law, E, Snew);
      for (int k = 0; k < D * D; ++k) psi += 0.5 * Snew[k] * E[k];
      *energy += w[g] * psi;
    }
    if (re) ip_force<D, N>(dN, N, w[g], Fb, S, re);
    if (ke) ip_tangent<D, N>(dN, N, w[g], law, mode, Fb, S, f, ke);
  }
  return det_min;
}

template <int D, int N, int NGP>
Status form_one(const ElemBlock& b, size_t slot, const KernelMode& mode,
                const double* u0, const double* u1, double* re, double* ke)
{
  const size_t first = b.gauss(slot);
  return form<D, N, NGP>(&b.dNdX[first * N * D], &b.w[first], b.law, mode, u0, u1, re, ke) > 0.0
             ? STATUS_OK
             : BAD_JACOBIAN;
}

// lanes in which a principal stress may exceed the strength: it is at SS_max sqrt(S : S)
unsigned near_strength(const ElemBlock& b, const int* slot, const Pack& SS_max)
{
  unsigned out = 0;
  for (int l = 0; l < PACK; ++l) {
    const double ft = b.law.crack.strength * (b.scatter.empty() ? 1.0 : b.scatter[slot[l]]);
    if (!(SS_max[l] <= ft * ft)) out |= 1u << l;
  }
  return out;
}

// equal elements share their gradients; those of others are gathered in packs. A separate instance for
// ENERGY: forces alone are faster
template <int D, int N, int NGP, bool ENERGY, bool STRESS>
__attribute__((noinline, flatten)) Pack form_rows(const ElemBlock& b, const int* slot, const KernelMode& mode,
                                                  const Pack* u0, const Pack* u1, Pack* re, Pack* ke,
                                                  Pack* energy, Pack* SS_max)
{
  bool equal = true;
  for (int l = 1; l < PACK; ++l) equal = equal && b.kind[slot[l]] == b.kind[slot[0]];
  if (equal) {
    const size_t first = b.gauss(slot[0]);
    return form<D, N, NGP, ENERGY, STRESS>(&b.dNdX[first * N * D], &b.w[first], b.law, mode, u0, u1, re, ke,
                                           energy, SS_max);
  }
  Pack dNdX[NGP * N * D], w[NGP];
  for (int g = 0; g < NGP; ++g) elem_gradients_pack<D, N>(b, slot, g, dNdX + g * N * D, w[g]);
  return form<D, N, NGP, ENERGY, STRESS>(dNdX, w, b.law, mode, u0, u1, re, ke, energy, SS_max);
}

template <int D, int N, int NGP>
Status form_pack(const ElemBlock& b, const int* slot, const KernelMode& mode, const double* u0,
                 const double* u1, double* re, double* ke, unsigned& bad, double* energy, unsigned* opens)
{
  const auto pack = [](const double* x) { return reinterpret_cast<const Pack*>(x); };
  Pack *rp = reinterpret_cast<Pack*>(re), *kp = reinterpret_cast<Pack*>(ke), psi;
  Pack SS_max = {}, det;
  if (opens) {
    const auto rows = energy ? form_rows<D, N, NGP, true, true> : form_rows<D, N, NGP, false, true>;
    det    = rows(b, slot, mode, pack(u0), pack(u1), rp, kp, &psi, &SS_max);
    *opens = near_strength(b, slot, SS_max);
  } else if (energy) {
    det = form_rows<D, N, NGP, true, false>(b, slot, mode, pack(u0), pack(u1), rp, kp, &psi, nullptr);
  } else {
    det = form_rows<D, N, NGP, false, false>(b, slot, mode, pack(u0), pack(u1), rp, kp, nullptr, nullptr);
  }
  bad = 0;
  for (int l = 0; l < PACK; ++l)
    if (!(det[l] > 0.0)) bad |= 1u << l;
  for (int l = 0; l < PACK && energy; ++l) energy[l] = psi[l];
  return bad ? BAD_JACOBIAN : STATUS_OK;
}

}  // namespace

ElemForm elem_form(const ElemBlock& b)
{
  if (elem_table[b.type].enhanced) return eas_form(b.shape);
  return by_shape(b.shape, [](auto z) -> ElemForm { return form_one<z.D, z.N, z.NGP>; });
}

ElemFormPack elem_form_pack(const ElemBlock& b)
{
  if (elem_table[b.type].enhanced || !b.short_form()) return nullptr;
  return by_shape(b.shape, [](auto z) -> ElemFormPack { return form_pack<z.D, z.N, z.NGP>; });
}
