#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/comm.h"
#include "solve/solve_data.h"

namespace {

using Pairs = std::vector<std::pair<int, int>>;       // row, column

void sort_unique(IntVec& list)
{
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

// what all ranks have of the list of each
std::vector<IntVec> all_lists(const IntVec& mine) { return comm_exchange(std::vector<IntVec>(comm_size(), mine)); }

// adds the neighbours of the rows of each rank, which any rank may know of
void add_neighbours(const SysMatrix& A, IntVec& row)
{
  std::vector<IntVec> tell = all_lists(row);
  std::vector<char> in(A.nrow);
  for (IntVec& list : tell) {
    std::fill(in.begin(), in.end(), 0);
    for (int I : list) in[I] = 1;
    list.clear();
    for (int I = 0; I < A.nrow; ++I)
      for (int k = A.off[I]; k < A.off[I + 1]; ++k)
        if (in[I] != in[A.col[k]]) list.push_back(in[I] ? A.col[k] : I);
    sort_unique(list);
  }
  for (const IntVec& list : comm_exchange(tell)) row.insert(row.end(), list.begin(), list.end());
  sort_unique(row);
}

// which blocks of A each rank needs, which rows it shares with this one, and in how many of their matrices a row stands
void sort_blocks(const SysMatrix& A, OwnBlock& own)
{
  IntVec count(A.nrow, 0);
  std::vector<char> in(A.nrow);
  own.to.assign(comm_size(), IntVec());
  own.common.assign(comm_size(), IntVec());
  const std::vector<IntVec> rows = all_lists(own.row);
  for (int r = 0; r < comm_size(); ++r) {
    std::fill(in.begin(), in.end(), 0);
    for (int I : rows[r]) {
      in[I] = 1;
      ++count[I];
    }
    for (int I = 0; I < A.nrow; ++I)
      for (int k = A.off[I]; in[I] && k < A.off[I + 1]; ++k)
        if (in[A.col[k]]) own.to[r].push_back(k);
    for (size_t I = 0; I < own.row.size() && r != comm_rank(); ++I)
      if (in[own.row[I]]) own.common[r].push_back(static_cast<int>(I));
  }
  own.weight.clear();
  own.once.clear();
  for (int I : own.row) {
    own.weight.insert(own.weight.end(), A.dim, 1.0 / std::sqrt(static_cast<double>(count[I])));
    own.once.insert(own.once.end(), A.dim, A.owner[I] == comm_rank() ? 1.0 : 0.0);
  }
}

// all rows, those of the first rank first
void sort_rows(const SysMatrix& A, OwnBlock& own)
{
  own.order.resize(A.nrow);
  std::iota(own.order.begin(), own.order.end(), 0);
  std::stable_sort(own.order.begin(), own.order.end(), [&](int I, int J) { return A.owner[I] < A.owner[J]; });
  own.count.assign(comm_size(), 0);
  for (int r : A.owner) own.count[r] += A.dim;
}

// pattern of B, and the place in it of each block that comes
void form_block_pattern(const SysMatrix& A, OwnBlock& own)
{
  IntVec row_of(A.col.size()), number(A.nrow, -1);
  for (int I = 0; I < A.nrow; ++I) std::fill(row_of.begin() + A.off[I], row_of.begin() + A.off[I + 1], I);
  for (size_t I = 0; I < own.row.size(); ++I) number[own.row[I]] = static_cast<int>(I);
  std::vector<IntVec> send(comm_size());
  for (int r = 0; r < comm_size(); ++r)
    for (int k : own.to[r]) send[r].insert(send[r].end(), {row_of[k], A.col[k]});
  Pairs all;
  for (const IntVec& pairs : comm_exchange(send))
    for (size_t k = 0; k < pairs.size(); k += 2) all.emplace_back(number[pairs[k]], number[pairs[k + 1]]);

  Pairs sorted = all;
  std::sort(sorted.begin(), sorted.end());
  sorted.erase(std::unique(sorted.begin(), sorted.end()), sorted.end());
  SysMatrix& B = own.B;
  B      = SysMatrix();
  B.dim  = A.dim;
  B.nrow = static_cast<int>(own.row.size());
  B.off.assign(B.nrow + 1, 0);
  for (const auto& p : sorted) {
    ++B.off[p.first + 1];
    B.col.push_back(p.second);
  }
  for (int I = 0; I < B.nrow; ++I) B.off[I + 1] += B.off[I];
  own.place.clear();
  for (const auto& p : all)
    own.place.push_back(static_cast<int>(std::lower_bound(sorted.begin(), sorted.end(), p) - sorted.begin()));
}

void form_lists(const SysMatrix& A, OwnBlock& own)
{
  own.off   = A.off;
  own.col   = A.col;
  own.owner = A.owner;
  own.row.clear();
  for (int I = 0; I < A.nrow; ++I)
    if (A.owner[I] == comm_rank()) own.row.push_back(I);
  add_neighbours(A, own.row);
  sort_blocks(A, own);
  sort_rows(A, own);
  form_block_pattern(A, own);
}

}  // namespace

// ---------------------------------------------------------------------------
// own_form : the matrix of the rows of this rank and of their neighbours, with what all ranks add to it        (8.7)
//
//   in    stamp   number of the matrix A
//   out   own.B   these rows, numbered as in own.row; entries that couple them with others are left out
//   note  a product with B is right in the rows of this rank
// ---------------------------------------------------------------------------
void own_form(const SysMatrix& A, long stamp, OwnBlock& own)
{
  if (own.stamp == stamp) return;
  own.stamp    = stamp;
  const int DD = A.dim * A.dim;
  if (comm_most(own.off != A.off || own.col != A.col || own.owner != A.owner)) form_lists(A, own);
  std::vector<RealVec> send(comm_size());
  for (int r = 0; r < comm_size(); ++r)
    for (size_t k = 0; r != comm_rank() && k < own.to[r].size(); ++k) {
      const double* a = &A.val[static_cast<size_t>(own.to[r][k]) * DD];
      send[r].insert(send[r].end(), a, a + DD);
    }
  const std::vector<RealVec> from = comm_exchange(send);
  own.B.val.assign(own.B.col.size() * DD, 0.0);
  size_t at = 0;
  const auto add = [&](const double* block) {
    double* b = &own.B.val[static_cast<size_t>(own.place[at++]) * DD];
    for (int i = 0; i < DD; ++i) b[i] += block[i];
  };
  for (int r = 0; r < comm_size(); ++r) {
    if (r == comm_rank())
      for (int k : own.to[r]) add(&A.val[static_cast<size_t>(k) * DD]);
    for (size_t k = 0; k < from[r].size(); k += DD) add(&from[r][k]);
  }
}

void own_pick(const OwnBlock& own, const RealVec& x, RealVec& v)
{
  const int D = own.B.dim;
  v.resize(own.row.size() * D);
  for (size_t I = 0; I < own.row.size(); ++I)
    for (int i = 0; i < D; ++i) v[I * D + i] = x[own.row[I] * D + i];
}

void own_gather(const OwnBlock& own, const RealVec& v, RealVec& x)
{
  const int D = own.B.dim;
  RealVec all(own.order.size() * D);
  size_t at = std::accumulate(own.count.begin(), own.count.begin() + comm_rank(), size_t(0));
  for (size_t i = 0; i < v.size(); ++i)
    if (own.once[i] != 0.0) all[at++] = v[i];
  comm_gather(all, own.count);
  x.resize(all.size());
  for (size_t I = 0; I < own.order.size(); ++I)
    for (int i = 0; i < D; ++i) x[own.order[I] * D + i] = all[I * D + i];
}

// parts are added in the order of the ranks, so that a run repeats
void own_sum(OwnBlock& own, RealVec& v, double* number, int n)
{
  const int ranks = comm_size(), D = own.B.dim;
  own.send.resize(ranks);
  own.got.resize(ranks);
  for (int r = 0; r < ranks; ++r) {
    if (r == comm_rank()) continue;
    RealVec& to = own.send[r];
    to.assign(number, number + n);
    for (int I : own.common[r]) to.insert(to.end(), &v[I * D], &v[I * D] + D);
    own.got[r].resize(to.size());
  }
  own.got[comm_rank()].assign(number, number + n);
  comm_trade(own.send, own.got);
  std::fill(number, number + n, 0.0);
  for (int r = 0; r < ranks; ++r) {
    const double* from = own.got[r].data();
    for (int k = 0; k < n; ++k) number[k] += *from++;
    for (int I : own.common[r])
      for (int i = 0; i < D; ++i) v[I * D + i] += *from++;
  }
}
