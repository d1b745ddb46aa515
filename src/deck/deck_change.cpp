// Initial stress, and elements that a step removes or adds: their mistakes, and the materials that get an
// initial strain.

#include <algorithm>

#include "deck/deck_state.h"

namespace {

std::string of_element(const Model& m, int e)
{
  return text_format("element %d of type ", m.mesh.elem_label[e]) + elem_table[m.mesh.elem_type[e]].name;
}

// the material of element e gets an initial strain
void mark_material(Model& m, int e)
{
  const int material = model_material(m, e);
  if (material >= 0) m.material[material].prestressed = true;
}

void check_stress(Deck& d, Model& m, const IntVec& body)
{
  const char* const word = "INITIAL CONDITIONS";
  for (const InitialStress& s : m.initial_stress) {
    if (s.body >= 0 && m.body[s.body].material >= 0) m.material[m.body[s.body].material].prestressed = true;
    for (int e : s.elem) {
      const int points = shape_info[elem_table[m.mesh.elem_type[e]].shape].ngp;
      std::string text;
      if (body[e] >= 0)
        text = text_format("element %d becomes material points; name their body ", m.mesh.elem_label[e]) +
               m.body[body[e]].name + " instead";
      else if (s.point >= points)
        text = of_element(m, e) + text_format(" has %d integration points", points);
      else {
        mark_material(m, e);
        continue;
      }
      fault(d, word, s.deck_line, "", text);
      break;
    }
  }
}

// [nelem] why an element may not be removed or added in a step; null: it may
std::vector<const char*> why_not(const Model& m, const IntVec& body)
{
  std::vector<const char*> out(m.mesh.nelem(), nullptr);
  const auto mark = [&](const IntVec& elem, const char* why) {
    for (int e : elem) out[e] = why;
  };
  for (int e = 0; e < m.mesh.nelem(); ++e)
    if (body[e] >= 0) out[e] = "it becomes material points";
  for (const FractureDef& f : m.fracture)
    if (f.elset >= 0) mark(m.elset[f.elset].item, "it is in the set of *EIGENFRACTURE; take it out of there");
  for (const ConversionDef& c : m.conversion)
    if (c.elset >= 0) mark(m.elset[c.elset].item, "it is in the set of *CONVERSION; take it out of there");
  std::vector<char> tied(m.mesh.nnode(), 0);
  for (const Equation& e : m.equation)
    for (const EquationTerm& t : e.term) tied[t.node] = 1;
  for (const RigidBody& r : m.rigid)
    for (int n : r.node) tied[n] = 1;
  for (int e = 0; e < m.mesh.nelem(); ++e)
    for (int a = 0; a < m.mesh.conn.count(e); ++a)
      if (tied[m.mesh.conn.begin(e)[a]])
        out[e] = "a node of it is in an *EQUATION, *TIE, *COUPLING, *RIGID BODY or *TRANSFORM, which "
                 "stays";
  const auto faces = [&](int surface, const char* why) {
    if (surface < 0) return;
    for (const Face& f : m.surface[surface].face)
      if (m.surface[surface].body < 0) out[f.elem] = why;
  };
  for (const BondDef& b : m.bond) {
    const char* const why =
        b.kind == BOND_CONTACT ? "a face of it is in contact" : "a face of it has a *BOND";
    faces(b.surface, why);
    faces(b.contact.master, why);
    if (b.contact.general)
      std::fill(out.begin(), out.end(), "*CONTACT takes all outer faces; take *CONTACT PAIR of the others");
  }
  for (const ViscousBoundary& v : m.viscous) faces(v.surface, "a face of it has a *VISCOUS BOUNDARY");
  return out;
}

void check_change(Deck& d, Model& m, const ModelChange& c, const std::vector<const char*>& why,
                  std::vector<char>& gone)
{
  for (int e : c.elem) {
    std::string text;
    if (why[e]) text = std::string("cannot be removed or added in a step: ") + why[e];
    else if (m.mesh.elem_section[e] < 0) text = "has no *SOLID SECTION";
    else if (c.add && !gone[e]) text = "is added but was not removed before";
    else if (!c.add && gone[e]) text = "is removed but is not there any more";
    if (c.add) mark_material(m, e);
    gone[e] = !c.add;
    if (text.empty()) continue;
    fault(d, "MODEL CHANGE", c.deck_line, "", text_format("element %d ", m.mesh.elem_label[e]) + text);
    return;
  }
}

}  // namespace

// ---------------------------------------------------------------------------
// deck_changes : mistakes of initial stresses and of *MODEL CHANGE in steps
// ---------------------------------------------------------------------------
void deck_changes(Deck& d, Model& m, const IntVec& body)
{
  check_stress(d, m, body);
  if (!model_changes(m)) return;
  const std::vector<const char*> why = why_not(m, body);
  std::vector<char> gone(m.mesh.nelem(), 0);
  for (const BrokenDef& b : m.broken)
    for (int e : b.elem) gone[e] = b.remove;
  for (const Step& s : m.step) {
    for (const ModelChange& c : s.change) check_change(d, m, c, why, gone);
    if (!s.change.empty() && m.body.empty() && std::count(gone.begin(), gone.end(), 0) == 0)
      fault(d, "MODEL CHANGE", s.change.back().deck_line, "",
            "all elements are removed; nothing is left to solve");
    if (!s.change.empty() && s.arc.on)
      fault(d, "MODEL CHANGE", s.change.back().deck_line, "",
            "does not go with *STATIC, RIKS; put it into a step of its own before");
  }
}
