#include "point/point_body.h"

namespace {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

}  // namespace

Mat3 point_gradient(const Points& pts, int dim, const RealVec& value, int p, const Mat3& from)
{
  Mat3 F = from;
  const double* G = pts.G(p);
  for (int a = 0; a < pts.conn.count(p); ++a)
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j)
        F(i, j) += value[static_cast<size_t>(pts.conn.begin(p)[a]) * dim + i] * G[a * dim + j];
  return F;
}

DomainBody point_body(const Points& pts, int dim, const Level& l, int p)
{
  const double* pairs = pts.mc(p);
  DomainBody g;
  g.n = pts.conn.count(p);
  for (int a = 0; a < g.n; ++a) {
    const size_t c = static_cast<size_t>(pts.conn.begin(p)[a]) * dim;
    g.X[a] = g.x[a] = g.v[a] = Vec3::Zero();
    g.mc[a] = 0.0;
    for (int i = 0; i < dim; ++i) {
      g.X[a][i] = pts.Xc[c + i];
      g.x[a][i] = g.X[a][i] + l.uc[c + i];
      g.v[a][i] = l.vc[c + i];
    }
    for (int b = 0; b <= a; ++b) g.m[a][b] = g.m[b][a] = *pairs++;
  }
  for (int a = 0; a < g.n; ++a)
    for (int b = 0; b < g.n; ++b) g.mc[a] += g.m[a][b];
  for (int a = 0; a < g.n; ++a) g.mass += g.mc[a];
  return g;
}

Vec3 body_mean(const DomainBody& g, const Vec3* value)
{
  Vec3 sum = Vec3::Zero();
  for (int a = 0; a < g.n; ++a) sum += g.mc[a] * value[a];
  return sum / g.mass;
}

Vec3 body_momentum(const DomainBody& g, const Vec3* r, const Vec3* w)
{
  Vec3 L = Vec3::Zero();
  for (int a = 0; a < g.n; ++a)
    for (int b = 0; b < g.n; ++b) L += g.m[a][b] * r[a].cross(w[b]);
  return L;
}

double body_energy(const DomainBody& g, const Vec3* w)
{
  double sum = 0.0;
  for (int a = 0; a < g.n; ++a)
    for (int b = 0; b < g.n; ++b) sum += 0.5 * g.m[a][b] * w[a].dot(w[b]);
  return sum;
}

Vec3 body_spin(const DomainBody& g, int dim, const Vec3* r, const Vec3& L)
{
  Mat3 I = Mat3::Zero();
  for (int a = 0; a < g.n; ++a)
    for (int b = 0; b < g.n; ++b)
      I += g.m[a][b] * (r[a].dot(r[b]) * Mat3::Identity() - r[a] * r[b].transpose());
  return dim == 2 ? Vec3(0.0, 0.0, L[2] / I(2, 2)) : Vec3(I.ldlt().solve(L));
}
