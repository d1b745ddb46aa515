#include <algorithm>

#include "deck/card.h"
#include "model/lumped.h"

namespace {

// the default, where the elements can have it
bool lumps(const Model& m, const Section& s)
{
  if (s.elset < 0 || !model_lumps(m)) return false;
  const IntVec& elem = m.elset[s.elset].item;
  return std::none_of(elem.begin(), elem.end(), [&](int e) { return elem_quadratic(m.mesh.elem_type[e]); });
}

}  // namespace

// *SOLID SECTION, ELSET=, MATERIAL=, MASS= : thickness (plane elements only)
void kw_solid_section(Card& card, Model& model)
{
  Section s;
  s.elset = s.material = -1;
  s.thickness = card_real_or(card, "thickness", 1.0, above(0.0));
  if (model.dim == 3 && card.open && card_good(card))
    card_error(card, card.field[0], "elements in three dimensions have no thickness; leave this line out");
  s.lumped = card_param_word(card, "MASS", "CONSISTENT|LUMPED", 0) == 1;
  const bool by_name = card_param(card, "MASS") != nullptr;
  s.place = card_place(card);
  if (card_param_real(card, "OFFSET", 0.0, any_number()) != 0.0)
    card_error(card, card_param(card, "OFFSET")->value, "plane elements lie in the plane: OFFSET must be 0");
  const Field elset = card_param_field(card, "ELSET"), material = card_param_field(card, "MATERIAL");
  const std::size_t i = model.section.size();
  model.section.push_back(s);
  card_later(card, STAGE_STEP, [=](Deck& d, Model& m) {
    m.section[i].elset = target_elset(d, m, elset);
    m.section[i].material = target_material(d, m, material);
  });
  if (by_name) return;
  card_later(card, STAGE_END, [=](Deck&, Model& m) { m.section[i].lumped = lumps(m, m.section[i]); });
}
