// ---------------------------------------------------------------------------
// law_cohesive_flow.cpp : cohesive crack in plastic material                            (doc/theory.md 2.6)
//
// law_cohesive.cpp with the cone of law_drucker_prager.cpp as the law of the adjacent material, in the
// principal elastic trial strains e, one of which the opening w reduces:
//
//   tau = cone(e - w/b N),  tau_N = f(k)/k w                                                         (2.41)
//
// Compression causes flow, tension opens the crack. STIFFNESS is the residual fraction of the elastic
// stiffness across the crack. In plane stress the strain across the sheet follows from tau_33 = 0 at each w,
// where the cone alone has one: at a given strain across the sheet w, and with it tau_33, may jump.
// ---------------------------------------------------------------------------
#include <algorithm>
#include <cmath>

#include "mat/crack.h"
#include "mat/hencky.h"
#include "mat/root.h"

namespace {

using Vec3 = Eigen::Vector3d;
using Mat3 = Eigen::Matrix3d;

enum { CRACK = FLOW_EQUIVALENT + 1, FLOW_WORK = CRACK + CRACK_SIZE };     // history, after the flow
// relative to the elastic stiffness: lower bound where flow of the material makes the crack snap back
// (no test)
const double MIN_STIFFNESS = 1e-3;
// plane stress: least stiffness across the sheet, relative to mu; tau_33 relative to the stress; evaluations
// of tau_33, 1 to 6 by Newton's method, about 60 by bisection  (no test)
const double SOFT       = 1e-3;
const double ROUND      = 1e-14;
const int MAX_THICKNESS = 200;

// The crack and the adjacent material, at one strain
struct Opened {
  ConeState beside;
  double width = 0.0;          // of the band
  double w = 0.0, k = 0.0;     // opening, the largest so far
  double s = 0.0;              // traction over w
  double flexible = 0.0;       // dw/dt
  double stored() const { return beside.psi + (width > 0.0 ? 0.5 * s * w * w / width : 0.0); }
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
  const Vec3 c3 = b.c.col(thick);
  const double pivot = std::max(c3(thick), SOFT * law.mu);
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      if (i != thick && j != thick) b.c(i, j) -= c3(i) * c3(j) / pivot;
  return b;
}

// The state before it opens
struct Closed {
  const MatLaw& law;
  Vec3 e;                      // trial; across a sheet: of the last state
  double a;                    // equivalent plastic strain
  int thick;                   // axis across a sheet in plane stress, else -1
  int axis;                    // of the opening
  double width;

  double elastic() const { return (law.lam3 + 2.0 * law.mu) / width; }
  double left() const { return law.c * elastic(); }
  ConeState at(double w)
  {
    Vec3 x = e;
    if (w != 0.0) x(axis) -= w / width;
    if (thick < 0) return cone_state(law, x, a);
    const ConeState b = sheet_state(law, x, thick, a);
    e(thick) = x(thick);
    return b;
  }
  // traction in loading to w; secant stiffness of unloading from k: force/length^2, /length
  double traction(double w) const { return cohesion(law.crack, w).f + left() * w; }
  double secant(double k) const { return cohesion(law.crack, k).f / k + left(); }
};

// w at equilibrium of stress and traction; grows: beyond k, else below
double opening(Closed& c, double k, bool grows)
{
  const auto excess = [&](double w, double* slope) {
    const ConeState b = c.at(w);
    *slope = -b.c(c.axis, c.axis) / c.width -
             (grows ? cohesion(c.law.crack, w).slope + c.left() : c.secant(k));
    return b.tau(c.axis) - (grows ? c.traction(w) : c.secant(k) * w);
  };
  double lo = grows ? k : 0.0, hi = k, slope;
  if (grows)
    for (hi = std::max(2.0 * k, c.at(0.0).tau(c.axis) / c.elastic()); excess(hi, &slope) > 0.0;) hi *= 2.0;
  return decreasing_root(lo, lo, hi, excess);
}

// (2.41) of a crack with the largest opening k so far
Opened open(Closed& c, double k)
{
  Opened o;
  o.beside = c.at(0.0);
  o.width  = c.width;
  o.k      = k;
  if (o.beside.tau(c.axis) <= (k > 0.0 ? 0.0 : crack_strength(c.law.crack))) return o;
  const bool grows = k == 0.0 || c.at(k).tau(c.axis) > c.traction(k);
  o.w      = opening(c, k, grows);
  o.k      = std::max(k, o.w);
  o.beside = c.at(o.w);
  const bool onward = c.law.crack.tangent == CRACK_ONWARD && o.w >= (1.0 - OPENING_TOL) * o.k;
  o.s               = c.secant(o.k);
  const bool secant = c.law.crack.tangent == CRACK_SECANT || !(grows || onward);
  const double gives =
      o.beside.c(c.axis, c.axis) / c.width + (secant ? o.s : cohesion(c.law.crack, o.k).slope + c.left());
  o.flexible = 1.0 / std::max(gives, MIN_STIFFNESS * c.elastic());
  return o;
}

// the axis of the largest elastic strain, which is that of the largest stress; in 2D: in the plane
int axis_of(const CrackLaw& c, const HenckyTrial& t)
{
  int best = -1;
  for (int i = 0; i < 3; ++i)
    if ((c.dim == 3 || std::fabs(t.n(2, i)) < 0.5) && (best < 0 || t.e(i) > t.e(best))) best = i;
  return best;
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

// the moduli with the crack: in a sheet those of the plane
void soften(double flexible, const Closed& c, Mat3& D)
{
  Vec3 N = D.col(c.axis);
  if (c.thick >= 0) N(c.thick) = 0.0;
  D -= flexible * N * N.transpose();
}

// the normal of the crack at t = 0
Vec3 normal_of(const HenckyTrial& t, int axis) { return (t.L * t.n.col(axis)).normalized(); }

// the width follows the mean normal: updates width and stored energy for the next increment; the change of
// energy is dissipated
//   inout tau   principal stresses: with the new width, unless the next increment returns to them at once
void follow(const Closed& c, const Opened& o, double before, double* h, LawOutput& out, Vec3& tau)
{
  const double width = crack_next_width(c.law.crack, o.width, before, o.k);
  if (width == o.width) return;
  Closed next{c.law, o.beside.e, o.beside.equivalent, c.thick, c.axis, width};
  next.e(c.axis) += o.w / c.width;
  const Opened then = open(next, o.k);
  h[CRACK_WIDTH]   = next.width;
  h[CRACK_OPENING] = then.k;
  out.dissipated += out.psi - then.stored() - then.beside.dissipated;
  out.psi = then.stored();
  if (then.k > o.k) tau = then.beside.tau;
}

}  // namespace

bool law_cohesive_flow(const MatLaw& law, bool finite, const double* E, const double* h_n, double* h_np1,
                       bool tangent, LawOutput& out)
{
  const CrackLaw& crack = law.crack;
  std::copy_n(h_n, FLOW_WORK + 1, h_np1);
  const bool sheet = law.plane == PLANE_STRESS;
  // 1. trial; in plane stress e3 of elastic strain is where the search begins
  HenckyTrial t;
  if (!trial_of(finite, E, h_n, sheet, t)) return false;
  Closed c{law, t.e, h_n[FLOW_EQUIVALENT], sheet ? thickness_axis(t) : -1, axis_of(crack, t),
           h_n[CRACK + CRACK_WIDTH]};
  if (sheet) c.e(c.thick) = -law.lam3 / (law.lam3 + 2.0 * law.mu) * (t.e.sum() - t.e(c.thick));
  Opened o;
  o.beside = c.at(0.0);
  const Vec3 tau = o.beside.tau;
  // 2. the crack
  const double k = h_n[CRACK + CRACK_OPENING];
  if (c.width > 0.0 || tau(c.axis) > crack_strength(crack)) {
    if (c.width == 0.0) c.width = crack_width(crack, normal_of(t, c.axis).data());
    o = open(c, k);
  }
  if (sheet) set_thickness(finite, h_n, c.e(c.thick), c.thick, t, out);
  hencky_stress(t, o.beside.tau, out.S);
  out.psi        = o.stored();
  out.dissipated = o.beside.dissipated;
  // 3. history
  h_np1[FLOW_EQUIVALENT] = o.beside.equivalent;
  h_np1[FLOW_WORK]       = h_n[FLOW_WORK] + o.beside.dissipated;
  Vec3 end = o.beside.e;
  if (o.w > 0.0) end(c.axis) += o.w / o.width;
  if (o.beside.flows) hencky_flow(t, end, h_np1);
  if (o.k > 0.0) {
    Eigen::Map<Vec3>(h_np1 + CRACK + CRACK_NORMAL) = normal_of(t, c.axis);
    h_np1[CRACK + CRACK_WIDTH]   = o.width;
    h_np1[CRACK + CRACK_OPENING] = o.k;
    out.dissipated += (dissipated_to(crack, o.k) - dissipated_to(crack, k)) / o.width;
    Vec3 next = o.beside.tau;
    if (o.w > 0.0) follow(c, o, k, h_np1 + CRACK, out, next);
    // half the force belongs to the next increment
    if (crack.tangent == CRACK_MEAN) hencky_stress(t, 0.5 * (o.beside.tau + next), out.S);
  }
  // 4. tangent
  if (!tangent) return true;
  Mat3 D = o.beside.c;
  if (o.w > 0.0) soften(o.flexible / o.width, c, D);
  hencky_tangent(t, crack.tangent == CRACK_SECANT ? tau : o.beside.tau, D, out.D);
  for (int i = 0; sheet && i < 6; ++i) out.D[12 + i] = out.D[6 * i + 2] = 0.0;
  return true;
}
