#include <algorithm>
#include <cstdint>
#include <unordered_map>

#include "base/halo.h"
#include "base/halo_numbers.h"

namespace {

// the rank that keeps the directory entry of a key
int directory(long key, int ranks)
{
  const std::uint64_t mixed = static_cast<std::uint64_t>(key) * 0x9E3779B97F4A7C15u;
  return static_cast<int>((mixed >> 33) % static_cast<std::uint64_t>(ranks));
}

struct Holder {
  long key;
  int rank;
  bool operator<(const Holder& b) const { return key != b.key ? key < b.key : rank < b.rank; }
};

// [ranks] keys shared with that rank, ascending
std::vector<std::vector<Holder>> ask_directory(const std::vector<long>& key)
{
  const int ranks = comm_size();
  std::vector<std::vector<long>> request(ranks);
  for (long k : key) request[directory(k, ranks)].push_back(k);
  std::vector<Holder> all;
  const std::vector<std::vector<long>> asked = comm_exchange(request);
  for (int r = 0; r < ranks; ++r)
    for (long k : asked[r]) all.push_back({k, r});
  std::sort(all.begin(), all.end());
  std::vector<std::vector<Holder>> tell(ranks);
  for (std::size_t i = 0, j = 0; i < all.size(); i = j) {
    while (j < all.size() && all[j].key == all[i].key) ++j;
    for (std::size_t a = i; a < j && j - i > 1; ++a)
      for (std::size_t b = i; b < j; ++b) tell[all[a].rank].push_back(all[b]);
  }
  return comm_exchange(tell);
}

}  // namespace

// ---------------------------------------------------------------------------
// halo_form : uses a directory of the keys that is distributed over the ranks
//
// The owner of a shared item is determined by the set of its ranks alone, so that each pair of neighbours has
// one owner and boundaries stay smooth.
// ---------------------------------------------------------------------------
void halo_form(const std::vector<long>& key, Halo& h)
{
  const int me = comm_rank();
  h = Halo();
  h.common.resize(comm_size());
  h.owner.assign(key.size(), me);
  std::vector<Holder> all;
  for (const std::vector<Holder>& part : ask_directory(key)) all.insert(all.end(), part.begin(), part.end());
  std::sort(all.begin(), all.end());
  std::unordered_map<long, int> index;
  for (const Holder& a : all) index[a.key] = -1;
  for (std::size_t i = 0; i < key.size(); ++i) {
    const auto it = index.find(key[i]);
    if (it != index.end()) it->second = static_cast<int>(i);
  }
  for (std::size_t i = 0, j = 0; i < all.size(); i = j) {
    const int k = index[all[i].key];
    int sum = 0;
    for (; j < all.size() && all[j].key == all[i].key; ++j) {
      if (all[j].rank != me) h.common[all[j].rank].push_back(k);
      sum += all[j].rank;
    }
    h.owner[k] = all[i + static_cast<std::size_t>(sum) % (j - i)].rank;
    h.shared.push_back(k);
  }
  std::sort(h.shared.begin(), h.shared.end());
}

void halo_renumber(const IntVec& index, Halo& h)
{
  for (IntVec& of : h.common)
    for (int& k : of) k = index[k];
  for (int& k : h.shared) k = index[k];
}

namespace {

// calls use(index into v, index into the message) for the D numbers of each item of list
template <int FIXED, class Use>
void each_number(const IntVec& list, int D, Use use)
{
  const std::size_t n = FIXED ? FIXED : D;
  std::size_t at = 0;
  for (int k : list)
    for (std::size_t i = 0; i < n; ++i) use(static_cast<std::size_t>(k) * n + i, at++);
}

template <class Use>
void each_number(const IntVec& list, int D, Use use)
{
  if (D == 3) each_number<3>(list, D, use);
  else if (D == 2) each_number<2>(list, D, use);
  else if (D == 1) each_number<1>(list, D, use);
  else each_number<0>(list, D, use);
}

// calls use(vector, its numbers in the message) for each vector, from index at on
template <class T, class Use>
void each_vector(const std::vector<RealVec*>& v, std::size_t numbers, T* at, Use use)
{
  for (RealVec* x : v) {
    use(x->data(), at);
    at += numbers;
  }
}

// adds the numbers of a message to x
void add_numbers(const IntVec& list, int D, const double* from, double* x)
{
  each_number(list, D, [&](std::size_t k, std::size_t at) { x[k] += from[at]; });
}

// x of v = sum in the order of the ranks; from [ranks]: m numbers and the values of the shared items
void add_in_order(const Halo& h, int D, const std::vector<RealVec*>& v, const std::vector<RealVec>& from,
                  int m)
{
  const int me = comm_rank();
  RealVec part(h.shared.size() * D * v.size());
  each_vector(v, h.shared.size() * D, part.data(), [&](double* x, double* own) {
    each_number(h.shared, D, [&](std::size_t k, std::size_t at) {
      own[at] = x[k];
      x[k]    = 0.0;
    });
  });
  for (std::size_t r = 0; r < from.size(); ++r) {
    const bool here    = static_cast<int>(r) == me;
    const IntVec& list = here ? h.shared : h.common[r];
    each_vector(v, list.size() * D, here ? part.data() : from[r].data() + m,
                [&](double* x, const double* of) { add_numbers(list, D, of, x); });
  }
}

}  // namespace

void halo_sum(const Halo& h, int D, const std::vector<RealVec*>& v, double* number, int m)
{
  const int ranks = comm_size(), me = comm_rank();
  std::vector<RealVec> to(ranks), from(ranks);
  for (int r = 0; r < ranks; ++r) {
    if (r == me) continue;
    to[r].resize(m + h.common[r].size() * D * v.size());
    from[r].resize(to[r].size());
    std::copy(number, number + m, to[r].begin());
    each_vector(v, h.common[r].size() * D, to[r].data() + m, [&](const double* x, double* out) {
      each_number(h.common[r], D, [&](std::size_t k, std::size_t at) { out[at] = x[k]; });
    });
  }
  comm_exchange(to, from);
  from[me].assign(number, number + m);
  std::fill(number, number + m, 0.0);
  for (const RealVec& of : from)
    for (int i = 0; i < m; ++i) number[i] += of[i];
  if (ranks != 2) return add_in_order(h, D, v, from, m);
  // a sum of two numbers is equal on both ranks
  const IntVec& list = h.common[1 - me];
  each_vector(v, list.size() * D, from[1 - me].data() + m,
              [&](double* x, const double* of) { add_numbers(list, D, of, x); });
}

namespace {

// calls use(index of the item) for the items of list with this owner
template <class Use>
void each_owned(const Halo& h, const IntVec& list, int owner, Use use)
{
  for (int k : list)
    if (h.owner[k] == owner) use(static_cast<std::size_t>(k));
}

}  // namespace

void halo_numbers(const Halo& h, int D, const std::vector<RealVec*>& v)
{
  const int ranks = comm_size(), me = comm_rank();
  const std::size_t n = D;
  std::vector<RealVec> to(ranks), from(ranks);
  for (std::size_t r = 0; r < h.common.size(); ++r) {
    const IntVec& list = h.common[r];
    std::size_t owned = 0, others = 0;
    each_owned(h, list, me, [&](std::size_t) { ++owned; });
    each_owned(h, list, static_cast<int>(r), [&](std::size_t) { ++others; });
    from[r].resize(others * n * v.size());
    to[r].reserve(owned * n * v.size());
    each_owned(h, list, me, [&](std::size_t k) {
      for (const RealVec* x : v)
        for (std::size_t i = 0; i < n; ++i) to[r].push_back((*x)[k * n + i]);
    });
  }
  comm_exchange(to, from);
  for (std::size_t r = 0; r < h.common.size(); ++r) {
    std::size_t at = 0;
    each_owned(h, h.common[r], static_cast<int>(r), [&](std::size_t k) {
      for (RealVec* x : v)
        for (std::size_t i = 0; i < n; ++i) (*x)[k * n + i] = from[r][at++];
    });
  }
}
