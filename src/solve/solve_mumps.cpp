#ifdef MPFE_MUMPS

#include <dmumps_c.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "base/comm.h"
#include "base/log.h"
#include "solve/solve_data.h"

struct MumpsData {
  DMUMPS_STRUC_C id;
  bool shared = false;               // all ranks work together
  IntVec number;                     // [nrow] number of each block row inside MUMPS
  std::vector<MUMPS_INT> irn, jcn;   // [col.size()*dim*dim] equation numbers from 1, in the order of A.val
  // [neq] place of each equation (its number inside MUMPS) in the elimination
  std::vector<MUMPS_INT> perm;
  RealVec x;                         // [neq] right-hand side and solution, numbered as inside MUMPS
  // several ranks: [neq] 1/sqrt of the diagonal; [A.val] what MUMPS gets, scaled by it
  RealVec scale, a;
};

namespace {

enum Job { JOB_OPEN = -1, JOB_CLOSE = -2, JOB_ANALYSE = 1, JOB_FACTOR = 2, JOB_BACK = 3 };

enum Order { ORDER_GIVEN = 1, ORDER_AMF = 2, ORDER_CHOOSE = 7 };      // ICNTL(7)

const int RELAX         = 20;        // percent of workspace above the estimate, at first
const int RELAX_MOST    = 640;
const double ZERO_PIVOT = 1e-12;     // relative to the norm of A scaled to unit diagonal

// the numbering of the manual of MUMPS
MUMPS_INT& icntl(MumpsData& m, int i) { return m.id.icntl[i - 1]; }
double& cntl(MumpsData& m, int i) { return m.id.cntl[i - 1]; }
int infog(const MumpsData& m, int i) { return m.id.infog[i - 1]; }

// Is there room for the factors on all ranks? part: of what the analysis has found
bool memory_there(const MumpsData& m, double part)
{
  const bool room = solve_room(part * m.id.info[14]);
  return !(m.shared ? comm_allreduce_max(!room) : !room);
}

// equation of a zero pivot: of the first one that may not be fixed, else of the first one
int zero_pivot(const MumpsData& m, int dim, int null_pivot_row)
{
  int first = -1;
  for (int k = 0; k < infog(m, 28); ++k) {
    const int row = (m.id.pivnul_list[k] - 1) / dim, component = (m.id.pivnul_list[k] - 1) % dim;
    const int I   = static_cast<int>(std::find(m.number.begin(), m.number.end(), row) - m.number.begin());
    if (k == 0 || I < null_pivot_row) first = I * dim + component;
    if (I < null_pivot_row) break;
  }
  return first;
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
// diagonal blocks gets the number 0: MUMPS leaves entries out of range away (and warns, INFOG(1) = 1).
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

// several ranks: each gives its entries, and MUMPS sums them
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

// scaled to unit diagonal: what one rank leaves to MUMPS, which cannot do so with entries of several
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
//   ICNTL(24), CNTL(3)   zero pivots are looked for, and are an error here. Free bodies of 40 x 30 to
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
  cntl(m, 3)   = ZERO_PIVOT;
}

}  // namespace

// ---------------------------------------------------------------------------
// mumps_analyse : numbering, order of elimination, symbolic factorisation
//
// Inside MUMPS block rows are numbered by reverse Cuthill-McKee: near in space is near in memory, and
// minimum fill breaks its ties well. Then minimum fill of MUMPS for dim <= 2 (as good a factor as nested
// dissection in a fifth of the time), nested dissection of METIS in 3D (half the work and less) and with
// more than two ranks (a wide tree; two were no faster with it). These have their entries each; rank 0 orders
// the whole pattern.
// ---------------------------------------------------------------------------
Status mumps_analyse(Solver& s, const SysMatrix& A)
{
  if (!s.data->mumps) open_instance(s);
  MumpsData& m = *s.data->mumps;
  const SysMatrix collected = m.shared ? sys_collect(A, false) : SysMatrix();
  const SysMatrix& whole    = m.shared ? collected : A;
  m.number     = order_rcm(whole);
  if (m.shared) comm_allgatherv(m.number);                 // the others have none
  number_entries(m, A);
  icntl(m, 7)  = ORDER_AMF;
  const bool dissect = A.dim == 3 || (m.shared && comm_size() > 2);
#ifdef MPFE_METIS
  if (dissect) {
    const IntVec pos = order_metis(whole);
    m.perm.resize(A.neq());
    for (int I = 0; I < whole.nrow; ++I)
      for (int i = 0; i < A.dim; ++i) m.perm[m.number[I] * A.dim + i] = pos[I] * A.dim + i + 1;
    m.id.perm_in = m.perm.data();
    icntl(m, 7)  = ORDER_GIVEN;
  }
#else
  if (dissect) icntl(m, 7) = ORDER_CHOOSE;
#endif
  m.id.n       = A.neq();
  give_entries(m);
  icntl(m, 14) = RELAX;
  m.x.resize(A.neq());
  if (call(m, JOB_ANALYSE) < 0) return explain(s);
  s.flops_ahead = m.id.rinfog[0];
  return STATUS_OK;
}

// ---------------------------------------------------------------------------
// mumps_factor : L D L^T of today's values
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
  s.negative  = infog(m, 12);
  if (infog(m, 28) > 0) {
    int equation = comm_rank() == 0 ? zero_pivot(m, A.dim, s.null_pivot_row) : 0;   // PIVNUL_LIST: rank 0
    if (m.shared) equation = comm_bcast(equation);
    const int I = equation / A.dim, component = equation % A.dim;
    s.zero_equation = equation;
    solve_fail(s, SOLVER_SINGULAR, "%d zero pivots, the first in equation %d (block row %d, component %d): a "
               "rigid-body motion or mechanism is not constrained; check the supports",
               infog(m, 28), equation + 1, I + 1, component + 1);
    if (s.null_pivot_row < 0 || I < s.null_pivot_row) return SOLVER_SINGULAR;
    s.fixed_null_pivots += infog(m, 28);
  }
  return STATUS_OK;
}

Status mumps_back(Solver& s, double* x, int count)
{
  MumpsData& m = *s.data->mumps;
  const int D = s.data->dim, nrow = static_cast<int>(m.number.size());
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
                             sizeof(MUMPS_INT));
}

void mumps_close(Solver& s)
{
  if (!s.data->mumps) return;
  call(*s.data->mumps, JOB_CLOSE);
  s.data->mumps.reset();
}

#endif
