#include "deck/card.h"

// *VISCOUS BOUNDARY : surface[, a, b], factors of the normal and tangential impedance
void kw_viscous_boundary(Card& card, Model& model)
{
  bool any = false;
  while (card_line(card)) {
    any = true;
    ViscousBoundary v;
    const Field surface = card_field(card, "surface");
    v.a = card_real_or(card, "factor a of the normal direction", 1.0, at_least(0.0));
    v.b = card_real_or(card, "factor b of the tangential directions", 1.0, at_least(0.0));
    v.deck_line = line_place(card);
    if (card_good(card) && v.a == 0.0 && v.b == 0.0)
      card_error(card, card.whole, "a and b are both 0: no damping; leave out the line");
    if (!card_good(card)) continue;
    const std::size_t i = model.viscous.size();
    model.viscous.push_back(v);
    card_later(card, STAGE_STEP,
               [=](Deck& d, Model& m) { m.viscous[i].surface = target_surface(d, m, surface); });
  }
  if (!any) card_error(card, card.head.at, "a data line must follow: surface[, a, b]");
}
