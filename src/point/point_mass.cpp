#include "point/point.h"

RealVec point_corner_mass(const Points& pts, int first)
{
  RealVec out(pts.ncorner, 0.0);
  const double* m = pts.mc.data();
  for (int p = 0; p < pts.npoint; ++p) {
    const int *corner = pts.conn.begin(p), nen = pts.conn.count(p);
    if (p < first) {
      m += pair_count(nen);
      continue;
    }
    for (int a = 0; a < nen; ++a)
      for (int b = 0; b <= a; ++b, ++m) {
        out[corner[a]] += *m;
        if (a != b) out[corner[b]] += *m;
      }
  }
  return out;
}

RealVec point_corner_momentum(const Points& pts, int dim, const RealVec& vc)
{
  RealVec q(vc.size(), 0.0);
  const double* m = pts.mc.data();
  for (int p = 0; p < pts.npoint; ++p) {
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
