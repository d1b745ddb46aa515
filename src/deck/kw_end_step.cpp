#include "deck/card.h"

// *END STEP : print requests are inherited unless this step has requests of the same kind
void kw_end_step(Card& card, Model& model)
{
  Deck& d = *card.deck;
  Step& s = model.step.back();
  d.open.step = false;
  s.hash      = d.hash[1];
  if (!d.open.procedure)
    card_error(card, card.head.at, "this step has no procedure; write *STATIC or *DYNAMIC after *STEP");
  if (model.step.size() > 1)
    for (const PrintRequest& p : model.step[model.step.size() - 2].print)
      if (p.element ? !d.open.prints_elem : !d.open.prints_node) s.print.push_back(p);
}
