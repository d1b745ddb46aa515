#include "deck/kw_output.h"

// *EL FILE[, FREQUENCY=]
void kw_el_file(Card& card, Model& model) { file_read(card, model, "S|E|ENER|ME|PEEQ|ELSE|NOE"); }
