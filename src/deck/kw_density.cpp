#include "deck/card.h"

// *DENSITY : mass per volume[, temperature]
void kw_density(Card& card, Model& model)
{
  Material& m = card_parent_material(card, model);
  if (m.density > 0.0)
    card_warn(card, card.head.at, "material " + m.name + " has a *DENSITY already; this one replaces it");
  m.density = card_real(card, "density", above(0.0));
  card_temperature(card);
}
