#include <algorithm>
#include <cctype>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <functional>

#include "base/log.h"
#include "deck/deck_state.h"

namespace {

const int max_printed = 50;
const int max_of_kind = 5;     // more of one kind would bury the others
const std::size_t max_stored = 1000;
const int window = 100;        // characters shown of a long line

// the original line around the word, with carets below the word
std::string echo(const Deck& d, const Field& at)
{
  const std::string raw = deck_line_text(d, at.file, at.line);
  const int n = static_cast<int>(raw.size());
  const int column = std::max(0, std::min(at.column, n));
  const int from = column > window - 20 ? column - window / 2 : 0;
  const int to   = std::min(n, from + window);
  std::string line = from > 0 ? "..." : "", caret = from > 0 ? "   " : "";
  for (int i = from; i < to; ++i) {
    const unsigned char c = static_cast<unsigned char>(raw[i]);
    line += (c < 32 || c == 127) ? ' ' : static_cast<char>(c);
    if (i < column && (c & 0xC0) != 0x80) caret += ' ';      // count UTF-8 characters, not bytes
  }
  if (to < n) line += "...";
  const int length = std::max(1, std::min(at.length, std::max(1, to - column)));
  return "  " + line + "\n  " + caret + std::string(length, '^') + "\n";
}

std::string page(const std::string& word)
{
  std::string name = word.empty() ? "README" : word;
  std::replace(name.begin(), name.end(), ' ', '_');
  return "doc/keywords/" + name + ".md";
}

// keyword, field and text without digits: messages of one kind are equal
std::string kind_of(const Deck& d, bool warning, const Field& at, const std::string& text)
{
  std::string kind = (warning ? "w" : "e") + d.word + text_format(" %d ", at.number);
  for (char c : text)
    if (!std::isdigit(static_cast<unsigned char>(c)) && !std::strchr("+-.", c)) kind += c;
  return kind;
}

void add_message(Deck& d, bool warning, const Field& at, const std::string& text)
{
  if (d.file.empty()) return;
  Message m;
  m.warning = warning;
  m.file = at.file;
  m.line = at.line;
  m.text = d.file[at.file].path;
  if (at.line > 0) m.text += text_format(" line %d", deck_line_number(d, at.file, at.line));
  if (!d.word.empty()) m.text += ", *" + d.word;
  if (at.number > 0) m.text += text_format(", field %d", at.number);
  m.text += "\n" + (at.line > 0 ? echo(d, at) : "") + "  " + text + "  (" + page(d.word) + ")";
  // the same line may be checked in each step
  if (!d.messages.texts.insert(std::hash<std::string>()(m.text + (warning ? "w" : "e"))).second) return;
  m.kind = kind_of(d, warning, at, text);
  if (++d.messages.of_kind[m.kind] > max_of_kind || d.messages.first.size() >= max_stored) return;
  d.messages.first.push_back(m);
}

// edit distance of two words: substitutions, deletions, insertions, transpositions
int distance(const std::string& a, const std::string& b)
{
  const std::size_t n = a.size(), m = b.size();
  std::vector<std::vector<int>> c(n + 1, std::vector<int>(m + 1));
  for (std::size_t i = 0; i <= n; ++i) c[i][0] = static_cast<int>(i);
  for (std::size_t j = 0; j <= m; ++j) c[0][j] = static_cast<int>(j);
  for (std::size_t i = 1; i <= n; ++i)
    for (std::size_t j = 1; j <= m; ++j) {
      c[i][j] = std::min({c[i - 1][j] + 1, c[i][j - 1] + 1, c[i - 1][j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        c[i][j] = std::min(c[i][j], c[i - 2][j - 2] + 1);
    }
  return c[n][m];
}

}  // namespace

std::string text_format(const char* format, ...)
{
  char buffer[1024];
  va_list args;
  va_start(args, format);
  std::vsnprintf(buffer, sizeof buffer, format, args);
  va_end(args);
  return buffer;
}

std::string text_show(const std::string& word)
{
  std::string s = word.size() > 40 ? word.substr(0, 37) + "..." : word;
  for (char& c : s)
    if (static_cast<unsigned char>(c) < 32 || c == 127) c = '?';
  return s;
}

std::string text_number(double value) { return text_format("%.12g", value); }

std::string text_upper(const std::string& word)
{
  std::string s = word;
  for (char& c : s)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return s;
}

std::string text_squeeze(const std::string& word)
{
  std::string s = text_upper(word);
  s.erase(std::remove_if(s.begin(), s.end(), [](char c) { return c == ' ' || c == '\t'; }), s.end());
  return s;
}

std::string text_keyword(const std::string& word)
{
  std::string s;
  for (char c : text_upper(word)) {
    if (std::strchr(" \t\r\v\f", c)) c = ' ';
    if (c != ' ' || (!s.empty() && s.back() != ' ')) s += c;
  }
  if (!s.empty() && s.back() == ' ') s.pop_back();
  return s;
}

std::string text_nearest(const std::string& word, const std::vector<std::string>& valid)
{
  if (word.empty() || word.size() > 80) return "";
  // largest edit distance of a suggestion
  int best = std::min(static_cast<int>(word.size()) - 1, 1 + static_cast<int>(word.size()) / 3);
  std::string nearest;
  for (const std::string& v : valid) {
    if (v.size() > 80) continue;
    const int k = distance(text_upper(word), text_upper(v));
    if (k < best || (k == best && nearest.empty())) {
      best = k;
      nearest = v;
    }
  }
  return nearest;
}

std::string text_suggest(const std::string& word, const std::vector<std::string>& valid)
{
  const std::string nearest = text_nearest(word, valid);
  std::string s = nearest.empty() ? "" : "; did you mean " + nearest + "?";
  if (valid.empty()) return s + "; none is defined";
  if (valid.size() > 12 && !nearest.empty()) return s;
  s += nearest.empty() ? "; known: " : " Known: ";
  for (std::size_t i = 0; i < valid.size() && i < 12; ++i) s += (i ? ", " : "") + text_show(valid[i]);
  return valid.size() > 12 ? s + ", ..." : s;
}

void deck_error(Deck& d, const Field& at, const std::string& text)
{
  ++d.messages.errors;
  add_message(d, false, at, text);
}

void deck_warn(Deck& d, const Field& at, const std::string& text)
{
  ++d.messages.warnings;
  add_message(d, true, at, text);
}

void fault(Deck& d, const std::string& keyword, const DeckLine& deck_line, const std::string& word,
           const std::string& text)
{
  d.word = keyword;
  deck_error(d, deck_field(d, deck_line, word), text);
}

void warn(Deck& d, const std::string& keyword, const DeckLine& deck_line, const std::string& word,
          const std::string& text)
{
  d.word = keyword;
  deck_warn(d, deck_field(d, deck_line, word), text);
}

// ---------------------------------------------------------------------------
// deck_print_messages : errors in the order of the deck, then warnings; at most 5 of a kind and 50 of each,
// then the number of the others
// ---------------------------------------------------------------------------
void deck_print_messages(const Deck& d)
{
  std::vector<Message> list = d.messages.first;
  std::stable_sort(list.begin(), list.end(), [](const Message& a, const Message& b) {
    if (a.warning != b.warning) return b.warning;
    return a.file != b.file ? a.file < b.file : a.line < b.line;
  });
  std::unordered_map<std::string, int> shown;
  int printed[2] = {0, 0}, hidden[2] = {0, 0};
  for (const Message& m : list) {
    if (++printed[m.warning] > max_printed) continue;
    const int more = ++shown[m.kind] == max_of_kind ? d.messages.of_kind.at(m.kind) - max_of_kind : 0;
    const std::string tail = more > 0 ? text_format("\n  and %d more of this kind", more) : "";
    if (m.warning) log_warn("%s%s", m.text.c_str(), tail.c_str());
    else log_error("%s%s", m.text.c_str(), tail.c_str());
  }
  for (const auto& k : d.messages.of_kind) {
    const auto s = shown.find(k.first);
    if (s == shown.end() || s->second < max_of_kind)
      hidden[k.first[0] == 'w'] += k.second - (s == shown.end() ? 0 : s->second);
  }
  if (hidden[1] > 0) log_warn("%d more warnings are not shown", hidden[1]);
  if (hidden[0] > 0) log_error("%d more errors are not shown", hidden[0]);
}

DeckLine deck_line_of(const Deck& d, const Field& at)
{
  DeckLine p;
  p.file = d.file[at.file].path;
  p.line = at.line;
  return p;
}

std::string spot_text(const Deck& d, const Spot& s)
{
  return d.file[s.file].path + text_format(" line %d", deck_line_number(d, s.file, s.line));
}

// ---------------------------------------------------------------------------
// deck_field : position of a word in a line; the whole line when it does not contain the word
// ---------------------------------------------------------------------------
Field deck_field(const Deck& d, const DeckLine& deck_line, const std::string& word)
{
  Field f;
  for (std::size_t i = 0; i < d.file.size(); ++i)
    if (d.file[i].path == deck_line.file) f.file = static_cast<int>(i);
  f.line = std::max(1, deck_line.line);
  const std::string raw = deck_line_text(d, f.file, f.line);
  const std::size_t at = word.empty() ? std::string::npos : text_upper(raw).find(text_upper(word));
  if (at != std::string::npos) {
    f.column = static_cast<int>(at);
    f.length = static_cast<int>(word.size());
    return f;
  }
  const std::size_t first = raw.find_first_not_of(" \t"), last = raw.find_last_not_of(" \t");
  if (first == std::string::npos) return f;
  f.column = static_cast<int>(first);
  f.length = static_cast<int>(last - first + 1);
  return f;
}
