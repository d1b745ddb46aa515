#include <cmath>

#include "deck/kw_plastic.h"

// ---------------------------------------------------------------------------
// *DRUCKER PRAGER[, SHEAR CRITERION=LINEAR][, APEX=PLASTIC|GAP] : friction angle, flow stress ratio,
// dilation angle
// ---------------------------------------------------------------------------
void kw_drucker_prager(Card& card, Model& model)
{
  Material& m = card_parent_material(card, model);
  card_param_word(card, "SHEAR CRITERION", "LINEAR", 0);
  m.gap = card_param_word(card, "APEX", "PLASTIC|GAP", 0) == 1;
  if (!card_line(card)) {
    card_error(card, card.head.at, "*DRUCKER PRAGER needs a line: friction angle, ratio, dilation angle");
    return;
  }
  const double friction = card_real(card, "friction angle", from_to(0.0, 71.5));
  const double ratio    = card_real_or(card, "flow stress ratio", 1.0, above(0.0));
  const double dilation = card_real_or(card, "dilation angle", 0.0, from_to(0.0, 71.5));
  if (card_more(card)) card_real(card, "temperature", any_number());
  if (!card_good(card)) return;
  if (ratio != 1.0)
    card_error(card, card.field[1], "the flow stress ratio must be 1: the yield surface is circular");
  if (dilation > friction)
    card_error(card, card.field[2],
               "the dilation angle must not exceed the friction angle: flow would create energy");
  m.friction = std::tan(card_radians(friction));
  m.dilation = std::tan(card_radians(dilation));
  m.law      = LAW_DRUCKER_PRAGER;
}

// ---------------------------------------------------------------------------
// *DRUCKER PRAGER HARDENING[, TYPE=COMPRESSION|TENSION|SHEAR] : lines of yield stress, equivalent plastic
// strain in this test
// ---------------------------------------------------------------------------
void kw_drucker_prager_hardening(Card& card, Model& model)
{
  Material& m = card_parent_material(card, model);
  m.hardening = static_cast<Hardening>(card_param_word(card, "TYPE", "COMPRESSION|TENSION|SHEAR", 0));
  hardening_table(card, m);
}
