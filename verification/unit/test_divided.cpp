// A matrix that is divided among ranks: src/solve/, mass_solve. Needs several (unit/run_ranks); one skips nearly all
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <climits>
#include <cmath>
#include <map>
#include <random>

#include "assem/assem.h"
#include "assem/mass_rows.h"
#include "assem/mass_rows.h"
#include "base/halo_numbers.h"
#include "base/key_number.h"
#include "solve/solve_data.h"
#include "samples.h"

namespace {

// n[0] x n[1] (x n[2]) cells, each with springs between all pairs of its nodes and to a fixed point (soft); a
// matrix of all rows, and what this rank has of it
struct Lattice {
  SysMatrix A;                       // of this rank
  std::vector<long> key;             // [A.nrow] x + 100 y + 10000 z
  RealVec place;
  Eigen::MatrixXd all;               // rows in the order of the keys
  std::map<long, int> row_of;        // row in all of a key
};

using RankOf = int (*)(const int* cell, const int* n);

// ragged borders
int by_slices(const int* c, const int* n)
{
  return std::min((c[0] * comm_size() + (c[1] * 7 + c[2] * 3) % 4) / n[0], comm_size() - 1);
}
int by_layers(const int* c, const int* n) { return std::min(c[1] * comm_size() / n[1], comm_size() - 1); }
int without_last(const int* c, const int* n) { return (c[0] * 5 + c[1] * 3) % n[0] % (comm_size() - 1); }

Eigen::MatrixXd cell_matrix(int dim, int nodes, double soft, double stiff)
{
  Eigen::MatrixXd K = Eigen::MatrixXd::Zero(nodes * dim, nodes * dim);
  for (int a = 0; a < nodes; ++a) {
    for (int i = 0; i < dim; ++i) K(a * dim + i, a * dim + i) += soft;
    for (int b = 0; b < a; ++b) {
      Eigen::VectorXd e(dim);
      for (int i = 0; i < dim; ++i) e[i] = ((a >> i) & 1) - ((b >> i) & 1);
      e /= e.norm();
      const Eigen::MatrixXd k = stiff * (e * e.transpose() + 0.1 * Eigen::MatrixXd::Identity(dim, dim));
      K.block(a * dim, a * dim, dim, dim) += k;
      K.block(b * dim, b * dim, dim, dim) += k;
      K.block(a * dim, b * dim, dim, dim) -= k;
      K.block(b * dim, a * dim, dim, dim) -= k;
    }
  }
  return K;
}

void add_block(SysMatrix& A, int I, int J, const Eigen::MatrixXd& k)
{
  if (J > I) return;
  const int D = A.dim;
  const auto first = A.col.begin() + A.off[I], last = A.col.begin() + A.off[I + 1];
  const long at    = std::find(first, last, J) - A.col.begin();
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j)
      if (I != J || j <= i) A.val[(static_cast<size_t>(at) * D + i) * D + j] += k(i, j);
}

Lattice lattice(int dim, std::vector<int> n, RankOf rank_of, double soft = 0.01, bool dense = true)
{
  n.resize(3, 1);
  Lattice l;
  const int nodes = 1 << dim;
  std::vector<std::vector<long>> cell, mine;
  std::map<long, std::array<double, 3>> place;
  IntVec number;
  for (int z = 0; z < (dim == 3 ? n[2] : 1); ++z)
    for (int y = 0; y < (dim > 1 ? n[1] : 1); ++y)
      for (int x = 0; x < n[0]; ++x) {
        const int c[3] = {x, y, z};
        std::vector<long> key;
        for (int a = 0; a < nodes; ++a) {
          const int p[3] = {x + (a & 1), y + ((a >> 1) & 1), z + ((a >> 2) & 1)};
          key.push_back(p[0] + 100L * p[1] + 10000L * p[2]);
          l.row_of[key.back()] = 0;
          place[key.back()]    = {1.0 * p[0], 1.0 * p[1], 1.0 * p[2]};
        }
        cell.push_back(key);
        if (rank_of(c, n.data()) == comm_rank()) {
          mine.push_back(key);
          number.push_back(static_cast<int>(cell.size()));
        }
      }
  int count = 0;
  for (auto& row : l.row_of) row.second = count++;
  const auto stiff = [](int k) { return 1.0 + (k * 7919 % 13) / 4.0; };
  if (dense) {
    l.all = Eigen::MatrixXd::Zero(count * dim, count * dim);
    for (size_t c = 0; c < cell.size(); ++c) {
      const Eigen::MatrixXd K = cell_matrix(dim, nodes, soft, stiff(static_cast<int>(c) + 1));
      for (int a = 0; a < nodes; ++a)
        for (int b = 0; b < nodes; ++b)
          l.all.block(l.row_of[cell[c][a]] * dim, l.row_of[cell[c][b]] * dim, dim, dim) +=
              K.block(a * dim, b * dim, dim, dim);
    }
  }
  // rows of this rank, in an order of its own
  std::map<long, int> here;
  for (const auto& key : mine)
    for (long k : key) here[k] = 0;
  for (auto& row : here) l.key.push_back(row.first);
  std::shuffle(l.key.begin(), l.key.end(), std::mt19937(comm_rank() + 1));
  for (size_t I = 0; I < l.key.size(); ++I) {
    here[l.key[I]] = static_cast<int>(I);
    for (int i = 0; i < dim; ++i) l.place.push_back(place[l.key[I]][i]);
  }
  ListTable lists;
  for (const auto& key : mine) {
    for (long k : key) lists.item.push_back(here[k]);
    lists.off.push_back(static_cast<int>(lists.item.size()));
  }
  sys_pattern(lists, static_cast<int>(l.key.size()), dim, l.A);
  halo_form(l.key, l.A.halo);
  for (size_t c = 0; c < mine.size(); ++c) {
    const Eigen::MatrixXd K = cell_matrix(dim, nodes, soft, stiff(number[c]));
    for (int a = 0; a < nodes; ++a)
      for (int b = 0; b < nodes; ++b)
        add_block(l.A, here[mine[c][a]], here[mine[c][b]], K.block(a * dim, b * dim, dim, dim));
  }
  return l;
}

// v of this rank from that of all rows
RealVec local(const Lattice& l, const Eigen::VectorXd& v)
{
  RealVec x;
  for (long key : l.key)
    for (int i = 0; i < l.A.dim; ++i) x.push_back(v[l.row_of.at(key) * l.A.dim + i]);
  return x;
}

Eigen::VectorXd load(const Lattice& l)
{
  Eigen::VectorXd b(l.all.rows());
  for (int k = 0; k < b.size(); ++k) b[k] = std::sin(1.0 + k);
  return b;
}

double worst(const RealVec& a, const RealVec& b)
{
  double most = a.size() == b.size() ? 0.0 : 1e300;
  for (size_t k = 0; k < a.size() && most < 1e300; ++k) most = std::max(most, std::fabs(a[k] - b[k]));
  return comm_allreduce_max(most);
}

// the bits of shared rows are the same on all ranks
bool same_bits(const SysMatrix& A, const RealVec& x)
{
  RealVec y = x;
  halo_copy(A.halo, A.dim, y);
  return comm_allreduce_max(static_cast<int>(x != y)) == 0;
}

SolveTask ask(const std::vector<long>& key, long stamp)
{
  SolveTask a{key};
  a.stamp = stamp;
  a.eta   = 1e-11;
  return a;
}

Solver open(SolverKind kind, Preconditioner precond, bool reuse)
{
  Solver s;
  EXPECT_TRUE(solve_open(s, {kind, precond, reuse}));
  return s;
}

void scale(SysMatrix& A, double factor)
{
  for (double& v : A.val) v *= factor;
}

#define NEEDS_RANKS \
  if (comm_size() < 2) GTEST_SKIP() << "needs several ranks"

}  // namespace

// rank 0 alone: factors of the first matrix, corrected where the second one differs; all ranks hear of it
TEST(Divided, FirstRankSolvesBrokenStatics)
{
  NEEDS_RANKS;
  Lattice l = lattice(2, {36, 28}, by_slices);
  Solver s  = open(SOLVER_AUTO, PRECOND_CHOLESKY, true);
  if (s.kind != SOLVER_MUMPS) GTEST_SKIP() << "without MUMPS rank 0 factorises alone anyway";
  s.null_pivot_row = l.A.nrow;
  const Eigen::VectorXd b = load(l);
  const long changed = 17 + 100L * 11;
  for (long stamp : {1, 2}) {
    if (stamp == 2) {
      l.all.diagonal().segment(l.row_of.at(changed) * 2, 2).array() += 3.0;
      for (int I = 0; I < l.A.nrow; ++I)
        if (l.key[I] == changed && l.A.halo.owner[I] == comm_rank())
          add_block(l.A, I, I, 3.0 * Eigen::MatrixXd::Identity(2, 2));
    }
    SolveTask a = ask(l.key, stamp);
    a.pattern  = 1;
    a.broken   = true;
    RealVec x;
    ASSERT_EQ(STATUS_OK, solve_system(s, l.A, a, local(l, b), x));
    const Eigen::VectorXd right = l.all.ldlt().solve(b);
    EXPECT_LT(worst(x, local(l, right)), 1e-8 * right.lpNorm<Eigen::Infinity>());
    EXPECT_TRUE(same_bits(l.A, x));
    EXPECT_EQ(1, s.path[PATH_FACTOR].solves);
    EXPECT_EQ(stamp - 1, s.path[PATH_CHANGED].solves);
  }
  EXPECT_EQ(1, s.nfactor);
  solve_close(s);
}

// a small one without a stiffness: rank 0 finds the zero pivot, and the ranks that have the row hear of it
TEST(Divided, FirstRankTellsOfAZeroPivot)
{
  NEEDS_RANKS;
  Lattice l = lattice(2, {6, 4}, by_slices, 0.0);
  Solver s  = open(SOLVER_AUTO, PRECOND_CHOLESKY, true);
  RealVec x;
  EXPECT_EQ(SOLVER_SINGULAR, solve_system(s, l.A, ask(l.key, 1), local(l, load(l)), x));
  EXPECT_GE(s.zero_equation, 0);
  const int here = s.zero_equation < l.A.neq() ? 1 : 0;
  double ranks   = here;
  comm_sum(&ranks, 1);
  EXPECT_GE(ranks, 1.0);
  EXPECT_FALSE(s.message.empty());
  solve_close(s);
}

// keys that several ranks bring count once; ranks ask for some that nobody brings, and one brings none
TEST(Divided, NumbersOfKeys)
{
  std::mt19937 random(comm_rank() + 1);
  std::vector<long> brings, asked;
  for (int k = 0; k < 300 && comm_rank() != 1; ++k) brings.push_back(static_cast<long>(random() % 999) - 500);
  brings.push_back(LONG_MIN + comm_rank());
  for (int k = 0; k < 200; ++k) asked.push_back(static_cast<long>(random() % 2000) - 1000);
  asked.push_back(LONG_MIN);
  asked.push_back(LONG_MAX);
  std::vector<long> known = brings;
  comm_allgatherv(known);
  std::sort(known.begin(), known.end());
  known.erase(std::unique(known.begin(), known.end()), known.end());
  int all = -1;
  const IntVec number = key_numbers(brings, asked, all);
  EXPECT_EQ(all, static_cast<int>(known.size()));
  ASSERT_EQ(number.size(), asked.size());
  for (size_t k = 0; k < asked.size(); ++k) {
    const auto at = std::lower_bound(known.begin(), known.end(), asked[k]);
    const bool is = at != known.end() && *at == asked[k];
    EXPECT_EQ(number[k], is ? static_cast<int>(at - known.begin()) : -1);
  }
  EXPECT_EQ(key_numbers({}, {1, 2}, all), IntVec({-1, -1}));
  EXPECT_EQ(all, 0);
}

TEST(Divided, ProductDiagonalAndCollection)
{
  NEEDS_RANKS;
  for (int dim : {1, 2, 3})
    for (RankOf rank_of : {by_slices, without_last}) {
      const Lattice l         = lattice(dim, {7, 4, 3}, rank_of);
      const Eigen::VectorXd v = load(l);
      RealVec y, d;
      sys_multiply(l.A, local(l, v), y);
      sys_sum(l.A, y);
      EXPECT_LT(worst(y, local(l, l.all * v)), 1e-12);
      sys_diagonal(l.A, d);
      EXPECT_LT(worst(d, local(l, l.all.diagonal())), 1e-13);
      EXPECT_TRUE(same_bits(l.A, y));
      EXPECT_EQ(sys_rows(l.A) * dim, l.all.rows());

      // numbers over all ranks stand for the keys
      const RowNumbers rows = sys_number(l.A);
      std::vector<std::vector<long>> name(comm_size());
      for (int I = 0; I < l.A.nrow; ++I)
        if (l.A.halo.owner[I] == comm_rank()) name[0].push_back(l.key[I]);
      std::vector<long> key;
      for (const auto& part : comm_exchange(name)) key.insert(key.end(), part.begin(), part.end());
      const SysMatrix whole = sys_collect(l.A, true);
      ASSERT_EQ(whole.nrow * dim, comm_rank() == 0 ? l.all.rows() : 0);
      EXPECT_EQ(sys_collect(l.A, false).col, whole.col);
      if (comm_rank() > 0) continue;
      RealVec x, z;
      for (long k : key)
        for (int i = 0; i < dim; ++i) x.push_back(v[l.row_of.at(k) * dim + i]);
      sys_multiply(whole, x, z);
      const Eigen::VectorXd product = l.all * v;
      for (size_t k = 0; k < z.size(); ++k)
        EXPECT_NEAR(z[k], product[l.row_of.at(key[k / dim]) * dim + k % dim], 1e-12);
    }
}

TEST(Divided, AllWaysSolve)
{
  NEEDS_RANKS;
  struct Way {
    SolverKind kind;
    Preconditioner precond;
    bool reuse;
    SolvePath path;
  };
  std::vector<Way> ways = {{SOLVER_CG, PRECOND_DIAGONAL, true, PATH_DIAGONAL},
                           {SOLVER_CG, PRECOND_CHOLESKY, true, PATH_CHOLESKY},
                           {SOLVER_CG, PRECOND_FACTORS, true, PATH_REUSED},
                           {SOLVER_SKYLINE, PRECOND_AUTO, true, PATH_FACTOR},
                           {SOLVER_SKYLINE, PRECOND_AUTO, false, PATH_FACTOR},
                           {SOLVER_AUTO, PRECOND_AUTO, false, PATH_FACTOR},
                           {SOLVER_AUTO, PRECOND_AUTO, true, PATH_FACTOR}};
  if (amg_there()) ways.push_back({SOLVER_AMG, PRECOND_AUTO, true, PATH_AMG});
  for (int dim : {1, 2, 3})
    for (RankOf rank_of : {by_slices, by_layers, without_last})
      for (const Way& w : ways) {
        Lattice l = lattice(dim, {9, 5, 4}, rank_of);
        const Eigen::VectorXd exact = l.all.ldlt().solve(load(l));
        const RealVec b = local(l, load(l));
        RealVec x;
        Solver s = open(w.kind, w.precond, w.reuse);
        for (int k = 1; k <= 3; ++k) {
          ASSERT_EQ(solve_system(s, l.A, ask(l.key, k), b, x), STATUS_OK);
          EXPECT_LT(worst(x, local(l, exact / std::pow(1.5, k - 1))), 1e-7 * exact.lpNorm<Eigen::Infinity>())
              << "dim " << dim << " kind " << w.kind << " precond " << w.precond << " reuse " << w.reuse;
          EXPECT_TRUE(same_bits(l.A, x));
          scale(l.A, 1.5);
        }
        EXPECT_GT(s.path[w.path].solves, 0);
        solve_close(s);
      }
}

// the factor of each rank with the sums at its border is worth nearly that of one rank
TEST(Divided, BorderOfTheFactorIsWhole)
{
  NEEDS_RANKS;
  const Lattice l = lattice(3, {12, 8, 8}, by_slices, 1e-3, false);
  const RealVec b(l.A.neq(), 1.0);
  RealVec x;
  long iterations[2];
  for (int k : {0, 1}) {
    Solver s = open(SOLVER_CG, k ? PRECOND_CHOLESKY : PRECOND_DIAGONAL, true);
    ASSERT_EQ(solve_system(s, l.A, ask(l.key, 1), b, x), STATUS_OK);
    iterations[k] = s.path[k ? PATH_CHOLESKY : PATH_DIAGONAL].iterations;
    EXPECT_TRUE(k == 0 || comm_size() > 2 || s.data->own.alike);
    solve_close(s);
  }
  EXPECT_LT(2 * iterations[1], iterations[0]);
}

// A border that ranks cannot factorise but with a larger diagonal: all form it again, and are of one mind on it
TEST(Divided, BorderWantsALargerDiagonal)
{
  NEEDS_RANKS;
  for (int dim : {2, 3}) {
    Lattice l   = lattice(dim, {12, 6, 4}, by_slices, 1e-3, false);
    const int D = l.A.dim;
    std::vector<char> border(l.A.nrow, 0);
    for (int I : l.A.halo.shared) border[I] = 1;
    for (int I = 0; I < l.A.nrow && comm_rank() == 0; ++I)
      for (int k = l.A.off[I]; k < l.A.off[I + 1] - 1; ++k)
        for (int i = 0; i < D * D && border[I] && border[l.A.col[k]]; ++i)
          l.A.val[static_cast<size_t>(k) * D * D + i] *= 4.0;
    Cholesky c;
    OwnBlock own;
    own_form(l.A, 1, own);
    ASSERT_TRUE(cholesky_form(l.A, c, &own));
    EXPECT_GT(comm_allreduce_max(c.border_shift), 0.0);
    const RealVec r(l.A.neq(), 1.0);
    RealVec y, z = r;
    EXPECT_GT(cholesky_apply(l.A, c, own, y, z), 0.0);
    EXPECT_TRUE(same_bits(l.A, z));
    // the next matrix begins with the shift that has gone well
    const double shift = c.border_shift;
    RealVec again = r;
    ASSERT_TRUE(cholesky_form(l.A, c, &own));
    cholesky_apply(l.A, c, own, y, again);
    EXPECT_EQ(c.border_shift, shift);
    EXPECT_EQ(again, z);
  }
}

// factors of a lattice serve another one, with rows that have come, left, and gone to other ranks
TEST(Divided, FactorsOfOtherRows)
{
  NEEDS_RANKS;
  for (int dim : {2, 3})
    for (RankOf then : {by_layers, by_slices, without_last}) {
      const Lattice old = lattice(dim, {9, 6, 3}, then);
      Lattice l         = lattice(dim, {10, 5, 3}, by_slices);
      RealVec x;
      Solver s = open(SOLVER_CG, PRECOND_FACTORS, true);
      ASSERT_EQ(solve_system(s, old.A, ask(old.key, 1), local(old, load(old)), x), STATUS_OK);
      const long factored = s.nfactor;
      ASSERT_EQ(solve_system(s, l.A, ask(l.key, 2), local(l, load(l)), x), STATUS_OK);
      EXPECT_EQ(s.nfactor, factored);
      EXPECT_GT(s.path[PATH_REUSED].solves, 0);
      const Eigen::VectorXd exact = l.all.ldlt().solve(load(l));
      EXPECT_LT(worst(x, local(l, exact)), 1e-7 * exact.lpNorm<Eigen::Infinity>());
      EXPECT_TRUE(same_bits(l.A, x));
      // then with factors of its own, and what is known of earlier solutions
      scale(l.A, 2.0);
      ASSERT_EQ(solve_system(s, l.A, ask(l.key, 3), local(l, load(l)), x), STATUS_OK);
      EXPECT_LT(worst(x, local(l, exact / 2.0)), 1e-7 * exact.lpNorm<Eigen::Infinity>());
      solve_close(s);
    }
}

// numbers without their counts are those with counts; two vectors in one message
TEST(Divided, NumbersOfTheHalo)
{
  NEEDS_RANKS;
  Lattice l = lattice(2, {6, 4}, by_slices, 0.0);
  RealVec a(l.A.neq()), b(l.A.neq());
  for (int i = 0; i < l.A.neq(); ++i) {
    a[i] = 100.0 * comm_rank() + i;
    b[i] = -a[i];
  }
  RealVec x = a, y = a, z = b;
  halo_copy(l.A.halo, 2, x);
  halo_numbers(l.A.halo, 2, {&y, &z});
  EXPECT_EQ(comm_allreduce_max(static_cast<int>(x != a)), 1);        // on ranks that do not own all
  EXPECT_EQ(x, y);
  for (int i = 0; i < l.A.neq(); ++i) EXPECT_EQ(z[i], -x[i]);
}

TEST(Divided, ZeroPivots)
{
  NEEDS_RANKS;
  for (bool reuse : {true, false}) {
    Lattice l = lattice(2, {6, 4}, by_slices, 0.0);            // free in space
    RealVec x;
    Solver s = open(SOLVER_AUTO, PRECOND_AUTO, reuse);
    EXPECT_EQ(solve_system(s, l.A, ask(l.key, 1), local(l, load(l)), x), SOLVER_SINGULAR);
    const bool here = s.zero_equation < l.A.neq();
    EXPECT_GE(s.zero_equation, 0);
    EXPECT_LE(s.zero_equation, l.A.neq());
    EXPECT_EQ(comm_allreduce_max(static_cast<int>(here)), 1);
    // all that have it name the same one
    RealVec name(l.A.neq(), 0.0);
    if (here) name[s.zero_equation] = 1.0;
    RealVec copy = name;
    halo_copy(l.A.halo, 2, copy);
    EXPECT_EQ(comm_allreduce_max(static_cast<int>(copy != name)), 0);
    EXPECT_FALSE(s.message.empty());
    solve_close(s);
  }
#ifdef MPFE_MUMPS
  // rows of a grid that nothing holds stand last
  for (bool reuse : {true, false}) {
    Lattice l = lattice(2, {6, 4}, by_slices);
    const int soft = l.A.nrow;
    for (int k = 0; k < 2; ++k) {                               // two that all ranks have
      l.key.push_back(900000 + k);
      l.A.col.push_back(l.A.nrow++);
      l.A.off.push_back(static_cast<int>(l.A.col.size()));
      l.A.val.insert(l.A.val.end(), 4, 0.0);
    }
    halo_form(l.key, l.A.halo);
      Eigen::VectorXd exact = l.all.ldlt().solve(load(l));
    RealVec b = local(lattice(2, {6, 4}, by_slices), load(l)), x;
    b.resize(l.A.neq(), 0.0);
    Solver s = open(SOLVER_MUMPS, PRECOND_AUTO, reuse);
    s.null_pivot_row = soft;
    ASSERT_EQ(solve_system(s, l.A, ask(l.key, 1), b, x), STATUS_OK) << s.message;
    EXPECT_GE(s.zero_equation, 2 * soft);
    EXPECT_EQ(comm_allreduce_max(static_cast<int>(s.fixed_null_pivots)), 4);
    RealVec body(x.begin(), x.begin() + 2 * soft);
    l.key.resize(soft);
    EXPECT_LT(worst(body, local(l, exact)), 1e-8 * exact.lpNorm<Eigen::Infinity>());
    solve_close(s);
  }
#endif
}

// the choice does not look at a clock
TEST(Divided, ChoiceRepeats)
{
  NEEDS_RANKS;
  Lattice l = lattice(3, {10, 8, 8}, by_slices, 0.05, false);
  const SysMatrix first = l.A;
  long solves[2][PATHS], iterations[2][PATHS];
  for (int run : {0, 1}) {
    Solver s = open(SOLVER_AUTO, PRECOND_AUTO, true);
    l.A = first;
    RealVec x;
    for (int k = 1; k <= 12; ++k) {
      SolveTask a = ask(l.key, k);
      a.inertia  = true;
      ASSERT_EQ(solve_system(s, l.A, a, RealVec(l.A.neq(), 1.0), x), STATUS_OK);
      for (size_t i = 0; i < l.A.val.size(); ++i) l.A.val[i] *= 1.02;
    }
    for (int p = 0; p < PATHS; ++p) {
      solves[run][p]     = s.path[p].solves;
      iterations[run][p] = s.path[p].iterations;
    }
    solve_close(s);
  }
  for (int p = 0; p < PATHS; ++p) {
    EXPECT_EQ(solves[0][p], solves[1][p]) << "path " << p;
    if (p != PATH_REUSED) {              // MUMPS sums in the order of the messages
      EXPECT_EQ(iterations[0][p], iterations[1][p]) << "path " << p;
    }
  }
}

// consistent masses of lattice cells, rows from first on, supports
TEST(Divided, MassSolve)
{
  NEEDS_RANKS;
  for (int dim : {2, 3})
    for (RankOf rank_of : {by_slices, without_last}) {
      Lattice l = lattice(dim, {7, 5, 3}, rank_of, 0.0);
      const int n = static_cast<int>(l.row_of.size());
      Dofs s;
      s.rows.dim  = dim;
      s.rows.nrow = l.A.nrow;
      s.pattern.A    = l.A;
      s.rows.row_key.assign(l.key.begin(), l.key.end());
      s.mass.M.assign(l.A.col.size(), 0.0);
      // springs of the first direction, with the sign of masses: dominant diagonal
      Eigen::MatrixXd M = Eigen::MatrixXd::Zero(n, n);
      for (int I = 0; I < n; ++I)
        for (int J = 0; J < n; ++J) M(I, J) = (I == J ? 1.2 : -1.0) * l.all(I * dim, J * dim);
      for (int I = 0; I < l.A.nrow; ++I)
        for (int k = l.A.off[I]; k < l.A.off[I + 1]; ++k)
          s.mass.M[k] = (l.A.col[k] == I ? 1.2 : -1.0) * l.A.val[static_cast<size_t>(k) * dim * dim];
      mass_diagonals(s);
      s.bound.fixed.assign(s.rows.neq(), 0);
      Eigen::VectorXd f(n * dim), given = Eigen::VectorXd::Zero(n * dim);
      for (int k = 0; k < n * dim; ++k) f[k] = std::cos(1.0 + k);
      RealVec x = local(l, given);
      for (int I = 0; I < l.A.nrow; ++I)
        if (l.key[I] % 100 == 3) s.bound.fixed[I * dim] = 1;
      ASSERT_GT(mass_solve(s, ROWS_ALL, 0, local(l, f), x), 0);
      RealVec factored = local(l, given);
      ASSERT_EQ(1, mass_factor(s, ROWS_ALL, local(l, f), factored));
      for (int k = 0; k < s.rows.neq(); ++k) EXPECT_NEAR(factored[k], x[k], 1e-11 * (1.0 + std::fabs(x[k])));
      for (int i = 0; i < dim; ++i) {
        Eigen::MatrixXd K = M;
        Eigen::VectorXd right(n);
        for (const auto& row : l.row_of) {
          right[row.second] = f[row.second * dim + i];
          if (i > 0 || row.first % 100 != 3) continue;
          K.row(row.second).setZero();
          K.col(row.second).setZero();
          K(row.second, row.second) = 1.0;
          right[row.second] = 0.0;
        }
        const Eigen::VectorXd u = K.ldlt().solve(right);
        for (int I = 0; I < l.A.nrow; ++I)
          EXPECT_NEAR(x[I * dim + i], u[l.row_of.at(l.key[I])], 1e-9 * u.lpNorm<Eigen::Infinity>());
      }
      EXPECT_TRUE(same_bits(l.A, x));
    }
}

// a strip of masses with points at one end: the solution near them is that of all rows, the others stay. With
// couplings that reach further all rows are solved
TEST(Divided, MassProjection)
{
  for (const double diagonal : {2.0, 1.2}) {
    Lattice l = lattice(2, {60, 2}, by_slices, 0.0);
    if (comm_size() == 1) l.A.halo = Halo();
    const int n = static_cast<int>(l.row_of.size());
    const auto x_of = [](long key) { return key % 100; };
    Dofs s;
    s.rows.dim  = 2;
    s.rows.nrow = s.rows.nfe = l.A.nrow;
    s.pattern.A    = l.A;
    s.rows.row_key.assign(l.key.begin(), l.key.end());
    s.rows.hung = true;
    s.mass.M.assign(l.A.col.size(), 0.0);
    Eigen::MatrixXd M = Eigen::MatrixXd::Zero(n, n);
    for (int I = 0; I < n; ++I)
      for (int J = 0; J < n; ++J) M(I, J) = (I == J ? diagonal : -1.0) * l.all(I * 2, J * 2);
    for (int I = 0; I < l.A.nrow; ++I)
      for (int k = l.A.off[I]; k < l.A.off[I + 1]; ++k)
        s.mass.M[k] = (l.A.col[k] == I ? diagonal : -1.0) * l.A.val[static_cast<size_t>(k) * 4];
    mass_diagonals(s);
    s.bound.fixed.assign(s.rows.neq(), 0);
    ActiveGrid grid;
    for (int I = 0; I < l.A.nrow && comm_rank() == 0; ++I)
      if (x_of(l.key[I]) == 0) grid.point.item.push_back(I - s.rows.nfe);
    grid.point.off.push_back(static_cast<int>(grid.point.item.size()));
    s.rows.owned_point = {0};
    s.mass.mass_rows   = mass_rows_projection(grid, s);
    int near = 0;
    for (int I : s.mass.mass_rows->row) near += x_of(l.key[I]) <= 26;
    EXPECT_EQ(near, s.mass.mass_rows->size());
    EXPECT_EQ(near, std::count_if(l.key.begin(), l.key.end(), [&](long key) { return x_of(key) <= 26; }));

    Eigen::MatrixXd before(n, 2), f(n, 2);
    for (const auto& row : l.row_of)
      for (int i = 0; i < 2; ++i) before(row.second, i) = std::cos(1.0 + row.second * 2 + i);
    f = M * before;
    for (const auto& row : l.row_of)
      if (x_of(row.first) == 0) f.row(row.second) *= 1.3;
    const Eigen::MatrixXd u = M.ldlt().solve(f);
    Eigen::VectorXd given(n * 2), right(n * 2);
    for (int I = 0; I < n; ++I)
      for (int i = 0; i < 2; ++i) {
        given[I * 2 + i] = before(I, i);
        right[I * 2 + i] = f(I, i);
      }
    RealVec x = local(l, given);
    const RealVec start = x;
    ASSERT_GT(mass_project(s, {}, local(l, right), x), 0);
    for (int I = 0; I < l.A.nrow; ++I)
      for (int i = 0; i < 2; ++i) {
        EXPECT_NEAR(x[I * 2 + i], u(l.row_of.at(l.key[I]), i), 1e-12);
        if (diagonal == 2.0 && x_of(l.key[I]) > 26) {
          EXPECT_EQ(x[I * 2 + i], start[I * 2 + i]);
        }
      }
    EXPECT_TRUE(!sys_shared(s.pattern.A) || same_bits(l.A, x));
  }
}
