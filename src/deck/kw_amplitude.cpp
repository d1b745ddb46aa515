#include "deck/card.h"

namespace {

const char* const DEFINITIONS = "TABULAR|SMOOTH STEP|STEFFEN|AKIMA|CUBIC|EXPRESSION";

// t1, y1, t2, y2, ... over any number of lines
void read_table(Card& card, Amplitude& a)
{
  while (card_line(card)) {
    while (card_more(card)) {
      const Field at = card.field[card.next];
      const double t = card_real(card, "time", any_number());
      const double y = card_real(card, "value", any_number());
      if (!card_good(card)) break;
      const std::size_t n = a.t.size();
      const bool jumps = n > 0 && t == a.t.back() && a.kind == AMP_TABULAR && (n < 2 || a.t[n - 2] < t);
      if (n > 0 && t <= a.t.back() && !jumps) {
        card_error(card, at,
                   "times must increase: " + text_number(t) + " follows " + text_number(a.t.back()) +
                       (t == a.t.back() ? "; a jump (two points at one time) needs TABULAR" : ""));
        break;
      }
      a.t.push_back(t);
      a.y.push_back(y);
    }
  }
}

}  // namespace

// ---------------------------------------------------------------------------
// *AMPLITUDE, NAME=[, TIME=][, DEFINITION=][, SHIFTX=][, SHIFTY=] : t1, y1, t2, y2, ... or "function of t"
// ---------------------------------------------------------------------------
void kw_amplitude(Card& card, Model& model)
{
  Amplitude a;
  a.name  = card_param_name(card, "NAME");
  a.deck_line = card_deck_line(card);
  a.total_time = card_param_word(card, "TIME", "STEP TIME|TOTAL TIME", 0) == 1;
  const int kind = card_param_word(card, "DEFINITION", DEFINITIONS, 0);
  a.kind = static_cast<AmplitudeKind>(kind < 0 ? 0 : kind);
  if (a.kind == AMP_EXPRESSION) {
    for (const char* shift : {"SHIFTX", "SHIFTY"})
      if (const HeadParam* const p = card_param(card, shift))
        card_error(card, p->value, std::string(shift) + " is for tables; write the shift into the function");
    const Field f = card_field(card, "function of t in double quotes");
    if (card_good(card) && !f.quoted)
      card_error(card, f,
                 "DEFINITION=EXPRESSION needs a function of t in double quotes, for example \"sin(pi*t)\"");
    if (card_good(card)) deck_function_of_t(*card.deck, f, f.text, a.expr);
  } else {
    read_table(card, a);
    for (double& t : a.t) t += card_param_real(card, "SHIFTX", 0.0, any_number());
    for (double& y : a.y) y += card_param_real(card, "SHIFTY", 0.0, any_number());
  }
  const std::size_t least = a.kind == AMP_AKIMA                            ? 5
                            : a.kind == AMP_STEFFEN || a.kind == AMP_CUBIC ? 3
                            : a.kind == AMP_SMOOTH_STEP                    ? 2
                                                                           : 1;
  if (a.kind != AMP_EXPRESSION && a.t.size() < least && card.deck->messages.errors == card.errors_before)
    card_error(card, card.head.at,
               text_format("%zu points are given; this DEFINITION needs at least %zu", a.t.size(), least));
  if (!a.name.empty() && model_find_amplitude(model, a.name) >= 0)
    card_error(card, card.head.at, "amplitude " + a.name + " is defined already");
  model.amplitude.push_back(a);
}
