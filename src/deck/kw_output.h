// ---------------------------------------------------------------------------
// kw_output.h : output keywords of CalculiX
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_KW_OUTPUT_H
#define MPFE_DECK_KW_OUTPUT_H

#include "deck/card.h"

// file_read : *NODE FILE, *EL FILE, *CONTACT FILE request VTK files, which contain all quantities of the
// data lines
void file_read(Card& card, Model& model, const char* words);

// print_read : *NODE PRINT, *EL PRINT
void print_read(Card& card, Model& model, bool element, const char* words);

#endif
