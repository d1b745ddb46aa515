// ---------------------------------------------------------------------------
// frac_track.cpp : cohesive cracks that grow from their tips along lines               (doc/theory.md 2.5)
// ---------------------------------------------------------------------------
#include <algorithm>
#include <cmath>

#include <Eigen/Dense>

#include "base/comm.h"
#include "frac/frac.h"

namespace {

// Of E Gc/ft^2: radius of the mean stress that gives the direction; length of crack over which its direction
// follows that of the mean  (test: strength/l_panel_track.inp, strength/l_panel_meshes)
const double RADIUS_OF_ZONE = 1.0 / 6.0, TURN_OF_ZONE = 0.4;
// The same of the length of the line through the body, if that is less  (test: strength/mixed_beam.inp)
const double RADIUS_OF_LINE = 0.15, TURN_OF_LINE = 0.37;
// In element sizes: smallest radius; length of the line ahead of a tip, and radius around a crack in which
// nothing else begins, both at least the radius of the mean  (test: strength/l_panel_track.inp)
const double MEAN_SIZES = 2.0, REACH_SIZES = 4.0;
// A corner of the surface with a larger angle of material is re-entrant  (test: strength/slit.inp)
const double CORNER_ANGLE = 1.3 * M_PI;
// In element sizes: distance of such a corner from the centre of the element that opens first
// (test: strength/slit.inp)
const double CORNER_SIZES = 1.5;
// the weight exp(-d^2/2r^2) of the mean ends here, in radii  (no test)
const double CUT = 2.5;

// Largest in one increment: advance of a tip, of the reach of a crack; opening of a new crack, of 2 Gc/ft
// (test: strength/l_panel_track.inp), with du=0.8
const double ADVANCE = 0.5, YOUNG = 0.2;

// Fracture::tracked
enum { ON_PATH = 1, BESIDE = 2, FREE = 3 };

struct Tracker {
  const Model& m;
  const Step& step;
  const Elements& el;
  const FracMesh& fm;
  State& st;
  Fracture& fr;
  TrackResult& result;
  // [nelem] of all ranks: the largest opening of cracks that opened in this run, 0: none
  RealVec opening;
  IntVec reached;              // [nelem] number of the last search that reached an element
  int search = 0;
  int ntip() const { return static_cast<int>(fr.tip_elem.size()); }
  const ShapeInfo& shape(int e) const { return shape_info[elem_table[m.mesh.elem_type[e]].shape]; }
  const double* centre(int e) const { return &fm.centre[3 * static_cast<size_t>(e)]; }
  const double* node(int e, int a) const
  {
    return &m.mesh.X[3 * static_cast<size_t>(m.mesh.conn.begin(e)[a])];
  }
  const ElemBlock& block(int e) const { return el.block[el.initial_block[e]]; }
};

double cross(const double* a, const double* b) { return a[0] * b[1] - a[1] * b[0]; }
double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1]; }

bool tracks(const Tracker& t, int e) { return t.fm.def[e] >= 0 && t.m.fracture[t.fm.def[e]].track; }

// can the element begin to crack?
bool intact(const Tracker& t, int e) { return t.fr.phase[e] == AS_ELEMENT && t.el.broken(e) < 0; }

// has the element a crack that opened in this run?
bool begun(const Tracker& t, int e) { return t.opening[e] > 0.0; }

// the largest opening of an element of this rank; broken: more than any
double largest_opening(const Tracker& t, int e)
{
  if (t.el.broken(e) >= 0) return t.fr.time[e] > 0.0 ? HUGE_VAL : 0.0;
  double largest = 0.0;
  for (int g = t.el.gauss_of[e]; g < t.el.gauss_of[e + 1] && elem_cracked(t.st.n, e); ++g)
    largest = std::max(largest, crack_opening(t.block(e).law, history_at(t.st.n.he, t.el.history, g)));
  return largest;
}

// A crack that iterations have begun (crack_begin) and that has not opened since counts as not begun: it
// opens as one that has no history, and moves no tip
void forget_forced(Tracker& t, int e)
{
  const double FORCED = 1e-6;          // of the opening at zero traction, exactly: less is an opening
  const MatLaw& law   = t.block(e).law;
  if (!t.st.n.cracked[e] || t.el.broken(e) >= 0) return;
  if (largest_opening(t, e) == FORCED * crack_open(law.crack)) t.st.n.cracked[e] = 0;
}

void find_openings(Tracker& t)
{
  t.opening.assign(t.m.mesh.nelem(), 0.0);
  for (int e = 0; e < t.m.mesh.nelem(); ++e)
    if (tracks(t, e) && t.m.part.works(e)) {
      forget_forced(t, e);
      t.opening[e] = largest_opening(t, e);
    }
  frac_share(t.m.part, t.opening);
}

// E Gc/ft^2                                                                                         length
double zone_length(const Tracker& t, int e)
{
  const FractureDef& f = t.m.fracture[t.fm.def[e]];
  return t.block(e).law.material->young * f.gc / (f.ft * f.ft);
}

double mean_radius(const Tracker& t, int e)
{
  return std::max(RADIUS_OF_ZONE * zone_length(t, e), MEAN_SIZES * t.fm.local[e]);
}

double reach(const Tracker& t, int e) { return std::max(mean_radius(t, e), REACH_SIZES * t.fm.local[e]); }

bool present(const Tracker& t, int e)
{
  return e >= 0 && t.el.initial_block[e] >= 0 && t.fr.phase[e] == AS_ELEMENT;
}

// calls use(element) for the elements whose centres are within radius of x, and which faces connect with e
// through such elements: none across a slit, or of another body
template <class Use>
void around(Tracker& t, int e, const double* x, double radius, Use use)
{
  if (t.reached.empty()) t.reached.assign(t.m.mesh.nelem(), 0);
  IntVec found = {e};
  t.reached[e] = ++t.search;
  for (size_t k = 0; k < found.size(); ++k) {
    for (int f = 0; f < t.shape(found[k]).nface; ++f) {
      const int o = t.fm.across[6 * static_cast<size_t>(found[k]) + f];
      if (o < 0 || t.reached[o] == t.search || !tracks(t, o) || !present(t, o)) continue;
      const double* c = t.centre(o);
      if (std::hypot(c[0] - x[0], c[1] - x[1]) >= radius) continue;
      t.reached[o] = t.search;
      found.push_back(o);
    }
    use(found[k]);
  }
}

// J F^-1 sigma F^-T in the plane: lines and distances are those of t = 0
Eigen::Matrix2d stress_at_rest(const IpFields& f)
{
  Eigen::Matrix2d F, sigma;
  F << f.F[0], f.F[1], f.F[3], f.F[4];
  sigma << f.sig[0], f.sig[3], f.sig[3], f.sig[1];
  const Eigen::Matrix2d inverse = F.inverse();
  return F.determinant() * inverse * sigma * inverse.transpose();
}

// adds weight times the tensile part of the stress in the plane: S 11, 22, 12
void add_tension(const Eigen::Matrix2d& sig, double weight, double* S)
{
  const double half = 0.5 * (sig(0, 0) - sig(1, 1)), mid = 0.5 * sig.trace(), r = std::hypot(half, sig(0, 1));
  const double angle = 0.5 * std::atan2(sig(0, 1), half);
  const double c = std::cos(angle), s = std::sin(angle);
  const double s1 = weight * std::max(mid + r, 0.0), s2 = weight * std::max(mid - r, 0.0);
  S[0] += s1 * c * c + s2 * s * s;
  S[1] += s1 * s * s + s2 * c * c;
  S[2] += (s1 - s2) * c * s;
}

// a term of the mean stress
struct Term { int number; double S[3]; };

// Tensile stress in the plane around x, of elements of all ranks in the order of the deck         (2.36d).
// Elements are of the material of e; those that may break are connected with it
void mean_stress(Tracker& t, int e, const double* x, double r, double* S)
{
  std::vector<Term> all;
  const double at[3] = {x[0], x[1], 0.0};
  around(t, e, x, CUT * r, [](int) {});
  frac_in_ball(t.fm, at, CUT * r, [&](int o, double) {
    if (t.el.initial_block[o] < 0 || !intact(t, o) || !t.m.part.works(o)) return;
    if ((tracks(t, o) && t.reached[o] != t.search) || frac_other_material(t.el, e, o)) return;
    Term term{t.m.part.elem_number(o), {0, 0, 0}};
    for (int g = 0; g < t.shape(o).ngp; ++g) {
      IpFields f;
      elem_ip_fields(t.m, t.el, t.st.n, t.step.nlgeom, o, g, f);
      const double along = std::hypot(f.X[0] - x[0], f.X[1] - x[1]) / r;
      if (along < CUT) add_tension(stress_at_rest(f), f.V0 * std::exp(-0.5 * along * along), term.S);
    }
    all.push_back(term);
  });
  comm_allgatherv(all);
  std::sort(all.begin(), all.end(), [](const Term& a, const Term& b) { return a.number < b.number; });
  for (const Term& term : all)
    for (int i = 0; i < 3; ++i) S[i] += term.S[i];
}

// angle from d to the line across the largest principal stress of the mean around x, -pi/2 to pi/2  (2.36d).
// Collective.
//   in   line   length of the line through the body
double turn_wanted(Tracker& t, int e, const double* x, const double* d, double line)
{
  double S[3] = {0, 0, 0};
  const double r = std::min(RADIUS_OF_ZONE * zone_length(t, e), RADIUS_OF_LINE * line);
  mean_stress(t, e, x, std::max(r, MEAN_SIZES * t.fm.local[e]), S);
  const double EQUAL = 1e-9;           // principal stresses: no direction
  if (std::hypot(S[2], 0.5 * (S[0] - S[1])) <= EQUAL * (S[0] + S[1])) return 0.0;
  const double angle = 0.5 * std::atan2(S[2], 0.5 * (S[0] - S[1])) + 0.5 * M_PI;
  return std::remainder(angle - std::atan2(d[1], d[0]), M_PI);
}

// where the line from x along d leaves the element, and through which face
int leave(const Tracker& t, int e, const double* x, const double* d, double* out)
{
  const double TO_FACE = 1e-9;         // cosine of a line that is parallel to a face
  const ShapeInfo& s = t.shape(e);
  double nearest = HUGE_VAL;
  int face = 0;
  for (int f = 0; f < s.nface; ++f) {
    const double *a = t.node(e, s.face[f][0]), *b = t.node(e, s.face[f][1]);
    const double n[2] = {b[1] - a[1], a[0] - b[0]};      // outward, times the length
    const double along = d[0] * n[0] + d[1] * n[1];
    if (along <= TO_FACE * std::hypot(n[0], n[1])) continue;
    const double distance = ((a[0] - x[0]) * n[0] + (a[1] - x[1]) * n[1]) / along;
    if (distance < nearest) {
      nearest = distance;
      face    = f;
    }
  }
  for (int i = 0; i < 2; ++i) out[i] = x[i] + std::max(nearest, 0.0) * d[i];
  return face;
}

// length of the line from x in element e along d, to the end of the elements that may break
double length_ahead(const Tracker& t, int e, const double* from, const double* d)
{
  double x[2] = {from[0], from[1]}, length = 0.0;
  for (int k = 0; k < t.m.mesh.nelem() && e >= 0 && tracks(t, e) && present(t, e); ++k) {
    double out[2];
    const int face = leave(t, e, x, d, out);
    length += std::hypot(out[0] - x[0], out[1] - x[1]);
    std::copy_n(out, 2, x);
    e = t.fm.across[6 * static_cast<size_t>(e) + face];
  }
  return length;
}

// the same along d and back
double length_through(const Tracker& t, int e, const double* x, const double* d)
{
  const double back[2] = {-d[0], -d[1]};
  return length_ahead(t, e, x, d) + length_ahead(t, e, x, back);
}

// Elements within radius of x, connected with e, and not behind it along d, begin as (2.33)
void free_around(Tracker& t, int e, const double* x, double radius, const double* d)
{
  around(t, e, x, radius, [&](int o) {
    const double to[2] = {t.centre(o)[0] - x[0], t.centre(o)[1] - x[1]};
    if (t.fr.tracked[o] == 0 && (begun(t, o) || intact(t, o)) && dot(to, d) >= -t.fm.size[o])
      t.fr.tracked[o] = FREE;
  });
}

// elements around those that began as (2.33) begin so too
void spread_free(Tracker& t)
{
  IntVec all;
  for (int e = 0; e < t.m.mesh.nelem(); ++e)
    if (t.fr.tracked[e] == FREE && begun(t, e)) all.push_back(e);
  const double NOWHERE[2] = {0, 0};
  for (int e : all) free_around(t, e, t.centre(e), MEAN_SIZES * t.fm.local[e], NOWHERE);
}

// The line of a tip along d ends at x, after element e. Square to a border there is nothing ahead, and the
// crack stops
void lose(Tracker& t, int e, const double* x, const double* d)
{
  const double AHEAD = 1.5;            // sizes of an element
  bool found = false;
  around(t, e, x, reach(t, e), [&](int o) {
    const double to[2] = {t.centre(o)[0] - x[0], t.centre(o)[1] - x[1]};
    found = found || dot(to, d) > AHEAD * t.fm.size[o];
  });
  if (!found) return;
  t.result.lost = e;
  free_around(t, e, x, reach(t, e), d);
}

// can an element not break, or is it stronger or tougher than e?
bool tougher(const Tracker& t, int e, int other)
{
  if (!present(t, other)) return false;
  if (!tracks(t, other)) return true;
  const FractureDef &a = t.m.fracture[t.fm.def[e]], &b = t.m.fracture[t.fm.def[other]];
  return b.ft > a.ft || b.gc > a.gc;
}

// Does the line from x along d end after element e? The one ahead of it is tougher, and so is nothing behind:
// a line crosses a weak layer
bool ends_line(const Tracker& t, int e, int ahead, const double* from, const double* d)
{
  if (!tougher(t, e, ahead)) return false;
  const double back[2] = {-d[0], -d[1]}, end = reach(t, e);
  double x[2] = {from[0], from[1]}, length = 0.0;
  for (int k = 0, o = e; tracks(t, ahead) && k < t.m.mesh.nelem() && length < end; ++k) {
    double out[2];
    const int face = leave(t, o, x, back, out);
    length += std::hypot(out[0] - x[0], out[1] - x[1]);
    std::copy_n(out, 2, x);
    o = t.fm.across[6 * static_cast<size_t>(o) + face];
    if (!present(t, o) || !tracks(t, o)) break;
    if (!tougher(t, o, ahead)) return false;
  }
  return true;
}

// First marks: elements that may break, and touch what ends a line as all others within three faces do, are
// a row, in which a line has no room to turn: they begin as (2.33)
void begin(Tracker& t)
{
  const int n = t.m.mesh.nelem();
  const int FACES = 3, ROW = 4;        // elements in a row, at least
  int rows = 0;
  std::vector<char> edge(n, 0), wide(n, 0);
  const auto neighbours = [&](int e, auto use) {
    for (int f = 0; f < t.shape(e).nface; ++f) {
      const int o = t.fm.across[6 * static_cast<size_t>(e) + f];
      if (present(t, o)) use(o);
    }
  };
  // by nodes too: of triangles crossed in squares only two touch the sides of a row by faces
  const auto at_nodes = [&](int e, auto use) {
    for (int a = 0; a < t.shape(e).nen; ++a) {
      const int node = t.m.mesh.conn.begin(e)[a];
      for (int k = 0; k < t.fm.of_node.count(node); ++k)
        if (present(t, t.fm.of_node.begin(node)[k])) use(t.fm.of_node.begin(node)[k]);
    }
  };
  t.fr.tracked.assign(n, 0);
  for (int e = 0; e < n; ++e)
    if (tracks(t, e)) at_nodes(e, [&](int o) { edge[e] |= tougher(t, e, o); });
  for (int e = 0; e < n; ++e) wide[e] = tracks(t, e) && !edge[e];
  for (int k = 0; k < FACES; ++k) {
    const std::vector<char> last = wide;
    for (int e = 0; e < n; ++e)
      if (tracks(t, e) && !last[e]) neighbours(e, [&](int o) { wide[e] |= last[o]; });
  }
  for (int e = 0; e < n; ++e) {
    if (!tracks(t, e) || wide[e]) continue;
    t.fr.tracked[e] = FREE;
    if (++rows >= ROW) t.result.lost = e;
  }
}

// The element that a line from x along d enters beyond a hole, within the reach of element e and connected
// with it: beside the crack nothing else begins there. -1: none
//   out   in   where
int beyond_hole(Tracker& t, int e, const double* x, const double* d, double* in)
{
  const double ROUND = 1e-6;           // sizes of an element
  double nearest = reach(t, e);
  int found = -1;
  around(t, e, x, 2.0 * nearest, [&](int o) {
    const ShapeInfo& s = t.shape(o);
    for (int f = 0; f < s.nface; ++f) {
      if (present(t, t.fm.across[6 * static_cast<size_t>(o) + f])) continue;
      const double *a = t.node(o, s.face[f][0]), *b = t.node(o, s.face[f][1]);
      const double n[2] = {b[1] - a[1], a[0] - b[0]}, side[2] = {b[0] - a[0], b[1] - a[1]},
                   to[2] = {a[0] - x[0], a[1] - x[1]};
      if (dot(d, n) >= 0.0) continue;
      const double along = dot(to, n) / dot(d, n), at = cross(to, d) / cross(d, side);
      if (along < ROUND * t.fm.size[o] || along >= nearest || at < 0.0 || at > 1.0) continue;
      nearest = along;
      found   = o;
    }
  });
  for (int i = 0; i < 2; ++i) in[i] = x[i] + nearest * d[i];
  return found >= 0 && t.fr.tracked[found] == 0 && intact(t, found) ? found : -1;
}

// moves tip k through the last element on its line that has begun, and all before it, which keep the line;
// the length it moves by
double advance(Tracker& t, int k)
{
  double *tip = &t.fr.tip[4 * static_cast<size_t>(k)], *d = tip + 2, x[2] = {tip[0], tip[1]};
  double length = 0.0, moved = 0.0;
  int& ahead = t.fr.tip_elem[k];
  int last   = -1;
  bool ends  = false;
  IntVec passed;
  const double end = reach(t, ahead);
  for (int e = ahead; e >= 0 && tracks(t, e) && t.fr.tracked[e] != ON_PATH && length < end;) {
    if (!begun(t, e) && !intact(t, e)) break;
    double out[2];
    const int face = leave(t, e, x, d, out);
    length += std::hypot(out[0] - x[0], out[1] - x[1]);
    std::copy_n(out, 2, x);
    passed.push_back(e);
    const bool opens = begun(t, e);
    const int next   = t.fm.across[6 * static_cast<size_t>(e) + face];
    ends = ends_line(t, e, next, x, d);
    e    = ends && !opens ? -1 : next;
    if (!opens) continue;
    for (int o : passed) t.fr.tracked[o] = ON_PATH;
    last = passed.back();
    passed.clear();
    std::copy_n(x, 2, tip);
    moved = length;
    ahead = e;
    if (ends) break;
  }
  // it meets a hole, and goes on beyond it
  const bool removed = ahead >= 0 && t.fr.phase[ahead] == AS_NOTHING;
  if (removed || (ahead < 0 && last >= 0 && !ends)) {
    double in[2];
    const int from = removed && t.fm.def[ahead] >= 0 ? ahead : last;
    if (from >= 0) ahead = beyond_hole(t, from, tip, d, in);
    if (from >= 0 && ahead >= 0) std::copy_n(in, 2, tip);
  }
  // it meets a crack, or what cannot break
  const bool stops = ahead >= 0 && (t.fr.tracked[ahead] == ON_PATH || !tracks(t, ahead) ||
                                    !(begun(t, ahead) || intact(t, ahead)));
  t.result.advance = std::max(t.result.advance, moved / (ADVANCE * end));
  if (ends && last >= 0 && passed.empty()) {
    lose(t, last, tip, d);
    ahead = -1;
  }
  if (stops) ahead = -1;
  return moved;
}

// A tip lies on the face between the last element of the crack, which its line has cut, and that ahead. A
// direction that points back into the last element becomes that along the face, and a little ahead
void keep_ahead(const Tracker& t, int ahead, const double* x, double* d)
{
  const double ROUND = 1e-6, LEAST = 0.05;             // sizes of an element; angle with the face
  double out[2];
  const int* face = t.shape(ahead).face[leave(t, ahead, x, d, out)];
  if (std::hypot(out[0] - x[0], out[1] - x[1]) > ROUND * t.fm.size[ahead]) return;
  const double *a = t.node(ahead, face[0]), *b = t.node(ahead, face[1]);
  const double length = std::hypot(b[0] - a[0], b[1] - a[1]);
  double along[2] = {(b[0] - a[0]) / length, (b[1] - a[1]) / length};
  const double in[2] = {-along[1], along[0]}, side = dot(along, d) < 0.0 ? -1.0 : 1.0;
  for (int i = 0; i < 2; ++i) d[i] = side * std::cos(LEAST) * along[i] + std::sin(LEAST) * in[i];
}

// turns tip k, which has moved, towards the direction of the mean
void turn(Tracker& t, int k, double moved)
{
  const int e = t.fr.tip_elem[k];
  double *x = &t.fr.tip[4 * static_cast<size_t>(k)], *d = x + 2;
  const double line = length_through(t, e, x, d);
  const double over = std::min(TURN_OF_ZONE * zone_length(t, e), TURN_OF_LINE * line);
  const double angle = std::atan2(d[1], d[0]) + std::min(1.0, moved / over) * turn_wanted(t, e, x, d, line);
  d[0] = std::cos(angle);
  d[1] = std::sin(angle);
  keep_ahead(t, e, x, d);
}

// the largest principal stress in the plane of the mean over the integration points of an element
double largest_at_rest(const Tracker& t, int e)
{
  Eigen::Matrix2d S = Eigen::Matrix2d::Zero();
  for (int g = 0; g < t.shape(e).ngp; ++g) {
    IpFields f;
    elem_ip_fields(t.m, t.el, t.st.n, t.step.nlgeom, e, g, f);
    S += stress_at_rest(f) / t.shape(e).ngp;
  }
  return 0.5 * S.trace() + std::hypot(0.5 * (S(0, 0) - S(1, 1)), S(0, 1));
}

// The largest principal stress over the strength of an element beside the tip of a crack
struct Hot { double share = 0.0; int number = -1; double X[2] = {0, 0}; };

// the element that is stressed most within the reach of a tip in element e, of those that may not begin.
// Collective
Hot most_stressed(Tracker& t, int e, const double* x)
{
  Hot most;
  around(t, e, x, reach(t, e), [&](int o) {
    if (t.fr.tracked[o] != 0 || begun(t, o) || !intact(t, o) || !t.m.part.works(o)) return;
    const Hot hot{largest_at_rest(t, o) / t.m.fracture[t.fm.def[o]].ft, t.m.part.elem_number(o),
                  {t.centre(o)[0], t.centre(o)[1]}};
    if (hot.share > most.share || (hot.share == most.share && hot.number < most.number)) most = hot;
  });
  std::vector<Hot> all = {most};
  comm_allgatherv(all);
  for (const Hot& hot : all)
    if (hot.share > most.share || (hot.share == most.share && hot.number < most.number)) most = hot;
  return most;
}

// the element within two sizes of e that has not begun and contains a point, -1: none
int element_at(Tracker& t, int e, const double* at)
{
  int found = -1;
  around(t, e, at, MEAN_SIZES * t.fm.local[e], [&](int o) {
    const ShapeInfo& s = t.shape(o);
    bool inside = t.fr.tracked[o] == 0 && intact(t, o) && !begun(t, o);
    for (int f = 0; f < s.nface; ++f) {
      const double *a = t.node(o, s.face[f][0]), *b = t.node(o, s.face[f][1]);
      const double side[2] = {b[0] - a[0], b[1] - a[1]}, to[2] = {at[0] - a[0], at[1] - a[1]};
      inside = inside && cross(side, to) >= 0.0;
    }
    if (inside) found = o;
  });
  return found;
}

// A tip rests while what may not begin beside it is stressed far above the strength: its line is turned at
// once, towards what is stressed most                                                              (2.36d)
void turn_at_rest(Tracker& t, int k)
{
  const double STRESSED = 2.0, OFF = 0.02;             // strengths; sizes of an element
  const int e = t.fr.tip_elem[k];
  if (begun(t, e)) return;
  double *x = &t.fr.tip[4 * static_cast<size_t>(k)], *d = x + 2;
  const Hot hot = most_stressed(t, e, x);
  if (hot.share < STRESSED) return;
  const double angle = std::atan2(d[1], d[0]) + turn_wanted(t, e, x, d, length_through(t, e, x, d));
  const double to[2] = {hot.X[0] - x[0], hot.X[1] - x[1]};
  double next[2] = {std::cos(angle), std::sin(angle)};
  if (dot(next, to) < 0.0)
    for (double& c : next) c = -c;
  const double off   = OFF * t.fm.size[e], at[2] = {x[0] + off * next[0], x[1] + off * next[1]};
  const int ahead    = element_at(t, e, at);
  if (ahead < 0) return;
  std::copy_n(next, 2, d);
  t.fr.tip_elem[k] = ahead;
}

// advances tips from first on, and turns those that have moved
void grow(Tracker& t, int first)
{
  for (int k = first; k < t.ntip(); ++k) {
    if (t.fr.tip_elem[k] < 0) continue;
    const double moved = advance(t, k);
    if (t.fr.tip_elem[k] < 0) continue;
    if (moved > 0.0) turn(t, k, moved);
    else turn_at_rest(t, k);
  }
}

void add_tip(Tracker& t, int e, const double* d)
{
  double out[2];
  const int face = leave(t, e, t.centre(e), d, out), ahead = t.fm.across[6 * static_cast<size_t>(e) + face];
  if (ends_line(t, e, ahead, out, d)) return lose(t, e, out, d);
  if (ahead < 0 || !tracks(t, ahead)) return;
  t.fr.tip.insert(t.fr.tip.end(), {out[0], out[1], d[0], d[1]});
  t.fr.tip_elem.push_back(ahead);
}

// is element e, which has begun, near a crack?
bool near_crack(Tracker& t, int e)
{
  const double *x = t.centre(e), radius = REACH_SIZES * t.fm.local[e];
  bool found = false;
  around(t, e, x, radius, [&](int o) {
    found = found || (t.fr.tracked[o] && (t.fr.tracked[o] != FREE || begun(t, o)));
  });
  for (int k = 0; k < t.ntip(); ++k) {
    const double* tip = &t.fr.tip[4 * static_cast<size_t>(k)];
    found = found || (t.fr.tip_elem[k] >= 0 && t.reached[t.fr.tip_elem[k]] == t.search &&
                      std::hypot(x[0] - tip[0], x[1] - tip[1]) < radius);
  }
  return found;
}

// A re-entrant corner of the surface; the end of a slit is one of 360 degrees
using Corner = TrackStart;

// local index of a node in an element
int local_of(const Tracker& t, int e, int node)
{
  const int* c = t.m.mesh.conn.begin(e);
  return static_cast<int>(std::find(c, c + t.shape(e).nen, node) - c);
}

// a, b: from node a of the element to the nodes after and before it, counterclockwise
void sides(const Tracker& t, int e, int node, double* a, double* b)
{
  const int k = local_of(t, e, node), nen = t.shape(e).nen;
  const double *x = t.node(e, k), *next = t.node(e, (k + 1) % nen), *last = t.node(e, (k + nen - 1) % nen);
  for (int i = 0; i < 2; ++i) {
    a[i] = next[i] - x[i];
    b[i] = last[i] - x[i];
  }
}

// has the surface a re-entrant corner at a node?
bool reentrant(const Tracker& t, int node, Corner& c)
{
  double turn = 0.0, out[2] = {0, 0};
  for (int k = 0; k < t.fm.of_node.count(node); ++k) {
    const int e = t.fm.of_node.begin(node)[k];
    if (!present(t, e)) continue;
    double a[2], b[2];
    sides(t, e, node, a, b);
    turn += std::atan2(cross(a, b), dot(a, b));
    const ShapeInfo& shape = t.shape(e);
    for (int f = 0; f < shape.nface; ++f) {
      const int *conn = t.m.mesh.conn.begin(e), from = conn[shape.face[f][0]], to = conn[shape.face[f][1]];
      if (from != node && to != node) continue;
      if (present(t, t.fm.across[6 * static_cast<size_t>(e) + f])) continue;
      const double* side = from == node ? a : b;
      for (int i = 0; i < 2; ++i) out[i] += side[i] / std::hypot(side[0], side[1]);
    }
  }
  const double length = std::hypot(out[0], out[1]);
  if (turn < CORNER_ANGLE || length == 0.0) return false;
  c.node = node;
  for (int i = 0; i < 2; ++i) c.into[i] = -out[i] / length;
  return true;
}

// the re-entrant corner near the centre of an element; of two, which are those of a blunt notch, none
Corner corner_near(Tracker& t, int e)
{
  Corner found, c;
  bool blunt = false;
  const double *x = t.centre(e), radius = CORNER_SIZES * t.fm.local[e];
  around(t, e, x, 2.0 * radius, [&](int o) {
    for (int a = 0; present(t, o) && a < t.shape(o).nen; ++a) {
      const int node = t.m.mesh.conn.begin(o)[a];
      const double* X = t.node(o, a);
      if (node == found.node || std::hypot(X[0] - x[0], X[1] - x[1]) > radius) continue;
      if (!reentrant(t, node, c)) continue;
      blunt = blunt || found.node >= 0;
      found = c;
    }
  });
  return blunt ? Corner() : found;
}

// A line from a corner: the node belongs to one side of it, and the elements on the other side, the flank,
// are parted from the node
struct Start {
  int side;                    // 1: the flank is to the left of the line, -1: to the right
  int ahead = -1;              // the first element of the line
  IntVec flank;
  double angle = 0.0;          // from the line to the surface on the side of the flank
  double area  = 0.0;          // of the parting, of all elements of the flank
};

// of the shape function of a node of the element at an integration point
const double* gradient(const Tracker& t, int e, int g, int node)
{
  const ElemBlock& b = t.block(e);
  const size_t at    = (b.gauss(t.el.slot_of[e]) + g) * t.shape(e).nen + local_of(t, e, node);
  return &b.dNdX[2 * at];
}

// area of the cut between a node of an element and the others, V/b of (2.36c)
double cut_area(const Tracker& t, int e, int node)
{
  const int ngp = t.shape(e).ngp;
  double sum = 0.0;
  for (int g = 0; g < ngp; ++g) {
    const double* dN = gradient(t, e, g, node);
    sum += t.fm.volume[e] / ngp * std::hypot(dN[0], dN[1]);
  }
  return sum;
}

// the start along d with its flank on one side; on an edge the first element is that of the flank. Sides are
// those of angles from the middle of the material: at the end of a slit it spans 360 degrees
Start start_on(const Tracker& t, const Corner& c, const double* d, int side)
{
  const int node = c.node;
  const double ROUND = side * 1e-6, to[2] = {d[0] - ROUND * d[1], d[1] + ROUND * d[0]};        // angle
  const auto turned = [&](const double* x) { return std::atan2(cross(c.into, x), dot(c.into, x)); };
  Start s;
  s.side = side;
  for (int k = 0; k < t.fm.of_node.count(node); ++k) {
    const int e = t.fm.of_node.begin(node)[k];
    if (!present(t, e)) continue;
    double a[2], b[2];
    sides(t, e, node, a, b);
    const double middle[2] = {a[0] + b[0], a[1] + b[1]};
    if (cross(a, to) >= 0.0 && cross(to, b) > 0.0) {
      s.ahead = e;
      s.angle += std::fabs(std::atan2(cross(d, side > 0 ? b : a), dot(d, side > 0 ? b : a)));
    } else if (side * (turned(middle) - turned(to)) > 0.0) {
      s.flank.push_back(e);
      s.angle += std::atan2(cross(a, b), dot(a, b));
      s.area += cut_area(t, e, node);
    }
  }
  return s;
}

// the flank with the smaller angle; of equal ones, at a slit, that with the smaller area
Start better_start(const Start& a, const Start& b)
{
  const double EQUAL_ANGLE = 0.4, ROUND = 1e-6;        // radians; relative
  if (a.ahead < 0 || b.ahead < 0) return a.ahead < 0 ? b : a;
  if (std::fabs(a.angle - b.angle) > EQUAL_ANGLE) return a.angle < b.angle ? a : b;
  return b.area < (1.0 - ROUND) * a.area ? b : a;
}

// calls mark(history) at the integration points at t(n)
template <class Mark>
void for_history(Tracker& t, int e, Mark mark)
{
  for (int g = 0; g < t.shape(e).ngp; ++g)
    mark(g, history_at(t.st.n.he, t.el.history, t.el.gauss_of[e] + g));
}

// an element of the flank of a start opens between its node there and the others
void mark_flank(Tracker& t, int e, int node)
{
  const ElemBlock& b = t.block(e);
  const double LEAST[3] = {0, 0, 0};   // no normal of a line: the smallest p
  for_history(t, e, [&](int g, double* h) {
    const double* dN  = gradient(t, e, g, node);
    const double G[3] = {dN[0], dN[1], 0.0};
    crack_line(b.law, G, LEAST, h);
  });
}

// the start of a crack along c.d
Start start_of(const Tracker& t, const Corner& c)
{
  return better_start(start_on(t, c, c.d, 1), start_on(t, c, c.d, -1));
}

// A crack that has begun in element root starts at a corner: the increment is repeated with a tip there.
// False: nothing can break there
bool start_at(Tracker& t, int root, Corner c)
{
  const double* X = &t.m.mesh.X[3 * static_cast<size_t>(c.node)];
  std::copy_n(c.into, 2, c.d);
  const int ahead = start_of(t, c).ahead;
  if (ahead < 0) return false;
  const double line = length_ahead(t, ahead, X, c.d);
  const double angle = std::atan2(c.into[1], c.into[0]) + turn_wanted(t, root, X, c.into, line);
  c.d[0] = std::cos(angle);
  c.d[1] = std::sin(angle);
  const Start s = start_of(t, c);
  if (s.ahead < 0 || !tracks(t, s.ahead) || !(intact(t, s.ahead) || begun(t, s.ahead))) return false;
  c.root = root;
  t.result.start.push_back(c);
  return true;
}

// a tip at a corner, and its flank
void add_start(Tracker& t, const Corner& c)
{
  const double* X = &t.m.mesh.X[3 * static_cast<size_t>(c.node)];
  const Start s   = start_of(t, c);
  if (s.ahead < 0) return;             // not at t(n): the increment is cut after MOST_STARTS
  const double off = 1e-6 * s.side * t.fm.size[s.ahead];       // the node is on one side of the line
  t.fr.tip.insert(t.fr.tip.end(), {X[0] - off * c.d[1], X[1] + off * c.d[0], c.d[0], c.d[1]});
  t.fr.tip_elem.push_back(s.ahead);
  for (int e : s.flank) {
    if (!tracks(t, e) || !intact(t, e)) continue;
    t.fr.tracked[e] = BESIDE;
    mark_flank(t, e, c.node);
  }
}

// has the crack of element e started at a corner?
bool started(Tracker& t, int e)
{
  const double* x = t.centre(e);
  bool found = false;
  for (const Corner& c : t.result.start) {
    const double* X = &t.m.mesh.X[3 * static_cast<size_t>(c.node)];
    if (std::hypot(X[0] - x[0], X[1] - x[1]) >= reach(t, c.root)) continue;
    around(t, c.root, X, reach(t, c.root), [&](int o) { found = found || o == e; });
  }
  return found;
}

// the line of a crack that starts in element e
void start_direction(Tracker& t, int e, double* d)
{
  const double *x = t.centre(e), axis[2] = {1.0, 0.0};
  const double first    = turn_wanted(t, e, x, axis, HUGE_VAL);
  const double along[2] = {std::cos(first), std::sin(first)};
  const double angle    = first + turn_wanted(t, e, x, along, length_through(t, e, x, along));
  d[0] = std::cos(angle);
  d[1] = std::sin(angle);
}

// element e gets two tips
void add_root(Tracker& t, int e, const double* d)
{
  t.fr.tracked[e] = ON_PATH;
  for (int side = -1; side <= 1; side += 2) {
    const double to[2] = {side * d[0], side * d[1]};
    add_tip(t, e, to);
  }
}

// limits the opening of a crack in the increment in which it begins
void note_opening(Tracker& t, int e)
{
  const FractureDef& f = t.m.fracture[t.fm.def[e]];
  t.result.advance = std::max(t.result.advance, t.opening[e] * f.ft / (YOUNG * 2.0 * f.gc));
}

// Statics: cracks that begin in one increment unload each other in the next, or, if none is ahead of the
// others, grow side by side with more load than one alone. So of those in all, by opening, the widest starts,
// and where others have begun too, the increment is repeated with this one alone                   (2.36d)
bool start_alone(Tracker& t, const std::vector<std::pair<double, int>>& all)
{
  if (t.step.proc != PROC_STATIC || t.step.arc.on) return false;
  int beside = 0;
  for (const auto& [opening, e] : all) beside += !t.fr.tracked[e] && !near_crack(t, e);
  const int root = all.front().second;
  if (beside < 2 || near_crack(t, root) || corner_near(t, root).node >= 0) return false;
  note_opening(t, root);
  TrackStart c;
  c.root = root;
  start_direction(t, root, c.d);
  t.result.start.push_back(c);
  return true;
}

// A crack that was to start alone, and has not opened, as the increment was cut, is taken back
void forget_starts(Tracker& t)
{
  for (int e = 0; e < t.m.mesh.nelem(); ++e) {
    if (t.fr.tracked[e] != ON_PATH || begun(t, e) || !intact(t, e)) continue;
    bool grown = false;
    IntVec beside;
    for (int f = 0; f < t.shape(e).nface; ++f) {
      const int o = t.fm.across[6 * static_cast<size_t>(e) + f];
      if (o < 0) continue;
      grown = grown || t.fr.tracked[o] == ON_PATH;
      beside.push_back(o);
    }
    if (grown) continue;
    t.fr.tracked[e] = 0;
    for (int& ahead : t.fr.tip_elem)
      if (ahead >= 0 && std::find(beside.begin(), beside.end(), ahead) != beside.end()) ahead = -1;
  }
}

// elements that have begun apart from all cracks: the one that is open widest first
void find_roots(Tracker& t)
{
  std::vector<std::pair<double, int>> all;
  for (int e = 0; e < t.m.mesh.nelem(); ++e)
    if (begun(t, e) && !t.fr.tracked[e]) all.push_back({-t.opening[e], e});
  if (all.empty()) return;
  std::sort(all.begin(), all.end());
  if (start_alone(t, all)) return;
  for (const auto& [opening, e] : all) {
    if (t.fr.tracked[e] || started(t, e)) continue;
    if (near_crack(t, e)) {
      t.fr.tracked[e] = BESIDE;
      continue;
    }
    note_opening(t, e);
    const Corner corner = corner_near(t, e);
    if (corner.node >= 0 && start_at(t, e, corner)) continue;
    double d[2];
    start_direction(t, e, d);
    add_root(t, e, d);
  }
}

// the line from x along d cuts the nodes of an element into two sides
void mark_line(Tracker& t, int e, const double* x, const double* d)
{
  const ElemBlock& b = t.block(e);
  const int nen      = t.shape(e).nen;
  const double N[3]  = {-d[1], d[0], 0.0};
  const double ON_LINE = 1e-9;         // sizes of an element: a node on the line is on its right
  for_history(t, e, [&](int g, double* h) {
    const double* dN = &b.dNdX[(b.gauss(t.el.slot_of[e]) + g) * nen * 2];
    double G[3] = {0, 0, 0};
    for (int a = 0; a < nen; ++a) {
      const double* X = t.node(e, a);
      if ((X[0] - x[0]) * N[0] + (X[1] - x[1]) * N[1] <= ON_LINE * t.fm.size[e]) continue;
      for (int i = 0; i < 2; ++i) G[i] += dN[2 * a + i];
    }
    const double PARTITION = 1e-9;     // all nodes on one side
    if (std::hypot(G[0], G[1]) * t.fm.size[e] > PARTITION) crack_line(b.law, G, N, h);
    else crack_free(b.law, h);
  });
}

// an element on a line begins where |S n| reaches p ft, whatever its other stresses
void begin_at_least(Tracker& t, int e)
{
  const double* N = crack_normal(t.block(e).law, history_at(t.st.n.he, t.el.history, t.el.gauss_of[e]));
  if ((N[0] != 0.0 || N[1] != 0.0) && t.m.part.works(e)) t.st.n.cracked[e] = 1;
}

// largest_at_rest over the strength, of intact elements of all ranks
RealVec over_strength_of_all(const Tracker& t)
{
  RealVec over(t.m.mesh.nelem(), 0.0);
  for (int e = 0; e < t.m.mesh.nelem(); ++e) {
    if (!tracks(t, e) || !intact(t, e) || begun(t, e) || !t.m.part.works(e)) continue;
    over[e] = largest_at_rest(t, e) / crack_strength(t.block(e).law.crack);
  }
  frac_share(t.m.part, over);
  return over;
}

// Beyond REACH_SIZES of all cracks and tips, what is stressed above the strength may begin all the same: the
// crack does not unload it, as with the length of its zone beyond the height of a beam            (2.36c)
void open_stressed(Tracker& t, std::vector<char>& shut)
{
  const double STRESSED = 1.005;       // strengths  (test: strength/bend_track.inp)
  const RealVec over = over_strength_of_all(t);
  std::vector<char> near(t.m.mesh.nelem(), 0);
  const auto close = [&](int e, const double* x) {
    around(t, e, x, REACH_SIZES * t.fm.local[e], [&](int o) { near[o] = 1; });
  };
  for (int e = 0; e < t.m.mesh.nelem(); ++e)
    if (t.fr.tracked[e] == ON_PATH || t.fr.tracked[e] == BESIDE) close(e, t.centre(e));
  for (int k = 0; k < t.ntip(); ++k)
    if (t.fr.tip_elem[k] >= 0) close(t.fr.tip_elem[k], &t.fr.tip[4 * static_cast<size_t>(k)]);
  for (int e = 0; e < t.m.mesh.nelem(); ++e)
    if (!near[e] && over[e] > STRESSED) shut[e] = 0;
}

// elements that may begin in the next increment: on the lines from the tips, and, unless a crack is to start
// alone, what open_stressed allows and is apart from all cracks
void mark(Tracker& t, bool alone)
{
  const int n = t.m.mesh.nelem();
  const auto can_begin = [&](int e) {
    return tracks(t, e) && t.fr.tracked[e] == 0 && intact(t, e);
  };
  const auto free = [&](int e) { return t.fr.tracked[e] == FREE && intact(t, e) && !begun(t, e); };
  std::vector<char> shut(n, alone);
  for (int e = 0; e < n; ++e)
    if (t.fr.tracked[e] == ON_PATH || t.fr.tracked[e] == BESIDE)
      around(t, e, t.centre(e), reach(t, e), [&](int o) { shut[o] = 1; });
  for (int k = 0; k < t.ntip(); ++k) {
    const int ahead = t.fr.tip_elem[k];
    // statics without RIKS: as long as a crack grows no other begins below the strength: nothing else decides
    const bool all      = t.step.proc == PROC_STATIC && !t.step.arc.on;
    const double radius = all ? HUGE_VAL : reach(t, std::max(ahead, 0));
    if (ahead >= 0) around(t, ahead, &t.fr.tip[4 * k], radius, [&](int o) { shut[o] = 1; });
  }
  if (!alone) open_stressed(t, shut);
  for (int e = 0; e < n; ++e) {
    if (free(e)) shut[e] = 0;
    else if (!can_begin(e)) continue;
    const MatLaw& law = t.block(e).law;
    for_history(t, e, [&](int, double* h) { shut[e] ? crack_shut(law, h) : crack_free(law, h); });
  }
  for (int e = 0; e < n; ++e)
    if (t.fr.tracked[e] == BESIDE && intact(t, e)) begin_at_least(t, e);
  for (int k = 0; k < t.ntip(); ++k) {
    const double *tip = &t.fr.tip[4 * static_cast<size_t>(k)], *d = tip + 2;
    double x[2] = {tip[0], tip[1]}, length = 0.0;
    for (int e = t.fr.tip_elem[k]; e >= 0 && (can_begin(e) || free(e)) && length < reach(t, e);) {
      double out[2];
      if (!free(e)) mark_line(t, e, x, d);
      const int face = leave(t, e, x, d, out);
      length += std::hypot(out[0] - x[0], out[1] - x[1]);
      std::copy_n(out, 2, x);
      const int next = t.fm.across[6 * static_cast<size_t>(e) + face];
      e = ends_line(t, e, next, x, d) ? -1 : next;
    }
  }
}

}  // namespace

void frac_track(const Model& m, const Step& s, const Elements& el, const FracMesh& fm, State& st,
                TrackResult& result)
{
  result = TrackResult();
  Tracker t{m, s, el, fm, st, st.frac, result, {}, {}};
  if (t.fr.tracked.empty()) begin(t);
  find_openings(t);
  grow(t, 0);
  forget_starts(t);
  spread_free(t);
  const int old = t.ntip();
  find_roots(t);
  if (!result.start.empty()) return;
  grow(t, old);
  mark(t, false);
}

void frac_start(const Model& m, const Step& s, const Elements& el, const FracMesh& fm,
                const std::vector<TrackStart>& start, State& st, TrackResult& result)
{
  result = TrackResult();
  Tracker t{m, s, el, fm, st, st.frac, result, {}, {}};
  if (t.fr.tracked.empty()) begin(t);
  find_openings(t);
  bool alone = false;
  for (const TrackStart& c : start) {
    alone = alone || c.node < 0;
    if (c.node < 0) add_root(t, c.root, c.d);
    else add_start(t, c);
  }
  mark(t, alone);
}
