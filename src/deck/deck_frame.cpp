// Nodes with local directions (*TRANSFORM). Supports, loads and equations of such a node act on its twin: a
// node without elements whose displacements are the local components of those of the node, by equations:
// doc/theory.md (5.9)

#include <algorithm>

#include "deck/deck_state.h"

namespace {

void make_twin(Deck& d, Model& m, Frame& f)
{
  const double* X = &m.mesh.X[3 * static_cast<std::size_t>(f.node)];
  const double x = X[0], y = X[1], z = X[2];
  f.twin     = mesh_add_node(d, m, -m.mesh.node_label[f.node], x, y, z, deck_field(d, f.deck_line, ""));
  f.equation = static_cast<int>(m.equation.size());
  for (int j = 0; j < m.dim; ++j) {
    Equation e;
    e.deck_line = f.deck_line;
    e.of    = EQUATION_TRANSFORM;
    e.term.push_back({f.node, j, 1.0});
    for (int i = 0; i < m.dim; ++i) e.term.push_back({f.twin, i, -f.axis[3 * i + j]});
    m.equation.push_back(e);
  }
}

}  // namespace

int frame_node(Deck& d, Model& m, int node)
{
  const auto found = d.frame_of.find(node);
  if (found == d.frame_of.end()) return node;
  if (m.frame[found->second].twin < 0) make_twin(d, m, m.frame[found->second]);
  return m.frame[found->second].twin;
}

void frame_nodes(Deck& d, Model& m, IntVec& node)
{
  if (d.frame_of.empty()) return;
  for (int& n : node) n = frame_node(d, m, n);
}

// ---------------------------------------------------------------------------
// frame_resolve : activates the equations of twins in all steps, also after *EQUATION, REMOVE ALL
// ---------------------------------------------------------------------------
void frame_resolve(Deck& d, Model& m)
{
  for (const Frame& f : m.frame) {
    if (f.twin < 0) continue;
    for (Step& s : m.step)
      for (int k = f.equation; k < f.equation + m.dim; ++k)
        if (std::find(s.equation.begin(), s.equation.end(), k) == s.equation.end()) s.equation.push_back(k);
  }
  if (m.frame.empty() || m.conversion.empty()) return;
  d.word = "TRANSFORM";
  deck_error(d, deck_field(d, m.frame[0].deck_line, "TRANSFORM"),
             "*TRANSFORM cannot be combined with *CONVERSION: points have no local directions; fix them by "
             "*BOND, TYPE=GROUND, or leave out *TRANSFORM");
}
