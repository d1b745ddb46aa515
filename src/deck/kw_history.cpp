#include <algorithm>

#include "deck/card.h"
#include "model/quantity.h"

namespace {

const std::vector<QuantityWhere> EVERYWHERE = {OF_MOTION,  OF_NODES, OF_SUPPORTS, OF_GRID,
                                               OF_CONTACT, OF_MODEL, OF_POINTS};

QuantityWhere where(const std::string& quantity) { return quantity_find(quantity)->where; }
bool is_of_elements(const std::string& quantity) { return where(quantity) == OF_POINTS; }
bool is_of_points(const std::string& quantity)
{
  return where(quantity) == OF_MOTION || is_of_elements(quantity);
}

// a body takes precedence over a set of the same name, whose elements may become points
void add_history(Deck& d, Model& m, HistoryDef h, const Field& target)
{
  const int body = model_find_body(m, text_upper(target.text));
  const bool other_kind = is_of_elements(h.what) ? model_find_elset(m, text_upper(target.text)) < 0 &&
                                                       model_find_nset(m, text_upper(target.text)) >= 0
                                                 : model_find_nset(m, text_upper(target.text)) < 0 &&
                                                       model_find_elset(m, text_upper(target.text)) >= 0;
  if (body >= 0 && is_of_points(h.what)) {
    h.body = body;
  } else if (body >= 0 || other_kind) {
    deck_error(d, target,
               h.what + " is a quantity of " + (is_of_elements(h.what) ? "elements; " : "nodes; ") +
                   text_show(target.text) + " is a " +
                   (body >= 0                ? "body of material points"
                    : is_of_elements(h.what) ? "node set"
                                             : "element set"));
    return;
  } else if (is_of_elements(h.what)) {
    h.elset = target_elset(d, m, target);
  } else {
    h.nset = target_nset(d, m, target);
  }
  if (h.body < 0 && h.elset < 0 && h.nset < 0) return;
  m.output.history.push_back(h);
}

void add_grid_history(Deck& d, Model& m, HistoryDef h, const Field& target)
{
  int number = 0;
  const int n = static_cast<int>(m.grid_bc.size());
  if (!target_label(target.text, number) || number < 1 || number > n)
    return deck_error(d, target,
                      h.what + (n > 0 ? text_format(" needs the number of a *GRID BOUNDARY line, 1 to %d", n)
                                      : std::string(" needs a *GRID BOUNDARY; none is defined")));
  h.grid_bc = number - 1;
  m.output.history.push_back(h);
}

void add_contact_history(Deck& d, Model& m, HistoryDef h, const Field& target)
{
  std::vector<std::string> names;
  for (std::size_t i = 0; i < m.bond.size(); ++i) {
    if (m.bond[i].kind != BOND_CONTACT) continue;
    names.push_back(m.bond[i].name);
    if (m.bond[i].name == text_upper(target.text)) h.contact = static_cast<int>(i);
  }
  if (h.contact < 0)
    return deck_error(d, target,
                      h.what + " needs the name of a *CONTACT PAIR" +
                          text_suggest(text_upper(target.text), names));
  m.output.history.push_back(h);
}

void read_line(Card& card, const Model& model, std::vector<std::string>& names)
{
  const std::string quantities = quantity_words(model.dim, EVERYWHERE);
  const char* const axis[3] = {"x", "y", "z"};
  HistoryDef h;
  const Field name = card_field(card, "name of the column");
  const int q = card_word(card, "quantity", quantities.c_str());
  if (q < 0 || !card_good(card)) return;
  h.what  = split_words(quantities.c_str())[q];
  h.name  = text_upper(name.text);
  h.deck_line = line_place(card);
  std::string column;
  if (column_built_in(h.name, column))
    card_error(card, name, "column " + column + " is built in; choose another name");
  else if (std::find(names.begin(), names.end(), h.name) != names.end())
    card_error(card, name, "column " + text_show(h.name) + " is defined already");
  names.push_back(h.name);

  if (where(h.what) == OF_MODEL) {                      // quantity of the whole model: no target
    if (card_more(card)) {
      const int r = card_word(card, "reduction", "MAX|MIN");
      if (r >= 0) h.reduce = r == 0 ? REDUCE_MAX : REDUCE_MIN;
    }
    if (card_good(card)) card_later(card, STAGE_END, [=](Deck&, Model& m) { m.output.history.push_back(h); });
    return;
  }
  const Field target = card_field(card, "target (node set, node, element set, body or AT)");
  const bool grid = where(h.what) == OF_GRID, contact = where(h.what) == OF_CONTACT;
  h.at_point = text_upper(target.text) == "AT";
  if (h.at_point && !is_of_points(h.what))
    card_error(card, target, h.what + " is not available AT a point; name a node set");
  for (int i = 0; h.at_point && i < model.dim; ++i) h.X[i] = card_real(card, axis[i], any_number());
  h.reduce = where(h.what) == OF_SUPPORTS || grid ? REDUCE_SUM : REDUCE_MEAN;
  if (!h.at_point && !grid && !contact && card_more(card)) {
    const int r = card_word(card, "reduction", "MEAN|SUM|MAX|MIN|ABSMAX");
    if (r >= 0) h.reduce = static_cast<Reduce>(r);
  }
  if (!card_good(card)) return;
  card_later(card, STAGE_END, [=](Deck& d, Model& m) {
    if (h.at_point) m.output.history.push_back(h);
    else if (grid) add_grid_history(d, m, h, target);
    else if (contact) add_contact_history(d, m, h, target);
    else add_history(d, m, h, target);
  });
}

}  // namespace

// ---------------------------------------------------------------------------
// *HISTORY[, FREQUENCY=] : name, quantity, target[, reduction] or name, quantity, AT, x, y[, z]
// ---------------------------------------------------------------------------
void kw_history(Card& card, Model& model)
{
  Deck& d = *card.deck;
  int& frequency = model.output.history_at.frequency;
  frequency      = card_param_int(card, "FREQUENCY", frequency, 1, 2147483647);
  while (card_line(card)) read_line(card, model, d.column);
}
