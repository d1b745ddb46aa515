#include <algorithm>
#include <cmath>

#include "frac/frac_kink.h"
#include "frac/frac_scan.h"

// Near an interface the criterion is the energy release of a sharp crack                            (7.38)

namespace {

// in element sizes: distance of an interface from the tip within which the crack is treated as sharp
// (test: fracture/crack_interface.inp, fracture/interface_motion.inp)
const double INTERFACE_DISTANCE = 3.0;
// in release times of an element, about 7 h/c_R: a tip without growth for longer is at rest
// (test: fracture/interface_motion.inp)
const double REST_TIME = 4.0;
// psi+ of the elements ahead of a crack of two rows, relative difference  (test: fracture/slit_interface.inp)
const double TIED = 0.01;
// in element sizes: distance between the centres of two such elements, of triangles up to 4/3  (no test)
const double TIED_DISTANCE = 1.6;
// cosine between their distance and the normal of the crack  (no test)
const double ACROSS_COS = 0.7, ACROSS_COS_3D = 0.9;

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
  const double off = dot3(J, n);
  double size = 0.0;
  for (int i = 0; i < 3; ++i) {
    d[i] = J[i] - off * n[i];
    size += d[i] * d[i];
  }
  for (int i = 0; i < 3; ++i) d[i] /= std::sqrt(size);
  return size > 0.0;
}

// A crack of two rows, as from a slit on a line of the mesh, goes on through two elements at once: moves x
// from the end of one row to the middle of both. Returns the number of rows
int join_rows(Scan& s, int ahead, const double* n, double* x)
{
  const double h = s.fm.local[ahead], *c = &s.fm.centre[3 * ahead], drive = drive_of(s, ahead);
  double sum[3] = {x[0], x[1], x[2]};
  int rows = 1;
  IntVec near;
  frac_in_ball(s.fm, c, TIED_DISTANCE * h, [&](int o, double) {
    if (o != ahead && s.intact(o) && s.fm.def[o] >= 0) near.push_back(o);
  });
  for (int o : near) {
    double y[3], into[3], r[3];
    for (int i = 0; i < 3; ++i) r[i] = s.fm.centre[3 * o + i] - c[i];
    const double least = (s.m.dim == 3 ? ACROSS_COS_3D : ACROSS_COS) * std::sqrt(dot3(r, r));
    if (std::fabs(dot3(r, n)) < least || !crack_face(s, o, y, into)) continue;
    if (std::fabs(drive_of(s, o) - drive) > TIED * drive) continue;
    for (int i = 0; i < 3; ++i) sum[i] += y[i];
    ++rows;
  }
  for (int i = 0; i < 3; ++i) x[i] = sum[i] / rows;
  return rows;
}

// radius in which the direction of a crack is looked for
double tip_reach(const Scan& s, int e)
{
  return estimate_of(s, e) == ESTIMATE_FORCE ? radius_of(s, e) : FRAC_NOTCH * s.fm.local[e];
}

double estimate_at(Scan& s, int e, double* J)
{
  return estimate_of(s, e) == ESTIMATE_FORCE ? force_estimate(s, e, tip_reach(s, e), J) : ball_estimate(s, e);
}

// in element sizes: distance behind the end of a notch of elements at its flanks
// (test: fracture/slit_interface.inp)
const double BEHIND = 0.25;
// in element sizes: distance from the end of elements ahead of it  (no test)
const double NEAR_END = 1.5;
// in element sizes: length of a slit that counts for the direction, and distance of its end
// (test: fracture/slit_interface.inp), with type=3
const double SLIT_LENGTH = 3.0;
const double RIGHT_ANGLE = 1.57079632679489662;
const double OFF_LINE = 0.2;   // in element sizes: of the points beyond a notch  (no test)

// an intact element right ahead of the end of a notch, on one side of its line
int beyond(const Scan& s, const Tip& t, double h, double side)
{
  for (double r : {0.3, 0.6, 0.9}) {
    const double x[3] = {t.end[0] + h * (r * t.d[0] - side * t.d[1]),
                         t.end[1] + h * (r * t.d[1] + side * t.d[0]), 0.0};
    const int o = element_at(s, x, 1.5 * h);
    if (o >= 0 && s.intact(o)) return o;
  }
  return -1;
}

// is the notch no wider than one element and a half?
bool is_narrow(const Scan& s, const Tip& t, double h)
{
  for (double side : {-0.75, 0.75}) {
    const double x[3] = {t.end[0] - h * (t.d[0] + side * t.d[1]), t.end[1] - h * (t.d[1] - side * t.d[0]),
                         0.0};
    const int o = element_at(s, x, 1.5 * h);
    if (o < 0 || !s.intact(o)) return false;
  }
  return true;
}

// is e beside a narrow notch, behind its end?
bool behind_end(const Scan& s, int e, Tip& t)
{
  const double h = s.fm.local[e];
  if (s.m.dim == 3 || !notch_end(s, e, t) || !is_narrow(s, t, h)) return false;
  const double x[2] = {s.fm.centre[3 * e] - t.end[0], s.fm.centre[3 * e + 1] - t.end[1]};
  return x[0] * t.d[0] + x[1] * t.d[1] < -BEHIND * h;
}

// direction to x of a crack at e, with the slit from which it has grown, which is longer at first
void crack_way(const Scan& s, int e, const double* x, double reach, double* way)
{
  const double h = s.fm.local[e], *c = &s.fm.centre[3 * e];
  double volume = 0.0, sum[2] = {0, 0};
  Tip t;
  grown_along(s, e, x, reach, 0.0, way);
  if (s.m.dim == 3 || !notch_end(s, e, t) || !is_narrow(s, t, h)) return;
  if (std::hypot(t.end[0] - c[0], t.end[1] - c[1]) > SLIT_LENGTH * h) return;
  const auto add = [&](double v, const double* y) {
    volume += v;
    for (int i = 0; i < 2; ++i) sum[i] += v * y[i];
  };
  frac_in_ball(s.fm, c, reach * AT_RADIUS, [&](int o, double) {
    if (s.cracked(o)) add(crack_share(s, e, o) / s.fm.thickness[e], &s.fm.centre[3 * o]);
  });
  const double half    = 0.5 * SLIT_LENGTH * h;
  const double slit[2] = {t.end[0] - half * t.d[0], t.end[1] - half * t.d[1]};
  add(SLIT_LENGTH * h * h, slit);
  const double r[2] = {x[0] - sum[0] / volume, x[1] - sum[1] / volume}, size = std::hypot(r[0], r[1]);
  for (int i = 0; i < 2; ++i) way[i] = r[i] / size;
}

}  // namespace

double sharp_share(Scan& s, int ahead)
{
  for (const auto& known : s.sharp)
    if (known.first == ahead) return known.second;
  double x[3], d[3] = {0, 0, 0}, n[3], J[3], share = 1.0;
  const double h  = s.fm.local[ahead], reach = tip_reach(s, ahead);
  const bool face = crack_face(s, ahead, x, d);
  double way[3]   = {d[0], d[1], d[2]};
  if (face) crack_way(s, ahead, &s.fm.centre[3 * ahead], reach, way);
  if (face && near_interface(s, x, INTERFACE_DISTANCE * h, way)) {
    const double G0 = estimate_at(s, ahead, J);
    std::copy_n(way, 3, d);
    double G = 0.0;
    if (crack_axes(s, ahead, J, d, n)) {
      const int rows = join_rows(s, ahead, n, x);
      if (rows > 1 && s.m.dim == 2) {
        crack_way(s, ahead, x, reach, d);
        crack_axes(s, ahead, J, d, n);
      }
      G = sharp_release(s, ahead, x, d, n, rows * h);
    }
    if (G > 0.0 && G0 > 0.0) share = G / G0;
  }
  s.sharp.emplace_back(ahead, share);
  return share;
}

// The mean in the ball assumes the tip field of one material
double rest_share(Scan& s, int e)
{
  const double *c = &s.fm.centre[3 * e], h = s.fm.local[e];
  if (s.m.dim == 3 || !near_interface(s, c, (INTERFACE_DISTANCE + 1.0) * h)) return 1.0;
  double last = -1e300, d[3];
  frac_in_ball(s.fm, c, FRAC_NOTCH * h * AT_RADIUS, [&](int o, double) {
    if (s.broken(o)) last = std::max(last, s.fr.time[o]);
  });
  if (s.l.time - last < REST_TIME * s.fm.release[e]) return 1.0;
  if (!grown_along(s, e, c, FRAC_NOTCH * h, 0.0, d)) return notch_share(s, e);
  const int ahead = element_ahead(s, e, d);
  return ahead >= 0 && s.intact(ahead) && s.fm.def[ahead] >= 0 ? sharp_share(s, ahead) : 1.0;
}

double notch_share(Scan& s, int e)
{
  const double h = s.fm.local[e];
  Tip t;
  if (s.m.dim == 3 || !near_interface(s, &s.fm.centre[3 * e], (INTERFACE_DISTANCE + 1.0) * h)) return 1.0;
  if (!notch_end(s, e, t) || !near_interface(s, t.end, INTERFACE_DISTANCE * h, t.d)) return 1.0;
  int ahead = -1;
  for (double side : {-OFF_LINE, OFF_LINE}) {
    const int o = beyond(s, t, h, side);
    if (o >= 0 && s.fm.def[o] >= 0) ahead = std::max(ahead, o);
  }
  if (ahead < 0 || !is_narrow(s, t, h)) return 1.0;
  for (const auto& known : s.notch)
    if (known.first == ahead) return known.second;
  double J[3];
  const double n[3] = {-t.d[1], t.d[0], 0.0}, G0 = estimate_at(s, ahead, J);
  const double G = sharp_release(s, ahead, t.end, t.d, n, slot_width(s, t));
  s.notch.emplace_back(ahead, G > 0.0 && G0 > 0.0 ? G / G0 : 1.0);
  return s.notch.back().second;
}

double end_share(const Scan& s, int e)
{
  Tip t;
  return behind_end(s, e, t) ? kink_share(RIGHT_ANGLE) : 1.0;
}

bool behind_end_of(const Scan& s, int o, int e)
{
  const double h = s.fm.local[e];
  Tip t;
  if (!behind_end(s, o, t)) return false;
  const double x[2] = {s.fm.centre[3 * e] - t.end[0], s.fm.centre[3 * e + 1] - t.end[1]};
  return std::hypot(x[0], x[1]) < NEAR_END * h && x[0] * t.d[0] + x[1] * t.d[1] > -BEHIND * h;
}
