#include "deck/card.h"

namespace {

void check_params(Card& card, const BondDef& b)
{
  const bool ground = b.kind == BOND_GROUND;
  const HeadParam* const body = card_param(card, "BODY");
  if (card_param(card, "PENALTY") && card_param(card, "ALPHA"))
    card_error(card, card_param(card, "ALPHA")->key,
               "the penalty is given twice: use PENALTY (force/length^3) or ALPHA (penalty = ALPHA M/h)");
  if (!ground && !body)
    card_error(card, card.head.at,
               "BODY=name is missing: the body of material points on the other side (or TYPE=GROUND)");
  if (ground && body)
    card_error(card, body->key,
               "BODY cannot be combined with TYPE=GROUND; a surface of a body is *SURFACE, TYPE=BODY");
  for (const char* name : {"NORMAL", "DOF", "AMPLITUDE"})
    if (!ground && card_param(card, name))
      card_error(card, card_param(card, name)->key, std::string(name) + " requires TYPE=GROUND");
  if (card_param(card, "NORMAL") && card_param(card, "DOF"))
    card_error(card, card_param(card, "DOF")->key, "NORMAL and DOF exclude each other");
}

// bonds between the nodes of an edge: INTERMEDIATE=k, in three dimensions also LATTICE=k+2, which counts the
// corners
int read_between(Card& card, const Model& model)
{
  const HeadParam* const lattice = card_param(card, "LATTICE");
  const int between = card_param_int(card, "INTERMEDIATE", -1, 0, 1000);
  if (!lattice) return between;
  if (card_param(card, "INTERMEDIATE"))
    card_error(card, lattice->key, "LATTICE=k is INTERMEDIATE=k-2; give one of them");
  else if (model.dim == 2)
    card_error(card, lattice->key,
               "a lattice of bonds covers faces in three dimensions; on edges write INTERMEDIATE");
  return card_param_int(card, "LATTICE", 2, 2, 1002) - 2;
}

}  // namespace

// ---------------------------------------------------------------------------
// *BOND, NAME=, SURFACE=, BODY= ... or *BOND, TYPE=GROUND, NAME=, SURFACE= ... : ux, uy[, uz] of the ground
// ---------------------------------------------------------------------------
void kw_bond(Card& card, Model& model)
{
  BondDef b;
  b.name    = card_param_name(card, "NAME");
  b.deck_line   = card_deck_line(card);
  b.kind    = card_param_word(card, "TYPE", "GRID|GROUND", 0) == 1 ? BOND_GROUND : BOND_MESH_GRID;
  b.penalty = card_param_real(card, "PENALTY", 0.0, above(0.0));
  b.alpha   = card_param_real(card, "ALPHA", 0.0, above(0.0));
  b.augment = card_param_int(card, "AUGMENT", 0, 0, 1000);
  b.intermediate = read_between(card, model);
  const int dof = card_param_int(card, "DOF", 0, 1, model.dim);
  b.normal_only = card_flag(card, "NORMAL") || card_param(card, "DOF");
  if (card_param(card, "DOF")) b.direction[dof > 0 ? dof - 1 : 0] = 1.0;
  check_params(card, b);
  if (b.kind == BOND_GROUND && card_line(card))
    for (int i = 0; i < model.dim; ++i)
      b.motion[i] = card_expr_or_zero(card, i == 2 ? "uz" : i ? "uy" : "ux");
  for (const BondDef& other : model.bond)
    if (other.name == b.name && !b.name.empty())
      card_error(card, card.head.at, "bond " + b.name + " is defined already");

  const std::size_t i = model.bond.size();
  const Field surface = card_param_field(card, "SURFACE"), body = card_param_field(card, "BODY"),
              amplitude = card_param_field(card, "AMPLITUDE");
  model.bond.push_back(b);
  card_later(card, STAGE_STEP, [=](Deck& d, Model& m) {
    if (!surface.empty()) m.bond[i].surface = target_surface(d, m, surface);
    if (!body.empty()) m.bond[i].body = target_body(d, m, body);
    if (!amplitude.empty()) m.bond[i].amplitude = target_amplitude(d, m, amplitude);
    const int s = m.bond[i].surface;
    if (b.kind == BOND_MESH_GRID && s >= 0 && m.surface[s].body >= 0)
      deck_error(d, surface,
                 "a bond to a body requires a surface of finite elements; " + m.surface[s].name +
                     " is the boundary of a body");
  });
}
