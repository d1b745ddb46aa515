#include "deck/kw_set.h"

// *NSET, NSET=name[, GENERATE][, WHERE="expr"]
void kw_nset(Card& card, Model& model) { set_read(card, model, true); }
