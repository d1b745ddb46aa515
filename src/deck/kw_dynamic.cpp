#include "deck/kw_procedure.h"

namespace {

const double calculix_alpha = -0.05;       // what CalculiX and Abaqus take without ALPHA

// the scheme that the words of the card mean; parameters of one scheme name it
TimeScheme scheme_meant(Card& card, bool no_alpha)
{
  const int named = card_param_word(card, "SCHEME", "NEWMARK|ENERGY-MOMENTUM|HHT", -1);
  if (named >= 0) return static_cast<TimeScheme>(named);
  if (card_param(card, "DISSIPATION")) return SCHEME_ENERGY_MOMENTUM;
  return card_param(card, "ALPHA") && !no_alpha ? SCHEME_HHT : SCHEME_NEWMARK;
}

// parameters that belong to another scheme than the one that is meant
void refuse(Card& card, TimeScheme scheme)
{
  struct Belongs {
    const char* word;
    TimeScheme scheme;
    const char* says;
  };
  const char* const of_newmark =
    "BETA and GAMMA belong to SCHEME=NEWMARK; HHT makes them of ALPHA, ENERGY-MOMENTUM has DISSIPATION";
  const Belongs all[] = {
      {"BETA", SCHEME_NEWMARK, of_newmark},
      {"GAMMA", SCHEME_NEWMARK, of_newmark},
      {"DISSIPATION", SCHEME_ENERGY_MOMENTUM,
       "DISSIPATION belongs to SCHEME=ENERGY-MOMENTUM; NEWMARK has GAMMA above 0.5, HHT has ALPHA"},
      {"ALPHA", SCHEME_HHT,
       "ALPHA belongs to SCHEME=HHT; ENERGY-MOMENTUM has DISSIPATION, NEWMARK has GAMMA above 0.5"}};
  for (const Belongs& b : all)
    if (const HeadParam* const word = card_param(card, b.word))
      if (b.scheme != scheme) return card_error(card, word->key, b.says);
}

}  // namespace

// ---------------------------------------------------------------------------
// *DYNAMIC[, DIRECT][, SCHEME=][, BETA=][, GAMMA=][, DISSIPATION=][, ALPHA=] : dt, period[, dt_min[, dt_max]]
// Without SCHEME: BETA, GAMMA mean Newmark, DISSIPATION energy-momentum, ALPHA below 0 HHT; else deck_resolve
// settles it.
// ---------------------------------------------------------------------------
void kw_dynamic(Card& card, Model& model)
{
  Step& s = model.step.back();
  const HeadParam* const beta  = card_param(card, "BETA");
  const HeadParam* const alpha = card_param(card, "ALPHA");
  double zero = 1.0;           // ALPHA=0, no damping, names no scheme
  const bool no_alpha = alpha && !card_param(card, "SCHEME") && parse_real(alpha->value.text, zero) &&
                        zero == 0.0;
  s.scheme       = scheme_meant(card, no_alpha);
  s.scheme_given = card_param(card, "SCHEME") || beta || card_param(card, "GAMMA") ||
                   card_param(card, "DISSIPATION") || (alpha && !no_alpha);
  s.beta  = card_param_real(card, "BETA", 0.25, at_least(0.0));
  s.gamma = card_param_real(card, "GAMMA", 0.5, from_to(0.5, 1.0));
  s.alpha = card_param_real(card, "ALPHA", s.scheme == SCHEME_HHT ? calculix_alpha : 0.0,
                            from_to(-1.0 / 3.0, 0.0));
  s.dissipation = card_param_real(card, "DISSIPATION", 0.0, from_to(0.0, 0.5));
  if (beta && (s.beta <= 0.0 || s.beta > 0.5))
    card_error(card, beta->value, "BETA must be above 0 and at most 0.5; 0.25 is the usual value");
  if (!no_alpha) refuse(card, s.scheme);
  if (s.scheme == SCHEME_HHT) {
    s.beta  = 0.25 * (1.0 - s.alpha) * (1.0 - s.alpha);
    s.gamma = 0.5 - s.alpha;
  }
  procedure_read(card, model, PROC_DYNAMIC);
}
