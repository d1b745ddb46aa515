// ---------------------------------------------------------------------------
// archive.h : values to bytes and back
//
// One io routine of a struct serves both ways: it hands all its fields to io_all. Structured bindings in it
// see to it that a new field cannot be forgotten: the program does not compile then.
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_ARCHIVE_H
#define MPFE_BASE_ARCHIVE_H

#include <cstdint>
#include <cstring>
#include <string>
#include <type_traits>
#include <vector>

struct Archive {
  bool reading = false;
  bool good = true;            // reading: the bytes did not end too early
  std::string bytes;
  std::size_t at = 0;          // reading: next byte
};

inline void archive_raw(Archive& f, void* data, std::size_t size)
{
  if (!f.reading) {
    f.bytes.append(static_cast<const char*>(data), size);
    return;
  }
  f.good = f.good && size <= f.bytes.size() - f.at;
  if (!f.good || size == 0) return;
  std::memcpy(data, f.bytes.data() + f.at, size);
  f.at += size;
}

template <class T>
constexpr bool is_plain = std::is_arithmetic<T>::value || std::is_enum<T>::value;

template <class T>
std::enable_if_t<is_plain<T>> io(Archive& f, T& x) { archive_raw(f, &x, sizeof x); }

template <class T, std::size_t N>
void io(Archive& f, T (&x)[N])
{
  for (T& one : x) io(f, one);
}

// number of items; reading: none when it cannot be right
inline std::size_t archive_count(Archive& f, std::size_t count)
{
  std::uint64_t n = count;
  io(f, n);
  f.good = f.good && (!f.reading || n <= f.bytes.size() - f.at);
  return f.good ? static_cast<std::size_t>(n) : 0;
}

inline void io(Archive& f, std::string& x)
{
  x.resize(archive_count(f, x.size()));
  archive_raw(f, &x[0], x.size());
}

template <class T>
void io(Archive& f, std::vector<T>& x)
{
  x.resize(archive_count(f, x.size()));
  if constexpr (is_plain<T>) archive_raw(f, x.data(), x.size() * sizeof(T));
  else
    for (T& one : x) io(f, one);
}

template <class... T>
void io_all(Archive& f, T&... x) { (io(f, x), ...); }

#endif
