#include <algorithm>
#include <numeric>

#include "base/comm.h"
#include "base/log.h"
#include "solve/solve_data.h"

namespace {

// y += A x, D known to the compiler. Blocks off the diagonal act twice, as A_IJ and as its transpose.
template <int D>
void multiply(const SysMatrix& A, const RealVec& val, const double* x, double* y)
{
  for (int I = 0; I < A.nrow; ++I) {
    double row[D] = {};
    const double* xI = x + I * D;
    const int last   = A.off[I + 1] - 1;
    for (int k = A.off[I]; k < last; ++k) {
      const double* a  = &val[static_cast<size_t>(k) * D * D];
      const double* xJ = x + A.col[k] * D;
      double* yJ       = y + A.col[k] * D;
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
          row[i] += a[i * D + j] * xJ[j];
          yJ[j] += a[i * D + j] * xI[i];
        }
    }
    const double* a = &val[static_cast<size_t>(last) * D * D];
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
// sys_multiply : y = A x, A as it is on this rank
//
//   in   x   [neq]
//   out  y   [neq], another vector than x
// ---------------------------------------------------------------------------
void sys_multiply(const SysMatrix& A, const RealVec& x, RealVec& y) { sys_multiply(A, A.val, x, y); }

void sys_multiply(const SysMatrix& A, const RealVec& val, const RealVec& x, RealVec& y)
{
  MPFE_CHECK(&x != &y, "sys_multiply: x and y are one vector");
  y.assign(A.neq(), 0.0);
  switch (A.dim) {
    case 1: multiply<1>(A, val, x.data(), y.data()); break;
    case 2: multiply<2>(A, val, x.data(), y.data()); break;
    case 3: multiply<3>(A, val, x.data(), y.data()); break;
    default: log_bug("sys_multiply: blocks are 1 x 1, 2 x 2 or 3 x 3", __FILE__, __LINE__);
  }
}

void sys_diagonal(const SysMatrix& A, RealVec& d)
{
  const int D = A.dim;
  d.resize(A.neq());
  for (int I = 0; I < A.nrow; ++I)
    for (int i = 0; i < D; ++i) d[I * D + i] = A.val[(static_cast<size_t>(A.off[I + 1] - 1) * D + i) * D + i];
  sys_sum(A, d);
}

void rows_add(const IntVec& row, RowSets& s)
{
  for (size_t k = 0; k < row.size(); ++k) {
    if (k == 0 || row[k] != row[k - 1] + 1) s.run.item.insert(s.run.item.end(), 2, row[k]);
    s.run.item.back() = row[k] + 1;
  }
  s.run.off.push_back(static_cast<int>(s.run.item.size()));
  s.count.push_back(static_cast<int>(row.size()));
}

double* rows_pack(const RowSets& s, int set, int D, const RealVec& v, double* to)
{
  for (const int* run = s.run.begin(set); run != s.run.begin(set + 1); run += 2)
    to = std::copy(v.begin() + run[0] * D, v.begin() + run[1] * D, to);
  return to;
}

const double* rows_put(const RowSets& s, int set, int D, const double* from, RealVec& v)
{
  for (const int* run = s.run.begin(set); run != s.run.begin(set + 1); run += 2) {
    const int n = (run[1] - run[0]) * D;
    std::copy(from, from + n, v.begin() + run[0] * D);
    from += n;
  }
  return from;
}

const double* rows_add_to(const RowSets& s, int set, int D, const double* from, RealVec& v)
{
  for (const int* run = s.run.begin(set); run != s.run.begin(set + 1); run += 2) {
    const int n = (run[1] - run[0]) * D;
    double* to  = &v[static_cast<size_t>(run[0]) * D];
    for (int i = 0; i < n; ++i) to[i] += from[i];
    from += n;
  }
  return from;
}

// ---------------------------------------------------------------------------
// sys_sum : what the ranks have added to the rows of A, in the order of the ranks
//
//   in   v       [n*nrow + extra], zero in rows that are not of A.rows of this rank
//   out  v       the sum, on all ranks (divided model: in their rows); one rank: as it was
// ---------------------------------------------------------------------------
void sys_sum(const SysMatrix& A, RealVec& v, int extra)
{
  if (!sys_shared(A)) return;
  if (sys_divided(A)) {
    const int D = A.nrow > 0 ? (static_cast<int>(v.size()) - extra) / A.nrow : 0;
    halo_sum(A.halo, D, v, v.data() + static_cast<size_t>(A.nrow) * D, extra);
    return;
  }
  static RealVec all;                    // kept, since large vectors are dear to make
  const int ranks = comm_size(), me = comm_rank(), D = (static_cast<int>(v.size()) - extra) / A.nrow;
  IntVec count(ranks);
  for (int r = 0; r < ranks; ++r) count[r] = A.rows.count[r] * D + extra;
  all.resize(std::accumulate(count.begin(), count.end(), size_t(0)));
  double* to = std::accumulate(count.begin(), count.begin() + me, all.data(),
                               [](double* p, int n) { return p + n; });
  std::copy(v.end() - extra, v.end(), rows_pack(A.rows, me, D, v, to));
  comm_allgatherv(all, count);
  const bool two = ranks == 2;           // then the order does not matter, and what is in v may stay
  if (!two) std::fill(v.begin(), v.end(), 0.0);
  const double* from = all.data();
  for (int r = 0; r < ranks; from += count[r++]) {
    if (two && r == me) continue;
    const double* number = rows_add_to(A.rows, r, D, from, v);
    for (auto last = v.end() - extra; last != v.end(); ++last) *last += *number++;
  }
}

// ---------------------------------------------------------------------------
// sys_pattern : lower block triangle, rows sorted, the diagonal last
//
//   in   lists  each: block rows that a thing couples; every row has its diagonal also without a list
//   out  A      dim, nrow, off, col; val: zeros
// ---------------------------------------------------------------------------
void sys_pattern(const ListTable& lists, int nrow, int dim, SysMatrix& A)
{
  // rows -> lists that hold them
  IntVec count(nrow + 1, 0);
  for (int r : lists.item) ++count[r + 1];
  for (int r = 0; r < nrow; ++r) count[r + 1] += count[r];
  IntVec holder(lists.item.size()), next(count.begin(), count.end() - 1);
  for (int l = 0; l < lists.size(); ++l)
    for (int k = lists.off[l]; k < lists.off[l + 1]; ++k) holder[next[lists.item[k]]++] = l;

  A      = SysMatrix();
  A.dim  = dim;
  A.nrow = nrow;
  A.off.assign(1, 0);
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
  A.col.shrink_to_fit();
  A.val.assign(A.col.size() * dim * dim, 0.0);
}

long sys_rows(const SysMatrix& A)
{
  if (!sys_divided(A)) return A.nrow;
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

// a block of the whole matrix, and which one it is in what the ranks have sent
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
SysMatrix collect_divided(const SysMatrix& A, bool values)
{
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

}  // namespace

// ---------------------------------------------------------------------------
// sys_collect : the whole matrix on rank 0, contributions summed in the order of the ranks
// ---------------------------------------------------------------------------
SysMatrix sys_collect(const SysMatrix& A, bool values)
{
  if (sys_divided(A)) return collect_divided(A, values);
  const auto to_first = [](const auto& x) {
    std::vector<std::decay_t<decltype(x)>> to(comm_size());
    to[0] = x;
    return comm_exchange(to);
  };
  const std::vector<IntVec> off = to_first(A.off), col = to_first(A.col);
  const std::vector<RealVec> val = to_first(values ? A.val : RealVec());
  SysMatrix whole;
  if (comm_rank() > 0) return whole;
  const int DD = A.dim * A.dim;
  whole.dim  = A.dim;
  whole.nrow = A.nrow;
  IntVec place(A.nrow, -1);            // of a column in the row at hand
  for (int I = 0; I < A.nrow; ++I) {
    const int first = static_cast<int>(whole.col.size());
    for (size_t r = 0; r < col.size(); ++r)
      for (int k = off[r][I]; k < off[r][I + 1]; ++k)
        if (place[col[r][k]] < 0) {
          place[col[r][k]] = 0;
          whole.col.push_back(col[r][k]);
        }
    std::sort(whole.col.begin() + first, whole.col.end());
    whole.off.push_back(static_cast<int>(whole.col.size()));
    for (int k = first; k < whole.off.back(); ++k) place[whole.col[k]] = k;
    if (values) whole.val.resize(whole.col.size() * DD, 0.0);
    for (size_t r = 0; values && r < col.size(); ++r)
      for (int k = off[r][I]; k < off[r][I + 1]; ++k)
        for (int i = 0; i < DD; ++i)
          whole.val[static_cast<size_t>(place[col[r][k]]) * DD + i] +=
              val[r][static_cast<size_t>(k) * DD + i];
    for (int k = first; k < whole.off.back(); ++k) place[whole.col[k]] = -1;
  }
  return whole;
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
