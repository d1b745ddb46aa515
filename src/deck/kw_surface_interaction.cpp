#include "deck/card.h"

// *SURFACE INTERACTION, NAME= [: thickness] : *SURFACE BEHAVIOR and *FRICTION follow
void kw_surface_interaction(Card& card, Model&)
{
  Deck& d = *card.deck;
  Interaction in;
  in.name = card_param_name(card, "NAME");
  for (const Interaction& other : d.interaction)
    if (other.name == in.name && !in.name.empty())
      card_error(card, card.head.at, "surface interaction " + in.name + " is defined already");
  if (card_line(card) && card_real_or(card, "thickness", 1.0, above(0.0)) != 1.0)
    card_warn(card, card.field[0],
              "this thickness has no effect; the one of *SOLID SECTION or *MATERIAL POINTS counts");
  d.interaction.push_back(in);
  d.open.interaction = static_cast<int>(d.interaction.size()) - 1;
}
