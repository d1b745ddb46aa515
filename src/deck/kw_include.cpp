#include "deck/card.h"

// *INCLUDE, INPUT=file : deck_peek opens the file before a card is made, so that the lines of the file may
// also be data of the keyword before. This reader is never called.
void kw_include(Card&, Model&) {}
