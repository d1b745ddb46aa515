#include "deck/kw_contact.h"

// ---------------------------------------------------------------------------
// *CONTACT PAIR, NAME=[, FRICTION=][, PENALTY= | ALPHA=] ... or INTERACTION=[, NAME=] ... : slave surface,
// master surface
// ---------------------------------------------------------------------------
void kw_contact_pair(Card& card, Model& model)
{
  BondDef b;
  b.name = card_param_name(card, "NAME");
  contact_params(card, b);
  b.contact.by_face = card_param_word(card, "TYPE", "NODE TO SURFACE|SURFACE TO SURFACE", 0) == 1;
  b.intermediate = card_param_int(card, "INTERMEDIATE", b.contact.by_face ? -1 : 0, 0, 1000);
  b.augment = card_param_int(card, "AUGMENT", 0, 0, 1000);
  if (!card_param(card, "INTERACTION") && b.name.empty() && !card_param(card, "NAME"))
    card_error(card, card.head.at,
               "parameter NAME is missing: write *CONTACT PAIR, NAME=... (or INTERACTION=...)");
  const Field interaction = card_param_field(card, "INTERACTION");
  if (!card_line(card)) {
    card_error(card, card.head.at, "a data line must follow: slave surface, master surface");
    return;
  }
  const Field slave = card_field(card, "slave surface"), master = card_field(card, "master surface");
  if (slave.empty() || master.empty()) return;
  if (b.name.empty()) b.name = text_upper(slave.text + "_" + master.text);
  for (const BondDef& other : model.bond)
    if (other.name == b.name)
      card_error(card, card.head.at, "bond or contact " + b.name + " is defined already");
  const std::size_t i = model.bond.size();
  model.bond.push_back(b);
  card_later(card, STAGE_STEP, [=](Deck& d, Model& m) {
    contact_copy(d, interaction, m.bond[i]);
    m.bond[i].surface = target_surface(d, m, slave);
    m.bond[i].contact.master  = target_surface(d, m, master);
    if (m.bond[i].surface >= 0 && m.bond[i].surface == m.bond[i].contact.master)
      deck_error(d, master, "a surface cannot be in contact with itself; name two surfaces");
  });
}
