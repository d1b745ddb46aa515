// Checks of mesh, sets and sections
#include <algorithm>
#include <cmath>

#include "deck/deck_check.h"

namespace {

DeckLine element_line(const Deck& d, int e)
{
  DeckLine p;
  p.file = d.file[d.labels.elem_spot[e].file].path;
  p.line = d.labels.elem_spot[e].line;
  return p;
}

// corner a of an element: twice the signed area, or six times the signed volume, spanned by its edges
double corner(const Model& m, Shape shape, const int* node, int a)
{
  const int dim = shape_info[shape].dim, *to = shape_info[shape].edge[a];
  double r[3][3];
  for (int j = 0; j < 3; ++j)
    for (int i = 0; i < 3; ++i) r[j][i] = deck_node_X(m, node[to[j]])[i] - deck_node_X(m, node[a])[i];
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
    const double *x = deck_node_X(m, node[end[0]]), *y = deck_node_X(m, node[end[1]]),
                 *z = deck_node_X(m, node[a]);
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
}  // namespace

void deck_box_element(BoundingBox& b, const Mesh& mesh, int e)
{
  for (int a = 0; a < mesh.conn.count(e); ++a)
    box_take(b, &mesh.X[3 * static_cast<std::size_t>(mesh.conn.begin(e)[a])]);
}

// Checks an element by its corners; quadratic ones are also checked at the Gauss points (elem_setup)
void deck_check_element(Deck& d, const Model& m, int e)
{
  const int* node = m.mesh.conn.begin(e);
  const int label = m.mesh.elem_label[e];
  const bool quadratic = elem_quadratic(m.mesh.elem_type[e]);
  const Shape shape = shape_info[elem_table[m.mesh.elem_type[e]].shape].linear;
  const int n = shape_info[shape].nen;
  const int dim = shape_info[shape].dim;
  BoundingBox b;
  deck_box_element(b, m.mesh, e);
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

void deck_check_elements(Deck& d, const Model& m)
{
  const int limit = d.messages.errors + 100;
  for (int e = 0; e < m.mesh.nelem() && d.messages.errors < limit; ++e) deck_check_element(d, m, e);
}

void deck_check_sets(Deck& d, const Model& m)
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

// Quadratic elements cannot have a lumped mass
void deck_check_lumped(Deck& d, const Model& m)
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
IntVec deck_body_of_elements(Deck& d, const Model& m)
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

void deck_check_sections(Deck& d, const Model& m, const IntVec& body)
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
