// ---------------------------------------------------------------------------
// kw_contact.h : what *CONTACT PAIR and *CONTACT share
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_KW_CONTACT_H
#define MPFE_DECK_KW_CONTACT_H

#include "deck/card.h"

// contact_overlap : OVERLAP=PUSH|ADJUST|REFUSE, or ADJUST=a as Abaqus has it: gaps up to a count as zero too
void contact_overlap(Card& card, BondDef& b);

// contact_twice : PENALTY and ALPHA together, or with INTERACTION what is said there
void contact_twice(Card& card);

// contact_interaction : the *SURFACE INTERACTION of this name; null: there is none, which is told
const Interaction* contact_interaction(Deck& d, const Field& at);

// contact_take : the numbers of an interaction
void contact_take(const Interaction& in, BondDef& b);

#endif
