// ---------------------------------------------------------------------------
// law_cohesive_axes.cpp : cohesive cracks along all principal axes                        (doc/theory.md 2.5)
//
// Each axis has an opening, a width and a history of its own:
//
//   E = Ee + sum of x_i N_i N_i,  x_i = w_i/b_i,   t_i - lam sum(x) - 2 mu x_i = f(k_i)/k_i w_i      (2.36e)
//
// t_i is the stress along N_i without cracks. The openings minimise the energy, whose derivative is the
// stress; they are unique where b max|f'| < 2 mu. A history belongs to the axis nearest to that of the
// last increment; while one axis alone has opened, to that of the largest stress, as in (2.33).
// ---------------------------------------------------------------------------
#include <algorithm>
#include <cmath>

#include "mat/crack_axes.h"
#include "mat/voigt.h"

namespace {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

// Principal stresses that differ by less, relative to the largest, are equal: their axes are those of t(n)
// (test: CohesiveAxes.TurnedPathsAreTheSame)
const double EQUAL = 1e-9;
// stress off equilibrium, relative to that without cracks; sweeps over the axes, few where the openings are
// unique  (no test)
const double AXES_ROUND = 1e-14;
// the same after MAX_SWEEPS, beyond which the increment is cut  (no test)
const double AXES_TOL = 1e-8;
// tangent: largest change of a shear modulus, relative to itself, where two cracked axes have almost the same
// stress  (no test)
const double MAX_SHARE = 10.0;
const int MAX_SWEEPS = 200;

struct Axes {
  int n;                       // 2 in the plane, 3 in space
  double lam, mu;
  double t[3];                 // stress without cracks
  double k0[3];                // largest openings at t(n)
  Opening o[3];                // in the order of the histories
  double x(int i) const { return o[i].w / o[i].width; }
  double stress(int i) const
  {
    double sum = 0.0;
    for (int j = 0; j < n; ++j) sum += x(j);
    return t[i] - lam * sum - 2.0 * mu * x(i);
  }
};

const double* crack_at(const double* h, int i) { return h + CRACK_SIZE * i; }
Vec3 normal_at(const double* h, int i) { return Eigen::Map<const Vec3>(crack_at(h, i)); }
double opening_at(const double* h, int i) { return crack_at(h, i)[CRACK_OPENING]; }

// ---- axes ----------------------------------------------------------------------------------------------

// the direction that axes of equal stress take: a remembered axis, or the first edge of the element
Vec3 preferred(const CrackLaw& c, const double* h, int i)
{
  if (opening_at(h, i) > 0.0) return normal_at(h, i);
  Vec3 edge = i == 0 ? Vec3::UnitX() : Vec3::UnitY();
  for (int k = 0; k < c.dim && c.X && i == 0; ++k) edge[k] = c.X[c.dim + k] - c.X[k];
  return edge.normalized();
}

// principal axes of S, the largest stress first
void principal_axes(const CrackLaw& c, const double* S, const double* h, Vec3* N)
{
  const double none = crack_no_stress(c);
  if (c.dim == 2) {
    const double half = 0.5 * (S[0] - S[1]), r = std::hypot(half, S[3]);
    const double angle = 0.5 * std::atan2(S[3], half);
    N[0] = Vec3(std::cos(angle), std::sin(angle), 0.0);
    N[1] = Vec3(-N[0][1], N[0][0], 0.0);
    const double same = std::max(EQUAL * (std::fabs(S[0]) + std::fabs(S[1])), none);
    if (r <= same) crack_turn(preferred(c, h, 0), N[0], N[1]);
    return;
  }
  const Eigen::SelfAdjointEigenSolver<Mat3> of(full_tensor(S));
  const Vec3 t      = of.eigenvalues().reverse();
  const double same = std::max(EQUAL * t.cwiseAbs().maxCoeff(), none);
  for (int i = 0; i < 3; ++i) N[i] = of.eigenvectors().col(2 - i);
  const bool first = t[0] - t[1] <= same, last = t[1] - t[2] <= same;
  if (first && last) {
    N[0] = preferred(c, h, 0);
    N[1] = N[0].unitOrthogonal();
    N[2] = N[0].cross(N[1]);
    crack_turn(preferred(c, h, 1), N[1], N[2]);
  } else if (first || last) {
    Vec3 &A = first ? N[0] : N[1], &B = first ? N[1] : N[2];
    const Vec3 a = preferred(c, h, 0), b = preferred(c, h, 1);
    const auto within = [&](const Vec3& of_axis) { return std::hypot(of_axis.dot(A), of_axis.dot(B)); };
    crack_turn(within(a) >= within(b) ? a : b, A, B);
  }
}

// gives each history the axis that is nearest to it: order[i] is that of the i-th
void follow_axes(const double* h, int n, const Vec3* N, int* order)
{
  for (int i = 0; i < 3; ++i) order[i] = i;
  for (int i = 0; i + 1 < n; ++i) {
    const Vec3 was = normal_at(h, i);
    for (int j = i + 1; j < n; ++j)
      if (std::fabs(was.dot(N[order[j]])) > std::fabs(was.dot(N[order[i]]))) std::swap(order[i], order[j]);
  }
}

Axes find_axes(const MatLaw& law, const double* S, const double* h)
{
  const CrackLaw& c = law.crack;
  Axes a;
  a.n   = c.dim == 2 ? 2 : 3;
  a.lam = law.lam3;
  a.mu  = law.mu;
  Vec3 N[3];
  int order[3];
  principal_axes(c, S, h, N);
  follow_axes(h, a.n, N, order);
  const Mat3 full = full_tensor(S);
  for (int i = 0; i < a.n; ++i) {
    Opening& o = a.o[i];
    o.N     = N[order[i]];
    a.t[i]  = o.N.dot(full * o.N);
    a.k0[i] = opening_at(h, i);
    o.width = a.k0[i] > 0.0 ? crack_at(h, i)[CRACK_WIDTH] : crack_width(c, o.N.data());
    o.beside = (a.lam + 2.0 * a.mu) / o.width;
  }
  return a;
}

// ---- openings ------------------------------------------------------------------------------------------

// the largest stress that is off equilibrium; a crack that is shut carries any stress up to its limit
double imbalance(const CrackLaw& c, const Axes& a)
{
  double largest = 0.0;
  for (int i = 0; i < a.n; ++i) {
    const double S = a.stress(i), limit = a.k0[i] > 0.0 ? 0.0 : crack_strength(c);
    largest = std::max(largest, a.o[i].w > 0.0 ? std::fabs(S - a.o[i].s * a.o[i].w) : S - limit);
  }
  return largest;
}

// opens one axis after the other, each at the openings of the others: lowers the energy
void sweep(const CrackLaw& c, Axes& a)
{
  for (int i = 0; i < a.n; ++i) {
    Opening& o = a.o[i];
    o.s = 0.0;
    o.t = a.stress(i) + (a.lam + 2.0 * a.mu) * a.x(i);
    crack_open_along(c, a.k0[i], o);
  }
}

// derivative of the stress to the strains of the open cracks; 1 in the rows of the others
//   in   slope   traction over opening, or its derivative
template <class Slope>
Mat3 matrix(const Axes& a, Slope slope)
{
  Mat3 K = Mat3::Identity();
  for (int i = 0; i < a.n; ++i)
    for (int j = 0; j < a.n; ++j)
      if (a.o[i].w > 0.0 && a.o[j].w > 0.0)
        K(i, j) = a.lam + (i == j ? 2.0 * a.mu + a.o[i].width * slope(i) : 0.0);
  return K;
}

// a correction of Newton's method for the cracks that are open; false, and unchanged: it does not halve the
// imbalance
bool correct(const CrackLaw& c, Axes& a)
{
  const auto slope = [&](int i) {
    const Opening& o = a.o[i];
    return o.k > a.k0[i] ? cohesion(c, o.k).slope : o.s;
  };
  const Mat3 K = matrix(a, slope);
  Vec3 rest = Vec3::Zero();
  for (int i = 0; i < a.n; ++i)
    if (a.o[i].w > 0.0) rest[i] = a.stress(i) - a.o[i].s * a.o[i].w;
  const Vec3 more = K.inverse() * rest;
  Axes next       = a;
  for (int i = 0; i < a.n; ++i) {
    Opening& o = next.o[i];
    if (o.w == 0.0) continue;
    o.w += o.width * more[i];
    if (!(o.w > 0.0)) return false;
    o.k = std::max(o.w, a.k0[i]);
    o.s = cohesion(c, o.k).f / o.k;
  }
  if (!(imbalance(c, next) < 0.5 * imbalance(c, a))) return false;
  a = next;
  return true;
}

// (2.36e): corrections of Newton's method, and sweeps where they fail. false: not found
bool open_all(const CrackLaw& c, Axes& a)
{
  double size = 0.0;
  for (int i = 0; i < a.n; ++i) size = std::max(size, std::fabs(a.t[i]));
  for (int it = 0; it < MAX_SWEEPS; ++it) {
    sweep(c, a);
    while (imbalance(c, a) > AXES_ROUND * size && correct(c, a)) continue;
    if (imbalance(c, a) <= AXES_ROUND * size) return true;
  }
  return imbalance(c, a) <= AXES_TOL * size;
}

// energy / volume of the strain without cracks, minus the stored energy
double released_energy(const Axes& a)
{
  double sum = 0.0;
  for (int i = 0; i < a.n; ++i) sum += 0.5 * (a.t[i] + a.stress(i) - a.o[i].s * a.o[i].w) * a.x(i);
  return sum;
}

double dissipated_by(const CrackLaw& c, const Axes& a)
{
  double sum = 0.0;
  for (int i = 0; i < a.n; ++i)
    if (a.o[i].k > a.k0[i])
      sum += (dissipated_to(c, a.o[i].k) - dissipated_to(c, a.k0[i])) / a.o[i].width;
  return sum;
}

// ---- widths of the next increment ----------------------------------------------------------------------

bool next_widths(const CrackLaw& c, Axes& a)
{
  CrackBand band[CRACK_AXES];
  for (int i = 0; i < a.n; ++i) band[i] = {a.o[i].N, a.k0[i], a.o[i].k, a.o[i].width};
  if (!crack_next_widths(c, a.n, band)) return false;
  for (int i = 0; i < a.n; ++i) {
    if (a.o[i].k == 0.0) continue;
    a.o[i].width  = band[i].width;
    a.o[i].beside = (a.lam + 2.0 * a.mu) / band[i].width;
  }
  return true;
}

// ---- tangent -------------------------------------------------------------------------------------------

// takes the cracks from the intact D, part: 1 - STIFFNESS. Along the axes by the inverse of the derivative of
// (2.36e), in the shear of two axes by (2.35); CRACK_SECANT: (2.36), and (2.35) where it is stiffer
void soften(const MatLaw& law, const Axes& a, double part, double* D)
{
  const CrackLaw& c = law.crack;
  const bool secant = c.tangent == CRACK_SECANT;
  const auto slope  = [&](int i) {
    const Opening& o  = a.o[i];
    const bool onward = c.tangent == CRACK_ONWARD && o.w >= (1.0 - OPENING_TOL) * o.k;
    return !secant && (o.k > a.k0[i] || onward) ? cohesion(c, o.k).slope : o.s;
  };
  const Mat3 F = matrix(a, slope).inverse();
  double S[3][6];
  for (int i = 0; i < a.n; ++i) crack_stress(law, a.o[i].N, a.o[i].N, S[i]);
  for (int i = 0; i < a.n; ++i)
    for (int j = 0; j < a.n; ++j)
      if (a.o[i].w > 0.0 && a.o[j].w > 0.0)
        for (int k = 0; k < 36; ++k) D[k] -= part * F(i, j) * S[i][k / 6] * S[j][k % 6];
  for (int i = 0; i < a.n; ++i)
    for (int j = 0; j < i; ++j) {
      const double dt = a.t[i] - a.t[j], size = std::max(std::fabs(a.t[i]), std::fabs(a.t[j]));
      if (std::fabs(dt) <= EQUAL * size) continue;
      const double most  = MAX_SHARE / law.mu,
                   share = std::clamp(2.0 * (a.x(i) - a.x(j)) / dt, -most, most);
      if (!secant || share < 0.0) crack_subtract(law, a.o[i].N, a.o[j].N, part * share, D);
    }
}

// S -= part times the stress that the cracks release
void release(const MatLaw& law, const Axes& a, double part, double* S)
{
  for (int i = 0; i < a.n; ++i) {
    double R[6];
    crack_stress(law, a.o[i].N, a.x(i) * a.o[i].N, R);
    for (int j = 0; j < 6; ++j) S[j] -= part * R[j];
  }
}

// open cracks first: those of t(n), which come first, stay open
void keep(const Axes& a, double* h)
{
  for (int i = 0; i < a.n; ++i)
    if (a.o[i].k > 0.0) h = crack_store(a.o[i].N, a.o[i].width, a.o[i].k, h);
}

}  // namespace

bool crack_turn(const Vec3& a, Eigen::Ref<Vec3> first, Eigen::Ref<Vec3> second)
{
  const double x = a.dot(first), y = a.dot(second), size = std::hypot(x, y);
  if (size == 0.0) return false;
  const Vec3 to = (x * first + y * second) / size;
  second = (x * second - y * first) / size;
  first  = to;
  return true;
}

double* crack_store(const Vec3& N, double width, double k, double* h)
{
  std::copy_n(N.data(), 3, h + CRACK_NORMAL);
  h[CRACK_WIDTH]   = width;
  h[CRACK_OPENING] = k;
  return h + CRACK_SIZE;
}

bool crack_next_widths(const CrackLaw& c, int n, CrackBand* band)
{
  const Vec3 across(c.across);
  int main = 0;
  const auto weight = [&](int i) { return c.X ? std::fabs(band[i].N.dot(across)) : band[i].before; };
  for (int i = 1; i < n; ++i)
    if (weight(i) > weight(main)) main = i;
  bool changes = false;
  for (int i = 0; i < n; ++i) {
    CrackBand& o       = band[i];
    const double width = o.width;
    if (o.k == 0.0) continue;
    if (i == main) o.width = crack_next_width(c, width, o.before, o.k);
    else if (c.X && !across.isZero(0.0) && o.k < SETTLED * crack_open(c)) {
      const Vec3 along = o.N - o.N.dot(across) * across;
      o.width = crack_width(c, along.normalized().eval().data());
    }
    changes = changes || o.width != width;
  }
  return changes;
}

bool law_cohesive_axes(const MatLaw& law, const double* h_n, double* h_np1, bool tangent, LawOutput& out)
{
  const CrackLaw& c = law.crack;
  const double part = 1.0 - law.c;
  Axes a = find_axes(law, out.S, h_n);
  if (!open_all(c, a)) return false;
  release(law, a, part, out.S);
  double released = released_energy(a);
  out.dissipated  = dissipated_by(c, a);
  Axes next = a;
  if (next_widths(c, next)) {                          // the change of energy is dissipated
    for (int i = 0; i < a.n; ++i) next.k0[i] = a.o[i].k;
    if (!open_all(c, next)) return false;
    out.dissipated += released_energy(next) - released;
    released = released_energy(next);
    bool grows = false;
    for (int i = 0; i < a.n; ++i) grows = grows || next.o[i].k > a.o[i].k;
    // half the force belongs to the next increment, unless that returns to it at once
    if (c.tangent == CRACK_MEAN && grows) {
      release(law, a, -0.5 * part, out.S);
      release(law, next, 0.5 * part, out.S);
    }
  }
  keep(next, h_np1);
  out.psi -= part * released;
  out.dissipated *= part;
  if (tangent) soften(law, a, part, out.D);
  return true;
}
