#include "elem/elem.h"
#include "shape/shape.h"

void ip_fields_from(const MatLaw& law, int dim, bool nlgeom, IpFields& out)
{
  static const int row[6] = {0, 1, 2, 0, 1, 2}, col[6] = {0, 1, 2, 1, 2, 0};
  double S[6];
  for (int k = 0; k < 6; ++k) {
    const int i = row[k], j = col[k];
    double e = 0.0;
    for (int l = 0; l < 3; ++l) e += out.F[3 * l + i] * out.F[3 * l + j];
    out.E[k] = 0.5 * (nlgeom ? e - (i == j) : out.F[3 * i + j] + out.F[3 * j + i] - 2.0 * (i == j));
  }
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
  if (dim == 2 && law.plane == PLANE_STRESS) F[8] = out.E[2] > -0.5 ? __builtin_sqrt(1.0 + 2.0 * out.E[2]) : 0.0;
  const double J = F[0] * (F[4] * F[8] - F[5] * F[7]) - F[1] * (F[3] * F[8] - F[5] * F[6]) +
                   F[2] * (F[3] * F[7] - F[4] * F[6]);
  const double Sm[9] = {S[0], S[3], S[5], S[3], S[1], S[4], S[5], S[4], S[2]};
  for (int k = 0; k < 6; ++k) {
    double s = 0.0;
    for (int a = 0; a < 3; ++a)
      for (int b = 0; b < 3; ++b) s += F[3 * row[k] + a] * Sm[3 * a + b] * F[3 * col[k] + b];
    out.sig[k] = s / J;
  }
}

void elem_ip_fields(const Model& m, const Elements& el, const RealVec& u, bool nlgeom,
                    int e, int g, IpFields& out)
{
  const ElemBlock& b    = el.block[el.block_of[e]];
  const ShapeInfo& info = shape_info[b.shape];
  const int dim = info.dim, slot = el.slot_of[e], *node = m.mesh.conn.begin(e);
  const double* dNdX = b.dNdX.data() + static_cast<size_t>(slot * info.ngp + g) * info.nen * dim;
  double N[8];
  shape_eval(b.shape, gauss_rule(b.shape).xi[g], N, nullptr);
  out    = IpFields();
  out.V0 = b.w[slot * info.ngp + g];
  for (int a = 0; a < info.nen; ++a) {
    const int n = node[a];
    for (int i = 0; i < dim; ++i) {
      out.X[i] += N[a] * m.mesh.X[3 * n + i];
      out.x[i] += N[a] * (m.mesh.X[3 * n + i] + u[n * dim + i]);
      for (int j = 0; j < dim; ++j) out.F[3 * i + j] += u[n * dim + i] * dNdX[a * dim + j];
    }
  }
  ip_fields_from(b.law, dim, nlgeom, out);
}

double elem_energy(const Model& m, const Elements& el, const RealVec& u, bool nlgeom)
{
  double sum = 0.0;
  for (const ElemBlock& b : el.block) {
    const ShapeInfo& info = shape_info[b.shape];
    const int dim = info.dim, nen = info.nen;
    for (size_t s = 0; s < b.elem.size(); ++s) {
      const int* node = m.mesh.conn.begin(b.elem[s]);
      double ul[24], H[9], E[9];
      for (int a = 0; a < nen; ++a)
        for (int i = 0; i < dim; ++i) ul[a * dim + i] = u[node[a] * dim + i];
      for (int g = 0; g < info.ngp; ++g) {
        const size_t ip    = s * info.ngp + g;
        const double* dNdX = b.dNdX.data() + ip * nen * dim;
        double tr = 0.0, ee = 0.0;
        if (dim == 2) {
          ip_gradient<2, 0>(dNdX, nen, ul, H);
          ip_strain<2>(nlgeom, H, E);
        } else {
          ip_gradient<3, 0>(dNdX, nen, ul, H);
          ip_strain<3>(nlgeom, H, E);
        }
        for (int i = 0; i < dim; ++i) tr += E[i * dim + i];
        for (int k = 0; k < dim * dim; ++k) ee += E[k] * E[k];
        sum += b.w[ip] * (0.5 * b.law.lam * tr * tr + b.law.mu * ee);
      }
    }
  }
  return sum;
}

double elem_gauss_place(const Model& m, const Elements& el, int e, int g, double* X, double* N)
{
  const ElemBlock& b    = el.block[el.block_of[e]];
  const ShapeInfo& info = shape_info[b.shape];
  shape_eval(b.shape, gauss_rule(b.shape).xi[g], N, nullptr);
  for (int i = 0; i < 3; ++i) {
    X[i] = 0.0;
    for (int a = 0; a < info.nen; ++a) X[i] += N[a] * m.mesh.X[3 * m.mesh.conn.begin(e)[a] + i];
  }
  return b.w[el.slot_of[e] * info.ngp + g];
}
