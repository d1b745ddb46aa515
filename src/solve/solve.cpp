#include "solve/solve.h"

#include <sys/mman.h>

#include <cmath>
#include <cstdarg>
#include <cstdio>

#include "base/comm.h"
#include "base/log.h"
#include "base/timer.h"
#include "solve/solve_data.h"

namespace {

const double BLAS_BUFFER = 150.0;    // MB, which BLAS takes beside the factors  (no test)
// operations of a skyline factorisation, half a millisecond; MUMPS has an overhead of a quarter millisecond
// (test: Solve.SmallAndIndefinite)
const double MAX_SKYLINE_FLOPS = 2e6;
// equations of a 2D problem from which on CHOLMOD is faster than MUMPS: 0.73 of its time, contact with 1060
// (test: Solve.Cholmod)
const int CHOLMOD_FROM = 200;

#ifdef MPFE_MUMPS
bool by_mumps(const Solver& s) { return s.kind == SOLVER_MUMPS && !s.data->narrow; }
#endif

// are zero pivots errors, or not expected?
bool regular(const Solver& s) { return s.masses || s.null_pivot_row < 0; }

// A small matrix with a narrow profile: the skyline takes less than the overhead of MUMPS. Not with REUSE=NO:
// the choice depends on earlier matrices of the pattern, which a restarted run does not have
bool narrow_analyse(Solver& s, const SysMatrix& A)
{
  if (s.kind != SOLVER_MUMPS || s.def.kind == SOLVER_MUMPS || !s.def.reuse || !regular(s) ||
      s.data->unfit || A.neq() >= SMALL_SYSTEM || comm_size() > 1)
    return false;
  return skyline_analyse(s, A) == STATUS_OK && s.flops < MAX_SKYLINE_FLOPS;
}

using Work = Status (*)(Solver& s, const SysMatrix& A);

// divided model: sends the rows whose zero pivots are fixed to rank 0
void send_soft(Solver& s)
{
  SolverData& d = *s.data;
  const int me  = comm_rank();
  std::vector<IntVec> to(comm_size());
  const int rows = static_cast<int>(d.pattern.halo.owner.size());
  for (int I = std::max(0, s.null_pivot_row); s.null_pivot_row >= 0 && I < rows; ++I)
    if (d.pattern.halo.owner[I] == me) to[0].push_back(d.pattern.numbers.number[I]);
  d.soft.clear();
  if (me == 0) d.soft.assign(d.pattern.numbers.first.back(), 0);
  for (const IntVec& list : comm_exchange(to))
    for (int number : list) d.soft[number] = 1;
}

// the work on A; first_only: by rank 0 on the whole matrix, which sends the result to the others
Status do_work(Solver& s, const SysMatrix& A, bool values, Work work)
{
  SolverData& d = *s.data;
  if (!d.first_only) return work(s, A);
  if (d.pattern.divided) send_soft(s);
  const SysMatrix whole = sys_collect(A, values);
  Status status = comm_rank() == 0 ? work(s, whole) : STATUS_OK;
  status = static_cast<Status>(comm_bcast(status));
  s.zero_equation = comm_bcast(s.zero_equation);
  if (d.pattern.divided)
    s.zero_equation = equation_here(d.pattern.numbers.number, d.pattern.dim, s.zero_equation);
  s.negative      = comm_bcast(s.negative);
  comm_bcast(s.message);
  double numbers[3] = {s.flops, s.flops_ahead, d.cost.factor_entries};
  comm_bcast(numbers, 3);
  s.flops          = numbers[0];
  s.flops_ahead    = numbers[1];
  d.cost.factor_entries = numbers[2];
  return status;
}

#ifdef MPFE_MUMPS
Status analyse_for_mumps(Solver& s, const SysMatrix& A)
{
  const Status status = mumps_analyse(s, A);
  s.data->for_mumps   = status == STATUS_OK;
  return status;
}

// 2D problems on one rank: CHOLMOD takes half the time of MUMPS, which follows only if CHOLMOD cannot
// factorise the matrix
Status analyse_mumps_or_chm(Solver& s, const SysMatrix& A)
{
  if (s.def.kind != SOLVER_MUMPS && A.dim == 2 && A.neq() >= CHOLMOD_FROM &&
      (comm_size() == 1 || s.data->first_only)) {
    const Status status = chm_analyse(s, A);
    if (status != SOLVER_SINGULAR) return status;
    s.data->chm.reset();
  }
  return analyse_for_mumps(s, A);
}

// Factorisations by MUMPS after a matrix that is not clearly positive definite: 1, then twice as many after
// each failure, up to this number; time only  (no test)
const int CHOLMOD_PAUSE = 64;

// A matrix that is not clearly positive definite is left to MUMPS, and so are some of the following ones of
// this pattern. With REUSE=NO each matrix is tried, so that a restarted run does the same
Status factor_mumps_or_chm(Solver& s, const SysMatrix& A)
{
  SolverData& d = *s.data;
  d.by_chm      = false;
  if (d.chm && (d.chm_wait == 0 || !s.def.reuse)) {
    const Status status = chm_factor(s, A);
    d.by_chm            = status == STATUS_OK;
    if (d.by_chm) ++s.ncholmod;
    if (d.by_chm) d.chm_pause = 0;
    if (status != SOLVER_SINGULAR) return status;
    d.chm_wait = d.chm_pause = std::min(std::max(1, 2 * d.chm_pause), CHOLMOD_PAUSE);
  } else if (d.chm) {
    --d.chm_wait;
  }
  if (!d.for_mumps) {
    const Status status = analyse_for_mumps(s, A);
    if (status != STATUS_OK) return status;
  }
  return mumps_factor(s, A);
}
#endif

Status back_work(Solver& s, RealVec& x)
{
#ifdef MPFE_MUMPS
  if (s.data->by_chm) return chm_back(s, x.data(), 1);
  if (by_mumps(s)) return mumps_back(s, x.data(), 1);
#endif
  return skyline_back(s, x);
}

// rank 0 has the factors. Divided model: ranks send their owned rows to it, and receive the solution in these
Status back_by_first(Solver& s, RealVec& x)
{
  const SolverData& d = *s.data;
  const int D = d.pattern.dim, me = comm_rank(), ranks = comm_size();
  if (!d.pattern.divided) {
    const Status status = me == 0 ? back_work(s, x) : STATUS_OK;
    comm_bcast(x.data(), static_cast<int>(x.size()));
    return static_cast<Status>(comm_bcast(status));
  }
  std::vector<RealVec> to(ranks);
  const int rows = static_cast<int>(d.pattern.halo.owner.size());
  for (int I = 0; I < rows; ++I)
    if (d.pattern.halo.owner[I] == me)
      to[0].insert(to[0].end(), x.begin() + long(I) * D, x.begin() + long(I + 1) * D);
  std::vector<RealVec> from = comm_exchange(to);
  Status status = STATUS_OK;
  to.assign(ranks, RealVec());
  if (me == 0) {
    RealVec all;
    for (RealVec& part : from) all.insert(all.end(), part.begin(), part.end());
    status = back_work(s, all);
    for (int r = 0; r < ranks; ++r)
      to[r].assign(all.begin() + long(d.pattern.numbers.first[r]) * D,
                   all.begin() + long(d.pattern.numbers.first[r + 1]) * D);
  }
  from = comm_exchange(to);
  const double* next = from[0].data();
  for (int I = 0; I < rows; ++I)
    if (d.pattern.halo.owner[I] == me) {
      std::copy(next, next + D, &x[I * D]);
      next += D;
    }
  halo_copy(d.pattern.halo, D, x);
  return static_cast<Status>(comm_bcast(status));
}

// a sum is finite only if all its terms are (values near the largest double do not occur)
bool is_finite(const RealVec& v)
{
  double part[8] = {};
  const size_t whole = v.size() / 8 * 8;
  for (size_t k = 0; k < whole; k += 8)
    for (size_t l = 0; l < 8; ++l) part[l] += v[k + l];
  for (size_t k = whole; k < v.size(); ++k) part[0] += v[k];
  double sum = 0.0;
  for (double p : part) sum += p;
  return std::isfinite(sum);
}

// adds the wall seconds until the end of its block
struct Stopwatch {
  explicit Stopwatch(double& sum) : seconds(sum), begin(timer_wall()) {}
  ~Stopwatch() { seconds += timer_wall() - begin; }
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;
  double& seconds;
  double begin;
};

}  // namespace

int equation_here(const IntVec& number, int dim, int equation)
{
  if (equation < 0) return equation;
  const long I = std::find(number.begin(), number.end(), equation / dim) - number.begin();
  return static_cast<int>(I) * dim + (I < static_cast<long>(number.size()) ? equation % dim : 0);
}

Status solve_fail(Solver& s, Status status, const char* format, ...)
{
  char text[512];
  va_list args;
  va_start(args, format);
  std::vsnprintf(text, sizeof text, format, args);
  va_end(args);
  s.message = text;
  return status;
}

// each rank compares its own pattern; the result is the same on all ranks
bool solve_same_pattern(const Solver& s, const SysMatrix& A)
{
  const SolverData& d = *s.data;
  // compare the shared rows too: a contact with another face may give the same pattern on other nodes
  // (test: ranks/compare), contact/g2_edges.inp on two ranks
  const bool rows = d.pattern.halo.common == A.halo.common && d.pattern.halo.owner == A.halo.owner;
  const bool same = d.pattern.dim == A.dim && d.pattern.off == A.off && d.pattern.col == A.col &&
      (!sys_shared(A) || rows);
  return sys_shared(A) ? !comm_allreduce_max(!same) : same;
}

// Allocates and frees the memory, with the buffer of a thread of OpenBLAS, which would wait
// for ever without it
bool solve_room(double mb)
{
  const size_t bytes = static_cast<size_t>(1e6 * (mb + BLAS_BUFFER));
  void* memory = mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (memory != MAP_FAILED) munmap(memory, bytes);
  return memory != MAP_FAILED;
}

bool solve_open(Solver& s, const SolverDef& def)
{
  SolverKind kind = def.kind == SOLVER_CG || def.kind == SOLVER_AMG ? SOLVER_AUTO : def.kind;
#ifdef MPFE_MUMPS
  if (kind == SOLVER_AUTO) kind = SOLVER_MUMPS;
#else
  if (kind == SOLVER_AUTO) kind = SOLVER_SKYLINE;
  if (kind == SOLVER_MUMPS) return false;
#endif
  if (def.kind == SOLVER_AMG && !amg_there()) return false;
  s.kind = kind;
  s.def  = def;
  s.data = std::make_shared<SolverData>();
  s.data->first_only = comm_size() > 1 && (kind == SOLVER_SKYLINE || !def.reuse);
  return true;
}

const char* solve_name(const Solver& s)
{
  switch (s.kind) {
    case SOLVER_SKYLINE: return "SKYLINE";
    case SOLVER_MUMPS: return "MUMPS";
    case SOLVER_CG:
    case SOLVER_AMG:
    case SOLVER_AUTO: break;
  }
  return "AUTO";
}

Status solve_analyse(Solver& s, const SysMatrix& A)
{
  MPFE_CHECK(s.data, "solve_analyse before solve_open");
  SolverData& d = *s.data;
  const bool same = d.analysed && solve_same_pattern(s, A);
  if (same && (!d.narrow || (regular(s) && !d.unfit))) return STATUS_OK;
  d.unfit = d.unfit && same;

  Stopwatch watch(s.seconds_analyse);
  ++s.nanalyse;
  d.factored = d.analysed = d.by_chm = d.for_mumps = false;
  d.chm.reset();
  d.chm_wait = d.chm_pause = 0;
  d.pattern.dim = A.dim;
  d.pattern.off = A.off;
  d.pattern.col = A.col;
  d.pattern.divided = sys_shared(A);
  if (d.pattern.divided) {
    d.pattern.halo    = A.halo;
    d.pattern.numbers = sys_number(A);
  }
  Status status = STATUS_OK;
  if (sys_rows(A) > 0) {
    d.narrow = narrow_analyse(s, A);
#ifdef MPFE_MUMPS
    if (!d.narrow)
      status = do_work(s, A, false, s.kind == SOLVER_MUMPS ? analyse_mumps_or_chm : skyline_analyse);
#else
    status = do_work(s, A, false, skyline_analyse);
#endif
  }
  d.analysed = status == STATUS_OK;
  return status;
}

Status solve_factor(Solver& s, const SysMatrix& A)
{
  Status status = solve_analyse(s, A);
  if (status != STATUS_OK) return status;

  Stopwatch watch(s.seconds_factor);
  ++s.nfactor;
  SolverData& d = *s.data;
  d.factored    = false;
  s.negative    = 0;
  s.zero_equation = -1;
  if (comm_allreduce_max(!is_finite(A.val)))
    return solve_fail(s, BAD_NUMBER, "the matrix contains a value that is not a number");
  if (sys_rows(A) > 0) {
#ifdef MPFE_MUMPS
    status = do_work(s, A, true, by_mumps(s) ? factor_mumps_or_chm : skyline_factor);
    // the skyline does not pivot: matrices that are singular or indefinite in statics are left to MUMPS,
    // until the pattern changes
    if (d.narrow && (status != STATUS_OK || (s.negative > 0 && !s.masses))) {
      d.unfit = true;
      status  = solve_analyse(s, A);
      if (status == STATUS_OK) status = do_work(s, A, true, factor_mumps_or_chm);
    }
#else
    status = do_work(s, A, true, skyline_factor);
#endif
  }
  d.factored = status == STATUS_OK;
  return status;
}

Status solve_back(Solver& s, const RealVec& b, RealVec& x)
{
  MPFE_CHECK(s.data && s.data->factored, "solve_back without a factorisation");
  const SolverData& d = *s.data;
  MPFE_CHECK(b.size() == (d.pattern.off.size() - 1) * d.pattern.dim,
             "solve_back: the right-hand side has another size than the matrix");

  Stopwatch watch(s.seconds_back);
  ++s.nback;
  if (&x != &b) x = b;
  if (d.pattern.divided ? d.pattern.numbers.first.back() == 0 : x.empty()) return STATUS_OK;
  return d.first_only ? back_by_first(s, x) : back_work(s, x);
}

Status solve_back_rough(Solver& s, const RealVec& b, RealVec& x)
{
  if (!s.data->by_chm || s.data->first_only) return solve_back(s, b, x);
  Stopwatch watch(s.seconds_back);
  ++s.nback;
  if (&x != &b) x = b;
  return chm_rough(s, x.data());
}

Status solve_back_many(Solver& s, double* x, int count)
{
  const SolverData& d = *s.data;
  MPFE_CHECK(d.factored && comm_size() == 1, "solve_back_many: factors of one rank");
  Stopwatch watch(s.seconds_back);
  s.nback += count;
#ifdef MPFE_MUMPS
  if (d.by_chm) return chm_back(s, x, count);
  if (by_mumps(s)) return mumps_back(s, x, count);
#endif
  const size_t n = (d.pattern.off.size() - 1) * d.pattern.dim;
  RealVec one(n);
  for (int k = 0; k < count; ++k) {
    std::copy(x + k * n, x + (k + 1) * n, one.begin());
    const Status status = skyline_back(s, one);
    if (status != STATUS_OK) return status;
    std::copy(one.begin(), one.end(), x + k * n);
  }
  return STATUS_OK;
}

bool solve_rest(const Solver& s, RealVec& rest)
{
  const SolverData& d = *s.data;
  if (d.rest == REST_UNKNOWN) return false;
  if (d.rest == REST_CG) rest = d.work.r;
  if (d.rest == REST_NONE) std::fill(rest.begin(), rest.end(), 0.0);
  for (size_t k = 0; k < rest.size() && d.rest == REST_SCALED; ++k)
    rest[k] = d.scaled.size * static_cast<double>(d.scaled.r[k] * d.scaled.root[k]);
  return true;
}

bool solve_multiply(const Solver& s, const SysMatrix& A, long stamp, const RealVec& x, RealVec& y)
{
  ScaledMatrix& z = s.data->scaled;
  if (z.stamp != stamp || z.root.size() != x.size()) return false;
  scaled_multiply(A, z, x, y);
  return true;
}

void solve_memory(const Solver& s, std::vector<MemoryUse>& out)
{
  const SolverData& d = *s.data;
  const auto reals = [](const RealVec& v) { return static_cast<double>(v.capacity() * sizeof(double)); };
  double numbers = static_cast<double>((d.pattern.off.capacity() + d.pattern.col.capacity()) * sizeof(int)),
         factors = reals(d.sky.a) + 1e6 * s.memory_mb;
#ifdef MPFE_MUMPS
  if (s.kind == SOLVER_MUMPS && d.mumps) numbers += mumps_memory(s);
  if (s.memory_mb > 0.0 && !d.first_only && comm_size() > 1) factors = 1e6 * mumps_factors_mb(s);
#endif
  double vectors = reals(d.work.r) + reals(d.work.z) + reals(d.work.p) + reals(d.work.q) + reals(d.reused.x) +
                   reals(d.reused.inverse) + reals(d.changed.A0.val) + reals(d.changed.G) +
                   reals(d.changed.Q) + reals(d.changed.y);
  for (const std::vector<float>* v : {&d.scaled.val, &d.scaled.root, &d.scaled.x, &d.scaled.r, &d.scaled.p,
                                      &d.scaled.q})
    vectors += static_cast<double>(v->capacity() * sizeof(float));
  for (const std::vector<float>& V : d.changed.V)
    vectors += static_cast<double>(V.capacity() * sizeof(float));
  for (const RealVec& x : d.past) vectors += reals(x);
  out.push_back({"indices of the entries for MUMPS", numbers});
  out.push_back({"factors", factors});
  const auto ints = [](const IntVec& v) { return static_cast<double>(v.capacity() * sizeof(int)); };
  if (comm_size() > 1 && d.own.inner > 0)
    out.push_back({"order of elimination, border",
                   reals(d.own.once) + ints(d.own.col) + ints(d.own.from)});
  out.push_back({"incomplete factors",
                 static_cast<double>(sizeof(float)) *
                     static_cast<double>(d.cholesky.L.capacity() + d.cholesky.border.capacity())});
  if (d.amg) out.push_back({"multigrid without the memory of PETSc", amg_memory(*d.amg)});
  out.push_back({"vectors of the solver", vectors});
  if (d.first) first_memory(*d.first, out);
}

void solve_drop(Solver& s)
{
  SolverData& d = *s.data;
#ifdef MPFE_MUMPS
  if (s.kind == SOLVER_MUMPS) mumps_close(s);
#endif
  d.chm.reset();
  d.sky   = Skyline();
  d.stamp = -1;
  d.factored = d.analysed = d.by_chm = d.for_mumps = d.narrow = false;
  d.reused = ReusedFactors();
  d.past.clear();
}

void solve_close(Solver& s)
{
  if (s.data && s.data->first) first_close(*s.data->first);
#ifdef MPFE_MUMPS
  if (s.data && s.kind == SOLVER_MUMPS) mumps_close(s);
#endif
  s.data.reset();
}
