// *COUPLING and *RIGID BODY: nodes coupled to a reference node by equations: doc/theory.md 5.3
//
// The rotation of a reference node is stored as the displacements of a node without elements (in the plane
// the first one). Directions 4 to 6 of *BOUNDARY and *CLOAD act on this node.

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include <Eigen/Dense>

#include "base/turn.h"
#include "deck/deck_state.h"
#include "shape/face.h"

namespace {

// number of rotations
int rotations(int dim) { return dim == 2 ? 1 : 3; }

const char* keyword_of(const CouplingDef& c) { return c.kind == COUPLING_RIGID ? "RIGID BODY" : "COUPLING"; }

double X_of(const Model& m, int n, int i) { return m.mesh.X[3 * static_cast<std::size_t>(n) + i]; }

struct WeightedNode { int node; double weight; };

// nodes of the surface, without the reference node, with their fractions of its area
std::vector<WeightedNode> surface_nodes(const Model& m, const CouplingDef& c)
{
  std::map<int, double> area;
  for (const Face& f : m.surface[c.surface].face) {
    const ShapeInfo& shape = shape_info[elem_table[m.mesh.elem_type[f.elem]].shape];
    const int n = shape.nfnode[f.face], kind = face_kind(m.dim, n);
    double x[3 * MAX_FACE_NODES], N[MAX_FACE_NODES], normal[3];
    const auto node = [&](int a) { return m.mesh.conn.begin(f.elem)[shape.face[f.face][a]]; };
    for (int a = 0; a < n; ++a)
      for (int i = 0; i < 3; ++i) x[3 * a + i] = X_of(m, node(a), i);
    const FaceRule& rule = face_rule(kind);
    for (int g = 0; g < rule.n; ++g) {
      face_eval(kind, rule.xi[g], N, nullptr);
      const double w = rule.w[g] * face_area(kind, x, rule.xi[g], normal);
      for (int a = 0; a < n; ++a) area[node(a)] += w * N[a];
    }
  }
  area.erase(c.ref);
  double sum = 0.0;
  for (const auto& a : area) sum += a.second;
  std::vector<WeightedNode> out;
  for (const auto& a : area) out.push_back({a.first, a.second / sum});
  return out;
}

std::vector<WeightedNode> element_nodes(const Model& m, const CouplingDef& c)
{
  std::set<int> node;
  for (int e : m.elset[c.elset].item)
    node.insert(m.mesh.conn.begin(e), m.mesh.conn.begin(e) + m.mesh.conn.count(e));
  node.erase(c.ref);
  std::vector<WeightedNode> out;
  for (int n : node) out.push_back({n, 0.0});
  return out;
}

int add_equation(Model& m, const CouplingDef& c, Equation e)
{
  e.deck_line = c.deck_line;
  e.of    = EQUATION_COUPLING;
  m.equation.push_back(std::move(e));
  return static_cast<int>(m.equation.size()) - 1;
}

// displacements and rotations of the reference node that are prescribed or loaded in a step
struct RefState {
  bool prescribed[6] = {}, zero[6] = {}, loaded[6] = {};
};

RefState ref_state(const CouplingDef& c, const Step& s)
{
  RefState h;
  for (const Prescribed& b : s.prescribed)
    for (int n : b.node)
      for (int i = b.first; i <= b.last; ++i) {
        if (n != c.ref && n != c.turn) continue;
        const int k = n == c.ref ? i : 3 + i;
        h.prescribed[k] = true;
        h.zero[k] = b.value.is_const() && b.value.value == 0.0;
      }
  for (const Load& l : s.load)
    for (int n : l.node)
      if (n == c.ref || n == c.turn) h.loaded[n == c.ref ? l.dof : 3 + l.dof] = true;
  return h;
}

// ---- kinematic: the nodes move as a rigid body                                                     (5.13)

IntVec kinematic_equations(Model& m, const CouplingDef& c, const std::vector<WeightedNode>& node)
{
  IntVec out;
  for (const WeightedNode& w : node)
    for (int i = 0; i < m.dim; ++i) {
      if (!c.coupled[i]) continue;
      double r[3];
      for (int j = 0; j < 3; ++j) r[j] = X_of(m, w.node, j) - X_of(m, c.ref, j);
      Equation e;
      e.term = {{w.node, i, 1.0}, {c.ref, i, -1.0}};
      for (int k = 0; k < rotations(m.dim); ++k) {
        const double coef = turn_coef(m.dim, r, i, k);
        if (coef != 0.0) e.term.push_back({c.turn, k, -coef});
      }
      out.push_back(add_equation(m, c, e));
    }
  return out;
}

bool rotation_fixed(const RefState& h, int dim)
{
  for (int k = 0; k < rotations(dim); ++k)
    if (!h.prescribed[3 + k] || !h.zero[3 + k]) return false;
  return true;
}

// only the reference node of a rigid body may be prescribed; false: error reported
bool nodes_free(Deck& d, const Model& m, const CouplingDef& c, const std::vector<WeightedNode>& node,
                const Step& s)
{
  const DofSet given = equation_given(m, s);
  for (const WeightedNode& w : node)
    for (int i = 0; i < m.dim; ++i) {
      if (!given.count({w.node, i})) continue;
      fault(d, keyword_of(c), c.deck_line, "",
          text_format(
              "direction %d of node %d of the body is prescribed or dependent in another equation or body: "
              "prescribe the reference node instead",
              i + 1, m.mesh.node_label[w.node]));
      return false;
    }
  return true;
}

void couple_kinematic(Deck& d, Model& m, const CouplingDef& c, const std::vector<WeightedNode>& node)
{
  const IntVec equation = kinematic_equations(m, c, node);
  const bool rigid = c.kind == COUPLING_RIGID;
  bool reported = false;
  for (Step& s : m.step) {
    if (rigid && !nodes_free(d, m, c, node, s)) return;
    if (rigid && s.nlgeom && s.explicit_steps()) continue;          // finite rotations: (6.41)
    s.equation.insert(s.equation.end(), equation.begin(), equation.end());
    if (!s.nlgeom || reported || rotation_fixed(ref_state(c, s), m.dim)) continue;
    reported = true;
    fault(d, keyword_of(c), c.deck_line, "",
          std::string(
              "with NLGEOM the nodes rotate by finite angles, which equations cannot describe: fix "
              "the rotation of the reference node (*BOUNDARY, direction") +
              (m.dim == 2 ? " 6)" : "s 4 to 6)") +
              (rigid ? ", use *DYNAMIC, EXPLICIT, or stiff elements instead of the rigid body"
                     : ", use *DISTRIBUTING, or leave out NLGEOM"));
  }
}

// ---- distributing: the reference node follows the mean motion of the surface                       (5.14)

struct Cloud {
  double centre[3] = {0, 0, 0};
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();   // of sum w (r.r I - r r), plane: (0, 0)
  double size = 0.0;
  bool has_rotation = true;    // a rotation is defined
};

Cloud cloud_of(const Model& m, const std::vector<WeightedNode>& node)
{
  Cloud c;
  for (const WeightedNode& w : node)
    for (int i = 0; i < 3; ++i) c.centre[i] += w.weight * X_of(m, w.node, i);
  Eigen::Matrix3d J = Eigen::Matrix3d::Zero();
  for (const WeightedNode& w : node) {
    Eigen::Vector3d r;
    for (int i = 0; i < 3; ++i) r(i) = X_of(m, w.node, i) - c.centre[i];
    J += w.weight * (r.squaredNorm() * Eigen::Matrix3d::Identity() - r * r.transpose());
  }
  const double trace = J.trace(), sum = 0.5 * trace;           // sum w r.r
  c.size = std::sqrt(sum);
  if (m.dim == 2) {
    c.has_rotation = sum > 0.0;
    c.inverse(0, 0) = c.has_rotation ? 1.0 / sum : 0.0;
  } else {
    c.has_rotation = J.determinant() > 1e-9 * trace * trace * trace;
    if (c.has_rotation) c.inverse = J.inverse();
  }
  return c;
}

using Row = std::map<std::pair<int, int>, double>;           // (node, direction) -> coefficient

// least-squares rotation about axis k
Row turn_row(const Model& m, const Cloud& c, const std::vector<WeightedNode>& node, int k)
{
  Row row;
  for (const WeightedNode& w : node)
    for (int i = 0; i < m.dim; ++i) {
      double r[3], sum = 0.0;
      for (int j = 0; j < 3; ++j) r[j] = X_of(m, w.node, j) - c.centre[j];
      for (int l = 0; l < rotations(m.dim); ++l) sum += c.inverse(k, l) * turn_coef(m.dim, r, i, l);
      if (sum != 0.0) row[{w.node, i}] += w.weight * sum;
    }
  return row;
}

// displacement i of the reference node: mean displacement, plus rotation times arm
Row mean_row(const Model& m, const CouplingDef& def, const Cloud& c, const std::vector<WeightedNode>& node,
             int i)
{
  Row row;
  for (const WeightedNode& w : node) row[{w.node, i}] += w.weight;
  double arm[3];
  for (int j = 0; j < 3; ++j) arm[j] = X_of(m, def.ref, j) - c.centre[j];
  for (int k = 0; k < rotations(m.dim) && def.coupled[m.dim == 2 ? 5 : 3 + k]; ++k) {
    const double coef = turn_coef(m.dim, arm, i, k);
    if (coef == 0.0) continue;
    for (const auto& t : turn_row(m, c, node, k)) row[t.first] += coef * t.second;
  }
  return row;
}

// solves the rows of prescribed directions for nodes of the surface, by Gauss-Jordan elimination with the
// largest coefficient as pivot. False: not enough free nodes.
bool pivot_rows(std::vector<Row>& row, const DofSet& taken, std::vector<std::pair<int, int>>& pivot)
{
  pivot.assign(row.size(), {-1, -1});
  for (std::size_t k = 0; k < row.size(); ++k) {
    double largest = 0.0, size = 0.0;
    for (const auto& t : row[k]) {
      size = std::max(size, std::fabs(t.second));
      if (taken.count(t.first) || std::fabs(t.second) <= largest * (1.0 + 1e-12)) continue;
      largest = std::fabs(t.second);
      pivot[k] = t.first;
    }
    if (largest <= 1e-6 * size) return false;
    const double pivot_value = row[k][pivot[k]];
    for (auto& t : row[k]) t.second /= pivot_value;
    for (std::size_t l = 0; l < row.size(); ++l) {
      const auto at = row[l].find(pivot[k]);
      if (l == k || at == row[l].end()) continue;
      const double f = at->second;
      for (const auto& t : row[k]) row[l][t.first] -= f * t.second;
      row[l].erase(pivot[k]);
    }
  }
  return true;
}

// equations of a step; false: too many nodes of the surface are prescribed
bool distributing_equations(Model& m, const CouplingDef& c, const Cloud& cloud,
                            const std::vector<WeightedNode>& node, const RefState& h, Step& s)
{
  DofSet taken = equation_given(m, s);
  for (int n : {c.ref, c.turn})
    for (int i = 0; i < m.dim; ++i) taken.insert({n, i});
  std::vector<Row> prescribed;
  for (int q = 0; q < m.dim + rotations(m.dim); ++q) {
    const bool turn = q >= m.dim;
    const int k = turn ? q - m.dim : q;
    if (!c.coupled[turn ? (m.dim == 2 ? 5 : 3 + k) : k] || (turn && !cloud.has_rotation)) continue;
    Row row = turn ? turn_row(m, cloud, node, k) : mean_row(m, c, cloud, node, k);
    const int dof_node = turn ? c.turn : c.ref;
    if (h.prescribed[turn ? 3 + k : k]) {
      row[{dof_node, k}] -= 1.0;
      prescribed.push_back(row);
      continue;
    }
    Equation e;
    e.term.push_back({dof_node, k, 1.0});
    for (const auto& t : row) e.term.push_back({t.first.first, t.first.second, -t.second});
    s.equation.push_back(add_equation(m, c, e));
  }
  std::vector<std::pair<int, int>> pivot;
  if (!pivot_rows(prescribed, taken, pivot)) return false;
  for (std::size_t k = 0; k < prescribed.size(); ++k) {
    Equation e;
    e.term.push_back({pivot[k].first, pivot[k].second, 1.0});
    for (const auto& t : prescribed[k])
      if (t.first != pivot[k] && t.second != 0.0) e.term.push_back({t.first.first, t.first.second, t.second});
    s.equation.push_back(add_equation(m, c, e));
  }
  return true;
}

// with NLGEOM only the mean displacement is linear; false: error reported
bool check_linear(Deck& d, const Model& m, const CouplingDef& c, const Cloud& cloud, const RefState& h)
{
  bool moved = false, turned = false;
  for (int k = 0; k < 3; ++k) {
    moved = moved || h.prescribed[k] || h.loaded[k];
    turned = turned || h.prescribed[3 + k] || h.loaded[3 + k];
  }
  double arm = 0.0;
  for (int j = 0; j < 3; ++j) arm += std::pow(X_of(m, c.ref, j) - cloud.centre[j], 2);
  const bool arms = moved && c.coupled[5] && std::sqrt(arm) > 1e-6 * cloud.size;
  if (!turned && !arms) return true;
  fault(d, keyword_of(c), c.deck_line, "",
        std::string("with NLGEOM the mean rotation of the surface is not a linear equation: ") +
            (turned ? "leave out rotation and moment of the reference node, or NLGEOM"
                    : "put the reference node at the centre of the surface, " +
                          position_text(cloud.centre, m.dim) +
                          ", or couple directions 1 to 3 alone (data line of *DISTRIBUTING: 1, 3)"));
  return false;
}

void couple_distributing(Deck& d, Model& m, const CouplingDef& c, const std::vector<WeightedNode>& node)
{
  const Cloud cloud = cloud_of(m, node);
  for (Step& s : m.step) {
    const RefState h = ref_state(c, s);
    if (!cloud.has_rotation)
      for (int k = 0; k < 3; ++k)
        if (h.prescribed[3 + k] || h.loaded[3 + k])
          return fault(d, keyword_of(c), c.deck_line, "",
                       "the nodes of the surface are collinear or coincide: no rotation is defined");
    if (s.nlgeom && !check_linear(d, m, c, cloud, h)) return;
    if (!distributing_equations(m, c, cloud, node, h, s))
      return fault(d, keyword_of(c), c.deck_line, "",
          "the motion of the reference node is prescribed, but supports or equations fix the nodes of "
          "the surface already; release one of the two");
  }
}

void couple(Deck& d, Model& m, const CouplingDef& c)
{
  if (c.ref < 0 || (c.kind == COUPLING_RIGID ? c.elset : c.surface) < 0) return;
  if (c.kind != COUPLING_RIGID && m.surface[c.surface].body >= 0)
    return fault(d, keyword_of(c), c.deck_line, "",
                 "surface " + m.surface[c.surface].name +
                     " is the boundary of a body of material points, which has "
                     "no nodes; couple a surface of elements");
  const std::vector<WeightedNode> node = c.kind == COUPLING_RIGID ? element_nodes(m, c) : surface_nodes(m, c);
  if (c.kind == COUPLING_DISTRIBUTING) couple_distributing(d, m, c, node);
  else couple_kinematic(d, m, c, node);
  if (c.kind == COUPLING_RIGID) {
    RigidBody b{{}, c.ref, c.turn, c.deck_line};
    for (const WeightedNode& w : node) b.node.push_back(w.node);
    m.rigid.push_back(b);
  }
  m.notes.tied.push_back(text_format("%s  %s: %zu nodes follow node %d", keyword_of(c), c.name.c_str(),
                                     node.size(), m.mesh.node_label[c.ref]));
}

}  // namespace

// ---------------------------------------------------------------------------
// coupling_turn : creates the node with the rotation of the reference node, and the set NAME_ROTATION
// ---------------------------------------------------------------------------
void coupling_turn(Deck& d, Model& m, CouplingDef& c)
{
  if (c.ref >= 0) return;
  IntVec node;
  if (!target_nodes(d, m, c.ref_at, node)) return;
  if (node.size() != 1)
    return deck_error(d, c.ref_at, text_format("set ") + text_show(c.ref_at.text) +
                      text_format(" has %zu nodes; the reference node must be a single node", node.size()));
  for (const CouplingDef& other : d.coupling)
    if (other.ref == node[0]) c.turn = other.turn;           // couplings of a node share its rotation
  c.ref = node[0];
  if (c.turn < 0) {
    const int label = -2000000000 + static_cast<int>(&c - d.coupling.data());
    const double x = X_of(m, c.ref, 0), y = X_of(m, c.ref, 1), z = X_of(m, c.ref, 2);
    c.turn = mesh_add_node(d, m, label, x, y, z, deck_field(d, c.deck_line, ""));
  }
  IntVec one{c.turn};
  set_merge(m.nset, c.name + "_ROTATION", one, c.deck_line);
}

int coupling_turn_of(Deck& d, Model& m, int node)
{
  for (CouplingDef& c : d.coupling) {
    coupling_turn(d, m, c);
    if (c.ref == node) return c.turn;
  }
  return -1;
}

// ---------------------------------------------------------------------------
// coupling_resolve : forms the equations of all couplings and rigid bodies
// ---------------------------------------------------------------------------
void coupling_resolve(Deck& d, Model& m)
{
  for (const CouplingDef& c : d.coupling) couple(d, m, c);
}
