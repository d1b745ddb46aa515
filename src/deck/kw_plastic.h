// ---------------------------------------------------------------------------
// kw_plastic.h : what the keywords of plastic materials have in common
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_KW_PLASTIC_H
#define MPFE_DECK_KW_PLASTIC_H

#include "deck/card.h"

// hardening_table : yield stress, equivalent plastic strain[, temperature], line after line
void hardening_table(Card& card, Material& m);

#endif
