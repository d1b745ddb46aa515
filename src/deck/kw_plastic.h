// ---------------------------------------------------------------------------
// kw_plastic.h : hardening table of plastic materials
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_KW_PLASTIC_H
#define MPFE_DECK_KW_PLASTIC_H

#include "deck/card.h"

// hardening_table : reads lines of yield stress, equivalent plastic strain[, temperature]
void hardening_table(Card& card, Material& m);

#endif
