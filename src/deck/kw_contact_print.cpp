#include "deck/card.h"

// *CONTACT PRINT[, FREQUENCY=][, TOTALS=] : ignored, with a warning that refers to *HISTORY
void kw_contact_print(Card& card, Model&)
{
  card_param_name(card, "NSET");
  card_param_int(card, "FREQUENCY", 1, 1, 2147483647);
  card_param_word(card, "TOTALS", "NO|YES|ONLY", 0);
  while (card_line(card))
    while (card_more(card)) card_word(card, "quantity", "CDIS|CDISP|CSTR|CSTRESS|CELS|CNUM|CF|CFN|CFS");
  card_warn(card, card.head.at,
            "has no effect; *HISTORY prints forces, gaps and areas of contact pairs (CFORCE, "
            "CGAP, CAREA, CWORK, CPRESS)");
}
