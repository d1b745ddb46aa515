// ---------------------------------------------------------------------------
// kw_procedure.h : what *STATIC and *DYNAMIC have in common
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_KW_PROCEDURE_H
#define MPFE_DECK_KW_PROCEDURE_H

#include "deck/card.h"

// procedure_read : dt, period[, dt_min[, dt_max]] and DIRECT into the open step
void procedure_read(Card& card, Model& model, Procedure proc);

#endif
