#include "model/state_window.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "base/comm.h"
#include "base/key_number.h"
#include "base/picked.h"
#include "base/sort_once.h"
#include "model/state_io.h"

namespace {

// points and corners, in global numbers
Points numbered(const Model& m, const IntVec& points, const IntVec& corners, const Points& p)
{
  const int dim = m.dim;
  const IntVec &point = p.part.point, &corner = p.part.corner;
  IntVec unshared = p.unshared_since;
  unshared.resize(p.ncorner, 0);
  Points out;
  out.npoint  = p.part.npoint;
  out.ncorner = p.part.ncorner;
  out.Xc      = picked(corners, dim, p.Xc);
  out.conn    = picked(points, p.conn);
  out.kinds   = p.kinds;
  for (IntVec Points::* x :
       {&Points::shape, &Points::kind, &Points::sampled, &Points::body, &Points::label, &Points::parent,
        &Points::next, &Points::broken, &Points::released})
    out.*x = picked(points, 1, p.*x);
  out.V0     = picked(points, 1, p.V0);
  out.mass   = picked(points, 1, p.mass);
  out.normal = picked(points, 3, p.normal);
  out.field  = picked(corners, 1, p.field);
  out.first_copy = picked(corners, 1, p.first_copy);
  out.hang   = picked(corners, p.hang);
  out.hang_w = picked(corners, p.hang.off, 1, p.hang_w);
  out.hangs  = picked(corners, 1, p.hangs);
  out.unshared_since = picked(corners, 1, unshared);
  for (int& q : out.next) q = point[q];
  for (IntVec* list : {&out.conn.item, &out.first_copy})
    for (int& c : *list) c = corner[c];
  for (int& k : out.hang.item)
    if (k < 0) k = -1 - corner[-1 - k];
  out.of_elem.assign(m.mesh.nelem(), -1);
  for (std::size_t e = 0; e < p.of_elem.size(); ++e)
    if (p.of_elem[e] >= 0) out.of_elem[e] = point[p.of_elem[e]];
  return out;
}

// names of faces of general contact, in the order of a single rank
std::vector<long> skin_names(const IntVec& point, const std::vector<SkinFace>& skin)
{
  const long faces = 8, behind = 1L << 40;           // of an element; elements
  std::vector<long> name;
  for (const SkinFace& f : skin)
    name.push_back(f.points ? (behind + point[f.elem]) * faces + f.face : f.elem * faces + f.face);
  return name;
}

// does this rank write a face of general contact?
bool writes_face(const MeshPart& mesh, const Points& p, const SkinFace& f)
{
  const int e = f.element(p);
  return e < 0 ? p.part.rank[f.elem] == comm_rank() : mesh.works(mesh.elem_here(e));
}

// Corners that this rank writes, ascending by their numbers: of the points that it writes, also before their
// release; of a shared corner one rank writes it
IntVec own_corners(const WindowState& kept, const IntVec& points)
{
  const Points& p = kept.points;
  std::vector<char> owned(p.npoint, 0), own(p.ncorner, 0);
  for (int q : points) {
    owned[q] = 1;
    for (int k = p.conn.off[q]; k < p.conn.off[q + 1]; ++k) own[p.conn.item[k]] = 1;
  }
  for (std::size_t k = 0; k < kept.released.size(); ++k)
    for (int i = kept.left.off[k]; i < kept.left.off[k + 1] && owned[kept.released[k]]; ++i)
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

// released points of owned elements, of all ranks, in the order of their new corners
void join_released(const WindowState& kept, const IntVec& own, Fracture& all)
{
  struct Released { int corner, point, at, n, left[8]; };
  const Points& p = kept.points;
  std::vector<char> owned(p.npoint, 0);
  for (int q : own) owned[q] = 1;
  std::vector<Released> list, joined;
  for (std::size_t k = 0; k < kept.released.size(); ++k) {
    const int q = kept.released[k], at = static_cast<int>(k);
    if (!owned[q]) continue;
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

// owned converted elements, of all ranks, in their order
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

// Items with these names on this rank, and those that it writes, sorted by name
//   out  number   global number of each, ascending with the names; -1: no rank writes it
ArchivePart named_part(const std::vector<long>& name, const std::vector<char>& brings, IntVec& number)
{
  ArchivePart part;
  std::vector<long> own;
  for (std::size_t i = 0; i < name.size(); ++i)
    if (brings[i]) own.push_back(name[i]);
  number = key_numbers(own, name, part.whole);
  part.at.resize(name.size());
  std::iota(part.at.begin(), part.at.end(), 0);
  std::sort(part.at.begin(), part.at.end(), [&](int i, int j) { return number[i] < number[j]; });
  part.item   = picked(part.at, 1, number);
  part.brings = picked(part.at, 1, brings);
  return part;
}

// faces of general contact, and their indices in bonds
//   in   p   points of this rank
ArchivePart faces_for_file(const MeshPart& mesh, const Points& p, Bonds& b)
{
  std::vector<char> brings;
  for (const SkinFace& f : b.contact.skin) brings.push_back(writes_face(mesh, p, f));
  IntVec number;
  const ArchivePart part = named_part(skin_names(p.part.point, b.contact.skin), brings, number);
  for (SkinFace& f : b.contact.skin)
    if (f.points) f.elem = p.part.point[f.elem];
  for (IntVec* list : {&b.contact.skin_of, &b.contact.met})
    for (int& i : *list)
      if (i >= 0) i = number[i];
  return part;
}

// bonds; those of the deck precede all others
ArchivePart bonds_for_file(Bonds& b)
{
  std::vector<char> brings;
  for (int rank : b.rank) brings.push_back(rank == comm_rank());
  IntVec number;
  const ArchivePart part = named_part(b.name, brings, number);
  int of_deck = 0;
  for (int q = 0; q < b.nfixed; ++q) of_deck = std::max(of_deck, number[q] + 1);
  b.nbond  = part.whole;
  b.nfixed = comm_allreduce_max(of_deck);
  return part;
}

// the items of the bonds
ArchivePart side_part(const ArchivePart& bonds, const ListTable& a)
{
  ArchivePart part = bonds;
  part.ragged = true;
  part.at     = picked(bonds.at, 1, a.off);
  for (int q : bonds.at) part.units.push_back(a.count(q));
  return part;
}

// points and corners that this rank writes, with their arrays outside Points
void points_for_file(const Model& m, const IntVec& here, const WindowState& kept, bool laid, State& s)
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
  if (laid) s.laid.uc = picked(corners, dim, kept.laid);
  s.frac.converted = join_converted(m, kept.converted, here, p);
  join_released(kept, points, s.frac);
}

// exchanges points and corners, and their arrays outside Points
void swap_points(WindowState& kept, State& s)
{
  std::swap(kept.points, s.points);
  std::swap(kept.converted, s.frac.converted);
  std::swap(kept.released, s.frac.released);
  std::swap(kept.released_at, s.frac.released_at);
  std::swap(kept.left, s.frac.left);
  s.n.uc.swap(kept.uc);
  s.n.vc.swap(kept.vc);
  s.n.hp.swap(kept.hp);
  s.laid.uc.swap(kept.laid);
  s.division.point.swap(kept.rank);
}

}  // namespace

void state_swap(WindowState& kept, State& s)
{
  std::swap(kept.nbond, s.bonds.nbond);
  std::swap(kept.nfixed, s.bonds.nfixed);
  s.bonds.contact.skin.swap(kept.skin);
  s.bonds.contact.skin_of.swap(kept.skin_of);
  s.bonds.contact.met.swap(kept.met);
  if (kept.in_parts) swap_points(kept, s);
}

void state_for_file(const Model& m, WindowState& kept, State& s, std::vector<ArchivePart>& part)
{
  IntVec here;                 // elements of converted
  for (int number : s.frac.converted) here.push_back(m.part.elem_here(number));
  Bonds& b = s.bonds;
  kept.in_parts = state_in_parts(m, s);
  kept.nbond    = b.nbond;
  kept.nfixed   = b.nfixed;
  kept.skin     = b.contact.skin;
  kept.skin_of  = b.contact.skin_of;
  kept.met      = b.contact.met;
  part[PER_BOND] = bonds_for_file(b);
  part[PER_SIDE] = side_part(part[PER_BOND], b.a);
  part[PER_SKIN] = faces_for_file(m.part, s.points, b);
  if (!kept.in_parts) return;
  const bool laid = comm_allreduce_max(static_cast<int>(!s.laid.uc.empty()));
  swap_points(kept, s);
  points_for_file(m, here, kept, laid, s);
}

void state_read_outline(Archive& f, Points& x)
{
  ArchivePart &points = f.part[PER_POINT], &conn = f.part[PER_CONN];
  IntVec first;                // index of the first corner of each point on this rank
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
  if (f.part[PER_CONN].whole == 0) return;           // points as at the start
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
  sort_once(here);
  for (IntVec* list : {&x.conn.item, &fr.left.item})
    for (int& c : *list) c = x.corner_here(c);
  x.npoint      = static_cast<int>(x.part.point.size());
  x.ncorner     = static_cast<int>(here.size());
  corners       = ArchivePart();
  corners.whole = x.part.ncorner;
  corners.item  = here;
}

void state_read_bonds(Archive& f, const Points& p, Bonds& x)
{
  ArchivePart &bonds = f.part[PER_BOND], &side = f.part[PER_SIDE], &skin = f.part[PER_SKIN];
  const ArchivePart &nodes = f.part[PER_NODE], &corners = f.part[PER_CORNER];
  const auto has = [](const ArchivePart& part, int i) {
    return part.all || std::binary_search(part.item.begin(), part.item.end(), i);
  };
  const int nbond = x.nbond, nfixed = x.nfixed, ncorner = corners.all ? p.ncorner : corners.whole;
  bonds = skin = ArchivePart();
  x = Bonds();
  archive_each<SkinFace>(f, [&](int i, const SkinFace& face) {
    skin.whole = i + 1;
    if (!has(f.part[face.points ? PER_POINT : PER_ELEM], face.elem)) return;
    skin.item.push_back(i);
    x.contact.skin.push_back(face);
  });
  bool here = true;            // all items of the bond are on this rank
  IntVec list;
  long items = 0;
  archive_each<int>(f, [&](int, int number) {
    const int k = number < 0 ? -1 - number : number;
    f.good = f.good && k - nodes.whole < ncorner;
    here = here && (k < nodes.whole ? has(nodes, k) : has(corners, k - nodes.whole));
    list.push_back(k);
    ++items;
    if (number >= 0) return;
    if (here) {
      bonds.item.push_back(bonds.whole);
      x.a.item.insert(x.a.item.end(), list.begin(), list.end());
      x.a.off.push_back(static_cast<int>(x.a.item.size()));
      x.name.push_back(static_cast<long>(bonds.whole) - nfixed);
    }
    ++bonds.whole;
    list.clear();
    here = true;
  });
  f.good = f.good && list.empty() && bonds.whole == nbond && nfixed >= 0 && nfixed <= nbond;
  x.nbond  = static_cast<int>(bonds.item.size());
  x.nfixed = static_cast<int>(std::lower_bound(bonds.item.begin(), bonds.item.end(), nfixed) -
                              bonds.item.begin());
  side = bonds;
  side.ragged    = true;
  side.all_units = items;
  for (int q = 0; q < x.nbond; ++q) side.units.push_back(x.a.count(q));
}

void state_find_faces(const Archive& f, Bonds& x)
{
  const ArchivePart& skin = f.part[PER_SKIN];
  for (IntVec* list : {&x.contact.skin_of, &x.contact.met})
    for (int& i : *list) {
      if (i < 0 || i >= skin.whole) continue;
      const auto at = std::lower_bound(skin.item.begin(), skin.item.end(), i);
      i = at != skin.item.end() && *at == i ? static_cast<int>(at - skin.item.begin()) : FACE_ELSEWHERE;
    }
}
