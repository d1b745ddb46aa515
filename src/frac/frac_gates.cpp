// ---------------------------------------------------------------------------
// frac_gates.cpp : which elements are compared with the toughness                      (doc/theory.md 7.1)
// ---------------------------------------------------------------------------
#include "frac/frac_gates.h"

#include <algorithm>
#include <cmath>

#include "shape/shape.h"

namespace {

// psi+/Gc of a candidate, relative to the largest of its competitors (behind_tip, theory 7.1). Lower: flanks
// of a crack break (A14); higher: it cannot branch (P8). Statics  (test: fracture/a10_turned.inp)
const double TIP_STATICS = 0.2;
// the same in motion  (test: fracture/a14_motion, paper/p8_compare)
const double TIP_MOTION = 0.4;
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

// cosine of the directions of a crack in the ball and in half of it, 20 degrees; below: bent.
// (test: fracture/kink_inclined.inp)
const double BENT_COS = 0.94;

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

}  // namespace

double threshold(const Scan& s, int e)
{
  const double h = s.fm.size[e];
  return s.fm.gc[e] * (s.m.dim == 2 ? h * s.fm.thickness[e] : h * h);
}

double spacing_of(const Scan& s, int e)
{
  const FractureDef& d = s.def(e);
  return (d.spacing >= 0.0 ? d.spacing : s.dynamic() ? FRAC_SPACING : 0.0) * s.fm.local[e];
}

bool start_allowed(const Scan& s, int e)
{
  return s.def(e).start || at_removed(s, e);
}

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

bool may_start(Scan& s, int e, double margin)
{
  if (crack_reaches(s, e)) return false;
  const double limit = margin * relative_drive(s, e);
  const auto stronger = [&](int o) { return competes(s, o, limit) && !behind_end_of(s, o, e); };
  if (beside(s, e, stronger)) return false;
  bool good = true;
  in_ball(s, e, [&](int o, double) { good = good && !stronger(o); });
  return good;
}

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

bool may_fall_back(const Scan& s)
{
  return std::any_of(s.m.fracture.begin(), s.m.fracture.end(), [&](const FractureDef& d) {
    const bool force = d.estimate == ESTIMATE_FORCE || (d.estimate == ESTIMATE_AUTO && !s.dynamic());
    return d.fallback > 0.0 || (d.fallback < 0.0 && force);
  });
}

double fallback_of(const Scan& s, int e)
{
  const double given = s.def(e).fallback;
  if (given >= 0.0) return given;
  if (estimate_of(s, e) != ESTIMATE_FORCE || s.W[e] * s.fm.volume[e] < PINCHED * threshold(s, e)) return 0.0;
  return pinched(s, e) || (s.m.dim == 3 && left_behind(s, e)) ? PINCHED : is_ligament(s, e) ? LIGAMENT : 0.0;
}

bool near_crack(const Scan& s, int e)
{
  bool found = false;
  in_ball(s, e, [&](int o, double) { found = found || s.cracked(o); });
  return found;
}
