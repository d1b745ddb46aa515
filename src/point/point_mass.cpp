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

RealVec point_corner_momentum(const Points& pts, int dim, const RealVec& vc, const IntVec& list)
{
  RealVec q(vc.size(), 0.0);
  const double* m = pts.mc.data();
  int at = 0;                  // point that m stands at
  for (int p : list) {
    for (; at < p; ++at) m += pair_count(pts.conn.count(at));
    ++at;
    const int *corner = pts.conn.begin(p), nen = pts.conn.count(p);
    for (int a = 0; a < nen; ++a)
      for (int b = 0; b <= a; ++b, ++m)
        for (int i = 0; i < dim; ++i) {
          q[corner[a] * dim + i] += *m * vc[corner[b] * dim + i];
          if (a != b) q[corner[b] * dim + i] += *m * vc[corner[a] * dim + i];
        }
  }
  return q;
}

void point_velocities(const Points& pts, int dim, const RealVec& vc, RealVec& vp)
{
  vp.assign(static_cast<size_t>(pts.npoint) * dim, 0.0);
  for (int p = 0; p < pts.npoint; ++p)
    for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k)
      for (int i = 0; i < dim; ++i) vp[p * dim + i] += pts.w[k] * vc[pts.conn.item[k] * dim + i];
}
