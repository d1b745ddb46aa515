#include "model/state_window.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/comm.h"
#include "base/picked.h"
#include "model/model_io.h"

namespace {

// Items of all ranks on rank 0, in the order of their names, each once; of one that several bring, they bring
// the same. Collective, as all below.
struct Joiner {
  IntVec item;                 // that this rank brings
  IntVec place;                // rank 0: of each that comes, rank after rank
  std::size_t count = 0;       // rank 0: of them
  Joiner(IntVec brings, const std::vector<long>& name);

  // numbers of the items, D for each
  template <class T>
  std::vector<T> join(const std::vector<T>& x, int D) const
  {
    std::vector<T> out(count * static_cast<std::size_t>(D));
    std::size_t k = 0;
    for (const std::vector<T>& part : comm_gather(picked(item, D, x)))
      for (std::size_t at = 0; at < part.size(); at += D, ++k)
        std::copy_n(&part[at], D, &out[place[k] * static_cast<std::size_t>(D)]);
    return out;
  }

  // numbers of lists with off [n+1], D for each of their items; off of all: of those on rank 0
  template <class T>
  std::vector<T> join_lists(const std::vector<T>& x, const IntVec& off, int D, IntVec& off_of_all) const
  {
    IntVec length(off.size() - 1);
    for (std::size_t i = 0; i < length.size(); ++i) length[i] = off[i + 1] - off[i];
    length = join(length, 1);
    off_of_all.assign(1, 0);
    for (int n : length) off_of_all.push_back(off_of_all.back() + n);
    std::vector<T> out(off_of_all.back() * static_cast<std::size_t>(D));
    std::size_t k = 0;
    for (const std::vector<T>& part : comm_gather(picked(item, off, D, x)))
      for (std::size_t at = 0; at < part.size(); ++k) {
        const std::size_t n = length[place[k]] * static_cast<std::size_t>(D);
        std::copy_n(part.begin() + static_cast<long>(at), n,
                    out.begin() + static_cast<long>(off_of_all[place[k]]) * D);
        at += n;
      }
    return out;
  }
};

Joiner::Joiner(IntVec brings, const std::vector<long>& name) : item(std::move(brings))
{
  std::vector<long> own, all;
  for (int i : item) own.push_back(name[i]);
  for (const std::vector<long>& part : comm_gather(own)) all.insert(all.end(), part.begin(), part.end());
  IntVec order(all.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(), [&](int a, int b) { return all[a] < all[b]; });
  place.resize(all.size());
  for (std::size_t k = 0; k < order.size(); ++k) {
    count += k == 0 || all[order[k]] != all[order[k - 1]];
    place[order[k]] = static_cast<int>(count) - 1;
  }
}

// places of lists with n[i] numbers
template <class Count>
IntVec offsets(int lists, Count count)
{
  IntVec off(1, 0);
  for (int i = 0; i < lists; ++i) off.push_back(off.back() + count(i));
  return off;
}

int pairs_of(const Points& p, int point) { return p.conn.count(point) * (p.conn.count(point) + 1) / 2; }

// points and corners, in numbers of all ranks
Points numbered(const Model& m, const IntVec& points, const IntVec& corners, const Points& p)
{
  const int dim = m.dim;
  const IntVec &point = p.part.point, &corner = p.part.corner;
  IntVec apart = p.apart;
  apart.resize(p.ncorner, 0);
  Points out;
  out.npoint  = p.part.npoint;
  out.ncorner = p.part.ncorner;
  out.Xc      = picked(corners, dim, p.Xc);
  out.conn    = picked(points, p.conn);
  out.w       = picked(points, p.conn.off, 1, p.w);
  out.G       = picked(points, p.conn.off, dim, p.G);
  out.mc      = picked(points, offsets(p.npoint, [&](int q) { return pairs_of(p, q); }), 1, p.mc);
  for (IntVec Points::* x : {&Points::shape, &Points::sampled, &Points::body, &Points::label, &Points::parent,
                             &Points::next, &Points::broken, &Points::released})
    out.*x = picked(points, 1, p.*x);
  out.V0     = picked(points, 1, p.V0);
  out.mass   = picked(points, 1, p.mass);
  out.normal = picked(points, 3, p.normal);
  out.field  = picked(corners, 1, p.field);
  out.twin   = picked(corners, 1, p.twin);
  out.hang   = picked(corners, p.hang);
  out.hang_w = picked(corners, p.hang.off, 1, p.hang_w);
  out.hangs  = picked(corners, 1, p.hangs);
  out.apart  = picked(corners, 1, apart);
  for (int& q : out.next) q = point[q];
  for (IntVec* list : {&out.conn.item, &out.twin})
    for (int& c : *list) c = corner[c];
  for (int& k : out.hang.item)
    if (k < 0) k = -1 - corner[-1 - k];
  out.of_elem.assign(m.mesh.nelem(), -1);
  for (std::size_t e = 0; e < p.of_elem.size(); ++e)
    if (p.of_elem[e] >= 0) out.of_elem[e] = point[p.of_elem[e]];
  return out;
}

// names of faces of general contact, in the order in which one rank has them
std::vector<long> skin_names(const IntVec& point, const std::vector<SkinFace>& skin)
{
  const long faces = 8, behind = 1L << 40;           // of an element; elements
  std::vector<long> name;
  for (const SkinFace& f : skin)
    name.push_back(f.points ? (behind + point[f.elem]) * faces + f.face : f.elem * faces + f.face);
  return name;
}

// Faces of general contact of this rank, and what bonds say of them
void join_skin(const MeshPart& mesh, const Joiner& of_bonds, const Points& p, const Bonds& b, Bonds& all)
{
  const std::vector<long> name = skin_names(p.part.point, b.skin);
  IntVec own, face;
  for (std::size_t i = 0; i < b.skin.size(); ++i) {
    const SkinFace& f = b.skin[i];
    const int e = f.element(p);
    if (e < 0 ? p.part.rank[f.elem] == comm_rank() : mesh.works(mesh.elem_here(e)))
      own.push_back(static_cast<int>(i));
    face.insert(face.end(), {f.points ? p.part.point[f.elem] : f.elem, f.face, f.points});
  }
  const Joiner of_skin(own, name);
  const std::vector<long> known = of_skin.join(name, 1);
  face = of_skin.join(face, 3);
  for (std::size_t i = 0; i < face.size(); i += 3) all.skin.push_back({face[i], face[i + 1], face[i + 2]});
  all.skin_penalty = of_skin.join(b.skin_penalty, 1);
  const auto join_places = [&](const IntVec& skin_of) {        // what is no face stays as it is
    std::vector<long> named;
    for (int i : skin_of) named.push_back(i < 0 ? i : name[i]);
    IntVec place;
    for (long n : of_bonds.join(named, 1))
      place.push_back(static_cast<int>(
          n < 0 ? n : std::lower_bound(known.begin(), known.end(), n) - known.begin()));
    return place;
  };
  all.skin_of = join_places(b.skin_of);
  all.met     = join_places(b.met);
}

void join_bonds(const Joiner& j, int dim, const Bonds& b, Bonds& all)
{
  all.nbond         = static_cast<int>(j.count);
  IntVec of_deck(b.nbond, 0);
  std::fill_n(of_deck.begin(), b.nfixed, 1);
  of_deck           = j.join(of_deck, 1);
  all.nfixed        = static_cast<int>(std::count(of_deck.begin(), of_deck.end(), 1));
  all.a.item        = j.join_lists(b.a.item, b.a.off, 1, all.a.off);
  IntVec off;
  all.a_w           = j.join_lists(b.a_w, b.a.off, 1, off);
  all.def           = j.join(b.def, 1);
  all.field         = j.join(b.field, 1);
  all.area          = j.join(b.area, 1);
  all.X             = j.join(b.X, 3);
  all.normal        = j.join(b.normal, dim);
  all.cn            = j.join(b.cn, 1);
  all.ct            = j.join(b.ct, 1);
  all.offset        = j.join(b.offset, 1);
  all.initial_penetration = j.join(b.initial_penetration, 1);
  all.intermediate  = j.join(b.intermediate, 1);
  all.friction      = j.join(b.friction, 1);
}

// Corners that this rank brings, ascending by their numbers: of the points that it brings, and those that
// these had before they were released; of a corner that several ranks have so, one brings it
IntVec own_corners(const WindowState& kept, const IntVec& points)
{
  const Points& p = kept.points;
  std::vector<char> mine(p.npoint, 0), own(p.ncorner, 0);
  for (int q : points) {
    mine[q] = 1;
    for (int k = p.conn.off[q]; k < p.conn.off[q + 1]; ++k) own[p.conn.item[k]] = 1;
  }
  for (std::size_t k = 0; k < kept.released.size(); ++k)
    for (int i = kept.left.off[k]; i < kept.left.off[k + 1] && mine[kept.released[k]]; ++i)
      own[kept.left.item[i]] = 1;
  IntVec list, brings;
  for (int c = 0; c < p.ncorner; ++c)
    if (own[c]) list.push_back(c);
  std::sort(list.begin(), list.end(), [&](int a, int b) { return p.part.corner[a] < p.part.corner[b]; });
  std::vector<long> key;
  for (int c : list) key.push_back(p.part.corner[c]);
  Halo halo;
  halo_form(key, halo);
  for (std::size_t k = 0; k < list.size(); ++k)
    if (halo.owner[k] == comm_rank()) brings.push_back(list[k]);
  return brings;
}

// released points that were elements of this rank, of all ranks, in the order in which they got their corners
void join_released(const WindowState& kept, const IntVec& own, Fracture& all)
{
  struct Released { int corner, point, at, n, left[8]; };
  const Points& p = kept.points;
  std::vector<char> mine(p.npoint, 0);
  for (int q : own) mine[q] = 1;
  std::vector<Released> list, joined;
  for (std::size_t k = 0; k < kept.released.size(); ++k) {
    const int q = kept.released[k], at = static_cast<int>(k);
    if (!mine[q]) continue;
    Released r{p.part.corner[p.conn.begin(q)[0]], p.part.point[q], kept.released_at[k], kept.left.count(at),
               {}};
    for (int a = 0; a < r.n; ++a) r.left[a] = p.part.corner[kept.left.begin(at)[a]];
    list.push_back(r);
  }
  for (const std::vector<Released>& part : comm_gather(list))
    joined.insert(joined.end(), part.begin(), part.end());
  std::sort(joined.begin(), joined.end(),
            [](const Released& a, const Released& b) { return a.corner < b.corner; });
  for (const Released& r : joined) {
    all.released.push_back(r.point);
    all.released_at.push_back(r.at);
    all.left.item.insert(all.left.item.end(), r.left, r.left + r.n);
    all.left.off.push_back(static_cast<int>(all.left.item.size()));
  }
}

// elements that this rank works on which became points, of all ranks, in their order
IntVec join_converted(const Model& m, const IntVec& converted, const IntVec& here, const Points& p)
{
  struct Turn { int point, number; };
  std::vector<Turn> own, all;
  for (std::size_t k = 0; k < converted.size(); ++k)
    if (m.part.works(here[k])) own.push_back({p.part.point[p.of_elem[here[k]]], converted[k]});
  for (const std::vector<Turn>& part : comm_gather(own)) all.insert(all.end(), part.begin(), part.end());
  std::sort(all.begin(), all.end(), [](const Turn& a, const Turn& b) { return a.point < b.point; });
  IntVec list;
  for (const Turn& t : all) list.push_back(t.number);
  return list;
}

}  // namespace

void state_swap(WindowState& kept, State& s)
{
  std::swap(kept.bonds, s.bonds);
  std::swap(kept.laid, s.laid);
  s.n.slip.swap(kept.slip);
  s.n.lambda.swap(kept.lambda);
  s.n.lambda_n.swap(kept.lambda_n);
  if (!kept.in_parts) return;
  std::swap(kept.points, s.points);
  std::swap(kept.converted, s.frac.converted);
  std::swap(kept.released, s.frac.released);
  std::swap(kept.released_at, s.frac.released_at);
  std::swap(kept.left, s.frac.left);
  s.n.uc.swap(kept.uc);
  s.n.vc.swap(kept.vc);
  s.n.hp.swap(kept.hp);
  s.division.point.swap(kept.rank);
}

namespace {

// bonds of all ranks on rank 0, and what a level and the grid say of them
//   in   p   points of kept
void bring_bonds(const Model& m, const Points& p, const WindowState& kept, bool laid, State& s)
{
  const Bonds& b = kept.bonds;
  IntVec bonds;
  for (int q = 0; q < b.nbond; ++q)
    if (b.rank[q] == comm_rank()) bonds.push_back(q);
  const Joiner of_bonds(bonds, b.name);
  join_bonds(of_bonds, m.dim, b, s.bonds);
  join_skin(m.part, of_bonds, p, b, s.bonds);
  s.n.slip     = of_bonds.join(kept.slip, m.dim);
  s.n.lambda   = of_bonds.join(kept.lambda, m.dim);
  s.n.lambda_n = of_bonds.join(kept.lambda_n, 1);
  if (laid) s.laid.xb = of_bonds.join(kept.laid.xb, m.dim);
}

// points and corners that this rank brings, and what else says something of them
void bring_points(const Model& m, const IntVec& here, const WindowState& kept, bool laid, State& s)
{
  const int dim = m.dim, me = comm_rank();
  const Points& p = kept.points;
  IntVec points;
  for (int q = 0; q < p.npoint; ++q) {
    const int number = p.parent[q];
    if (number >= 0 ? m.part.works(m.part.elem_here(number)) : p.part.rank[q] == me) points.push_back(q);
  }
  const IntVec corners = own_corners(kept, points);
  s.points = numbered(m, points, corners, p);
  s.points.part.npoint  = p.part.npoint;
  s.points.part.ncorner = p.part.ncorner;
  s.points.part.point   = picked(points, 1, p.part.point);
  s.points.part.corner  = picked(corners, 1, p.part.corner);
  s.n.uc       = picked(corners, dim, kept.uc);
  s.n.vc       = picked(corners, dim, kept.vc);
  s.n.hp       = picked(points, p.npoint ? static_cast<int>(kept.hp.size() / p.npoint) : 0, kept.hp);
  s.division.point = picked(points, s.division.handed, kept.rank);
  if (laid) s.laid.uc = picked(corners, dim, kept.laid.uc);
  s.frac.converted = join_converted(m, kept.converted, here, p);
  join_released(kept, points, s.frac);
}

}  // namespace

void state_bring(const Model& m, WindowState& kept, State& s)
{
  IntVec here;                 // elements of converted
  for (int number : s.frac.converted) here.push_back(m.part.elem_here(number));
  kept.in_parts = state_in_parts(m, s);
  state_swap(kept, s);
  const bool laid = comm_allreduce_max(static_cast<int>(!kept.laid.uc.empty()));
  bring_bonds(m, kept.in_parts ? kept.points : s.points, kept, laid, s);
  if (kept.in_parts) bring_points(m, here, kept, laid, s);
  else s.laid.uc = kept.laid.uc;
}

void state_read_outline(Archive& f, Points& x)
{
  ArchivePart &points = f.part[PER_POINT], &conn = f.part[PER_CONN];
  IntVec first;                // place of the first corner of each point that is here
  long items = 0;
  std::size_t next = 0;
  x = Points();
  io_all(f, x.part.npoint, x.part.ncorner);
  IntVec& here = x.part.point;
  archive_each<int>(f, [&](int i, int parent) {
    if (!points.takes(i, parent)) return;
    here.push_back(i);
    x.parent.push_back(parent);
  });
  archive_each<int>(f, [&](int i, int n) {
    f.good = f.good && n >= 0 && n <= 8;
    if (next < here.size() && here[next] == i) {
      first.push_back(static_cast<int>(items));
      x.conn.off.push_back(x.conn.off.back() + n);
      ++next;
    }
    items += n;
  });
  next = 0;
  archive_each<int>(f, [&](int i, int corner) {
    f.good = f.good && corner >= 0 && corner < x.part.ncorner;
    while (next < first.size() && i >= first[next] + x.conn.count(static_cast<int>(next))) ++next;
    if (next < first.size() && i >= first[next]) x.conn.item.push_back(corner);
  });
  f.good = f.good && items > 0;
  points.whole = x.part.npoint;
  points.item  = here;
  points.brings.clear();
  conn           = points;
  conn.ragged    = true;
  conn.all_units = items;
  for (int q = 0; q < x.conn.size(); ++q) conn.units.push_back(x.conn.count(q));
}

void state_find_corners(Archive& f, State& s)
{
  if (f.part[PER_CONN].whole == 0) return;           // points are as at the start
  Points& x    = s.points;
  Fracture& fr = s.frac;
  const auto in = [](const IntVec& list, int n) {
    return std::all_of(list.begin(), list.end(), [n](int i) { return i >= 0 && i < n; });
  };
  f.good = f.good && fr.released.size() == fr.released_at.size() && in(fr.released, x.part.npoint) &&
           static_cast<std::size_t>(fr.left.size()) == fr.released.size() && fr.left.off[0] == 0 &&
           std::is_sorted(fr.left.off.begin(), fr.left.off.end()) &&
           fr.left.off.back() == static_cast<int>(fr.left.item.size()) && in(fr.left.item, x.part.ncorner);
  if (!f.good) return;
  IntVec released, at;
  ListTable left;
  for (std::size_t k = 0; k < fr.released.size(); ++k) {
    const int q = x.point_here(fr.released[k]), i = static_cast<int>(k);
    if (q < 0) continue;
    released.push_back(q);
    at.push_back(fr.released_at[k]);
    left.item.insert(left.item.end(), fr.left.begin(i), fr.left.begin(i + 1));
    left.off.push_back(static_cast<int>(left.item.size()));
  }
  fr.released.swap(released);
  fr.released_at.swap(at);
  std::swap(fr.left, left);
  ArchivePart& corners = f.part[PER_CORNER];
  IntVec& here = x.part.corner;
  here = corners.item;
  for (const IntVec* list : {&x.conn.item, &fr.left.item})
    here.insert(here.end(), list->begin(), list->end());
  std::sort(here.begin(), here.end());
  here.erase(std::unique(here.begin(), here.end()), here.end());
  for (IntVec* list : {&x.conn.item, &fr.left.item})
    for (int& c : *list) c = x.corner_here(c);
  x.npoint      = static_cast<int>(x.part.point.size());
  x.ncorner     = static_cast<int>(here.size());
  corners       = ArchivePart();
  corners.whole = x.part.ncorner;
  corners.item  = here;
}
