// ---------------------------------------------------------------------------
// law_cohesive.cpp : cohesive crack, smeared over the element                         (doc/theory.md 2.5)
//
// The largest principal stress opens it: E = Ee + w/b N N, N the axis of that stress, b the width of the
// element along N when it began to open. S follows from Ee by the intact law, and the stress along N equals
// the traction of the crack,
//
//   t = f(k)/k w,  k = the largest opening so far,  f(0) = strength,  integral of f = toughness   (2.33)
//
// Compression closes it. N is an axis of strain and stress, so that w minimises the energy
// psi(Ee) + [t w/2 + dissipated]/b, whose derivative is the stress. Where the stress beside the crack reaches
// the strength too, law_cohesive_axes.cpp continues with an opening for each axis.
//
// A crack along a line has a fixed normal, and opens and slides against one traction             (2.36c)
// ---------------------------------------------------------------------------
#include <algorithm>
#include <cmath>

#include "mat/crack_axes.h"
#include "mat/root.h"
#include "mat/voigt.h"

namespace {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

// linear part of a softening curve from (k0, f0) to (k1, f1); work: integral of f up to k0
Cohesion straight(double k, double k0, double f0, double k1, double f1, double work)
{
  const double slope = (f1 - f0) / (k1 - k0), f = f0 + slope * (k - k0);
  return {f, slope, work + 0.5 * (f0 + f) * (k - k0)};
}

// are all principal stresses below the limit? By the signs of the leading minors of S - limit
bool all_below(const double* S, double limit)
{
  const double x = S[0] - limit, y = S[1] - limit, z = S[2] - limit;
  if (!(x < 0.0) || !(x * y > S[3] * S[3])) return false;
  return x * (y * z - S[4] * S[4]) - S[3] * (S[3] * z - S[4] * S[5]) + S[5] * (S[3] * S[4] - y * S[5]) < 0.0;
}

// the largest principal stress by the Lode angle; in 2D: in the plane. Below the limit: an upper bound
double largest_stress(const CrackLaw& c, const double* S, double limit)
{
  if (c.dim == 2) return 0.5 * (S[0] + S[1]) + std::hypot(0.5 * (S[0] - S[1]), S[3]);
  if (all_below(S, limit)) return limit;
  const double mean = (S[0] + S[1] + S[2]) / 3.0, x = S[0] - mean, y = S[1] - mean, z = S[2] - mean,
               J2 = 0.5 * (x * x + y * y + z * z) + S[3] * S[3] + S[4] * S[4] + S[5] * S[5],
               J3 = x * (y * z - S[4] * S[4]) - y * S[5] * S[5] - z * S[3] * S[3] +
                    2.0 * S[3] * S[4] * S[5];
  const double r = std::sqrt(J2 / 3.0), cube = 2.0 * r * r * r;
  if (cube == 0.0 || mean + 2.0 * r <= limit) return mean + 2.0 * r;
  return mean + 2.0 * r * std::cos(std::acos(std::clamp(J3 / cube, -1.0, 1.0)) / 3.0);
}

// a unit vector normal to the unit vector N
Vec3 normal_to(const Vec3& N)
{
  int least = 0;
  for (int i = 1; i < 3; ++i)
    if (std::fabs(N[i]) < std::fabs(N[least])) least = i;
  return N.cross(Vec3::Unit(least)).normalized();
}

// direction of the largest principal stress t in 3D: normal to all rows of S - t
Vec3 direction_of(const double* S, double t)
{
  const double SAME = 1e-10;           // of the largest row: below, two principal stresses are equal
  Mat3 A = full_tensor(S);
  A.diagonal().array() -= t;
  Vec3 best = Vec3::Zero();
  int longest = 0;
  for (int i = 0; i < 3; ++i) {
    const Vec3 x = A.row(i).cross(A.row((i + 1) % 3));
    if (x.squaredNorm() > best.squaredNorm()) best = x;
    if (A.row(i).squaredNorm() > A.row(longest).squaredNorm()) longest = i;
  }
  const double size = A.row(longest).squaredNorm();
  if (size == 0.0) return Vec3::UnitX();
  return best.norm() > SAME * size ? Vec3(best.normalized()) : normal_to(A.row(longest).normalized());
}

// the direction of the largest principal stress o.t; o.t by the Rayleigh quotient
void find_normal(const CrackLaw& c, const double* S, Opening& o)
{
  if (c.dim == 2) {
    const double angle = 0.5 * std::atan2(S[3], 0.5 * (S[0] - S[1]));
    o.N = Vec3(std::cos(angle), std::sin(angle), 0.0);
    return;
  }
  o.N = direction_of(S, o.t);
  o.t = o.N.dot(full_tensor(S) * o.N);
}

// the axis of a crack without stress: that of t(n), towards which o.t acts
void keep_normal(const double* S, const double* h, Opening& o)
{
  o.N = Eigen::Map<const Vec3>(h + CRACK_NORMAL);
  o.t = o.N.dot(full_tensor(S) * o.N);
}

// a principal axis of S normal to N
Vec3 other_axis(const CrackLaw& c, const Mat3& S, const Vec3& N)
{
  if (c.dim == 2) return Vec3(-N[1], N[0], 0.0);
  const Vec3 u = normal_to(N), v = N.cross(u), Su = S * u;
  const double angle = 0.5 * std::atan2(2.0 * v.dot(Su), u.dot(Su) - v.dot(S * v));
  return std::cos(angle) * u + std::sin(angle) * v;
}

// the opening in loading, larger than k: beside w + f(w) = t
double grown(const CrackLaw& c, const Opening& o, double k)
{
  return decreasing_root(k, k, o.t / o.beside, [&](double x, double* slope) {
    const Cohesion h = cohesion(c, x);
    *slope = -(o.beside + h.slope);
    return o.t - o.beside * x - h.f;
  });
}

// energy / volume of the strain without a crack, minus the stored energy
double released_energy(const Opening& o) { return (o.t - 0.5 * (o.beside + o.s) * o.w) * o.w / o.width; }

}  // namespace

void crack_open_along(const CrackLaw& c, double k, Opening& o)
{
  o.k = k;
  if (k > 0.0) o.s = cohesion(c, k).f / k;
  o.flexible = o.t > 0.0 && k > 0.0 ? 1.0 / (o.beside + o.s) : 0.0;
  o.w        = o.flexible * o.t;
  if (k > 0.0 ? o.w <= k : o.t <= crack_strength(c)) {
    if (c.tangent == CRACK_ONWARD && k > 0.0 && o.w >= (1.0 - OPENING_TOL) * k)
      o.flexible = 1.0 / (o.beside + cohesion(c, k).slope);
    return;
  }
  o.w = o.k  = grown(c, o, k);
  o.s        = cohesion(c, o.k).f / o.k;
  o.flexible = 1.0 / (o.beside + cohesion(c, o.k).slope);
}

void crack_stress(const MatLaw& law, const Vec3& N, const Vec3& a, double* S)
{
  using V = VoigtIndex<3>;
  const double trace = N.dot(a);
  for (int i = 0; i < 6; ++i)
    S[i] = (i < 3 ? law.lam3 * trace : 0.0) +
           law.mu * (N[V::row[i]] * a[V::col[i]] + N[V::col[i]] * a[V::row[i]]);
}

void crack_subtract(const MatLaw& law, const Vec3& N, const Vec3& a, double share, double* D)
{
  double S[6];
  crack_stress(law, N, a, S);
  for (int i = 0; i < 6; ++i)
    for (int j = 0; j < 6; ++j) D[6 * i + j] -= share * S[i] * S[j];
}

namespace {

// Secant stiffness, an upper bound of that of the energy, which therefore decreases in every iteration: fixed
// normal, t/w along it, and the shear of the intact law                                  (2.36)
void soften_secant(const MatLaw& law, const Opening& o, double* D)
{
  if (o.w > 0.0) crack_subtract(law, o.N, o.N, 1.0 / ((o.beside + o.s) * o.width), D);
}

// D of the crack from the intact D: softening along N; in the shear of N and another axis the stress rotates
// with the strain: dS/dE = (S_N - S_a)/(E_N - E_a)                                       (2.35)
void soften(const MatLaw& law, const Opening& o, const Mat3& E, const Mat3& S, double* D)
{
  const Vec3 B = other_axis(law.crack, S, o.N);
  crack_subtract(law, o.N, o.N, o.flexible / o.width, D);
  for (const Vec3& a : {B, Vec3(o.N.cross(B))}) {
    const double dE = o.N.dot(E * o.N) - a.dot(E * a), dS = o.N.dot(S * o.N) - a.dot(S * a);
    if (dE > 0.0) crack_subtract(law, o.N, a, (law.mu - 0.5 * dS / dE) / (law.mu * law.mu), D);
  }
}

}  // namespace

Cohesion cohesion(const CrackLaw& c, double k)
{
  const double gc = c.gc * c.scatter, ft = crack_strength(c);
  if (c.softening == SOFTENING_EXPONENTIAL) {
    const double f = ft * std::exp(-ft / gc * k);
    return {f, -ft / gc * f, gc - gc / ft * f};
  }
  const double end = crack_open(c);
  if (k >= end) return {0.0, 0.0, gc};
  if (c.softening == SOFTENING_LINEAR) return straight(k, 0.0, ft, end, 0.0, 0.0);
  // Petersson: (0.8 Gc/ft, ft/3), (3.6 Gc/ft, 0)
  const double knee = 0.8 * gc / ft;
  if (k < knee) return straight(k, 0.0, ft, knee, ft / 3.0, 0.0);
  return straight(k, knee, ft / 3.0, end, 0.0, knee * ft * 2.0 / 3.0);
}

double dissipated_to(const CrackLaw& c, double k)
{
  const Cohesion h = cohesion(c, k);
  return h.work - 0.5 * h.f * k;
}

CrackLaw crack_of(const FractureDef& d)
{
  CrackLaw c;
  c.softening = d.softening;
  c.strength  = d.ft;
  c.gc        = d.gc;
  return c;
}

namespace {

// width of the box of a material point along the normal F N in space
double box_width(const CrackLaw& c, const double* N)
{
  double sum = 0.0, length = 0.0;
  for (int i = 0; i < c.dim; ++i) {
    double n = 0.0;
    for (int j = 0; j < c.dim; ++j) n += c.F[3 * i + j] * N[j];
    sum += std::fabs(n) * c.box[i];
    length += n * n;
  }
  return sum / std::sqrt(length);
}

}  // namespace

double crack_width(const CrackLaw& c, const double* N)
{
  if (!c.X) return box_width(c, N);
  double lo = 0.0, hi = 0.0;
  for (int a = 0; a < c.nodes; ++a) {
    double at = 0.0;
    for (int i = 0; i < c.dim; ++i) at += N[i] * c.X[a * c.dim + i];
    lo = a == 0 ? at : std::min(lo, at);
    hi = a == 0 ? at : std::max(hi, at);
  }
  return hi - lo;
}

double crack_next_width(const CrackLaw& c, double width, double before, double opening)
{
  if (!c.X && c.box[0] > 0.0) {
    const bool grows = opening > before && opening < crack_open(c),
               moves = opening < SETTLED * crack_open(c) || std::fabs(c.band - width) > OTHER_WIDTH * width;
    return c.band > 0.0 && grows && moves ? c.band : width;
  }
  const double* N = c.across;
  const bool follows = (N[0] != 0.0 || N[1] != 0.0 || N[2] != 0.0) && opening < SETTLED * crack_open(c);
  return follows ? crack_width(c, N) : width;
}

double crack_open(const CrackLaw& c)
{
  static const double openings[] = {2.0, 3.6, 7.0};
  return openings[c.softening] * c.gc / c.strength;
}

double crack_traction(const CrackLaw& c, double k) { return cohesion(c, k).f; }

double crack_max_width(const MatLaw& law)
{
  const double part[] = {2.0, 1.2, 1.0};
  const CrackLaw& c = law.crack;
  return part[c.softening] * law.material->young * c.gc / (c.strength * crack_strength(c));
}

namespace {

// the first crack in a history; LAW_COHESIVE begins with it
const double* first_crack(const MatLaw& law, const double* h)
{
  return h + (law.kind == LAW_COHESIVE ? HISTORY_OF_LAW : law_field(law_of(law), HISTORY_CRACK));
}

// the crack in a history that has opened widest
const double* widest(const MatLaw& law, const double* h)
{
  const double *first = first_crack(law, h), *best = first;
  if (first[CRACK_SIZE + CRACK_OPENING] == 0.0) return first;
  for (int i = 1; i < CRACK_AXES; ++i)
    if (first[CRACK_SIZE * i + CRACK_OPENING] > best[CRACK_OPENING]) best = first + CRACK_SIZE * i;
  return best;
}

}  // namespace

const double* crack_normal(const MatLaw& law, const double* h) { return widest(law, h); }

double crack_opening(const MatLaw& law, const double* h) { return widest(law, h)[CRACK_OPENING]; }

double crack_band(const MatLaw& law, const double* h) { return std::fabs(widest(law, h)[CRACK_WIDTH]); }

const double* crack_normal_like(const MatLaw& law, const double* h, const double* N, double* k)
{
  const double *first = first_crack(law, h), *best = first;
  double nearest = -1.0;
  for (int i = 0; i < CRACK_AXES; ++i) {
    const double* x = first + CRACK_SIZE * i;
    if (i > 0 && x[CRACK_OPENING] == 0.0) break;
    const double cosine = std::fabs(N[0] * x[0] + N[1] * x[1] + N[2] * x[2]);
    if (cosine <= nearest) continue;
    nearest = cosine;
    best    = x;
  }
  *k = best[CRACK_OPENING];
  return best;
}

namespace {

void set_mark(const MatLaw& law, const Vec3& N, double width, double* h)
{
  double* crack = h + law_field(law_of(law), HISTORY_CRACK);
  std::copy_n(N.data(), 3, crack + CRACK_NORMAL);
  crack[CRACK_WIDTH] = width;
}

}  // namespace

void crack_line(const MatLaw& law, const double* G, const double* N, double* h)
{
  const Eigen::Map<const Vec3> g(G), across(N);
  const double size = g.norm(), p = std::max(g.dot(across) / size, LEAST_COSINE);
  set_mark(law, p / size * g, -1.0 / size, h);
}

bool crack_begin(const MatLaw& law, const double* h_np1, double* h_n)
{
  const double SMALL = 1e-6;           // of the opening at zero traction
  const int first    = law_field(law_of(law), HISTORY_CRACK);
  const double* next = h_np1 + first;
  double* crack      = h_n + first;
  if (crack[CRACK_WIDTH] >= 0.0 || crack[CRACK_OPENING] > 0.0 || next[CRACK_OPENING] == 0.0) return false;
  crack[CRACK_OPENING] = SMALL * crack_open(law.crack);
  return true;
}

void crack_shut(const MatLaw& law, double* h) { set_mark(law, Vec3::Zero(), -1.0, h); }

void crack_free(const MatLaw& law, double* h) { set_mark(law, Vec3::Zero(), 0.0, h); }

namespace {

// crack_share of a crack along a line, 0 where it is pressed or shut
double line_share(const MatLaw& law, const double* S, const double* h, double* N)
{
  const Eigen::Map<const Vec3> pn(crack_normal(law, h));
  const double p = pn.norm(), k = crack_opening(law, h), carries = cohesion(law.crack, k).f;
  if (p == 0.0 || carries == 0.0) return 0.0;
  const Mat3 full = full_tensor(S);
  const Vec3 n = pn / p, t = full * n;
  std::copy_n(n.data(), 3, N);
  if (n.dot(t) <= 0.0) return 0.0;
  const double share = t.norm() / (p * carries);
  return k > 0.0 ? share : std::min(share, full.norm() / carries);
}

}  // namespace

double crack_share(const MatLaw& law, const double* S, const double* h, double* N, double* k)
{
  const double* first = first_crack(law, h);
  *k = first[CRACK_OPENING];
  if (first[CRACK_WIDTH] < 0.0) return line_share(law, S, h, N);
  const Mat3 full = full_tensor(S);
  Opening o;
  o.t = largest_stress(law.crack, S, -HUGE_VAL);
  find_normal(law.crack, S, o);
  double largest = -HUGE_VAL;
  const auto take = [&](const Vec3& axis, double opened) {
    const double carries = cohesion(law.crack, opened).f,
                 share   = carries > 0.0 ? axis.dot(full * axis) / carries : 0.0;
    if (share <= largest) return;
    largest = share;
    *k      = opened;
    std::copy_n(axis.data(), 3, N);
  };
  if (first[CRACK_OPENING] == 0.0) take(o.N, 0.0);
  else take(Eigen::Map<const Vec3>(first).normalized(), first[CRACK_OPENING]);
  if (first[CRACK_OPENING] == 0.0) return largest;
  const Vec3 A = Eigen::Map<const Vec3>(first).normalized();
  const double* second = first + CRACK_SIZE;
  const bool two = second[CRACK_OPENING] > 0.0;
  const Vec3 B   = two ? Vec3(Eigen::Map<const Vec3>(second)) : other_axis(law.crack, full, A);
  take(B, second[CRACK_OPENING]);
  if (law.crack.dim == 3) take(A.cross(B), second[CRACK_SIZE + CRACK_OPENING]);
  return largest;
}

namespace {

// Crack along a line: E = Ee + sym(w n)/b, S n = p f(k)/k w, k = the largest |w| so far          (2.36c)
struct LineCrack {
  Vec3 n, t;                   // normal; traction without the crack
  double p, beside, slide;     // stiffness of the adjacent material across and along the crack, times 1/b
  bool closed;                 // pressed: slides only
  // w for the ratio s = f(k)/k
  Vec3 jump(double s) const
  {
    const double across = n.dot(t);
    const Vec3 w = (t - across * n) / (slide + p * s);
    return closed ? w : Vec3(w + across / (beside + p * s) * n);
  }
};

// the largest opening of a line that opens or slides farther than k: |w(f(x)/x)| = x
double grown(const CrackLaw& c, const LineCrack& o, double k)
{
  const int MAX_BISECTIONS = 200;
  const double ROUND = 1e-14;          // of an opening
  double lo = k, hi = o.t.norm() / o.slide;
  for (int i = 0; i < MAX_BISECTIONS && hi - lo > ROUND * hi; ++i) {
    const double x = 0.5 * (lo + hi);
    (o.jump(cohesion(c, x).f / x).norm() > x ? lo : hi) = x;
  }
  return 0.5 * (lo + hi);
}

// D of the crack from the intact D: -S_i S_j dw_i/dt_j / b, S_i the stress of the strain sym(n e_i)
void soften_line(const MatLaw& law, const LineCrack& o, const Mat3& flexible, double b, double* D)
{
  double S[3][6];
  for (int i = 0; i < 3; ++i) crack_stress(law, o.n, Vec3::Unit(i), S[i]);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 36; ++k) D[k] -= flexible(i, j) / b * S[i][k / 6] * S[j][k % 6];
}

// dw/dt of the crack at w; k0: the largest opening at the start
Mat3 flexibility(const CrackLaw& c, const LineCrack& o, const Vec3& w, double k0, double k, double s)
{
  const Mat3 nn = o.n * o.n.transpose();
  const bool follows = k > k0 || (c.tangent == CRACK_ONWARD && w.norm() >= (1.0 - OPENING_TOL) * k);
  Mat3 B = (o.slide + o.p * s) * Mat3::Identity() + (o.beside - o.slide) * nn;
  if (follows && c.tangent != CRACK_SECANT)
    B += o.p * (cohesion(c, k).slope - s) / (k * k) * w * w.transpose();
  const Mat3 along = o.closed ? Mat3(Mat3::Identity() - nn) : Mat3(Mat3::Identity());
  return along * B.inverse() * along;
}

bool law_line(const MatLaw& law, const double* h_n, double* h_np1, bool tangent, LawOutput& out)
{
  const CrackLaw& c = law.crack;
  const Vec3 pn = Eigen::Map<const Vec3>(h_n + CRACK_NORMAL);
  const double b = -h_n[CRACK_WIDTH], k0 = h_n[CRACK_OPENING], part = 1.0 - law.c;
  LineCrack o;
  o.p = pn.norm();
  if (o.p == 0.0) return true;                         // shut
  o.n = pn / o.p;
  o.t = full_tensor(out.S) * o.n;
  o.beside = (law.lam3 + 2.0 * law.mu) / b;
  o.slide  = law.mu / b;
  o.closed = o.n.dot(o.t) <= 0.0;
  if (k0 == 0.0 && (o.closed || o.t.norm() <= o.p * crack_strength(c))) return true;
  double k = k0;
  if (k0 == 0.0 || o.jump(cohesion(c, k0).f / k0).norm() > k0) k = grown(c, o, k0);
  const double s = cohesion(c, k).f / k;
  const Vec3 w   = o.jump(s);
  double R[6];
  crack_stress(law, o.n, w / b, R);
  for (int i = 0; i < 6; ++i) out.S[i] -= part * R[i];
  out.dissipated = part * o.p * (dissipated_to(c, k) - dissipated_to(c, k0)) / b;
  out.psi -= part * 0.5 * o.t.dot(w) / b;
  h_np1[CRACK_OPENING] = k;
  if (tangent) soften_line(law, o, part * flexibility(c, o, w, k0, k, s), b, out.D);
  return true;
}

// does the stress S - R along another axis than that of o exceed the strength?
bool another_opens(const CrackLaw& c, const double* S, const double* R, const Opening& o)
{
  const double ft = crack_strength(c);
  if (c.dim == 2) return S[0] + S[1] - R[0] - R[1] - (o.t - o.w * o.beside) > ft;
  double left[6];
  for (int i = 0; i < 6; ++i) left[i] = S[i] - R[i];
  return !all_below(left, ft);
}

// may another axis than N be nearer to the crack?
bool crosses(const double* h, const Vec3& N)
{
  const double cosine = N.dot(Eigen::Map<const Vec3>(h + CRACK_NORMAL));
  return cosine * cosine < 0.5;
}

// does no crack begin along o.N, and are all other axes pressed? The closed crack in h turns with its axis
bool rests(const CrackLaw& c, const double* S, const Opening& o, double* h)
{
  if (o.t > crack_strength(c)) return false;
  const Mat3 full = full_tensor(S);
  const Vec3 B = other_axis(c, full, o.N), C = o.N.cross(B);
  if (B.dot(full * B) > 0.0 || (c.dim == 3 && C.dot(full * C) > 0.0)) return false;
  Eigen::Map<Vec3> N(h + CRACK_NORMAL);
  const bool second = c.dim == 2 || std::fabs(N.dot(B)) >= std::fabs(N.dot(C));
  if (std::fabs(N.dot(o.N)) > std::fabs(N.dot(second ? B : C))) return false;
  N = second ? B : C;
  return true;
}

}  // namespace

bool law_cohesive(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
                  bool tangent, LawOutput& out)
{
  const CrackLaw& c = law.crack;
  law_svk(law, finite, E, nullptr, nullptr, tangent, out);
  std::copy_n(h_n, CRACK_SIZE * CRACK_AXES, h_np1);
  if (h_n[CRACK_WIDTH] < 0.0) return law_line(law, h_n, h_np1, tangent, out);
  if (h_n[CRACK_SIZE + CRACK_OPENING] > 0.0) return law_cohesive_axes(law, h_n, h_np1, tangent, out);
  Opening o;
  const double limit = h_n[CRACK_WIDTH] == 0.0 ? crack_strength(c) : 0.0;
  o.t = largest_stress(c, out.S, limit);
  if (o.t <= limit) return true;                       // whole, or closed
  if (h_n[CRACK_OPENING] > 0.0 && o.t <= crack_no_stress(c)) keep_normal(out.S, h_n, o);
  else find_normal(c, out.S, o);
  if (o.t <= limit) return true;
  if (h_n[CRACK_OPENING] > 0.0 && crosses(h_n, o.N))
    return rests(c, out.S, o, h_np1) || law_cohesive_axes(law, h_n, h_np1, tangent, out);
  o.width  = h_n[CRACK_WIDTH] == 0.0 ? crack_width(c, o.N.data()) : h_n[CRACK_WIDTH];
  o.beside = (law.lam3 + 2.0 * law.mu) / o.width;
  crack_open_along(c, h_n[CRACK_OPENING], o);
  const double part = 1.0 - law.c;
  double R[6];
  crack_stress(law, o.N, o.w / o.width * o.N, R);
  if (another_opens(c, out.S, R, o)) return law_cohesive_axes(law, h_n, h_np1, tangent, out);
  for (int i = 0; i < 6; ++i) out.S[i] -= part * R[i];
  double released = released_energy(o);
  out.dissipated  = (dissipated_to(c, o.k) - dissipated_to(c, h_n[CRACK_OPENING])) / o.width;
  for (int i = 0; i < 3; ++i) h_np1[CRACK_NORMAL + i] = o.N[i];
  h_np1[CRACK_WIDTH]   = o.width;
  h_np1[CRACK_OPENING] = o.k;
  const double width = crack_next_width(c, o.width, h_n[CRACK_OPENING], o.k);
  if (width != o.width) {                              // the change of energy is dissipated
    Opening next = o;
    h_np1[CRACK_WIDTH] = next.width = width;
    next.beside = (law.lam3 + 2.0 * law.mu) / next.width;
    crack_open_along(c, o.k, next);
    h_np1[CRACK_OPENING] = next.k;
    out.dissipated += released_energy(next) - released;
    released = released_energy(next);
    // half the force belongs to the next increment, unless that returns to it at once
    if (c.tangent == CRACK_MEAN && next.k > o.k) {
      double R1[6];
      crack_stress(law, next.N, next.w / next.width * next.N, R1);
      for (int i = 0; i < 6; ++i) out.S[i] -= part * 0.5 * (R1[i] - R[i]);
    }
  }
  out.psi -= part * released;
  out.dissipated *= part;
  if (!tangent) return true;
  double S[6], intact[36];                             // S of the crack alone, without law.c
  for (int i = 0; i < 6; ++i) S[i] = out.S[i] - law.c * R[i];
  std::copy_n(out.D, 36, intact);
  if (c.tangent == CRACK_SECANT) soften_secant(law, o, out.D);
  else soften(law, o, full_tensor(E), full_tensor(S), out.D);
  for (int i = 0; i < 36; ++i) out.D[i] = law.c * intact[i] + part * out.D[i];
  return true;
}
