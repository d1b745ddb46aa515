#include "deck/kw_output.h"

// *CONTACT FILE[, FREQUENCY=][, OUTPUT=]
void kw_contact_file(Card& card, Model& model)
{
  file_read(card, model, "CDIS|CDISP|CSTR|CSTRE|CSTRESS|CELS|PCON");
}
