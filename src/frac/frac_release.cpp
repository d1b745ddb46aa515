#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "base/comm.h"
#include "frac/frac.h"
#include "point/point_body.h"

namespace {

// a released point, which is elastic, is reshaped above this stretch and below the inverse volume ratio, for
// any smaller RELEASE  (no test)
const double RESHAPE = 1.5;
// minimum size of a released point, as a fraction of its undeformed size along each axis of its stretch, and
// minimum scale when fitted between others  (test: contact/g4_box)
const double MIN_SIZE = 0.5;

Eigen::Matrix3d rotation(const Eigen::Matrix3d& F)
{
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Matrix3d U = svd.matrixU();
  // inverted: along the smallest stretch
  if ((U * svd.matrixV().transpose()).determinant() < 0.0) U.col(2) *= -1.0;
  return U * svd.matrixV().transpose();
}

// spin that conserves the angular momentum of the domain with corners at r from the centre; reduced if it
// needs more energy than the previous motion about the centre
Eigen::Vector3d spin(const DomainBody& g, int dim, const Eigen::Vector3d* r)
{
  const Eigen::Vector3d x = body_mean(g, g.x), v = body_mean(g, g.v);
  Eigen::Vector3d r0[8], w0[8];
  for (int a = 0; a < g.n; ++a) {
    r0[a] = g.x[a] - x;
    w0[a] = g.v[a] - v;
  }
  const Eigen::Vector3d L = body_momentum(g, r0, w0), omega = body_spin(g, dim, r, L);
  const double had = body_energy(g, w0), needs = 0.5 * omega.dot(L);
  return needs > had ? Eigen::Vector3d(std::sqrt(had / needs) * omega) : omega;
}

// the stretch of F, limited to MIN_SIZE ... 1 along its axes
Eigen::Matrix3d squeezed(const Eigen::Matrix3d& F)
{
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(F, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d stretch = svd.singularValues();
  for (int i = 0; i < 3; ++i) stretch[i] = std::min(1.0, std::max(MIN_SIZE, stretch[i]));
  return svd.matrixV() * stretch.asDiagonal() * svd.matrixV().transpose();
}

// Maps from the shapes of t = 0 to shapes of released points without overlap. The neighbourhood of a point is
// stored by the rank of its element.                                                               (7.34)
void fitted(const Model& m, const IntVec& fresh, const State& st, std::vector<Eigen::Matrix3d>& map)
{
  const Points& pts = st.points;
  std::vector<ReleasedShape> released;
  IntVec number;
  map.clear();
  for (int p : fresh) {
    const DomainBody g = point_body(pts, m.dim, st.n, p);
    const Eigen::Matrix3d F = point_gradient(pts, m.dim, st.n.uc, p), U = squeezed(F), R = rotation(F);
    const Eigen::Vector3d X = body_mean(g, g.X), x = body_mean(g, g.x);
    ReleasedShape shape;
    shape.number = pts.point_number(p);
    shape.shape  = static_cast<Shape>(pts.shape[p]);
    for (int i = 0; i < 3; ++i) shape.centre[i] = x[i];
    for (int a = 0; a < g.n; ++a) {
      const Eigen::Vector3d y = x + R * U * (g.X[a] - X);
      for (int i = 0; i < 3; ++i) shape.corner[a][i] = y[i];
    }
    number.push_back(shape.number);
    map.push_back(U);
    if (!m.part.window || m.part.works(pts.parent[p])) released.push_back(shape);
  }
  const auto before = [](const ReleasedShape& g, const ReleasedShape& h) { return g.number < h.number; };
  if (m.part.window) comm_allgatherv(released);
  std::sort(released.begin(), released.end(), before);
  frac_room(m, st, MIN_SIZE, released);
  for (size_t i = 0; i < number.size(); ++i) {
    ReleasedShape of;
    of.number = number[i];
    map[i] *= std::lower_bound(released.begin(), released.end(), of, before)->scale;
  }
}

// maps the undeformed shape of a point, about its centre, by A. The volume that carries stress is reduced, so
// that no frequency increases: compressed debris does not limit the explicit increment               (7.34)
void reshape(const Eigen::Matrix3d& A, int dim, int p, Points& pts, DomainBody& g)
{
  const Eigen::Vector3d X = body_mean(g, g.X);
  const Eigen::Matrix3d B = A.inverse().transpose();
  const double least = Eigen::JacobiSVD<Eigen::Matrix3d>(A).singularValues()[2];
  pts.V0[p] *= std::min(1.0, least * least);
  pts.kind[p] = domain_own(pts.kind[p], pts.kinds);
  double* G   = &pts.kinds.number[pts.kinds.first[pts.kind[p]]] + g.n;
  for (int a = 0; a < g.n; ++a) {
    Eigen::Vector3d G_a = Eigen::Vector3d::Zero();
    for (int i = 0; i < dim; ++i) G_a[i] = G[a * dim + i];
    g.X[a] = X + A * (g.X[a] - X);
    G_a = B * G_a;
    for (int i = 0; i < dim; ++i) {
      pts.Xc[pts.conn.begin(p)[a] * dim + i] = g.X[a][i];
      G[a * dim + i] = G_a[i];
    }
  }
}

// resets a point to the rotated undeformed shape and a rigid motion (7.13); map: to the new undeformed shape,
// null: unchanged
void restore(int dim, int p, const Eigen::Matrix3d* map, Points& pts, Level& l)
{
  DomainBody g = point_body(pts, dim, l, p);
  const Eigen::Matrix3d R = rotation(point_gradient(pts, dim, l.uc, p));
  if (map) reshape(*map, dim, p, pts, g);
  const Eigen::Vector3d X = body_mean(g, g.X), x = body_mean(g, g.x), v = body_mean(g, g.v);
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

// copies displacements and velocities of the corners left to the new corners of released points, from index
// first on
void copy_corners(const IntVec& left, size_t first, int dim, Level& l)
{
  for (size_t k = first; k < left.size(); ++k)
    for (int i = 0; i < dim; ++i) {
      l.uc.push_back(l.uc[left[k] * dim + i]);
      l.vc.push_back(l.vc[left[k] * dim + i]);
    }
}

// a reshaped point has neither plastic deformation nor initial strain; the dissipated energy is kept
void forget_flow(const Model& m, const Points& pts, int p, RealVec& hp)
{
  const size_t n   = hp.size() / static_cast<size_t>(pts.npoint);
  const MatLaw law = broken_law(m, pts, p);
  for (int field : {law_field(law_of(law), HISTORY_DEFORMATION), law.initial})
    if (n > 0 && field >= 0) std::fill_n(&hp[p * n + field], 6, 0.0);
}

// is the broken point p to be released or reshaped?
bool must_release(const Model& m, const FracMesh& fm, const Points& pts, const RealVec& uc, int p)
{
  const double release = m.conversion[fm.conv[pts.parent[p]]].release,
               limit   = pts.released[p] ? std::max(release, RESHAPE) : release;
  if (release == 0.0) return false;
  const Eigen::Matrix3d F = point_gradient(pts, m.dim, uc, p), C = F.transpose() * F;
  if (F.determinant() < 1.0 / limit) return true;
  // the largest eigenvalue is at most mean + 2 norm of the deviator / sqrt(6)
  const double mean = C.trace() / 3.0, beyond = (C - mean * Eigen::Matrix3d::Identity()).norm();
  if (mean + 2.0 / std::sqrt(6.0) * beyond < (1.0 - 1e-9) * limit * limit) return false;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> own(C, Eigen::EigenvaluesOnly);
  return own.eigenvalues()[2] > limit * limit;
}

// Released points on this rank, and their position in the list of all ranks
struct ReleasedPoints { IntVec point, turn; };

ReleasedPoints released_here(const IntVec& number, const Points& pts)
{
  ReleasedPoints here;
  const IntVec& own = pts.part.point;
  for (size_t k = 0; k < number.size(); ++k) {
    int p = number[k];
    if (pts.part.window) {
      const auto at = std::lower_bound(own.begin(), own.end(), p);
      if (at == own.end() || *at != p) continue;
      p = static_cast<int>(at - own.begin());
    }
    here.point.push_back(p);
    here.turn.push_back(static_cast<int>(k));
  }
  return here;
}

// number of points in the lists of all ranks
int count_of_all(const Model& m, const Points& pts, const IntVec& list)
{
  double own = 0.0;
  for (int p : list) own += m.part.works(pts.parent[p]);
  comm_sum(&own, 1);
  return static_cast<int>(own);
}

}  // namespace

void frac_to_release(const Model& m, const FracMesh& fm, const Fracture& fr, const Points& pts,
                     const Level& l, IntVec& out)
{
  out.clear();
  if (fr.nconverted == 0 || std::none_of(m.conversion.begin(), m.conversion.end(),
                                         [](const ConversionDef& c) { return c.release > 0.0; }))
    return;
  const bool window = m.part.window;
  for (int p = 0; p < pts.npoint; ++p) {
    const int e = pts.parent[p];
    if (pts.broken[p] < 0 || e < 0 || fm.conv[e] < 0 || (window && !m.part.works(e))) continue;
    if (must_release(m, fm, pts, l.uc, p)) out.push_back(pts.point_number(p));
  }
  if (!window) return;
  comm_allgatherv(out);
  std::sort(out.begin(), out.end());
}

void frac_release(const Model& m, const FracMesh& fm, const IntVec& number, bool last, State& st)
{
  Points& pts   = st.points;
  Fracture& fr  = st.frac;
  const int all = static_cast<int>(number.size());
  const ReleasedPoints torn = released_here(number, pts);
  IntVec fresh;
  for (int p : torn.point)
    if (!pts.released[p]) fresh.push_back(p);
  fr.released.insert(fr.released.end(), fresh.begin(), fresh.end());
  fr.released_at.resize(fr.released.size(), pts.npoint_all());
  const int news = m.part.window ? count_of_all(m, pts, fresh) : static_cast<int>(fresh.size());
  fr.nreleased += news;
  fr.renewed += all - news;
  std::vector<Eigen::Matrix3d> map;
  if (model_general_contact(m) >= 0) fitted(m, fresh, st, map);
  const size_t before = fr.left.item.size();
  point_release(fresh, m.dim, pts, fr.left);
  copy_corners(fr.left.item, before, m.dim, st.n);
  const size_t history = point_history_size(pts, st.n);
  size_t k = 0;
  for (int p : torn.point) {
    const bool first = k < fresh.size() && fresh[k] == p;
    const double V = pts.V0[p];
    restore(m.dim, p, first && !map.empty() ? &map[k] : nullptr, pts, st.n);
    if (history) history_at(st.n.hp, history, p)[HISTORY_DISSIPATED] *= V / pts.V0[p];    // stays
    forget_flow(m, pts, p, st.n.hp);
    k += first;
  }
  if (m.part.window) point_number_released(m, torn.point, torn.turn, fresh, pts);
  if (last) frac_interfaces(m, fm, st);
}

namespace {

// finds the corners in of that correspond to the corners of the points of the converted element e in start
//   in   left   corners in of, before the release of points of start
//   out  number [ncorner of start]; false: there are no such points
bool match_corners(const Points& of, const Points& start, const std::map<int, const int*>& left, int e,
                   IntVec& number)
{
  number.resize(start.ncorner, -1);
  for (int p = start.of_elem[e], q = of.of_elem[e]; p < start.npoint; ++p, ++q) {
    if (q < 0 || q >= of.npoint || of.conn.count(q) != start.conn.count(p)) return false;
    const auto had    = left.find(p);
    const int* corner = had != left.end() ? had->second : of.conn.begin(q);
    for (int k = 0; k < start.conn.count(p); ++k) {
      if (corner[k] < 0 || corner[k] >= of.ncorner) return false;
      number[start.conn.begin(p)[k]] = corner[k];
    }
  }
  return true;
}

}  // namespace

bool frac_repeat(const Model& m, const FracMesh& fm, const Fracture& fr, const Points& of, Points& start,
                 CornerShare& share, IntVec& number, ListTable& left)
{
  share = CornerShare();
  std::map<int, const int*> had;
  for (size_t r = 0; r < fr.released.size(); ++r) had[fr.released[r]] = fr.left.begin(static_cast<int>(r));
  if (static_cast<int>(number.size()) != start.ncorner) {
    number.resize(start.ncorner);
    std::iota(number.begin(), number.end(), 0);
  }
  const auto release = [&](size_t& r, int until) {   // points released at this number of points
    IntVec fresh;
    for (; r < fr.released.size() && fr.released_at[r] <= until; ++r) fresh.push_back(fr.released[r]);
    for (int p : fresh)
      if (p < 0 || p >= start.npoint || start.parent[p] < 0 || !start.converted(start.parent[p]))
        return false;
    point_release(fresh, m.dim, start, left);
    return true;
  };
  size_t r = 0;
  for (int e : fr.converted) {
    if (fm.conv[e] < 0 || !of.converted(e)) return false;
    const int first = of.part.window ? of.part.point[of.of_elem[e]] : of.of_elem[e];
    if (!release(r, first)) return false;
    const int old = start.ncorner;
    point_convert(m, m.conversion[fm.conv[e]].body[m.mesh.elem_section[e]], e, first, share, start);
    if (!match_corners(of, start, had, e, number)) return false;
    // not from the points of this rank: released points may be elsewhere
    start.unshared_since.resize(start.ncorner, 0);
    for (int c = old; c < start.ncorner; ++c)
      if (number[c] >= 0 && number[c] < static_cast<int>(of.unshared_since.size()))
        start.unshared_since[c] = of.unshared_since[number[c]];
  }
  return release(r, std::numeric_limits<int>::max());
}

bool frac_replay(const Model& m, const FracMesh& fm, const State& st, Points start, CornerShare& share)
{
  const Points& pts = st.points;
  IntVec number;
  ListTable left;
  if (!frac_repeat(m, fm, st.frac, pts, start, share, number, left)) return false;
  if (start.Xc.size() != pts.Xc.size()) return false;
  for (int c = 0; c < pts.ncorner; ++c)                // released points have other shapes          (7.34)
    for (int i = 0; i < m.dim && pts.field[c] != FIELD_OWN; ++i)
      if (start.Xc[c * m.dim + i] != pts.Xc[c * m.dim + i]) return false;
  return start.shape == pts.shape && start.conn.off == pts.conn.off &&
         start.conn.item == pts.conn.item && start.body == pts.body && start.of_elem == pts.of_elem &&
         start.parent == pts.parent && start.first_copy == pts.first_copy && left.item == st.frac.left.item;
}
