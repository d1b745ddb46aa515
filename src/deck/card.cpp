#include "deck/card.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "deck/keyword_table.h"

namespace {

bool within(const Limit& l, double v)
{
  if (l.has_lo && (l.ends ? v < l.lo : v <= l.lo)) return false;
  if (l.has_hi && (l.ends ? v > l.hi : v >= l.hi)) return false;
  return true;
}

std::string limit_text(const Limit& l, double v)
{
  const std::string lo = text_number(l.lo), hi = text_number(l.hi);
  if (l.has_lo && l.has_hi)
    return "must lie between " + lo + " and " + hi +
           (!l.ends && (v == l.lo || v == l.hi) ? ", ends excluded" : "");
  return (l.ends ? "must be at least " : "must be above ") + lo;
}

// an allowed number, used after an error
double harmless(const Limit& l)
{
  if (l.has_lo && l.has_hi) return 0.5 * (l.lo + l.hi);
  return l.has_lo ? l.lo + 1.0 : 0.0;
}

double real_of(Card& c, const Field& f, const char* name, const Limit& limit)
{
  double v = 0.0;
  if (f.bad) return harmless(limit);
  if (!parse_real(f.text, v) || f.quoted) {
    card_error(c, f,
               std::string(name) + " must be a number, not " +
                   (f.quoted ? "a function in quotes" : text_show(f.text)) +
                   " (an expression of parameters is written in < >)");
    return harmless(limit);
  }
  if (within(limit, v)) return v;
  card_error(c, f, std::string(name) + " = " + text_show(f.text) + " " + limit_text(limit, v));
  return harmless(limit);
}

int int_of(Card& c, const Field& f, const char* name, int lo, int hi)
{
  long long v = 0;
  if (f.bad) return lo;
  const char* first = f.text.data() + (!f.text.empty() && f.text[0] == '+' ? 1 : 0);
  const char* last = f.text.data() + f.text.size();
  const auto r = std::from_chars(first, last, v);
  if (f.quoted || r.ptr != last || r.ec == std::errc::invalid_argument) {
    card_error(c, f, std::string(name) + " must be a whole number, not " + text_show(f.text));
    return lo;
  }
  if (r.ec == std::errc() && v >= lo && v <= hi) return static_cast<int>(v);
  card_error(c, f,
             std::string(name) + " = " + text_show(f.text) +
                 text_format(" must lie between %d and %d", lo, hi));
  return lo;
}

int word_of(Card& c, const Field& f, const char* name, const char* words)
{
  const std::vector<std::string> list = split_words(words);
  for (std::size_t i = 0; i < list.size(); ++i)
    if (text_squeeze(f.text) == text_squeeze(list[i])) return static_cast<int>(i);
  const std::string nearest = text_nearest(f.text, list);
  std::string allowed;
  for (const std::string& w : list) allowed += (allowed.empty() ? "" : ", ") + w;
  card_error(c, f, std::string(name) + " " + text_show(f.text) + " is not known; allowed: " + allowed +
             (nearest.empty() ? "" : "; did you mean " + nearest + "?"));
  return -1;
}

const HeadParam* with_value(Card& c, const char* name)
{
  const HeadParam* p = card_param(c, name);
  if (!p) return nullptr;
  if (p->has_value && !p->value.empty()) return p;
  card_error(c, p->key, std::string(name) + " needs a value: " + name + "=...");
  return nullptr;
}

Expr expr_of(Card& c, const Field& f, const char* name)
{
  Expr e = expr_number(0.0);
  if (f.quoted) deck_function(*c.deck, f, f.text, e);
  else if (!parse_real(f.text, e.value))
    card_error(c, f,
               std::string(name) + " must be a number or a function of x, y, z, t in double quotes, not " +
                   text_show(f.text));
  return e;
}

// true: the next field is given; skips an empty one
bool next_given(Card& c)
{
  if (!c.open && !card_line(c)) return false;
  if (c.next < c.field.size() && c.field[c.next].empty()) {
    ++c.next;
    return false;
  }
  return c.next < c.field.size();
}

}  // namespace

Limit any_number() { return {0.0, 0.0, false, false, true}; }
Limit above(double lo) { return {lo, 0.0, true, false, false}; }
Limit at_least(double lo) { return {lo, 0.0, true, false, true}; }
Limit between(double lo, double hi) { return {lo, hi, true, true, false}; }
Limit from_to(double lo, double hi) { return {lo, hi, true, true, true}; }

// ---------------------------------------------------------------------------
// parse_real : the whole text as a finite number; exponents with e or d; no nan, inf or hexadecimal
// ---------------------------------------------------------------------------
bool parse_real(const std::string& text, double& value)
{
  if (text.empty() || text.size() > 400 || text.find_first_not_of("0123456789+-.eEdD") != std::string::npos)
    return false;
  std::string s = text[0] == '+' ? text.substr(1) : text;
  if (s.empty() || s[0] == '+' || (text[0] == '+' && s[0] == '-')) return false;
  for (char& c : s)
    if (c == 'd' || c == 'D') c = 'e';
  double v = 0.0;
  const auto r = std::from_chars(s.data(), s.data() + s.size(), v);
  if (r.ptr != s.data() + s.size() || r.ec == std::errc::invalid_argument) return false;
  if (r.ec == std::errc::result_out_of_range) {      // underflow gives 0, overflow is an error
    const std::size_t e = s.find_first_of("eE");
    if (e == std::string::npos || e + 1 >= s.size() || s[e + 1] != '-') return false;
    v = 0.0;
  }
  if (!std::isfinite(v)) return false;
  value = v;
  return true;
}

std::vector<std::string> split_words(const char* words)
{
  std::vector<std::string> list(1);
  for (; *words; ++words) {
    if (*words == '|') list.emplace_back();
    else list.back() += *words;
  }
  return list;
}

// ---- data lines -----------------------------------------------------------

bool card_line(Card& c)
{
  if (c.open && card_more(c) && card_good(c))
    card_error(c, c.field[c.next],
               "this field is left over; *" + c.head.word + text_format(" reads %zu here", c.next));
  c.open = false;
  c.next = 0;
  c.field.clear();
  bool keyword = false;
  if (!deck_peek(*c.deck, keyword) || keyword) return false;
  c.errors_line = c.deck->messages.errors;
  deck_fields(*c.deck, true, c.field, c.whole, c.comma);
  c.open = true;
  return true;
}

void card_join(Card& c)
{
  bool keyword = false;
  if (!deck_peek(*c.deck, keyword) || keyword) return;
  std::vector<Field> more;
  Field whole;
  deck_fields(*c.deck, true, more, whole, c.comma);
  c.field.insert(c.field.end(), more.begin(), more.end());
}

bool card_text(Card& c, std::string& text)
{
  bool keyword = false;
  if (!deck_peek(*c.deck, keyword) || keyword) return false;
  deck_fields(*c.deck, false, c.field, c.whole, c.comma);
  text = c.whole.text;
  return true;
}

bool card_more(const Card& c) { return c.open && c.next < c.field.size(); }
bool card_good(const Card& c) { return c.deck->messages.errors == c.errors_line; }

void card_end(Card& c)
{
  if (!card_line(c)) return;
  if (c.deck->messages.errors == c.errors_before)
    card_error(c, c.whole, "this data line is left over; *" + c.head.word + " reads no further line");
  c.next = c.field.size();
  while (card_line(c)) c.next = c.field.size();
}

// ---- fields ---------------------------------------------------------------

Field card_field(Card& c, const char* name)
{
  if (!c.open && !card_line(c)) {
    card_error(c, c.head.at, std::string("a data line with ") + name + " must follow");
    c.errors_line = c.deck->messages.errors - 1;
    return c.head.at;
  }
  if (c.next < c.field.size() && !c.field[c.next].empty()) return c.field[c.next++];
  Field f = c.whole;
  f.text.clear();
  f.column += std::max(0, f.length - 1);
  f.length = 1;
  f.number = static_cast<int>(c.next) + 1;
  if (c.next < c.field.size()) f = c.field[c.next++];
  card_error(c, f, std::string(name) + " is missing here");
  return f;
}

Field card_field_or_none(Card& c) { return card_more(c) ? c.field[c.next++] : Field(); }

double card_real(Card& c, const char* name, const Limit& limit)
{
  const Field f = card_field(c, name);
  return c.open && !f.empty() ? real_of(c, f, name, limit) : harmless(limit);
}

double card_real_or(Card& c, const char* name, double preset, const Limit& limit)
{
  return next_given(c) ? real_of(c, c.field[c.next++], name, limit) : preset;
}

int card_int(Card& c, const char* name, int lo, int hi)
{
  const Field f = card_field(c, name);
  return c.open && !f.empty() ? int_of(c, f, name, lo, hi) : lo;
}

int card_int_or(Card& c, const char* name, int preset, int lo, int hi)
{
  return next_given(c) ? int_of(c, c.field[c.next++], name, lo, hi) : preset;
}

int card_label(Card& c, const char* name) { return card_int(c, name, 1, 2147483647); }

int card_word(Card& c, const char* name, const char* words)
{
  const Field f = card_field(c, name);
  return c.open && !f.empty() ? word_of(c, f, name, words) : -1;
}

Expr card_expr(Card& c, const char* name)
{
  const Field f = card_field(c, name);
  return c.open && !f.empty() ? expr_of(c, f, name) : expr_number(0.0);
}

Expr card_expr_or_zero(Card& c, const char* name)
{
  return next_given(c) ? expr_of(c, c.field[c.next++], name) : expr_number(0.0);
}

int card_dof(Card& c, const Model& m, const char* name)
{
  const Field f = card_field(c, name);
  if (!c.open || f.empty()) return -1;
  const int errors = c.deck->messages.errors;
  const int dof = int_of(c, f, name, 1, m.dim) - 1;
  return c.deck->messages.errors == errors ? dof : -1;
}

std::array<double, 3> card_direction(Card& c, const Model& m)
{
  const char* const name = "direction";
  const Field first = c.next < c.field.size() ? c.field[c.next] : c.whole;
  std::array<double, 3> n{{0, 0, 0}};
  for (int i = 0; i < m.dim; ++i) n[i] = card_real(c, name, any_number());
  if (m.dim == 2) n[2] = card_real_or(c, name, 0.0, from_to(0.0, 0.0));
  const double s = std::hypot(n[0], n[1], n[2]);
  if (card_good(c) && !(s > 0.0 && std::isfinite(s)))
    card_error(c, first,
               std::string("direction is the zero vector; give a direction such as ") +
                   (m.dim == 3 ? "0, 0, -1" : "0, -1"));
  for (double& v : n) v = s > 0.0 ? v / s : 0.0;
  return n;
}

bool card_box(Card& c, int dim, const char* low, const char* high, double lo[3], double hi[3])
{
  std::string all;
  for (const char* end : {low, high})
    for (int i = 0; i < dim; ++i) all += (all.empty() ? "" : ", ") + std::string(1, "xyz"[i]) + end;
  if (!c.open && !card_line(c)) {
    card_error(c, c.head.at, "a data line with the box must follow: " + all);
    return false;
  }
  if (dim == 3 && c.field.size() == 4) {
    card_error(c, c.whole, "the model has three dimensions: a box has six numbers, " + all);
    c.next = c.field.size();
    return false;
  }
  for (int i = 0; i < dim; ++i) lo[i] = card_real(c, (std::string(1, "xyz"[i]) + low).c_str(), any_number());
  for (int i = 0; i < dim; ++i) hi[i] = card_real(c, (std::string(1, "xyz"[i]) + high).c_str(), above(lo[i]));
  return card_good(c);
}

bool card_cells(Card& c, int dim, int n[3])
{
  const char* const name[3] = {"nx", "ny", "nz"};
  for (int i = 0; i < dim; ++i) n[i] = card_int(c, name[i], 1, 50000000);
  return card_good(c);
}

// ---- parameters -----------------------------------------------------------

const HeadParam* card_param(const Card& c, const char* name)
{
  const std::string key = text_squeeze(name);
  for (const HeadParam& p : c.head.param)
    if (p.name == key) return &p;
  return nullptr;
}

bool card_flag(Card& c, const char* name)
{
  const HeadParam* p = card_param(c, name);
  if (p && p->has_value) card_error(c, p->value, std::string(name) + " takes no value");
  return p != nullptr;
}

std::string card_param_name(Card& c, const char* name)
{
  const HeadParam* p = with_value(c, name);
  if (!p) return "";
  const std::string s = text_upper(p->value.text);
  const bool letter = !s.empty() && ((s[0] >= 'A' && s[0] <= 'Z') || s[0] == '_' || (s[0] & 0x80));
  if (letter && s.size() <= 80 && s.find_first_of(",\"*|") == std::string::npos) return s;
  card_error(c, p->value, "a name begins with a letter, has at most 80 characters and no , \" * |");
  return "";
}

Field card_param_field(Card& c, const char* name)
{
  const HeadParam* p = with_value(c, name);
  Field f = p ? p->value : c.head.at;
  f.text = p ? text_upper(f.text) : "";
  return f;
}

int card_param_word(Card& c, const char* name, const char* words, int preset)
{
  const HeadParam* p = with_value(c, name);
  return p ? word_of(c, p->value, name, words) : preset;
}

bool card_param_yes(Card& c, const char* name, bool alone, bool preset)
{
  const HeadParam* p = card_param(c, name);
  if (p && !p->has_value && alone) return true;
  return card_param_word(c, name, "NO|YES", preset ? 1 : 0) == 1;
}

double card_param_real(Card& c, const char* name, double preset, const Limit& limit)
{
  const HeadParam* p = with_value(c, name);
  return p ? real_of(c, p->value, name, limit) : preset;
}

int card_param_int(Card& c, const char* name, int preset, int lo, int hi)
{
  const HeadParam* p = with_value(c, name);
  return p ? int_of(c, p->value, name, lo, hi) : preset;
}

bool card_param_where(Card& c, Expr& out)
{
  const HeadParam* p = with_value(c, "WHERE");
  if (!p) return false;
  if (p->value.quoted) return deck_function(*c.deck, p->value, p->value.text, out);
  card_error(c, p->value,
             "WHERE is a function of x, y, z in double quotes, for example WHERE=\"x > 0.5\"");
  return false;
}

bool card_where(Card& c, const Expr& where, const double* X, int dim, const std::string& name)
{
  const double value = expr_eval(where, X, 0.0);
  if (!std::isfinite(value) && c.deck->messages.errors == c.errors_before)
    card_error(c, card_param(c, "WHERE")->value, "WHERE is not a finite number at " + name + " " +
               position_text(X, dim) + ": check roots, logarithms and divisions");
  return value != 0.0;
}

// substitute for an unavailable element type of Abaqus or CalculiX; "": not such a type
std::string other_element(const std::string& name)
{
  struct Family {
    const char *begin, *words;
  };
  static const Family family[] = {
      {"C3D20", "this form is not available; use C3D20R, or C3D20"},
      {"C3D27", "bricks of 27 nodes are not available; use C3D20R, with the first 20 nodes (gmsh: "
                "Mesh.SecondOrderIncomplete = 1)"},
      {"C3D18", "wedges of 18 nodes are not available; use C3D15, with the first 15 nodes (gmsh: "
                "Mesh.SecondOrderIncomplete = 1)"},
      {"C3D5", "this form is not available; use C3D5"},
      {"C3D13", "quadratic pyramids are not available; mesh with linear elements (C3D5) or tetrahedra alone"},
      {"C3D14", "quadratic pyramids are not available; mesh with linear elements (C3D5) or tetrahedra alone"},
      {"C3D15", "this form is not available; use C3D15"},
      {"C3D10", "this form is not available; use C3D10"},
      {"C3D8", "this form of integration is not available; use C3D8, or C3D8I for bending"},
      {"M3D9", "quadrilaterals of 9 nodes are not available; write 8-node ones (gmsh: "
               "Mesh.SecondOrderIncomplete = 1)"},
      {"CPE8", "this form is not available; use CPE8R, or CPE8"},
      {"CPS8", "this form is not available; use CPS8R, or CPS8"},
      {"CPE6", "this form is not available; use CPE6"},
      {"CPS6", "this form is not available; use CPS6"},
      {"CPE4", "this form of integration is not available; use CPE4, or CPE4I for bending"},
      {"CPS4", "this form of integration is not available; use CPS4, or CPS4I for bending"},
      {"CAX", "axisymmetric elements are not available"},
      {"S3", "shells are not available; use solid elements"},
      {"S4", "shells are not available; use solid elements"},
      {"S6", "shells are not available; use solid elements"},
      {"S8", "shells are not available; use solid elements"},
      {"M3D", "membranes are not available; use solid elements"},
      {"B2", "beams are not available; use solid elements"},
      {"B3", "beams are not available; use solid elements"},
      {"T2D", "trusses are not available; use solid elements"},
      {"T3D", "trusses are not available; use solid elements"},
      {"SPRING", "springs are not available; *BOND, TYPE=GROUND is a spring to the ground"},
  };
  for (const Family& f : family) {
    const std::string begin = f.begin;
    if (name.compare(0, begin.size(), begin) == 0) return f.words;
  }
  return "";
}

int card_param_element(Card& c, std::string* remedy)
{
  const HeadParam* const p = with_value(c, "TYPE");
  if (!p) return -1;
  Field f = p->value;
  f.text  = element_type_here(*c.deck, f.text);
  const std::string name = text_squeeze(f.text), other = elem_type_find(name) < 0 ? other_element(name) : "";
  if (!other.empty()) {
    if (remedy) *remedy = other;
    else card_error(c, f, "TYPE " + text_show(name) + ": " + other);
    return -1;
  }
  const int type = word_of(c, f, "TYPE", element_type_words().c_str());
  if (type >= 0)
    deck_same_dimension(*c.deck, card_param(c, "TYPE")->value, elem_table[type].name,
                        shape_info[elem_table[type].shape].dim);
  return type;
}

int card_param_amplitude(Card& c, Model& m)
{
  const Field f      = card_param_field(c, "AMPLITUDE");
  const double delay = card_param_real(c, "TIME DELAY", 0.0, at_least(0.0));
  const int index    = f.empty() ? -1 : target_amplitude(*c.deck, m, f);
  if (delay == 0.0) return index;
  if (index < 0 || m.amplitude[index].kind == AMP_EXPRESSION) {
    if (index >= 0 || f.empty())
      card_error(c, card_param(c, "TIME DELAY")->value,
                 "TIME DELAY requires AMPLITUDE= with a table; write the delay into a function of t");
    return index;
  }
  Amplitude later = m.amplitude[index];
  later.name += " " + text_number(delay) + " LATER";
  for (double& t : later.t) t += delay;
  m.amplitude.push_back(later);
  return static_cast<int>(m.amplitude.size()) - 1;
}

bool card_op_new(Card& c) { return card_param_word(c, "OP", "MOD|NEW", 0) == 1; }

// ---- messages -------------------------------------------------------------

void card_error(Card& c, const Field& at, const std::string& text) { deck_error(*c.deck, at, text); }
void card_warn(Card& c, const Field& at, const std::string& text) { deck_warn(*c.deck, at, text); }
DeckLine card_deck_line(const Card& c) { return deck_line_of(*c.deck, c.head.at); }
DeckLine line_place(const Card& c) { return deck_line_of(*c.deck, c.open ? c.whole : c.head.at); }

void card_later(Card& c, Stage stage, std::function<void(Deck&, Model&)> run)
{
  Later l;
  l.word = c.head.word;
  l.run = std::move(run);
  c.deck->later[stage].push_back(std::move(l));
}

Material& card_parent_material(Card& c, Model& m) { return m.material[c.deck->open.material]; }

void card_temperature(Card& c)
{
  card_real_or(c, "temperature", 0.0, any_number());
  if (card_good(c) && card_line(c)) {
    card_error(c, c.whole, "a second row would depend on temperature, which *" + c.head.word +
               " does not support; keep only the row of the temperature of the run");
    do c.next = c.field.size();
    while (card_line(c));
  }
}
