#include <Eigen/Dense>

#include "frac/frac.h"

namespace {

// a released point, which is elastic, is made anew above this stretch and below its inverse in volume,
// however small RELEASE is.  Test: verification/contact/g3_grains.inp
const double RENEW = 1.5;
// a released point is no smaller than this part of its natural size along each axis of its stretch, and once
// more when it is fitted between others.  Test: verification/contact/g4_box
const double LEAST_SIZE = 0.5;

// F of a point; 33 is 1 in the plane                                                          (3.5)
Eigen::Matrix3d gradient(const Points& pts, int dim, const RealVec& uc, int p)
{
  Eigen::Matrix3d F = Eigen::Matrix3d::Identity();
  for (int k = pts.conn.off[p]; k < pts.conn.off[p + 1]; ++k)
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j) F(i, j) += uc[pts.conn.item[k] * dim + i] * pts.G[k * dim + j];
  return F;
}

Eigen::Matrix3d rotation(const Eigen::Matrix3d& F)
{
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d U = svd.matrixU();
  // inside out: along the smallest stretch
  if ((U * svd.matrixV().transpose()).determinant() < 0.0) U.col(2) *= -1.0;
  return U * svd.matrixV().transpose();
}

// One domain as a rigid body: places and velocities of its corners, pairs of its consistent mass
struct RigidFragment {
  int n = 0;
  Eigen::Vector3d X[8], x[8], v[8];
  double m[8][8], mc[8], mass = 0.0;
};

// first pair of a point in Points::mc
size_t first_pair(const Points& pts, int p)
{
  size_t k = 0;
  for (int q = 0; q < p; ++q) k += pair_count(pts.conn.count(q));
  return k;
}

// the mean over the mass
Eigen::Vector3d mean(const RigidFragment& g, const Eigen::Vector3d* value)
{
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (int a = 0; a < g.n; ++a) sum += g.mc[a] * value[a];
  return sum / g.mass;
}

void read_fragment(const Points& pts, int dim, const Level& l, int p, const double* pairs, RigidFragment& g)
{
  g = RigidFragment();
  g.n = pts.conn.count(p);
  for (int a = 0; a < g.n; ++a) {
    const int c = pts.conn.begin(p)[a];
    g.X[a] = g.x[a] = g.v[a] = Eigen::Vector3d::Zero();
    g.mc[a] = 0.0;
    for (int i = 0; i < dim; ++i) {
      g.X[a][i] = pts.Xc[c * dim + i];
      g.x[a][i] = g.X[a][i] + l.uc[c * dim + i];
      g.v[a][i] = l.vc[c * dim + i];
    }
    for (int b = 0; b <= a; ++b) g.m[a][b] = g.m[b][a] = *pairs++;
  }
  for (int a = 0; a < g.n; ++a)
    for (int b = 0; b < g.n; ++b) g.mc[a] += g.m[a][b];
  for (int a = 0; a < g.n; ++a) g.mass += g.mc[a];
}

// the spin that has the angular momentum of the domain once its corners are at r from the centre, in the
// plane about axis 3; less when that would need more energy than the motion about the centre had
Eigen::Vector3d spin(const RigidFragment& g, int dim, const Eigen::Vector3d* r)
{
  const Eigen::Vector3d x = mean(g, g.x), v = mean(g, g.v);
  Eigen::Vector3d L = Eigen::Vector3d::Zero();
  Eigen::Matrix3d I = Eigen::Matrix3d::Zero();
  double had = 0.0;            // energy of the motion about the centre
  for (int a = 0; a < g.n; ++a)
    for (int b = 0; b < g.n; ++b) {
      L += g.m[a][b] * (g.x[a] - x).cross(g.v[b] - v);
      had += 0.5 * g.m[a][b] * (g.v[a] - v).dot(g.v[b] - v);
      I += g.m[a][b] * (r[a].dot(r[b]) * Eigen::Matrix3d::Identity() - r[a] * r[b].transpose());
    }
  const Eigen::Vector3d omega = dim == 2 ? Eigen::Vector3d(0.0, 0.0, L[2] / I(2, 2))
                                         : Eigen::Vector3d(I.ldlt().solve(L));
  const double needs = 0.5 * omega.dot(L);
  return needs > had ? Eigen::Vector3d(std::sqrt(had / needs) * omega) : omega;
}

// the stretch of F along its axes, none above 1
Eigen::Matrix3d squeezed(const Eigen::Matrix3d& F)
{
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d stretch = svd.singularValues();
  for (int i = 0; i < 3; ++i) stretch[i] = std::min(1.0, std::max(LEAST_SIZE, stretch[i]));
  return svd.matrixV() * stretch.asDiagonal() * svd.matrixV().transpose();
}

// the maps from the shapes of t = 0 to those that points are released with, which have room        (7.34)
void fitted(const Model& m, const IntVec& fresh, const State& st, std::vector<Eigen::Matrix3d>& map)
{
  std::vector<GrainShape> grain;
  map.clear();
  for (int p : fresh) {
    RigidFragment g;
    read_fragment(st.points, m.dim, st.n, p, &st.points.mc[first_pair(st.points, p)], g);
    const Eigen::Matrix3d F = gradient(st.points, m.dim, st.n.uc, p), U = squeezed(F), R = rotation(F);
    const Eigen::Vector3d X = mean(g, g.X), x = mean(g, g.x);
    GrainShape shape;
    shape.point = p;
    for (int i = 0; i < 3; ++i) shape.centre[i] = x[i];
    for (int a = 0; a < g.n; ++a) {
      const Eigen::Vector3d y = x + R * U * (g.X[a] - X);
      for (int i = 0; i < 3; ++i) shape.corner[a][i] = y[i];
    }
    grain.push_back(shape);
    map.push_back(U);
  }
  frac_room(m, st, LEAST_SIZE, grain);
  for (size_t i = 0; i < grain.size(); ++i) map[i] *= grain[i].scale;
}

// the shape of a point without stress is mapped, about its centre, by A
void reshape(const Eigen::Matrix3d& A, int dim, int p, Points& pts, RigidFragment& g)
{
  const Eigen::Vector3d X = mean(g, g.X);
  const Eigen::Matrix3d B = A.inverse().transpose();
  for (int a = 0; a < g.n; ++a) {
    const int k = pts.conn.off[p] + a;
    Eigen::Vector3d G = Eigen::Vector3d::Zero();
    for (int i = 0; i < dim; ++i) G[i] = pts.G[k * dim + i];
    g.X[a] = X + A * (g.X[a] - X);
    G = B * G;
    for (int i = 0; i < dim; ++i) {
      pts.Xc[pts.conn.item[k] * dim + i] = g.X[a][i];
      pts.G[k * dim + i] = G[i];
    }
  }
}

// the shape without stress, turned, and a rigid motion (7.13); map: to the shape without stress from now on,
// null: as it was
void restore(int dim, int p, const Eigen::Matrix3d* map, Points& pts, Level& l)
{
  RigidFragment g;
  read_fragment(pts, dim, l, p, &pts.mc[first_pair(pts, p)], g);
  const Eigen::Matrix3d R = rotation(gradient(pts, dim, l.uc, p));
  if (map) reshape(*map, dim, p, pts, g);
  const Eigen::Vector3d X = mean(g, g.X), x = mean(g, g.x), v = mean(g, g.v);
  Eigen::Vector3d r[8];
  for (int a = 0; a < g.n; ++a) r[a] = R * (g.X[a] - X);
  const Eigen::Vector3d omega = spin(g, dim, r);
  for (int a = 0; a < g.n; ++a) {
    const int c = pts.conn.begin(p)[a];
    const Eigen::Vector3d u = x + r[a] - g.X[a], vc = v + omega.cross(r[a]);
    for (int i = 0; i < dim; ++i) {
      l.uc[c * dim + i] = u[i];
      l.vc[c * dim + i] = vc[i];
    }
  }
}

// displacements and velocities of the corners that points have got for their own
void copy_corners(const IntVec& fresh, const IntVec& source, const Points& pts, int dim, Level& l)
{
  int k = 0;
  for (int p : fresh)
    for (int a = 0; a < pts.conn.count(p); ++a, ++k)
      for (int i = 0; i < dim; ++i) {
        l.uc.push_back(l.uc[source[k] * dim + i]);
        l.vc.push_back(l.vc[source[k] * dim + i]);
      }
}

// a shape that is made anew has no plastic deformation; what is dissipated stays
void forget_flow(const Points& pts, int p, RealVec& hp)
{
  const size_t n = hp.size() / static_cast<size_t>(pts.npoint);
  if (n > HISTORY_EQUIVALENT) std::fill_n(&hp[p * n], HISTORY_EQUIVALENT, 0.0);
}

}  // namespace

void frac_torn(const Model& m, const FracMesh& fm, const Points& pts, const Level& l, IntVec& out)
{
  out.clear();
  for (int p = 0; p < pts.npoint; ++p) {
    if (pts.broken[p] < 0 || pts.parent[p] < 0 || fm.conv[pts.parent[p]] < 0) continue;
    const double release = m.conversion[fm.conv[pts.parent[p]]].release,
                 limit   = pts.released[p] ? std::max(release, RENEW) : release;
    if (release == 0.0) continue;
    const Eigen::Matrix3d F = gradient(pts, m.dim, l.uc, p);
    const double most = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(F.transpose() * F,
                                                                       Eigen::EigenvaluesOnly)
                            .eigenvalues()[2];
    if (most > limit * limit || F.determinant() < 1.0 / limit) out.push_back(p);
  }
}

void frac_release(const Model& m, const FracMesh& fm, const IntVec& torn, CornerShare& share, State& st)
{
  Points& pts = st.points;
  IntVec fresh, source;
  for (int p : torn) {
    if (pts.released[p]) continue;
    fresh.push_back(p);
    source.insert(source.end(), pts.conn.begin(p), pts.conn.begin(p) + pts.conn.count(p));
    st.frac.released.push_back(p);
    st.frac.released_at.push_back(static_cast<int>(st.frac.converted.size()));
  }
  st.frac.renewed += static_cast<int>(torn.size() - fresh.size());
  std::vector<Eigen::Matrix3d> map;
  if (model_general_contact(m) >= 0) fitted(m, fresh, st, map);
  point_release(fresh, m.dim, share, pts);
  copy_corners(fresh, source, pts, m.dim, st.n);
  size_t k = 0;
  for (int p : torn) {
    const bool first = k < fresh.size() && fresh[k] == p;
    restore(m.dim, p, first && !map.empty() ? &map[k] : nullptr, pts, st.n);
    forget_flow(pts, p, st.n.hp);
    k += first;
  }
  frac_interfaces(m, fm, st);
}

bool frac_repeat(const Model& m, const FracMesh& fm, const Fracture& fr, Points& start, CornerShare& share)
{
  share    = CornerShare();
  size_t r = 0;
  for (size_t k = 0; k <= fr.converted.size(); ++k) {
    IntVec fresh;
    for (; r < fr.released.size() && fr.released_at[r] == static_cast<int>(k); ++r)
      fresh.push_back(fr.released[r]);
    for (int p : fresh)
      if (p >= start.npoint || start.parent[p] < 0 || start.of_elem.empty() ||
          start.of_elem[start.parent[p]] < 0)
        return false;
    point_release(fresh, m.dim, share, start);
    if (k == fr.converted.size()) break;
    const int e = fr.converted[k];
    if (fm.conv[e] < 0) return false;
    point_convert(m, m.conversion[fm.conv[e]].body[m.mesh.elem_section[e]], e, share, start);
  }
  return true;
}

bool frac_replay(const Model& m, const FracMesh& fm, const State& st, Points start, CornerShare& share)
{
  if (!frac_repeat(m, fm, st.frac, start, share)) return false;
  const Points& pts = st.points;
  if (start.Xc.size() != pts.Xc.size()) return false;
  for (int c = 0; c < pts.ncorner; ++c)                // released points have shapes of their own   (7.34)
    for (int i = 0; i < m.dim && pts.field[c] != FIELD_OWN; ++i)
      if (start.Xc[c * m.dim + i] != pts.Xc[c * m.dim + i]) return false;
  return start.shape == pts.shape && start.conn.off == pts.conn.off &&
         start.conn.item == pts.conn.item && start.body == pts.body && start.of_elem == pts.of_elem &&
         start.parent == pts.parent && start.twin == pts.twin;
}
