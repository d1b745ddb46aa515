#include "deck/card.h"

// ---------------------------------------------------------------------------
// *NEWTON : before the first step the default of all steps; in a step for this step
// ---------------------------------------------------------------------------
void kw_newton(Card& card, Model& model)
{
  Controls& ctl = card.deck->open.step ? model.step.back().ctl : card.deck->controls;
  ctl.tol_force   = card_param_real(card, "TOL FORCE", ctl.tol_force, between(0.0, 1.0));
  ctl.tol_energy  = card_param_real(card, "TOL ENERGY", ctl.tol_energy, between(0.0, 1.0));
  ctl.max_iter    = card_param_int(card, "MAX ITER", ctl.max_iter, 1, 10000);
  ctl.max_cut     = card_param_int(card, "MAX CUT", ctl.max_cut, 0, 50);
  ctl.line_search = card_param_yes(card, "LINE SEARCH", false, ctl.line_search);
}
