#include "deck/card.h"

// ---------------------------------------------------------------------------
// *HYPERELASTIC, NEO HOOKE : C10, D1[, temperature]. young and poisson are the small-strain constants:
// mu = 2 C10, K = 2 / D1
// ---------------------------------------------------------------------------
void kw_hyperelastic(Card& card, Model& model)
{
  Material& m = card_parent_material(card, model);
  if (!card_flag(card, "NEO HOOKE"))
    card_error(card, card.head.at, "the model is missing: write *HYPERELASTIC, NEO HOOKE");
  if (m.has_elastic)
    card_warn(card, card.head.at,
              "material " + m.name + " has elastic constants already; *HYPERELASTIC replaces them");
  const double c10 = card_real(card, "C10", above(0.0));
  const double d1  = card_real(card, "D1", above(0.0));
  card_temperature(card);
  if (!card_good(card)) return;
  const double mu = 2.0 * c10, K = 2.0 / d1;
  if (m.law == LAW_SVK) m.law = LAW_NEO_HOOKE;
  m.hyper       = true;
  m.young       = 9.0 * K * mu / (3.0 * K + mu);
  m.poisson     = (3.0 * K - 2.0 * mu) / (2.0 * (3.0 * K + mu));
  m.has_elastic = true;
  if (!(m.poisson > -1.0 && m.poisson < 0.5 - 1e-12))
    card_error(card, card.head.at, "C10 and D1 give Poisson's ratio " + text_number(m.poisson) +
                                       "; it must lie between -1 and 0.5: use a larger D1");
}
