#include "deck/card.h"

// *HEADING : lines of text
void kw_heading(Card& card, Model& model)
{
  std::string line;
  while (card_text(card, line)) {
    if (!model.heading.empty()) model.heading += "\n";
    if (model.heading.size() < 10000) model.heading += line;
  }
}
