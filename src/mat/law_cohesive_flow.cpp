// ---------------------------------------------------------------------------
// law_cohesive_flow.cpp : cohesive cracks in plastic material                           (doc/theory.md 2.6)
//
// law_cohesive.cpp and law_cohesive_axes.cpp with the cone of law_drucker_prager.cpp as the law of the
// adjacent material, in the principal elastic trial strains e, which the openings w reduce:
//
//   tau = cone(e - sum of w_i/b_i N_i),  tau_i = f(k_i)/k_i w_i                                      (2.41)
//
// Compression causes flow, tension opens the cracks. STIFFNESS is the residual fraction of the elastic
// stiffness across a crack. One crack, until the stress along another axis reaches the strength. In plane
// stress the strain across the sheet follows from tau_33 = 0 at each w, where the cone alone has one: at a
// given strain across the sheet w, and with it tau_33, may jump.
// ---------------------------------------------------------------------------
#include <algorithm>
#include <cmath>

#include "mat/crack_axes.h"
#include "mat/hencky.h"
#include "mat/root.h"

namespace {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

// history, after the flow
enum { CRACK = FLOW_EQUIVALENT + 1, FLOW_WORK = CRACK + CRACK_SIZE * CRACK_AXES };
// relative to the elastic stiffness: lower bound where flow of the material makes the crack snap back
// (no test)
const double MIN_STIFFNESS = 1e-3;
// plane stress: least stiffness across the sheet, relative to mu; tau_33 relative to the stress; evaluations
// of tau_33, 1 to 6 by Newton's method, about 60 by bisection  (no test)
const double SOFT       = 1e-3;
const double ROUND      = 1e-14;
const int MAX_THICKNESS = 200;
// squares of stretches that differ by less, relative to the largest, are equal: their axes are those of the
// cracks  (test: CohesiveFlow.TurnedPathsAreTheSame)
const double SAME_AXES = 1e-9;
// several cracks, stress off equilibrium relative to that of the trial strains: aim; what is accepted where
// round-off of the cone ends the progress, and after MAX_ROUNDS over the axes  (no test)
const double FLOW_ROUND = 1e-14, FLOW_NEAR = 1e-11, FLOW_TOL = 1e-8;
const int MAX_ROUNDS = 20;
// tangent: largest shear modulus of two axes, relative to mu, where their strains are almost equal and their
// stresses are not  (no test)
const double MAX_SHEAR = 10.0;

// The crack along a principal axis
struct AxisCrack {
  int axis = 0;                // of the trial state
  double width = 0.0;          // of the band
  double k0 = 0.0;             // largest opening at t(n)
  double w = 0.0, k = 0.0;     // opening, the largest so far
  double s = 0.0;              // traction over w
};

// e3 of plane stress: tau_3 = 0 in the principal trial strains x, x(thick) the start. In c the strain across
// the sheet is eliminated in the plane
ConeState sheet_state(const MatLaw& law, Vec3& x, int thick, double a)
{
  double lo = -HUGE_VAL, hi = HUGE_VAL, away = 1e-4 + x.cwiseAbs().maxCoeff();
  ConeState b = cone_state(law, x, a);
  for (int it = 0; it < MAX_THICKNESS; ++it) {
    const double t3 = b.tau(thick), c33 = b.c(thick, thick), old = x(thick);
    if (std::fabs(t3) <= ROUND * b.tau.cwiseAbs().sum() || std::fabs(t3) <= 1e-15 * law.mu) break;
    (t3 > 0.0 ? hi : lo) = old;
    double next = c33 > 0.0 ? old - t3 / c33 : HUGE_VAL;
    if (!(next > lo && next < hi && std::fabs(next - old) <= 2.0 * away)) {
      next = std::isfinite(lo) && std::isfinite(hi) ? 0.5 * (lo + hi) : old + (t3 > 0.0 ? -away : away);
      away *= 2.0;
    }
    if (next == old) break;
    x(thick) = next;
    b = cone_state(law, x, a);
  }
  b.tau(thick) = 0.0;
  const Vec3 column = b.c.col(thick), row = b.c.row(thick);
  const double pivot = std::max(column(thick), SOFT * law.mu);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (i != thick && j != thick) b.c(i, j) -= column(i) * row(j) / pivot;
  return b;
}

// the same of the principal strains x without flow; across a sheet x follows
ConeState elastic_state(const MatLaw& law, Vec3& x, int thick, double a)
{
  const double lam = thick < 0 ? law.lam3 : law.lam;
  ConeState b;
  b.c = Mat3::Constant(lam) + 2.0 * law.mu * Mat3::Identity();
  if (thick >= 0) {
    b.c.row(thick).setZero();
    b.c.col(thick).setZero();
    x(thick) = -law.lam3 / (law.lam3 + 2.0 * law.mu) * (x.sum() - x(thick));
  }
  b.tau        = b.c * x;
  b.e          = x;
  b.psi        = 0.5 * b.tau.dot(x);
  b.dissipated = 0.0;
  b.equivalent = a;
  b.flows      = false;
  return b;
}

// The material and its cracks, at one strain
struct Cracked {
  const MatLaw& law;
  Vec3 e;                      // trial; across a sheet: of the last state
  double a;                    // equivalent plastic strain
  int thick;                   // axis across a sheet in plane stress, else -1
  int n;                       // cracks that may be open
  AxisCrack crack[CRACK_AXES];
  ConeState beside;            // of the material, at the openings
  bool may_flow = true;

  void find()
  {
    Vec3 x = e;
    for (int i = 0; i < n; ++i)
      if (crack[i].w != 0.0) x(crack[i].axis) -= crack[i].w / crack[i].width;
    beside = !may_flow   ? elastic_state(law, x, thick, a)
             : thick < 0 ? cone_state(law, x, a)
                         : sheet_state(law, x, thick, a);
    if (thick >= 0) e(thick) = x(thick);
  }
  // stress along the i-th axis at this opening
  double stress(int i, double w)
  {
    if (crack[i].w != w) {
      crack[i].w = w;
      find();
    }
    return stress(i);
  }
  double stress(int i) const { return beside.tau(crack[i].axis); }
  // is a crack open?
  bool opens() const
  {
    for (int i = 0; i < n; ++i)
      if (crack[i].w > 0.0) return true;
    return false;
  }
  // tension beyond which the i-th crack opens
  double limit(int i) const { return crack[i].k0 > 0.0 ? 0.0 : crack_strength(law.crack); }

  double elastic(int i) const { return (law.lam3 + 2.0 * law.mu) / crack[i].width; }
  double left(int i) const { return law.c * elastic(i); }
  // traction in loading to w; secant stiffness of unloading from k: force/length^2, /length
  double traction(int i, double w) const { return cohesion(law.crack, w).f + left(i) * w; }
  double secant(int i, double k) const { return cohesion(law.crack, k).f / k + left(i); }
  // derivative of the traction of an open crack
  double slope(int i) const
  {
    const AxisCrack& o = crack[i];
    return o.k > o.k0 ? cohesion(law.crack, o.k).slope + left(i) : o.s;
  }

  double stored() const
  {
    double sum = beside.psi;
    for (int i = 0; i < n; ++i)
      if (crack[i].w > 0.0) sum += 0.5 * crack[i].s * crack[i].w * crack[i].w / crack[i].width;
    return sum;
  }
  // by the cracks, since t(n)
  double dissipated() const
  {
    double sum = 0.0;
    for (int i = 0; i < n; ++i) {
      const AxisCrack& o = crack[i];
      if (o.k > o.k0) sum += (dissipated_to(law.crack, o.k) - dissipated_to(law.crack, o.k0)) / o.width;
    }
    return sum;
  }
};

void open_along(Cracked& c, int i, bool nested);

// stress along the i-th axis at this opening; nested: with those before it in equilibrium
double stress_at(Cracked& c, int i, double w, bool nested)
{
  c.stress(i, w);
  if (nested && i > 0) open_along(c, i - 1, true);
  return c.stress(i);
}

// w at equilibrium of stress and traction, nested by bisection; grows: beyond k0, else below
//   in   whole   stress without this crack
double opening(Cracked& c, int i, double whole, bool grows, bool nested)
{
  const int axis = c.crack[i].axis;
  const double k = c.crack[i].k0, width = c.crack[i].width;
  const auto excess = [&](double w, double* slope) {
    const double tau = stress_at(c, i, w, nested);
    *slope = nested && i > 0 ? 0.0
                             : -c.beside.c(axis, axis) / width -
                                   (grows ? cohesion(c.law.crack, w).slope + c.left(i) : c.secant(i, k));
    return tau - (grows ? c.traction(i, w) : c.secant(i, k) * w);
  };
  double lo = grows ? k : 0.0, hi = k, slope;
  if (grows)
    for (hi = std::max(2.0 * k, whole / c.elastic(i)); excess(hi, &slope) > 0.0;) hi *= 2.0;
  return decreasing_root(lo, lo, hi, excess);
}

// (2.41) along one axis, at the openings of the others, nested: of those after it
void open_along(Cracked& c, int i, bool nested)
{
  AxisCrack& o = c.crack[i];
  const double whole = stress_at(c, i, 0.0, nested);
  o.k = o.k0;
  o.s = 0.0;
  if (whole <= c.limit(i)) return;
  const bool grows = o.k0 == 0.0 || stress_at(c, i, o.k0, nested) > c.traction(i, o.k0);
  stress_at(c, i, opening(c, i, whole, grows, nested), nested);
  o.k = std::max(o.k0, o.w);
  o.s = c.secant(i, o.k);
}

// the largest stress that is off equilibrium; a crack that is shut carries any stress up to its limit
double off_balance(const Cracked& c)
{
  double largest = 0.0;
  for (int i = 0; i < c.n; ++i) {
    const AxisCrack& o = c.crack[i];
    largest = std::max(largest, o.w > 0.0 ? std::fabs(c.stress(i) - o.s * o.w) : c.stress(i) - c.limit(i));
  }
  return largest;
}

// a correction of Newton's method for the cracks that are open; false, and unchanged: it does not halve what
// is off balance
bool correct_all(Cracked& c)
{
  Mat3 K    = Mat3::Identity();
  Vec3 rest = Vec3::Zero();
  for (int i = 0; i < c.n; ++i) {
    if (c.crack[i].w == 0.0) continue;
    rest(i) = c.stress(i) - c.crack[i].s * c.crack[i].w;
    for (int j = 0; j < c.n; ++j)
      if (c.crack[j].w > 0.0) K(i, j) = c.beside.c(c.crack[i].axis, c.crack[j].axis);
    K(i, i) += c.crack[i].width * c.slope(i);
  }
  const Vec3 more = K.inverse() * rest;
  const double off = off_balance(c);
  AxisCrack before[CRACK_AXES];
  std::copy_n(c.crack, CRACK_AXES, before);
  const ConeState was = c.beside;
  const Vec3 e        = c.e;
  bool open = true;
  for (int i = 0; i < c.n; ++i) {
    AxisCrack& o = c.crack[i];
    if (o.w == 0.0) continue;
    o.w += o.width * more(i);
    open = open && o.w > 0.0;
    o.k  = std::max(o.w, o.k0);
    o.s  = c.secant(i, o.k);
  }
  if (open) c.find();
  if (open && off_balance(c) < 0.5 * off) return true;
  std::copy_n(before, CRACK_AXES, c.crack);
  c.beside = was;
  c.e      = e;
  return false;
}

// (2.41) along all axes: corrections of Newton's method, and one axis after the other where they fail. false:
// not found
//   in   size   stress of the trial strains
bool balance(Cracked& c, double size)
{
  double last = HUGE_VAL;
  for (int it = 0; it < MAX_ROUNDS; ++it) {
    while (off_balance(c) > FLOW_ROUND * size && correct_all(c)) continue;
    const double off = off_balance(c);
    if (off <= FLOW_ROUND * size || (off <= FLOW_NEAR * size && off > 0.5 * last)) return true;
    last = off;
    for (int i = 0; i < c.n; ++i) open_along(c, i, false);
  }
  return false;
}

// The openings: of several from those without flow; where flow has left so little stiffness that axes in turn
// part from each other, nested. false: not found
bool open_all(Cracked& c)
{
  if (c.n == 1) {
    open_along(c, 0, false);
    return true;
  }
  const double size = 2.0 * c.law.mu * c.e.cwiseAbs().maxCoeff() + c.law.lam3 * std::fabs(c.e.sum());
  c.may_flow = false;
  c.find();
  balance(c, size);
  c.may_flow = true;
  c.find();
  if (balance(c, size)) return true;
  open_along(c, c.n - 1, true);
  return off_balance(c) <= FLOW_TOL * size;
}

// ---- axes ----------------------------------------------------------------------------------------------

const double* crack_in(const double* h, int i) { return h + CRACK + CRACK_SIZE * i; }

// can a crack begin? Not in points that were elements: no width
bool may_begin(const CrackLaw& c) { return c.X || c.box[0] > 0.0; }

// the axes along which cracks may open, in 2D those in the plane; the largest strain, which is that of the
// largest stress, first. Returns their number
int open_axes(const CrackLaw& c, const HenckyTrial& t, int* axis)
{
  int n = 0;
  for (int i = 0; i < 3; ++i) {
    if (c.dim == 2 && std::fabs(t.n(2, i)) >= 0.5) continue;
    int at = n++;
    for (; at > 0 && t.e(axis[at - 1]) < t.e(i); --at) axis[at] = axis[at - 1];
    axis[at] = i;
  }
  return n;
}

// equal, or apart by round-off of an unloaded body: the stress is mu times the difference
bool same_strain(const MatLaw& law, const HenckyTrial& t, int i, int j)
{
  const double same = std::max(SAME_AXES * t.x.cwiseAbs().maxCoeff(), crack_no_stress(law.crack) / law.mu);
  return std::fabs(t.x(i) - t.x(j)) <= same;
}

// turns two axes of equal strain in their plane, the first towards a
void turn_axes(const Vec3& a, int first, int second, HenckyTrial& t)
{
  if (crack_turn(a, t.n.col(first), t.n.col(second)))
    t.M = t.L.transpose().triangularView<Eigen::Upper>().solve(t.n);
}

// gives each crack of t(n) the axis that is nearest to its normal, which moves with the material; axes of
// equal strain turn to it
void follow_cracks(const MatLaw& law, const double* h, int n, int* axis, HenckyTrial& t)
{
  for (int i = 0; i + 1 < n && crack_in(h, i)[CRACK_OPENING] > 0.0; ++i) {
    const Eigen::Map<const Vec3> N(crack_in(h, i) + CRACK_NORMAL);
    const auto cosine = [&](int j) { return std::fabs(N.dot(t.M.col(axis[j]))); };
    for (int j = i + 1; j < n; ++j)
      if (cosine(j) > cosine(i)) std::swap(axis[i], axis[j]);
    const Vec3 a = t.L.triangularView<Eigen::Lower>().solve(N);
    for (int j = i + 1; j < n; ++j)
      if (same_strain(law, t, axis[i], axis[j])) turn_axes(a, axis[i], axis[j], t);
  }
}

// axes of equal strain at the first crack turn to the first edge of the element
void turn_to_edge(const Cracked& c, HenckyTrial& t)
{
  const CrackLaw& law = c.law.crack;
  Vec3 edge = Vec3::Zero();
  for (int k = 0; k < law.dim && law.X; ++k) edge(k) = law.X[law.dim + k] - law.X[k];
  const int first = c.crack[0].axis;
  for (int j = 1; j < law.dim; ++j)
    if (same_strain(c.law, t, first, c.crack[j].axis)) turn_axes(edge, first, c.crack[j].axis, t);
}

// the axis across the sheet
int thickness_axis(const HenckyTrial& t)
{
  int at;
  t.n.row(2).cwiseAbs().maxCoeff(&at);
  return at;
}

// the strain across the sheet at the elastic trial strain e3 (2.24), with the plastic one in h_n
double thickness_strain(bool finite, const double* h_n, double e3)
{
  const double flow = h_n[FLOW_DEFORMATION + 2];
  return finite ? 0.5 * (std::expm1(2.0 * e3) - flow) / (1.0 + flow) : e3 - 0.5 * flow;
}

// the trial state of another e3; axes and all other strains stay as they are
void set_thickness(bool finite, const double* h_n, double e3, int thick, HenckyTrial& t, LawOutput& out)
{
  out.E33 = thickness_strain(finite, h_n, e3);
  t.e(thick) = e3;
  t.x(thick) = finite ? std::expm1(2.0 * e3) : 2.0 * e3;
  if (!finite) {
    t.LL(2, 2) = 2.0 * out.E33;
    return;
  }
  t.L(2, 2)  = std::sqrt(1.0 + 2.0 * out.E33);
  t.LL(2, 2) = 2.0 * out.E33;
  t.M(2, thick) = t.n(2, thick) / t.L(2, 2);
}

bool trial_of(bool finite, const double* strain, const double* h_n, bool sheet, HenckyTrial& t)
{
  double E[6];
  std::copy_n(strain, 6, E);
  if (sheet) E[2] = 0.0;
  if (finite) return hencky_trial(E, h_n, t);
  hencky_small(E, h_n, t);
  return true;
}

// the symmetric moduli with the cracks, in a sheet those of the plane
Mat3 cracked_moduli(const Cracked& c)
{
  const Mat3 D = 0.5 * (c.beside.c + c.beside.c.transpose());
  const CrackTangent tangent = c.law.crack.tangent;
  if (!c.opens()) return D;
  Mat3 N = Mat3::Zero(), K = Mat3::Identity() * (c.law.lam3 + 2.0 * c.law.mu);
  const auto open = [&](int i) { return c.crack[i].w > 0.0; };
  for (int i = 0; i < c.n; ++i) {
    const AxisCrack& o = c.crack[i];
    if (!open(i)) continue;
    N.col(i) = D.col(o.axis);
    if (c.thick >= 0) N(c.thick, i) = 0.0;
    for (int j = 0; j < c.n; ++j)
      if (open(j)) K(i, j) = D(o.axis, c.crack[j].axis);
    const bool onward = tangent == CRACK_ONWARD && o.w >= (1.0 - OPENING_TOL) * o.k;
    K(i, i) += o.width * (tangent == CRACK_SECANT ? o.s
                          : onward                ? cohesion(c.law.crack, o.k).slope + c.left(i)
                                                  : c.slope(i));
  }
  Eigen::SelfAdjointEigenSolver<Mat3> of(K);
  const Vec3 stiff = of.eigenvalues().cwiseMax(MIN_STIFFNESS * (c.law.lam3 + 2.0 * c.law.mu));
  const Mat3 A     = N * of.eigenvectors();
  return D - A * stiff.cwiseInverse().asDiagonal() * A.transpose();
}

// the normal of a crack at t = 0
Vec3 normal_of(const HenckyTrial& t, int axis) { return (t.L * t.n.col(axis)).normalized(); }

// widths of the cracks that have not opened
void find_widths(const HenckyTrial& t, Cracked& c)
{
  for (int i = 0; i < c.n; ++i)
    if (c.crack[i].k0 == 0.0)
      c.crack[i].width = crack_width(c.law.crack, normal_of(t, c.crack[i].axis).data());
}

// widths of the next increment; false: none changes
bool next_flow_widths(const HenckyTrial& t, Cracked& c)
{
  CrackBand band[CRACK_AXES];
  for (int i = 0; i < c.n; ++i) {
    const AxisCrack& o = c.crack[i];
    band[i] = {normal_of(t, o.axis), o.k0, o.k, o.width};
  }
  if (!crack_next_widths(c.law.crack, c.n, band)) return false;
  for (int i = 0; i < c.n; ++i) c.crack[i].width = band[i].width;
  return true;
}

// the widths follow the mean normal: updates widths and stored energy for the next increment; the change of
// energy is dissipated. false: the openings are not found
//   inout tau   principal stresses: with the new widths, unless the next increment returns to them at once
bool follow(const HenckyTrial& t, Cracked& c, LawOutput& out, Vec3& tau)
{
  if (!c.opens()) return true;
  Cracked next = c;
  if (!next_flow_widths(t, next)) return true;
  next.a = c.beside.equivalent;
  next.e = c.beside.e;
  for (int i = 0; i < c.n; ++i) {
    AxisCrack& o = next.crack[i];
    if (o.w > 0.0) next.e(o.axis) += o.w / c.crack[i].width;
    o.k0 = o.k;
    o.w  = 0.0;
  }
  next.find();
  if (!open_all(next)) return false;
  out.dissipated += out.psi - next.stored() - next.beside.dissipated;
  out.psi = next.stored();
  bool grows = false;
  for (int i = 0; i < c.n; ++i) {
    grows = grows || next.crack[i].k > c.crack[i].k;
    c.crack[i].width = next.crack[i].width;
    c.crack[i].k     = next.crack[i].k;
  }
  if (grows) tau = next.beside.tau;
  return true;
}

// open cracks first: those of t(n), which come first, stay open. A crack that is alone keeps its normal while
// all axes are pressed
void keep_cracks(const HenckyTrial& t, const Cracked& c, int axes, double* h)
{
  double* to = h + CRACK;
  double largest = c.stress(0);
  for (int i = 1; i < axes; ++i) largest = std::max(largest, c.stress(i));
  if (c.n == 1 && !c.opens() && largest <= 0.0) return;
  for (int i = 0; i < c.n; ++i) {
    const AxisCrack& o = c.crack[i];
    if (o.k > 0.0) to = crack_store(normal_of(t, o.axis), o.width, o.k, to);
  }
}

// the trial state and the cracks of t(n)
Cracked start(const MatLaw& law, const double* h_n, HenckyTrial& t, int& axes)
{
  const bool sheet = law.plane == PLANE_STRESS;
  int axis[3];
  axes = open_axes(law.crack, t, axis);
  if (crack_in(h_n, 0)[CRACK_OPENING] > 0.0) follow_cracks(law, h_n, axes, axis, t);
  Cracked c{law, t.e, h_n[FLOW_EQUIVALENT], sheet ? thickness_axis(t) : -1, 1, {}, {}, true};
  if (sheet) c.e(c.thick) = -law.lam3 / (law.lam3 + 2.0 * law.mu) * (t.e.sum() - t.e(c.thick));
  for (int i = 0; i < axes; ++i) {
    const double* crack = crack_in(h_n, i);
    c.crack[i].axis  = axis[i];
    c.crack[i].width = crack[CRACK_WIDTH];
    c.crack[i].k = c.crack[i].k0 = crack[CRACK_OPENING];
    if (crack[CRACK_OPENING] > 0.0 && i > 0) c.n = may_begin(law.crack) ? axes : i + 1;
  }
  c.find();
  return c;
}

// opens the cracks; all axes where the stress beside one reaches the strength. false: not found
bool open_cracks(int axes, HenckyTrial& t, Cracked& c)
{
  if (c.crack[0].k0 == 0.0) {
    if (c.stress(0) <= c.limit(0) || !may_begin(c.law.crack)) return true;
    turn_to_edge(c, t);
  }
  find_widths(t, c);
  if (!open_all(c)) return false;
  const auto exceeds = [&](int i) { return c.beside.tau(c.crack[i].axis) > crack_strength(c.law.crack); };
  if (c.n == axes || !may_begin(c.law.crack) || !(exceeds(1) || (axes == 3 && exceeds(2)))) return true;
  c.n = axes;
  find_widths(t, c);
  return open_all(c);
}

}  // namespace

bool law_cohesive_flow(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
                       bool tangent, LawOutput& out)
{
  std::copy_n(h_n, FLOW_WORK + 1, h_np1);
  const bool sheet = law.plane == PLANE_STRESS;
  // 1. trial; in plane stress e3 of elastic strain is where the search begins
  HenckyTrial t;
  if (!trial_of(finite, E, h_n, sheet, t)) return false;
  int axes;
  Cracked c = start(law, h_n, t, axes);
  const Vec3 tau = c.beside.tau;
  // 2. the cracks
  if (!open_cracks(axes, t, c)) return false;
  if (sheet) set_thickness(finite, h_n, c.e(c.thick), c.thick, t, out);
  hencky_stress(t, c.beside.tau, out.S);
  out.psi        = c.stored();
  out.dissipated = c.beside.dissipated + c.dissipated();
  // 3. history
  h_np1[FLOW_EQUIVALENT] = c.beside.equivalent;
  h_np1[FLOW_WORK]       = h_n[FLOW_WORK] + c.beside.dissipated;
  Vec3 end = c.beside.e;
  bool open = false;
  for (int i = 0; i < c.n; ++i) {
    if (c.crack[i].w > 0.0) end(c.crack[i].axis) += c.crack[i].w / c.crack[i].width;
    open = open || c.crack[i].k > 0.0;
  }
  if (c.beside.flows) hencky_flow(t, end, h_np1);
  const Mat3 D = tangent ? cracked_moduli(c) : Mat3();
  if (open) {
    Vec3 next = c.beside.tau;
    if (!follow(t, c, out, next)) return false;
    keep_cracks(t, c, axes, h_np1);
    // half the force belongs to the next increment
    if (law.crack.tangent == CRACK_MEAN) hencky_stress(t, 0.5 * (c.beside.tau + next), out.S);
  }
  // 4. tangent
  if (!tangent) return true;
  hencky_tangent(t, law.crack.tangent == CRACK_SECANT ? tau : c.beside.tau, D, out.D, MAX_SHEAR * law.mu);
  for (int i = 0; sheet && i < 6; ++i) out.D[12 + i] = out.D[6 * i + 2] = 0.0;
  return true;
}
