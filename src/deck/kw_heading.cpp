#include "deck/card.h"

// *HEADING : lines of text
void kw_heading(Card& card, Model& model)
{
  std::string line;
  while (card_text(card, line)) {
    if (!model.notes.heading.empty()) model.notes.heading += "\n";
    if (model.notes.heading.size() < 10000) model.notes.heading += line;
  }
}
