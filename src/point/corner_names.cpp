#include "point/corner_names.h"

#include <cstdint>

#include "base/grow.h"

namespace {

std::uint64_t mix(std::uint64_t h, int x)
{
  h = (h ^ static_cast<std::uint32_t>(x)) * 1099511628211ULL;
  return h ^ h >> 29;
}

bool has_key(const CornerNames& names, int name, int field, const CornerKey& key)
{
  const int first = names.node.off[name];
  if (names.field[name] != field || names.node.count(name) != static_cast<int>(key.size())) return false;
  for (std::size_t i = 0; i < key.size(); ++i)
    if (names.node.item[first + i] != key[i].first || names.weight[first + i] != key[i].second) return false;
  return true;
}

// the table is at most half full
void make_room(CornerNames& names)
{
  if (2 * (names.corner.size() + 1) <= names.place.size()) return;
  names.place.assign(names.place.empty() ? 16 : 2 * names.place.size(), -1);
  const std::size_t mask = names.place.size() - 1;
  for (int name = 0; name < static_cast<int>(names.corner.size()); ++name) {
    std::uint64_t h = mix(0, names.field[name]);
    for (int k = names.node.off[name]; k < names.node.off[name + 1]; ++k)
      h = mix(mix(h, names.node.item[k]), names.weight[k]);
    std::size_t i = h & mask;
    while (names.place[i] >= 0) i = (i + 1) & mask;
    names.place[i] = name;
  }
}

}  // namespace

int& corner_named(int field, const CornerKey& key, CornerNames& names)
{
  make_room(names);
  const std::size_t mask = names.place.size() - 1;
  std::uint64_t h = mix(0, field);
  for (const auto& [node, weight] : key) h = mix(mix(h, node), weight);
  std::size_t i = h & mask;
  for (; names.place[i] >= 0; i = (i + 1) & mask)
    if (has_key(names, names.place[i], field, key)) return names.corner[names.place[i]];
  names.place[i] = static_cast<int>(names.corner.size());
  append(names.field, field);
  append(names.corner, -1);
  for (const auto& [node, weight] : key) {
    append(names.node.item, node);
    append(names.weight, weight);
  }
  append(names.node.off, static_cast<int>(names.node.item.size()));
  return names.corner.back();
}
