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

ErodedLaw broken_law(const Model& m, const Points& pts, int p, double c)
{
  return eroded_law(m, pts.broken[p], c, &pts.normal[3 * static_cast<size_t>(p)]);
}

// calls pack(points, n) for n <= PACK intact points of one body and number of corners, repeated to PACK, and
// one(p) for broken ones
template <class UsePack, class UseOne>
void by_packs(const Points& pts, const IntVec& owned, UsePack pack, UseOne one)
{
  int point[PACK], n = 0;
  const auto flush = [&]() {
    if (n == 0) return;
    for (int l = n; l < PACK; ++l) point[l] = point[0];
    pack(point, n);
    n = 0;
  };
  for (int p : owned) {
    if (pts.broken[p] >= 0) {
      one(p);
      continue;
    }
    if (n && (pts.body[p] != pts.body[point[0]] || pts.conn.count(p) != pts.conn.count(point[0]))) flush();
    point[n++] = p;
    if (n == PACK) flush();
  }
  flush();
}

// gradients G [nen*D] and volumes of PACK points
template <int D>
void load_points(const Points& pts, const int* point, int nen, Pack* G, Pack& V0)
{
  for (int l = 0; l < PACK; ++l) {
    const double* from = &pts.G[static_cast<size_t>(pts.conn.off[point[l]]) * D];
    for (int k = 0; k < nen * D; ++k) G[k][l] = from[k];
    V0[l] = pts.V0[point[l]];
  }
}

// displacements u [nen*D] of their corners
template <int D>
void load_ends(const Points& pts, const int* point, int nen, const RealVec& uc, Pack* u)
{
  for (int l = 0; l < PACK; ++l) {
    const int* corner = pts.conn.begin(point[l]);
    for (int a = 0; a < nen; ++a)
      for (int i = 0; i < D; ++i) u[a * D + i][l] = uc[corner[a] * D + i];
  }
}

template <int D>
void add_corner_force(const Points& pts, int p, const double* re, int stride, RealVec& fc)
{
  const int* corner = pts.conn.begin(p);
  for (int a = 0; a < pts.conn.count(p); ++a)
    for (int i = 0; i < D; ++i) fc[corner[a] * D + i] += re[(a * D + i) * stride];
}

template <int D>
Status corner_force(const Model& m, const Points& pts, const std::vector<MatLaw>& law, const KernelMode& mode,
                    const Level& l0, const Level& l1, const IntVec& owned, RealVec& fc, int* worst)
{
  Status status = STATUS_OK;
  by_packs(pts, owned, [&](const int* point, int n) {
    const int nen = pts.conn.count(point[0]);
    Pack G[8 * D], V0, u[8 * D], H0[D * D] = {}, H1[D * D], Fb[D * D], S[D * D], re[8 * D] = {};
    load_points<D>(pts, point, nen, G, V0);
    load_ends<D>(pts, point, nen, l1.uc, u);
    ip_gradient<D, 0>(G, nen, u, H1);
    if (mode_reads_old(mode, law[pts.body[point[0]]])) {
      load_ends<D>(pts, point, nen, l0.uc, u);
      ip_gradient<D, 0>(G, nen, u, H0);
    }
    const Pack det = ip_stress<D>(law[pts.body[point[0]]], mode, H0, H1, Fb, S);
    ip_force<D, 0>(G, nen, V0, Fb, S, re);
    for (int l = 0; l < n; ++l) {
      if (!(det[l] > 0.0)) {
        *worst = point[l];
        status = BAD_JACOBIAN;
      }
      add_corner_force<D>(pts, point[l], reinterpret_cast<const double*>(re) + l, PACK, fc);
    }
  }, [&](int p) {
    double H0[D * D] = {0}, H1[D * D], Fb[D * D], S[D * D], re[8 * D] = {0};
    gradient<D>(pts, l1.uc, p, H1);
    if (mode.mid) gradient<D>(pts, l0.uc, p, H0);
    const double c = degr_of_step(l0, l1, mode.mid, pts.parent[p]);
    ip_broken<D>(law[pts.body[p]], broken_law(m, pts, p, c), mode, H0, H1, Fb, S, nullptr);
    ip_force<D, 0>(&pts.G[static_cast<size_t>(pts.conn.off[p]) * D], pts.conn.count(p), pts.V0[p], Fb, S, re);
    add_corner_force<D>(pts, p, re, 1, fc);
  });
  return status;
}

template <int D>
void tangent_pack(const Points& pts, const std::vector<MatLaw>& law, const KernelMode& mode,
                  const RealVec& uc0, const RealVec& uc1, const ActiveGrid& g, const int* point, double* ke)
{
  const int n = g.point.count(point[0]);
  const MatLaw& of_body = law[pts.body[point[0]]];
  const bool old        = mode_reads_old(mode, of_body);
  Pack dS[POINT_PACK_NODES * D], f[POINT_PACK_NODES * D], V0, H0[D * D] = {}, H1[D * D], Fb[D * D], S[D * D];
  for (int l = 0; l < PACK; ++l) {
    const double* from = &g.dS[static_cast<size_t>(g.point.off[point[l]]) * D];
    double H[D * D];
    for (int k = 0; k < n * D; ++k) dS[k][l] = from[k];
    gradient<D>(pts, uc1, point[l], H);
    for (int k = 0; k < D * D; ++k) H1[k][l] = H[k];
    if (old) gradient<D>(pts, uc0, point[l], H);
    for (int k = 0; k < D * D && old; ++k) H0[k][l] = H[k];
    V0[l] = pts.V0[point[l]];
  }
  Pack* k = reinterpret_cast<Pack*>(ke);
  for (int i = 0; i < pair_count(n) * D * D; ++i) k[i] = Pack{};
  ip_stress<D>(of_body, mode, H0, H1, Fb, S);
  ip_tangent<D, 0>(dS, n, V0, of_body, mode, Fb, S, f, k);
}

template <int D>
double energy(const Model& m, const Points& pts, const Level& l, const IntVec& owned)
{
  const std::vector<MatLaw> law = point_laws(m);
  double sum = 0.0;
  by_packs(pts, owned, [&](const int* point, int n) {
    const int nen = pts.conn.count(point[0]);
    Pack G[8 * D], V0, u[8 * D], H[D * D], E[D * D], S[D * D], psi = {};
    load_points<D>(pts, point, nen, G, V0);
    load_ends<D>(pts, point, nen, l.uc, u);
    ip_gradient<D, 0>(G, nen, u, H);
    ip_strain<D>(true, H, E);
    ip_law<D>(law[pts.body[point[0]]], E, S);
    for (int k = 0; k < D * D; ++k) psi += 0.5 * S[k] * E[k];
    psi *= V0;
    for (int k = 0; k < n; ++k) sum += psi[k];
  }, [&](int p) {
    sum += point_energy_one(m, pts, l, p, l.degr[pts.parent[p]]);
  });
  return sum;
}

template <int D>
void tangent(const Model& m, const Points& pts, const std::vector<MatLaw>& law, const KernelMode& mode,
             const Level& l0, const Level& l1, const ActiveGrid& g, int p, RealVec& work, double* ke)
{
  double H0[D * D] = {0}, H1[D * D], Fb[D * D], S[D * D];
  gradient<D>(pts, l1.uc, p, H1);
  if (mode_reads_old(mode, law[pts.body[p]])) gradient<D>(pts, l0.uc, p, H0);
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
  const double c = degr_of_step(l0, l1, mode.mid, pts.parent[p]);
  ip_broken<D>(law[pts.body[p]], broken_law(m, pts, p, c), mode, H0, H1, Fb, S, C);
  ip_tangent_general<D, 0>(dS, n, pts.V0[p], C, mode.cG(), Fb, S, work.data(), work.data() + n * nv * D, ke);
}

}  // namespace

Status point_corner_force(const Model& m, const Points& pts, const std::vector<MatLaw>& law,
                          const KernelMode& mode, const Level& l0, const Level& l1, const IntVec& owned,
                          RealVec& fc, int* worst)
{
  return m.dim == 2 ? corner_force<2>(m, pts, law, mode, l0, l1, owned, fc, worst)
                    : corner_force<3>(m, pts, law, mode, l0, l1, owned, fc, worst);
}

void point_tangent(const Model& m, const Points& pts, const std::vector<MatLaw>& law, const KernelMode& mode,
                   const Level& l0, const Level& l1, const ActiveGrid& g, int p, RealVec& work, double* ke)
{
  if (m.dim == 2)
    tangent<2>(m, pts, law, mode, l0, l1, g, p, work, ke);
  else
    tangent<3>(m, pts, law, mode, l0, l1, g, p, work, ke);
}

void point_tangent_pack(int dim, const Points& pts, const std::vector<MatLaw>& law, const KernelMode& mode,
                        const RealVec& uc0, const RealVec& uc1, const ActiveGrid& g, const int* point,
                        double* ke)
{
  if (dim == 2) tangent_pack<2>(pts, law, mode, uc0, uc1, g, point, ke);
  else tangent_pack<3>(pts, law, mode, uc0, uc1, g, point, ke);
}

namespace {

template <int D>
double viscous_loss(const Points& pts, const std::vector<MatLaw>& law, const Level& l0, const Level& l1,
                    const IntVec& owned)
{
  double sum = 0.0, H[D * D], E0[D * D], dE[D * D], S[D * D];
  for (int p : owned) {
    const MatLaw& of_body = law[pts.body[p]];
    if (of_body.beta == 0.0 || pts.broken[p] >= 0) continue;
    gradient<D>(pts, l0.uc, p, H);
    ip_strain<D>(true, H, E0);
    gradient<D>(pts, l1.uc, p, H);
    ip_strain<D>(true, H, dE);
    for (int k = 0; k < D * D; ++k) dE[k] -= E0[k];
    ip_law<D>(of_body, dE, S);
    for (int k = 0; k < D * D; ++k) sum += of_body.beta * pts.V0[p] * S[k] * dE[k];
  }
  return sum;
}

}  // namespace

double point_viscous_loss(const Points& pts, int dim, const std::vector<MatLaw>& law, const Level& l0,
                          const Level& l1, const IntVec& owned)
{
  return dim == 2 ? viscous_loss<2>(pts, law, l0, l1, owned) : viscous_loss<3>(pts, law, l0, l1, owned);
}

std::vector<MatLaw> point_laws(const Model& m)
{
  std::vector<MatLaw> law;
  for (const Body& b : m.body)
    law.push_back(mat_law(m.material[b.material], m.dim == 2 ? b.plane : PLANE_NONE));
  return law;
}

namespace {

// place, displacement gradient and volume of a point; uc [ncorner*dim]
void point_motion(const Points& pts, int dim, const RealVec& uc, int p, IpFields& out)
{
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
}

// c: degradation factor of a broken point
void point_fields(const Model& m, const Points& pts, const RealVec& uc, int p, double c, IpFields& out)
{
  const Body& b    = m.body[pts.body[p]];
  const MatLaw law = mat_law(m.material[b.material], m.dim == 2 ? b.plane : PLANE_NONE);
  point_motion(pts, m.dim, uc, p, out);
  if (pts.broken[p] < 0) {
    ip_fields_from(law, m.dim, true, nullptr, out);
    return;
  }
  const ErodedLaw er = broken_law(m, pts, p, c);
  ip_fields_from(law, m.dim, true, &er, out);
}

}  // namespace

void point_ip_fields(const Model& m, const Points& pts, const Level& l, int p, IpFields& out)
{
  point_fields(m, pts, l.uc, p, pts.broken[p] < 0 ? 1.0 : l.degr[pts.parent[p]], out);
}

double point_energy_one(const Model& m, const Points& pts, const Level& l, int p, double c)
{
  IpFields f;
  point_fields(m, pts, l.uc, p, c, f);
  return f.psi * f.V0;
}

double point_energy(const Model& m, const Points& pts, const Level& l, const IntVec& owned)
{
  return m.dim == 2 ? energy<2>(m, pts, l, owned) : energy<3>(m, pts, l, owned);
}
