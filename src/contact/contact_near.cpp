#include "contact/contact_near.h"

#include <algorithm>

#include "base/comm.h"
#include "base/gather_lists.h"
#include "base/sort_once.h"
#include "contact/contact_meet.h"
#include "point/point.h"

namespace {

// Margin of near_outer beyond the search range, as a fraction of the size of each of the two faces. Larger:
// larger pieces; smaller: more frequent divisions. Measured: doc/benchmarks.md, "Contact on several ranks"
// (test: Divided.NearElementsAreOuterOnes)
const double OUTER_MARGIN = 1.5;

// is the element or the point of a face stored here? Outer elements may lack their points
bool stored(const MeshPart& part, const Points& pts, const NearFace& f)
{
  if (f.elem < 0) return pts.point_here(f.point) >= 0;
  const int e = part.elem_here(f.elem);
  return e >= 0 && (!f.converted || part.stores_points(e));
}

// the box around all faces
BoundingBox box_of(const std::vector<NearFace>& face)
{
  BoundingBox all;
  for (const NearFace& f : face) box_take(all, f.box.lo, f.box.hi);
  return all;
}

}  // namespace

std::vector<NearFace> near_faces(const Model& m, const Points& pts, const std::vector<SkinFace>& skin,
                                 const RealVec& u, const RealVec& uc, const NearReach& reach)
{
  std::vector<NearFace> out;
  for (const SkinFace& s : skin) {
    const MasterFace f = master_face(m, pts, s.points, {s.elem, s.face}, u, uc);
    const int e        = s.element(pts);
    NearFace near = {e < 0 ? -1 : m.part.elem_number(e), f.size, {}};
    box_take(near.box, f.lo, f.hi);
    if (e < 0) near.point = pts.point_number(s.elem);
    near.converted = s.points && e >= 0;
    box_grow(near.box, reach.fraction * f.size + 0.5 * (reach.motion + reach.margin));
    out.push_back(near);
  }
  return out;
}

std::vector<NearFace> near_now(const Model& m, const Points& pts, const std::vector<SkinFace>& skin,
                               const RealVec& u, const RealVec& uc, bool is_static, double travel)
{
  RealVec size;
  for (const NearFace& f : near_faces(m, pts, skin, u, uc, {})) size.push_back(f.size);
  return near_faces(m, pts, skin, u, uc, near_reach(is_static, travel, size));
}

std::vector<NearFace> near_own(const Model& m, const Points& pts, const std::vector<SkinFace>& skin,
                               const std::vector<NearFace>& face)
{
  std::vector<NearFace> own;
  for (std::size_t i = 0; i < skin.size(); ++i)
    if (point_skin_counts(m, pts, skin[i])) own.push_back(face[i]);
  return own;
}

bool near_known(const MeshPart& part, const Points& pts, const std::vector<NearFace>& own,
                const std::vector<NearFace>& look)
{
  const int ranks = comm_size();
  std::vector<BoundingBox> of_rank(1, box_of(look)), box;
  comm_allgatherv(of_rank);
  std::vector<std::vector<NearFace>> send(ranks);
  for (int r = 0; r < ranks; ++r)
    for (const NearFace& f : own)
      if (r != comm_rank() && boxes_meet(f.box, of_rank[r])) send[r].push_back(f);
  for (const NearFace& f : look) box.push_back(f.box);
  const BoxTree tree(box);
  int missing = 0;
  IntVec found;
  for (const std::vector<NearFace>& received : comm_exchange(send))
    for (const NearFace& f : received) {
      if (missing || stored(part, pts, f)) continue;
      found.clear();
      tree.overlap(f.box, found);
      missing = std::any_of(found.begin(), found.end(), [&](int i) { return look[i].def == f.def; });
    }
  return comm_allreduce_max(missing) == 0;
}

void near_outer(const std::vector<NearFace>& face, const IntVec& rank, const std::vector<IntVec>& slaves,
                NearLists& out)
{
  std::vector<BoundingBox> box;
  int elements = 0;            // upper bound of the element numbers
  for (const NearFace& f : face) {
    box.push_back(f.box);
    box_grow(box.back(), OUTER_MARGIN * f.size);
    elements = std::max(elements, f.elem + 1);
  }
  const BoxTree tree(box);
  IntVec found, to;
  const ListTable others = gather_lists(elements, [&](auto use) {
    for (std::size_t r = 0; r < slaves.size(); ++r)
      for (int e : slaves[r])
        if (e < elements) use(e, static_cast<int>(r));
  });
  for (std::size_t i = 0; i < face.size(); ++i) {
    const int e = face[i].elem;
    if (face[i].side == NEAR_MASTER) continue;
    to.assign(1, rank[i]);
    if (face[i].side == NEAR_SLAVE && e >= 0) to.insert(to.end(), others.begin(e), others.begin(e + 1));
    found.clear();
    tree.overlap(box[i], found);
    for (int j : found) {
      const NearFace& f = face[j];
      if (f.def != face[i].def || f.side == NEAR_SLAVE) continue;
      for (int r : to) {
        if (rank[j] == r) continue;
        if (f.elem >= 0) out.elem[r].push_back(f.elem);
        else out.point[r].push_back({f.point, rank[j]});
      }
    }
  }
  for (IntVec& of : out.elem) sort_once(of);
  for (std::vector<OriginalPoint>& of : out.point) sort_once(of);
}
