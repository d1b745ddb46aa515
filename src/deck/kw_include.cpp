#include "deck/card.h"

// *INCLUDE, INPUT=file : opened by deck_peek, so that the file may also contain data lines of the preceding
// keyword. This reader is never called.
void kw_include(Card&, Model&) {}
