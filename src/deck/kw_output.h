// ---------------------------------------------------------------------------
// kw_output.h : what the output keywords of CalculiX have in common
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_KW_OUTPUT_H
#define MPFE_DECK_KW_OUTPUT_H

#include "deck/card.h"

// file_read : *NODE FILE, *EL FILE, *CONTACT FILE : a request for VTK; the quantities of the data lines are
// all in there anyway
void file_read(Card& card, Model& model, const char* words);

// print_read : *NODE PRINT, *EL PRINT
void print_read(Card& card, Model& model, bool element, const char* words);

#endif
