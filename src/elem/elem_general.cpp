#include <algorithm>
#include <cmath>

#include "elem/elem.h"
#include "elem/kernel_general.h"

namespace {

template <int D, int N, int NGP>
Status form(const ElemBlock& b, size_t slot, const MatLaw& law, const KernelMode& mode, const double* u0,
            const double* u1, const HistoryStep* h, double* re, double* ke)
{
  constexpr int nv = VoigtIndex<D>::nv;
  const size_t first = b.gauss(slot);
  const double *dNdX = &b.dNdX[first * N * D], *w = &b.w[first];
  const bool old = mode_reads_old(mode, law);
  for (int k = 0; k < N * D; ++k) re[k] = 0.0;
  for (int k = 0; ke && k < pair_count(N) * D * D; ++k) ke[k] = 0.0;
  for (int g = 0; g < NGP; ++g) {
    const double* dN = dNdX + g * N * D;
    double H0[D * D] = {0}, H1[D * D], Fb[D * D], S[D * D], C[nv * nv];
    ip_gradient<D, N>(dN, N, u1, H1);
    if (old) ip_gradient<D, N>(dN, N, u0, H0);
    if (ip_general<D>(law, mode, H0, H1, h[g].n, h[g].np1, Fb, S, ke ? C : nullptr) != STATUS_OK)
      return BAD_JACOBIAN;
    ip_force<D, N>(dN, N, w[g], Fb, S, re);
    if (ke) ip_tangent_general<D, N>(dN, N, w[g], C, mode.cG(), Fb, S, ke);
  }
  return STATUS_OK;
}

// normal of the widest cohesive crack at n points with the histories of(g), null: none               [3]
template <class Of>
const double* widest_crack(const MatLaw& law, int n, Of of)
{
  double most = 0.0;
  const double* main = nullptr;
  for (int g = 0; g < n; ++g) {
    const double opening = crack_opening(law, of(g));
    if (opening <= most) continue;
    most = opening;
    main = crack_normal(law, of(g));
  }
  return main;
}

// mean normal of the cohesive cracks at the n points of an element, weighted by their openings; 0: none  [3].
// Of several at a point that which is nearest to the widest of the element
void mean_normal(const MatLaw& law, const HistoryStep* h, int n, double* mean)
{
  std::fill_n(mean, 3, 0.0);
  const double* main = widest_crack(law, n, [&](int g) { return h[g].n; });
  if (!main) return;
  for (int g = 0; g < n; ++g) {
    double opening;
    const double* N = crack_normal_like(law, h[g].n, main, &opening);
    if (opening == 0.0) continue;
    const double k = N[0] * mean[0] + N[1] * mean[1] + N[2] * mean[2] < 0.0 ? -opening : opening;
    for (int i = 0; i < 3; ++i) mean[i] += k * N[i];
  }
  const double length = std::sqrt(mean[0] * mean[0] + mean[1] * mean[1] + mean[2] * mean[2]);
  for (int i = 0; i < 3 && length > 0.0; ++i) mean[i] /= length;
}

}  // namespace

const double* elem_main_crack(const Elements& el, const Level& l, int e)
{
  const int first = el.gauss_of[e], n = el.gauss_of[e + 1] - first;
  return widest_crack(el.block[el.initial_block[e]].law, n,
                      [&](int g) { return history_at(l.he, el.history, first + g); });
}

void elem_history(const Elements& el, const Level& l0, Level& l1, int e, HistoryStep* h)
{
  for (int k = el.gauss_of[e]; k < el.gauss_of[e + 1]; ++k)
    *h++ = {history_at(l0.he, el.history, k), history_at(l1.he, el.history, k)};
}

namespace {

void copy_history(const Elements& el, const Level& l0, Level& l1, int e)
{
  const size_t first = static_cast<size_t>(el.gauss_of[e]) * el.history,
               n     = static_cast<size_t>(el.gauss_of[e + 1]) * el.history - first;
  std::copy_n(&l0.he[first], n, &l1.he[first]);
}

}  // namespace

void elem_uncracked(const Elements& el, const Level& l0, Level& l1, int e)
{
  if (!l1.cracked[e]) return;
  copy_history(el, l0, l1, e);         // an earlier iteration has opened one
  l1.cracked[e] = 0;
}

void elem_copy_history(const Elements& el, const Level& n, Level& l)
{
  if (n.cracked.empty() || l.cracked.size() != n.cracked.size() || l.he.size() != n.he.size()) l.he = n.he;
  else
    for (size_t e = 0; e < n.cracked.size(); ++e) {
      const int b = el.initial_block[e];
      if (b < 0 || (elem_keeps_none(el, el.block[b], n, e) && !l.cracked[e])) continue;
      copy_history(el, n, l, static_cast<int>(e));
    }
  l.cracked = n.cracked;
}

double elem_start(const MatLaw& law, const double* h, double* S0)
{
  double E[6] = {0}, none[MAX_HISTORY];
  LawOutput out;
  law_update(law, true, E, h, none, false, out);
  std::copy_n(out.S, 6, S0);
  return out.psi;
}

Status elem_form_general(const ElemBlock& b, size_t slot, const MatLaw& law, const KernelMode& mode,
                         const double* u0, const double* u1, const HistoryStep* h, double* re, double* ke)
{
  return by_shape(b.shape, [&](auto z) {
    if (!b.bar || law.broken) return form<z.D, z.N, z.NGP>(b, slot, law, mode, u0, u1, h, re, ke);
    const size_t first = b.gauss(slot);
    const double* dNdX = &b.dNdX[first * z.N * z.D];
    const bool old = mode_reads_old(mode, law);
    double H0[z.NGP * z.D * z.D], H1[z.NGP * z.D * z.D];
    for (int g = 0; g < z.NGP; ++g) {
      ip_gradient<z.D, z.N>(dNdX + g * z.N * z.D, z.N, u1, H1 + g * z.D * z.D);
      if (old) ip_gradient<z.D, z.N>(dNdX + g * z.N * z.D, z.N, u0, H0 + g * z.D * z.D);
    }
    return bar_form({z.D, z.NGP, z.N, dNdX, &b.w[first], &law}, mode, H0, H1, h, re, ke);
  });
}

Status elem_form_one(const Model& m, const Elements& el, const KernelMode& mode, const ElemBlock& b, int slot,
                     ElemForm form, const Level& l0, Level& l1, double* re, double* ke)
{
  const int e       = b.elem[slot];
  const bool intact = el.broken(e) < 0;
  double u0[3 * MAX_NODES], u1[3 * MAX_NODES];
  HistoryStep h[MAX_GAUSS];
  elem_ends(l0, l1, m.mesh.conn.begin(e), shape_info[b.shape].nen, m.dim, u0, u1);
  if (intact && b.enhanced_start()) {
    double S0[9 * MAX_GAUSS], six[6];
    for (int k = el.gauss_of[e], g = 0; k < el.gauss_of[e + 1]; ++k, ++g) {
      elem_start(b.law, history_at(l0.he, el.history, k), six);
      for (int i = 0; i < m.dim; ++i)
        for (int j = 0; j < m.dim; ++j) S0[(g * m.dim + i) * m.dim + j] = six[six_at[i][j]];
    }
    copy_history(el, l0, l1, e);
    return eas_form_start(b.shape)(b, slot, mode, u0, u1, S0, re, ke);
  }
  if (intact && !b.general) return form(b, slot, mode, u0, u1, re, ke);
  elem_history(el, l0, l1, e, h);
  MatLaw law       = elem_law(m, el, b, slot, intact ? 1.0 : degr_of_step(l0, l1, mode.mid, e));
  law.crack.tangent = mode.crack;
  if (!intact || !b.opens()) return elem_form_general(b, slot, law, mode, u0, u1, h, re, ke);
  const int ngp = shape_info[b.shape].ngp;
  mean_normal(law, h, ngp, law.crack.across);
  const Status status = elem_form_general(b, slot, law, mode, u0, u1, h, re, ke);
  const auto cracked = [&](const HistoryStep& x) { return crack_opening(law, x.np1) > 0.0; };
  l1.cracked[e] = std::any_of(h, h + ngp, cracked);
  return status;
}
