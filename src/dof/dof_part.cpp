#include <algorithm>
#include <array>
#include <cstdlib>
#include <map>
#include <set>

#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "base/comm.h"
#include "base/forest.h"
#include "base/log.h"
#include "contact/contact.h"
#include "contact/overlap.h"
#include "dof/dof.h"
#include "model/model_cut.h"
#include "model/model_send.h"

namespace {

// finite elements a rank: below, all ranks keep the whole model
const int LEAST = 16;
// cells of points a rank, where each has its own
const int LEAST_CELLS = 16;

// does a body wait for points that elements become?
bool waits(const Body& b) { return b.fill == FILL_CONVERSION; }

// Can each rank have points of its own of those that are there from the start? Without elements there must be
// enough
bool points_divide(const Model& m)
{
  if (std::all_of(m.body.begin(), m.body.end(), waits)) return false;
  const IntVec& section = m.mesh.elem_section;
  const bool elements   = std::any_of(section.begin(), section.end(), [](int s) { return s >= 0; });
  return elements || point_fill_divides(m, LEAST_CELLS);
}

// Can each rank know the points and outer faces of the elements that it has alone? Elements become points, or
// contact is general
bool points_near(const Model& m)
{
  return !m.conversion.empty() || (!m.part.points && model_general_contact(m) >= 0);
}

// is the model large enough? MPFE_DIVIDE=0: it is not wanted; tests compare
bool asked(const Model& m)
{
  const char* text = std::getenv("MPFE_DIVIDE");
  const IntVec& section = m.mesh.elem_section;
  const long elements   = std::count_if(section.begin(), section.end(), [](int s) { return s >= 0; });
  if (text && *text == '0') return false;
  return (m.part.points && elements == 0) || elements >= static_cast<long>(LEAST) * comm_size();
}

// Elements that all ranks have: at surfaces of bonds and contact pairs, those that are points from the start,
// and of general contact where all ranks know outer faces
IntVec elements_of_all(const Model& m)
{
  IntVec all;
  const IntVec surface = model_bonded_surfaces(m, !m.part.window);
  for (std::size_t s = 0; s < surface.size(); ++s)
    if (surface[s])
      for (const Face& f : m.surface[s].face) all.push_back(f.elem);
  for (const Face& f : m.part.skin)
    if (!m.part.window) all.push_back(f.elem);
  for (const Body& b : m.body)
    if (b.fill == FILL_ELSET) {
      const IntVec& elem = m.elset[b.elset].item;
      all.insert(all.end(), elem.begin(), elem.end());
    }
  return all;
}

// faces of general contact at t = 0, with the reach of the search that looks for overlaps then
std::vector<NearFace> skin_at_start(const Model& m)
{
  std::vector<SkinFace> skin;
  Points pts;
  if (model_general_contact(m) < 0) return {};
  for (const Face& f : m.part.skin) skin.push_back({f.elem, f.face, 0});
  point_fill_whole(m, pts);
  for (const Face& f : pts.boundary) skin.push_back({f.elem, f.face, 1});
  const RealVec u(static_cast<std::size_t>(m.mesh.nnode()) * m.dim, 0.0), uc(pts.Xc.size(), 0.0);
  return near_now(m, pts, skin, u, uc, true, 0.0);
}

// lists of the ranks, and what all have of others, each once, ascending
OfRanks<int> joined_lists(const std::vector<const std::vector<IntVec>*>& lists, const IntVec& all,
                          const IntVec& rank)
{
  OfRanks<int> out;
  out.off.push_back(0);
  for (int r = 0; r < comm_size(); ++r) {
    std::set<int> here;
    for (const std::vector<IntVec>* list : lists) here.insert((*list)[r].begin(), (*list)[r].end());
    for (int e : all)
      if (rank[e] != r) here.insert(e);
    out.item.insert(out.item.end(), here.begin(), here.end());
    out.off.push_back(static_cast<int>(out.item.size()));
  }
  return out;
}

// Elements of others that each rank looks at: near what breaks, those whose points it knows (near), and those
// of all
OfRanks<int> outer_elements(const Model& m, const IntVec& rank, const std::vector<NearFace>& skin,
                            OfRanks<int>& near, std::vector<char>& notch)
{
  const IntVec all = elements_of_all(m);
  if (m.fracture.empty() && all.empty() && !m.part.window) return {};
  std::vector<IntVec> breaks(comm_size()), points(comm_size()), faces(comm_size());
  if (!m.fracture.empty()) breaks = frac_outer(m, rank, comm_size(), notch);
  if (m.part.window) frac_around(m, rank, points);
  if (m.part.window) near_outer(skin.empty() ? skin_at_start(m) : skin, rank, faces);
  near = joined_lists({&points, &faces}, all, rank);
  return joined_lists({&breaks, &points, &faces}, all, rank);
}

// work of an element: its node pairs at each Gauss point; next to none of one that is no finite element
RealVec element_work(const Mesh& mesh)
{
  RealVec work;
  for (int e = 0; e < mesh.nelem(); ++e) {
    const ShapeInfo& info = shape_info[elem_table[mesh.elem_type[e]].shape];
    work.push_back(mesh.elem_section[e] < 0 ? 1 : pair_count(info.nen) * info.ngp);
  }
  return work;
}

// do all finite elements that are not removed hang together by common faces?
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

// rank 0: rank of each element; false: the model stays whole
bool divided(const Model& m, const DivideBy& by, IntVec& rank)
{
  rank = by.rank;
  if (!rank.empty()) return true;
  const IntVec& section = m.mesh.elem_section;
  if (std::none_of(section.begin(), section.end(), [](int s) { return s >= 0; })) {
    rank.assign(m.mesh.nelem(), 0);
    return true;
  }
  std::vector<RealVec> kind = by.work;
  const auto none = [](const RealVec& w) { return *std::max_element(w.begin(), w.end()) <= 0.0; };
  kind.erase(std::remove_if(kind.begin(), kind.end(), none), kind.end());
  if (kind.empty()) kind.push_back(element_work(m.mesh));
  rank = part_mesh(m.mesh, m.dim, kind, comm_size());
  IntVec count(comm_size(), 0);
  for (int r : rank) ++count[r];
  return *std::min_element(count.begin(), count.end()) > 0;
}

// rank 0: to the other ranks one piece after the other, so that no more than one lies beside the whole model
void send_pieces(const IntVec& rank, const OverlapWatch& watch, const std::vector<NearFace>& skin, Model& m)
{
  m.part.joined    = joined_by_faces(m);
  m.part.strangers = watch.pair;
  m.part.skin      = contact_skin_at_start(m);
  OfRanks<int> near;
  std::vector<char> notch;
  const OfRanks<int> outer = outer_elements(m, rank, skin, near, notch);
  model_order_nodes(rank, outer, comm_size(), m);
  ModelCut cut = model_cut_open(m, rank, outer, comm_size());
  cut.near     = std::move(near);
  cut.notch    = std::move(notch);
  for (int r = 1; r < comm_size(); ++r) {
    Model piece = model_cut_piece(cut, r);
    model_send(piece, r);
  }
  m = model_cut_piece(cut, 0);
}

}  // namespace

// ---------------------------------------------------------------------------
// dof_part : the model of rank 0, divided where it can be                                doc/theory.md 5.1
//
//   inout m      rank 0: the whole model; behind it, on all ranks, what they work on
// ---------------------------------------------------------------------------
void dof_part(bool whole, const DivideBy& by, Model& m)
{
  if (comm_size() == 1) return;
  IntVec rank;
  OverlapWatch watch;
  bool divides = false;
  if (comm_rank() == 0 && !whole) {
    overlap_pairs(m, watch);
    m.part.points = points_divide(m);
    m.part.window = points_near(m);
    divides       = asked(m) && divided(m, by, rank);
    m.part.points = m.part.points && divides;
    m.part.window = m.part.window && divides;
  }
  if (!comm_bcast(static_cast<int>(divides))) return model_bcast(m);
  if (comm_rank() == 0) send_pieces(rank, watch, by.skin, m);
  else m = model_receive();
  model_cut_close(m);
#ifdef __GLIBC__
  malloc_trim(0);                        // what the whole model took
#endif
}
