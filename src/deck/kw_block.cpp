#include <cmath>

#include "deck/kw_mesh.h"

namespace {

struct Block {
  int dim = 2;
  double lo[3] = {0, 0, 0}, hi[3] = {0, 0, 0};
  int n[3] = {1, 1, 0};        // cells; none in z in the plane
  bool mapped = false;
  bool straight = false;       // quadratic types: midside nodes on straight edges
  Expr map[3];                 // final coordinates of a node
};

bool read_lines(Card& card, Block& b)
{
  const char* const axis[3] = {"X", "Y", "Z"};
  bool good = card_box(card, b.dim, "0", "1", b.lo, b.hi);
  if (!card_line(card)) {
    if (good)
      card_error(card, card.head.at,
                 std::string("the second data line, nx, ny") + (b.dim == 3 ? ", nz" : "") + ", is missing");
    return false;
  }
  good = card_cells(card, b.dim, b.n) && good;
  if (!card_line(card)) return good;
  b.mapped = true;
  for (int i = 0; i < b.dim; ++i) b.map[i] = card_expr(card, axis[i]);
  return good && card_good(card);
}

// coordinates of node i, j, k, mapped; also between nodes
template <class Number>
void node_position(const Block& b, const Number at[3], double x[3])
{
  double X[3] = {0, 0, 0};
  for (int i = 0; i < b.dim; ++i) X[i] = b.lo[i] + (b.hi[i] - b.lo[i]) * at[i] / b.n[i];
  for (int i = 0; i < 3; ++i) x[i] = b.mapped && i < b.dim ? expr_eval(b.map[i], X, 0.0) : X[i];
}

// bits of XMIN, XMAX, YMIN, YMAX, ZMIN, ZMAX
int sides_of(const Block& b, const int at[3])
{
  int side = 0;
  for (int i = 0; i < b.dim; ++i) {
    if (at[i] == 0) side |= 1 << 2 * i;
    if (at[i] == b.n[i]) side |= 2 << 2 * i;
  }
  return side;
}

bool make_nodes(Card& card, Model& model, const Block& b, Part& p)
{
  int at[3];
  for (at[2] = 0; at[2] <= b.n[2]; ++at[2])
    for (at[1] = 0; at[1] <= b.n[1]; ++at[1])
      for (at[0] = 0; at[0] <= b.n[0]; ++at[0]) {
        double x[3];
        node_position(b, at, x);
        if (part_node(card, model, x, sides_of(b, at), p)) continue;
        card_error(card, card.head.at,
                   text_format("%s no finite value at column %d, row %d",
                               b.mapped ? "the map has" : "the block has", at[0], at[1]) +
                       (b.dim == 3 ? text_format(", layer %d", at[2]) : "") + " of the nodes");
        return false;
      }
  return true;
}

void make_elems(Card& card, Model& model, const Block& b, Part& p)
{
  const int row = b.n[0] + 1, layer = row * (b.n[1] + 1);
  p.between = [&](int c, int e, double x[3]) {
    const double *from = &model.mesh.X[3 * static_cast<std::size_t>(p.node[c])],
                 *to   = &model.mesh.X[3 * static_cast<std::size_t>(p.node[e])];
    for (int i = 0; i < 3; ++i) x[i] = 0.5 * (from[i] + to[i]);
    if (b.straight) return;
    const double at[3] = {0.5 * (c % row + e % row), 0.5 * (c % layer / row + e % layer / row),
                          0.5 * (c / layer + e / layer)};
    node_position(b, at, x);
  };
  for (int k = 0; k < (b.dim == 3 ? b.n[2] : 1); ++k)
    for (int j = 0; j < b.n[1]; ++j)
      for (int i = 0; i < b.n[0]; ++i) {
        const int c = k * layer + j * row + i, u = c + layer;
        const int corner[8] = {c, c + 1, c + row + 1, c + row, u, u + 1, u + row + 1, u + row};
        if (!part_cell(card, model, corner, p))
          return card_error(card, card.head.at,
                            text_format("the map has no finite value between the nodes of column %d, row %d, "
                                        "layer %d", i, j, k));
      }
}

}  // namespace

// ---------------------------------------------------------------------------
// *BLOCK, TYPE=, ELSET=name[, MERGE][, EDGES=] : x0, y0[, z0], x1, y1[, z1] / nx, ny[, nz] / "X", "Y"[, "Z"]
// ---------------------------------------------------------------------------
void kw_block(Card& card, Model& model)
{
  Part p;
  Block b;
  const bool named = part_open(card, model, {"XMIN", "XMAX", "YMIN", "YMAX"}, p);
  b.dim = p.type < 0 ? model.dim : shape_info[elem_table[p.type].shape].dim;
  b.straight = card_param_word(card, "EDGES", "MAPPED|STRAIGHT", 0) == 1;
  if (b.dim == 3) p.side_name.insert(p.side_name.end(), {"ZMIN", "ZMAX"});
  if (!read_lines(card, b) || !named) return;
  double nodes = 1.0, cells = 1.0, diagonal = 0.0;
  for (int i = 0; i < b.dim; ++i) {
    nodes *= b.n[i] + 1.0;
    cells *= b.n[i];
    diagonal = std::hypot(diagonal, b.hi[i] - b.lo[i]);
  }
  if (!part_room(card, model, nodes, cells, diagonal, p)) return;
  if (!make_nodes(card, model, b, p)) return;
  make_elems(card, model, b, p);
  part_close(card, model, p);
}
