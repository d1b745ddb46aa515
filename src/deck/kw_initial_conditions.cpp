#include <cmath>

#include "deck/card.h"

namespace {

// a body takes precedence over a set of the same name, whose nodes may become points
void add_initial(Deck& d, Model& m, const Field& target, InitialValue v)
{
  v.body = model_find_body(m, text_upper(target.text));
  if (v.body < 0 && !target_nodes(d, m, target, v.node)) return;
  m.initial.push_back(v);
}

// element set|element[, n1, n2[, n3]] : elements broken at the start, with the normal of the crack
void read_broken(Card& card, Model& model)
{
  const char* const axis[3] = {"n1", "n2", "n3"};
  while (card_line(card)) {
    BrokenDef b;
    b.place = line_place(card);
    const Field target = card_field(card, "element set or element");
    double norm = 0.0;
    for (int i = 0; i < model.dim; ++i)
      b.normal[i] = card_real_or(card, axis[i], i == 0 && !card_more(card) ? 1.0 : 0.0, any_number());
    for (double n : b.normal) norm += n * n;
    if (card_good(card) && norm == 0.0) card_error(card, card.whole, "the normal is the zero vector");
    for (double& n : b.normal) n /= norm > 0.0 ? std::sqrt(norm) : 1.0;
    if (!card_good(card)) continue;
    card_later(card, STAGE_STEP, [=](Deck& d, Model& m) {
      BrokenDef broken = b;
      if (target_elems(d, m, target, broken.elem)) m.broken.push_back(broken);
    });
  }
}

}  // namespace

// ---------------------------------------------------------------------------
// *INITIAL CONDITIONS, TYPE=VELOCITY|DISPLACEMENT : nset|node|body, direction, value
//                     TYPE=BROKEN                 : elset|element[, n1, n2[, n3]]
// ---------------------------------------------------------------------------
void kw_initial_conditions(Card& card, Model& model)
{
  const int type = card_param_word(card, "TYPE", "VELOCITY|DISPLACEMENT|BROKEN", 0);
  if (type == 2) return read_broken(card, model);
  while (card_line(card)) {
    InitialValue v;
    v.displacement = type == 1;
    const Field target = card_field(card, "node set, node or body");
    v.dof   = card_int(card, "direction", 1, 3) - 1;
    v.value = card_expr(card, type == 1 ? "displacement" : "velocity");
    if (card_good(card) && v.dof >= model.dim) {     // a 3D deck used for a plane model
      if (!v.value.is_const() || v.value.value != 0.0)
        card_error(card, card.whole, "direction 3 does not exist in a plane model; only 0 can be given");
      continue;
    }
    v.place = line_place(card);
    if (card_good(card))
      card_later(card, STAGE_STEP, [=](Deck& d, Model& m) { add_initial(d, m, target, v); });
  }
}
