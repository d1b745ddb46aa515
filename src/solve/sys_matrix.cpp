#include "base/log.h"
#include "solve/solve_data.h"

namespace {

// y += A x, D known to the compiler. Blocks off the diagonal act twice, as A_IJ and as its transpose.
template <int D>
void multiply(const SysMatrix& A, const double* x, double* y)
{
  for (int I = 0; I < A.nrow; ++I) {
    double row[D] = {};
    const double* xI = x + I * D;
    const int last   = A.off[I + 1] - 1;
    for (int k = A.off[I]; k < last; ++k) {
      const double* a  = &A.val[static_cast<size_t>(k) * D * D];
      const double* xJ = x + A.col[k] * D;
      double* yJ       = y + A.col[k] * D;
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
          row[i] += a[i * D + j] * xJ[j];
          yJ[j] += a[i * D + j] * xI[i];
        }
    }
    const double* a = &A.val[static_cast<size_t>(last) * D * D];
    for (int i = 0; i < D; ++i) {
      row[i] += a[i * D + i] * xI[i];
      for (int j = 0; j < i; ++j) {
        row[i] += a[i * D + j] * xI[j];
        row[j] += a[i * D + j] * xI[i];
      }
    }
    for (int i = 0; i < D; ++i) y[I * D + i] += row[i];
  }
}

}  // namespace

// ---------------------------------------------------------------------------
// sys_multiply : y = A x
//
//   in   x   [neq]
//   out  y   [neq], another vector than x
// ---------------------------------------------------------------------------
void sys_multiply(const SysMatrix& A, const RealVec& x, RealVec& y)
{
  MPFE_CHECK(&x != &y, "sys_multiply: x and y are one vector");
  y.assign(A.neq(), 0.0);
  switch (A.dim) {
    case 1: return multiply<1>(A, x.data(), y.data());
    case 2: return multiply<2>(A, x.data(), y.data());
    case 3: return multiply<3>(A, x.data(), y.data());
  }
  log_bug("sys_multiply: blocks are 1 x 1, 2 x 2 or 3 x 3", __FILE__, __LINE__);
}

ListTable sys_graph(const SysMatrix& A)
{
  ListTable graph;
  graph.off.assign(A.nrow + 1, 0);
  for (int I = 0; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1] - 1; ++k) {
      ++graph.off[I + 1];
      ++graph.off[A.col[k] + 1];
    }
  for (int I = 0; I < A.nrow; ++I) graph.off[I + 1] += graph.off[I];

  // rows ascend, so that the lower neighbours of a row are in before the upper ones
  graph.item.resize(graph.off[A.nrow]);
  IntVec next(graph.off.begin(), graph.off.end() - 1);
  for (int I = 0; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1] - 1; ++k) {
      graph.item[next[I]++]        = A.col[k];
      graph.item[next[A.col[k]]++] = I;
    }
  return graph;
}
