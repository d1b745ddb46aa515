#include "base/archive.h"

#include <algorithm>
#include <cstring>

#include "base/comm.h"

namespace {

// bytes written, sent or read at once; bytes of a divided array that rank 0 stores at once: memory against
// the number of messages  (test: Archive.DividedArraysAreThoseOfTheWhole)
const std::size_t CHUNK = 1 << 18;
const long WINDOW = 1 << 19;

// number of items of a divided array that rank 0 stores at once; tests make it small, together with messages
long window(std::size_t bytes, int items)
{
  const double most = WINDOW / std::max(1.0, static_cast<double>(bytes) / std::max(1, items));
  return std::max(16L, std::min({65536L, static_cast<long>(most), comm_piece() >> 14}));
}

bool goes_on(const Archive& f) { return f.file || f.rank != NO_RANK; }

void hand_on(Archive& f)
{
  if (f.bytes.empty()) return;
  if (f.rank != NO_RANK) comm_send(f.bytes, f.rank);
  else {
    std::fwrite(f.bytes.data(), 1, f.bytes.size(), f.file);    // a full disk is detected at closing
    f.hash = hash_add(f.hash, f.bytes.data(), f.bytes.size());
  }
  f.at += f.bytes.size();
  f.bytes.clear();
}

// rank 0: n bytes of the content from at on; fewer when the file has changed
std::size_t from_file(Archive& f, std::size_t at, char* to, std::size_t n)
{
  if (std::fseek(f.file, f.head + static_cast<long>(at), SEEK_SET) != 0) return 0;
  return std::fread(to, 1, n, f.file);
}

// the next bytes of the content, on all ranks
void refill(Archive& f)
{
  f.bytes.clear();
  if (f.filed && comm_rank() == 0) {
    f.bytes.resize(std::min(CHUNK, f.size - f.at));
    f.bytes.resize(from_file(f, f.at, &f.bytes[0], f.bytes.size()));
  }
  if (f.rank != NO_RANK) comm_receive(f.bytes, 0);
  else if (f.filed) comm_bcast(f.bytes);
  f.begin = f.at;
  f.good  = !f.bytes.empty();
}

std::size_t local_units(const ArchivePart& p)
{
  std::size_t n = p.item.size();
  if (p.ragged) {
    n = 0;
    for (int u : p.units) n += static_cast<std::size_t>(u);
  }
  return n;
}

std::size_t whole_units(const ArchivePart& p)
{
  if (!p.ragged) return static_cast<std::size_t>(p.whole);
  if (p.all_units > 0) return static_cast<std::size_t>(p.all_units);
  double n = 0.0;
  for (std::size_t i = 0; i < p.units.size(); ++i)
    if (p.brings.empty() || p.brings[i]) n += p.units[i];
  comm_sum(&n, 1);
  return static_cast<std::size_t>(n);
}

// The items of a rank in a window of the whole array: they are consecutive in the rank's own array
struct Slice {
  std::size_t first = 0, last = 0;     // of ArchivePart::item
  std::size_t unit = 0, units = 0;     // their first index in the array of the rank, and their number
};

Slice next_slice(const ArchivePart& p, long hi, const Slice& before)
{
  Slice s;
  s.first = s.last = before.last;
  s.unit = before.unit + before.units;
  for (; s.last < p.item.size() && p.item[s.last] < hi; ++s.last)
    s.units += static_cast<std::size_t>(p.ragged ? p.units[s.last] : 1);
  return s;
}

struct Item { int index, units; };

std::vector<Item> items_of(const ArchivePart& p, const Slice& s, bool writing)
{
  std::vector<Item> list;
  for (std::size_t i = s.first; i < s.last; ++i)
    if (!writing || p.brings.empty() || p.brings[i]) list.push_back({p.item[i], p.ragged ? p.units[i] : 1});
  return list;
}

// rank 0: offsets of the items [lo, hi) in the window                    [hi - lo + 1] units
std::vector<std::size_t> starts(const std::vector<std::vector<Item>>& list, bool ragged, long lo, long hi)
{
  std::vector<std::size_t> at(static_cast<std::size_t>(hi - lo) + 1, ragged ? 0 : 1);
  for (const std::vector<Item>& of_rank : list)
    for (const Item& i : of_rank) at[i.index - lo] = static_cast<std::size_t>(i.units);
  std::size_t sum = 0;
  for (std::size_t& n : at) {
    const std::size_t own = n;
    n = sum;
    sum += own;
  }
  return at;
}

}  // namespace

void archive_raw(Archive& f, void* data, std::size_t size)
{
  if (!f.reading) {
    if (f.part && comm_rank() > 0) return;
    for (std::size_t at = 0; at < size;) {
      const std::size_t n = goes_on(f) ? std::min(size - at, CHUNK - f.bytes.size()) : size;
      f.bytes.append(static_cast<const char*>(data) + at, n);
      at += n;
      if (goes_on(f) && f.bytes.size() == CHUNK) hand_on(f);
    }
    return;
  }
  f.good = f.good && size <= f.end() - f.at;
  char* next = static_cast<char*>(data);
  while (f.good && size > 0) {
    if (f.at >= f.begin + f.bytes.size()) refill(f);
    const std::size_t n = std::min(size, f.begin + f.bytes.size() - f.at);
    std::memcpy(next, f.bytes.data() + (f.at - f.begin), n);
    next += n;
    f.at += n;
    size -= n;
  }
}

void archive_flush(Archive& f)
{
  if (goes_on(f)) hand_on(f);
}

void archive_divided(Archive& f, const ArchivePart& part, std::size_t one, std::size_t count, const char* x)
{
  const std::size_t local = local_units(part);
  double each = local > 0 ? static_cast<double>(count / local) : 0.0;
  comm_max(&each, 1);
  const std::size_t unit = one * static_cast<std::size_t>(each);         // bytes
  const std::size_t all_units = whole_units(part);
  archive_count(f, static_cast<std::size_t>(each) * all_units);
  if (unit == 0) return;
  Slice s;
  const long chunk = window(unit * all_units, part.whole);
  for (long lo = 0; lo < part.whole; lo += chunk) {
    const long hi = std::min(lo + chunk, static_cast<long>(part.whole));
    s = next_slice(part, hi, s);
    std::vector<char> own;
    std::size_t at = s.unit;
    for (std::size_t i = s.first; i < s.last; ++i) {
      const std::size_t units = static_cast<std::size_t>(part.ragged ? part.units[i] : 1);
      const char* from = x + (part.at.empty() ? at : static_cast<std::size_t>(part.at[i])) * unit;
      if (part.brings.empty() || part.brings[i]) own.insert(own.end(), from, from + units * unit);
      at += units;
    }
    const auto list = comm_gather(items_of(part, s, true));
    const auto data = comm_gather(std::move(own));
    if (comm_rank() > 0) continue;
    const std::vector<std::size_t> start = starts(list, part.ragged, lo, hi);
    std::vector<char> all(start.back() * unit, 0);
    for (std::size_t r = 0; r < list.size(); ++r) {
      const char* next = data[r].data();
      for (const Item& i : list[r]) {
        const std::size_t n = static_cast<std::size_t>(i.units) * unit;
        std::copy_n(next, n, all.data() + start[i.index - lo] * unit);
        next += n;
      }
    }
    archive_raw(f, all.data(), all.size());
  }
}

std::size_t archive_divided_count(Archive& f, const ArchivePart& part, std::size_t& of_all)
{
  of_all = archive_count(f, 0);
  const std::size_t units = whole_units(part);
  f.good = f.good && (units == 0 ? of_all == 0 : of_all % units == 0);
  if (!f.good || units == 0) of_all = 0;
  return of_all == 0 ? 0 : of_all / units * local_units(part);
}

void archive_divided_read(Archive& f, const ArchivePart& part, std::size_t one, std::size_t of_all, char* x)
{
  f.good = f.good && of_all <= (f.end() - f.at) / one;
  if (!f.good || of_all == 0) return;
  const std::size_t unit = of_all / whole_units(part) * one;             // bytes
  std::size_t from = f.at;
  int good = 1;
  Slice s;
  const long chunk = window(of_all * one, part.whole);
  for (long lo = 0; lo < part.whole; lo += chunk) {
    const long hi = std::min(lo + chunk, static_cast<long>(part.whole));
    s = next_slice(part, hi, s);
    const auto list = comm_gather(items_of(part, s, false));
    std::vector<std::vector<char>> to(comm_size());
    if (comm_rank() == 0) {
      const std::vector<std::size_t> start = starts(list, part.ragged, lo, hi);
      std::vector<char> all(start.back() * unit);
      good = good && from_file(f, from, all.data(), all.size()) == all.size();
      from += all.size();
      for (std::size_t r = 0; r < list.size(); ++r)
        for (const Item& i : list[r]) {
          const char* first = all.data() + start[i.index - lo] * unit;
          to[r].insert(to[r].end(), first, first + static_cast<std::size_t>(i.units) * unit);
        }
    }
    const std::vector<std::vector<char>> got = comm_exchange(to);
    if (part.at.empty()) {
      std::copy(got[0].begin(), got[0].end(), x + s.unit * unit);
      continue;
    }
    const char* next = got[0].data();
    for (std::size_t i = s.first; i < s.last; ++i, next += unit)
      std::copy_n(next, unit, x + static_cast<std::size_t>(part.at[i]) * unit);
  }
  f.at += of_all * one;
  if (comm_rank() == 0) good = good && from == f.at;   // else ragged: no rank takes an item
  f.begin = f.at;
  f.bytes.clear();
  f.good = comm_bcast(good) == 1;
}
