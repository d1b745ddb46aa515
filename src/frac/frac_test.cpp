#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "base/forest.h"
#include "base/timer.h"
#include "frac/frac_kink.h"
#include "frac/frac_scan.h"
#include "mat/law.h"
#include "shape/shape.h"

namespace {

const double PI = 3.14159265358979323846;
const double ROUNDING = 1.0 + 1e-9;    // round-off of a bound, relative to it  (no test)
// psi+/Gc of a candidate, relative to the largest of its competitors (behind_tip, theory 7.1). Lower: flanks
// of a crack break (A14); higher: it cannot branch (P8). Statics  (test: fracture/a10_turned.inp)
const double TIP_STATICS = 0.2;
// the same in motion  (test: fracture/a14_motion, paper/p8_compare)
const double TIP_MOTION = 0.4;
// parts of an increment: round-off of the time of a break must not separate a symmetric pair  (no test)
const double TIME_STEPS = 1e6;
const double LONG_AGO = -1e300;        // time of a criterion that falls and has been met before
// A crack kinks if the kink releases more by this factor: at a notch, with known direction, than straight
// growth; for a grown crack, than |J|. Up to K_II/K_I = 0.4, |J| has the direction of a kink. Staircases of
// the mesh have less gain, although they appear as shear, as do waves in dynamics (A14)
// (test: fracture/kink_inclined.inp)
const double KINK_GAIN = 1.05;
// (test: paper/p7_compare)
const double KINK_GAIN_GROWN = 1.15;
// (test: fracture/kink_motion.inp)
const double KINK_GAIN_MOTION = 1.15;
// relative difference of ranks of a symmetric pair, by the tolerance of Newton's method  (no test)
const double RANK_TOL = 1e-3;
// elements of a 3D front within this difference break together: |J| varies by it along a straight front.
// (test: fracture/interface_3d.inp)
const double FRONT_TOL = 0.03;
// energy over Gc h at which an element breaks that hangs on the other side of a crack by a node or an edge,
// which has no width: below that of a tip element (0.1 to 0.3, tetrahedra less)
// (test: fracture/sharp_notch.inp)
const double PINCHED = 0.05;
// cosine of the angle up to which cracked elements count as ahead of, or beside, an element that a
// front has left behind  (no test)
const double ALONG_COS = 0.7;
// the same of an element of a wake with cracked elements at opposite faces  (test: fracture/a10_strip_3d.inp)
const double LIGAMENT = 0.45;
// cosine between the directions to two opposite broken neighbours, 120 degrees  (no test)
const double OPPOSITE_COS = -0.5;

// ---- energy average in a ball                                                      (7.3), (7.4)

// weight of an element at the distance r in the average: 1 within radius - h, decreasing to 0 at radius + h.
// With a sharp ball G would jump with each element, by up to a sixth on aligned squares
double ball_weight(const Scan& s, int e, double radius, double r)
{
  return std::min(1.0, std::max(0.0, 0.5 * (radius - r) / s.fm.local[e] + 0.5));
}

// C = G / (energy density radius): the energy within r of a mode I tip is kappa G r in 2D, pi/2 kappa G r^2
// in 3D (7.4)
double ball_constant(const Scan& s, int e)
{
  const MatLaw& law = s.law(e);
  const double nu   = law.lam3 / (2.0 * (law.lam3 + law.mu));
  const bool stress = law.plane == PLANE_STRESS;
  double kappa = stress ? (5.0 - 3.0 * nu) / 8.0 : (5.0 - 8.0 * nu) / (8.0 * (1.0 - nu));
  if (s.def(e).drive == SPLIT_RCE)
    kappa = stress ? 0.5247 * (1.0 - nu * nu) : 0.5247 * (1.0 - 2.0 * nu) / ((1.0 - nu) * (1.0 - nu));
  const double x = s.fm.local[e] / radius_of(s, e), x2 = x * x;
  return s.m.dim == 2 ? PI / kappa * (1.0 + x2 / 3.0) : 8.0 / (3.0 * kappa) * (1.0 + x2) / (1.0 + x2 / 3.0);
}

// bound: from the total energy, an upper bound of psi+
double ball_estimate(Scan& s, int e, bool bound = false)
{
  const double radius = radius_of(s, e);
  double energy = 0.0, volume = 0.0;
  frac_in_ball(s.fm, &s.fm.centre[3 * e], radius + s.fm.local[e], [&](int o, double r) {
    if (s.removed(o) || s.el.initial_block[o] < 0 || frac_other_material(s.el, e, o)) return;
    const double w = ball_weight(s, e, radius, r) * s.fm.volume[o];
    volume += w;
    if (s.intact(o)) energy += (bound ? s.W[o] : drive_beside(s, e, o)) * w;
  });
  return volume > 0.0 ? ball_constant(s, e) * radius * energy / volume : 0.0;
}

// energy released by growth of a slot under stress along it; 0 for a sharp crack                    (7.35)
// (test: fracture/kink_inclined.inp), with b=15
double slot_release(const Scan& s, const Tip& t)
{
  const double lam = s.law(t.elem).lam, mu = s.law(t.elem).mu;
  const double modulus = 4.0 * mu * (lam + mu) / (lam + 2.0 * mu);
  const double width   = s.m.dim == 2 ? slot_width(s, t) : at_removed(s, t.elem) ? s.fm.local[t.elem] : 0.0;
  return 0.5 * width * t.along * t.along / modulus;
}

// BALL in 2D: the end of a notch near e without a crack yet, and the kink there; false: growth is straight. A
// row of removed elements must be straight, as in statics
bool notch_kinks(const Scan& s, int e, Tip& t, Kink& k)
{
  bool left = false, slot = false, found = false;
  frac_in_ball(s.fm, &s.fm.centre[3 * e], FRAC_NOTCH * s.fm.local[e] * AT_RADIUS, [&](int o, double) {
    left = left || s.broken(o);
    slot = slot || s.removed(o);
    Tip x;
    if (found || !s.intact(o) || !at_removed(s, o) || !crack_tip(s, o, x) || !x.given || !x.straight) return;
    t = x;
    found = true;
  });
  if (s.m.dim == 3 || left || (slot ? !found : !notch_end(s, e, t))) return false;
  if (!slot) modes_ahead(s, e, t);
  k = kink_of(t.ratio);
  return k.gain >= KINK_GAIN_MOTION;
}

// in element sizes: distance of an interface from the tip within which the crack is treated as sharp
// (test: fracture/crack_interface.inp, fracture/interface_motion.inp)
const double INTERFACE_DISTANCE = 3.0;
// in release times of an element, about 7 h/c_R: a tip without growth for longer is at rest
// (test: fracture/interface_motion.inp)
const double REST_TIME = 4.0;

// normal n of a crack that grows along d; in 3D d is the part of J perpendicular to n; false: none
bool crack_axes(const Scan& s, int e, const double* J, double* d, double* n)
{
  n[0] = -d[1];
  n[1] = d[0];
  n[2] = 0.0;
  if (s.m.dim == 2) return true;
  if (!crack_plane(s, e, n)) {                       // a single layer: as front_length
    double E[9];
    mean_strain(s, e, E);
    split_normal(s.law(e), 3, E, n);
  }
  const double off = J[0] * n[0] + J[1] * n[1] + J[2] * n[2];
  double size = 0.0;
  for (int i = 0; i < 3; ++i) {
    d[i] = J[i] - off * n[i];
    size += d[i] * d[i];
  }
  for (int i = 0; i < 3; ++i) d[i] /= std::sqrt(size);
  return size > 0.0;
}

// energy release of a sharp crack through the element ahead of a tip, over the estimate there
double sharp_share(Scan& s, int ahead)
{
  for (const auto& known : s.sharp)
    if (known.first == ahead) return known.second;
  double x[3], d[3] = {0, 0, 0}, n[3], J[3], share = 1.0;
  const bool force = estimate_of(s, ahead) == ESTIMATE_FORCE;
  const double h = s.fm.local[ahead], radius = force ? radius_of(s, ahead) : FRAC_NOTCH * h;
  const bool face = crack_face(s, ahead, x, d);
  double way[3]   = {d[0], d[1], d[2]};
  grown_along(s, ahead, &s.fm.centre[3 * ahead], radius, 0.0, way);
  if (face && near_interface(s, x, INTERFACE_DISTANCE * h, way)) {
    const double G0 = force ? force_estimate(s, ahead, radius, J) : ball_estimate(s, ahead);
    std::copy_n(way, 3, d);
    const double G = crack_axes(s, ahead, J, d, n) ? sharp_release(s, ahead, x, d, n) : 0.0;
    if (G > 0.0) share = G / G0;
  }
  s.sharp.emplace_back(ahead, share);
  return share;
}

// BALL in 2D, near an interface, for a tip at rest: energy release of a sharp crack, over G. The mean in the
// ball assumes the tip field of one material
double rest_share(Scan& s, int e)
{
  const double *c = &s.fm.centre[3 * e], h = s.fm.local[e];
  if (s.m.dim == 3 || !near_interface(s, c, (INTERFACE_DISTANCE + 1.0) * h)) return 1.0;
  double last = -1e300, d[3];
  frac_in_ball(s.fm, c, FRAC_NOTCH * h * AT_RADIUS, [&](int o, double) {
    if (s.broken(o)) last = std::max(last, s.fr.time[o]);
  });
  if (s.l.time - last < REST_TIME * s.fm.release[e]) return 1.0;
  if (!grown_along(s, e, c, FRAC_NOTCH * h, 0.0, d)) return 1.0;
  const int ahead = element_ahead(s, e, d);
  return ahead >= 0 && s.intact(ahead) && s.fm.def[ahead] >= 0 ? sharp_share(s, ahead) : 1.0;
}

// BALL: within 5 h of the end of a notch also J, which is accurate from the first element on; the ball is a
// fifth too high, because a void has no volume  (7.7). Near an interface: sharp crack  (7.38)
double estimate(Scan& s, int e, double* J)
{
  for (int i = 0; i < 3; ++i) J[i] = 0.0;
  if (estimate_of(s, e) == ESTIMATE_FORCE) return force_estimate(s, e, radius_of(s, e), J);
  const double G = ball_estimate(s, e), radius = FRAC_NOTCH * s.fm.local[e];
  if (G < s.fm.gc[e]) return G;
  const double share = rest_share(s, e);
  if (share != 1.0 || !at_notch(s, e, radius)) return G * share;
  double F[3];
  Tip t;
  Kink k;
  double by_force = force_estimate(s, e, radius, F);
  if (notch_kinks(s, e, t, k)) by_force = k.gain * (F[0] * t.d[0] + F[1] * t.d[1] - slot_release(s, t));
  return std::min(G, by_force);
}

// threshold of one element: Gc h t                                                   (7.1)
double threshold(const Scan& s, int e)
{
  const double h = s.fm.size[e];
  return s.fm.gc[e] * (s.m.dim == 2 ? h * s.fm.thickness[e] : h * h);
}

// ---- gates

double spacing_of(const Scan& s, int e)
{
  const FractureDef& d = s.def(e);
  return (d.spacing >= 0.0 ? d.spacing : s.dynamic() ? FRAC_SPACING : 0.0) * s.fm.local[e];
}

// a crack may start without a broken neighbour: at removed elements always, elsewhere with START
bool start_allowed(const Scan& s, int e)
{
  return s.def(e).start || at_removed(s, e);
}

// psi+ / volume over toughness, to compare elements                                    1/length
double relative_drive(Scan& s, int e) { return drive_of(s, e) / s.fm.gc[e]; }

// a competing element: of an *EIGENFRACTURE, intact, in tension, at a crack or where a crack may start, with
// a relative drive above the limit
bool competes(Scan& s, int o, double limit)
{
  if (s.fm.def[o] < 0 || s.W[o] <= limit * s.fm.gc[o]) return false;   // psi+ <= W
  if (relative_drive(s, o) <= limit || !(largest_stress(s, o) > 0.0)) return false;
  return at_crack(s, o) || touches_broken(s, o) || start_allowed(s, o);
}

// is the drive small compared with the strongest competitor: FORCE: in its ball, BALL in dynamics: within
// SPACING? G of the ball, and |J|, are similar for all elements near a tip, also behind it; on an aligned
// mesh the neighbours of the tip element have a third of its energy, those behind it a tenth.
// FORCE compares the energies as well: a weak element ahead makes no tip behind it
// (test: fracture/weak_ahead.inp)
bool behind_tip(Scan& s, int e)
{
  const bool force = estimate_of(s, e) == ESTIMATE_FORCE;
  if (!force && (!s.dynamic() || s.def(e).order == ORDER_ALL)) return false;
  const double reach = force ? radius_of(s, e) : spacing_of(s, e),
               limit = relative_drive(s, e) / (force ? TIP_STATICS : TIP_MOTION),
               least = force ? drive_of(s, e) / TIP_STATICS : 0.0;
  bool found = false;
  frac_in_ball(s.fm, &s.fm.centre[3 * e], reach * AT_RADIUS,
            [&](int o, double) { found = found || (competes(s, o, limit) && drive_of(s, o) > least); });
  return found;
}

// is e connected to a crack in its ball, by breakable elements of the ball?
bool crack_reaches(const Scan& s, int e)
{
  const bool force  = estimate_of(s, e) == ESTIMATE_FORCE;
  const auto is_end = [&](int o) { return force ? s.cracked(o) : s.broken(o); };
  IntVec ball, todo(1, e);
  bool any = false;
  in_ball(s, e, [&](int o, double) {
    if (o != e && (is_end(o) || (s.fm.def[o] >= 0 && s.intact(o)))) ball.push_back(o);
    any = any || is_end(o);
  });
  std::sort(ball.begin(), ball.end());
  std::vector<char> seen(ball.size(), 0);
  for (size_t next = 0; any && next < todo.size(); ++next) {
    const int nen = s.m.mesh.conn.count(todo[next]), *node = s.m.mesh.conn.begin(todo[next]);
    for (int a = 0; a < nen; ++a)
      for (int k = 0; k < s.fm.of_node.count(node[a]); ++k) {
        const int o   = s.fm.of_node.begin(node[a])[k];
        const auto at = std::lower_bound(ball.begin(), ball.end(), o);
        if (at == ball.end() || *at != o || seen[at - ball.begin()]) continue;
        if (is_end(o)) return true;
        seen[at - ball.begin()] = 1;
        todo.push_back(o);
      }
  }
  return false;
}

// may a crack start at e: no crack reaches it, and its relative drive exceeds that of its neighbours and of
// the competitors in its ball
bool may_start(Scan& s, int e)
{
  if (crack_reaches(s, e)) return false;
  const double limit = (1.0 + RANK_TOL) * relative_drive(s, e);
  if (beside(s, e, [&](int o) { return competes(s, o, limit); })) return false;
  bool good = true;
  in_ball(s, e, [&](int o, double) { good = good && !competes(s, o, limit); });
  return good;
}

// cosine of the directions of a crack in the ball and in half of it, 20 degrees; below: bent.
// (test: fracture/kink_inclined.inp)
const double BENT_COS = 0.94;

// the order: J along the direction from the broken elements of the ball, so that the path does not follow
// mesh lines; a kink by its own direction, not that of the crack before it; in 3D without the component along
// the front: elements of a plane front have equal rank (7.8)
double force_rank(const Scan& s, int e, const double* J, double G)
{
  double d[3], near[3], n[3];
  const double *x = &s.fm.centre[3 * e], radius = radius_of(s, e);
  if (!grown_along(s, e, x, radius, 0.0, d)) return G;
  if (s.m.dim == 2 && grown_along(s, e, x, 0.5 * radius, 0.0, near) &&
      d[0] * near[0] + d[1] * near[1] < BENT_COS)
    std::copy_n(near, 3, d);
  const double ahead = J[0] * d[0] + J[1] * d[1] + J[2] * d[2];
  if (s.m.dim == 2 || ahead <= 0.0 || !crack_plane(s, e, n)) return ahead;
  const double size = std::hypot(J[0], J[1], J[2]), off = d[0] * n[0] + d[1] * n[1] + d[2] * n[2];
  return ahead / std::hypot(ahead / size, off);
}

// does e hang on a node, or edge, of the crack that its neighbours across faces do not share with all others?
// There two sides of a crack meet, as at the end of a sharp notch beside which the first element has broken
bool pinched(const Scan& s, int e)
{
  const int nen = s.m.mesh.conn.count(e), *node = s.m.mesh.conn.begin(e);
  for (int a = 0; a < nen; ++a) {
    IntVec fan, seen(1, e);
    bool crack = false;
    for (int k = 0; k < s.fm.of_node.count(node[a]); ++k) {
      const int o = s.fm.of_node.begin(node[a])[k];
      crack = crack || s.broken(o);
      if (s.intact(o)) fan.push_back(o);
    }
    for (size_t next = 0; crack && next < seen.size(); ++next)
      beside(s, seen[next], [&](int o) {
        const bool of_fan = std::find(fan.begin(), fan.end(), o) != fan.end();
        if (of_fan && std::find(seen.begin(), seen.end(), o) == seen.end()) seen.push_back(o);
        return false;
      });
    if (crack && seen.size() < fan.size()) return true;
  }
  return false;
}

// has any definition a fallback?
bool may_fall_back(const Scan& s)
{
  return std::any_of(s.m.fracture.begin(), s.m.fracture.end(), [&](const FractureDef& d) {
    const bool force = d.estimate == ESTIMATE_FORCE || (d.estimate == ESTIMATE_AUTO && !s.dynamic());
    return d.fallback > 0.0 || (d.fallback < 0.0 && force);
  });
}

// a ligament in space: with cracked elements at opposite faces
bool is_ligament(const Scan& s, int e)
{
  if (s.m.dim == 2) return false;
  double way[6][3], mid[3];
  int n = 0;
  for (int f = 0; f < shape_info[s.el.block[s.el.initial_block[e]].shape].nface; ++f)
    if (s.fm.across[6 * e + f] >= 0 && s.cracked(s.fm.across[6 * e + f]))
      face_of(s.m.mesh, e, f, mid, way[n++]);
  bool found = false;
  for (int a = 0; a < n; ++a)
    for (int b = 0; b < a; ++b) {
      double dot = 0.0;
      for (int i = 0; i < 3; ++i) dot += way[a][i] * way[b][i];
      const double sizes = std::hypot(way[a][0], way[a][1], way[a][2]) *
                           std::hypot(way[b][0], way[b][1], way[b][2]);
      found = found || dot < OPPOSITE_COS * sizes;
    }
  return found;
}

// in space: has a front left e behind? Cracked elements at its nodes lie ahead, along J, and none on either
// side of the plane perpendicular to the largest stress, as beside a crack
bool left_behind(const Scan& s, int e)
{
  double E[9], n[3], J[3];
  mean_strain(s, e, E);
  split_normal(s.law(e), 3, E, n);
  force_estimate(s, e, radius_of(s, e), J);
  const double size = std::hypot(J[0], J[1], J[2]);
  const int nen = s.m.mesh.conn.count(e), *node = s.m.mesh.conn.begin(e);
  bool ahead = false, side = false;
  for (int a = 0; a < nen; ++a)
    for (int k = 0; k < s.fm.of_node.count(node[a]); ++k) {
      const int o = s.fm.of_node.begin(node[a])[k];
      if (!s.cracked(o)) continue;
      double r = 0.0, off = 0.0, on = 0.0;
      for (int i = 0; i < 3; ++i) {
        const double d = s.fm.centre[3 * o + i] - s.fm.centre[3 * e + i];
        r += d * d;
        off += d * n[i];
        on += d * J[i];
      }
      side  = side || std::fabs(off) > ALONG_COS * std::sqrt(r);
      ahead = ahead || on > ALONG_COS * size * std::sqrt(r);
    }
  return ahead && !side;
}

// part of Gc h at which e breaks where no candidate does: given, or of a ligament
double fallback_of(const Scan& s, int e)
{
  const double given = s.def(e).fallback;
  if (given >= 0.0) return given;
  if (estimate_of(s, e) != ESTIMATE_FORCE || s.W[e] * s.fm.volume[e] < PINCHED * threshold(s, e)) return 0.0;
  return pinched(s, e) || (s.m.dim == 3 && left_behind(s, e)) ? PINCHED : is_ligament(s, e) ? LIGAMENT : 0.0;
}

// a crack contains its direction of growth: removes the component of N along J
void remove_along(const double* J, double* N)
{
  const double JJ = J[0] * J[0] + J[1] * J[1] + J[2] * J[2];
  if (JJ == 0.0) return;
  const double along = (N[0] * J[0] + N[1] * J[1] + N[2] * J[2]) / JJ;
  double n[3], norm = 0.0;
  for (int i = 0; i < 3; ++i) {
    n[i] = N[i] - along * J[i];
    norm += n[i] * n[i];
  }
  if (norm < 1e-6) return;
  for (int i = 0; i < 3; ++i) N[i] = n[i] / std::sqrt(norm);
}

bool near_crack(const Scan& s, int e)
{
  bool found = false;
  in_ball(s, e, [&](int o, double) { found = found || s.cracked(o); });
  return found;
}

// ---- candidates

// in element sizes: length of a kink (theory 7.1)  (no test)
const double KINK_LENGTH = 3.0;
// cosine between the direction from a crack into an element and the direction, or plane, of the crack; below,
// or with a centre further off the plane (in element sizes), the element is beside the crack, and its
// breaking is a kink  (test: K7)
const double BESIDE_COS = 0.5, BESIDE_DISTANCE = 0.6;
// in element sizes: distance along the crack from the centre of cracked elements within 2.5; below: a flank
// (no test)
const double MIDDLE_DISTANCE = 0.5;

const int MAX_KINK = 16;       // elements of a kink, of a length of three  (no test)

// A candidate, with all data for the choice over all ranks
struct Candidate {
  Erosion x;
  double ball = 0.0;           // FORCE: distance within which the candidate of the highest rank decides
  double spacing  = 0.0;       // between elements that break in one test
  double fallback = 0.0;       // by_element: fraction of Gc h that breaks it
  bool griffith = false, force = false, order_all = false;
  double level = RANK_TOL;     // relative difference of equal ranks
  int front = -1, front_label = 0;
  bool decides = false;        // at a straight initial crack: other elements of the ball are beside it
  bool at_front = false;       // in space, itself at the front of the crack
  double flanks = 0.0;         // radius of that ball
  // mixed mode: the elements of the kink
  int nkink = 0;
  Erosion kink[MAX_KINK];
};

Erosion erosion_of(const Scan& s, int e, double value, double rank, const double* J)
{
  const double* X = &s.fm.centre[3 * e];
  return {e, value, rank, {J[0], J[1], J[2]}, 0.0, s.m.part.elem_number(e), s.m.mesh.elem_label[e],
          s.fm.def[e], {X[0], X[1], X[2]}};
}

Candidate candidate(const Scan& s, int e, double value, double rank, const double* J)
{
  const FractureDef& d = s.def(e);
  Candidate c;
  c.x = erosion_of(s, e, value, rank, J);
  c.ball      = radius_of(s, e) * AT_RADIUS;
  c.spacing   = spacing_of(s, e);
  c.griffith  = d.criterion == CRITERION_GRIFFITH;
  c.force     = c.griffith && estimate_of(s, e) == ESTIMATE_FORCE;
  c.order_all = d.order == ORDER_ALL;
  if (c.force && s.m.dim == 3) c.level = FRONT_TOL;
  c.front       = c.x.number;
  c.front_label = c.x.label;
  return c;
}

void scale(double share, Candidate& c)
{
  c.x.gain *= share;
  c.x.value *= share;
  c.x.rank *= share;
}

double distance(const Candidate& a, const Candidate& b)
{
  const double *x = a.x.X, *y = b.x.X;
  return std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]);
}

void find_energies(const RealVec& energy, Scan& s)
{
  const size_t nelem = s.fm.size.size();
  s.W.assign(nelem, 0.0);
  s.drive.assign(nelem, -1.0);
  if (!frac_uses_energy(s.m)) return;
  for (size_t e = 0; e < nelem; ++e)
    if (s.intact(static_cast<int>(e))) s.W[e] = energy[e] / s.fm.volume[e];
  frac_share(s.m.part, s.W);
  for (size_t e = 0; e < nelem; ++e)
    if (s.averaged(static_cast<int>(e)) && s.W[e] > 0.0) s.W[e] = std::max(s.W[e], s.fr.mean[e]);
}

// gathers the candidates of all ranks, in the order of one rank
void join(std::vector<Candidate>& all)
{
  if (comm_size() == 1) return;
  comm_allgatherv(all);
  std::sort(all.begin(), all.end(),
            [](const Candidate& a, const Candidate& b) { return a.x.number < b.x.number; });
}

// psi+ of the element against the threshold                                          (7.1)
void by_element(Scan& s, int e, double part, std::vector<Candidate>& out)
{
  const double need = part * threshold(s, e);
  // psi+ <= total energy
  if (s.W[e] * s.fm.volume[e] < need) return timer_skip(PHASE_ESTIMATE);
  ++timer_phase(PHASE_ESTIMATE).calls;
  const double value = drive_of(s, e) * s.fm.volume[e] / threshold(s, e);
  const double none[3] = {0, 0, 0};
  if (value < part || !(start_allowed(s, e) || near_crack(s, e))) return;
  out.push_back(candidate(s, e, value, value, none));
  out.back().fallback = part;
}

// is there an element that opens against a traction?
bool opens(const Model& m)
{
  return std::any_of(m.fracture.begin(), m.fracture.end(),
                     [](const FractureDef& f) { return f.criterion == CRITERION_COHESIVE; });
}

// COHESIVE: no traction at all Gauss points along one axis
void by_cohesion(const Scan& s, int e, std::vector<Candidate>& out)
{
  if (!elem_cracked(s.l, e)) return;
  const double end  = crack_open(crack_of(s.def(e)));
  const MatLaw& law = s.el.block[s.el.initial_block[e]].law;
  const double* main = elem_main_crack(s.el, s.l, e);
  double least = 1e300, k;
  for (int g = s.el.gauss_of[e]; g < s.el.gauss_of[e + 1] && main; ++g) {
    crack_normal_like(law, history_at(s.l.he, s.el.history, g), main, &k);
    least = std::min(least, k / end);
  }
  if (!main) return;
  const double none[3] = {0, 0, 0};
  if (least >= 1.0) out.push_back(candidate(s, e, least, least, none));
}

// BALL: the criterion cannot be met with W_max, the largest energy / volume of the elements of this rank and
// their halo, which have the ball
bool out_of_reach(const Scan& s, int e, double W_max)
{
  return ball_constant(s, e) * radius_of(s, e) * W_max * ROUNDING < s.fm.gc[e];
}

// adds the elements along the kink of the tip t from x, with the value of c; false: there are none
bool take_line(const Scan& s, const Tip& t, const double* x, const Kink& k, double value, Candidate& c)
{
  const int e = c.x.elem;
  const double cosine = std::cos(k.angle), sine = std::sin(k.angle), G = value * s.fm.gc[e];
  double go[3] = {t.d[0] * cosine - t.d[1] * sine, t.d[0] * sine + t.d[1] * cosine, 0.0};
  for (int i = 0; i < 3 && s.m.dim == 3; ++i) go[i] = t.d[i] * cosine + t.n[i] * sine;
  const double J[3] = {G * go[0], G * go[1], G * go[2]};
  IntVec line;
  if (!along_line(s, e, x, go, KINK_LENGTH * s.fm.local[e], line)) return false;
  c.nkink = std::min<int>(MAX_KINK, line.size());
  for (int i = 0; i < c.nkink; ++i) c.kink[i] = erosion_of(s, line[i], value, value, J);
  return true;
}

// BALL: the same at the end of a notch
void take_notch(const Scan& s, Candidate& c)
{
  Tip t;
  Kink k;
  if (!notch_kinks(s, c.x.elem, t, k)) return;
  take_line(s, t, t.end, k, c.x.value, c);
}

// FORCE: a crack in mixed mode kinks to the largest energy release, gain times that of straight growth;
// the elements of the kink break together, since J of the ball does not include it yet
//   in   J   of (7.5)
void take_kink(const Scan& s, const double* J, Candidate& c)
{
  const int e = c.x.elem;
  double x[3], into[3];
  Tip t;
  if (s.m.dim == 3) {
    if (!space_tip(s, e, J, t)) return;
    c.at_front = true;
  } else if (crack_face(s, e, x, into)) {
    if (!crack_tip(s, e, t)) return;
  } else {
    if (!notch_end(s, e, t)) return;
    modes_ahead(s, e, t);
  }
  const Kink k = kink_of(t.ratio);
  double G     = (J[0] * t.d[0] + J[1] * t.d[1] + J[2] * t.d[2]) / s.fm.gc[e] * k.gain;
  if (t.given ? k.gain < KINK_GAIN : G < KINK_GAIN_GROWN * c.x.value) return;
  if (t.given) G -= slot_release(s, t) / s.fm.gc[e] * k.gain;
  if (!take_line(s, t, t.face, k, G, c)) return;
  c.decides = t.given && t.straight;
  c.flanks  = std::max(c.ball, FRAC_RADIUS_FORCE * s.fm.local[e]);
  c.x.gain  = G / c.x.value;
  c.x.value = G;
}

// is e at the end of a slot from which a crack kinks? Flanks of the slot may have more energy
bool kinks(const Scan& s, int e)
{
  Tip t;
  double J[3];
  if (estimate_of(s, e) != ESTIMATE_FORCE || !at_initial(s, e)) return false;
  if (s.m.dim == 3) force_estimate(s, e, radius_of(s, e), J);
  return (s.m.dim == 2 ? crack_tip(s, e, t) : space_tip(s, e, J, t)) && t.given && t.straight &&
         kink_of(t.ratio).gain >= KINK_GAIN;
}

// FORCE: near an interface G changes within an element, and J includes the blunt end of a row. In 3D only
// bricks with more than half of their toughness; jagged fronts of tetrahedra have no such tip
void take_interface(Scan& s, const double* J, Candidate& c)
{
  const int e = c.x.elem;
  double x[3], into[3];
  if (s.fm.between.empty()) return;
  if (s.m.dim == 3 && (c.x.value < 0.5 || s.el.block[s.el.initial_block[e]].shape != SHAPE_HEX8)) return;
  if (s.m.dim == 3 && !crack_face(s, e, x, into)) return;
  const double size = std::hypot(J[0], J[1], J[2]);
  const bool front  = s.m.dim == 3 && J[0] * into[0] + J[1] * into[1] + J[2] * into[2] > BESIDE_COS * size;
  const int ahead   = front ? e : element_ahead(s, e, J);
  if (ahead < 0 || !s.intact(ahead)) return;
  scale(sharp_share(s, ahead), c);
}

// FORCE: an element beside a crack releases the energy of a kink of that angle. If the element ahead is
// tougher, or unbreakable, |J| would break the flanks
//   in   J   of (7.5), 0: not known
void take_beside(const Scan& s, const double* J, Candidate& c)
{
  const int e = c.x.elem;
  double x[3], into[3], n[3], mid[3], way[3] = {J[0], J[1], J[2]}, off = 0.0, away = 0.0;
  if (!crack_face(s, e, x, into) || !crack_plane(s, e, n, mid)) return;
  for (int i = 0; i < 3; ++i) {
    off += n[i] * into[i];
    away += n[i] * (s.fm.centre[3 * e + i] - mid[i]);
  }
  double ways = std::sqrt(std::max(0.0, 1.0 - off * off));
  const double size = std::hypot(J[0], J[1], J[2]);
  if (size > 0.0) {
    ways = std::max(ways, (J[0] * into[0] + J[1] * into[1] + J[2] * into[2]) / size);
  } else {                                           // from the centre of the crack, in its plane
    for (int i = 0; i < 3; ++i) way[i] = s.fm.centre[3 * e + i] - mid[i] - away * n[i];
    if (std::hypot(way[0], way[1], way[2]) < 0.5 * s.fm.local[e]) return;
  }
  if (std::fabs(away) > BESIDE_DISTANCE * s.fm.local[e]) ways = 0.0;
  if (ways >= BESIDE_COS || !blocked(s, e, way)) return;
  const double share = kink_share(std::acos(std::max(0.0, ways)));
  scale(share, c);
  c.x.rank = std::max(c.x.rank, c.x.value);          // share has the angle; J . d would count it twice
}

// a kink: replaces the element at the tip by the elements of the kink
void take_kinks(const MeshPart& part, std::vector<Candidate>& all)
{
  std::vector<Candidate> out;
  for (const Candidate& c : all) {
    if (c.nkink == 0) out.push_back(c);
    for (int i = 0; i < c.nkink; ++i) {
      bool twice = false;                            // also given by another element at the same tip
      for (const Candidate& o : out) twice = twice || o.x.number == c.kink[i].number;
      if (twice) continue;
      out.push_back(c);
      out.back().x = c.kink[i];
      out.back().x.elem = part.elem_here(c.kink[i].number);
    }
  }
  all.swap(out);
}

// FORCE: is e at a flank of a removed slot, away from its ends?
// (test: fracture/kink_inclined.inp), with b=15
bool flank(const Scan& s, int e)
{
  double n[3], mid[3], off = 0.0, apart = 0.0;
  if (estimate_of(s, e) != ESTIMATE_FORCE || !at_initial(s, e)) return false;
  if (!crack_plane(s, e, n, mid) && (s.m.dim == 2 || !side_normal(s, e, n))) return false;
  for (int i = 0; i < 3; ++i) off += n[i] * (s.fm.centre[3 * e + i] - mid[i]);
  for (int i = 0; i < 3; ++i) {
    const double along = s.fm.centre[3 * e + i] - mid[i] - off * n[i];
    apart += along * along;
  }
  return std::fabs(off) > BESIDE_DISTANCE * s.fm.local[e] &&
         std::sqrt(apart) < MIDDLE_DISTANCE * s.fm.local[e];
}

void by_griffith(Scan& s, int e, double W_max, std::vector<Candidate>& out)
{
  const double least = FRAC_MIN_DRIVE * s.fm.gc[e] / s.fm.size[e];
  if (s.W[e] <= least) return;
  const bool force = estimate_of(s, e) == ESTIMATE_FORCE;
  if (!force && out_of_reach(s, e, W_max)) return timer_skip(PHASE_ESTIMATE);
  if (!force && ball_estimate(s, e, true) * ROUNDING < s.fm.gc[e]) return timer_skip(PHASE_ESTIMATE);
  if (!(largest_stress(s, e) > 0.0) || drive_of(s, e) <= least) return;
  const bool at = at_crack(s, e);
  if (at ? behind_tip(s, e) && !kinks(s, e) : !start_allowed(s, e) || !may_start(s, e)) return;
  if (at && flank(s, e)) return;
  double J[3];
  ++timer_phase(PHASE_ESTIMATE).calls;
  const double G = estimate(s, e, J);
  if (G < s.fm.gc[e] && !force) return;              // FORCE: decided in keep_fronts
  const double rank = force ? force_rank(s, e, J, G) : drive_of(s, e) * s.fm.size[e];
  const double F[3] = {J[0], J[1], J[2]};
  if (!at) J[0] = J[1] = J[2] = 0.0;                 // no crack yet
  out.push_back(candidate(s, e, G / s.fm.gc[e], rank / s.fm.gc[e], J));
  if (force) take_kink(s, F, out.back());
  if (!force && at_notch(s, e, FRAC_NOTCH * s.fm.local[e])) take_notch(s, out.back());
  if (force && at && out.back().nkink == 0) take_interface(s, F, out.back());
  if (at && out.back().nkink == 0) take_beside(s, F, out.back());
}

// drops elements beside a kink of an initial crack, for which |J| is meaningless
void drop_beside(std::vector<Candidate>& all)
{
  std::vector<Candidate> out;
  for (const Candidate& c : all) {
    bool keep = true;
    for (const Candidate& o : all)
      keep = keep && (!c.force || c.decides || c.at_front || !o.decides || distance(c, o) >= o.flanks);
    if (keep) out.push_back(c);
  }
  all.swap(out);
}

// FORCE: elements around a tip have similar |J|. If the element of the highest rank in a ball does not break,
// none of them breaks.
void keep_fronts(std::vector<Candidate>& all)
{
  std::vector<Candidate> out;
  for (const Candidate& c : all) {
    if (c.x.value < 1.0 - (c.force ? c.level : 0.0)) continue;
    const Candidate* best = &c;
    for (const Candidate& o : all)
      if (c.force && o.force && o.x.rank > best->x.rank && distance(c, o) < c.ball) best = &o;
    if (best->x.value < 1.0) continue;
    if (c.x.value >= 1.0 || c.x.rank >= (1.0 - c.level) * best->x.rank) out.push_back(c);
  }
  all.swap(out);
}

// the largest value over the criterion: 1 at the load of first fracture. FORCE: the element of the highest
// rank in a ball decides (keep_fronts)
FirstBreak most_exceeded(const std::vector<Candidate>& all, bool fallback)
{
  FirstBreak first;
  for (const Candidate& c : all) {
    const double part  = fallback ? c.fallback : 0.0;
    const double value = c.x.value / (fallback ? part : 1.0);
    if (value <= first.value) continue;
    bool front = true;
    for (const Candidate& o : all)
      front = front && (fallback || !c.force || !o.force || o.x.rank <= c.x.rank || distance(c, o) >= c.ball);
    if (front) first = {-1, c.front, c.front_label, c.x.def, value, part, c.x.gain};
  }
  return first;
}

// highest rank first; others in the same test if of equal rank, or far enough away; in dynamics without this
// condition for GRIFFITH, after behind_tip: both arms of a branching crack may break at once
void choose(bool dynamic, bool fallback, std::vector<Candidate>& all)
{
  std::sort(all.begin(), all.end(), [](const Candidate& a, const Candidate& b) {
    return a.x.rank != b.x.rank ? a.x.rank > b.x.rank : a.x.number < b.x.number;
  });
  std::vector<Candidate> out;
  for (const Candidate& c : all) {
    const bool judged = c.order_all || (dynamic && c.griffith && !fallback);
    bool take = true;
    for (const Candidate& o : out) {
      const bool far = c.spacing > 0.0 && distance(c, o) >= c.spacing * (1.0 - 1e-9);
      take = take && (judged || c.x.rank >= (1.0 - c.level) * o.x.rank || far);
    }
    if (take) out.push_back(c);
  }
  all.swap(out);
}

// Cover of an element that breaks by a broken one: 1 - r/h, r: distance in the crack plane
struct Cover {
  double d[3];                 // from the element that breaks, in that plane
  double r, part;
};

// the largest fraction covered by two elements: in full for an element opposite to the first one, not for one
// beside or behind it; without a preferred direction in the plane
double covered_part(const std::vector<Cover>& all)
{
  double most = 0.0;
  for (const Cover& a : all)
    for (const Cover& b : all) {
      if (b.part > a.part) continue;
      const double dot = a.d[0] * b.d[0] + a.d[1] * b.d[1] + a.d[2] * b.d[2], rr = a.r * b.r;
      most = std::max(most, a.part + (rr > 0.0 ? b.part * std::max(0.0, -dot / rr) : 0.0));
    }
  return most;
}

// crack area of an element that breaks: the square (2D: edge) of its size in the plane of the crack, minus
// the cover by elements broken before within 1.5 h of that plane, on either side (7.17)
double crack_area(const Scan& s, int e, const double* N)
{
  const double h = s.fm.size[e];
  std::vector<Cover> all;
  frac_in_ball(s.fm, &s.fm.centre[3 * e], 2.1 * s.fm.local[e], [&](int o, double) {
    if (o == e || s.fr.broken[o] < 0) return;
    double n = 0.0, rr = 0.0;
    Cover c;
    for (int i = 0; i < 3; ++i) {
      c.d[i] = s.fm.centre[3 * o + i] - s.fm.centre[3 * e + i];
      n += c.d[i] * N[i];
    }
    if (std::fabs(n) > 1.5 * s.fm.local[e] * (1.0 + 1e-9)) return;
    for (int i = 0; i < 3; ++i) {
      c.d[i] -= n * N[i];
      rr += c.d[i] * c.d[i];
    }
    c.r    = std::sqrt(rr);
    c.part = 1.0 - c.r / h;
    if (c.part > 0.0) all.push_back(c);
  });
  const double share = std::max(0.0, 1.0 - covered_part(all));
  return share * h * (s.m.dim == 2 ? s.fm.thickness[e] : h);
}

// the criterion of an intact element over its critical value; part: fraction of Gc h, 0: by its definition
double value_of(Scan s, int e, double part)
{
  s.drive.assign(s.fm.size.size(), -1.0);
  if (part > 0.0 || s.def(e).criterion == CRITERION_ELEMENT)
    return drive_of(s, e) * s.fm.volume[e] / ((part > 0.0 ? part : 1.0) * threshold(s, e));
  double J[3];
  return estimate(s, e, J) / s.fm.gc[e];
}

// the mean normal of the cracks at the Gauss points that are nearest to the widest of the element, oriented
// as the first one
void mean_normal(const Scan& s, int e, double* N)
{
  const MatLaw& law  = s.el.block[s.el.initial_block[e]].law;
  const double* main = elem_main_crack(s.el, s.l, e);
  double sum[3] = {0, 0, 0}, size = 0.0, k;
  for (int g = s.el.gauss_of[e]; g < s.el.gauss_of[e + 1]; ++g) {
    const double* n   = crack_normal_like(law, history_at(s.l.he, s.el.history, g), main, &k);
    const double side = n[0] * sum[0] + n[1] * sum[1] + n[2] * sum[2] < 0.0 ? -1.0 : 1.0;
    for (int i = 0; i < 3; ++i) sum[i] += side * n[i];
  }
  for (double x : sum) size += x * x;
  for (int i = 0; i < 3; ++i) N[i] = sum[i] / std::sqrt(size);
}

// time at which the criterion was met, on the line through its values at l0 and l1                (7.15)
//   in   s   at the level l0
double when_met(const Scan& s, const Level& l1, const Erosion& x)
{
  if (!s.dynamic() || s.fm.release[x.elem] == 0.0 || x.value < 1.0) return l1.time;
  if (s.def(x.elem).criterion == CRITERION_COHESIVE) return l1.time;
  const double value0 = x.gain * value_of(s, x.elem, 0.0), dt = l1.time - s.l.time;
  if (value0 >= 1.0 && value0 >= x.value) return LONG_AGO;
  return s.l.time + std::round(TIME_STEPS * (1.0 - value0) / (x.value - value0)) / TIME_STEPS * dt;
}

// resets the history for a law of broken material; the dissipated energy is kept
void forget_history(const Scan& s, int e, Level& l)
{
  const ElemBlock& b = s.el.block[s.el.initial_block[e]];
  const Law& law     = law_of(elem_law(s.m, s.el, b, s.el.slot_of[e], l.degr[e]));
  const int numbers  = b.law.initial >= 0 ? b.law.initial : s.el.history;
  if (law.history.empty() || &law == &law_of(b.law)) return;
  for (int k = s.el.gauss_of[e]; k < s.el.gauss_of[e + 1]; ++k)
    std::fill_n(history_at(l.he, s.el.history, k) + HISTORY_OF_LAW, numbers - HISTORY_OF_LAW, 0.0);
}

// energy, area: on the owner
void erode(const Scan& s, const Erosion& x, Fracture& fr, Level& l, double& energy, double& area)
{
  const int e    = x.elem;
  const bool own = s.m.part.works(e);
  if (own) energy = elem_energy_one(s.m, s.el, e, l, 1.0, s.step.nlgeom);
  double E[9];
  mean_strain(s, e, E);
  double* N = &fr.normal[3 * static_cast<size_t>(e)];
  const bool cohesive = s.def(e).criterion == CRITERION_COHESIVE;
  if (cohesive) {
    if (own) mean_normal(s, e, N);
  } else {
    split_normal(s.law(e), s.m.dim, E, N);
    remove_along(x.J, N);
  }
  fr.broken[e] = s.fm.def[e];
  fr.time[e]   = x.time;
  fr.releasing.push_back(e);
  if (!s.dynamic() || s.fm.release[e] == 0.0) l.degr[e] = s.def(e).stiffness;
  if (!own) return;
  forget_history(s, e, l);
  energy -= elem_energy_one(s.m, s.el, e, l, l.degr[e], s.step.nlgeom);
  area = crack_area(s, e, N);
}

}  // namespace

double frac_estimate(const Model& m, const Step& step, const Elements& el, const FracMesh& fm,
                     const Fracture& fr, const Level& l, double start, int e, double J[3])
{
  Scan s{m, step, el, fm, fr, l, start, {}, {}, {}};
  s.drive.assign(fm.size.size(), -1.0);
  return estimate(s, e, J);
}

void frac_test(const Model& m, const Step& step, const Elements& el, const FracMesh& fm, const Fracture& fr,
               const Level& l, double start, const RealVec& energy, std::vector<Erosion>& out,
               FirstBreak& first)
{
  out.clear();
  first = FirstBreak();
  if (m.fracture.empty()) return;
  Scan s{m, step, el, fm, fr, l, start, {}, {}, {}};
  const int nelem = m.mesh.nelem();
  find_energies(energy, s);
  const double W_max = s.W.empty() ? 0.0 : *std::max_element(s.W.begin(), s.W.end());
  std::vector<Candidate> all, open;
  // in motion frac_average has found which elements have enough psi+ for a candidate
  const bool averages = s.dynamic() && !fr.mean.empty() && fr.drive_time == l.time;
  for (int e = 0; e < nelem; ++e) {
    if (fm.def[e] < 0 || (averages && fm.average[e] > 0.0 && fr.drive[e] == 0.0)) continue;
    if (!m.part.works(e) || !s.intact(e)) continue;
    if (s.def(e).criterion == CRITERION_COHESIVE) by_cohesion(s, e, open);
    else if (s.def(e).criterion == CRITERION_ELEMENT) by_element(s, e, 1.0, all);
    else by_griffith(s, e, W_max, all);
  }
  if (frac_uses_energy(m)) join(all);
  if (opens(m)) join(open);
  drop_beside(all);
  keep_fronts(all);
  const bool fallback = all.empty();
  if (fallback && may_fall_back(s)) {             // ligaments
    for (int e = 0; e < nelem; ++e)
      if (m.part.works(e) && fm.def[e] >= 0 && s.intact(e) && s.def(e).criterion == CRITERION_GRIFFITH) {
        const double part = fallback_of(s, e);
        if (part > 0.0) by_element(s, e, part, all);
      }
    join(all);
  }
  first = most_exceeded(all, fallback);
  if (first.number >= 0) first.elem = m.part.elem_here(first.number);
  choose(s.dynamic(), fallback, all);
  take_kinks(m.part, all);
  all.insert(all.end(), open.begin(), open.end());
  for (Candidate& c : all) {
    c.x.elem = m.part.elem_here(c.x.number);
    out.push_back(c.x);
  }
}

double frac_value(const Model& m, const Step& step, const Elements& el, const FracMesh& fm,
                  const Fracture& fr, const Level& l, double start, const FirstBreak& first)
{
  const bool own = first.elem >= 0 && m.part.works(first.elem);
  double value   = 0.0;
  if (own) value = first.gain * value_of({m, step, el, fm, fr, l, start, {}, {}, {}}, first.elem, first.part);
  if (m.part.on) comm_sum(&value, 1);
  return value;
}

void frac_when(const Model& m, const Step& step, const Elements& el, const FracMesh& fm, const Fracture& fr,
               const Level& l0, double start, const Level& l1, std::vector<Erosion>& all)
{
  RealVec time;
  for (const Erosion& x : all) {
    const bool own = x.elem >= 0 && m.part.works(x.elem);
    time.push_back(own ? when_met({m, step, el, fm, fr, l0, start, {}, {}, {}}, l1, x) : 0.0);
  }
  comm_sum(time);
  for (size_t k = 0; k < all.size(); ++k) all[k].time = time[k];
}

void frac_erode(const Model& m, const Step& step, const Elements& el, const FracMesh& fm,
                const std::vector<Erosion>& all, Fracture& fr, Level& l, RealVec& released)
{
  const size_t n = all.size();
  RealVec sum(2 * n, 0.0);     // energies, crack areas
  for (size_t k = 0; k < n; ++k)
    if (all[k].elem >= 0) erode({m, step, el, fm, fr, l, 0.0, {}, {}, {}}, all[k], fr, l, sum[k], sum[n + k]);
  // halo elements: copied from their owners, as round-off differs
  if (n > 0 && m.part.around.on()) halo_copy(m.part.around, 3, fr.normal);
  // in the order of a restart file, so that sums do not change after a restart
  std::sort(fr.releasing.begin(), fr.releasing.end(), [&](int a, int b) {
    return fr.time[a] != fr.time[b] ? fr.time[a] < fr.time[b] : a < b;
  });
  if (m.part.on) comm_sum(sum);
  released.assign(sum.begin(), sum.begin() + static_cast<long>(n));
  for (size_t k = 0; k < n; ++k) fr.area += sum[n + k];
  fr.neroded += static_cast<int>(n);
  fr.nreleasing += static_cast<int>(n);
}
