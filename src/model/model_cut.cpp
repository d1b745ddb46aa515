#include "model/model_cut.h"

#include <algorithm>
#include <numeric>
#include <utility>

namespace {

// The lists that grow with the mesh, always in the same order. A face goes with its element.
struct Lists {
  std::vector<IntVec*> node, elem;
  std::vector<std::vector<Face>*> face;
};

Lists lists_of(Model& m)
{
  Lists l;
  for (Set& s : m.nset) l.node.push_back(&s.item);
  for (Set& s : m.elset) l.elem.push_back(&s.item);
  for (Surface& s : m.surface) l.face.push_back(&s.face);
  for (InitialValue& v : m.initial) l.node.push_back(&v.node);
  for (Step& s : m.step) {
    for (Load& load : s.load) {
      l.node.push_back(&load.node);
      l.elem.push_back(&load.elem);
      l.face.push_back(&load.face);
    }
    for (Prescribed& b : s.prescribed) l.node.push_back(&b.node);
  }
  return l;
}

// The items of a list by rank; they keep their order. The list is empty behind it.
//   ranks_of(item)   first and last of the ranks that have it
template <class T, class RanksOf>
OfRanks<T> divide(std::vector<T>& list, int ranks, RanksOf ranks_of)
{
  OfRanks<T> out;
  out.off.assign(ranks + 1, 0);
  for (const T& x : list)
    for (auto [r, last] = ranks_of(x); r != last; ++r) ++out.off[*r + 1];
  std::partial_sum(out.off.begin(), out.off.end(), out.off.begin());
  out.item.resize(out.off.back());
  IntVec next(out.off);
  for (const T& x : list)
    for (auto [r, last] = ranks_of(x); r != last; ++r) out.item[next[*r]++] = x;
  std::vector<T>().swap(list);
  return out;
}

// nodes of the elements of each rank; those without elements go to the first one
OfRanks<int> nodes_of(const Mesh& mesh, const OfRanks<int>& elem)
{
  OfRanks<int> out;
  IntVec seen(mesh.nnode(), -1);
  for (int n : mesh.conn.item) seen[n] = -2;
  for (int n = 0; n < mesh.nnode(); ++n)
    if (seen[n] == -1) out.item.push_back(n);
  out.off.push_back(0);
  for (int r = 0; r + 1 < static_cast<int>(elem.off.size()); ++r) {
    for (int k = elem.off[r]; k < elem.off[r + 1]; ++k)
      for (int i = mesh.conn.off[elem.item[k]]; i < mesh.conn.off[elem.item[k] + 1]; ++i) {
        const int n = mesh.conn.item[i];
        if (seen[n] == r) continue;
        seen[n] = r;
        out.item.push_back(n);
      }
    std::sort(out.item.begin() + out.off[r], out.item.end());
    out.off.push_back(static_cast<int>(out.item.size()));
  }
  return out;
}

// ranks of each node, ascending
ListTable ranks_of_nodes(int nnode, const OfRanks<int>& node)
{
  ListTable out;
  out.off.assign(nnode + 1, 0);
  for (int n : node.item) ++out.off[n + 1];
  std::partial_sum(out.off.begin(), out.off.end(), out.off.begin());
  out.item.resize(node.item.size());
  IntVec next(out.off);
  for (int r = 0; r + 1 < static_cast<int>(node.off.size()); ++r)
    for (int k = node.off[r]; k < node.off[r + 1]; ++k) out.item[next[node.item[k]]++] = r;
  return out;
}

IntVec items(const OfRanks<int>& all, int r)
{
  return IntVec(all.item.begin() + all.off[r], all.item.begin() + all.off[r + 1]);
}

IntVec items(const OfRanks<int>& all, int r, const IntVec& index)
{
  IntVec out = items(all, r);
  for (int& k : out) k = index[k];
  return out;
}

Mesh cut_mesh(const Mesh& old, const MeshPart& part, const IntVec& node_index)
{
  Mesh mesh;
  std::size_t corners = 0;
  for (int e : part.elem) corners += static_cast<std::size_t>(old.conn.count(e));
  mesh.X.reserve(3 * part.node.size());
  mesh.conn.item.reserve(corners);
  mesh.conn.off.reserve(part.elem.size() + 1);
  for (int n : part.node) {
    const double* x = &old.X[3 * static_cast<std::size_t>(n)];
    mesh.X.insert(mesh.X.end(), x, x + 3);
  }
  for (int e : part.elem) {
    for (int i = old.conn.off[e]; i < old.conn.off[e + 1]; ++i)
      mesh.conn.item.push_back(node_index[old.conn.item[i]]);
    mesh.conn.off.push_back(static_cast<int>(mesh.conn.item.size()));
  }
  const auto pick = [](const IntVec& from, const IntVec& which) {
    IntVec out;
    out.reserve(which.size());
    for (int k : which) out.push_back(from[k]);
    return out;
  };
  mesh.node_label   = pick(old.node_label, part.node);
  mesh.elem_label   = pick(old.elem_label, part.elem);
  mesh.elem_type    = pick(old.elem_type, part.elem);
  mesh.elem_section = pick(old.elem_section, part.elem);
  return mesh;
}

}  // namespace

ModelCut model_cut_open(Model& whole, const IntVec& rank, int ranks)
{
  ModelCut c;
  const auto of_elem = [&](int e) { return std::make_pair(&rank[e], &rank[e] + 1); };
  c.rest = std::move(whole);
  whole  = Model();
  std::swap(c.mesh, c.rest.mesh);
  IntVec all(c.mesh.nelem());
  std::iota(all.begin(), all.end(), 0);
  c.elem = divide(all, ranks, of_elem);
  c.node = nodes_of(c.mesh, c.elem);
  const ListTable near = ranks_of_nodes(c.mesh.nnode(), c.node);
  const auto of_node   = [&](int n) { return std::make_pair(near.begin(n), near.begin(n + 1)); };
  const Lists lists    = lists_of(c.rest);
  for (IntVec* list : lists.node) c.node_list.push_back(divide(*list, ranks, of_node));
  for (IntVec* list : lists.elem) c.elem_list.push_back(divide(*list, ranks, of_elem));
  for (std::vector<Face>* list : lists.face)
    c.face_list.push_back(divide(*list, ranks, [&](const Face& f) { return of_elem(f.elem); }));
  c.elem_index.resize(c.mesh.nelem());
  c.node_index.resize(c.mesh.nnode());
  return c;
}

Model model_cut_piece(ModelCut& c, int r)
{
  Model m = c.rest;
  m.part.on    = true;
  m.part.nnode = c.mesh.nnode();
  m.part.nelem = c.mesh.nelem();
  m.part.node  = items(c.node, r);
  m.part.elem  = items(c.elem, r);
  for (std::size_t k = 0; k < m.part.node.size(); ++k) c.node_index[m.part.node[k]] = static_cast<int>(k);
  for (std::size_t k = 0; k < m.part.elem.size(); ++k) c.elem_index[m.part.elem[k]] = static_cast<int>(k);
  m.mesh = cut_mesh(c.mesh, m.part, c.node_index);
  const Lists lists = lists_of(m);
  for (std::size_t k = 0; k < lists.node.size(); ++k)
    *lists.node[k] = items(c.node_list[k], r, c.node_index);
  for (std::size_t k = 0; k < lists.elem.size(); ++k)
    *lists.elem[k] = items(c.elem_list[k], r, c.elem_index);
  for (std::size_t k = 0; k < lists.face.size(); ++k) {
    const OfRanks<Face>& all = c.face_list[k];
    for (int i = all.off[r]; i < all.off[r + 1]; ++i)
      lists.face[k]->push_back({c.elem_index[all.item[i].elem], all.item[i].face});
  }
  return m;
}

// ---------------------------------------------------------------------------
// model_cut_close : which nodes other ranks have too. A load at a node counts once, on the rank that the node
// belongs to; all other things go with their element.
// ---------------------------------------------------------------------------
void model_cut_close(Model& m)
{
  const MeshPart& part = m.part;
  halo_form(std::vector<long>(part.node.begin(), part.node.end()), m.part.halo);
  for (Step& s : m.step)
    for (Load& l : s.load)
      l.node.erase(std::remove_if(l.node.begin(), l.node.end(), [&](int n) { return !part.counts(n); }),
                   l.node.end());
}
