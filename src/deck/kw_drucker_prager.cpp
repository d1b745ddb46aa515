#include <algorithm>
#include <cmath>

#include "deck/kw_plastic.h"

namespace {

const Limit cone_angle = from_to(0.0, 71.5);

// friction angle, flow stress ratio, dilation angle
void read_straight(Card& card, Material& m)
{
  const double friction = card_real(card, "friction angle", cone_angle);
  const double ratio    = card_real_or(card, "flow stress ratio", 1.0, above(0.0));
  const double dilation = card_real_or(card, "dilation angle", 0.0, cone_angle);
  if (!card_good(card)) return;
  if (ratio != 1.0)
    card_error(card, card.field[1], "the flow stress ratio must be 1: the yield surface is circular");
  if (dilation > friction)
    card_error(card, card.field[2],
               "the dilation angle must not exceed the friction angle: flow would create energy");
  m.friction = std::tan(card_radians(friction));
  m.exponent = 1.0;
  m.dilation = std::tan(card_radians(dilation));
}

// a, b, (empty), dilation angle
void read_curve(Card& card, Material& m)
{
  const double a = card_real(card, "a", above(0.0));
  const double b = card_real(card, "b", from_to(1.0, 20.0));
  const Field third = card_field_or_none(card);
  if (!third.empty())
    card_error(card, third,
               "the third field of SHEAR CRITERION=EXPONENT FORM is empty: a, b, , dilation angle");
  const double dilation = card_real_or(card, "dilation angle", 0.0, cone_angle);
  if (!card_good(card)) return;
  m.friction = 1.0 / a;
  m.exponent = b;
  m.dilation = std::tan(card_radians(dilation));
  if (b == 1.0) m.dilation = std::min(m.dilation, m.friction);         // the slope of the line
}

}  // namespace

// ---------------------------------------------------------------------------
// *DRUCKER PRAGER[, SHEAR CRITERION=LINEAR|EXPONENT FORM][, APEX=PLASTIC|GAP] : friction angle, flow stress
// ratio, dilation angle; EXPONENT FORM: a, b, (empty), dilation angle
// ---------------------------------------------------------------------------
void kw_drucker_prager(Card& card, Model& model)
{
  Material& m = card_parent_material(card, model);
  const bool curved = card_param_word(card, "SHEAR CRITERION", "LINEAR|EXPONENT FORM", 0) == 1;
  m.gap = card_param_word(card, "APEX", "PLASTIC|GAP", 0) == 1;
  if (!card_line(card)) {
    card_error(card, card.head.at,
               std::string("*DRUCKER PRAGER needs a line: ") +
                   (curved ? "a, b, (empty), dilation angle" : "friction angle, ratio, dilation angle"));
    return;
  }
  (curved ? read_curve : read_straight)(card, m);
  if (card_more(card)) card_real(card, "temperature", any_number());
  m.law = LAW_DRUCKER_PRAGER;
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
