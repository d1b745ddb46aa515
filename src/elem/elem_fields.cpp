#include <algorithm>
#include <cmath>

#include "elem/elem.h"
#include "mat/voigt.h"
#include "shape/shape.h"

namespace {

// strains of all Gauss points of an element, with their enhanced part                [ngp][dim*dim]
template <int D>
void element_strains(const Model& m, const ElemBlock& b, size_t slot, const RealVec& u, bool nlgeom,
                     double* E)
{
  const ShapeInfo& info = shape_info[b.shape];
  const int nen = info.nen, *node = elem_nodes(m.mesh, b, slot);
  double ul[3 * MAX_NODES], H[D * D], extra[8 * D * D];         // enhanced types have 8 points at most
  for (int a = 0; a < nen; ++a)
    for (int i = 0; i < D; ++i) ul[a * D + i] = u[node[a] * D + i];
  for (int g = 0; g < info.ngp; ++g) {
    ip_gradient<D, 0>(&b.dNdX[(b.gauss(slot) + g) * nen * D], nen, ul, H);
    ip_strain<D>(nlgeom, H, E + g * D * D);
  }
  if (!elem_table[b.type].enhanced) return;
  for (int g = 0; g < info.ngp; ++g)
    eas_strain(b.shape, &b.eas[b.kind[slot] * eas_size(b.shape)], &b.w[b.gauss(slot)], b.law, E, g,
               extra + g * D * D);
  for (int k = 0; k < info.ngp * D * D; ++k) E[k] += extra[k];
}

// strains of all Gauss points of an element of a general law               [ngp][6], scale [ngp]
void general_strains(const Model& m, const ElemBlock& b, bool bar, size_t slot, const RealVec& u,
                     bool nlgeom, double* E, double* scale)
{
  const ShapeInfo& info = shape_info[b.shape];
  const int dim = info.dim, nen = info.nen, *node = elem_nodes(m.mesh, b, slot);
  const size_t first = b.gauss(slot);
  double ul[3 * MAX_NODES], H[9 * MAX_GAUSS], plane[9];
  for (int a = 0; a < nen; ++a)
    for (int i = 0; i < dim; ++i) ul[a * dim + i] = u[node[a] * dim + i];
  for (int g = 0; g < info.ngp; ++g) {
    const double* dN = &b.dNdX[(first + g) * nen * dim];
    if (dim == 2) ip_gradient<2, 0>(dN, nen, ul, H + 4 * g);
    else ip_gradient<3, 0>(dN, nen, ul, H + 9 * g);
  }
  std::fill_n(scale, info.ngp, 1.0);
  const BarGroup group{dim, info.ngp, nen, nullptr, &b.w[first], &b.law};
  if (bar && b.bar && bar_strains(group, nlgeom, H, E, scale)) return;
  for (int g = 0; g < info.ngp; ++g)
    if (dim == 2) {
      ip_strain<2>(nlgeom, H + 4 * g, plane);
      six_components<2>(plane, E + 6 * g);
    } else {
      ip_strain<3>(nlgeom, H + 9 * g, plane);
      six_components<3>(plane, E + 6 * g);
    }
}

// stored energy of an element of a general law; h: history of its first Gauss point
double general_energy(const Model& m, const ElemBlock& b, const MatLaw& law, size_t slot, const RealVec& u,
                      bool nlgeom, const double* h, int stride)
{
  double E[6 * MAX_GAUSS], scale[MAX_GAUSS], none[MAX_HISTORY], sum = 0.0;
  LawOutput out;
  general_strains(m, b, law.bar, slot, u, nlgeom, E, scale);
  for (int g = 0; g < shape_info[b.shape].ngp; ++g) {
    if (!law_update(law, nlgeom, E + 6 * g, h + g * stride, none, false, out)) return std::nan("");
    sum += b.w[b.gauss(slot) + g] * out.psi;
  }
  return sum;
}

// strain energy of the intact element in slot s
template <int D>
double one_energy(const Model& m, const ElemBlock& b, size_t s, const RealVec& u, bool nlgeom)
{
  const int ngp = shape_info[b.shape].ngp;
  double sum = 0.0, E[MAX_GAUSS * D * D], S[D * D];
  element_strains<D>(m, b, s, u, nlgeom, E);
  for (int g = 0; g < ngp; ++g) {
    double psi = 0.0;
    ip_law<D>(b.law, E + g * D * D, S);
    for (int k = 0; k < D * D; ++k) psi += 0.5 * S[k] * E[g * D * D + k];
    sum += b.w[b.gauss(s) + g] * psi;
  }
  return sum;
}

// strain energy of an intact enhanced element with initial stress: S0 works on the compatible strain   (2.46)
template <int D>
double start_energy(const Model& m, const Elements& el, int e, const Level& l, bool nlgeom)
{
  const ElemBlock& b    = el.block[el.initial_block[e]];
  const ShapeInfo& info = shape_info[b.shape];
  const int slot = el.slot_of[e], *node = elem_nodes(m.mesh, b, slot);
  double ul[3 * MAX_NODES], H[D * D], E[D * D], S0[6], sum = one_energy<D>(m, b, slot, l.u, nlgeom);
  for (int a = 0; a < info.nen; ++a)
    for (int i = 0; i < D; ++i) ul[a * D + i] = l.u[node[a] * D + i];
  for (int g = 0; g < info.ngp; ++g) {
    double psi = elem_start(b.law, history_at(l.he, el.history, el.gauss_of[e] + g), S0);
    ip_gradient<D, 0>(&b.dNdX[(b.gauss(slot) + g) * info.nen * D], info.nen, ul, H);
    ip_strain<D>(nlgeom, H, E);
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j) psi += S0[six_at[i][j]] * E[i * D + j];
    sum += b.w[b.gauss(slot) + g] * psi;
  }
  return sum;
}

// strain energies of PACK intact elements, not of an enhanced type                   [PACK]
template <int D, int N, int NGP>
void pack_energy(const Mesh& mesh, const ElemBlock& b, const int* slot, const RealVec& u, bool nlgeom,
                 double* out)
{
  Pack ul[N * D], sum = {}, dN[N * D], w = {};
  elem_ends_pack(u, mesh, b, slot, N, D, reinterpret_cast<double*>(ul));
  for (int g = 0; g < NGP; ++g) {
    elem_gradients_pack<D, N>(b, slot, g, dN, w);
    Pack H[D * D], E[D * D], S[D * D], psi = {};
    ip_gradient<D, N>(dN, N, ul, H);
    ip_strain<D>(nlgeom, H, E);
    ip_law<D>(b.law, E, S);
    for (int k = 0; k < D * D; ++k) psi += 0.5 * S[k] * E[k];
    sum += w * psi;
  }
  for (int l = 0; l < PACK; ++l) out[l] = sum[l];
}

using PackEnergy = void (*)(const Mesh& mesh, const ElemBlock& b, const int* slot, const RealVec& u,
                            bool nlgeom, double* out);

PackEnergy pack_energy_of(const ElemBlock& b)
{
  if (elem_table[b.type].enhanced || !b.short_form()) return nullptr;
  return by_shape(b.shape, [](auto z) -> PackEnergy { return pack_energy<z.D, z.N, z.NGP>; });
}

// sigma = F S F^T / det F                                                            (2.3)
void cauchy_stress(const double* F, const double* S, double* sig)
{
  using V = VoigtIndex<3>;
  const double J = F[0] * (F[4] * F[8] - F[5] * F[7]) - F[1] * (F[3] * F[8] - F[5] * F[6]) +
                   F[2] * (F[3] * F[7] - F[4] * F[6]);
  double Sm[9];
  full_tensor<3>(S, Sm);
  for (int k = 0; k < 6; ++k) {
    double s = 0.0;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) s += F[3 * V::row[k] + a] * Sm[3 * a + b] * F[3 * V::col[k] + b];
    sig[k] = s / J;
  }
}

// E of out (six components) from an enhanced element
void set_strain(const double* E, int dim, IpFields& out)
{
  using V = VoigtIndex<3>;
  for (int k = 0; k < 6; ++k) {
    const int i = V::row[k], j = V::col[k];
    out.E[k] = i < dim && j < dim ? E[i * dim + j] : 0.0;
  }
}

}  // namespace

void ip_fields_from(const MatLaw& law, int dim, bool nlgeom, IpFields& out)
{
  using V = VoigtIndex<3>;
  for (int k = 0; k < 6; ++k) {
    const int i = V::row[k], j = V::col[k];
    double e = 0.0;
    for (int l = 0; l < 3; ++l) e += out.F[3 * l + i] * out.F[3 * l + j];
    out.E[k] = 0.5 * (nlgeom ? e - (i == j) : out.F[3 * i + j] + out.F[3 * j + i] - 2.0 * (i == j));
  }
  ip_stress_from(law, dim, nlgeom, out);
}

void ip_stress_from(const MatLaw& law, int dim, bool nlgeom, IpFields& out)
{
  double S[6];
  mat_full(law, dim, out.E, S);
  out.psi = 0.0;
  for (int k = 0; k < 6; ++k) out.psi += 0.5 * S[k] * out.E[k] * (k < 3 ? 1.0 : 2.0);
  if (!nlgeom) {
    for (int k = 0; k < 6; ++k) out.sig[k] = S[k];
    return;
  }
  double F[9];
  for (int k = 0; k < 9; ++k) F[k] = out.F[k];
  // plane stress: S33 = 0, so the thickness stretch enters sigma through J alone
  if (dim == 2 && law.plane == PLANE_STRESS)
    F[8] = out.E[2] > -0.5 ? __builtin_sqrt(1.0 + 2.0 * out.E[2]) : 0.0;
  cauchy_stress(F, S, out.sig);
}

void ip_general_from(const MatLaw& law, bool nlgeom, const double* E, double scale, const double* h,
                     IpFields& out)
{
  double none[MAX_HISTORY];
  LawOutput l;
  for (int k = 0; k < 6; ++k) out.E[k] = E[k];
  if (!law_update(law, nlgeom, out.E, h, none, false, l)) {
    out.psi = std::nan("");
    for (double& s : out.sig) s = std::nan("");
    return;
  }
  out.psi     = l.psi;
  const int equivalent = law_field(law_of(law), HISTORY_EQUIVALENT);
  out.plastic = equivalent >= 0 ? h[equivalent] : 0.0;
  for (int k = 0; k < 6; ++k) out.sig[k] = l.S[k];
  if (!nlgeom) return;
  double F[9];
  for (int k = 0; k < 9; ++k) F[k] = scale * out.F[k];
  if (law.plane == PLANE_STRESS) F[8] = out.E[2] > -0.5 ? std::sqrt(1.0 + 2.0 * out.E[2]) : 0.0;
  std::copy_n(F, 9, out.Fbar);
  cauchy_stress(F, l.S, out.sig);
}

void elem_ip_fields(const Model& m, const Elements& el, const Level& l, bool nlgeom,
                    int e, int g, IpFields& out)
{
  const ElemBlock& b    = el.block[el.initial_block[e]];
  const ShapeInfo& info = shape_info[b.shape];
  const int dim = info.dim, slot = el.slot_of[e], *node = m.mesh.conn.begin(e);
  const double* dNdX = &b.dNdX[(b.gauss(slot) + g) * info.nen * dim];
  double N[MAX_NODES];
  shape_eval(b.shape, gauss_rule(b.shape).xi[g], N, nullptr);
  out    = IpFields();
  out.V0 = b.w[b.gauss(slot) + g];
  for (int a = 0; a < info.nen; ++a) {
    const int n = node[a];
    for (int i = 0; i < dim; ++i) {
      out.X[i] += N[a] * m.mesh.X[3 * n + i];
      out.x[i] += N[a] * (m.mesh.X[3 * n + i] + l.u[n * dim + i]);
      for (int j = 0; j < dim; ++j) out.F[3 * i + j] += l.u[n * dim + i] * dNdX[a * dim + j];
    }
  }
  const bool broken = el.broken(e) >= 0;
  if (!elem_keeps_none(el, b, l, e)) {
    double strain[6 * MAX_GAUSS], scale[MAX_GAUSS];
    const MatLaw law = elem_law(m, el, b, slot, broken ? l.degr[e] : 1.0);
    const double* h  = history_at(l.he, el.history, el.gauss_of[e] + g);
    general_strains(m, b, law.bar, slot, l.u, nlgeom, strain, scale);
    ip_general_from(law, nlgeom, strain + 6 * g, scale[g], h, out);
    if (b.opens() && law.kind != LAW_GRANULAR) out.opening = crack_opening(b.law, h);
    return;
  }
  if (!elem_table[b.type].enhanced) {
    ip_fields_from(b.law, dim, nlgeom, out);
    return;
  }
  double E[72];
  if (dim == 2) element_strains<2>(m, b, slot, l.u, nlgeom, E);
  else element_strains<3>(m, b, slot, l.u, nlgeom, E);
  set_strain(E + g * dim * dim, dim, out);
  if (b.enhanced_start()) {
    double strain[6];
    std::copy_n(out.E, 6, strain);
    ip_general_from(b.law, nlgeom, strain, 1.0, history_at(l.he, el.history, el.gauss_of[e] + g), out);
    return;
  }
  ip_stress_from(b.law, dim, nlgeom, out);
}

void elem_strains(const Model& m, const Elements& el, int e, const RealVec& u, const RealVec* he, bool nlgeom,
                  double* E)
{
  const ElemBlock& b = el.block[el.initial_block[e]];
  if (m.dim == 2) element_strains<2>(m, b, el.slot_of[e], u, nlgeom, E);
  else element_strains<3>(m, b, el.slot_of[e], u, nlgeom, E);
  if (!he || b.law.initial < 0) return;
  for (int k = el.gauss_of[e]; k < el.gauss_of[e + 1]; ++k, E += m.dim * m.dim)
    for (int i = 0; i < m.dim; ++i)
      for (int j = 0; j < m.dim; ++j)
        E[i * m.dim + j] += history_at(*he, el.history, k)[b.law.initial + six_at[i][j]];
}

double elem_initial33(const Elements& el, const RealVec& he, int e, int g)
{
  const MatLaw& law = el.block[el.initial_block[e]].law;
  if (law.initial < 0 || law.plane != PLANE_STRAIN) return 0.0;
  return history_at(he, el.history, el.gauss_of[e] + g)[law.initial + 2];
}

void elem_forget_strain(const Model& m, const Elements& el, int e, bool nlgeom, Level& l)
{
  const ElemBlock& b = el.block[el.initial_block[e]];
  double E[6 * MAX_GAUSS], scale[MAX_GAUSS];
  if (b.enhanced_start()) {                          // with the enhanced part, so that no stress is left
    double all[72];
    IpFields six;
    elem_strains(m, el, e, l.u, nullptr, nlgeom, all);
    for (int g = 0; g < shape_info[b.shape].ngp; ++g) {
      set_strain(all + g * m.dim * m.dim, m.dim, six);
      std::copy_n(six.E, 6, E + 6 * g);
    }
  } else {
    general_strains(m, b, b.law.bar, el.slot_of[e], l.u, nlgeom, E, scale);
  }
  if (!l.cracked.empty()) l.cracked[e] = 0;
  for (int k = el.gauss_of[e], g = 0; k < el.gauss_of[e + 1]; ++k, ++g) {
    double* h = history_at(l.he, el.history, k);
    std::fill_n(h, el.history, 0.0);
    for (int i = 0; i < 6; ++i) h[b.law.initial + i] = -E[6 * g + i];
  }
}

double elem_energy_one(const Model& m, const Elements& el, int e, const Level& l, double c, bool nlgeom)
{
  const ElemBlock& b = el.block[el.initial_block[e]];
  const int slot = el.slot_of[e];
  if (el.broken(e) >= 0 || b.general) {
    const double* h = history_at(l.he, el.history, el.gauss_of[e]);
    return general_energy(m, b, elem_law(m, el, b, slot, c), slot, l.u, nlgeom, h, el.history);
  }
  if (b.enhanced_start())
    return m.dim == 2 ? start_energy<2>(m, el, e, l, nlgeom) : start_energy<3>(m, el, e, l, nlgeom);
  return m.dim == 2 ? one_energy<2>(m, b, slot, l.u, nlgeom) : one_energy<3>(m, b, slot, l.u, nlgeom);
}

void elem_dissipated(const Elements& el, const Level& l, double& plastic, double& cohesive)
{
  if (el.history == 0) return;
  for (const ElemBlock& b : el.block) {
    const int flow = law_field(law_of(b.law), HISTORY_FLOW_WORK);
    double& sum    = b.opens() ? cohesive : plastic;
    for (int s : b.live) {
      if (elem_keeps_none(el, b, l, b.elem[s])) continue;
      const double* h = history_at(l.he, el.history, el.gauss_of[b.elem[s]]);
      for (int g = 0; g < shape_info[b.shape].ngp; ++g, h += el.history) {
        const double flowed = flow >= 0 ? h[flow] : 0.0;
        sum += b.w[b.gauss(s) + g] * (h[HISTORY_DISSIPATED] - flowed);
        plastic += b.w[b.gauss(s) + g] * flowed;
      }
    }
  }
}

double elem_energy(const Model& m, const Elements& el, const Level& l, bool nlgeom, RealVec* each)
{
  double sum = 0.0, energy[PACK];
  int slot[PACK], n = 0;       // intact elements of an incomplete pack
  if (each) each->assign(el.initial_block.size(), 0.0);
  const auto add = [&](int e, double value, bool intact) {
    sum += value;
    if (each && intact) (*each)[e] = value;
  };
  for (const ElemBlock& b : el.block) {
    const PackEnergy pack = pack_energy_of(b);
    const auto flush = [&]() {
      if (n == 0) return;
      for (int k = n; k < PACK; ++k) slot[k] = slot[0];
      pack(m.mesh, b, slot, l.u, nlgeom, energy);
      for (int k = 0; k < n; ++k) add(b.elem[slot[k]], energy[k], true);
      n = 0;
    };
    for (int s : b.live) {
      const int e       = b.elem[s];
      const bool intact = el.broken(e) < 0;
      if (pack && elem_whole(el, l, e)) {
        slot[n++] = s;
        if (n == PACK) flush();
      } else {
        add(e, elem_energy_one(m, el, e, l, intact ? 1.0 : l.degr[e], nlgeom), intact);
      }
    }
    flush();
  }
  return sum;
}

double elem_viscous_loss(const Model& m, const Elements& el, const Level& l0, const Level& l1, bool nlgeom)
{
  double sum = 0.0, E0[9 * MAX_GAUSS], E1[9 * MAX_GAUSS], S[9];
  const int dd = m.dim * m.dim;
  for (const ElemBlock& b : el.block) {
    if (b.law.beta == 0.0) continue;
    for (int slot : b.live) {
      const int e = b.elem[slot];
      if (el.broken(e) >= 0) continue;
      if (b.general) {
        double scale[MAX_GAUSS];
        general_strains(m, b, true, slot, l0.u, nlgeom, E0, scale);
        general_strains(m, b, true, slot, l1.u, nlgeom, E1, scale);
        for (int g = 0; g < shape_info[b.shape].ngp; ++g) {
          for (int k = 6 * g; k < 6 * g + 6; ++k) E1[k] -= E0[k];
          sum += b.law.beta * b.w[b.gauss(slot) + g] * law_viscous_work(b.law, E1 + 6 * g);
        }
        continue;
      }
      elem_strains(m, el, e, l0.u, nullptr, nlgeom, E0);
      elem_strains(m, el, e, l1.u, nullptr, nlgeom, E1);
      for (int g = 0; g < shape_info[b.shape].ngp; ++g) {
        double *dE = E1 + g * dd, loss = 0.0;
        for (int k = 0; k < dd; ++k) dE[k] -= E0[g * dd + k];
        if (m.dim == 2) ip_law<2>(b.law, dE, S);
        else ip_law<3>(b.law, dE, S);
        for (int k = 0; k < dd; ++k) loss += S[k] * dE[k];
        sum += b.law.beta * b.w[b.gauss(slot) + g] * loss;
      }
    }
  }
  return sum;
}

double elem_gauss_position(const Model& m, const Elements& el, int e, int g, double* X, double* N)
{
  const ElemBlock& b    = el.block[el.initial_block[e]];
  const ShapeInfo& info = shape_info[b.shape];
  shape_eval(b.shape, gauss_rule(b.shape).xi[g], N, nullptr);
  for (int i = 0; i < 3; ++i) {
    X[i] = 0.0;
    for (int a = 0; a < info.nen; ++a) X[i] += N[a] * m.mesh.X[3 * m.mesh.conn.begin(e)[a] + i];
  }
  return b.w[b.gauss(el.slot_of[e]) + g];
}
