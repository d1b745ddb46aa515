// ---------------------------------------------------------------------------
// kw_set.h : reader of *NSET and *ELSET
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_KW_SET_H
#define MPFE_DECK_KW_SET_H

#include "deck/card.h"

// set_read : reads data lines (labels and set names, or first, last, step) and WHERE of *NSET (nodes) and
// *ELSET (elements)
void set_read(Card& card, Model& model, bool nodes);

#endif
