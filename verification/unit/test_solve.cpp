// Solvers and orders: src/solve/
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>

#include "assem/assem.h"
#include "base/comm.h"
#include "base/part_points.h"
#include "solve/solve.h"
#include "samples.h"

namespace {

std::vector<SolverKind> solvers_built_in()
{
  std::vector<SolverKind> kind{SOLVER_SKYLINE};
#ifdef MPFE_MUMPS
  kind.push_back(SOLVER_MUMPS);
#endif
  return kind;
}

// Pattern of the pairs (row, lower column), values zero. Diagonals are added.
SysMatrix pattern(int dim, int nrow, std::vector<std::pair<int, int>> pair)
{
  for (auto& p : pair)
    if (p.first < p.second) std::swap(p.first, p.second);
  for (int I = 0; I < nrow; ++I) pair.push_back({I, I});
  std::sort(pair.begin(), pair.end());
  pair.erase(std::unique(pair.begin(), pair.end()), pair.end());
  SysMatrix A;
  A.dim  = dim;
  A.nrow = nrow;
  A.off.assign(nrow + 1, 0);
  for (const auto& p : pair) {
    ++A.off[p.first + 1];
    A.col.push_back(p.second);
  }
  std::partial_sum(A.off.begin(), A.off.end(), A.off.begin());
  A.val.assign(A.col.size() * dim * dim, 0.0);
  return A;
}

double& diagonal(SysMatrix& A, int I, int i)
{
  return A.val[(static_cast<size_t>(A.off[I + 1]) - 1) * A.dim * A.dim + i * A.dim + i];
}

// Random blocks; diagonals outweigh their rows. definite: all positive, else of random sign.
SysMatrix random_matrix(int dim, int nrow, bool definite, unsigned seed)
{
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> value(-1.0, 1.0);
  std::vector<std::pair<int, int>> pair;
  for (int k = 0; k < 3 * nrow; ++k)
    pair.push_back({static_cast<int>(random() % nrow), static_cast<int>(random() % nrow)});
  SysMatrix A = pattern(dim, nrow, pair);
  for (double& v : A.val) v = value(random);
  for (int I = 0; I < nrow; ++I)
    for (int i = 0; i < dim; ++i) {
      for (int j = i + 1; j < dim; ++j)
        A.val[(static_cast<size_t>(A.off[I + 1]) - 1) * dim * dim + i * dim + j] = 0.0;
      diagonal(A, I, i) = (definite || value(random) > 0.0 ? 1.0 : -1.0) * (30.0 + value(random));
    }
  return A;
}

// Grid of nx x ny rows, each tied to its right and upper neighbour by unit springs in all directions,
// numbered at random:
// free, singular with one zero mode per direction.
SysMatrix shuffled_grid(int dim, int nx, int ny)
{
  IntVec label(nx * ny);
  std::iota(label.begin(), label.end(), 0);
  std::shuffle(label.begin(), label.end(), std::mt19937(7));
  std::vector<std::pair<int, int>> pair;
  for (int y = 0; y < ny; ++y)
    for (int x = 0; x < nx; ++x) {
      if (x + 1 < nx) pair.push_back({label[y * nx + x], label[y * nx + x + 1]});
      if (y + 1 < ny) pair.push_back({label[y * nx + x], label[(y + 1) * nx + x]});
    }
  SysMatrix A = pattern(dim, nx * ny, pair);
  for (int I = 0; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1] - 1; ++k)
      for (int i = 0; i < dim; ++i) {
        A.val[static_cast<size_t>(k) * dim * dim + i * dim + i] = -1.0;
        diagonal(A, I, i) += 1.0;
        diagonal(A, A.col[k], i) += 1.0;
      }
  return A;
}

Eigen::MatrixXd dense(const SysMatrix& A)
{
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(A.neq(), A.neq());
  for (int I = 0; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1]; ++k)
      for (int i = 0; i < A.dim; ++i)
        for (int j = 0; j < A.dim; ++j) {
          if (A.col[k] == I && j > i) continue;
          const double v = A.val[static_cast<size_t>(k) * A.dim * A.dim + i * A.dim + j];
          M(I * A.dim + i, A.col[k] * A.dim + j) = M(A.col[k] * A.dim + j, I * A.dim + i) = v;
        }
  return M;
}

// largest difference of x to the solution of a dense factorisation, relative to its largest value
double error_to_dense(const SysMatrix& A, const RealVec& b, const RealVec& x)
{
  const Eigen::VectorXd right = Eigen::Map<const Eigen::VectorXd>(b.data(), A.neq());
  const Eigen::VectorXd exact = dense(A).ldlt().solve(right);
  return (Eigen::Map<const Eigen::VectorXd>(x.data(), A.neq()) - exact).lpNorm<Eigen::Infinity>() /
         exact.lpNorm<Eigen::Infinity>();
}

// sum of the column heights of the block profile in the order pos
long profile(const SysMatrix& A, const IntVec& pos)
{
  IntVec first(pos.size());
  std::iota(first.begin(), first.end(), 0);
  for (int I = 0; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1]; ++k) {
      const int low = std::min(pos[I], pos[A.col[k]]), high = std::max(pos[I], pos[A.col[k]]);
      first[high] = std::min(first[high], low);
    }
  long sum = 0;
  for (int J = 0; J < A.nrow; ++J) sum += J - first[J] + 1;
  return sum;
}

bool is_permutation_of_rows(IntVec pos, int nrow)
{
  std::sort(pos.begin(), pos.end());
  IntVec all(nrow);
  std::iota(all.begin(), all.end(), 0);
  return pos == all;
}

}  // namespace

TEST(Solve, MultiplyAgainstDense)
{
  for (int dim : {1, 2, 3}) {
    const SysMatrix A = random_matrix(dim, 25, false, 3);
    const RealVec x   = right_hand_side(A);
    RealVec y;
    sys_multiply(A, x, y);
    const Eigen::VectorXd exact = dense(A) * Eigen::Map<const Eigen::VectorXd>(x.data(), A.neq());
    for (int k = 0; k < A.neq(); ++k) EXPECT_NEAR(y[k], exact[k], 1e-13 * 30);
  }
}

TEST(Solve, SolversAgainstDense)
{
  for (SolverKind kind : solvers_built_in())
    for (int dim : {1, 2, 3})
      for (bool definite : {true, false})
        for (int nrow : {1, 2, 7, 60}) {
          SCOPED_TRACE(testing::Message()
                       << "kind " << kind << " dim " << dim << " definite " << definite << " nrow " << nrow);
          const SysMatrix A = random_matrix(dim, nrow, definite, 11u + nrow);
          const RealVec b   = right_hand_side(A);
          RealVec x;
          Solver s;
          ASSERT_TRUE(solve_open(s, {kind}));
          ASSERT_EQ(solve_factor(s, A), STATUS_OK) << s.message;
          ASSERT_EQ(solve_back(s, b, x), STATUS_OK) << s.message;
          EXPECT_LT(error_to_dense(A, b, x), 1e-12);
          EXPECT_EQ(s.negative, (dense(A).ldlt().vectorD().array() < 0.0).count());
          x = b;
          ASSERT_EQ(solve_back(s, x, x), STATUS_OK);     // one vector for both
          EXPECT_LT(error_to_dense(A, b, x), 1e-12);
          solve_close(s);
        }
}

// soft and stiff parts differ by 1e16 and are no singularity
TEST(Solve, SoftBesideStiff)
{
  for (SolverKind kind : solvers_built_in()) {
    SysMatrix A = pattern(2, 4, {{1, 0}, {3, 2}});
    for (int k = 0; k < static_cast<int>(A.col.size()); ++k)
      for (int i = 0; i < 2; ++i) A.val[k * 4 + i * 2 + i] = -1.0;
    for (int I = 0; I < 4; ++I)
      for (int i = 0; i < 2; ++i) diagonal(A, I, i) = 2.0;
    for (int k = A.off[2]; k < A.off[4]; ++k)
      for (int i = 0; i < 4; ++i) A.val[k * 4 + i] *= 1e-16;
    Solver s;
    ASSERT_TRUE(solve_open(s, {kind}));
    EXPECT_EQ(solve_factor(s, A), STATUS_OK) << s.message;
    solve_close(s);
  }
}

TEST(Solve, SingularIsTold)
{
  for (SolverKind kind : solvers_built_in())
    for (int dim : {2, 3}) {
      SCOPED_TRACE(testing::Message() << "kind " << kind << " dim " << dim);
      SysMatrix A = shuffled_grid(dim, 20, 15);      // free body
      Solver s;
      ASSERT_TRUE(solve_open(s, {kind}));
      EXPECT_EQ(solve_factor(s, A), SOLVER_SINGULAR);
      EXPECT_NE(s.message.find("equation"), std::string::npos) << s.message;

      // the same solver works again once the body is held
      for (int i = 0; i < dim; ++i) diagonal(A, 5, i) += 1.0;
      ASSERT_EQ(solve_factor(s, A), STATUS_OK) << s.message;
      const RealVec b = right_hand_side(A);
      RealVec x;
      ASSERT_EQ(solve_back(s, b, x), STATUS_OK);
      EXPECT_LT(error_to_dense(A, b, x), 1e-9);
      EXPECT_EQ(s.nanalyse, 1);
      solve_close(s);
    }
}

// where zero pivots are no error each free motion costs one unknown, and what the body can carry is carried
TEST(Solve, NullPivotsAreFixed)
{
  for (SolverKind kind : solvers_built_in())
    for (int dim : {2, 3}) {
      SCOPED_TRACE(testing::Message() << "kind " << kind << " dim " << dim);
      const SysMatrix A = shuffled_grid(dim, 20, 15);      // free body
      Solver s;
      ASSERT_TRUE(solve_open(s, {kind}));
      s.null_pivot_row = 0;
      ASSERT_EQ(solve_factor(s, A), STATUS_OK) << s.message;
      EXPECT_GT(s.fixed_null_pivots, 0);
      EXPECT_GE(s.zero_equation, 0);
      const RealVec u = right_hand_side(A);
      RealVec b(A.neq()), x, back(A.neq());
      sys_multiply(A, u, b);                               // in balance
      ASSERT_EQ(solve_back(s, b, x), STATUS_OK);
      sys_multiply(A, x, back);
      double most = 0.0, error = 0.0;
      for (int i = 0; i < A.neq(); ++i) {
        most  = std::max(most, std::fabs(b[i]));
        error = std::max(error, std::fabs(back[i] - b[i]));
      }
      EXPECT_LT(error, 1e-9 * most);
      solve_close(s);
    }
}

// the message names the equation that nothing holds
TEST(Solve, SingularNamesTheEquation)
{
  for (SolverKind kind : solvers_built_in()) {
    SysMatrix A = random_matrix(2, 12, true, 5);
    for (int I = 0; I < A.nrow; ++I)
      for (int k = A.off[I]; k < A.off[I + 1]; ++k)
        for (int i = 0; i < 2; ++i)
          for (int j = 0; j < 2; ++j)
            if (I * 2 + i == 9 || A.col[k] * 2 + j == 9) A.val[k * 4 + i * 2 + j] = 0.0;
    Solver s;
    ASSERT_TRUE(solve_open(s, {kind}));
    EXPECT_EQ(solve_factor(s, A), SOLVER_SINGULAR);
    EXPECT_NE(s.message.find("equation 10 (block row 5, component 2)"), std::string::npos) << s.message;
    solve_close(s);
  }
}

TEST(Solve, NotANumberIsTold)
{
  for (SolverKind kind : solvers_built_in()) {
    SysMatrix A      = random_matrix(2, 12, true, 5);
    A.val[A.col.size()] = std::nan("");
    Solver s;
    ASSERT_TRUE(solve_open(s, {kind}));
    EXPECT_EQ(solve_factor(s, A), BAD_NUMBER);
    solve_close(s);
  }
}

TEST(Solve, AnalysisIsReusedWhileThePatternStays)
{
  for (SolverKind kind : solvers_built_in()) {
    SysMatrix A = random_matrix(2, 40, true, 1);
    Solver s;
    ASSERT_TRUE(solve_open(s, {kind}));
    ASSERT_EQ(solve_analyse(s, A), STATUS_OK);
    for (int again = 0; again < 3; ++again) {
      for (double& v : A.val) v *= 1.5;
      ASSERT_EQ(solve_factor(s, A), STATUS_OK);
      const RealVec b = right_hand_side(A);
      RealVec x;
      ASSERT_EQ(solve_back(s, b, x), STATUS_OK);
      EXPECT_LT(error_to_dense(A, b, x), 1e-12);
    }
    EXPECT_EQ(s.nanalyse, 1);
    EXPECT_EQ(s.nfactor, 3);
    A = random_matrix(2, 40, true, 2);               // another pattern
    ASSERT_EQ(solve_factor(s, A), STATUS_OK);
    EXPECT_EQ(s.nanalyse, 2);
    const RealVec b = right_hand_side(A);
    RealVec x;
    ASSERT_EQ(solve_back(s, b, x), STATUS_OK);
    EXPECT_LT(error_to_dense(A, b, x), 1e-12);
    solve_close(s);
  }
}

TEST(Solve, EmptyMatrix)
{
  for (SolverKind kind : solvers_built_in()) {
    SysMatrix A;
    A.dim = 2;
    RealVec x;
    Solver s;
    ASSERT_TRUE(solve_open(s, {kind}));
    EXPECT_EQ(solve_factor(s, A), STATUS_OK);
    EXPECT_EQ(solve_back(s, RealVec(), x), STATUS_OK);
    solve_close(s);
  }
}

TEST(Solve, AutoAndKindsNotBuiltIn)
{
  Solver s;
  ASSERT_TRUE(solve_open(s, {SOLVER_AUTO}));
#ifdef MPFE_MUMPS
  EXPECT_EQ(s.kind, SOLVER_MUMPS);
  EXPECT_STREQ(solve_name(s), "MUMPS");
  solve_close(s);
#else
  EXPECT_EQ(s.kind, SOLVER_SKYLINE);
  EXPECT_STREQ(solve_name(s), "SKYLINE");
  solve_close(s);
  EXPECT_FALSE(solve_open(s, {SOLVER_MUMPS}));
#endif
}

#ifdef MPFE_MUMPS
// plane problems of 2000 equations and more are factorised by CHOLMOD, and by MUMPS when they are not
// positive
TEST(Solve, Cholmod)
{
  SysMatrix A = shuffled_grid(2, 45, 30);            // 2700 equations; free
  Solver s, mumps;
  ASSERT_TRUE(solve_open(s, {SOLVER_AUTO}));
  EXPECT_EQ(solve_factor(s, A), SOLVER_SINGULAR);
  EXPECT_EQ(s.ncholmod, 0);
  for (int i = 0; i < 2; ++i) diagonal(A, 7, i) += 1.0;
  ASSERT_TRUE(solve_open(mumps, {SOLVER_MUMPS}));
  ASSERT_EQ(solve_factor(mumps, A), STATUS_OK);
  EXPECT_EQ(mumps.ncholmod, 0);
  // another pattern: a new analysis, after which CHOLMOD is tried again
  SysMatrix other = shuffled_grid(2, 30, 45);
  ASSERT_EQ(solve_analyse(s, other), STATUS_OK);
  ASSERT_EQ(solve_factor(s, A), STATUS_OK);
  EXPECT_EQ(s.ncholmod, 1);
  const size_t n = A.neq();
  RealVec b = right_hand_side(A), x, y, many;
  ASSERT_EQ(solve_back(s, b, x), STATUS_OK);
  ASSERT_EQ(solve_back(mumps, b, y), STATUS_OK);
  const double most = std::fabs(
      *std::max_element(y.begin(), y.end(), [](double p, double q) { return std::fabs(p) < std::fabs(q); }));
  for (size_t k = 0; k < n; ++k) EXPECT_NEAR(x[k], y[k], 1e-10 * most);
  for (int q = 1; q <= 20; ++q)                      // several right-hand sides at a time
    for (size_t k = 0; k < n; ++k) many.push_back(q * b[k]);
  ASSERT_EQ(solve_back_many(s, many.data(), 20), STATUS_OK);
  for (size_t k = 0; k < many.size(); ++k)
    EXPECT_NEAR(many[k], static_cast<double>(k / n + 1) * x[k % n], 1e-10 * most);
  // in single precision: symmetric all the same
  RealVec c = b, rough, turned;
  for (size_t k = 0; k < n; k += 3) c[k] = -c[k];
  ASSERT_EQ(solve_back_rough(s, b, rough), STATUS_OK);
  ASSERT_EQ(solve_back_rough(s, c, turned), STATUS_OK);
  double far = 0.0;
  for (size_t k = 0; k < n; ++k) far = std::max(far, std::fabs(rough[k] - x[k]));
  EXPECT_GT(far, 1e-9 * most);
  EXPECT_LT(far, 1e-3 * most);
  EXPECT_NEAR(dot(b, turned), dot(c, rough), 1e-10 * std::fabs(dot(b, rough)));
  diagonal(A, 3, 1) = -5.0;                          // indefinite: MUMPS
  ASSERT_EQ(solve_factor(s, A), STATUS_OK);
  EXPECT_EQ(s.ncholmod, 1);
  EXPECT_GT(s.negative, 0);
  solve_close(s);
  solve_close(mumps);
}

// small matrices go to the skyline, and from there to MUMPS when they are indefinite: here a pivot is zero
TEST(Solve, SmallAndIndefinite)
{
  SysMatrix A = random_matrix(2, 40, true, 4);
  Solver s;
  ASSERT_TRUE(solve_open(s, {SOLVER_AUTO}));
  const RealVec b = right_hand_side(A);
  RealVec x;
  for (const bool zero : {false, true, true}) {
    if (zero)
      for (int I = 0; I < A.nrow; ++I) diagonal(A, I, 0) = 0.0;
    ASSERT_EQ(solve_factor(s, A), STATUS_OK) << s.message;
    ASSERT_EQ(solve_back(s, b, x), STATUS_OK) << s.message;
    EXPECT_LT((Eigen::Map<Eigen::VectorXd>(x.data(), A.neq()) -
               dense(A).fullPivLu().solve(Eigen::Map<const Eigen::VectorXd>(b.data(), A.neq())))
                  .lpNorm<Eigen::Infinity>(),
              1e-8);
    EXPECT_EQ(s.nanalyse, zero ? 2 : 1);
  }
  EXPECT_GT(s.negative, 0);
  solve_close(s);
}
#endif

TEST(Order, RcmReducesTheProfile)
{
  const SysMatrix A = shuffled_grid(2, 40, 10);
  IntVec same(A.nrow);
  std::iota(same.begin(), same.end(), 0);
  const IntVec pos = order_rcm(A);
  EXPECT_TRUE(is_permutation_of_rows(pos, A.nrow));
  EXPECT_LT(profile(A, pos), 400 * 11);               // by lines of 10, a height is 11 at most
  EXPECT_GT(profile(A, same), 10 * profile(A, pos));
}

TEST(Order, RcmOfSeparateParts)
{
  const SysMatrix A = pattern(3, 7, {{2, 0}, {5, 2}, {6, 1}});    // chains 0 2 5 and 1 6, rows 3 and 4 alone
  const IntVec pos  = order_rcm(A);
  EXPECT_TRUE(is_permutation_of_rows(pos, A.nrow));
  EXPECT_EQ(profile(A, pos), 7 + 3);
}

#ifdef MPFE_METIS
TEST(Order, MetisIsAPermutationAndRepeats)
{
  for (const SysMatrix& A :
       {shuffled_grid(2, 40, 30), shuffled_grid(3, 2, 1), pattern(2, 5, {}), pattern(3, 1, {})}) {
    const IntVec pos = order_metis(A);
    EXPECT_TRUE(is_permutation_of_rows(pos, A.nrow));
    EXPECT_EQ(pos, order_metis(A));
  }
}
#endif

// ---- several ranks ------------------------------------------------------------

// Elements fill a square, points its lower left corner: straight cuts leave the points on one side, a diagonal
// divides both, with few things at the cut
TEST(Ranks, ObliqueCutsDivideTwoKindsOfWork)
{
  const int n = 24, few = 6;
  RealVec X;
  std::vector<RealVec> work(2);
  const auto add = [&](double x, double y, int kind) {
    X.insert(X.end(), {x, y, 0.0});
    for (int k = 0; k < 2; ++k) work[k].push_back(k == kind ? 1.0 : 0.0);
  };
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) add(x + 0.5, y + 0.5, 0);
  for (int y = 0; y < few; ++y)
    for (int x = 0; x < few; ++x) add(x + 0.5, y + 0.5, 1);
  for (int parts : {2, 4}) {
    const IntVec part = part_planes(X, work, parts);
    for (const RealVec& kind : work) {
      RealVec load(parts, 0.0);
      for (size_t i = 0; i < part.size(); ++i) load.at(part[i]) += kind[i];
      const double all = std::accumulate(load.begin(), load.end(), 0.0);
      if (parts == 2)
        for (double l : load) EXPECT_NEAR(l, all / parts, 0.1 * all);
      else EXPECT_LT(*std::max_element(load.begin(), load.end()), 0.45 * all);
    }
    EXPECT_EQ(part, part_planes(X, work, parts));
  }
  // one kind: halves
  const IntVec half = part_planes({0, 0, 0, 1, 0, 0, 2, 0, 0, 3, 0, 0}, {{1.0, 1.0, 1.0, 1.0}}, 2);
  EXPECT_EQ(half[0], half[1]);
  EXPECT_EQ(half[2], half[3]);
  EXPECT_NE(half[0], half[2]);
}

// a mesh of squares, of which those in a corner cost more: both parts have as much of both kinds of work
TEST(Ranks, MeshIsDividedByTwoKindsOfWork)
{
  const int n = 24, few = 8;
  Mesh mesh;
  for (int y = 0; y <= n; ++y)
    for (int x = 0; x <= n; ++x) {
      mesh.node_label.push_back(mesh.nnode() + 1);
      mesh.X.insert(mesh.X.end(), {double(x), double(y), 0.0});
    }
  std::vector<RealVec> work(2);
  for (int y = 0; y < n; ++y)
    for (int x = 0; x < n; ++x) {
      const int first = y * (n + 1) + x;
      mesh.elem_label.push_back(mesh.nelem() + 1);
      mesh.conn.item.insert(mesh.conn.item.end(), {first, first + 1, first + n + 2, first + n + 1});
      mesh.conn.off.push_back(static_cast<int>(mesh.conn.item.size()));
      work[0].push_back(1.0);
      work[1].push_back(x < few && y < few ? 13.0 : 0.0);
    }
  const IntVec part = part_mesh(mesh, 2, work, 2);
  for (const RealVec& kind : work) {
    double load[2] = {0.0, 0.0};
    for (size_t e = 0; e < kind.size(); ++e) load[part.at(e)] += kind[e];
    EXPECT_NEAR(load[0], load[1], 0.15 * (load[0] + load[1]));
  }
  EXPECT_EQ(part, part_mesh(mesh, 2, work, 2));
  const IntVec one = part_mesh(mesh, 2, {work[0]}, 2);           // one kind: halves
  EXPECT_EQ(std::count(one.begin(), one.end(), 0), n * n / 2);
}

// METIS adds weights up as integers of 32 bits
TEST(Ranks, WeightsOfManyThingsCanBeSummed)
{
  EXPECT_EQ(part_weights({1.0, 0.5, 0.0, 2.0}), IntVec({501, 251, 1, 1001}));
  EXPECT_EQ(part_weights({0.0, 0.0}), IntVec({1, 1}));
  RealVec many(3000000, 1.0);
  many[0] = 2.0;
  double sum = 0.0;
  for (int w : part_weights(many)) sum += w;
  EXPECT_LT(sum, 1.1e9);
  EXPECT_GT(sum, 0.9e9);
}

TEST(Ranks, PatternHoldsWhatListsCoupleAndAllDiagonals)
{
  ListTable lists;
  lists.off  = {0, 3, 5};
  lists.item = {3, 0, 1, 4, 3};
  SysMatrix A;
  sys_pattern(lists, 6, 2, A);
  EXPECT_EQ(A.off, (IntVec{0, 1, 3, 4, 7, 9, 10}));
  EXPECT_EQ(A.col, (IntVec{0, 0, 1, 2, 0, 1, 3, 3, 4, 5}));
  EXPECT_EQ(A.val, RealVec(40, 0.0));
}

TEST(Ranks, OneRankCollectsItself)
{
  const SysMatrix A = random_matrix(3, 20, true, 5), B = sys_collect(A, true);
  EXPECT_EQ(A.off, B.off);
  EXPECT_EQ(A.col, B.col);
  EXPECT_EQ(A.val, B.val);
}

// pairs of nodes that all corners see as one: M is singular, to rounding indefinite, and M x = f all the same
TEST(Mass, SingularPair)
{
  const int n = 300, dim = 2;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> number(0.5, 2.0);
  Dofs s;
  ListTable lists;
  for (int r = 0; r < n; ++r) lists.item.push_back(r);
  lists.off.push_back(n);
  sys_pattern(lists, n, dim, s.pattern.A);
  s.rows.dim  = dim;
  s.rows.nrow = n;
  s.mass.M.assign(s.pattern.A.col.size(), 0.0);
  for (int k = 0; k < n; ++k)
    {                      // corners: each sees four nodes in a row, and their twins
    const double mass = std::pow(10.0, -(k % 9));
    RealVec N(n, 0.0);
    for (int a = 0; a < 4; ++a) N[(k + a) % (n / 2)] = N[(k + a) % (n / 2) + n / 2] = number(random);
    for (int r = 0; r < n; ++r)
      for (int c = 0; c <= r; ++c) s.mass.M[s.pattern.A.off[r] + c] += mass * N[r] * N[c];
  }
  for (int r = n / 2; r < n; ++r) s.mass.M[s.pattern.A.off[r] + r - n / 2] *= 1.0 + 1e-15;
  mass_diagonals(s);
  s.bound.fixed.assign(s.rows.neq(), 0);
  RealVec x(s.rows.neq(), 0.0), z(s.rows.neq()), f, y;
  for (double& v : z) v = number(random);
  mass_multiply(s, z, f);
  EXPECT_GT(mass_solve(s, ROWS_ALL, 0, f, x), 0);
  mass_multiply(s, x, y);
  for (int k = 0; k < s.rows.neq(); ++k) EXPECT_NEAR(f[k], y[k], 1e-7 * std::abs(f[k]));
}

// corners of debris that lie nearly in a plane: motions of the grid have 1e-7 to 1e-13 of the mass that others have,
// and conjugate gradients do not end
TEST(Mass, MotionsThatCornersHardlySee)
{
  const int side = 5, nodes = side + 1, n = 2 * nodes * nodes, dim = 3;
  std::mt19937 random(7);
  std::uniform_real_distribution<double> part(0.0, 1.0);
  Dofs s;
  ListTable lists;
  for (int r = 0; r < n; ++r) lists.item.push_back(r);
  lists.off.push_back(n);
  sys_pattern(lists, n, dim, s.pattern.A);
  s.rows.dim  = dim;
  s.rows.nrow = n;
  s.mass.M.assign(s.pattern.A.col.size(), 0.0);
  RealVec f(n * dim, 0.0);
  for (int k = 0; k < 45; ++k) {                     // corners in the cells of a layer
    const double x = side * part(random), y = side * part(random), mass = std::pow(10.0, -3.0 * part(random)),
                 off = std::pow(10.0, -3.0 - k % 4) * part(random);
    const int i = static_cast<int>(x), j = static_cast<int>(y);
    const double in[3] = {x - i, y - j, 0.5 + off};
    RealVec N(n, 0.0);
    for (int a = 0; a < 8; ++a) {
      const int to[3] = {a % 2, a / 2 % 2, a / 4};
      double& w = N[((j + to[1]) * nodes + i + to[0]) * 2 + to[2]];
      w = 1.0;
      for (int d = 0; d < 3; ++d) w *= to[d] ? in[d] : 1.0 - in[d];
    }
    double v[3];
    for (double& component : v) component = part(random) - 0.5;
    for (int r = 0; r < n; ++r) {
      for (int c = 0; c <= r; ++c) s.mass.M[s.pattern.A.off[r] + c] += mass * N[r] * N[c];
      for (int d = 0; d < dim; ++d) f[r * dim + d] += mass * N[r] * v[d];
    }
  }
  mass_diagonals(s);
  s.bound.fixed.assign(s.rows.neq(), 0);
  s.bound.fixed[7] = 1;
  RealVec x(s.rows.neq(), 0.0), y;
  x[7] = 2.0;
  ASSERT_GT(mass_solve(s, ROWS_ALL, 0, f, x), 0);
  EXPECT_EQ(2.0, x[7]);
  mass_multiply(s, x, y);
  double left = 0.0, size = 0.0;                     // as (3.14) weighs them
  for (int k = 0; k < s.rows.neq(); ++k) {
    if (!(s.mass.M_diag[k / dim] > 0.0)) continue;
    size += f[k] * f[k] / s.mass.M_diag[k / dim];
    if (k != 7) left += (f[k] - y[k]) * (f[k] - y[k]) / s.mass.M_diag[k / dim];
  }
  EXPECT_LT(left, 1e-16 * size);
}

// M x = f on the free dofs of the last rows, with supports and a row without mass
TEST(Mass, SolvesForFreeDofsAndKeepsTheRest)
{
  for (int dim : {2, 3}) {
    const int side = 12, n = side * side, first = 30, bare = n - 7;
    Dofs s;
    ListTable lists;                                 // bilinear squares
    for (int j = 0; j + 1 < side; ++j)
      for (int i = 0; i + 1 < side; ++i) {
        const int a = j * side + i;
        for (int r : {a, a + 1, a + side, a + side + 1}) lists.item.push_back(r);
        lists.off.push_back(static_cast<int>(lists.item.size()));
      }
    sys_pattern(lists, n, dim, s.pattern.A);
    s.rows.dim  = dim;
    s.rows.nrow = n;
    s.rows.nfe  = first;
    s.mass.M.assign(s.pattern.A.col.size(), 0.0);
    const double part[3] = {4.0 / 36, 2.0 / 36, 1.0 / 36};
    std::mt19937 random(dim);
    std::uniform_real_distribution<double> number(0.5, 2.0);
    for (int l = 0; l < lists.size(); ++l) {
      const double mass = number(random);
      for (int a = 0; a < 4; ++a)
        for (int b = 0; b <= a; ++b) {
          const int r = lists.begin(l)[a], c = lists.begin(l)[b];
          if (r == bare || c == bare) continue;
          const int k = static_cast<int>(
              std::find(s.pattern.A.col.begin() + s.pattern.A.off[r], s.pattern.A.col.begin() +
                        s.pattern.A.off[r + 1], c) - s.pattern.A.col.begin());
          s.mass.M[k] += mass * part[a == b ? 0 : a + b == 3 ? 2 : 1];
        }
    }
    mass_diagonals(s);
    s.bound.fixed.assign(s.rows.neq(), 0);
    for (int k : {100, 101, 150, 233}) s.bound.fixed[k] = 1;
    RealVec x(s.rows.neq(), 0.0), f(s.rows.neq()), y;
    for (double& v : f) v = number(random);
    for (int k = 0; k < s.rows.neq(); ++k)
      if (s.bound.fixed[k]) x[k] = number(random);
    const RealVec before = x;
    const int iterations = mass_solve(s, ROWS_GRID, first, f, x);
    EXPECT_GT(iterations, 0);
    EXPECT_LT(iterations, 30);
    mass_multiply(s, x, y);
    for (int k = 0; k < s.rows.neq(); ++k) {
      if (k < first * dim || s.bound.fixed[k] || k / dim == bare) EXPECT_EQ(before[k], x[k]) << k;
      else EXPECT_NEAR(f[k], y[k], 1e-12) << k;
    }
  }
}
