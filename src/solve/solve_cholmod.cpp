#include "solve/solve_data.h"

#ifdef MPFE_CHOLMOD

#include <cholmod.h>
#include <omp.h>

#include "base/log.h"

struct ChmData {
  cholmod_common common;
  cholmod_factor* L = nullptr;
  cholmod_dense *X = nullptr, *Y = nullptr, *E = nullptr;      // solution and workspace of the last solution
  ChmData();
  ~ChmData();
  ChmData(const ChmData&) = delete;
  ChmData& operator=(const ChmData&) = delete;
};

// What differs from the defaults of CHOLMOD: always supernodal, and ordered by AMD alone. METIS takes five to
// ten times as long for factors that are at best a few percent smaller (doc/benchmarks.md)
ChmData::ChmData()
{
  cholmod_start(&common);
  common.print                      = 0;
  common.supernodal                 = CHOLMOD_SUPERNODAL;
  common.nmethods                   = 1;
  common.method[0].ordering         = CHOLMOD_AMD;
  common.quick_return_if_not_posdef = true;
}

ChmData::~ChmData()
{
  for (cholmod_dense** v : {&X, &Y, &E}) cholmod_free_dense(v, &common);
  cholmod_free_factor(&L, &common);
  cholmod_finish(&common);
}

namespace {

const double ZERO_PIVOT = 3e-12;     // of the diagonal of A in the same equation, as for the skyline
const int TOGETHER      = 16;        // right-hand sides at a time: more are no cheaper

// CHOLMOD asks OpenMP for four threads in each supernode, whatever the user has set; they make the
// factorisation half as dear again
struct OneThread {
  const int levels = omp_get_max_active_levels();
  OneThread() { omp_set_max_active_levels(0); }
  ~OneThread() { omp_set_max_active_levels(levels); }
  OneThread(const OneThread&) = delete;
  OneThread& operator=(const OneThread&) = delete;
};

// The equations of the lower triangle, row by row, are the columns of the upper one. Null: see common.status
cholmod_sparse* upper_triangle(const SysMatrix& A, bool values, cholmod_common& common)
{
  const int D          = A.dim;
  const size_t n       = static_cast<size_t>(A.neq());
  const size_t entries = A.col.size() * D * D - n * (D - 1) / 2;
  cholmod_sparse* S = cholmod_allocate_sparse(n, n, entries, true, true, 1,
                                              values ? CHOLMOD_REAL : CHOLMOD_PATTERN, &common);
  if (!S) return S;
  int *p = static_cast<int*>(S->p), *row = static_cast<int*>(S->i), next = 0;
  double* x = static_cast<double*>(S->x);
  for (int I = 0; I < A.nrow; ++I)
    for (int i = 0; i < D; ++i) {
      p[I * D + i] = next;
      for (int k = A.off[I]; k < A.off[I + 1]; ++k)
        for (int j = 0; j < (A.col[k] == I ? i + 1 : D); ++j, ++next) {
          row[next] = A.col[k] * D + j;
          if (values) x[next] = A.val[(static_cast<size_t>(k) * D + i) * D + j];
        }
    }
  p[n] = next;
  return S;
}

// are all pivots clearly positive?
bool clearly_positive(const cholmod_factor& L, const SysMatrix& A)
{
  RealVec diagonal;
  sys_diagonal(A, diagonal);
  const int *first = static_cast<int*>(L.super), *rows = static_cast<int*>(L.pi),
            *start = static_cast<int*>(L.px);
  const int* equation = static_cast<int*>(L.Perm);
  const double* x     = static_cast<double*>(L.x);
  for (size_t s = 0; s < L.nsuper; ++s)
    for (int k = 0; k < first[s + 1] - first[s]; ++k) {
      const double l = x[start[s] + static_cast<size_t>(k) * (rows[s + 1] - rows[s] + 1)];
      if (!(l * l > ZERO_PIVOT * diagonal[equation[first[s] + k]])) return false;
    }
  return true;
}

// memory: SOLVER_FAILED; else CHOLMOD is not for this matrix: SOLVER_SINGULAR
Status refuse(Solver& s)
{
  const ChmData& c = *s.data->chm;
  if (c.common.status != CHOLMOD_OUT_OF_MEMORY) return SOLVER_SINGULAR;
  const double mb = c.L ? static_cast<double>(c.L->xsize * sizeof(double)) / 1e6 : 0.0;
  return solve_fail(s, SOLVER_FAILED,
                    "not enough memory for CHOLMOD: the factors need %.0f MB; use a coarser mesh, or a "
                    "machine with more memory",
                    mb);
}

}  // namespace

// ---------------------------------------------------------------------------
// chm_analyse : order of elimination and supernodes
//
//   status  SOLVER_FAILED: memory; SOLVER_SINGULAR: CHOLMOD does not take it (integers of 32 bits)
// ---------------------------------------------------------------------------
Status chm_analyse(Solver& s, const SysMatrix& A)
{
  s.data->chm = std::make_shared<ChmData>();
  ChmData& c  = *s.data->chm;
  cholmod_sparse* S = upper_triangle(A, false, c.common);
  if (S) c.L = cholmod_analyze(S, &c.common);
  cholmod_free_sparse(&S, &c.common);
  if (!c.L) return refuse(s);
  s.flops_ahead = c.common.fl;
  return STATUS_OK;
}

// ---------------------------------------------------------------------------
// chm_factor : L L^T of today's values                                                     (8.10)
//
//   status  SOLVER_SINGULAR: a pivot is not clearly positive; SOLVER_FAILED: memory
// ---------------------------------------------------------------------------
Status chm_factor(Solver& s, const SysMatrix& A)
{
  ChmData& c = *s.data->chm;
  if (!solve_room(static_cast<double>(c.L->xsize * sizeof(double)) / 1e6)) {
    c.common.status = CHOLMOD_OUT_OF_MEMORY;
    return refuse(s);
  }
  cholmod_sparse* S = upper_triangle(A, true, c.common);
  if (S) {
    const OneThread one;
    cholmod_factorize(S, c.L, &c.common);
  }
  cholmod_free_sparse(&S, &c.common);
  if (c.common.status != CHOLMOD_OK || !clearly_positive(*c.L, A)) return refuse(s);
  s.flops     = c.common.fl;
  s.data->factor_entries = c.common.lnz;
  s.memory_mb = static_cast<double>(c.common.memory_inuse) / 1e6;
  return STATUS_OK;
}

// ---------------------------------------------------------------------------
// chm_back : x = A^-1 x for count right-hand sides, one after the other [count*neq]
// ---------------------------------------------------------------------------
Status chm_back(Solver& s, double* x, int count)
{
  ChmData& c     = *s.data->chm;
  const size_t n = c.L->n;
  for (int k = 0; k < count; k += TOGETHER) {
    cholmod_dense B{};
    B.nrow = B.d = n;
    B.ncol  = static_cast<size_t>(std::min(TOGETHER, count - k));
    B.nzmax = n * B.ncol;
    B.x     = x + k * n;
    B.xtype = CHOLMOD_REAL;
    B.dtype = CHOLMOD_DOUBLE;
    if (!cholmod_solve2(CHOLMOD_A, c.L, &B, nullptr, &c.X, nullptr, &c.Y, &c.E, &c.common)) return refuse(s);
    const double* from = static_cast<double*>(c.X->x);
    std::copy(from, from + B.nzmax, x + k * n);
  }
  return STATUS_OK;
}

#else

Status chm_analyse(Solver&, const SysMatrix&) { return SOLVER_SINGULAR; }
Status chm_factor(Solver&, const SysMatrix&) { return SOLVER_SINGULAR; }
Status chm_back(Solver&, double*, int) { return SOLVER_FAILED; }

#endif
