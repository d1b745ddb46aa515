#include "deck/card.h"

// *DENSITY : mass per volume[, temperature]
void kw_density(Card& card, Model& model)
{
  card_parent_material(card, model).density = card_real(card, "density", above(0.0));
  card_temperature(card);
}
