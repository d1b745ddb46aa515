#include "point/grid_halo.h"

namespace {

// material in the active cells
struct CellFill {
  // [ncell] maximum over the points that reach into the cell; broken points with their residual stiffness
  RealVec E, rho, thickness;
  std::vector<char> boundary;  // [ncell] a neighbour is not active
};

template <int D>
void fill_cells(const Model& m, const Points& pts, const RealVec& uc, const std::vector<long>& cell,
                CellFill& f)
{
  f.E.assign(cell.size(), 0.0);
  f.rho = f.thickness = f.E;
  CellPosition s;
  for (int q = 0; q < pts.npoint; ++q) {
    if (pts.released[q]) continue;
    const Body& body    = m.body[pts.body[q]];
    const Material& mat = m.material[body.material];
    const double E      = mat.young * (pts.broken[q] < 0 ? 1.0 : m.fracture[pts.broken[q]].stiffness);
    const int field     = pts.field[pts.conn.begin(q)[0]];
    double mid[D] = {}, x[D];
    const auto reach = [&](const double* at) {
      if (!locate<D>(m.grid, at, s)) return;
      const int c = find_key(cell, cell_key(m.grid, D, field, s.cell));
      if (c < 0) return;
      f.E[c]         = std::max(f.E[c], E);
      f.rho[c]       = std::max(f.rho[c], mat.density);
      f.thickness[c] = std::max(f.thickness[c], D == 2 ? body.thickness : 1.0);
    };
    const double* w = pts.w(q);
    for (int a = 0; a < pts.conn.count(q); ++a) {
      const size_t c = static_cast<size_t>(pts.conn.begin(q)[a]) * D;
      for (int i = 0; i < D; ++i) {
        x[i] = pts.Xc[c + i] + uc[c + i];
        mid[i] += w[a] * x[i];
      }
      reach(x);
    }
    reach(mid);
  }
}

// the active cell adjacent to cell c in direction axis, next (by = 1) or previous (by = -1); -1: not active
int neighbour(const Grid& g, int dim, const std::vector<long>& cell, int c, int axis, int by)
{
  int at[3];
  const int field = cell_of_key(g, dim, cell[c], at);
  at[axis] += by;
  return at[axis] < 0 || at[axis] >= g.n[axis] ? -1 : find_key(cell, cell_key(g, dim, field, at));
}

// Gauss points on the face between a cell and the next one in direction axis, exact for the square of the
// jump.
// Jump of the normal gradient times h: sum_k N_k (u_k(before) - 2 u_k + u_k(after)) over the nodes k of the
// face.
template <int D>
void add_face(const Model& m, const std::vector<long>& node, long cell, int axis, double k, double mass,
              ActiveGrid& g)
{
  const int corners = 1 << (D - 1);
  const double gauss = 0.5 / std::sqrt(3.0);
  int at[3], list[3 << (D - 1)];
  const int field = cell_of_key(m.grid, D, cell, at);
  for (int a = 0; a < corners; ++a)
    for (int j = 0; j < 3; ++j) {
      int to[3] = {at[0], at[1], at[2]};
      for (int i = 0, bit = 0; i < D; ++i) to[i] += i == axis ? j : (a >> bit++) & 1;
      list[3 * a + j] = find_key(node, node_key(m.grid, D, field, to));
      if (list[3 * a + j] < 0) return;               // no corner touches that node
    }
  for (int q = 0; q < corners; ++q) {
    for (int a = 0; a < corners; ++a) {
      double N = 1.0;
      for (int bit = 0; bit < D - 1; ++bit) N *= 0.5 + (((a ^ q) >> bit) & 1 ? -gauss : gauss);
      for (int j = 0; j < 3; ++j) {
        g.ghost.item.push_back(list[3 * a + j]);
        g.ghost_w.push_back(j == 1 ? -2.0 * N : N);
      }
    }
    g.ghost.off.push_back(static_cast<int>(g.ghost.item.size()));
    g.ghost_k.push_back(k / corners);
    g.ghost_m.push_back(mass / corners);
  }
}

template <int D>
void add_faces(const Model& m, const std::vector<long>& node, const std::vector<long>& cell,
               const CellFill& f, const KeyHalo* halo, ActiveGrid& g)
{
  const Grid& grid = m.grid;
  for (int c = 0; c < static_cast<int>(cell.size()); ++c)
    for (int axis = 0; axis < D; ++axis) {
      if (halo && !halo->counts(c)) continue;
      const int n = neighbour(grid, D, cell, c, axis, 1);
      if (n < 0 || !(f.boundary[c] || f.boundary[n])) continue;
      double area = std::min(f.thickness[c], f.thickness[n]);
      for (int i = 0; i < D; ++i) area *= i == axis ? 1.0 : grid.h[i];
      const double h = grid.h[axis];
      add_face<D>(m, node, cell[c], axis, grid.ghost_stiffness * std::min(f.E[c], f.E[n]) * area / h,
                  grid.ghost_mass * std::min(f.rho[c], f.rho[n]) * area * h / 3.0, g);
    }
}

template <int D>
void ghost(const Model& m, const Points& pts, const RealVec& uc, const std::vector<long>& node,
           const KeyHalo* halo, ActiveGrid& g)
{
  const std::vector<long>& cell = halo ? halo->key : g.cell;
  CellFill f;
  fill_cells<D>(m, pts, uc, cell, f);
  if (halo)
    for (RealVec* x : {&f.E, &f.rho, &f.thickness}) key_max(*halo, *x);
  f.boundary.assign(cell.size(), 0);
  for (int c = 0; c < static_cast<int>(cell.size()); ++c)
    for (int axis = 0; axis < D; ++axis)
      for (int by : {-1, 1}) f.boundary[c] |= neighbour(m.grid, D, cell, c, axis, by) < 0;
  add_faces<D>(m, node, cell, f, halo, g);
}

}  // namespace

void grid_ghost(const Model& m, const Points& pts, const RealVec& uc, const std::vector<long>& node,
                const KeyHalo* halo, ActiveGrid& g)
{
  g.ghost = ListTable();
  g.ghost_w.clear();
  g.ghost_k.clear();
  g.ghost_m.clear();
  if (m.grid.ghost_stiffness <= 0.0 && m.grid.ghost_mass <= 0.0) return;
  if (m.dim == 2) ghost<2>(m, pts, uc, node, halo, g);
  else ghost<3>(m, pts, uc, node, halo, g);
}
