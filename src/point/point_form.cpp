#include "elem/kernel_broken.h"
#include "point/point.h"

namespace {

// displacement gradient of point p: sum_c u_c (x) G_c                              (3.5)
template <int D>
void gradient(const Points& pts, const RealVec& uc, int p, double* H)
{
  for (int k = 0; k < D * D; ++k) H[k] = 0.0;
  for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) {
    const int c = pts.conn.item[k];
    for (int i = 0; i < D; ++i) {
      const double u = uc[c * D + i];
      for (int j = 0; j < D; ++j) H[i * D + j] += u * pts.G[k * D + j];
    }
  }
}

ErodedLaw broken_law(const Model& m, const Points& pts, int p)
{
  return eroded_law(m, pts.broken[p], &pts.normal[3 * static_cast<size_t>(p)]);
}

template <int D>
Status corner_force(const Model& m, const Points& pts, const std::vector<MatLaw>& law, const KernelMode& mode,
                    const RealVec& uc0, const RealVec& uc1, const IntVec& mine, RealVec& fc, int* worst)
{
  Status status = STATUS_OK;
  for (int p : mine) {
    double H0[D * D] = {0}, H1[D * D], Fb[D * D], S[D * D], re[8 * D] = {0};
    gradient<D>(pts, uc1, p, H1);
    if (mode.mid) gradient<D>(pts, uc0, p, H0);
    if (pts.broken[p] >= 0) {
      ip_broken<D>(law[pts.body[p]], broken_law(m, pts, p), mode, H0, H1, Fb, S, nullptr);
    } else if (!(ip_stress<D>(law[pts.body[p]], mode, H0, H1, Fb, S) > 0.0)) {
      *worst = p;
      status = BAD_JACOBIAN;
    }
    const int first = pts.conn.off[p], n = pts.conn.count(p);
    ip_force<D, 0>(&pts.G[static_cast<size_t>(first) * D], n, pts.V0[p], Fb, S, re);
    for (int a = 0; a < n; ++a)
      for (int i = 0; i < D; ++i) fc[pts.conn.item[first + a] * D + i] += re[a * D + i];
  }
  return status;
}

template <int D>
void tangent(const Model& m, const Points& pts, const std::vector<MatLaw>& law, const KernelMode& mode,
             const RealVec& uc0, const RealVec& uc1, const ActiveGrid& g, int p, RealVec& work, double* ke)
{
  double H0[D * D] = {0}, H1[D * D], Fb[D * D], S[D * D];
  gradient<D>(pts, uc1, p, H1);
  if (mode.mid) gradient<D>(pts, uc0, p, H0);
  const int first = g.point.off[p], n = g.point.count(p);
  const double* dS = &g.dS[static_cast<size_t>(first) * D];
  for (int k = 0; k < pair_count(n) * D * D; ++k) ke[k] = 0.0;
  if (pts.broken[p] < 0) {
    work.resize(static_cast<size_t>(n) * D);
    ip_stress<D>(law[pts.body[p]], mode, H0, H1, Fb, S);
    ip_tangent<D, 0>(dS, n, pts.V0[p], law[pts.body[p]], mode, Fb, S, work.data(), ke);
    return;
  }
  constexpr int nv = VoigtPlace<D>::nv;
  double C[nv * nv];
  work.resize(static_cast<size_t>(2 * n) * nv * D);
  ip_broken<D>(law[pts.body[p]], broken_law(m, pts, p), mode, H0, H1, Fb, S, C);
  ip_tangent_general<D, 0>(dS, n, pts.V0[p], C, mode.cG(), Fb, S, work.data(), work.data() + n * nv * D, ke);
}

}  // namespace

Status point_corner_force(const Model& m, const Points& pts, const std::vector<MatLaw>& law, const KernelMode& mode,
                          const RealVec& uc0, const RealVec& uc1, const IntVec& mine, RealVec& fc, int* worst)
{
  return m.dim == 2 ? corner_force<2>(m, pts, law, mode, uc0, uc1, mine, fc, worst)
                    : corner_force<3>(m, pts, law, mode, uc0, uc1, mine, fc, worst);
}

void point_tangent(const Model& m, const Points& pts, const std::vector<MatLaw>& law, const KernelMode& mode,
                   const RealVec& uc0, const RealVec& uc1, const ActiveGrid& g, int p, RealVec& work, double* ke)
{
  if (m.dim == 2)
    tangent<2>(m, pts, law, mode, uc0, uc1, g, p, work, ke);
  else
    tangent<3>(m, pts, law, mode, uc0, uc1, g, p, work, ke);
}

std::vector<MatLaw> point_laws(const Model& m)
{
  std::vector<MatLaw> law;
  for (const Body& b : m.body) law.push_back(mat_law(m.material[b.material], m.dim == 2 ? b.plane : PLANE_NONE));
  return law;
}

void point_ip_fields(const Model& m, const Points& pts, const RealVec& uc, int p, IpFields& out)
{
  const int dim = m.dim;
  out    = IpFields();
  out.V0 = pts.V0[p];
  for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k) {
    const int c = pts.conn.item[k];
    for (int i = 0; i < dim; ++i) {
      const double X = pts.Xc[c * dim + i], u = uc[c * dim + i];
      out.X[i] += pts.w[k] * X;
      out.x[i] += pts.w[k] * (X + u);
      for (int j = 0; j < dim; ++j) out.F[3 * i + j] += u * pts.G[k * dim + j];
    }
  }
  const Body& b    = m.body[pts.body[p]];
  const MatLaw law = mat_law(m.material[b.material], dim == 2 ? b.plane : PLANE_NONE);
  if (pts.broken[p] < 0) {
    ip_fields_from(law, dim, true, nullptr, out);
    return;
  }
  const ErodedLaw er = broken_law(m, pts, p);
  ip_fields_from(law, dim, true, &er, out);
}

double point_energy(const Model& m, const Points& pts, const RealVec& uc, const IntVec& mine)
{
  IpFields f;
  double sum = 0.0;
  for (int p : mine) {
    point_ip_fields(m, pts, uc, p, f);
    sum += f.psi * f.V0;
  }
  return sum;
}
