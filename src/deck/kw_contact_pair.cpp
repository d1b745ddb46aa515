#include "deck/card.h"

// ---------------------------------------------------------------------------
// *CONTACT PAIR, NAME=[, FRICTION=][, PENALTY= | ALPHA=][, INTERMEDIATE=] : slave surface, master surface
// ---------------------------------------------------------------------------
void kw_contact_pair(Card& card, Model& model)
{
  BondDef b;
  b.kind     = BOND_CONTACT;
  b.name     = card_param_name(card, "NAME");
  b.place    = card_place(card);
  b.penalty  = card_param_real(card, "PENALTY", 0.0, above(0.0));
  b.alpha    = card_param_real(card, "ALPHA", 0.0, above(0.0));
  b.friction = card_param_real(card, "FRICTION", 0.0, at_least(0.0));
  b.intermediate = card_param_int(card, "INTERMEDIATE", 0, 0, 1000);
  if (card_param(card, "PENALTY") && card_param(card, "ALPHA"))
    card_error(card, card_param(card, "ALPHA")->key, "the penalty is given twice: take PENALTY (force/length^3) or ALPHA (penalty = ALPHA E/h)");
  for (const BondDef& other : model.bond)
    if (other.name == b.name && !b.name.empty()) card_error(card, card.head.at, "bond or contact " + b.name + " is defined already");
  if (!card_line(card)) {
    card_error(card, card.head.at, "a data line must follow: slave surface, master surface");
    return;
  }
  const Field slave = card_field(card, "slave surface"), master = card_field(card, "master surface");
  const std::size_t i = model.bond.size();
  model.bond.push_back(b);
  card_later(card, STAGE_STEP, [=](Deck& d, Model& m) {
    m.bond[i].surface = target_surface(d, m, slave);
    m.bond[i].master  = target_surface(d, m, master);
    if (m.bond[i].surface >= 0 && m.bond[i].surface == m.bond[i].master)
      deck_error(d, master, "a surface cannot be in contact with itself here; name two surfaces");
  });
}
