#include <algorithm>
#include <numeric>

#include "base/far_first.h"
#include "base/gather_lists.h"
#include "model/model_cut.h"

namespace {

// [nnode] 1: node of elements of several ranks, own or halo
std::vector<char> shared_nodes(const Mesh& mesh, const OfRanks<int>& own, const OfRanks<int>& outer)
{
  std::vector<char> shared(mesh.nnode(), 0);
  IntVec rank(mesh.nnode(), -1);
  for (const OfRanks<int>* list : {&own, &outer})
    for (int r = 0; r + 1 < static_cast<int>(list->off.size()); ++r)
      each_node(mesh, *list, r, [&](int n) {
        shared[n] = shared[n] || (rank[n] >= 0 && rank[n] != r);
        rank[n]   = r;
      });
  return shared;
}

// nodes of the elements of rank r, those far from shared ones first; at [nnode]: scratch, all -1
IntVec far_nodes(const Mesh& mesh, const OfRanks<int>& own, int r, const std::vector<char>& shared,
                 IntVec& at)
{
  IntVec node;
  each_node(mesh, own, r, [&](int n) {
    if (at[n] < 0) node.push_back(n);
    at[n] = 0;
  });
  std::sort(node.begin(), node.end());
  const int count = static_cast<int>(node.size());
  IntVec border, order(count);
  for (int k = 0; k < count; ++k) {
    at[node[k]] = k;
    if (shared[node[k]]) border.push_back(k);
  }
  const ListTable around = gather_lists(count, [&](auto use) {
    for (int k = own.off[r]; k < own.off[r + 1]; ++k)
      for (int i = mesh.conn.off[own.item[k]]; i < mesh.conn.off[own.item[k] + 1]; ++i)
        use(at[mesh.conn.item[i]], own.item[k]);
  });
  std::iota(order.begin(), order.end(), 0);
  far_first(count, border, [&](int k, auto use) {
    for (int j = around.off[k]; j < around.off[k + 1]; ++j)
      for (int i = mesh.conn.off[around.item[j]]; i < mesh.conn.off[around.item[j] + 1]; ++i)
        use(at[mesh.conn.item[i]]);
  }, order);
  for (int n : node) at[n] = -1;
  for (int& k : order) k = node[k];
  return order;
}

template <class T>
void reorder(const IntVec& order, int each, std::vector<T>& x)
{
  std::vector<T> out(x.size());
  for (std::size_t n = 0; n < order.size(); ++n)
    std::copy_n(&x[static_cast<std::size_t>(order[n]) * each], each, &out[n * each]);
  x.swap(out);
}

}  // namespace

// ---------------------------------------------------------------------------
// model_order_nodes : the nodes of the whole model in the order in which ranks eliminate their rows  (8.7)
//
// Rank by rank, nodes far from those of other ranks first. Rows and nodes of a rank then have the same order,
// and its vectors are read contiguously. MeshPart::deck has the deck number of each node.
// ---------------------------------------------------------------------------
void model_order_nodes(const IntVec& rank, const OfRanks<int>& outer, int ranks, Model& m)
{
  Mesh& mesh = m.mesh;
  const ListTable elem = gather_lists(ranks, [&](auto use) {
    for (int e = 0; e < mesh.nelem(); ++e) use(rank[e], e);
  });
  const OfRanks<int> own{elem.off, elem.item};
  const std::vector<char> shared = shared_nodes(mesh, own, outer);
  std::vector<char> taken(mesh.nnode(), 0);
  IntVec order, at(mesh.nnode(), -1), index(mesh.nnode());
  const auto take = [&](int n) {
    if (!taken[n]) order.push_back(n);
    taken[n] = 1;
  };
  for (int r = 0; r < ranks; ++r)
    for (int n : far_nodes(mesh, own, r, shared, at)) take(n);
  for (int n = 0; n < mesh.nnode(); ++n) take(n);    // of no element
  for (int n = 0; n < mesh.nnode(); ++n) index[order[n]] = n;
  reorder(order, 3, mesh.X);
  reorder(order, 1, mesh.node_label);
  for (int& n : mesh.conn.item) n = index[n];
  for (const ModelLists& lists : {model_lists_of_work(m), model_lists_of_all(m)})
    for (IntVec* list : lists.node)
      for (int& n : *list) n = index[n];
  for (Equation& e : m.equation)
    for (EquationTerm& t : e.term) t.node = index[t.node];
  for (Frame& f : m.frame) {
    f.node = index[f.node];
    if (f.twin >= 0) f.twin = index[f.twin];
  }
  for (RigidBody& b : m.rigid) {
    for (int* n : {&b.ref, &b.turn}) *n = index[*n];
    for (int& n : b.node) n = index[n];
  }
  m.part.deck = order;
}
