#include "model/state_window.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/comm.h"

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
    std::vector<T> own;
    for (int i : item) own.insert(own.end(), x.begin() + long(i) * D, x.begin() + long(i + 1) * D);
    std::vector<T> out(count * static_cast<std::size_t>(D));
    std::size_t k = 0;
    for (const std::vector<T>& part : comm_gather(own))
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
    std::vector<T> own;
    for (int i : item) own.insert(own.end(), x.begin() + long(off[i]) * D, x.begin() + long(off[i + 1]) * D);
    std::vector<T> out(off_of_all.back() * static_cast<std::size_t>(D));
    std::size_t k = 0;
    for (const std::vector<T>& part : comm_gather(own))
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

std::vector<long> names(const IntVec& number) { return {number.begin(), number.end()}; }

// places of lists with n[i] numbers
template <class Count>
IntVec offsets(int lists, Count count)
{
  IntVec off(1, 0);
  for (int i = 0; i < lists; ++i) off.push_back(off.back() + count(i));
  return off;
}

int pairs_of(const Points& p, int point) { return p.conn.count(point) * (p.conn.count(point) + 1) / 2; }

// faces of points of this rank, in numbers of all ranks, ascending on rank 0
std::vector<Face> join_faces(std::vector<Face> face, const std::vector<char>& own, const IntVec& number)
{
  const auto others = [&](const Face& f) { return !own[f.elem]; };
  face.erase(std::remove_if(face.begin(), face.end(), others), face.end());
  for (Face& f : face) f.elem = number[f.elem];
  std::vector<Face> all;
  for (const std::vector<Face>& part : comm_gather(face)) all.insert(all.end(), part.begin(), part.end());
  std::sort(all.begin(), all.end(), [](const Face& a, const Face& b) {
    return a.elem != b.elem ? a.elem < b.elem : a.face < b.face;
  });
  return all;
}

void join_points(const Model& m, const Joiner& of_points, const Joiner& of_corners, const Points& p,
                 Points& all)
{
  const int dim = m.dim;
  const IntVec &point = p.part.point, &corner = p.part.corner;
  all.npoint  = static_cast<int>(of_points.count);
  all.ncorner = static_cast<int>(of_corners.count);
  IntVec conn = p.conn.item, next = p.next, twin = p.twin, hang = p.hang.item, off;
  for (int& c : conn) c = corner[c];
  for (int& q : next) q = point[q];
  for (int& c : twin) c = corner[c];
  for (int& k : hang)
    if (k < 0) k = -1 - corner[-1 - k];
  const IntVec pairs = offsets(p.npoint, [&](int q) { return pairs_of(p, q); });
  all.Xc        = of_corners.join(p.Xc, dim);
  all.shape     = of_points.join(p.shape, 1);
  all.conn.item = of_points.join_lists(conn, p.conn.off, 1, all.conn.off);
  all.w         = of_points.join_lists(p.w, p.conn.off, 1, off);
  all.G         = of_points.join_lists(p.G, p.conn.off, dim, off);
  all.sampled   = of_points.join(p.sampled, 1);
  all.mc        = of_points.join_lists(p.mc, pairs, 1, off);
  all.V0        = of_points.join(p.V0, 1);
  all.mass      = of_points.join(p.mass, 1);
  all.body      = of_points.join(p.body, 1);
  all.label     = of_points.join(p.label, 1);
  all.parent    = of_points.join(p.parent, 1);
  all.next      = of_points.join(next, 1);
  all.broken    = of_points.join(p.broken, 1);
  all.normal    = of_points.join(p.normal, 3);
  all.released  = of_points.join(p.released, 1);
  all.field     = of_corners.join(p.field, 1);
  all.twin      = of_corners.join(twin, 1);
  all.hang.item = of_corners.join_lists(hang, p.hang.off, 1, all.hang.off);
  all.hang_w    = of_corners.join_lists(p.hang_w, p.hang.off, 1, off);
  all.hangs     = of_corners.join(p.hangs, 1);
  IntVec apart  = p.apart;
  apart.resize(p.ncorner, 0);
  all.apart     = of_corners.join(apart, 1);
  std::vector<char> own(p.npoint, 0);
  for (int q : of_points.item) own[q] = 1;
  all.boundary = join_faces(p.boundary, own, point);
  for (const std::vector<Face>& face : p.surface) all.surface.push_back(join_faces(face, own, point));
  all.of_elem.assign(m.mesh.nelem(), -1);            // of the elements of this rank, on all ranks
  for (std::size_t e = 0; e < p.of_elem.size(); ++e)
    if (p.of_elem[e] >= 0) all.of_elem[e] = point[p.of_elem[e]];
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
  all.nfixed        = b.nfixed;
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

// Corners of no point that this rank has to bring, those that released points have left behind: no rank has
// them in a point of its own, and no lower rank has them; own [ncorner]
IntVec left_corners(const Points& p, const std::vector<char>& own)
{
  struct Corner { int number, rank, at; };
  std::vector<char> used(p.ncorner, 0);
  for (int c : p.conn.item) used[c] = 1;
  std::vector<Corner> all;
  for (int c = 0; c < p.ncorner; ++c)
    if (!used[c]) all.push_back({p.part.corner[c], comm_rank(), c});
  comm_allgatherv(all);
  std::sort(all.begin(), all.end(), [](const Corner& a, const Corner& b) {
    return a.number != b.number ? a.number < b.number : a.rank < b.rank;
  });
  RealVec owned;
  for (const Corner& c : all) {
    const int here = p.corner_here(c.number);
    owned.push_back(here >= 0 && own[here] ? 1.0 : 0.0);
  }
  comm_sum(owned);
  IntVec list;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const bool first = k == 0 || all[k - 1].number != all[k].number;
    if (first && owned[k] == 0.0 && all[k].rank == comm_rank()) list.push_back(all[k].at);
  }
  return list;
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
  std::swap(kept.points, s.points);
  std::swap(kept.bonds, s.bonds);
  std::swap(kept.laid, s.laid);
  std::swap(kept.converted, s.frac.converted);
  std::swap(kept.released, s.frac.released);
  std::swap(kept.released_at, s.frac.released_at);
  std::swap(kept.left, s.frac.left);
  s.n.uc.swap(kept.uc);
  s.n.vc.swap(kept.vc);
  s.n.hp.swap(kept.hp);
  s.n.slip.swap(kept.slip);
  s.n.lambda.swap(kept.lambda);
  s.n.lambda_n.swap(kept.lambda_n);
}

void state_gather(const Model& m, WindowState& kept, State& s)
{
  const int dim = m.dim, me = comm_rank();
  IntVec here;                 // elements of converted
  for (int number : s.frac.converted) here.push_back(m.part.elem_here(number));
  state_swap(kept, s);
  const Points& p = kept.points;
  const Bonds& b  = kept.bonds;
  IntVec points, corners, bonds;
  std::vector<char> own(p.ncorner, 0);               // corners of elements of this rank
  for (int q = 0; q < p.npoint; ++q) {
    const int number = p.parent[q];
    if (number >= 0 ? !m.part.works(m.part.elem_here(number)) : p.part.rank[q] != me) continue;
    points.push_back(q);
    for (int k = p.conn.off[q]; k < p.conn.off[q + 1]; ++k) own[p.conn.item[k]] = 1;
  }
  for (int c = 0; c < p.ncorner; ++c)
    if (own[c]) corners.push_back(c);
  const IntVec left = left_corners(p, own);
  corners.insert(corners.end(), left.begin(), left.end());
  for (int q = 0; q < b.nbond; ++q)
    if (b.rank[q] == me) bonds.push_back(q);
  const Joiner of_points(points, names(p.part.point)), of_corners(corners, names(p.part.corner)),
      of_bonds(bonds, b.name);
  if (s.frac.nconverted > 0) join_points(m, of_points, of_corners, p, s.points);
  else s.points = p;                                 // as at the start
  join_bonds(of_bonds, dim, b, s.bonds);
  join_skin(m.part, of_bonds, p, b, s.bonds);
  const int history = comm_allreduce_max(p.npoint ? static_cast<int>(kept.hp.size() / p.npoint) : 0);
  s.n.uc       = of_corners.join(kept.uc, dim);
  s.n.vc       = of_corners.join(kept.vc, dim);
  s.n.hp       = of_points.join(kept.hp, history);
  s.n.slip     = of_bonds.join(kept.slip, dim);
  s.n.lambda   = of_bonds.join(kept.lambda, dim);
  s.n.lambda_n = of_bonds.join(kept.lambda_n, 1);
  if (comm_allreduce_max(static_cast<int>(!kept.laid.uc.empty()))) {
    s.laid.uc = of_corners.join(kept.laid.uc, dim);
    s.laid.xb = of_bonds.join(kept.laid.xb, dim);
  }
  s.frac.converted = join_converted(m, kept.converted, here, p);
  join_released(kept, points, s.frac);
}
