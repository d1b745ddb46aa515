#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "assem/assem.h"
#include "assem/mass_rows.h"
#include "base/comm.h"

namespace {

// FACTOR_SHIFT, relative to a unit diagonal, is added to M, which may be singular, and removed by at most
// FACTOR_REFINEMENTS refinements. Squares of the residual relative to the right-hand side: GOAL ends the
// refinement, ENOUGH is accepted                                                                  (3.14)
// (test: Mass.MotionsThatCornersHardlySee)
const double FACTOR_SHIFT    = 1e-13;
const int FACTOR_REFINEMENTS = 10;     // one is enough there  (no test)
const double GOAL = 1e-28, ENOUGH = 1e-16;

using Sparse = Eigen::SparseMatrix<double>;

// the values of all rows on rank 0, in the order of the matrix there, [D] each
RealVec collect(const Halo& h, int D, const RealVec& x)
{
  if (!h.on()) return x;
  std::vector<RealVec> to(comm_size());
  for (size_t r = 0; r < h.owner.size(); ++r)
    if (h.owner[r] == comm_rank()) to[0].insert(to[0].end(), &x[r * D], &x[r * D] + D);
  RealVec all;
  for (const RealVec& part : comm_exchange(to)) all.insert(all.end(), part.begin(), part.end());
  return all;
}

// the inverse
void distribute(const SysMatrix& A, int D, const RealVec& all, RealVec& x)
{
  if (!sys_shared(A)) {
    x = all;
    return;
  }
  const RowNumbers n = sys_number(A);
  std::vector<RealVec> to(comm_size());
  if (comm_rank() == 0)
    for (int r = 0; r < comm_size(); ++r)
      to[r].assign(all.begin() + static_cast<long>(n.first[r]) * D,
                   all.begin() + static_cast<long>(n.first[r + 1]) * D);
  const RealVec own = comm_exchange(to)[0];
  size_t next       = 0;
  for (int r = 0; r < A.nrow; ++r) {
    if (A.halo.owner[r] != comm_rank()) continue;
    std::copy_n(&own[next], D, &x[static_cast<size_t>(r) * D]);
    next += D;
  }
  halo_copy(A.halo, D, x);
}

// One direction. M of the free rows, scaled to a unit diagonal. In: x at the other rows; out: the solution of
// M x = f. Returns true if the residual is small
bool solve_free(const SysMatrix& M, const std::vector<char>& free, const RealVec& f, RealVec& x)
{
  IntVec at(M.nrow, -1);
  RealVec scale;
  int n = 0;
  for (int r = 0; r < M.nrow; ++r) {
    if (!free[r]) continue;
    at[r] = n++;
    scale.push_back(1.0 / std::sqrt(M.val[M.off[r + 1] - 1]));
  }
  Eigen::VectorXd b(n);
  for (int r = 0; r < M.nrow; ++r)
    if (free[r]) b[at[r]] = f[r];
  std::vector<Eigen::Triplet<double>> entry;
  for (int r = 0; r < M.nrow; ++r)
    for (int k = M.off[r]; k < M.off[r + 1]; ++k) {
      const int c = M.col[k];
      if (free[r] && free[c]) entry.emplace_back(at[r], at[c], M.val[k] * scale[at[r]] * scale[at[c]]);
      else if (free[r]) b[at[r]] -= M.val[k] * x[c];
      else if (free[c]) b[at[c]] -= M.val[k] * x[r];
    }
  for (int k = 0; k < n; ++k) b[k] *= scale[k];
  Sparse A(n, n), I(n, n);
  A.setFromTriplets(entry.begin(), entry.end());
  I.setIdentity();
  const Eigen::SimplicialLDLT<Sparse> factor(A + FACTOR_SHIFT * I);
  if (factor.info() != Eigen::Success) return false;
  Eigen::VectorXd u = Eigen::VectorXd::Zero(n), r = b;
  const double size = b.squaredNorm();
  for (int k = 0; k < FACTOR_REFINEMENTS && !(r.squaredNorm() <= GOAL * size); ++k) {
    u += factor.solve(r);
    r = b - A.selfadjointView<Eigen::Lower>() * u;
  }
  for (int row = 0; row < M.nrow; ++row)
    if (free[row]) x[row] = u[at[row]] * scale[at[row]];
  return std::isfinite(size) && r.squaredNorm() <= ENOUGH * size;
}

}  // namespace

// ---------------------------------------------------------------------------
// mass_factor : M x = f by a factorisation, if conjugate gradients fail: M + FACTOR_SHIFT I is factorised and
// the residual of M refined. Needed for motions that hardly move corners, with 1e-10 of the mass of other
// motions. Rank 0 factorises. Collective.                                                           (3.14)
//
//   in   of     rows: all, or those of the grid
//        f      [neq]   momentum or force
//   in, out  x  [neq]   given at fixed dofs and in other rows
//   returns  1; -1: not solved
// ---------------------------------------------------------------------------
int mass_factor(const Dofs& s, MassRowsOf of, const RealVec& f, RealVec& x)
{
  const int D = s.rows.dim, first = of == ROWS_GRID ? s.rows.nfe : 0;
  SysMatrix part;
  part.dim  = 1;
  part.nrow = s.rows.nrow;
  part.off  = s.pattern.A.off;
  part.col  = s.pattern.A.col;
  part.val  = s.mass.M;
  part.halo = s.pattern.A.halo;
  const SysMatrix M = sys_collect(part, true);
  RealVec fixed_row(s.rows.neq());
  for (int i = 0; i < s.rows.neq(); ++i)
    fixed_row[i] = s.bound.fixed[i] || i < first * D || !(s.mass.M_diag[i / D] > 0.0) ? 1.0 : 0.0;
  const RealVec F = collect(s.pattern.A.halo, D, f), fixed = collect(s.pattern.A.halo, D, fixed_row);
  RealVec X   = collect(s.pattern.A.halo, D, x);
  bool solved = true;
  for (int i = 0; i < D && comm_rank() == 0; ++i) {
    std::vector<char> free(M.nrow);
    RealVec right(M.nrow), at(M.nrow);
    for (int r = 0; r < M.nrow; ++r) {
      free[r]  = fixed[r * D + i] == 0.0;
      right[r] = F[r * D + i];
      at[r]    = X[r * D + i];
    }
    solved = solve_free(M, free, right, at) && solved;
    for (int r = 0; r < M.nrow; ++r) X[r * D + i] = at[r];
  }
  distribute(part, D, X, x);
  return comm_bcast(static_cast<int>(solved)) ? 1 : -1;
}
