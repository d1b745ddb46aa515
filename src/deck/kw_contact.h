// ---------------------------------------------------------------------------
// kw_contact.h : parameters shared by *CONTACT PAIR and *CONTACT
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_KW_CONTACT_H
#define MPFE_DECK_KW_CONTACT_H

#include "deck/card.h"

// contact_params : reads penalty, friction, OVERLAP=PUSH|ADJUST|REFUSE, or ADJUST=a as in Abaqus (gaps up to
// a are closed too); reports PENALTY with ALPHA, and INTERACTION with parameters that it contains
void contact_params(Card& card, BondDef& b);

// contact_interaction : the *SURFACE INTERACTION of this name; null: undefined, which is reported
const Interaction* contact_interaction(Deck& d, const Field& at);

// contact_copy : copies penalty and friction of the interaction of this name, unless the name is empty
void contact_copy(Deck& d, const Field& at, BondDef& b);

#endif
