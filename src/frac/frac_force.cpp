#include "frac/frac_scan.h"

#include <algorithm>
#include <cmath>

#include <Eigen/Eigenvalues>

#include "shape/shape.h"

namespace {

// ---- configurational force in a ball                                               (7.5), (7.6)

// displacement gradient H, P and energy W at a Gauss point of an intact element, strains E there
template <int D>
void point_fields(const Scan& s, const ElemBlock& b, int e, int g, const double* E, const double* u,
                  double* H, double* P, double& W)
{
  double S[D * D];
  W = 0.0;
  ip_gradient<D, 0>(&b.dNdX[(b.gauss(s.el.slot_of[e]) + g) * shape_info[b.shape].nen * D],
                    shape_info[b.shape].nen, u, H);
  ip_law<D>(b.law, E, S);
  if (const double E33 = elem_initial33(s.el, s.l.he, e, g)) {             // plane strain
    W = 0.5 * (b.law.lam + 2.0 * b.law.mu) * E33 * E33;
    for (int i = 0; i < D; ++i) {
      W += 0.5 * b.law.lam * E33 * E[i * D + i];
      S[i * D + i] += b.law.lam * E33;
    }
  }
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      P[i * D + j] = S[i * D + j];
      W += 0.5 * S[i * D + j] * E[i * D + j];
      if (s.step.nlgeom)
        for (int k = 0; k < D; ++k) P[i * D + j] += H[i * D + k] * S[k * D + j];
    }
}

template <int D>
void node_displacements(const Scan& s, int e, double* u)
{
  const int *node = s.m.mesh.conn.begin(e);
  for (int a = 0; a < s.m.mesh.conn.count(e); ++a)
    for (int i = 0; i < D; ++i) u[a * D + i] = s.l.u[node[a] * D + i];
}

// J += sum_a q_a F_a of one element
template <int D>
void add_force_of(const Scan& s, int e, const double* q, double* J)
{
  const ElemBlock& b    = s.el.block[s.el.initial_block[e]];
  const ShapeInfo& info = shape_info[b.shape];
  const int nen = info.nen;
  double E[72], u[24], H[D * D], P[D * D], W;
  elem_strains(s.m, s.el, e, s.l.u, &s.l.he, s.step.nlgeom, E);
  node_displacements<D>(s, e, u);
  for (int g = 0; g < info.ngp; ++g) {
    const size_t at  = b.gauss(s.el.slot_of[e]) + g;
    const double* dN = &b.dNdX[at * nen * D];
    double gq[D] = {0};
    point_fields<D>(s, b, e, g, E + g * D * D, u, H, P, W);
    for (int a = 0; a < nen; ++a)
      for (int j = 0; j < D; ++j) gq[j] += q[a] * dN[a * D + j];
    for (int k = 0; k < D; ++k)
      for (int j = 0; j < D; ++j) {
        double eshelby = k == j ? -W : 0.0;
        for (int i = 0; i < D; ++i) eshelby += H[i * D + k] * P[i * D + j];
        J[k] += b.w[at] * eshelby * gq[j];
      }
  }
}

// f += force of an intact element on one of its nodes
template <int D>
void add_node_force(const Scan& s, int e, int node, double* f)
{
  const ElemBlock& b    = s.el.block[s.el.initial_block[e]];
  const ShapeInfo& info = shape_info[b.shape];
  const int nen = info.nen, *conn = s.m.mesh.conn.begin(e);
  const int local = static_cast<int>(std::find(conn, conn + nen, node) - conn);
  double E[72], u[24], H[D * D], P[D * D], W;
  elem_strains(s.m, s.el, e, s.l.u, &s.l.he, s.step.nlgeom, E);
  node_displacements<D>(s, e, u);
  for (int g = 0; g < info.ngp; ++g) {
    const size_t at = b.gauss(s.el.slot_of[e]) + g;
    point_fields<D>(s, b, e, g, E + g * D * D, u, H, P, W);
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j) f[i] += b.w[at] * P[i * D + j] * b.dNdX[(at * nen + local) * D + j];
  }
}

}  // namespace

// free faces of elements in a ball
void free_faces(const Scan& s, int e, double radius, std::vector<FreeFace>& out)
{
  out.clear();
  frac_in_ball(s.fm, &s.fm.centre[3 * e], radius, [&](int o, double) {
    if (s.removed(o) || s.el.initial_block[o] < 0) return;
    for (int f = 0; f < shape_info[s.el.block[s.el.initial_block[o]].shape].nface; ++f) {
      const int behind = s.fm.across[6 * o + f];
      if (behind < 0 || s.removed(behind)) out.push_back(free_face(s.m.mesh, o, f, behind >= 0));
    }
  });
}

namespace {

// does the end of a notch lie in the ball?
bool find_notch(const Scan& s, int e, double radius)
{
  std::vector<FreeFace> face;
  free_faces(s, e, radius * AT_RADIUS, face);
  return notch_among(face, s.fm.local[e]);
}

}  // namespace

// the same; the result is stored, since bodies are those at t = 0
bool at_notch(const Scan& s, int e, double radius)
{
  if (!s.m.part.notch.empty() && !s.m.part.notch[e]) return false;
  RealVec& known = s.fm.notch;
  known.resize(s.fm.size.size(), 0.0);
  if (std::fabs(known[e]) != radius) known[e] = find_notch(s, e, radius) ? -radius : radius;
  return known[e] < 0.0;
}

namespace {

// q of (7.6) at x
double weight_at(const double* x, const double* c, double radius)
{
  return ball_q(std::hypot(x[0] - c[0], x[1] - c[1], x[2] - c[2]), radius);
}

// contribution of the surface of the body inside the ball to J: -int q W n dA on faces without traction.
// Faces of a notch belong to the crack
void take_surface(const Scan& s, int e, double radius, double* J)
{
  std::vector<FreeFace> face;
  free_faces(s, e, radius + 1.5 * s.fm.local[e], face);
  for (const FreeFace& f : face) {
    if (f.removed || !s.intact(f.elem)) continue;
    double q = 0.0;
    for (int a = 0; a < f.n; ++a) q += weight_of(s, f.node[a], &s.fm.centre[3 * e], radius) / f.n;
    if (q == 0.0) continue;
    bool notch = false;
    for (const FreeFace& o : face) notch = notch || (&o != &f && facing(f, o, s.fm.local[e], false));
    if (notch) continue;
    const double W = elem_energy_one(s.m, s.el, f.elem, s.l, 1.0, s.step.nlgeom) / s.fm.volume[f.elem];
    for (int a = 0; a < f.n; ++a) {
      const double qa = weight_of(s, f.node[a], &s.fm.centre[3 * e], radius) / f.n;
      double part[3];
      for (int i = 0; i < 3; ++i) part[i] = qa * W * s.fm.thickness[f.elem] * f.area[i];
      take_supported(s, f.node[a], part);
      for (int i = 0; i < 3; ++i) J[i] += part[i];
    }
  }
}

// in element sizes: spacing of sampling points of the crack, radius of the fit of its plane. Minimum variance
// of the centres of cracked elements along the crack, in element sizes squared (two elements of a row: 0.25,
// three: 0.67), and maximum variance across it, relative to that along it
// (test: K7, fracture/interface_3d.inp)
const double SPACING = 0.5, PLANE_RADIUS = 2.5, MIN_SPREAD = 0.1, MAX_FLATNESS = 0.4;
// in element sizes: radius around an element of a layer with faces on both sides of it  (no test)
const double LAYER_RADIUS = 1.3;

// second moment of a tetrahedron about its centre, over its volume: the centres alone of the six of a cube
// tilt the plane of a crack by 5 degrees  (test: fracture/kink_space.inp), with type=4
Eigen::Matrix3d own_spread(const Scan& s, int o)
{
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  for (int a = 0; a < 4; ++a) {
    Eigen::Vector3d d;
    for (int i = 0; i < 3; ++i)
      d[i] = s.m.mesh.X[3 * static_cast<size_t>(s.m.mesh.conn.begin(o)[a]) + i] - s.fm.centre[3 * o + i];
    sum += d * d.transpose() / 20.0;
  }
  return sum;
}

// cosine between the normals of faces of a layer, at least  (no test)
const double PARALLEL = 0.99;

// unit normal of a layer of one or two elements between parallel surfaces of the body; false: none at e
bool layer_normal(const Scan& s, int e, double* m)
{
  bool sides[2] = {false, false}, other = false;
  frac_in_ball(s.fm, &s.fm.centre[3 * e], LAYER_RADIUS * s.fm.local[e], [&](int o, double) {
    if (s.el.initial_block[o] < 0) return;
    for (int f = 0; f < shape_info[s.el.block[s.el.initial_block[o]].shape].nface; ++f) {
      double mid[3], area[3];
      if (s.fm.across[6 * o + f] >= 0) continue;
      face_of(s.m.mesh, o, f, mid, area);
      const double size = std::hypot(area[0], area[1], area[2]);
      if (!sides[0] && !sides[1])
        for (int i = 0; i < 3; ++i) m[i] = area[i] / size;
      const double same = (area[0] * m[0] + area[1] * m[1] + area[2] * m[2]) / size;
      other = other || std::fabs(same) < PARALLEL;
      sides[same < 0.0] = true;
    }
  });
  return sides[0] && sides[1] && !other;
}

}  // namespace

// unit normal of the line or plane of the cracked elements around e; false: not flat
bool crack_plane(const Scan& s, int e, double* n, double* mid)
{
  const double h = s.fm.local[e];
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double volume = 0.0;
  frac_in_ball(s.fm, &s.fm.centre[3 * e], PLANE_RADIUS * h * AT_RADIUS, [&](int o, double) {
    if (!s.cracked(o)) return;
    const Eigen::Vector3d at = Eigen::Map<const Eigen::Vector3d>(&s.fm.centre[3 * o]) -
                               Eigen::Map<const Eigen::Vector3d>(&s.fm.centre[3 * e]);
    const double v = crack_share(s, e, o);
    volume += v;
    sum += v * at;
    spread += v * at * at.transpose();
    if (s.m.mesh.conn.count(o) == 4 && s.m.dim == 3) spread += v * own_spread(s, o);
  });
  if (volume == 0.0) return false;
  const Eigen::Vector3d middle = sum / volume;
  Eigen::Matrix3d about = spread / volume - middle * middle.transpose();
  if (s.m.dim == 2) about(2, 2) = h * h;           // along the front
  double m[3];
  if (s.m.dim == 3 && layer_normal(s, e, m)) {
    const Eigen::Map<const Eigen::Vector3d> front(m);
    about += h * h * front * front.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(about);
  for (int i = 0; i < 3; ++i) n[i] = axes.eigenvectors()(i, 0);
  for (int i = 0; mid && i < 3; ++i) mid[i] = s.fm.centre[3 * e + i] + middle[i];
  return axes.eigenvalues()[1] > MIN_SPREAD * h * h &&
         axes.eigenvalues()[0] < MAX_FLATNESS * axes.eigenvalues()[1];
}

bool lies_in(const Mesh& mesh, int e, const double* x)
{
  bool in = true;
  for (int f = 0; in && f < shape_info[elem_table[mesh.elem_type[e]].shape].nface; ++f) {
    double mid[3], area[3], out = 0.0;
    face_of(mesh, e, f, mid, area);
    for (int i = 0; i < 3; ++i) out += (x[i] - mid[i]) * area[i];
    in = out <= 0.0;
  }
  return in;
}

// element in which x lies at t = 0, -1: none
int element_at(const Scan& s, const double* x, double h)
{
  int found = -1;
  frac_in_ball(s.fm, x, h, [&](int o, double) {
    if (found >= 0 || (!s.cracked(o) && s.el.initial_block[o] < 0)) return;
    if (lies_in(s.m.mesh, o, x)) found = o;
  });
  return found;
}

namespace {

// orthonormal vectors perpendicular to n
void plane_axes(const double* n, double* a, double* b)
{
  int least = 0;
  for (int i = 1; i < 3; ++i)
    if (std::fabs(n[i]) < std::fabs(n[least])) least = i;
  double axis[3] = {0, 0, 0};
  axis[least] = 1.0;
  for (int i = 0; i < 3; ++i) a[i] = n[(i + 1) % 3] * axis[(i + 2) % 3] - n[(i + 2) % 3] * axis[(i + 1) % 3];
  const double size = std::hypot(a[0], a[1], a[2]);
  for (int i = 0; i < 3; ++i) a[i] /= size;
  for (int i = 0; i < 3; ++i) b[i] = n[(i + 1) % 3] * a[(i + 2) % 3] - n[(i + 2) % 3] * a[(i + 1) % 3];
}

// int q n.j ds along the actual front, n its normal, j the direction of J in the plane of the crack: between
// neighbouring sampling points in that plane, one in the crack and one in intact material. 0: not a plane
// (test: fracture/kink_space.inp), with layers=3
double crack_front(const Scan& s, int e, const double* J, double radius)
{
  double n[3], mid[3], a[3], b[3], off = 0.0, sum = 0.0;
  const double *c = &s.fm.centre[3 * e], h = s.fm.local[e];
  if (!at_crack(s, e) || !crack_plane(s, e, n, mid)) return 0.0;
  plane_axes(n, a, b);
  double ja = 0.0, jb = 0.0;
  for (int i = 0; i < 3; ++i) {
    ja += J[i] * a[i];
    jb += J[i] * b[i];
  }
  const double size = std::hypot(ja, jb);
  if (size == 0.0) return 0.0;
  for (int i = 0; i < 3; ++i) off += (mid[i] - c[i]) * n[i];
  const int most    = static_cast<int>(std::ceil(radius / (SPACING * h))), wide = 2 * most + 2;
  const double cell = radius / most;
  IntVec state(static_cast<size_t>(wide) * wide, 0);            // 1: crack, 2: intact
  const auto position = [&](double p, double q, double* x) {
    for (int i = 0; i < 3; ++i)
      x[i] = c[i] + (p - most) * cell * a[i] + (q - most) * cell * b[i] + off * n[i];
  };
  for (int p = 0; p < wide; ++p)
    for (int q = 0; q < wide; ++q) {
      double x[3];
      position(p - 0.5, q - 0.5, x);
      if (std::hypot(x[0] - c[0], x[1] - c[1], x[2] - c[2]) > radius + cell) continue;
      const int o = element_at(s, x, 1.2 * h);
      state[p * wide + q] = o < 0 ? 0 : s.cracked(o) ? 1 : 2;
    }
  for (int p = 0; p < wide; ++p)
    for (int q = 0; q < wide; ++q)
      for (int side = 0; side < 2; ++side) {
        const int one = state[p * wide + q], p2 = p + (side == 0), q2 = q + (side == 1);
        if (one == 0 || p2 == wide || q2 == wide || one + state[p2 * wide + q2] != 3) continue;
        double x[3];
        position(p - (side == 0 ? 0.0 : 0.5), q - (side == 1 ? 0.0 : 0.5), x);
        const double along = (side == 0 ? ja : jb) / size;
        sum += (one == 1 ? along : -along) * cell * weight_at(x, c, radius);
      }
  return sum;
}

// int q ds along the straight front through the element, perpendicular to J and to the largest principal
// stress, inside the body: 1.5 radius in the interior                                                 (7.6)
double front_length(const Scan& s, int e, const double* J, double radius)
{
  double E[9], N[3], t[3], norm = 0.0, reach[2] = {radius, radius};
  const double* c = &s.fm.centre[3 * e];
  mean_strain(s, e, E);
  split_normal(s.law(e), 3, E, N);
  for (int i = 0; i < 3; ++i) {
    t[i] = J[(i + 1) % 3] * N[(i + 2) % 3] - J[(i + 2) % 3] * N[(i + 1) % 3];
    norm += t[i] * t[i];
  }
  if (norm == 0.0) return 1.5 * radius;
  for (int i = 0; i < 3; ++i) t[i] /= std::sqrt(norm);
  frac_in_ball(s.fm, c, radius + s.fm.local[e], [&](int o, double) {
    if (s.el.initial_block[o] < 0) return;
    for (int f = 0; f < shape_info[s.el.block[s.el.initial_block[o]].shape].nface; ++f) {
      if (s.fm.across[6 * o + f] >= 0) continue;
      double mid[3], area[3], to_face = 0.0, slope = 0.0, size2 = 0.0, miss2 = 0.0;
      face_of(s.m.mesh, o, f, mid, area);
      for (int i = 0; i < 3; ++i) {
        to_face += (mid[i] - c[i]) * area[i];
        slope += t[i] * area[i];
        size2 += area[i] * area[i];
      }
      if (slope == 0.0) continue;
      const double at = to_face / slope;
      for (int i = 0; i < 3; ++i) miss2 += (c[i] + at * t[i] - mid[i]) * (c[i] + at * t[i] - mid[i]);
      if (miss2 < std::sqrt(size2)) reach[at < 0.0] = std::min(reach[at < 0.0], std::fabs(at));
    }
  });
  double sum = 0.0;
  for (double a : reach) sum += a < 0.5 * radius ? a : 2.0 * a - a * a / radius - 0.25 * radius;
  return sum;
}

// J += contribution of an element with its body force, without nodes where an interface bends; at a tip, at
// supported faces, without the normal force                                           (7.5), (7.5c), (7.5d)
//   inout   q   [nodes] weights
void add_force(const Scan& s, int e, bool tip, double* q, double* J)
{
  const int nen = s.m.mesh.conn.count(e), *node = s.m.mesh.conn.begin(e);
  for (int a = 0; !s.fm.between.empty() && a < nen; ++a) {
    const int k = q[a] > 0.0 ? interface_node(s, node[a]) : -1;
    if (k >= 0 && interface_bends(s, k)) q[a] = 0.0;
  }
  const auto add = [&](const double* of, double* to) {
    (s.m.dim == 2 ? add_force_of<2> : add_force_of<3>)(s, e, of, to);
    take_body(s, e, of, to);
  };
  for (int a = 0; tip && a < nen; ++a) {
    double one[8] = {0}, F[3] = {0, 0, 0};
    if (q[a] == 0.0 || !take_supported(s, node[a], F)) continue;
    std::swap(one[a], q[a]);
    add(one, F);
    take_supported(s, node[a], F);
    for (int i = 0; i < 3; ++i) J[i] += F[i];
  }
  add(q, J);
}

// takes the force of an initial strain that varies, int q S : dE0/dX dV, out of J. Its gradient is that
// between the centres of adjacent elements                                                          (7.5b)
template <int D>
void take_initial(const Scan& s, int e, double radius, double* J)
{
  const double* c = &s.fm.centre[3 * e];
  frac_in_ball(s.fm, c, radius, [&](int o, double r) {
    if (!s.intact(o)) return;
    using Strain = Eigen::Matrix<double, D * D, 1>;
    Strain here, there;
    mean_initial(s, o, here.data());
    Eigen::Matrix<double, D, D> dX = Eigen::Matrix<double, D, D>::Zero();
    Eigen::Matrix<double, D * D, D> dE = Eigen::Matrix<double, D * D, D>::Zero();
    beside(s, o, [&](int next) {
      if (!s.intact(next) || frac_other_material(s.el, o, next)) return false;
      Eigen::Matrix<double, D, 1> d;
      for (int i = 0; i < D; ++i) d[i] = s.fm.centre[3 * next + i] - s.fm.centre[3 * o + i];
      dX += d * d.transpose();
      mean_initial(s, next, there.data());
      dE += (there - here) * d.transpose();
      return false;
    });
    if (std::fabs(dX.determinant()) < 1e-9 * std::pow(s.fm.local[o], 2 * D)) return;
    dE = dE * dX.inverse();
    double E[D * D], S[D * D];
    mean_strain(s, o, E);
    ip_law<D>(s.law(o), E, S);
    for (int i = 0; i < D; ++i) S[i * D + i] += stress_of_33(s, o);
    for (int k = 0; k < D; ++k)
      for (int i = 0; i < D * D; ++i) J[k] -= ball_q(r, radius) * s.fm.volume[o] * S[i] * dE(i, k);
  });
}

}  // namespace

double weight_of(const Scan& s, int node, const double* c, double radius)
{
  return weight_at(&s.m.mesh.X[3 * node], c, radius);
}

const double* force_at(const Scan& s, int node)
{
  const int dim = s.m.dim;
  if (s.node_known.empty()) {
    s.node_known.assign(s.m.mesh.nnode(), 0);
    s.node_force.assign(static_cast<size_t>(s.m.mesh.nnode()) * dim, 0.0);
  }
  double* f = &s.node_force[static_cast<size_t>(node) * dim];
  const auto add = dim == 2 ? add_node_force<2> : add_node_force<3>;
  for (int k = 0; !s.node_known[node] && k < s.fm.of_node.count(node); ++k)
    if (s.intact(s.fm.of_node.begin(node)[k])) add(s, s.fm.of_node.begin(node)[k], node, f);
  s.node_known[node] = 1;
  return f;
}

// J of the ball around an element, per thickness or per length of the front
double force_estimate(const Scan& s, int e, double radius, double* J)
{
  const bool crack = at_crack(s, e), tip = crack || at_notch(s, e, radius);
  if (crack && estimate_of(s, e) == ESTIMATE_FORCE) radius = tip_radius(s, e, radius);
  const double *c = &s.fm.centre[3 * e], reach = radius + 1.5 * s.fm.local[e];
  for (int i = 0; i < 3; ++i) J[i] = 0.0;
  frac_in_ball(s.fm, c, reach, [&](int o, double) {
    if (!s.intact(o)) return;
    const int n = s.m.mesh.conn.count(o), *node = s.m.mesh.conn.begin(o);
    double q[8], sum = 0.0;
    for (int a = 0; a < n; ++a) sum += q[a] = weight_of(s, node[a], c, radius);
    if (sum > 0.0) add_force(s, o, tip, q, J);
  });
  take_interfaces(s, c, radius, J);
  // without crack or notch a crack may start at the surface itself
  if (tip) {
    take_surface(s, e, radius, J);
    if (!s.dynamic()) take_loads(s, e, radius, J);
    if (s.law(e).initial >= 0) (s.m.dim == 2 ? take_initial<2> : take_initial<3>)(s, e, radius, J);
  }
  double per = s.fm.thickness[e];
  if (s.m.dim == 3) {
    const double straight = front_length(s, e, J, radius), found = crack_front(s, e, J, radius);
    per = found > 0.5 * straight ? found : straight;
  }
  for (int i = 0; i < 3; ++i) J[i] /= per;
  return std::sqrt(J[0] * J[0] + J[1] * J[1] + J[2] * J[2]);
}
