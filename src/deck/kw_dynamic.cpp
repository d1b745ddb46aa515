#include "deck/kw_procedure.h"

namespace {

// HALFINC SCALE FACTOR: default, which gives an oscillator ten increments a period (theory 6.7); limit of
// the warning: the factor of Abaqus multiplies a mean over the model and is many times larger
// (test: analytic/half_increments)
const double default_half_part = 0.05, large_half_part = 10.0;

const double calculix_alpha = -0.05;       // default of CalculiX and Abaqus

// scheme of the card: given by SCHEME, or implied by a parameter of one scheme
TimeScheme read_scheme(Card& card, bool no_alpha)
{
  const int named = card_param_word(card, "SCHEME", "NEWMARK|ENERGY-MOMENTUM|HHT", -1);
  if (named >= 0) return static_cast<TimeScheme>(named);
  if (card_param(card, "DISSIPATION")) return SCHEME_ENERGY_MOMENTUM;
  return card_param(card, "ALPHA") && !no_alpha ? SCHEME_HHT : SCHEME_NEWMARK;
}

// reports parameters of other schemes
void refuse(Card& card, TimeScheme scheme)
{
  struct SchemeParam {
    const char* word;
    TimeScheme scheme;
    const char* text;
  };
  const char* const of_newmark =
    "BETA and GAMMA belong to SCHEME=NEWMARK; HHT computes them from ALPHA, ENERGY-MOMENTUM has DISSIPATION";
  const SchemeParam all[] = {
      {"BETA", SCHEME_NEWMARK, of_newmark},
      {"GAMMA", SCHEME_NEWMARK, of_newmark},
      {"DISSIPATION", SCHEME_ENERGY_MOMENTUM,
       "DISSIPATION belongs to SCHEME=ENERGY-MOMENTUM; NEWMARK has GAMMA above 0.5, HHT has ALPHA"},
      {"ALPHA", SCHEME_HHT,
       "ALPHA belongs to SCHEME=HHT; ENERGY-MOMENTUM has DISSIPATION, NEWMARK has GAMMA above 0.5"}};
  for (const SchemeParam& b : all)
    if (const HeadParam* const word = card_param(card, b.word))
      if (b.scheme != scheme) return card_error(card, word->key, b.text);
}

// limits of the half-increment residual, for automatic increments
void read_half(Card& card, Step& s)
{
  const HeadParam* const force = card_param(card, "HAFTOL");
  const HeadParam* const part  = card_param(card, "HALFINC SCALE FACTOR");
  const bool off = card_flag(card, "NOHAF"), direct = card_param(card, "DIRECT");
  s.half_force   = card_param_real(card, "HAFTOL", 0.0, above(0.0));
  s.half_part    = card_param_real(card, "HALFINC SCALE FACTOR", force ? 0.0 : default_half_part, above(0.0));
  if (off || direct) s.half_force = s.half_part = 0.0;
  if (force && part)
    return card_error(card, force->key,
                      "HAFTOL is a force, HALFINC SCALE FACTOR a fraction of the typical force: give one of "
                      "them");
  if (part && s.half_part >= large_half_part)
    card_warn(card, part->value,
              "HALFINC SCALE FACTOR is a fraction of the typical inertia force, by default 0.05; "
              "Abaqus multiplies a mean force by it: with this value increments are almost never cut");
  const HeadParam* const given = force ? force : part;
  const std::string name       = force ? "HAFTOL" : "HALFINC SCALE FACTOR";
  if (given && direct)
    return card_error(card, given->key, "DIRECT fixes the increments and ignores " + name +
                                            ": leave out one of the two");
  if (given && off)
    card_error(card, given->key,
               "NOHAF switches the half-increment residual off, which " + name +
                   " limits: leave out one of the two");
}

// Increments of explicit steps are given or the stable ones; options of Abaqus for this are accepted, those
// of implicit schemes are errors
void read_explicit(Card& card, Model& model)
{
  Step& s  = model.step.back();
  s.scheme = SCHEME_EXPLICIT;
  s.scheme_given = true;
  for (const char* word : {"SCHEME", "BETA", "GAMMA", "DISSIPATION", "ALPHA", "HAFTOL",
                           "HALFINC SCALE FACTOR", "NOHAF", "SOLVER"})
    if (const HeadParam* const given = card_param(card, word))
      card_error(card, given->key, std::string(word) + " belongs to implicit schemes; an explicit step has "
                                                       "only SCALE FACTOR: leave it out");
  for (const char* word : {"DIRECT", "DIRECT USER CONTROL", "FIXED TIME INCREMENTATION",
                           "ELEMENT BY ELEMENT"})
    card_flag(card, word);
  s.safety = card_param_real(card, "SCALE FACTOR", s.safety, from_to(0.01, 1.0));
  if (s.max_inc == Step().max_inc) s.max_inc = 2000000000;
  procedure_begin(card, model, PROC_DYNAMIC);
  procedure_times(card, s);
}

// reports parameters of explicit steps
void refuse_explicit(Card& card)
{
  for (const char* word : {"SCALE FACTOR", "DIRECT USER CONTROL", "FIXED TIME INCREMENTATION",
                           "ELEMENT BY ELEMENT"})
    if (const HeadParam* const given = card_param(card, word))
      card_error(card, given->key, std::string(word) + " belongs to *DYNAMIC, EXPLICIT: write EXPLICIT, or "
                                                       "leave it out");
}

}  // namespace

// ---------------------------------------------------------------------------
// *DYNAMIC[, DIRECT][, SCHEME=][, BETA=][, GAMMA=][, DISSIPATION=][, ALPHA=][, HAFTOL=]
//         [, HALFINC SCALE FACTOR=][, NOHAF] : dt, period[, dt_min[, dt_max]]
// Without SCHEME: BETA, GAMMA imply Newmark, DISSIPATION energy-momentum, ALPHA < 0 HHT; otherwise see
// deck_resolve.
// *DYNAMIC, EXPLICIT[, SCALE FACTOR=] : [dt], period[, , dt_max]
// ---------------------------------------------------------------------------
void kw_dynamic(Card& card, Model& model)
{
  Step& s = model.step.back();
  const int of_abaqus = card_param_word(card, "APPLICATION",
                                        "TRANSIENT FIDELITY|MODERATE DISSIPATION|QUASI-STATIC", 0);
  if (of_abaqus > 0)
    card_warn(card, card_param(card, "APPLICATION")->value,
              "APPLICATION has no effect: nothing is damped by it; ALPHA=-0.3 or DISSIPATION=0.2 dampen "
              "motion of short periods");
  card_param_yes(card, "INITIAL", false, true);
  if (card_flag(card, "EXPLICIT")) return read_explicit(card, model);
  refuse_explicit(card);
  const HeadParam* const beta  = card_param(card, "BETA");
  const HeadParam* const alpha = card_param(card, "ALPHA");
  double zero = 1.0;           // ALPHA=0 does not imply HHT
  const bool no_alpha = alpha && !card_param(card, "SCHEME") && parse_real(alpha->value.text, zero) &&
                        zero == 0.0;
  s.scheme       = read_scheme(card, no_alpha);
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
  read_half(card, s);
  procedure_read(card, model, PROC_DYNAMIC);
}
