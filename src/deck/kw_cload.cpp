#include "deck/card.h"

namespace {

// turns a moment into a force on the rotation node of a reference node; false: error reported
bool to_moment(Card& card, Model& m, Load& l)
{
  for (int& n : l.node) {
    const int turn = coupling_turn_of(*card.deck, m, n);
    if (turn < 0 || l.dof < (m.dim == 2 ? 5 : 3)) {
      card_error(card, card.whole,
                 text_format("direction %d of node %d does not exist: moments (directions 4 to 6; in the "
                             "plane 6) act on reference nodes of *COUPLING and *RIGID BODY",
                             l.dof + 1, m.mesh.node_label[n]));
      return false;
    }
    n = turn;
  }
  l.dof = m.dim == 2 ? 0 : l.dof - 3;
  return true;
}

}  // namespace

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
    const bool turns = !d.coupling.empty();          // moments act on reference nodes
    l.dof   = turns ? card_int(card, "direction", 1, 6) - 1 : card_dof(card, model, "direction");
    l.value = card_expr(card, "force");
    if (!card_good(card) || !target_nodes(d, model, target, l.node)) continue;
    const std::string key = text_upper(target.text) + text_format(" %d", l.dof + 1);
    if (l.dof >= model.dim && !to_moment(card, model, l)) continue;
    frame_nodes(d, model, l.node);
    l.kind = LOAD_NODE;
    l.amplitude = amplitude;
    deck_load(d, model, "CLOAD", key, target, l);
  }
}
