#include "solve/solve_data.h"

#ifdef MPFE_CHOLMOD

#include <cholmod.h>
#include <omp.h>

struct ChmData {
  cholmod_common common;
  cholmod_factor* L = nullptr;
  cholmod_dense *X = nullptr, *Y = nullptr, *E = nullptr;      // solution and workspace of the last solution
  // for chm_rough: columns of L from the diagonal on, the diagonal inverted; empty: not formed yet
  std::vector<float> rough;
  RealVec x, w;                // [n]; of a supernode
  ChmData();
  ~ChmData();
  ChmData(const ChmData&) = delete;
  ChmData& operator=(const ChmData&) = delete;
};

// Differences from the defaults of CHOLMOD: always supernodal, ordering by AMD only. METIS takes five to ten
// times as long for factors that are at best a few percent smaller (doc/benchmarks.md)
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

// right-hand sides solved together: more are no cheaper; time only  (no test)
const int TOGETHER = 16;

// CHOLMOD starts four OpenMP threads in each supernode, whatever the user has set; they make the
// factorisation 1.5 times as expensive
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

// Supernode of L: columns first to first + ncol, on rows row[0 ... nrow), the first ncol of which are its own
struct Supernode {
  int first, ncol, nrow;
  const int* row;
  size_t start;                // of its values in L.x, column by column
};

Supernode supernode(const cholmod_factor& L, size_t s)
{
  const int *first = static_cast<int*>(L.super), *rows = static_cast<int*>(L.pi),
            *start = static_cast<int*>(L.px);
  return {first[s], first[s + 1] - first[s], rows[s + 1] - rows[s], static_cast<int*>(L.s) + rows[s],
          static_cast<size_t>(start[s])};
}

// are all pivots clearly positive?
bool clearly_positive(const cholmod_factor& L, const SysMatrix& A)
{
  RealVec diagonal;
  sys_diagonal(A, diagonal);
  const int* equation = static_cast<int*>(L.Perm);
  const double* x     = static_cast<double*>(L.x);
  for (size_t s = 0; s < L.nsuper; ++s) {
    const Supernode n = supernode(L, s);
    for (int k = 0; k < n.ncol; ++k) {
      const double l = x[n.start + static_cast<size_t>(k) * (n.nrow + 1)];
      if (!(l * l > ZERO_PIVOT * diagonal[equation[n.first + k]])) return false;
    }
  }
  return true;
}

void make_rough(const cholmod_factor& L, size_t entries, std::vector<float>& rough)
{
  rough.reserve(entries);
  const double* x = static_cast<double*>(L.x);
  for (size_t s = 0; s < L.nsuper; ++s) {
    const Supernode n = supernode(L, s);
    for (int j = 0; j < n.ncol; ++j) {
      const double* column = x + n.start + static_cast<size_t>(j) * n.nrow;
      rough.push_back(static_cast<float>(1.0 / column[j]));
      rough.insert(rough.end(), column + j + 1, column + n.nrow);
    }
  }
}

// y += a x
void add(int n, double a, const float* __restrict x, double* __restrict y)
{
  for (int k = 0; k < n; ++k) y[k] += a * static_cast<double>(x[k]);
}

// x y, in reverse order: L is read from memory as one stream
double product(int n, const float* __restrict x, const double* __restrict y)
{
  const int LANES = 16;
  double part[LANES] = {};
  int k = n;
  for (; k >= LANES; k -= LANES)
    for (int l = 0; l < LANES; ++l) part[l] += static_cast<double>(x[k - LANES + l]) * y[k - LANES + l];
  for (int l = 0; l < k; ++l) part[l] += static_cast<double>(x[l]) * y[l];
  double sum = 0.0;
  for (double p : part) sum += p;
  return sum;
}

// out of memory: SOLVER_FAILED; else CHOLMOD cannot factorise this matrix: SOLVER_SINGULAR
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
//   status  SOLVER_FAILED: memory; SOLVER_SINGULAR: too large for CHOLMOD (integers of 32 bits)
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
// chm_factor : L L^T of the present values                                                 (8.10)
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
  c.rough.clear();
  cholmod_sparse* S = upper_triangle(A, true, c.common);
  if (S) {
    const OneThread one;
    cholmod_factorize(S, c.L, &c.common);
  }
  cholmod_free_sparse(&S, &c.common);
  if (c.common.status != CHOLMOD_OK || !clearly_positive(*c.L, A)) return refuse(s);
  s.flops     = c.common.fl;
  s.data->cost.factor_entries = c.common.lnz;
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

// ---------------------------------------------------------------------------
// chm_rough : x = A^-1 x by L in single precision, which halves the memory traffic                    (8.15)
// ---------------------------------------------------------------------------
Status chm_rough(Solver& s, double* x)
{
  ChmData& c              = *s.data->chm;
  const cholmod_factor& L = *c.L;
  const int* equation     = static_cast<int*>(L.Perm);
  if (c.rough.empty()) {
    const double mb = 1e-6 * c.common.lnz * sizeof(float);
    if (!solve_room(mb)) return chm_back(s, x, 1);
    make_rough(L, static_cast<size_t>(c.common.lnz), c.rough);
    s.memory_mb += mb;
  }
  c.x.resize(L.n);
  c.w.resize(L.n);
  double* w = c.w.data();
  for (size_t i = 0; i < L.n; ++i) c.x[i] = x[equation[i]];
  const float* l = c.rough.data();
  for (size_t k = 0; k < L.nsuper; ++k) {
    const Supernode n = supernode(L, k);
    std::copy_n(&c.x[n.first], n.ncol, w);
    std::fill(w + n.ncol, w + n.nrow, 0.0);
    for (int j = 0; j < n.ncol; ++j) {
      w[j] *= static_cast<double>(*l++);
      add(n.nrow - j - 1, -w[j], l, w + j + 1);
      l += n.nrow - j - 1;
    }
    std::copy_n(w, n.ncol, &c.x[n.first]);
    for (int i = n.ncol; i < n.nrow; ++i) c.x[n.row[i]] += w[i];
  }
  for (size_t k = L.nsuper; k-- > 0;) {
    const Supernode n = supernode(L, k);
    for (int i = 0; i < n.nrow; ++i) w[i] = c.x[n.row[i]];
    for (int j = n.ncol - 1; j >= 0; --j) {
      l -= n.nrow - j - 1;
      w[j] -= product(n.nrow - j - 1, l, w + j + 1);
      w[j] *= static_cast<double>(*--l);
    }
    std::copy_n(w, n.ncol, &c.x[n.first]);
  }
  for (size_t i = 0; i < L.n; ++i) x[equation[i]] = c.x[i];
  return STATUS_OK;
}

#else

Status chm_analyse(Solver&, const SysMatrix&) { return SOLVER_SINGULAR; }
Status chm_factor(Solver&, const SysMatrix&) { return SOLVER_SINGULAR; }
Status chm_back(Solver&, double*, int) { return SOLVER_FAILED; }
Status chm_rough(Solver&, double*) { return SOLVER_FAILED; }

#endif
