#include "deck/card.h"

// *FRICTION[, SLIP TOLERANCE=] : mu[, stick slope]
void kw_friction(Card& card, Model&)
{
  Interaction& in = card.deck->interaction[card.deck->open.interaction];
  if (in.has_friction)
    card_error(card, card.head.at, "surface interaction " + in.name + " has a *FRICTION already");
  in.has_friction = true;
  in.friction = card_real(card, "friction coefficient", at_least(0.0));
  if (card_more(card)) in.stick = card_real(card, "stick slope (force/length^3)", above(0.0));
}
