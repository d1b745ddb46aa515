#include <algorithm>

#include "deck/card.h"

namespace {

// nodes of an element may go on in the next line
void join_lines(Card& card, int wanted)
{
  bool keyword = false;
  while (static_cast<int>(card.field.size()) < wanted && deck_peek(*card.deck, keyword) && !keyword) {
    if (!card.comma) return;
    card_join(card);
  }
}

}  // namespace

// ---------------------------------------------------------------------------
// *ELEMENT, TYPE=[, ELSET=] : label, nodes
// ---------------------------------------------------------------------------
void kw_element(Card& card, Model& model)
{
  Mesh& mesh = model.mesh;
  const int type = card_param_element(card);
  const std::string set = card_param_name(card, "ELSET");
  const int nen = type < 0 ? 0 : shape_info[elem_table[type].shape].nen;
  IntVec item;
  while (type >= 0 && card_line(card)) {
    join_lines(card, nen + 1);
    const int label = card_label(card, "element label");
    int node[8];
    for (int a = 0; a < nen; ++a) {
      const int number = card_label(card, "node");
      const auto n = mesh.node_index.find(number);
      if (card_good(card) && n == mesh.node_index.end())
        card_error(card, card.field[a + 1], text_format("node %d of element %d is not defined; *NODE must stand before *ELEMENT", number, label));
      node[a] = card_good(card) ? n->second : -1;
      if (card_good(card) && std::find(node, node + a, node[a]) != node + a)
        card_error(card, card.field[a + 1], text_format("element %d has node %d twice", label, number));
      if (!card_good(card)) break;
    }
    if (!card_good(card)) continue;
    const auto old = mesh.elem_index.find(label);
    if (old != mesh.elem_index.end())
      card_error(card, card.field[0], text_format("element %d is defined already, in ", label) +
                 spot_text(*card.deck, card.deck->elem_spot[old->second]) + "; give it another label");
    else item.push_back(mesh_add_elem(*card.deck, model, label, type, node, card.whole));
  }
  if (!set.empty()) set_merge(model.elset, set, item, card_place(card));
}
