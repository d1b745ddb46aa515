#include "frac/frac_scan.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/SparseCholesky>

#include "shape/shape.h"

// A sharp crack in a square of small cells around the tip, with the displacements of the mesh on its border.
// x along the crack, the tip at 0; cells have the material of the mesh there.                       (7.38)

namespace {

// cells in the size of an element; half a side of the square in sizes of an element
const int CELLS = 4, HALF = 6, SIDE = 2 * CELLS * HALF, NODES = SIDE + 1;
const int TIP   = SIDE / 2;    // column of the tip, row of the crack
// in sizes of an element: what is cracked and lies so far from the line of the crack is void
const double SLOT = 0.75;

struct Cell {
  double lam = 0.0, mu = 0.0;  // times thickness
  bool there = false;
};

struct Square {
  double h;                    // of a cell
  std::vector<Cell> cell;      // [SIDE*SIDE]
  // nodes; those of the crack once more after them, for the cells above it
  std::vector<std::array<double, 2>> given;          // displacement on the border
  std::vector<char> held;
};

int node_at(int column, int row) { return row * NODES + column; }
bool on_border(int column, int row)
{
  return column == 0 || row == 0 || column == NODES - 1 || row == NODES - 1;
}

Square empty_square(double h)
{
  return {h / CELLS, std::vector<Cell>(SIDE * SIDE), std::vector<std::array<double, 2>>(NODES * NODES),
          std::vector<char>(NODES * NODES, 0)};
}

// ---- stiffness and energy

// stiffness of a square cell, which does not depend on its size          [8*8]
void cell_stiffness(const Cell& c, double K[8][8])
{
  const double g = 1.0 / std::sqrt(3.0);
  std::fill_n(K[0], 64, 0.0);
  for (double x : {-g, g})
    for (double y : {-g, g}) {
      const double dN[4][2] = {{y - 1, x - 1}, {1 - y, -1 - x}, {1 + y, 1 + x}, {-1 - y, 1 - x}};
      for (int a = 0; a < 4; ++a)
        for (int b = 0; b < 4; ++b)
          for (int i = 0; i < 2; ++i)
            for (int j = 0; j < 2; ++j) {
              const double dot = i == j ? dN[a][0] * dN[b][0] + dN[a][1] * dN[b][1] : 0.0;
              K[2 * a + i][2 * b + j] +=
                  (c.lam * dN[a][i] * dN[b][j] + c.mu * (dN[a][j] * dN[b][i] + dot)) / 16.0;
            }
    }
}

// nodes of a cell when the crack is open up to a column; those above it are the second ones there
void cell_nodes(int column, int row, int open, int node[4])
{
  node[0] = node_at(column, row);
  node[1] = node_at(column + 1, row);
  node[2] = node_at(column + 1, row + 1);
  node[3] = node_at(column, row + 1);
  if (row != TIP) return;
  if (column < open) node[0] = NODES * NODES + column;
  if (column + 1 < open) node[1] = NODES * NODES + column + 1;
}

// strain energy with the crack open up to a column
double energy_open(const Square& q, int open)
{
  const int total = NODES * NODES + open;
  std::vector<char> used(total, 0);
  for (int k = 0; k < SIDE * SIDE; ++k) {
    int node[4];
    cell_nodes(k % SIDE, k / SIDE, open, node);
    for (int n : node) used[n] |= q.cell[k].there;
  }
  IntVec eqn(total, -1);
  int neq = 0;
  for (int n = 0; n < total; ++n)
    if (used[n] && (n >= NODES * NODES || !q.held[n])) eqn[n] = 2 * neq++;
  std::vector<Eigen::Triplet<double>> entry;
  Eigen::VectorXd load = Eigen::VectorXd::Zero(2 * neq);
  double fixed = 0.0;          // energy of the given displacements alone
  for (int k = 0; k < SIDE * SIDE; ++k) {
    if (!q.cell[k].there) continue;
    int node[4];
    double K[8][8];
    cell_nodes(k % SIDE, k / SIDE, open, node);
    cell_stiffness(q.cell[k], K);
    const auto value = [&](int a) { return eqn[node[a / 2]] < 0 ? q.given[node[a / 2]][a % 2] : 0.0; };
    for (int a = 0; a < 8; ++a)
      for (int b = 0; b < 8; ++b) {
        const int i = eqn[node[a / 2]], j = eqn[node[b / 2]];
        if (i >= 0 && j >= 0) entry.emplace_back(i + a % 2, j + b % 2, K[a][b]);
        else if (i >= 0) load[i + a % 2] -= K[a][b] * value(b);
        else if (j < 0) fixed += 0.5 * K[a][b] * value(a) * value(b);
      }
  }
  Eigen::SparseMatrix<double> A(2 * neq, 2 * neq);
  A.setFromTriplets(entry.begin(), entry.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(A);
  if (factor.info() != Eigen::Success) return 0.0;
  return fixed - 0.5 * load.dot(factor.solve(load));
}

// energy per length of the crack that goes on between two columns, from the tip
double release(const Square& q, int from, int to)
{
  return (energy_open(q, TIP + from) - energy_open(q, TIP + to)) / ((to - from) * q.h);
}

// ---- what stands in the square

// the square in the mesh: axis along the crack, tip
struct CrackAxes {
  const double *tip, *d;
  void place(double along, double across, double* x) const
  {
    x[0] = tip[0] + along * d[0] - across * d[1];
    x[1] = tip[1] + along * d[1] + across * d[0];
    x[2] = 0.0;
  }
};

// the element in which a place lies, of what is cracked along the line the one beside it; -1: void
int element_of(const Scan& s, const CrackAxes& f, double along, double across, double h)
{
  double x[3];
  f.place(along, across, x);
  int o = element_at(s, x, 1.5 * h);
  const double side = across < 0.0 ? -1.0 : 1.0;
  for (double way : {side, -side}) {
    if (o < 0 || !s.cracked(o) || std::fabs(across) > SLOT * h) break;
    f.place(along, across + way * h, x);
    const int next = element_at(s, x, 1.5 * h);
    if (next >= 0 && s.intact(next)) o = next;
  }
  return o >= 0 && s.intact(o) ? o : -1;
}

void fill_cells(const Scan& s, const CrackAxes& f, double h, Square& q)
{
  for (int k = 0; k < SIDE * SIDE; ++k) {
    const int o = element_of(s, f, (k % SIDE + 0.5 - TIP) * q.h, (k / SIDE + 0.5 - TIP) * q.h, h);
    if (o < 0) continue;
    const MatLaw& law = s.law(o);
    q.cell[k] = {law.lam * s.fm.thickness[o], law.mu * s.fm.thickness[o], true};
  }
}

// displacement of the mesh at x; false: nothing intact is there
bool displacement_at(const Scan& s, const double* x, double h, double* u)
{
  bool found = false;
  frac_near(s.fm, x, 1.5 * h, [&](int o, double) {
    if (found || !s.intact(o)) return;
    const Shape shape = s.el.block[s.el.initial_block[o]].shape;
    const int nen = shape_info[shape].nen, *node = s.m.mesh.conn.begin(o);
    double X[24], xi[3], N[8];
    for (int a = 0; a < nen; ++a)
      for (int i = 0; i < 2; ++i) X[2 * a + i] = s.m.mesh.X[3 * node[a] + i];
    if (!shape_inverse(shape, X, x, xi) || !shape_inside(shape, xi, 1e-6)) return;
    shape_eval(shape, xi, N, nullptr);
    u[0] = u[1] = 0.0;
    for (int a = 0; a < nen; ++a)
      for (int i = 0; i < 2; ++i) u[i] += N[a] * s.l.u[2 * node[a] + i];
    found = true;
  });
  return found;
}

// turns displacements back by the mean rotation of the border, in the axes of the crack
void turn_back(const CrackAxes& f, Square& q)
{
  double turn = 0.0, size = 0.0, mean[2] = {0, 0}, n = 0.0;
  const auto each = [&](auto use) {
    for (int k = 0; k < NODES * NODES; ++k)
      if (q.held[k]) use((k % NODES - TIP) * q.h, (k / NODES - TIP) * q.h, q.given[k]);
  };
  each([&](double, double, std::array<double, 2>& u) {
    u = {u[0] * f.d[0] + u[1] * f.d[1], u[1] * f.d[0] - u[0] * f.d[1]};
    for (int i = 0; i < 2; ++i) mean[i] += u[i];
    ++n;
  });
  each([&](double x, double y, std::array<double, 2>& u) {
    const double p[2] = {x + u[0] - mean[0] / n, y + u[1] - mean[1] / n};
    turn += x * p[1] - y * p[0];
    size += x * p[0] + y * p[1];
  });
  const double angle = std::atan2(turn, size), c = std::cos(angle), t = std::sin(angle);
  each([&](double x, double y, std::array<double, 2>& u) {
    const double p[2] = {x + u[0] - mean[0] / n, y + u[1] - mean[1] / n};
    u = {c * p[0] + t * p[1] - x, c * p[1] - t * p[0] - y};
  });
}

void hold_border(const Scan& s, const CrackAxes& f, double h, Square& q)
{
  for (int k = 0; k < NODES * NODES; ++k) {
    if (!on_border(k % NODES, k / NODES)) continue;
    double x[3];
    f.place((k % NODES - TIP) * q.h, (k / NODES - TIP) * q.h, x);
    q.held[k] = displacement_at(s, x, h, q.given[k].data());
  }
  turn_back(f, q);
}

// the same with the material of e in all cells
Square one_material(const Scan& s, int e, Square q)
{
  const MatLaw& law = s.law(e);
  for (Cell& c : q.cell)
    if (c.there) c = {law.lam * s.fm.thickness[e], law.mu * s.fm.thickness[e], true};
  return q;
}

}  // namespace

double sharp_release(const Scan& s, int e, const double* tip, const double* d)
{
  const double h = s.fm.local[e];
  const CrackAxes f  = {tip, d};
  Square q = empty_square(h);
  fill_cells(s, f, h, q);
  hold_border(s, f, h, q);
  const Square u = one_material(s, e, q);
  // held as it is, the border does not follow the crack: by as much less it releases in one material
  const double held = release(u, 0, CELLS) / release(u, -1, 2);
  return release(q, 0, CELLS) / (held * s.fm.thickness[e]);
}
