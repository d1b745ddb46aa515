#include <Eigen/Dense>
#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>

#include "solve/solve_data.h"

// Rows of the grid, of broken points and their bonds, factorised separately
struct GridBlock {
  int first = 0;               // block rows from first on
  RealVec scale;               // 1/sqrt of the diagonal
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor;
  Eigen::VectorXd x;
  int size() const { return static_cast<int>(scale.size()); }
};

namespace {

// relative to the stiffness of its elements: a block with a larger difference belongs to the set
// (test: Krylov.ChangedRowsAreExactToSinglePrecision)
const double CHANGED    = 0.01;
// unknowns of the set, whose dense matrix costs their cube
// (test: Krylov.ChangedRowsAreExactToSinglePrecision)
const size_t MAX_CHANGED = 300;
// relative to a unit diagonal: rows of the grid may have no stiffness of their own  (no test)
const double SHIFT      = 1e-14;

double largest(const double* a, int n)
{
  double size = 0.0;
  for (int i = 0; i < n; ++i) size = std::max(size, std::fabs(a[i]));
  return size;
}

// block of the lower triangle of A in row I, column J <= I; null: none
const double* block_of(const SysMatrix& A, int I, int J)
{
  const int* first = A.col.data() + A.off[I];
  const int* last  = A.col.data() + A.off[I + 1];
  const int* found = std::lower_bound(first, last, J);
  if (found == last || *found != J) return nullptr;
  return &A.val[static_cast<size_t>(found - A.col.data()) * A.dim * A.dim];
}

// the same, tested first at index next; next is set to the index after the block found
const double* block_at(const SysMatrix& A, int I, int J, int& next)
{
  const double* found = next < A.off[I + 1] && A.col[next] == J
                            ? &A.val[static_cast<size_t>(next) * A.dim * A.dim]
                            : block_of(A, I, J);
  if (found) next = static_cast<int>((found - A.val.data()) / (A.dim * A.dim)) + 1;
  return found;
}

// the full block in row I, column J of a symmetric matrix, from either triangle
bool whole_block(const SysMatrix& A, int I, int J, double* out)
{
  const int D     = A.dim;
  const double* a = I >= J ? block_of(A, I, J) : block_of(A, J, I);
  std::fill(out, out + D * D, 0.0);
  if (!a) return false;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      const bool turned = I < J || (I == J && j > i);
      out[i * D + j]    = turned ? a[j * D + i] : a[i * D + j];
    }
  return true;
}

// stiffness of the elements at a row: its largest coupling with another row, since the diagonal may come from
// stiff bonds.   [nfe]
void element_size(const SysMatrix& A, int nfe, RealVec& size)
{
  const int DD = A.dim * A.dim;
  size.assign(nfe, 0.0);
  for (int I = 0; I < nfe; ++I)
    for (int k = A.off[I]; k < A.off[I + 1] - 1; ++k) {
      const double a = largest(&A.val[static_cast<size_t>(k) * DD], DD);
      size[I]        = std::max(size[I], a);
      size[A.col[k]] = std::max(size[A.col[k]], a);
    }
  for (int I = 0; I < nfe; ++I)        // without coupling, as at prescribed nodes
    if (size[I] == 0.0) size[I] = largest(&A.val[static_cast<size_t>(A.off[I + 1] - 1) * DD], DD);
}

// factorises the block of the grid. false: not positive definite
bool grid_factor(const SysMatrix& A, int first, GridBlock& g)
{
  const int D = A.dim, n = (A.nrow - first) * D;
  g.first = first;
  g.scale.assign(n, 1.0);
  for (int I = first; I < A.nrow; ++I)
    for (int i = 0; i < D; ++i) {
      const double d = A.val[static_cast<size_t>(A.off[I + 1] - 1) * D * D + i * D + i];
      if (d > 0.0) g.scale[(I - first) * D + i] = 1.0 / std::sqrt(d);
    }
  std::vector<Eigen::Triplet<double>> entry;
  for (int I = first; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1]; ++k) {
      const int J = A.col[k];
      if (J < first) continue;
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
          if (I == J && j > i) continue;
          const int row = (I - first) * D + i, col = (J - first) * D + j;
          entry.emplace_back(row, col,
                             A.val[static_cast<size_t>(k) * D * D + i * D + j] * g.scale[row] * g.scale[col]);
        }
    }
  for (int i = 0; i < n; ++i) entry.emplace_back(i, i, SHIFT);
  Eigen::SparseMatrix<double> K(n, n);
  K.setFromTriplets(entry.begin(), entry.end());
  if (n == 0) return true;
  g.factor.compute(K);
  return g.factor.info() == Eigen::Success && g.factor.vectorD().minCoeff() > 0.0;
}

// x <- A_gg^-1 x
void grid_solve(GridBlock& g, double* x)
{
  const int n = g.size();
  if (n == 0) return;
  g.x.resize(n);
  for (int i = 0; i < n; ++i) g.x[i] = x[i] * g.scale[i];
  g.x = g.factor.solve(g.x);
  for (int i = 0; i < n; ++i) x[i] = g.x[i] * g.scale[i];
}

// y_g -= A_gf x, or y_f -= A_fg x_g (turned)
void grid_couple(const SysMatrix& A, int first, bool turned, const double* x, double* y)
{
  const int D = A.dim;
  for (int I = first; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1] && A.col[k] < first; ++k) {
      const double* a = &A.val[static_cast<size_t>(k) * D * D];
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
          const int row = (I - first) * D + i, col = A.col[k] * D + j;
          if (turned) y[col] -= a[i * D + j] * x[row];
          else y[row] -= a[i * D + j] * x[col];
        }
    }
}

// C -= A_Sg A_gg^-1 A_gS of rows S of A (-1: none)                        [m][m], m = D S
void take_grid(const SysMatrix& A, GridBlock& g, const IntVec& set, RealVec& C)
{
  const int D = A.dim, m = static_cast<int>(set.size()) * D, n = g.size();
  if (n == 0) return;
  IntVec in_set(g.first, -1);
  for (size_t k = 0; k < set.size(); ++k)
    if (set[k] >= 0) in_set[set[k]] = static_cast<int>(k);
  struct Part {
    int row, col;              // in the grid, in the set
    const double* a;
  };
  std::vector<Part> part;
  std::vector<char> tied(set.size(), 0);
  for (int I = g.first; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1] && A.col[k] < g.first; ++k)
      if (in_set[A.col[k]] >= 0) {
        part.push_back({I - g.first, in_set[A.col[k]], &A.val[static_cast<size_t>(k) * D * D]});
        tied[part.back().col] = 1;
      }
  RealVec x(n);
  for (int j = 0; j < m; ++j) {
    if (!tied[j / D]) continue;
    std::fill(x.begin(), x.end(), 0.0);
    for (const Part& p : part)
      if (p.col == j / D)
        for (int i = 0; i < D; ++i) x[p.row * D + i] += p.a[i * D + j % D];
    grid_solve(g, x.data());
    for (const Part& p : part)
      for (int i = 0; i < D; ++i)
        for (int q = 0; q < D; ++q)
          C[static_cast<size_t>(j) * m + p.col * D + q] -= p.a[i * D + q] * x[p.row * D + i];
  }
}

using Dense = Eigen::Map<Eigen::MatrixXd>;

// maps present rows of elements to the old matrix, and back; removed rows belong to the set.
// false: a row is new
bool match_rows(const std::vector<long>& key, int nfe, Changed& c, std::vector<char>& in)
{
  c.old.resize(nfe);
  c.now.assign(c.nfe, -1);
  for (int I = 0; I < nfe; ++I) {
    const auto found = c.row_of.find(key[I]);
    if (found == c.row_of.end() || found->second >= c.nfe) return false;
    c.old[I] = found->second;
    c.now[c.old[I]] = I;
  }
  for (int J = 0; J < c.nfe; ++J)
    if (c.now[J] < 0) in[J] = 1;
  return true;
}

// old rows of elements with a block that has changed
void find_changed(const SysMatrix& A, int nfe, Changed& c, std::vector<char>& in)
{
  const int D = A.dim, DD = D * D;
  RealVec size;
  element_size(A, nfe, size);
  RealVec stiffness(c.nfe);
  for (int J = 0; J < c.nfe; ++J)
    stiffness[J] = c.now[J] >= 0 ? std::min(size[c.now[J]], c.size[J]) : c.size[J];
  const auto compare = [&](int I, int K, const double* now, const double* before) {        // old rows
    double change = 0.0;
    for (int i = 0; i < DD; ++i)
      change = std::max(change, std::fabs((now ? now[i] : 0.0) - (before ? before[i] : 0.0)));
    if (change * change > CHANGED * CHANGED * stiffness[I] * stiffness[K]) in[I] = in[K] = 1;
  };
  double other[9];
  for (int I = 0; I < nfe; ++I) {
    const int J0 = c.old[I];
    int next = c.A0.off[J0];                               // most rows keep their order
    for (int k = A.off[I]; k < A.off[I + 1]; ++k) {
      const int K0 = c.old[A.col[k]];
      if (in[J0] && in[K0]) continue;
      const double* now    = &A.val[static_cast<size_t>(k) * DD];
      const double* before = J0 >= K0 ? block_at(c.A0, J0, K0, next) : block_of(c.A0, K0, J0);
      if (before && J0 < K0) {                             // the other triangle
        for (int i = 0; i < D; ++i)
          for (int j = 0; j < D; ++j) other[i * D + j] = before[j * D + i];
        before = other;
      }
      compare(J0, K0, now, before);
    }
  }
  for (int J = 0; J < c.nfe; ++J) {                        // couplings that no longer exist
    const int I = c.now[J];
    int next    = I >= 0 ? A.off[I] : 0;
    for (int k = c.A0.off[J]; k < c.A0.off[J + 1]; ++k) {
      const int K = c.A0.col[k], L = c.now[K];
      if (in[J] && in[K]) continue;
      if (I >= 0 && L >= 0 && (I >= L ? block_at(A, I, L, next) : block_of(A, L, I))) continue;
      compare(J, K, nullptr, &c.A0.val[static_cast<size_t>(k) * DD]);
    }
  }
}

// adds columns of the inverse of the old matrix for new rows of the set, and the inverse of their rows in the
// set. The columns are stored in single precision, since reading them is a third of an application; the dense
// matrices of the set and the residual of CG are double
Status add_columns(Solver& s, Changed& c, const IntVec& rows)
{
  const int D = c.A0.dim, count = static_cast<int>(rows.size()) * D;
  const size_t n = static_cast<size_t>(c.A0.neq());
  RealVec fresh(count * n, 0.0);
  for (int k = 0; k < count; ++k) fresh[k * n + rows[k / D] * D + k % D] = 1.0;
  const Status status = solve_back_many(s, fresh.data(), count);
  if (status != STATUS_OK) return status;
  c.V.emplace_back(fresh.begin(), fresh.end());
  const int before = static_cast<int>(c.set.size()) * D;
  for (int row : rows) {
    c.in_set[row] = static_cast<int>(c.set.size());
    c.set.push_back(row);
  }
  const int m = static_cast<int>(c.set.size()) * D;
  Eigen::MatrixXd F(m, m);
  F.topLeftCorner(before, before) = Dense(c.F.data(), before, before);
  for (int k = 0; k < count; ++k)
    for (int i = 0; i < m; ++i) F(i, before + k) = fresh[k * n + c.set[i / D] * D + i % D];
  F.bottomLeftCorner(count, before) = F.topRightCorner(before, count).transpose();
  c.F.assign(F.data(), F.data() + F.size());
  const Eigen::LLT<Eigen::MatrixXd> factor(0.5 * (F + F.transpose()));
  if (factor.info() != Eigen::Success) return SOLVER_SINGULAR;
  c.G.resize(static_cast<size_t>(m) * m);
  Dense(c.G.data(), m, m) = factor.solve(Eigen::MatrixXd::Identity(m, m));
  // the old matrix in the set, without its grid
  c.C0.assign(static_cast<size_t>(m) * m, 0.0);
  double block[9];
  for (int J = 0; J < m / D; ++J)
    for (int I = 0; I < m / D; ++I) {
      whole_block(c.A0, c.set[I], c.set[J], block);
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) c.C0[static_cast<size_t>(J * D + j) * m + I * D + i] = block[i * D + j];
    }
  take_grid(c.A0, *c.grid0, c.set, c.C0);
  return STATUS_OK;
}

// the dense matrix of the set, inverted                                                (8.9)
bool form_dense(const SysMatrix& A, Changed& c)
{
  const int D = A.dim, set = static_cast<int>(c.set.size()), m = set * D;
  IntVec now(set);
  for (int k = 0; k < set; ++k) now[k] = c.now[c.set[k]];
  RealVec C(static_cast<size_t>(m) * m, 0.0);
  double block[9];
  for (int J = 0; J < set; ++J)
    for (int I = 0; I < set; ++I) {
      if (now[I] < 0 || now[J] < 0) continue;
      whole_block(A, now[I], now[J], block);
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) C[static_cast<size_t>(J * D + j) * m + I * D + i] = block[i * D + j];
    }
  take_grid(A, *c.grid, now, C);
  for (int J = 0; J < set; ++J)
    for (int I = 0; I < set; ++I)
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
          const size_t at = static_cast<size_t>(J * D + j) * m + I * D + i;
          C[at] = now[I] < 0 || now[J] < 0 ? (I == J && i == j ? 1.0 : 0.0) : C[at] + c.G[at] - c.C0[at];
        }
  const Eigen::MatrixXd Q = Dense(C.data(), m, m);
  const Eigen::LLT<Eigen::MatrixXd> factor(0.5 * (Q + Q.transpose()));
  if (m > 0 && factor.info() != Eigen::Success) return false;
  c.Q.resize(static_cast<size_t>(m) * m);
  if (m > 0) Dense(c.Q.data(), m, m) = factor.solve(Eigen::MatrixXd::Identity(m, m));
  return true;
}

}  // namespace

// ---------------------------------------------------------------------------
// changed_begin : stores a matrix that has just been factorised; later changes of rows are relative to it
//
//   in   nfe   rows of elements, followed by rows of the grid
// ---------------------------------------------------------------------------
void changed_begin(const SysMatrix& A, const std::vector<long>& key, int nfe, Changed& c)
{
  c.A0  = A;
  c.nfe = nfe;
  element_size(A, nfe, c.size);
  c.row_of.clear();
  c.row_of.reserve(key.size());
  for (size_t i = 0; i < key.size(); ++i) c.row_of[key[i]] = static_cast<int>(i);
  c.in_set.assign(nfe, -1);
  c.set.clear();
  c.V.clear();
  c.F.clear();
  c.G.clear();
  c.C0.clear();
  c.grid0 = std::make_shared<GridBlock>();
  c.grid  = std::make_shared<GridBlock>();
  c.stamp = -1;
  c.on    = grid_factor(A, nfe, *c.grid0);
}

// ---------------------------------------------------------------------------
// changed_form : the set of rows in which A differs from the matrix that was factorised, and their dense
// matrix  (8.9)
//
// false: too many rows, or a matrix is not positive definite
// ---------------------------------------------------------------------------
bool changed_form(Solver& s, const SysMatrix& A, const std::vector<long>& key, int nfe, long stamp,
                  Changed& c)
{
  c.columns = 0;
  if (!c.on || c.stamp == stamp) return c.on;
  std::vector<char> in(c.nfe, 0);
  for (int row : c.set) in[row] = 1;
  c.on = match_rows(key, nfe, c, in) && grid_factor(A, nfe, *c.grid);
  if (!c.on) return false;
  find_changed(A, nfe, c, in);
  IntVec rows;
  for (int J = 0; J < c.nfe; ++J)
    if (in[J] && c.in_set[J] < 0) rows.push_back(J);
  c.on = (c.set.size() + rows.size()) * A.dim <= MAX_CHANGED;
  c.columns = static_cast<int>(rows.size()) * A.dim;
  if (c.on && !rows.empty()) c.on = add_columns(s, c, rows) == STATUS_OK;
  c.on = c.on && form_dense(A, c);
  if (c.on) c.stamp = stamp;
  return c.on;
}

// ---------------------------------------------------------------------------
// changed_apply : z = P^-1 r, one back substitution                                    (8.9)
// ---------------------------------------------------------------------------
Status changed_apply(Solver& s, const SysMatrix& A, Changed& c, const RealVec& r, RealVec& z)
{
  const int D = A.dim, m = static_cast<int>(c.set.size()) * D, nfe = static_cast<int>(c.old.size()),
            nf = nfe * D;
  const size_t neq = static_cast<size_t>(c.A0.neq());
  // 1. eliminate the grid
  RealVec rf(r.begin(), r.begin() + nf), rg(r.begin() + nf, r.end());
  grid_solve(*c.grid, rg.data());
  grid_couple(A, nfe, true, rg.data(), rf.data());
  // 2. elements
  c.y.assign(neq, 0.0);
  for (int I = 0; I < nfe; ++I)
    if (c.in_set[c.old[I]] < 0)
      for (int i = 0; i < D; ++i) c.y[c.old[I] * D + i] = rf[I * D + i];
  const Status status = solve_back_rough(s, c.y, c.y);
  if (status != STATUS_OK) return status;
  if (m > 0) {
    Eigen::VectorXd y(m), x(m);
    for (int k = 0; k < m; ++k) y[k] = c.y[c.set[k / D] * D + k % D];
    const Dense G(c.G.data(), m, m), Q(c.Q.data(), m, m);
    x = G * y;
    for (int k = 0; k < m; ++k) {
      const int row = c.now[c.set[k / D]];
      x[k]          = row < 0 ? 0.0 : x[k] + rf[row * D + k % D];
    }
    x = (Q * x).eval();
    y = G * (x - y);
    long first = 0;
    const long n = static_cast<long>(neq);
    const Eigen::VectorXf w = y.cast<float>();
    Eigen::VectorXf move = Eigen::VectorXf::Zero(n);
    for (const std::vector<float>& V : c.V) {
      const long columns = static_cast<long>(V.size()) / n;
      move += Eigen::Map<const Eigen::MatrixXf>(V.data(), n, columns) * w.segment(first, columns);
      first += columns;
    }
    Eigen::Map<Eigen::VectorXd>(c.y.data(), n) += move.cast<double>();
    for (int k = 0; k < m; ++k) c.y[c.set[k / D] * D + k % D] = x[k];
  }
  for (int I = 0; I < nfe; ++I)
    for (int i = 0; i < D; ++i) z[I * D + i] = c.y[c.old[I] * D + i];
  // 3. back substitution for the grid
  std::copy(r.begin() + nf, r.end(), z.begin() + nf);
  grid_couple(A, nfe, false, z.data(), z.data() + nf);
  grid_solve(*c.grid, z.data() + nf);
  return STATUS_OK;
}
