#include "deck/card.h"

// ---------------------------------------------------------------------------
// *TIE, NAME=[, POSITION TOLERANCE=][, ADJUST=YES|NO] : slave surface, master surface
// ---------------------------------------------------------------------------
void kw_tie(Card& card, Model&)
{
  TieDef t;
  t.name      = card_param_name(card, "NAME");
  t.deck_line     = card_deck_line(card);
  t.tolerance = card_param_real(card, "POSITION TOLERANCE", 0.0, above(0.0));
  card_param_word(card, "TYPE", "SURFACE TO SURFACE|NODE TO SURFACE", 0);
  t.adjust    = card_param_yes(card, "ADJUST", true, true);
  if (!card_line(card))
    return card_error(card, card.head.at, "a data line must follow: slave surface, master surface");
  const Field slave = card_field(card, "slave surface"), master = card_field(card, "master surface");
  if (slave.empty() || master.empty()) return;
  Deck& deck = *card.deck;
  for (const TieDef& other : deck.tie)
    if (other.name == t.name) card_error(card, card.head.at, "tie " + t.name + " is defined already");
  const std::size_t i = deck.tie.size();
  deck.tie.push_back(t);
  card_later(card, STAGE_STEP, [=](Deck& d, Model& m) {
    d.tie[i].slave  = target_surface(d, m, slave);
    d.tie[i].master = target_surface(d, m, master);
    if (d.tie[i].slave >= 0 && d.tie[i].slave == d.tie[i].master)
      deck_error(d, master, "a surface cannot be tied to itself; name two surfaces");
  });
}
