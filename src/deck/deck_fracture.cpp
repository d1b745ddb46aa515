#include <algorithm>
#include <array>
#include <cmath>

#include "deck/deck_state.h"

namespace {

void refuse(Deck& d, const char* keyword, const DeckLine& deck_line, const std::string& word,
            const std::string& text)
{
  d.word = keyword;
  deck_error(d, deck_field(d, deck_line, word), text);
}

// an element belongs to at most one definition
template <class Def>
void check_once(Deck& d, const Model& m, const std::vector<Def>& defs, const char* keyword)
{
  IntVec owner(m.mesh.nelem(), -1);
  for (std::size_t i = 0; i < defs.size(); ++i) {
    if (defs[i].elset < 0) continue;
    for (int e : m.elset[defs[i].elset].item) {
      if (owner[e] >= 0) {
        refuse(d, keyword, defs[i].deck_line, m.elset[defs[i].elset].name,
               text_format("element %d is in *%s of line %d already; sets must not overlap",
                           m.mesh.elem_label[e], keyword, defs[owner[e]].deck_line.line));
        break;
      }
      owner[e] = static_cast<int>(i);
    }
  }
}

// sets must contain finite elements, not elements that are points from the start
template <class Def>
void check_elements(Deck& d, const Model& m, const std::vector<Def>& defs, const char* keyword)
{
  for (const Def& f : defs) {
    if (f.elset < 0) continue;
    for (int e : m.elset[f.elset].item)
      if (m.mesh.elem_section[e] < 0) {
        refuse(d, keyword, f.deck_line, m.elset[f.elset].name,
               text_format("element %d has no *SOLID SECTION; only finite elements can break or become "
                           "points during the run",
                           m.mesh.elem_label[e]));
        break;
      }
  }
}

// [nelem] 1: of an *EIGENFRACTURE
IntVec breakable_elements(const Model& m)
{
  IntVec breakable(m.mesh.nelem(), 0);
  for (const FractureDef& f : m.fracture)
    if (f.elset >= 0)
      for (int e : m.elset[f.elset].item) breakable[e] = 1;
  return breakable;
}

void check_broken(Deck& d, const Model& m)
{
  const IntVec breakable = breakable_elements(m);
  for (const BrokenDef& b : m.broken)
    for (int e : b.elem) {
      if (b.remove || breakable[e]) continue;
      refuse(d, "INITIAL CONDITIONS", b.deck_line, "",
             text_format("element %d is broken at the start, but belongs to no *EIGENFRACTURE, which "
                         "defines its residual stress; add it to the set of one",
                         m.mesh.elem_label[e]));
      break;
    }
}

// configurational forces are valid in equilibrium only
void check_estimate(Deck& d, const Model& m)
{
  for (const FractureDef& f : m.fracture)
    for (const Step& s : m.step) {
      if (f.estimate != ESTIMATE_FORCE || s.proc != PROC_DYNAMIC) continue;
      refuse(
          d, "EIGENFRACTURE", f.deck_line, "FORCE",
          text_format(
              "ESTIMATE=FORCE is valid in static steps only, the step of line %d is dynamic; leave it out: "
              "AUTO, the default, uses FORCE in static steps and BALL in dynamic ones",
              s.deck_line.line));
      break;
    }
}

// largest distance between two nodes of an element
double diameter(const Mesh& mesh, int e)
{
  double largest = 0.0;
  for (int a = 0; a < mesh.conn.count(e); ++a)
    for (int b = 0; b < a; ++b) {
      const double *x = &mesh.X[3 * mesh.conn.begin(e)[a]], *y = &mesh.X[3 * mesh.conn.begin(e)[b]];
      largest = std::max(largest, std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]));
    }
  return largest;
}

// largest element that can follow the softening: E over its steepest slope               (2.34)
double max_elem_size(const FractureDef& f, double young)
{
  const double part[] = {2.0, 1.2, 1.0};             // linear, bilinear, exponential
  return part[f.softening] * young * f.gc / (f.ft * f.ft);
}

// uniaxial tensile strength of a Drucker-Prager material                                         (2.37)
double tensile_strength(const Material& a)
{
  return cone_tension(a, *std::max_element(a.yield.begin(), a.yield.end()));
}

// COHESIVE: what a material that cracks must not have; empty: nothing
std::string material_fault(const FractureDef& f, const Material& mat)
{
  if (mat.law != LAW_SVK && mat.law != LAW_DRUCKER_PRAGER)
    return std::string("CRITERION=COHESIVE requires isotropic *ELASTIC, alone or with *DRUCKER PRAGER; ") +
           (mat.law == LAW_J2      ? "leave out *PLASTIC of "
            : mat.law == LAW_ORTHO ? "leave out TYPE=ENGINEERING CONSTANTS of "
                                   : "write *ELASTIC instead of *HYPERELASTIC in ") + mat.name;
  if (mat.law != LAW_DRUCKER_PRAGER || mat.yield.empty()) return "";
  const double strength = tensile_strength(mat);
  if (f.ft >= strength)
    return "in tension " + mat.name + " yields at " + text_number(strength) +
           ", below ft = " + text_number(f.ft) +
           ", and cannot crack; lower ft, or raise *DRUCKER PRAGER HARDENING";
  if (f.residual != SPLIT_CRACK)
    return "a crack in " + mat.name + " with *DRUCKER PRAGER keeps the law of this material; leave out "
           "RESIDUAL";
  return "";
}

// COHESIVE: empty if what has this size follows the softening
//   in   each, mend   words for such things, and how to make them smaller
std::string size_fault(const FractureDef& f, const Material& mat, double size, const char* each,
                       const char* mend)
{
  const double limit = max_elem_size(f, mat.young);
  if (size <= limit) return "";
  return "its size " + text_number(size) + " is too large for the softening, which needs " +
         each + " below " + text_number(limit) + " (E Gc/ft^2 = " +
         text_number(mat.young * f.gc / (f.ft * f.ft)) + "); " + mend + ", or lower ft";
}

// why no crack of the definition can grow along a line; empty: they can
//   in   given   TRACK=YES is in the deck: in motion and in steps with RIKS too
std::string track_fault(const Model& m, const FractureDef& f, bool given)
{
  if (m.dim != 2) return "a crack grows from a tip in the plane only";
  const auto must_give = [](const Step& s) { return s.proc == PROC_DYNAMIC || s.arc.on; };
  if (!given && std::any_of(m.step.begin(), m.step.end(), must_give)) return "not by default";
  const auto other = [&](int e) {
    const int material = model_material(m, e);
    return material >= 0 && m.material[material].law != LAW_SVK;
  };
  const IntVec& elem = m.elset[f.elset].item;
  return std::any_of(elem.begin(), elem.end(), other) ? "a crack along a line requires *ELASTIC alone" : "";
}

// an element that is too large for a crack along a line, -1: none. A line that cuts a corner is 2.4 diameters
// wide, and slides against mu                                                                     (2.36c)
//   out   limit   of its diameter
int too_large_for_line(const Model& m, const FractureDef& f, double& limit)
{
  for (int e : m.elset[f.elset].item) {
    const int material = model_material(m, e);
    if (material < 0) continue;
    const Material& a = m.material[material];
    limit = max_elem_size(f, a.young) / (4.8 * (1.0 + a.poisson));
    if (diameter(m.mesh, e) > limit) return e;
  }
  return -1;
}

// TRACK: the default where it is possible
void choose_track(Deck& d, Model& m)
{
  for (FractureDef& f : m.fracture) {
    if (!f.track || f.elset < 0) continue;
    const bool given = d.tracked.count(static_cast<int>(&f - m.fracture.data())) > 0;
    const std::string fault = track_fault(m, f, given);
    if (!fault.empty()) {
      f.track = false;
      if (given) refuse(d, "EIGENFRACTURE", f.deck_line, "TRACK", "TRACK: " + fault + "; leave out TRACK");
      continue;
    }
    double limit = 0.0;
    const int e = too_large_for_line(m, f, limit);
    if (e < 0) continue;
    f.track = false;
    if (given)
      deck_warn(d, deck_field(d, f.deck_line, "TRACK"),
                text_format("TRACK: element %d is too large for cracks along lines, which need elements "
                            "smaller than %.4g: cracks grow as without TRACK, and may follow the rows of the "
                            "mesh",
                            m.mesh.elem_label[e], limit));
  }
}

// COHESIVE: needs elastic or Drucker-Prager material and elements small enough for the softening
void check_cohesive(Deck& d, const Model& m)
{
  for (const FractureDef& f : m.fracture) {
    if (f.criterion != CRITERION_COHESIVE || f.elset < 0) continue;
    for (int e : m.elset[f.elset].item) {
      const int material = model_material(m, e);
      if (material < 0) break;                       // reported by check_elements
      const Material& mat  = m.material[material];
      const ElemType& type = elem_table[m.mesh.elem_type[e]];
      std::string text = material_fault(f, mat);
      if (text.empty() && type.enhanced)
        text = std::string("CRITERION=COHESIVE needs elements without enhanced strains, not ") + type.name;
      if (text.empty()) text = size_fault(f, mat, diameter(m.mesh, e), "elements", "refine the mesh");
      if (text.empty()) continue;
      refuse(d, "EIGENFRACTURE", f.deck_line, m.elset[f.elset].name,
             text_format("element %d: ", m.mesh.elem_label[e]) + text);
      break;
    }
  }
}

// difference of the largest and the smallest of n numbers
double spread(const double* x, int n)
{
  const auto ends = std::minmax_element(x, x + n);
  return *ends.second - *ends.first;
}

// largest extent along one axis of the domains of points that an element is divided into, at least that;
// exact for parallelograms, triangles and tetrahedra
//   in   x   coordinates of its nodes along the axis
//        n   POINTS
double domain_extent(Shape shape, const double* x, int n)
{
  const auto edges = [&](std::initializer_list<std::array<int, 2>> all) {
    double largest = 0.0;
    for (const auto& edge : all) largest = std::max(largest, std::fabs(x[edge[1]] - x[edge[0]]));
    return largest;
  };
  switch (shape) {
    case SHAPE_QUAD4: return (edges({{0, 1}, {3, 2}}) + edges({{0, 3}, {1, 2}})) / n;
    case SHAPE_HEX8:
      return (edges({{0, 1}, {3, 2}, {4, 5}, {7, 6}}) + edges({{0, 3}, {1, 2}, {4, 7}, {5, 6}}) +
              edges({{0, 4}, {1, 5}, {2, 6}, {3, 7}})) / n;
    case SHAPE_TET4:           // four of the eight meet along a diagonal of the octahedron in the middle
      return n == 1 ? spread(x, 4) : 0.5 * std::max(spread(x, 4), std::fabs(x[1] + x[2] - x[0] - x[3]));
    case SHAPE_WEDGE6:         // from a corner to the centroid of its triangle
      return std::max(spread(x, 3), spread(x + 3, 3)) * 2.0 / 3.0 + edges({{0, 3}, {1, 4}, {2, 5}}) / n;
    case SHAPE_PYR5: return spread(x, 5) * (n == 1 ? 1.0 : 0.75);
    case SHAPE_TRI3: case SHAPE_TRI6: case SHAPE_QUAD8: case SHAPE_QUAD8R: case SHAPE_TET10:
    case SHAPE_WEDGE15: case SHAPE_HEX20: case SHAPE_HEX20R: case SHAPES: break;
  }
  return spread(x, shape_info[shape].nen) / n;
}

// largest diagonal of what opens as one in a body: a cell of the grid, or a larger domain of a point  (2.36a)
double box_diagonal(const Model& m, const Body& b)
{
  const auto diagonal = [&](auto domain) {
    double sum = 0.0;
    for (int i = 0; i < m.dim; ++i) {
      const double edge = std::max(m.grid.h[i], domain(i));
      sum += edge * edge;
    }
    return std::sqrt(sum);
  };
  if (b.fill != FILL_ELSET)
    return diagonal([&](int i) {
      return b.cells[i] > 0 ? (b.hi[i] - b.lo[i]) / (b.cells[i] * b.per_cell) : 0.0;
    });
  double largest = 0.0;
  for (int e : b.elset < 0 ? IntVec() : m.elset[b.elset].item)
    largest = std::max(largest, diagonal([&](int i) {
      double x[MAX_NODES];
      for (int a = 0; a < m.mesh.conn.count(e); ++a) x[a] = m.mesh.X[3 * m.mesh.conn.begin(e)[a] + i];
      return domain_extent(elem_table[m.mesh.elem_type[e]].shape, x, b.per_cell);
    }));
  return largest;
}

// BODY=: gives each body its definition
void check_bodies(Deck& d, Model& m)
{
  for (std::size_t i = 0; i < m.fracture.size(); ++i) {
    const FractureDef& f = m.fracture[i];
    if (f.body < 0) continue;
    Body& b = m.body[f.body];
    const auto fault = [&](const std::string& text) {
      refuse(d, "EIGENFRACTURE", f.deck_line, b.name, "body " + b.name + ": " + text);
    };
    if (b.fracture >= 0)
      fault(text_format("the *EIGENFRACTURE of line %d has it already",
                        m.fracture[b.fracture].deck_line.line));
    b.fracture = static_cast<int>(i);
    if (f.criterion != CRITERION_COHESIVE || b.material < 0) continue;
    if (b.reshape > 0.0) fault("RESHAPE would lose the directions of its cracks; leave it out");
    if (m.grid.ghost_stiffness > 0.0)
      fault("STIFFNESS of *GHOST would hold its cracks closed; leave it out");
    std::string text = material_fault(f, m.material[b.material]);
    if (text.empty() && m.grid.given)
      text = size_fault(f, m.material[b.material], box_diagonal(m, b), "cells and points",
                        "take smaller ones");
    if (!text.empty()) fault(text);
  }
}

void check_per_elem(Deck& d, const Model& m, const ConversionDef& c)
{
  if (c.per_elem <= 2) return;
  for (int e : m.elset[c.elset].item) {
    const Shape shape = elem_table[m.mesh.elem_type[e]].shape;
    if (shape != SHAPE_TET4 && shape != SHAPE_WEDGE6 && shape != SHAPE_PYR5) continue;
    return refuse(d, "CONVERSION", c.deck_line, "POINTS",
                  text_format("a %s points: POINTS=1 or 2, not %d",
                              shape == SHAPE_TET4   ? "tetrahedron becomes 1 or 8"
                              : shape == SHAPE_PYR5 ? "pyramid becomes 1 or 10"
                                                    : "wedge becomes 3 or 6",
                              c.per_elem));
  }
}

// TRIGGER=EROSION needs elements that can break
void check_trigger(Deck& d, const Model& m, const ConversionDef& c)
{
  if (c.trigger != TRIGGER_EROSION) return;
  const IntVec breakable = breakable_elements(m);
  for (int e : m.elset[c.elset].item)
    if (breakable[e]) return;
  refuse(d, "CONVERSION", c.deck_line, m.elset[c.elset].name,
         "no element of this set is in an *EIGENFRACTURE: none can break and become "
         "points; write one, or use TRIGGER=DISTORTION or TIME");
}

// creates the body of the converted elements of one section, empty at t = 0, and its bonds to the other
// elements
void make_body(Model& m, ConversionDef& c, int section, const IntVec& elem)
{
  Body b;
  std::string name = c.body_name;
  for (int k = 2; model_find_body(m, name) >= 0; ++k) name = c.body_name + "_" + std::to_string(k);
  b.name      = name;
  b.fill      = FILL_CONVERSION;
  b.per_cell  = c.per_elem;
  b.field     = c.field;
  b.hang      = !c.bonded;
  b.material  = m.section[section].material;
  b.plane     = elem_table[m.mesh.elem_type[elem[0]]].plane;
  b.thickness = m.section[section].thickness;
  b.deck_line     = c.deck_line;
  BoundingBox box;
  for (int e : elem) deck_box_element(box, m.mesh, e);
  for (int i = 0; i < m.dim; ++i) {
    b.lo[i] = box.lo[i];
    b.hi[i] = box.hi[i];
  }
  BondDef bond = c.bond;
  bond.kind  = BOND_MESH_GRID;
  bond.name  = name;
  bond.body  = static_cast<int>(m.body.size());
  bond.deck_line = c.deck_line;
  c.body[section]    = bond.body;
  c.bond_of[section] = static_cast<int>(m.bond.size());
  m.body.push_back(b);
  m.bond.push_back(bond);
}

// grid cells much larger than the elements would couple the two faces of a crack
void check_cells(Deck& d, const Model& m, const ConversionDef& c)
{
  if (!m.grid.given || c.elset < 0) return;
  double smallest = 1e300;
  for (int e : m.elset[c.elset].item)
    for (int a = 0; a < m.mesh.conn.count(e); ++a) {
      const int *node = m.mesh.conn.begin(e), b = (a + 1) % m.mesh.conn.count(e);
      const double *x = &m.mesh.X[3 * node[a]], *y = &m.mesh.X[3 * node[b]];
      const double length = std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]);
      if (length > 0.0) smallest = std::min(smallest, length);
    }
  double h = 0.0;
  for (int i = 0; i < m.dim; ++i) h = std::max(h, m.grid.h[i]);
  if (h > 3.0 * smallest)
    refuse(d, "CONVERSION", c.deck_line, m.elset[c.elset].name,
           "the cells of the grid (" + text_number(h) +
               ") are more than three times as large as the "
               "smallest edge of these elements (" +
               text_number(smallest) + "): the grid would couple the faces of a crack; use smaller cells");
}

void make_bodies(Deck& d, Model& m, ConversionDef& c)
{
  c.body.assign(m.section.size(), -1);
  c.bond_of.assign(m.section.size(), -1);
  if (c.elset < 0) return;
  if (model_find_body(m, c.body_name) >= 0 && c.body_name != "CONVERTED")
    return refuse(d, "CONVERSION", c.deck_line, c.body_name,
                  "body " + c.body_name + " is defined already; choose another name");
  check_per_elem(d, m, c);
  check_trigger(d, m, c);
  check_cells(d, m, c);
  for (std::size_t s = 0; s < m.section.size(); ++s) {
    IntVec elem;
    for (int e : m.elset[c.elset].item)
      if (m.mesh.elem_section[e] == static_cast<int>(s)) elem.push_back(e);
    if (!elem.empty()) make_body(m, c, static_cast<int>(s), elem);
  }
}

}  // namespace

// ---------------------------------------------------------------------------
// deck_fracture : checks *EIGENFRACTURE, *CONVERSION and pre-cracks; creates the bodies of *CONVERSION
// ---------------------------------------------------------------------------
void deck_fracture(Deck& d, Model& m)
{
  check_once(d, m, m.fracture, "EIGENFRACTURE");
  check_once(d, m, m.conversion, "CONVERSION");
  check_elements(d, m, m.fracture, "EIGENFRACTURE");
  check_elements(d, m, m.conversion, "CONVERSION");
  check_estimate(d, m);
  check_broken(d, m);
  choose_track(d, m);
  deck_joints(d, m);
  check_cohesive(d, m);
  check_bodies(d, m);
  for (ConversionDef& c : m.conversion) make_bodies(d, m, c);
}
