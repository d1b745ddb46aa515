#include "solve/level_product.h"

#include <algorithm>
#include <type_traits>

#include "base/log.h"

namespace {

const int WIDTH = 8;
typedef float Lanes __attribute__((vector_size(4 * WIDTH)));
typedef float LanesAt __attribute__((vector_size(4 * WIDTH), aligned(4), may_alias));

int block_rows(const LevelMatrix& A) { return static_cast<int>(A.off.size()) - 1; }

int line_length(const LevelMatrix& A, int I)
{
  const int count = (A.off[I + 1] - A.off[I]) * A.cols;
  return (count + WIDTH - 1) / WIDTH * WIDTH;
}

float sum(Lanes v)
{
  float s = 0.0F;
  for (int l = 0; l < WIDTH; ++l) s += v[l];
  return s;
}

// R lines of one length, times v
template <int R>
void multiply_lines(const float* a, int length, const float* v, bool add, double* y)
{
  Lanes part[R] = {};
  for (int k = 0; k < length; k += WIDTH) {
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
  for (int k = 0; k < length; k += WIDTH) {
    Lanes s = {};
    for (int i = 0; i < R; ++i) s += *reinterpret_cast<const LanesAt*>(a + i * length + k) * scale[i];
    *reinterpret_cast<LanesAt*>(v + k) = s;
  }
}

// calls use(I, length, a) for each row of blocks, with the length of its lines and the first of them
template <int R, class Use>
void each_row(const LevelMatrix& A, Use use)
{
  const float* a = A.val.data();
  for (int I = 0; I < block_rows(A); ++I) {
    const int length = line_length(A, I);
    use(I, length, a);
    a += R * length;
  }
}

// memory for the part of a vector that multiplies the longest line
std::vector<float> longest_part(const LevelMatrix& A)
{
  int longest = 0;
  for (int I = 0; I < block_rows(A); ++I) longest = std::max(longest, line_length(A, I));
  return std::vector<float>(longest);
}

template <int R>
void multiply(const LevelMatrix& A, const double* x, bool add, double* y)
{
  std::vector<float> part = longest_part(A);
  each_row<R>(A, [&](int I, int length, const float* a) {
    float* v = part.data();
    for (int k = A.off[I]; k < A.off[I + 1]; ++k)
      for (int j = 0; j < A.cols; ++j) *v++ = static_cast<float>(x[A.col[k] * A.cols + j]);
    std::fill(v, part.data() + length, 0.0F);
    multiply_lines<R>(a, length, part.data(), add, y + I * R);
  });
}

template <int R>
void transposed(const LevelMatrix& A, const double* x, double* y)
{
  std::vector<float> part = longest_part(A);
  each_row<R>(A, [&](int I, int length, const float* a) {
    add_lines<R>(a, length, x + I * R, part.data());
    const float* v = part.data();
    for (int k = A.off[I]; k < A.off[I + 1]; ++k)
      for (int j = 0; j < A.cols; ++j) y[A.col[k] * A.cols + j] += *v++;
  });
}

// rows of a block: displacements of a node, or motions of an aggregate
template <class Use>
void with_rows(int rows, Use use)
{
  switch (rows) {
    case 1: return use(std::integral_constant<int, 1>());
    case 2: return use(std::integral_constant<int, 2>());
    case 3: return use(std::integral_constant<int, 3>());
    case 6: return use(std::integral_constant<int, 6>());
  }
  log_bug("with_rows: blocks have 1, 2, 3 or 6 rows", __FILE__, __LINE__);
}

// block columns of each row of blocks, ascending
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
  const bool known = rows == 1 || rows == 2 || rows == 3 || rows == 6;
  if (!known || cols < 1 || n % rows || m % cols) return false;
  A.rows = rows;
  A.cols = cols;
  list_blocks(n, m, off, col, A);
  if (static_cast<double>(A.col.size()) * rows * cols > 2.0 * off[n] + 1.0) return false;
  size_t numbers = 0;
  for (int I = 0; I < block_rows(A); ++I) numbers += static_cast<size_t>(rows) * line_length(A, I);
  A.val.assign(numbers, 0.0F);
  IntVec start(m / cols);                            // of a block column in the lines of a row
  float* line = A.val.data();
  for (int I = 0; I < block_rows(A); ++I) {
    const int length = line_length(A, I);
    for (int k = A.off[I]; k < A.off[I + 1]; ++k) start[A.col[k]] = (k - A.off[I]) * cols;
    for (int i = I * rows; i < (I + 1) * rows; ++i, line += length)
      for (int k = off[i]; k < off[i + 1]; ++k)
        line[start[col[k] / cols] + col[k] % cols] = static_cast<float>(val[k]);
  }
  return true;
}

void level_multiply(const LevelMatrix& A, const double* x, bool add, double* y)
{
  with_rows(A.rows, [&](auto rows) { multiply<decltype(rows)::value>(A, x, add, y); });
}

void level_transposed(const LevelMatrix& A, const double* x, double* y)
{
  with_rows(A.rows, [&](auto rows) { transposed<decltype(rows)::value>(A, x, y); });
}

double level_memory(const LevelMatrix& A)
{
  return static_cast<double>((A.off.capacity() + A.col.capacity()) * sizeof(int) +
                             A.val.capacity() * sizeof(float));
}
