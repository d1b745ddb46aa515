#include "deck/kw_output.h"

// *EL PRINT, ELSET=[, FREQUENCY=] : S, E, ENER, PEEQ
void kw_el_print(Card& card, Model& model) { print_read(card, model, true, "S|E|ENER|PEEQ"); }
