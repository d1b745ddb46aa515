#include "frac/frac_scan.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "shape/shape.h"

namespace {

// cosine of the directions of a crack in the ball and in half of it, 3 degrees; below: not straight
// (test: fracture/kink_inclined.inp)
const double STRAIGHT_COS = 0.9986;
// cosine between the crack and the direction into an element at its end; below: beside the crack
// (test: fracture/kink_inclined.inp)
const double AHEAD_COS = 0.65;
// in element sizes: distance from the end of the crack to the centre of the cracked elements in the ball;
// below: too short for a direction (three elements of a row: 1.5)  (no test)
const double MIN_CRACK = 1.4;
// fraction of a stress along a slot that remains on the line ahead of its end
// (test: fracture/kink_inclined.inp)
const double BEFORE_END = 0.85;
// slope of the sides, rise over length, above which a notch is not a slot  (no test)
const double NOTCH_SLOPE = 0.3;
// cosine between a crack and the normal of an interface; below: along it, where G does not change
// (test: fracture/interface_along.inp)
const double ALONG_INTERFACE = 0.2;
// toughness ratio above which an element blocks growth  (test: fracture/crack_interface.inp)
const double TOUGHER = 1.2;

// radius of the ball for the direction of a crack: EPSILON may be too small
double kink_radius(const Scan& s, int e)
{
  return std::max(radius_of(s, e), FRAC_RADIUS_FORCE * s.fm.local[e]) * AT_RADIUS;
}

template <class Use>
void in_kink_ball(const Scan& s, int e, Use use)
{
  frac_in_ball(s.fm, &s.fm.centre[3 * e], kink_radius(s, e), use);
}

// centre of the free faces within radius of c, weighted by size
void middle_of(const std::vector<FreeFace>& face, const double* c, double radius, double* mid)
{
  double size = 0.0;
  mid[0] = mid[1] = 0.0;
  for (const FreeFace& f : face) {
    if (std::hypot(f.mid[0] - c[0], f.mid[1] - c[1]) > radius) continue;
    const double area = std::hypot(f.area[0], f.area[1]);
    size += area;
    for (int i = 0; i < 2; ++i) mid[i] += area * f.mid[i];
  }
  for (int i = 0; size > 0.0 && i < 2; ++i) mid[i] /= size;
}

// mean of the foremost nodes along d of the faces around c; returns the face there with the largest energy
const FreeFace* faces_ahead(const Scan& s, const std::vector<FreeFace>& face, const double* c,
                            const double* d, double h, double* end)
{
  double far = -1e300, most = 0.0, sum[2] = {0, 0};
  int n = 0;
  const FreeFace* first = nullptr;
  const auto ahead = [&](int node) {
    const double* X = &s.m.mesh.X[3 * node];
    return std::hypot(X[0] - c[0], X[1] - c[1]) < 3.0 * h ? X[0] * d[0] + X[1] * d[1] : -1e300;
  };
  for (const FreeFace& f : face)
    for (int a = 0; a < f.n; ++a) far = std::max(far, ahead(f.node[a]));
  for (const FreeFace& f : face)
    for (int a = 0; a < f.n; ++a) {
      if (ahead(f.node[a]) < far - 0.8 * h) continue;
      for (int i = 0; i < 2; ++i) sum[i] += s.m.mesh.X[3 * f.node[a] + i];
      ++n;
      if (!s.intact(f.elem)) continue;
      const double W = elem_energy_one(s.m, s.el, f.elem, s.l, 1.0, s.step.nlgeom) / s.fm.volume[f.elem];
      if (W <= most) continue;
      most  = W;
      first = &f;
    }
  for (int i = 0; n && i < 2; ++i) end[i] = sum[i] / n;
  return first;
}

// unit vector to end from the centre of the faces around it; false: nearer than least
bool away_from(const std::vector<FreeFace>& face, const double* end, double h, double least, double* d)
{
  double mid[2];
  middle_of(face, end, 3.0 * h, mid);
  const double norm = std::hypot(end[0] - mid[0], end[1] - mid[1]);
  if (norm < least) return false;
  for (int i = 0; i < 2; ++i) d[i] = (end[i] - mid[i]) / norm;
  return true;
}

}  // namespace

// the end of a notch near e without a crack yet; false: none
bool notch_end(const Scan& s, int e, Tip& t)
{
  if (!at_notch(s, e, s.dynamic() ? FRAC_NOTCH * s.fm.local[e] : radius_of(s, e))) return false;
  const double h = s.fm.local[e], *c = &s.fm.centre[3 * e];
  std::vector<FreeFace> face;
  free_faces(s, e, FRAC_KINK * h, face);
  std::copy_n(c, 2, t.end);
  const FreeFace* first = nullptr;
  for (int pass = 0; pass < 2; ++pass) {             // second pass: about the end found in the first
    if (!away_from(face, t.end, h, 0.5 * h, t.d)) return false;
    first = faces_ahead(s, face, c, t.d, h, t.end);
  }
  if (!first) return false;
  std::copy_n(first->mid, 2, t.face);
  t.elem = first->elem;
  return away_from(face, t.end, h, h, t.d);
}

// the centre of the faces between a crack and e, and the unit vector into e there [3]; false: no crack at e
bool crack_face(const Scan& s, int e, double* x, double* into)
{
  double mid[3], area[3];
  int n = 0;
  for (int i = 0; i < 3; ++i) x[i] = into[i] = 0.0;
  for (int f = 0; f < shape_info[s.el.block[s.el.initial_block[e]].shape].nface; ++f) {
    const int o = s.fm.across[6 * e + f];
    if (o < 0 || !s.cracked(o)) continue;
    face_of(s.m.mesh, e, f, mid, area);
    for (int i = 0; i < s.m.dim; ++i) {
      x[i] += mid[i];
      into[i] -= area[i];
    }
    ++n;
  }
  const double norm = std::hypot(into[0], into[1], into[2]);
  for (int i = 0; n && i < s.m.dim; ++i) {
    x[i] /= n;
    into[i] /= norm;
  }
  return n > 0 && norm > 0.0;
}

namespace {

// An element on the line ahead of a tip
struct Ahead {
  double along, volume, pull, shear, apart, out;
};

// End of the line ahead of a tip: where its mean tension over a slice of h turns to pressure. In mode II
// tension on one side of the line and pressure on the other cancel
double line_end(const std::vector<Ahead>& line, double h)
{
  const double PRESSED = 0.1;          // of the shear, pressure that counts  (test: fracture/dcb_rotations)
  for (int slice = 0; slice < 3; ++slice) {
    double pull = 0.0, shear = 0.0;
    for (const Ahead& a : line) {
      if (a.along < (1 + slice) * h || a.along >= (2 + slice) * h) continue;
      pull += a.volume * a.pull;
      shear += a.volume * a.shear;
    }
    if (pull >= -PRESSED * std::fabs(shear)) continue;
    return slice == 0 ? 1e300 : (1 + slice) * h;
  }
  return 1e300;
}

}  // namespace

namespace {

double poisson_of(const MatLaw& law) { return law.lam3 / (2.0 * (law.lam3 + law.mu)); }

// ratio, out and T of a tip from the elements on the line ahead of it
void modes_of_line(const Scan& s, int e, const std::vector<Ahead>& line, Tip& t)
{
  const double end = line_end(line, s.fm.local[e]);
  double normal = 0.0, shear = 0.0, apart = 0.0, volume = 0.0, out = 0.0;
  for (const Ahead& a : line) {
    if (a.along >= end) continue;
    volume += a.volume;
    normal += a.volume * a.pull;
    shear += a.volume * a.shear;
    apart += a.volume * a.apart;
    out += a.volume * a.out;
  }
  const double least = 1e-3 * std::hypot(shear, out), opening = std::max(normal, least);
  t.ratio = shear == 0.0 ? 0.0 : shear / opening;
  t.out   = out == 0.0 ? 0.0 : out / (opening * std::sqrt(1.0 - poisson_of(s.law(e))));
  t.along = volume > 0.0 ? apart / (BEFORE_END * volume) : 0.0;
}

}  // namespace

// K_II/K_I: shear over tension on the line ahead, independent of stress along the crack; 1e3 with the sign of
// the shear for a closed crack. T: on this line the singular stresses along and across the crack are equal.
// Where the tension ahead of an open crack turns to pressure, as in the arms of a DCB, the line ends
// (test: fracture/dcb_rotations)
void modes_ahead(const Scan& s, int e, Tip& t)
{
  const double *c = t.end, *d = t.d;
  std::vector<Ahead> line;
  in_kink_ball(s, e, [&](int o, double) {
    if (!s.intact(o)) return;
    const double *x = &s.fm.centre[3 * o], h = s.fm.local[e];
    const double along  = (x[0] - c[0]) * d[0] + (x[1] - c[1]) * d[1];
    const double across = std::fabs((x[0] - c[0]) * d[1] - (x[1] - c[1]) * d[0]);
    if (along < h || along > 3.2 * h || across > 0.5 * h + 0.2 * along) return;
    double E[4], S[4];
    mean_strain(s, o, E);
    ip_law<2>(s.law(o), E, S);
    for (int k = 0; k < 4; k += 3) S[k] += stress_of_33(s, o);
    const double p[2] = {S[1] * d[0] - S[0] * d[1], S[3] * d[0] - S[2] * d[1]};      // S n, n = (-d2, d1)
    const double pull = p[1] * d[0] - p[0] * d[1];
    line.push_back({along, s.fm.volume[o], pull, p[0] * d[0] + p[1] * d[1], S[0] + S[3] - 2.0 * pull, 0.0});
  });
  modes_of_line(s, e, line, t);
}

namespace {

// cosine between the normals of opposite faces, negative  (no test)
const double OPPOSITE = 0.8;

// the same in the plane normal to a front in space
void modes_in_space(const Scan& s, int e, Tip& t)
{
  const double h = s.fm.local[e], *d = t.d, *n = t.n;
  const bool brick = s.el.block[s.el.initial_block[e]].shape == SHAPE_HEX8;
  const double aside = (brick ? 0.6 : 1.2) * h;      // tetrahedra: more of them, for a mean
  double front[3];
  for (int i = 0; i < 3; ++i) front[i] = d[(i + 1) % 3] * n[(i + 2) % 3] - d[(i + 2) % 3] * n[(i + 1) % 3];
  std::vector<Ahead> line;
  in_kink_ball(s, e, [&](int o, double) {
    if (!s.intact(o)) return;
    double x[3], E[9], S[9], p[3] = {0, 0, 0}, q[3] = {0, 0, 0};
    for (int i = 0; i < 3; ++i) x[i] = s.fm.centre[3 * o + i] - t.end[i];
    const double along = dot3(x, t.d), across = dot3(x, t.n);
    const double side  = std::sqrt(std::max(0.0, dot3(x, x) - along * along - across * across));
    if (along < h || along > 3.2 * h || std::fabs(across) > 0.5 * h + 0.2 * along || side > aside) return;
    mean_strain(s, o, E);
    ip_law<3>(s.law(o), E, S);
    for (int i = 0; i < 3; ++i)
      for (int j = 0; j < 3; ++j) {
        p[i] += S[3 * i + j] * t.n[j];
        q[i] += S[3 * i + j] * t.d[j];
      }
    const double pull = dot3(p, n);
    line.push_back({along, s.fm.volume[o], pull, dot3(p, d), dot3(q, d) - pull, dot3(p, front)});
  });
  modes_of_line(s, e, line, t);
}

}  // namespace

// normal of the sides of the crack behind e, where it is a single row: of two opposite faces of a cracked
// element there, with intact elements behind them; false: none, or several
bool side_normal(const Scan& s, int e, double* n)
{
  return beside(s, e, [&](int o) {
    if (!s.cracked(o)) return false;
    const int faces = shape_info[elem_table[s.m.mesh.elem_type[o]].shape].nface;
    int pairs       = 0;
    for (int f = 0; f < faces; ++f)
      for (int g = 0; g < f; ++g) {
        double mid[3], one[3], other[3];
        const int a = s.fm.across[6 * o + f], b = s.fm.across[6 * o + g];
        if (a < 0 || b < 0 || !s.intact(a) || !s.intact(b)) continue;
        face_of(s.m.mesh, o, f, mid, one);
        face_of(s.m.mesh, o, g, mid, other);
        const double size = std::sqrt(dot3(one, one));
        if (dot3(one, other) > -OPPOSITE * size * std::sqrt(dot3(other, other))) continue;
        for (int i = 0; i < 3; ++i) n[i] = one[i] / size;
        ++pairs;
      }
    return pairs == 1;                               // several: a column of cracked elements has no plane
  });
}

namespace {

// in element sizes: radius around an element at a jagged front within which its faces count  (no test)
const double FRONT_RADIUS = 1.5;
// cosine between the direction of a crack and the normal of a face in front of it, at least  (no test)
const double FACING_COS = 0.5;

// moves the start of a kink to the mean of the faces of the front around it: tetrahedra meet a crack by
// inclined faces
void mean_front(const Scan& s, int e, Tip& t)
{
  double size = 0.0, along = 0.0, off = 0.0;
  frac_in_ball(s.fm, t.face, FRONT_RADIUS * s.fm.local[e], [&](int o, double) {
    for (int f = 0; s.intact(o) && f < shape_info[elem_table[s.m.mesh.elem_type[o]].shape].nface; ++f) {
      const int behind = s.fm.across[6 * o + f];
      double mid[3], area[3];
      if (behind < 0 || !s.cracked(behind)) continue;
      face_of(s.m.mesh, o, f, mid, area);
      const double ahead = -dot3(area, t.d);
      if (ahead < FACING_COS * std::sqrt(dot3(area, area))) continue;
      for (int i = 0; i < 3; ++i) mid[i] -= t.face[i];
      size += ahead;
      along += ahead * dot3(mid, t.d);
      off += ahead * dot3(mid, t.n);
    }
  });
  for (int i = 0; size > 0.0 && i < 3; ++i) t.face[i] += (along * t.d[i] + off * t.n[i]) / size;
}

}  // namespace

bool space_tip(const Scan& s, int e, const double* J, Tip& t)
{
  double into[3], mid[3], size = 0.0;
  t.elem = e;
  if (!crack_face(s, e, t.face, into)) return false;
  if (!crack_plane(s, e, t.n, mid) && !side_normal(s, e, t.n)) return false;
  const double off = dot3(J, t.n);
  for (int i = 0; i < 3; ++i) t.d[i] = J[i] - off * t.n[i];
  size = std::sqrt(dot3(t.d, t.d));
  if (size == 0.0) return false;
  for (double& x : t.d) x /= size;
  if (dot3(t.d, into) < AHEAD_COS) return false;
  if (s.el.block[s.el.initial_block[e]].shape != SHAPE_HEX8) mean_front(s, e, t);
  std::copy_n(t.face, 3, t.end);
  in_kink_ball(s, e, [&](int o, double) { t.given = t.given && !s.grown(o); });
  modes_in_space(s, e, t);
  return true;
}

int element_ahead(const Scan& s, int e, const double* J)
{
  int tip = -1;
  double far = 0.0, x[3], size = std::hypot(J[0], J[1], J[2]);
  const double h = s.fm.local[e];
  in_ball(s, e, [&](int o, double) {
    if (!s.cracked(o)) return;
    double along = 0.0;
    for (int i = 0; i < 3; ++i) along += J[i] * (s.fm.centre[3 * o + i] - s.fm.centre[3 * e + i]);
    if (tip >= 0 && along <= far) return;
    tip = o;
    far = along;
  });
  int o = tip;
  for (double r = 0.25; o >= 0 && s.cracked(o) && size > 0.0 && r <= 1.0; r += 0.25) {
    for (int i = 0; i < 3; ++i) x[i] = s.fm.centre[3 * tip + i] + J[i] / size * r * h;
    o = element_at(s, x, 1.5 * h);
  }
  return o >= 0 && s.cracked(o) ? -1 : o;
}

bool blocked(const Scan& s, int e, const double* J)
{
  const int o = element_ahead(s, e, J);
  if (o < 0 || !s.intact(o)) return false;
  return s.fm.def[o] < 0 || s.fm.gc[o] * s.fm.thickness[o] > TOUGHER * s.fm.gc[e] * s.fm.thickness[e];
}

bool near_interface(const Scan& s, const double* x, double distance, const double* way)
{
  for (size_t k = 0; k < s.fm.between.size(); ++k) {
    const double *X = &s.m.mesh.X[3 * static_cast<size_t>(s.fm.between[k])], *n = &s.fm.between_normal[3 * k];
    if (std::hypot(X[0] - x[0], X[1] - x[1], X[2] - x[2]) >= distance) continue;
    const bool bend = n[0] == 0.0 && n[1] == 0.0 && n[2] == 0.0;
    if (!way || bend) return true;
    if (std::fabs(n[0] * way[0] + n[1] * way[1] + n[2] * way[2]) > ALONG_INTERFACE) return true;
  }
  return false;
}

namespace {

// does the ball reach the boundary of the mesh?
bool at_surface(const Scan& s, int e)
{
  bool found = false;
  in_kink_ball(s, e, [&](int o, double) {
    if (s.el.initial_block[o] < 0) return;
    for (int f = 0; f < shape_info[s.el.block[s.el.initial_block[o]].shape].nface; ++f)
      found = found || s.fm.across[6 * o + f] < 0;
  });
  return found;
}

}  // namespace

namespace {

// variance of the centres of an initial crack across its axis over that along it; above: bent
// (test: fracture/crack_diagonal.inp)
const double STRAIGHT_SPREAD = 0.1;
// in element sizes: distance along the axis from the end of an initial crack to the faces of its tip; a step
// of a staircase at 45 degrees: 1.06 to the next faces  (test: fracture/crack_diagonal.inp)
const double STEP_DISTANCE = 0.8;

// the axis of an initial crack, which may be a staircase: end and direction of the line through the centres
// of its elements in the ball
//   inout  t   with the direction from their centre; false: bent, or e is not at its end
bool initial_axis(const Scan& s, int e, double radius, Tip& t)
{
  double sum = 0.0, mid[2] = {0, 0}, xx = 0.0, xy = 0.0, yy = 0.0, far = -1e300;
  const double* c = &s.fm.centre[3 * e];
  const auto each = [&](auto use) {
    frac_in_ball(s.fm, c, radius * AT_RADIUS, [&](int o, double) {
      if (s.cracked(o)) use(o, crack_share(s, e, o), &s.fm.centre[3 * o]);
    });
  };
  each([&](int, double v, const double* x) {
    sum += v;
    for (int i = 0; i < 2; ++i) mid[i] += v * x[i];
  });
  for (double& x : mid) x /= sum;
  each([&](int, double v, const double* x) {
    xx += v * (x[0] - mid[0]) * (x[0] - mid[0]);
    xy += v * (x[0] - mid[0]) * (x[1] - mid[1]);
    yy += v * (x[1] - mid[1]) * (x[1] - mid[1]);
  });
  const double half = 0.5 * (xx + yy), root = std::hypot(0.5 * (xx - yy), xy);
  if (half - root > STRAIGHT_SPREAD * (half + root)) return false;
  const double angle = 0.5 * std::atan2(2.0 * xy, xx - yy);
  double d[3] = {std::cos(angle), std::sin(angle), 0.0};
  if (d[0] * t.d[0] + d[1] * t.d[1] < 0.0)
    for (double& x : d) x = -x;
  each([&](int o, double, const double*) {
    for (int k = s.m.mesh.conn.off[o]; k < s.m.mesh.conn.off[o + 1]; ++k) {
      const double* X = &s.m.mesh.X[3 * static_cast<size_t>(s.m.mesh.conn.item[k])];
      far = std::max(far, (X[0] - mid[0]) * d[0] + (X[1] - mid[1]) * d[1]);
    }
  });
  const double at = (t.face[0] - mid[0]) * d[0] + (t.face[1] - mid[1]) * d[1];
  if (at < far - STEP_DISTANCE * s.fm.local[e]) return false;
  std::copy_n(d, 3, t.d);
  for (int i = 0; i < 2; ++i) t.end[i] = mid[i] + far * d[i];
  return true;
}

}  // namespace

// the tip of the crack at e, with its modes; false: e is not ahead of it, or the crack is too short
bool crack_tip(const Scan& s, int e, Tip& t)
{
  double into[3];
  const double radius = kink_radius(s, e);
  t.elem = e;
  if (!crack_face(s, e, t.face, into)) return false;
  std::copy_n(t.face, 2, t.end);
  if (!grown_along(s, e, t.face, radius, MIN_CRACK * s.fm.local[e], t.d)) return false;
  in_kink_ball(s, e, [&](int o, double) { t.given = t.given && !s.grown(o); });
  // the ligament is too short for J and the stress ahead
  if (!t.given && at_surface(s, e)) return false;
  modes_ahead(s, e, t);
  // a kink is shorter than the ball: use the direction in half of it, if K_II/K_I is smaller
  Tip half = t;
  if (!grown_along(s, e, t.face, 0.5 * radius, 0.0, half.d)) return false;
  if (t.given && t.d[0] * half.d[0] + t.d[1] * half.d[1] <= STRAIGHT_COS && initial_axis(s, e, radius, t)) {
    modes_ahead(s, e, t);                            // a staircase
    return t.d[0] * into[0] + t.d[1] * into[1] >= AHEAD_COS;
  }
  modes_ahead(s, e, half);
  half.straight = t.straight = t.d[0] * half.d[0] + t.d[1] * half.d[1] > STRAIGHT_COS;
  if (std::fabs(half.ratio) < std::fabs(t.ratio)) t = half;
  return t.d[0] * into[0] + t.d[1] * into[1] >= AHEAD_COS;
}

// width of the slot that ends at t, where the weight q decreases; 0 for a notch with inclined sides
double slot_width(const Scan& s, const Tip& t)
{
  const int e    = t.elem;
  const double h = s.fm.local[e];
  double opens = 0.0, side[2] = {0, 0}, size[2] = {0, 0};
  std::vector<FreeFace> face;
  free_faces(s, e, (s.dynamic() ? FRAC_NOTCH * h : radius_of(s, e)) * AT_RADIUS, face);
  for (const FreeFace& f : face) {
    const double x[2] = {f.mid[0] - t.end[0], f.mid[1] - t.end[1]};
    if (x[0] * t.d[0] + x[1] * t.d[1] > -h) continue;
    const double part = f.area[1] * t.d[0] - f.area[0] * t.d[1];        // of the face, along the slot
    opens += f.area[0] * t.d[0] + f.area[1] * t.d[1];
    size[part > 0.0] += std::fabs(part);
    side[part > 0.0] += std::fabs(part) * (x[1] * t.d[0] - x[0] * t.d[1]);
  }
  if (size[0] == 0.0 || size[1] == 0.0 || std::fabs(opens) > NOTCH_SLOPE * (size[0] + size[1])) return 0.0;
  return std::max(0.0, side[0] / size[0] - side[1] / size[1]);
}

// intact elements on a line of this length from x, up to an element that cannot break; false: none
bool along_line(const Scan& s, int e, const double* x, const double* d, double length, IntVec& out)
{
  const double step = 0.02 * s.fm.local[e];
  int now = -1;
  out.clear();
  for (double r = 0.5 * step; r < length; r += step) {
    const double at[3] = {x[0] + r * d[0], x[1] + r * d[1], x[2] + r * d[2]};
    if (now >= 0 && lies_in(s.m.mesh, now, at)) continue;
    now = element_at(s, at, 2.0 * s.fm.local[e]);
    if (now < 0 || (s.cracked(now) ? !out.empty() : s.fm.def[now] < 0)) break;
    if (s.intact(now) && std::find(out.begin(), out.end(), now) == out.end()) out.push_back(now);
  }
  return !out.empty();
}

namespace {

// in element sizes: a node nearer to a plane lies in it  (no test)
const double IN_PLANE = 0.05;

// centre of the points in which a plane through x with the normal n meets the lines between the nodes of an
// element; false: all nodes are on one side
bool cut_centre(const Mesh& mesh, int o, const double* x, const double* n, double least, double* centre)
{
  const int nen = mesh.conn.count(o), *node = mesh.conn.begin(o);
  double apart[8];
  int met = 0;
  for (int a = 0; a < nen; ++a) {
    const double* X = &mesh.X[3 * static_cast<size_t>(node[a])];
    apart[a] = (X[0] - x[0]) * n[0] + (X[1] - x[1]) * n[1] + (X[2] - x[2]) * n[2];
  }
  if (*std::max_element(apart, apart + nen) < least || *std::min_element(apart, apart + nen) > -least)
    return false;
  for (int i = 0; i < 3; ++i) centre[i] = 0.0;
  for (int a = 0; a < nen; ++a)
    for (int b = 0; b < nen; ++b) {
      if (apart[a] <= 0.0 || apart[b] > 0.0) continue;
      const double part = apart[a] / (apart[a] - apart[b]);
      for (int i = 0; i < 3; ++i) {
        const double X = mesh.X[3 * static_cast<size_t>(node[a]) + i];
        centre[i] += X + part * (mesh.X[3 * static_cast<size_t>(node[b]) + i] - X);
      }
      ++met;
    }
  for (int i = 0; i < 3; ++i) centre[i] /= met;
  return true;
}

}  // namespace

bool along_strip(const Scan& s, int e, const double* x, const double* d, const double* n, double length,
                 double aside, IntVec& out)
{
  const double h = s.fm.local[e];
  std::vector<std::pair<double, int>> cut;           // distance along d, element
  out.clear();
  frac_in_ball(s.fm, x, length + aside + h, [&](int o, double) {
    double c[3];
    if (!cut_centre(s.m.mesh, o, x, n, IN_PLANE * h, c)) return;
    for (int i = 0; i < 3; ++i) c[i] -= x[i];
    const double along = dot3(c, d);
    if (along < 0.0 || along > length || dot3(c, c) - along * along > aside * aside) return;
    if (s.intact(o) || (s.cracked(o) && along > h)) cut.emplace_back(along, o);
  });
  std::sort(cut.begin(), cut.end());
  for (const auto& [along, o] : cut) {
    if (!s.intact(o) || s.fm.def[o] < 0) break;
    out.push_back(o);
  }
  return !out.empty();
}
