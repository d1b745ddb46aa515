#include <algorithm>

#include "model/model.h"

namespace {

// Index here of the nodes and elements of the deck, -1: not here
struct Kept {
  IntVec node, elem;
};

// old items that are here, by their new index
IntVec kept_items(const IntVec& old, const IntVec& index)
{
  IntVec out;
  for (int k : old)
    if (index[k] >= 0) out.push_back(index[k]);
  return out;
}

std::vector<Face> kept_faces(const std::vector<Face>& old, const IntVec& elem)
{
  std::vector<Face> out;
  for (const Face& f : old)
    if (elem[f.elem] >= 0) out.push_back({elem[f.elem], f.face});
  return out;
}

// nodes of the elements of this rank; those without elements go to the first one
Kept find_kept(const Mesh& mesh, const IntVec& rank, MeshPart& part)
{
  Kept k;
  const int me = comm_rank();
  k.elem.assign(mesh.nelem(), -1);
  k.node.assign(mesh.nnode(), me == 0 ? 0 : -1);
  for (int e = 0; e < mesh.nelem() && me == 0; ++e)
    for (int i = mesh.conn.off[e]; i < mesh.conn.off[e + 1]; ++i) k.node[mesh.conn.item[i]] = -1;
  for (int e = 0; e < mesh.nelem(); ++e) {
    if (rank[e] != me) continue;
    k.elem[e] = static_cast<int>(part.elem.size());
    part.elem.push_back(e);
    for (int i = mesh.conn.off[e]; i < mesh.conn.off[e + 1]; ++i) k.node[mesh.conn.item[i]] = 0;
  }
  for (int n = 0; n < mesh.nnode(); ++n) {
    if (k.node[n] < 0) continue;
    k.node[n] = static_cast<int>(part.node.size());
    part.node.push_back(n);
  }
  return k;
}

Mesh cut_mesh(const Mesh& old, const Kept& k, const MeshPart& part)
{
  Mesh mesh;
  for (int n : part.node) {
    mesh.node_index[old.node_label[n]] = static_cast<int>(mesh.node_label.size());
    mesh.node_label.push_back(old.node_label[n]);
    mesh.X.insert(mesh.X.end(), &old.X[3 * static_cast<size_t>(n)], &old.X[3 * static_cast<size_t>(n)] + 3);
  }
  for (int e : part.elem) {
    mesh.elem_index[old.elem_label[e]] = static_cast<int>(mesh.elem_label.size());
    mesh.elem_label.push_back(old.elem_label[e]);
    mesh.elem_type.push_back(old.elem_type[e]);
    mesh.elem_section.push_back(old.elem_section[e]);
    for (int i = old.conn.off[e]; i < old.conn.off[e + 1]; ++i)
      mesh.conn.item.push_back(k.node[old.conn.item[i]]);
    mesh.conn.off.push_back(static_cast<int>(mesh.conn.item.size()));
  }
  for (IntVec* list : {&mesh.node_label, &mesh.elem_label, &mesh.elem_type, &mesh.elem_section,
                       &mesh.conn.item, &mesh.conn.off})
    list->shrink_to_fit();
  mesh.X.shrink_to_fit();
  return mesh;
}

// loads at a node count once, on the rank that the node belongs to; all other things go with their element
void cut_step(const Kept& k, const MeshPart& part, Step& s)
{
  for (Load& l : s.load) {
    l.node = kept_items(l.node, k.node);
    l.node.erase(std::remove_if(l.node.begin(), l.node.end(), [&](int n) { return !part.counts(n); }),
                 l.node.end());
    l.face = kept_faces(l.face, k.elem);
    l.elem = kept_items(l.elem, k.elem);
  }
  for (Prescribed& b : s.prescribed) b.node = kept_items(b.node, k.node);
}

}  // namespace

// ---------------------------------------------------------------------------
// model_cut : of the whole model what rank[e] [nelem] gives to this rank. Collective.
// ---------------------------------------------------------------------------
void model_cut(const IntVec& rank, Model& m)
{
  MeshPart& part = m.part;
  part       = MeshPart();
  part.on    = true;
  part.nnode = m.mesh.nnode();
  part.nelem = m.mesh.nelem();
  const Kept k = find_kept(m.mesh, rank, part);
  halo_form(std::vector<long>(part.node.begin(), part.node.end()), part.halo);
  m.mesh = cut_mesh(m.mesh, k, part);
  for (Set& s : m.nset) s.item = kept_items(s.item, k.node);
  for (Set& s : m.elset) s.item = kept_items(s.item, k.elem);
  for (Surface& s : m.surface) s.face = kept_faces(s.face, k.elem);
  for (InitialValue& v : m.initial) v.node = kept_items(v.node, k.node);
  for (Step& s : m.step) cut_step(k, part, s);
}
