#include "deck/kw_procedure.h"

#include <algorithm>

namespace {

const double max_increments = 1e9;

void read_times(Card& card, Step& s)
{
  s.dt     = card_real_or(card, "dt", 0.0, above(0.0));
  s.period = card_real_or(card, "period", 1.0, above(0.0));
  if (s.dt == 0.0) s.dt = s.period;
  s.dt_min = card_real_or(card, "smallest dt", 0.0, at_least(0.0));
  s.dt_max = card_real_or(card, "largest dt", 0.0, at_least(0.0));
  if (!card.open || !card_good(card)) return;
  if (s.dt > s.period * (1.0 + 1e-12))
    card_error(card, card.field[0],
               "dt = " + text_number(s.dt) + " is larger than the period, " + text_number(s.period));
  else if (s.period / s.dt > max_increments)
    card_error(card, card.field[0], "dt is so small that the step has more than 1e9 increments");
  else if (s.dt_min > s.dt)
    card_error(card, card.field[2], "the smallest dt must not be larger than dt");
  else if (s.dt_max > 0.0 && s.dt_max < s.dt)
    card_error(card, card.field[3], "the largest dt must not be smaller than dt");
}

}  // namespace

void procedure_begin(Card& card, Model& model, Procedure proc)
{
  Deck& d = *card.deck;
  if (d.open.procedure)
    card_error(card, card.head.at, "the step has a procedure already; one *STATIC or *DYNAMIC a step");
  d.open.procedure = true;
  model.step.back().proc = proc;
}

void procedure_times(Card& card, Step& s)
{
  const double dt = card_real_or(card, "dt", 0.0, at_least(0.0));
  s.period = card_real_or(card, "period", 1.0, above(0.0));
  card_real_or(card, "an empty field", 0.0, at_least(0.0));
  s.dt_max = card_real_or(card, "largest dt", 0.0, at_least(0.0));
  if (card.open && dt > s.period * (1.0 + 1e-12))
    card_error(card, card.field[0],
               "dt = " + text_number(dt) + " is larger than the period, " + text_number(s.period));
  s.dt = dt > 0.0 ? dt : s.period;
  if (s.dt_max > 0.0) s.dt = std::min(s.dt, s.dt_max);
  s.dt_max = s.dt;
  s.dt_min = 1e-12 * s.period;
}

void procedure_read(Card& card, Model& model, Procedure proc)
{
  Step& s = model.step.back();
  procedure_begin(card, model, proc);
  s.direct = card_flag(card, "DIRECT");
  card_param_word(card, "SOLVER",
                  "SPOOLES|PARDISO|PASTIX|TAUCS|SGI|ITERATIVE SCALING|ITERATIVE CHOLESKY|DIRECT|ITERATIVE",
                  0);
  read_times(card, s);
  if (s.dt_min <= 0.0) s.dt_min = 1e-6 * s.dt;
  // dynamic steps: deck_resolve
  if (s.dt_max <= 0.0 && proc == PROC_STATIC) s.dt_max = s.arc.on ? s.dt : s.period;
}
