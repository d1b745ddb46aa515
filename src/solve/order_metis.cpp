#include "base/log.h"
#include "solve/solve_data.h"

#ifdef MPFE_METIS

#include <metis.h>

#include <cmath>
#include <numeric>

namespace {

// lower bound of the operations of a factorisation over those of its first separator: cubes 20,
// plates 50, beams 1000 (theory 8.3)  (no test)
const double SEPARATORS = 16.0;

// graph of the block rows; the integers of METIS may have 64 bits
struct MetisGraph {
  explicit MetisGraph(const SysMatrix& A) : n(A.nrow)
  {
    const ListTable graph = sys_graph(A);
    off.assign(graph.off.begin(), graph.off.end());
    item.assign(graph.item.begin(), graph.item.end());
    METIS_SetDefaultOptions(option);
    option[METIS_OPTION_NUMBERING] = 0;
    option[METIS_OPTION_SEED]      = 1;
  }
  idx_t n;
  std::vector<idx_t> off, item;
  idx_t option[METIS_NOPTIONS];
};

}  // namespace

// ---------------------------------------------------------------------------
// order_metis : nested dissection of the block graph by METIS
//
//   returns  new position of each block row [nrow]; the same in every run (fixed seed)
//
// A graph that METIS refuses keeps its order, with a warning.
// ---------------------------------------------------------------------------
IntVec order_metis(const SysMatrix& A)
{
  IntVec pos(A.nrow);
  std::iota(pos.begin(), pos.end(), 0);
  MetisGraph g(A);
  if (g.item.empty()) return pos;         // METIS needs an edge
  std::vector<idx_t> perm(A.nrow), inverse(A.nrow);
  const int result = METIS_NodeND(&g.n, g.off.data(), g.item.data(), nullptr, g.option, perm.data(),
                                  inverse.data());
  if (result == METIS_OK)
    pos.assign(inverse.begin(), inverse.end());
  else
    log_warn("METIS failed to order the equations (code %d): their order is kept, factorisation may be slow",
             result);
  return pos;
}

// two ranks: their border is a separator
double order_least(const SysMatrix& A)
{
  const bool shared = sys_shared(A);
  const auto least_of = [&](double rows) { return SEPARATORS / 3.0 * std::pow(rows * A.dim, 3); };
  if (shared && comm_size() == 2) return least_of(static_cast<double>(A.halo.shared.size()));
  const SysMatrix whole = shared ? sys_collect(A, false) : SysMatrix();
  double least = 0.0;
  if (comm_rank() == 0) {
    MetisGraph g(shared ? whole : A);
    std::vector<idx_t> part(g.n);
    idx_t rows = 0;
    if (!g.item.empty() && METIS_ComputeVertexSeparator(&g.n, g.off.data(), g.item.data(), nullptr, g.option,
                                                        &rows, part.data()) == METIS_OK)
      least = least_of(static_cast<double>(rows));
  }
  comm_bcast(&least, 1);
  return least;
}

#else

double order_least(const SysMatrix&) { return 0.0; }

#endif
