#include "deck/kw_set.h"

// *ELSET, ELSET=name[, GENERATE][, WHERE="expr"] : WHERE is evaluated at the centroid of an element
void kw_elset(Card& card, Model& model) { set_read(card, model, false); }
