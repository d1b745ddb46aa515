#include <algorithm>
#include <climits>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "base/comm.h"
#include "frac/frac.h"
#include "mat/voigt.h"

namespace {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;
using MapVec = Eigen::Map<Vec3>;

struct Carrier {               // an element or the domain of a point: present nodes or corners
  int nen;
  Vec3 x[MAX_NODES], v[MAX_NODES];
  double mass[pair_count(MAX_NODES)];        // node pairs a >= b
};

// calls use(a, b, m_ab) for all ordered pairs of nodes
template <class Use>
void each_pair(const Carrier& c, Use use)
{
  for (int a = 0, k = 0; a < c.nen; ++a)
    for (int b = 0; b <= a; ++b, ++k) {
      use(a, b, c.mass[k]);
      if (a != b) use(b, a, c.mass[k]);
    }
}

void load_element(const Model& m, const Elements& el, const Level& l, int e, Carrier& c)
{
  c.nen = m.mesh.conn.count(e);
  for (int a = 0; a < c.nen; ++a) {
    const int n = m.mesh.conn.begin(e)[a];
    c.x[a] = c.v[a] = Vec3::Zero();
    for (int i = 0; i < m.dim; ++i) {
      c.x[a][i] = m.mesh.X[3 * n + i] + l.u[n * m.dim + i];
      c.v[a][i] = l.v[n * m.dim + i];
    }
  }
  const double* mass = elem_mass(el.block[el.block_of[e]], el.slot_of[e]);
  std::copy(mass, mass + pair_count(c.nen), c.mass);
}

void load_point(const Points& pts, int dim, const Level& l, int p, Carrier& c)
{
  c.nen = pts.conn.count(p);
  for (int a = 0; a < c.nen; ++a) {
    const int n = pts.conn.begin(p)[a];
    c.x[a] = c.v[a] = Vec3::Zero();
    for (int i = 0; i < dim; ++i) {
      c.x[a][i] = pts.Xc[n * dim + i] + l.uc[n * dim + i];
      c.v[a][i] = l.vc[n * dim + i];
    }
  }
  std::copy_n(pts.mc(p), pair_count(c.nen), c.mass);
}

// calls use(fragment, carrier) for all owned elements and points
template <class Use>
void each_carrier(const Model& m, const Elements& el, const State& st, const Fragments& f, Use use)
{
  Carrier c;
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    if (f.of_elem[e] < 0) continue;
    load_element(m, el, st.n, e, c);
    use(f.of_elem[e], c);
  }
  for (int p = 0; p < st.points.npoint; ++p) {
    if (!point_counts(m, st.points, p)) continue;
    load_point(st.points, m.dim, st.n, p, c);
    use(f.of_point[p], c);
  }
}

// labels of elements have priority over labels of points
void take_label(Fragment& k, bool of_mesh, int label)
{
  if (of_mesh == k.of_mesh) k.label = std::min(k.label, label);
  else if (of_mesh) k.label = label;
  k.of_mesh = k.of_mesh || of_mesh;
}

void count_items(const Model& m, const Elements& el, const Points& pts, Fragments& f)
{
  for (Fragment& k : f.item) k.label = INT_MAX;
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    if (f.of_elem[e] < 0) continue;
    Fragment& k         = f.item[f.of_elem[e]];
    const ElemBlock& b  = el.block[el.block_of[e]];
    const int ngp       = shape_info[b.shape].ngp;
    for (int g = 0; g < ngp; ++g) k.volume += b.w[b.gauss(el.slot_of[e]) + g];
    ++k.nelem;
    take_label(k, true, m.mesh.elem_label[e]);
  }
  for (int p = 0; p < pts.npoint; ++p) {
    if (!point_counts(m, pts, p)) continue;
    Fragment& k = f.item[f.of_point[p]];
    k.volume += point_volume(m, pts, p);
    ++k.npoint;
    const int e = pts.parent[p];
    take_label(k, e >= 0, e >= 0 ? m.mesh.elem_label[e] : pts.label[p]);
  }
}

// ---- divided model: of all ranks ----

// The additive data: each(use) calls use(number) for them
template <class Each>
void sum_ranks(Each each)
{
  RealVec sum;
  each([&](auto& x) { sum.push_back(x); });
  comm_sum(sum);
  const double* next = sum.data();
  each([&](auto& x) { x = static_cast<std::decay_t<decltype(x)>>(*next++); });
}

// bounding box, and the label by take_label
void join_items(std::vector<Fragment>& item)
{
  const double offset = 1e10;  // labels of points follow those of elements
  RealVec most;                // negated minima, for comm_max
  for (const Fragment& k : item) {
    for (int i = 0; i < 3; ++i) most.insert(most.end(), {-k.lo[i], k.hi[i]});
    most.push_back(-k.label - (k.of_mesh ? 0.0 : offset));
  }
  comm_max(most.data(), static_cast<long>(most.size()));
  const double* next = most.data();
  for (Fragment& k : item) {
    for (int i = 0; i < 3; ++i) {
      k.lo[i] = -*next++;
      k.hi[i] = *next++;
    }
    const double label = -*next++;
    k.of_mesh = label < offset;
    k.label   = static_cast<int>(k.of_mesh ? label : label - offset);
  }
}

void sum_first(std::vector<Fragment>& item)
{
  sum_ranks([&](auto use) {
    for (Fragment& k : item) {
      for (int* n : {&k.nelem, &k.npoint}) use(*n);
      for (double* x : {&k.volume, &k.mass}) use(*x);
      for (int i = 0; i < 3; ++i) {
        use(k.centre[i]);
        use(k.momentum[i]);
      }
    }
  });
  join_items(item);
}

void sum_second(std::vector<Fragment>& item, std::vector<Mat3>& S)
{
  sum_ranks([&](auto use) {
    for (Fragment& k : item) {
      use(k.rest);
      for (double& x : k.angular) use(x);
    }
    for (Mat3& s : S)
      for (int i = 0; i < 9; ++i) use(s.data()[i]);
  });
}

// first pass: mass, centre, momentum, box. Each carrier is summed separately: less round-off
void add_first(Fragment& k, const Carrier& c)
{
  double mass = 0.0;
  Vec3 first = Vec3::Zero(), momentum = Vec3::Zero();
  each_pair(c, [&](int a, int, double mab) {
    mass += mab;
    first += mab * c.x[a];
    momentum += mab * c.v[a];
  });
  k.mass += mass;
  MapVec(k.centre) += first;
  MapVec(k.momentum) += momentum;
  for (int a = 0; a < c.nen; ++a) {
    MapVec(k.lo) = MapVec(k.lo).cwiseMin(c.x[a]);
    MapVec(k.hi) = MapVec(k.hi).cwiseMax(c.x[a]);
  }
}

// second pass, relative to the centre: S = int rho r r^T dV, angular momentum, kinetic energy
void add_second(Fragment& k, const Carrier& c, Mat3& S)
{
  const Vec3 centre = MapVec(k.centre), velocity = MapVec(k.velocity);
  double kinetic = 0.0;
  Vec3 angular = Vec3::Zero();
  Mat3 second = Mat3::Zero();
  each_pair(c, [&](int a, int b, double mab) {
    const Vec3 r = c.x[a] - centre, w = c.v[b] - velocity;
    second += mab * r * (c.x[b] - centre).transpose();
    angular += mab * r.cross(w);
    kinetic += 0.5 * mab * (c.v[a] - velocity).dot(w);
  });
  S += second;
  MapVec(k.angular) += angular;
  k.rest += kinetic;
}

void finish(Fragment& k, const Mat3& S)
{
  const Mat3 I = S.trace() * Mat3::Identity() - 0.5 * (S + S.transpose());
  using V = VoigtIndex<3>;
  for (int i = 0; i < 6; ++i) k.inertia[i] = I(V::row[i], V::col[i]);
  const Eigen::SelfAdjointEigenSolver<Mat3> eigen(I);
  const Vec3 L = MapVec(k.angular);
  Vec3 spin = Vec3::Zero();
  for (int i = 0; i < 3; ++i) {
    Vec3 n = eigen.eigenvectors().col(i);
    int big;
    n.cwiseAbs().maxCoeff(&big);
    if (n[big] < 0.0) n = -n;
    k.principal[i] = eigen.eigenvalues()[i];
    MapVec(k.axis + 3 * i) = n;
    if (k.principal[i] > 0.0) spin += n.dot(L) / k.principal[i] * n;
  }
  MapVec(k.spin) = spin;
  k.translation = 0.5 * MapVec(k.momentum).dot(MapVec(k.velocity));
  k.rotation    = 0.5 * spin.dot(L);
  k.kinetic     = k.translation + k.rest;
  k.rest -= k.rotation;
}

}  // namespace

void frac_measure(const Model& m, const Elements& el, const State& st, int n, Fragments& f)
{
  f.item.assign(n + 1, Fragment());
  count_items(m, el, st.points, f);
  for (Fragment& k : f.item) {
    std::fill(k.lo, k.lo + 3, 1e300);
    std::fill(k.hi, k.hi + 3, -1e300);
  }
  each_carrier(m, el, st, f, [&](int k, const Carrier& c) { add_first(f.item[k], c); });
  if (m.part.on) sum_first(f.item);
  for (Fragment& k : f.item) {
    if (k.mass <= 0.0) continue;
    MapVec(k.centre) /= k.mass;
    MapVec(k.velocity) = MapVec(k.momentum) / k.mass;
  }
  std::vector<Mat3> S(n + 1, Mat3::Zero());
  each_carrier(m, el, st, f, [&](int k, const Carrier& c) { add_second(f.item[k], c, S[k]); });
  if (m.part.on) sum_second(f.item, S);
  for (int k = 0; k <= n; ++k) finish(f.item[k], S[k]);
}
