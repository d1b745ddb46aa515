#include "deck/kw_procedure.h"

// *STATIC[, DIRECT] : dt, period[, dt_min[, dt_max]]
void kw_static(Card& card, Model& model) { procedure_read(card, model, PROC_STATIC); }
