#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/log.h"
#include "solve/solve_data.h"

#ifdef MPFE_METIS
#include <metis.h>
#endif

namespace {

// equal weights in the order of the rows
IntVec part_in_order(const RealVec& weight, int parts)
{
  double all = 0.0, sum = 0.0;
  for (double w : weight) all += w;
  IntVec part(weight.size());
  for (size_t I = 0; I < weight.size(); ++I) {
    part[I] = std::min(parts - 1, static_cast<int>(parts * (sum + 0.5 * weight[I]) / std::max(all, 1e-300)));
    sum += weight[I];
  }
  return part;
}

}  // namespace

IntVec part_weights(const RealVec& weight)
{
  const double most  = weight.empty() ? 0.0 : *std::max_element(weight.begin(), weight.end());
  const double one   = 1.0 / std::max(most, 1e-300);
  const double all   = one * std::accumulate(weight.begin(), weight.end(), 0.0);
  const double scale = one * std::min(1000.0, 1e9 / std::max(all, 1e-300));
  IntVec out;
  out.reserve(weight.size());
  for (double w : weight) out.push_back(1 + static_cast<int>(std::lround(scale * w)));
  return out;
}

// ---------------------------------------------------------------------------
// part_metis : the rows of A in parts of equal weight with few neighbours between them
//
//   in   weight [nrow]   parts 2 or more
//   out  part of each row [nrow]; the same in every run (fixed seed)
//
// Without METIS, or when it refuses: slices in the order of the rows.
// ---------------------------------------------------------------------------
IntVec part_metis(const SysMatrix& A, const RealVec& weight, int parts)
{
#ifdef MPFE_METIS
  const ListTable graph = sys_graph(A);
  if (A.nrow >= 4 * parts && !graph.item.empty()) {
    const IntVec whole = part_weights(weight);
    std::vector<idx_t> off(graph.off.begin(), graph.off.end()), item(graph.item.begin(), graph.item.end());
    std::vector<idx_t> part(A.nrow), load(whole.begin(), whole.end());
    idx_t n = A.nrow, one = 1, count = parts, cut = 0, option[METIS_NOPTIONS];
    METIS_SetDefaultOptions(option);
    option[METIS_OPTION_NUMBERING] = 0;
    option[METIS_OPTION_SEED]      = 1;
    const int result = METIS_PartGraphKway(&n, &one, off.data(), item.data(), load.data(), nullptr, nullptr,
                                           &count, nullptr, nullptr, option, &cut, part.data());
    if (result == METIS_OK) return IntVec(part.begin(), part.end());
    log_warn("METIS failed to partition the rows (code %d): each rank takes consecutive rows",
             result);
  }
#else
  (void)A;
#endif
  return part_in_order(weight, parts);
}
