#include <algorithm>

#include "deck/card.h"

namespace {

// REMOVE or ADD, one of them; true: ADD
bool reads_add(Card& card)
{
  const bool remove = card_flag(card, "REMOVE"), add = card_param(card, "ADD") != nullptr;
  const HeadParam* given = card_param(card, "ADD");
  if (given && given->has_value) card_param_word(card, "ADD", "STRAIN FREE|STRAINFREE", 0);
  if (remove == add)
    card_error(card, card.head.at,
               "either REMOVE or ADD must be given: *MODEL CHANGE, TYPE=ELEMENT, REMOVE");
  else if (add && !card.deck->open.step)
    card_error(card, given->key,
               "before the first *STEP all elements are there; elements are added in a step, after another "
               "one has removed them");
  return add;
}

}  // namespace

// ---------------------------------------------------------------------------
// *MODEL CHANGE, TYPE=ELEMENT, REMOVE|ADD : elements or sets removed or added at the start of the step;
// before the first *STEP: removed at the start, they count as cracked
// ---------------------------------------------------------------------------
void kw_model_change(Card& card, Model& model)
{
  card_param_word(card, "TYPE", "ELEMENT", 0);
  const bool add = reads_add(card);
  IntVec elem;
  while (card_line(card))
    while (card_more(card)) {
      const Field f = card.field[card.next++];
      if (f.empty()) card_error(card, f, "a label or a set name is missing here");
      else target_elems(*card.deck, model, f, elem);
    }
  if (elem.empty() && card.deck->messages.errors == card.errors_before)
    card_error(card, card.head.at, "data lines must follow: elements or element sets");
  std::sort(elem.begin(), elem.end());
  elem.erase(std::unique(elem.begin(), elem.end()), elem.end());
  if (card.deck->open.step) {
    model.step.back().change.push_back({elem, add, card_deck_line(card)});
    return;
  }
  BrokenDef b;
  b.remove = true;
  b.deck_line  = card_deck_line(card);
  b.elem   = elem;
  model.broken.push_back(b);
}
