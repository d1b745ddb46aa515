#include "deck/kw_procedure.h"

// ---------------------------------------------------------------------------
// *DYNAMIC[, DIRECT][, SCHEME=][, BETA=][, GAMMA=][, DISSIPATION=] : dt, period[, dt_min[, dt_max]]
// Without SCHEME: BETA, GAMMA mean Newmark, DISSIPATION energy-momentum; else deck_resolve settles it.
// ---------------------------------------------------------------------------
void kw_dynamic(Card& card, Model& model)
{
  Step& s = model.step.back();
  const HeadParam* const beta = card_param(card, "BETA");
  const HeadParam* const gamma = card_param(card, "GAMMA");
  const HeadParam* const dissipation = card_param(card, "DISSIPATION");
  const int scheme = card_param_word(card, "SCHEME", "NEWMARK|ENERGY-MOMENTUM", -1);
  s.scheme_given = card_param(card, "SCHEME") || beta || gamma || dissipation;
  s.scheme = scheme == 1 || (scheme < 0 && dissipation) ? SCHEME_ENERGY_MOMENTUM : SCHEME_NEWMARK;
  s.beta   = card_param_real(card, "BETA", 0.25, at_least(0.0));
  s.gamma  = card_param_real(card, "GAMMA", 0.5, from_to(0.5, 1.0));
  s.dissipation = card_param_real(card, "DISSIPATION", 0.0, from_to(0.0, 0.5));
  if (beta && (s.beta <= 0.0 || s.beta > 0.5)) card_error(card, beta->value, "BETA must be above 0 and at most 0.5; 0.25 is the usual value");

  const HeadParam* const alpha = card_param(card, "ALPHA");
  double a = 0.0;
  if (alpha && (!parse_real(alpha->value.text, a) || a != 0.0))
    card_error(card, alpha->has_value ? alpha->value : alpha->key, "ALPHA other than 0 is not offered (no HHT damping); use DISSIPATION=0 ... 0.5 instead");
  const HeadParam* const newmark = beta ? beta : gamma;
  if (s.scheme == SCHEME_ENERGY_MOMENTUM && newmark)
    card_error(card, newmark->key, "BETA and GAMMA belong to SCHEME=NEWMARK; SCHEME=ENERGY-MOMENTUM and DISSIPATION do not go with them");
  if (s.scheme == SCHEME_NEWMARK && scheme == 0 && dissipation)
    card_error(card, dissipation->key, "DISSIPATION belongs to SCHEME=ENERGY-MOMENTUM; with SCHEME=NEWMARK take GAMMA above 0.5");
  procedure_read(card, model, PROC_DYNAMIC);
}
