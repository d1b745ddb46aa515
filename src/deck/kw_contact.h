// ---------------------------------------------------------------------------
// kw_contact.h : parameters shared by *CONTACT PAIR and *CONTACT
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_KW_CONTACT_H
#define MPFE_DECK_KW_CONTACT_H

#include "deck/card.h"

// contact_overlap : OVERLAP=PUSH|ADJUST|REFUSE, or ADJUST=a as in Abaqus: gaps up to a are closed too
void contact_overlap(Card& card, BondDef& b);

// contact_check_params : reports PENALTY with ALPHA, and INTERACTION with parameters that it contains
void contact_check_params(Card& card);

// contact_interaction : the *SURFACE INTERACTION of this name; null: undefined, which is reported
const Interaction* contact_interaction(Deck& d, const Field& at);

// contact_copy : copies penalty and friction of an interaction
void contact_copy(const Interaction& in, BondDef& b);

#endif
