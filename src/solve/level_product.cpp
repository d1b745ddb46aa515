#include "solve/level_product.h"

#include <algorithm>

#include "base/log.h"

namespace {

const int LANES = 8;
typedef float Lanes __attribute__((vector_size(4 * LANES)));
typedef float LanesAt __attribute__((vector_size(4 * LANES), aligned(4), may_alias));

int line_length(const LevelMatrix& A, int I)
{
  const int count = (A.off[I + 1] - A.off[I]) * A.cols;
  return (count + LANES - 1) / LANES * LANES;
}

float sum(Lanes v)
{
  float s = 0.0F;
  for (int l = 0; l < LANES; ++l) s += v[l];
  return s;
}

// R lines of one length, times v
template <int R>
void multiply_lines(const float* a, int length, const float* v, bool add, double* y)
{
  Lanes part[R] = {};
  for (int k = 0; k < length; k += LANES) {
    const Lanes x = *reinterpret_cast<const LanesAt*>(v + k);
    for (int i = 0; i < R; ++i) part[i] += *reinterpret_cast<const LanesAt*>(a + i * length + k) * x;
  }
  for (int i = 0; i < R; ++i) y[i] = (add ? y[i] : 0.0) + sum(part[i]);
}

// v = sum of x_i times line i
template <int R>
void add_lines(const float* a, int length, const double* x, float* v)
{
  float scale[R];
  for (int i = 0; i < R; ++i) scale[i] = static_cast<float>(x[i]);
  for (int k = 0; k < length; k += LANES) {
    Lanes s = {};
    for (int i = 0; i < R; ++i) s += *reinterpret_cast<const LanesAt*>(a + i * length + k) * scale[i];
    *reinterpret_cast<LanesAt*>(v + k) = s;
  }
}

template <int R>
void multiply(const LevelMatrix& A, const double* x, bool add, double* y)
{
  const int C = A.cols;
  std::vector<float> part;
  for (size_t I = 0; I + 1 < A.off.size(); ++I) {
    const int length = line_length(A, static_cast<int>(I));
    if (static_cast<int>(part.size()) < length) part.resize(length);
    float* v = part.data();
    for (int k = A.off[I]; k < A.off[I + 1]; ++k)
      for (int j = 0; j < C; ++j) *v++ = static_cast<float>(x[A.col[k] * C + j]);
    std::fill(v, part.data() + length, 0.0F);
    multiply_lines<R>(A.val.data() + A.first[I], length, part.data(), add, y + I * R);
  }
}

template <int R>
void transposed(const LevelMatrix& A, const double* x, double* y)
{
  const int C = A.cols;
  std::vector<float> part;
  for (size_t I = 0; I + 1 < A.off.size(); ++I) {
    const int length = line_length(A, static_cast<int>(I));
    if (static_cast<int>(part.size()) < length) part.resize(length);
    add_lines<R>(A.val.data() + A.first[I], length, x + I * R, part.data());
    const float* v = part.data();
    for (int k = A.off[I]; k < A.off[I + 1]; ++k)
      for (int j = 0; j < C; ++j) y[A.col[k] * C + j] += *v++;
  }
}

// columns of blocks of each row of blocks, ascending
void list_blocks(int n, int m, const int* off, const int* col, LevelMatrix& A)
{
  IntVec seen(m / A.cols, -1);
  A.off.assign(1, 0);
  A.col.clear();
  for (int I = 0; I < n / A.rows; ++I) {
    for (int k = off[I * A.rows]; k < off[(I + 1) * A.rows]; ++k) {
      const int J = col[k] / A.cols;
      if (seen[J] == I) continue;
      seen[J] = I;
      A.col.push_back(J);
    }
    std::sort(A.col.begin() + A.off.back(), A.col.end());
    A.off.push_back(static_cast<int>(A.col.size()));
  }
}

}  // namespace

bool level_fill(int rows, int cols, int n, int m, const int* off, const int* col, const double* val,
                LevelMatrix& A)
{
  if (rows < 1 || cols < 1 || rows > 6 || n % rows || m % cols) return false;
  A.rows = rows;
  A.cols = cols;
  list_blocks(n, m, off, col, A);
  if (static_cast<double>(A.col.size()) * rows * cols > 2.0 * off[n] + 1.0) return false;
  A.first.assign(1, 0);
  for (int I = 0; I < n / rows; ++I)
    A.first.push_back(A.first.back() + static_cast<size_t>(rows) * line_length(A, I));
  A.val.assign(A.first.back(), 0.0F);
  IntVec place(m / cols);
  for (int I = 0; I < n / rows; ++I) {
    for (int k = A.off[I]; k < A.off[I + 1]; ++k) place[A.col[k]] = (k - A.off[I]) * cols;
    float* line = A.val.data() + A.first[I];
    for (int i = I * rows; i < (I + 1) * rows; ++i, line += line_length(A, I))
      for (int k = off[i]; k < off[i + 1]; ++k)
        line[place[col[k] / cols] + col[k] % cols] = static_cast<float>(val[k]);
  }
  return true;
}

void level_multiply(const LevelMatrix& A, const double* x, bool add, double* y)
{
  switch (A.rows) {
    case 1: return multiply<1>(A, x, add, y);
    case 2: return multiply<2>(A, x, add, y);
    case 3: return multiply<3>(A, x, add, y);
    case 4: return multiply<4>(A, x, add, y);
    case 5: return multiply<5>(A, x, add, y);
    case 6: return multiply<6>(A, x, add, y);
  }
  log_bug("level_multiply: blocks have one to six rows", __FILE__, __LINE__);
}

void level_transposed(const LevelMatrix& A, const double* x, double* y)
{
  switch (A.rows) {
    case 1: return transposed<1>(A, x, y);
    case 2: return transposed<2>(A, x, y);
    case 3: return transposed<3>(A, x, y);
    case 4: return transposed<4>(A, x, y);
    case 5: return transposed<5>(A, x, y);
    case 6: return transposed<6>(A, x, y);
  }
  log_bug("level_transposed: blocks have one to six rows", __FILE__, __LINE__);
}

double level_memory(const LevelMatrix& A)
{
  return static_cast<double>((A.off.capacity() + A.col.capacity()) * sizeof(int) +
                             A.first.capacity() * sizeof(size_t) + A.val.capacity() * sizeof(float));
}
