#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <set>

#include "base/comm.h"
#include "base/forest.h"
#include "base/gather_lists.h"
#include "base/heap.h"
#include "base/sort_once.h"
#include "bond/bond.h"
#include "contact/contact.h"
#include "contact/contact_masters.h"
#include "contact/overlap.h"
#include "dof/dof.h"
#include "model/model_cut.h"
#include "model/model_send.h"

namespace {

// least number of finite elements and cells of points on a rank: with fewer, messages cost more than they
// save, and METIS balances badly  (test: Divided.SmallModelsTakeFewerRanks)
const int OWNED_AT_LEAST = 16;
// fraction of all convertible elements: if ranks have more elements of other ranks in two rows, they store
// the points of one row. P9, largest of four: 44.9 MB; 47.6 with two rows (3 % faster)  (no test)
const double TWO_ROWS_AT_MOST = 1.0 / 3.0;

// will a body receive the points of converted elements?
bool waits(const Body& b) { return b.fill == FILL_CONVERSION; }

// are there points from the start?
bool has_points(const Model& m) { return !std::all_of(m.body.begin(), m.body.end(), waits); }

int finite_elements(const Model& m)
{
  const IntVec& section = m.mesh.elem_section;
  return static_cast<int>(std::count_if(section.begin(), section.end(), [](int s) { return s >= 0; }));
}

// Do ranks store the points and outer faces of the elements
// that they store? With conversion or general contact
bool points_near(const Model& m)
{
  return !m.conversion.empty() || model_general_contact(m) >= 0;
}

// elements that are points from the start
IntVec elements_of_bodies(const Model& m)
{
  IntVec all;
  for (const Body& b : m.body)
    if (b.fill == FILL_ELSET) {
      const IntVec& elem = m.elset[b.elset].item;
      all.insert(all.end(), elem.begin(), elem.end());
    }
  return all;
}

// [ranks] the elements of these that share a node with an element of the rank, and belong to another rank
std::vector<IntVec> around_bodies(const Model& m, const IntVec& rank)
{
  const Mesh& mesh  = m.mesh;
  const IntVec elem = elements_of_bodies(m);
  std::vector<IntVec> out(comm_size());
  if (elem.empty()) return out;
  const ListTable at = gather_lists(mesh.nnode(), [&](auto use) {
    for (int e : elem)
      for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1]; ++k) use(mesh.conn.item[k], e);
  });
  for (int n = 0; n < mesh.nnode(); ++n)
    for (const int* a = at.begin(n); a != at.begin(n + 1); ++a)
      for (const int* b = at.begin(n); b != at.begin(n + 1); ++b)
        if (rank[*a] != rank[*b]) out[rank[*a]].push_back(*b);
  return out;
}

// [ranks] elements of other ranks with a face on side A of bonds or contact pairs that has a node of the
// rank's elements: the rank then stores all such faces at its nodes
std::vector<IntVec> around_bonds(const Model& m, const IntVec& rank)
{
  const Mesh& mesh = m.mesh;
  std::vector<IntVec> out(comm_size());
  const ListTable at = gather_lists(mesh.nnode(), [&](auto use) {
    for (const BondDef& d : m.bond) {
      if (d.surface < 0) continue;
      for (const Face& f : m.surface[d.surface].face) {
        const ShapeInfo& info = shape_info[elem_table[mesh.elem_type[f.elem]].shape];
        const int* node       = mesh.conn.begin(f.elem);
        for (int k = 0; k < info.nfnode[f.face]; ++k) use(node[info.face[f.face][k]], f.elem);
      }
    }
  });
  for (int e = 0; e < mesh.nelem() && !at.item.empty(); ++e)
    for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1]; ++k)
      for (const int* b = at.begin(mesh.conn.item[k]); b != at.begin(mesh.conn.item[k] + 1); ++b)
        if (rank[*b] != rank[e]) out[rank[e]].push_back(*b);
  return out;
}

bool of_general(const NearFace& f) { return f.side == NEAR_BOTH; }

// faces of general contact at t = 0, with the search range for initial overlaps; pts: of all ranks
std::vector<NearFace> skin_at_start(const Model& m, const Points& pts)
{
  std::vector<SkinFace> skin;
  RealVec u, uc;
  for (const Face& f : m.part.skin) skin.push_back({f.elem, f.face, 0});
  for (const Face& f : pts.boundary) skin.push_back({f.elem, f.face, 1});
  contact_displacements(m, pts, u, uc);
  return near_now(m, pts, skin, u, uc, true, 0.0);
}

// faces of contact pairs at t = 0; adjusted: where contact points created by conversion search
// for their gap at t = 0
std::vector<NearFace> pairs_at_start(const Model& m, const Points& pts, bool adjusted)
{
  RealVec u, uc;
  contact_displacements(m, pts, u, uc);
  return masters_and_slaves(m, pts, u, uc, adjusted);
}

// near faces of general contact, or of contact pairs
struct NearFaces { std::vector<NearFace> general, pairs; };

// given: faces of an earlier division, or of a state; kinds that are missing there: those of t = 0
NearFaces near_of(const Model& m, const std::vector<NearFace>& given)
{
  NearFaces out;
  for (const NearFace& f : given) (of_general(f) ? out.general : out.pairs).push_back(f);
  const auto adjusts = [](const BondDef& d) { return d.pair() && d.contact.overlap == OVERLAP_ADJUST; };
  const bool general = out.general.empty() && model_general_contact(m) >= 0,
             pairs   = out.pairs.empty() && model_has_pairs(m),
             adjust  = !m.conversion.empty() && std::any_of(m.bond.begin(), m.bond.end(), adjusts);
  if (!general && !pairs && !adjust) return out;
  Points pts;
  point_fill_whole(m, pts);
  if (general) out.general = skin_at_start(m, pts);
  if (pairs) out.pairs = pairs_at_start(m, pts, false);
  if (!adjust) return out;
  const std::vector<NearFace> start = pairs_at_start(m, pts, true);
  out.pairs.insert(out.pairs.end(), start.begin(), start.end());
  return out;
}

// [face] rank of its element or point
IntVec ranks_of_faces(const Model& m, const IntVec& rank, const std::vector<NearFace>& face)
{
  IntVec out, number;
  for (const NearFace& f : face)
    if (f.elem < 0) number.push_back(f.point);
  sort_once(number);
  const IntVec home = point_fill_homes(m, rank, number);
  for (const NearFace& f : face) {
    const auto at = std::lower_bound(number.begin(), number.end(), f.point) - number.begin();
    out.push_back(f.elem < 0 ? home[at] : rank[f.elem]);
  }
  return out;
}

// lists of the ranks, each item once, ascending
OfRanks<int> joined_lists(const std::vector<const std::vector<IntVec>*>& lists)
{
  OfRanks<int> out;
  out.off.push_back(0);
  for (int r = 0; r < comm_size(); ++r) {
    std::set<int> here;
    for (const std::vector<IntVec>* list : lists) here.insert((*list)[r].begin(), (*list)[r].end());
    out.item.insert(out.item.end(), here.begin(), here.end());
    out.off.push_back(static_cast<int>(out.item.size()));
  }
  return out;
}

// [ranks] has an element that the rank owns, or whose points it stores, a node of these faces? Only such a
// rank can have contact points on them
IntVec ranks_at(const Mesh& mesh, const std::vector<Face>& face, const IntVec& rank,
                const std::vector<IntVec>& points)
{
  std::vector<char> at(mesh.nnode(), 0);
  const auto each = [&](int e, auto use) {
    for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1]; ++k) use(mesh.conn.item[k]);
  };
  for (const Face& f : face) each(f.elem, [&](int n) { at[n] = 1; });
  IntVec out(points.size(), 0);
  for (int e = 0; e < mesh.nelem(); ++e) each(e, [&](int n) { out[rank[e]] |= at[n]; });
  for (std::size_t r = 0; r < points.size(); ++r)
    for (int e : points[r]) each(e, [&](int n) { out[r] |= at[n]; });
  return out;
}

// [ranks] ContactDef::present, for each of bond: may a rank have contact points of a pair?
//   in   points   [ranks] elements of other ranks whose points the rank stores
std::vector<IntVec> pairs_of_ranks(const Model& m, const IntVec& rank, const std::vector<IntVec>& points)
{
  std::vector<IntVec> present(points.size(), IntVec(m.bond.size(), 1));
  for (std::size_t d = 0; d < m.bond.size(); ++d) {
    const BondDef& b = m.bond[d];
    if (!b.pair() || m.surface[b.surface].body >= 0) continue;
    const IntVec known = ranks_at(m.mesh, m.surface[b.surface].face, rank, points);
    for (std::size_t r = 0; r < points.size(); ++r) present[r][d] = known[r];
  }
  return present;
}

// What each rank stores in addition to its own elements and points
struct Outer {
  // elements of other ranks: all that it reads, since they are near breaking elements, have faces that
  // contact may meet, adjoin its own at side A of bonds and contact pairs or its own points from the start,
  // or become points that it stores; and the latter only
  OfRanks<int> elem, near;
  std::vector<std::vector<OriginalPoint>> point;         // ModelCut
  std::vector<IntVec> present; // the same
  std::vector<char> notch;     // the same
};

// Are there many elements of other ranks in two rows? Then a rank stores the points of one row only; with two
// rows it could take over points when the work becomes uneven.
//   in   rows   [ranks] elements of two rows
bool too_many(const Model& m, const std::vector<IntVec>& rows)
{
  std::size_t all = 0, others = 0;
  for (const ConversionDef& c : m.conversion) all += m.elset[c.elset].item.size();
  for (const IntVec& elem : rows) others += elem.size();
  return others > TWO_ROWS_AT_MOST * all;
}

Outer find_outer(const Model& m, const IntVec& rank, const std::vector<NearFace>& given)
{
  Outer out;
  const std::size_t ranks = comm_size();
  const std::vector<IntVec> around = around_bodies(m, rank), bonds = around_bonds(m, rank);
  std::vector<IntVec> breaks(ranks), rows(ranks), points(ranks);
  NearLists near = {std::vector<IntVec>(ranks), std::vector<std::vector<OriginalPoint>>(ranks)};
  if (!m.fracture.empty()) breaks = frac_outer(m, rank, comm_size(), out.notch);
  const NearFaces face = near_of(m, given);
  near_outer(face.general, ranks_of_faces(m, rank, face.general), {}, near);
  if (m.part.window) {
    rows   = frac_around(m, rank, comm_size(), FRAC_ROWS);
    points = too_many(m, rows) ? frac_around(m, rank, comm_size(), 1) : rows;
    for (std::size_t r = 0; r < ranks; ++r)
      points[r].insert(points[r].end(), near.elem[r].begin(), near.elem[r].end());
  }
  out.present = pairs_of_ranks(m, rank, points);
  near_outer(face.pairs, ranks_of_faces(m, rank, face.pairs), bonds, near);
  for (std::size_t r = 0; r < ranks && m.part.window; ++r)
    points[r].insert(points[r].end(), near.elem[r].begin(), near.elem[r].end());
  out.near  = joined_lists({&points});
  out.elem  = joined_lists({&breaks, &rows, &points, &around, &bonds, &near.elem});
  out.point = std::move(near.point);
  return out;
}

// work of an element: its node pairs at each Gauss point; almost none if it is not a finite element
RealVec element_work(const Mesh& mesh)
{
  RealVec work;
  for (int e = 0; e < mesh.nelem(); ++e) {
    const ShapeInfo& info = shape_info[elem_table[mesh.elem_type[e]].shape];
    work.push_back(mesh.elem_section[e] < 0 ? 1 : pair_count(info.nen) * info.ngp);
  }
  return work;
}

// are all finite elements that are not removed connected by common faces?
bool joined_by_faces(const Model& m)
{
  const Mesh& mesh = m.mesh;
  std::map<std::array<int, 4>, int> owner;
  Forest parts(mesh.nelem());
  IntVec removed = model_removed(m);
  for (int e = 0; e < mesh.nelem(); ++e) removed[e] |= mesh.elem_section[e] < 0;
  int left = static_cast<int>(std::count(removed.begin(), removed.end(), 0));
  for (int e = 0; e < mesh.nelem(); ++e) {
    if (removed[e]) continue;
    const ShapeInfo& info = shape_info[elem_table[mesh.elem_type[e]].shape];
    for (int f = 0; f < info.nface; ++f) {
      std::array<int, 4> key = {-1, -1, -1, -1};
      for (int a = 0; a < face_corners(info, f); ++a) key[a] = mesh.conn.begin(e)[info.face[f][a]];
      std::sort(key.begin(), key.end());
      const auto known = owner.emplace(key, e);
      if (known.second) continue;
      left -= parts.root(e) != parts.root(known.first->second);
      parts.join(e, known.first->second);
      owner.erase(known.first);          // a face has two elements at most
    }
  }
  return left == 1;
}

// gives each of the first ranks an element: METIS may leave a rank empty if there are few
void leave_none_empty(int ranks, IntVec& rank)
{
  IntVec count(ranks, 0);
  for (int r : rank) ++count[r];
  for (int r = 0; r < ranks; ++r) {
    if (count[r] > 0) continue;
    const int most = static_cast<int>(std::max_element(count.begin(), count.end()) - count.begin());
    const auto last = std::find(rank.rbegin(), rank.rend(), most);
    *last = r;
    --count[most];
    ++count[r];
  }
}

// rank 0: owner of each element. A few elements with many points belong to the first ranks
IntVec owners(const Model& m, const DivideBy& by)
{
  if (!by.rank.empty()) return by.rank;
  const int elements = finite_elements(m), most = m.part.points ? elements / OWNED_AT_LEAST : comm_size(),
            ranks    = std::max(1, std::min(comm_size(), most));
  IntVec rank(m.mesh.nelem(), 0);
  if (elements == 0 || ranks == 1) return rank;
  std::vector<RealVec> kind = by.work;
  const auto none = [](const RealVec& w) { return *std::max_element(w.begin(), w.end()) <= 0.0; };
  kind.erase(std::remove_if(kind.begin(), kind.end(), none), kind.end());
  if (kind.empty()) kind.push_back(element_work(m.mesh));
  rank = part_mesh(m.mesh, m.dim, kind, ranks);
  leave_none_empty(ranks, rank);
  return rank;
}

// rank 0: sends the pieces one by one, so that only one exists in addition to the whole model
void send_pieces(const IntVec& rank, const OverlapWatch& watch, const std::vector<NearFace>& near, Model& m)
{
  for (BondDef& d : m.bond)
    if (d.pair()) d.contact.stiff = surface_stiffness(m, m.surface[d.contact.master]);
  m.part.joined    = joined_by_faces(m);
  m.part.uncoupled = watch.pair;
  m.part.skin      = contact_skin_at_start(m);
  Outer outer = find_outer(m, rank, near);
  model_order_nodes(rank, outer.elem, comm_size(), m);
  ModelCut cut = model_cut_open(m, rank, outer.elem, comm_size());
  cut.near     = std::move(outer.near);
  cut.point    = std::move(outer.point);
  cut.present  = std::move(outer.present);
  cut.notch    = std::move(outer.notch);
  for (int r = 1; r < comm_size(); ++r) {
    Model piece = model_cut_piece(cut, r);
    model_send(piece, r);
  }
  m = model_cut_piece(cut, 0);
}

}  // namespace

int dof_ranks(const Model& m)
{
  const int ranks = comm_size(), elements = finite_elements(m);
  if (elements >= static_cast<long>(OWNED_AT_LEAST) * ranks || ranks == 1) return ranks;
  // with fracture, conversion or general contact each rank must own elements: a rank without any would have
  // an empty Fracture (state.h) and no outer faces, as in a model without these
  const bool owns  = elements > 0 && (!m.fracture.empty() || !m.broken.empty() || points_near(m));
  const long cells = has_points(m) && !owns ? point_fill_cells(m) : 0;
  return static_cast<int>(std::max(1L, std::min<long>(ranks, (elements + cells) / OWNED_AT_LEAST)));
}

// ---------------------------------------------------------------------------
// dof_part : the model of rank 0, divided among the ranks                                doc/theory.md 5.1
//
//   inout m      rank 0: the whole model; afterwards, on all ranks, what they own and its surroundings
// ---------------------------------------------------------------------------
void dof_part(const DivideBy& by, Model& m)
{
  if (comm_size() == 1) return;
  if (comm_rank() == 0) {
    OverlapWatch watch;
    overlap_pairs(m, watch);
    m.part.points = has_points(m);
    m.part.window = points_near(m);
    IntVec rank   = owners(m, by);
    if (m.part.points) point_fill_ranks(rank, m);
    send_pieces(rank, watch, by.near, m);
  } else {
    m = model_receive();
  }
  model_cut_close(m);
  heap_give_back();                      // the memory of the whole model
}
