// ---------------------------------------------------------------------------
// deck.h : interface of the deck reader for main (dialect: doc/keywords/README.md)
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_DECK_H
#define MPFE_DECK_DECK_H

#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "model/model.h"

// deck_read : reads a deck into the model and checks it. defines: -D name=value.
// Errors go to stderr, each with its line, a caret and the allowed values. Returns the number of errors.
int deck_read(const std::string& path, const std::vector<std::pair<std::string, double>>& defines,
              Model& model);

// deck_list_keywords : prints name, one line of help and page of each keyword
void deck_list_keywords(std::FILE* out);

// deck_help : prints the page of a keyword (doc/keywords, or the installed copy). False: unknown keyword;
// the message suggests the nearest one.
bool deck_help(const std::string& word, std::FILE* out);

#endif
