// ---------------------------------------------------------------------------
// kw_set.h : what *NSET and *ELSET have in common
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_KW_SET_H
#define MPFE_DECK_KW_SET_H

#include "deck/card.h"

// set_read : data lines (labels and set names, or first, last, step) and WHERE of *NSET (nodes) and *ELSET
// (elements)
void set_read(Card& card, Model& model, bool nodes);

#endif
