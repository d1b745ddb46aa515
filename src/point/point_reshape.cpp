// ---------------------------------------------------------------------------
// point_reshape.cpp : domains that flow has stretched get their first shape again       (doc/theory.md 3.8)
// ---------------------------------------------------------------------------
#include <algorithm>
#include <cmath>

#include "mat/voigt.h"
#include "point/point_body.h"

namespace {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

bool too_stretched(const Mat3& F, double limit)
{
  const Eigen::SelfAdjointEigenSolver<Mat3> C(F.transpose() * F, Eigen::EigenvaluesOnly);
  const double square = limit * limit;
  return C.eigenvalues()(2) > square || C.eigenvalues()(0) < 1.0 / square || F.determinant() <= 0.0;
}

// the points that share their change of volume lose it: plastic deformation such that each keeps its elastic
// strain without the others                                                                      (1.14)
void part_group(int dim, int p, Points& pts, const RealVec& uc, int field, size_t history, RealVec& hp)
{
  double sum = 0.0, volume = 0.0;
  IntVec group;
  RealVec theta;
  int q = p;
  do {
    group.push_back(q);
    theta.push_back(std::log(std::max(point_gradient(pts, dim, uc, q).determinant(), 1e-300)));
    sum += pts.V0[q] * theta.back();
    volume += pts.V0[q];
    q = pts.next[q];
  } while (q != p);
  for (size_t k = 0; k < group.size() && group.size() > 1; ++k) {
    double* flow       = &hp[static_cast<size_t>(group[k]) * history + field];
    const double scale = std::exp(2.0 / 3.0 * (sum / volume - theta[k]));
    for (int i = 0; i < 6; ++i) flow[i] = scale * flow[i] + (i < 3 ? scale - 1.0 : 0.0);
    pts.next[group[k]] = group[k];
  }
}

// Cp^-1 - I such that the stretch U has the elastic strain of F before: F Cp^-1 F^T
void keep_elastic(const Mat3& before, const Vec3& U, double* flow)
{
  const Mat3 F  = U.cwiseInverse().asDiagonal() * before;
  const Mat3 be = F * (full_tensor(flow) + Mat3::Identity()) * F.transpose() - Mat3::Identity();
  using V = VoigtIndex<3>;
  for (int i = 0; i < 6; ++i) flow[i] = be(V::row[i], V::col[i]);
}

// the room of a domain at x along each axis: the grid, and the planes that *GRID BOUNDARY holds across
struct Room { Vec3 lo, hi; };

Room room_at(const Model& m, const Vec3& x)
{
  Room room{Vec3::Constant(-HUGE_VAL), Vec3::Constant(HUGE_VAL)};
  for (int i = 0; i < m.dim; ++i) {
    room.lo(i) = m.grid.lo[i];
    room.hi(i) = m.grid.lo[i] + m.grid.n[i] * m.grid.h[i];
  }
  for (const GridBc& b : m.grid_bc) {
    const int i = b.axis;
    if (b.first > i || b.last < i) continue;
    if (x(i) >= b.position) room.lo(i) = std::max(room.lo(i), b.position);
    else room.hi(i) = std::min(room.hi(i), b.position);
  }
  return room;
}

// fits a domain with corners at r from x into its room: stretches of at least least, and if that is not
// enough x moves
Vec3 fit(const Room& room, const Vec3* r, int n, int dim, double least, Vec3& x)
{
  Vec3 U = Vec3::Ones();
  for (int i = 0; i < dim; ++i) {
    double half = 0.0;
    for (int a = 0; a < n; ++a) half = std::max(half, std::fabs(r[a](i)));
    U(i) = std::clamp(std::min(x(i) - room.lo(i), room.hi(i) - x(i)) / half, least, 1.0);
    x(i) = std::clamp(x(i), room.lo(i) + U(i) * half, room.hi(i) - U(i) * half);
  }
  return U;
}

// relative to the inverse of RESHAPE: the least stretch that a plane of the grid leaves a domain  (no test)
const double FLAT = 1.05;

// the first shape about the centre, the mean velocity gradient, and the spin of before; no energy is gained.
// Returns its stretch, less than 1 at a plane of the grid
Vec3 restore(const Model& m, int p, const Points& pts, const Mat3& F, Level& l)
{
  const int dim      = m.dim;
  const DomainBody g = point_body(pts, dim, l, p);
  const Vec3 centre = body_mean(g, g.X), v = body_mean(g, g.v);
  Vec3 x = body_mean(g, g.x), now[8], had[8], X[8], r[8], w[8];
  for (int a = 0; a < g.n; ++a) {
    now[a] = g.x[a] - x;
    had[a] = g.v[a] - v;
    X[a]   = g.X[a] - centre;
  }
  const Vec3 U = fit(room_at(m, x), X, g.n, dim, FLAT / m.body[pts.body[p]].reshape, x);
  const Mat3 L = std::fabs(F.determinant()) > 1e-3
      ? Mat3(point_gradient(pts, dim, l.vc, p, Mat3::Zero()) * F.inverse()) : Mat3(Mat3::Zero());
  for (int a = 0; a < g.n; ++a) {
    r[a] = U.asDiagonal() * X[a];
    w[a] = L * r[a];
  }
  const Vec3 omega = body_spin(g, dim, r, body_momentum(g, now, had) - body_momentum(g, r, w));
  for (int a = 0; a < g.n; ++a) w[a] += omega.cross(r[a]);
  const double before = body_energy(g, had), needs = body_energy(g, w);
  const double part = needs > before ? std::sqrt(before / needs) : 1.0;
  for (int a = 0; a < g.n; ++a)
    for (int i = 0; i < dim; ++i) {
      const size_t c = static_cast<size_t>(pts.conn.begin(p)[a]) * dim + i;
      l.uc[c] = x(i) - centre(i) + (U(i) - 1.0) * X[a](i);
      l.vc[c] = v(i) + part * w[a](i);
    }
  return U;
}

}  // namespace

IntVec point_stretched(const Model& m, const Points& pts, const RealVec& uc)
{
  IntVec out;
  for (int p = 0; p < pts.npoint; ++p) {
    const double limit = m.body[pts.body[p]].reshape;
    if (limit > 0.0 && too_stretched(point_gradient(pts, m.dim, uc, p), limit)) out.push_back(p);
  }
  return out;
}

void point_reshape(const Model& m, const IntVec& which, Points& pts, Level& l)
{
  const size_t history = point_history_size(pts, l);
  for (int p : which) {
    const Body& b    = m.body[pts.body[p]];
    const MatLaw law = mat_law(m.material[b.material], m.dim == 2 ? b.plane : PLANE_NONE);
    const int field  = law_field(law_of(law), HISTORY_DEFORMATION);
    if (law.bar) part_group(m.dim, p, pts, l.uc, field, history, l.hp);
    const Mat3 F = point_gradient(pts, m.dim, l.uc, p);
    const Vec3 U = restore(m, p, pts, F, l);
    keep_elastic(F, U, &l.hp[static_cast<size_t>(p) * history + field]);
  }
}
