// Checks of the whole model after reading. Each message gives line, error and remedy.

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "deck/deck_state.h"

namespace {

struct Box { double lo[3], hi[3]; };

const char* const in_axis[3] = {" in x", " in y", " in z"};

Box empty_box()
{
  const double big = std::numeric_limits<double>::max();
  return Box{{big, big, big}, {-big, -big, -big}};
}

void grow(Box& b, const double* x)
{
  for (int i = 0; i < 3; ++i) {
    b.lo[i] = std::min(b.lo[i], x[i]);
    b.hi[i] = std::max(b.hi[i], x[i]);
  }
}

const double* node_X(const Model& m, int n) { return &m.mesh.X[3 * static_cast<std::size_t>(n)]; }

void grow_by_element(Box& b, const Model& m, int e)
{
  for (int a = 0; a < m.mesh.conn.count(e); ++a) grow(b, node_X(m, m.mesh.conn.begin(e)[a]));
}

Box body_box(const Model& m, const Body& body)
{
  if (body.fill != FILL_ELSET)
    return Box{{body.lo[0], body.lo[1], body.lo[2]}, {body.hi[0], body.hi[1], body.hi[2]}};
  Box b = empty_box();
  if (body.elset >= 0)
    for (int e : m.elset[body.elset].item) grow_by_element(b, m, e);
  return b;
}

DeckLine element_line(const Deck& d, int e)
{
  DeckLine p;
  p.file = d.file[d.labels.elem_spot[e].file].path;
  p.line = d.labels.elem_spot[e].line;
  return p;
}

DeckLine last_line(const Deck& d)
{
  DeckLine p;
  p.file = d.file[0].path;
  p.line = std::max<int>(1, static_cast<int>(d.file[0].start.size()));
  return p;
}

const char* bond_word(const BondDef& bond) { return bond.kind == BOND_CONTACT ? "CONTACT PAIR" : "BOND"; }

// ---- mesh -----------------------------------------------------------------

// corner a of an element: twice the signed area, or six times the signed volume, spanned by its edges
double corner(const Model& m, Shape shape, const int* node, int a)
{
  const int dim = shape_info[shape].dim, *to = shape_info[shape].edge[a];
  double r[3][3];
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) r[j][i] = node_X(m, node[to[j]])[i] - node_X(m, node[a])[i];
  const double z = r[0][0] * r[1][1] - r[0][1] * r[1][0];
  if (dim == 2) return z;
  return (r[0][1] * r[1][2] - r[0][2] * r[1][1]) * r[2][0] +
         (r[0][2] * r[1][0] - r[0][0] * r[1][2]) * r[2][1] + z * r[2][2];
}

// node labels in the reversed order
std::string reversed_nodes(const Model& m, Shape shape, const int* node)
{
  std::string text;
  for (int a = 0; a < shape_info[shape].nen; ++a)
    text += text_format(" %d", m.mesh.node_label[node[shape_info[shape].mirror[a]]]);
  return text;
}

// keyword that created an element
const char* keyword_of(const Deck& d, int e)
{
  const Spot& spot       = d.labels.elem_spot[e];
  const std::string line = text_upper(deck_line_text(d, spot.file, spot.line));
  return line.find("*BLOCK") != std::string::npos      ? "BLOCK"
         : line.find("*CYLINDER") != std::string::npos ? "CYLINDER"
                                                       : "ELEMENT";
}

// midside nodes of a quadratic element must lie near the middle of their edges
void check_middles(Deck& d, const Model& m, int e)
{
  const Shape shape = elem_table[m.mesh.elem_type[e]].shape;
  const int* node   = m.mesh.conn.begin(e);
  for (int a = shape_info[shape_info[shape].linear].nen; a < shape_info[shape].nen; ++a) {
    int end[2];
    shape_edge(shape, a, end);
    const double *x = node_X(m, node[end[0]]), *y = node_X(m, node[end[1]]),
                 *z = node_X(m, node[a]);
    double off = 0.0, length = 0.0;
    for (int i = 0; i < m.dim; ++i) {
      off    = std::hypot(off, z[i] - 0.5 * (x[i] + y[i]));
      length = std::hypot(length, y[i] - x[i]);
    }
    if (off <= 0.4 * length) continue;
    const auto label = [&](int k) { return m.mesh.node_label[node[k]]; };
    return fault(d, "ELEMENT", element_line(d, e), "",
                 text_format("node %d of element %d must lie near the middle of its edge from node %d to "
                             "node %d, but is ",
                             label(a), m.mesh.elem_label[e], label(end[0]), label(end[1])) +
                     text_number(off) + " away; check the order of the nodes (*ELEMENT)");
  }
}

// Checks an element by its corners; quadratic ones are also checked at the Gauss points (elem_setup)
void check_element(Deck& d, const Model& m, int e)
{
  const int* node = m.mesh.conn.begin(e);
  const int label = m.mesh.elem_label[e];
  const bool quadratic = elem_quadratic(m.mesh.elem_type[e]);
  const Shape shape = shape_info[elem_table[m.mesh.elem_type[e]].shape].linear;
  const int n = shape_info[shape].nen;
  const int dim = shape_info[shape].dim;
  Box b = empty_box();
  grow_by_element(b, m, e);
  const double size = (b.hi[0] - b.lo[0]) + (b.hi[1] - b.lo[1]) + (b.hi[2] - b.lo[2]),
               zero = 1e-12 * std::pow(size, dim);
  int positive = 0, negative = 0, worst = 0;
  for (int a = 0; a < n; ++a) {
    const double part = corner(m, shape, node, a);
    if (part > zero) ++positive;
    else worst = a;
    if (part < -zero) ++negative;
  }
  if (quadratic && negative < n && positive + negative > 0) return check_middles(d, m, e);
  if (positive == n) return;
  std::string text;
  if (negative == n) {
    text = text_format(dim == 3 ? "element %d is inside out; write its nodes in this order:"
                                : "the nodes of element %d run clockwise; write them counter-clockwise:",
                       label) +
           reversed_nodes(m, shape, node) + (quadratic ? " (corners), midside nodes accordingly" : "") +
           (dim == 2 && std::string(keyword_of(d, e)) == "ELEMENT"
                ? ". In gmsh ReverseMesh Surface {n}; turns the elements of surface n, tools/msh2inp all"
                : "");
  } else if (positive + negative == 0) {
    text = text_format(dim == 3 ? "element %d has no volume; its nodes are coplanar or coincide"
                                : "element %d has no area; its nodes are collinear or coincide",
                       label);
  } else if (dim == 3) {
    text = text_format("element %d is folded at node %d: its edges there span no positive volume; check the "
                       "order of the nodes",
                       label, m.mesh.node_label[node[worst]]);
  } else {
    text = text_format(
        "element %d is not convex at node %d: the angle is 180 degrees or more; check the order of the nodes",
        label, m.mesh.node_label[node[worst]]);
  }
  fault(d, keyword_of(d, e), element_line(d, e), "", text);
}

}  // namespace

void deck_check_element(Deck& d, const Model& m, int e) { check_element(d, m, e); }

namespace {

void check_elements(Deck& d, const Model& m)
{
  const int limit = d.messages.errors + 100;
  for (int e = 0; e < m.mesh.nelem() && d.messages.errors < limit; ++e) check_element(d, m, e);
}

void check_sets(Deck& d, const Model& m)
{
  for (const Set& s : m.nset)
    if (s.item.empty())
      fault(d, "NSET", s.deck_line, s.name, "node set " + s.name + " is empty; give it nodes or remove it");
  for (const Set& s : m.elset)
    if (s.item.empty())
      fault(d, "ELSET", s.deck_line, s.name,
            "element set " + s.name + " is empty; give it elements or remove it");
  for (const Surface& s : m.surface)
    if (s.face.empty() && s.body < 0)
      fault(d, "SURFACE", s.deck_line, s.name, "surface " + s.name + " is empty; give it faces or remove it");
}

std::string quadratic_text(const Model& m, int e)
{
  return std::string("quadratic elements (") + elem_table[m.mesh.elem_type[e]].name +
         text_format(", element %d)", m.mesh.elem_label[e]);
}

int first_quadratic(const Model& m, const IntVec& elem)
{
  for (int e : elem)
    if (elem_quadratic(m.mesh.elem_type[e])) return e;
  return -1;
}

// Quadratic elements cannot have a lumped mass
void check_quadratic(Deck& d, const Model& m)
{
  for (const Section& s : m.section) {
    const int e = s.lumped && s.elset >= 0 ? first_quadratic(m, m.elset[s.elset].item) : -1;
    if (e >= 0)
      fault(d, "SOLID SECTION", s.deck_line, "LUMPED",
            quadratic_text(m, e) + " have no lumped mass: row sums are negative at corner nodes; "
                                   "leave out MASS=LUMPED");
  }
}

// body of each element that becomes points, -1: remains an element
IntVec body_of_elements(Deck& d, const Model& m)
{
  IntVec body(m.mesh.nelem(), -1);
  for (std::size_t b = 0; b < m.body.size(); ++b) {
    if (m.body[b].elset < 0) continue;
    bool shared = false, section = false;
    for (int e : m.elset[m.body[b].elset].item) {
      shared  = shared || body[e] >= 0;
      section = section || m.mesh.elem_section[e] >= 0;
      body[e] = static_cast<int>(b);
    }
    const std::string word = m.elset[m.body[b].elset].name;
    if (section)
      fault(d, "MATERIAL POINTS", m.body[b].deck_line, word,
            "elements of " + word +
                " have a *SOLID SECTION; they become material points and must not have one");
    if (shared)
      fault(d, "MATERIAL POINTS", m.body[b].deck_line, word,
            "elements of " + word + " belong to another body as well; an element fills one body");
  }
  return body;
}

void check_sections(Deck& d, const Model& m, const IntVec& body)
{
  int missing = 0, first = -1;
  for (int e = 0; e < m.mesh.nelem(); ++e) {
    if (m.mesh.elem_section[e] >= 0 || body[e] >= 0) continue;
    if (missing++ == 0) first = e;
  }
  if (missing == 0) return;
  fault(d, "SOLID SECTION", element_line(d, first), "",
        text_format("%d elements have no *SOLID SECTION, the first is element %d; write *SOLID SECTION, "
                    "ELSET=..., MATERIAL=...",
                    missing, m.mesh.elem_label[first]));
}

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

// ---- material points ------------------------------------------------------

void check_body_box(Deck& d, const Model& m, const Body& body)
{
  const Grid& g = m.grid;
  const Box b = body_box(m, body);
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
  Box s = empty_box();
  for (const Face& f : m.surface[bond.surface].face) {
    const ShapeInfo& info = shape_info[elem_table[m.mesh.elem_type[f.elem]].shape];
    for (int a = 0; a < info.nfnode[f.face]; ++a)
      grow(s, node_X(m, m.mesh.conn.begin(f.elem)[info.face[f.face][a]]));
  }
  const Box b = body_box(m, m.body[bond.body]);
  for (int i = 0; i < m.dim; ++i) {
    const double gap = std::max(s.lo[i] - b.hi[i], b.lo[i] - s.hi[i]);
    if (s.lo[i] > s.hi[i] || b.lo[i] > b.hi[i] || gap <= m.grid.h[i]) continue;
    return warn(d, "BOND", bond.deck_line, m.surface[bond.surface].name,
                "surface " + m.surface[bond.surface].name + " is " + text_number(gap) + in_axis[i] +
                    " away from body " + m.body[bond.body].name +
                    ", more than a cell of the grid; is it the right surface?");
  }
}

// ---- steps ----------------------------------------------------------------

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

// [nelem] 1: *MODEL CHANGE, REMOVE
IntVec removed_elements(const Model& m)
{
  IntVec removed(m.mesh.nelem(), 0);
  for (const BrokenDef& b : m.broken)
    for (int e : b.elem) removed[e] = removed[e] || b.remove;
  return removed;
}

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

//   in   read_well   nodes that lines with errors would give an element are no further errors
void check_steps(Deck& d, const Model& m, const IntVec& body, bool read_well)
{
  const IntVec removed = removed_elements(m);
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
  const IntVec removed = removed_elements(m);
  if (!removed.empty() && m.body.empty() && std::count(removed.begin(), removed.end(), 0) == 0)
    fault(d, "MODEL CHANGE", m.broken.front().deck_line, "",
          "all elements are removed; nothing is left to solve");
  if (m.step.empty())
    fault(d, "STEP", last_line(d), "", "the deck has no step; write *STEP, *STATIC or *DYNAMIC, *END STEP");
  check_sets(d, m);
  check_sections(d, m, body);
  check_materials(d, m);
  check_law_elements(d, m);
  check_quadratic(d, m);
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
  check_elements(d, m);
  const IntVec body = body_of_elements(d, m);
  if (read_well) check_missing(d, m, body);
  if (read_well) deck_changes(d, m, body);
  check_steps(d, m, body, read_well);
  check_equations(d, m);
  for (const BondDef& b : m.bond) {
    check_bond_faces(d, m, b, body);
    // otherwise faces next to elements that become points are outer faces too
    if (m.body.empty()) check_contact_faces(d, m, b);
  }
  check_times(d, m);
}
