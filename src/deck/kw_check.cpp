#include <cmath>

#include "deck/card.h"
#include "model/quantity.h"

namespace {

// 0.01 or 2%; percent are relative to scale
double read_tolerance(Card& card, double scale)
{
  const Field f = card_field(card, "tolerance");
  if (!card_good(card)) return 1.0;
  const bool percent = !f.text.empty() && f.text.back() == '%';
  double v = 0.0;
  std::string text = percent ? f.text.substr(0, f.text.size() - 1) : f.text;
  while (!text.empty() && text.back() == ' ') text.pop_back();
  if (f.quoted || !parse_real(text, v) || v < 0.0)
    card_error(card, f, "tolerance must be a number such as 1e-3, or percent such as 2%, and not negative");
  else if (percent && scale == 0.0)
    card_error(card, f, "percent of a target of 0 is 0; give the tolerance as a number");
  return percent ? 0.01 * v * scale : v;
}

void read_history(Card& card, Check c, std::vector<std::pair<Check, Field>>& list)
{
  const Field column = card_field(card, "column");
  c.target    = card_real(card, "target", any_number());
  c.tolerance = read_tolerance(card, std::fabs(c.target));
  c.column = text_upper(column.text);
  if (card_good(card)) list.emplace_back(c, column);
}

void read_field(Card& card, const Model& model, Check c, std::vector<std::pair<Check, Field>>& list)
{
  const std::string fields = quantity_words(model.dim, {OF_MOTION, OF_POINTS});
  const int q = card_word(card, "quantity", fields.c_str());
  c.exact     = card_expr(card, "exact value");
  c.tolerance = read_tolerance(card, 1.0);
  if (q < 0 || !card_good(card)) return;
  c.what = split_words(fields.c_str())[q];
  list.emplace_back(c, card.whole);
}

// adds a check; its column must be built in or defined by *HISTORY
void add_check(Deck& d, Model& m, Check c, const Field& at)
{
  if (c.kind == CHECK_FIELD || column_built_in(c.column, c.column)) {
    m.output.check.push_back(c);
    return;
  }
  for (const std::string& name : d.column)
    if (name == c.column) {
      m.output.check.push_back(c);
      return;
    }
  deck_error(d, at,
             "column " + text_show(at.text) + " is neither built in nor a column of *HISTORY" +
                 text_suggest(c.column, d.column));
}

void read_time(Card& card, Check& c)
{
  const CheckAt at[4] = {AT_END, AT_MAX, AT_MIN, AT_ABSMAX};
  const int word = card_param_word(card, "AT", "END|MAX|MIN|ABSMAX", 0);
  c.at = at[word < 0 ? 0 : word];
  if (card_param(card, "AT") && c.kind == CHECK_FIELD && c.at != AT_END)
    card_error(card, card_param(card, "AT")->value, "a field is checked at AT=END or at TIME=");
  if (!card_param(card, "TIME")) return;
  if (card_param(card, "AT")) card_error(card, card_param(card, "AT")->key, "TIME and AT exclude each other");
  c.at   = AT_TIME;
  c.time = card_param_real(card, "TIME", 0.0, at_least(0.0));
}

}  // namespace

// ---------------------------------------------------------------------------
// *CHECK, TYPE=HISTORY, SOURCE=[, TIME= | AT=] : column, target, tolerance
// *CHECK, TYPE=FIELD, SOURCE=[, TIME=][, SCALE=][, CENTRE] : quantity, "exact", tolerance of the relative L2
// error
// ---------------------------------------------------------------------------
void kw_check(Card& card, Model& model)
{
  const char* const sources = "ANALYTIC|PUBLISHED|CONVERGED|PREVIOUS";
  Check c;
  const int type = card_param_word(card, "TYPE", "HISTORY|FIELD", -1);
  const int source = card_param_word(card, "SOURCE", sources, -1);
  c.kind = type == 1 ? CHECK_FIELD : CHECK_HISTORY;
  if (source >= 0) c.source = split_words(sources)[source];
  read_time(card, c);
  c.centre = card_flag(card, "CENTRE");
  c.scale = card_param_real(card, "SCALE", 0.0, above(0.0));
  if (card_param(card, "SCALE") && type == 0)
    card_error(card, card_param(card, "SCALE")->key, "SCALE requires TYPE=FIELD");
  std::vector<std::pair<Check, Field>> list;
  int lines = 0;
  while (type >= 0 && card_line(card)) {
    ++lines;
    c.deck_line = line_place(card);
    if (type == 1) read_field(card, model, c, list);
    else read_history(card, c, list);
  }
  if (type >= 0 && lines == 0)
    card_error(card, card.head.at, "a data line must follow: column or quantity, target, tolerance");
  for (const auto& l : list)
    card_later(card, STAGE_END, [l](Deck& d, Model& m) { add_check(d, m, l.first, l.second); });
}
