#include <cmath>

#include "elem/elem.h"

namespace {

// change of volume over volume at t = 0 of the mean gradient H
template <int D>
inline Pack volume_change(bool finite, const Pack* H)
{
  if (finite) return ip_det<D>(H) - 1.0;
  Pack sum{};
  for (int i = 0; i < D; ++i) sum += H[i * D + i];
  return sum;
}

// forces of the bulk viscosity of the mean gradient of each element                               (6.35)
template <int D, int N>
void bulk_pack(const ElemBlock& b, const int* slot, int n, const double* u0, const double* u1, bool finite,
               const RealVec& q0, RealVec& q1, BulkStep& k, double* re)
{
  const auto pack = [](const double* x) { return reinterpret_cast<const Pack*>(x); };
  const double* of[PACK];
  for (int l = 0; l < PACK; ++l) of[l] = &b.mean[static_cast<size_t>(b.kind[slot[l]]) * (N * D + 3)];
  Pack mean[N * D + 3], H0[D * D], H1[D * D], cof[D * D], before{};
  pack_rows(of, N * D + 3, mean);
  const Pack volume = mean[N * D], travel = mean[N * D + 1], size = mean[N * D + 2];
  ip_gradient<D, N>(mean, N, pack(u0), H0);
  ip_gradient<D, N>(mean, N, pack(u1), H1);
  for (int l = 0; l < PACK; ++l) before[l] = q0[b.elem[slot[l]]];
  const Pack change0 = volume_change<D>(finite, H0), change = volume_change<D>(finite, H1) - change0;
  const double c = std::sqrt((b.law.lam + 2.0 * b.law.mu) / b.density);
  Pack q = before;
  if (k.dt > 0.0) {
    const Pack rate = change / ((1.0 + change0 + 0.5 * change) * k.dt);
    Pack length, span;
    for (int l = 0; l < PACK; ++l) length[l] = bulk_length(size[l], c * k.dt);
    q = bulk_stress(k, b.density, c, length, size, rate, span);
    const Pack xi = span / travel;
    const Pack loss = 0.5 * volume * (before + q) * change;
    for (int l = 0; l < n; ++l) {
      k.loss += loss[l];
      k.xi = std::max(k.xi, xi[l]);
    }
  }
  for (int l = 0; l < n; ++l) q1[b.elem[slot[l]]] = q[l];
  if (finite) ip_cofactor<D>(H1, cof);
  Pack* f = reinterpret_cast<Pack*>(re);
  for (int a = 0; a < N; ++a)
    for (int i = 0; i < D; ++i) {
      Pack sum{};
      if (finite)
        for (int j = 0; j < D; ++j) sum += cof[i * D + j] * mean[a * D + j];
      else
        sum = mean[a * D + i];
      f[a * D + i] += volume * q * sum;
    }
}

// force and tangent over an increment of the energy-momentum scheme; returns the energy dissipated   (6.49)
template <int D, int N>
double form_mid(const ElemBlock& b, int slot, const double* u0, const double* u1, bool finite,
                const BulkStep& k, double* re, double* ke)
{
  const double* mean  = &b.mean[static_cast<size_t>(b.kind[slot]) * (N * D + 3)];
  const double volume = mean[N * D], c = std::sqrt((b.law.lam + 2.0 * b.law.mu) / b.density);
  double H0[D * D], H1[D * D], cof[D * D], g[N * D], q, slope;
  ip_gradient<D, N>(mean, N, u0, H0);
  ip_gradient<D, N>(mean, N, u1, H1);
  const double size = mean[N * D + 2], way = c * k.dt;
  const double change =
      bulk_mid<D>(k, b.density, c, 2.0 * size + way, size + way, finite, H0, H1, cof, q, slope);
  bulk_rows<D>(cof, mean, N, g);
  for (int i = 0; i < N * D; ++i) re[i] = volume * q * g[i];
  if (ke) {
    std::fill_n(ke, pair_count(N) * D * D, 0.0);
    bulk_tangent<D>(volume * slope, g, N, ke);
  }
  return volume * q * change;
}

}  // namespace

bool elem_bulk_mid(const Mesh& mesh, const Elements& el, const ElemBlock& b, int slot, const Level& l0,
                   const Level& l1, bool finite, const BulkStep& k, double* re, double* ke, double& loss)
{
  const int e = b.elem[slot];
  if (!elem_whole(el, l0, e) || (!el.rigid.empty() && el.rigid[e])) return false;
  const int *node = elem_nodes(mesh, b, slot);
  const int nen = shape_info[b.shape].nen, dim = shape_info[b.shape].dim;
  double u0[MAX_NODES * 3], u1[MAX_NODES * 3];
  elem_ends(l0, l1, node, nen, dim, u0, u1);
  loss = by_shape(b.shape, [&](auto z) { return form_mid<z.D, z.N>(b, slot, u0, u1, finite, k, re, ke); });
  return true;
}

double elem_bulk_loss(const Mesh& mesh, const Elements& el, const Level& l0, const Level& l1, bool finite,
                      const BulkStep& k)
{
  double sum = 0.0, re[MAX_NODES * 3], loss;
  for (const ElemBlock& b : el.block)
    for (int slot : b.live)
      if (elem_bulk_mid(mesh, el, b, slot, l0, l1, finite, k, re, nullptr, loss)) sum += loss;
  return sum;
}

ElemBulkPack elem_bulk_pack(const ElemBlock& b)
{
  return by_shape(b.shape, [](auto z) -> ElemBulkPack { return bulk_pack<z.D, z.N>; });
}
