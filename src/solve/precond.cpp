#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "base/comm.h"
#include "base/log.h"
#include "solve/solve_data.h"

namespace {

const double LEAST_PIVOT   = 1e-6;     // of the diagonal of A; below, the incomplete factor is worthless
// of the diagonal, when a pivot is not positive; then ten times as much
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

// diagonal blocks of A; those of several ranks are summed
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

// s -= a b^T, then the same with b of single precision
template <int D>
inline void subtract(const double* a, const float* b, double* s)
{
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      for (int k = 0; k < D; ++k) s[i * D + j] -= a[i * D + k] * static_cast<double>(b[j * D + k]);
}

// L L^T of A with the diagonal times 1 + shift, on the pattern of A; border (or null): blocks instead of
// those of A. false: a pivot is not positive
template <int D>
bool factor(const SysMatrix& A, const Border* border, double shift, std::vector<float>& L)
{
  const int DD = D * D;
  IntVec place(A.nrow, -1);            // of a column in the row at hand
  RealVec row;
  size_t next = 0;                     // block of the border
  for (int I = 0; I < A.nrow; ++I) {
    const int first = A.off[I], last = A.off[I + 1] - 1;
    row.assign(A.val.begin() + static_cast<long>(first) * DD,
               A.val.begin() + static_cast<long>(last + 1) * DD);
    for (; border && next < border->block.size() && border->block[next] <= last; ++next)
      std::copy_n(&border->val[next * DD], DD, &row[static_cast<size_t>(border->block[next] - first) * DD]);
    double* diag = &row[static_cast<size_t>(last - first) * DD];
    double least[D];
    for (int i = 0; i < D; ++i) {
      least[i] = LEAST_PIVOT * diag[i * D + i];
      diag[i * D + i] *= 1.0 + shift;
    }
    for (int k = first; k < last; ++k) {
      const int J = A.col[k];
      double* s   = &row[static_cast<size_t>(k - first) * DD];
      // L_IJ = (A_IJ - sum_K L_IK L_JK^T) L_JJ^-T, K < J
      for (int m = A.off[J]; m < A.off[J + 1] - 1; ++m)
        if (place[A.col[m]] >= 0)
          subtract<D>(&row[static_cast<size_t>(place[A.col[m]]) * DD], &L[static_cast<size_t>(m) * DD], s);
      const float* inv = &L[static_cast<size_t>(A.off[J + 1] - 1) * DD];
      double l[DD];
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) {
          l[i * D + j] = 0.0;
          for (int c = 0; c <= j; ++c) l[i * D + j] += s[i * D + c] * static_cast<double>(inv[j * D + c]);
        }
      float* out = &L[static_cast<size_t>(k) * DD];
      for (int i = 0; i < DD; ++i) {
        out[i] = static_cast<float>(l[i]);
        s[i]   = static_cast<double>(out[i]);
      }
      subtract<D>(s, out, diag);
      place[J] = k - first;
    }
    for (int k = first; k < last; ++k) place[A.col[k]] = -1;
    double K[DD];
    if (!inverse_factor<D>(diag, least, K)) return false;
    for (int i = 0; i < DD; ++i) L[static_cast<size_t>(last) * DD + i] = static_cast<float>(K[i]);
  }
  return true;
}

// z = L^-T L^-1 z
template <int D>
void solve(const SysMatrix& A, const float* __restrict L, double* __restrict z)
{
  for (int I = 0; I < A.nrow; ++I) {
    const int last = A.off[I + 1] - 1;
    double t[D];
    for (int i = 0; i < D; ++i) t[i] = z[I * D + i];
    for (int k = A.off[I]; k < last; ++k) {
      const float* l  = L + static_cast<size_t>(k) * D * D;
      const double* y = z + A.col[k] * D;
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) t[i] -= static_cast<double>(l[i * D + j]) * y[j];
    }
    const float* inv = L + static_cast<size_t>(last) * D * D;
    for (int i = 0; i < D; ++i) {
      double sum = 0.0;
      for (int j = 0; j <= i; ++j) sum += static_cast<double>(inv[i * D + j]) * t[j];
      z[I * D + i] = sum;
    }
  }
  for (int I = A.nrow - 1; I >= 0; --I) {
    const int last   = A.off[I + 1] - 1;
    const float* inv = L + static_cast<size_t>(last) * D * D;
    double t[D];
    for (int i = 0; i < D; ++i) {
      t[i] = 0.0;
      for (int j = i; j < D; ++j) t[i] += static_cast<double>(inv[j * D + i]) * z[I * D + j];
    }
    for (int i = 0; i < D; ++i) z[I * D + i] = t[i];
    for (int k = A.off[I]; k < last; ++k) {
      const float* l = L + static_cast<size_t>(k) * D * D;
      double* y      = z + A.col[k] * D;
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) y[j] -= static_cast<double>(l[i * D + j]) * t[i];
    }
  }
}

void multiply_block(int D, const double* block, const double* x, double* y)
{
  for (int i = 0; i < D; ++i) {
    y[i] = 0.0;
    for (int j = 0; j < D; ++j) y[i] += block[i * D + j] * x[j];
  }
}

// divided model: rows of the factors serve when all ranks that have them today had them then
void keep_agreed(const SysMatrix& A, ReusedFactors& k)
{
  const double had = 1.0, belonged = 1e6;
  RealVec vote(A.nrow, 0.0), ranks(A.nrow, 1.0);
  for (int I = 0; I < A.nrow; ++I)
    if (k.old[I] >= 0) vote[I] = had + (k.owner[k.old[I]] == comm_rank() ? belonged : 0.0);
  for (const IntVec& list : A.halo.common)
    for (int I : list) ranks[I] += 1.0;
  halo_sum(A.halo, 1, vote);
  for (int I = 0; I < A.nrow; ++I)
    if (vote[I] != belonged + ranks[I]) k.old[I] = -1;
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
//   in   border   blocks that stand for those of A; null: none
//   out  c   L in single precision, which halves what the memory must bring; L^-T L^-1 stays symmetric.
//            The place of a diagonal block holds the inverse of the factor of that block.
//
// A pivot that is not positive asks for a larger diagonal, (1 + shift) times that of A; the shift that went
// well is where the next form begins. false: not even the largest shift helps.
// ---------------------------------------------------------------------------
bool cholesky_form(const SysMatrix& A, Cholesky& c, const Border* border)
{
  c.L.resize(A.val.size());
  for (;;) {
    const bool good = A.dim == 1   ? factor<1>(A, border, c.shift, c.L)
                      : A.dim == 2 ? factor<2>(A, border, c.shift, c.L)
                                   : factor<3>(A, border, c.shift, c.L);
    if (good) return true;
    c.shift = c.shift > 0.0 ? 10.0 * c.shift : FIRST_SHIFT;
    if (c.shift > LARGEST_SHIFT) {
      c.shift = 0.0;
      return false;
    }
  }
}

void cholesky_apply(const SysMatrix& A, const Cholesky& c, RealVec& z)
{
  switch (A.dim) {
    case 1: return solve<1>(A, c.L.data(), z.data());
    case 2: return solve<2>(A, c.L.data(), z.data());
    case 3: return solve<3>(A, c.L.data(), z.data());
  }
  log_bug("cholesky_apply: blocks are 1 x 1, 2 x 2 or 3 x 3", __FILE__, __LINE__);
}

// ---------------------------------------------------------------------------
// reused_form : which row of the factorised matrix each row of A was                     (8.4)
//
//   in   key   [nrow] who a row is: two rows with the same key are the same node
//   divided model: only rows that all who have them had then, the rank they belonged to among these
//   out  k     old row of each row, or -1; those get the inverse of their diagonal block
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

// z = P^T F^-1 P r + inverse diagonal blocks of the rows that P leaves out: symmetric and positive definite
// when F is
Status reused_apply(Solver& s, const SysMatrix& A, ReusedFactors& k, const RealVec& r, RealVec& z)
{
  if (k.same) return solve_back(s, r, z);
  const int D = A.dim;
  std::fill(k.x.begin(), k.x.end(), 0.0);
  for (int I = 0; I < A.nrow; ++I)
    if (k.old[I] >= 0)
      for (int i = 0; i < D; ++i) k.x[k.old[I] * D + i] = r[I * D + i];
  const Status status = solve_back(s, k.x, k.x);
  for (int I = 0; I < A.nrow; ++I) {
    if (k.old[I] < 0) multiply_block(D, &k.inverse[static_cast<size_t>(I) * D * D], &r[I * D], &z[I * D]);
    else
      for (int i = 0; i < D; ++i) z[I * D + i] = k.x[k.old[I] * D + i];
  }
  return status;
}
