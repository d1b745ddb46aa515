#include "deck/card.h"

// *GHOST[, STIFFNESS=, MASS=] : ghost stabilisation of the grid at the boundary of the bodies
void kw_ghost(Card& card, Model& model)
{
  Grid& g = model.grid;
  if (!g.ghost_place.file.empty())
    card_error(card, card.head.at,
               "ghosts are defined already, in " + g.ghost_place.file +
                   text_format(" line %d", g.ghost_place.line));
  g.ghost_place     = card_deck_line(card);
  g.ghost_stiffness = card_param_real(card, "STIFFNESS", 0.01, from_to(0.0, 1e3));
  g.ghost_mass      = card_param_real(card, "MASS", 0.0, from_to(0.0, 1e3));
  card_end(card);
}
