#include "deck/card.h"

// ---------------------------------------------------------------------------
// *SURFACE BEHAVIOR, PRESSURE-OVERCLOSURE=LINEAR : penalty[, tension, c0]; or PRESSURE-OVERCLOSURE=HARD
// without data lines
// ---------------------------------------------------------------------------
void kw_surface_behavior(Card& card, Model&)
{
  Interaction& in = card.deck->interaction[card.deck->open.interaction];
  if (in.has_behavior)
    card_error(card, card.head.at, "surface interaction " + in.name + " has a *SURFACE BEHAVIOR already");
  in.has_behavior = true;
  const int kind = card_param_word(card, "PRESSURE-OVERCLOSURE", "LINEAR|HARD", 0);
  if (kind == 1) return;
  in.penalty = card_real(card, "penalty (force/length^3)", above(0.0));
  if (card_real_or(card, "tension at large distance", 0.0, at_least(0.0)) > 0.0 && kind == 0)
    card_warn(card, card.field[1], "an open contact carries no tension here; the value has no effect");
  card_real_or(card, "clearance c0", 0.0, at_least(0.0));
}
