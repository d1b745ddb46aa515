#include "deck/kw_output.h"

#include <algorithm>

void file_read(Card& card, Model& model, const char* words)
{
  VtkDef& v = model.output.vtk;
  const int frequency = card_param_int(card, "FREQUENCY", 1, 1, 2147483647);
  if (!v.on) v.frequency = frequency;
  else if (v.frequency > 0) v.frequency = std::min(v.frequency, frequency);
  v.on = true;
  card_param_word(card, "OUTPUT", "2D|3D", 0);
  card_param_yes(card, "GLOBAL", true, true);
  while (card_line(card))
    while (card_more(card)) card_word(card, "quantity", words);
}

void print_read(Card& card, Model& model, bool element, const char* words)
{
  Deck& d = *card.deck;
  (element ? d.open.prints_elem : d.open.prints_node) = true;
  PrintRequest p;
  p.element   = element;
  p.frequency = card_param_int(card, "FREQUENCY", 1, 1, 2147483647);
  const int totals = card_param_word(card, "TOTALS", "NO|YES|ONLY", 0);
  p.totals    = totals > 0;
  p.only      = totals == 2;
  p.global    = card_param_yes(card, "GLOBAL", true, false);
  const Field set = card_param_field(card, element ? "ELSET" : "NSET");
  if (!set.empty()) p.set = element ? target_elset(d, model, set) : target_nset(d, model, set);
  while (card_line(card))
    while (card_more(card)) {
      const int w = card_word(card, "quantity", words);
      if (w >= 0) p.what.push_back(split_words(words)[w]);
    }
  if (p.what.empty() && d.messages.errors == card.errors_before)
    card_error(card, card.head.at,
               "a data line with the quantities must follow, for example " + split_words(words)[0]);
  if (p.set >= 0) model.step.back().print.push_back(p);
}
