#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <iterator>

#include "deck/deck_state.h"

namespace {

const std::size_t max_text = 4000;

const char* const functions[] = {"sin",   "cos",  "tan",  "asin",  "acos",  "atan",     "atan2",
                                 "sinh",  "cosh", "tanh", "asinh", "acosh", "atanh",    "log2",
                                 "log10", "log",  "ln",   "exp",   "sqrt",  "sign",     "rint",
                                 "abs",   "min",  "max",  "sum",   "avg",   "heaviside"};
const char* const reserved[] = {"x", "y", "z", "t", "pi", "_pi", "_e"};

bool name_char(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_'; }
bool name_start(char c) { return std::isalpha(static_cast<unsigned char>(c)) || c == '_'; }

// rejects syntax that muParser accepts silently: assignments, lists, strings
bool well_formed(const std::string& text, std::string& error, int& position)
{
  int depth = 0;
  const auto fault = [&](const char* message, std::size_t i) {
    error = message;
    position = static_cast<int>(i);
    return false;
  };
  if (text.find_first_not_of(" \t") == std::string::npos) return fault("the expression is empty", 0);
  if (text.size() > max_text) return fault("the expression is longer than 4000 characters", max_text);
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i], next = i + 1 < text.size() ? text[i + 1] : ' ', before = i ? text[i - 1] : ' ';
    if (c == '(' && ++depth > 100) return fault("more than 100 brackets are open", i);
    if (c == ')' && --depth < 0) return fault("the opening bracket is missing", i);
    if (c == ',' && depth == 0) return fault("a comma is allowed only between arguments of a function", i);
    if (c == '=' && next != '=' && before != '=' && before != '<' && before != '>' && before != '!')
      return fault("= is not allowed; to compare write ==", i);
    if (!name_char(c) && !std::strchr(" \t.+-*/^(),<>=!&|?:", c))
      return fault("this character has no meaning in an expression", i);
  }
  if (depth > 0) return fault("a closing bracket is missing", text.size());
  return true;
}

bool listed(const char* const* first, const char* const* last, const std::string& name)
{
  for (; first != last; ++first)
    if (name == *first) return true;
  return false;
}

bool is_function(const std::string& name) { return listed(std::begin(functions), std::end(functions), name); }
bool is_reserved(const std::string& name) { return listed(std::begin(reserved), std::end(reserved), name); }

// finds the first unknown name of the text; false: all are known
bool unknown_name(const Deck& d, const std::string& text, bool with_xyzt, std::string& name, int& position)
{
  for (std::size_t i = 0; i < text.size();) {
    if (std::isdigit(static_cast<unsigned char>(text[i])) || text[i] == '.') {     // a number with exponent
      while (i < text.size() && (name_char(text[i]) || text[i] == '.')) ++i;
    } else if (name_start(text[i])) {
      const std::size_t first = i;
      while (i < text.size() && name_char(text[i])) ++i;
      name = text.substr(first, i - first);
      const bool known = is_function(name) || d.params.value.count(name) ||
                         (is_reserved(name) && (with_xyzt || name.size() > 1));
      position = static_cast<int>(first);
      if (!known) return true;
    } else {
      ++i;
    }
  }
  return false;
}

void note_use(Deck& d, const std::string& text)
{
  std::string name;
  for (std::size_t i = 0; i <= text.size(); ++i) {
    if (i < text.size() && name_char(text[i])) {
      name += text[i];
    } else {
      if (!name.empty()) d.params.used.insert(name);
      name.clear();
    }
  }
}

std::vector<std::string> known_names(const Deck& d, bool with_xyzt)
{
  std::vector<std::string> list;
  for (const auto& p : d.params.value) list.push_back(p.first);
  if (with_xyzt) list.insert(list.end(), {"x", "y", "z", "t"});
  list.push_back("pi");
  return list;
}

// reports an error with the caret below position in the expression
void report(Deck& d, Field at, int offset, const std::string& text, const std::string& error, int position,
            int length)
{
  at.column += offset + std::max(0, std::min(position, static_cast<int>(text.size())));
  at.length = length;
  deck_error(d, at, "expression " + text_show(text) + ": " + error);
}

bool names_are_known(Deck& d, const Field& at, int offset, const std::string& text, bool with_xyzt)
{
  std::string name;
  int position = 0;
  if (!unknown_name(d, text, with_xyzt, name, position)) return true;
  const bool letter = !with_xyzt && is_reserved(name);
  report(d, at, offset, text,
         letter ? "x, y, z, t have no value here; only parameters do"
                : "the name " + text_show(name) + " is not known" +
                      text_suggest(name, known_names(d, with_xyzt)),
         position, static_cast<int>(name.size()));
  return false;
}

}  // namespace

std::string deck_parameter_name_fault(const std::string& name)
{
  if (name.empty() || !name_start(name[0]) || name.size() > 60)
    return "must begin with a letter and have at most 60 characters";
  for (char c : name)
    if (!name_char(c)) return "may contain only letters, digits and _";
  if (is_reserved(name) || is_function(name))
    return "is reserved in expressions (x y z t pi, functions); choose another";
  return "";
}

// ---------------------------------------------------------------------------
// deck_scalar : value of an expression of parameters
//
//   in   at, offset   the word, and the offset of the text in it (caret)
// ---------------------------------------------------------------------------
bool deck_scalar(Deck& d, const Field& at, int offset, const std::string& text, double& value)
{
  std::string error;
  int position = 0;
  note_use(d, text);
  if (!well_formed(text, error, position)) return report(d, at, offset, text, error, position, 1), false;
  if (!names_are_known(d, at, offset, text, false)) return false;
  double v = 0.0;
  if (!expr_scalar(text, d.params.value, v, error, position))
    return report(d, at, offset, text, error, position, 1), false;
  if (!std::isfinite(v)) {
    report(d, at, offset, text, "the value is not a finite number (division by zero?)", 0,
           static_cast<int>(text.size()));
    return false;
  }
  value = v;
  if (d.hashing) deck_hash(d, text_format("%.17g", v));
  return true;
}

// deck_function : "text" -> function of x, y, z, t
bool deck_function(Deck& d, const Field& at, const std::string& text, Expr& out)
{
  std::string error;
  int position = 0;
  note_use(d, text);
  if (!well_formed(text, error, position)) return report(d, at, 1, text, error, position, 1), false;
  if (!names_are_known(d, at, 1, text, true)) return false;
  if (!expr_compile(text, d.params.value, out, error, position))
    return report(d, at, 1, text, error, position, 1), false;
  for (const auto& constant : expr_constants(out))
    if (d.hashing) deck_hash(d, constant.first + text_format("=%.17g", constant.second));
  return true;
}

// deck_function_of_t : a function of t alone (amplitudes)
bool deck_function_of_t(Deck& d, const Field& at, const std::string& text, Expr& out)
{
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool alone = (i == 0 || !name_char(text[i - 1])) &&
                       (i + 1 == text.size() || !name_char(text[i + 1]));
    if (alone && text[i] >= 'x' && text[i] <= 'z') {
      report(d, at, 1, text, "an amplitude is a function of t alone", static_cast<int>(i), 1);
      return false;
    }
  }
  return deck_function(d, at, text, out);
}
