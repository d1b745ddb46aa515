#include "deck/card.h"

namespace {

// E1, E2, E3, nu12, nu13, nu23, G12, G13 / G23[, temperature]
void read_engineering(Card& card, Material& m)
{
  const char* const name[9] = {"E1", "E2", "E3", "nu12", "nu13", "nu23", "G12", "G13", "G23"};
  double c[9];
  for (int k = 0; k < 9; ++k) {
    if (k == 8 && !card_more(card)) card_line(card);
    c[k] = card_real(card, name[k], k >= 3 && k < 6 ? any_number() : above(0.0));
  }
  card_temperature(card);
  if (!card_good(card)) return;
  if (!ortho_matrix(c, m.elastic))
    card_error(card, card.head.at,
               "the elastic constants are not positive definite: nu12 must be less than "
               "sqrt(E1/E2), others alike, and 1 - nu12 nu21 - nu13 nu31 - nu23 nu32 - 2 nu21 nu32 nu13 "
               "above 0");
  else ortho_isotropic(m.elastic, m.young, m.poisson);
  m.law = LAW_ORTHO;
}

}  // namespace

// *ELASTIC[, TYPE=] : young, poisson[, temperature], or engineering constants
void kw_elastic(Card& card, Model& model)
{
  Material& m = card_parent_material(card, model);
  if (m.has_elastic)
    card_warn(card, card.head.at, "material " + m.name + " has an *ELASTIC already; this one replaces it");
  m.has_elastic = true;
  m.elastic.clear();
  if (m.law == LAW_ORTHO) m.law = LAW_SVK;
  if (card_param_word(card, "TYPE", "ISOTROPIC|ISO|ENGINEERING CONSTANTS", 0) == 2)
    return read_engineering(card, m);
  m.young   = card_real(card, "young",   above(0.0));
  m.poisson = card_real(card, "poisson", between(-1.0, 0.5));
  card_temperature(card);
}
