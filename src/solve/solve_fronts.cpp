#include <Eigen/Dense>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/log.h"
#include "solve/solve_data.h"

namespace {

const double ZERO_PIVOT = 3e-12;     // of the diagonal of A in the same equation, as for the skyline
const double ZEROS      = 0.03;      // of the numbers of a front, and FEW more: fewer and larger fronts
const double FEW        = 16.0;      // blocks
const int PANEL         = 32;        // columns that are factorised one by one
const int D             = 2;         // blocks of plane problems; a constant, which makes small loops a tenth faster

using Matrix = Eigen::Map<Eigen::MatrixXd, 0, Eigen::OuterStride<>>;

// rows below the diagonal that elimination leaves in each column, and the first of them (-1: none), in the order of elimination
void column_rows(const ListTable& graph, const IntVec& pos, std::vector<IntVec>& below, IntVec& parent)
{
  const int n = graph.size();
  IntVec row(n), mark(n, -1);
  for (int I = 0; I < n; ++I) row[pos[I]] = I;
  std::vector<IntVec> child(n);
  below.assign(n, {});
  parent.assign(n, -1);
  for (int j = 0; j < n; ++j) {
    const auto take = [&](int i) {
      if (i <= j || mark[i] == j) return;
      mark[i] = j;
      below[j].push_back(i);
    };
    for (const int* J = graph.begin(row[j]); J != graph.begin(row[j]) + graph.count(row[j]); ++J) take(pos[*J]);
    for (int c : child[j])
      for (int i : below[c]) take(i);
    if (below[j].empty()) continue;
    parent[j] = *std::min_element(below[j].begin(), below[j].end());
    child[parent[j]].push_back(j);
  }
}

// Columns become fronts: the front of a column takes in those of its children, as long as that brings few zeros.
// Returns the last column of the front of each column
IntVec join_columns(const std::vector<IntVec>& below, const IntVec& parent)
{
  const int n = static_cast<int>(parent.size());
  IntVec into(n);
  std::iota(into.begin(), into.end(), 0);
  std::vector<double> width(n, 1.0), zeros(n, 0.0);
  std::vector<IntVec> child(n);
  for (int j = 0; j < n; ++j) {
    std::stable_sort(child[j].begin(), child[j].end(), [&](int a, int b) { return below[a].size() > below[b].size(); });
    for (int c : child[j]) {
      const double w = width[c] + width[j], rows = static_cast<double>(below[j].size());
      const double z = zeros[c] + zeros[j] + width[c] * (width[j] + rows - static_cast<double>(below[c].size()));
      if (z > ZEROS * w * (0.5 * w + rows) + FEW) continue;
      into[c]  = j;
      width[j] = w;
      zeros[j] = z;
    }
    if (parent[j] >= 0) child[parent[j]].push_back(j);
  }
  for (int j = n - 1; j >= 0; --j) into[j] = into[into[j]];
  return into;
}

// the fronts so that each follows its children at once
IntVec postorder(const IntVec& into, const IntVec& parent)
{
  const int n = static_cast<int>(into.size());
  std::vector<IntVec> child(n + 1);
  for (int j = n - 1; j >= 0; --j)
    if (into[j] == j) child[parent[j] < 0 ? n : into[parent[j]]].push_back(j);
  IntVec order, stack = child[n];
  while (!stack.empty()) {             // parents first, turned round at the end
    const int j = stack.back();
    stack.pop_back();
    order.push_back(j);
    stack.insert(stack.end(), child[j].begin(), child[j].end());
  }
  std::reverse(order.begin(), order.end());
  return order;
}

// to which number of which front each block of A goes
void place_blocks(const SysMatrix& A, Fronts& f)
{
  const int fronts = f.count();
  IntVec owner(A.nrow), local(A.nrow, -1);
  for (int s = 0; s < fronts; ++s)
    for (int j = f.first[s]; j < f.first[s + 1]; ++j) owner[j] = s;
  std::vector<std::vector<FrontBlock>> found(fronts);
  for (int I = 0; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1]; ++k) {
      const int i = f.place[I], j = f.place[A.col[k]];
      found[owner[std::min(i, j)]].push_back({k, std::max(i, j), std::min(i, j), i < j});
    }
  f.block_off.assign(1, 0);
  f.block.clear();
  for (int s = 0; s < fronts; ++s) {
    const int first = f.first[s], width = f.first[s + 1] - first;
    for (int j = 0; j < width; ++j) local[first + j] = j;
    for (int k = 0; k < f.below.count(s); ++k) local[f.below.begin(s)[k]] = width + k;
    for (FrontBlock b : found[s]) {
      b.row = local[b.row];
      b.col -= first;
      f.block.push_back(b);
    }
    f.block_off.push_back(static_cast<int>(f.block.size()));
  }
}

// A in the columns of front s
void add_matrix(const SysMatrix& A, const Fronts& f, int s, double* P, int m)
{
  for (int q = f.block_off[s]; q < f.block_off[s + 1]; ++q) {
    const FrontBlock& b = f.block[q];
    const double* a     = &A.val[static_cast<size_t>(b.k) * D * D];
    double* to          = P + static_cast<size_t>(b.col) * D * m + b.row * D;
    for (int j = 0; j < D; ++j)
      for (int i = b.row == b.col ? j : 0; i < D; ++i) to[static_cast<size_t>(j) * m + i] += b.turned ? a[j * D + i] : a[i * D + j];
  }
}

// what child c leaves, to front s: columns P, the rest U; local: row of the front of each block row
void add_child(const Fronts& f, int c, const double* from, const IntVec& local, int k, double* P, int m, double* U)
{
  const int n = f.below.count(c), rows = n * D, rest = m - k;
  const int* row = f.below.begin(c);
  for (int J = 0; J < n; ++J)
    for (int j = 0; j < D; ++j) {
      const int col   = local[row[J]] * D + j;
      const double* x = from + static_cast<size_t>(J * D + j) * rows;
      double* to      = col < k ? P + static_cast<size_t>(col) * m : U + static_cast<size_t>(col - k) * rest - k;
      for (int I = J; I < n; ++I)
        for (int i = 0; i < D; ++i) to[local[row[I]] * D + i] += x[I * D + i];
    }
}

// the first w columns of P, rows below them included; the diagonal becomes its inverse. false: a pivot is not clearly positive
bool factor_columns(double* P, int m, int rows, int w, const double* least)
{
  for (int j = 0; j < w; ++j) {
    double* a = P + static_cast<size_t>(j) * m;
    for (int c = 0; c < j; ++c) {
      const double* l = P + static_cast<size_t>(c) * m;
      const double t  = l[j];
      for (int i = j; i < rows; ++i) a[i] -= t * l[i];
    }
    if (!(a[j] > least[j])) return false;
    const double inverse = 1.0 / std::sqrt(a[j]);
    for (int i = j + 1; i < rows; ++i) a[i] *= inverse;
    a[j] = inverse;
  }
  return true;
}

// Cholesky factor of the k columns of a front of m rows, and what it leaves to the rest, U -= L L^T
bool factor_front(double* P, int m, int k, double* U, const double* least)
{
  for (int j = 0; j < k; j += PANEL) {
    const int w = std::min(PANEL, k - j), rows = m - j, next = k - j - w;
    double* a = P + static_cast<size_t>(j) * m + j;
    if (!factor_columns(a, m, rows, w, least + j)) return false;
    if (next == 0) break;
    const Matrix L(a + w, rows - w, w, Eigen::OuterStride<>(m));
    Matrix(a + static_cast<size_t>(w) * m + w, rows - w, next, Eigen::OuterStride<>(m)).noalias() -= L * L.topRows(next).transpose();
  }
  const int rest = m - k;
  if (rest == 0) return true;
  const Matrix L(P + k, rest, k, Eigen::OuterStride<>(m));
  Matrix(U, rest, rest, Eigen::OuterStride<>(rest)).selfadjointView<Eigen::Lower>().rankUpdate(L, -1.0);
  return true;
}

// w <- L^-1 w in the columns a, W of them, and what they leave in the rows below
template <int W>
void forward(const double* __restrict a, int m, int rows, double* __restrict w)
{
  double x[W];
  for (int j = 0; j < W; ++j) {
    x[j] = w[j];
    for (int c = 0; c < j; ++c) x[j] -= a[static_cast<size_t>(c) * m + j] * x[c];
    x[j] *= a[static_cast<size_t>(j) * m + j];
    w[j] = x[j];
  }
  for (int i = W; i < rows; ++i) {
    double sum = 0.0;
    for (int j = 0; j < W; ++j) sum += a[static_cast<size_t>(j) * m + i] * x[j];
    w[i] -= sum;
  }
}

double total(const double* s) { return ((s[0] + s[4]) + (s[1] + s[5])) + ((s[2] + s[6]) + (s[3] + s[7])); }

// w <- L^-T w in the columns a, W of them; eight partial sums for vector registers
template <int W>
void backward(const double* __restrict a, int m, int rows, double* __restrict w)
{
  const int LANES = 8, whole = W + (rows - W) / LANES * LANES;
  double sum[W][LANES] = {};
  for (int i = W; i < whole; i += LANES)
    for (int j = 0; j < W; ++j)
      for (int l = 0; l < LANES; ++l) sum[j][l] += a[static_cast<size_t>(j) * m + i + l] * w[i + l];
  for (int i = whole; i < rows; ++i)
    for (int j = 0; j < W; ++j) sum[j][i - whole] += a[static_cast<size_t>(j) * m + i] * w[i];
  for (int j = W - 1; j >= 0; --j) {
    double x = w[j] - total(sum[j]);
    for (int c = j + 1; c < W; ++c) x -= a[static_cast<size_t>(j) * m + c] * w[c];
    w[j] = x * a[static_cast<size_t>(j) * m + j];
  }
}

void forward(const double* P, int m, int k, double* w)
{
  int j = 0;
  for (; j + 4 <= k; j += 4) forward<4>(P + static_cast<size_t>(j) * m + j, m, m - j, w + j);
  for (; j < k; ++j) forward<1>(P + static_cast<size_t>(j) * m + j, m, m - j, w + j);
}

void backward(const double* P, int m, int k, double* w)
{
  int j = k;
  for (; j % 4; --j) backward<1>(P + static_cast<size_t>(j - 1) * m + j - 1, m, m - j + 1, w + j - 1);
  for (; j > 0; j -= 4) backward<4>(P + static_cast<size_t>(j - 4) * m + j - 4, m, m - j + 4, w + j - 4);
}

}  // namespace

// ---------------------------------------------------------------------------
// fronts_analyse : fronts of the block rows in the order of elimination pos, and the room they need
// ---------------------------------------------------------------------------
void fronts_analyse(const SysMatrix& A, const IntVec& pos, Fronts& f)
{
  MPFE_CHECK(A.dim == D, "fronts are for plane problems");
  std::vector<IntVec> below;
  IntVec parent;
  column_rows(sys_graph(A), pos, below, parent);
  const IntVec into  = join_columns(below, parent);
  const IntVec order = postorder(into, parent);
  const int fronts = static_cast<int>(order.size());
  // 1. places: the columns of a front one after the other
  f = Fronts();
  std::vector<IntVec> column(A.nrow);
  for (int j = 0; j < A.nrow; ++j) column[into[j]].push_back(j);
  IntVec place(A.nrow), number(A.nrow, -1);
  f.first.assign(1, 0);
  for (int s = 0; s < fronts; ++s) {
    number[order[s]] = s;
    int next = f.first[s];
    for (int j : column[order[s]]) place[j] = next++;
    f.first.push_back(next);
  }
  f.place.resize(A.nrow);
  for (int I = 0; I < A.nrow; ++I) f.place[I] = place[pos[I]];
  // 2. rows below, parents, room
  f.parent.assign(fronts, -1);
  f.start.assign(1, 0);
  size_t held = 0;                     // by what fronts have left so far
  std::vector<size_t> left(fronts, 0); // by the children of a front
  for (int s = 0; s < fronts; ++s) {
    for (int i : below[order[s]]) f.below.item.push_back(place[i]);
    std::sort(f.below.item.begin() + f.below.off.back(), f.below.item.end());
    f.below.off.push_back(static_cast<int>(f.below.item.size()));
    if (parent[order[s]] >= 0) f.parent[s] = number[into[parent[order[s]]]];
    const size_t k = static_cast<size_t>(f.first[s + 1] - f.first[s]) * D, rest = static_cast<size_t>(f.below.count(s)) * D;
    f.start.push_back(f.start[s] + (k + rest) * k);
    f.stack = std::max(f.stack, held + rest * rest);
    f.most  = std::max(f.most, k + rest);
    held += rest * rest - left[s];
    if (f.parent[s] >= 0) left[f.parent[s]] += rest * rest;
    f.flops += static_cast<double>(k) * static_cast<double>(k * k / 3 + k * rest + rest * rest);
  }
  place_blocks(A, f);
}

// ---------------------------------------------------------------------------
// fronts_factor : L L^T of the values of A, one front after the other                     (8.10)
//
// A front holds the columns that leave together and the rows they touch; what they leave there waits on a stack for the parent.
// false: a pivot is not clearly positive
// ---------------------------------------------------------------------------
bool fronts_factor(const SysMatrix& A, Fronts& f)
{
  RealVec diagonal, least(A.neq()), stack(f.stack);
  sys_diagonal(A, diagonal);
  for (int I = 0; I < A.nrow; ++I)
    for (int i = 0; i < D; ++i) least[f.place[I] * D + i] = ZERO_PIVOT * diagonal[I * D + i];
  f.L.assign(f.start.back(), 0.0);
  IntVec local(A.nrow), waiting;       // children on the stack
  size_t top = 0;
  for (int s = 0; s < f.count(); ++s) {
    const int first = f.first[s], width = f.first[s + 1] - first, n = f.below.count(s), k = width * D, rest = n * D, m = k + rest;
    double *P = &f.L[f.start[s]], *U = stack.data() + top;
    std::fill_n(U, static_cast<size_t>(rest) * rest, 0.0);
    for (int j = 0; j < width; ++j) local[first + j] = j;
    for (int q = 0; q < n; ++q) local[f.below.begin(s)[q]] = width + q;
    add_matrix(A, f, s, P, m);
    double* bottom = U;
    for (; !waiting.empty() && f.parent[waiting.back()] == s; waiting.pop_back()) {
      const int c    = waiting.back();
      const size_t r = static_cast<size_t>(f.below.count(c)) * D;
      bottom -= r * r;
      add_child(f, c, bottom, local, k, P, m, U);
    }
    if (!factor_front(P, m, k, U, &least[first * D])) return false;
    std::copy(U, U + static_cast<size_t>(rest) * rest, bottom);
    top = static_cast<size_t>(bottom - stack.data()) + static_cast<size_t>(rest) * rest;
    waiting.push_back(s);
  }
  return true;
}

// ---------------------------------------------------------------------------
// fronts_back : x = A^-1 x for count right-hand sides, one after the other [count*neq]. A front serves all of them while it is near
// ---------------------------------------------------------------------------
void fronts_back(const Fronts& f, double* x, int count)
{
  const int nrow = static_cast<int>(f.place.size());
  const size_t n = static_cast<size_t>(nrow) * D;
  RealVec y(n * count), w(f.most);
  const auto turn = [&](bool back) {
    for (int q = 0; q < count; ++q)
      for (int I = 0; I < nrow; ++I)
        for (int i = 0; i < D; ++i) {
          double &ours = y[q * n + f.place[I] * D + i], &given = x[q * n + I * D + i];
          if (back) given = ours;
          else ours = given;
        }
  };
  turn(false);
  const auto visit = [&](int s, bool back) {
    const int k = (f.first[s + 1] - f.first[s]) * D, rows = f.below.count(s), m = k + rows * D;
    const int* below = f.below.begin(s);
    for (int q = 0; q < count; ++q) {
      double *own = &y[q * n + f.first[s] * D], *all = &y[q * n];
      std::copy(own, own + k, w.begin());
      if (back) {
        for (int r = 0; r < rows; ++r)
          for (int i = 0; i < D; ++i) w[k + r * D + i] = all[below[r] * D + i];
        backward(&f.L[f.start[s]], m, k, w.data());
      } else {
        std::fill(w.begin() + k, w.begin() + m, 0.0);
        forward(&f.L[f.start[s]], m, k, w.data());
        for (int r = 0; r < rows; ++r)
          for (int i = 0; i < D; ++i) all[below[r] * D + i] += w[k + r * D + i];
      }
      std::copy(w.begin(), w.begin() + k, own);
    }
  };
  for (int s = 0; s < f.count(); ++s) visit(s, false);
  for (int s = f.count(); s-- > 0;) visit(s, true);
  turn(true);
}
