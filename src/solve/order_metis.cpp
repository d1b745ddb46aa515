#ifdef MPFE_METIS

#include <metis.h>

#include <numeric>

#include "base/log.h"
#include "solve/solve_data.h"

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
  const ListTable graph = sys_graph(A);
  if (graph.item.empty()) return pos;     // METIS wants an edge

  // its integers may be of 64 bits
  std::vector<idx_t> off(graph.off.begin(), graph.off.end());
  std::vector<idx_t> item(graph.item.begin(), graph.item.end());
  std::vector<idx_t> perm(A.nrow), inverse(A.nrow);
  idx_t n = A.nrow;
  idx_t option[METIS_NOPTIONS];
  METIS_SetDefaultOptions(option);
  option[METIS_OPTION_NUMBERING] = 0;
  option[METIS_OPTION_SEED]      = 1;

  const int result = METIS_NodeND(&n, off.data(), item.data(), nullptr, option, perm.data(), inverse.data());
  if (result == METIS_OK)
    pos.assign(inverse.begin(), inverse.end());
  else
    log_warn("METIS failed to order the equations (code %d): their order is kept, factorisation may be slow",
             result);
  return pos;
}

#endif
