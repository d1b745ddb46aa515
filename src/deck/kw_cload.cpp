#include "deck/card.h"

// ---------------------------------------------------------------------------
// *CLOAD[, AMPLITUDE=][, OP=] : nset|node, direction, force of each node
// ---------------------------------------------------------------------------
void kw_cload(Card& card, Model& model)
{
  Deck& d = *card.deck;
  const int amplitude = card_param_amplitude(card, model);
  if (card_op_new(card)) d.removes.back().cload = true;
  while (card_line(card)) {
    Load l;
    const Field target = card_field(card, "node set or node");
    l.dof   = card_dof(card, model, "direction");
    l.value = card_expr(card, "force");
    if (!card_good(card) || !target_nodes(d, model, target, l.node)) continue;
    frame_nodes(d, model, l.node);
    l.kind = LOAD_NODE;
    l.amplitude = amplitude;
    deck_load(d, model, "CLOAD", text_upper(target.text) + text_format(" %d", l.dof + 1), target, l);
  }
}
