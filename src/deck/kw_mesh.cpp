#include "deck/kw_mesh.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "base/log.h"

namespace {

// cut of a cell into n elements of nen nodes, given as corners of the cell
struct Cut {
  int n, nen;
  int corner[6][8];            // CENTRE: node at the centre of the cell
};
const int CENTRE = 8;

// Corners of the quadrilateral and of the lower face of the brick: counter-clockwise from lower left.
// Triangles and wedges are cut from lower left to upper right. The six tetrahedra share the diagonal 0 - 6,
// so that the diagonals of adjacent cells match.
const Cut cut_quad = {1, 4, {{0, 1, 2, 3}}};
const Cut cut_tri  = {2, 3, {{0, 1, 2}, {0, 2, 3}}};
const Cut cut_hex  = {1, 8, {{0, 1, 2, 3, 4, 5, 6, 7}}};
const Cut cut_wedge = {2, 6, {{0, 1, 2, 4, 5, 6}, {0, 2, 3, 4, 6, 7}}};
const Cut cut_tet = {
    6, 4, {{0, 1, 2, 6}, {0, 2, 3, 6}, {0, 3, 7, 6}, {0, 7, 4, 6}, {0, 4, 5, 6}, {0, 5, 1, 6}}};

const Cut cut_pyramid = {6, 5, {{0, 1, 2, 3, CENTRE}, {4, 7, 6, 5, CENTRE}, {0, 4, 5, 1, CENTRE},
                               {1, 5, 6, 2, CENTRE}, {2, 6, 7, 3, CENTRE}, {3, 7, 4, 0, CENTRE}}};

const Cut& cut_of(int type)
{
  switch (shape_info[elem_table[type].shape].linear) {
    case SHAPE_TRI3:   return cut_tri;
    case SHAPE_TET4:   return cut_tet;
    case SHAPE_WEDGE6: return cut_wedge;
    case SHAPE_HEX8:   return cut_hex;
    case SHAPE_PYR5:   return cut_pyramid;
    case SHAPE_QUAD4:  return cut_quad;
    case SHAPE_TRI6: case SHAPE_QUAD8: case SHAPE_QUAD8R: case SHAPE_TET10: case SHAPE_WEDGE15:
    case SHAPE_HEX20: case SHAPE_HEX20R: case SHAPES: break;
  }
  MPFE_CHECK(false, "cut_of: no shape of corners");
}

// hash of a cell; collisions are resolved by the distance of the nodes
std::size_t cell_key(double i, double j, double k)
{
  const std::hash<double> h;
  return (h(i) * 31 + h(j)) * 31 + h(k);
}

int find_merged(const Part& p, const Mesh& mesh, const double x[3])
{
  for (int c = 0; c < 8; ++c) {
    double at[3];
    for (int i = 0; i < 3; ++i) at[i] = std::floor((x[i] + (c >> i & 1 ? p.tol : -p.tol)) / (4 * p.tol));
    const auto range = p.close_nodes.equal_range(cell_key(at[0], at[1], at[2]));
    for (auto n = range.first; n != range.second; ++n) {
      const double* y = &mesh.X[3 * static_cast<std::size_t>(n->second)];
      if (std::hypot(x[0] - y[0], x[1] - y[1], x[2] - y[2]) <= p.tol) return n->second;
    }
  }
  return -1;
}

void add_faces(Part& p, int e, const int* part_node_of)
{
  const ShapeInfo& info = shape_info[elem_table[p.type].shape];
  for (int f = 0; f < info.nface; ++f) {
    int common = ~0;
    for (int a = 0; a < info.nfnode[f]; ++a) common &= p.side[part_node_of[info.face[f][a]]];
    for (std::size_t s = 0; s < p.side_name.size(); ++s)
      if (common >> s & 1) p.face[s].push_back(Face{e, f});
  }
}

}  // namespace

bool part_open(Card& card, Model& model, const std::vector<std::string>& sides, Part& p)
{
  p.side_name = sides;
  p.type = card_param_element(card);
  p.name = card_param_name(card, "ELSET");
  if (p.type < 0 || p.name.empty()) return false;
  bool taken = model_find_elset(model, p.name) >= 0;
  for (const std::string& side : sides) taken = taken || model_find_surface(model, p.name + "_" + side) >= 0;
  if (taken)
    card_error(card, card.head.at,
               "the name " + p.name + " is in use already; *" + card.head.word + " needs a new one");
  return !taken;
}

bool part_room(Card& card, Model& model, double nodes, double cells, double size, Part& p)
{
  Mesh& mesh = model.mesh;
  const int per_cell = cut_of(p.type).n;
  if (elem_quadratic(p.type)) nodes *= per_cell > 1 ? 8 : 4;       // upper bound of edges per corner
  if (&cut_of(p.type) == &cut_pyramid) nodes += cells;
  if (cells > 5e7) {
    card_error(card, card.whole, text_format("%.9g cells; at most 5e7 are allowed", cells));
    return false;
  }
  p.node_label = mesh_max_label(mesh.node_label);
  p.elem_label = mesh_max_label(mesh.elem_label);
  if (nodes + p.node_label >= 2147483647.0 || per_cell * cells + p.elem_label >= 2147483647.0 ||
      nodes + mesh.nnode() >= 4e8) {
    card_error(card, card.whole,
               "labels would exceed 2147483647: the largest label before this line is too large");
    return false;
  }
  if (!card_flag(card, "MERGE")) return true;
  p.tol = 1e-9 * size;
  for (int n = 0; n < mesh.nnode(); ++n) {
    if (mesh.node_label[n] < 0) continue;            // twin of *TRANSFORM
    const double* x = &mesh.X[3 * static_cast<std::size_t>(n)];
    p.close_nodes.emplace(cell_key(std::floor(x[0] / (4 * p.tol)), std::floor(x[1] / (4 * p.tol)),
                                   std::floor(x[2] / (4 * p.tol))),
                   n);
  }
  return true;
}

bool part_node(Card& card, Model& model, const double x[3], int side, Part& p)
{
  if (!std::isfinite(x[0]) || !std::isfinite(x[1]) || !std::isfinite(x[2])) return false;
  const int old = p.tol > 0.0 ? find_merged(p, model.mesh, x) : -1;
  p.node.push_back(
      old >= 0 ? old : mesh_add_node(*card.deck, model, ++p.node_label, x[0], x[1], x[2], card.head.at));
  p.side.push_back(side);
  return true;
}

namespace {

// midside node a of a quadratic element, created once for each edge; -1: no finite coordinates
int middle_node(Card& card, Model& model, int a, const int* corner, Part& p)
{
  int local[2];
  shape_edge(elem_table[p.type].shape, a, local);
  const int i = corner[local[0]], j = corner[local[1]];
  const auto known = p.middle.find(std::minmax(i, j));
  if (known != p.middle.end()) return known->second;
  double x[3];
  p.between(i, j, x);
  if (!part_node(card, model, x, p.side[i] & p.side[j], p)) return -1;
  return p.middle[std::minmax(i, j)] = static_cast<int>(p.node.size()) - 1;
}

// node at the centre of a cell with eight corners
int centre_node(Card& card, Model& model, const int* corner, Part& p)
{
  double x[3] = {0, 0, 0};
  for (int a = 0; a < 8; ++a)
    for (int i = 0; i < 3; ++i) x[i] += model.mesh.X[3 * static_cast<std::size_t>(p.node[corner[a]]) + i] / 8;
  return part_node(card, model, x, 0, p) ? static_cast<int>(p.node.size()) - 1 : -1;
}

}  // namespace

bool part_cell(Card& card, Model& model, const int* corners, Part& p)
{
  const Cut& cut = cut_of(p.type);
  int corner[CENTRE + 1];
  std::copy(corners, corners + (model.dim == 3 ? 8 : 4), corner);
  if (&cut == &cut_pyramid && (corner[CENTRE] = centre_node(card, model, corner, p)) < 0) return false;
  for (int k = 0; k < cut.n; ++k) {
    int local_node[MAX_NODES], node[MAX_NODES];
    for (int a = 0; a < cut.nen; ++a) local_node[a] = corner[cut.corner[k][a]];
    const int nen = shape_info[elem_table[p.type].shape].nen;
    for (int a = cut.nen; a < nen; ++a) {
      local_node[a] = middle_node(card, model, a, local_node, p);
      if (local_node[a] < 0) return false;
    }
    for (int a = 0; a < nen; ++a) node[a] = p.node[local_node[a]];
    p.elem.push_back(mesh_add_elem(*card.deck, model, ++p.elem_label, p.type, node, card.head.at));
    add_faces(p, p.elem.back(), local_node);
  }
  return true;
}

void part_close(Card& card, Model& model, Part& p)
{
  for (std::size_t s = 0; s < p.side_name.size(); ++s) {
    IntVec node;
    for (std::size_t n = 0; n < p.node.size(); ++n)
      if (p.side[n] >> s & 1) node.push_back(p.node[n]);
    Surface surface;
    surface.name  = p.name + "_" + p.side_name[s];
    surface.deck_line = card_deck_line(card);
    surface.face.swap(p.face[s]);
    set_merge(model.nset, surface.name, node, card_deck_line(card));
    model.surface.push_back(surface);
  }
  set_merge(model.elset, p.name, p.elem, card_deck_line(card));
  set_merge(model.nset, p.name, p.node, card_deck_line(card));
}
