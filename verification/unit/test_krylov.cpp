// Conjugate gradients, their preconditioners, and the way that solve_system takes: src/solve/
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "solve/level_product.h"
#include "solve/solve_data.h"
#include "samples.h"

namespace {

// nx x ny rows (x nz), each tied to its neighbours by springs of stiffness 1 along all axes, stiff in x;
// every row held by soft. Positive definite. key: x + 1000 y, so that a smaller grid knows its rows in a
// larger one.
struct Springs {
  SysMatrix A;
  std::vector<long> key;
};

Springs springs(int dim, int x0, int nx, int ny, double stiff, double soft)
{
  Springs s;
  SysMatrix& A = s.A;
  const int DD = dim * dim;
  A.dim  = dim;
  A.nrow = nx * ny;
  for (int y = 0; y < ny; ++y)
    for (int x = 0; x < nx; ++x) {
      const int I = y * nx + x;
      if (y > 0) A.col.push_back(I - nx);
      if (x > 0) A.col.push_back(I - 1);
      A.col.push_back(I);
      A.off.push_back(static_cast<int>(A.col.size()));
      s.key.push_back(x0 + x + 1000L * y);
    }
  A.val.assign(A.col.size() * DD, 0.0);
  auto diagonal = [&](int I, int i) -> double& {
    return A.val[static_cast<size_t>(A.off[I + 1] - 1) * DD + i * dim + i];
  };
  for (int I = 0; I < A.nrow; ++I) {
    for (int i = 0; i < dim; ++i) diagonal(I, i) += soft;
    for (int k = A.off[I]; k < A.off[I + 1] - 1; ++k)
      for (int i = 0; i < dim; ++i) {
        const double c = A.col[k] == I - 1 ? stiff : 1.0;
        A.val[static_cast<size_t>(k) * DD + i * dim + i] = -c;
        diagonal(I, i) += c;
        diagonal(A.col[k], i) += c;
      }
  }
  return s;
}

// length of b - A x against that of b
double residual(const SysMatrix& A, const RealVec& b, const RealVec& x)
{
  RealVec y;
  sys_multiply(A, x, y);
  double r = 0.0, f = 0.0;
  for (size_t i = 0; i < b.size(); ++i) {
    r += (b[i] - y[i]) * (b[i] - y[i]);
    f += b[i] * b[i];
  }
  return std::sqrt(r / f);
}

SolveTask ask(const std::vector<long>& key, long stamp)
{
  SolveTask a{key};
  a.stamp = stamp;
  a.eta   = 1e-10;
  return a;
}

Solver open(SolverKind kind, Preconditioner precond, bool reuse = true)
{
  Solver s;
  EXPECT_TRUE(solve_open(s, {kind, precond, reuse}));
  return s;
}

}  // namespace

TEST(Krylov, ArrivesWithEachPreconditioner)
{
  for (int dim : {1, 2, 3})
    for (Preconditioner p : {PRECOND_DIAGONAL, PRECOND_CHOLESKY}) {
      const Springs k = springs(dim, 0, 13, 9, 1.0, 0.01);
      const RealVec b = right_hand_side(k.A);
      RealVec x;
      Solver s = open(SOLVER_CG, p);
      ASSERT_EQ(solve_system(s, k.A, ask(k.key, 1), b, x), STATUS_OK);
      EXPECT_LT(residual(k.A, b, x), 1e-9);
      EXPECT_EQ(s.nfactor, 0);
      EXPECT_EQ(s.path[p == PRECOND_DIAGONAL ? PATH_DIAGONAL : PATH_CHOLESKY].solves, 1);
      solve_close(s);
    }
}

// a right-hand side that earlier solutions make up needs no iteration, another one begins with what they have
// of it
TEST(Krylov, BeginsWithEarlierSolutions)
{
  const Springs k = springs(2, 0, 13, 9, 1.0, 0.01);
  const RealVec b = right_hand_side(k.A);
  RealVec c = b, x, y, z;
  for (size_t i = 0; i < c.size(); i += 3) c[i] = -c[i];
  Cholesky f;
  ASSERT_TRUE(cholesky_form(k.A, f));
  const auto M = [&](const RealVec& r, RealVec& out, double& rho) {
    out = r;
    cholesky_apply(k.A, f, out);
    rho = dot(r, out);
    return true;
  };
  const CgSystem system{k.A, nullptr, M};
  CgWork w;
  const CgGoal goal{1e-12, 0.0, 0.0, 1000};
  ASSERT_TRUE(cg_solve(system, b, goal, w, x).good);
  ASSERT_TRUE(cg_solve(system, c, goal, w, y).good);
  RealVec both = b;
  for (size_t i = 0; i < b.size(); ++i) both[i] = 2.0 * b[i] - c[i];
  CgGoal warm = goal;
  warm.eta    = 1e-8;
  warm.initial_energy  = cg_begin(system, both, {x, y, x}, z);            // a solution twice does no harm
  EXPECT_NEAR(dot(both, z), warm.initial_energy, 1e-9 * warm.initial_energy);
  const CgDone done = cg_solve(system, both, warm, w, z);
  EXPECT_TRUE(done.good);
  EXPECT_EQ(done.iterations, 0);
  EXPECT_LT(residual(k.A, both, z), 1e-9);
  EXPECT_EQ(cg_begin(system, b, {}, z), 0.0);
}

// a chain has no fill: the factor is complete, but for single precision
TEST(Krylov, CholeskyOfAChainIsExact)
{
  const Springs k = springs(3, 0, 50, 1, 1.0, 0.1);
  const RealVec b = right_hand_side(k.A);
  Cholesky c;
  ASSERT_TRUE(cholesky_form(k.A, c));
  EXPECT_EQ(c.shift, 0.0);
  RealVec x = b;
  cholesky_apply(k.A, c, x);
  EXPECT_LT(residual(k.A, b, x), 1e-5);
}

// springs a thousand times as stiff between the columns, as bonds are: diagonal blocks suffer, the factor
// does not
TEST(Krylov, CholeskyBearsStiffBonds)
{
  long iterations[2];
  for (Preconditioner p : {PRECOND_DIAGONAL, PRECOND_CHOLESKY}) {
    const Springs k = springs(2, 0, 2, 200, 1000.0, 0.01);
    const RealVec b = right_hand_side(k.A);
    RealVec x;
    Solver s = open(SOLVER_CG, p);
    ASSERT_EQ(solve_system(s, k.A, ask(k.key, 1), b, x), STATUS_OK);
    EXPECT_LT(residual(k.A, b, x), 1e-9);
    iterations[p == PRECOND_CHOLESKY] = s.path[PATH_DIAGONAL].iterations + s.path[PATH_CHOLESKY].iterations;
    solve_close(s);
  }
  EXPECT_LT(2 * iterations[1], iterations[0]);
}

// the incomplete factor stays while the matrix changes little; one that serves badly is made anew, in the same
// solution when it does not converge
TEST(Krylov, IncompleteFactorIsKept)
{
  Springs k = springs(2, 0, 40, 30, 1.0, 0.01);
  const RealVec b = right_hand_side(k.A);
  Solver s = open(SOLVER_CG, PRECOND_CHOLESKY);
  const Cholesky& c = s.data->cholesky;
  RealVec x;
  const auto solve = [&](long stamp, long pattern) {
    SolveTask a = ask(k.key, stamp);
    a.pattern  = pattern;
    ASSERT_EQ(solve_system(s, k.A, a, b, x), STATUS_OK);
    EXPECT_LT(residual(k.A, b, x), 1e-9);
  };
  solve(1, 5);
  k.A.val[k.A.val.size() - 1] *= 1.01;
  solve(2, 5);
  EXPECT_EQ(c.stamp, 1);
  solve(3, 6);                                       // another pattern
  EXPECT_EQ(c.stamp, 3);
  const RealVec before = k.A.val;
  for (size_t i = 0; i < before.size() / 2; ++i) k.A.val[i] *= 1e6;
  solve(4, 6);                                       // of no use: the solution is repeated
  EXPECT_EQ(c.stamp, 4);
  EXPECT_EQ(s.path[PATH_CHOLESKY].solves, 4);
  EXPECT_EQ(s.nfactor, 0);
  k.A.val = before;
  solve(5, 0);                                       // pattern not known
  EXPECT_EQ(c.stamp, 5);
  solve_close(s);
}

// rows leave and come: the preconditioner stays symmetric and positive definite
TEST(Krylov, FactorsServeWhenRowsChange)
{
  const Springs old = springs(2, 0, 10, 8, 1.0, 0.1), now = springs(2, 3, 10, 8, 1.2, 0.1);
  Solver s = open(SOLVER_CG, PRECOND_FACTORS);
  RealVec x;
  ASSERT_EQ(solve_system(s, old.A, ask(old.key, 1), right_hand_side(old.A), x), STATUS_OK);
  ReusedFactors& kept = s.data->reused;
  ASSERT_TRUE(reused_form(now.A, now.key, kept));
  EXPECT_EQ(std::count(kept.old.begin(), kept.old.end(), -1), 3 * 8);
  RealVec u = right_hand_side(now.A), v(u.size()), Mu(u.size()), Mv(u.size());
  for (size_t i = 0; i < v.size(); ++i) v[i] = std::cos(0.3 * static_cast<double>(i * i));
  ASSERT_EQ(reused_apply(s, now.A, kept, u, Mu), STATUS_OK);
  ASSERT_EQ(reused_apply(s, now.A, kept, v, Mv), STATUS_OK);
  EXPECT_NEAR(dot(u, Mv), dot(v, Mu), 1e-12 * std::sqrt(dot(u, u) * dot(v, v)) * 100.0);
  EXPECT_GT(dot(u, Mu), 0.0);
  EXPECT_GT(dot(v, Mv), 0.0);

  CgWork work;
  const auto M = [&](const RealVec& r, RealVec& z, double& rho) {
    const bool good = reused_apply(s, now.A, kept, r, z) == STATUS_OK;
    rho = dot(r, z);
    return good;
  };
  const CgDone done = cg_solve({now.A, nullptr, M}, u, {1e-10, 0.0, 0.0, 500, 1e9}, work, x);
  EXPECT_TRUE(done.good);
  EXPECT_LT(residual(now.A, u, x), 1e-9);
  solve_close(s);
}

// a negative direction ends conjugate gradients, and a factorisation takes over
TEST(Krylov, NegativeCurvatureIsFactorised)
{
  Springs k = springs(2, 0, 12, 12, 1.0, -0.3);
  const RealVec b = right_hand_side(k.A);
  RealVec x;
  for (Preconditioner p : {PRECOND_DIAGONAL, PRECOND_CHOLESKY}) {
    Solver s = open(SOLVER_CG, p);
    ASSERT_EQ(solve_system(s, k.A, ask(k.key, 1), b, x), STATUS_OK);
    EXPECT_LT(residual(k.A, b, x), 1e-10);
    EXPECT_EQ(s.path[PATH_FACTOR].solves, 1);
    EXPECT_EQ(s.left, 0.0);
    solve_close(s);
  }
}

// an exact solution in motion takes no factors; in statics, and where iterations are many, it does
TEST(Krylov, ExactInMotionWithoutFactors)
{
  for (double soft : {0.5, 1e-4}) {
    for (bool moves : {true, false}) {
      const Springs k = springs(3, 0, 30, 30, 1.0, soft);
      const RealVec b = right_hand_side(k.A);
      RealVec x;
      Solver s   = open(SOLVER_AUTO, PRECOND_AUTO);
      SolveTask a = ask(k.key, 1);
      a.eta     = 1e-3;
      a.exact   = true;
      a.inertia = moves;
      ASSERT_EQ(solve_system(s, k.A, a, b, x), STATUS_OK);
      EXPECT_LT(residual(k.A, b, x), 1e-10);
      EXPECT_EQ(s.nfactor, moves && soft == 0.5 ? 0 : 1) << soft;
      solve_close(s);
    }
  }
}

// a correction in motion without a factor, in single precision; with stiff springs, which take too many
// iterations, the incomplete factor follows. The rest is what the solution leaves
TEST(Krylov, SinglePrecisionWhereInertiaDominates)
{
  for (int dim : {2, 3})
    for (double stiff : {1.0, 1e3}) {
      Springs k = springs(dim, 0, 50, 40, stiff, 8.0);
      for (int I = 0; I < k.A.nrow; ++I)             // couplings between directions
        for (int n = k.A.off[I]; n < k.A.off[I + 1]; ++n)
          k.A.val[static_cast<size_t>(n) * dim * dim + dim] = 0.3;
      const RealVec b = right_hand_side(k.A);
      RealVec x, y, rest(b.size());
      Solver s = open(SOLVER_AUTO, PRECOND_AUTO);
      SolveTask a = ask(k.key, 1);
      a.digits  = 10.0;
      a.inertia = a.repeats = true;
      ASSERT_EQ(solve_system(s, k.A, a, b, x), STATUS_OK);
      EXPECT_EQ(s.path[PATH_SCALED].solves, stiff == 1.0) << dim;
      EXPECT_EQ(s.path[PATH_CHOLESKY].solves, stiff != 1.0) << dim;
      EXPECT_LT(residual(k.A, b, x), stiff == 1.0 ? 2e-6 : 1e-9);
      ASSERT_TRUE(solve_rest(s, rest));
      sys_multiply(k.A, x, y);
      double off = 0.0, largest = 0.0;
      for (size_t i = 0; i < b.size(); ++i) {
        off     = std::max(off, std::fabs(b[i] - y[i] - rest[i]));
        largest = std::max(largest, std::fabs(b[i]));
      }
      EXPECT_LT(off, 2e-6 * largest);
      EXPECT_EQ(solve_multiply(s, k.A, 1, x, rest), true);
      for (size_t i = 0; i < b.size(); ++i) EXPECT_NEAR(rest[i], y[i], 1e-5 * largest);
      EXPECT_EQ(solve_multiply(s, k.A, 2, x, rest), false);
      EXPECT_EQ(s.nfactor, 0);
      solve_close(s);
    }
}

// In motion: matrix 4 is indefinite and is factorised; the incomplete factor serves before and
// behind, and gives their factors back. Before, it rested for 50 solutions and more
TEST(Krylov, IndefiniteInMotionIsFactorisedOnce)
{
  const Springs good = springs(3, 0, 30, 30, 1.0, 0.5), bad = springs(3, 0, 30, 30, 1.0, -0.3);
  const RealVec b = right_hand_side(good.A);
  RealVec x;
  Solver s = open(SOLVER_AUTO, PRECOND_AUTO);
  for (int n = 1; n <= 12; ++n) {
    const bool indefinite = n == 4;
    const Springs& k = indefinite ? bad : good;
    SolveTask a = ask(k.key, n);
    a.eta     = 1e-8;
    a.inertia = true;
    ASSERT_EQ(solve_system(s, k.A, a, b, x), STATUS_OK);
    EXPECT_LT(residual(k.A, b, x), 1e-6) << n;
    EXPECT_EQ(s.data->factored, indefinite) << n;
  }
  EXPECT_EQ(s.nfactor, 1);
  EXPECT_EQ(s.path[PATH_FACTOR].solves, 1);
  EXPECT_EQ(s.path[PATH_CHOLESKY].solves, 11);
  EXPECT_EQ(s.data->cholesky.shift, 0.0);
  solve_close(s);
}

// the same number: the same matrix, no second factorisation; REUSE=NO factorises all the same
TEST(Krylov, SameMatrixKeepsItsFactors)
{
  const Springs k = springs(2, 0, 12, 12, 1.0, 0.1);
  const RealVec b = right_hand_side(k.A);
  for (bool reuse : {true, false}) {
    Solver s = open(SOLVER_AUTO, PRECOND_AUTO, reuse);
    RealVec x;
    for (int again = 0; again < 3; ++again) {
      ASSERT_EQ(solve_system(s, k.A, ask(k.key, 7), b, x), STATUS_OK);
      EXPECT_LT(residual(k.A, b, x), 1e-12);
    }
    EXPECT_EQ(s.nfactor, reuse ? 1 : 3);
    solve_close(s);
  }
}

// whatever the clock says, all ways lead to the solution
TEST(Krylov, ChosenPathsAgree)
{
  Springs k = springs(2, 0, 60, 40, 1.0, 0.05);
  const RealVec b = right_hand_side(k.A);
  Solver s = open(SOLVER_AUTO, PRECOND_AUTO);
  RealVec x;
  for (int n = 0; n < 20; ++n) {
    for (double& v : k.A.val) v *= 1.01;
    ASSERT_EQ(solve_system(s, k.A, ask(k.key, n), b, x), STATUS_OK);
    EXPECT_LT(residual(k.A, b, x), 1e-9) << n;
  }
  long cg = 0;
  for (SolvePath p : {PATH_REUSED, PATH_CHOLESKY}) cg += s.path[p].solves;
  EXPECT_GT(cg, 0);
  solve_close(s);
}

// without a row, and without what the springs to it gave to its neighbours
static Springs without(const Springs& k, int row)
{
  Springs n;
  const SysMatrix& A = k.A;
  const int DD = A.dim * A.dim;
  IntVec now(A.nrow, -1);
  n.A.dim = A.dim;
  for (int I = 0; I < A.nrow; ++I) {
    if (I == row) continue;
    now[I] = n.A.nrow++;
    n.key.push_back(k.key[I]);
    for (int q = A.off[I]; q < A.off[I + 1]; ++q) {
      if (A.col[q] == row) continue;
      n.A.col.push_back(now[A.col[q]]);
      n.A.val.insert(n.A.val.end(), A.val.begin() + static_cast<long>(q) * DD, A.val.begin() + (q + 1L) * DD);
    }
    n.A.off.push_back(static_cast<int>(n.A.col.size()));
  }
  for (int I = 0; I < A.nrow; ++I)
    for (int q = A.off[I]; q < A.off[I + 1] - 1; ++q) {
      if (I != row && A.col[q] != row) continue;
      const int J = now[I == row ? A.col[q] : I];
      double* diagonal = &n.A.val[static_cast<size_t>(n.A.off[J + 1] - 1) * DD];
      const double* spring = &A.val[static_cast<size_t>(q) * DD];
      for (int i = 0; i < A.dim; ++i) diagonal[i * A.dim + i] += spring[i * A.dim + i];
    }
  return n;
}

// A row of elements leaves, and the rows of the grid (the last line) are other ones: the corrected factors
// are exact
TEST(Krylov, ChangedRowsAreExactToSinglePrecision)
{
  const int nx = 13, nfe = nx * 8, leaves = 4 * nx + 6, now = nfe - 1;
  const Springs k = springs(2, 0, nx, 9, 1.0, 0.01);
  Springs n = without(k, leaves);
  for (int I = now; I < n.A.nrow; ++I) n.key[I] += 1000000;
  Solver s = open(SOLVER_AUTO, PRECOND_AUTO);
  ASSERT_EQ(solve_factor(s, k.A), STATUS_OK);
  Changed c;
  changed_begin(k.A, k.key, nfe, c);
  ASSERT_TRUE(c.on);
  ASSERT_TRUE(changed_form(s, n.A, n.key, now, 2, c));
  EXPECT_EQ(c.set.size(), 5u);                       // the row and its four neighbours
  const RealVec b = right_hand_side(n.A);
  RealVec x(b.size());
  ASSERT_EQ(changed_apply(s, n.A, c, b, x), STATUS_OK);
  EXPECT_LT(residual(n.A, b, x), 1e-6);              // the columns of the set are float
  // a row of elements that was not there has no factors
  n.key[3] = 77777;
  EXPECT_FALSE(changed_form(s, n.A, n.key, now, 3, c));
  EXPECT_FALSE(c.on);
  solve_close(s);
}

namespace {

// nx x ny bilinear elements of side 1, modulus 1 (in the left half: left), Poisson's
// ratio 0; held at x = 0 by springs
struct Plate {
  SysMatrix A;
  std::vector<long> key;
  RealVec place;
};

Plate plate(int nx, int ny, double left)
{
  Plate p;
  ListTable cells;
  const auto node = [&](int x, int y) { return y * (nx + 1) + x; };
  for (int y = 0; y < ny; ++y)
    for (int x = 0; x < nx; ++x) {
      for (int at : {node(x, y), node(x + 1, y), node(x + 1, y + 1), node(x, y + 1)})
        cells.item.push_back(at);
      cells.off.push_back(static_cast<int>(cells.item.size()));
    }
  sys_pattern(cells, (nx + 1) * (ny + 1), 2, p.A);
  const auto block = [&](int I, int J) {
    const int* first = &p.A.col[p.A.off[I]];
    const int* last  = first + p.A.off[I + 1] - p.A.off[I];
    return &p.A.val[4 * static_cast<size_t>(p.A.off[I] + std::lower_bound(first, last, J) - first)];
  };
  const double g = 0.5 / std::sqrt(3.0), sx[4] = {-1, 1, 1, -1}, sy[4] = {-1, -1, 1, 1};
  for (int c = 0; c < cells.size(); ++c) {
    const double E = c % nx < nx / 2 ? left : 1.0;
    for (int q = 0; q < 4; ++q) {
      double dN[4][2];
      for (int a = 0; a < 4; ++a) {
        dN[a][0] = sx[a] * (0.5 + sy[a] * sy[q] * g);
        dN[a][1] = sy[a] * (0.5 + sx[a] * sx[q] * g);
      }
      for (int a = 0; a < 4; ++a)
        for (int b = 0; b < 4; ++b) {
          const int I = cells.begin(c)[a], J = cells.begin(c)[b];
          if (J > I) continue;
          double* k = block(I, J);
          for (int i = 0; i < 2; ++i)
            for (int j = 0; j < (I == J ? i + 1 : 2); ++j) {
              double sum = 0.5 * dN[a][j] * dN[b][i];
              for (int m = 0; m < 2 && i == j; ++m) sum += 0.5 * dN[a][m] * dN[b][m];
              k[i * 2 + j] += 0.25 * E * sum;
            }
        }
    }
  }
  for (int y = 0; y <= ny; ++y)
    for (int x = 0; x <= nx; ++x) {
      p.key.push_back(node(x, y));
      p.place.insert(p.place.end(), {1.0 * x, 1.0 * y});
      for (int i = 0; i < 2 && x == 0; ++i) block(node(x, y), node(x, y))[3 * i] += 1e3;
    }
  return p;
}

}  // namespace

// a long plate, where smooth modes rule: multigrid takes a fraction of the iterations of its smoother, keeps
// its coarse matrices while they serve, and makes new ones when they do not
TEST(Krylov, MultigridSeesSmoothModes)
{
  Solver s;
  if (!solve_open(s, {SOLVER_AMG, PRECOND_AUTO, true})) GTEST_SKIP() << "built without PETSc";
  const Plate p   = plate(120, 8, 1.0);
  const RealVec b = right_hand_side(p.A);
  SolveTask a = ask(p.key, 1);
  a.positions = [&p] { return p.place; };
  RealVec x;
  ASSERT_EQ(solve_system(s, p.A, a, b, x), STATUS_OK);
  EXPECT_LT(residual(p.A, b, x), 1e-9);
  const long first = s.path[PATH_AMG].iterations;
  Solver c = open(SOLVER_CG, PRECOND_CHOLESKY);
  ASSERT_EQ(solve_system(c, p.A, a, b, x), STATUS_OK);
  EXPECT_LT(4 * first, c.path[PATH_CHOLESKY].iterations);

  const Plate nearly = plate(120, 8, 1.05), other = plate(120, 8, 30.0);
  a.stamp = 2;
  ASSERT_EQ(solve_system(s, nearly.A, a, b, x), STATUS_OK);
  EXPECT_LT(residual(nearly.A, b, x), 1e-9);
  EXPECT_LE(s.path[PATH_AMG].iterations, 2 * first + 3);
  for (int n = 3; n < 7; ++n) {
    a.stamp = n;
    ASSERT_EQ(solve_system(s, other.A, a, b, x), STATUS_OK);
    EXPECT_LT(residual(other.A, b, x), 1e-9);
  }
  const long before = s.path[PATH_AMG].iterations;
  a.stamp = 7;
  ASSERT_EQ(solve_system(s, other.A, a, b, x), STATUS_OK);
  EXPECT_LE(s.path[PATH_AMG].iterations - before, 2 * first);
  EXPECT_EQ(s.nfactor, 0);
  solve_close(c);
  solve_close(s);
}

// an indefinite matrix: conjugate gradients end, a factorisation takes over, and multigrid waits
TEST(Krylov, MultigridThatFailsWaits)
{
  Solver s;
  if (!solve_open(s, {SOLVER_AMG, PRECOND_AUTO, true})) GTEST_SKIP() << "built without PETSc";
  const Springs k = springs(2, 0, 12, 12, 1.0, -0.3);
  const RealVec b = right_hand_side(k.A);
  RealVec x;
  for (int n = 0; n < 3; ++n) {
    ASSERT_EQ(solve_system(s, k.A, ask(k.key, n), b, x), STATUS_OK);
    EXPECT_LT(residual(k.A, b, x), 1e-10);
  }
  EXPECT_EQ(s.path[PATH_AMG].solves, 0);
  EXPECT_EQ(s.path[PATH_AMG].failed, 1);
  EXPECT_EQ(s.path[PATH_FACTOR].solves, 3);
  solve_close(s);
}

// Products with the matrices of coarse levels: rows x cols blocks, one row of blocks empty, lines of all
// lengths of a rest behind whole vector registers. Single precision against the sum in double
TEST(Krylov, LevelProductIsThatOfSingleEquations)
{
  for (int rows : {1, 2, 3, 6})
    for (int cols : {1, 3, 6}) {
      const int nb = 9, mb = 7, n = nb * rows, m = mb * cols;
      IntVec off{0}, col;
      RealVec val;
      const auto there = [](int I, int J) { return I != 4 && (I * 5 + J * 3) % 4 < 2; };
      for (int i = 0; i < n; ++i) {
        for (int j = 0; j < m; ++j)
          if (there(i / rows, j / cols)) {
            col.push_back(j);
            val.push_back(std::sin(1.0 + 7.0 * i + 3.0 * j));
          }
        off.push_back(static_cast<int>(col.size()));
      }
      RealVec x(m), t(n), y(n, 9.0), more(n, 2.0), back(m, -1.0), right(n, 0.0), left(m, -1.0);
      for (int j = 0; j < m; ++j) x[j] = std::cos(0.3 * j);
      for (int i = 0; i < n; ++i) t[i] = std::cos(1.7 * i);
      for (int i = 0; i < n; ++i)
        for (int k = off[i]; k < off[i + 1]; ++k) {
          right[i] += val[k] * x[col[k]];
          left[col[k]] += val[k] * t[i];
        }
      LevelMatrix A;
      ASSERT_TRUE(level_fill(rows, cols, n, m, off.data(), col.data(), val.data(), A));
      level_multiply(A, x.data(), false, y.data());
      level_multiply(A, x.data(), true, more.data());
      level_transposed(A, t.data(), back.data());
      for (int i = 0; i < n; ++i) EXPECT_NEAR(y[i], right[i], 1e-5);
      for (int i = 0; i < n; ++i) EXPECT_NEAR(more[i], right[i] + 2.0, 1e-5);
      for (int j = 0; j < m; ++j) EXPECT_NEAR(back[j], left[j], 1e-5);
    }
}

// sizes that are no whole blocks, and single equations without blocks, stay with PETSc
TEST(Krylov, LevelProductNeedsBlocks)
{
  const IntVec off{0, 1, 2, 3, 4, 5, 6}, col{0, 1, 2, 3, 4, 5};
  const RealVec val(6, 1.0);
  LevelMatrix A;
  EXPECT_FALSE(level_fill(4, 6, 6, 6, off.data(), col.data(), val.data(), A));
  EXPECT_FALSE(level_fill(6, 4, 6, 6, off.data(), col.data(), val.data(), A));
  EXPECT_FALSE(level_fill(6, 6, 6, 6, off.data(), col.data(), val.data(), A));
  EXPECT_TRUE(level_fill(2, 2, 6, 6, off.data(), col.data(), val.data(), A));
}
