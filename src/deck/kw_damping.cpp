#include "deck/card.h"

// *DAMPING, ALPHA=, BETA= : Rayleigh damping of a material
void kw_damping(Card& card, Model& model)
{
  Material& m = card_parent_material(card, model);
  if (m.has_damping)
    card_warn(card, card.head.at, "material " + m.name + " has a *DAMPING already; this one replaces it");
  if (!card_param(card, "ALPHA") && !card_param(card, "BETA"))
    card_error(card, card.head.at,
               "*DAMPING needs ALPHA=, BETA= or both: ALPHA of the mass (1/time), BETA of the stiffness "
               "(time)");
  m.alpha = card_param_real(card, "ALPHA", 0.0, at_least(0.0));
  m.beta  = card_param_real(card, "BETA", 0.0, at_least(0.0));
  m.has_damping = true;
  card_end(card);
}
