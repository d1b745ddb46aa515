#include <algorithm>

#include "solve/solve_data.h"

namespace {

// Breadth-first levels from root. order receives the rows visited, neighbours by increasing degree;
// returns the number of levels, and in last the start of the last level in order.
// mark[n] == stamp: visited in this search; rows with mark DONE belong to finished parts.
const int DONE = -2;

int levels_from(int root, const ListTable& graph, int stamp, IntVec& mark, IntVec& order, size_t& last)
{
  order.assign(1, root);
  mark[root] = stamp;
  int levels = 0;
  for (size_t begin = 0; begin < order.size(); ++levels) {
    last             = begin;
    const size_t end = order.size();
    for (; begin < end; ++begin) {
      const int I       = order[begin];
      const size_t from = order.size();
      for (const int* J = graph.begin(I); J != graph.begin(I) + graph.count(I); ++J)
        if (mark[*J] != stamp && mark[*J] != DONE) {
          mark[*J] = stamp;
          order.push_back(*J);
        }
      std::sort(order.begin() + from, order.end(), [&](int a, int b) {
        return graph.count(a) != graph.count(b) ? graph.count(a) < graph.count(b) : a < b;
      });
    }
  }
  return levels;
}

}  // namespace

// ---------------------------------------------------------------------------
// order_rcm : reverse Cuthill-McKee on the block graph
//
//   returns  new position of each block row [nrow]
//
// Each connected part starts from a pseudo-peripheral row (George and Liu 1979):
// move to the row of least degree in the last level as long as the number of levels grows.
// ---------------------------------------------------------------------------
IntVec order_rcm(const SysMatrix& A)
{
  const ListTable graph = sys_graph(A);
  IntVec mark(A.nrow, -1), order, part, pos(A.nrow);
  order.reserve(A.nrow);
  int stamp = 0;
  for (int I = 0; I < A.nrow; ++I) {
    if (mark[I] == DONE) continue;
    // 1. pseudo-peripheral row of the part that holds I
    size_t last = 0;
    int root    = I;
    int levels  = levels_from(root, graph, stamp++, mark, part, last);
    for (bool better = true; better;) {
      const int far = *std::min_element(part.begin() + last, part.end(),
                                        [&](int a, int b) { return graph.count(a) < graph.count(b); });
      const int trial = levels_from(far, graph, stamp++, mark, part, last);
      better          = trial > levels;
      if (better || trial == levels) root = far;
      levels = trial;
    }
    // 2. Cuthill-McKee from there
    levels_from(root, graph, stamp++, mark, part, last);
    for (int J : part) mark[J] = DONE;
    order.insert(order.end(), part.begin(), part.end());
  }
  // 3. reverse
  for (int k = 0; k < A.nrow; ++k) pos[order[k]] = A.nrow - 1 - k;
  return pos;
}
