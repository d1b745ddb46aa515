#include "model/domain_kinds.h"

#include <algorithm>
#include <cstdint>
#include <cstring>

#include "base/grow.h"

namespace {

std::uint64_t hash_of(std::size_t n, const double* number)
{
  std::uint64_t h = 14695981039346656037ULL;
  for (std::size_t i = 0; i < n; ++i) {
    std::uint64_t bits;
    std::memcpy(&bits, number + i, sizeof bits);
    h = (h ^ bits) * 1099511628211ULL;
    h ^= h >> 29;
  }
  return h;
}

// numbers of a kind
std::size_t length(const DomainKinds& k, int kind)
{
  const std::size_t next = static_cast<std::size_t>(kind) + 1;
  return (next < k.first.size() ? k.first[next] : k.number.size()) - k.first[kind];
}

// numbers may lie in those of k
int new_kind(std::size_t numbers, const double* number, bool alone, DomainKinds& k)
{
  for (std::size_t i = k.unused.size(); i-- > 0;) {
    const int kind = k.unused[i];
    if (length(k, kind) != numbers) continue;
    k.unused.erase(k.unused.begin() + static_cast<long>(i));
    std::copy_n(number, numbers, &k.number[k.first[kind]]);
    k.users[kind] = 1;
    k.alone[kind] = alone;
    return kind;
  }
  const RealVec copy(number, number + numbers);
  append(k.first, k.number.size());
  append(k.users, 1);
  append(k.alone, static_cast<char>(alone));
  append(k.number, copy.data(), copy.data() + numbers);
  return static_cast<int>(k.first.size()) - 1;
}

// place in the table of these numbers, or the free one where they belong
std::size_t find_place(std::size_t numbers, const double* number, const DomainKinds& k)
{
  const std::size_t mask = k.place.size() - 1;
  std::size_t i = hash_of(numbers, number) & mask;
  for (; k.place[i] >= 0; i = (i + 1) & mask) {
    const int kind = k.place[i];
    if (length(k, kind) == numbers && std::memcmp(k.at(kind), number, numbers * sizeof(double)) == 0) break;
  }
  return i;
}

// the table is at most half full
void make_room(DomainKinds& k)
{
  if (2 * (k.first.size() + 1) <= k.place.size()) return;
  k.place.assign(k.place.empty() ? 16 : 2 * k.place.size(), -1);
  for (int kind = 0; kind < static_cast<int>(k.first.size()); ++kind)
    if (k.users[kind] > 0 && !k.alone[kind]) k.place[find_place(length(k, kind), k.at(kind), k)] = kind;
}

// a kind leaves the table; those behind it, which it may have kept from their place, are put there again
void leave_table(int kind, DomainKinds& k)
{
  const std::size_t mask = k.place.size() - 1, at = find_place(length(k, kind), k.at(kind), k);
  k.place[at] = -1;
  for (std::size_t i = (at + 1) & mask; k.place[i] >= 0; i = (i + 1) & mask) {
    const int other = k.place[i];
    k.place[i]      = -1;
    k.place[find_place(length(k, other), k.at(other), k)] = other;
  }
}

}  // namespace

int domain_kind(int n, int dim, const double* number, DomainKinds& k)
{
  k.dim = dim;
  make_room(k);
  const std::size_t numbers = domain_numbers(n, dim);
  int& place = k.place[find_place(numbers, number, k)];
  if (place < 0) return place = new_kind(numbers, number, false, k);
  ++k.users[place];
  return place;
}

int domain_change(int kind, int n, const double* number, DomainKinds& k)
{
  const int now = domain_kind(n, k.dim, number, k);
  if (--k.users[kind] > 0) return now;
  if (!k.alone[kind]) leave_table(kind, k);
  k.unused.push_back(kind);
  return now;
}

int domain_own(int kind, DomainKinds& k)
{
  if (k.users[kind] == 1) {
    if (!k.alone[kind]) leave_table(kind, k);
    k.alone[kind] = 1;
    return kind;
  }
  --k.users[kind];
  return new_kind(length(k, kind), k.at(kind), true, k);
}
