#include <algorithm>

#include "deck/card.h"

namespace {

// nodes of an element may continue in the next line
void join_lines(Card& card, int wanted)
{
  bool keyword = false;
  while (static_cast<int>(card.field.size()) < wanted && deck_peek(*card.deck, keyword) && !keyword) {
    if (!card.comma) return;
    card_join(card);
  }
}

// false: the label is in use, which is reported
bool label_is_new(Card& card, int label)
{
  const int old = card.deck->labels.elem.find(label);
  if (old < 0 && !card.deck->facets.index.count(label)) return true;
  std::string where;
  if (old >= 0) where = ", in " + spot_text(*card.deck, card.deck->labels.elem_spot[old]);
  card_error(card, card.field[0],
             text_format("element %d is defined already", label) + where + "; give it another label");
  return false;
}

// an edge of three nodes in any order: moves the middle node to the end; the end nodes are furthest apart
void middle_last(const Mesh& mesh, Facet& f)
{
  const auto distance = [&](int a, int b) {
    double sum = 0.0;
    for (int i = 0; i < 3; ++i) {
      const double d = mesh.X[3 * static_cast<std::size_t>(f.node[a]) + i] -
                       mesh.X[3 * static_cast<std::size_t>(f.node[b]) + i];
      sum += d * d;
    }
    return sum;
  };
  const double opposite[3] = {distance(1, 2), distance(2, 0), distance(0, 1)};
  const long middle = std::max_element(opposite, opposite + 3) - opposite;
  std::swap(f.node[middle], f.node[2]);
}

// index of the a-th node of an element, -1: an error in the line
int read_node(Card& card, int a, int label)
{
  const int number = card_label(card, "node"), n = card.deck->labels.node.find(number);
  if (card_good(card) && n < 0)
    card_error(card, card.field[a + 1],
               text_format("node %d of element %d is not defined; *NODE must precede *ELEMENT", number,
                           label));
  return card_good(card) ? n : -1;
}

// reads elements of a lower dimension than the model
void read_facets(Card& card, Model& model, int nen, int corners)
{
  Deck& d = *card.deck;
  const std::string set = card_param_name(card, "ELSET");
  IntVec item;
  while (card_line(card)) {
    join_lines(card, nen + 1);
    const int label = card_label(card, "element label");
    Facet f;
    f.n       = nen;
    f.corners = corners;
    for (int a = 0; a < nen; ++a) {
      f.node[a] = read_node(card, a, label);
      if (!card_good(card)) break;
    }
    if (!card_good(card) || !label_is_new(card, label)) continue;
    if (nen == 3 && corners == 2) middle_last(model.mesh, f);
    item.push_back(static_cast<int>(d.facets.list.size()));
    facet_add(d, label, f);
  }
  if (!set.empty()) facet_set_merge(d, model, set, item, card_deck_line(card));
}

// reads elements of an unavailable type, which are reported once at the end of the mesh. remedy: empty for a
// misspelt type, which has been reported
void read_absent(Card& card, const std::string& remedy)
{
  const int max_fields = 100;  // of an element
  Deck& d = *card.deck;
  const std::string set = card_param_name(card, "ELSET");
  if (!set.empty()) d.absent.set.insert(set);
  long count = 0;
  while (card_line(card)) {
    join_lines(card, max_fields);
    d.absent.elem.insert(card_label(card, "element label"));
    card.next = card.field.size();
    ++count;
  }
  if (remedy.empty()) return;
  const Field& at        = card_param(card, "TYPE")->value;
  const std::string type = text_squeeze(element_type_here(d, at.text));
  for (Absent& a : d.absent.type)
    if (a.type == type) {
      a.count += count;
      return;
    }
  d.absent.type.push_back({type, remedy, at, count});
}

}  // namespace

// ---------------------------------------------------------------------------
// *ELEMENT, TYPE=[, ELSET=] : label, nodes
// Types of a lower dimension than the model define node sets and surfaces (deck_facet.cpp).
// ---------------------------------------------------------------------------
void kw_element(Card& card, Model& model)
{
  const HeadParam* const named = card_param(card, "TYPE");
  int corners     = 0;
  const int facet = named ? facet_nodes(element_type_here(*card.deck, named->value.text), model.dim, corners)
                          : 0;
  if (facet) return read_facets(card, model, facet, corners);
  std::string remedy;
  const int type = card_param_element(card, &remedy);
  if (type < 0 && named) return read_absent(card, remedy);
  const std::string set = card_param_name(card, "ELSET");
  const int nen = type < 0 ? 0 : shape_info[elem_table[type].shape].nen;
  IntVec item;
  while (type >= 0 && card_line(card)) {
    join_lines(card, nen + 1);
    const int label = card_label(card, "element label");
    int node[MAX_NODES];
    for (int a = 0; a < nen; ++a) {
      node[a] = read_node(card, a, label);
      if (card_good(card) && std::find(node, node + a, node[a]) != node + a)
        card_error(card, card.field[a + 1], text_format("element %d has node %d twice", label,
                                                        model.mesh.node_label[node[a]]));
      if (!card_good(card)) break;
    }
    if (!card_good(card)) continue;
    if (!label_is_new(card, label)) continue;
    item.push_back(mesh_add_elem(*card.deck, model, label, type, node, card.whole));
  }
  if (!set.empty()) set_merge(model.elset, set, item, card_deck_line(card));
}
