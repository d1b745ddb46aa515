// ---------------------------------------------------------------------------
// card.h : a keyword with its parameters and data lines, for its reader
//
// A reader takes the fields in order. The first field opens the first data line; card_line opens the next.
// Each card_ routine reports its errors and then returns an allowed value, so that reading continues.
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_CARD_H
#define MPFE_DECK_CARD_H

#include <cmath>

#include "deck/deck_state.h"

struct Keyword;

struct Card {
  Deck* deck = nullptr;
  const Keyword* keyword = nullptr;
  Head head;
  std::vector<Field> field;    // of the open data line
  Field whole;                 // the open data line
  std::size_t next = 0;        // index of the next field
  bool open = false;           // a data line is open
  bool comma = false;          // the open line ends in a comma
  int errors_before = 0, errors_line = 0;   // Deck::errors when card and line were opened
};

struct Limit {                 // range of a number
  double lo, hi;
  bool has_lo, has_hi, ends;   // ends: lo and hi are included
};
Limit any_number();
Limit above(double lo);
Limit at_least(double lo);
Limit between(double lo, double hi);     // without the ends
Limit from_to(double lo, double hi);     // with the ends

// ---- data lines
// opens the next data line; reports unread fields of the previous one
bool card_line(Card& c);
void card_join(Card& c);                 // appends the next data line to the open one
bool card_text(Card& c, std::string& text);    // opens the next line as raw text
bool card_more(const Card& c);           // the open line has another field
bool card_good(const Card& c);           // no error in the open line so far
void card_end(Card& c);                  // a further field or line is an error

// ---- fields of the open line. name: name in messages. words: "MEAN|SUM|MAX".
Field card_field(Card& c, const char* name);
Field card_field_or_none(Card& c);       // empty: no such field
double card_real(Card& c, const char* name, const Limit& limit);
double card_real_or(Card& c, const char* name, double preset, const Limit& limit);
int card_int(Card& c, const char* name, int lo, int hi);
int card_int_or(Card& c, const char* name, int preset, int lo, int hi);
int card_label(Card& c, const char* name);
int card_word(Card& c, const char* name, const char* words);       // index, -1: error
Expr card_expr(Card& c, const char* name);                         // number or "function"
Expr card_expr_or_zero(Card& c, const char* name);
int card_dof(Card& c, const Model& m, const char* name);           // 0-based, -1: error
std::array<double, 3> card_direction(Card& c, const Model& m);     // unit vector
// xLOW, yLOW[, zLOW], xHIGH ...; false: error
bool card_box(Card& c, int dim, const char* low, const char* high, double lo[3], double hi[3]);
bool card_cells(Card& c, int dim, int n[3]);                       // nx, ny[, nz]; false: error

// ---- parameters of the keyword line
const HeadParam* card_param(const Card& c, const char* name);      // null: not given
bool card_flag(Card& c, const char* name);                         // NAME without a value
std::string card_param_name(Card& c, const char* name);            // upper case; "" when missing or invalid
Field card_param_field(Card& c, const char* name);                 // value, upper case, to look up
int card_param_word(Card& c, const char* name, const char* words, int preset);
// NAME=YES|NO; alone: NAME without a value is YES
bool card_param_yes(Card& c, const char* name, bool alone, bool preset);
double card_param_real(Card& c, const char* name, double preset, const Limit& limit);
int card_param_int(Card& c, const char* name, int preset, int lo, int hi);
bool card_param_where(Card& c, Expr& out);                         // WHERE="function"
inline double card_radians(double degrees) { return degrees * std::acos(-1.0) / 180.0; }
// card_where : where != 0 at X; a value that is not finite is an error, reported once. name: node, element
bool card_where(Card& c, const Expr& where, const double* X, int dim, const std::string& name);
// TYPE= as index into elem_table, -1: error
int card_param_element(Card& c, std::string* remedy = nullptr);
int card_param_amplitude(Card& c, Model& m);     // index or -1; TIME DELAY= adds a shifted copy
bool card_op_new(Card& c);                                         // OP=NEW

// ---- messages, lines of the deck, deferred work
void card_error(Card& c, const Field& at, const std::string& text);
void card_warn(Card& c, const Field& at, const std::string& text);
DeckLine card_deck_line(const Card& c);                                   // the keyword line
DeckLine line_place(const Card& c);                                   // the open data line
void card_later(Card& c, Stage stage, std::function<void(Deck&, Model&)> run);
Material& card_parent_material(Card& c, Model& m);
void card_temperature(Card& c);          // last field of the only row of a material
bool parse_real(const std::string& text, double& value);           // the whole text is a finite number
std::vector<std::string> split_words(const char* words);

#endif
