#include <algorithm>
#include <cmath>
#include <new>

#include "base/log.h"
#include "solve/solve_data.h"

namespace {

// as ZERO_PIVOT, where a zero pivot is no error. In G3 pivots of free motions are up to 7e-12, all others
// above 1e-6; a missed one causes a spurious motion, a false one costs an iteration
// (test: Solve.NullPivotsAreFixed)
const double NO_ERROR = 1e-10;
const double FIXED = 1e200;         // pivot of an unknown that is fixed

// height of block column J in scalar rows, with the diagonal block; its first scalar column
long column_height(const Skyline& K, int J, int D) { return static_cast<long>(J - K.first[J] + 1) * D; }
double* column(Skyline& K, int J) { return K.a.data() + K.start[J]; }

// g[i][j] = sum over k < n of p_i[k] q_j[k]; columns p_i = p + i*np, q_j = q + j*nq.
// Eight partial sums each, so that the compiler can use vector registers.
template <int D>
void column_products(const double* p, long np, const double* q, long nq, long n, double g[D][D])
{
  const int LANES = 8;
  double sum[D][D][LANES] = {};
  const long whole = n / LANES * LANES;
  for (long k = 0; k < whole; k += LANES)
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
        for (int l = 0; l < LANES; ++l) sum[i][j][l] += p[i * np + k + l] * q[j * nq + k + l];

  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      g[i][j] = 0.0;
      for (int l = 0; l < LANES; ++l) g[i][j] += sum[i][j][l];
      for (long k = whole; k < n; ++k) g[i][j] += p[i * np + k] * q[j * nq + k];
    }
}

// lower block triangle of A into the profile, in the new order
template <int D>
void fill_profile(Skyline& K, const SysMatrix& A)
{
  std::fill(K.a.begin(), K.a.end(), 0.0);
  for (int I = 0; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1]; ++k) {
      const double* a = &A.val[static_cast<size_t>(k) * D * D];
      const int row   = std::min(K.pos[I], K.pos[A.col[k]]);
      const int col   = std::max(K.pos[I], K.pos[A.col[k]]);
      const bool turn = row == K.pos[I];            // a belongs to (row, col), not transposed
      const long h    = column_height(K, col, D);
      double* c       = column(K, col) + static_cast<long>(row - K.first[col]) * D;
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
          if (row == col && j > i) continue;        // diagonal block: only its lower half is stored
          if (row != col && turn)
            c[j * h + i] = a[i * D + j];
          else
            c[i * h + j] = a[i * D + j];
        }
    }
}

// rows of block column J above its diagonal block: g = (U^T)^-1 a
template <int D>
void eliminate_column(Skyline& K, int J)
{
  double* q     = column(K, J);
  const long nq = column_height(K, J, D);
  for (int I = K.first[J]; I < J; ++I) {
    const int top = std::max(K.first[I], K.first[J]);
    const long np = column_height(K, I, D);
    const long n  = static_cast<long>(I - top) * D;
    double* p     = column(K, I);
    double g[D][D];
    column_products<D>(p + static_cast<long>(top - K.first[I]) * D, np,
                       q + static_cast<long>(top - K.first[J]) * D, nq, n, g);

    double* r        = q + static_cast<long>(I - K.first[J]) * D;   // rows of I in the columns of J
    const double* uI = p + static_cast<long>(I - K.first[I]) * D;   // diagonal block of I
    for (int j = 0; j < D; ++j)
      for (int i = 0; i < D; ++i) {
        r[j * nq + i] -= g[i][j];
        for (int k = 0; k < i; ++k) r[j * nq + i] -= uI[i * np + k] * r[j * nq + k];
      }
  }
}

// diagonal block of J: pivots, and the columns divided by the pivots. diagonal [D]: of A, in the rows of J.
// A pivot up to zero times the diagonal counts as zero: its unknown is fixed. Returns their number, and the
// local column of the first one
template <int D>
int divide_column(Skyline& K, int J, const double* diagonal, double zero, int& first)
{
  int zeros = 0;
  const long h     = column_height(K, J, D);
  const long above = h - D;
  const double* d  = K.d.data() + static_cast<long>(K.first[J]) * D;
  for (int c = 0; c < D; ++c) {
    double* q = column(K, J) + c * h;
    for (int r = 0; r < c; ++r) {
      const double* p = column(K, J) + r * h;
      double g[1][1];
      column_products<1>(p, h, q, h, above + r, g);
      q[above + r] -= g[0][0];
    }
    double pivot = q[above + c];
    for (long k = 0; k < above + c; ++k) {
      const double u = q[k] / d[k];
      pivot -= u * q[k];
      q[k] = u;
    }
    if (std::fabs(pivot) <= zero * std::fabs(diagonal[c])) {
      if (zeros++ == 0) first = c;
      pivot = FIXED;
    }
    K.d[static_cast<long>(J) * D + c] = pivot;
  }
  return zeros;
}

template <int D>
Status factor(Solver& s, const SysMatrix& A)
{
  Skyline& K = s.data->sky;
  fill_profile<D>(K, A);
  IntVec row(A.nrow);          // of A, of each block column
  for (int I = 0; I < A.nrow; ++I) row[K.pos[I]] = I;
  int zeros = 0;
  bool fixed = true;
  for (int J = 0; J < A.nrow && fixed; ++J) {
    double diagonal[D];
    for (int c = 0; c < D; ++c) diagonal[c] = column(K, J)[(c + 1) * column_height(K, J, D) - D + c];
    eliminate_column<D>(K, J);
    int first = 0;
    const bool may = pivot_fixed(s, row[J]) && !s.data->narrow;      // narrow: MUMPS follows
    const int more = divide_column<D>(K, J, diagonal, may ? NO_ERROR : ZERO_PIVOT, first);
    if (more == 0) continue;
    fixed = may;
    if (zeros == 0 || !fixed) s.zero_equation = row[J] * D + first;
    zeros += more;
  }
  if (zeros > 0) {
    const int I = s.zero_equation / D, component = s.zero_equation % D;
    solve_fail(s, SOLVER_SINGULAR, "%d zero pivots, the first in equation %d (block row %d, component %d): a "
               "rigid-body motion or mechanism is not constrained; check the supports",
               zeros, s.zero_equation + 1, I + 1, component + 1);
    if (!fixed) return SOLVER_SINGULAR;
    s.fixed_null_pivots += zeros;
  }
  s.negative = static_cast<int>(std::count_if(K.d.begin(), K.d.end(), [](double d) { return d < 0.0; }));
  return STATUS_OK;
}

template <int D>
void back(Skyline& K, RealVec& b)
{
  const int nrow = static_cast<int>(K.pos.size());
  double* x      = K.x.data();
  for (int I = 0; I < nrow; ++I)
    for (int i = 0; i < D; ++i) x[K.pos[I] * D + i] = b[I * D + i];

  // 1. U^T y = b by columns
  for (int J = 0; J < nrow; ++J) {
    const long h     = column_height(K, J, D);
    const double* x0 = x + static_cast<long>(K.first[J]) * D;
    for (int c = 0; c < D; ++c) {
      double g[1][1];
      column_products<1>(column(K, J) + c * h, h, x0, h, h - D + c, g);
      x[J * D + c] -= g[0][0];
    }
  }
  // 2. divide by the pivots
  for (size_t k = 0; k < K.d.size(); ++k) x[k] /= K.d[k];
  // 3. U x = y
  for (int J = nrow - 1; J >= 0; --J) {
    const long h = column_height(K, J, D);
    double* x0   = x + static_cast<long>(K.first[J]) * D;
    for (int c = D - 1; c >= 0; --c) {
      const double* q = column(K, J) + c * h;
      const double xc = x[J * D + c];
      for (long k = 0; k < h - D + c; ++k) x0[k] -= q[k] * xc;
    }
  }
  for (int I = 0; I < nrow; ++I)
    for (int i = 0; i < D; ++i) b[I * D + i] = x[K.pos[I] * D + i];
}

}  // namespace

// ---------------------------------------------------------------------------
// skyline_analyse : order by reverse Cuthill-McKee, column heights, storage
//
//   status  SOLVER_FAILED: not enough memory for the profile
// ---------------------------------------------------------------------------
Status skyline_analyse(Solver& s, const SysMatrix& A)
{
  MPFE_CHECK(A.dim >= 1 && A.dim <= 3, "skyline_analyse: blocks are 1 x 1, 2 x 2 or 3 x 3");
  Skyline& K = s.data->sky;
  K.pos      = order_rcm(A);
  K.first.resize(A.nrow);
  for (int I = 0; I < A.nrow; ++I) K.first[I] = I;
  for (int I = 0; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1]; ++k) {
      const int low  = std::min(K.pos[I], K.pos[A.col[k]]);
      const int high = std::max(K.pos[I], K.pos[A.col[k]]);
      K.first[high]  = std::min(K.first[high], low);
    }

  K.start.assign(A.nrow + 1, 0);
  s.flops = 0.0;
  for (int J = 0; J < A.nrow; ++J) {
    const double h = static_cast<double>(column_height(K, J, A.dim));
    K.start[J + 1] = K.start[J] + column_height(K, J, A.dim) * A.dim;
    s.flops += A.dim * h * h;
  }
  s.data->cost.factor_entries = static_cast<double>(K.start[A.nrow]);
  s.memory_mb = static_cast<double>(K.start[A.nrow]) * sizeof(double) / 1e6;
  try {
    K.a.resize(K.start[A.nrow]);
    K.d.resize(A.neq());
    K.x.resize(A.neq());
  } catch (const std::bad_alloc&) {
    return solve_fail(s, SOLVER_FAILED,
                      "the skyline needs %.0f MB, more than is available: use *SOLVER, TYPE=MUMPS, or a "
                      "coarser mesh",
                      s.memory_mb);
  }
  return STATUS_OK;
}

// ---------------------------------------------------------------------------
// skyline_factor : A = U^T D U, columns from left to right, no pivoting
//
//   status  SOLVER_SINGULAR: |pivot| <= 3e-12 of the diagonal of A in that equation, so that soft parts
//           next to stiff ones give no false alarm. Free bodies of 40 x 30 to 400 x 160 quadrilaterals
//           have pivots of 3e-14 to 7e-13 from round-off, measured. Where a zero pivot is no error
//           (pivot_fixed) its unknown is fixed, as by MUMPS.
//
// An indefinite matrix is allowed as long as no pivot vanishes. Columns of one block row
// have the same height, so that D x D inner products share their loads.
// ---------------------------------------------------------------------------
Status skyline_factor(Solver& s, const SysMatrix& A)
{
  return A.dim == 1 ? factor<1>(s, A) : A.dim == 2 ? factor<2>(s, A) : factor<3>(s, A);
}

Status skyline_back(Solver& s, RealVec& x)
{
  Skyline& K = s.data->sky;
  switch (s.data->pattern.dim) {
    case 1: back<1>(K, x); break;
    case 2: back<2>(K, x); break;
    default: back<3>(K, x);
  }
  return STATUS_OK;
}
