// ---------------------------------------------------------------------------
// deck.h : the deck reader as main sees it (dialect: doc/keywords/README.md)
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_DECK_H
#define MPFE_DECK_DECK_H

#include <cstdio>
#include <string>
#include <utility>
#include <vector>

#include "model/model.h"

// deck_read : deck -> model, checked. defines are those of -D name=value.
// All mistakes go to stderr, each with its line, a caret and what is allowed. Returns the number of errors.
int deck_read(const std::string& path, const std::vector<std::pair<std::string, double>>& defines,
              Model& model);

// deck_list_keywords : name, one line of help, page
void deck_list_keywords(std::FILE* out);

// deck_help : the page of a keyword (doc/keywords, also after make install). False: there is no such
// keyword, and a message says what is near.
bool deck_help(const std::string& word, std::FILE* out);

#endif
