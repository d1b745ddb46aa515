#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <utility>

#include "deck/deck_state.h"

namespace {

const int max_depth = 10;
const int max_includes = 1000;
const std::size_t max_line = 100000;

struct Scan {                  // position in a line
  Deck& deck;
  std::string raw;
  std::size_t pos;
  int file, line;
  bool substitute;
};

bool blank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\v' || c == '\f'; }

int line_count(const DeckFile& f) { return static_cast<int>(f.start.size()); }

Field field_at(const Scan& s, std::size_t column, std::size_t length)
{
  Field f;
  f.file = s.file;
  f.line = s.line;
  f.column = static_cast<int>(column);
  f.length = static_cast<int>(length);
  return f;
}

std::string printed(double v)
{
  if (v == std::floor(v) && std::fabs(v) < 9.0e15) return text_format("%.0f", v == 0.0 ? 0.0 : v);
  return text_format("%.17g", v);
}

// "text" : reads up to the closing quote
void scan_quote(Scan& s, Field& f)
{
  const std::size_t open = s.pos, close = s.raw.find('"', open + 1);
  if (!f.text.empty() || f.quoted)
    deck_error(s.deck, field_at(s, open, 1), "a quote is allowed only at the start of a field");
  if (close == std::string::npos)
    deck_error(s.deck, field_at(s, open, s.raw.size() - open), "the closing quote is missing in this line");
  const std::size_t end = close == std::string::npos ? s.raw.size() : close;
  f.text   = s.raw.substr(open + 1, end - open - 1);
  f.quoted = true;
  s.pos = close == std::string::npos ? end : end + 1;
}

// <expression> : replaced by its value
void scan_number(Scan& s, Field& f)
{
  const std::size_t open = s.pos, close = s.raw.find('>', open);
  if (close == std::string::npos) {
    deck_error(s.deck, field_at(s, open, 1),
               "< begins an expression of parameters; the closing > is missing in this line");
    s.pos = s.raw.size();
    f.text += "0";
    f.bad = true;
    return;
  }
  double v = 0.0;
  if (!deck_scalar(s.deck, field_at(s, open, close + 1 - open), 1, s.raw.substr(open + 1, close - open - 1),
                   v))
    f.bad = true;
  f.text += printed(v);
  s.pos = close + 1;
}

// reads a word up to a character of stop, which is not consumed; quotes and <...> protect such characters
Field scan_word(Scan& s, const char* stop)
{
  while (s.pos < s.raw.size() && blank(s.raw[s.pos])) ++s.pos;
  const std::size_t first = s.pos;
  std::size_t last = first;
  Field f = field_at(s, first, 0);
  while (s.pos < s.raw.size() && !std::strchr(stop, s.raw[s.pos])) {
    const char c = s.raw[s.pos];
    if (c == '"') {
      scan_quote(s, f);
      last = s.pos;
    } else if (c == '<' && s.substitute && !f.quoted) {
      scan_number(s, f);
      last = s.pos;
    } else {
      if (f.quoted && !blank(c)) {
        deck_error(s.deck, field_at(s, s.pos, 1), "a comma must follow the closing quote");
        while (s.pos < s.raw.size() && !std::strchr(stop, s.raw[s.pos])) ++s.pos;
        break;
      }
      if (!f.quoted) f.text += c;
      ++s.pos;
      if (!blank(c)) last = s.pos;
    }
  }
  while (!f.quoted && !f.text.empty() && blank(f.text.back())) f.text.pop_back();
  f.length = static_cast<int>(last - first);
  return f;
}

Scan scan_open(Deck& d, bool substitute)
{
  const Reading& r = d.reading.back();
  Scan s{d, deck_line_text(d, r.file, r.line + 1), 0, r.file, r.line + 1, substitute};
  if (s.raw.size() > max_line) {
    deck_error(d, field_at(s, max_line, 1), text_format("the line is longer than %zu characters", max_line));
    s.raw.resize(max_line);
  }
  return s;
}

// parameters of one keyword line; true: it ends in a comma and continues in the next line
bool scan_params(Scan& s, Head& head)
{
  bool comma = true;
  while (s.pos < s.raw.size()) {
    HeadParam p;
    p.key = scan_word(s, ",=");
    if (s.pos < s.raw.size() && s.raw[s.pos] == '=') {
      ++s.pos;
      p.has_value = true;
      p.value = scan_word(s, ",");
    }
    const bool stop = s.pos >= s.raw.size();
    if (stop && p.key.empty() && !p.has_value) return comma;
    comma = !stop;
    ++s.pos;
    p.name = text_squeeze(p.key.text);
    if (p.key.empty()) deck_error(s.deck, p.key, "a parameter is missing here");
    else head.param.push_back(p);
  }
  return comma;
}

bool line_is_blank_or_comment(const DeckFile& f, int line)
{
  std::size_t i = f.start[line];
  while (i < f.text.size() && blank(f.text[i])) ++i;
  if (i >= f.text.size() || f.text[i] == '\n') return true;
  return f.text.compare(i, 2, "**") == 0;
}

bool line_is_keyword(const DeckFile& f, int line)
{
  std::size_t i = f.start[line];
  while (i < f.text.size() && blank(f.text[i])) ++i;
  return i < f.text.size() && f.text[i] == '*';
}

bool line_is_include(const DeckFile& f, int line)
{
  const std::size_t i = f.text.find('*', f.start[line]);
  return text_upper(f.text.substr(i, 8)) == "*INCLUDE" &&
         (i + 8 >= f.text.size() || f.text[i + 8] == ',' || f.text[i + 8] == '\n' || blank(f.text[i + 8]));
}

std::string same_file(const std::string& path)
{
  std::error_code ec;
  const auto p = std::filesystem::weakly_canonical(path, ec);
  return ec ? path : p.string();
}

// reads a file into memory; false: failed, with the reason
bool load_file(const std::string& path, DeckFile& f, std::string& reason)
{
  std::error_code ec;
  if (!std::filesystem::exists(path, ec)) return reason = "there is no such file", false;
  if (!std::filesystem::is_regular_file(path, ec)) return reason = "it is not a file", false;
  const std::uintmax_t size = std::filesystem::file_size(path, ec);
  if (!ec && size > 2000000000u) return reason = "it is larger than 2 GB", false;
  std::ifstream in(path, std::ios::binary);
  f.text.resize(ec ? 0 : static_cast<std::size_t>(size));
  if (ec || !in.read(&f.text[0], static_cast<std::streamsize>(size)))
    return reason = "it cannot be read", false;
  if (f.text.find('\0') != std::string::npos)
    return reason = "it is not a text file (it contains a zero byte); save UTF-16 as UTF-8", false;
  if (f.text.find('\n') == std::string::npos && f.text.find('\r') != std::string::npos)
    return reason = "its lines end in CR alone; save it with LF or CR LF", false;
  f.path = path;
  if (f.text.compare(0, 3, "\xEF\xBB\xBF") == 0) f.text.erase(0, 3);
  for (std::size_t i = 0; i < f.text.size(); ++i) {
    f.start.push_back(i);
    i = f.text.find('\n', i);
    if (i == std::string::npos) break;
  }
  return true;
}

bool is_element_type(const std::string& word)
{
  for (int i = 0; i < ELEM_TYPES; ++i)
    if (text_upper(word) == elem_table[i].name) return true;
  return false;
}

// CPE3|CPS3 -> CPE3, CPS3
std::string text_join(std::string words)
{
  std::size_t i;
  while ((i = words.find('|')) != std::string::npos) words.replace(i, 1, ", ");
  return words;
}

// *INCLUDE, INPUT=file[, type in the file=type here]
void read_include(Deck& d)
{
  const std::string before = d.word;
  d.word = "INCLUDE";
  Head head;
  const bool hashing = d.hashing;
  deck_head(d, head);
  d.hashing = hashing;         // lines of the file and behind it belong to the open card
  const HeadParam* input = nullptr;
  std::vector<std::pair<std::string, std::string>> type;
  for (const HeadParam& p : head.param) {
    if (p.name == "INPUT" && p.has_value && !p.value.text.empty()) input = &p;
    else if (p.has_value && is_element_type(p.value.text))
      type.emplace_back(p.name, text_upper(p.value.text));
    else
      deck_error(d, p.key,
                 "parameter " + text_show(p.key.text) +
                     " is not known; allowed: INPUT=file, and "
                     "TYPE IN THE FILE=TYPE HERE, for example CPS3=CPE3; types: " +
                     text_join(element_type_words()));
  }
  if (input) {
    const std::filesystem::path base = std::filesystem::path(d.file[head.at.file].path).parent_path();
    if (deck_open(d, (base / input->value.text).string(), &input->value)) d.reading.back().type = type;
  } else {
    deck_error(d, head.at, "the file is missing: write *INCLUDE, INPUT=file");
  }
  d.word = before;
}

}  // namespace

std::string deck_line_text(const Deck& d, int file, int line)
{
  const DeckFile& f = d.file[file];
  if (line < 1 || line > line_count(f)) return "";
  const std::size_t first = f.start[line - 1];
  std::size_t last = line < line_count(f) ? f.start[line] : f.text.size();
  while (last > first && (f.text[last - 1] == '\n' || f.text[last - 1] == '\r')) --last;
  return f.text.substr(first, last - first);
}

int deck_line_number(const Deck& d, int file, int line)
{
  const IntVec& origin = d.file[file].origin;
  return line >= 1 && line <= static_cast<int>(origin.size()) ? origin[line - 1] : line;
}

// ---------------------------------------------------------------------------
// deck_open : continues reading in this file. from: the word of *INCLUDE that names it, null for the deck
// ---------------------------------------------------------------------------
bool deck_open(Deck& d, const std::string& path, const Field* from)
{
  const std::string name = same_file(path);
  std::string reason;
  for (const Reading& r : d.reading)
    if (same_file(d.file[r.file].path) == name) reason = "it includes itself (a cycle)";
  if (static_cast<int>(d.reading.size()) >= max_depth) reason = "includes are nested more than 10 deep";
  if (++d.includes > max_includes) reason = "more than 1000 includes";

  int index = -1;
  for (std::size_t i = 0; i < d.file.size(); ++i)
    if (d.file[i].path == path) index = static_cast<int>(i);
  DeckFile f;
  if (index < 0 && reason.empty() && load_file(path, f, reason)) {
    index = static_cast<int>(d.file.size());
    d.file.push_back(std::move(f));
    if (deck_has_parts(d.file[index])) deck_flatten(d, index);
  }
  if (!reason.empty()) {
    if (!from) {               // the deck: an empty file, for the message
      f = DeckFile();
      f.path = path;
      d.file.push_back(f);
    }
    deck_error(d, from ? *from : Field(), "file " + text_show(path) + " is not read: " + reason);
    return false;
  }
  Reading r;
  r.file = index;
  d.reading.push_back(r);
  return true;
}

// ---------------------------------------------------------------------------
// deck_peek : skips blank lines and comments, opens includes and closes finished files.
// False: end of the deck. keyword: the next line begins with a star.
// ---------------------------------------------------------------------------
bool deck_peek(Deck& d, bool& keyword)
{
  while (!d.reading.empty()) {
    Reading& r = d.reading.back();
    const DeckFile& f = d.file[r.file];
    if (r.line >= line_count(f)) {
      d.reading.pop_back();
      continue;
    }
    if (line_is_blank_or_comment(f, r.line)) {
      ++r.line;
      continue;
    }
    keyword = line_is_keyword(f, r.line);
    if (!keyword || !line_is_include(f, r.line)) return true;
    read_include(d);
  }
  return false;
}

// ---------------------------------------------------------------------------
// deck_head : reads a keyword line; a line that ends in a comma continues in the next one
// ---------------------------------------------------------------------------
void deck_head(Deck& d, Head& head)
{
  d.hashing = false;           // the values enter with the parameters of the line
  Scan s = scan_open(d, true);
  s.pos = s.raw.find('*') + 1;
  head.at = scan_word(s, ",");
  head.word = text_keyword(head.at.text);
  bool more = s.pos < s.raw.size();
  if (more) {
    ++s.pos;
    more = scan_params(s, head);
  }
  Reading& r = d.reading.back();
  const DeckFile& f = d.file[r.file];
  ++r.line;
  while (more) {
    while (r.line < line_count(f) && line_is_blank_or_comment(f, r.line)) ++r.line;
    if (r.line >= line_count(f) || line_is_keyword(f, r.line)) {
      deck_error(d, head.at, "the keyword line ends in a comma, but no further parameter follows");
      return;
    }
    Scan next = scan_open(d, true);
    more = scan_params(next, head);
    ++r.line;
  }
}

void deck_hash(Deck& d, const std::string& line)
{
  std::uint64_t& hash = d.hash[d.hash_step];
  hash = hash_add(hash, line.c_str(), line.size() + 1);
}

// ---------------------------------------------------------------------------
// deck_fields : reads a data line
//
//   in   substitute   replace <expression> by its value
//   out  field        words between commas; a comma at the end of the line adds no field
//        whole        the trimmed line
//        comma        the line ends in a comma
// ---------------------------------------------------------------------------
void deck_fields(Deck& d, bool substitute, std::vector<Field>& field, Field& whole, bool& comma)
{
  Scan s = scan_open(d, substitute);
  const std::size_t first = s.raw.find_first_not_of(" \t\r\v\f"), last = s.raw.find_last_not_of(" \t\r\v\f");
  whole = field_at(s, first, last + 1 - first);
  whole.text = s.raw.substr(first, last + 1 - first);
  if (d.hashing) deck_hash(d, whole.text);
  field.clear();
  comma = false;
  while (substitute && s.pos < s.raw.size()) {
    Field f = scan_word(s, ",");
    const bool stop = s.pos >= s.raw.size();
    if (stop && f.empty()) break;
    f.number = static_cast<int>(field.size()) + 1;
    if (f.length == 0) f.length = 1;
    field.push_back(f);
    comma = !stop;
    ++s.pos;
  }
  ++d.reading.back().line;
}
