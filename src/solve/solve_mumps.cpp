#ifdef MPFE_MUMPS

#include <dmumps_c.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <unordered_map>

#include "base/comm.h"
#include "base/log.h"
#include "solve/solve_data.h"

struct MumpsData {
  DMUMPS_STRUC_C id;
  bool shared = false;               // all ranks work together
  bool parts  = false;               // divided model: rows and vectors of this rank only
  IntVec number;                     // [nrow] number of each block row inside MUMPS
  std::vector<MUMPS_INT> irn, jcn;   // [col.size()*dim*dim] equation numbers from 1, in the order of A.val
  // [neq] position of each equation (by its number inside MUMPS) in the elimination
  std::vector<MUMPS_INT> perm;
  RealVec x;                         // [neq] right-hand side and solution, numbered as inside MUMPS
  // several ranks: [neq] 1/sqrt of the diagonal; [A.val] what MUMPS gets, scaled by it
  RealVec scale, a;
  // divided model: right-hand side in the rows that belong to this rank, and their equations from 1; the
  // solution where MUMPS leaves it, and its equations from 1
  std::vector<MUMPS_INT> right_row, left_row;
  RealVec right, left;
  // that the lists below are for; [ranks] positions in left of what a rank has, equations that come from it
  std::vector<MUMPS_INT> known;
  std::vector<IntVec> give, take;
};

namespace {

enum Job { JOB_OPEN = -1, JOB_CLOSE = -2, JOB_ANALYSE = 1, JOB_FACTOR = 2, JOB_BACK = 3 };

enum Order { ORDER_GIVEN = 1, ORDER_AMF = 2, ORDER_CHOOSE = 7 };      // ICNTL(7)

// percent of workspace above the estimate of MUMPS: at first, and after doublings  (no test)
const int RELAX         = 20;
const int RELAX_MOST    = 640;
// relative to the norm of A scaled to unit diagonal  (test: Solve.NullPivotsAreFixed, Solve.SingularIsTold)
const double NULL_PIVOT = 1e-12;

// numbering as in the manual of MUMPS
MUMPS_INT& icntl(MumpsData& m, int i) { return m.id.icntl[i - 1]; }
double& cntl(MumpsData& m, int i) { return m.id.cntl[i - 1]; }
int infog(const MumpsData& m, int i) { return m.id.infog[i - 1]; }

// Is there memory for the factors on all ranks? part: fraction of the estimate of the analysis
bool memory_there(const MumpsData& m, double part)
{
  const bool room = solve_room(part * m.id.info[14]);
  return !(m.shared ? comm_allreduce_max(!room) : !room);
}

// equation of a zero pivot: of the first one that must not be fixed, else of the first one
int zero_pivot(const Solver& s, const MumpsData& m, int dim)
{
  int first = -1;
  for (int k = 0; k < infog(m, 28); ++k) {
    const int row = (m.id.pivnul_list[k] - 1) / dim, component = (m.id.pivnul_list[k] - 1) % dim;
    const int I   = static_cast<int>(std::find(m.number.begin(), m.number.end(), row) - m.number.begin());
    const bool fixed = pivot_fixed(s, I);
    if (k == 0 || !fixed) first = I * dim + component;
    if (!fixed) break;
  }
  return first;
}

// the same for a divided model: the equation on this rank, on ranks without it the last equation plus one;
// all ranks receive whether it is fixed, and its number over all ranks
int zero_pivot_of_all(const Solver& s, const MumpsData& m, int dim, bool& fixed, int& number)
{
  const int count = infog(m, 28), nrow = static_cast<int>(m.number.size());
  RealVec list(count, 0.0);                                  // rank 0 has it
  if (comm_rank() == 0) list.assign(m.id.pivnul_list, m.id.pivnul_list + count);
  comm_bcast(list.data(), count);
  std::unordered_map<int, int> row;
  for (int I = 0; I < nrow; ++I) row[m.number[I]] = I;
  int wrong = count;                                         // the first one that must not be fixed
  for (int k = count - 1; k >= 0; --k) {
    const auto found = row.find((static_cast<int>(list[k]) - 1) / dim);
    if (found != row.end() && !pivot_fixed(s, found->second)) wrong = k;
  }
  wrong = -comm_allreduce_max(-wrong);
  fixed = wrong == count;
  const int pivot  = static_cast<int>(list[fixed ? 0 : wrong]) - 1;
  const auto found = row.find(pivot / dim);
  const bool here  = found != row.end();
  number = comm_allreduce_max(here ? s.data->pattern.numbers.number[found->second] * dim + pivot % dim : -1);
  return here ? found->second * dim + pivot % dim : nrow * dim;
}

int call(MumpsData& m, Job job)
{
  m.id.job = job;
  dmumps_c(&m.id);
  return infog(m, 1);
}

// INFOG(1), INFOG(2) in words with a remedy; status of the failure
Status explain(Solver& s)
{
  const MumpsData& m = *s.data->mumps;
  const int code = infog(m, 1), detail = infog(m, 2);
  const char* words = "unexpected; see the manual of MUMPS for this code";
  switch (code) {
    case -2: words = "wrong number of entries"; break;
    case -4: words = "the ordering of the equations is not a permutation"; break;
    case -6: return solve_fail(s, SOLVER_SINGULAR, "the matrix is structurally singular (rank %d of %d): "
                               "some equations have no stiffness; check the supports", detail, m.id.n);
    case -10:
      return solve_fail(s, SOLVER_SINGULAR,
                        "the matrix is singular (zero pivot after %d of %d equations): a rigid-body motion "
                        "or mechanism is not constrained; check the supports",
                        detail, m.id.n);
    case -5: case -7: case -13: case -22: case -23:
      words = "not enough memory: use a coarser mesh, more ranks on more machines, or a machine with more "
              "memory";
      break;
    case -8: case -9: case -11: case -12: case -14: case -15: case -17: case -18: case -20:
      words = "the workspace remained too small after several enlargements: the matrix is ill-conditioned; "
              "check the largest penalties and parts that are nearly unsupported";
      break;
    case -19: words = "not enough memory: a memory limit is set"; break;
    case -16: words = "wrong number of equations"; break;
    case -51: case -52: words = "the problem is too large for an ordering with 32-bit integers: "
                                "use MUMPS and METIS with 64-bit integers"; break;
    case -90: words = "out of core: writing failed; check the free disk space"; break;
    default: break;
  }
  return solve_fail(s, SOLVER_FAILED, "MUMPS stopped with INFOG(1) = %d, INFOG(2) = %d: %s", code, detail,
                    words);
}

bool workspace_too_small(int code) { return code == -8 || code == -9; }

// Equation numbers of all numbers of A.val, so that MUMPS reads A.val itself. The upper half of
// diagonal blocks gets the number 0: MUMPS ignores entries out of range (and warns, INFOG(1) = 1).
void number_entries(MumpsData& m, const SysMatrix& A)
{
  const int D = A.dim;
  m.irn.resize(A.col.size() * D * D);
  m.jcn.resize(m.irn.size());
  size_t entry = 0;
  for (int I = 0; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1]; ++k)
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j, ++entry) {
          const bool upper = A.col[k] == I && j > i;
          m.irn[entry]     = upper ? 0 : m.number[I] * D + i + 1;
          m.jcn[entry]     = upper ? 0 : m.number[A.col[k]] * D + j + 1;
        }
}

// several ranks: each passes its entries, and MUMPS sums them
void give_entries(MumpsData& m)
{
  const MUMPS_INT8 n = static_cast<MUMPS_INT8>(m.irn.size());
  if (!m.shared) {
    m.id.nnz = n;
    m.id.irn = m.irn.data();
    m.id.jcn = m.jcn.data();
    return;
  }
  icntl(m, 18)  = 3;
  m.id.nnz_loc  = n;
  m.id.irn_loc  = m.irn.data();
  m.id.jcn_loc  = m.jcn.data();
}

// values scaled to unit diagonal; on one rank MUMPS does so itself, which it cannot
// for entries of several ranks
void scale_values(MumpsData& m, const SysMatrix& A)
{
  const int D = A.dim;
  sys_diagonal(A, m.scale);
  for (double& d : m.scale) d = d != 0.0 ? 1.0 / std::sqrt(std::fabs(d)) : 1.0;
  m.a = A.val;
  double* a = m.a.data();
  for (int I = 0; I < A.nrow; ++I)
    for (int k = A.off[I]; k < A.off[I + 1]; ++k)
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) *a++ *= m.scale[I * D + i] * m.scale[A.col[k] * D + j];
}

void give_values(MumpsData& m, const SysMatrix& A)
{
  if (!m.shared) {
    m.id.a = const_cast<double*>(A.val.data());      // MUMPS only reads it
    return;
  }
  scale_values(m, A);
  m.id.a_loc = m.a.data();
}

// ---------------------------------------------------------------------------
// open_instance : an instance of MUMPS on all ranks, or on this one alone (first_only), with the first
// analysis.
// MPI must stay open until mumps_close.
//
// What differs from the defaults of MUMPS, with the reason:
//   ICNTL(6), (12)       no maximal transversal, no compressed ordering: stiffness has a strong diagonal
//   ICNTL(8) = 1         scaling to unit diagonal, cheaper than the default, and a zero pivot then
//                        means the same in soft and in stiff parts; several ranks: scale_values
//   ICNTL(10) = 0        no refinement: Newton corrects
//   ICNTL(13) = 1        no ScaLAPACK at the root: it would hide the number of negative pivots
//   ICNTL(24), CNTL(3)   zero pivots are detected, and are an error here. Free bodies of 40 x 30 to
//                        400 x 160 quadrilaterals have pivots of 3e-14 to 7e-13 by rounding, measured.
// The pivot threshold CNTL(1) stays at 0.01: smaller ones are no faster.
// ---------------------------------------------------------------------------
void open_instance(Solver& s)
{
  s.data->mumps = std::make_shared<MumpsData>();
  MumpsData& m  = *s.data->mumps;
  std::memset(&m.id, 0, sizeof m.id);
  m.id.sym          = 2;      // symmetric, indefinite allowed
  m.id.par          = 1;      // rank 0 works too
  m.shared          = comm_size() > 1 && !s.data->first_only;
  m.id.comm_fortran = comm_fortran(!s.data->first_only);
  const int code    = call(m, JOB_OPEN);
  MPFE_CHECK(code == 0, "MUMPS did not open");
  for (int i = 1; i <= 3; ++i) icntl(m, i) = -1;    // no output
  icntl(m, 4)  = 0;
  icntl(m, 6)  = 0;
  icntl(m, 8)  = m.shared ? 0 : 1;
  icntl(m, 10) = 0;
  icntl(m, 12) = 1;
  icntl(m, 13) = 1;
  icntl(m, 14) = RELAX;
  icntl(m, 24) = 1;
  cntl(m, 3)   = NULL_PIVOT;
}

// ---- divided model ---------------------------------------------------------

// rank 0 has numbered the rows of all ranks: each receives the numbers of its rows
void scatter_numbers(MumpsData& m, const SysMatrix& A, const RowNumbers& rows)
{
  std::vector<IntVec> to(comm_size());
  if (comm_rank() == 0)
    for (int r = 0; r < comm_size(); ++r)
      to[r].assign(m.number.begin() + rows.first[r], m.number.begin() + rows.first[r + 1]);
  const IntVec own = comm_exchange(to)[0];
  m.number.assign(A.nrow, -1);
  for (int I = 0, k = 0; I < A.nrow; ++I)
    if (A.halo.owner[I] == comm_rank()) m.number[I] = own[k++];
  halo_copy(A.halo, 1, m.number);
  m.right_row.clear();
  m.known.clear();
  m.give.clear();
  for (int I = 0; I < A.nrow; ++I)
    for (int i = 0; i < A.dim && A.halo.owner[I] == comm_rank(); ++i)
      m.right_row.push_back(m.number[I] * A.dim + i + 1);
  m.right.resize(m.right_row.size());
}

// The ranks that need the equations of the solution here:
// for each equation one rank collects who needs it and who has it
void find_takers(MumpsData& m, int dim)
{
  const int ranks = comm_size(), piece = m.id.n / ranks + 1, nrow = static_cast<int>(m.number.size());
  std::vector<IntVec> need(ranks), have(ranks);
  std::unordered_map<int, int> here, position;
  for (int I = 0; I < nrow; ++I)
    for (int i = 0; i < dim; ++i) {
      const int e = m.number[I] * dim + i;
      need[e / piece].push_back(e);
      here[e] = I * dim + i;
    }
  for (size_t k = 0; k < m.left_row.size(); ++k) {
    const int e = m.left_row[k] - 1;
    have[e / piece].push_back(e);
    position[e] = static_cast<int>(k);
  }
  need = comm_exchange(need);
  have = comm_exchange(have);
  IntVec holder(piece, -1);
  for (int r = 0; r < ranks; ++r)
    for (int e : have[r]) holder[e % piece] = r;
  std::vector<IntVec> send(ranks);                           // equation, rank that needs it
  for (int r = 0; r < ranks; ++r)
    for (int e : need[r])
      if (holder[e % piece] >= 0) send[holder[e % piece]].insert(send[holder[e % piece]].end(), {e, r});
  m.give.assign(ranks, IntVec());
  std::vector<IntVec> name(ranks);
  for (const IntVec& list : comm_exchange(send))
    for (size_t k = 0; k < list.size(); k += 2) {
      m.give[list[k + 1]].push_back(position[list[k]]);
      name[list[k + 1]].push_back(list[k]);
    }
  m.take = comm_exchange(name);
  for (IntVec& list : m.take)
    for (int& e : list) e = here[e];
}

// right-hand side and solution are distributed; no vector has the size of the whole system
Status back_divided(Solver& s, MumpsData& m, double* x)
{
  const int D = s.data->pattern.dim, ranks = comm_size(), nrow = static_cast<int>(m.number.size());
  const IntVec& owner = s.data->pattern.halo.owner;
  size_t next = 0;
  for (int I = 0; I < nrow; ++I)
    for (int i = 0; i < D && owner[I] == comm_rank(); ++i)
      m.right[next++] = m.scale[I * D + i] * x[I * D + i];
  icntl(m, 20)   = 10;
  icntl(m, 21)   = 1;
  m.id.nrhs      = 1;
  m.id.nloc_rhs  = static_cast<MUMPS_INT>(m.right.size());
  m.id.lrhs_loc  = std::max<MUMPS_INT>(1, m.id.nloc_rhs);
  m.id.irhs_loc  = m.right_row.data();
  m.id.rhs_loc   = m.right.data();
  m.id.lsol_loc  = std::max<MUMPS_INT>(1, m.id.info[22]);
  m.left.resize(m.id.lsol_loc);
  m.left_row.assign(m.id.lsol_loc, 0);
  m.id.sol_loc   = m.left.data();
  m.id.isol_loc  = m.left_row.data();
  if (call(m, JOB_BACK) < 0) return explain(s);
  m.left_row.resize(m.id.info[22]);
  // delayed pivots have moved to other ranks
  if (comm_allreduce_max(static_cast<int>(m.give.empty() || m.known != m.left_row))) {
    find_takers(m, D);
    m.known = m.left_row;
  }
  std::vector<RealVec> to(ranks);
  for (int r = 0; r < ranks; ++r)
    for (int k : m.give[r]) to[r].push_back(m.left[k]);
  const std::vector<RealVec> from = comm_exchange(to);
  for (int r = 0; r < ranks; ++r)
    for (size_t k = 0; k < m.take[r].size(); ++k) x[m.take[r][k]] = m.scale[m.take[r][k]] * from[r][k];
  return STATUS_OK;
}

}  // namespace

// ---------------------------------------------------------------------------
// mumps_analyse : numbering, order of elimination, symbolic factorisation
//
// Inside MUMPS block rows are numbered by reverse Cuthill-McKee: neighbours in space are close in memory, and
// minimum fill breaks its ties well. Then minimum fill of MUMPS for dim <= 2 (factors as small as with nested
// dissection in a fifth of the time), nested dissection of METIS in 3D (half the work or less) and with more
// than two ranks (a wide tree; two ranks were no faster with it). Each rank passes its entries; rank 0 orders
// the whole pattern.
// ---------------------------------------------------------------------------
Status mumps_analyse(Solver& s, const SysMatrix& A)
{
  if (!s.data->mumps) open_instance(s);
  MumpsData& m = *s.data->mumps;
  const SysMatrix collected = m.shared ? sys_collect(A, false) : SysMatrix();
  const SysMatrix& whole    = m.shared ? collected : A;
  m.parts      = sys_shared(A);
  m.number     = order_rcm(whole);
  const IntVec number = m.parts ? m.number : IntVec();     // of the whole matrix, for perm
  if (m.parts) scatter_numbers(m, A, s.data->pattern.numbers);
  else if (m.shared) comm_allgatherv(m.number);            // the others have none
  number_entries(m, A);
  icntl(m, 7)  = ORDER_AMF;
  const bool dissect = A.dim == 3 || (m.shared && comm_size() > 2);
#ifdef MPFE_METIS
  if (dissect) {
    const IntVec pos = order_metis(whole);
    const IntVec& number_of = m.parts ? number : m.number;
    m.perm.resize(whole.nrow * A.dim);
    for (int I = 0; I < whole.nrow; ++I)
      for (int i = 0; i < A.dim; ++i) m.perm[number_of[I] * A.dim + i] = pos[I] * A.dim + i + 1;
    m.id.perm_in = m.perm.data();
    icntl(m, 7)  = ORDER_GIVEN;
  }
#else
  if (dissect) icntl(m, 7) = ORDER_CHOOSE;
#endif
  m.id.n       = m.parts ? s.data->pattern.numbers.first.back() * A.dim : A.neq();
  give_entries(m);
  icntl(m, 14) = RELAX;
  if (!m.parts) m.x.resize(A.neq());
  if (call(m, JOB_ANALYSE) < 0) return explain(s);
  s.flops_ahead = m.id.rinfog[0];
  return STATUS_OK;
}

// ---------------------------------------------------------------------------
// mumps_factor : L D L^T of the present values
//
//   status  SOLVER_SINGULAR: zero pivot, unless the solver may fix it; SOLVER_FAILED: see the message
// ---------------------------------------------------------------------------
Status mumps_factor(Solver& s, const SysMatrix& A)
{
  MumpsData& m = *s.data->mumps;
  give_values(m, A);
  int code = -8;
  for (double part = 1.0; workspace_too_small(code) && icntl(m, 14) <= RELAX_MOST; part *= 2.0) {
    if (!memory_there(m, part))
      return solve_fail(
          s, SOLVER_FAILED,
          "not enough memory: the factors need %.0f MB, more than the machine or a memory limit (ulimit) "
          "allows; use a coarser mesh, more ranks on more machines, or a machine with more memory",
          part * m.id.infog[15]);
    code = call(m, JOB_FACTOR);
    if (workspace_too_small(code)) icntl(m, 14) *= 2;
  }
  if (code < 0) return explain(s);

  s.flops     = m.id.rinfog[2];
  s.memory_mb = infog(m, 19);
  s.data->cost.factor_entries = infog(m, 29) < 0 ? -1e6 * infog(m, 29) : infog(m, 29);
  s.negative  = infog(m, 12);
  if (infog(m, 28) > 0) {
    bool fixed   = false;
    int equation = 0;                                      // PIVNUL_LIST: rank 0
    if (m.parts) {
      s.zero_equation = zero_pivot_of_all(s, m, A.dim, fixed, equation);
    } else {
      if (comm_rank() == 0) equation = zero_pivot(s, m, A.dim);
      if (m.shared) equation = comm_bcast(equation);
      s.zero_equation = equation;
      fixed = pivot_fixed(s, equation / A.dim);
    }
    const int I = equation / A.dim, component = equation % A.dim;
    solve_fail(s, SOLVER_SINGULAR, "%d zero pivots, the first in equation %d (block row %d, component %d): a "
               "rigid-body motion or mechanism is not constrained; check the supports",
               infog(m, 28), equation + 1, I + 1, component + 1);
    if (!fixed) return SOLVER_SINGULAR;
    s.fixed_null_pivots += infog(m, 28);
  }
  return STATUS_OK;
}

Status mumps_back(Solver& s, double* x, int count)
{
  MumpsData& m = *s.data->mumps;
  if (m.parts) return back_divided(s, m, x);
  const int D = s.data->pattern.dim, nrow = static_cast<int>(m.number.size());
  const size_t n = static_cast<size_t>(nrow) * D;
  m.x.resize(n * count);
  for (int k = 0; k < count; ++k)
    for (int I = 0; I < nrow; ++I)
      for (int i = 0; i < D; ++i)
        m.x[k * n + m.number[I] * D + i] = (m.scale.empty() ? 1.0 : m.scale[I * D + i]) *
                                           x[k * n + I * D + i];
  m.id.nrhs = count;
  m.id.lrhs = m.id.n;
  m.id.rhs  = m.x.data();
  if (call(m, JOB_BACK) < 0) return explain(s);
  if (m.shared) comm_bcast(m.x.data(), m.id.n * count);
  for (int k = 0; k < count; ++k)
    for (int I = 0; I < nrow; ++I)
      for (int i = 0; i < D; ++i)
        x[k * n + I * D + i] = (m.scale.empty() ? 1.0 : m.scale[I * D + i]) *
                               m.x[k * n + m.number[I] * D + i];
  return STATUS_OK;
}

double mumps_memory(const Solver& s)
{
  const MumpsData& m = *s.data->mumps;
  return static_cast<double>((m.irn.capacity() + m.jcn.capacity() + m.perm.capacity() + m.number.capacity()) *
                             sizeof(MUMPS_INT)) +
         static_cast<double>((m.a.capacity() + m.left.capacity() + m.right.capacity()) * sizeof(double));
}

double mumps_factors_mb(const Solver& s) { return s.data->mumps ? s.data->mumps->id.info[15] : 0.0; }

void mumps_close(Solver& s)
{
  if (!s.data->mumps) return;
  call(*s.data->mumps, JOB_CLOSE);
  s.data->mumps.reset();
}

#endif
