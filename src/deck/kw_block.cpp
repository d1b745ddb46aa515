#include <cmath>
#include <functional>

#include "deck/card.h"

namespace {

struct Block {
  double lo[2], hi[2];
  int n[2];                    // cells
  bool mapped = false;
  Expr map[2];                 // final place of a node
  IntVec node;                 // [(n0+1)*(n1+1)] index, row by row in x
  IntVec elem;
};

// nodes that exist already, by cells a little larger than the tolerance
struct NearNodes {
  double tol = 0.0;
  std::unordered_multimap<std::size_t, int> cell;
};

// two cells with the same key cost time only: the distance decides
std::size_t cell_key(double i, double j) { return std::hash<double>()(i) * 31 + std::hash<double>()(j); }

void near_open(NearNodes& near, const Mesh& mesh, double tol)
{
  near.tol = tol;
  for (int n = 0; n < mesh.nnode(); ++n) {
    const double* x = &mesh.X[3 * static_cast<std::size_t>(n)];
    near.cell.emplace(cell_key(std::floor(x[0] / (4 * tol)), std::floor(x[1] / (4 * tol))), n);
  }
}

int near_find(const NearNodes& near, const Mesh& mesh, const double x[3])
{
  for (int k = 0; k < 4; ++k) {
    const double i = std::floor((x[0] + (k & 1 ? near.tol : -near.tol)) / (4 * near.tol));
    const double j = std::floor((x[1] + (k & 2 ? near.tol : -near.tol)) / (4 * near.tol));
    const auto range = near.cell.equal_range(cell_key(i, j));
    for (auto c = range.first; c != range.second; ++c) {
      const double* y = &mesh.X[3 * static_cast<std::size_t>(c->second)];
      if (std::hypot(x[0] - y[0], x[1] - y[1]) <= near.tol) return c->second;
    }
  }
  return -1;
}

bool read_lines(Card& card, Block& b)
{
  for (int i = 0; i < 2; ++i) b.lo[i] = card_real(card, i ? "y0" : "x0", any_number());
  for (int i = 0; i < 2; ++i) b.hi[i] = card_real(card, i ? "y1" : "x1", above(b.lo[i]));
  bool good = card_good(card);
  if (!card_line(card)) {
    if (good) card_error(card, card.head.at, "the second data line, nx, ny, is missing");
    return false;
  }
  for (int i = 0; i < 2; ++i) b.n[i] = card_int(card, i ? "ny" : "nx", 1, 50000000);
  if (card_good(card) && static_cast<double>(b.n[0]) * b.n[1] > 5e7)
    card_error(card, card.whole, text_format("%d x %d cells; at most 5e7 are allowed", b.n[0], b.n[1]));
  good = good && card_good(card);
  if (!card_line(card)) return good;
  b.mapped = true;
  for (int i = 0; i < 2; ++i) b.map[i] = card_expr(card, i ? "Y" : "X");
  return good && card_good(card);
}

bool labels_fit(Card& card, const Mesh& mesh, const Block& b, int per_cell)
{
  const double nodes = (b.n[0] + 1.0) * (b.n[1] + 1.0) + mesh_max_label(mesh.node_label);
  const double elems = static_cast<double>(per_cell) * b.n[0] * b.n[1] + mesh_max_label(mesh.elem_label);
  if (nodes < 2147483647.0 && elems < 2147483647.0 && nodes + mesh.nnode() < 4e8) return true;
  card_error(card, card.whole, "labels would pass 2147483647: the largest label before this block is too large");
  return false;
}

bool make_nodes(Card& card, Model& model, Block& b)
{
  NearNodes near;
  const double diagonal = std::hypot(b.hi[0] - b.lo[0], b.hi[1] - b.lo[1]);
  const bool merge = card_flag(card, "MERGE");
  if (merge) near_open(near, model.mesh, 1e-9 * diagonal);
  int label = mesh_max_label(model.mesh.node_label);
  model.mesh.node_index.reserve(model.mesh.node_index.size() + (b.n[0] + 1u) * (b.n[1] + 1u));
  for (int j = 0; j <= b.n[1]; ++j)
    for (int i = 0; i <= b.n[0]; ++i) {
      double x[3] = {b.lo[0] + (b.hi[0] - b.lo[0]) * i / b.n[0], b.lo[1] + (b.hi[1] - b.lo[1]) * j / b.n[1], 0.0};
      if (b.mapped) {
        const double place[2] = {expr_eval(b.map[0], x, 0.0), expr_eval(b.map[1], x, 0.0)};
        x[0] = place[0];
        x[1] = place[1];
      }
      if (!std::isfinite(x[0]) || !std::isfinite(x[1])) {
        card_error(card, card.head.at, text_format("%s no finite value at column %d, row %d of the nodes", b.mapped ? "the map has" : "the block has", i, j));
        return false;
      }
      const int old = merge ? near_find(near, model.mesh, x) : -1;
      b.node.push_back(old >= 0 ? old : mesh_add_node(*card.deck, model, ++label, x[0], x[1], 0.0, card.head.at));
    }
  return true;
}

// a cell is a quadrilateral or two triangles cut from lower left to upper right
void make_elems(Card& card, Model& model, Block& b, int type)
{
  int label = mesh_max_label(model.mesh.elem_label);
  const bool triangles = elem_table[type].shape == SHAPE_TRI3;
  model.mesh.elem_index.reserve(model.mesh.elem_index.size() + (triangles ? 2u : 1u) * b.n[0] * b.n[1]);
  for (int j = 0; j < b.n[1]; ++j)
    for (int i = 0; i < b.n[0]; ++i) {
      const int* low = &b.node[static_cast<std::size_t>(j) * (b.n[0] + 1) + i];
      const int* up  = low + b.n[0] + 1;
      const int quad[4] = {low[0], low[1], up[1], up[0]}, second[3] = {low[0], up[1], up[0]};
      b.elem.push_back(mesh_add_elem(*card.deck, model, ++label, type, quad, card.head.at));
      if (triangles) b.elem.push_back(mesh_add_elem(*card.deck, model, ++label, type, second, card.head.at));
    }
}

// nodes and faces of the edge side = 0 1 2 3: XMIN XMAX YMIN YMAX
void make_edge(Card& card, Model& model, const Block& b, int type, int side, const std::string& name)
{
  const bool triangles = elem_table[type].shape == SHAPE_TRI3;
  const int along = side < 2 ? 1 : 0, nx = b.n[0], ny = b.n[1];
  const int face_quad[4] = {3, 1, 0, 2}, face_tri[4] = {2, 1, 0, 1}, which_tri[4] = {1, 0, 0, 1};
  IntVec node;
  Surface s;
  for (int k = 0; k <= b.n[along]; ++k) {
    const int i = along ? (side == 1 ? nx : 0) : k, j = along ? k : (side == 3 ? ny : 0);
    node.push_back(b.node[static_cast<std::size_t>(j) * (nx + 1) + i]);
    if (k == b.n[along]) break;
    const int ci = along ? (side == 1 ? nx - 1 : 0) : k, cj = along ? k : (side == 3 ? ny - 1 : 0);
    const std::size_t cell = static_cast<std::size_t>(cj) * nx + ci;
    if (triangles) s.face.push_back(Face{b.elem[2 * cell + which_tri[side]], face_tri[side]});
    else s.face.push_back(Face{b.elem[cell], face_quad[side]});
  }
  set_merge(model.nset, name, node, card_place(card));
  s.name = name;
  s.place = card_place(card);
  model.surface.push_back(s);
}

}  // namespace

// ---------------------------------------------------------------------------
// *BLOCK, TYPE=, ELSET=name[, MERGE] : x0, y0, x1, y1 / nx, ny / "X", "Y"
// ---------------------------------------------------------------------------
void kw_block(Card& card, Model& model)
{
  const char* const edge[4] = {"_XMIN", "_XMAX", "_YMIN", "_YMAX"};
  const int type = card_param_word(card, "TYPE", element_type_words().c_str(), -1);
  const std::string name = card_param_name(card, "ELSET");
  Block b;
  if (!read_lines(card, b) || type < 0 || name.empty()) return;
  if (model_find_elset(model, name) >= 0 || model_find_surface(model, name + edge[0]) >= 0)
    return card_error(card, card.head.at, "the name " + name + " is taken already; a block needs a new one");
  if (!labels_fit(card, model.mesh, b, elem_table[type].shape == SHAPE_TRI3 ? 2 : 1)) return;
  if (!make_nodes(card, model, b)) return;
  make_elems(card, model, b, type);
  for (int side = 0; side < 4; ++side) make_edge(card, model, b, type, side, name + edge[side]);
  set_merge(model.elset, name, b.elem, card_place(card));
  set_merge(model.nset, name, b.node, card_place(card));
}
