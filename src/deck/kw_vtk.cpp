#include "deck/card.h"

// *VTK[, FREQUENCY=][, TIME INTERVAL=][, FORMAT=BINARY|ASCII] : without both every increment
void kw_vtk(Card& card, Model& model)
{
  VtkDef& v = model.vtk;
  v.on = true;
  v.ascii     = card_param_word(card, "FORMAT", "BINARY|ASCII", 0) == 1;
  v.interval  = card_param_real(card, "TIME INTERVAL", 0.0, above(0.0));
  v.frequency = card_param_int(card, "FREQUENCY", v.interval > 0.0 ? 0 : 1, 1, 2147483647);
}
