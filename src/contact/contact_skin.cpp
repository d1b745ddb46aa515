#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "base/comm.h"
#include "base/gather_lists.h"
#include "contact/contact.h"
#include "contact/contact_meet.h"
#include "model/model_cut.h"
#include "shape/face.h"

namespace {

// is e a finite element at present?
bool is_element(const Model& m, const Fracture& fr, int e)
{
  return m.mesh.elem_section[e] >= 0 && (fr.empty() || fr.phase[e] == AS_ELEMENT);
}

using FaceKey = std::array<int, 4>;

FaceKey face_key(const Mesh& mesh, const Face& f)
{
  const ShapeInfo& info = shape_info[elem_table[mesh.elem_type[f.elem]].shape];
  FaceKey key{{-1, -1, -1, -1}};
  for (int k = 0; k < info.nfnode[f.face]; ++k) key[k] = mesh.conn.begin(f.elem)[info.face[f.face][k]];
  std::sort(key.begin(), key.end());
  return key;
}

struct OuterFace {
  FaceKey key;
  Face face;
};

std::vector<FaceKey> sorted_keys(const Mesh& mesh, const std::vector<Face>& face)
{
  std::vector<FaceKey> key;
  for (const Face& f : face) key.push_back(face_key(mesh, f));
  std::sort(key.begin(), key.end());
  return key;
}

bool contains(const std::vector<FaceKey>& list, const FaceKey& key)
{
  return std::binary_search(list.begin(), list.end(), key);
}

// Faces that belong to one element only, without those of bonded, ordered by their last node. Divided model:
// the element behind a face may be on another rank; such a face is an outer face only if it was one at t = 0,
// since converted elements and their neighbours are stored by all ranks that own adjacent elements.
std::vector<OuterFace> outer_faces(const Model& m, const Fracture& fr, const std::vector<Face>& bonded)
{
  std::vector<OuterFace> all, here, out;
  for (int e = 0; e < m.mesh.nelem(); ++e)
    for (int s = 0; s < shape_info[elem_table[m.mesh.elem_type[e]].shape].nface; ++s)
      all.push_back({face_key(m.mesh, {e, s}), {e, s}});
  const std::vector<FaceKey> tied = sorted_keys(m.mesh, bonded), start = sorted_keys(m.mesh, m.part.skin);
  const ListTable at = gather_lists(m.mesh.nnode(), [&](auto use) {    // faces by their last node
    for (size_t i = 0; i < all.size(); ++i) use(all[i].key[3], static_cast<int>(i));
  });
  for (int n = 0; n < m.mesh.nnode(); ++n) {
    here.clear();
    for (int k = at.off[n]; k < at.off[n + 1]; ++k) here.push_back(all[at.item[k]]);
    std::sort(here.begin(), here.end(), [](const OuterFace& a, const OuterFace& b) { return a.key < b.key; });
    for (size_t i = 0, j; i < here.size(); i = j) {
      const FaceKey& key = here[i].key;
      const OuterFace* owner = nullptr;
      int owners = 0;
      for (j = i; j < here.size() && here[j].key == key; ++j) {
        if (!is_element(m, fr, here[j].face.elem)) continue;
        owner = &here[j];
        ++owners;
      }
      const bool known = !m.part.on || j - i > 1 || contains(start, key);
      if (owners == 1 && known && !contains(tied, key)) out.push_back(*owner);
    }
  }
  return out;
}

// outer faces of elements by node
struct FacesOfNodes {
  std::vector<std::pair<int, int>> of;       // node, index of the face; ascending
  explicit FacesOfNodes(const std::vector<OuterFace>& faces)
  {
    for (size_t i = 0; i < faces.size(); ++i)
      for (int n : faces[i].key)
        if (n >= 0) of.emplace_back(n, static_cast<int>(i));
    std::sort(of.begin(), of.end());
  }
};

// the outer face of an element that contains these nodes, -1: none
int face_under(const std::vector<OuterFace>& faces, const FacesOfNodes& around, const IntVec& node)
{
  auto it = std::lower_bound(around.of.begin(), around.of.end(), std::make_pair(node[0], 0));
  for (; it != around.of.end() && it->first == node[0]; ++it) {
    const FaceKey& key = faces[it->second].key;
    if (std::all_of(node.begin(), node.end(),
                    [&](int n) { return std::find(key.begin(), key.end(), n) != key.end(); }))
      return it->second;
  }
  return -1;
}

// adds to out the nodes and corners (nnode + first corner of the name) that carry a node or corner
void add_carriers(const Model& m, const Points& pts, int node, IntVec& out)
{
  const int nnode = m.mesh.nnode(), c = node - nnode;
  if (c < 0) {
    out.push_back(node);
    return;
  }
  const int hangs = pts.carrier(c);
  if (hangs == HANG_NODE) out.push_back(pts.hang.begin(c)[0]);
  else if (hangs == HANG_CORNERS)
    for (int k = 0; k < pts.hang.count(c); ++k) add_carriers(m, pts, nnode - 1 - pts.hang.begin(c)[k], out);
  else out.push_back(nnode + pts.first_copy[c]);
}

// removes boundary faces of points that hang on the outer face of an element: they are inside the body, as is
// the face of the element where they cover it
void drop_covered(const Model& m, const Points& pts, std::vector<OuterFace>& faces,
                  std::vector<Face>& boundary)
{
  const FacesOfNodes around(faces);
  const auto area = [&](bool points, const Face& f) {
    const MasterFace at_start = face_at_start(m, pts, points, f);
    return face_whole_area(at_start.n, at_start.x);
  };
  RealVec covered(faces.size(), 0.0);
  IntVec node;
  std::vector<Face> rest;
  for (const Face& f : boundary) {
    const ShapeInfo& info = shape_info[pts.shape[f.elem]];
    node.clear();
    for (int k = 0; k < info.nfnode[f.face]; ++k)
      add_carriers(m, pts, m.mesh.nnode() + pts.conn.begin(f.elem)[info.face[f.face][k]], node);
    const bool hangs = *std::max_element(node.begin(), node.end()) < m.mesh.nnode();
    const int under  = hangs ? face_under(faces, around, node) : -1;
    if (under < 0) rest.push_back(f);
    else covered[under] += area(true, f);
  }
  boundary.swap(rest);
  size_t n = 0;
  for (size_t i = 0; i < faces.size(); ++i)
    if (covered[i] == 0.0 || covered[i] < (1.0 - 1e-6) * area(false, faces[i].face)) faces[n++] = faces[i];
  faces.resize(n);
}

// [node] bits of the directions in which a node is fixed (zero displacement) in all steps
IntVec fixed_nodes(const Model& m)
{
  IntVec fixed(m.mesh.nnode(), 7);
  for (const Step& step : m.step) {
    IntVec now(m.mesh.nnode(), 0);
    for (const Prescribed& p : step.prescribed)
      for (int n : p.node)
        for (int k = p.first; k <= p.last; ++k)
          if (p.value.is_const() && p.value.value == 0.0) now[n] |= 1 << k;
    for (int n = 0; n < m.mesh.nnode(); ++n) fixed[n] &= now[n];
  }
  return fixed;
}

// A face on a plane of symmetry, whose nodes or grid are fixed in the normal direction only, is inside the
// body of which a half is modelled  (test: Contact.PlanesOfSymmetryAreNoOuterFaces)
struct SymmetryPlanes {
  const Model& m;
  const Points& pts;
  IntVec fixed;
  std::vector<ContactWall> wall;

  // bits of the directions in which a node, or a corner (nnode + c) on the grid, is fixed
  int fixed_at(int node) const
  {
    const int c = node - m.mesh.nnode();
    if (c < 0) return fixed[node];
    int bits = 0;
    if (pts.field[c] == FIELD_OWN) return 0;
    for (const ContactWall& w : wall)
      if (std::fabs(pts.Xc[c * m.dim + w.axis] - w.at) <= 1e-6 * m.grid.h[w.axis])
        bits |= w.sticks ? 7 : 1 << w.axis;
    return bits;
  }

  bool holds(bool points, const Face& f) const
  {
    const MasterFace face = face_at_start(m, pts, points, f);
    double x[3], n[3];
    int bits = 7;
    IntVec base;
    for (int k = 0; k < face.n; ++k) add_carriers(m, pts, face.node[k], base);
    for (int node : base) bits &= fixed_at(node);
    face_middle(face, x, n);
    for (int k = 0; k < m.dim; ++k)
      if (bits == 1 << k && std::fabs(n[k]) > 1.0 - 1e-6) return true;
    return false;
  }
};

bool skin_before(const SkinFace& a, const SkinFace& b)
{
  const bool p = a.points > 0, q = b.points > 0;
  return p != q ? p < q : a.elem != b.elem ? a.elem < b.elem : a.face < b.face;
}

// A face of an element, or of a point of a converted element
struct SkinOfElem { int elem, point, face; };        // index of the point in its element, -1: of the element

// MeshPart::window: copies the faces of outer elements and of their points from the owner of the element,
// which stores the elements behind them. Collective.
void copy_skin(const Model& m, const Points& pts, std::vector<SkinFace>& skin)
{
  const Halo& around = m.part.around_points;
  const int ranks = comm_size(), me = comm_rank();
  if (!m.part.window || !around.on()) return;
  std::vector<SkinFace> own;
  std::vector<std::vector<SkinOfElem>> of(m.mesh.nelem()), send(ranks);
  for (const SkinFace& f : skin) {
    const int e = f.element(pts);
    if (e >= 0 && !m.part.works(e)) continue;
    own.push_back(f);
    if (e < 0) continue;       // all ranks store it
    of[e].push_back({m.part.elem[e], f.points ? f.elem - pts.of_elem[e] : -1, f.face});
  }
  for (int r = 0; r < ranks; ++r)
    for (int e : around.common[r])
      if (around.owner[e] == me) send[r].insert(send[r].end(), of[e].begin(), of[e].end());
  for (const std::vector<SkinOfElem>& received : comm_exchange(send))
    for (const SkinOfElem& f : received) {
      const int e = m.part.elem_here(f.elem), p = f.point < 0 ? -1 : pts.of_elem[e] + f.point;
      own.push_back({p < 0 ? e : p, f.face, p < 0 ? 0 : pts.released[p] ? 2 : 1});
    }
  std::sort(own.begin(), own.end(), skin_before);
  skin.swap(own);
}

}  // namespace

std::vector<ContactWall> contact_walls(const Model& m)
{
  std::vector<ContactWall> out;
  for (size_t i = 0; i < m.grid_bc.size(); ++i) {
    const GridBc& b = m.grid_bc[i];
    const double lo = m.grid.lo[b.axis], hi = lo + m.grid.n[b.axis] * m.grid.h[b.axis],
                 tol = 1e-6 * m.grid.h[b.axis];
    const bool below = b.position < lo + tol;
    if (b.first > b.axis || b.last < b.axis || !b.value.is_const() || b.value.value != 0.0) continue;
    if (!below && b.position < hi - tol) continue;
    out.push_back({static_cast<int>(i), b.axis, b.position, below ? 1.0 : -1.0, b.first < b.last});
  }
  return out;
}

std::vector<Face> contact_skin_at_start(const Model& m)
{
  std::vector<Face> skin;
  if (model_general_contact(m) < 0) return skin;
  Fracture fr;
  for (int removed : model_removed(m)) fr.phase.push_back(removed ? AS_NOTHING : AS_ELEMENT);
  for (const OuterFace& f : outer_faces(m, fr, {})) skin.push_back(f.face);
  return skin;
}

std::vector<SkinFace> contact_skin(const Model& m, const Fracture& fr, const Points& pts,
                                   const std::vector<Face>& interface)
{
  std::vector<SkinFace> skin;
  if (model_general_contact(m) < 0) return skin;
  std::vector<Face> bonded = interface, boundary = pts.boundary;
  for (const BondDef& d : m.bond)
    if (d.kind == BOND_MESH_GRID && d.surface >= 0)
      bonded.insert(bonded.end(), m.surface[d.surface].face.begin(), m.surface[d.surface].face.end());
  std::vector<OuterFace> faces = outer_faces(m, fr, bonded);
  drop_covered(m, pts, faces, boundary);
  const SymmetryPlanes symmetry{m, pts, fixed_nodes(m), contact_walls(m)};
  faces.erase(std::remove_if(faces.begin(), faces.end(),
                             [&](const OuterFace& f) { return symmetry.holds(false, f.face); }),
              faces.end());
  boundary.erase(std::remove_if(boundary.begin(), boundary.end(),
                                [&](const Face& f) { return symmetry.holds(true, f); }),
                 boundary.end());
  for (const OuterFace& f : faces) skin.push_back({f.face.elem, f.face.face, 0});
  for (const Face& f : boundary) skin.push_back({f.elem, f.face, pts.released[f.elem] ? 2 : 1});
  std::sort(skin.begin(), skin.end(), skin_before);
  copy_skin(m, pts, skin);
  return skin;
}
