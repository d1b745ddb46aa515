#include "deck/card.h"

namespace {

// a body of material points before a set of the same name (its nodes may have become points)
void apply(Deck& d, Model& m, const Field& target, InitialValue v)
{
  v.body = model_find_body(m, text_upper(target.text));
  if (v.body < 0 && !target_nodes(d, m, target, v.node)) return;
  m.initial.push_back(v);
}

}  // namespace

// ---------------------------------------------------------------------------
// *INITIAL CONDITIONS, TYPE=VELOCITY|DISPLACEMENT : nset|node|body, direction, value
// ---------------------------------------------------------------------------
void kw_initial_conditions(Card& card, Model& model)
{
  const int type = card_param_word(card, "TYPE", "VELOCITY|DISPLACEMENT", 0);
  while (card_line(card)) {
    InitialValue v;
    v.displacement = type == 1;
    const Field target = card_field(card, "node set, node or body");
    v.dof   = card_dof(card, model, "direction");
    v.value = card_expr(card, type == 1 ? "displacement" : "velocity");
    v.place = line_place(card);
    if (card_good(card)) card_later(card, STAGE_STEP, [=](Deck& d, Model& m) { apply(d, m, target, v); });
  }
}
