// ---------------------------------------------------------------------------
// level_product.h : products with the matrices of coarse levels, in single precision
//
// The rows of an aggregate couple with the same columns, which form whole aggregates: a row of blocks is
// stored as `rows` consecutive lines of numbers, and its part of x is gathered once.
// ---------------------------------------------------------------------------
#ifndef MPFE_SOLVE_LEVEL_PRODUCT_H
#define MPFE_SOLVE_LEVEL_PRODUCT_H

#include "base/types.h"

struct LevelMatrix {
  int rows = 1, cols = 1;          // of a block
  IntVec off, col;                 // [block rows + 1], [blocks] its column, in blocks
  std::vector<float> val;          // its lines, padded with zeros to whole vector registers
};

// level_fill : A of the pattern (off, col) and the values of single equations, for n rows and m columns
//
// false: n x m is not divisible into blocks of rows x cols, the blocks would take more than twice the memory,
// or rows is not 1, 2, 3 or 6
bool level_fill(int rows, int cols, int n, int m, const int* off, const int* col, const double* val,
                LevelMatrix& A);

// level_multiply : y = A x, or y += A x; level_transposed : y += A^T x. x and y do not overlap
void level_multiply(const LevelMatrix& A, const double* x, bool add, double* y);
void level_transposed(const LevelMatrix& A, const double* x, double* y);

double level_memory(const LevelMatrix& A);

#endif
