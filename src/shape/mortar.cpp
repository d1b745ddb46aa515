#include "shape/mortar.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <Eigen/Dense>

#include "base/box_tree.h"
#include "shape/face.h"
#include "shape/shape.h"

namespace {

using Vec = Eigen::Vector3d;
using Point = Eigen::Vector2d;

// part of the face: a face covered less than this is not tied, a sliver at the rim of the master
// (test: Mortar.PartlyCovered)
const double LEAST_COVER = 1e-3;
// faces are opposite each other when the cosine of their normals is below this  (test: Mortar.FarAndTurned)
const double OPPOSITE = -0.2;
// coefficients below this, relative to their sum 1, are round-off  (test: Mortar.LinearFunctions)
const double NO_COEF = 1e-13;

Vec at(const RealVec& X, int n) { return Vec(X[3 * n], X[3 * n + 1], X[3 * n + 2]); }

// A face with its nodes in the plane of a slave face, or along its line
struct Shadow {
  int n = 0, kind = 0;         // corners; face_kind
  int all = 0;
  Point x[MAX_FACE_NODES];
  double height[MAX_FACE_NODES] = {0};     // along the normal
};

int kind_of(const MortarFace& f) { return face_kind(f.n == 2 ? 2 : 3, f.all()); }

// The plane of a slave face: its middle, two directions along it (plane: one), its normal
struct Frame3 {
  Vec middle, along, across, normal;
};

Vec normal_of(const RealVec& X, const MortarFace& f)
{
  if (f.n == 2) {
    const Vec t = at(X, f.node[1]) - at(X, f.node[0]);
    return Vec(t.y(), -t.x(), 0.0);
  }
  return f.n == 3
             ? Vec(0.5 * (at(X, f.node[1]) - at(X, f.node[0])).cross(at(X, f.node[2]) - at(X, f.node[0])))
             : Vec(0.5 * (at(X, f.node[2]) - at(X, f.node[0])).cross(at(X, f.node[3]) - at(X, f.node[1])));
}

Frame3 frame_of(const RealVec& X, const MortarFace& f)
{
  Frame3 p;
  p.middle = Vec::Zero();
  for (int a = 0; a < f.n; ++a) p.middle += at(X, f.node[a]) / f.n;
  p.normal = normal_of(X, f).normalized();
  p.along  = at(X, f.node[1]) - at(X, f.node[0]);
  p.along  = (p.along - p.normal * p.normal.dot(p.along)).normalized();
  p.across = p.normal.cross(p.along);
  return p;
}

Shadow shadow_of(const RealVec& X, const MortarFace& f, const Frame3& p)
{
  Shadow s;
  s.n    = f.n;
  s.all  = f.all();
  s.kind = kind_of(f);
  for (int a = 0; a < s.all; ++a) {
    const Vec r = at(X, f.node[a]) - p.middle;
    s.x[a]      = Point(p.along.dot(r), f.n == 2 ? 0.0 : p.across.dot(r));
    s.height[a] = p.normal.dot(r);
  }
  return s;
}

double cross2(const Point& a, const Point& b) { return a.x() * b.y() - a.y() * b.x(); }

// what the convex polygon x has in common with the convex, counter-clockwise one: Sutherland and Hodgman
std::vector<Point> clip(std::vector<Point> x, const Shadow& by)
{
  for (int k = 0; k < by.n && !x.empty(); ++k) {
    const Point &a = by.x[k], &b = by.x[(k + 1) % by.n];
    const std::vector<Point> before = std::move(x);
    x.clear();
    for (size_t i = 0; i < before.size(); ++i) {
      const Point &p = before[i], &q = before[(i + 1) % before.size()];
      const double dp = cross2(b - a, p - a), dq = cross2(b - a, q - a);
      if (dp >= 0.0) x.push_back(p);
      if ((dp >= 0.0) != (dq >= 0.0)) x.push_back(p + dp / (dp - dq) * (q - p));
    }
  }
  return x;
}

// local coordinate of a point of an edge; with a middle node by Newton's method
double along_edge(const Shadow& s, double x)
{
  double xi[2] = {2.0 * (x - s.x[0].x()) / (s.x[1].x() - s.x[0].x()) - 1.0, 0.0};
  double N[MAX_FACE_NODES], dN[2 * MAX_FACE_NODES], step = s.all > 2 ? 1.0 : 0.0;
  for (int it = 0; it < 20 && std::fabs(step) > 1e-14; ++it) {
    double r = x, slope = 0.0;
    face_eval(s.kind, xi, N, dN);
    for (int a = 0; a < s.all; ++a) {
      r -= N[a] * s.x[a].x();
      slope += dN[2 * a] * s.x[a].x();
    }
    step = r / slope;
    xi[0] += step;
  }
  return xi[0];
}

// N of a face at a point of the plane; false: the point has no local coordinates
bool shape_at(const Shadow& s, const Point& x, double* N)
{
  double xi[3] = {0, 0, 0}, X[2 * MAX_FACE_NODES];
  for (int a = 0; a < s.all; ++a) {
    X[2 * a]     = s.x[a].x();
    X[2 * a + 1] = s.x[a].y();
  }
  if (s.n == 2) xi[0] = along_edge(s, x.x());
  else {
    const Shape shape = s.n == 3 ? (s.all > 3 ? SHAPE_TRI6 : SHAPE_TRI3)
                                 : (s.all > 4 ? SHAPE_QUAD8 : SHAPE_QUAD4);
    if (!shape_inverse(shape, X, x.data(), xi)) return false;
  }
  face_eval(s.kind, xi, N, nullptr);
  return true;
}

struct Sample { Point x; double w; };

const double gauss3[3] = {-0.774596669241483377, 0.0, 0.774596669241483377};
const double weight3[3] = {5.0 / 9.0, 8.0 / 9.0, 5.0 / 9.0};
const double gauss6[6] = {-0.932469514203152028, -0.661209386466264514, -0.238619186083196909,
                          0.238619186083196909, 0.661209386466264514, 0.932469514203152028};
const double weight6[6] = {0.171324492379170345, 0.360761573048138608, 0.467913934572691047,
                           0.467913934572691047, 0.360761573048138608, 0.171324492379170345};

// Gauss points of a triangle, of a square that has one side in a corner
void sample_triangle(const Point& a, const Point& b, const Point& c, bool fine, std::vector<Sample>& out)
{
  const int n = fine ? 6 : 3;
  const double *g = fine ? gauss6 : gauss3, *w = fine ? weight6 : weight3;
  const double twice = cross2(b - a, c - a);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const double r = 0.5 * (1.0 + g[i]), s = 0.5 * (1.0 + g[j]);
      out.push_back({a + r * (b - a) + r * s * (c - b), 0.25 * w[i] * w[j] * r * twice});
    }
}

bool parallelogram(const Shadow& s)
{
  if (s.n != 4) return true;
  const Point skew = s.x[0] - s.x[1] + s.x[2] - s.x[3];
  return skew.norm() <= 1e-10 * (s.x[2] - s.x[0]).norm();
}

// Gauss points of what two faces have in common, in the plane of the slave
std::vector<Sample> common(const Shadow& slave, const Shadow& master)
{
  std::vector<Sample> out;
  if (slave.n == 2) {
    double lo = std::min(master.x[0].x(), master.x[1].x()), hi = std::max(master.x[0].x(), master.x[1].x());
    lo = std::max(lo, slave.x[0].x());
    hi = std::min(hi, slave.x[1].x());
    for (int g = 0; g < 3 && hi > lo; ++g)
      out.push_back(
          {Point(0.5 * (lo + hi) + 0.5 * (hi - lo) * gauss3[g], 0.0), 0.5 * (hi - lo) * weight3[g]});
    return out;
  }
  std::vector<Point> x(master.x, master.x + master.n);
  std::reverse(x.begin(), x.end());                  // opposite: clockwise as the slave sees it
  x = clip(x, slave);
  if (x.size() < 3) return out;
  const bool fine = !parallelogram(slave) || !parallelogram(master) || slave.all > 6;
  for (size_t k = 1; k + 1 < x.size(); ++k) sample_triangle(x[0], x[k], x[k + 1], fine, out);
  return out;
}

double height_at(const Shadow& s, const double* N)
{
  double sum = 0.0;
  for (int a = 0; a < s.all; ++a) sum += N[a] * s.height[a];
  return sum;
}

// ---- which faces are nearby

BoundingBox box_of(const RealVec& X, const MortarFace& f)
{
  BoundingBox b;
  for (int a = 0; a < f.all(); ++a) box_take(b, &X[3 * f.node[a]]);
  return b;
}

std::vector<BoundingBox> boxes_of(const RealVec& X, const std::vector<MortarFace>& face)
{
  std::vector<BoundingBox> box;
  for (const MortarFace& f : face) box.push_back(box_of(X, f));
  return box;
}

// faces whose boxes come within reach of a box, ascending
IntVec faces_within(const BoxTree& tree, BoundingBox b, double reach)
{
  box_grow(b, reach);
  IntVec out;
  tree.overlap(b, out);
  std::sort(out.begin(), out.end());
  return out;
}

// ---- the integrals of one slave face

struct Piece { Sample at; double N[MAX_FACE_NODES], Nm[MAX_FACE_NODES]; int master; };

std::vector<Piece> pieces_of(const RealVec& X, const MortarFace& slave, const Frame3& plane,
                             const std::vector<MortarFace>& master, const IntVec& near, double reach)
{
  std::vector<Piece> out;
  const Shadow s = shadow_of(X, slave, plane);
  for (int k : near) {
    if (normal_of(X, master[k]).normalized().dot(plane.normal) > OPPOSITE) continue;
    const Shadow m = shadow_of(X, master[k], plane);
    for (const Sample& g : common(s, m)) {
      Piece p;
      p.at     = g;
      p.master = k;
      if (!shape_at(s, g.x, p.N) || !shape_at(m, g.x, p.Nm)) continue;
      if (std::fabs(height_at(m, p.Nm) - height_at(s, p.N)) <= reach) out.push_back(p);
    }
  }
  return out;
}

struct Sum {
  double area = 0.0;
  std::map<int, double> master;
  int end[2] = {-1, -1};
};

using Matrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, 0, MAX_FACE_NODES, MAX_FACE_NODES>;
using Column = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, MAX_FACE_NODES, 1>;

// corners at the ends of the edge of node a, which is no corner
void ends_of(const MortarFace& f, int a, int end[2])
{
  end[0] = a - f.n;
  end[1] = (a - f.n + 1) % f.n;
}

// N in terms of which w are the nodal values: half of that of an edge, of which the corners get a quarter
// each: of triangles Bernstein's polynomials, whose integrals are above 0                         (5.15)
Column positive_shape(const MortarFace& f, const double* N)
{
  Column out(f.all());
  for (int a = 0; a < f.all(); ++a) out(a) = a < f.n ? N[a] : 0.5 * N[a];
  for (int a = f.n; a < f.all(); ++a) {
    int end[2];
    ends_of(f, a, end);
    for (int k : end) out(k) += 0.25 * N[a];
  }
  return out;
}

// psi_a = sum_b A_ab N_b with A = D M^-1; adds the integrals of N_a and of psi_a N_m               (5.10)
void add_face(const MortarFace& slave, const std::vector<MortarFace>& master, const std::vector<Piece>& piece,
              std::map<int, Sum>& sum)
{
  const int n = slave.all();
  Matrix M = Matrix::Zero(n, n);
  Column D = Column::Zero(n);
  for (const Piece& p : piece) {
    const Column N = positive_shape(slave, p.N);
    D += p.at.w * N;
    M += p.at.w * N * N.transpose();
  }
  const Matrix A = D.asDiagonal() * M.llt().solve(Matrix::Identity(n, n));
  for (int a = 0; a < n; ++a) {
    Sum& s = sum[slave.node[a]];
    s.area += D(a);
    if (a < slave.n) continue;
    int end[2];
    ends_of(slave, a, end);
    for (int k = 0; k < 2; ++k) s.end[k] = slave.node[end[k]];
  }
  for (const Piece& p : piece) {
    const Column psi = A * positive_shape(slave, p.N);
    for (int a = 0; a < n; ++a)
      for (int b = 0; b < master[p.master].all(); ++b)
        sum[slave.node[a]].master[master[p.master].node[b]] += p.at.w * psi(a) * p.Nm[b];
  }
}

// without rounding; what is left out goes to the largest, so that the sum is 1
MortarRow row_of(int node, const Sum& s)
{
  MortarRow row{node, s.area, {}, {s.end[0], s.end[1]}};
  double sum = 0.0;
  size_t largest = 0;
  for (const auto& m : s.master) {
    const double c = m.second / s.area;
    if (std::fabs(c) < NO_COEF) continue;
    row.master.emplace_back(m.first, c);
    sum += c;
    if (c > row.master[largest].second) largest = row.master.size() - 1;
  }
  row.master[largest].second += 1.0 - sum;
  return row;
}

// nearest point of a triangle: Ericson, Real-Time Collision Detection 5.1.5
double triangle_distance(const Vec& p, const Vec& a, const Vec& b, const Vec& c)
{
  const Vec n = (b - a).cross(c - a);
  const double area = n.squaredNorm();
  const double u = n.dot((b - p).cross(c - p)), v = n.dot((c - p).cross(a - p)),
               w = n.dot((a - p).cross(b - p));
  if (area > 0.0 && u >= 0.0 && v >= 0.0 && w >= 0.0) return std::fabs(n.dot(p - a)) / std::sqrt(area);
  double best = 1e300;
  const Vec* corner[3] = {&a, &b, &c};
  for (int k = 0; k < 3; ++k) {
    const Vec &s = *corner[k], t = *corner[(k + 1) % 3] - s;
    const double part = std::min(1.0, std::max(0.0, t.dot(p - s) / t.squaredNorm()));
    best = std::min(best, (p - s - part * t).norm());
  }
  return best;
}

// of a face of a quadratic element: the triangles between its nodes and its middle
double bent_distance(const RealVec& X, const Vec& p, const MortarFace& f)
{
  Vec o = Vec::Zero();
  for (int a = 0; a < f.all(); ++a) o += at(X, f.node[a]) / f.all();
  if (f.n == 2) o = at(X, f.node[2]);
  double best = 1e300;
  for (int a = f.n; a < f.all(); ++a) {
    int end[2];
    ends_of(f, a, end);
    for (int k : end)
      best = std::min(best, triangle_distance(p, o, at(X, f.node[a]), at(X, f.node[k])));
  }
  return best;
}

double face_distance(const RealVec& X, const Vec& p, const MortarFace& f)
{
  if (f.mid > 0) return bent_distance(X, p, f);
  const Vec a = at(X, f.node[0]), b = at(X, f.node[1]);
  if (f.n == 2) return triangle_distance(p, a, b, b);
  if (f.n == 3) return triangle_distance(p, a, b, at(X, f.node[2]));
  const Vec c = at(X, f.node[2]), d = at(X, f.node[3]), o = 0.25 * (a + b + c + d);
  return std::min(std::min(triangle_distance(p, o, a, b), triangle_distance(p, o, b, c)),
                  std::min(triangle_distance(p, o, c, d), triangle_distance(p, o, d, a)));
}

}  // namespace

std::vector<MortarRow> mortar_rows(const RealVec& X, const std::vector<MortarFace>& slave,
                                   const std::vector<MortarFace>& master, double reach)
{
  std::map<int, Sum> sum;
  const std::vector<BoundingBox> box = boxes_of(X, master);
  const BoxTree tree(box);
  for (const MortarFace& f : slave) {
    const Frame3 plane = frame_of(X, f);
    const double whole = normal_of(X, f).norm();
    const std::vector<Piece> piece =
        pieces_of(X, f, plane, master, faces_within(tree, box_of(X, f), reach), reach);
    double covered = 0.0;
    for (const Piece& p : piece) covered += p.at.w;
    if (covered > LEAST_COVER * whole) add_face(f, master, piece, sum);
  }
  std::vector<MortarRow> out;
  for (const auto& s : sum) out.push_back(row_of(s.first, s.second));
  return out;
}

RealVec mortar_distances(const RealVec& X, const IntVec& node, const std::vector<MortarFace>& face,
                         double limit)
{
  RealVec out(node.size(), limit);
  const std::vector<BoundingBox> box = boxes_of(X, face);
  const BoxTree tree(box);
  for (size_t k = 0; k < node.size(); ++k) {
    BoundingBox point;
    box_take(point, &X[3 * node[k]]);
    for (int f : faces_within(tree, point, limit))
      out[k] = std::min(out[k], face_distance(X, at(X, node[k]), face[f]));
  }
  return out;
}

double mortar_size(int dim, const RealVec& X, const std::vector<MortarFace>& face)
{
  double sum = 0.0;
  for (const MortarFace& f : face)
    sum += dim == 2 ? normal_of(X, f).norm() : std::sqrt(normal_of(X, f).norm());
  return face.empty() ? 0.0 : sum / static_cast<double>(face.size());
}
