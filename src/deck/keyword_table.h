#ifndef MPFE_DECK_KEYWORD_TABLE_H
#define MPFE_DECK_KEYWORD_TABLE_H

#include "deck/card.h"

enum {                         // where a keyword is allowed
  IN_MODEL    = 1,             // before the first *STEP
  IN_STEP     = 2,             // between *STEP and *END STEP
  AFTER_STEPS = 4,             // outside steps, after the first one
  IN_MATERIAL = 8,             // after a *MATERIAL
  IN_INTERACTION = 16          // after a *SURFACE INTERACTION
};

struct Keyword {
  const char* word;
  void (*read)(Card&, Model&);
  int where;
  const char* params;          // separated by |; a trailing ! marks required ones
  const char* help;
};

extern const Keyword keyword_table[];
extern const int keyword_count;

const Keyword* keyword_find(const std::string& word);    // ignores blanks; null: unknown

#endif
