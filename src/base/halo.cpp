#include <algorithm>
#include <cstdint>
#include <unordered_map>

#include "base/halo.h"

namespace {

// the rank that is asked who has a key
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

// [ranks] the keys that this rank and that one have, ascending
std::vector<std::vector<Holder>> ask_directory(const std::vector<long>& key)
{
  const int ranks = comm_size();
  std::vector<std::vector<long>> ask(ranks);
  for (long k : key) ask[directory(k, ranks)].push_back(k);
  std::vector<Holder> all;
  const std::vector<std::vector<long>> asked = comm_exchange(ask);
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
// halo_form : who has what, by a directory of the keys that is spread over the ranks
//
// A thing of several ranks belongs to one of them, which follows from these ranks alone, so that each pair
// of neighbours has one owner and boundaries stay smooth.
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

void halo_sum(const Halo& h, int D, const std::vector<RealVec*>& v, double* number, int m)
{
  const int ranks = comm_size(), me = comm_rank();
  const auto at = [D](RealVec& x, int k) { return x.data() + static_cast<std::size_t>(k) * D; };
  std::vector<RealVec> to(ranks), from(ranks);
  for (int r = 0; r < ranks; ++r) {
    if (r == me) continue;
    to[r].reserve(m + h.common[r].size() * D * v.size());
    to[r].assign(number, number + m);
    for (RealVec* x : v)
      for (int k : h.common[r]) to[r].insert(to[r].end(), at(*x, k), at(*x, k) + D);
    from[r].resize(to[r].size());
  }
  const RealVec own(number, number + m);
  RealVec part;
  part.reserve(h.shared.size() * D * v.size());
  for (RealVec* x : v)
    for (int k : h.shared)
      for (int i = 0; i < D; ++i) {
        double& value = at(*x, k)[i];
        part.push_back(value);
        value = 0.0;
      }
  comm_exchange(to, from);
  std::fill(number, number + m, 0.0);
  for (int r = 0; r < ranks; ++r) {
    const double* next = r == me ? own.data() : from[r].data();
    for (int i = 0; i < m; ++i) number[i] += *next++;
    if (r == me) next = part.data();
    for (RealVec* x : v)
      for (int k : r == me ? h.shared : h.common[r])
        for (int i = 0; i < D; ++i) at(*x, k)[i] += *next++;
  }
}
