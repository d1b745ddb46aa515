#include "deck/kw_contact.h"

#include <algorithm>

namespace {

void read_overlap(Card& card, BondDef& b)
{
  const HeadParam* const adjust = card_param(card, "ADJUST");
  const int word = card_param_word(card, "OVERLAP", "PUSH|ADJUST|REFUSE",
                                   adjust ? OVERLAP_ADJUST : OVERLAP_PUSH);
  b.contact.overlap = static_cast<OverlapPolicy>(word < 0 ? 0 : word);
  b.contact.adjust  = card_param_real(card, "ADJUST", 0.0, at_least(0.0));
  if (adjust && word >= 0 && word != OVERLAP_ADJUST)
    card_error(card, adjust->key, "ADJUST=a requires OVERLAP=ADJUST");
}

void check_numbers(Card& card)
{
  const bool interaction = card_param(card, "INTERACTION");
  if (card_param(card, "PENALTY") && card_param(card, "ALPHA"))
    card_error(card, card_param(card, "ALPHA")->key,
               "the penalty is given twice: use PENALTY (force/length^3) or ALPHA (penalty = ALPHA M/h)");
  for (const char* name : {"PENALTY", "ALPHA", "FRICTION"})
    if (interaction && card_param(card, name))
      card_error(card, card_param(card, name)->key,
                 std::string(name) +
                     " cannot be combined with INTERACTION, which has *SURFACE BEHAVIOR and *FRICTION");
}

}  // namespace

void contact_params(Card& card, BondDef& b)
{
  b.kind      = BOND_CONTACT;
  b.deck_line = card_deck_line(card);
  b.penalty   = card_param_real(card, "PENALTY", 0.0, above(0.0));
  b.alpha     = card_param_real(card, "ALPHA", 0.0, above(0.0));
  b.contact.friction = card_param_real(card, "FRICTION", 0.0, at_least(0.0));
  read_overlap(card, b);
  check_numbers(card);
}

const Interaction* contact_interaction(Deck& d, const Field& at)
{
  std::vector<std::string> names;
  for (const Interaction& in : d.interaction) {
    names.push_back(in.name);
    if (in.name == text_upper(at.text)) return &in;
  }
  deck_error(d, at,
             "there is no *SURFACE INTERACTION, NAME=" + text_show(at.text) +
                 text_suggest(text_upper(at.text), names));
  return nullptr;
}

void contact_copy(Deck& d, const Field& at, BondDef& b)
{
  const Interaction* in = at.empty() ? nullptr : contact_interaction(d, at);
  if (!in) return;
  b.penalty          = in->penalty;
  b.contact.friction = in->friction;
  b.contact.stick    = in->stick;
}

namespace {

const std::size_t MAX_RULES = 30;      // two of 64 bits for each rule (ContactScene::sides)

// surface, body or element set of a name; an empty word: all faces
ContactSide contact_side(Deck& d, const Model& m, const Field& at)
{
  ContactSide side;
  if (at.empty()) return side;
  const std::string name = text_upper(at.text);
  if (name == "ALL EXTERIOR") return side;
  side.surface = model_find_surface(m, name);
  if (side.surface < 0) side.body = model_find_body(m, name);
  if (side.surface < 0 && side.body < 0) side.elset = model_find_elset(m, name);
  if (side.surface < 0 && side.body < 0 && side.elset < 0) {
    std::vector<std::string> names;
    for (const Surface& s : m.surface) names.push_back(s.name);
    for (const Body& b : m.body) names.push_back(b.name);
    for (const Set& s : m.elset) names.push_back(s.name);
    deck_error(d, at, "there is no surface, body or element set " + text_show(at.text) +
                          text_suggest(name, names));
  }
  return side;
}

enum RuleKind { RULE_INCLUDE, RULE_EXCLUDE, RULE_PROPERTY };

std::vector<ContactRule>& rules_of(BondDef& b, RuleKind kind)
{
  ContactDef& c = b.contact;
  return kind == RULE_INCLUDE ? c.include : kind == RULE_EXCLUDE ? c.exclude : c.property;
}

// a line: side, side[, interaction]; an empty first side: all faces; an empty second side: the first side
void rule_line(Card& card, int general, RuleKind kind)
{
  const Field a = card_field_or_none(card), b = card_field_or_none(card);
  const Field property = kind == RULE_PROPERTY ? card_field(card, "surface interaction") : Field();
  card_later(card, STAGE_STEP, [=](Deck& d, Model& m) {
    ContactRule rule;
    rule.a = contact_side(d, m, a);
    rule.b = b.empty() && !a.empty() ? rule.a : contact_side(d, m, b);
    const Interaction* in = kind == RULE_PROPERTY ? contact_interaction(d, property) : nullptr;
    if (in) rule.friction = in->friction;
    if (in) rule.stick    = in->stick;
    if (in) rule.penalty  = in->penalty;
    rules_of(m.bond[general], kind).push_back(rule);
  });
}

void read_rules(Card& card, Model& model, RuleKind kind)
{
  const int general = model_general_contact(model);
  if (general < 0) card_error(card, card.head.at, "*CONTACT must precede this keyword");
  while (card_line(card))
    if (general >= 0) rule_line(card, general, kind);
    else card.next = card.field.size();
}

// side a contains side b
bool contains(const ContactSide& a, const ContactSide& b)
{
  const bool all = a.surface < 0 && a.elset < 0 && a.body < 0;
  return all || (a.surface == b.surface && a.elset == b.elset && a.body == b.body);
}

// every inclusion is cancelled by an exclusion
bool all_excluded(const BondDef& g)
{
  return std::all_of(g.contact.include.begin(), g.contact.include.end(), [&](const ContactRule& in) {
    return std::any_of(g.contact.exclude.begin(), g.contact.exclude.end(), [&](const ContactRule& out) {
      return (contains(out.a, in.a) && contains(out.b, in.b)) ||
             (contains(out.a, in.b) && contains(out.b, in.a));
    });
  });
}

// excludes the contact pairs from general contact; without inclusions, includes all faces
void complete_rules(Deck& d, Model& m, int general)
{
  BondDef& g = m.bond[general];
  if (g.contact.include.empty()) g.contact.include.push_back(ContactRule());
  if (all_excluded(g))
    deck_error(d, deck_field(d, g.deck_line, "CONTACT"),
               "*CONTACT EXCLUSIONS remove all inclusions; no contact is left");
  for (const BondDef& b : m.bond)
    if (b.kind == BOND_CONTACT && !b.contact.general && b.surface >= 0 && b.contact.master >= 0) {
      ContactRule rule;
      rule.a.surface = b.surface;
      rule.b.surface = b.contact.master;
      g.contact.exclude.push_back(rule);
    }
  if (g.contact.include.size() + g.contact.exclude.size() + g.contact.property.size() > MAX_RULES)
    deck_error(d, deck_field(d, g.deck_line, "CONTACT"),
               "more than 30 inclusions, exclusions, properties and contact pairs in total");
}

}  // namespace

// ---------------------------------------------------------------------------
// *CONTACT[, NAME=][, FRICTION=][, PENALTY= | ALPHA=][, INTERACTION=][, INTERMEDIATE=][, OVERLAP=]
// [, ADJUST=] : general contact of all outer faces, or of those of *CONTACT INCLUSIONS
// ---------------------------------------------------------------------------
void kw_contact(Card& card, Model& model)
{
  BondDef b;
  b.contact.general = true;
  b.name = card_param(card, "NAME") ? card_param_name(card, "NAME") : "GENERAL";
  contact_params(card, b);
  b.intermediate = card_param_int(card, "INTERMEDIATE", -1, 0, 1000);
  const Field interaction = card_param_field(card, "INTERACTION");
  if (model_general_contact(model) >= 0)
    card_error(card, card.head.at, "*CONTACT is defined already; only one is allowed");
  for (const BondDef& other : model.bond)
    if (other.name == b.name && !other.contact.general)
      card_error(card, card.head.at, "bond or contact " + b.name + " is defined already");
  const int i = static_cast<int>(model.bond.size());
  model.bond.push_back(b);
  card_later(card, STAGE_STEP, [=](Deck& d, Model& m) { contact_copy(d, interaction, m.bond[i]); });
  card_later(card, STAGE_END, [=](Deck& d, Model& m) { complete_rules(d, m, i); });
}

// *CONTACT INCLUSIONS[, ALL EXTERIOR] : side, side; pairs of general contact
void kw_contact_inclusions(Card& card, Model& model)
{
  const int general = model_general_contact(model);
  if (card_flag(card, "ALL EXTERIOR") && general >= 0)
    model.bond[general].contact.include.push_back(ContactRule());
  read_rules(card, model, RULE_INCLUDE);
}

// *CONTACT EXCLUSIONS : side, side; pairs without general contact
void kw_contact_exclusions(Card& card, Model& model) { read_rules(card, model, RULE_EXCLUDE); }

// *CONTACT PROPERTY ASSIGNMENT : side, side, interaction; the last line that matches two faces is used
void kw_contact_property(Card& card, Model& model) { read_rules(card, model, RULE_PROPERTY); }
