#include "deck/card.h"

// *ELASTIC : young, poisson[, temperature]
void kw_elastic(Card& card, Model& model)
{
  Material& m = card_parent_material(card, model);
  if (m.has_elastic)
    card_warn(card, card.head.at, "material " + m.name + " has an *ELASTIC already; this one replaces it");
  card_param_word(card, "TYPE", "ISOTROPIC|ISO", 0);
  m.young   = card_real(card, "young",   above(0.0));
  m.poisson = card_real(card, "poisson", between(-1.0, 0.5));
  card_temperature(card);
  m.has_elastic = true;
}
