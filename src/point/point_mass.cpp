#include "point/point.h"

void point_add_mass(const Points& pts, int first, size_t at, RealVec& mass)
{
  const double* m = pts.mc.data() + at;
  for (int p = first; p < pts.npoint; ++p) {
    const int *corner = pts.conn.begin(p), nen = pts.conn.count(p);
    for (int a = 0; a < nen; ++a)
      for (int b = 0; b <= a; ++b, ++m) {
        mass[corner[a]] += *m;
        if (a != b) mass[corner[b]] += *m;
      }
  }
}

namespace {

// q += m v of a domain; NEN = 0: n corners
template <int D, int NEN>
inline void add_momentum(int n, const int* corner, const double* m, const double* vc, double* q)
{
  const int nen = NEN ? NEN : n;
  double v[8 * D], out[8 * D] = {};
  for (int a = 0; a < nen; ++a)
    for (int i = 0; i < D; ++i) v[a * D + i] = vc[corner[a] * D + i];
  for (int a = 0; a < nen; ++a)
    for (int b = 0; b <= a; ++b, ++m)
      for (int i = 0; i < D; ++i) {
        out[a * D + i] += *m * v[b * D + i];
        if (a != b) out[b * D + i] += *m * v[a * D + i];
      }
  for (int a = 0; a < nen; ++a)
    for (int i = 0; i < D; ++i) q[corner[a] * D + i] += out[a * D + i];
}

template <int D>
void corner_momentum(const Points& pts, const RealVec& vc, const IntVec& list, RealVec& q)
{
  const double* m = pts.mc.data();
  int at = 0;                  // point that m stands at
  for (int p : list) {
    for (; at < p; ++at) m += pair_count(pts.conn.count(at));
    ++at;
    const int *corner = pts.conn.begin(p), nen = pts.conn.count(p);
    if (nen == 4) add_momentum<D, 4>(nen, corner, m, vc.data(), q.data());
    else if (nen == 8) add_momentum<D, 8>(nen, corner, m, vc.data(), q.data());
    else add_momentum<D, 0>(nen, corner, m, vc.data(), q.data());
    m += nen * (nen + 1) / 2;
  }
}

}  // namespace

RealVec point_corner_momentum(const Points& pts, int dim, const RealVec& vc, const IntVec& list)
{
  RealVec q(vc.size(), 0.0);
  if (dim == 2) corner_momentum<2>(pts, vc, list, q);
  else corner_momentum<3>(pts, vc, list, q);
  return q;
}

void point_velocities(const Points& pts, int dim, const RealVec& vc, RealVec& vp)
{
  vp.assign(static_cast<size_t>(pts.npoint) * dim, 0.0);
  for (int p = 0; p < pts.npoint; ++p)
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k)
      for (int i = 0; i < dim; ++i) vp[p * dim + i] += pts.w[k] * vc[pts.conn.item[k] * dim + i];
}
