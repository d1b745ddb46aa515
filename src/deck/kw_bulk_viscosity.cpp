#include "deck/card.h"
#include "deck/deck_state.h"

// *BULK VISCOSITY : [b1, b2], coefficients of the linear and quadratic part, also for later steps
void kw_bulk_viscosity(Card& card, Model& model)
{
  Step& s = model.step.back();
  s.bulk_linear    = card_real_or(card, "linear coefficient b1", BULK_LINEAR, at_least(0.0));
  s.bulk_quadratic = card_real_or(card, "quadratic coefficient b2", BULK_QUADRATIC, at_least(0.0));
  card_end(card);
  if (s.proc == PROC_DYNAMIC && !s.scheme_given) {
    s.scheme       = SCHEME_ENERGY_MOMENTUM;
    s.scheme_given = true;
  }
  if (s.proc != PROC_DYNAMIC || (s.scheme != SCHEME_ENERGY_MOMENTUM && !s.explicit_steps()))
    card_error(card, card.head.at,
               "*BULK VISCOSITY requires explicit steps or SCHEME=ENERGY-MOMENTUM: write it after *DYNAMIC; "
               "in other dynamic steps use BETA of *DAMPING");
}
