#include <algorithm>

#include "base/comm.h"
#include "base/key_number.h"
#include "base/sort_once.h"

namespace {

// first keys of the ranges [ranks - 1] of the ranks, from regular samples of the keys of each rank: a range
// has at most twice the mean number of keys
std::vector<long> find_ranges(std::vector<long> own)
{
  const size_t ranks = comm_size();
  std::sort(own.begin(), own.end());
  std::vector<long> sample, first;
  for (size_t k = 0; k < ranks && !own.empty(); ++k) sample.push_back(own[k * own.size() / ranks]);
  comm_allgatherv(sample);
  std::sort(sample.begin(), sample.end());
  for (size_t r = 1; r < ranks && !sample.empty(); ++r) first.push_back(sample[r * sample.size() / ranks]);
  return first;
}

size_t range_of(const std::vector<long>& first, long key)
{
  return std::upper_bound(first.begin(), first.end(), key) - first.begin();
}

}  // namespace

// ---------------------------------------------------------------------------
// key_numbers : each rank numbers a range of the keys, and sends the numbers to the ranks that need them
// ---------------------------------------------------------------------------
IntVec key_numbers(const std::vector<long>& brings, const std::vector<long>& key, int& all)
{
  const int ranks = comm_size();
  const std::vector<long> first = find_ranges(brings);
  const auto to_ranks = [&](const std::vector<long>& list) {
    std::vector<std::vector<long>> to(ranks);
    for (long k : list) to[range_of(first, k)].push_back(k);
    return comm_exchange(to);
  };
  std::vector<long> known;                           // of the range of this rank
  for (const std::vector<long>& part : to_ranks(brings)) known.insert(known.end(), part.begin(), part.end());
  sort_once(known);
  IntVec count(1, static_cast<int>(known.size()));
  comm_allgatherv(count);
  int before = 0;
  all = 0;
  for (int r = 0; r < ranks; ++r) {
    if (r == comm_rank()) before = all;
    all += count[r];
  }
  std::vector<IntVec> answer(ranks);
  const std::vector<std::vector<long>> asked = to_ranks(key);
  for (int r = 0; r < ranks; ++r)
    for (long k : asked[r]) {
      const auto at = std::lower_bound(known.begin(), known.end(), k);
      answer[r].push_back(at != known.end() && *at == k ? before + static_cast<int>(at - known.begin()) : -1);
    }
  answer = comm_exchange(answer);
  IntVec number, next(ranks, 0);
  for (long k : key) {
    const size_t r = range_of(first, k);
    number.push_back(answer[r][next[r]++]);
  }
  return number;
}
