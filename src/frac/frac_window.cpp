#include <algorithm>
#include <map>
#include <numeric>

#include "base/grow.h"
#include "base/picked.h"
#include "bond/bond.h"
#include "frac/frac.h"
#include "model/state_window.h"

namespace {

// are faces of general contact in a state that was read consistent with bonds?
bool skin_fits(const Bonds& b)
{
  const size_t q = b.nbond;
  const int n    = static_cast<int>(b.contact.skin.size());
  const auto in  = [n](const IntVec& list) {
    return std::all_of(list.begin(), list.end(), [n](int i) { return i < n; });
  };
  const ContactState& c = b.contact;
  return c.skin_of.size() == q && c.met.size() == q && c.wall.size() == q && in(c.skin_of) && in(c.met) &&
         c.skin_penalty.size() == c.skin.size();
}

bool ends(const ListTable& t, size_t lists)
{
  return t.off.size() == lists + 1 && t.off.front() == 0 && std::is_sorted(t.off.begin(), t.off.end()) &&
         static_cast<size_t>(t.off.back()) == t.item.size();
}

// have the arrays of a level the lengths of points and corners?
bool level_fits(int dim, size_t npoint, size_t ncorner, const State& s)
{
  return s.n.uc.size() == ncorner * dim && s.n.vc.size() == ncorner * dim &&
         (npoint == 0 ? s.n.hp.empty() : s.n.hp.size() % npoint == 0) &&
         s.laid.fits(ncorner * dim, static_cast<size_t>(s.bonds.nbond) * dim);
}

// have the arrays of points that were read the lengths of their counts?
bool points_fit(int dim, const State& s)
{
  const Points& p    = s.points;
  const Fracture& fr = s.frac;
  const size_t n = p.npoint, c = p.ncorner;
  const auto in = [](const IntVec& list, size_t end) {
    return std::all_of(list.begin(), list.end(),
                       [=](int i) { return i >= 0 && static_cast<size_t>(i) < end; });
  };
  return p.part.point.size() == n && p.part.corner.size() == c && p.parent.size() == n &&
         p.Xc.size() == c * dim && p.unshared_since.size() == c && in(fr.released, n) &&
         fr.released_at.size() == fr.released.size() && ends(fr.left, fr.released.size()) &&
         in(fr.left.item, c) && ends(p.conn, n) && p.kind.size() == n && p.sampled.size() == n &&
         p.V0.size() == n && p.label.size() == n && p.broken.size() == n && p.normal.size() == 3 * n &&
         p.hangs.size() == c && (!s.division.handed || s.division.point.size() == n) &&
         level_fits(dim, n, c, s);
}

// have the arrays of a state that was read the lengths of its counts?
bool lengths_fit(int dim, const State& s)
{
  const Bonds& b = s.bonds;
  const size_t q = b.nbond;
  const bool points = s.frac.nconverted > 0 ? points_fit(dim, s)
                                            : level_fits(dim, s.points.npoint, s.points.ncorner, s);
  return points && b.nfixed >= 0 && b.nbond >= b.nfixed && ends(b.a, q) &&
         b.a_w.size() == b.a.item.size() &&
         b.def.size() == q && b.side.size() == q && b.field.size() == q && b.area.size() == q &&
         b.X.size() == 3 * q &&
         b.normal.size() == q * dim && b.cn.size() == q && b.ct.size() == q && b.contact.offset.size() == q &&
         b.contact.initial_penetration.size() == q && b.contact.deep.size() == q &&
         b.intermediate.size() == q && b.contact.friction.size() == q &&
         skin_fits(b) && s.n.slip.size() == q * dim &&
         s.n.lambda.size() == q * dim && s.n.lambda_n.size() == q;
}

// renumbers released points as by the conversions to come; first: number of points at the start. False: their
// corners do not fit
bool take_released(const Points& known, int first, Fracture& fr)
{
  std::map<int, int> here, count;        // of an element: its first point here, its points
  for (int e : known.parent)
    if (e >= 0) ++count[e];
  for (int e : fr.converted) {
    here[e] = first;
    first += count[e];
  }
  for (size_t k = 0; k < fr.released.size(); ++k) {
    int& q = fr.released[k];
    const auto found = here.find(known.parent[q]);
    if (found == here.end() || fr.left.count(static_cast<int>(k)) != known.conn.count(q)) return false;
    q = found->second + q - known.of_elem[found->first];
  }
  return true;
}

// local indices of numbers of points or corners
template <class Here>
IntVec indices_here(IntVec number, Here here)
{
  for (int& n : number) n = here(n);
  return number;
}

bool found(const IntVec& list) { return std::find(list.begin(), list.end(), -1) == list.end(); }

// finds the points of this rank in known, and the corners of released points
//   inout point, corner   at input those from the start
bool find_points(const Points& known, const Fracture& fr, const Points& here, IntVec& point, IntVec& corner)
{
  point.resize(here.npoint, -1);
  corner.resize(here.ncorner, -1);
  for (int e : fr.converted)
    for (int p = here.of_elem[e], q = known.of_elem[e]; p < here.npoint && here.parent[p] == e; ++p, ++q)
      point[p] = q;
  if (!found(point)) return false;
  for (int p : fr.released)
    for (int k = 0; k < here.conn.count(p); ++k)
      corner[here.conn.begin(p)[k]] = known.conn.begin(point[p])[k];
  return found(corner);
}

// copies the data of points and corners that a conversion does not give; point, corner: index in known
void take_points(int dim, const Points& known, const IntVec& point, const IntVec& corner, State& st)
{
  Points& here = st.points;
  for (int p = 0; p < here.npoint; ++p)
    here.kind[p] = domain_gradients(here.kind[p], here.conn.count(p), known.G(point[p]), here.kinds);
  for (IntVec Points::* x : {&Points::sampled, &Points::label, &Points::broken})
    here.*x = picked(point, 1, known.*x);
  here.V0     = picked(point, 1, known.V0);
  here.normal = picked(point, 3, known.normal);
  here.hangs  = picked(corner, 1, known.hangs);
  here.unshared_since = picked(corner, 1, known.unshared_since);
  here.Xc     = picked(corner, dim, known.Xc);       // released points have other shapes               (7.34)
  here.part.window  = true;
  here.part.npoint  = known.part.npoint;
  here.part.ncorner = known.part.ncorner;
  here.part.point   = picked(point, 1, known.part.point);
  here.part.corner  = picked(corner, 1, known.part.corner);
  const size_t history = known.npoint ? st.n.hp.size() / known.npoint : 0;
  st.n.hp = picked(point, static_cast<int>(history), st.n.hp);
  st.division.point = picked(point, st.division.handed, st.division.point);
  for (RealVec* x : {&st.n.uc, &st.n.vc}) *x = picked(corner, dim, *x);
  if (!st.laid.uc.empty()) st.laid.uc = picked(corner, dim, st.laid.uc);
}

// reserves memory for later conversions: arrays made by a division have none, or half as much again
void fit_points(State& st)
{
  Points& p = st.points;
  for (RealVec* x : {&p.Xc, &p.V0, &p.mass, &p.normal, &p.hang_w, &st.n.uc, &st.n.vc, &st.n.hp}) fit_room(*x);
  for (IntVec* x : {&p.shape, &p.conn.off, &p.conn.item, &p.kind, &p.sampled, &p.body, &p.label, &p.parent,
                    &p.next, &p.broken, &p.released, &p.field, &p.first_copy, &p.hang.off, &p.hang.item,
                    &p.hangs, &p.unshared_since, &p.part.point, &p.part.corner})
    fit_room(*x);
}

// keeps the faces of general contact of this rank; index [b.skin]: new index, FACE_ELSEWHERE: not here
void take_skin(const Points& here, Bonds& b, IntVec& index)
{
  std::vector<SkinFace> skin;
  RealVec penalty;
  index.assign(b.contact.skin.size(), FACE_ELSEWHERE);
  for (size_t i = 0; i < b.contact.skin.size(); ++i) {
    SkinFace f = b.contact.skin[i];
    if (f.points) f.elem = here.point_here(f.elem);
    if (f.elem < 0) continue;
    index[i] = static_cast<int>(skin.size());
    skin.push_back(f);
    penalty.push_back(b.contact.skin_penalty[i]);
  }
  b.contact.skin.swap(skin);
  b.contact.skin_penalty.swap(penalty);
}

// converts numbers of corners of all ranks at side A, after the nodes, to local corners, or -1
void take_corners(int nnode, const IntVec& number, IntVec& side)
{
  IntVec order(number.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return number[a] < number[b]; });
  for (int& k : side) {
    if (k < nnode) continue;
    const auto at = std::lower_bound(order.begin(), order.end(), k - nnode,
                                     [&](int c, int value) { return number[c] < value; });
    k = at != order.end() && number[*at] == k - nnode ? nnode + *at : -1;
  }
}

// keeps the bonds whose nodes and corners are all here: of general contact in a window those on faces of this
// rank, others as by bond_form and bond_rebuild
void take_bonds(const Model& m, State& st)
{
  const int dim = m.dim;
  Bonds& b = st.bonds;
  take_corners(m.mesh.nnode(), st.points.part.corner, b.a.item);
  IntVec face;
  take_skin(st.points, b, face);
  for (IntVec* x : {&b.contact.skin_of, &b.contact.met})
    for (int& i : *x)
      if (i >= 0) i = face[i];
  const auto is_own = [&](int i) {
    return i == -1 || (i >= 0 && (!m.part.window || point_skin_counts(m, st.points, b.contact.skin[i])));
  };
  const std::vector<char> own = bond_own(m, st.points);
  const auto is_formed = [&](int q) {
    if (q >= b.nfixed) return m.bond[b.def[q]].contact.present;
    return std::any_of(b.a.begin(q), b.a.begin(q + 1), [&](int k) { return own[k] != 0; });
  };
  IntVec list;
  ListTable a;
  RealVec a_w;
  for (int q = 0; q < b.nbond; ++q) {
    const int *first = b.a.begin(q), *last = first + b.a.count(q);
    if (first == last || std::find(first, last, -1) != last) continue;
    if (!is_own(b.contact.skin_of[q]) || !is_formed(q)) continue;
    list.push_back(q);
    a.item.insert(a.item.end(), first, last);
    a_w.insert(a_w.end(), b.a_w.begin() + b.a.off[q], b.a_w.begin() + b.a.off[q + 1]);
    a.off.push_back(static_cast<int>(a.item.size()));
  }
  std::swap(b.a, a);
  b.a_w.swap(a_w);
  b.nbond = static_cast<int>(list.size());
  ContactState& c = b.contact;
  for (IntVec* x : {&b.def, &b.side, &b.field, &b.intermediate, &c.skin_of, &c.met, &c.wall})
    *x = picked(list, 1, *x);
  for (RealVec* x : {&b.area, &b.cn, &b.ct, &c.offset, &c.initial_penetration, &c.deep, &c.friction,
                     &st.n.lambda_n})
    *x = picked(list, 1, *x);
  b.X = picked(list, 3, b.X);
  for (RealVec* x : {&b.normal, &st.n.slip, &st.n.lambda}) *x = picked(list, dim, *x);
  if (!st.laid.xb.empty()) st.laid.xb = picked(list, dim, st.laid.xb);
  b.name   = picked(list, 1, b.name);
  b.nfixed = static_cast<int>(std::lower_bound(list.begin(), list.end(), b.nfixed) - list.begin());
}

}  // namespace

bool frac_take(const Model& m, const FracMesh& fm, const Points& begin, State& st)
{
  Fracture& fr = st.frac;
  const auto unknown = [&](int e) {
    return e < 0 || (e < m.mesh.nelem() && !m.part.stores_points(e));
  };
  fr.converted.erase(std::remove_if(fr.converted.begin(), fr.converted.end(), unknown), fr.converted.end());
  const auto is_def = [&](int d) { return d >= 0 && d < static_cast<int>(m.bond.size()); };
  if (!lengths_fit(m.dim, st) || !std::all_of(st.bonds.def.begin(), st.bonds.def.end(), is_def)) return false;
  if (fr.nconverted == 0) {
    take_bonds(m, st);
    return true;
  }
  Points known = begin;
  std::swap(known, st.points);
  const auto of_point  = [&](int number) { return known.point_here(number); };
  const auto of_corner = [&](int number) { return known.corner_here(number); };
  IntVec &first = known.of_elem, point = indices_here(begin.part.point, of_point),
         corner = indices_here(begin.part.corner, of_corner);
  if (first.size() != static_cast<size_t>(m.mesh.nelem()) || !found(point) || !found(corner)) return false;
  first = indices_here(first, of_point);
  for (int e : fr.converted)
    if (e < 0 || e >= m.mesh.nelem() || fm.conv[e] < 0 || first[e] < 0) return false;
  if (!take_released(known, begin.npoint, fr)) return false;
  CornerShare share;
  ListTable left;
  known.part.window = true;
  if (!frac_repeat(m, fm, fr, known, st.points, share, corner, left) ||
      !find_points(known, fr, st.points, point, corner))
    return false;
  std::swap(fr.left, left);
  take_points(m.dim, known, point, corner, st);
  fit_points(st);
  take_bonds(m, st);
  return true;
}
