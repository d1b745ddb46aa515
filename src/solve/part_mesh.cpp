#include <algorithm>
#include <numeric>

#include "base/log.h"
#include "solve/solve.h"

#ifdef MPFE_METIS
#include <metis.h>
#endif

namespace {

// halves of equal work across the longest side, again and again
void bisect(const RealVec& X, const RealVec& work, int* begin, int* end, int first, int parts, IntVec& part)
{
  if (parts == 1 || end - begin < 2) {
    for (int* e = begin; e != end; ++e) part[*e] = first;
    return;
  }
  double lo[3] = {1e300, 1e300, 1e300}, hi[3] = {-1e300, -1e300, -1e300}, all = 0.0, sum = 0.0;
  for (const int* e = begin; e != end; ++e) {
    all += work[*e];
    for (int i = 0; i < 3; ++i) {
      lo[i] = std::min(lo[i], X[3 * *e + i]);
      hi[i] = std::max(hi[i], X[3 * *e + i]);
    }
  }
  int side = 0;
  for (int i = 1; i < 3; ++i)
    if (hi[i] - lo[i] > hi[side] - lo[side]) side = i;
  std::sort(begin, end, [&](int a, int b) {
    const double xa = X[3 * a + side], xb = X[3 * b + side];
    return xa != xb ? xa < xb : a < b;
  });
  const int left = parts / 2;
  int* middle = begin;
  while (middle != end && sum < all * left / parts) sum += work[*middle++];
  bisect(X, work, begin, middle, first, left, part);
  bisect(X, work, middle, end, first + left, parts - left, part);
}

IntVec part_by_place(const Mesh& mesh, const RealVec& work, int parts)
{
  RealVec X(3 * static_cast<size_t>(mesh.nelem()), 0.0);
  for (int e = 0; e < mesh.nelem(); ++e)
    for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1]; ++k)
      for (int i = 0; i < 3; ++i)
        X[3 * static_cast<size_t>(e) + i] += mesh.X[3 * mesh.conn.item[k] + i] / mesh.conn.count(e);
  IntVec order(mesh.nelem()), part(mesh.nelem(), 0);
  std::iota(order.begin(), order.end(), 0);
  bisect(X, work, order.data(), order.data() + order.size(), 0, parts, part);
  return part;
}

#ifdef MPFE_METIS
struct DualGraph {             // METIS frees it
  idx_t *off = nullptr, *near = nullptr;
  DualGraph() = default;
  DualGraph(const DualGraph&) = delete;
  DualGraph& operator=(const DualGraph&) = delete;
  ~DualGraph()
  {
    METIS_Free(off);
    METIS_Free(near);
  }
};

// elements with so many common nodes are neighbours; the copy of the mesh goes before the graph is divided
int dual_graph(const Mesh& mesh, int common_nodes, DualGraph& graph)
{
  std::vector<idx_t> off(mesh.conn.off.begin(), mesh.conn.off.end()),
      item(mesh.conn.item.begin(), mesh.conn.item.end());
  idx_t n = mesh.nelem(), nodes = mesh.nnode(), common = common_nodes, numbering = 0;
  return METIS_MeshToDual(&n, &nodes, off.data(), item.data(), &common, &numbering, &graph.off, &graph.near);
}
#endif

}  // namespace

// ---------------------------------------------------------------------------
// part_mesh : the elements of a mesh in parts of equal work with few common nodes
//
//   in   work [nelem]   parts 2 or more;   dim: elements with so many common nodes are neighbours
//   out  part of each element; the same in every run (fixed seed)
//
// Without METIS, or when it refuses: bisection by coordinates.
// ---------------------------------------------------------------------------
IntVec part_mesh(const Mesh& mesh, int dim, const RealVec& work, int parts)
{
#ifdef MPFE_METIS
  DualGraph graph;
  int result = dual_graph(mesh, dim, graph);
  if (result == METIS_OK) {
    const IntVec whole = part_weights(work);
    std::vector<idx_t> part(mesh.nelem()), load(whole.begin(), whole.end());
    idx_t n = mesh.nelem(), one = 1, count = parts, cut = 0, option[METIS_NOPTIONS];
    METIS_SetDefaultOptions(option);
    option[METIS_OPTION_NUMBERING] = 0;
    option[METIS_OPTION_SEED]      = 1;
    option[METIS_OPTION_UFACTOR]   = 10;             // the largest part at most 1.01 of the mean
    // bisection balances few parts better
    result = (parts > 8 ? METIS_PartGraphKway : METIS_PartGraphRecursive)(
        &n, &one, graph.off, graph.near, load.data(), nullptr, nullptr, &count, nullptr, nullptr, option,
        &cut, part.data());
    if (result == METIS_OK) return IntVec(part.begin(), part.end());
  }
  log_warn("METIS failed to partition the mesh (code %d): it is divided by coordinates", result);
#else
  (void)dim;
#endif
  return part_by_place(mesh, work, parts);
}
