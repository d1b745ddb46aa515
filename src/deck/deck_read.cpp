#include <algorithm>
#include <cmath>
#include <filesystem>
#include <new>

#include "deck/deck.h"
#include "deck/keyword_table.h"

namespace {

std::vector<std::string> keyword_words()
{
  std::vector<std::string> list;
  for (int i = 0; i < keyword_count; ++i) list.push_back(keyword_table[i].word);
  return list;
}

// hint for a keyword of Abaqus or CalculiX that is not available here; "": none
std::string other_keyword(const std::string& word)
{
  for (const char* part : {"PART", "END PART", "ASSEMBLY", "END ASSEMBLY", "INSTANCE", "END INSTANCE"})
    if (word == part)
      return ": the file has no *PART";
  return "";
}

// Keywords that are ignored: output requests of Abaqus (here *VTK, *HISTORY and the keywords of CalculiX),
// controls of another program, thermal properties
bool is_ignored(const std::string& word)
{
  for (const char* other : {"PREPRINT", "OUTPUT", "NODE OUTPUT", "ELEMENT OUTPUT", "CONTACT OUTPUT",
                            "ENERGY OUTPUT", "FILE FORMAT", "TIME POINTS", "MONITOR", "PRINT", "CONTROLS",
                            "SECTION CONTROLS", "EXPANSION", "CONDUCTIVITY", "SPECIFIC HEAT",
                            "PHYSICAL CONSTANTS"})
    if (word == other) return true;
  return false;
}

// *OUTPUT (2), *PREPRINT
std::string ignored_text(const Deck& d)
{
  std::string text;
  for (const auto& p : d.passed)
    text += (text.empty() ? "*" : ", *") + p.first +
            (p.second > 1 ? " (" + std::to_string(p.second) + ")" : "");
  if (!d.parts.empty()) text += (text.empty() ? "" : "; ") + ("*PART made flat: " + d.parts);
  return text;
}

void skip_data(Deck& d)
{
  std::vector<Field> field;
  Field whole;
  bool keyword = false, comma = false;
  while (deck_peek(d, keyword) && !keyword) deck_fields(d, false, field, whole, comma);
}

// checks the parameters: unknown, repeated, missing. False: the card cannot be read.
bool check_params(Card& c)
{
  std::vector<std::string> valid;
  bool fit = true;
  for (std::string p : split_words(c.keyword->params)) {
    const bool required = !p.empty() && p.back() == '!';
    if (required) p.pop_back();
    if (!p.empty()) valid.push_back(p);
    if (!required || card_param(c, p.c_str())) continue;
    card_error(c, c.head.at, "parameter " + p + " is missing: write *" + c.head.word + ", " + p + "=...");
    fit = false;
  }
  for (const HeadParam& p : c.head.param) {
    bool known = false;
    for (const std::string& v : valid) known = known || text_squeeze(v) == p.name;
    if (!known && valid.empty()) card_error(c, p.key, "*" + c.head.word + " has no parameters");
    else if (!known)
      card_error(c, p.key,
                 "parameter " + text_show(p.key.text) + " is not known" + text_suggest(p.key.text, valid));
    else if (card_param(c, p.name.c_str()) != &p)
      card_error(c, p.key, "parameter " + p.name + " is given twice");
  }
  return fit;
}

// checks that the keyword is allowed here; closes the open material and interaction
bool keyword_allowed(Card& c, const Model& m)
{
  Deck& d = *c.deck;
  const int where = c.keyword->where;
  const std::string word = "*" + c.head.word;
  const bool of_material = where == IN_MATERIAL, of_interaction = where == IN_INTERACTION;
  const bool anywhere = c.head.word == "PARAMETER" || c.head.word == "HEADING";
  if (!of_material && !anywhere) d.open.material = -1;
  if (!of_interaction && !anywhere) d.open.interaction = -1;
  if (of_material || of_interaction) {
    if (of_material ? d.open.material >= 0 : d.open.interaction >= 0) return true;
    card_error(c, c.head.at, word + " must follow a *" + (of_material ? "MATERIAL" : "SURFACE INTERACTION"));
    return false;
  }
  const int here = d.open.step ? IN_STEP : m.step.empty() ? IN_MODEL : AFTER_STEPS;
  if (where & here) return true;
  if (d.open.step)
    card_error(c, c.head.at,
               word + " is not allowed inside a step (opened in " +
                   spot_text(d, Spot{d.open.step_at.file, d.open.step_at.line}) + ")");
  else if (where == IN_STEP)
    card_error(c, c.head.at, word + " is allowed only inside a step, between *STEP and *END STEP");
  else card_error(c, c.head.at, word + " must precede the first *STEP");
  return false;
}

// adds keyword and parameters to the hash by which a restart file is matched to its deck. Keywords of output
// and of solution control are left out, and the limit of increments; a *PARAMETER counts where it is used.
// Columns and checks are those of the whole run wherever they stand
void hash_card(Deck& d, const Card& c)
{
  const std::vector<std::string> excluded = split_words(
      "CONTACT FILE|CONTACT PRINT|EL FILE|EL PRINT|FRAGMENTS|HEADING|NEWTON|"
      "NODE FILE|NODE PRINT|PARAMETER|RESTART|SOLVER|VTK");
  const auto listed = [&](const std::vector<std::string>& words) {
    return std::find(words.begin(), words.end(), c.head.word) != words.end();
  };
  d.hashing   = !listed(excluded);
  d.hash_step = (d.open.step || c.head.word == "STEP") && !listed({"CHECK", "HISTORY"});
  if (!d.hashing) return;
  deck_hash(d, c.head.word);
  for (const HeadParam& p : c.head.param)
    if (c.head.word != "STEP" || p.name != "INC") deck_hash(d, p.name + "=" + p.value.text);
}

// what the steps decide of the whole model: explicit ones its masses and elements, RIKS and motion whether
// cracks follow lines, *MODEL CHANGE whether elements have a state of fracture
void hash_schemes(Deck& d, const Model& m)
{
  d.hash_step = false;
  const bool any = std::any_of(m.step.begin(), m.step.end(),
                               [](const Step& s) { return s.explicit_steps(); });
  deck_hash(d, any ? "explicit" : "implicit");
  for (const FractureDef& f : m.fracture) deck_hash(d, f.track ? "track" : "no track");
  deck_hash(d, model_changes(m) ? "change" : "no change");
}

// the keyword that a parameter follows without a comma; empty: none
std::string comma_missing(const std::string& word)
{
  for (std::size_t end = word.rfind(' '); end != std::string::npos && end > 0;
       end = word.rfind(' ', end - 1)) {
    const Keyword* k = keyword_find(word.substr(0, end));
    const std::string rest = text_squeeze(word.substr(end, word.find('=', end) - end));
    for (std::string p : split_words(k ? k->params : "")) {
      if (!p.empty() && p.back() == '!') p.pop_back();
      if (!p.empty() && text_squeeze(p) == rest) return k->word;
    }
  }
  return "";
}

void read_card(Deck& d, Model& m)
{
  Card c;
  c.deck = &d;
  c.errors_before = c.errors_line = d.messages.errors;
  d.word.clear();
  deck_head(d, c.head);
  c.keyword = keyword_find(c.head.word);
  if (!c.keyword && is_ignored(c.head.word)) {
    ++d.passed[c.head.word];
    d.hashing = false;         // not part of the hash
    return skip_data(d);
  }
  if (!c.keyword) {
    const std::string nearest = text_nearest(c.head.word, keyword_words());
    const std::string remedy = other_keyword(c.head.word), before = comma_missing(c.head.word);
    deck_error(d, c.head.at, "keyword *" + text_show(c.head.word) + " is not known" +
               (!remedy.empty()   ? remedy
                : !before.empty() ? "; write a comma after *" + before
                : nearest.empty() ? "; mpfe --list-keywords lists all"
                                  : "; did you mean *" + nearest + "?"));
    return skip_data(d);
  }
  d.word = c.head.word = c.keyword->word;
  hash_card(d, c);
  const bool allowed = keyword_allowed(c, m), params = check_params(c);
  if (!allowed || !params) return skip_data(d);
  c.keyword->read(c, m);
  card_end(c);
}

void read_cards(Deck& d, Model& m)
{
  bool keyword = false;
  while (deck_peek(d, keyword)) {
    if (keyword) {
      read_card(d, m);
      continue;
    }
    Field at;
    std::vector<Field> field;
    bool comma = false;
    d.word.clear();
    deck_fields(d, false, field, at, comma);
    deck_error(
        d, at,
        "a data line without a keyword before it; a deck begins with a line such as *HEADING or *NODE");
    skip_data(d);
  }
  d.word = "STEP";
  if (d.open.step) deck_error(d, d.open.step_at, "*END STEP is missing");
}

void set_defines(Deck& d, const std::vector<std::pair<std::string, double>>& defines)
{
  d.word = "PARAMETER";
  for (const auto& def : defines) {
    const std::string fault = deck_parameter_name_fault(def.first);
    if (!fault.empty()) deck_error(d, Field(), "-D " + text_show(def.first) + ": the name " + fault);
    else if (!std::isfinite(def.second))
      deck_error(d, Field(), "-D " + def.first + ": the value must be a finite number");
    else d.params.define[def.first] = d.params.value[def.first] = def.second;
  }
}

void warn_unused_defines(Deck& d)
{
  d.word = "PARAMETER";
  for (const auto& def : d.params.define)
    if (!d.params.used.count(def.first))
      deck_warn(d, Field(), "-D " + def.first + " is not used in this deck");
}

void read_all(Deck& d, const std::string& path, const std::vector<std::pair<std::string, double>>& defines,
              Model& m)
{
  if (!deck_open(d, path, nullptr)) return;
  set_defines(d, defines);
  m.dim = deck_dimension(d, path);
  read_cards(d, m);
  absent_report(d);
  deck_run_later(d, m, STAGE_STEP);
  if (d.messages.errors == 0) deck_split(d, m);
  deck_resolve(d, m);
  deck_run_later(d, m, STAGE_END);
  deck_inherit(d, m);
  if (d.messages.errors == 0) coupling_resolve(d, m);
  if (d.messages.errors == 0) tie_resolve(d, m);
  warn_unused_defines(d);
  deck_check(d, m);
  hash_schemes(d, m);
  m.notes.param  = d.params.value;
  m.hash         = d.hash[0];
  m.notes.passed = ignored_text(d);
}

}  // namespace

void deck_run_later(Deck& d, Model& m, Stage stage)
{
  std::vector<Later> list;
  list.swap(d.later[stage]);
  const std::string word = d.word;
  for (Later& l : list) {
    d.word = l.word;
    l.run(d, m);
  }
  d.word = word;
}

// ---------------------------------------------------------------------------
// deck_read : deck -> model
//
//   0. two or three dimensions
//   1. cards in order; each reader reports its errors and continues
//   2. names that may be used before they are defined; quadratic elements that need to be linear are split
//   3. sections of elements, loads on elements that become material points
//   4. checks of the whole model
//
//   in   defines   -D name=value
//   out  number of errors; all messages go to stderr
// ---------------------------------------------------------------------------
int deck_read(const std::string& path, const std::vector<std::pair<std::string, double>>& defines,
              Model& model)
{
  Deck d;
  model.deck = path;
  model.job = std::filesystem::path(path).stem().string();
  try {
    read_all(d, path, defines, model);
  } catch (const std::bad_alloc&) {
    deck_print_messages(d);
    throw;                     // reported by main
  }
  deck_print_messages(d);
  return d.messages.errors;
}

void deck_list_keywords(std::FILE* out)
{
  for (int i = 0; i < keyword_count; ++i) {
    std::string name = keyword_table[i].word;
    for (char& c : name)
      if (c == ' ') c = '_';
    std::fprintf(out, "*%-20s %s  (doc/keywords/%s.md)\n", keyword_table[i].word, keyword_table[i].help,
                 name.c_str());
  }
}
