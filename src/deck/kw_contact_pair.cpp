#include "deck/card.h"

namespace {

void check_params(Card& card, const BondDef& b)
{
  const bool interaction = card_param(card, "INTERACTION");
  if (card_param(card, "PENALTY") && card_param(card, "ALPHA"))
    card_error(card, card_param(card, "ALPHA")->key,
               "the penalty is given twice: take PENALTY (force/length^3) or ALPHA (penalty = ALPHA E/h)");
  for (const char* name : {"PENALTY", "ALPHA", "FRICTION"})
    if (interaction && card_param(card, name))
      card_error(card, card_param(card, name)->key,
                 std::string(name) +
                     " does not go with INTERACTION: it is said there, by *SURFACE BEHAVIOR or *FRICTION");
  if (!interaction && b.name.empty() && !card_param(card, "NAME"))
    card_error(card, card.head.at,
               "parameter NAME is missing: write *CONTACT PAIR, NAME=... (or INTERACTION=...)");
}

// OVERLAP=PUSH|ADJUST|REFUSE, or ADJUST=a as Abaqus has it: gaps up to a count as zero too
void read_overlap(Card& card, BondDef& b)
{
  const HeadParam* const adjust = card_param(card, "ADJUST");
  const int word = card_param_word(card, "OVERLAP", "PUSH|ADJUST|REFUSE",
                                   adjust ? OVERLAP_ADJUST : OVERLAP_PUSH);
  b.overlap = static_cast<OverlapPolicy>(word < 0 ? 0 : word);
  b.adjust  = card_param_real(card, "ADJUST", 0.0, at_least(0.0));
  if (adjust && word >= 0 && word != OVERLAP_ADJUST)
    card_error(card, adjust->key, "ADJUST=a goes with OVERLAP=ADJUST only");
}

// the numbers of the interaction that the pair names
void take_interaction(Deck& d, const Field& at, BondDef& b)
{
  std::vector<std::string> names;
  for (const Interaction& in : d.interaction) {
    names.push_back(in.name);
    if (in.name != text_upper(at.text)) continue;
    b.penalty  = in.penalty;
    b.friction = in.friction;
    b.stick    = in.stick;
    return;
  }
  deck_error(d, at,
             "there is no *SURFACE INTERACTION, NAME=" + text_show(at.text) +
                 text_suggest(text_upper(at.text), names));
}

}  // namespace

// ---------------------------------------------------------------------------
// *CONTACT PAIR, NAME=[, FRICTION=][, PENALTY= | ALPHA=] ... or INTERACTION=[, NAME=] ... : slave surface,
// master surface
// ---------------------------------------------------------------------------
void kw_contact_pair(Card& card, Model& model)
{
  BondDef b;
  b.kind     = BOND_CONTACT;
  b.name     = card_param_name(card, "NAME");
  b.place    = card_place(card);
  b.penalty  = card_param_real(card, "PENALTY", 0.0, above(0.0));
  b.alpha    = card_param_real(card, "ALPHA", 0.0, above(0.0));
  b.friction = card_param_real(card, "FRICTION", 0.0, at_least(0.0));
  b.by_face = card_param_word(card, "TYPE", "NODE TO SURFACE|SURFACE TO SURFACE", 0) == 1;
  b.intermediate = card_param_int(card, "INTERMEDIATE", b.by_face ? -1 : 0, 0, 1000);
  b.augment = card_param_int(card, "AUGMENT", 0, 0, 1000);
  read_overlap(card, b);
  check_params(card, b);
  const Field interaction = card_param_field(card, "INTERACTION");
  if (!card_line(card)) {
    card_error(card, card.head.at, "a data line must follow: slave surface, master surface");
    return;
  }
  const Field slave = card_field(card, "slave surface"), master = card_field(card, "master surface");
  if (slave.empty() || master.empty()) return;
  if (b.name.empty()) b.name = text_upper(slave.text + "_" + master.text);
  for (const BondDef& other : model.bond)
    if (other.name == b.name)
      card_error(card, card.head.at, "bond or contact " + b.name + " is defined already");
  const std::size_t i = model.bond.size();
  model.bond.push_back(b);
  card_later(card, STAGE_STEP, [=](Deck& d, Model& m) {
    if (!interaction.empty()) take_interaction(d, interaction, m.bond[i]);
    m.bond[i].surface = target_surface(d, m, slave);
    m.bond[i].master  = target_surface(d, m, master);
    if (m.bond[i].surface >= 0 && m.bond[i].surface == m.bond[i].master)
      deck_error(d, master, "a surface cannot be in contact with itself here; name two surfaces");
  });
}
