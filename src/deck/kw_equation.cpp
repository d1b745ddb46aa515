#include <algorithm>
#include <cmath>
#include <set>

#include "deck/card.h"

namespace {

struct Term {                  // one term of a deck line
  Field node;
  int dof = 0;
  double coef = 0.0;
};

// the node of a term: a label, or a set of one node; -1: error reported
int node_of(Deck& d, const Model& m, const Field& at)
{
  IntVec node;
  if (!target_nodes(d, m, at, node)) return -1;
  if (node.size() == 1) return node[0];
  deck_error(d, at,
             "set " + text_show(at.text) +
                 text_format(" has %zu nodes, a term requires one: sets are unordered, so that nodes "
                             "cannot be paired; write "
                             "an equation for each pair",
                             node.size()));
  return -1;
}

void add_equation(Deck& d, Model& m, const DeckLine& deck_line, const std::vector<Term>& term)
{
  Equation e;
  e.deck_line = deck_line;
  for (const Term& t : term) {
    const int node = node_of(d, m, t.node);
    if (node < 0) return;
    e.term.push_back({frame_node(d, m, node), t.dof, t.coef});
  }
  double first = 0.0, size = 0.0;
  for (const EquationTerm& t : e.term) {
    if (t.node != e.term[0].node || t.dof != e.term[0].dof) continue;
    first += t.coef;
    size  = std::max(size, std::fabs(t.coef));
  }
  if (std::fabs(first) <= 1e-14 * size)
    return deck_error(d, term[0].node,
                      "the coefficient of the first term is 0, but the equation is solved for its direction, "
                      "which depends on the others");
  for (const Equation& other : m.equation)
    if (other.term[0].node == e.term[0].node && other.term[0].dof == e.term[0].dof)
      return deck_error(d, term[0].node,
                        text_format("direction %d of node %d is dependent already, in the equation of ",
                        e.term[0].dof + 1, m.mesh.node_label[e.term[0].node]) + other.deck_line.file +
                        text_format(" line %d; begin this one with another term", other.deck_line.line));
  m.equation.push_back(e);
}

// n, then n times node, direction, coefficient, over any number of lines
void read_equation(Card& card, const Model& model)
{
  const DeckLine deck_line = line_place(card);
  const int errors  = card.deck->messages.errors;
  const int n       = card_int(card, "number of terms", 2, 1000000);
  std::vector<Term> term;
  for (int k = 0; k < n && card.deck->messages.errors == errors; ++k) {
    if (!card_more(card) && !card_line(card))
      return card_error(
          card, card.head.at,
          text_format("term %d of %d is missing: a line with node, direction, coefficient must follow", k + 1,
                      n));
    Term t;
    t.node = card_field(card, "node");
    t.dof  = card_dof(card, model, "direction");
    t.coef = card_real(card, "coefficient", any_number());
    term.push_back(t);
  }
  if (card.deck->messages.errors == errors)
    card_later(card, STAGE_STEP, [=](Deck& d, Model& m) { add_equation(d, m, deck_line, term); });
  else
    card.next = card.field.size();
}

// nset|node, first[, last] : removes the equations with these dependent dofs
void remove_line(Card& card, Model& model, IntVec& active)
{
  IntVec node;
  const Field at  = card_field(card, "node set or node");
  const int first = card_dof(card, model, "first direction");
  const int last  = card_int_or(card, "last direction", first + 1, 1, model.dim) - 1;
  if (!card_good(card) || !target_nodes(*card.deck, model, at, node)) return;
  frame_nodes(*card.deck, model, node);
  const std::set<int> listed(node.begin(), node.end());
  const std::size_t before = active.size();
  const auto is_removed = [&](int q) {
    const EquationTerm& t = model.equation[q].term[0];
    return listed.count(t.node) && t.dof >= first && t.dof <= last;
  };
  active.erase(std::remove_if(active.begin(), active.end(), is_removed), active.end());
  if (active.size() == before)
    card_error(card, card.whole,
               "no equation has such a direction as its dependent (first) term; "
               "nothing is removed");
}

}  // namespace

// ---------------------------------------------------------------------------
// *EQUATION : n, then n times node, direction, coefficient; the first term is the dependent one
// *EQUATION, REMOVE : nset|node, first[, last]; *EQUATION, REMOVE ALL; for this and all later steps
// ---------------------------------------------------------------------------
void kw_equation(Card& card, Model& model)
{
  Deck& d = *card.deck;
  const bool some = card_flag(card, "REMOVE"), all = card_flag(card, "REMOVE ALL");
  if ((some || all) != d.open.step)
    return card_error(
        card, card.head.at,
        d.open.step ? "equations must precede the first *STEP; in a step they can only be removed (REMOVE, "
                    "REMOVE ALL)"
                  : "REMOVE is allowed only in a step; leave out the equation instead");
  if (!d.open.step)
    while (card_line(card)) read_equation(card, model);
  else if (all) model.step.back().equation.clear();
  else
    while (card_line(card)) remove_line(card, model, model.step.back().equation);
}
