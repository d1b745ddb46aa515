#include <algorithm>
#include <cctype>

#include "deck/card.h"

namespace {

struct Line {                  // a data line
  Field target;
  Field whole;
  int first = -1, last = -1;
  Expr value;
  bool all = false;            // ENCASTRE: also the rotations of a reference node
};

// false: f is no word
bool read_word(Card& card, const Model& model, const Field& f, Line& line)
{
  const std::string word = text_squeeze(f.text);
  const bool all = word == "ENCASTRE" || word == "PINNED";
  const int axis = word == "XSYMM" ? 0 : word == "YSYMM" ? 1 : word == "ZSYMM" && model.dim == 3 ? 2 : -1;
  if (!all && axis < 0) {
    if (word.empty() || !std::isalpha(static_cast<unsigned char>(word[0]))) return false;
    std::vector<std::string> known = {"ENCASTRE", "PINNED", "XSYMM", "YSYMM"};
    if (model.dim == 3) known.push_back("ZSYMM");
    card_error(card, f, "a direction, or a word: " + text_show(f.text) + " is not known" +
               text_suggest(word, known));
    return true;
  }
  ++card.next;
  line.first = all ? 0 : axis;
  line.last  = all ? model.dim - 1 : axis;
  line.value = expr_number(0.0);
  line.all   = word == "ENCASTRE";
  return true;
}

bool read_line(Card& card, const Model& model, Line& line)
{
  line.target = card_field(card, "node set or node");
  line.whole  = card.whole;
  if (card_more(card) && read_word(card, model, card.field[card.next], line)) return card_good(card);
  line.first = line.last = card_int(card, "first direction", 1, 6) - 1;
  if (card_more(card) && card.field[card.next].empty()) ++card.next;
  else if (card_more(card)) line.last = card_int(card, "last direction", 1, 6) - 1;
  line.value = card_expr_or_zero(card, "displacement or velocity");
  if (card_good(card) && line.last < line.first)
    card_error(card, card.field[2], "the last direction is smaller than the first");
  return card_good(card);
}

// removes directions without dofs from a line (3 in the plane, rotations), which may only be 0.
// False: no direction is left
bool drop_missing_directions(Deck& d, const Model& m, Line& line)
{
  if (line.last < m.dim) return true;
  const int first = std::max(line.first, m.dim);
  const char* const reason = first < 3 ? "does not exist in a plane model"
                                       : "is a rotation, which solid elements do not have";
  const std::string text   = text_format("direction %d %s", first + 1, reason);
  if (!line.value.is_const() || line.value.value != 0.0)
    deck_error(d, line.whole, text + "; only 0 can be prescribed");
  line.last = m.dim - 1;
  if (line.first > line.last) deck_warn(d, line.whole, text + "; the line has no effect");
  return line.first <= line.last;
}

void prescribe(Deck& d, Model& m, Prescribed b, int first, int last)
{
  for (int i = first; i <= last; ++i) {
    b.first = b.last = i;
    (d.open.step ? m.step.back().prescribed : d.base).push_back(b);
  }
}

// prescribes rotations of reference nodes (*COUPLING, *RIGID BODY) at their rotation nodes; true: all nodes
// of the line are reference nodes with prescribed rotation
bool prescribe_rotations(Deck& d, Model& m, const Line& line, const Prescribed& b)
{
  if (d.coupling.empty() || (line.last < 3 && !line.all)) return false;
  Prescribed turn = b;
  turn.node.clear();
  for (int n : b.node) {
    const int t = coupling_turn_of(d, m, n);
    if (t >= 0) turn.node.push_back(t);
  }
  if (turn.node.empty()) return false;
  const int first = line.all ? 3 : std::max(3, line.first), last = line.all ? 5 : line.last;
  if (m.dim == 3) prescribe(d, m, turn, first - 3, last - 3);
  else if (last == 5) prescribe(d, m, turn, 0, 0);
  return turn.node.size() == b.node.size();
}

void add_support(Deck& d, Model& m, Line line, int amplitude, bool velocity)
{
  Prescribed b;
  if (!target_nodes(d, m, line.target, b.node)) return;
  b.value = line.value;
  b.velocity  = velocity;
  b.amplitude = amplitude;
  b.deck_line = deck_line_of(d, line.target);
  if (prescribe_rotations(d, m, line, b)) line.last = std::min(line.last, m.dim - 1);
  else if (!drop_missing_directions(d, m, line)) return;
  frame_nodes(d, m, b.node);
  prescribe(d, m, b, line.first, line.last);
}

}  // namespace

// ---------------------------------------------------------------------------
// *BOUNDARY[, TYPE=][, AMPLITUDE=][, OP=] : nset|node, first[, last[, value]] or nset|node, ENCASTRE
// Outside a step it is active in all steps; sets and amplitudes may then be defined later.
// ---------------------------------------------------------------------------
void kw_boundary(Card& card, Model& model)
{
  Deck& d = *card.deck;
  const Field name = card_param_field(card, "AMPLITUDE");
  const int amplitude = d.open.step ? card_param_amplitude(card, model) : -1;
  if (!d.open.step && card_param(card, "TIME DELAY"))
    card_error(card, card_param(card, "TIME DELAY")->value, "TIME DELAY is allowed only in a step");
  const bool velocity = card_param_word(card, "TYPE", "DISPLACEMENT|VELOCITY", 0) == 1;
  if (card_op_new(card) && d.open.step) d.removes.back().boundary = true;
  while (card_line(card)) {
    Line line;
    if (!read_line(card, model, line)) continue;
    if (d.open.step) add_support(d, model, line, amplitude, velocity);
    else card_later(card, STAGE_STEP, [=](Deck& deck, Model& m) {
      add_support(deck, m, line, name.empty() ? -1 : target_amplitude(deck, m, name), velocity);
    });
  }
}
