#include <algorithm>
#include <cmath>
#include <iterator>
#include <numeric>
#include <utility>

#include "base/comm.h"
#include "base/far_first.h"
#include "base/grow.h"
#include "solve/solve_data.h"

namespace {

using Pairs = std::vector<long>;       // row and column of each, ascending

long pair_of(int row, int col) { return static_cast<long>(row) << 32 | col; }
int row_of_pair(long pair) { return static_cast<int>(pair >> 32); }
int col_of_pair(long pair) { return static_cast<int>(pair & 0x7FFFFFFF); }

std::uint64_t check_sum(std::uint64_t sum, const IntVec& list)
{
  for (int k : list) sum = (sum ^ static_cast<std::uint64_t>(static_cast<unsigned>(k))) * 0x100000001B3u;
  return (sum ^ list.size()) * 0x100000001B3u;
}

std::uint64_t pattern_sum(const SysMatrix& A)
{
  std::uint64_t sum = check_sum(check_sum(check_sum(0xCBF29CE484222325u, A.off), A.col), A.halo.owner);
  for (const IntVec& list : A.halo.common) sum = check_sum(sum, list);
  return sum;
}

// the block in rows I, J of A: 2 k, or 2 k + 1 if A stores its transpose; -1: none
int find_block(const SysMatrix& A, int I, int J)
{
  const int row = std::max(I, J), col = std::min(I, J);
  const auto first = A.col.begin() + A.off[row], last = A.col.begin() + A.off[row + 1];
  const auto found = std::lower_bound(first, last, col);
  if (found == last || *found != col) return -1;
  return 2 * static_cast<int>(found - A.col.begin()) + (J > I ? 1 : 0);
}

// first the rows of this rank alone, those far from the border and from tied rows first; then the border: on
// two ranks in the order of the keys, which is equal on both, so that both solve for it alike;
// else in the order of A
void order_rows(const SysMatrix& A, OwnBlock& own)
{
  const ListTable graph = sys_graph(A);
  own.inner = A.nrow - static_cast<int>(A.halo.shared.size());
  own.order.resize(A.nrow);
  own.at.resize(A.nrow);
  std::iota(own.order.begin(), own.order.end(), 0);
  const auto neighbours = [&](int I, auto use) {
    for (int k = graph.off[I]; k < graph.off[I + 1]; ++k) use(graph.item[k]);
  };
  IntVec late = A.tied;
  late.insert(late.end(), A.halo.shared.begin(), A.halo.shared.end());
  std::vector<char> border(A.nrow, 0);
  for (int I : A.halo.shared) border[I] = 1;
  far_first(A.nrow, late, neighbours, own.order);
  std::stable_partition(own.order.begin(), own.order.end(), [&](int I) { return !border[I]; });
  if (comm_size() == 2) {
    const IntVec& common = A.halo.common[1 - comm_rank()];
    std::copy(common.begin(), common.end(), own.order.begin() + own.inner);
  }
  for (int n = 0; n < A.nrow; ++n) own.at[own.order[n]] = n;
  own.in_order = std::is_sorted(own.order.begin(), own.order.end());
}

// weights of the rows in sums over the ranks
void take_rows(const SysMatrix& A, OwnBlock& own)
{
  const Halo& h = A.halo;
  IntVec ranks(A.nrow, 1);
  for (const IntVec& list : h.common)
    for (int I : list) ++ranks[I];
  for (int n = own.inner; n < A.nrow; ++n)
    own.weight.push_back(1.0 / std::sqrt(static_cast<double>(ranks[own.order[n]])));
  own.once.assign(A.neq(), 1.0);
  for (int I = 0; I < A.nrow; ++I)
    if (h.owner[I] != comm_rank()) std::fill_n(own.once.begin() + static_cast<long>(I) * A.dim, A.dim, 0.0);
}

// blocks outside the border, by the row that is eliminated last, columns ascending; blocks of the border as
// pairs of its rows
void list_blocks(const SysMatrix& A, OwnBlock& own, Pairs& border)
{
  const auto each = [&](auto use, auto on_border) {
    for (int I = 0; I < A.nrow; ++I)
      for (int k = A.off[I]; k < A.off[I + 1]; ++k) {
        const int i = own.at[I], j = own.at[A.col[k]];
        if (std::min(i, j) >= own.inner) on_border(i - own.inner, j - own.inner);
        else use(std::max(i, j), std::min(i, j), 2 * k + (j > i ? 1 : 0));
      }
  };
  own.off.assign(A.nrow + 1, 0);
  size_t on_border = 0;
  each([&](int row, int, int) { ++own.off[row + 1]; }, [&](int, int) { ++on_border; });
  std::partial_sum(own.off.begin(), own.off.end(), own.off.begin());
  own.col.resize(own.off.back());
  own.from.resize(own.off.back());
  border.reserve(on_border);
  IntVec next(own.off.begin(), own.off.end() - 1);
  each([&](int row, int col, int k) {
    const int to = next[row]++;
    own.col[to]  = col;
    own.from[to] = k;
  }, [&](int i, int j) {
    border.push_back(pair_of(std::max(i, j), std::min(i, j)));
  });
  Pairs line;                                        // column and block
  for (int row = 0; row < A.nrow; ++row) {
    line.clear();
    for (int k = own.off[row]; k < own.off[row + 1]; ++k) line.push_back(pair_of(own.col[k], own.from[k]));
    if (std::is_sorted(line.begin(), line.end())) continue;
    std::sort(line.begin(), line.end());
    for (int k = own.off[row]; k < own.off[row + 1]; ++k) {
      own.col[k]  = row_of_pair(line[k - own.off[row]]);
      own.from[k] = col_of_pair(line[k - own.off[row]]);
    }
  }
}

// [ranks] position of each row of the border among the rows shared with a rank, -1: not shared
std::vector<IntVec> common_positions(const SysMatrix& A, const OwnBlock& own)
{
  std::vector<IntVec> position(comm_size(), IntVec(A.halo.shared.size(), -1));
  for (size_t r = 0; r < position.size(); ++r)
    for (size_t k = 0; k < A.halo.common[r].size(); ++k)
      position[r][own.at[A.halo.common[r][k]] - own.inner] = static_cast<int>(k);
  return position;
}

// couplings of the border on this rank and others, and the blocks shared with each rank
//   in   pairs   of this rank
void form_border(const SysMatrix& A, OwnBlock& own, Pairs pairs)
{
  const int ranks = comm_size();
  const std::vector<IntVec> position = common_positions(A, own);
  std::vector<IntVec> send(ranks);
  std::sort(pairs.begin(), pairs.end());
  for (int r = 0; r < ranks; ++r)
    for (long q : pairs) {
      const int a = position[r][row_of_pair(q)], b = position[r][col_of_pair(q)];
      if (a < 0 || b < 0) continue;
      send[r].push_back(a);
      send[r].push_back(b);
    }
  send = comm_exchange(send);
  for (int r = 0; r < ranks; ++r) {
    Pairs other, joined;
    other.reserve(send[r].size() / 2);
    for (size_t k = 0; k < send[r].size(); k += 2) {
      const int a = own.at[A.halo.common[r][send[r][k]]], b = own.at[A.halo.common[r][send[r][k + 1]]];
      other.push_back(pair_of(std::max(a, b) - own.inner, std::min(a, b) - own.inner));
    }
    IntVec().swap(send[r]);
    std::sort(other.begin(), other.end());
    std::set_union(pairs.begin(), pairs.end(), other.begin(), other.end(), std::back_inserter(joined));
    pairs.swap(joined);
  }
  SysMatrix& s = own.border;
  s.dim  = A.dim;
  s.nrow = static_cast<int>(A.halo.shared.size());
  s.off.assign(s.nrow + 1, 0);
  s.col.reserve(pairs.size());
  own.border_from.reserve(pairs.size());
  for (long q : pairs) {
    const int row = row_of_pair(q), col = col_of_pair(q);
    ++s.off[row + 1];
    s.col.push_back(col);
    own.border_from.push_back(find_block(A, own.order[own.inner + row], own.order[own.inner + col]));
  }
  std::partial_sum(s.off.begin(), s.off.end(), s.off.begin());
  own.to.assign(ranks, IntVec());
  std::vector<std::pair<long, int>> name;            // name of a block, equal on both ranks
  for (int r = 0; r < ranks; ++r) {
    name.clear();
    for (size_t k = 0; k < pairs.size(); ++k) {
      const int a = position[r][row_of_pair(pairs[k])], b = position[r][col_of_pair(pairs[k])];
      if (a < 0 || b < 0) continue;
      name.emplace_back(pair_of(std::max(a, b), std::min(a, b)), 2 * static_cast<int>(k) + (a < b ? 1 : 0));
    }
    std::sort(name.begin(), name.end());
    own.to[r].reserve(name.size());
    for (const auto& n : name) own.to[r].push_back(n.second);
  }
}

// do all ranks have the same border, in the same order?
bool border_alike(const SysMatrix& A, const OwnBlock& own)
{
  bool same = true;
  std::uint64_t sum = 0xCBF29CE484222325u;
  for (int r = 0; r < comm_size(); ++r) {
    if (r == comm_rank()) continue;
    const IntVec& common = A.halo.common[r];
    same = same && common.size() == A.halo.shared.size();
    IntVec index;
    for (int I : common) index.push_back(own.at[I] - own.inner);
    sum = check_sum(0xCBF29CE484222325u, index);     // if same, equal for all other ranks
  }
  std::vector<std::uint64_t> all(1, same ? sum : 0);
  comm_allgatherv(all);
  for (std::uint64_t x : all) same = same && x == all[0];
  return comm_allreduce_max(static_cast<int>(!same)) == 0;
}

// y += block x, or its transpose
template <class From, class To>
void add_block(int D, bool turned, const From* x, To* y)
{
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) y[i * D + j] += static_cast<To>(turned ? x[j * D + i] : x[i * D + j]);
}

}  // namespace

// ---------------------------------------------------------------------------
// own_form : data of conjugate gradients on several ranks from the pattern of A                       (8.7)
// ---------------------------------------------------------------------------
void own_form(const SysMatrix& A, long number, OwnBlock& own)
{
  if (number > 0 && number == own.number) return;
  const std::uint64_t pattern = pattern_sum(A);
  if (comm_allreduce_max(static_cast<int>(own.pattern != pattern))) {
    own = OwnBlock();                                // frees its memory first
    Pairs border;
    order_rows(A, own);
    take_rows(A, own);
    list_blocks(A, own, border);
    form_border(A, own, std::move(border));
    own.alike = border_alike(A, own);
  }
  own.pattern = pattern;
  own.number  = number;
}

void own_border(const SysMatrix& A, OwnBlock& own, std::vector<float>& val)
{
  fit_size(val, own.border.col.size() * A.dim * A.dim);
  std::fill(val.begin(), val.end(), 0.0f);
  with_dim(A.dim, [&](auto d) {
    constexpr int D = decltype(d)::value, DD = D * D;
    for (size_t k = 0; k < own.border_from.size(); ++k) {
      if (own.border_from[k] < 0) continue;
      const double* a = &A.val[static_cast<size_t>(own.border_from[k] / 2) * DD];
      add_block(D, own.border_from[k] % 2 == 1, a, &val[k * DD]);
    }
    RealVec diag;
    sys_diagonal(A, diag);
    own.diag.clear();
    for (int n = own.inner; n < A.nrow; ++n)
      for (int i = 0; i < D; ++i) own.diag.push_back(diag[own.order[n] * D + i]);
  });
}

namespace {

// Calls use(block, transposed there) for the next PART_OF_MESSAGE blocks at most of list, from index at on,
// for which take(block) is true. Returns the index after them.
template <class Take, class Use>
size_t next_blocks(const IntVec& list, size_t at, Take take, Use use)
{
  const int PART_OF_MESSAGE = 1024;      // blocks for each rank
  for (int n = 0; at < list.size() && n < PART_OF_MESSAGE; ++at) {
    if (!take(list[at] / 2)) continue;
    use(static_cast<size_t>(list[at] / 2), list[at] % 2 == 1);
    ++n;
  }
  return at;
}

// sends the blocks of val chosen by take(rank, block) to other ranks, and calls back(block, turned, value)
// for the received ones, chosen by come(rank, block). In parts, so that messages need little memory
template <class Take, class Come, class Back>
void exchange_blocks(const OwnBlock& own, int D, const std::vector<float>& val, Take take, Come come,
                     Back back)
{
  const int ranks = comm_size(), me = comm_rank(), DD = D * D;
  std::vector<RealVec> send(ranks), from(ranks);
  std::vector<size_t> given(ranks, 0), got(ranks, 0);
  for (bool more = true; more;) {
    more = false;
    for (int r = 0; r < ranks; ++r) {
      if (r == me) continue;
      size_t in = 0;
      send[r].clear();
      const auto give = [&](size_t k, bool turned) {
        send[r].resize(send[r].size() + DD, 0.0);
        add_block(D, turned, &val[k * DD], &send[r][send[r].size() - DD]);
      };
      given[r] = next_blocks(own.to[r], given[r], [&](int k) { return take(r, k); }, give);
      next_blocks(own.to[r], got[r], [&](int k) { return come(r, k); }, [&](size_t, bool) { in += DD; });
      from[r].resize(in);
    }
    comm_exchange(send, from);
    for (int r = 0; r < ranks; ++r) {
      if (r == me) continue;
      const double* value = from[r].data();
      const auto get = [&](size_t k, bool turned) {
        back(k, turned, value);
        value += DD;
      };
      got[r] = next_blocks(own.to[r], got[r], [&](int k) { return come(r, k); }, get);
      more = more || given[r] < own.to[r].size() || got[r] < own.to[r].size();
    }
  }
}

// Two ranks, in one message: both have the same blocks, and get the same sum of two
template <int D>
void sum_direct(const OwnBlock& own, std::vector<float>& val)
{
  const int other = 1 - comm_rank();
  const IntVec& common = own.to[other];
  std::vector<RealVec> send(2), from(2);
  send[other].resize(common.size() * D * D);
  from[other].resize(send[other].size());
  const auto each = [&](auto use) {      // calls use(index into val, index into the message)
    size_t at = 0;
    for (int to : common) {
      const size_t block = static_cast<size_t>(to / 2) * D * D;
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) use(block + (to % 2 ? j * D + i : i * D + j), at + i * D + j);
      at += D * D;
    }
  };
  each([&](size_t k, size_t at) { send[other][at] = static_cast<double>(val[k]); });
  comm_exchange(send, from);
  each([&](size_t k, size_t at) { val[k] += static_cast<float>(from[other][at]); });
}

// in two messages: the first rank with a block sums it, in the order of the ranks, and sends it to the others
void sum_by_first(const OwnBlock& own, int D, std::vector<float>& val)
{
  const int DD = D * D, me = comm_rank();
  IntVec first(val.size() / DD, me);
  for (int r = 0; r < me; ++r)
    for (int to : own.to[r]) first[to / 2] = std::min(first[to / 2], r);
  const auto there = [&](int r, int k) { return first[k] == r; };
  const auto here  = [&](int, int k) { return first[k] == me; };
  exchange_blocks(own, D, val, there, here, [&](size_t k, bool turned, const double* value) {
    add_block(D, turned, value, &val[k * DD]);
  });
  exchange_blocks(own, D, val, here, there, [&](size_t k, bool turned, const double* value) {
    std::fill_n(&val[k * DD], DD, 0.0f);
    add_block(D, turned, value, &val[k * DD]);
  });
}

}  // namespace

void own_sum(const OwnBlock& own, int D, std::vector<float>& val)
{
  if (comm_size() > 2) return sum_by_first(own, D, val);
  with_dim(D, [&](auto d) { sum_direct<decltype(d)::value>(own, val); });
}
