#include <algorithm>
#include <array>
#include <charconv>
#include <iterator>

#include "base/sort_once.h"
#include "deck/deck_state.h"

namespace {

Spot spot_of(const Field& at) { return Spot{at.file, at.line}; }

template <class Named>
std::vector<std::string> names_of(const std::vector<Named>& list)
{
  std::vector<std::string> names;
  for (std::size_t i = 0; i < list.size() && i < 1000; ++i) names.push_back(list[i].name);
  return names;
}

bool is_facet_set(const Deck& d, const std::string& name)
{
  for (const Set& s : d.facets.set)
    if (s.name == name) return true;
  return false;
}

template <class Named>
int target(Deck& d, const Field& at, const std::vector<Named>& list, const char* kind, const char* keyword)
{
  const std::string name = text_upper(at.text);
  for (std::size_t i = 0; i < list.size(); ++i)
    if (list[i].name == name) return static_cast<int>(i);
  // undefined because its elements have an unavailable type, which is reported
  if (d.absent.set.count(name) || (!d.absent.elem.empty() && is_facet_set(d, name))) {
    ++d.messages.errors;
    return -1;
  }
  if (std::string(keyword) == "ELSET" && is_facet_set(d, name)) {
    deck_error(d, at,
               "the elements of set " + name +
                   " are of a lower dimension than the model (T3D2, ...): they define "
                   "a node set and a surface of this name, and have no stress, load or section");
    return -1;
  }
  deck_error(d, at, std::string(kind) + " " + text_show(at.text) + " is not defined (*" + keyword + ")" +
             text_suggest(name, names_of(list)));
  return -1;
}

int index_of(Deck& d, const LabelIndex& index, const Field& at, int label, const char* kind)
{
  const int i = index.find(label);
  if (i < 0 && &index == &d.labels.elem && d.absent.elem.count(label)) ++d.messages.errors;
  else if (i < 0)
    deck_error(d, at, text_format("%s %d is not defined; it must be defined before it is used", kind, label));
  return i;
}

// a set with the label as its name, so that a single node can be used as a set
int set_of_one(std::vector<Set>& sets, const std::string& name, int item, const DeckLine& deck_line)
{
  for (std::size_t i = 0; i < sets.size(); ++i)
    if (sets[i].name == name) return static_cast<int>(i);
  IntVec one{item};
  return set_merge(sets, name, one, deck_line);
}

bool target_items(Deck& d, const Field& at, const std::vector<Set>& sets,
                  const LabelIndex& index, const char* kind, const char* set, const char* keyword,
                  IntVec& item)
{
  int label = 0;
  if (target_label(at.text, label)) {
    const auto parts = d.split.find(label);
    if (&index == &d.labels.elem && parts != d.split.end()) {
      item.insert(item.end(), parts->second.begin(), parts->second.end());
      return true;
    }
    const int i = index_of(d, index, at, label, kind);
    if (i >= 0) item.push_back(i);
    return i >= 0;
  }
  const int i = target(d, at, sets, set, keyword);
  if (i < 0) return false;
  item.insert(item.end(), sets[i].item.begin(), sets[i].item.end());
  if (sets[i].item.empty() && d.absent.set.count(sets[i].name)) ++d.messages.errors;
  else if (sets[i].item.empty()) deck_error(d, at, std::string(set) + " " + sets[i].name + " is empty");
  return !sets[i].item.empty();
}

}  // namespace

int LabelIndex::find(int label) const
{
  if (label >= 0 && label < static_cast<int>(dense.size()) && dense[label] >= 0) return dense[label];
  if (sparse.empty()) return -1;
  const auto i = sparse.find(label);
  return i != sparse.end() ? i->second : -1;
}

void LabelIndex::add(int label, int index)
{
  if (label < 0 || label > 4L * index + 1000) sparse[label] = index;
  else {
    if (label >= static_cast<int>(dense.size())) dense.resize(static_cast<std::size_t>(label) + 1, -1);
    dense[label] = index;
  }
}

int mesh_add_node(Deck& d, Model& m, int label, double x, double y, double z, const Field& at)
{
  const int n = m.mesh.nnode();
  m.mesh.node_label.push_back(label);
  m.mesh.X.insert(m.mesh.X.end(), {x, y, z});
  d.labels.node.add(label, n);
  d.labels.node_spot.push_back(spot_of(at));
  return n;
}

int mesh_add_elem(Deck& d, Model& m, int label, int type, const int* node, const Field& at)
{
  Mesh& mesh = m.mesh;
  const int e = mesh.nelem();
  mesh.elem_label.push_back(label);
  mesh.elem_type.push_back(type);
  mesh.elem_section.push_back(-1);
  mesh.conn.item.insert(mesh.conn.item.end(), node, node + shape_info[elem_table[type].shape].nen);
  mesh.conn.off.push_back(static_cast<int>(mesh.conn.item.size()));
  d.labels.elem.add(label, e);
  d.labels.elem_spot.push_back(spot_of(at));
  return e;
}

// element_type_words : CPE3|CPS3|... for card_param_word
std::string element_type_words()
{
  std::string words;
  for (int i = 0; i < ELEM_TYPES; ++i) words += (i ? "|" : "") + std::string(elem_table[i].name);
  return words;
}

int mesh_max_label(const IntVec& label)
{
  return label.empty() ? 0 : *std::max_element(label.begin(), label.end());
}

void mesh_centroid(const Mesh& mesh, int e, double x[3])
{
  const int n = mesh.conn.count(e);
  for (int i = 0; i < 3; ++i) {
    x[i] = 0.0;
    for (int a = 0; a < n; ++a) x[i] += mesh.X[3 * static_cast<std::size_t>(mesh.conn.begin(e)[a]) + i] / n;
  }
}

// ---------------------------------------------------------------------------
// mesh_free_faces : faces of one element only, compared by their corners, ordered by element
// ---------------------------------------------------------------------------
const std::vector<Face>& mesh_free_faces(Deck& d, const Model& m)
{
  struct Owned { std::array<int, 4> node; Face face; };
  const Mesh& mesh = m.mesh;
  if (d.free.nelem == mesh.nelem()) return d.free.face;
  std::vector<Owned> all;
  for (int e = 0; e < mesh.nelem(); ++e) {
    const ShapeInfo& s = shape_info[elem_table[mesh.elem_type[e]].shape];
    for (int f = 0; f < s.nface; ++f) {
      Owned o{{{-1, -1, -1, -1}}, {e, f}};
      for (int a = 0; a < face_corners(s, f); ++a) o.node[a] = mesh.conn.begin(e)[s.face[f][a]];
      std::sort(o.node.begin(), o.node.end());
      all.push_back(o);
    }
  }
  std::stable_sort(all.begin(), all.end(), [](const Owned& a, const Owned& b) { return a.node < b.node; });
  d.free.face.clear();
  for (std::size_t i = 0, j = 0; i < all.size(); i = j) {
    while (j < all.size() && all[j].node == all[i].node) ++j;
    if (j == i + 1) d.free.face.push_back(all[i].face);
  }
  std::sort(d.free.face.begin(), d.free.face.end(), [](const Face& a, const Face& b) {
    return a.elem != b.elem ? a.elem < b.elem : a.face < b.face;
  });
  d.free.nelem = mesh.nelem();
  return d.free.face;
}

// ---------------------------------------------------------------------------
// set_merge : adds items (in any order) to the set of this name, created if needed. Returns its index.
// ---------------------------------------------------------------------------
int set_merge(std::vector<Set>& sets, const std::string& name, IntVec& item, const DeckLine& deck_line)
{
  sort_once(item);
  for (std::size_t i = 0; i < sets.size(); ++i) {
    if (sets[i].name != name) continue;
    IntVec both;
    std::set_union(sets[i].item.begin(), sets[i].item.end(), item.begin(), item.end(),
                   std::back_inserter(both));
    sets[i].item.swap(both);
    return static_cast<int>(i);
  }
  Set s;
  s.name = name;
  s.item = item;
  s.deck_line = deck_line;
  sets.push_back(s);
  return static_cast<int>(sets.size()) - 1;
}

// target_label : an integer, with or without sign, is a label
bool target_label(const std::string& text, int& label)
{
  const char* last = text.data() + text.size();
  return !text.empty() && std::from_chars(text.data(), last, label).ptr == last &&
         text.find_first_not_of("-0123456789") == std::string::npos;
}

bool target_nodes(Deck& d, const Model& m, const Field& at, IntVec& node)
{
  return !at.empty() && target_items(d, at, m.nset, d.labels.node, "node", "node set", "NSET", node);
}

bool target_elems(Deck& d, const Model& m, const Field& at, IntVec& elem)
{
  return !at.empty() &&
         target_items(d, at, m.elset, d.labels.elem, "element", "element set", "ELSET", elem);
}

int target_nset(Deck& d, Model& m, const Field& at)
{
  int label = 0;
  if (!target_label(at.text, label)) return target(d, at, m.nset, "node set", "NSET");
  const int n = index_of(d, d.labels.node, at, label, "node");
  return n < 0 ? -1 : set_of_one(m.nset, std::to_string(label), n, deck_line_of(d, at));
}

int target_elset(Deck& d, Model& m, const Field& at)
{
  int label = 0;
  if (!target_label(at.text, label)) return target(d, at, m.elset, "element set", "ELSET");
  const auto parts = d.split.find(label);
  if (parts != d.split.end()) {
    IntVec all = parts->second;
    return set_merge(m.elset, std::to_string(label), all, deck_line_of(d, at));
  }
  const int e = index_of(d, d.labels.elem, at, label, "element");
  return e < 0 ? -1 : set_of_one(m.elset, std::to_string(label), e, deck_line_of(d, at));
}

int target_material(Deck& d, const Model& m, const Field& at)
{
  return target(d, at, m.material, "material", "MATERIAL");
}
int target_surface(Deck& d, const Model& m, const Field& at)
{
  return target(d, at, m.surface, "surface", "SURFACE");
}
int target_body(Deck& d, const Model& m, const Field& at)
{
  return target(d, at, m.body, "body", "MATERIAL POINTS");
}
int target_amplitude(Deck& d, const Model& m, const Field& at)
{
  return target(d, at, m.amplitude, "amplitude", "AMPLITUDE");
}
