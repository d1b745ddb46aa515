// ---------------------------------------------------------------------------
// hash.h : checksums of bytes and numbers
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_HASH_H
#define MPFE_BASE_HASH_H

#include <cstddef>
#include <cstdint>

// hash_add : FNV-1a of more bytes, from hash_start on
const std::uint64_t hash_start = 14695981039346656037ull;

inline std::uint64_t hash_add(std::uint64_t hash, const void* data, std::size_t size)
{
  const unsigned char* byte = static_cast<const unsigned char*>(data);
  for (std::size_t i = 0; i < size; ++i) hash = (hash ^ byte[i]) * 1099511628211ull;
  return hash;
}

// hash_mix : adds one number to a hash, a word at a time; the high bits are mixed into the low ones
inline std::uint64_t hash_mix(std::uint64_t h, std::uint64_t x)
{
  h = (h ^ x) * 1099511628211ULL;
  return h ^ h >> 29;
}

#endif
