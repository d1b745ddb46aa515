#include "deck/card.h"

// *RESTART, WRITE[, FREQUENCY=][, TIME INTERVAL=][, OVERLAY] and *RESTART, READ
void kw_restart(Card& card, Model& model)
{
  RestartDef& r    = model.output.restart;
  const bool write = card_flag(card, "WRITE"), read = card_flag(card, "READ");
  if (!write && !read)
    card_error(card, card.head.at, "WRITE or READ must be given: *RESTART, WRITE or *RESTART, READ");
  for (const char* name : {"FREQUENCY", "TIME INTERVAL", "OVERLAY"})
    if (!write && card_param(card, name))
      card_error(card, card_param(card, name)->key, std::string(name) + " requires WRITE");
  if (write && r.write) card_error(card, card.head.at, "*RESTART, WRITE is given already");
  r.read = r.read || read;
  if (!write) return;
  r.frequency = card_param_int(card, "FREQUENCY", 0, 0, 2147483647);
  if (r.frequency == 0 && card_param(card, "FREQUENCY")) return;   // as in Abaqus: no files
  r.write     = true;
  r.interval  = card_param_real(card, "TIME INTERVAL", 0.0, above(0.0));
  r.overlay   = card_flag(card, "OVERLAY");
}
