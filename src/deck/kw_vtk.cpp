#include "deck/card.h"

// *VTK[, FREQUENCY=][, TIME INTERVAL=][, FORMAT=LEGACY|VTU|BINARY|ASCII] : default every increment
void kw_vtk(Card& card, Model& model)
{
  VtkDef& v = model.output.vtk;
  v.on = true;
  const int format = card_param_word(card, "FORMAT", "LEGACY|VTU|BINARY|ASCII", 0);
  v.xml       = format == 1;
  v.ascii     = format == 3;
  v.interval  = card_param_real(card, "TIME INTERVAL", 0.0, above(0.0));
  v.frequency = card_param_int(card, "FREQUENCY", v.interval > 0.0 ? 0 : 1, 1, 2147483647);
}
