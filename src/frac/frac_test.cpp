#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "base/forest.h"
#include "base/timer.h"
#include "frac/frac_gates.h"
#include "frac/frac_kink.h"
#include "frac/frac_scan.h"
#include "mat/law.h"
#include "shape/shape.h"

namespace {

const double PI = 3.14159265358979323846;
const double ROUNDING = 1.0 + 1e-9;    // round-off of a bound, relative to it  (no test)
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
// share of K_III in G above which a front in space is reported, and its crack has the normal of the plane
// (test: fracture/crack_tearing.inp)
const double TWISTED = 0.2;
// relative difference of ranks of a symmetric pair, by the tolerance of Newton's method  (no test)
const double RANK_TOL = 1e-3;
// elements of a 3D front within this difference break together: |J| varies by it along a straight front.
// (test: fracture/interface_3d.inp)
const double FRONT_TOL = 0.03;
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

}  // namespace

// bound: from the total energy, an upper bound of psi+
double ball_estimate(Scan& s, int e, bool bound)
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

namespace {

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
  k = kink_of(t.ratio, t.out);
  return k.gain >= KINK_GAIN_MOTION;
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

// ---- candidates

// in element sizes: length of a kink (theory 7.1)  (no test)
const double KINK_LENGTH = 3.0;
// in element sizes: distance along the front up to which an element at it breaks others with its kink;
// elements at a front are half a size apart  (no test)
const double KINK_ASIDE = 0.6;
// cosine between the direction from a crack into an element and the direction, or plane, of the crack; below,
// or with a centre further off the plane (in element sizes), the element is beside the crack, and its
// breaking is a kink  (test: K7)
const double BESIDE_COS = 0.5, BESIDE_DISTANCE = 0.6;
// in element sizes: distance along the crack from the centre of cracked elements within 2.5; below: a flank
// (no test)
const double MIDDLE_DISTANCE = 0.5;

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
  // mixed mode: number of elements of the kink
  int nkink = 0;
};

// An element of the kink of a candidate
struct Kinked {
  int of = -1;                 // number of the candidate
  Erosion x;
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
void join(std::vector<Kinked>& all)
{
  if (comm_size() == 1) return;
  comm_allgatherv(all);
  std::stable_sort(all.begin(), all.end(), [](const Kinked& a, const Kinked& b) { return a.of < b.of; });
}

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
bool take_line(const Scan& s, const Tip& t, const double* x, const Kink& k, double value, Candidate& c,
               std::vector<Kinked>& kinked)
{
  const int e = c.x.elem;
  const double cosine = std::cos(k.angle), sine = std::sin(k.angle), G = value * s.fm.gc[e],
               length = KINK_LENGTH * s.fm.local[e];
  double go[3] = {t.d[0] * cosine - t.d[1] * sine, t.d[0] * sine + t.d[1] * cosine, 0.0}, n[3];
  for (int i = 0; i < 3 && s.m.dim == 3; ++i) go[i] = t.d[i] * cosine + t.n[i] * sine;
  for (int i = 0; i < 3; ++i) n[i] = t.n[i] * cosine - t.d[i] * sine;
  const double J[3] = {G * go[0], G * go[1], G * go[2]};
  const bool brick  = s.m.dim == 2 || s.el.block[s.el.initial_block[e]].shape == SHAPE_HEX8;
  IntVec line;
  if (brick ? !along_line(s, e, x, go, length, line)
            : !along_strip(s, e, x, go, n, length, KINK_ASIDE * s.fm.local[e], line))
    return false;
  c.nkink = static_cast<int>(line.size());
  for (int o : line) {
    Kinked one{c.x.number, erosion_of(s, o, value, value, J)};
    one.x.twist = c.x.twist;
    if (c.x.twist > 0.0) std::copy_n(n, 3, one.x.N);
    kinked.push_back(one);
  }
  return true;
}

// BALL: the same at the end of a notch
void take_notch(const Scan& s, Candidate& c, std::vector<Kinked>& kinked)
{
  Tip t;
  Kink k;
  if (!notch_kinks(s, c.x.elem, t, k)) return;
  take_line(s, t, t.end, k, c.x.value, c, kinked);
}

// FORCE: a crack in mixed mode kinks to the largest energy release, gain times that of straight growth;
// the elements of the kink break together, since J of the ball does not include it yet
//   in   J   of (7.5)
void take_kink(const Scan& s, const double* J, Candidate& c, std::vector<Kinked>& kinked)
{
  const int e = c.x.elem;
  double x[3], into[3];
  Tip t;
  if (s.m.dim == 3) {
    if (!space_tip(s, e, J, t)) return;
    c.at_front = true;
    const double share = t.out * t.out / (1.0 + t.ratio * t.ratio + t.out * t.out);
    if (t.given && share > TWISTED) {
      c.x.twist = share;
      std::copy_n(t.n, 3, c.x.N);
    }
  } else if (crack_face(s, e, x, into)) {
    if (!crack_tip(s, e, t)) return;
  } else {
    if (!notch_end(s, e, t)) return;
    modes_ahead(s, e, t);
  }
  const Kink k = kink_of(t.ratio, t.out);
  double G     = (J[0] * t.d[0] + J[1] * t.d[1] + J[2] * t.d[2]) / s.fm.gc[e] * k.gain;
  if (t.given ? k.gain < KINK_GAIN : G < KINK_GAIN_GROWN * c.x.value) return;
  if (t.given) G -= slot_release(s, t) / s.fm.gc[e] * k.gain;
  if (!take_line(s, t, t.face, k, G, c, kinked)) return;
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
         kink_of(t.ratio, t.out).gain >= KINK_GAIN;
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

// the same at the end of a notch without a crack yet, whose flanks release a kink as those of a crack
void take_end(Scan& s, Candidate& c)
{
  const int e = c.x.elem;
  scale(end_share(s, e), c);
  if (c.force) scale(notch_share(s, e), c);
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
void take_kinks(const MeshPart& part, const std::vector<Kinked>& kinked, std::vector<Candidate>& all)
{
  std::vector<Candidate> out;
  IntVec numbers;                                    // of out
  for (const Candidate& c : all) {
    const auto add = [&](const Erosion& x) {         // once: others at the same tip may give it too
      if (std::find(numbers.begin(), numbers.end(), x.number) != numbers.end()) return false;
      numbers.push_back(x.number);
      out.push_back(c);
      out.back().x = x;
      return true;
    };
    if (c.nkink == 0) add(c.x);
    for (const Kinked& k : kinked) {
      if (c.nkink == 0 || k.of != c.x.number || !add(k.x)) continue;
      out.back().x.elem = part.elem_here(k.x.number);
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

void by_griffith(Scan& s, int e, double W_max, std::vector<Candidate>& out, std::vector<Kinked>& kinked)
{
  const double least = FRAC_MIN_DRIVE * s.fm.gc[e] / s.fm.size[e];
  if (s.W[e] <= least) return;
  const bool force = estimate_of(s, e) == ESTIMATE_FORCE;
  if (!force && out_of_reach(s, e, W_max)) return timer_skip(PHASE_ESTIMATE);
  if (!force && ball_estimate(s, e, true) * ROUNDING < s.fm.gc[e]) return timer_skip(PHASE_ESTIMATE);
  if (!(largest_stress(s, e) > 0.0) || drive_of(s, e) <= least) return;
  const bool at = at_crack(s, e);
  if (at && behind_tip(s, e) && !kinks(s, e)) return;
  if (!at && (!start_allowed(s, e) || !may_start(s, e, 1.0 + RANK_TOL))) return;
  if (at && flank(s, e)) return;
  double J[3];
  ++timer_phase(PHASE_ESTIMATE).calls;
  const double G = estimate(s, e, J);
  if (G < s.fm.gc[e] && !force) return;              // FORCE: decided in keep_fronts
  const double rank = force ? force_rank(s, e, J, G) : drive_of(s, e) * s.fm.size[e];
  const double F[3] = {J[0], J[1], J[2]};
  if (!at) J[0] = J[1] = J[2] = 0.0;                 // no crack yet
  out.push_back(candidate(s, e, G / s.fm.gc[e], rank / s.fm.gc[e], J));
  if (force) take_kink(s, F, out.back(), kinked);
  if (!force && at_notch(s, e, FRAC_NOTCH * s.fm.local[e])) take_notch(s, out.back(), kinked);
  if (force && at && out.back().nkink == 0) take_interface(s, F, out.back());
  if (!at && out.back().nkink == 0) take_end(s, out.back());
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
  } else if (x.N[0] != 0.0 || x.N[1] != 0.0 || x.N[2] != 0.0) {
    std::copy_n(x.N, 3, N);
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
  find_body(s);
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
  find_body(s);
  const double W_max = s.W.empty() ? 0.0 : *std::max_element(s.W.begin(), s.W.end());
  std::vector<Candidate> all, open;
  std::vector<Kinked> kinked;
  // in motion frac_average has found which elements have enough psi+ for a candidate
  const bool averages = s.dynamic() && !fr.mean.empty() && fr.drive_time == l.time;
  for (int e = 0; e < nelem; ++e) {
    if (fm.def[e] < 0 || (averages && fm.average[e] > 0.0 && fr.drive[e] == 0.0)) continue;
    if (!m.part.works(e) || !s.intact(e)) continue;
    if (s.def(e).criterion == CRITERION_COHESIVE) by_cohesion(s, e, open);
    else if (s.def(e).criterion == CRITERION_ELEMENT) by_element(s, e, 1.0, all);
    else by_griffith(s, e, W_max, all, kinked);
  }
  if (frac_uses_energy(m)) {
    join(all);
    join(kinked);
  }
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
  take_kinks(m.part, kinked, all);
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
  Scan s{m, step, el, fm, fr, l, start, {}, {}, {}};
  find_body(s);
  if (own) value = first.gain * value_of(s, first.elem, first.part);
  if (m.part.on) comm_sum(&value, 1);
  return value;
}

void frac_when(const Model& m, const Step& step, const Elements& el, const FracMesh& fm, const Fracture& fr,
               const Level& l0, double start, const Level& l1, std::vector<Erosion>& all)
{
  RealVec time;
  Scan s{m, step, el, fm, fr, l0, start, {}, {}, {}};
  if (!all.empty()) find_body(s);
  for (const Erosion& x : all) {
    const bool own = x.elem >= 0 && m.part.works(x.elem);
    time.push_back(own ? when_met(s, l1, x) : 0.0);
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
