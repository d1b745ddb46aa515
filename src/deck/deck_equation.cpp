// Checks of equations between displacements, for each step

#include <map>

#include "deck/deck_state.h"

namespace {

const char* keyword_of(const Equation& e)
{
  return e.of == EQUATION_TIE ? "TIE" : e.of == EQUATION_TRANSFORM ? "TRANSFORM"
      : e.of == EQUATION_COUPLING ? "COUPLING" : "EQUATION";
}

// [nnode] 0: no elements, 1: an element remains an element during the run, 2: none does
std::vector<char> node_kinds(const Model& m)
{
  std::vector<char> converts(m.mesh.nelem(), 0), kind(m.mesh.nnode(), 0);
  for (const Body& b : m.body)
    if (b.elset >= 0)
      for (int e : m.elset[b.elset].item) converts[e] = 1;
  for (const ConversionDef& c : m.conversion)
    if (c.elset >= 0)
      for (int e : m.elset[c.elset].item) converts[e] = 1;
  for (int e = 0; e < m.mesh.nelem(); ++e)
    for (int k = m.mesh.conn.off[e]; k < m.mesh.conn.off[e + 1]; ++k) {
      char& l = kind[m.mesh.conn.item[k]];
      if (!converts[e]) l = 1;
      else if (l == 0) l = 2;
    }
  return kind;
}

// equations cannot act on nodes whose elements all become material points
void check_nodes(Deck& d, const Model& m, const std::vector<char>& kind)
{
  for (const Equation& e : m.equation)
    for (const EquationTerm& t : e.term) {
      if (kind[t.node] != 2) continue;
      fault(d, keyword_of(e), e.deck_line, "",
          text_format("all elements of node %d are or may become material points, on which equations "
                      "cannot act; exclude an element there from *CONVERSION, or use *BOND",
                      m.mesh.node_label[t.node]));
      break;
    }
}

// a dependent dof must not be prescribed
void check_prescribed(Deck& d, const Model& m, const Step& s)
{
  std::map<int, int> dependent;
  for (int k : s.equation) dependent[3 * m.equation[k].term[0].node + m.equation[k].term[0].dof] = k;
  for (const Prescribed& b : s.prescribed)
    for (int n : b.node)
      for (int i = b.first; i <= b.last; ++i) {
        const auto k = dependent.find(3 * n + i);
        if (k == dependent.end()) continue;
        const Equation& e = m.equation[k->second];
        fault(d, keyword_of(e), e.deck_line, "",
              text_format(e.of == EQUATION_COUPLING
                              ? "direction %d of node %d follows the reference node, but is prescribed in "
                              : "direction %d of node %d is dependent in this equation, but is "
                                "prescribed in ",
                          i + 1, m.mesh.node_label[n]) +
                  b.deck_line.file + text_format(" line %d; ", b.deck_line.line) +
                  (e.of == EQUATION_COUPLING
                       ? "prescribe the reference node instead, or couple other directions"
                       : "begin the equation with another term, or release the direction"));
        return;
      }
}

// a load on a node without elements needs an equation with this dof
void check_loads(Deck& d, const Model& m, const Step& s, const std::vector<char>& kind)
{
  std::vector<char> linked(3 * static_cast<std::size_t>(m.mesh.nnode()), 0);
  for (int k : s.equation)
    for (const EquationTerm& t : m.equation[k].term) linked[3 * static_cast<std::size_t>(t.node) + t.dof] = 1;
  for (const RigidBody& b : m.rigid)
    for (std::size_t i = 0; i < 3; ++i)
      linked[3 * static_cast<std::size_t>(b.ref) + i] =
          linked[3 * static_cast<std::size_t>(b.turn) + i] = 1;
  for (const Load& l : s.load)
    for (int n : l.node) {
      if (kind[n] || linked[3 * static_cast<std::size_t>(n) + l.dof]) continue;
      fault(d, "CLOAD", l.deck_line, "",
          text_format("direction %d of node %d is loaded, but belongs to no element and to no equation of "
                 "this step",
                 l.dof + 1, m.mesh.node_label[n]));
      break;
    }
}

}  // namespace

DofSet equation_given(const Model& m, const Step& s)
{
  DofSet given;
  for (const Prescribed& b : s.prescribed)
    for (int n : b.node)
      for (int i = b.first; i <= b.last; ++i) given.insert({n, i});
  for (int k : s.equation) given.insert({m.equation[k].term[0].node, m.equation[k].term[0].dof});
  return given;
}

// ---------------------------------------------------------------------------
// check_equations : the equations must be solvable in all steps, without conflicting supports and loads
// ---------------------------------------------------------------------------
void check_equations(Deck& d, const Model& m)
{
  if (m.equation.empty()) return;
  const std::vector<char> kind = node_kinds(m);
  check_nodes(d, m, kind);
  for (const Step& s : m.step) {
    std::vector<EquationSolved> solved;
    int bad = -1;
    if (!equations_resolve(m, s.equation, solved, bad))
      fault(d, keyword_of(m.equation[bad]), m.equation[bad].deck_line, "",
            m.equation[bad].of == EQUATION_TIE
                ? "slave nodes depend on themselves through other ties or equations; exchange slave and "
                  "master "
                  "of one of them"
                : "the first term of this equation depends on itself through other equations; "
                  "begin one of them with another term");
    check_prescribed(d, m, s);
    check_loads(d, m, s, kind);
  }
}
