#include "deck/kw_output.h"

// *NODE PRINT, NSET=[, FREQUENCY=][, TOTALS=YES] : U, V, A, RF
void kw_node_print(Card& card, Model& model) { print_read(card, model, false, "U|V|A|RF"); }
