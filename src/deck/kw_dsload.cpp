#include "deck/card.h"

// ---------------------------------------------------------------------------
// *DSLOAD[, AMPLITUDE=][, OP=] : surface, P, pressure; surface, TRVEC, traction, dx, dy[, dz]
// ---------------------------------------------------------------------------
void kw_dsload(Card& card, Model& model)
{
  Deck& d = *card.deck;
  const int amplitude = card_param_amplitude(card, model);
  if (card_op_new(card)) d.removes.back().dload = true;
  while (card_line(card)) {
    Load l;
    const Field target = card_field(card, "surface");
    const int kind = card_word(card, "kind of load", "P|TRVEC");
    if (kind < 0) continue;
    l.kind  = kind == 0 ? LOAD_PRESSURE : LOAD_TRACTION;
    l.value = card_expr(card, kind == 0 ? "pressure" : "traction");
    if (kind == 1) l.dir = card_direction(card, model);
    l.amplitude = amplitude;
    if (!card_good(card)) continue;
    l.surface = target_surface(d, model, target);
    const std::string key = text_upper(target.text) + (kind == 0 ? " P" : " TRVEC");
    if (l.surface >= 0) deck_load(d, model, "DSLOAD", key, target, l);
  }
}
