// ---------------------------------------------------------------------------
// archive.h : values to bytes and back
//
// One io routine of a struct serves both directions. It uses structured bindings, so that the program does
// not compile if a new field is missing: IO_FIELDS.
//
// Bytes are written to and read from a file in pieces, so that no rank stores all of them; without a file
// they stay in the archive. On several ranks rank 0 has the file. All ranks read together, and get what rank
// 0 reads. Rank 0 writes alone, or, with arrays divided among the ranks (parts), all write together.
// Bytes are sent from rank 0 to other ranks in the same way (ranks).
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_ARCHIVE_H
#define MPFE_BASE_ARCHIVE_H

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "base/halo.h"
#include "base/hash.h"
#include "base/types.h"

// Items of a divided array: nodes, elements, or Gauss points of elements; material points, their corners;
// items of lists of each point (its corners, pairs of these) or corner (what carries it); bonds, items of
// their side A; faces of general contact
enum ArchiveKind {
  PER_NODE, PER_ELEM, PER_GAUSS, PER_POINT, PER_CORNER, PER_CONN, PER_PAIR, PER_HANG, PER_BOND, PER_SIDE,
  PER_SKIN, ARCHIVE_KINDS
};

struct ArchivePart {           // items of this rank
  bool all = false;            // each rank has all items
  int whole = 0;               // items of all ranks
  IntVec item;                 // index of each among the items of all ranks, ascending
  // ragged: item i has units[i] entries in the array, and none if no rank has it (reading: the file is then
  // invalid); else one
  bool ragged = false;
  IntVec units;
  long all_units = 0;          // reading: of all items; 0: of those that ranks bring
  std::vector<char> brings;    // this rank writes the item; empty: it writes all
  // index of each item, or of its first entry, in the array of this rank; empty: in that order
  IntVec at;
  // reading: item are those that this rank takes, by their index and a number that the file has of each
  std::function<bool(int, int)> takes;
};

// Receivers of bytes from rank 0: none, all other ranks, or (0 or more) one of them. A reader states whether
// it is one of all, or the only one.
enum { NO_RANK = -1 };

struct Archive {
  bool reading = false;
  bool good = true;            // reading: the bytes did not end too early
  std::string bytes;           // writing: not in the file yet; reading: from begin on
  std::size_t at = 0;          // reading: next byte of the content; writing: bytes in the file, or sent
  std::size_t begin = 0;       // position of bytes in the content
  std::size_t size = 0;        // reading from a file: bytes of the content
  std::uint64_t hash = hash_start;     // writing to a file: of what is in it
  bool filed = false;          // there is a file, on rank 0
  std::FILE* file = nullptr;
  long head = 0;               // bytes of the file before the content
  ArchivePart* part = nullptr; // [ARCHIVE_KINDS] arrays are divided among ranks; null: not divided
  int rank = NO_RANK;          // no file: bytes are sent from rank 0 to this rank; their number is unknown
  std::vector<std::shared_ptr<void>> shared;     // objects shared by several values, in order of appearance
  std::size_t end() const { return rank != NO_RANK ? SIZE_MAX : filed ? size : bytes.size(); }
};

// archive_raw : writes or reads plain bytes. Collective when it reads from a file, or sends to all ranks.
void archive_raw(Archive& f, void* data, std::size_t size);

// archive_flush : writes or sends the remaining bytes; hash and at then cover the whole content
void archive_flush(Archive& f);

// archive_divided : writes an array whose items are divided among ranks, as one rank would. Collective.
//   in   one       bytes of a number
//        x         numbers of this rank             [count]
// archive_divided_count : reading: count of numbers for this rank, and for all
// archive_divided_read : reads them
void archive_divided(Archive& f, const ArchivePart& part, std::size_t one, std::size_t count, const char* x);
std::size_t archive_divided_count(Archive& f, const ArchivePart& part, std::size_t& of_all);
void archive_divided_read(Archive& f, const ArchivePart& part, std::size_t one, std::size_t of_all, char* x);

template <class T>
constexpr bool is_plain = std::is_arithmetic<T>::value || std::is_enum<T>::value;

template <class T>
std::enable_if_t<is_plain<T>> io(Archive& f, T& x) { archive_raw(f, &x, sizeof x); }

template <class T, std::size_t N>
void io(Archive& f, T (&x)[N])
{
  for (T& one : x) io(f, one);
}

// number of items; reading: 0 if it is not plausible
inline std::size_t archive_count(Archive& f, std::size_t count)
{
  std::uint64_t n = count;
  io(f, n);
  f.good = f.good && (!f.reading || n <= f.end() - f.at);
  return f.good ? static_cast<std::size_t>(n) : 0;
}

inline void io(Archive& f, std::string& x)
{
  x.resize(archive_count(f, x.size()));
  archive_raw(f, &x[0], x.size());
}

template <class T, std::size_t N>
void io(Archive& f, std::array<T, N>& x)
{
  for (T& one : x) io(f, one);
}

template <class T>
void io(Archive& f, std::map<std::string, T>& x)
{
  std::vector<std::pair<std::string, T>> list(x.begin(), x.end());
  list.resize(archive_count(f, list.size()));
  for (auto& [key, value] : list) {
    io(f, key);
    io(f, value);
  }
  if (f.reading) x = std::map<std::string, T>(list.begin(), list.end());
}

// archive_share : true: the object of x is already in the archive, or x is null; else the object must follow,
// and the reader must create it and append it to f.shared
template <class T>
bool archive_share(Archive& f, std::shared_ptr<T>& x)
{
  const auto known = std::find(f.shared.begin(), f.shared.end(), x);
  int which = x ? static_cast<int>(known - f.shared.begin()) : -1;
  io(f, which);
  if (which < 0) x.reset();
  if (which < 0) return true;
  const bool follows = which >= static_cast<int>(f.shared.size());
  if (!follows && f.reading) x = std::static_pointer_cast<T>(f.shared[which]);
  if (follows && !f.reading) f.shared.push_back(x);
  return !follows;
}

template <class T>
void io(Archive& f, std::vector<T>& x)
{
  x.resize(archive_count(f, x.size()));
  if constexpr (is_plain<T>) archive_raw(f, x.data(), x.size() * sizeof(T));
  else
    for (T& one : x) io(f, one);
}

// Divided : an array whose items are of one of these kinds
template <class T>
struct Divided {
  std::vector<T>& x;
  ArchiveKind kind;
  bool skip = false;           // reading: skipped
};

template <class T>
Divided<T> of_nodes(std::vector<T>& x) { return {x, PER_NODE}; }
template <class T>
Divided<T> of_elems(std::vector<T>& x) { return {x, PER_ELEM}; }
template <class T>
Divided<T> of_gauss(std::vector<T>& x) { return {x, PER_GAUSS}; }
template <class T>
Divided<T> of_points(std::vector<T>& x, bool skip = false) { return {x, PER_POINT, skip}; }
template <class T>
Divided<T> of_corners(std::vector<T>& x, bool skip = false) { return {x, PER_CORNER, skip}; }
template <class T>
Divided<T> of_bonds(std::vector<T>& x) { return {x, PER_BOND}; }

// archive_each : reading: calls use(index, value) for each number of an array, reading a few at a time
template <class T, class Use>
void archive_each(Archive& f, Use use)
{
  const std::size_t n = archive_count(f, 0);
  std::vector<T> some;
  for (std::size_t at = 0; at < n && f.good; at += some.size()) {
    some.resize(std::min<std::size_t>(n - at, 1 << 14));
    archive_raw(f, some.data(), some.size() * sizeof(T));
    for (std::size_t k = 0; k < some.size() && f.good; ++k) use(static_cast<int>(at + k), some[k]);
  }
}

// archive_skip : reading: skips an array
template <class T>
void archive_skip(Archive& f)
{
  const std::size_t n = archive_count(f, 0);
  f.good = f.good && n <= (f.end() - f.at) / sizeof(T);
  if (f.good) f.at += n * sizeof(T);
}

template <class T>
void io(Archive& f, const Divided<T>& d)
{
  static_assert(is_plain<T>, "divided arrays hold numbers");
  if (f.reading && d.skip) return archive_skip<T>(f);
  if (!f.part || f.part[d.kind].all) return io(f, d.x);
  const ArchivePart& part = f.part[d.kind];
  if (!f.reading)
    return archive_divided(f, part, sizeof(T), d.x.size(), reinterpret_cast<const char*>(d.x.data()));
  std::size_t of_all = 0;
  d.x.resize(archive_divided_count(f, part, of_all));
  archive_divided_read(f, part, sizeof(T), of_all, reinterpret_cast<char*>(d.x.data()));
}

template <class... T>
void io_all(Archive& f, T&&... x) { (io(f, x), ...); }

// IO_FIELDS : io of a struct S by its fields; a field that is missing does not compile
#define IO_FIELDS(S, ...)             \
  inline void io(Archive& f, S& x)    \
  {                                   \
    auto& [__VA_ARGS__] = x;          \
    io_all(f, __VA_ARGS__);           \
  }

#endif
