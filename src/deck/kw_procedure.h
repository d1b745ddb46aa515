// ---------------------------------------------------------------------------
// kw_procedure.h : what *STATIC and *DYNAMIC have in common
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_KW_PROCEDURE_H
#define MPFE_DECK_KW_PROCEDURE_H

#include "deck/card.h"

// procedure_read : dt, period[, dt_min[, dt_max]] and DIRECT into the open step
void procedure_read(Card& card, Model& model, Procedure proc);

// procedure_begin : the open step has this procedure, and no other one yet
// procedure_times : [dt], period[, , dt_max] of an explicit step; without dt the largest stable one
void procedure_begin(Card& card, Model& model, Procedure proc);
void procedure_times(Card& card, Step& s);

#endif
