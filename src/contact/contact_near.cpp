#include "contact/contact_near.h"

#include <algorithm>

#include "base/comm.h"
#include "contact/contact_meet.h"
#include "point/point.h"

namespace {

// of the size of each of two faces: what lies between them beyond their reach when their elements become
// known. More: pieces are larger; less: they are made more often. Measured: doc/benchmarks.md, "General
// contact of near elements"
const double AROUND = 1.5;

ContactBox grown(ContactBox b, double by)
{
  for (int i = 0; i < 3; ++i) {
    b.lo[i] -= by;
    b.hi[i] += by;
  }
  return b;
}

// around all of them
ContactBox box_of(const std::vector<NearFace>& face)
{
  ContactBox all = {{1e300, 1e300, 1e300}, {-1e300, -1e300, -1e300}};
  for (const NearFace& f : face)
    for (int i = 0; i < 3; ++i) {
      all.lo[i] = std::min(all.lo[i], f.box.lo[i]);
      all.hi[i] = std::max(all.hi[i], f.box.hi[i]);
    }
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
    std::copy_n(f.lo, 3, near.box.lo);
    std::copy_n(f.hi, 3, near.box.hi);
    near.box = grown(near.box, reach.part * f.size + 0.5 * (reach.most + reach.margin));
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

bool near_known(const MeshPart& part, const std::vector<NearFace>& own)
{
  const int ranks = comm_size();
  std::vector<ContactBox> of_rank(1, box_of(own)), box;
  comm_allgatherv(of_rank);
  std::vector<std::vector<NearFace>> tell(ranks);
  for (int r = 0; r < ranks; ++r)
    for (const NearFace& f : own)
      if (r != comm_rank() && boxes_meet(f.box, of_rank[r])) tell[r].push_back(f);
  for (const NearFace& f : own) box.push_back(f.box);
  const ContactTree tree(box);
  int missing = 0;
  IntVec found;
  for (const std::vector<NearFace>& told : comm_exchange(tell))
    for (const NearFace& f : told) {
      if (missing || f.elem < 0 || part.elem_here(f.elem) >= 0) continue;
      tree.overlap(f.box, found);
      missing = !found.empty();
    }
  return comm_allreduce_max(missing) == 0;
}

void near_outer(const std::vector<NearFace>& face, const IntVec& rank, std::vector<IntVec>& list)
{
  std::vector<ContactBox> box;
  for (const NearFace& f : face) box.push_back(grown(f.box, AROUND * f.size));
  const ContactTree tree(box);
  IntVec found;
  const int ranks = static_cast<int>(list.size());
  for (std::size_t i = 0; i < face.size(); ++i) {
    const int r = face[i].elem < 0 ? -1 : rank[face[i].elem];
    found.clear();
    tree.overlap(box[i], found);
    for (int j : found) {
      const int e = face[j].elem;
      for (int to = r < 0 ? 0 : r; to < (r < 0 ? ranks : r + 1) && e >= 0; ++to)
        if (rank[e] != to) list[to].push_back(e);
    }
  }
  for (IntVec& of : list) {
    std::sort(of.begin(), of.end());
    of.erase(std::unique(of.begin(), of.end()), of.end());
  }
}
