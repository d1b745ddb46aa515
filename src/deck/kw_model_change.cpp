#include "deck/card.h"

// ---------------------------------------------------------------------------
// *MODEL CHANGE, TYPE=ELEMENT, REMOVE : elements or sets removed at the start; they count as cracked
// ---------------------------------------------------------------------------
void kw_model_change(Card& card, Model& model)
{
  BrokenDef b;
  b.remove = true;
  b.place  = card_place(card);
  card_param_word(card, "TYPE", "ELEMENT", 0);
  if (!card_flag(card, "REMOVE"))
    card_error(card, card.head.at, "only REMOVE is possible: *MODEL CHANGE, TYPE=ELEMENT, REMOVE");
  IntVec elem;
  while (card_line(card))
    while (card_more(card)) {
      const Field f = card.field[card.next++];
      if (f.empty()) card_error(card, f, "a label or a set name is missing here");
      else target_elems(*card.deck, model, f, elem);
    }
  if (elem.empty() && card.deck->messages.errors == card.errors_before)
    card_error(card, card.head.at, "data lines must follow: elements or element sets");
  b.elem = elem;
  model.broken.push_back(b);
}
