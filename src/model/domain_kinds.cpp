#include "model/domain_kinds.h"

#include <algorithm>
#include <cstring>

#include "base/grow.h"
#include "base/hash_slots.h"

namespace {

std::uint64_t hash_of(std::size_t n, const double* number)
{
  std::uint64_t h = hash_start;
  for (std::size_t i = 0; i < n; ++i) {
    std::uint64_t bits;
    std::memcpy(&bits, number + i, sizeof bits);
    h = hash_mix(h, bits);
  }
  return h;
}

// count of the numbers of a kind
std::size_t length(const DomainKinds& k, int kind)
{
  const std::size_t next = static_cast<std::size_t>(kind) + 1;
  return (next < k.first.size() ? k.first[next] : k.number.size()) - k.first[kind];
}

// number may point into k.number
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

// index into the table of these numbers, or a free one
std::size_t find_index(std::size_t numbers, const double* number, const DomainKinds& k)
{
  return hash_find(k.table, hash_of(numbers, number), [&](int kind) {
    return length(k, kind) == numbers && std::memcmp(k.at(kind), number, numbers * sizeof(double)) == 0;
  });
}

// removes a kind from the table, and inserts the kinds after it again
void remove_kind(int kind, DomainKinds& k)
{
  const std::size_t mask = k.table.size() - 1, at = find_index(length(k, kind), k.at(kind), k);
  k.table[at] = -1;
  for (std::size_t i = (at + 1) & mask; k.table[i] >= 0; i = (i + 1) & mask) {
    const int other = k.table[i];
    k.table[i]      = -1;
    k.table[find_index(length(k, other), k.at(other), k)] = other;
  }
}

}  // namespace

int domain_kind(int n, int dim, const double* number, DomainKinds& k)
{
  k.dim = dim;
  hash_room(k.table, static_cast<int>(k.first.size()),
            [&](int kind) { return k.users[kind] > 0 && !k.alone[kind]; },
            [&](int kind) { return hash_of(length(k, kind), k.at(kind)); });
  const std::size_t numbers = domain_numbers(n, dim);
  int& kind = k.table[find_index(numbers, number, k)];
  if (kind < 0) return kind = new_kind(numbers, number, false, k);
  ++k.users[kind];
  return kind;
}

int domain_change(int kind, int n, const double* number, DomainKinds& k)
{
  const int now = domain_kind(n, k.dim, number, k);
  if (--k.users[kind] > 0) return now;
  if (!k.alone[kind]) remove_kind(kind, k);
  k.unused.push_back(kind);
  return now;
}

int domain_gradients(int kind, int n, const double* G, DomainKinds& k)
{
  RealVec number(k.at(kind), k.at(kind) + domain_numbers(n, k.dim));
  std::copy_n(G, n * k.dim, &number[n]);
  return domain_change(kind, n, number.data(), k);
}

int domain_own(int kind, DomainKinds& k)
{
  if (k.users[kind] == 1) {
    if (!k.alone[kind]) remove_kind(kind, k);
    k.alone[kind] = 1;
    return kind;
  }
  --k.users[kind];
  return new_kind(length(k, kind), k.at(kind), true, k);
}
