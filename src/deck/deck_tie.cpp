// *TIE: equations between the nodes of non-matching surfaces, for each step: doc/theory.md 5.2

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "deck/deck_state.h"
#include "shape/mortar.h"

namespace {

// default POSITION TOLERANCE, relative to the mean size of the master faces  (test: bad/tie_far.inp)
const double TOLERANCE = 0.05;
// tolerance of points inside the faces, relative to that of nodes: curved faces are further apart between
// their nodes  (no test)
const double INSIDE_FACTOR = 2.0;
const int MAX_LISTED = 5;      // nodes listed in a warning  (no test)

// faces of a surface; empty: it cannot be tied, which is reported
std::vector<MortarFace> faces_of(Deck& d, const Model& m, const TieDef& t, int surface)
{
  std::vector<MortarFace> out;
  const Surface& s = m.surface[surface];
  if (s.body >= 0) {
    fault(d, "TIE", t.deck_line, "",
          "surface " + s.name +
              " is the boundary of a body of material points, which has no nodes "
              "to tie; tie elements to points by *BOND");
    return out;
  }
  for (const Face& f : s.face) {
    const ShapeInfo& shape = shape_info[elem_table[m.mesh.elem_type[f.elem]].shape];
    MortarFace face{face_corners(shape, f.face), {}};
    face.mid = shape.nfnode[f.face] - face.n;
    for (int a = 0; a < face.all(); ++a) face.node[a] = m.mesh.conn.begin(f.elem)[shape.face[f.face][a]];
    out.push_back(face);
  }
  return out;
}

// a node of a slave surface is a corner of all its faces, or on an edge of all; false: reported
bool one_kind(Deck& d, const Model& m, const TieDef& t, const std::vector<MortarFace>& slave)
{
  std::map<int, bool> corner;
  for (const MortarFace& f : slave)
    for (int a = 0; a < f.all(); ++a) {
      const auto known = corner.emplace(f.node[a], a < f.n);
      if (known.first->second == (a < f.n)) continue;
      fault(d, "TIE", t.deck_line, "",
            text_format("node %d of surface ", m.mesh.node_label[f.node[a]]) + m.surface[t.slave].name +
                " is the corner of one face and in the middle of an edge of another; exchange slave and "
                "master surface");
      return false;
    }
  return true;
}

IntVec nodes_of(const std::vector<MortarFace>& face)
{
  std::set<int> node;
  for (const MortarFace& f : face) node.insert(f.node, f.node + f.all());
  return IntVec(node.begin(), node.end());
}

std::string listed(const Model& m, const IntVec& node)
{
  std::string text;
  for (std::size_t k = 0; k < node.size() && k < MAX_LISTED; ++k)
    text += (k ? ", " : "") + std::to_string(m.mesh.node_label[node[k]]);
  return text + (node.size() > MAX_LISTED ? ", ..." : "");
}

// A tie with the equations of its nodes, before supports are considered
struct Tied {
  std::vector<MortarRow> row;                        // equations of the tied nodes
  std::map<int, int> row_of;                         // node -> row
  std::map<int, std::set<int>> adjacent;             // node -> tied nodes on its slave faces
  std::set<int> common;                              // tied nodes that belong to both surfaces
  double gap = 0.0;                                  // largest distance of a tied node
  int nodes = 0;                                     // of the slave surface
};

// ties slave nodes within the tolerance that project onto a master face; lists the others in a warning
Tied tied_nodes(Deck& d, const Model& m, const TieDef& t, const std::vector<MortarFace>& slave,
                const std::vector<MortarFace>& master)
{
  Tied out;
  const RealVec& X = m.mesh.X;
  const double size = mortar_size(m.dim, X, master);
  const double tolerance = t.tolerance > 0.0 ? t.tolerance : TOLERANCE * size;
  const IntVec node = nodes_of(slave), other = nodes_of(master);
  const RealVec distance = mortar_distances(X, node, master, 2.0 * tolerance);
  const std::vector<MortarRow> row = mortar_rows(X, slave, master, INSIDE_FACTOR * tolerance);
  std::map<int, const MortarRow*> row_of;
  for (const MortarRow& r : row) row_of[r.node] = &r;
  IntVec free;
  for (std::size_t k = 0; k < node.size(); ++k) {
    const auto r = row_of.find(node[k]);
    if (distance[k] > tolerance || r == row_of.end()) {
      free.push_back(node[k]);
      continue;
    }
    if (std::binary_search(other.begin(), other.end(), node[k])) out.common.insert(node[k]);
    out.gap = std::max(out.gap, distance[k]);
    out.row_of[node[k]] = static_cast<int>(out.row.size());
    out.row.push_back(*r->second);
  }
  out.nodes = static_cast<int>(node.size());
  for (const MortarFace& f : slave)
    for (int a = 0; a < f.all(); ++a)
      for (int b = 0; b < f.all(); ++b)
        if (a != b && out.row_of.count(f.node[b])) out.adjacent[f.node[a]].insert(f.node[b]);
  if (out.row.size() == out.common.size())
    fault(d, "TIE", t.deck_line, "",
          text_format("no node of the slave surface lies within %.4g of an opposite master face; check "
                      "the two surfaces and POSITION TOLERANCE",
                      tolerance));
  else if (!free.empty())
    warn(d, "TIE", t.deck_line, "",
         text_format("%zu of %zu slave nodes are not tied, as no opposite master face lies within "
                     "%.4g: ",
                     free.size(), node.size(), tolerance) +
             listed(m, free) +
             "; increase POSITION TOLERANCE, or exchange slave and master if the slave surface is the "
             "larger one");
  return out;
}

// moves slave nodes to the positions given by the equations at t = 0: no strain in rigid rotations (5.12);
// corners before the nodes on edges, which depend on them
double adjust(Model& m, const Tied& t)
{
  double largest = 0.0;
  const RealVec old = m.mesh.X;
  RealVec& X = m.mesh.X;
  for (const bool edges : {false, true})
    for (const MortarRow& r : t.row) {
      if (t.common.count(r.node) || (r.end[0] >= 0) != edges) continue;
      double moved = 0.0;
      for (int i = 0; i < 3; ++i) {
        const auto x_of = [i](const RealVec& x, int n) { return x[3 * static_cast<std::size_t>(n) + i]; };
        double x = 0.0;
        for (const auto& q : r.master) x += q.second * x_of(old, q.first);
        if (edges) x = 0.5 * x + 0.25 * (x_of(X, r.end[0]) + x_of(X, r.end[1]));
        moved += (x - x_of(old, r.node)) * (x - x_of(old, r.node));
        X[3 * static_cast<std::size_t>(r.node) + i] = x;
      }
      largest = std::max(largest, std::sqrt(moved));
    }
  return largest;
}

// ---- equations of a step

// nearest tied nodes that are free in direction i, searched in rings of slave faces; of a node on an edge
// those on edges, if there are any: corners would then depend on each other
IntVec free_neighbours(const Tied& t, const DofSet& fixed, int node, int i)
{
  std::set<int> seen{node}, ring{node};
  while (!ring.empty()) {
    std::set<int> next;
    IntVec out;
    for (int n : ring) {
      const auto adjacent = t.adjacent.find(n);
      if (adjacent == t.adjacent.end()) continue;
      for (int b : adjacent->second)
        if (seen.insert(b).second) {
          next.insert(b);
          if (!fixed.count({b, i})) out.push_back(b);
        }
    }
    IntVec on_edges;
    for (int n : out)
      if (t.row[t.row_of.at(n)].end[0] >= 0) on_edges.push_back(n);
    if (t.row[t.row_of.at(node)].end[0] >= 0 && !on_edges.empty()) return on_edges;
    if (!out.empty()) return out;
    ring.swap(next);
  }
  return {};
}

// D w_s + sum over fixed h of part D_h w_h = sum of (D c_sm + part D_h c_hm) u_m               (5.11), (5.15)
std::vector<Equation> equations_of(const Tied& t, const DofSet& fixed, int dim, const DeckLine& deck_line)
{
  std::vector<Equation> out;
  for (int i = 0; i < dim; ++i) {
    std::vector<std::map<int, double>> sum(t.row.size());      // of each row: node -> coefficient
    const auto add = [&](int to, const MortarRow& r, double part) {
      const bool edge = r.end[0] >= 0;
      sum[to][r.node] += (edge ? 2.0 : 1.0) * part * r.area;
      for (int k = 0; k < 2 && edge; ++k) sum[to][r.end[k]] -= 0.5 * part * r.area;
      for (const auto& q : r.master) sum[to][q.first] -= part * r.area * q.second;
    };
    for (std::size_t k = 0; k < t.row.size(); ++k) {
      if (!fixed.count({t.row[k].node, i})) {
        add(static_cast<int>(k), t.row[k], 1.0);
        continue;
      }
      const IntVec to = free_neighbours(t, fixed, t.row[k].node, i);
      for (int n : to) add(t.row_of.at(n), t.row[k], 1.0 / static_cast<double>(to.size()));
    }
    for (std::size_t k = 0; k < t.row.size(); ++k) {
      if (fixed.count({t.row[k].node, i})) continue;
      Equation e;
      e.deck_line = deck_line;
      e.of    = EQUATION_TIE;
      const double diagonal = sum[k][t.row[k].node];
      e.term.push_back({t.row[k].node, i, 1.0});
      for (const auto& q : sum[k])
        if (q.first != t.row[k].node && q.second != 0.0) e.term.push_back({q.first, i, q.second / diagonal});
      out.push_back(e);
    }
  }
  return out;
}

// adds the equations to each step; steps with the same fixed dofs share them
void add_equations(Model& m, const TieDef& def, const Tied& t)
{
  std::map<DofSet, IntVec> made;
  for (Step& s : m.step) {
    DofSet fixed;
    for (const auto& dof : equation_given(m, s))
      if (t.row_of.count(dof.first)) fixed.insert(dof);
    for (int n : t.common)
      for (int i = 0; i < m.dim; ++i) fixed.insert({n, i});
    const auto same = made.find(fixed);
    if (same == made.end()) {
      IntVec& list = made[fixed];
      for (Equation& e : equations_of(t, fixed, m.dim, def.deck_line)) {
        list.push_back(static_cast<int>(m.equation.size()));
        m.equation.push_back(std::move(e));
      }
    }
    const IntVec& list = made[fixed];
    s.equation.insert(s.equation.end(), list.begin(), list.end());
  }
}

// excludes the tied surfaces from general contact
void exclude(Model& m, const TieDef& t)
{
  const int general = model_general_contact(m);
  if (general < 0) return;
  ContactRule r;
  r.a.surface = t.slave;
  r.b.surface = t.master;
  m.bond[general].contact.exclude.push_back(r);
}

void tie(Deck& d, Model& m, const TieDef& def)
{
  if (def.slave < 0 || def.master < 0 || def.slave == def.master) return;
  const std::vector<MortarFace> slave = faces_of(d, m, def, def.slave),
                                master = faces_of(d, m, def, def.master);
  if (slave.empty() || master.empty() || !one_kind(d, m, def, slave)) return;
  const Tied t = tied_nodes(d, m, def, slave, master);
  if (t.row.empty()) return;
  for (const Frame& f : m.frame)
    if (f.twin >= 0 && t.row_of.count(f.node))
      return fault(d, "TIE", def.deck_line, "",
                   text_format("slave node %d has local directions (*TRANSFORM), and is supported or loaded "
                               "in them; exchange slave and master surface",
                               m.mesh.node_label[f.node]));
  const double moved = def.adjust ? adjust(m, t) : 0.0;
  const double size = mortar_size(m.dim, m.mesh.X, slave);
  bool nlgeom = false;
  for (const Step& s : m.step) nlgeom = nlgeom || s.nlgeom;
  if (!def.adjust && nlgeom && t.gap > 1e-6 * size)
    warn(d, "TIE", def.deck_line, "",
         text_format(
             "tied nodes are up to %.3g away from their master faces (ADJUST=NO): a rotation strains "
             "them by up to its angle times %.3g; ADJUST=YES moves them onto the faces",
             t.gap, t.gap / size));
  add_equations(m, def, t);
  exclude(m, def);
  m.notes.tied.push_back(text_format("TIE  %s: %zu of %d slave nodes are tied, %.3g or less from their faces",
                                     def.name.c_str(), t.row.size(), t.nodes, t.gap) +
                         (moved > 1e-12 * size ? text_format("; moved there by up to %.3g", moved) : ""));
}

}  // namespace

// ---------------------------------------------------------------------------
// tie_resolve : forms the equations of all ties. A slave node of two ties is tied by the first one.
// ---------------------------------------------------------------------------
void tie_resolve(Deck& d, Model& m)
{
  for (const TieDef& t : d.tie) tie(d, m, t);
}
