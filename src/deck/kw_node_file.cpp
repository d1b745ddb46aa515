#include "deck/kw_output.h"

// *NODE FILE[, FREQUENCY=]
void kw_node_file(Card& card, Model& model) { file_read(card, model, "U|V|A|RF|NT|PU"); }
