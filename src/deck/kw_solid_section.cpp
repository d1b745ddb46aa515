#include <algorithm>

#include "deck/card.h"
#include "model/lumped.h"

namespace {

// default of MASS; quadratic elements cannot have lumped mass
bool can_lump(const Model& m, const Section& s)
{
  if (s.elset < 0 || !model_lumps(m)) return false;
  const IntVec& elem = m.elset[s.elset].item;
  return std::none_of(elem.begin(), elem.end(), [&](int e) { return elem_quadratic(m.mesh.elem_type[e]); });
}

// copy of the material with its constants rotated by an orientation; one for each orientation
int rotated_material(Deck& d, Model& m, int k, const Field& orientation)
{
  const auto found = d.orientation.find(text_upper(orientation.text));
  if (k < 0) return k;
  if (found == d.orientation.end()) {
    deck_error(d, orientation,
               "orientation " + text_show(orientation.text) + " is not defined (*ORIENTATION)");
    return k;
  }
  if (m.material[k].elastic.empty()) return k;       // isotropic, or constants that were refused
  Material rotated = m.material[k];
  rotated.name += " in " + found->first;
  for (std::size_t i = 0; i < m.material.size(); ++i)
    if (m.material[i].name == rotated.name) return static_cast<int>(i);
  rotated.elastic = ortho_turn(rotated.elastic, found->second);
  m.material.push_back(rotated);
  m.material[k].used = true;                         // by the rotated copy
  return static_cast<int>(m.material.size()) - 1;
}

}  // namespace

// *SOLID SECTION, ELSET=, MATERIAL=, MASS= : thickness (plane elements only)
void kw_solid_section(Card& card, Model& model)
{
  Section s;
  s.elset = s.material = -1;
  s.thickness = card_real_or(card, "thickness", 1.0, above(0.0));
  if (model.dim == 3 && card.open && card_good(card) && !card.field[0].empty())       // CAE writes a comma
    card_error(card, card.field[0], "elements in three dimensions have no thickness; leave this line out");
  s.lumped = card_param_word(card, "MASS", "CONSISTENT|LUMPED", 0) == 1;
  const bool mass_given = card_param(card, "MASS") != nullptr;
  s.deck_line = card_deck_line(card);
  if (card_param_real(card, "OFFSET", 0.0, any_number()) != 0.0)
    card_error(card, card_param(card, "OFFSET")->value, "plane elements lie in the plane: OFFSET must be 0");
  const Field elset = card_param_field(card, "ELSET"), material = card_param_field(card, "MATERIAL");
  const Field orientation = card_param_field(card, "ORIENTATION");
  const std::size_t i = model.section.size();
  model.section.push_back(s);
  card_later(card, STAGE_STEP, [=](Deck& d, Model& m) {
    m.section[i].elset = target_elset(d, m, elset);
    m.section[i].material = target_material(d, m, material);
    if (orientation.empty()) return;
    m.section[i].material = rotated_material(d, m, m.section[i].material, orientation);
  });
  if (mass_given) return;
  card_later(card, STAGE_END, [=](Deck&, Model& m) { m.section[i].lumped = can_lump(m, m.section[i]); });
}
