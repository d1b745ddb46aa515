#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/comm.h"
#include "base/log.h"
#include "solve/solve_data.h"

namespace {

using Pairs = std::vector<std::pair<int, int>>;       // row, column

void sort_unique(IntVec& list)
{
  std::sort(list.begin(), list.end());
  list.erase(std::unique(list.begin(), list.end()), list.end());
}

std::uint64_t check_sum(std::uint64_t sum, const IntVec& list)
{
  for (int k : list) sum = (sum ^ static_cast<std::uint64_t>(static_cast<unsigned>(k))) * 0x100000001B3u;
  return (sum ^ list.size()) * 0x100000001B3u;
}

std::uint64_t pattern_sum(const SysMatrix& A)
{
  return check_sum(check_sum(check_sum(0xCBF29CE484222325u, A.off), A.col), A.halo.owner);
}

// 2 k, k the block of rows I and J of A; 2 k + 1: it is transposed there; -1: none
int find_block(const SysMatrix& A, int I, int J)
{
  const int turned = J > I ? 1 : 0;
  if (turned) std::swap(I, J);
  const auto first = A.col.begin() + A.off[I], last = A.col.begin() + A.off[I + 1];
  const auto found = std::lower_bound(first, last, J);
  return found != last && *found == J ? 2 * static_cast<int>(found - A.col.begin()) + turned : -1;
}

// how often each row counts
void take_rows(const SysMatrix& A, OwnBlock& own)
{
  const Halo& h = A.halo;
  IntVec ranks(A.nrow, 1);
  for (const IntVec& list : h.common)
    for (int I : list) ++ranks[I];
  own.weight.clear();
  for (int I : h.shared) own.weight.push_back(1.0 / std::sqrt(static_cast<double>(ranks[I])));
  own.once.assign(A.neq(), 1.0);
  for (int I = 0; I < A.nrow; ++I)
    if (h.owner[I] != comm_rank()) std::fill_n(own.once.begin() + static_cast<long>(I) * A.dim, A.dim, 0.0);
}

// blocks of rows that another rank has both, named by their positions in the list of common rows
void list_border(const SysMatrix& A, OwnBlock& own)
{
  const int ranks = comm_size();
  IntVec number(A.nrow, -1), all;
  std::vector<Pairs> name(ranks);
  own.to.assign(ranks, IntVec());
  for (int r = 0; r < ranks; ++r) {
    const IntVec& common = A.halo.common[r];
    for (size_t k = 0; k < common.size(); ++k) number[common[k]] = static_cast<int>(k);
    for (int I : common)
      for (int k = A.off[I]; k < A.off[I + 1]; ++k)
        if (number[A.col[k]] >= 0) {
          own.to[r].push_back(k);
          name[r].emplace_back(number[I], number[A.col[k]]);
        }
    for (int I : common) number[I] = -1;
    all.insert(all.end(), own.to[r].begin(), own.to[r].end());
  }
  sort_unique(all);
  own.border.block = all;
  std::vector<std::vector<int>> send(ranks);
  for (int r = 0; r < ranks; ++r)
    for (const auto& pair : name[r]) send[r].insert(send[r].end(), {pair.first, pair.second});
  const std::vector<IntVec> come = comm_exchange(send);
  own.place.clear();
  own.come.clear();
  for (int r = 0; r < ranks; ++r) {
    own.come.push_back(static_cast<int>(come[r].size() / 2));
    for (size_t k = 0; k < come[r].size(); k += 2) {
      const int found = find_block(A, A.halo.common[r][come[r][k]], A.halo.common[r][come[r][k + 1]]);
      const auto at   = std::lower_bound(all.begin(), all.end(), found / 2);
      own.place.push_back(found < 0 ? -1 : 2 * static_cast<int>(at - all.begin()) + found % 2);
    }
  }
}

// numbers of the border: parts of all ranks, in their order
void form_border(const SysMatrix& A, OwnBlock& own)
{
  const int D = A.dim, DD = D * D, ranks = comm_size(), me = comm_rank();
  std::vector<RealVec> send(ranks), from(ranks);
  for (int r = 0; r < ranks; ++r) {
    send[r].reserve(own.to[r].size() * DD);
    for (int k : own.to[r]) {
      const double* a = &A.val[static_cast<size_t>(k) * DD];
      send[r].insert(send[r].end(), a, a + DD);
    }
    from[r].resize(static_cast<size_t>(own.come[r]) * DD);
  }
  comm_exchange(send, from);
  Border& border = own.border;
  border.val.assign(border.block.size() * DD, 0.0);
  const int* place = own.place.data();
  for (int r = 0; r < ranks; ++r) {
    for (size_t k = 0; r == me && k < border.block.size(); ++k)
      for (int i = 0; i < DD; ++i)
        border.val[k * DD + i] += A.val[static_cast<size_t>(border.block[k]) * DD + i];
    for (size_t k = 0; k < from[r].size(); k += DD, ++place) {
      if (*place < 0) continue;
      double* b = &border.val[static_cast<size_t>(*place / 2) * DD];
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) b[i * D + j] += from[r][k + (*place % 2 ? j * D + i : i * D + j)];
    }
  }
}

}  // namespace

// ---------------------------------------------------------------------------
// own_form : what conjugate gradients of several ranks want to know of A beside it                     (8.7)
//
//   in    stamp   number of the matrix A
//   out   own     how often rows count; own.border: blocks that several ranks add to, summed
// ---------------------------------------------------------------------------
void own_form(const SysMatrix& A, long stamp, OwnBlock& own)
{
  if (own.stamp == stamp) return;
  own.stamp = stamp;
  const std::uint64_t pattern = pattern_sum(A);
  if (comm_allreduce_max(static_cast<int>(own.pattern != pattern))) {
    take_rows(A, own);
    list_border(A, own);
  }
  own.pattern = pattern;
  form_border(A, own);
}

void own_weigh(const SysMatrix& A, const OwnBlock& own, RealVec& v)
{
  for (size_t k = 0; k < A.halo.shared.size(); ++k)
    for (int i = 0; i < A.dim; ++i) v[A.halo.shared[k] * A.dim + i] *= own.weight[k];
}
