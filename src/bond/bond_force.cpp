#include <algorithm>
#include <cmath>

#include "bond/bond.h"

namespace {

// sums of positions x [nnode + ncorner][D] over side A
template <int D>
void add_places(const Bonds& bonds, const double* x, double* xb)
{
  for (int b = 0; b < bonds.nbond; ++b, xb += D) {
    double sum[D] = {};
    for (int k = bonds.a.off[b]; k < bonds.a.off[b + 1]; ++k)
      for (int i = 0; i < D; ++i) sum[i] += bonds.a_w[k] * x[bonds.a.item[k] * D + i];
    std::copy_n(sum, D, xb);
  }
}

}  // namespace

void bond_places(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& u, const RealVec& uc,
                 RealVec& xb)
{
  const int dim = m.dim, nnode = m.mesh.nnode();
  RealVec x(static_cast<size_t>(nnode + pts.ncorner) * dim);
  for (int n = 0; n < nnode; ++n)
    for (int i = 0; i < dim; ++i) x[n * dim + i] = m.mesh.X[3 * n + i] + u[n * dim + i];
  double* corner = x.data() + static_cast<size_t>(nnode) * dim;
  for (int k = 0; k < pts.ncorner * dim; ++k) corner[k] = pts.Xc[k] + uc[k];
  xb.resize(static_cast<size_t>(bonds.nbond) * dim);
  if (dim == 2) add_places<2>(bonds, x.data(), xb.data());
  else add_places<3>(bonds, x.data(), xb.data());
}

void bond_stiffness(const Bonds& bonds, int dim, int b, double* C)
{
  const double *n = &bonds.normal[b * dim], ct = bonds.ct[b], dc = bonds.cn[b] - ct;
  for (int i = 0; i < dim; ++i)
    for (int j = 0; j < dim; ++j) C[i * dim + j] = dc * n[i] * n[j] + (i == j ? ct : 0.0);
}

void bond_ground_motion(const Model& m, const Bonds& bonds, int b, double t_step, double t_total, double* g)
{
  const BondDef& d    = m.bond[bonds.def[b]];
  for (int i = 0; i < m.dim; ++i)
    g[i] = support_value(m, d.motion[i], d.amplitude, &bonds.X[b * 3], t_step, t_total);
}

BondSums bond_sums(const Bonds& bonds, int def)
{
  BondSums sum;
  double first = 1e300;        // smallest name
  for (int b = 0; b < bonds.nbond; ++b) {
    if (bonds.def[b] != def || !bonds.counts(b)) continue;
    ++(bonds.intermediate[b] ? sum.between : sum.nodal);
    sum.area += bonds.area[b];
    const double name = bonds.halo.on() ? static_cast<double>(bonds.name[b]) : b;
    if (bonds.area[b] <= 0.0 || name >= first) continue;
    first = name;
    sum.penalty = bonds.cn[b] / bonds.area[b];
  }
  if (!bonds.halo.on()) return sum;
  double all[3] = {sum.nodal, sum.between, sum.area};
  comm_sum(all, 3);
  const double least = -comm_allreduce_max(-first);
  return {all[0], all[1], all[2], comm_allreduce_max(first == least ? sum.penalty : 0.0)};
}

double bond_energy(const Bonds& bonds, int dim, const Level& l, double* slip_max, double* slip_rms)
{
  double energy = 0.0, worst = 0.0, sum = 0.0, C[9];
  for (int b = 0; b < bonds.nbond; ++b) {
    if (!bonds.counts(b)) continue;
    const double *s = &l.slip[b * dim], *lam = &l.lambda[b * dim];
    double ss = 0.0;
    if (s[0] == CONTACT_OPEN) continue;
    if (bonds.side[b] == SIDE_CONTACT) {                        // contact                 (4.14)
      const double shift = l.lambda_n[b] < 0.0 ? l.lambda_n[b] / bonds.cn[b] : 0.0,
                   g = std::min(s[0] + shift, 0.0);
      const double n = bonds.beyond(b, s[0]);
      energy += 0.5 * bonds.cn[b] * (g * g - shift * shift) + 0.25 * bonds.growth(b) * n * n * n * n;
      for (int i = 0; i < dim && bonds.ct[b] > 0.0; ++i) energy += 0.5 * lam[i] * lam[i] / bonds.ct[b];
      continue;
    }
    bond_stiffness(bonds, dim, b, C);
    for (int i = 0; i < dim; ++i) {
      double Cs = 0.0;
      for (int j = 0; j < dim; ++j) Cs += C[i * dim + j] * s[j];
      energy += s[i] * (0.5 * Cs + lam[i]);
      const double tied = bonds.cn[b] > 0.0 ? Cs / bonds.cn[b] : 0.0;   // slip in the tied directions only
      ss += tied * tied;
    }
    worst = std::max(worst, ss);
    sum += ss;
  }
  if (bonds.halo.on()) {
    double both[2] = {energy, sum};
    comm_sum(both, 2);
    energy = both[0];
    sum    = both[1];
    worst  = comm_allreduce_max(worst);
  }
  *slip_max = std::sqrt(worst);
  *slip_rms = bonds.nbond_all() ? std::sqrt(sum / bonds.nbond_all()) : 0.0;
  return energy;
}
