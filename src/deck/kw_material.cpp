#include "deck/card.h"

// *MATERIAL, NAME= : *ELASTIC and *DENSITY follow
void kw_material(Card& card, Model& model)
{
  Material m;
  m.name  = card_param_name(card, "NAME");
  m.deck_line = card_deck_line(card);
  if (!m.name.empty() && model_find_material(model, m.name) >= 0)
    card_error(card, card.head.at, "material " + m.name + " is defined already");
  model.material.push_back(m);
  card.deck->open.material = static_cast<int>(model.material.size()) - 1;
}
