// ---------------------------------------------------------------------------
// kw_procedure.h : times and procedure of a step, for *STATIC and *DYNAMIC
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_KW_PROCEDURE_H
#define MPFE_DECK_KW_PROCEDURE_H

#include "deck/card.h"

// procedure_read : reads dt, period[, dt_min[, dt_max]] and DIRECT of the open step
void procedure_read(Card& card, Model& model, Procedure proc);

// procedure_begin : sets the procedure of the open step; a second one is an error
// procedure_times : reads [dt], period[, , dt_max] of an explicit step; without dt the stable increment
void procedure_begin(Card& card, Model& model, Procedure proc);
void procedure_times(Card& card, Step& s);

#endif
