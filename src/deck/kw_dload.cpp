#include <cmath>

#include "deck/card.h"

namespace {

const char* const plane_loads = "P1|P2|P3|P4|TRVEC1|TRVEC2|TRVEC3|TRVEC4|GRAV|CENTRIF|BX|BY";
const char* const solid_loads =
    "P1|P2|P3|P4|P5|P6|TRVEC1|TRVEC2|TRVEC3|TRVEC4|TRVEC5|TRVEC6|GRAV|CENTRIF|BX|BY|BZ";

// face loads: adds the face of each element
bool take_faces(Card& card, const Model& model, const Field& target, int face, Load& l)
{
  IntVec elem;
  if (model_find_body(model, text_upper(target.text)) >= 0 &&
      model_find_elset(model, text_upper(target.text)) < 0) {
    card_error(card, target,
               "a body of material points has no numbered faces; use *SURFACE, TYPE=BODY and *DSLOAD");
    return false;
  }
  if (!target_elems(*card.deck, model, target, elem)) return false;
  for (int e : elem) {
    if (face >= shape_info[elem_table[model.mesh.elem_type[e]].shape].nface) {
      card_error(card, card.field[1],
                 text_format("element %d is a %s and has no face %d", model.mesh.elem_label[e],
                             elem_table[model.mesh.elem_type[e]].name, face + 1));
      return false;
    }
    l.face.push_back(Face{e, face});
  }
  return true;
}

// volume loads: adds elements or a body; an empty target of GRAV: all
bool take_volume(Card& card, const Model& model, const Field& target, Load& l)
{
  const int body = model_find_body(model, text_upper(target.text));
  if (target.empty()) {
    for (int e = 0; e < model.mesh.nelem(); ++e) l.elem.push_back(e);
    for (std::size_t b = 0; b < model.body.size(); ++b) l.body.push_back(static_cast<int>(b));
    return true;
  }
  if (body < 0) return target_elems(*card.deck, model, target, l.elem);
  l.body.push_back(body);
  return true;
}

// CENTRIF, omega^2, point and direction of the axis: acceleration omega^2 times the distance at t = 0
bool take_centrifugal(Card& card, Model& model, const Field& target, const std::string& key, int amplitude)
{
  double p[3], n[3], length = 0.0;
  const double w2 = card_real(card, "square of the angular velocity", at_least(0.0));
  for (double& x : p) x = card_real(card, "point of the axis", any_number());
  for (double& x : n) x = card_real(card, "direction of the axis", any_number());
  for (double x : n) length = std::hypot(length, x);
  if (!card_good(card)) return false;
  if (!(length > 0.0)) {
    card_error(card, card.whole, "the direction of the axis is 0");
    return false;
  }
  const char* const axis = "xyz";
  std::string along;
  for (int i = 0; i < 3; ++i)
    along += text_format("%s(%c-(%.17g))*(%.17g)", i ? "+" : "", axis[i], p[i], n[i] / length);
  for (int i = 0; i < model.dim; ++i) {
    Load l;
    l.kind      = LOAD_BODY;
    l.per_mass  = true;
    l.of_position  = true;
    l.dir[i]    = 1.0;
    l.amplitude = amplitude;
    const std::string text = text_format("%.17g*(%c-(%.17g)-(%.17g)*(", w2, axis[i], p[i], n[i] / length) +
                             along + "))";
    if (!deck_function(*card.deck, target, text, l.value)) return false;
    if (!take_volume(card, model, target, l)) return false;
    deck_load(*card.deck, model, "DLOAD", key, card.whole, l);
  }
  return true;
}

bool read_line(Card& card, Model& model, Load& l, Field& target, std::string& word, int amplitude)
{
  const bool everything = card.field[0].empty() && card.field.size() > 1 &&
                          text_squeeze(card.field[1].text) == "GRAV";
  target = everything ? card.field[card.next++] : card_field(card, "element set, element or body");
  const char* const words = model.dim == 3 ? solid_loads : plane_loads;
  const int faces = model.dim == 3 ? 6 : 4;
  const int kind = card_word(card, "kind of load", words);
  if (kind < 0) return false;
  word = split_words(words)[kind];
  if (word == "CENTRIF") {
    take_centrifugal(card, model, target, text_upper(target.text) + " " + word, amplitude);
    return false;
  }
  l.kind = kind < faces ? LOAD_PRESSURE : kind < 2 * faces ? LOAD_TRACTION : LOAD_BODY;
  l.per_mass = word == "GRAV";
  l.value = card_expr(card, l.kind == LOAD_PRESSURE ? "pressure"
                            : l.per_mass            ? "acceleration"
                            : l.kind == LOAD_BODY   ? "force per volume"
                                                    : "traction");
  if (word[0] == 'B') l.dir[word[1] - 'X'] = 1.0;
  else if (l.kind != LOAD_PRESSURE) l.dir = card_direction(card, model);
  if (!card_good(card)) return false;
  return l.kind == LOAD_BODY ? take_volume(card, model, target, l)
                             : take_faces(card, model, target, kind % faces, l);
}

}  // namespace

// ---------------------------------------------------------------------------
// *DLOAD[, AMPLITUDE=][, OP=] : target, P1, pressure; target, TRVEC1, traction, dx, dy;
// target, GRAV, g, dx, dy; target, CENTRIF, omega^2, x, y, z, nx, ny, nz; target, BX, force per volume.
// In three dimensions directions also have dz.
// ---------------------------------------------------------------------------
void kw_dload(Card& card, Model& model)
{
  const int amplitude = card_param_amplitude(card, model);
  if (card_op_new(card)) card.deck->removes.back().dload = true;
  while (card_line(card)) {
    Load l;
    Field target;
    std::string word;
    if (!read_line(card, model, l, target, word, amplitude)) continue;
    l.amplitude = amplitude;
    deck_load(*card.deck, model, "DLOAD", text_upper(target.text) + " " + word, card.whole, l);
  }
}
