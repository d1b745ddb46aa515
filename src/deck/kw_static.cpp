#include "deck/kw_procedure.h"

// *STATIC[, DIRECT] : dt, period[, dt_min[, dt_max]]
// *STATIC, RIKS     : dt, period[, dt_min[, dt_max[, nset, direction, displacement]]]
void kw_static(Card& card, Model& model)
{
  Step& s = model.step.back();
  s.arc.on   = card_flag(card, "RIKS");
  for (const char* name : {"STABILIZE", "FACTOR"})
    if (const HeadParam* p = card_param(card, name)) {
      card_warn(card, p->key,
                std::string(name) + " has no effect: statics have no artificial damping here; what is not in "
                "equilibrium goes through its instability in a *DYNAMIC step");
      break;
    }
  procedure_read(card, model, PROC_STATIC);
  if (!s.arc.on) return;
  if (s.direct) card_error(card, card.head.at, "RIKS chooses its increments: leave out DIRECT");
  if (!card_more(card)) return;
  const Field set = card_field(card, "a node set");
  s.arc.direction = card_dof(card, model, "direction");
  s.arc.end       = card_real(card, "displacement", any_number());
  if (card_good(card)) s.arc.nset = target_nset(*card.deck, model, set);
}
