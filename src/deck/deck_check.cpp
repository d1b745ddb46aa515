// Checks of the whole model after reading. Each message gives line, error and remedy.

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <utility>

#include "deck/deck_check.h"

namespace {

const char* const in_axis[3] = {" in x", " in y", " in z"};

BoundingBox body_box(const Model& m, const Body& body)
{
  BoundingBox b;
  if (body.fill != FILL_ELSET) {
    std::copy_n(body.lo.data(), 3, b.lo);
    std::copy_n(body.hi.data(), 3, b.hi);
  } else if (body.elset >= 0) {
    for (int e : m.elset[body.elset].item) deck_box_element(b, m.mesh, e);
  }
  return b;
}

DeckLine last_line(const Deck& d)
{
  DeckLine p;
  p.file = d.file[0].path;
  p.line = std::max<int>(1, static_cast<int>(d.file[0].start.size()));
  return p;
}

const char* bond_word(const BondDef& bond) { return bond.kind == BOND_CONTACT ? "CONTACT PAIR" : "BOND"; }

// ---- materials ------------------------------------------------------------

// the keyword of plasticity
const char* plastic_word(const Material& a) { return a.law == LAW_J2 ? "PLASTIC" : "DRUCKER PRAGER"; }

// orthotropic constants exclude other laws; in a plane model z must be a material direction
void check_ortho(Deck& d, const Model& m, const Material& a)
{
  if (a.elastic.empty()) return;
  const char* const alone =
      a.hyper               ? "*HYPERELASTIC replaces *ELASTIC, TYPE=ENGINEERING CONSTANTS; keep one of them"
      : a.law != LAW_ORTHO  ? "plasticity requires isotropic *ELASTIC"
      : a.beta > 0.0        ? "*DAMPING, BETA= requires isotropic *ELASTIC; ALPHA= is available"
      : a.breaks            ? "*EIGENFRACTURE contains elements of it, but criterion and broken material are "
                              "isotropic; remove these elements from the set"
                            : nullptr;
  if (alone) fault(d, "ELASTIC", a.deck_line, a.name, "material " + a.name + ": " + alone);
  double largest = 0.0, out = 0.0;
  for (int i : {0, 1, 2, 3})
    for (int j : {0, 1, 2, 3}) largest = std::max(largest, std::fabs(a.elastic[6 * i + j]));
  for (int i : {0, 1, 2, 3})
    for (int j : {4, 5}) out = std::max(out, std::fabs(a.elastic[6 * i + j]));
  if (m.dim == 2 && out > 1e-9 * largest)
    fault(d, "ELASTIC", a.deck_line, a.name,
          "material " + a.name +
              " couples in-plane strain and out-of-plane shear: in a plane model one of its three "
              "directions must be z");
}

// all elements of this material that can break have CRITERION=COHESIVE
bool only_cohesive(const Model& m, const Material& a)
{
  for (const FractureDef& f : m.fracture) {
    if (f.criterion == CRITERION_COHESIVE || f.elset < 0) continue;
    for (int e : m.elset[f.elset].item) {
      const int material = model_material(m, e);
      if (material >= 0 && &m.material[material] == &a) return false;
    }
  }
  return true;
}

// names a body of this material that cracks, else its elements
std::string breaking_part(const Model& m, const Material& a)
{
  for (const FractureDef& f : m.fracture)
    if (f.body >= 0 && m.body[f.body].material >= 0 && &m.material[m.body[f.body].material] == &a)
      return "body " + m.body[f.body].name;
  return "elements";
}

// EXPONENT FORM: the curve that begins without pressure has a strength in uniaxial compression already
void check_curve(Deck& d, const Material& a)
{
  double steep;
  if (a.law != LAW_DRUCKER_PRAGER || a.yield.empty() || cone_cohesion(a, a.yield.front(), &steep) > 0.0)
    return;
  const double least      = std::pow(a.friction / 3.0, 1.0 / (a.exponent - 1.0));
  const std::string range = a.exponent == 1.0 ? "" : ", which must exceed " + text_number(least);
  fault(d, "DRUCKER PRAGER", a.deck_line, a.name,
        "material " + a.name + " has no cohesion: pt of SHEAR CRITERION=EXPONENT FORM with a = " +
            text_number(1.0 / a.friction) + ", b = " + text_number(a.exponent) +
            " is not above 0 at a strength in uniaxial compression of " + text_number(a.yield.front()) +
            range + "; raise a or *DRUCKER PRAGER HARDENING");
}

void check_materials(Deck& d, const Model& m)
{
  bool dynamic = false;
  for (const Step& s : m.step) dynamic = dynamic || s.proc == PROC_DYNAMIC;
  for (const Material& a : m.material) {
    if (!a.used) {
      warn(d, "MATERIAL", a.deck_line, a.name,
           "material " + a.name +
               " is not used; name it in *SOLID SECTION or *MATERIAL POINTS, or remove it");
      continue;
    }
    if (!a.has_elastic)
      fault(d, "ELASTIC", a.deck_line, a.name,
            "material " + a.name + " has no *ELASTIC (or *HYPERELASTIC); write it after *MATERIAL");
    if (!a.yield.empty() && !law_flows(a.law) && !a.hyper)
      fault(d, "DRUCKER PRAGER HARDENING", a.deck_line, a.name,
            "material " + a.name + " has *DRUCKER PRAGER HARDENING without *DRUCKER PRAGER; write it before");
    if (a.law == LAW_DRUCKER_PRAGER && a.yield.empty())
      fault(d, "DRUCKER PRAGER", a.deck_line, a.name,
            "material " + a.name +
                " has *DRUCKER PRAGER without its strength; write *DRUCKER PRAGER HARDENING");
    check_curve(d, a);
    if (law_flows(a.law) && a.hyper)
      fault(d, plastic_word(a), a.deck_line, a.name,
            "material " + a.name + " has *HYPERELASTIC and *" + plastic_word(a) +
                "; plasticity requires *ELASTIC");
    check_ortho(d, m, a);
    if (a.law == LAW_NEO_HOOKE && a.breaks)
      warn(d, "HYPERELASTIC", a.deck_line, a.name,
           "material " + a.name + " is hyperelastic and can break: the criterion of *EIGENFRACTURE and "
           "broken material use the small-strain elastic constants, which are accurate for strains of a "
           "few per cent");
    if (law_flows(a.law) && a.breaks && !(a.law == LAW_DRUCKER_PRAGER && only_cohesive(m, a)))
      fault(d, plastic_word(a), a.deck_line, a.name,
            "material " + a.name + " is plastic, and *EIGENFRACTURE contains elements of it: plastic "
            "dissipation at a crack tip is not in the criterion; remove *" + plastic_word(a) +
                ", or these elements from the set" +
                (a.law == LAW_DRUCKER_PRAGER ? ", or use CRITERION=COHESIVE" : ""));
    if (a.gap && a.breaks)
      fault(d, "DRUCKER PRAGER", a.deck_line, a.name,
            "material " + a.name + " has APEX=GAP, and *EIGENFRACTURE contains " + breaking_part(m, a) +
                " of it: the crack opens and closes instead; leave out APEX=GAP");
    if (dynamic && a.density == 0.0)
      fault(d, "DENSITY", a.deck_line, a.name,
            "material " + a.name + " has no *DENSITY, which a *DYNAMIC step needs; write it after *MATERIAL");
  }
}

// elements with enhanced strains need *ELASTIC
void check_law_elements(Deck& d, const Model& m)
{
  std::vector<char> reported(m.material.size(), 0);
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    const int k = model_material(m, e);
    if (k < 0 || reported[k] || !elem_table[m.mesh.elem_type[e]].enhanced) continue;
    const Material& a = m.material[k];
    if (a.law == LAW_SVK) continue;
    reported[k] = 1;
    const std::string type = elem_table[m.mesh.elem_type[e]].name;
    const char* const word = law_flows(a.law)       ? plastic_word(a)
                             : a.law == LAW_ORTHO ? "ELASTIC"
                                                    : "HYPERELASTIC";
    fault(d, word, a.deck_line, a.name,
          text_format("element %d of type ", m.mesh.elem_label[e]) + type + " has material " + a.name +
              ": enhanced strains require " + (a.law == LAW_ORTHO ? "isotropic " : "") +
              "*ELASTIC; use " + type.substr(0, type.size() - 1) +
              (law_flows(a.law) ? ", which does not lock volumetrically" : ""));
  }
}

// elements that lock volumetrically: one integration point, or breakable; quadratic with full integration
// (no F-bar)
bool may_lock(const ElemType& type, const Material& a)
{
  const Shape s = type.shape;
  return shape_info[s].ngp == 1 || a.breaks || (shape_quadratic(s) && s != SHAPE_QUAD8R && s != SHAPE_HEX20R);
}

// what to do against it: elements that may break have no F-bar, and quadratic ones among them are split
std::string unlock(const Model& m, const Material& a, bool points)
{
  if (a.breaks && law_flows(a.law))
    return "; material that may break has no F-bar, whatever the element: refine the mesh, and give elements "
           "that only flow a *MATERIAL of their own";
  return std::string("; use ") +
         (m.dim == 3 ? "C3D20R or C3D8" : "CPE8R or CPE4, or CPS4 where plane stress fits") +
         (points ? ", and POINTS=2 or more for material points" : "") +
         (a.breaks ? "; with *EIGENFRACTURE a smaller Poisson's ratio (0.45)" : "");
}

void check_locking(Deck& d, const Model& m)
{
  IntVec element(m.material.size(), -1), body(m.material.size(), -1);
  for (int e = m.mesh.nelem() - 1; e >= 0; --e) {
    const ElemType& info = elem_table[m.mesh.elem_type[e]];
    if (info.enhanced || info.plane == PLANE_STRESS) continue;
    const int material = model_material(m, e);
    if (material >= 0 && may_lock(info, m.material[material])) element[material] = e;
  }
  for (std::size_t b = m.body.size(); b-- > 0;) {
    const int material = m.body[b].material;
    if (material >= 0 && m.body[b].plane != PLANE_STRESS &&
        (m.material[material].breaks || (m.body[b].per_cell == 1 && m.body[b].fill != FILL_CONVERSION)))
      body[material] = static_cast<int>(b);
  }
  for (std::size_t k = 0; k < m.material.size(); ++k) {
    const Material& a = m.material[k];
    if ((a.poisson < 0.49 && !law_flows(a.law)) || (element[k] < 0 && body[k] < 0)) continue;
    std::string elements;
    if (element[k] >= 0)
      elements = elem_table[m.mesh.elem_type[element[k]]].name +
                 text_format(" (element %d)", m.mesh.elem_label[element[k]]);
    if (body[k] >= 0)
      elements += (elements.empty() ? "" : " and ") + ("material points (body " + m.body[body[k]].name + ")");
    const std::string cause = law_flows(a.law) ? "plastic flow" : "poisson = " + text_number(a.poisson);
    warn(d, law_flows(a.law) ? plastic_word(a) : "ELASTIC", a.deck_line, a.name,
         cause + " of material " + a.name + " makes " + elements + " too stiff by volumetric locking" +
             (element[k] >= 0 && elem_quadratic(m.mesh.elem_type[element[k]]) ? " (no F-bar)" : "") +
             unlock(m, a, body[k] >= 0));
  }
}

// warns of two initial values for a node or body in the same direction
void check_initial(Deck& d, const Model& m)
{
  std::map<std::pair<int, int>, const InitialValue*> previous;  // node, or -1 - body; direction and kind
  for (const InitialValue& v : m.initial) {
    IntVec target = v.node;
    if (v.body >= 0) target.push_back(-1 - v.body);
    bool reported = false;
    for (int n : target) {
      const InitialValue*& last = previous[{n, v.dof + (v.displacement ? 3 : 0)}];
      if (last && !reported && !expr_same(last->value, v.value)) {
        reported = true;
        const std::string name = n < 0 ? "body " + m.body[-1 - n].name
                                       : text_format("node %d", m.mesh.node_label[n]);
        warn(d, "INITIAL CONDITIONS", v.deck_line, "",
             text_format("replaces the value of line %d for ", last->deck_line.line) + name +
                 text_format(", direction %d; the last value is used", v.dof + 1));
      }
      last = &v;
    }
  }
}

void check_fragments(Deck& d, const Model& m)
{
  if (!m.output.fragments.on) return;
  for (const Material& a : m.material)
    if (a.used && a.density == 0.0)
      fault(d, "FRAGMENTS", m.output.fragments.deck_line, "FRAGMENTS",
            "masses of fragments need the density of material " + a.name +
                "; write *DENSITY after *MATERIAL");
}

// ---- material points ------------------------------------------------------

void check_body_box(Deck& d, const Model& m, const Body& body)
{
  const Grid& g = m.grid;
  const BoundingBox b = body_box(m, body);
  for (int i = 0; i < m.dim; ++i) {
    const double hi = g.lo[i] + g.n[i] * g.h[i], tol = 1e-9 * (hi - g.lo[i]);
    if (b.lo[i] > b.hi[i] || (b.lo[i] >= g.lo[i] - tol && b.hi[i] <= hi + tol)) continue;
    return fault(d, body.fill == FILL_CONVERSION ? "CONVERSION" : "MATERIAL POINTS", body.deck_line,
                 body.name,
                 "body " + body.name + " extends from " + text_number(b.lo[i]) + " to " +
                     text_number(b.hi[i]) + in_axis[i] + ", the grid from " + text_number(g.lo[i]) + " to " +
                     text_number(hi) + "; enlarge the *GRID, with room for the motion");
  }
}

// a box must have cells, and a region at least one point
void check_fill(Deck& d, const Model& m, const Body& body)
{
  double n[3] = {1.0, 1.0, 1.0};
  const char* const counts = m.dim == 3 ? "nx, ny, nz" : "nx, ny";
  for (int i = 0; i < m.dim; ++i) {
    n[i] = body.cells[i] > 0 ? body.cells[i] : std::round((body.hi[i] - body.lo[i]) / m.grid.h[i]);
    if (!(n[i] >= 1.0))
      return fault(d, "MATERIAL POINTS", body.deck_line, body.name,
                   "the box of " + body.name + " is thinner than half a cell of the grid: 0 points; give " +
                       std::string(counts) + " in a second data line");
    n[i] *= body.per_cell;
  }
  if (!(n[0] * n[1] * n[2] <= 5e7))
    return fault(d, "MATERIAL POINTS", body.deck_line, body.name,
                 "body " + body.name + " has more than 5e7 points; give fewer cells (" + counts +
                     ") or a coarser grid");
  if (body.fill != FILL_REGION || n[0] * n[1] * n[2] > 4e6 || body.where.is_const()) return;
  double at[3];
  for (at[2] = 0.5; at[2] < n[2]; ++at[2])
    for (at[1] = 0.5; at[1] < n[1]; ++at[1])
      for (at[0] = 0.5; at[0] < n[0]; ++at[0]) {
        double x[3] = {0, 0, 0};
        for (int i = 0; i < m.dim; ++i) x[i] = body.lo[i] + (body.hi[i] - body.lo[i]) * at[i] / n[i];
        if (expr_eval(body.where, x, 0.0) != 0.0) return;
      }
  fault(d, "MATERIAL POINTS", body.deck_line, "WHERE",
        "WHERE is 0 at the centre of every domain of the box: 0 points; check the box and the function");
}

// what reshaped domains cannot do
void check_reshape(Deck& d, const Model& m, const Body& b)
{
  if (b.reshape == 0.0 || b.material < 0) return;
  const Material& a = m.material[b.material];
  const auto refuse_it = [&](const std::string& why) {
    fault(d, "MATERIAL POINTS", b.deck_line, "RESHAPE", "body " + b.name + ", RESHAPE: " + why);
  };
  const int i = static_cast<int>(&b - m.body.data());
  if (!law_flows(a.law))
    refuse_it("material " + a.name + " does not flow; its strain is lost with the shape; write *PLASTIC or "
              "*DRUCKER PRAGER, or leave RESHAPE out");
  if (std::any_of(m.initial_stress.begin(), m.initial_stress.end(),
                  [&](const InitialStress& s) { return s.body == i; }))
    refuse_it("not with *INITIAL CONDITIONS, TYPE=STRESS");
  if (model_general_contact(m) >= 0 ||
      std::any_of(m.surface.begin(), m.surface.end(), [&](const Surface& s) { return s.body == i; }))
    refuse_it("reshaped domains leave gaps, so the body has no surface for *CONTACT, *BOND or loads");
  if (comm_size() > 1) refuse_it("runs on one rank");
}

// friction along a plane of the grid                                                             (6.48)
void check_grid_friction(Deck& d, const Model& m)
{
  for (const GridBc& b : m.grid_bc) {
    if (b.friction == 0.0) continue;
    const auto refuse_it = [&](const std::string& why) {
      fault(d, "GRID BOUNDARY", b.deck_line, "FRICTION", "FRICTION: " + why);
    };
    if (b.first != b.axis || b.last != b.axis)
      refuse_it("the plane is fixed along another direction than across; write that direction alone");
    if (b.side == 0)
      refuse_it("write an end of the grid, XMIN to ZMAX: between its ends both sides may press");
    if (std::any_of(m.step.begin(), m.step.end(), [](const Step& s) { return !s.explicit_steps(); }))
      refuse_it("in steps with *DYNAMIC, EXPLICIT only");
  }
}

// warns of overlapping boxes of points, which would double the material
void check_overlap(Deck& d, const Model& m)
{
  for (std::size_t k = 1; k < m.body.size(); ++k)
    for (std::size_t l = 0; l < k; ++l) {
      const Body &a = m.body[k], &b = m.body[l];
      if (a.fill != FILL_BLOCK || b.fill != FILL_BLOCK) continue;
      bool separate = false;
      for (int i = 0; i < m.dim; ++i)
        separate = separate || std::min(a.hi[i], b.hi[i]) - std::max(a.lo[i], b.lo[i]) <= 1e-6 * m.grid.h[i];
      if (!separate)
        warn(d, "MATERIAL POINTS", a.deck_line, a.name,
             "the boxes of " + a.name + " and " + b.name +
                 " overlap: the material is doubled there, "
                 "with twice the mass and stiffness; is this intended?");
    }
}

void check_bodies(Deck& d, const Model& m)
{
  for (const Body& b : m.body) {
    if (!m.grid.given) {
      fault(d, "GRID", b.deck_line, b.name,
            "material points need a grid; write *GRID with the box and the size of a cell");
      continue;
    }
    if (b.lo[0] > b.hi[0] || m.grid.h[0] <= 0.0) continue;
    check_body_box(d, m, b);
    check_reshape(d, m, b);
    if (b.fill == FILL_BLOCK || b.fill == FILL_REGION) check_fill(d, m, b);
  }
  if (m.grid.given) check_overlap(d, m);
  if (!m.grid.ghost_place.file.empty() && !m.grid.given)
    fault(d, "GHOST", m.grid.ghost_place, "GHOST",
          "there is no grid to stabilise; write *GRID with the box and the size of a cell, or leave *GHOST "
          "out");
  if (m.grid.given && m.body.empty())
    warn(d, "GRID", m.grid.deck_line, "GRID", "there is a grid, but no *MATERIAL POINTS; it has no effect");
}

// Features that are not available in explicit steps
void check_explicit(Deck& d, const Model& m)
{
  const auto is    = [](const Step& s) { return s.explicit_steps(); };
  const auto first = std::find_if(m.step.begin(), m.step.end(), is);
  if (first == m.step.end()) return;
  const std::string line = text_format("the step of line %d is *DYNAMIC, EXPLICIT", first->deck_line.line);
  for (const Section& s : m.section)
    if (s.elset >= 0 && !s.lumped)
      fault(d, "SOLID SECTION", s.deck_line, "CONSISTENT",
            line + ", which requires lumped masses; leave out MASS=CONSISTENT");
  const bool points = !m.body.empty() || !m.conversion.empty();
  for (const Material& a : m.material)
    if (a.used && a.alpha > 0.0 && points)
      fault(d, "DAMPING", a.deck_line, a.name,
            line + ": ALPHA is not available with material points; use BETA, or an implicit step");
  for (const ViscousBoundary& v : m.viscous)
    if (points)
      fault(d, "VISCOUS BOUNDARY", v.deck_line, "",
            line + ": viscous boundaries are not available with material points; use an implicit step");
  if (m.grid.ghost_stiffness > 0.0 || m.grid.ghost_mass > 0.0)
    fault(d, "GHOST", m.grid.ghost_place, "GHOST", line + ", which has no *GHOST; leave it out");
  for (const ConversionDef& c : m.conversion)
    if (c.bonded)
      fault(d, "CONVERSION", c.deck_line, "BONDS",
            line + ": new bonds would reduce the stable increment during the step; leave INTERFACE=BONDS "
                   "out");
  for (const BondDef& b : m.bond)
    if (b.augment > 0)
      fault(d, bond_word(b), b.deck_line, b.name,
            line + ", which does not augment contact or bonds; leave out AUGMENT");
}

// AUGMENT of bonds acts in static steps
void check_augment(Deck& d, const Model& m)
{
  const bool dynamic = std::any_of(m.step.begin(), m.step.end(),
                                   [](const Step& s) {
                                     return s.proc == PROC_DYNAMIC && !s.explicit_steps();
                                   });
  for (const BondDef& b : m.bond)
    if (b.augment > 0 && b.kind != BOND_CONTACT && dynamic)
      warn(d, bond_word(b), b.deck_line, b.name,
           "bond " + b.name + ": AUGMENT acts in static steps only; in dynamic ones its multipliers stay as "
                              "they are");
}

// *DAMPING and *VISCOUS BOUNDARY act in dynamic steps only; a face belongs to one viscous boundary
void check_damping(Deck& d, const Model& m, const IntVec& body)
{
  const bool dynamic = std::any_of(m.step.begin(), m.step.end(),
                                   [](const Step& s) { return s.proc == PROC_DYNAMIC; });
  for (const Material& a : m.material)
    if (a.used && a.has_damping && !dynamic && !m.step.empty())
      warn(d, "DAMPING", a.deck_line, a.name,
           "material " + a.name + " has a *DAMPING, which has no effect: no step is *DYNAMIC");
  std::set<std::pair<int, int>> damped;
  for (const ViscousBoundary& v : m.viscous) {
    if (v.surface < 0) continue;
    const Surface& s = m.surface[v.surface];
    if (!dynamic && !m.step.empty())
      warn(d, "VISCOUS BOUNDARY", v.deck_line, s.name,
           "viscous boundary " + s.name + " has no effect: no step is *DYNAMIC");
    for (const ViscousBoundary* w = m.viscous.data(); w != &v; ++w)
      if (w->surface == v.surface && s.body >= 0)
        fault(d, "VISCOUS BOUNDARY", v.deck_line, s.name,
              "surface " + s.name + " is a viscous boundary already");
    for (const Face& f : s.face) {
      const std::string face = text_format("face S%d of element %d", f.face + 1, m.mesh.elem_label[f.elem]);
      if (body[f.elem] >= 0)
        fault(d, "VISCOUS BOUNDARY", v.deck_line, s.name,
              text_format("element %d of surface ", m.mesh.elem_label[f.elem]) + s.name +
                  " becomes material points; use *SURFACE, TYPE=BODY, BODY=" + m.body[body[f.elem]].name);
      else if (!damped.insert({f.elem, f.face}).second)
        fault(d, "VISCOUS BOUNDARY", v.deck_line, s.name,
              face + " of surface " + s.name + " is on a viscous boundary already");
      else continue;
      break;
    }
  }
}

// elements that become points have no faces for bonds
void check_bond_faces(Deck& d, const Model& m, const BondDef& bond, const IntVec& body)
{
  for (int s : {bond.surface, bond.contact.master}) {
    if (s < 0) continue;
    for (const Face& f : m.surface[s].face) {
      if (body[f.elem] < 0) continue;
      const std::string& name = m.surface[s].name;
      fault(d, bond_word(bond), bond.deck_line, name,
            text_format("element %d of surface ", m.mesh.elem_label[f.elem]) + name +
                " becomes material points; use *SURFACE, TYPE=BODY, BODY=" + m.body[body[f.elem]].name +
                (bond.kind == BOND_CONTACT ? "" : " (bonds to the ground)") +
                " or the surface of the elements that stay");
      break;
    }
  }
}

// contact needs outer faces; a face must not be on both sides
void check_contact_faces(Deck& d, const Model& m, const BondDef& bond)
{
  const int master = bond.contact.master;
  if (bond.kind != BOND_CONTACT || bond.surface < 0 || master < 0 || bond.surface == master) return;
  const auto key = [](const Face& f) { return std::make_pair(f.elem, f.face); };
  std::set<std::pair<int, int>> outer, slave;
  for (const Face& f : mesh_free_faces(d, m)) outer.insert(key(f));
  for (const Face& f : m.surface[bond.surface].face) slave.insert(key(f));
  for (const Face& f : m.surface[bond.contact.master].face) {
    if (!slave.count(key(f))) continue;
    fault(d, "CONTACT PAIR", bond.deck_line, bond.name,
          text_format("face S%d of element %d belongs to both surfaces, ", f.face + 1,
                      m.mesh.elem_label[f.elem]) +
              m.surface[bond.surface].name + " and " + m.surface[bond.contact.master].name +
              "; it cannot be in contact with itself");
    break;
  }
  for (int s : {bond.surface, bond.contact.master})
    for (const Face& f : m.surface[s].face) {
      if (outer.count(key(f))) continue;
      fault(d, "CONTACT PAIR", bond.deck_line, bond.name,
            text_format("face S%d of element %d in surface ", f.face + 1, m.mesh.elem_label[f.elem]) +
                m.surface[s].name +
                " lies inside the mesh, between two elements; contact needs outer faces (*SURFACE, ELSET=... "
                "finds them)");
      break;
    }
}

void check_bond_distance(Deck& d, const Model& m, const BondDef& bond)
{
  if (bond.kind != BOND_MESH_GRID || bond.surface < 0 || bond.body < 0 || !m.grid.given) return;
  BoundingBox s;
  for (const Face& f : m.surface[bond.surface].face) {
    const ShapeInfo& info = shape_info[elem_table[m.mesh.elem_type[f.elem]].shape];
    for (int a = 0; a < info.nfnode[f.face]; ++a)
      box_take(s, deck_node_X(m, m.mesh.conn.begin(f.elem)[info.face[f.face][a]]));
  }
  const BoundingBox b = body_box(m, m.body[bond.body]);
  for (int i = 0; i < m.dim; ++i) {
    const double gap = std::max(s.lo[i] - b.hi[i], b.lo[i] - s.hi[i]);
    if (s.lo[i] > s.hi[i] || b.lo[i] > b.hi[i] || gap <= m.grid.h[i]) continue;
    return warn(d, "BOND", bond.deck_line, m.surface[bond.surface].name,
                "surface " + m.surface[bond.surface].name + " is " + text_number(gap) + in_axis[i] +
                    " away from body " + m.body[bond.body].name +
                    ", more than a cell of the grid; is it the right surface?");
  }
}

void check_times(Deck& d, const Model& m)
{
  double end = 0.0;
  for (const Step& s : m.step) end += s.period;
  for (const Check& c : m.output.check)
    if (!m.step.empty() && c.at == AT_TIME && c.time > end * (1.0 + 1e-9))
      fault(d, "CHECK", c.deck_line, "",
            "TIME = " + text_number(c.time) + " is never reached; the run ends at " + text_number(end));
}

// missing or inconsistent data; checked only after reading without errors, to avoid secondary messages
void check_missing(Deck& d, const Model& m, const IntVec& body)
{
  if (m.mesh.nelem() == 0 && m.body.empty())
    fault(d, "ELEMENT", last_line(d), "",
          "the deck has neither elements nor material points; write *ELEMENT, *BLOCK or *MATERIAL POINTS");
  const IntVec removed = deck_removed_elements(m);
  if (!removed.empty() && m.body.empty() && std::count(removed.begin(), removed.end(), 0) == 0)
    fault(d, "MODEL CHANGE", m.broken.front().deck_line, "",
          "all elements are removed; nothing is left to solve");
  if (m.step.empty())
    fault(d, "STEP", last_line(d), "", "the deck has no step; write *STEP, *STATIC or *DYNAMIC, *END STEP");
  deck_check_sets(d, m);
  deck_check_sections(d, m, body);
  check_materials(d, m);
  check_law_elements(d, m);
  deck_check_lumped(d, m);
  check_locking(d, m);
  check_initial(d, m);
  check_fragments(d, m);
  check_bodies(d, m);
  check_grid_friction(d, m);
  check_damping(d, m, body);
  check_explicit(d, m);
  check_augment(d, m);
  for (const BondDef& b : m.bond) check_bond_distance(d, m, b);
}

}  // namespace

// ---------------------------------------------------------------------------
// deck_check : checks of the whole model
// ---------------------------------------------------------------------------
void deck_check(Deck& d, Model& m)
{
  const bool read_well = d.messages.errors == 0;
  deck_check_elements(d, m);
  const IntVec body = deck_body_of_elements(d, m);
  if (read_well) check_missing(d, m, body);
  if (read_well) deck_changes(d, m, body);
  deck_check_steps(d, m, body, read_well);
  check_equations(d, m);
  for (const BondDef& b : m.bond) {
    check_bond_faces(d, m, b, body);
    // otherwise faces next to elements that become points are outer faces too
    if (m.body.empty()) check_contact_faces(d, m, b);
  }
  check_times(d, m);
}
