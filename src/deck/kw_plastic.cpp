#include "deck/kw_plastic.h"

void hardening_table(Card& card, Material& m)
{
  if (!m.yield.empty())
    card_warn(card, card.head.at,
              "material " + m.name + " has a yield stress already; this one replaces it");
  m.yield.clear();
  m.plastic_strain.clear();
  while (card_line(card)) {
    const double y    = card_real(card, "yield stress", above(0.0));
    const double last = m.plastic_strain.empty() ? 0.0 : m.plastic_strain.back();
    const double a    = card_real_or(card, "plastic strain", 0.0, at_least(0.0));
    if (card_more(card)) card_real(card, "temperature", any_number());
    if (!card_good(card)) continue;
    if (m.yield.empty() && a != 0.0)
      card_error(card, card.whole, "the first plastic strain must be 0 (initial yield stress)");
    if (!m.yield.empty() && !(a > last))
      card_error(card, card.whole, "plastic strains must increase from line to line (" + text_number(last) +
                                       " precedes); one table, properties do not depend on temperature");
    if (!m.yield.empty() && y < m.yield.back())
      card_error(card, card.whole, "the yield stress must not decrease: softening would depend on the mesh");
    m.yield.push_back(y);
    m.plastic_strain.push_back(a);
  }
  if (m.yield.empty())
    card_error(card, card.head.at, "*" + card.head.word + " needs a line: yield stress, plastic strain");
}

// ---------------------------------------------------------------------------
// *PLASTIC[, HARDENING=ISOTROPIC] : lines of yield stress, equivalent plastic strain[, temperature]
// ---------------------------------------------------------------------------
void kw_plastic(Card& card, Model& model)
{
  Material& m = card_parent_material(card, model);
  card_param_word(card, "HARDENING", "ISOTROPIC", 0);
  hardening_table(card, m);
  m.law = LAW_J2;
}
