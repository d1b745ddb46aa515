#include "deck/card.h"

// ---------------------------------------------------------------------------
// *STEP[, NLGEOM[=YES|NO]][, INC=][, EXTRAPOLATION=LINEAR|NO][, BALANCE=] : text lines may follow.
// Settings of the previous step remain until they are changed.
// ---------------------------------------------------------------------------
void kw_step(Card& card, Model& model)
{
  Deck& d = *card.deck;
  if (d.open.step)
    card_error(card, card.head.at,
               "the step of " + spot_text(d, Spot{d.open.step_at.file, d.open.step_at.line}) +
                   " is still open; *END STEP is missing before this line");
  absent_report(d);
  facet_surfaces(d, model);
  deck_run_later(d, model, STAGE_STEP);
  d.word = card.head.word;     // after messages about other keywords
  Step s;
  s.deck_line   = card_deck_line(card);
  s.ctl     = d.controls;
  s.nlgeom  = card_param_yes(card, "NLGEOM", true, !model.step.empty() && model.step.back().nlgeom);
  s.max_inc = card_param_int(card, "INC", s.max_inc, 1, 2147483647);
  s.extrapolate = card_param_word(card, "EXTRAPOLATION", "LINEAR|NO", 0) <= 0;
  s.balance = card_param_real(card, "BALANCE", 0.0, above(0.0));
  std::string title;
  while (card_text(card, title)) {}
  if (!model.step.empty()) {
    s.bulk_linear    = model.step.back().bulk_linear;
    s.bulk_quadratic = model.step.back().bulk_quadratic;
    s.equation       = model.step.back().equation;
  } else {
    s.bulk_linear = NOT_GIVEN;
    for (std::size_t k = 0; k < model.equation.size(); ++k) s.equation.push_back(static_cast<int>(k));
  }
  model.step.push_back(s);
  d.removes.emplace_back();
  d.open.step = true;
  d.open.procedure = d.open.prints_node = d.open.prints_elem = false;
  d.open.step_at = card.head.at;
}
