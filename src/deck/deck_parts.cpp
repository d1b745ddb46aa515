#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>

#include "deck/deck_state.h"

// A deck with parts and instances is flattened before its cards are read: each *INSTANCE is replaced by the
// lines of its part, with labels above those of earlier instances and sets renamed to INSTANCE.NAME

namespace {

const double PI = 3.14159265358979323846;

struct FlatLine {
  std::string text;
  int origin;                  // 1-based line of the file
};

struct DeckPart {
  std::vector<FlatLine> line;
};

struct Instance {
  std::string name;            // prefix of its set names
  double shift[3] = {0, 0, 0};
  double from[3] = {0, 0, 0}, to[3] = {0, 0, 0}, angle = 0.0;   // axis of the rotation, degrees
  int node = 0, elem = 0;      // offset of labels
};

struct Flat {
  std::vector<FlatLine> out;
  std::vector<std::pair<int, std::string>> fault;    // line of out, message
  std::map<std::string, DeckPart> part;
  std::map<std::string, Instance> instance;
  Instance assembly;           // offsets for nodes and sets of the assembly (reference points)
  bool has_points = false;
  int max_node = 0, max_elem = 0;                    // largest label so far
  std::string listing;         // instances and label offsets, for the listing
};

// ---- words of a line

std::string trimmed(const std::string& s)
{
  const std::size_t a = s.find_first_not_of(" \t\r"), b = s.find_last_not_of(" \t\r");
  return a == std::string::npos ? "" : s.substr(a, b - a + 1);
}

// fields separated by commas outside quotes
std::vector<std::string> fields_of(const std::string& line)
{
  std::vector<std::string> out(1);
  bool quote = false;
  for (char c : line) {
    quote = quote != (c == '"');
    if (c == ',' && !quote) out.emplace_back();
    else out.back() += c;
  }
  for (std::string& f : out) f = trimmed(f);
  return out;
}

std::string joined(const std::vector<std::string>& field)
{
  std::string line;
  for (std::size_t k = 0; k < field.size(); ++k) line += (k ? ", " : "") + field[k];
  return line;
}

bool is_keyword(const std::string& line) { return line.size() > 1 && line[0] == '*' && line[1] != '*'; }
bool is_data(const std::string& line) { return !line.empty() && line[0] != '*'; }

// the keyword of a line, without the star
std::string card_word_of(const std::string& line) { return text_keyword(fields_of(line)[0].substr(1)); }

std::string name_of(std::string f)
{
  const std::size_t at = f.find('=');
  return at == std::string::npos ? "" : trimmed(text_upper(f.substr(0, at)));
}

std::string value_of(const std::string& f)
{
  std::string v = trimmed(f.substr(f.find('=') + 1));
  v.erase(std::remove(v.begin(), v.end(), '"'), v.end());
  return text_upper(v);
}

std::string param_of(const std::string& line, const char* name)
{
  for (const std::string& f : fields_of(line))
    if (name_of(f) == name) return value_of(f);
  return "";
}

bool has_flag(const std::string& line, const char* name)
{
  for (const std::string& f : fields_of(line))
    if (text_squeeze(f) == name) return true;
  return false;
}

// a number of *INSTANCE, or a coordinate moved by it; blank: 0
double instance_number(Flat& f, const std::string& field)
{
  char* end = nullptr;
  const double value = std::strtod(field.c_str(), &end);
  if (*end != 0)
    f.fault.emplace_back(std::max<int>(1, f.out.size()) - 1,
                         text_show(field) + " is not a number; *INSTANCE has no expressions, nor have "
                                            "coordinates of a moved instance");
  return value;
}

// ---- lines of an instance

std::string in_quotes(const std::string& name)
{
  return name.find(' ') == std::string::npos ? name : '"' + name + '"';
}

// a label with its offset, or the name of a set of the instance
std::string shifted(const Instance& i, const std::string& field, int offset)
{
  int label = 0;
  if (field.empty()) return field;
  if (target_label(field, label)) return std::to_string(label + offset);
  return i.name.empty() ? field : in_quotes(i.name + "." + value_of("=" + field));
}

void move_node(const Instance& i, double* x)
{
  for (int k = 0; k < 3; ++k) x[k] += i.shift[k];
  double n[3], r[3], along = 0.0, size = 0.0;
  for (int k = 0; k < 3; ++k) size += (i.to[k] - i.from[k]) * (i.to[k] - i.from[k]);
  if (i.angle == 0.0 || size == 0.0) return;
  for (int k = 0; k < 3; ++k) {
    n[k] = (i.to[k] - i.from[k]) / std::sqrt(size);
    r[k] = x[k] - i.from[k];
    along += n[k] * r[k];
  }
  const double c = std::cos(i.angle * PI / 180.0), s = std::sin(i.angle * PI / 180.0);
  for (int k = 0; k < 3; ++k) {
    const int p = (k + 1) % 3, q = (k + 2) % 3;
    x[k] = i.from[k] + c * r[k] + s * (n[p] * r[q] - n[q] * r[p]) + (1.0 - c) * along * n[k];
  }
}

std::string node_line(Flat& flat, const Instance& i, std::vector<std::string> f)
{
  f[0] = shifted(i, f[0], i.node);
  double x[3] = {0, 0, 0};
  const bool moved = i.angle != 0.0 || i.shift[0] != 0.0 || i.shift[1] != 0.0 || i.shift[2] != 0.0;
  if (!moved) return joined(f);
  for (std::size_t k = 1; k < std::min<std::size_t>(4, f.size()); ++k) x[k - 1] = instance_number(flat, f[k]);
  move_node(i, x);
  const bool space = f.size() > 3 || std::fabs(x[2]) > 1e-12 * (std::fabs(x[0]) + std::fabs(x[1]));
  std::string line = f[0];
  for (int k = 0; k < (space ? 3 : 2); ++k) line += text_format(", %.17g", x[k]);
  return line;
}

// a data line of a card; first: first line of an element
std::string data_line(Flat& flat, const Instance& i, const std::string& word, const std::string& head,
                      bool first, const std::string& line)
{
  std::vector<std::string> f = fields_of(line);
  const bool generate = has_flag(head, "GENERATE");
  if (word == "NODE") return node_line(flat, i, f);
  if (word == "ELEMENT")
    for (std::size_t k = 0; k < f.size(); ++k) f[k] = shifted(i, f[k], first && k == 0 ? i.elem : i.node);
  if (word == "NSET" || word == "ELSET")
    for (std::size_t k = 0; k < f.size() && !(generate && k == 2); ++k)
      f[k] = shifted(i, f[k], word == "NSET" ? i.node : i.elem);
  if (word == "SURFACE") f[0] = shifted(i, f[0], param_of(head, "TYPE") == "NODE" ? i.node : i.elem);
  return joined(f);
}

// a keyword line of a part, with the set names of the instance
std::string head_line(const Instance& i, const std::string& word, const std::string& line)
{
  std::vector<std::string> f = fields_of(line);
  for (std::string& p : f) {
    const std::string name = name_of(p);
    if (name == "NSET" || name == "ELSET" || (name == "NAME" && word == "SURFACE"))
      p = name + "=" + in_quotes(i.name + "." + value_of(p));
  }
  return joined(f);
}

bool allowed_in_part(const std::string& word)
{
  for (const char* w : {"NODE", "ELEMENT", "NSET", "ELSET", "SURFACE", "SOLID SECTION"})
    if (word == w) return true;
  return false;
}

void add_instance(Flat& f, const Instance& i, const DeckPart& part)
{
  std::string word, head;
  bool first = true;
  for (const FlatLine& l : part.line) {
    const std::string t = trimmed(l.text);
    std::string text = l.text;
    if (is_keyword(t)) {
      word = card_word_of(t);
      head = t;
      text = head_line(i, word, t);
      first = true;
      if (!allowed_in_part(word))
        f.fault.emplace_back(f.out.size(),
                             "*" + word + " inside *PART is not available; write it after *END ASSEMBLY");
    } else if (is_data(t)) {
      text = data_line(f, i, word, head, first, t);
      int label = 0;
      if (first && target_label(fields_of(text)[0], label)) {
        if (word == "NODE") f.max_node = std::max(f.max_node, label);
        if (word == "ELEMENT") f.max_elem = std::max(f.max_elem, label);
      }
      first = word != "ELEMENT" || t.back() != ',';
    }
    f.out.push_back({text, l.origin});
  }
}

// label offset of the next instance: a power of ten above the largest label so far
int label_offset(int largest)
{
  int offset = largest > 0 ? 10 : 0;
  while (offset > 0 && offset <= largest) offset = offset > 100000000 ? largest + 1 : 10 * offset;
  return offset;
}

// ---- the file

void read_placement(Flat& flat, Instance& i, const std::vector<std::string>& data)
{
  for (std::size_t row = 0; row < data.size() && row < 2; ++row) {
    std::vector<std::string> f = fields_of(data[row]);
    f.resize(7);
    for (int k = 0; k < 3; ++k) {
      const double v = instance_number(flat, f[k]);
      if (row == 0) i.shift[k] = v;
      else {
        i.from[k] = v;
        i.to[k]   = instance_number(flat, f[3 + k]);
      }
    }
    if (row == 1) i.angle = instance_number(flat, f[6]);
  }
}

void begin_instance(Flat& f, const std::string& head, const std::vector<FlatLine>& inside)
{
  Instance i;
  i.name = param_of(head, "NAME");
  i.node = label_offset(f.max_node);
  i.elem = label_offset(f.max_elem);
  const std::string part_name = param_of(head, "PART");
  const auto part = f.part.find(part_name);
  std::vector<std::string> data;
  for (const FlatLine& l : inside)
    if (is_data(trimmed(l.text))) data.push_back(trimmed(l.text));
  if (part == f.part.end() || i.name.empty()) {
    f.fault.emplace_back(f.out.size() - 1, "*INSTANCE needs NAME= and PART= of a *PART above it");
    return;
  }
  read_placement(f, i, data);
  f.listing += (f.listing.empty() ? "" : ", ") + i.name + " of *PART " + part_name +
               (i.node || i.elem ? text_format(" (nodes + %d, elements + %d)", i.node, i.elem) : "");
  add_instance(f, i, part->second);
  f.instance[i.name] = i;
}

// nodes of the assembly: labels above those of all instances so far
void begin_points(Flat& f)
{
  if (f.has_points) return;
  f.has_points    = true;
  f.assembly.node = label_offset(f.max_node);
  if (f.assembly.node)
    f.listing += text_format("%sreference points (nodes + %d)", f.listing.empty() ? "" : ", ",
                             f.assembly.node);
}

// a line of the assembly: sets with labels of an instance, reference points
void assembly_line(Flat& f, const FlatLine& l, std::string& head, const Instance*& active)
{
  const std::string t = trimmed(l.text);
  if (is_keyword(t)) {
    const std::string name = param_of(t, "INSTANCE");
    const auto found = f.instance.find(name);
    head   = t;
    active = found == f.instance.end() ? nullptr : &found->second;
    if (!name.empty() && !active)
      f.fault.emplace_back(f.out.size(), "INSTANCE " + text_show(name) + " is not known");
    if (card_word_of(t) == "NODE") begin_points(f);
    if (!active && f.has_points) active = &f.assembly;
    std::vector<std::string> p = fields_of(t);
    const auto of_instance = [](const std::string& x) { return name_of(x) == "INSTANCE"; };
    p.erase(std::remove_if(p.begin(), p.end(), of_instance), p.end());
    f.out.push_back({name.empty() ? l.text : joined(p), l.origin});
    return;
  }
  const bool set = active && is_data(t);
  const std::string text = set ? data_line(f, *active, card_word_of(head), head, true, t) : l.text;
  int label = 0;
  if (set && card_word_of(head) == "NODE" && target_label(fields_of(text)[0], label))
    f.max_node = std::max(f.max_node, label);
  f.out.push_back({text, l.origin});
}

// ---- lines of a file, with the lines of includes that contain parts or are part of one

bool begins_part(const std::string& line)
{
  const std::string t = text_upper(trimmed(line).substr(0, 9));
  return t.compare(0, 5, "*PART") == 0 || t.compare(0, 9, "*INSTANCE") == 0;
}

std::vector<std::string> lines_of_file(const std::string& path)
{
  std::vector<std::string> line;
  std::ifstream in(path);
  for (std::string text; std::getline(in, text);) line.push_back(text);
  return line;
}

std::string path_of_include(const std::string& folder, const std::string& head)
{
  for (const std::string& f : fields_of(head)) {
    if (name_of(f) != "INPUT") continue;
    std::string path = trimmed(f.substr(f.find('=') + 1));
    path.erase(std::remove(path.begin(), path.end(), '"'), path.end());
    return (std::filesystem::path(folder) / path).string();
  }
  return "";
}

// tracks whether the keyword line opens or closes a part or an assembly
void track_blocks(const std::string& word, bool& part, bool& assembly)
{
  if (word == "PART") part = true;
  if (word == "END PART") part = false;
  if (word == "ASSEMBLY" || word == "INSTANCE") assembly = true;
  if (word == "END ASSEMBLY") assembly = false;
}

// Adds lines; a keyword line inside *PART or *ASSEMBLY that ends in a comma is joined with the next.
//   in   origin   line of the deck for messages; in an include the line of *INCLUDE
void add_lines(const std::string& folder, const std::vector<std::string>& text, int origin, int depth,
               bool& part, bool& assembly, std::vector<FlatLine>& all)
{
  bool continued = false;
  for (std::size_t k = 0; k < text.size(); ++k) {
    const int line      = origin > 0 ? origin : static_cast<int>(k) + 1;
    const std::string t = trimmed(text[k]);
    if (continued && !t.empty() && t.compare(0, 2, "**") != 0) {
      all.back().text += " " + t;
      continued = t.back() == ',';
      continue;
    }
    const std::string word = is_keyword(t) ? card_word_of(t) : "";
    track_blocks(word, part, assembly);
    if (word == "INCLUDE" && depth < 10) {
      const std::string path = path_of_include(folder, t);
      const std::vector<std::string> inner = lines_of_file(path);
      if (part || std::any_of(inner.begin(), inner.end(), begins_part)) {
        const std::string at = std::filesystem::path(path).parent_path().string();
        add_lines(at, inner, line, depth + 1, part, assembly, all);
        continue;
      }
    }
    all.push_back({text[k], line});
    continued = (part || assembly) && !word.empty() && t.back() == ',';
  }
}

// copies the lines; lines of parts are stored for their instances
void flatten(const std::vector<FlatLine>& all, Flat& f)
{
  DeckPart* part = nullptr;
  std::string head;
  bool in_assembly = false;
  const Instance* active = nullptr;
  for (std::size_t k = 0; k < all.size(); ++k) {
    const FlatLine& l = all[k];
    const std::string t = trimmed(l.text), word = is_keyword(t) ? card_word_of(t) : "";
    const FlatLine blank = {"** " + t, l.origin};
    if (word == "PART") part = &f.part[param_of(t, "NAME")];
    else if (part && word != "END PART") part->line.push_back(l);
    else if (word == "ASSEMBLY") in_assembly = true;
    else if (word == "END ASSEMBLY") in_assembly = false;
    else if (word == "INSTANCE") {
      std::vector<FlatLine> inside;
      f.out.push_back(blank);
      while (++k < all.size() && card_word_of("*" + trimmed(all[k].text)) != "*END INSTANCE")
        inside.push_back(all[k]);
      begin_instance(f, t, inside);
      continue;
    } else if (word != "END PART" && in_assembly) {
      assembly_line(f, l, head, active);
      continue;
    } else if (word != "END PART") {
      f.out.push_back(l);
      continue;
    }
    if (word == "END PART") part = nullptr;
    f.out.push_back(blank);
  }
  if (part) f.fault.emplace_back(f.out.size() - 1, "*END PART is missing");
}

}  // namespace

bool deck_has_parts(const DeckFile& f)
{
  for (std::size_t start : f.start) {
    std::size_t i = f.text.find_first_not_of(" \t", start);
    if (i != std::string::npos && f.text[i] == '*' && begins_part(f.text.substr(i, 9))) return true;
  }
  return false;
}

void deck_flatten(Deck& d, int file)
{
  DeckFile& f = d.file[file];
  std::vector<std::string> text;
  for (int line = 1; line <= static_cast<int>(f.start.size()); ++line)
    text.push_back(deck_line_text(d, file, line));
  std::vector<FlatLine> all;
  bool part = false, assembly = false;
  add_lines(std::filesystem::path(f.path).parent_path().string(), text, 0, 0, part, assembly, all);
  Flat flat;
  flatten(all, flat);
  f.text.clear();
  f.start.clear();
  for (const FlatLine& l : flat.out) {
    f.start.push_back(f.text.size());
    f.text += l.text + "\n";
    f.origin.push_back(l.origin);
  }
  for (const auto& x : flat.fault) {
    Field at;
    at.file = file;
    at.line = x.first + 1;
    deck_error(d, at, x.second);
  }
  d.parts = flat.listing;
}
