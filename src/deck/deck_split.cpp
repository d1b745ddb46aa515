// Quadratic elements are split into linear ones where these are needed: doc/theory.md 1.2

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "deck/deck_check.h"
#include "shape/shape.h"

namespace {

const int MAX_PARTS = 8;       // of an element  (no test)
// part of its length by which a diagonal must be shorter to be preferred  (no test)
const double SHORTER = 1e-9;
// part of the volume from which on a change of it is reported  (no test)
const double SAME_VOLUME = 1e-9;

// Parts of a quadratic element. Their nodes are its own, then those made: one at the centre of each
// quadrilateral face (made_on: its face; -1: the centre of the element)
struct Pattern {
  int made = 0;
  int made_on[7] = {-1, -1, -1, -1, -1, -1, -1};
  int parts = 0;
  int node[MAX_PARTS][MAX_CORNERS] = {};
};

// ---- patterns of the shapes

Pattern triangle_parts() { return {0, {}, 4, {{0, 3, 5}, {3, 1, 4}, {5, 4, 2}, {3, 4, 5}}}; }

Pattern quad_parts()
{
  return {1, {-1}, 4, {{0, 4, 8, 7}, {4, 1, 5, 8}, {8, 5, 2, 6}, {7, 8, 6, 3}}};
}

// the octahedron inside is cut along one of its diagonals: 4-9, 5-7, 6-8
Pattern tet_parts(int diagonal)
{
  static const int inner[3][4][4] = {{{4, 9, 5, 6}, {4, 9, 6, 7}, {4, 9, 7, 8}, {4, 9, 8, 5}},
                                     {{5, 7, 4, 8}, {5, 7, 8, 9}, {5, 7, 9, 6}, {5, 7, 6, 4}},
                                     {{6, 8, 4, 5}, {6, 8, 5, 9}, {6, 8, 9, 7}, {6, 8, 7, 4}}};
  Pattern p = {0, {}, 8, {{0, 4, 6, 7}, {4, 1, 5, 8}, {6, 5, 2, 9}, {7, 8, 9, 3}}};
  for (int k = 0; k < 4; ++k) std::copy(inner[diagonal][k], inner[diagonal][k] + 4, p.node[4 + k]);
  return p;
}

// four triangles in each of two layers; rows: nodes at corners and edges of the triangle
Pattern wedge_parts()
{
  static const int layer[3][6] = {{0, 1, 2, 6, 7, 8}, {12, 13, 14, 15, 16, 17}, {3, 4, 5, 9, 10, 11}};
  const Pattern flat = triangle_parts();
  Pattern p = {3, {2, 3, 4}, 8, {}};
  for (int k = 0; k < 8; ++k)
    for (int a = 0; a < 6; ++a) p.node[k][a] = layer[k / 4 + a / 3][flat.node[k % 4][a % 3]];
  return p;
}

// the cells of 3 x 3 x 3 nodes; rows: z, y; columns: x
Pattern brick_parts()
{
  static const int at[3][3][3] = {{{0, 8, 1}, {11, 20, 9}, {3, 10, 2}},
                                  {{16, 22, 17}, {25, 26, 23}, {19, 24, 18}},
                                  {{4, 12, 5}, {15, 21, 13}, {7, 14, 6}}};
  static const int corner[8][3] = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                                   {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};
  Pattern p = {7, {0, 1, 2, 3, 4, 5, -1}, 8, {}};
  for (int k = 0; k < 8; ++k)
    for (int a = 0; a < 8; ++a)
      p.node[k][a] = at[corner[k][2] + corner[a][2]][corner[k][1] + corner[a][1]]
                       [corner[k][0] + corner[a][0]];
  return p;
}

double distance(const Mesh& mesh, int a, int b)
{
  const double *x = &mesh.X[3 * static_cast<std::size_t>(a)], *y = &mesh.X[3 * static_cast<std::size_t>(b)];
  return std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]);
}

int shortest_diagonal(const Mesh& mesh, const int* node)
{
  const int end[3][2] = {{4, 9}, {5, 7}, {6, 8}};
  int best = 0;
  double length = distance(mesh, node[4], node[9]);
  for (int k = 1; k < 3; ++k) {
    const double other = distance(mesh, node[end[k][0]], node[end[k][1]]);
    if (other > (1.0 - SHORTER) * length) continue;
    best   = k;
    length = other;
  }
  return best;
}

Pattern pattern_of(const Mesh& mesh, int e)
{
  switch (shape_info[elem_table[mesh.elem_type[e]].shape].linear) {
    case SHAPE_TRI3: return triangle_parts();
    case SHAPE_QUAD4: return quad_parts();
    case SHAPE_TET4: return tet_parts(shortest_diagonal(mesh, mesh.conn.begin(e)));
    case SHAPE_WEDGE6: return wedge_parts();
    case SHAPE_HEX8: return brick_parts();
    case SHAPE_PYR5: case SHAPE_TRI6: case SHAPE_QUAD8: case SHAPE_QUAD8R: case SHAPE_TET10:
    case SHAPE_WEDGE15: case SHAPE_HEX20: case SHAPE_HEX20R: case SHAPES: break;
  }
  return {};
}

int linear_type(int type)
{
  const ElemType& q = elem_table[type];
  for (const ElemType& t : elem_table)
    if (t.shape == shape_info[q.shape].linear && t.plane == q.plane && !t.enhanced) return t.type;
  return -1;
}

// ---- which elements are split

struct Reason {                // keyword that needs linear elements
  const char* keyword;
  DeckLine deck_line;
  bool known = false;          // its page says that it splits
};

struct Wanted {
  std::vector<char> elem;      // [nelem] to be split
  std::vector<Reason> reason;
};

void want(const Mesh& mesh, const IntVec& list, const Reason& r, Wanted& w)
{
  bool any = false;
  for (int e : list)
    if (elem_quadratic(mesh.elem_type[e])) {
      w.elem[e] = 1;
      any       = true;
    }
  if (any) w.reason.push_back(r);
}

IntVec owners(const Surface& s)
{
  IntVec elem;
  for (const Face& f : s.face) elem.push_back(f.elem);
  return elem;
}

// elements that need to be linear; with fracture or conversion all, as its arrays hold linear ones
Wanted wanted_elements(const Model& m)
{
  const Mesh& mesh = m.mesh;
  Wanted w;
  w.elem.assign(mesh.nelem(), 0);
  IntVec all(mesh.nelem());
  for (int e = 0; e < mesh.nelem(); ++e) all[e] = e;
  for (const FractureDef& f : m.fracture) want(mesh, all, {"EIGENFRACTURE", f.deck_line, true}, w);
  for (const ConversionDef& c : m.conversion) want(mesh, all, {"CONVERSION", c.deck_line, true}, w);
  for (const Body& b : m.body)
    if (b.elset >= 0) want(mesh, m.elset[b.elset].item, {"MATERIAL POINTS", b.deck_line, true}, w);
  for (const BondDef& b : m.bond) {
    if (b.contact.general) want(mesh, all, {"CONTACT", b.deck_line}, w);
    if (b.kind == BOND_MESH_GRID && b.surface >= 0 && m.surface[b.surface].body < 0)
      want(mesh, owners(m.surface[b.surface]), {"BOND", b.deck_line}, w);
  }
  for (const Step& s : m.step)
    if (s.explicit_steps()) want(mesh, all, {"DYNAMIC", s.deck_line}, w);
  return w;
}

// nodes of a quadratic element on its edges
IntVec middles_of(const Mesh& mesh, int e)
{
  const Shape linear = shape_info[elem_table[mesh.elem_type[e]].shape].linear;
  return IntVec(mesh.conn.begin(e) + shape_info[linear].nen, mesh.conn.begin(e + 1));
}

// Quadratic elements that share an edge with a split one are split too: the displacements of the two sides
// would differ along the edge
void spread(const Mesh& mesh, std::vector<char>& elem)
{
  std::vector<char> split_edge(mesh.nnode(), 0), done(mesh.nelem(), 0);
  bool more = true;
  while (more) {
    more = false;
    for (int e = 0; e < mesh.nelem(); ++e) {
      if (done[e] || !elem_quadratic(mesh.elem_type[e])) continue;
      const IntVec middle = middles_of(mesh, e);
      if (!elem[e] && std::none_of(middle.begin(), middle.end(), [&](int n) { return split_edge[n]; }))
        continue;
      elem[e] = done[e] = 1;
      more = true;
      for (int n : middle) split_edge[n] = 1;
    }
  }
}

// ---- the new mesh

struct Made {                  // a node at the centre of a face or of an element, and the nodes around it
  int node;
  IntVec around;
  bool of_face;
};

struct SplitMesh {
  Mesh old;                    // as read
  std::vector<char> chosen;    // [elements of the deck]
  std::vector<IntVec> part;    // [elements of the deck] elements of the new mesh
  std::vector<Made> made;
  std::map<std::array<int, 4>, int> of_face;         // corners of a face -> the node at its centre
  double volume = 0.0, parts_volume = 0.0;
  int shift = 0;               // of the labels of the parts; 0: they are numbered on
};

// quadratic shape functions at the centre: -1/4 at corners; at edges 1/2 (quadrilateral), 1/4 (brick)
void centre_of(const Mesh& mesh, const IntVec& around, double x[3])
{
  const std::size_t corners = around.size() == 20 ? 8 : 4;
  const double at_edge = corners == 8 ? 0.25 : 0.5;
  for (int i = 0; i < 3; ++i) {
    x[i] = 0.0;
    for (std::size_t a = 0; a < around.size(); ++a)
      x[i] += (a < corners ? -0.25 : at_edge) * mesh.X[3 * static_cast<std::size_t>(around[a]) + i];
  }
}

Field position_of(const Spot& spot)
{
  Field at;
  at.file = spot.file;
  at.line = spot.line;
  return at;
}

// the node at the centre of face f (-1: of the element), which neighbours share
int centre_node(Deck& d, Model& m, SplitMesh& s, int e, int f, const Field& at, int& label)
{
  const ShapeInfo& info = shape_info[elem_table[s.old.elem_type[e]].shape];
  const int* node = s.old.conn.begin(e);
  Made c{-1, {}, f >= 0};
  for (int a = 0; a < (f < 0 ? info.nen : info.nfnode[f]); ++a)
    c.around.push_back(node[f < 0 ? a : info.face[f][a]]);
  std::array<int, 4> key{};
  std::copy(c.around.begin(), c.around.begin() + 4, key.begin());
  std::sort(key.begin(), key.end());
  const auto shared = s.of_face.find(key);
  if (f >= 0 && shared != s.of_face.end()) return shared->second;
  double x[3];
  centre_of(s.old, c.around, x);
  c.node = mesh_add_node(d, m, ++label, x[0], x[1], x[2], at);
  if (f >= 0) s.of_face[key] = c.node;
  s.made.push_back(c);
  return c.node;
}

// the power of ten above all labels, if those of the parts then fit into an int; else 0
int label_shift(const Mesh& mesh)
{
  const long largest = mesh_max_label(mesh.elem_label);
  long shift = 10;
  while (shift <= largest) shift *= 10;
  return MAX_PARTS * shift + largest <= 2147483647L ? static_cast<int>(shift) : 0;
}

double volume_of(const RealVec& all, int type, const int* node)
{
  const Shape shape = elem_table[type].shape;
  const ShapeInfo& info = shape_info[shape];
  const GaussRule& rule = gauss_rule_mass(shape);
  double X[3 * MAX_NODES], N[MAX_NODES], dN[3 * MAX_NODES], dNdX[3 * MAX_NODES], sum = 0.0;
  for (int a = 0; a < info.nen; ++a)
    for (int i = 0; i < info.dim; ++i) X[info.dim * a + i] = all[3 * static_cast<std::size_t>(node[a]) + i];
  for (int g = 0; g < rule.n; ++g) {
    shape_eval(shape, rule.xi[g], N, dN);
    sum += rule.w[g] * shape_jacobian(shape, dN, X, dNdX);
  }
  return sum;
}

// adds the parts of element e to the mesh
void add_parts(Deck& d, Model& m, SplitMesh& s, int e, const Field& at, int& node_label, int& elem_label)
{
  const Pattern p = pattern_of(s.old, e);
  const int type = linear_type(s.old.elem_type[e]);
  IntVec all(s.old.conn.begin(e), s.old.conn.begin(e + 1));
  for (int k = 0; k < p.made; ++k) all.push_back(centre_node(d, m, s, e, p.made_on[k], at, node_label));
  s.volume += volume_of(s.old.X, s.old.elem_type[e], all.data());
  for (int k = 0; k < p.parts; ++k) {
    int node[MAX_CORNERS];
    for (int a = 0; a < shape_info[elem_table[type].shape].nen; ++a) node[a] = all[p.node[k][a]];
    const int label = s.shift ? s.shift * (k + 1) + s.old.elem_label[e] : ++elem_label;
    s.part[e].push_back(mesh_add_elem(d, m, label, type, node, at));
    s.parts_volume += volume_of(m.mesh.X, type, node);
  }
}

// replaces the split elements in the mesh by their parts, in the same order
void rebuild(Deck& d, Model& m, SplitMesh& s)
{
  const std::vector<Spot> spot = d.labels.elem_spot;
  s.old   = m.mesh;
  s.shift = label_shift(s.old);
  s.part.resize(s.old.nelem());
  int node_label = mesh_max_label(s.old.node_label), elem_label = mesh_max_label(s.old.elem_label);
  m.mesh.elem_label.clear();
  m.mesh.elem_type.clear();
  m.mesh.elem_section.clear();
  m.mesh.conn = ListTable();
  d.labels.elem = LabelIndex();
  d.labels.elem_spot.clear();
  for (int e = 0; e < s.old.nelem(); ++e) {
    const Field at = position_of(spot[e]);
    if (s.chosen[e]) add_parts(d, m, s, e, at, node_label, elem_label);
    else s.part[e] = {mesh_add_elem(d, m, s.old.elem_label[e], s.old.elem_type[e], s.old.conn.begin(e), at)};
    if (s.chosen[e]) d.split[s.old.elem_label[e]] = s.part[e];
  }
}

// ---- all that names elements, faces and nodes of the mesh as read

void replace(const SplitMesh& s, IntVec& elem)
{
  IntVec out;
  for (int e : elem) out.insert(out.end(), s.part[e].begin(), s.part[e].end());
  elem.swap(out);
}

// the faces of the parts of an element on its face f
void faces_of_parts(const SplitMesh& s, const Face& f, std::vector<Face>& out)
{
  const int type = s.old.elem_type[f.elem];
  const ShapeInfo& whole = shape_info[elem_table[type].shape];
  const ShapeInfo& info  = shape_info[elem_table[linear_type(type)].shape];
  const Pattern p = pattern_of(s.old, f.elem);
  std::vector<char> on(whole.nen + p.made, 0);
  for (int a = 0; a < whole.nfnode[f.face]; ++a) on[whole.face[f.face][a]] = 1;
  for (int k = 0; k < p.made; ++k) on[whole.nen + k] = p.made_on[k] == f.face;
  for (int k = 0; k < p.parts; ++k)
    for (int j = 0; j < info.nface; ++j) {
      bool all = true;
      for (int a = 0; a < info.nfnode[j]; ++a) all = all && on[p.node[k][info.face[j][a]]];
      if (all) out.push_back(Face{s.part[f.elem][k], j});
    }
}

void replace(const SplitMesh& s, std::vector<Face>& face)
{
  std::vector<Face> out;
  for (const Face& f : face) {
    if (s.chosen[f.elem]) faces_of_parts(s, f, out);
    else out.push_back(Face{s.part[f.elem][0], f.face});
  }
  face.swap(out);
}

// a list with all nodes of a face, or of an element, gets the one at its centre
void extend(const Model& m, const SplitMesh& s, IntVec& node)
{
  if (s.made.empty() || node.size() < s.made[0].around.size()) return;
  std::vector<char> in(m.mesh.nnode(), 0);
  for (int n : node) in[n] = 1;
  for (const Made& c : s.made)
    if (std::all_of(c.around.begin(), c.around.end(), [&](int n) { return in[n]; })) node.push_back(c.node);
}

bool has_direction(const Prescribed& b, int i) { return b.first <= i && i <= b.last; }
bool has_direction(const InitialValue& v, int i) { return v.dof == i; }

// Values given node by node: the node at the centre has that of the nodes around it, if all have the same
template <class Value>
void extend_values(Deck& d, const Model& m, const SplitMesh& s, const char* keyword, std::vector<Value>& list)
{
  for (Value& v : list) extend(m, s, v.node);
  const std::size_t given = list.size();
  for (int i = 0; i < m.dim && !s.made.empty(); ++i) {
    IntVec of(m.mesh.nnode(), -1);                   // node -> last value
    for (std::size_t k = 0; k < given; ++k)
      for (int n : list[k].node)
        if (has_direction(list[k], i)) of[n] = static_cast<int>(k);
    for (const Made& c : s.made) {
      const int first = of[c.around[0]];
      if (of[c.node] >= 0 ||
          !std::all_of(c.around.begin(), c.around.end(), [&](int n) { return of[n] >= 0; }))
        continue;
      const bool same = std::all_of(c.around.begin(), c.around.end(),
                                    [&](int n) { return deck_same_value(list[of[n]], list[first]); });
      if (!same)
        return fault(d, keyword, list[first].deck_line, "",
                     text_format("the element or face around node %d is split, and has a node at its "
                                 "centre: give the values in direction %d as one line, by a node set "
                                 "and a function of x, y, z",
                                 m.mesh.node_label[c.around[0]], i + 1));
      Value v = list[first];
      v.node  = {c.node};
      list.push_back(v);
    }
  }
}

void replace_in_steps(Deck& d, Model& m, const SplitMesh& s)
{
  extend_values(d, m, s, "BOUNDARY", d.base);
  for (Step& step : m.step) {
    for (Load& l : step.load) {
      replace(s, l.elem);
      replace(s, l.face);
    }
    for (ModelChange& c : step.change) replace(s, c.elem);
    extend_values(d, m, s, "BOUNDARY", step.prescribed);
  }
}

void replace_all(Deck& d, Model& m, const SplitMesh& s)
{
  for (Set& set : m.elset) replace(s, set.item);
  for (Set& set : m.nset) extend(m, s, set.item);
  for (Surface& surface : m.surface)
    if (surface.body < 0) replace(s, surface.face);
  for (BrokenDef& b : m.broken) replace(s, b.elem);
  d.word = "INITIAL CONDITIONS";
  for (InitialStress& i : m.initial_stress) {
    if (i.point >= 0 && std::any_of(i.elem.begin(), i.elem.end(), [&](int e) { return s.chosen[e]; }))
      deck_error(d, deck_field(d, i.deck_line, ""),
                 text_format("element %d is split into linear ones, which have other integration points; "
                             "give one line for the whole element, or a function of x, y, z",
                             s.old.elem_label[i.elem[0]]));
    replace(s, i.elem);
  }
  extend_values(d, m, s, "INITIAL CONDITIONS", m.initial);
  replace_in_steps(d, m, s);
}

// nodes at centres have no directions of their own, and are in no equation
void check_centres(Deck& d, const Model& m, const SplitMesh& s)
{
  std::vector<const DeckLine*> line(m.mesh.nnode(), nullptr);
  const auto check = [&](const char* keyword, const char* what) {
    for (const Made& c : s.made)
      if (std::all_of(c.around.begin(), c.around.end(), [&](int n) { return line[n] != nullptr; }))
        return fault(d, keyword, *line[c.around[0]], "",
                     text_format("all nodes of a face at node %d have %s, but the face is split and has "
                                 "a node at its centre, which has none; use C3D10, CPE6 or linear "
                                 "elements there",
                                 m.mesh.node_label[c.around[0]], what));
  };
  for (const Frame& f : m.frame) line[f.node] = &f.deck_line;
  check("TRANSFORM", "local directions");
  std::fill(line.begin(), line.end(), nullptr);
  for (const Equation& e : m.equation)
    for (const EquationTerm& t : e.term)
      if (e.of == EQUATION_GIVEN) line[t.node] = &e.deck_line;
  check("EQUATION", "equations");
}

// nodes that values, also along local directions, or equations hold in direction i
std::vector<char> fixed_nodes(const Model& m, int i, const std::vector<Prescribed>& values)
{
  std::vector<char> fixed(m.mesh.nnode(), 0), turned(m.mesh.nnode(), 0);
  for (const Frame& f : m.frame) turned[f.node] = 1;
  for (const Equation& e : m.equation)
    if (e.of == EQUATION_GIVEN && e.term[0].dof == i) fixed[e.term[0].node] = 1;
  for (const Prescribed& b : values)
    for (int n : b.node)
      if (has_direction(b, i) || turned[n]) fixed[n] = 1;
  return fixed;
}

// values that act in a step: where a face has nodes fixed by different means, or in different steps, the node
// at its centre would be free
void check_means(Deck& d, const Model& m, const SplitMesh& s, const std::vector<Prescribed>& values)
{
  for (int i = 0; i < m.dim; ++i) {
    const std::vector<char> fixed = fixed_nodes(m, i, values);
    const auto free_centre = [&](const Made& c) {
      return c.of_face && !fixed[c.node] &&
             std::all_of(c.around.begin(), c.around.end(), [&](int n) { return fixed[n]; });
    };
    const auto c = std::find_if(s.made.begin(), s.made.end(), free_centre);
    if (c == s.made.end()) continue;
    const IntVec& around = c->around;
    const auto holds = [&](const Prescribed& b) {
      return std::find_first_of(b.node.begin(), b.node.end(), around.begin(), around.end()) != b.node.end();
    };
    const auto b = std::find_if(values.begin(), values.end(), holds);
    if (b == values.end()) continue;
    return fault(d, "BOUNDARY", b->deck_line, "",
                 text_format("all nodes of a face at node %d are fixed in direction %d, some by equations, "
                             "local directions or in another step, but the face is split and the node at "
                             "its centre is free; fix the face by one node set in one step, or use "
                             "C3D10, CPE6 or linear elements there",
                             m.mesh.node_label[around[0]], i + 1));
  }
}

void check_means(Deck& d, const Model& m, const SplitMesh& s)
{
  std::vector<Prescribed> acting = d.base;
  for (std::size_t k = 0; k < m.step.size() && !s.made.empty() && d.messages.errors == 0; ++k) {
    if (k < d.removes.size() && d.removes[k].boundary) acting.clear();
    acting.insert(acting.end(), m.step[k].prescribed.begin(), m.step[k].prescribed.end());
    check_means(d, m, s, acting);
  }
}

// ---- what is reported

std::string types_of(const SplitMesh& s)
{
  std::map<int, std::pair<long, long>> count;
  for (int e = 0; e < s.old.nelem(); ++e) {
    if (!s.chosen[e]) continue;
    ++count[s.old.elem_type[e]].first;
    count[s.old.elem_type[e]].second += static_cast<long>(s.part[e].size());
  }
  std::string text;
  for (const auto& c : count)
    text += text_format("%s%ld %s into %ld %s", text.empty() ? "" : ", ", c.second.first,
                        elem_table[c.first].name, c.second.second, elem_table[linear_type(c.first)].name);
  return text;
}

std::string labels_of(const SplitMesh& s)
{
  const auto first = std::find(s.chosen.begin(), s.chosen.end(), 1) - s.chosen.begin();
  const int label = s.old.elem_label[first];
  if (s.shift == 0) return "; their parts have the labels that follow the largest one";
  return text_format("; the parts of element %d are %d, %d, ...", label, s.shift + label,
                     2 * s.shift + label);
}

void report(Deck& d, Model& m, const SplitMesh& s, const std::vector<Reason>& reason)
{
  const double change = s.parts_volume / s.volume - 1.0;
  m.notes.tied.push_back("SPLIT  " + types_of(s) + ", with the accuracy of linear elements" + labels_of(s) +
                         (std::fabs(change) > SAME_VOLUME
                              ? text_format("; bent edges become straight: volume %+.2g", change)
                              : ""));
  if (std::any_of(reason.begin(), reason.end(), [](const Reason& r) { return r.known; })) return;
  const Reason& r = reason.front();
  warn(d, r.keyword, r.deck_line, "",
       std::string("linear elements are needed: quadratic ones are split, ") + types_of(s) +
           ", with the accuracy of linear elements");
}

}  // namespace

// ---------------------------------------------------------------------------
// deck_split : splits quadratic elements into linear ones: all in a deck with fracture, conversion, general
// contact or explicit steps; else those that are points from the start or bonded to points, and all that
// share an edge with them. Sets, surfaces, loads, supports and initial values follow.
// ---------------------------------------------------------------------------
void deck_split(Deck& d, Model& m)
{
  Wanted w = wanted_elements(m);
  if (w.reason.empty()) return;
  spread(m.mesh, w.elem);
  const int before = d.messages.errors;
  for (int e = 0; e < m.mesh.nelem(); ++e)
    if (w.elem[e]) deck_check_element(d, m, e);
  if (d.messages.errors > before) return;
  SplitMesh s;
  s.chosen.swap(w.elem);
  rebuild(d, m, s);
  check_centres(d, m, s);
  replace_all(d, m, s);
  check_means(d, m, s);
  report(d, m, s, w.reason);
}
