#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "base/comm.h"
#include "base/grow.h"
#include "solve/solve_data.h"

namespace {

// relative to the diagonal of A; below, the incomplete factor is useless
// (test: Krylov.CholeskyOfAChainIsExact)
const double LEAST_PIVOT   = 1e-6;
// relative to the diagonal, if a pivot is not positive; then increased by factors of ten
// (test: Divided.BorderWantsALargerDiagonal)
const double FIRST_SHIFT   = 1e-3;
const double LARGEST_SHIFT = 10.0;

// K = inverse of the lower Cholesky factor of the symmetric block a (i >= j is read); false: not positive
template <int D>
bool inverse_factor(const double* a, const double* least, double* K)
{
  double L[D * D] = {};
  for (int j = 0; j < D; ++j)
    for (int i = j; i < D; ++i) {
      double sum = a[i * D + j];
      for (int k = 0; k < j; ++k) sum -= L[i * D + k] * L[j * D + k];
      if (i > j) L[i * D + j] = sum / L[j * D + j];
      else if (sum > least[i]) L[i * D + i] = std::sqrt(sum);
      else return false;
    }
  std::fill(K, K + D * D, 0.0);
  for (int j = 0; j < D; ++j) {
    K[j * D + j] = 1.0 / L[j * D + j];
    for (int i = j + 1; i < D; ++i) {
      double sum = 0.0;
      for (int k = j; k < i; ++k) sum -= L[i * D + k] * K[k * D + j];
      K[i * D + j] = sum / L[i * D + i];
    }
  }
  return true;
}

// diagonal blocks of A, summed over the ranks
struct Diagonal {
  explicit Diagonal(const SysMatrix& matrix) : A(matrix)
  {
    if (!sys_shared(A)) return;
    const size_t DD = static_cast<size_t>(A.dim) * A.dim;
    for (int I = 0; I < A.nrow; ++I) sum.insert(sum.end(), own(I), own(I) + DD);
    sys_sum(A, sum);
  }
  const double* own(int I) const { return &A.val[static_cast<size_t>(A.off[I + 1] - 1) * A.dim * A.dim]; }
  const double* block(int I) const
  {
    return sum.empty() ? own(I) : &sum[static_cast<size_t>(I) * A.dim * A.dim];
  }
  const SysMatrix& A;
  RealVec sum;
};

// inverse of the diagonal block a
template <int D>
bool invert_block(const double* a, double* inverse)
{
  const double least[3] = {0.0, 0.0, 0.0};
  double K[D * D];
  if (!inverse_factor<D>(a, least, K)) return false;
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      inverse[i * D + j] = 0.0;
      for (int k = std::max(i, j); k < D; ++k) inverse[i * D + j] += K[k * D + i] * K[k * D + j];
    }
  return true;
}

bool invert_block(int D, const double* a, double* inverse)
{
  return D == 1   ? invert_block<1>(a, inverse)
         : D == 2 ? invert_block<2>(a, inverse)
                  : invert_block<3>(a, inverse);
}

// s -= a b^T, b in single precision
template <int D>
inline void subtract(const double* a, const float* b, double* s)
{
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      for (int k = 0; k < D; ++k) s[i * D + j] -= a[i * D + k] * static_cast<double>(b[j * D + k]);
}

// The rows of a factor, in the order of elimination
struct FactorRows {
  int n = 0, inner = 0;        // the first inner rows are eliminated, the others have no diagonal block
  const int* off = nullptr;    // [n+1] their blocks,
  const int* col = nullptr;    // ascending, the diagonal last
  const int* from = nullptr;   // 2 k: block k of the matrix, 2 k + 1: transposed; null: in the same order
};

// the rows of one rank, or of the border
FactorRows all_rows(const SysMatrix& A)
{
  FactorRows f;
  f.n = f.inner = A.nrow;
  f.off = A.off.data();
  f.col = A.col.data();
  return f;
}

FactorRows own_rows(const OwnBlock& own)
{
  FactorRows f;
  f.n     = static_cast<int>(own.order.size());
  f.inner = own.inner;
  f.off   = own.off.data();
  f.col   = own.col.data();
  f.from  = own.from.data();
  return f;
}

// blocks of row i of f; Val: double or float
template <int D, class Val>
void take_row(const FactorRows& f, const std::vector<Val>& val, int i, RealVec& row)
{
  const int DD = D * D, first = f.off[i], last = f.off[i + 1];
  row.resize(static_cast<size_t>(last - first) * DD);
  if (!f.from) {
    std::copy(val.begin() + static_cast<long>(first) * DD, val.begin() + static_cast<long>(last) * DD,
              row.begin());
    return;
  }
  double* to = row.data();
  for (int k = first; k < last; ++k, to += DD) {
    const Val* a = &val[static_cast<size_t>(f.from[k] / 2) * DD];
    if (f.from[k] % 2 == 0) std::copy_n(a, DD, to);
    else
      for (int r = 0; r < D; ++r)
        for (int c = 0; c < D; ++c) to[r * D + c] = a[c * D + r];
  }
}

// replaces the block s of row in column J by that of L: L_IJ = (A_IJ - sum_K L_IK L_JK^T) L_JJ^-T, K < J
template <int D>
void eliminate(const FactorRows& f, int J, const IntVec& block_of, const std::vector<float>& L, RealVec& row,
               double* s, float* out)
{
  const int DD = D * D, last = f.off[J + 1] - 1;
  for (int m = f.off[J]; m < last; ++m)
    if (block_of[f.col[m]] >= 0)
      subtract<D>(&row[static_cast<size_t>(block_of[f.col[m]]) * DD], &L[static_cast<size_t>(m) * DD], s);
  const float* inv = &L[static_cast<size_t>(last) * DD];
  double l[DD];
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) {
      l[i * D + j] = 0.0;
      for (int c = 0; c <= j; ++c) l[i * D + j] += s[i * D + c] * static_cast<double>(inv[j * D + c]);
    }
  for (int i = 0; i < DD; ++i) {
    out[i] = static_cast<float>(l[i]);
    s[i]   = static_cast<double>(out[i]);
  }
}

// L L^T of the matrix with the values val, on the rows f, the diagonal times 1 + shift. L may be val.
//   in   base   [n*D] diagonal to which shift and the least pivot are relative; null: that of val
// false: a pivot is not positive
template <int D, class Val>
bool factor(const FactorRows& f, const std::vector<Val>& val, const double* base, double shift,
            std::vector<float>& L)
{
  const int DD = D * D;
  IntVec block_of(f.n, -1);            // [column] index of its block in the present row, -1: none
  RealVec row;
  for (int n = 0; n < f.inner; ++n) {
    const int first = f.off[n], last = f.off[n + 1] - 1;
    take_row<D>(f, val, n, row);
    double* diag = &row[static_cast<size_t>(last - first) * DD];
    double least[D];
    for (int i = 0; i < D; ++i) {
      least[i] = LEAST_PIVOT * (base ? base[n * D + i] : diag[i * D + i]);
      if (base) diag[i * D + i] += shift * base[n * D + i];
      else diag[i * D + i] *= 1.0 + shift;
    }
    for (int k = first; k < last; ++k) {
      double* s  = &row[static_cast<size_t>(k - first) * DD];
      float* out = &L[static_cast<size_t>(k) * DD];
      eliminate<D>(f, f.col[k], block_of, L, row, s, out);
      subtract<D>(s, out, diag);
      block_of[f.col[k]] = k - first;
    }
    for (int k = first; k < last; ++k) block_of[f.col[k]] = -1;
    double K[DD];
    if (!inverse_factor<D>(diag, least, K)) return false;
    for (int i = 0; i < DD; ++i) L[static_cast<size_t>(last) * DD + i] = static_cast<float>(K[i]);
  }
  return true;
}

// several ranks: rows of the border, and the Schur complement after elimination of the inner rows
//   inout left  [border blocks] A, then A - sum_K L_IK L_JK^T, the contribution of this rank
template <int D>
void reduce_border(const FactorRows& f, const RealVec& val, const SysMatrix& border, std::vector<float>& L,
                   std::vector<float>& left)
{
  const int DD = D * D;
  IntVec block_of(f.n, -1);
  RealVec row;
  for (int n = f.inner; n < f.n; ++n) {
    const int first = f.off[n], last = f.off[n + 1], b = n - f.inner;
    take_row<D>(f, val, n, row);
    for (int k = first; k < last; ++k) {
      eliminate<D>(f, f.col[k], block_of, L, row, &row[static_cast<size_t>(k - first) * DD],
                   &L[static_cast<size_t>(k) * DD]);
      block_of[f.col[k]] = k - first;
    }
    for (int q = border.off[b]; q < border.off[b + 1]; ++q) {
      const int other = f.inner + border.col[q];
      double sum[DD];
      std::copy_n(&left[static_cast<size_t>(q) * DD], DD, sum);
      for (int m = f.off[other]; m < f.off[other + 1]; ++m)
        if (block_of[f.col[m]] >= 0)
          subtract<D>(&row[static_cast<size_t>(block_of[f.col[m]]) * DD], &L[static_cast<size_t>(m) * DD],
                      sum);
      for (int i = 0; i < DD; ++i) left[static_cast<size_t>(q) * DD + i] = static_cast<float>(sum[i]);
    }
    for (int k = first; k < last; ++k) block_of[f.col[k]] = -1;
  }
}

// t -= L y, for the blocks of a row
template <int D>
inline void take_blocks(const FactorRows& f, const float* L, int first, int last, const double* z, double* t)
{
  double sum[D];
  for (int i = 0; i < D; ++i) sum[i] = t[i];
  for (int k = first; k < last; ++k) {
    const float* l  = L + static_cast<size_t>(k) * D * D;
    const double* y = z + f.col[k] * D;
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j) sum[i] -= static_cast<double>(l[i * D + j]) * y[j];
  }
  for (int i = 0; i < D; ++i) t[i] = sum[i];
}

// y -= L^T t, for the blocks of a row, in reverse order, so that L is read from memory as one stream; each y
// is loaded and stored once
template <int D>
inline void give_blocks(const FactorRows& f, const float* L, int first, int last, const double* t, double* z)
{
  double from[D];
  for (int i = 0; i < D; ++i) from[i] = t[i];
  for (int k = last - 1; k >= first; --k) {
    const float* l = L + static_cast<size_t>(k) * D * D;
    double* y      = z + f.col[k] * D;
    double sum[D];
    for (int j = 0; j < D; ++j) sum[j] = y[j];
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j) sum[j] -= static_cast<double>(l[i * D + j]) * from[i];
    for (int j = 0; j < D; ++j) y[j] = sum[j];
  }
}

// z = L^-1 z in the eliminated rows; subtracts their contribution from the other rows
template <int D>
void forward(const FactorRows& f, const float* __restrict L, double* __restrict z)
{
  for (int n = 0; n < f.inner; ++n) {
    const int last = f.off[n + 1] - 1;
    double t[D];
    for (int i = 0; i < D; ++i) t[i] = z[n * D + i];
    take_blocks<D>(f, L, f.off[n], last, z, t);
    const float* inv = L + static_cast<size_t>(last) * D * D;
    for (int i = 0; i < D; ++i) {
      double sum = 0.0;
      for (int j = 0; j <= i; ++j) sum += static_cast<double>(inv[i * D + j]) * t[j];
      z[n * D + i] = sum;
    }
  }
  for (int n = f.inner; n < f.n; ++n) take_blocks<D>(f, L, f.off[n], f.off[n + 1], z, z + n * D);
}

// z = L^-T z, given z in the rows that are not eliminated
template <int D>
void backward(const FactorRows& f, const float* __restrict L, double* __restrict z)
{
  for (int n = f.n - 1; n >= f.inner; --n) give_blocks<D>(f, L, f.off[n], f.off[n + 1], z + n * D, z);
  for (int n = f.inner - 1; n >= 0; --n) {
    const int last   = f.off[n + 1] - 1;
    const float* inv = L + static_cast<size_t>(last) * D * D;
    double t[D];
    for (int i = 0; i < D; ++i) {
      t[i] = 0.0;
      for (int j = i; j < D; ++j) t[i] += static_cast<double>(inv[j * D + i]) * z[n * D + j];
    }
    for (int i = 0; i < D; ++i) z[n * D + i] = t[i];
    give_blocks<D>(f, L, f.off[n], last, t, z);
  }
}

// the next shift to try; false: none is left, shift is reset to 0
bool larger_shift(double& shift)
{
  shift = shift > 0.0 ? 10.0 * shift : FIRST_SHIFT;
  if (shift <= LARGEST_SHIFT) return true;
  shift = 0.0;
  return false;
}

void multiply_block(int D, const double* block, const double* x, double* y)
{
  for (int i = 0; i < D; ++i) {
    y[i] = 0.0;
    for (int j = 0; j < D; ++j) y[i] += block[i * D + j] * x[j];
  }
}

// divided model: rows of the factors are used if all ranks that have them now had them then,
// among these the former owner
void keep_agreed(const SysMatrix& A, ReusedFactors& k)
{
  const double had = 1.0, owned = 1e6;
  RealVec vote(A.nrow, 0.0), ranks(A.nrow, 1.0);
  for (int I = 0; I < A.nrow; ++I)
    if (k.old[I] >= 0) vote[I] = had + (k.owner[k.old[I]] == comm_rank() ? owned : 0.0);
  for (const IntVec& list : A.halo.common)
    for (int I : list) ranks[I] += 1.0;
  halo_sum(A.halo, 1, vote);
  for (int I = 0; I < A.nrow; ++I)
    if (vote[I] != owned + ranks[I]) k.old[I] = -1;
}

}  // namespace

// ---------------------------------------------------------------------------
// diagonal_form : inverse diagonal blocks of A. false: one of them is not positive definite
// ---------------------------------------------------------------------------
bool diagonal_form(const SysMatrix& A, RealVec& inverse)
{
  const Diagonal diagonal(A);
  inverse.resize(static_cast<size_t>(A.nrow) * A.dim * A.dim);
  for (int I = 0; I < A.nrow; ++I)
    if (!invert_block(A.dim, diagonal.block(I), &inverse[static_cast<size_t>(I) * A.dim * A.dim]))
      return false;
  return true;
}

void diagonal_apply(const SysMatrix& A, const RealVec& inverse, const RealVec& r, RealVec& z)
{
  const int D = A.dim;
  for (int I = 0; I < A.nrow; ++I)
    multiply_block(D, &inverse[static_cast<size_t>(I) * D * D], &r[I * D], &z[I * D]);
}

// ---------------------------------------------------------------------------
// cholesky_form : incomplete Cholesky factor L of A on its own pattern                (8.3)
//
//   in   own  several ranks: the rows of this one and the border, collective; null: one rank
//   out  c    L in single precision, which halves the memory traffic; L^-T L^-1 stays symmetric.
//             A diagonal block holds the inverse of the factor of that block.
//
// If a pivot is not positive, the diagonal is enlarged to (1 + shift) times that of A; the next factorisation
// begins with the shift that succeeded. false: even the largest shift fails.
// ---------------------------------------------------------------------------
bool cholesky_form(const SysMatrix& A, Cholesky& c, OwnBlock* own)
{
  const FactorRows rows = own ? own_rows(*own) : all_rows(A);
  fit_size(c.L, static_cast<size_t>(rows.off[rows.n]) * A.dim * A.dim);
  return with_dim(A.dim, [&](auto d) {
    constexpr int D = decltype(d)::value;
    bool good = true;
    while (good && !factor<D>(rows, A.val, nullptr, c.shift, c.L)) good = larger_shift(c.shift);
    if (!own) return good;
    // The Schur complement of the border, summed over the ranks, is factorised in its storage (8.7); if a
    // rank needs a larger shift, all begin again
    const SysMatrix& border = own->border;
    for (;;) {
      own_border(A, *own, c.border);
      reduce_border<D>(rows, A.val, border, c.L, c.border);
      own_sum(*own, D, c.border);
      const bool done = factor<D>(all_rows(border), c.border, own->diag.data(), c.border_shift, c.border);
      good = good && (done || larger_shift(c.border_shift));
      const int worst = comm_allreduce_max(!good ? 2 : !done ? 1 : 0);
      if (worst != 1) return worst == 0;
    }
  });
}

void cholesky_apply(const SysMatrix& A, const Cholesky& c, RealVec& z)
{
  with_dim(A.dim, [&](auto d) {
    constexpr int D = decltype(d)::value;
    forward<D>(all_rows(A), c.L.data(), z.data());
    backward<D>(all_rows(A), c.L.data(), z.data());
    return 0;
  });
}

// ---------------------------------------------------------------------------
// cholesky_apply : several ranks: z = M^-1 r, r and z summed over the ranks            (8.7)
//
//   inout y   [neq] work space
//
// If all ranks have the same border, each solves for all of it. Otherwise each solves for its own rows,
// shared rows being weighted.  Returns r z of all ranks. Collective.
// ---------------------------------------------------------------------------
double cholesky_apply(const SysMatrix& A, const Cholesky& c, const OwnBlock& own, RealVec& y, RealVec& z)
{
  const FactorRows rows = own_rows(own), edge = all_rows(own.border);
  const int* row = own.order.data();               // row of A for each row of the factor
  return with_dim(A.dim, [&](auto d) {
    constexpr int D = decltype(d)::value;
    if (!own.in_order) {
      y.resize(z.size());
      for (int n = 0; n < rows.n; ++n) std::copy_n(&z[row[n] * D], D, &y[n * D]);
    }
    RealVec& x = own.in_order ? z : y;             // in the order of the factor
    for (int n = rows.inner; n < rows.n; ++n)
      for (int i = 0; i < D; ++i) x[n * D + i] *= own.once[row[n] * D + i];
    forward<D>(rows, c.L.data(), x.data());
    double rz = sum_terms(static_cast<size_t>(rows.inner) * D, [&](size_t k) { return x[k] * x[k]; });
    const auto part = [&](int n) { return own.alike ? 1.0 : own.weight[n - rows.inner]; };
    const auto sum_border = [&](double* with) {
      for (int n = rows.inner; n < rows.n; ++n) std::copy_n(&x[n * D], D, &z[row[n] * D]);
      halo_sum(A.halo, D, z, with, 1);
    };
    sum_border(&rz);
    RealVec b(static_cast<size_t>(edge.n) * D);
    for (int n = rows.inner; n < rows.n; ++n)
      for (int i = 0; i < D; ++i) b[(n - rows.inner) * D + i] = part(n) * z[row[n] * D + i];
    forward<D>(edge, c.border.data(), b.data());
    double more = dot(b, b);
    backward<D>(edge, c.border.data(), b.data());
    for (int n = rows.inner; n < rows.n; ++n)
      for (int i = 0; i < D; ++i) x[n * D + i] = part(n) * b[(n - rows.inner) * D + i];
    if (!own.alike) {
      sum_border(&more);
      for (int n = rows.inner; n < rows.n; ++n) std::copy_n(&z[row[n] * D], D, &x[n * D]);
    }
    backward<D>(rows, c.L.data(), x.data());
    for (int n = 0; n < rows.n && !own.in_order; ++n) std::copy_n(&x[n * D], D, &z[row[n] * D]);
    return rz + more;
  });
}

// ---------------------------------------------------------------------------
// reused_form : finds the row of the factorised matrix for each row of A                 (8.4)
//
//   in   key   [nrow] identity of a row: two rows with the same key are the same node
//   divided model: only rows that all ranks with the row had then, including its former owner
//   out  k     old row of each row, or -1; these get the inverse of their diagonal block
//
// false: the diagonal block of a new row is not positive definite
// ---------------------------------------------------------------------------
bool reused_form(const SysMatrix& A, const std::vector<long>& key, ReusedFactors& k)
{
  const int D = A.dim;
  k.same = key == k.key;
  if (sys_shared(A)) k.same = !comm_allreduce_max(static_cast<int>(!k.same));
  if (k.same) return true;
  std::unordered_map<long, int> old;
  old.reserve(k.key.size());
  for (size_t i = 0; i < k.key.size(); ++i) old[k.key[i]] = static_cast<int>(i);
  k.old.assign(A.nrow, -1);
  k.inverse.resize(static_cast<size_t>(A.nrow) * D * D);
  k.x.resize(k.key.size() * D);
  for (int I = 0; I < A.nrow; ++I) {
    const auto found = old.find(key[I]);
    if (found != old.end()) k.old[I] = found->second;
  }
  if (sys_shared(A)) keep_agreed(A, k);
  const Diagonal diagonal(A);
  bool good = true;
  for (int I = 0; I < A.nrow && good; ++I)
    good = k.old[I] >= 0 ||
           invert_block(D, diagonal.block(I), &k.inverse[static_cast<size_t>(I) * D * D]);
  return sys_shared(A) ? !comm_allreduce_max(static_cast<int>(!good)) : good;
}

// z = P^T F^-1 P r + inverse diagonal blocks of the rows that P omits: symmetric
// and positive definite if F is
Status reused_apply(Solver& s, const SysMatrix& A, ReusedFactors& k, const RealVec& r, RealVec& z)
{
  if (k.same) return solve_back_rough(s, r, z);
  const int D = A.dim;
  std::fill(k.x.begin(), k.x.end(), 0.0);
  for (int I = 0; I < A.nrow; ++I)
    if (k.old[I] >= 0)
      for (int i = 0; i < D; ++i) k.x[k.old[I] * D + i] = r[I * D + i];
  const Status status = solve_back_rough(s, k.x, k.x);
  for (int I = 0; I < A.nrow; ++I) {
    if (k.old[I] < 0) multiply_block(D, &k.inverse[static_cast<size_t>(I) * D * D], &r[I * D], &z[I * D]);
    else
      for (int i = 0; i < D; ++i) z[I * D + i] = k.x[k.old[I] * D + i];
  }
  return status;
}
