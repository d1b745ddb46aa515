#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "base/comm.h"
#include "base/log.h"
#include "bond/bond.h"
#include "mat/mat.h"
#include "point/point.h"
#include "shape/face.h"

const double bond_alpha = 1000.0, contact_alpha = 10.0;

namespace {

// a face of a surface: its nodes (corner c: nnode + c), their positions, its thickness
struct FaceNodes {
  int n = 0;                   // nodes
  int kind = 0, corners = 0;   // face_kind; corners, which stand first
  int node[MAX_FACE_NODES];
  double X[3 * MAX_FACE_NODES];        // [n*3]
  double thickness = 1.0, stiff = 0.0;      // stiff: mat_stiffness of its material
};

double body_stiffness(const Model& m, int b)
{
  const Body& body = m.body[b];
  return mat_stiffness(m.material[body.material], m.dim == 2 ? body.plane : PLANE_NONE);
}

double element_stiffness(const Model& m, int e)
{
  const int material = model_material(m, e);
  return material < 0 ? 0.0 : mat_stiffness(m.material[material], elem_table[m.mesh.elem_type[e]].plane);
}

// of_body: body of the point with the face, -1: a finite element
FaceNodes face_nodes(const Model& m, const Points& pts, int of_body, const Face& f)
{
  FaceNodes out;
  const bool body       = of_body >= 0;
  const ShapeInfo& info = shape_info[body ? pts.shape[f.elem] : elem_table[m.mesh.elem_type[f.elem]].shape];
  out.n       = info.nfnode[f.face];
  out.kind    = face_kind(m.dim, out.n);
  out.corners = face_corners(info, f.face);
  for (int k = 0; k < out.n; ++k) {
    const int local = info.face[f.face][k];
    const int node  = body ? pts.conn.begin(f.elem)[local] : m.mesh.conn.begin(f.elem)[local];
    out.node[k]      = body ? m.mesh.nnode() + node : node;
    for (int i = 0; i < 3; ++i)
      out.X[3 * k + i] = !body ? m.mesh.X[3 * node + i] : i < m.dim ? pts.Xc[node * m.dim + i] : 0.0;
  }
  if (body) {
    out.thickness = m.body[of_body].thickness;
    out.stiff     = body_stiffness(m, of_body);
  } else if (m.mesh.elem_section[f.elem] >= 0) {
    const Section& sec = m.section[m.mesh.elem_section[f.elem]];
    out.thickness = sec.thickness;
    out.stiff     = element_stiffness(m, f.elem);
  }
  return out;
}

// longest edge of a face
double face_size(const FaceNodes& face)
{
  double most = 0.0;
  for (int k = 0; k < face.corners; ++k) {
    const double *x = &face.X[3 * k], *y = &face.X[3 * ((k + 1) % face.corners)];
    most = std::max(most, std::hypot(y[0] - x[0], y[1] - x[1], y[2] - x[2]));
  }
  return most;
}

}  // namespace

double surface_stiffness(const Model& m, const Surface& s)
{
  if (s.body >= 0) return body_stiffness(m, s.body);
  double stiff = 0.0;
  for (const Face& f : s.face) stiff = std::max(stiff, element_stiffness(m, f.elem));
  return stiff;
}

double bond_side_stiffness(const Model& m, const BondDef& d)
{
  const double stiff = d.body >= 0 ? body_stiffness(m, d.body) : 0.0;
  return d.surface < 0 ? stiff : std::max(stiff, surface_stiffness(m, m.surface[d.surface]));
}

namespace {

// penalty per area of a definition
double penalty_of(const Model& m, const BondDef& d, const FaceNodes& face)
{
  if (d.penalty > 0.0) return d.penalty;
  double stiff = face.stiff, h = face_size(face);
  if (d.body >= 0) stiff = std::max(stiff, body_stiffness(m, d.body));
  if (d.contact.master >= 0)
    stiff = std::max(stiff, m.part.on ? d.contact.stiff : surface_stiffness(m, m.surface[d.contact.master]));
  const bool points = d.kind == BOND_MESH_GRID || m.surface[d.surface].body >= 0 ||
                      (d.contact.master >= 0 && m.surface[d.contact.master].body >= 0);
  if (m.grid.given && points) {
    h = m.grid.h[0];
    for (int i = 1; i < m.dim; ++i) h = std::min(h, m.grid.h[i]);
  }
  return (d.alpha > 0.0 ? d.alpha : d.kind == BOND_CONTACT ? contact_alpha : bond_alpha) * stiff / h;
}

// Height of an element over its face f: mean distance of its other nodes from it, which is similar for
// adjacent elements of any mesh. Slivers count as a tenth of the longest edge of the face.
double height_over(const Model& m, const Points& pts, bool body, const Face& f, const FaceNodes& face)
{
  const ListTable& conn = body ? pts.conn : m.mesh.conn;
  const double xi[2] = {face.n == 3 ? 1.0 / 3 : 0.0, face.n == 3 ? 1.0 / 3 : 0.0};
  double n[3], sum = 0.0, centre = 0.0;
  const double norm = face_area(face.n, face.X, xi, n);
  for (int k = 0; k < face.n; ++k)
    for (int i = 0; i < m.dim; ++i) centre += face.X[3 * k + i] * n[i] / face.n;
  for (int k = 0; k < conn.count(f.elem); ++k) {
    const int node  = conn.begin(f.elem)[k];
    const double* X = body ? &pts.Xc[node * m.dim] : &m.mesh.X[3 * node];
    for (int i = 0; i < m.dim; ++i) sum -= X[i] * n[i];
    sum += centre;
  }
  return std::max(sum / (conn.count(f.elem) - face.n) / norm, 0.1 * face_size(face));
}

// penalty per area of a face of general contact, from material and height of the element behind it
double skin_penalty(const Model& m, const Points& pts, const BondDef& d, const SkinFace& s,
                    const FaceNodes& face)
{
  if (d.penalty > 0.0) return d.penalty;
  const bool on_grid = s.points && !pts.released[s.elem];
  const double h = on_grid ? *std::min_element(m.grid.h.begin(), m.grid.h.begin() + m.dim)
                           : height_over(m, pts, s.points, {s.elem, s.face}, face);
  return (d.alpha > 0.0 ? d.alpha : contact_alpha) * face.stiff / h;
}

// parts of an edge: from the deck, or as long as the domains of the body on side B, so that the traction on
// the grid is as uniform as on the points (doc/theory.md 4, measured in doc/verification.md)
int edge_parts(const Model& m, const BondDef& d, const FaceNodes& face)
{
  if (d.intermediate >= 0) return d.intermediate + 1;
  if (d.body < 0) return 1;
  const Body& b = m.body[d.body];
  double most = 0.0;
  for (int k = 0; k < face.corners; ++k) {
    const double *x = &face.X[3 * k], *y = &face.X[3 * ((k + 1) % face.corners)];
    double length2 = 0.0, domains = 0.0;
    for (int i = 0; i < m.dim; ++i) {
      const double cell = b.cells[i] > 0 ? (b.hi[i] - b.lo[i]) / b.cells[i] : m.grid.h[i];
      length2 += (y[i] - x[i]) * (y[i] - x[i]);
      domains += std::fabs(y[i] - x[i]) * cell / b.per_cell;
    }
    most = std::max(most, length2 / domains);         // length / (size of a domain along the edge)
  }
  return std::max(1, static_cast<int>(std::lround(most)));
}

// name of a lattice point: its nodes and integer weights, so that shared edges get one bond
using BondKey = std::vector<std::pair<int, int>>;

const long NO_NAME = -1;

struct BondBuilder {
  const Model& m;
  Bonds& b;
  int def;
  std::map<BondKey, int> known;
  long name = NO_NAME;         // of the next point on a face (Bonds::name)
  // [nodes, then corners] 1: points that depend on one of them are created (bond_own; points inside a face:
  // corners of that face); null: all points
  const std::vector<char>* own = nullptr;
};

// maximum number of bonds on a face, of faces of an element
const long BONDS_OF_FACE = 1L << 14, FACES = 6;

// offsets of names: bonds of the deck, then on faces of elements, then on faces of points
const long AT_POINTS = 1L << 62, OF_DECK = -AT_POINTS, OWNERS = 1L << 31;

// name of the first bond on a face of an element or a point with this number, or on a face of a surface
long face_name(int def, long number, int face)
{
  return ((def * OWNERS + number) * FACES + face) * BONDS_OF_FACE;
}

// a bond without area at the point with the shape functions N of the face; side A is already in the list
int new_bond(BondBuilder& f, const FaceNodes& face, const double* N)
{
  Bonds& b = f.b;
  double X[3] = {0, 0, 0};
  for (int k = 0; k < face.n; ++k)
    for (int i = 0; i < 3; ++i) X[i] += N[k] * face.X[3 * k + i];
  b.a.off.push_back(static_cast<int>(b.a.item.size()));
  b.X.insert(b.X.end(), X, X + 3);
  b.def.push_back(f.def);
  const BondDef& def = f.m.bond[f.def];
  b.side.push_back(def.kind == BOND_CONTACT  ? SIDE_CONTACT
                   : def.kind == BOND_GROUND ? SIDE_GROUND
                                             : SIDE_GRID);
  b.field.push_back(def.kind == BOND_MESH_GRID ? f.m.body[def.body].field : -1);
  b.area.push_back(0.0);
  b.normal.insert(b.normal.end(), f.m.dim, 0.0);
  b.cn.push_back(0.0);
  b.ct.push_back(0.0);
  ContactState& c = b.contact;
  c.offset.push_back(0.0);
  c.initial_penetration.push_back(0.0);
  c.deep.push_back(0.0);
  c.friction.push_back(def.contact.friction);
  c.skin_of.push_back(-1);
  c.met.push_back(-1);
  c.wall.push_back(-1);
  b.intermediate.push_back(b.a.count(b.nbond) > 1);
  return b.nbond++;
}

int lattice_bond(BondBuilder& f, const BondKey& key, double total, const FaceNodes& face,
                 const FacePoint& p)
{
  double N[4] = {0, 0, 0, 0}, all = 0.0;
  for (int k = 0; k < face.n; ++k) all += p.iw[k];
  for (int k = 0; k < face.n; ++k) N[k] = p.iw[k] / all;
  for (const auto& k : key) {
    f.b.a.item.push_back(k.first);
    f.b.a_w.push_back(k.second / total);
  }
  f.known.emplace(key, f.b.nbond);
  return new_bond(f, face, N);
}

// adds area, stiffness and normal of a face at the local coordinates xi to bond b
void add_area(BondBuilder& f, const FaceNodes& face, const double* xi, double area, double penalty, int b)
{
  double n[3];
  const double norm = face_area(face.n, face.X, xi, n);
  f.b.area[b] += area;
  f.b.cn[b] += penalty * area;
  for (int i = 0; i < f.m.dim; ++i) f.b.normal[b * f.m.dim + i] += area * n[i] / norm;
}

// parts of an edge of a slave face whose pressure acts at points inside: an error of 1e-3 in a patch test
// across meshes that do not match (doc/verification.md, A1)
int sample_parts(const Model& m, const BondDef& d)
{
  if (d.intermediate > 0 || (d.intermediate == 0 && d.contact.by_face)) return d.intermediate + 1;
  const int body = m.surface[d.surface].body, parts = m.dim == 2 ? 8 : 4;
  // faces of points are parts of a cell
  return body < 0 ? parts : std::max(2, parts / m.body[body].per_cell);
}

// contact points inside a slave face                                                 (4.17)
void form_inside(BondBuilder& f, const FaceNodes& face, double penalty)
{
  const double thickness = f.m.dim == 2 ? face.thickness : 1.0;
  const auto wanted      = [&](int node) { return (*f.own)[node]; };
  if (f.own && std::none_of(face.node, face.node + face.n, wanted)) return;
  for (const FaceSample& s : face_samples(face.kind, face.X, sample_parts(f.m, f.m.bond[f.def]))) {
    for (int k = 0; k < face.n; ++k) {
      f.b.a.item.push_back(face.node[k]);
      f.b.a_w.push_back(s.N[k]);
    }
    const int b = new_bond(f, face, s.N);
    add_area(f, face, s.xi, s.area * thickness, penalty, b);
    if (f.name != NO_NAME) f.b.name.push_back(f.name++);
  }
}

// warns if thickness differs between the sides; face: the first face
void warn_thickness(const BondBuilder& f, const FaceNodes& face)
{
  const BondDef& d = f.m.bond[f.def];
  if (d.body < 0 || f.m.dim == 3 || face.thickness == f.m.body[d.body].thickness) return;
  log_warn("bond %s (%s line %d): the elements are %g thick, the body %s is %g thick", d.name.c_str(),
           d.deck_line.file.c_str(), d.deck_line.line, face.thickness, f.m.body[d.body].name.c_str(),
           f.m.body[d.body].thickness);
}

// bonds of one face: trapezoidal shares, so that a uniform traction gives the nodal forces
// of the element (4.5)
void form_face(BondBuilder& f, const FaceNodes& face)
{
  const BondDef& d     = f.m.bond[f.def];
  const int dim        = f.m.dim;
  const double penalty = penalty_of(f.m, d, face);
  if (d.contact.by_face || face.n > face.corners) return form_inside(f, face, penalty);
  const int parts = edge_parts(f.m, d, face);
  long name       = f.name;
  for (const FacePoint& p : face_lattice(face.n, face.X, parts)) {
    BondKey key;
    for (int k = 0; k < face.n; ++k)
      if (p.iw[k]) key.emplace_back(face.node[k], p.iw[k]);
    // the same order on all ranks; corners after nodes
    const int nnode   = f.m.mesh.nnode();
    const auto number = [&](int node) {
      return node < nnode ? f.m.part.node_number(node) : f.m.part.nnode + node;
    };
    const auto wanted = [&](const auto& k) { return (*f.own)[k.first]; };
    if (f.own && std::none_of(key.begin(), key.end(), wanted)) {
      ++name;
      continue;
    }
    std::sort(key.begin(), key.end(),
              [&](const auto& a, const auto& b) { return number(a.first) < number(b.first); });
    // at a node the name does not depend on the number of parts
    if (key.size() == 1) key[0].second = 1;
    const auto it     = f.known.find(key);
    const double total = key.size() == 1 ? 1.0 : static_cast<double>(parts) * parts;
    const int b       = it != f.known.end() ? it->second : lattice_bond(f, key, total, face, p);
    if (f.name != NO_NAME && it == f.known.end()) f.b.name.push_back(name);
    ++name;
    add_area(f, face, p.xi, p.share * (dim == 2 ? face.thickness : 1.0), penalty, b);
  }
}

// normalises normals; the tangential stiffness of bonds that tie one direction only is zero
void finish(BondBuilder& f, int first)
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
    f.b.ct[b] = d.normal_only ? 0.0 : d.contact.stick > 0.0 ? d.contact.stick * f.b.area[b] : f.b.cn[b];
  }
}

// 1 if a bond of the definition lies outside the grid at t = 0
int outside_grid(const Model& m, const BondDef& d, const Bonds& bonds, int first)
{
  const Grid& g = m.grid;
  for (int b = first; b < bonds.nbond; ++b)
    for (int i = 0; i < m.dim; ++i) {
      const double t = (bonds.X[3 * b + i] - g.lo[i]) / g.h[i];
      if (t > -1e-9 && t < g.n[i] + 1e-9) continue;
      log_error("bond %s (%s line %d): its point (%g, %g) on surface %s lies outside the grid: enlarge "
                "*GRID, or use another surface",
                d.name.c_str(), d.deck_line.file.c_str(), d.deck_line.line, bonds.X[3 * b],
                bonds.X[3 * b + 1], m.surface[d.surface].name.c_str());
      return 1;
    }
  return 0;
}

// sum of the area vectors of a surface at t = 0; area: sum of their norms. Collective
void area_vector(const Model& m, const Points& pts, int surface, double* sum, double& area)
{
  const Surface& s = m.surface[surface];
  area = sum[0] = sum[1] = sum[2] = 0.0;
  for (const Face& f : s.body >= 0 ? pts.surface[surface] : s.face) {
    if (s.body >= 0 ? pts.part.on && pts.part.rank[f.elem] != comm_rank() : !m.part.works(f.elem)) continue;
    const FaceNodes face = face_nodes(m, pts, s.body, f);
    const double centre[2] = {face.corners == 3 ? 1.0 / 3 : 0.0, face.corners == 3 ? 1.0 / 3 : 0.0};
    double n[3];
    area += face_area(face.kind, face.X, centre, n);
    for (int i = 0; i < 3; ++i) sum[i] += n[i];
  }
  if (!m.part.on) return;
  comm_sum(&area, 1);
  comm_sum(sum, 3);
}

// two nearly plane surfaces with the same normal cannot meet: one of them is on the wrong side
void warn_same_way(const Model& m, const Points& pts, const BondDef& d)
{
  double a[3], b[3], area_a, area_b;
  area_vector(m, pts, d.surface, a, area_a);
  area_vector(m, pts, d.contact.master, b, area_b);
  if (a[0] * b[0] + a[1] * b[1] + a[2] * b[2] > 0.9 * area_a * area_b)
    log_warn("contact %s (%s line %d): the surfaces %s and %s face the same way and cannot meet unless a "
             "body turns round; is one of them "
             "the wrong side?",
             d.name.c_str(), d.deck_line.file.c_str(), d.deck_line.line, m.surface[d.surface].name.c_str(),
             m.surface[d.contact.master].name.c_str());
}

}  // namespace

std::vector<char> bond_own(const Model& m, const Points& pts)
{
  const int nnode = m.mesh.nnode();
  std::vector<char> own(nnode + pts.ncorner, 0);
  for (int e = 0; e < m.mesh.nelem(); ++e)
    for (int k = m.mesh.conn.off[e]; k < m.mesh.conn.off[e + 1] && m.part.works(e); ++k)
      own[m.mesh.conn.item[k]] = 1;
  for (size_t q = 0; q < pts.part.rank.size(); ++q)
    for (int k = pts.conn.off[q]; k < pts.conn.off[q + 1] && pts.part.rank[q] == comm_rank(); ++k)
      own[nnode + pts.conn.item[k]] = 1;
  return own;
}

int bond_form(const Model& m, const Points& pts, Bonds& bonds)
{
  bonds = Bonds();
  int errors = 0;
  const std::vector<char> own = m.part.on ? bond_own(m, pts) : std::vector<char>();
  for (size_t d = 0; d < m.bond.size(); ++d) {
    const BondDef& def = m.bond[d];
    if (def.surface < 0) continue;                    // conversion, general contact
    const Surface& s = m.surface[def.surface];
    const int first    = bonds.nbond;
    BondBuilder f{m, bonds, static_cast<int>(d), {}};
    if (m.part.on) f.own = &own;
    const std::vector<Face>& list = s.body >= 0 ? pts.surface[def.surface] : s.face;
    for (size_t k = 0; k < list.size(); ++k) {
      const long at        = s.member.empty() ? static_cast<long>(k) : s.member[k].at;
      const FaceNodes face = face_nodes(m, pts, s.body, list[k]);
      if (m.part.on)
        f.name = OF_DECK + (s.body < 0 ? face_name(f.def, at, 0)
                                       : face_name(f.def, pts.part.point[list[k].elem], list[k].face));
      if (at == 0) warn_thickness(f, face);
      form_face(f, face);
    }
    finish(f, first);
    if (def.kind == BOND_MESH_GRID) errors += outside_grid(m, def, bonds, first);
    const int made = bonds.nbond - first;
    if ((m.part.on ? comm_allreduce_max(made) : made) == 0) {
      log_error("%s %s (%s line %d): its surface %s holds no face",
                def.kind == BOND_CONTACT ? "contact" : "bond", def.name.c_str(), def.deck_line.file.c_str(),
                def.deck_line.line, s.name.c_str());
      ++errors;
    }
    if (def.kind == BOND_CONTACT) warn_same_way(m, pts, def);
  }
  bonds.nfixed = bonds.nbond;
  return m.part.on ? comm_allreduce_max(errors) : errors;
}

namespace {

// key of a bond that is kept when the mesh around it changes: nodes and weights of side A
using SlipKey = std::pair<int, std::vector<std::pair<int, long>>>;

SlipKey slip_key(const Bonds& b, int q)
{
  SlipKey key{b.def[q], {}};
  for (int k = b.a.off[q]; k < b.a.off[q + 1]; ++k)
    key.second.emplace_back(b.a.item[k], std::lround(b.a_w[k] * 1e9));
  return key;
}

// A face of general contact; a released point begins with new contact points (apart)
using FaceId = std::array<int, 3>;

FaceId face_id(const SkinFace& f, bool apart) { return {apart ? f.points : f.points > 0, f.elem, f.face}; }

// keeps the first n bonds
void cut_bonds(Bonds& b, int dim, int n)
{
  b.nbond = n;
  b.a.off.resize(n + 1);
  b.a.item.resize(b.a.off[n]);
  b.a_w.resize(b.a.off[n]);
  ContactState& c = b.contact;
  for (IntVec* v : {&b.def, &b.side, &b.field, &b.intermediate, &c.skin_of, &c.met, &c.wall}) v->resize(n);
  for (RealVec* v : {&b.area, &b.cn, &b.ct, &c.offset, &c.initial_penetration, &c.deep, &c.friction})
    v->resize(n);
  b.X.resize(3 * static_cast<size_t>(n));
  b.normal.resize(static_cast<size_t>(dim) * n);
  if (!b.name.empty()) b.name.resize(n);
}

}  // namespace

namespace {

// State that a rebuilt bond takes from the earlier bond of the same name
struct KeptBond {
  std::array<double, 3> slip{{0, 0, 0}}, lambda{{0, 0, 0}};
  double lambda_n = 0.0, offset = 0.0, initial_penetration = 0.0, deep = 0.0, area = 0.0;
  double cn = 0.0, ct = 0.0, friction = 0.0;   // general contact: of the face that it met
  SkinFace met;
  int wall = -1;
};

// Earlier bonds: by their keys; points of general contact face by face
struct KeptBonds {
  std::map<SlipKey, KeptBond> bond;
  std::vector<KeptBond> point;
  std::vector<std::pair<FaceId, int>> face;          // ascending; its first point
};

//   in   copies   points of general contact are copied: without them
KeptBonds keep_bonds(const Bonds& b, const Level& l, int dim, bool copies)
{
  const ContactState& c = b.contact;
  KeptBonds kept;
  int open = -1;               // face of the points being stored
  for (int q = b.nfixed; q < b.nbond; ++q) {
    if (copies && c.skin_of[q] >= 0) continue;
    KeptBond k;
    std::copy_n(&l.slip[q * dim], dim, k.slip.begin());
    std::copy_n(&l.lambda[q * dim], dim, k.lambda.begin());
    k.lambda_n = l.lambda_n[q];
    k.offset   = c.offset[q];
    k.initial_penetration    = c.initial_penetration[q];
    k.deep     = c.deep[q];
    k.area     = b.area[q];
    k.cn       = b.cn[q];
    k.ct       = b.ct[q];
    k.friction = c.friction[q];
    if (c.met[q] >= 0) k.met = c.skin[c.met[q]];
    k.wall = c.wall[q];
    if (c.skin_of[q] < 0) {
      kept.bond[slip_key(b, q)] = k;
      continue;
    }
    if (c.skin_of[q] != open) kept.face.emplace_back(face_id(c.skin[c.skin_of[q]], true), kept.point.size());
    open = c.skin_of[q];
    kept.point.push_back(k);
  }
  std::sort(kept.face.begin(), kept.face.end());
  return kept;
}

// index of the first item that is not before id
size_t find_id(const std::vector<std::pair<FaceId, int>>& list, const FaceId& id)
{
  const auto before = [](const std::pair<FaceId, int>& a, const FaceId& b) { return a.first < b; };
  return std::lower_bound(list.begin(), list.end(), id, before) - list.begin();
}

// earlier state of bond q, or of the first point of a face of general contact; null: new
const KeptBond* bond_before(const KeptBonds& kept, const Bonds& b, int q)
{
  if (b.contact.skin_of[q] < 0) {
    const auto it = kept.bond.find(slip_key(b, q));
    return it == kept.bond.end() ? nullptr : &it->second;
  }
  const FaceId id = face_id(b.contact.skin[b.contact.skin_of[q]], true);
  const size_t at = find_id(kept.face, id);
  if (at == kept.face.size() || kept.face[at].first != id) return nullptr;
  return &kept.point[kept.face[at].second];
}

// sets the state of the bonds from nfixed on: their earlier state, or zero. Returns the new contact points
IntVec restore_bonds(int dim, const KeptBonds& kept, Bonds& b, Level& l)
{
  ContactState& c = b.contact;
  IntVec fresh;
  const size_t fixed = static_cast<size_t>(b.nfixed), all = static_cast<size_t>(b.nbond);
  l.slip.resize(fixed * dim);
  l.lambda.resize(fixed * dim);
  l.lambda_n.resize(fixed);
  l.slip.resize(all * dim, 0.0);
  l.lambda.resize(all * dim, 0.0);
  l.lambda_n.resize(all, 0.0);
  std::vector<std::pair<FaceId, int>> skin;          // a released point keeps its faces
  for (size_t i = 0; i < c.skin.size(); ++i) skin.emplace_back(face_id(c.skin[i], false), i);
  std::sort(skin.begin(), skin.end());
  int first = b.nfixed;
  const KeptBond* before = nullptr;
  for (int q = b.nfixed; q < b.nbond; ++q) {
    if (q == b.nfixed || c.skin_of[q] < 0 || c.skin_of[q] != c.skin_of[first]) {
      first  = q;
      before = bond_before(kept, b, q);
    }
    const KeptBond* k = before ? before + (q - first) : nullptr;
    if (!k) {
      if (b.side[q] == SIDE_CONTACT) fresh.push_back(q);
      continue;
    }
    std::copy_n(k->slip.begin(), dim, &l.slip[q * dim]);
    std::copy_n(k->lambda.begin(), dim, &l.lambda[q * dim]);
    l.lambda_n[q] = k->lambda_n * (k->area > 0.0 ? b.area[q] / k->area : 1.0);   // contact: kept per area
    c.offset[q]   = k->offset;
    c.initial_penetration[q]    = k->initial_penetration;
    c.deep[q]     = k->deep;
    if (c.skin_of[q] < 0) continue;
    b.cn[q]       = k->cn;
    b.ct[q]       = k->ct;
    c.friction[q] = k->friction;
    c.wall[q]     = k->wall;
    if (k->met.elem < 0) continue;
    const FaceId met = face_id(k->met, false);
    const size_t at  = find_id(skin, met);
    if (at < skin.size() && skin[at].first == met) c.met[q] = skin[at].second;
  }
  return fresh;
}

// is it a contact pair with a slave surface of elements?
bool has_slave_elements(const Model& m, const BondDef& d)
{
  return d.kind == BOND_CONTACT && !d.contact.general && m.surface[d.surface].body < 0;
}

// Slave points of the deck keep the part of their area on faces of elements; the rest moves to faces of
// points. Forces are kept per area.
void shrink_slaves(const Model& m, const Points& pts, Bonds& b, Level& l)
{
  const int dim = m.dim;
  for (size_t d = 0; d < m.bond.size(); ++d) {
    if (!has_slave_elements(m, m.bond[d])) continue;
    if (pts.surface[m.bond[d].surface].empty()) continue;
    Bonds rest;
    BondBuilder f{m, rest, static_cast<int>(d), {}};
    for (const Face& s : m.surface[m.bond[d].surface].face)
      if (!pts.converted(s.elem)) form_face(f, face_nodes(m, pts, -1, s));
    finish(f, 0);
    std::map<SlipKey, int> find;
    for (int r = 0; r < rest.nbond; ++r) find[slip_key(rest, r)] = r;
    for (int q = 0; q < b.nfixed; ++q) {
      if (b.def[q] != static_cast<int>(d) || b.area[q] == 0.0) continue;
      const auto it      = find.find(slip_key(b, q));
      const int r        = it == find.end() ? -1 : it->second;
      const double share = r < 0 ? 0.0 : rest.area[r] / b.area[q];
      if (share == 1.0) continue;
      b.area[q] = r < 0 ? 0.0 : rest.area[r];
      b.cn[q]   = r < 0 ? 0.0 : rest.cn[r];
      b.ct[q]   = r < 0 ? 0.0 : rest.ct[r];
      l.lambda_n[q] *= share;
      for (int i = 0; i < dim; ++i) l.lambda[q * dim + i] *= share;
    }
  }
}

}  // namespace

// general contact: parts of an edge of a face, in 2D and 3D: the smallest numbers for which the stress error
// of a patch test is below 1e-3 from ten faces on (doc/verification/contact.md, G6)
// (test: contact/g6_patch.inp, contact/g6_patch_3d.inp)
const int SKIN_PARTS[4] = {0, 0, 4, 3};

namespace {

// points of general contact on face s of the skin
void form_skin_face(BondBuilder& f, const Points& pts, int s)
{
  Bonds& b          = f.b;
  const Model& m    = f.m;
  const BondDef& d  = m.bond[f.def];
  const SkinFace& k = b.contact.skin[s];
  const int elem = k.elem, first = b.nbond,
            parts          = d.intermediate >= 0 ? d.intermediate + 1 : SKIN_PARTS[m.dim];
  const FaceNodes face   = face_nodes(m, pts, k.points ? pts.body[elem] : -1, {elem, k.face});
  const double thickness = m.dim == 2 ? face.thickness : 1.0, penalty = skin_penalty(m, pts, d, k, face);
  b.contact.skin_penalty[s] = penalty;
  if (m.part.window && !point_skin_counts(m, pts, k)) return;
  if (m.part.on)
    f.name = k.points ? AT_POINTS + face_name(f.def, pts.part.point[elem], k.face)
                      : face_name(f.def, m.part.elem_number(elem), k.face);
  for (const FacePoint& p : face_lattice(face.n, face.X, parts)) {
    double N[4] = {0, 0, 0, 0};
    for (int c = 0; c < face.n; ++c) {
      N[c] = p.iw[c] / (static_cast<double>(parts) * parts);
      if (p.iw[c] == 0) continue;
      b.a.item.push_back(face.node[c]);
      b.a_w.push_back(N[c]);
    }
    const int q = new_bond(f, face, N);
    b.contact.skin_of[q] = s;
    if (f.name != NO_NAME) b.name.push_back(f.name++);
    add_area(f, face, p.xi, 0.5 * p.share * thickness, penalty, q);
  }
  finish(f, first);
}

}  // namespace

void bond_skin(const Model& m, const Points& pts, const std::vector<SkinFace>& skin, Bonds& b)
{
  b.contact.skin = skin;
  b.contact.skin_penalty.assign(skin.size(), 0.0);
  BondBuilder f{m, b, model_general_contact(m), {}};
  for (size_t s = 0; s < skin.size(); ++s) form_skin_face(f, pts, static_cast<int>(s));
}

namespace {

// adds items first ... last-1 of from, of some numbers each
template <class V>
void add_items(const V& from, int first, int last, int width, V& to)
{
  if (to.capacity() < from.size()) to.reserve(from.size() + from.size() / 8);
  to.insert(to.end(), from.begin() + static_cast<long>(first) * width,
            from.begin() + static_cast<long>(last) * width);
}

// adds the bonds first ... last-1 of before
void copy_bonds(const Bonds& before, int dim, int first, int last, Bonds& b)
{
  const ContactState& c = before.contact;
  ContactState& to      = b.contact;
  const int shift = static_cast<int>(b.a.item.size()) - before.a.off[first];
  add_items(before.a.item, before.a.off[first], before.a.off[last], 1, b.a.item);
  add_items(before.a_w, before.a.off[first], before.a.off[last], 1, b.a_w);
  for (int q = first; q < last; ++q) b.a.off.push_back(before.a.off[q + 1] + shift);
  const std::pair<const IntVec*, IntVec*> whole[] = {
      {&before.def, &b.def}, {&before.side, &b.side}, {&before.field, &b.field}, {&c.met, &to.met},
      {&before.intermediate, &b.intermediate}, {&c.skin_of, &to.skin_of}, {&c.wall, &to.wall}};
  const std::pair<const RealVec*, RealVec*> real[] = {
      {&before.area, &b.area}, {&before.cn, &b.cn}, {&before.ct, &b.ct}, {&c.offset, &to.offset},
      {&c.initial_penetration, &to.initial_penetration}, {&c.deep, &to.deep}, {&c.friction, &to.friction}};
  for (const auto& x : whole) add_items(*x.first, first, last, 1, *x.second);
  for (const auto& x : real) add_items(*x.first, first, last, 1, *x.second);
  add_items(before.X, first, last, 3, b.X);
  add_items(before.normal, first, last, dim, b.normal);
  b.nbond += last - first;
}

// Points of general contact before their faces change, with their state; one rank
struct SkinBefore {
  Bonds b;
  RealVec slip, lambda, lambda_n;
  IntVec from;                 // [skin] now: index of the face before, -1: new
  IntVec first;                // [skin + 1] before: its first point
  IntVec now;                  // [skin] before: index of the face now, if its point was released too; -1
};

// the faces of before, and those of the skin now
void match_skin(const std::vector<SkinFace>& skin, SkinBefore& s)
{
  const std::vector<SkinFace>& old = s.b.contact.skin;
  const auto order = [](const SkinFace& f) { return FaceId{{f.points > 0, f.elem, f.face}}; };
  s.from.assign(skin.size(), -1);
  s.now.assign(old.size(), -1);
  size_t k = 0;
  for (size_t i = 0; i < skin.size(); ++i) {         // both ascending
    while (k < old.size() && order(old[k]) < order(skin[i])) ++k;
    if (k == old.size() || order(old[k]) != order(skin[i])) continue;
    s.now[k] = static_cast<int>(i);
    if (old[k] == skin[i]) s.from[i] = static_cast<int>(k);
  }
  s.first.assign(old.size() + 1, s.b.nbond);
  for (int q = s.b.nbond - 1; q >= s.b.nfixed && s.b.contact.skin_of[q] >= 0; --q)
    s.first[s.b.contact.skin_of[q]] = q;
}

// moves all bonds to s, and leaves those of the deck; skin: its faces now
void take_skin(const std::vector<SkinFace>& skin, int dim, Bonds& b, Level& l, SkinBefore& s)
{
  std::swap(s.b, b);
  s.slip.swap(l.slip);
  s.lambda.swap(l.lambda);
  s.lambda_n.swap(l.lambda_n);
  match_skin(skin, s);
  b.nfixed = s.b.nfixed;
  copy_bonds(s.b, dim, 0, s.b.nfixed, b);
  add_items(s.slip, 0, s.b.nfixed, dim, l.slip);
  add_items(s.lambda, 0, s.b.nfixed, dim, l.lambda);
  add_items(s.lambda_n, 0, s.b.nfixed, 1, l.lambda_n);
}

// adds the points of face k before to b, with their state; i: the face now
void copy_skin_face(const SkinBefore& s, int dim, int k, int i, Bonds& b, Level& l)
{
  const int at = b.nbond, first = s.first[k], last = s.first[k + 1];
  copy_bonds(s.b, dim, first, last, b);
  b.contact.skin_penalty[i] = s.b.contact.skin_penalty[k];
  for (int q = at; q < b.nbond; ++q) {
    int& met = b.contact.met[q];
    b.contact.skin_of[q] = i;
    if (met >= 0) met = s.now[met];
  }
  add_items(s.slip, first, last, dim, l.slip);
  add_items(s.lambda, first, last, dim, l.lambda);
  add_items(s.lambda_n, first, last, 1, l.lambda_n);
}

// points of general contact: those of faces that stay keep their state; one rank
//   inout  fresh   new points are added
void renew_skin(const Model& m, const Points& pts, const std::vector<SkinFace>& skin, const SkinBefore& s,
                Bonds& b, Level& l, IntVec& fresh)
{
  b.contact.skin = skin;
  b.contact.skin_penalty.assign(skin.size(), 0.0);
  BondBuilder f{m, b, model_general_contact(m), {}};
  for (int i = 0; i < static_cast<int>(skin.size()); ++i) {
    if (s.from[i] >= 0) {
      copy_skin_face(s, m.dim, s.from[i], i, b, l);
      continue;
    }
    const int first = b.nbond;
    form_skin_face(f, pts, i);
    for (int q = first; q < b.nbond; ++q) fresh.push_back(q);
    l.slip.resize(static_cast<size_t>(b.nbond) * m.dim, 0.0);
    l.lambda.resize(static_cast<size_t>(b.nbond) * m.dim, 0.0);
    l.lambda_n.resize(b.nbond, 0.0);
  }
}

}  // namespace

IntVec bond_rebuild(const Model& m, const Points& pts, const std::vector<BondFace>& face,
                    const IntVec& node_lost, const std::vector<SkinFace>& skin, Bonds& b, Level& l)
{
  const int dim = m.dim;
  const bool copies = !m.part.on && !b.contact.skin.empty();
  const KeptBonds kept = keep_bonds(b, l, dim, copies);
  SkinBefore before;
  if (copies) take_skin(skin, dim, b, l, before);
  shrink_slaves(m, pts, b, l);
  for (int q = 0; q < b.nfixed; ++q)
    for (int k = b.a.off[q]; k < b.a.off[q + 1]; ++k) {
      if (b.a.item[k] >= m.mesh.nnode() || !node_lost[b.a.item[k]]) continue;
      b.area[q] = b.cn[q] = b.ct[q] = 0.0;
      for (int i = 0; i < dim; ++i) l.lambda[q * dim + i] = 0.0;
      l.lambda_n[q] = 0.0;
    }
  if (!copies) cut_bonds(b, dim, b.nfixed);
  for (size_t k = 0; k < face.size();) {             // faces are sorted by definition
    const int def = face[k].def, first = b.nbond;
    BondBuilder f{m, b, def, {}};
    for (; k < face.size() && face[k].def == def; ++k) {
      if (m.part.window) f.name = face_name(def, m.part.elem_number(face[k].face.elem), face[k].face.face);
      form_face(f, face_nodes(m, pts, -1, face[k].face));
    }
    finish(f, first);
  }
  for (size_t d = 0; d < m.bond.size(); ++d) {       // slave surfaces continue as faces of points
    if (!has_slave_elements(m, m.bond[d]) || !m.bond[d].contact.present) continue;
    const int first = b.nbond;
    BondBuilder f{m, b, static_cast<int>(d), {}};
    for (const Face& s : pts.surface[m.bond[d].surface]) {
      if (m.part.window) f.name = AT_POINTS + face_name(f.def, pts.part.point[s.elem], s.face);
      form_face(f, face_nodes(m, pts, pts.body[s.elem], s));
    }
    finish(f, first);
  }
  if (!copies) bond_skin(m, pts, skin, b);
  IntVec fresh = restore_bonds(dim, kept, b, l);
  if (copies) renew_skin(m, pts, skin, before, b, l, fresh);
  return fresh;
}
