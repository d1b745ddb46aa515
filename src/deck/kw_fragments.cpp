#include "deck/card.h"

// *FRAGMENTS[, FREQUENCY= | TIME INTERVAL=] : table of fragments; always at the end of the run
void kw_fragments(Card& card, Model& model)
{
  FragmentsDef& f = model.output.fragments;
  f.on        = true;
  f.deck_line     = card_deck_line(card);
  f.frequency = card_param_int(card, "FREQUENCY", 0, 1, 2147483647);
  f.interval  = card_param_real(card, "TIME INTERVAL", 0.0, above(0.0));
  if (card_param(card, "FREQUENCY") && card_param(card, "TIME INTERVAL"))
    card_error(card, card_param(card, "TIME INTERVAL")->key,
               "use FREQUENCY (increments) or TIME INTERVAL, not both");
  card_end(card);
}
