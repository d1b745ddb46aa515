#include <algorithm>

#include "deck/card.h"

// ---------------------------------------------------------------------------
// *PARAMETER : lines name = expression; a value from the command line (-D) takes precedence
// ---------------------------------------------------------------------------
void kw_parameter(Card& card, Model&)
{
  Deck& d = *card.deck;
  std::string line;
  while (card_text(card, line)) {
    const std::size_t equal = line.find('=');
    if (equal == std::string::npos) {
      card_error(card, card.whole, "a line of *PARAMETER reads: name = expression");
      continue;
    }
    std::string name = line.substr(0, equal);
    while (!name.empty() && (name.back() == ' ' || name.back() == '\t')) name.pop_back();
    Field at = card.whole;
    at.length = std::max(1, static_cast<int>(name.size()));
    const std::string fault = deck_parameter_name_fault(name);
    if (!fault.empty()) {
      card_error(card, at, "the name " + text_show(name) + " " + fault);
      continue;
    }
    const auto first = d.params.spot.emplace(name, Spot{at.file, at.line});
    if (!first.second && !d.params.define.count(name))
      card_warn(card, at, "replaces the value of " + name + " in " + spot_text(d, first.first->second) +
                " from here on");
    first.first->second = Spot{at.file, at.line};
    d.params.used.insert(name);
    double value = 1.0;
    std::string text = line.substr(equal + 1);
    if (!text.empty() && text.back() == ',') text.pop_back();
    deck_scalar(d, card.whole, static_cast<int>(equal) + 1, text, value);
    if (!d.params.define.count(name)) d.params.value[name] = value;
  }
}
