#include <algorithm>
#include <numeric>

#include "base/comm.h"
#include "base/gather_lists.h"
#include "base/grow.h"
#include "base/log.h"
#include "solve/solve_data.h"

namespace {

// y += A x. Off-diagonal blocks act twice, as A_IJ and as its transpose. T: type of the values
template <class T>
void multiply_line(const SysMatrix& A, const T* a, const double* x, double* y)
{
  const int *off = A.off.data(), *col = A.col.data(), n = A.nrow;
  for (int I = 0; I < n; ++I) {
    double row = 0.0;
    for (int k = off[I], last = off[I + 1] - 1; k < last; ++k, ++a) {
      row += *a * x[col[k]];
      y[col[k]] += *a * x[I];
    }
    y[I] += row + *a++ * x[I];
  }
}

typedef double Two __attribute__((vector_size(16)));
typedef double TwoAt __attribute__((vector_size(16), aligned(8), may_alias));
typedef float FloatsAt __attribute__((vector_size(8), aligned(4), may_alias));

inline Two two(const double* v) { return *reinterpret_cast<const TwoAt*>(v); }
inline Two two(const float* v)
{
  return __builtin_convertvector(*reinterpret_cast<const FloatsAt*>(v), Two);
}

// the same in 2D: a row of a block is one vector register
template <class T>
void multiply_plane(const SysMatrix& A, const T* a, const double* x, double* y)
{
  const int *off = A.off.data(), *col = A.col.data(), n = A.nrow;
  for (int I = 0; I < n; ++I) {
    const double x0 = x[2 * I], x1 = x[2 * I + 1];
    Two first = {}, second = {};
    for (int k = off[I], last = off[I + 1] - 1; k < last; ++k, a += 4) {
      const int J = 2 * col[k];
      first += two(a) * two(x + J);
      second += two(a + 2) * two(x + J);
      *reinterpret_cast<TwoAt*>(y + J) += two(a) * x0 + two(a + 2) * x1;
    }
    y[2 * I] += first[0] + first[1] + (a[0] * x0 + a[2] * x1);
    y[2 * I + 1] += second[0] + second[1] + (a[2] * x0 + a[3] * x1);
    a += 4;
  }
}

// the same in 3D: two numbers in a register, and one alone
template <class T>
void multiply_space(const SysMatrix& A, const T* a, const double* x, double* y)
{
  const int *off = A.off.data(), *col = A.col.data(), n = A.nrow;
  for (int I = 0; I < n; ++I) {
    const double *xI = x + 3 * I, x0 = xI[0], x1 = xI[1], x2 = xI[2];
    Two s0 = {}, s1 = {}, s2 = {};
    double t0 = 0.0, t1 = 0.0, t2 = 0.0;
    for (int k = off[I], last = off[I + 1] - 1; k < last; ++k, a += 9) {
      const int J = 3 * col[k];
      const Two a0 = two(a), a1 = two(a + 3), a2 = two(a + 6), xJ = two(x + J);
      const double b0 = a[2], b1 = a[5], b2 = a[8], zJ = x[J + 2];
      s0 += a0 * xJ;
      s1 += a1 * xJ;
      s2 += a2 * xJ;
      t0 += b0 * zJ;
      t1 += b1 * zJ;
      t2 += b2 * zJ;
      *reinterpret_cast<TwoAt*>(y + J) += a0 * x0 + a1 * x1 + a2 * x2;
      y[J + 2] += b0 * x0 + b1 * x1 + b2 * x2;
    }
    double* yI = y + 3 * I;
    yI[0] += s0[0] + s0[1] + t0 + (a[0] * x0 + a[3] * x1 + a[6] * x2);
    yI[1] += s1[0] + s1[1] + t1 + (a[3] * x0 + a[4] * x1 + a[7] * x2);
    yI[2] += s2[0] + s2[1] + t2 + (a[6] * x0 + a[7] * x1 + a[8] * x2);
    a += 9;
  }
}

template <class T>
void multiply(const SysMatrix& A, const std::vector<T>& val, const double* x, double* y)
{
  std::fill(y, y + A.neq(), 0.0);
  switch (A.dim) {
    case 1: return multiply_line(A, val.data(), x, y);
    case 2: return multiply_plane(A, val.data(), x, y);
    case 3: return multiply_space(A, val.data(), x, y);
    default: log_bug("sys_multiply: blocks are 1 x 1, 2 x 2 or 3 x 3", __FILE__, __LINE__);
  }
}

}  // namespace

// ---------------------------------------------------------------------------
// sys_multiply : y = A x, with the contribution of this rank to A
//
//   in   x   [neq]
//   out  y   [neq], another vector than x
// ---------------------------------------------------------------------------
void sys_multiply(const SysMatrix& A, const RealVec& x, RealVec& y) { sys_multiply(A, A.val, x, y); }

void sys_multiply(const SysMatrix& A, const RealVec& val, const RealVec& x, RealVec& y)
{
  MPFE_CHECK(&x != &y, "sys_multiply: x and y are one vector");
  y.resize(A.neq());
  multiply(A, val, x.data(), y.data());
}

void sys_multiply(const SysMatrix& A, const std::vector<float>& val, const double* x, double* y)
{
  multiply(A, val, x, y);
}

void sys_diagonal(const SysMatrix& A, RealVec& d)
{
  const int D = A.dim;
  d.resize(A.neq());
  for (int I = 0; I < A.nrow; ++I)
    for (int i = 0; i < D; ++i) d[I * D + i] = A.val[(static_cast<size_t>(A.off[I + 1] - 1) * D + i) * D + i];
  sys_sum(A, d);
}

// ---------------------------------------------------------------------------
// sys_sum : sums the contributions to the rows of A, in the order of the ranks
//
//   in   v       [n*nrow]
//   out  v       the sum, on all ranks that have a row; one rank: unchanged
// ---------------------------------------------------------------------------
void sys_sum(const SysMatrix& A, RealVec& v)
{
  if (!sys_shared(A)) return;
  halo_sum(A.halo, A.nrow > 0 ? static_cast<int>(v.size()) / A.nrow : 0, v);
}

// ---------------------------------------------------------------------------
// sys_pattern : lower block triangle, rows sorted, the diagonal last
//
//   in   lists  block rows that an item couples; every row has its diagonal, even without a list
//   out  A      dim, nrow, off, col; val: zeros
// ---------------------------------------------------------------------------
void sys_pattern(const ListTable& lists, int nrow, int dim, SysMatrix& A)
{
  // row -> lists that contain it
  IntVec count(nrow + 1, 0);
  for (int r : lists.item) ++count[r + 1];
  for (int r = 0; r < nrow; ++r) count[r + 1] += count[r];
  IntVec holder(lists.item.size()), next(count.begin(), count.end() - 1);
  for (int l = 0; l < lists.size(); ++l)
    for (int k = lists.off[l]; k < lists.off[l + 1]; ++k) holder[next[lists.item[k]]++] = l;

  RealVec val = std::move(A.val);          // its memory is reused
  const size_t before = A.col.size();
  A      = SysMatrix();
  A.dim  = dim;
  A.nrow = nrow;
  A.off.assign(1, 0);
  A.off.reserve(nrow + 1);
  A.col.reserve(before + before / 16);
  IntVec stamp(nrow, -1);
  for (int r = 0; r < nrow; ++r) {
    const size_t first = A.col.size();
    stamp[r] = r;
    for (int h = count[r]; h < count[r + 1]; ++h)
      for (int k = lists.off[holder[h]]; k < lists.off[holder[h] + 1]; ++k) {
        const int c = lists.item[k];
        if (c >= r || stamp[c] == r) continue;
        stamp[c] = r;
        A.col.push_back(c);
      }
    std::sort(A.col.begin() + static_cast<long>(first), A.col.end());
    A.col.push_back(r);
    A.off.push_back(static_cast<int>(A.col.size()));
  }
  give_back(A.col);
  const size_t numbers = A.col.size() * dim * dim;
  fit_size(val, numbers);
  std::fill(val.begin(), val.end(), 0.0);
  A.val = std::move(val);
}

long sys_rows(const SysMatrix& A)
{
  if (!sys_shared(A)) return A.nrow;
  double owned = static_cast<double>(std::count(A.halo.owner.begin(), A.halo.owner.end(), comm_rank()));
  comm_sum(&owned, 1);
  return static_cast<long>(owned);
}

RowNumbers sys_number(const SysMatrix& A)
{
  RowNumbers n;
  const int ranks = comm_size(), me = comm_rank();
  n.first.assign(ranks + 1, 0);
  const long owned = std::count(A.halo.owner.begin(), A.halo.owner.end(), me);
  const std::vector<long> all = comm_counts(std::vector<long>(ranks, owned));
  for (int r = 0; r < ranks; ++r) n.first[r + 1] = n.first[r] + static_cast<int>(all[r]);
  n.number.resize(A.nrow);
  int next = n.first[me];
  for (int I = 0; I < A.nrow; ++I)
    if (A.halo.owner[I] == me) n.number[I] = next++;
  halo_copy(A.halo, 1, n.number);
  return n;
}

namespace {

// a block of the whole matrix, and its index in the message of a rank
struct Part {
  int col, rank;
  long index;                  // 2 k, block k of the rank; 2 k + 1: transposed
  bool operator<(const Part& b) const
  {
    return col != b.col ? col < b.col : rank != b.rank ? rank < b.rank : index < b.index;
  }
};

// x += block k of a, or its transpose
void add_block(int D, const RealVec& a, long index, double* x)
{
  const double* b = &a[static_cast<size_t>(index / 2) * D * D];
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) x[i * D + j] += index % 2 ? b[j * D + i] : b[i * D + j];
}

// divided model: rows are numbered by sys_number
}  // namespace

// ---------------------------------------------------------------------------
// sys_collect : the whole matrix on rank 0, contributions summed in the order of the ranks
// ---------------------------------------------------------------------------
SysMatrix sys_collect(const SysMatrix& A, bool values)
{
  if (!sys_shared(A)) {
    SysMatrix whole = A;
    if (!values) whole.val.clear();
    return whole;
  }
  const auto to_first = [](auto x) {
    std::vector<decltype(x)> to(comm_size());
    to[0] = std::move(x);
    return comm_exchange(to);
  };
  const RowNumbers numbers = sys_number(A);
  IntVec block_row, block_col;
  for (int I = 0; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1]; ++k) {
      block_row.push_back(numbers.number[I]);
      block_col.push_back(numbers.number[A.col[k]]);
    }
  const std::vector<IntVec> row = to_first(std::move(block_row)), col = to_first(std::move(block_col));
  const std::vector<RealVec> val = to_first(values ? A.val : RealVec());
  SysMatrix whole;
  if (comm_rank() > 0) return whole;
  const int D = A.dim;
  whole.dim  = D;
  whole.nrow = numbers.first.back();
  std::vector<long> next(whole.nrow + 1, 0);
  for (size_t r = 0; r < row.size(); ++r)
    for (size_t k = 0; k < row[r].size(); ++k) ++next[std::max(row[r][k], col[r][k]) + 1];
  std::partial_sum(next.begin(), next.end(), next.begin());
  const std::vector<long> first = next;
  std::vector<Part> part(first.back());
  for (size_t r = 0; r < row.size(); ++r)
    for (size_t k = 0; k < row[r].size(); ++k) {
      const int I = row[r][k], J = col[r][k];
      part[next[std::max(I, J)]++] = {std::min(I, J), static_cast<int>(r),
                                      2 * static_cast<long>(k) + (J > I ? 1 : 0)};
    }
  for (int I = 0; I < whole.nrow; ++I) {
    std::sort(part.begin() + first[I], part.begin() + first[I + 1]);
    for (long k = first[I]; k < first[I + 1]; ++k) {
      if (k == first[I] || part[k].col != part[k - 1].col) whole.col.push_back(part[k].col);
      if (!values) continue;
      whole.val.resize(whole.col.size() * D * D, 0.0);
      add_block(D, val[part[k].rank], part[k].index, &whole.val[(whole.col.size() - 1) * D * D]);
    }
    whole.off.push_back(static_cast<int>(whole.col.size()));
  }
  return whole;
}

ListTable sys_graph(const SysMatrix& A, const std::vector<char>* may)
{
  // rows ascend: the lower neighbours of a row are added before the upper ones
  return gather_lists(A.nrow, [&](auto use) {
    for (int I = 0; I < A.nrow; ++I)
      for (int k = A.off[I]; k < A.off[I + 1] - 1; ++k) {
        if (may && !(*may)[k]) continue;
        use(I, A.col[k]);
        use(A.col[k], I);
      }
  });
}
