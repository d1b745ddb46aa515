#include <algorithm>
#include <set>
#include <utility>

#include "base/comm.h"
#include "model/model_cut.h"

namespace {

// ---- elements that all ranks get (model_grow); numbers are those of the mesh that was divided ----

struct GivenElem { int number, label, type, section, rank, nodes; };
struct GivenNode { int number, deck, label; double X[3]; };
struct GivenItem { int list, number, what; };       // what: face, or place in the set

struct Gift {
  std::vector<GivenElem> elem;
  IntVec conn;                 // nodes of one element after the other
  std::vector<GivenNode> node;
  std::vector<GivenItem> of_node, of_elem, of_face, of_member;         // where they stand in the lists
};

Gift pack(const Model& m, const IntVec& give, const ModelLists& lists)
{
  const MeshPart& part = m.part;
  const Mesh& mesh     = m.mesh;
  Gift g;
  std::vector<char> node(mesh.nnode(), 0), elem(mesh.nelem(), 0);
  for (int e : give) {
    elem[e] = 1;
    g.elem.push_back({part.elem[e], mesh.elem_label[e], mesh.elem_type[e], mesh.elem_section[e], part.rank[e],
                      mesh.conn.count(e)});
    for (int i = mesh.conn.off[e]; i < mesh.conn.off[e + 1]; ++i) {
      g.conn.push_back(part.node[mesh.conn.item[i]]);
      node[mesh.conn.item[i]] = 1;
    }
  }
  for (int n = 0; n < mesh.nnode(); ++n) {
    const double* X = &mesh.X[3 * static_cast<std::size_t>(n)];
    if (node[n]) g.node.push_back({part.node[n], part.deck[n], mesh.node_label[n], {X[0], X[1], X[2]}});
  }
  const auto each = [](const auto& of, auto use) {
    for (std::size_t k = 0; k < of.size(); ++k)
      for (const auto& x : *of[k]) use(static_cast<int>(k), x);
  };
  each(lists.node, [&](int k, int n) { if (node[n]) g.of_node.push_back({k, part.node[n], 0}); });
  each(lists.elem, [&](int k, int e) { if (elem[e]) g.of_elem.push_back({k, part.elem[e], 0}); });
  each(lists.face, [&](int k, const Face& f) {
    if (elem[f.elem]) g.of_face.push_back({k, part.elem[f.elem], f.face});
  });
  each(lists.member, [&](int k, const Member& x) {
    if (elem[x.elem]) g.of_member.push_back({k, part.elem[x.elem], x.at});
  });
  return g;
}

void exchange(Gift& g)
{
  comm_allgatherv(g.elem);
  comm_allgatherv(g.conn);
  comm_allgatherv(g.node);
  for (auto* list : {&g.of_node, &g.of_elem, &g.of_face, &g.of_member}) comm_allgatherv(*list);
}

IntVec fresh_elems(const MeshPart& part, const Gift& g)
{
  IntVec out;
  for (const GivenElem& e : g.elem)
    if (part.elem_here(e.number) < 0) out.push_back(e.number);
  std::sort(out.begin(), out.end());
  return out;
}

IntVec fresh_nodes(const MeshPart& part, const Gift& g)
{
  IntVec out;
  for (const GivenNode& n : g.node)
    if (part.node_here(n.number) < 0) out.push_back(n.number);
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

// ascending lists become one; place: where those of the first one are then. turns: a list begins with the
// first of old, and the smaller ones follow the largest
IntVec join(const IntVec& old, const IntVec& fresh, bool turns, IntVec& place)
{
  IntVec all = old;
  all.insert(all.end(), fresh.begin(), fresh.end());
  std::sort(all.begin(), all.end());
  if (turns && !old.empty())
    std::rotate(all.begin(), std::lower_bound(all.begin(), all.end(), old.front()), all.end());
  std::size_t k = 0;
  place.clear();
  for (int number : old) {
    while (all[k] != number) ++k;
    place.push_back(static_cast<int>(k));
  }
  return all;
}

template <class T>
std::vector<T> moved(const std::vector<T>& old, const IntVec& place, std::size_t n, T none)
{
  std::vector<T> out(n, none);
  for (std::size_t k = 0; k < place.size(); ++k) out[place[k]] = old[k];
  return out;
}

// part: nodes and elements of now
Mesh grown_mesh(const Mesh& old, const ModelGrowth& g, const MeshPart& part, const Gift& gift)
{
  const std::size_t nelem = part.elem.size(), nnode = part.node.size();
  Mesh mesh;
  mesh.node_label   = moved(old.node_label, g.node, nnode, 0);
  mesh.elem_label   = moved(old.elem_label, g.elem, nelem, 0);
  mesh.elem_type    = moved(old.elem_type, g.elem, nelem, 0);
  mesh.elem_section = moved(old.elem_section, g.elem, nelem, -1);
  mesh.X.resize(3 * nnode);
  for (std::size_t n = 0; n < g.node.size(); ++n) std::copy_n(&old.X[3 * n], 3, &mesh.X[3 * g.node[n]]);
  for (const GivenNode& n : gift.node) {
    const int here = part.node_here(n.number);
    mesh.node_label[here] = n.label;
    std::copy_n(n.X, 3, &mesh.X[3 * static_cast<std::size_t>(here)]);
  }
  std::vector<IntVec> conn(nelem);
  for (std::size_t e = 0; e < g.elem.size(); ++e)
    for (int i = old.conn.off[e]; i < old.conn.off[e + 1]; ++i)
      conn[g.elem[e]].push_back(g.node[old.conn.item[i]]);
  const int* node = gift.conn.data();
  for (const GivenElem& e : gift.elem) {
    const int here = part.elem_here(e.number);
    mesh.elem_label[here]   = e.label;
    mesh.elem_type[here]    = e.type;
    mesh.elem_section[here] = e.section;
    conn[here].clear();
    for (int i = 0; i < e.nodes; ++i) conn[here].push_back(part.node_here(*node++));
  }
  for (const IntVec& list : conn) {
    mesh.conn.item.insert(mesh.conn.item.end(), list.begin(), list.end());
    mesh.conn.off.push_back(static_cast<int>(mesh.conn.item.size()));
  }
  return mesh;
}

void renumber_lists(const ModelGrowth& g, const ModelLists& lists)
{
  for (IntVec* list : lists.node)
    for (int& n : *list) n = g.node[n];
  for (IntVec* list : lists.elem)
    for (int& e : *list) e = g.elem[e];
  for (std::vector<Face>* list : lists.face)
    for (Face& f : *list) f.elem = g.elem[f.elem];
  for (std::vector<Member>* list : lists.member)
    for (Member& x : *list) x.elem = g.elem[x.elem];
}

void renumber_equations(const ModelGrowth& g, Model& m)
{
  for (Equation& e : m.equation)
    for (EquationTerm& t : e.term) t.node = g.node[t.node];
}

// what was not here before stands in the lists as it does on the ranks that gave it
void add_members(const Gift& gift, const MeshPart& before, const MeshPart& part, const ModelLists& lists)
{
  std::set<std::pair<int, int>> known;               // several ranks give a node
  for (const GivenItem& x : gift.of_node)
    if (before.node_here(x.number) < 0 && known.insert({x.list, x.number}).second)
      lists.node[x.list]->push_back(part.node_here(x.number));
  const auto each = [&](const std::vector<GivenItem>& of, auto use) {
    for (const GivenItem& x : of)
      if (before.elem_here(x.number) < 0) use(x, part.elem_here(x.number));
  };
  each(gift.of_elem, [&](const GivenItem& x, int e) { lists.elem[x.list]->push_back(e); });
  each(gift.of_face, [&](const GivenItem& x, int e) { lists.face[x.list]->push_back({e, x.what}); });
  each(gift.of_member, [&](const GivenItem& x, int e) { lists.member[x.list]->push_back({e, x.what}); });
  for (IntVec* list : lists.elem) std::sort(list->begin(), list->end());
  for (std::vector<Member>* list : lists.member)
    std::sort(list->begin(), list->end(), [](const Member& a, const Member& b) { return a.at < b.at; });
}

}  // namespace

// ---------------------------------------------------------------------------
// model_grow : pieces get elements of others                                               doc/theory.md 5.1
//
// The order stays, so that what goes by indices goes as it would with the whole model.
// ---------------------------------------------------------------------------
ModelGrowth model_grow(const IntVec& give, const IntVec& gone, Model& m)
{
  MeshPart& part = m.part;
  const ModelLists lists = model_lists_of_all(m);
  Gift gift = pack(m, give, lists);
  for (int e : give) part.given[e] = 1;
  exchange(gift);
  ModelGrowth g;
  const IntVec elem = join(part.elem, fresh_elems(part, gift), false, g.elem),
               node = join(part.node, fresh_nodes(part, gift), true, g.node);
  const MeshPart before = part;
  part.elem = elem;
  part.node = node;
  part.deck = moved(before.deck, g.node, node.size(), -1);
  for (const GivenNode& n : gift.node) part.deck[part.node_here(n.number)] = n.deck;
  part.rank = moved(before.rank, g.elem, elem.size(), -1);
  part.given = moved(before.given, g.elem, elem.size(), '\1');
  m.mesh = grown_mesh(m.mesh, g, part, gift);
  for (const GivenElem& e : gift.elem) {
    part.rank[part.elem_here(e.number)]  = e.rank;
    part.given[part.elem_here(e.number)] = 1;
  }
  for (const ModelLists& l : {model_lists_of_work(m), model_lists_of_all(m)}) renumber_lists(g, l);
  renumber_equations(g, m);
  add_members(gift, before, part, model_lists_of_all(m));
  ++part.grown;
  model_find_common(moved(gone, g.elem, elem.size(), 0), m);
  return g;
}
