#include "deck/card.h"

// ---------------------------------------------------------------------------
// *CONVERSION, ELSET=[, BODY=][, POINTS=][, FIELD=][, TRIGGER=EROSION|DISTORTION|TIME][, LIMIT=][, TIME=][,
// RELEASE=]
// [, INTERFACE=NODES|BONDS][, INTERMEDIATE=][, PENALTY= | ALPHA=]
// elements of the set become material points during the run
// ---------------------------------------------------------------------------
void kw_conversion(Card& card, Model& model)
{
  ConversionDef c;
  c.deck_line    = card_deck_line(card);
  const int trigger = card_param_word(card, "TRIGGER", "EROSION|DISTORTION|TIME", 0);
  c.trigger  = static_cast<ConversionTrigger>(trigger < 0 ? 0 : trigger);
  c.per_elem = card_param_int(card, "POINTS", 2, 1, 10);
  c.field    = card_param_int(card, "FIELD", 0, 0, 1000);
  c.release  = card_param_real(card, "RELEASE", 0.0, above(1.0));
  c.body_name = card_param(card, "BODY") ? card_param_name(card, "BODY") : "CONVERTED";
  c.bonded    = card_param_word(card, "INTERFACE", "NODES|BONDS", 0) == 1;
  c.bond.penalty = card_param_real(card, "PENALTY", 0.0, above(0.0));
  c.bond.alpha   = card_param_real(card, "ALPHA", 0.0, above(0.0));
  c.bond.intermediate = card_param_int(card, "INTERMEDIATE", 0, 0, 1000);
  if (card_param(card, "PENALTY") && card_param(card, "ALPHA"))
    card_error(card, card_param(card, "ALPHA")->key,
               "the penalty is given twice: use PENALTY (force/length^3) or ALPHA (penalty = ALPHA M/h)");
  if (c.trigger == TRIGGER_DISTORTION) c.limit = card_param_real(card, "LIMIT", 0.2, between(0.0, 1.0));
  else if (card_param(card, "LIMIT"))
    card_error(card, card_param(card, "LIMIT")->key, "LIMIT requires TRIGGER=DISTORTION");
  if (c.trigger == TRIGGER_TIME) {
    if (!card_param(card, "TIME"))
      card_error(card, card.head.at, "TRIGGER=TIME needs TIME=, the total time of the conversion");
    c.limit = card_param_real(card, "TIME", 0.0, at_least(0.0));
  } else if (card_param(card, "TIME")) {
    card_error(card, card_param(card, "TIME")->key, "TIME requires TRIGGER=TIME");
  }
  card_end(card);
  const Field elset = card_param_field(card, "ELSET");
  const std::size_t i = model.conversion.size();
  model.conversion.push_back(c);
  card_later(card, STAGE_STEP, [=](Deck& d, Model& m) { m.conversion[i].elset = target_elset(d, m, elset); });
}
