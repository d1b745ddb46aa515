#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "base/log.h"
#include "bond/bond.h"

const double bond_alpha = 1000.0;

namespace {

// a face of a surface: its nodes (corner c: nnode + c), their places, its share of thickness
struct FaceNodes {
  int n = 0;
  int kin[4];
  double X[4][3];
  double thickness = 1.0, young = 0.0;
};

FaceNodes face_nodes(const Model& m, const Points& pts, const Surface& s, const Face& f)
{
  FaceNodes out;
  const bool body       = s.body >= 0;
  const ShapeInfo& info = shape_info[body ? pts.shape[f.elem] : elem_table[m.mesh.elem_type[f.elem]].shape];
  out.n = info.nfnode[f.face];
  for (int k = 0; k < out.n; ++k) {
    const int local = info.face[f.face][k];
    const int node  = body ? pts.conn.begin(f.elem)[local] : m.mesh.conn.begin(f.elem)[local];
    out.kin[k]      = body ? m.mesh.nnode() + node : node;
    for (int i = 0; i < 3; ++i)
      out.X[k][i] = !body ? m.mesh.X[3 * node + i] : i < m.dim ? pts.Xc[node * m.dim + i] : 0.0;
  }
  if (body) {
    out.thickness = m.body[s.body].thickness;
    out.young     = m.material[m.body[s.body].material].young;
  } else if (m.mesh.elem_section[f.elem] >= 0) {
    const Section& sec = m.section[m.mesh.elem_section[f.elem]];
    out.thickness = sec.thickness;
    out.young     = m.material[sec.material].young;
  }
  return out;
}

// outward unit normal of an edge (nodes counter-clockwise) and its length
std::array<double, 3> edge_normal(const FaceNodes& f, double& length)
{
  const double dx = f.X[1][0] - f.X[0][0], dy = f.X[1][1] - f.X[0][1];
  length = std::hypot(dx, dy);
  return {{dy / length, -dx / length, 0.0}};
}

// penalty per area of a definition
double penalty_of(const Model& m, const BondDef& d, double young_face, double h_face)
{
  if (d.penalty > 0.0) return d.penalty;
  double young = young_face, h = h_face;
  if (d.body >= 0) young = std::max(young, m.material[m.body[d.body].material].young);
  if (m.grid.given) {
    h = m.grid.h[0];
    for (int i = 1; i < m.dim; ++i) h = std::min(h, m.grid.h[i]);
  }
  return (d.alpha > 0.0 ? d.alpha : bond_alpha) * young / h;
}

// bonds between the nodes of an edge: as the deck says, or as close as the corners of the body on side B, so that
// the grid receives a traction as evenly as the points do. Doc: doc/theory.md 4, measured in doc/verification.md.
int between_nodes(const Model& m, const BondDef& d, const double* n, double length)
{
  if (d.intermediate >= 0) return d.intermediate;
  if (d.body < 0) return 0;
  const Body& b  = m.body[d.body];
  double cell[2];
  for (int i = 0; i < 2; ++i) cell[i] = b.cells[i] > 0 ? (b.hi[i] - b.lo[i]) / b.cells[i] : m.grid.h[i];
  const double spacing = (std::fabs(n[1]) * cell[0] + std::fabs(n[0]) * cell[1]) / b.per_cell;
  return std::max(0, static_cast<int>(std::lround(length / spacing)) - 1);
}

struct Former {
  const Model& m;
  Bonds& b;
  int def;
  int first;                   // first bond of the definition
  std::map<int, int> at_node;  // kin -> bond: one bond a node, its area grows with every edge
};

int new_bond(Former& f, int field, bool between, const double* X)
{
  Bonds& b = f.b;
  b.X.insert(b.X.end(), X, X + 3);
  b.def.push_back(f.def);
  b.field.push_back(field);
  b.area.push_back(0.0);
  b.normal.insert(b.normal.end(), f.m.dim, 0.0);
  b.cn.push_back(0.0);
  b.ct.push_back(0.0);
  b.intermediate.push_back(between);
  return b.nbond++;
}

void close_side(Bonds& b) { b.a.off.push_back(static_cast<int>(b.a.item.size())); }

// a bond at a node exists once; its side A list is written when it is made
int node_bond(Former& f, int kin, const double* X, int field)
{
  const auto it = f.at_node.find(kin);
  if (it != f.at_node.end()) return it->second;
  const int b = new_bond(f, field, false, X);
  f.b.a.item.push_back(kin);
  f.b.a_w.push_back(1.0);
  close_side(f.b);
  f.at_node.emplace(kin, b);
  return b;
}

int edge_bond(Former& f, const FaceNodes& face, double s, int field)
{
  double X[3];
  for (int i = 0; i < 3; ++i) X[i] = (1.0 - s) * face.X[0][i] + s * face.X[1][i];
  const int b = new_bond(f, field, true, X);
  for (int k = 0; k < 2; ++k) {
    f.b.a.item.push_back(face.kin[k]);
    f.b.a_w.push_back(k ? s : 1.0 - s);
  }
  close_side(f.b);
  return b;
}

// area, normal and stiffness (area times penalty) of one share
void add_share(Former& f, int b, double area, const double* n, double penalty)
{
  f.b.area[b] += area;
  f.b.cn[b] += penalty * area;
  for (int i = 0; i < f.m.dim; ++i) f.b.normal[b * f.m.dim + i] += area * n[i];
}

// bonds of one edge: trapezoidal shares, so that a uniform traction goes to the nodes as from the element   (4.5)
void form_edge(Former& f, const FaceNodes& face, int field)
{
  const BondDef& d = f.m.bond[f.def];
  double length;
  const std::array<double, 3> n = edge_normal(face, length);
  const int parts     = between_nodes(f.m, d, n.data(), length) + 1;
  const double share  = length * face.thickness / parts;
  const double penalty = penalty_of(f.m, d, face.young, length);
  if (d.body >= 0 && f.b.nbond == f.first && face.thickness != f.m.body[d.body].thickness)
    log_warn("bond %s (%s line %d): the elements are %g thick, the body %s is %g thick", d.name.c_str(),
             d.place.file.c_str(), d.place.line, face.thickness, f.m.body[d.body].name.c_str(), f.m.body[d.body].thickness);
  for (int k = 0; k <= parts; ++k) {
    const bool end = k == 0 || k == parts;
    const int b    = end ? node_bond(f, face.kin[k ? 1 : 0], face.X[k ? 1 : 0], field)
                         : edge_bond(f, face, static_cast<double>(k) / parts, field);
    add_share(f, b, end ? 0.5 * share : share, n.data(), penalty);
  }
}

// unit normals; the tangential stiffness of bonds that tie one direction only is zero
void finish(Former& f, int first)
{
  const BondDef& d = f.m.bond[f.def];
  const int dim    = f.m.dim;
  for (int b = first; b < f.b.nbond; ++b) {
    double* n = &f.b.normal[b * dim];
    bool given = false;
    for (int i = 0; i < dim; ++i) given = given || d.direction[i] != 0.0;
    double norm = 0.0;
    for (int i = 0; i < dim; ++i) {
      if (given) n[i] = d.direction[i];
      norm += n[i] * n[i];
    }
    norm = std::sqrt(norm);
    for (int i = 0; i < dim; ++i) n[i] = norm > 0.0 ? n[i] / norm : (i == 0);
    f.b.ct[b] = d.normal_only ? 0.0 : f.b.cn[b];
  }
}

}  // namespace

int bond_form(const Model& m, const Points& pts, Bonds& bonds)
{
  bonds = Bonds();
  int errors = 0;
  for (size_t d = 0; d < m.bond.size(); ++d) {
    const BondDef& def = m.bond[d];
    const Surface& s   = m.surface[def.surface];
    const int first    = bonds.nbond;
    const int field    = def.kind == BOND_GROUND ? -1 : m.body[def.body].field;
    Former f{m, bonds, static_cast<int>(d), first, {}};
    for (const Face& face : s.body >= 0 ? pts.surface[def.surface] : s.face)
      form_edge(f, face_nodes(m, pts, s, face), field);
    finish(f, first);
    if (bonds.nbond == first) {
      log_error("bond %s (%s line %d): its surface %s holds no face", def.name.c_str(), def.place.file.c_str(),
                def.place.line, s.name.c_str());
      ++errors;
    }
  }
  return errors;
}
