// Checks of the steps
#include <algorithm>

#include "deck/deck_check.h"

namespace {

// *STATIC, RIKS: needs loads with one common factor, and a cohesive crack to control its opening
void check_arc(Deck& d, const Model& m, const Step& s)
{
  if (!s.arc.on) return;
  const auto refuse = [&](const DeckLine& at, const std::string& text) {
    fault(d, "STATIC", at, "RIKS", text);
  };
  const auto varies = [](const Expr& value, int amplitude) { return amplitude >= 0 || !value.is_const(); };
  if (&s != &m.step.back()) refuse(s.deck_line, "the step with *STATIC, RIKS must be the last one");
  if (std::none_of(m.fracture.begin(), m.fracture.end(), [](const FractureDef& f) {
        return f.criterion == CRITERION_COHESIVE && f.body < 0;
      }))
    refuse(s.deck_line, "*STATIC, RIKS requires cohesive cracks in finite elements: write *EIGENFRACTURE, "
                    "CRITERION=COHESIVE, or leave out RIKS");
  for (const FractureDef& f : m.fracture)
    if (f.body >= 0)
      refuse(s.deck_line, "*STATIC, RIKS does not control cracks of material points: leave out RIKS, or "
                          "*EIGENFRACTURE, BODY=" + m.body[f.body].name);
  for (const Load& l : s.load) {
    if (!l.of_position && varies(l.value, l.amplitude))
      refuse(l.deck_line, "*STATIC, RIKS computes the factor of the loads: give a number without AMPLITUDE");
    if (s.nlgeom && l.kind == LOAD_PRESSURE)
      refuse(l.deck_line, "a follower pressure (NLGEOM) cannot be combined with *STATIC, RIKS");
  }
  for (const Prescribed& b : s.prescribed)
    if (varies(b.value, b.amplitude))
      refuse(b.deck_line, "*STATIC, RIKS computes the factor of the displacements: give a number without "
                      "AMPLITUDE");
}

void check_gravity(Deck& d, const Model& m, const Step& s)
{
  const auto has_density = [&](int material) { return material < 0 || m.material[material].density > 0.0; };
  for (const Load& l : s.load) {
    if (!l.per_mass) continue;
    bool good = true;
    for (int e : l.elem) good = good && has_density(model_material(m, e));
    for (int b : l.body) good = good && has_density(m.body[b].material);
    if (!good && s.proc == PROC_STATIC)
      fault(d, "DENSITY", l.deck_line, "GRAV",
            "gravity needs the density of the material; write *DENSITY after *MATERIAL");
  }
}

// warns of loads on prescribed dofs, which have no effect
void check_loaded_supports(Deck& d, const Model& m, const Step& s)
{
  std::vector<char> fixed(3 * m.mesh.node_label.size(), 0);
  for (const Prescribed& b : s.prescribed)
    for (int n : b.node)
      for (int i = b.first; i <= b.last; ++i) fixed[3 * static_cast<std::size_t>(n) + i] = 1;
  for (const Load& l : s.load) {
    if (l.kind != LOAD_NODE || l.ramp == RAMP_OUT) continue;
    for (int n : l.node)
      if (fixed[3 * static_cast<std::size_t>(n) + l.dof]) {
        warn(d, "CLOAD", l.deck_line, "",
             text_format(
                 "direction %d of node %d is prescribed and loaded; the load has no effect on the motion",
                 l.dof + 1, m.mesh.node_label[n]));
        break;
      }
  }
}

enum NodeUse { USE_NONE, USE_BODY, USE_ELEMENT };      // nodes of equations count as nodes of elements

std::vector<char> node_use(const Model& m, const IntVec& body, const IntVec& removed)
{
  std::vector<char> use(m.mesh.node_label.size(), USE_NONE);
  for (int e = 0; e < m.mesh.nelem(); ++e)
    for (int a = 0; a < m.mesh.conn.count(e) && !removed[e]; ++a) {
      char& u = use[m.mesh.conn.begin(e)[a]];
      u = std::max<char>(u, body[e] < 0 ? USE_ELEMENT : USE_BODY);
    }
  for (const Equation& e : m.equation)
    for (const EquationTerm& t : e.term)
      if (use[t.node] == USE_NONE) use[t.node] = USE_ELEMENT;
  return use;
}

// loads and supports must act on nodes of elements
//   in   ever   of elements that are there in some step: supports on these are no mistake
void check_acting_nodes(Deck& d, const Model& m, const Step& s, const std::vector<char>& use,
                        const std::vector<char>& ever)
{
  for (const Load& l : s.load)
    for (int n : l.node) {
      if (use[n] == USE_ELEMENT) continue;
      const std::string text = use[n] == USE_NONE
                                   ? " is loaded but belongs to no element; remove it from the set"
                                   : " becomes a corner of material points; load the body by "
                                     "*SURFACE, TYPE=BODY and *DSLOAD";
      fault(d, "CLOAD", l.deck_line, "", text_format("node %d", m.mesh.node_label[n]) + text);
      break;
    }
  for (const Prescribed& b : s.prescribed)
    for (int n : b.node) {
      if (use[n] == USE_ELEMENT || ever[n] == USE_ELEMENT) continue;
      if (use[n] == USE_BODY)
        fault(d, "BOUNDARY", b.deck_line, "",
              text_format("node %d becomes a corner of material points; fix it by *GRID BOUNDARY or *BOND, "
                          "TYPE=GROUND",
                          m.mesh.node_label[n]));
      else
        warn(d, "BOUNDARY", b.deck_line, "",
             text_format("node %d is prescribed but belongs to no element; it has no effect",
                         m.mesh.node_label[n]));
      break;
    }
}

void check_acting_faces(Deck& d, const Model& m, const Step& s, const IntVec& body)
{
  for (const Load& l : s.load) {
    if (l.surface < 0) continue;
    const std::vector<Face>& face = m.surface[l.surface].face;
    for (const Face& f : face) {
      if (body[f.elem] < 0) continue;
      fault(
          d, l.keyword.c_str(), l.deck_line, "",
          text_format("element %d becomes material points; load its body by *SURFACE, TYPE=BODY and *DSLOAD",
                      m.mesh.elem_label[f.elem]));
      break;
    }
  }
}

// a load on faces of removed elements has no effect
void check_removed_faces(Deck& d, const Model& m, const Step& s, const IntVec& removed)
{
  for (const Load& l : s.load) {
    if (l.surface < 0 || l.ramp == RAMP_OUT) continue;
    const std::vector<Face>& face = m.surface[l.surface].face;
    const auto removed_faces = std::count_if(face.begin(), face.end(),
                                             [&](const Face& f) { return removed[f.elem] != 0; });
    if (removed_faces == 0) continue;
    const std::string text = text_format(
        "%d of the %d loaded faces belong to elements that *MODEL CHANGE removes: they carry no load",
        static_cast<int>(removed_faces), static_cast<int>(face.size()));
    if (removed_faces == static_cast<long>(face.size()))
      fault(d, l.keyword.c_str(), l.deck_line, "", text + "; load the remaining faces");
    else warn(d, l.keyword.c_str(), l.deck_line, "", text);
  }
}
}  // namespace

// [nelem] 1: *MODEL CHANGE, REMOVE
IntVec deck_removed_elements(const Model& m)
{
  IntVec removed(m.mesh.nelem(), 0);
  for (const BrokenDef& b : m.broken)
    for (int e : b.elem) removed[e] = removed[e] || b.remove;
  return removed;
}

//   in   read_well   nodes that lines with errors would give an element are no further errors
void deck_check_steps(Deck& d, const Model& m, const IntVec& body, bool read_well)
{
  const IntVec removed = deck_removed_elements(m);
  IntVec gone = removed;       // when the step acts
  IntVec never = gone;
  for (const Step& s : m.step)
    for (const ModelChange& c : s.change)
      for (int e : c.elem) never[e] = never[e] && !c.add;
  const std::vector<char> ever = node_use(m, body, never);
  std::vector<char> use = node_use(m, body, gone);
  for (const Step& s : m.step) {
    for (const ModelChange& c : s.change)
      for (int e : c.elem) gone[e] = !c.add;
    if (!s.change.empty()) use = node_use(m, body, gone);
    if (!m.body.empty() && !s.nlgeom)
      fault(d, "STEP", s.deck_line, "STEP",
            "material points move through a grid and need large displacements; write *STEP, NLGEOM");
    check_gravity(d, m, s);
    check_arc(d, m, s);
    check_loaded_supports(d, m, s);
    if (read_well) check_acting_nodes(d, m, s, use, ever);
    check_acting_faces(d, m, s, body);
    check_removed_faces(d, m, s, removed);
  }
}
