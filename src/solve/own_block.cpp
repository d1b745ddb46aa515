#include <algorithm>
#include <utility>

#include "base/comm.h"
#include "solve/solve_data.h"

namespace {

using Pairs = std::vector<std::pair<int, int>>;       // row, column

// blocks of A by the rank that both their rows belong to; blocks between two ranks are left out
void sort_blocks(const SysMatrix& A, OwnBlock& own)
{
  own.from.clear();
  own.to.assign(comm_size(), IntVec());
  for (int I = 0; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1]; ++k) {
      const int r = A.owner[I];
      if (A.owner[A.col[k]] == r) (r == comm_rank() ? own.from : own.to[r]).push_back(k);
    }
}

// pattern of B and places, from the blocks of all ranks
void form_block_pattern(const SysMatrix& A, OwnBlock& own)
{
  IntVec row_of(A.col.size()), number(A.nrow, -1);
  for (int I = 0; I < A.nrow; ++I) std::fill(row_of.begin() + A.off[I], row_of.begin() + A.off[I + 1], I);
  own.row.clear();
  for (int I = 0; I < A.nrow; ++I)
    if (A.owner[I] == comm_rank()) {
      number[I] = static_cast<int>(own.row.size());
      own.row.push_back(I);
    }
  std::vector<IntVec> send(comm_size());
  for (int r = 0; r < comm_size(); ++r)
    for (int k : own.to[r]) send[r].insert(send[r].end(), {row_of[k], A.col[k]});
  Pairs all;
  for (int k : own.from) all.emplace_back(number[row_of[k]], number[A.col[k]]);
  for (const IntVec& pairs : comm_exchange(send))
    for (size_t k = 0; k < pairs.size(); k += 2) all.emplace_back(number[pairs[k]], number[pairs[k + 1]]);

  Pairs sorted = all;
  for (size_t I = 0; I < own.row.size(); ++I) sorted.emplace_back(I, I);
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

}  // namespace

// ---------------------------------------------------------------------------
// own_form : the matrix of the rows that belong to this rank, with what other ranks add to it                 (8.7)
//
//   out  own.B   own rows, numbered as in own.row; entries that couple them with rows of other ranks are left out
// ---------------------------------------------------------------------------
void own_form(const SysMatrix& A, OwnBlock& own)
{
  const int DD = A.dim * A.dim;
  if (comm_most(own.off != A.off || own.col != A.col || own.owner != A.owner)) {
    own.off   = A.off;
    own.col   = A.col;
    own.owner = A.owner;
    sort_blocks(A, own);
    form_block_pattern(A, own);
  }
  std::vector<RealVec> send(comm_size());
  for (int r = 0; r < comm_size(); ++r)
    for (int k : own.to[r])
      send[r].insert(send[r].end(), A.val.begin() + static_cast<long>(k) * DD, A.val.begin() + static_cast<long>(k + 1) * DD);
  own.B.val.assign(own.B.col.size() * DD, 0.0);
  size_t at = 0;
  const auto add = [&](const double* block) {
    double* b = &own.B.val[static_cast<size_t>(own.place[at++]) * DD];
    for (int i = 0; i < DD; ++i) b[i] += block[i];
  };
  for (int k : own.from) add(&A.val[static_cast<size_t>(k) * DD]);
  for (const RealVec& val : comm_exchange(send))
    for (size_t k = 0; k < val.size(); k += DD) add(&val[k]);
}

void own_gather(OwnBlock& own, const RealVec& r)
{
  const int D = own.B.dim;
  own.r.resize(own.row.size() * D);
  own.z.resize(own.r.size());
  for (size_t I = 0; I < own.row.size(); ++I)
    for (int i = 0; i < D; ++i) own.r[I * D + i] = r[own.row[I] * D + i];
}

// every row belongs to one rank: the sum puts the pieces together
void own_scatter(const OwnBlock& own, RealVec& z)
{
  const int D = own.B.dim;
  std::fill(z.begin(), z.end(), 0.0);
  for (size_t I = 0; I < own.row.size(); ++I)
    for (int i = 0; i < D; ++i) z[own.row[I] * D + i] = own.z[I * D + i];
  comm_sum(z);
}
