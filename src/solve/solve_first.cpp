#include <algorithm>
#include <functional>
#include <numeric>

#include "base/comm.h"
#include "solve/solve_data.h"

// Systems that rank 0 solves alone for all ranks
struct FirstAlone {
  Solver solver;               // rank 0; its routines run within CommAlone
  long pattern = 0;            // SolveTask::pattern of the data below, 0: none
  long stamp   = -1;           // SolveTask::stamp of the values
  IntVec number;               // [nrow] row of the whole matrix
  IntVec own;                  // rows owned by this rank
  // rank 0
  SysMatrix whole;
  std::vector<long> key;       // [rows of all]
  int nfe = 0;                 // number of these that are rows of elements
  std::vector<IntVec> row;     // [ranks] rows of the whole matrix that a rank owns
  std::vector<IntVec> block;   // [ranks] 2 k: block k of whole for each of its blocks; 2 k + 1: transposed
};

namespace {

// equations of systems that rank 0 solves alone: it must store the whole matrix and its factors  (no test)
const long MAX_FIRST = 300000;

// ---- rows and pattern of all ranks -------------------------------------------------

template <class T>
std::vector<std::vector<T>> to_first(const std::vector<T>& x)
{
  std::vector<std::vector<T>> to(comm_size());
  to[0] = x;
  return comm_exchange(to);
}

// numbers rows of elements by node, then rows of the grid, as on one rank; returns the rows of each rank
std::vector<IntVec> number_rows(const std::vector<std::vector<long>>& key, FirstAlone& f)
{
  long nodes = 0;
  std::vector<long> grid;      // keys
  for (const std::vector<long>& list : key)
    for (long k : list) {
      nodes = std::max(nodes, k + 1);
      if (k < 0) grid.push_back(k);
    }
  std::sort(grid.begin(), grid.end(), std::greater<long>());
  grid.erase(std::unique(grid.begin(), grid.end()), grid.end());
  IntVec row(nodes, -1);       // of nodes
  for (const std::vector<long>& list : key)
    for (long k : list)
      if (k >= 0) row[k] = 0;
  f.key.clear();
  for (long k = 0; k < nodes; ++k)
    if (row[k] == 0) {
      row[k] = static_cast<int>(f.key.size());
      f.key.push_back(k);
    }
  f.nfe = static_cast<int>(f.key.size());
  f.key.insert(f.key.end(), grid.begin(), grid.end());
  std::vector<IntVec> number(key.size());
  for (size_t r = 0; r < key.size(); ++r)
    for (long k : key[r]) {
      const auto at = std::lower_bound(grid.begin(), grid.end(), k, std::greater<long>());
      number[r].push_back(k >= 0 ? row[k] : f.nfe + static_cast<int>(at - grid.begin()));
    }
  return number;
}

// pattern of the whole matrix, and the positions of the blocks of each rank in it
void join_patterns(int dim, const std::vector<IntVec>& number, const std::vector<IntVec>& off,
                   const std::vector<IntVec>& col, FirstAlone& f)
{
  const int n = static_cast<int>(f.key.size()), ranks = static_cast<int>(number.size());
  // blocks of all ranks, rank by rank: column, and twice its number, plus 1 if transposed
  using Block = std::pair<int, unsigned>;
  IntVec next(n + 1, 0);
  const auto each = [&](auto use) {
    unsigned at = 0;
    for (int r = 0; r < ranks; ++r)
      for (size_t I = 0; I + 1 < off[r].size(); ++I)
        for (int k = off[r][I]; k < off[r][I + 1]; ++k) use(at++, number[r][I], number[r][col[r][k]]);
  };
  each([&](unsigned, int I, int J) { ++next[std::max(I, J) + 1]; });
  std::partial_sum(next.begin(), next.end(), next.begin());
  const IntVec first = next;
  std::vector<Block> block(first.back());
  each([&](unsigned at, int I, int J) {
    block[next[std::max(I, J)]++] = {std::min(I, J), 2 * at + (J > I ? 1 : 0)};
  });
  IntVec target(block.size());
  SysMatrix& A = f.whole;
  A = SysMatrix();
  A.dim  = dim;
  A.nrow = n;
  for (int I = 0; I < n; ++I) {
    std::sort(block.begin() + first[I], block.begin() + first[I + 1]);
    for (int k = first[I]; k < first[I + 1]; ++k) {
      const auto& [J, at] = block[k];
      if (k == first[I] || J != block[k - 1].first) A.col.push_back(J);
      target[at / 2] = 2 * (static_cast<int>(A.col.size()) - 1) + static_cast<int>(at % 2);
    }
    A.off.push_back(static_cast<int>(A.col.size()));
  }
  f.block.clear();
  auto from = target.begin();
  for (int r = 0; r < ranks; ++r) {
    f.block.emplace_back(from, from + static_cast<long>(col[r].size()));
    from += static_cast<long>(col[r].size());
  }
}

void join(const SysMatrix& A, const SolveTask& task, FirstAlone& f)
{
  const int ranks = comm_size(), me = comm_rank();
  f.own.clear();
  for (int I = 0; I < A.nrow; ++I)
    if (A.halo.owner[I] == me) f.own.push_back(I);
  const auto key = to_first(task.key);
  const auto own = to_first(f.own), off = to_first(A.off), col = to_first(A.col);
  std::vector<IntVec> number(ranks);
  if (me == 0) {
    number = number_rows(key, f);
    f.row.assign(ranks, {});
    for (int r = 0; r < ranks; ++r)
      for (int I : own[r]) f.row[r].push_back(number[r][I]);
    join_patterns(A.dim, number, off, col, f);
  }
  f.number  = comm_exchange(number)[0];
  f.pattern = task.pattern;
}

// ---- numbers -----------------------------------------------------------------------

// sums the contributions of all ranks
void join_values(const RealVec& val, FirstAlone& f)
{
  const std::vector<RealVec> part = to_first(val);
  if (comm_rank() > 0) return;
  const int D = f.whole.dim, DD = D * D;
  f.whole.val.assign(f.whole.col.size() * DD, 0.0);
  for (size_t r = 0; r < part.size(); ++r)
    for (size_t k = 0; k < f.block[r].size(); ++k) {
      const double* a = &part[r][k * DD];
      double* x       = &f.whole.val[static_cast<size_t>(f.block[r][k] / 2) * DD];
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) x[i * D + j] += f.block[r][k] % 2 ? a[j * D + i] : a[i * D + j];
    }
}

RealVec join_vector(int D, const RealVec& b, const FirstAlone& f)
{
  RealVec own, all(f.key.size() * D);
  for (int I : f.own) own.insert(own.end(), b.begin() + long(I) * D, b.begin() + long(I + 1) * D);
  const std::vector<RealVec> part = to_first(own);
  for (size_t r = 0; r < part.size() && comm_rank() == 0; ++r)
    for (size_t k = 0; k < f.row[r].size(); ++k)
      std::copy_n(&part[r][k * D], D, &all[static_cast<size_t>(f.row[r][k]) * D]);
  return all;
}

void share_vector(const SysMatrix& A, const RealVec& all, const FirstAlone& f, RealVec& x)
{
  const int D = A.dim;
  std::vector<RealVec> to(comm_size());
  for (int r = 0; r < comm_size() && comm_rank() == 0; ++r)
    for (int I : f.row[r])
      to[r].insert(to[r].end(), all.begin() + long(I) * D, all.begin() + long(I + 1) * D);
  const RealVec own = comm_exchange(to)[0];
  x.resize(A.neq());
  for (size_t k = 0; k < f.own.size(); ++k)
    std::copy_n(&own[k * D], D, &x[static_cast<size_t>(f.own[k]) * D]);
  halo_copy(A.halo, D, x);
}

// ---- counts and results of the solver of rank 0 --------------------------------------

// calls use(number) for all counts
template <class Counts, class Use>
void each_count(Counts& c, Use use)
{
  use(c.fixed_null_pivots);
  use(c.nfactor);
  use(c.nback);
  use(c.nanalyse);
  use(c.ncholmod);
  use(c.seconds_factor);
  use(c.seconds_back);
  use(c.seconds_analyse);
  for (auto& p : c.path) {
    use(p.solves);
    use(p.iterations);
    use(p.failed);
    use(p.seconds);
    use(p.digits);
  }
}

RealVec counts(const SolveCounts& c)
{
  RealVec out;
  each_count(c, [&](auto x) { out.push_back(static_cast<double>(x)); });
  return out;
}

Status share_results(Status status, RealVec did, const FirstAlone& f, int dim, Solver& s)
{
  const Solver& one = f.solver;
  did.insert(did.end(), {1.0 * status, 1.0 * one.zero_equation, 1.0 * one.negative, one.left, one.flops,
                         one.memory_mb, one.flops_ahead});
  comm_bcast(did.data(), static_cast<int>(did.size()));
  s.message = one.message;
  comm_bcast(s.message);
  const double* next = did.data();
  each_count(static_cast<SolveCounts&>(s), [&](auto& x) {
    x += static_cast<std::decay_t<decltype(x)>>(*next++);
  });
  s.zero_equation = equation_here(f.number, dim, static_cast<int>(next[1]));
  s.negative    = static_cast<int>(next[2]);
  s.left        = next[3];
  s.flops       = next[4];
  s.memory_mb   = next[5];
  s.flops_ahead = next[6];
  return static_cast<Status>(static_cast<int>(next[0]));
}

}  // namespace

bool first_pays(const Solver& s, const SysMatrix& A, const SolveTask& task)
{
  const long equations = s.data->cost.rows * A.dim;
  // on two ranks whole runs with CHOLMOD take 0.72 to 1.04 of the time with MUMPS (doc/benchmarks.md)
  const bool suits = task.broken || (A.dim == 2 && !task.inertia && comm_size() == 2);
  return sys_shared(A) && s.def.kind == SOLVER_AUTO && s.kind == SOLVER_MUMPS && s.def.reuse &&
         equations > 0 && (equations < SMALL_SYSTEM || (suits && equations <= MAX_FIRST));
}

Status first_solve(Solver& s, const SysMatrix& A, const SolveTask& task, const RealVec& b, RealVec& x)
{
  std::shared_ptr<FirstAlone>& first = s.data->first;
  if (!first) {
    first = std::make_shared<FirstAlone>();
    CommAlone alone;
    if (alone.rank == 0) solve_open(first->solver, s.def);
  }
  FirstAlone& f    = *first;
  const bool fresh = task.pattern == 0 || f.pattern != task.pattern;
  if (fresh) join(A, task, f);
  if (fresh || f.stamp != task.stamp) join_values(A.val, f);
  f.stamp = task.stamp;
  RealVec all = join_vector(A.dim, b, f), y;
  Status status = STATUS_OK;
  RealVec did   = counts(f.solver);
  if (comm_rank() == 0) {
    CommAlone alone;
    SolveTask whole{f.key, task.stamp, task.pattern, task.eta, task.energy, task.residual, task.digits,
                    task.exact, task.broken, task.inertia, task.known_regular, task.plain};
    f.solver.null_pivot_row = s.null_pivot_row >= 0 ? f.nfe : -1;
    status = solve_system(f.solver, f.whole, whole, all, y);
    const RealVec now = counts(f.solver);
    for (size_t k = 0; k < did.size(); ++k) did[k] = now[k] - did[k];
  }
  status = share_results(status, did, f, A.dim, s);
  if (status == STATUS_OK) share_vector(A, y, f, x);
  return status;
}

void first_memory(const FirstAlone& f, std::vector<MemoryUse>& out)
{
  const double numbers = static_cast<double>(f.whole.val.capacity() * sizeof(double));
  out.push_back({"matrix of all ranks", numbers});
  if (comm_rank() > 0 || !f.solver.data) return;
  std::vector<MemoryUse> more;
  CommAlone alone;
  solve_memory(f.solver, more);
  for (const MemoryUse& u : more) {
    const auto same = std::find_if(out.begin(), out.end(), [&](const MemoryUse& o) {
      return std::string(o.what) == u.what;
    });
    if (same == out.end()) out.push_back(u);
    else same->bytes += u.bytes;
  }
}

void first_close(FirstAlone& f)
{
  if (comm_rank() > 0) return;
  CommAlone alone;
  solve_close(f.solver);
}
