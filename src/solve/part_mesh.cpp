#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/log.h"
#include "base/part_points.h"
#include "solve/solve.h"

#ifdef MPFE_METIS
#include <metis.h>
#endif

namespace {

IntVec part_by_coordinates(const Mesh& mesh, const std::vector<RealVec>& work, int parts)
{
  RealVec X(3 * static_cast<size_t>(mesh.nelem()), 0.0);
  for (int e = 0; e < mesh.nelem(); ++e)
    for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1]; ++k)
      for (int i = 0; i < 3; ++i)
        X[3 * static_cast<size_t>(e) + i] += mesh.X[3 * mesh.conn.item[k] + i] / mesh.conn.count(e);
  return work.size() == 1 ? part_points(X, work[0], parts) : part_planes(X, work, parts);
}

#ifdef MPFE_METIS
// number of nodes shared by elements of several parts
int shared_nodes(const Mesh& mesh, const IntVec& part)
{
  return part_shared(mesh.nnode(), [&](auto use) {
    for (int e = 0; e < mesh.nelem(); ++e)
      for (int k = mesh.conn.off[e]; k < mesh.conn.off[e + 1]; ++k) use(mesh.conn.item[k], part[e]);
  });
}

// cost of a partition relative to an ideal one: with several kinds of work, the largest part
// of each kind; and shared nodes
double surplus(const Mesh& mesh, const std::vector<RealVec>& work, int parts, const IntVec& part)
{
  double largest = 0.0, all = 0.0;
  for (const RealVec& kind : work) {
    RealVec load(parts, 0.0);
    for (size_t e = 0; e < kind.size(); ++e) load[part[e]] += kind[e];
    largest += *std::max_element(load.begin(), load.end());
    all += std::accumulate(load.begin(), load.end(), 0.0);
  }
  const double shared = static_cast<double>(shared_nodes(mesh, part)) * parts / mesh.nnode();
  return (work.size() > 1 ? largest * parts / all : 0.0) + shared;
}

struct DualGraph {             // METIS frees it
  idx_t *off = nullptr, *item = nullptr;
  DualGraph() = default;
  DualGraph(const DualGraph&) = delete;
  DualGraph& operator=(const DualGraph&) = delete;
  ~DualGraph()
  {
    METIS_Free(off);
    METIS_Free(item);
  }
};

// elements with at least common_nodes common nodes are neighbours; the copy of the mesh is freed on return
int dual_graph(const Mesh& mesh, int common_nodes, DualGraph& graph)
{
  std::vector<idx_t> off(mesh.conn.off.begin(), mesh.conn.off.end()),
      item(mesh.conn.item.begin(), mesh.conn.item.end());
  idx_t n = mesh.nelem(), nodes = mesh.nnode(), common = common_nodes, numbering = 0;
  return METIS_MeshToDual(&n, &nodes, off.data(), item.data(), &common, &numbering, &graph.off, &graph.item);
}

// A cut through elements with more work costs more: rows and points at the cut exist twice. The sum of the
// weights fits into 32 bits
std::vector<idx_t> edge_weights(const DualGraph& graph, const std::vector<RealVec>& work)
{
  const idx_t n = static_cast<idx_t>(work[0].size());
  const IntVec whole = part_weights(part_sums(work));
  double sum = 0.0;
  for (idx_t e = 0; e < n; ++e) sum += 2.0 * whole[e] * static_cast<double>(graph.off[e + 1] - graph.off[e]);
  const double scale = std::min(1.0, 1e9 / sum);
  std::vector<idx_t> edge(graph.off[n]);
  for (idx_t e = 0; e < n; ++e)
    for (idx_t k = graph.off[e]; k < graph.off[e + 1]; ++k)
      edge[k] = std::max<idx_t>(1, static_cast<idx_t>(scale * (whole[e] + whole[graph.item[k]])));
  return edge;
}
#endif

}  // namespace

IntVec part_weights(const RealVec& weight)
{
  const double top   = weight.empty() ? 0.0 : *std::max_element(weight.begin(), weight.end());
  const double one   = 1.0 / std::max(top, 1e-300);
  const double all   = one * std::accumulate(weight.begin(), weight.end(), 0.0);
  const double scale = one * std::min(1000.0, 1e9 / std::max(all, 1e-300));
  IntVec out;
  out.reserve(weight.size());
  for (double w : weight) out.push_back(1 + static_cast<int>(std::lround(scale * w)));
  return out;
}

// ---------------------------------------------------------------------------
// part_mesh : divides the elements of a mesh into parts of equal work with few common nodes
//
//   in   work [kinds][nelem], no kind all zero;   parts 2 or more
//        dim: elements with this many common nodes are neighbours
//   out  part of each element; the same in every run (fixed seed)
//
// METIS, or bisection by coordinates if that has fewer common nodes: straight cuts through regular meshes.
// ---------------------------------------------------------------------------
IntVec part_mesh(const Mesh& mesh, int dim, const std::vector<RealVec>& work, int parts)
{
  const IntVec straight = part_by_coordinates(mesh, work, parts);
#ifdef MPFE_METIS
  DualGraph graph;
  int result = dual_graph(mesh, dim, graph);
  if (result == METIS_OK) {
    idx_t n = mesh.nelem(), kinds = static_cast<idx_t>(work.size()), count = parts, cut = 0,
          option[METIS_NOPTIONS];
    std::vector<idx_t> part(n), load(static_cast<size_t>(n) * kinds);
    for (idx_t k = 0; k < kinds; ++k) {
      const IntVec whole = part_weights(work[k]);
      for (idx_t e = 0; e < n; ++e) load[static_cast<size_t>(e) * kinds + k] = whole[e];
    }
    // two parts have one cut, whose preconditioner matters most: P9 on two ranks 95.7 s, 97.6 with weights
    std::vector<idx_t> edge = kinds > 1 && parts > 2 ? edge_weights(graph, work) : std::vector<idx_t>();
    METIS_SetDefaultOptions(option);
    option[METIS_OPTION_NUMBERING] = 0;
    option[METIS_OPTION_SEED]      = 1;
    option[METIS_OPTION_UFACTOR]   = 10;             // the largest part at most 1.01 of the mean
    option[METIS_OPTION_NCUTS]     = kinds > 1 ? 4 : 1;      // the best of 4: with two kinds they differ
    // bisection balances a small number of parts better
    result = (parts > 8 ? METIS_PartGraphKway : METIS_PartGraphRecursive)(
        &n, &kinds, graph.off, graph.item, load.data(), nullptr, edge.empty() ? nullptr : edge.data(), &count,
        nullptr, nullptr, option, &cut, part.data());
    const IntVec found(part.begin(), part.end());
    if (result == METIS_OK)
      return surplus(mesh, work, parts, straight) <= surplus(mesh, work, parts, found) ? straight : found;
  }
  log_warn("METIS failed to partition the mesh (code %d): it is divided by coordinates", result);
#else
  (void)dim;
#endif
  return straight;
}
