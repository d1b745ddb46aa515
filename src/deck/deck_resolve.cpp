#include <algorithm>

#include "deck/deck_state.h"

namespace {

// assigns the sections to the elements of their sets; an element has one section
void give_sections(Deck& d, Model& m)
{
  d.word = "SOLID SECTION";
  for (std::size_t i = 0; i < m.section.size(); ++i) {
    const Section& s = m.section[i];
    if (s.material >= 0) m.material[s.material].used = true;
    if (s.elset < 0) continue;
    bool reported = false;
    for (int e : m.elset[s.elset].item) {
      int& section = m.mesh.elem_section[e];
      if (section >= 0 && !reported) {
        deck_error(d, deck_field(d, s.deck_line, m.elset[s.elset].name),
                   text_format("element %d has a section already, in ", m.mesh.elem_label[e]) +
                       m.section[section].deck_line.file +
                       text_format(" line %d; an element has one section",
                                   m.section[section].deck_line.line));
        reported = true;
      }
      section = static_cast<int>(i);
    }
  }
  for (const Body& b : m.body)
    if (b.material >= 0) m.material[b.material].used = true;
}

// marks materials of elements that can break
void mark_breaking(Model& m)
{
  for (const FractureDef& f : m.fracture) {
    if (f.body >= 0 && m.body[f.body].material >= 0) m.material[m.body[f.body].material].breaks = true;
    if (f.elset < 0) continue;
    for (int e : m.elset[f.elset].item) {
      const int material = model_material(m, e);
      if (material >= 0) m.material[material].breaks = true;
    }
  }
}

// hyperelastic materials need NLGEOM in all steps, as in CalculiX
void force_nlgeom(Deck& d, Model& m)
{
  d.word = "STEP";
  for (const Material& a : m.material) {
    if (!a.used || !a.hyper) continue;
    for (std::size_t k = 0; k < m.step.size(); ++k) {
      if (m.step[k].nlgeom) continue;
      deck_warn(d, deck_field(d, m.step[k].deck_line, "STEP"),
                "material " + a.name + " is hyperelastic: step " + std::to_string(k + 1) +
                    " is computed with NLGEOM; write *STEP, NLGEOM");
      m.step[k].nlgeom = true;
    }
  }
}

// body of each element that becomes material points, -1: stays an element
IntVec body_of_elements(const Model& m)
{
  IntVec body(m.mesh.nelem(), -1);
  for (std::size_t b = 0; b < m.body.size(); ++b)
    if (m.body[b].elset >= 0)
      for (int e : m.elset[m.body[b].elset].item) body[e] = static_cast<int>(b);
  return body;
}

// moves a volume load on elements that become points to their body
void move_to_bodies(Deck& d, const Model& m, const IntVec& body, Load& l)
{
  std::vector<std::size_t> hit(m.body.size(), 0);
  IntVec rest;
  for (int e : l.elem) {
    if (body[e] < 0) rest.push_back(e);
    else ++hit[body[e]];
  }
  if (rest.size() == l.elem.size()) return;
  for (std::size_t b = 0; b < hit.size(); ++b) {
    if (hit[b] == 0) continue;
    if (hit[b] < m.elset[m.body[b].elset].item.size())
      deck_error(d, deck_field(d, l.deck_line, ""),
                 "the load acts on a part of body " + m.body[b].name +
                     ", but loads act on whole bodies; name the body");
    if (std::find(l.body.begin(), l.body.end(), static_cast<int>(b)) == l.body.end())
      l.body.push_back(static_cast<int>(b));
  }
  l.elem.swap(rest);
}

// Default scheme: Newmark conserves energy in linear problems only, so nonlinear ones take energy-momentum.
// The energy balance is checked in dynamic steps; in static ones on request.
void default_scheme(Deck& d, const Model& m, Step& s)
{
  if (s.proc != PROC_DYNAMIC) return;
  if (s.scheme == SCHEME_HHT && (!m.body.empty() || !m.conversion.empty()))
    deck_error(d, deck_field(d, s.deck_line, ""),
               "SCHEME=HHT (ALPHA) is not available with material points; use SCHEME=ENERGY-MOMENTUM, "
               "DISSIPATION=0 ... 0.5");
  bool nonlinear = s.nlgeom || !m.body.empty() || !m.fracture.empty() || !m.conversion.empty();
  for (const BondDef& b : m.bond) nonlinear = nonlinear || b.kind == BOND_CONTACT;
  for (const Material& a : m.material) nonlinear = nonlinear || (a.used && a.law != LAW_SVK);
  if (!s.scheme_given && nonlinear) s.scheme = SCHEME_ENERGY_MOMENTUM;
  if (s.balance == 0.0) s.balance = 0.05;
}

// Default bulk viscosity: on where materials have a strength, as spurious oscillations behind a wave front
// would exceed it. Test: C5 (strength/spall.inp)
void default_bulk(const Model& m, Step& s)
{
  if (s.bulk_linear != NOT_GIVEN) return;
  const bool strength = std::any_of(m.fracture.begin(), m.fracture.end(), [](const FractureDef& f) {
    return f.criterion == CRITERION_COHESIVE;
  });
  s.bulk_linear    = strength ? BULK_LINEAR : 0.0;
  s.bulk_quadratic = strength ? BULK_QUADRATIC : 0.0;
}

// Default largest increment of dynamics: with the half-increment residual a hundredth of the step, as in
// Abaqus. Not with fracture, which is tested once an increment and not limited by the residual.
void default_dt_max(const Model& m, Step& s)
{
  if (s.proc != PROC_DYNAMIC || s.dt_max > 0.0 || s.explicit_steps()) return;
  const bool limited = s.half_force > 0.0 || s.half_part > 0.0;
  s.dt_max = limited && m.fracture.empty() ? std::max(s.dt, 0.01 * s.period) : s.dt;
}

}  // namespace

// ---------------------------------------------------------------------------
// deck_resolve : sets data that depend on the whole deck: sections of elements, materials in use, loads on
// elements that become material points, the scheme of dynamic steps
// ---------------------------------------------------------------------------
void deck_resolve(Deck& d, Model& m)
{
  give_sections(d, m);
  deck_fracture(d, m);
  frame_resolve(d, m);
  mark_breaking(m);
  force_nlgeom(d, m);
  const IntVec body = body_of_elements(m);
  for (Step& s : m.step) {
    d.word = "DYNAMIC";
    default_scheme(d, m, s);
    default_bulk(m, s);
    default_dt_max(m, s);
    d.word = "DLOAD";
    for (Load& l : s.load)
      if (l.kind == LOAD_BODY) move_to_bodies(d, m, body, l);
  }
}
