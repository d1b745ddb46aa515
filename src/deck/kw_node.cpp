#include "deck/card.h"

// ---------------------------------------------------------------------------
// *NODE[, NSET=] : label[, x[, y[, z]]]; missing or blank coordinates are 0
// ---------------------------------------------------------------------------
void kw_node(Card& card, Model& model)
{
  const std::string set = card_param_name(card, "NSET");
  IntVec item;
  while (card_line(card)) {
    const int label = card_label(card, "node label");
    const double x = card_real_or(card, "x", 0.0, any_number());
    const double y = card_real_or(card, "y", 0.0, any_number());
    const double z = card_real_or(card, "z", 0.0, any_number());
    for (int i = 0; i < 3; ++i) card_real_or(card, "normal", 0.0, any_number());       // of shells, unused
    if (model.dim == 2 && z != 0.0)
      card_error(card, card.field[3],
                 "z = " + text_show(card.field[3].text) +
                     " in a two-dimensional model; elements C3D... or a *GRID with a box of six numbers "
                     "make it three-dimensional");
    if (!card_good(card)) continue;
    const int old = card.deck->labels.node.find(label);
    if (old >= 0)
      card_error(card, card.field[0], text_format("node %d is defined already, in ", label) +
                 spot_text(*card.deck, card.deck->labels.node_spot[old]) + "; give it another label");
    else item.push_back(mesh_add_node(*card.deck, model, label, x, y, z, card.whole));
  }
  if (!set.empty()) set_merge(model.nset, set, item, card_deck_line(card));
}
