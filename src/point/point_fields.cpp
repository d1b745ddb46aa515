#include <algorithm>
#include <cmath>

#include "elem/kernel_general.h"
#include "point/point_law.h"

namespace {

// position, displacement gradient and volume of a point; uc [ncorner*dim]
void point_motion(const Points& pts, int dim, const RealVec& uc, int p, IpFields& out)
{
  out    = IpFields();
  out.V0 = pts.V0[p];
  const double *w = pts.w(p), *G = pts.G(p);
  for (int a = 0; a < pts.conn.count(p); ++a) {
    const int c = pts.conn.begin(p)[a];
    for (int i = 0; i < dim; ++i) {
      const double X = pts.Xc[c * dim + i], u = uc[c * dim + i];
      out.X[i] += w[a] * X;
      out.x[i] += w[a] * (X + u);
      for (int j = 0; j < dim; ++j) out.F[3 * i + j] += u * G[a * dim + j];
    }
  }
}

// strain [6] for the law of a point, and the scale of its F                             (1.14)
template <int D>
void general_strain(const Points& pts, const MatLaw& law, const RealVec& uc, int p, double* E, double* scale)
{
  double own[D * D];
  point_dudX<D>(pts, uc, p, own);
  if (!law.bar) {
    double plane[D * D];
    ip_strain<D>(true, own, plane);
    six_components<D>(plane, E);
    *scale = 1.0;
    return;
  }
  RealVec H(own, own + D * D), V0{pts.V0[p]};
  for (int q = pts.next[p]; q != p; q = pts.next[q]) {
    if (pts.broken[q] >= 0 || pts.released[q]) continue;
    H.resize(H.size() + D * D);
    point_dudX<D>(pts, uc, q, &H[H.size() - D * D]);
    V0.push_back(pts.V0[q]);
  }
  RealVec all(6 * V0.size()), scales(V0.size(), 1.0);
  const BarGroup g{D, static_cast<int>(V0.size()), 0, nullptr, V0.data(), &law};
  if (!bar_strains(g, true, H.data(), all.data(), scales.data())) all.assign(all.size(), std::nan(""));
  std::copy_n(all.data(), 6, E);
  *scale = scales[0];
}

template <int D>
double viscous_loss(const Points& pts, const PointLaws& law, const Level& l0, const Level& l1,
                    const IntVec& owned)
{
  double sum = 0.0, dE[6], E0[6], scale;
  for (int p : owned) {
    const MatLaw& of_body = law.body[pts.body[p]];
    if (of_body.beta == 0.0 || pts.eroded(p)) continue;
    general_strain<D>(pts, of_body, l0.uc, p, E0, &scale);
    general_strain<D>(pts, of_body, l1.uc, p, dE, &scale);
    for (int k = 0; k < 6; ++k) dE[k] -= E0[k];
    sum += of_body.beta * pts.V0[p] * law_viscous_work(of_body, dE);
  }
  return sum;
}

// law of a point at the end of an increment, with its strain [6] and the scale of F
//   in   c   degradation factor of a broken point
MatLaw law_at_end(const Model& m, const Points& pts, const MatLaw& law, const Level& l, int p, double c,
                  double* E, double* scale)
{
  const MatLaw now = point_law_now(m, pts, law, l, CRACK_TANGENT, p, c);      // with the width of l
  if (m.dim == 2) general_strain<2>(pts, now, l.uc, p, E, scale);
  else general_strain<3>(pts, now, l.uc, p, E, scale);
  return now;
}

// energy of the penalty that ties the changes of volume of a point and its group              (1.14)
double deviation_energy(const MatLaw& law, double scale)
{
  const double deviation = scale == 1.0 ? 0.0 : 3.0 * std::log(scale);       // thetabar - theta
  return 0.5 * point_volume_penalty(law) * deviation * deviation;
}

// c: degradation factor of a broken point
void point_fields(const Model& m, const Points& pts, const Level& l, int p, double c, IpFields& out)
{
  const MatLaw law = point_law_of(m, m.body[pts.body[p]]);
  point_motion(pts, m.dim, l.uc, p, out);
  if (!pts.eroded(p) && !law_is_general(law)) {
    ip_fields_from(law, m.dim, true, out);
    return;
  }
  double E[6], scale;
  const MatLaw now = law_at_end(m, pts, law, l, p, c, E, &scale);
  ip_general_from(now, true, E, scale, history_at(l.hp, point_history_size(pts, l), p), out);
  out.psi += deviation_energy(now, scale);
  if (law_opens(law.kind) && !pts.eroded(p))
    out.opening = crack_opening(law, history_at(l.hp, point_history_size(pts, l), p));
}

}  // namespace

void point_ip_fields(const Model& m, const Points& pts, const Level& l, int p, IpFields& out)
{
  point_fields(m, pts, l, p, !pts.eroded(p) ? 1.0 : l.degr[pts.parent[p]], out);
}

// of a broken point or a general law the energy alone
double point_energy_one(const Model& m, const Points& pts, const Level& l, int p, double c)
{
  const MatLaw law = point_law_of(m, m.body[pts.body[p]]);
  if (!pts.eroded(p) && !law_is_general(law)) {
    IpFields f;
    point_fields(m, pts, l, p, c, f);
    return f.psi * f.V0;
  }
  double E[6], scale, none[MAX_HISTORY];
  LawOutput out;
  const MatLaw now = law_at_end(m, pts, law, l, p, c, E, &scale);
  if (!law_update(now, true, E, history_at(l.hp, point_history_size(pts, l), p), none, false, out))
    return std::nan("");
  return (out.psi + deviation_energy(now, scale)) * pts.V0[p];
}

double point_viscous_loss(const Points& pts, int dim, const PointLaws& law, const Level& l0, const Level& l1,
                          const IntVec& owned)
{
  return dim == 2 ? viscous_loss<2>(pts, law, l0, l1, owned) : viscous_loss<3>(pts, law, l0, l1, owned);
}

MatLaw broken_law(const Model& m, const Points& pts, int p)
{
  const MatLaw intact = mat_law(point_material(m, pts, p), m.body[pts.body[p]].plane);
  return law_broken(intact, m.fracture[pts.broken[p]], 0.0, &pts.normal[3 * static_cast<size_t>(p)]);
}

void point_dissipated(const Model& m, const Points& pts, const Level& l, const IntVec& owned, double& plastic,
                      double& cohesive)
{
  const size_t history = point_history_size(pts, l);
  if (history == 0) return;
  for (int p : owned) {
    const bool broken = pts.eroded(p) && m.fracture[pts.broken[p]].criterion == CRITERION_COHESIVE,
               opened = broken || m.body[pts.body[p]].fracture >= 0;
    const double* h = history_at(l.hp, history, p);
    double flowed   = 0.0;
    if (opened && law_flows(point_material(m, pts, p).law)) {
      const MatLaw law = broken ? broken_law(m, pts, p) : point_law_of(m, m.body[pts.body[p]]);
      flowed = h[law_field(law_of(law), HISTORY_FLOW_WORK)];
    }
    (opened ? cohesive : plastic) += pts.V0[p] * (h[HISTORY_DISSIPATED] - flowed);
    plastic += pts.V0[p] * flowed;
  }
}
