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

// what all ranks have of the list of each
std::vector<IntVec> all_lists(const IntVec& list)
{
  return comm_exchange(std::vector<IntVec>(comm_size(), list));
}

// adds the neighbours of the rows of each rank, which any rank may know of
void add_neighbours(const SysMatrix& A, IntVec& row)
{
  std::vector<IntVec> tell(comm_size());
  for (int I = 0; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1]; ++k) {
      const int J = A.col[k];
      if (A.owner[I] == A.owner[J]) continue;
      tell[A.owner[I]].push_back(J);
      tell[A.owner[J]].push_back(I);
    }
  for (IntVec& list : tell) sort_unique(list);
  for (const IntVec& list : comm_exchange(tell)) row.insert(row.end(), list.begin(), list.end());
  sort_unique(row);
}

// ranks in whose matrices each row stands, ascending; rows: those of each rank
ListTable ranks_of_rows(const std::vector<IntVec>& rows, int nrow)
{
  ListTable ranks;
  ranks.off.assign(nrow + 1, 0);
  for (const IntVec& list : rows)
    for (int I : list) ++ranks.off[I + 1];
  std::partial_sum(ranks.off.begin(), ranks.off.end(), ranks.off.begin());
  ranks.item.resize(ranks.off.back());
  IntVec next(ranks.off.begin(), ranks.off.end() - 1);
  for (size_t r = 0; r < rows.size(); ++r)
    for (int I : rows[r]) ranks.item[next[I]++] = static_cast<int>(r);
  return ranks;
}

// which blocks of A each rank needs, which rows it shares with this one, and in how many of their matrices a
// row stands
void sort_blocks(const SysMatrix& A, OwnBlock& own)
{
  const ListTable ranks = ranks_of_rows(all_lists(own.row), A.nrow);
  own.to.assign(comm_size(), IntVec());
  own.common.assign(comm_size(), IntVec());
  for (int I = 0; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1]; ++k) {
      const int *r = ranks.begin(I), *q = ranks.begin(A.col[k]);
      const int *const rend = r + ranks.count(I), *const qend = q + ranks.count(A.col[k]);
      while (r != rend && q != qend) {
        if (*r == *q) own.to[*r].push_back(k);
        const int least = std::min(*r, *q);
        r += *r == least;
        q += *q == least;
      }
    }
  for (size_t k = 0; k < own.row.size(); ++k)
    for (int q = ranks.off[own.row[k]]; q < ranks.off[own.row[k] + 1]; ++q)
      if (ranks.item[q] != comm_rank()) own.common[ranks.item[q]].push_back(static_cast<int>(k));
  own.once.clear();
  own.shared.clear();
  own.weight.clear();
  own.foreign.clear();
  for (size_t k = 0; k < own.row.size(); ++k) {
    const int I = own.row[k], place = static_cast<int>(k);
    const bool owned = A.owner[I] == comm_rank();
    own.once.insert(own.once.end(), A.dim, owned ? 1.0 : 0.0);
    if (!owned) own.foreign.push_back(place);
    if (ranks.count(I) == 1) continue;
    own.shared.push_back(place);
    own.weight.push_back(1.0 / std::sqrt(static_cast<double>(ranks.count(I))));
  }
}

void sort_rows(const SysMatrix& A, OwnBlock& own)
{
  std::vector<IntVec> of(comm_size());
  for (int I = 0; I < A.nrow; ++I) of[A.owner[I]].push_back(I);
  own.all = own.here = own.owned = RowSets();
  for (const IntVec& row : of) rows_add(row, own.all);
  rows_add(own.row, own.here);
  IntVec place;
  for (size_t k = 0; k < own.row.size(); ++k)
    if (A.owner[own.row[k]] == comm_rank()) place.push_back(static_cast<int>(k));
  rows_add(place, own.owned);
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
  own.come.clear();
  for (const IntVec& pairs : comm_exchange(send)) {
    for (size_t k = 0; k < pairs.size(); k += 2) all.emplace_back(number[pairs[k]], number[pairs[k + 1]]);
    own.come.push_back(static_cast<int>(pairs.size() / 2));
  }

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

// numbers of B: parts of all ranks, in their order
template <int D>
void form_values(const SysMatrix& A, OwnBlock& own)
{
  const int DD = D * D, me = comm_rank();
  std::vector<RealVec> send(comm_size()), from(comm_size());
  for (int r = 0; r < comm_size(); ++r) {
    if (r == me) continue;
    send[r].reserve(own.to[r].size() * DD);
    for (int k : own.to[r]) {
      const double* a = &A.val[static_cast<size_t>(k) * DD];
      send[r].insert(send[r].end(), a, a + DD);
    }
    from[r].resize(static_cast<size_t>(own.come[r]) * DD);
  }
  comm_exchange(send, from);
  send = std::vector<RealVec>();
  own.B.val.assign(own.B.col.size() * DD, 0.0);
  const int* place = own.place.data();
  const auto add = [&](const double* block) {
    double* b = &own.B.val[static_cast<size_t>(*place++) * DD];
    for (int i = 0; i < DD; ++i) b[i] += block[i];
  };
  for (int r = 0; r < comm_size(); ++r) {
    if (r == me)
      for (int k : own.to[r]) add(&A.val[static_cast<size_t>(k) * DD]);
    for (size_t k = 0; k < from[r].size(); k += DD) add(&from[r][k]);
  }
}

// ---- divided model ---------------------------------------------------------

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

// the rows of A, and how often each counts
void take_rows(const SysMatrix& A, OwnBlock& own)
{
  const Halo& h = A.halo;
  const int me = comm_rank();
  IntVec ranks(A.nrow, 1), owned;
  for (const IntVec& list : h.common)
    for (int I : list) ++ranks[I];
  own.common = h.common;
  own.shared = h.shared;
  own.weight.clear();
  own.foreign.clear();
  for (int I : h.shared) own.weight.push_back(1.0 / std::sqrt(static_cast<double>(ranks[I])));
  own.once.assign(A.neq(), 1.0);
  for (int I = 0; I < A.nrow; ++I)
    if (h.owner[I] == me) owned.push_back(I);
    else {
      own.foreign.push_back(I);
      std::fill_n(own.once.begin() + static_cast<long>(I) * A.dim, A.dim, 0.0);
    }
  own.owned = RowSets();
  rows_add(owned, own.owned);
}

// blocks of rows that another rank has both, named by their positions in the list of common rows
void list_border(const SysMatrix& A, OwnBlock& own)
{
  const int ranks = comm_size();
  IntVec number(A.nrow, -1), all;
  std::vector<Pairs> name(ranks);
  own.to.assign(ranks, IntVec());
  for (int r = 0; r < ranks; ++r) {
    const IntVec& common = own.common[r];
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
      const int found = find_block(A, own.common[r][come[r][k]], own.common[r][come[r][k + 1]]);
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
    for (size_t k = 0; r == me && k < border.block.size(); ++k) {
      const double* a = &A.val[static_cast<size_t>(border.block[k]) * DD];
      for (int i = 0; i < DD; ++i) border.val[k * DD + i] += a[i];
    }
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
// own_form : the matrix of the rows of this rank and of their neighbours, with what all ranks add to
// it  (8.7)
//
//   in    stamp   number of the matrix A
//   out   own.B   these rows, numbered as in own.row; entries that couple them with others are left out
//         divided model: own.border, what B would have beside A; a product with A is a part
//   note  a product with B is right in the rows of this rank
// ---------------------------------------------------------------------------
void own_form(const SysMatrix& A, long stamp, OwnBlock& own)
{
  if (own.stamp == stamp) return;
  own.stamp = stamp;
  own.dim   = A.dim;
  own.parts = sys_divided(A);
  if (own.parts) {
    const std::uint64_t pattern = pattern_sum(A);
    if (comm_allreduce_max(static_cast<int>(own.pattern != pattern))) {
      take_rows(A, own);
      list_border(A, own);
    }
    own.pattern = pattern;
    form_border(A, own);
    return;
  }
  if (comm_allreduce_max(own.off != A.off || own.col != A.col || own.owner != A.owner)) form_lists(A, own);
  switch (A.dim) {
    case 1: return form_values<1>(A, own);
    case 2: return form_values<2>(A, own);
    case 3: return form_values<3>(A, own);
  }
  log_bug("own_form: blocks are 1 x 1, 2 x 2 or 3 x 3", __FILE__, __LINE__);
}

void own_pick(const OwnBlock& own, const RealVec& x, RealVec& v)
{
  if (own.parts) {
    v = x;
    return;
  }
  v.resize(own.row.size() * own.dim);
  rows_pack(own.here, 0, own.dim, x, v.data());
}

void own_gather(OwnBlock& own, const RealVec& v, RealVec& x)
{
  if (own.parts) {
    x = v;
    return;
  }
  const int ranks = comm_size(), D = own.dim;
  IntVec count;
  for (int rows : own.all.count) count.push_back(rows * D);
  own.gathered.resize(std::accumulate(count.begin(), count.end(), size_t(0)));
  rows_pack(own.owned, 0, D, v,
            own.gathered.data() + std::accumulate(count.begin(), count.begin() + comm_rank(), size_t(0)));
  comm_allgatherv(own.gathered, count);
  x.resize(own.gathered.size());
  const double* from = own.gathered.data();
  for (int r = 0; r < ranks; ++r) from = rows_put(own.all, r, D, from, x);
}

void own_weigh(const OwnBlock& own, RealVec& v)
{
  const int D = own.dim;
  for (size_t k = 0; k < own.shared.size(); ++k)
    for (int i = 0; i < D; ++i) v[own.shared[k] * D + i] *= own.weight[k];
}

// parts are added in the order of the ranks, so that a run repeats
void own_sum(OwnBlock& own, RealVec& v, double* number, int n)
{
  const int ranks = comm_size(), D = own.dim;
  own.send.resize(ranks);
  own.got.resize(ranks);
  for (int r = 0; r < ranks; ++r) {
    if (r == comm_rank()) continue;
    RealVec& to = own.send[r];
    to.assign(number, number + n);
    for (int I : own.common[r]) to.insert(to.end(), &v[I * D], &v[I * D] + D);
    own.got[r].resize(to.size());
  }
  RealVec& here = own.got[comm_rank()];
  here.assign(number, number + n);
  if (own.parts)                         // all ranks get the same bits
    for (int I : own.shared) {
      here.insert(here.end(), &v[I * D], &v[I * D] + D);
      std::fill_n(&v[I * D], D, 0.0);
    }
  comm_exchange(own.send, own.got);
  std::fill(number, number + n, 0.0);
  for (int r = 0; r < ranks; ++r) {
    const double* from = own.got[r].data();
    for (int k = 0; k < n; ++k) number[k] += *from++;
    for (int I : own.parts && r == comm_rank() ? own.shared : own.common[r])
      for (int i = 0; i < D; ++i) v[I * D + i] += *from++;
  }
}
