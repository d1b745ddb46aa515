#include "deck/kw_set.h"

namespace {

const long max_range = 100000000;

// first, last[, step] : existing labels of the range; descending with a negative step
void generate(Card& card, const LabelIndex& index, const IntVec& label, IntVec& item)
{
  int first = card_label(card, "first label"), last = card_label(card, "last label");
  int step  = card_int_or(card, "step", 1, -2147483647, 2147483647);
  if (!card_good(card)) return;
  if (step == 0) return card_error(card, card.field[2], "the step of a range must not be 0");
  if (step > 0 ? last < first : last > first)
    return card_error(card, card.field[1],
                      text_format("last label %d is %s than the first, %d", last,
                                  step > 0 ? "smaller" : "larger", first));
  if (step < 0) {
    step = -step;
    std::swap(first, last);
    first += static_cast<int>((static_cast<long>(last) - first) % step);      // smallest label of the range
  }
  const long count = (static_cast<long>(last) - first) / step + 1;
  if (count > max_range)
    return card_error(card, card.whole,
                      text_format("a range of %ld labels; at most %ld are allowed", count, max_range));
  const std::size_t before = item.size();
  if (count < static_cast<long>(label.size())) {
    for (long k = 0; k < count; ++k) {
      const int i = index.find(static_cast<int>(first + k * step));
      if (i >= 0) item.push_back(i);
    }
  } else {
    for (std::size_t i = 0; i < label.size(); ++i)
      if (label[i] >= first && label[i] <= last && (static_cast<long>(label[i]) - first) % step == 0)
        item.push_back(static_cast<int>(i));
  }
  const long missing = count - static_cast<long>(item.size() - before);
  if (missing > 0 && card.deck->absent.elem.empty())
    card_warn(card, card.whole,
              text_format("%ld of the %ld labels of this range are not defined", missing, count));
}

// adds facets by label or set name; true: the word is used up
bool listed_facets(const Deck& d, const Model& model, const Field& f, IntVec& facet)
{
  int label = 0;
  if (target_label(f.text, label)) {
    const auto i = d.facets.index.find(label);
    if (i != d.facets.index.end()) facet.push_back(i->second);
    return i != d.facets.index.end();
  }
  bool found = false;
  for (const Set& s : d.facets.set)
    if (s.name == text_upper(f.text)) {
      facet.insert(facet.end(), s.item.begin(), s.item.end());
      found = true;
    }
  return found && model_find_elset(model, text_upper(f.text)) < 0;     // a set may contain both
}

// undefined labels of a set
struct Missing {
  Field first;
  int label = 0, count = 0;
  // true: f is an undefined label. Elements of an unavailable type are not counted.
  bool add(const Deck& d, const Field& f, const LabelIndex& index)
  {
    int number = 0;
    if (!target_label(f.text, number) || index.find(number) >= 0) return false;
    if (&index == &d.labels.elem && d.absent.elem.count(number)) return false;
    if (count++ == 0) {
      first = f;
      label = number;
    }
    return true;
  }
};

void report_missing(Card& card, const char* name, const Missing& missing, std::size_t defined)
{
  if (missing.count == 0) return;
  if (missing.count == 1)
    return card_error(card, missing.first,
                      text_format("%s %d is not defined; it must be defined before it is used", name,
                                  missing.label));
  card_error(card, missing.first,
             text_format("%d of the %zu %ss of this set are not defined, the first is %d; define them "
                         "before use. Mesh generators omit elements that this format "
                         "does not have (gmsh: pyramids), which leaves holes in the mesh",
                         missing.count, missing.count + defined, name, missing.label));
}

// a data line of labels and set names
void listed(Card& card, const Model& model, bool nodes, Missing& missing, IntVec& item, IntVec& facet)
{
  const LabelIndex& index = nodes ? card.deck->labels.node : card.deck->labels.elem;
  while (card_more(card)) {
    Field f = card.field[card.next++];
    const bool may_be_facet = !nodes && !card.deck->facets.list.empty() && !f.empty();
    if (may_be_facet && listed_facets(*card.deck, model, f, facet)) continue;
    if (f.empty()) card_error(card, f, "a label or a set name is missing here");
    else if (missing.add(*card.deck, f, index)) continue;
    else if (nodes) target_nodes(*card.deck, model, f, item);
    else target_elems(*card.deck, model, f, item);
  }
}

void selected(Card& card, const Model& model, bool nodes, const Expr& where, IntVec& item)
{
  const int n = nodes ? model.mesh.nnode() : model.mesh.nelem();
  for (int i = 0; i < n; ++i) {
    if (nodes && model.mesh.node_label[i] < 0) continue;         // of *TRANSFORM
    double x[3];
    if (nodes) for (int k = 0; k < 3; ++k) x[k] = model.mesh.X[3 * static_cast<std::size_t>(i) + k];
    else mesh_centroid(model.mesh, i, x);
    const int label = nodes ? model.mesh.node_label[i] : model.mesh.elem_label[i];
    const std::string name = text_format(nodes ? "node %d" : "the centre of element %d", label);
    if (card_where(card, where, x, model.dim, name)) item.push_back(i);
  }
}

// *NSET, ELSET= : the nodes of the elements of a set
void nodes_of(Card& card, const Model& model, const Field& elset, IntVec& item)
{
  IntVec elem;
  if (!target_elems(*card.deck, model, elset, elem)) return;
  for (int e : elem) item.insert(item.end(), model.mesh.conn.begin(e), model.mesh.conn.begin(e + 1));
}

}  // namespace

void set_read(Card& card, Model& model, bool nodes)
{
  const std::string name = card_param_name(card, nodes ? "NSET" : "ELSET");
  const bool generated = card_flag(card, "GENERATE");
  IntVec item, facet;
  Missing missing;
  Expr where;
  const Field elset = nodes ? card_param_field(card, "ELSET") : Field();
  if (!elset.empty()) nodes_of(card, model, elset, item);
  if (card_param_where(card, where)) selected(card, model, nodes, where, item);
  while (card_line(card)) {
    if (!generated) listed(card, model, nodes, missing, item, facet);
    else if (nodes) generate(card, card.deck->labels.node, model.mesh.node_label, item);
    else generate(card, card.deck->labels.elem, model.mesh.elem_label, item);
  }
  report_missing(card, nodes ? "node" : "element", missing, item.size() + facet.size());
  if (name.empty()) return;
  Deck& d = *card.deck;
  if (d.messages.errors > card.errors_before && !d.absent.elem.empty()) d.absent.set.insert(name);
  facet_set_merge(*card.deck, model, name, facet, card_deck_line(card));
  if (item.empty() && !facet.empty()) return;
  if (item.empty() && card.deck->messages.errors == card.errors_before)
    card_error(card, card.head.at,
               "set " + name + " is empty" +
                   (card_param(card, "WHERE")
                        ? ": WHERE selects nothing; check the tolerance, for example \"abs(x - 1) < 1e-9\""
                        : "; give labels, set names or WHERE"));
  set_merge(nodes ? model.nset : model.elset, name, item, card_deck_line(card));
}
