#include "point/corner_names.h"

#include "base/grow.h"
#include "base/hash_slots.h"

namespace {

std::uint64_t with_node(std::uint64_t h, int node, int weight)
{
  return hash_mix(hash_mix(h, static_cast<std::uint32_t>(node)), static_cast<std::uint32_t>(weight));
}

std::uint64_t hash_of_name(const CornerNames& names, int name)
{
  std::uint64_t h = hash_mix(hash_start, static_cast<std::uint32_t>(names.field[name]));
  for (int k = names.node.off[name]; k < names.node.off[name + 1]; ++k)
    h = with_node(h, names.node.item[k], names.weight[k]);
  return h;
}

bool has_key(const CornerNames& names, int name, int field, const CornerKey& key)
{
  const int first = names.node.off[name];
  if (names.field[name] != field || names.node.count(name) != static_cast<int>(key.size())) return false;
  for (std::size_t i = 0; i < key.size(); ++i)
    if (names.node.item[first + i] != key[i].first || names.weight[first + i] != key[i].second) return false;
  return true;
}

}  // namespace

int& corner_named(int field, const CornerKey& key, CornerNames& names)
{
  hash_room(names.table, static_cast<int>(names.corner.size()), [](int) { return true; },
            [&](int name) { return hash_of_name(names, name); });
  std::uint64_t h = hash_mix(hash_start, static_cast<std::uint32_t>(field));
  for (const auto& [node, weight] : key) h = with_node(h, node, weight);
  int& name = names.table[hash_find(names.table, h, [&](int n) { return has_key(names, n, field, key); })];
  if (name >= 0) return names.corner[name];
  name = static_cast<int>(names.corner.size());
  append(names.field, field);
  append(names.corner, -1);
  for (const auto& [node, weight] : key) {
    append(names.node.item, node);
    append(names.weight, weight);
  }
  append(names.node.off, static_cast<int>(names.node.item.size()));
  return names.corner.back();
}
