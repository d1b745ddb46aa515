#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/log.h"
#include "base/part_places.h"
#include "solve/solve_data.h"

#ifdef MPFE_METIS
#include <metis.h>
#endif

namespace {

// equal weights in the order of the rows
IntVec part_in_order(const std::vector<RealVec>& weight, int parts)
{
  const RealVec sums = part_sums(weight);
  const size_t n     = sums.size();
  const double all   = std::accumulate(sums.begin(), sums.end(), 0.0);
  double sum = 0.0;
  IntVec part(n);
  for (size_t r = 0; r < n; ++r) {
    part[r] = std::min(parts - 1, static_cast<int>(parts * (sum + 0.5 * sums[r]) / std::max(all, 1e-300)));
    sum += sums[r];
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
//   in   weight [kinds][nrow]: parts have as much of each kind; none of them is all zero    parts 2 or more
//   out  part of each row [nrow]; the same in every run (fixed seed)
//
// Without METIS, or when it refuses: slices in the order of the rows.
// ---------------------------------------------------------------------------
IntVec part_metis(const SysMatrix& A, const std::vector<RealVec>& weight, int parts)
{
#ifdef MPFE_METIS
  const ListTable graph = sys_graph(A);
  if (A.nrow >= 4 * parts && !graph.item.empty()) {
    std::vector<idx_t> off(graph.off.begin(), graph.off.end()), item(graph.item.begin(), graph.item.end());
    std::vector<idx_t> part(A.nrow), load(weight.size() * A.nrow);
    for (size_t k = 0; k < weight.size(); ++k) {
      const IntVec whole = part_weights(weight[k]);
      for (int r = 0; r < A.nrow; ++r) load[r * weight.size() + k] = whole[r];
    }
    idx_t n = A.nrow, kinds = static_cast<idx_t>(weight.size()), count = parts, cut = 0,
          option[METIS_NOPTIONS];
    METIS_SetDefaultOptions(option);
    option[METIS_OPTION_NUMBERING] = 0;
    option[METIS_OPTION_SEED]      = 1;
    const int result = METIS_PartGraphKway(&n, &kinds, off.data(), item.data(), load.data(), nullptr, nullptr,
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
