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
    b.deck_line = line_place(card);
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

// ---- TYPE=STRESS ------------------------------------------------------------

// components of Abaqus and CalculiX, 11 22 33 12 13 23: index in 11 22 33 12 23 31
const int place_of[6] = {0, 1, 2, 3, 5, 4};
const char* const component[6] = {"S11", "S22", "S33", "S12", "S13", "S23"};

bool is_zero(const Expr& e) { return e.is_const() && e.value == 0.0; }

// a plane sheet has S11, S22, S12, or S11, S22, S33 = 0, S12
bool plane_components(Deck& d, const DeckLine& at, int given, bool sheet, InitialStress& s)
{
  const auto no = [&](const char* text) {
    deck_error(d, deck_field(d, at, ""), text);
    return false;
  };
  if (sheet && given == 3) {
    s.value[3] = s.value[2];
    s.value[2] = Expr();
  }
  if (sheet && !is_zero(s.value[2]))
    return no("S33 is zero in plane stress: the components are S11, S22, S12");
  for (int k = 4; k < 6; ++k)
    if (!is_zero(s.value[k])) return no("S13 and S23 are zero in a plane model: S11, S22, S33, S12");
  return true;
}

// a body of material points before a set of the same name; elements of plane stress and strain apart
void apply_stress(Deck& d, Model& m, const Field& target, int given, const InitialStress& as_read)
{
  InitialStress s = as_read;
  s.body = model_find_body(m, text_upper(target.text));
  if (s.body >= 0) {
    if (s.point >= 0)
      deck_error(d, target, "a body of material points has no integration points; leave their number out");
    else if (m.dim == 3 || plane_components(d, s.deck_line, given, m.body[s.body].plane == PLANE_STRESS, s))
      m.initial_stress.push_back(s);
    return;
  }
  IntVec all;
  if (!target_elems(d, m, target, all)) return;
  for (const bool sheet : {false, true}) {
    InitialStress part = s;
    for (int e : all)
      if ((elem_table[m.mesh.elem_type[e]].plane == PLANE_STRESS) == sheet) part.elem.push_back(e);
    if (part.elem.empty()) continue;
    if (m.dim == 3 || plane_components(d, s.deck_line, given, sheet, part)) m.initial_stress.push_back(part);
  }
}

// elset|element|body[, integration point], S11, S22, S33, S12, S13, S23
void read_stress(Card& card, Model& model)
{
  while (card_line(card)) {
    InitialStress s;
    s.deck_line = line_place(card);
    const Field target = card_field(card, "element set, element or body");
    if (card.field.size() == 8 && model.dim == 3)
      s.point = card_int(card, "integration point", 1, MAX_GAUSS) - 1;
    int given = 0;
    do {
      s.value[place_of[given]] = card_expr(card, component[given]);
      ++given;
    } while (given < 6 && card_more(card));
    if (card_good(card))
      card_later(card, STAGE_STEP, [=](Deck& d, Model& m) { apply_stress(d, m, target, given, s); });
  }
}

// the stress a1 at the height x1 and a2 at x2, linear, times a part
Expr over_height(const Card& card, const Model& m, const double* a, const double* x, double part)
{
  Expr out;
  std::string error;
  int position;
  const std::string axis = m.dim == 3 ? "z" : "y";
  expr_compile(text_format("%.17g*(%.17g + (%.17g)*(%s - (%.17g)))", part, a[0],
                           (a[1] - a[0]) / (x[1] - x[0]), axis.c_str(), x[0]),
               card.deck->params.value, out, error, position);
  return out;
}

// elset|element|body, stress 1, height 1, stress 2, height 2, part to the side[, along y]
void read_geostatic(Card& card, Model& model)
{
  const int up = model.dim - 1;
  while (card_line(card)) {
    InitialStress s;
    s.deck_line = line_place(card);
    const Field target = card_field(card, "element set, element or body");
    double a[2], x[2], side[2];
    for (int k = 0; k < 2; ++k) {
      a[k] = card_real(card, k ? "vertical stress 2" : "vertical stress 1", any_number());
      x[k] = card_real(card, k ? "height 2" : "height 1", any_number());
    }
    side[0] = card_real(card, "part to the side", any_number());
    side[1] = card_real_or(card, "the other part to the side", side[0], any_number());
    if (card_good(card) && x[0] == x[1]) card_error(card, card.whole, "the two heights are the same");
    if (!card_good(card)) continue;
    s.value[up] = over_height(card, model, a, x, 1.0);
    s.value[0]  = over_height(card, model, a, x, side[0]);
    s.value[model.dim == 3 ? 1 : 2] = over_height(card, model, a, x, side[1]);
    card_later(card, STAGE_STEP, [=](Deck& d, Model& m) { apply_stress(d, m, target, 4, s); });
  }
}

}  // namespace

// ---------------------------------------------------------------------------
// *INITIAL CONDITIONS, TYPE=VELOCITY|DISPLACEMENT : nset|node|body, direction, value
//                     TYPE=BROKEN                 : elset|element[, n1, n2[, n3]]
//                     TYPE=STRESS                 : elset|element|body[, point], S11, S22, S33, S12, S13, S23
//                     TYPE=STRESS, GEOSTATIC      : elset|element|body, S, height, S, height, part[, part]
// ---------------------------------------------------------------------------
void kw_initial_conditions(Card& card, Model& model)
{
  const int type = card_param_word(card, "TYPE", "VELOCITY|DISPLACEMENT|BROKEN|STRESS|TEMPERATURE", 0);
  const bool geostatic = card_flag(card, "GEOSTATIC");
  if (geostatic && type != 3)
    card_error(card, card.head.at, "GEOSTATIC goes with TYPE=STRESS");
  if (type < 0 || type == 4) {                       // there are no temperatures
    while (card_line(card)) card.next = card.field.size();
    return;
  }
  if (type == 2) return read_broken(card, model);
  if (type == 3) return geostatic ? read_geostatic(card, model) : read_stress(card, model);
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
    v.deck_line = line_place(card);
    if (card_good(card))
      card_later(card, STAGE_STEP, [=](Deck& d, Model& m) { add_initial(d, m, target, v); });
  }
}
