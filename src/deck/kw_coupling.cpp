#include "deck/card.h"

namespace {

// first[, last] in each line; no line: all directions. Rotations of nodes of solid elements are ignored.
void read_directions(Card& card, CouplingDef& c)
{
  bool any = false, coupled[6] = {false, false, false, false, false, false};
  while (card_line(card)) {
    const int first = card_int(card, "first direction", 1, 6) - 1;
    const int last  = card_int_or(card, "last direction", first + 1, 1, 6) - 1;
    if (!card_good(card)) continue;
    any = true;
    if (last < first) card_error(card, card.whole, "the last direction is smaller than the first");
    for (int i = first; i <= last; ++i) coupled[i] = true;
  }
  for (int i = 0; i < 6; ++i) c.coupled[i] = !any || coupled[i];
}

void read_kind(Card& card, CouplingKind kind)
{
  Deck& d = *card.deck;
  CouplingDef ignored;
  const bool open = !d.coupling.empty() && d.coupling.back().kind == COUPLING_OPEN;
  if (!open)
    card_error(card, card.head.at,
               "it must follow a *COUPLING, CONSTRAINT NAME=..., REF NODE=..., SURFACE=...");
  CouplingDef& c = open ? d.coupling.back() : ignored;
  c.kind = kind;
  read_directions(card, c);
}

}  // namespace

// ---------------------------------------------------------------------------
// *COUPLING, CONSTRAINT NAME=, REF NODE=, SURFACE= : *KINEMATIC or *DISTRIBUTING follows
// ---------------------------------------------------------------------------
void kw_coupling(Card& card, Model&)
{
  Deck& deck = *card.deck;
  CouplingDef c;
  c.name  = card_param_name(card, "CONSTRAINT NAME");
  c.deck_line = card_deck_line(card);
  c.ref_at = card_param_field(card, "REF NODE");
  const Field surface = card_param_field(card, "SURFACE");
  for (const CouplingDef& other : deck.coupling)
    if (other.name == c.name) card_error(card, card.head.at, "coupling " + c.name + " is defined already");
  const std::size_t i = deck.coupling.size();
  deck.coupling.push_back(c);
  const Field at = card.head.at;
  card_later(card, STAGE_STEP, [=](Deck& d, Model& m) {
    CouplingDef& coupling = d.coupling[i];
    coupling.surface = target_surface(d, m, surface);
    coupling_turn(d, m, coupling);
    if (coupling.kind == COUPLING_OPEN) deck_error(d, at, "*KINEMATIC or *DISTRIBUTING must follow");
  });
}

// ---------------------------------------------------------------------------
// *KINEMATIC : first[, last] directions that move with the reference node
// *DISTRIBUTING : first[, last] directions in which the reference node follows the mean of the surface
// ---------------------------------------------------------------------------
void kw_kinematic(Card& card, Model&) { read_kind(card, COUPLING_KINEMATIC); }
void kw_distributing(Card& card, Model&) { read_kind(card, COUPLING_DISTRIBUTING); }

// ---------------------------------------------------------------------------
// *RIGID BODY, REF NODE=, ELSET= : the elements of the set move as one body
// ---------------------------------------------------------------------------
void kw_rigid_body(Card& card, Model&)
{
  Deck& deck = *card.deck;
  CouplingDef c;
  c.kind   = COUPLING_RIGID;
  c.deck_line  = card_deck_line(card);
  c.ref_at = card_param_field(card, "REF NODE");
  c.name   = "RIGID_" + text_upper(c.ref_at.text);
  const Field elset = card_param_field(card, "ELSET");
  const std::size_t i = deck.coupling.size();
  deck.coupling.push_back(c);
  card_later(card, STAGE_STEP, [=](Deck& d, Model& m) {
    d.coupling[i].elset = target_elset(d, m, elset);
    coupling_turn(d, m, d.coupling[i]);
  });
}
