#include "frac/frac_scan.h"

#include <algorithm>
#include <array>
#include <cmath>

#include <Eigen/SparseCholesky>

#include "shape/shape.h"

// A sharp crack in a square of small cells around the tip, with the displacements of the mesh on its border.
// x along the crack, the tip at 0; materials of the mesh.                                           (7.38)

namespace {

// sizes of the cells from the tip outwards, in element sizes. 3.3 more sizes change K4 by 1 %
// (test: fracture/crack_interface.inp)
const int FINE_CELLS = 8, SIDE = 26, NODES = SIDE + 1;
const double FINE_SIZE = 0.25, COARSE[5] = {0.35, 0.5, 0.7, 1.0, 1.4};
const int CELLS_PER_ELEMENT = 4;         // fine cells in the size of an element
const int TIP     = SIDE / 2;  // column of the tip, row of the crack
// in element sizes: cracked elements further beside the rows of the crack are void
// (test: fracture/crack_interface.inp)
const double SLOT_DISTANCE = 0.25;

struct SmallCell {
  double lam[4] = {0, 0, 0, 0}, mu[4] = {0, 0, 0, 0};    // at the Gauss points, times thickness; 0: void
  bool there = false;
};

struct Square {
  double at[NODES];            // of the lines of the grid
  std::vector<SmallCell> cell;      // [SIDE*SIDE]
  // [NODES*NODES]; in the system followed by the upper nodes of the crack
  std::vector<std::array<double, 2>> given;          // displacement on the border
  std::vector<char> fixed;
};

int node_at(int column, int row) { return row * NODES + column; }
bool on_border(int column, int row)
{
  return column == 0 || row == 0 || column == NODES - 1 || row == NODES - 1;
}

Square empty_square(double h)
{
  Square q{{}, std::vector<SmallCell>(SIDE * SIDE), std::vector<std::array<double, 2>>(NODES * NODES),
           std::vector<char>(NODES * NODES, 0)};
  for (int k = 0; k <= TIP; ++k) {
    const double before = k > 0 ? q.at[TIP + k - 1] : 0.0;
    q.at[TIP + k] = before + (k == 0 ? 0.0 : k <= FINE_CELLS ? FINE_SIZE : COARSE[k - FINE_CELLS - 1]) * h;
    q.at[TIP - k] = -q.at[TIP + k];
  }
  return q;
}

// ---- stiffness and energy

const double XI = 0.57735026918962576;
const double GAUSS[4][2] = {{-XI, -XI}, {XI, -XI}, {-XI, XI}, {XI, XI}};

// stiffness of a cell of a x b                [8*8]
void cell_stiffness(const SmallCell& c, double a, double b, double K[8][8])
{
  std::fill_n(K[0], 64, 0.0);
  for (int g = 0; g < 4; ++g) {
    const double x = GAUSS[g][0], y = GAUSS[g][1], p = 0.5 / a, q = 0.5 / b, w = 0.25 * a * b;
    const double dN[4][2] = {{p * (y - 1), q * (x - 1)}, {p * (1 - y), q * (-1 - x)},
                             {p * (1 + y), q * (1 + x)}, {p * (-1 - y), q * (1 - x)}};
    for (int m = 0; m < 4; ++m)
      for (int n = 0; n < 4; ++n)
        for (int i = 0; i < 2; ++i)
          for (int j = 0; j < 2; ++j) {
            const double dot = i == j ? dN[m][0] * dN[n][0] + dN[m][1] * dN[n][1] : 0.0;
            K[2 * m + i][2 * n + j] +=
                w * (c.lam[g] * dN[m][i] * dN[n][j] + c.mu[g] * (dN[m][j] * dN[n][i] + dot));
          }
  }
}

// nodes of a cell with the crack open up to a column; above the crack the upper nodes
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
    if (used[n] && (n >= NODES * NODES || !q.fixed[n])) eqn[n] = 2 * neq++;
  std::vector<Eigen::Triplet<double>> entry;
  Eigen::VectorXd load = Eigen::VectorXd::Zero(2 * neq);
  double fixed = 0.0;          // energy of the given displacements alone
  for (int k = 0; k < SIDE * SIDE; ++k) {
    if (!q.cell[k].there) continue;
    int node[4];
    double K[8][8];
    cell_nodes(k % SIDE, k / SIDE, open, node);
    cell_stiffness(q.cell[k], q.at[k % SIDE + 1] - q.at[k % SIDE], q.at[k / SIDE + 1] - q.at[k / SIDE], K);
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

// energy release per length of the crack between two columns, counted from the tip
double release(const Square& q, int from, int to)
{
  return (energy_open(q, TIP + from) - energy_open(q, TIP + to)) /
         (q.at[TIP + to] - q.at[TIP + from]);
}

// ---- contents of the square

// the square in the mesh: tip, axis along the crack, normal of the crack; in 3D perpendicular to the front
struct CrackAxes {
  const double *tip, *d, *n;
  double wide;                 // of the rows of the crack
  void position(double along, double across, double* x) const
  {
    for (int i = 0; i < 3; ++i) x[i] = tip[i] + along * d[i] + across * n[i];
  }
  // components of a displacement along both                                      [dim] to [2]
  std::array<double, 2> components(const double* u, int dim) const
  {
    std::array<double, 2> c = {0.0, 0.0};
    for (int i = 0; i < dim; ++i) {
      c[0] += d[i] * u[i];
      c[1] += n[i] * u[i];
    }
    return c;
  }
};

// the element at a position, for cracked ones and voids along the line their neighbour across it; -1: void
int element_of(const Scan& s, const CrackAxes& f, double along, double across, double h)
{
  double x[3];
  f.position(along, across, x);
  int o = element_at(s, x, 1.5 * h);
  const double side = across < 0.0 ? -1.0 : 1.0;
  for (double way : {side, -side}) {
    if ((o >= 0 && !s.cracked(o)) || std::fabs(across) > 0.5 * f.wide + SLOT_DISTANCE * h) break;
    f.position(along, across + way * 0.5 * (f.wide + h), x);
    const int next = element_at(s, x, 1.5 * h);
    if (next >= 0 && s.intact(next)) o = next;
  }
  return o >= 0 && s.intact(o) ? o : -1;
}

void fill_cells(const Scan& s, const CrackAxes& f, double h, Square& q)
{
  const auto middle = [&](int k, double x) {
    return 0.5 * (q.at[k] + q.at[k + 1] + x * (q.at[k + 1] - q.at[k]));
  };
  for (int k = 0; k < SIDE * SIDE; ++k)
    for (int g = 0; g < 4; ++g) {
      SmallCell& c = q.cell[k];
      const int o = element_of(s, f, middle(k % SIDE, GAUSS[g][0]), middle(k / SIDE, GAUSS[g][1]), h);
      if (o < 0) continue;
      c.lam[g] = s.law(o).lam * s.fm.thickness[o];
      c.mu[g]  = s.law(o).mu * s.fm.thickness[o];
      c.there  = true;
    }
}

// displacement of the mesh at x [dim]; false: no intact element there
bool displacement_at(const Scan& s, const double* x, double h, double* u)
{
  bool found = false;
  const int dim = s.m.dim;
  frac_in_ball(s.fm, x, 1.5 * h, [&](int o, double) {
    if (found || !s.intact(o)) return;
    const Shape shape = s.el.block[s.el.initial_block[o]].shape;
    const int nen = shape_info[shape].nen, *node = s.m.mesh.conn.begin(o);
    double X[3 * MAX_NODES], xi[3], N[MAX_NODES];
    for (int a = 0; a < nen; ++a)
      for (int i = 0; i < dim; ++i) X[dim * a + i] = s.m.mesh.X[3 * node[a] + i];
    if (!shape_locate(shape, X, x, xi)) return;
    shape_eval(shape, xi, N, nullptr);
    std::fill_n(u, dim, 0.0);
    for (int a = 0; a < nen; ++a)
      for (int i = 0; i < dim; ++i) u[i] += N[a] * s.l.u[dim * node[a] + i];
    found = true;
  });
  return found;
}

// removes the mean rotation of the border from the displacements
void rotate_back(Square& q)
{
  double turn = 0.0, size = 0.0, mean[2] = {0, 0}, n = 0.0;
  const auto each = [&](auto use) {
    for (int k = 0; k < NODES * NODES; ++k)
      if (q.fixed[k]) use(q.at[k % NODES], q.at[k / NODES], q.given[k]);
  };
  each([&](double, double, std::array<double, 2>& u) {
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

void fix_border(const Scan& s, const CrackAxes& f, double h, Square& q)
{
  for (int k = 0; k < NODES * NODES; ++k) {
    if (!on_border(k % NODES, k / NODES)) continue;
    double x[3], u[3];
    if (k / NODES == TIP && q.at[k % NODES] < 0.0) continue;           // the crack
    f.position(q.at[k % NODES], q.at[k / NODES], x);
    q.fixed[k] = displacement_at(s, x, h, u);
    if (q.fixed[k]) q.given[k] = f.components(u, s.m.dim);
  }
  rotate_back(q);
}

// the same with the material of e in all cells
Square one_material(const Scan& s, int e, Square q)
{
  for (SmallCell& c : q.cell)
    for (int g = 0; g < 4; ++g) {
      if (c.mu[g] == 0.0) continue;
      c.lam[g] = s.law(e).lam * s.fm.thickness[e];
      c.mu[g]  = s.law(e).mu * s.fm.thickness[e];
    }
  return q;
}

}  // namespace

double sharp_release(const Scan& s, int e, const double* tip, const double* d, const double* n, double wide)
{
  const double h    = s.fm.local[e];
  const CrackAxes f = {tip, d, n, wide};
  Square q = empty_square(h);
  fill_cells(s, f, h, q);
  fix_border(s, f, h, q);
  const Square u = one_material(s, e, q);
  // a fixed border does not follow the crack, and each row of elements acts as a longer one: corrected by the
  // ratio of energy releases in one material
  const int rows = std::min(2, static_cast<int>(std::lround(wide / h)));
  const double correction = release(u, 0, CELLS_PER_ELEMENT) / release(u, rows - 2, rows + 1);
  return release(q, 0, CELLS_PER_ELEMENT) / (correction * s.fm.thickness[e]);
}
