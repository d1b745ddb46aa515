#include "solve/solve_data.h"

#ifdef MPFE_PETSC

#include <climits>
#include <cmath>
#include <numeric>

#include "base/log.h"
#include "base/sort_once.h"
#include "solve/level_product.h"
#include "solve/petsc_load.h"

namespace {

// cost of new coarse matrices, in iterations: time only (doc/benchmarks.md, Algebraic multigrid)
// (test: Krylov.MultigridSeesSmoothModes)
const double SETUP_AGAIN = 10.0;

const Petsc* petsc = nullptr;

// use of a block of the lower triangle
enum Kind { AS_IT_IS, TRANSPOSED, DIAGONAL };

}  // namespace

struct AmgTarget {
  int first, stride;               // of its entries; from row to row
};

struct AmgExchange {               // several ranks: blocks of M that ranks send to one another
  std::vector<IntVec> to;          // [ranks] blocks that a rank needs, 3 k + Kind
  std::vector<AmgTarget> target;   // positions in the entries of the blocks received, rank by rank
  IntVec received;                 // [ranks] number of blocks received
};

struct AmgAge {                    // of the coarse matrices
  bool kept = false;               // they belong to an earlier matrix
  double digit = 0.0;              // iterations per digit when they were new
  double extra = 0.0;              // additional iterations since then
};

// A hierarchy of PETSc (GAMG). Its finest level uses the matrix and the incomplete factor of this program
struct AmgData {
  AmgData()                          = default;
  AmgData(const AmgData&)            = delete;
  AmgData& operator=(const AmgData&) = delete;
  ~AmgData();

  const SysMatrix* M = nullptr;    // present matrix: all rows, or the rows of this rank
  std::vector<float> val;          // its values, in single precision
  OwnBlock* own      = nullptr;    // several ranks
  const Cholesky* L  = nullptr;    // its incomplete factor
  IntVec off, col;                 // pattern for which the lists below are valid; several ranks: its checksum
  std::uint64_t pattern = 0;
  int nall = 0;                    // block rows of all ranks
  IntVec row;                      // [n] owned rows of M; the rows below
  IntVec block_off;                // [n+1]
  IntVec source;                   // [blocks of the rows] 2 k: block k of M, 2 k + 1: transposed
  IntVec number;                   // [blocks of the rows] column, numbered over all ranks
  AmgExchange blocks;
  IntVec entry_off, entry_col;     // the same for scalar equations
  RealVec entry;                   // their values, of the matrix with this stamp:
  long stamp = -1;
  Mat matrix = nullptr;            // of entry; its product is replaced by sys_multiply with M
  double level_bytes = 0.0;        // of the matrices of coarse levels in single precision
  PC multigrid = nullptr;
  Vec in = nullptr, out = nullptr;
  RealVec x, y;                    // [M.neq]
  RealVec r, z;                    // [n*dim] several ranks
  AmgAge age;
};

AmgData::~AmgData()
{
  if (!petsc) return;
  petsc->PCDestroy(&multigrid);
  petsc->MatDestroy(&matrix);
  for (Vec* v : {&in, &out}) petsc->VecDestroy(v);
}

namespace {

// blocks of both triangles, row by row, columns ascending
void list_blocks(const SysMatrix& M, const IntVec& number, AmgData& d)
{
  IntVec next(M.nrow + 1, 0);
  for (int I = 0; I < M.nrow; ++I)
    for (int k = M.off[I]; k < M.off[I + 1]; ++k) {
      ++next[I + 1];
      if (M.col[k] != I) ++next[M.col[k] + 1];
    }
  std::partial_sum(next.begin(), next.end(), next.begin());
  const IntVec first = next;
  std::vector<std::pair<int, int>> block(first.back());      // column, source
  for (int I = 0; I < M.nrow; ++I)
    for (int k = M.off[I]; k < M.off[I + 1]; ++k) {
      block[next[I]++] = {number[M.col[k]], 2 * k};
      if (M.col[k] != I) block[next[M.col[k]]++] = {number[I], 2 * k + 1};
    }
  d.block_off.assign(1, 0);
  for (int I : d.row) {
    std::sort(block.begin() + first[I], block.begin() + first[I + 1]);
    for (int k = first[I]; k < first[I + 1]; ++k) {
      d.number.push_back(block[k].first);
      d.source.push_back(block[k].second);
    }
    d.block_off.push_back(static_cast<int>(d.number.size()));
  }
}

// divided model: the blocks of owned rows, from all ranks that contribute to them
void list_blocks_of_all(const SysMatrix& M, const RowNumbers& rows, AmgData& d)
{
  const int ranks = comm_size(), first = rows.first[comm_rank()];
  const IntVec &number = rows.number, &owner = M.halo.owner;
  std::vector<std::vector<std::pair<int, int>>> name(ranks);
  d.blocks.to.assign(ranks, IntVec());
  const auto give = [&](int I, int J, int k, Kind kind) {
    d.blocks.to[owner[I]].push_back(3 * k + kind);
    name[owner[I]].emplace_back(number[I], number[J]);
  };
  for (int I = 0; I < M.nrow; ++I)
    for (int k = M.off[I]; k < M.off[I + 1]; ++k) {
      const int J = M.col[k];
      give(I, J, k, I == J ? DIAGONAL : AS_IT_IS);
      if (I != J) give(J, I, k, TRANSPOSED);
    }
  std::vector<IntVec> send(ranks);
  for (int r = 0; r < ranks; ++r)
    for (const auto& pair : name[r]) send[r].insert(send[r].end(), {pair.first - rows.first[r], pair.second});
  name.clear();
  const std::vector<IntVec> come = comm_exchange(send);
  send.clear();
  std::vector<std::pair<int, int>> all;                    // row here, column
  for (const IntVec& list : come)
    for (size_t k = 0; k < list.size(); k += 2) all.emplace_back(list[k], list[k + 1]);
  sort_once(all);
  const int n = static_cast<int>(d.row.size()), D = M.dim;
  MPFE_CHECK(n == rows.first[comm_rank() + 1] - first, "list_blocks_of_all: rows of this rank");
  d.block_off.assign(n + 1, 0);
  for (const auto& pair : all) {
    ++d.block_off[pair.first + 1];
    d.number.push_back(pair.second);
  }
  std::partial_sum(d.block_off.begin(), d.block_off.end(), d.block_off.begin());
  for (const IntVec& list : come) {
    d.blocks.received.push_back(static_cast<int>(list.size() / 2));
    for (size_t k = 0; k < list.size(); k += 2) {
      const int I = list[k], begin = d.block_off[I], end = d.block_off[I + 1];
      const auto at = std::lower_bound(d.number.begin() + begin, d.number.begin() + end, list[k + 1]);
      const int index = static_cast<int>(at - d.number.begin()) - begin;
      d.blocks.target.push_back({begin * D * D + index * D, (end - begin) * D});
    }
  }
}

void list_entries(int D, AmgData& d)
{
  d.entry_off.assign(1, 0);
  d.entry_col.reserve(d.number.size() * D * D);
  for (size_t n = 0; n < d.row.size(); ++n)
    for (int i = 0; i < D; ++i) {
      for (int k = d.block_off[n]; k < d.block_off[n + 1]; ++k)
        for (int j = 0; j < D; ++j) d.entry_col.push_back(d.number[k] * D + j);
      d.entry_off.push_back(static_cast<int>(d.entry_col.size()));
    }
  d.entry.resize(d.entry_col.size());
}

template <int D>
void fill_entries(const SysMatrix& M, AmgData& d)
{
  double* a = d.entry.data();
  for (size_t n = 0; n < d.row.size(); ++n)
    for (int i = 0; i < D; ++i)
      for (int k = d.block_off[n]; k < d.block_off[n + 1]; ++k, a += D) {
        const int block   = d.source[k] / 2;
        const double* b   = &M.val[static_cast<size_t>(block) * D * D];
        const bool turned = d.source[k] % 2 == 1, diagonal = M.col[block] == d.row[n] && !turned;
        for (int j = 0; j < D; ++j) a[j] = turned || (diagonal && j > i) ? b[j * D + i] : b[i * D + j];
      }
}

template <int D>
void add_entries(const double* block, const AmgTarget& t, AmgData& d)
{
  for (int i = 0; i < D; ++i)
    for (int j = 0; j < D; ++j) d.entry[static_cast<size_t>(t.first) + i * t.stride + j] += block[i * D + j];
}

// divided model: adds the contributions of all ranks, in the order of the ranks
template <int D>
void fill_entries_of_all(const SysMatrix& M, AmgData& d)
{
  const int ranks = comm_size(), me = comm_rank(), DD = D * D;
  std::vector<RealVec> send(ranks), from(ranks);
  double block[DD];
  const auto expand = [&](int code) {
    const double* b = &M.val[static_cast<size_t>(code / 3) * DD];
    const int kind  = code % 3;
    for (int i = 0; i < D; ++i)
      for (int j = 0; j < D; ++j)
        block[i * D + j] = kind == TRANSPOSED || (kind == DIAGONAL && j > i) ? b[j * D + i] : b[i * D + j];
  };
  for (int r = 0; r < ranks; ++r) {
    if (r == me) continue;
    for (int code : d.blocks.to[r]) {
      expand(code);
      send[r].insert(send[r].end(), block, block + DD);
    }
    from[r].resize(static_cast<size_t>(d.blocks.received[r]) * DD);
  }
  comm_exchange(send, from);
  std::fill(d.entry.begin(), d.entry.end(), 0.0);
  const AmgTarget* next = d.blocks.target.data();
  for (int r = 0; r < ranks; ++r) {
    for (size_t k = 0; k < from[r].size(); k += DD) add_entries<D>(&from[r][k], *next++, d);
    if (r != me) continue;
    for (int code : d.blocks.to[me]) {
      expand(code);
      add_entries<D>(block, *next++, d);
    }
  }
}

void fill_entries(AmgData& d)
{
  if (d.own) switch (d.M->dim) {
      case 1: return fill_entries_of_all<1>(*d.M, d);
      case 2: return fill_entries_of_all<2>(*d.M, d);
      case 3: return fill_entries_of_all<3>(*d.M, d);
    }
  switch (d.M->dim) {
    case 1: return fill_entries<1>(*d.M, d);
    case 2: return fill_entries<2>(*d.M, d);
    case 3: return fill_entries<3>(*d.M, d);
  }
  log_bug("fill_entries: blocks are 1 x 1, 2 x 2 or 3 x 3", __FILE__, __LINE__);
}

// translations and rotations of a rigid body at the rows of this rank, about the centre of all rows;
// positions [neq]: of all ranks; null: translations only
std::vector<RealVec> rigid_motions(const AmgData& d, const RealVec* positions)
{
  const int D = d.M->dim;
  const size_t n = d.row.size();
  std::vector<RealVec> motion(!positions ? D : D == 3 ? 6 : D == 2 ? 3 : 1, RealVec(n * D, 0.0));
  for (size_t l = 0; l < n; ++l)
    for (int i = 0; i < D; ++i) motion[i][l * D + i] = 1.0;
  if (!positions) return motion;
  double mean[3] = {0, 0, 0}, size = 0.0;
    for (size_t k = 0; k < positions->size(); ++k)
    mean[k % D] += (d.own ? d.own->once[k] : 1.0) * (*positions)[k] / d.nall;
  if (d.own) comm_sum(mean, 3);
  for (size_t k = 0; k < positions->size(); ++k)
    size = std::max(size, std::fabs((*positions)[k] - mean[k % D]));
  if (d.own) size = comm_allreduce_max(size);
  for (size_t l = 0; l < n; ++l) {
    const double* x = &(*positions)[static_cast<size_t>(d.row[l]) * D];
    for (int i = 1, m = D; i < D; ++i)
      for (int j = 0; j < i; ++j, ++m) {
        motion[m][l * D + i] = (x[j] - mean[j]) / size;
        motion[m][l * D + j] = -(x[i] - mean[i]) / size;
      }
  }
  return motion;
}

// ---- matrix products of this program instead of those of PETSc ------------

const char* const ATTACHED = "mpfe";

// data attached to a matrix of PETSc; null: none
template <class T>
T* attached(Mat matrix)
{
  PetscObject container = nullptr;
  void* data            = nullptr;
  petsc->PetscObjectQuery(reinterpret_cast<PetscObject>(matrix), ATTACHED, &container);
  if (container) petsc->PetscContainerGetPointer(reinterpret_cast<PetscContainer>(container), &data);
  return static_cast<T*>(data);
}

bool attach(Mat matrix, void* data, PetscErrorCode (*destroy)(void*))
{
  PetscContainer container = nullptr;
  const bool good = !petsc->PetscContainerCreate(MPI_COMM_SELF, &container) &&
                    !petsc->PetscContainerSetPointer(container, data) &&
                    !petsc->PetscContainerSetUserDestroy(container, destroy) &&
                    !petsc->PetscObjectCompose(reinterpret_cast<PetscObject>(matrix), ATTACHED,
                                               reinterpret_cast<PetscObject>(container));
  petsc->PetscContainerDestroy(&container);
  return good;
}

PetscErrorCode no_destroy(void*) { return 0; }
PetscErrorCode destroy_level(void* data)
{
  delete static_cast<LevelMatrix*>(data);
  return 0;
}

bool set_operation(Mat matrix, MatOperation operation, PetscErrorCode (*routine)(Mat, Vec, Vec))
{
  return !petsc->MatSetOperation(matrix, operation, reinterpret_cast<void (*)()>(routine));
}

template <class Product>
PetscErrorCode work_on(Vec from, Vec to, Product product)
{
  const double* x = nullptr;
  double* y       = nullptr;
  petsc->VecGetArrayRead(from, &x);
  petsc->VecGetArray(to, &y);
  product(x, y);
  petsc->VecRestoreArray(to, &y);
  petsc->VecRestoreArrayRead(from, &x);
  return 0;
}

// to = A from
PetscErrorCode level_mult(Mat matrix, Vec from, Vec to)
{
  const LevelMatrix& A = *attached<LevelMatrix>(matrix);
  return work_on(from, to, [&](const double* x, double* y) { level_multiply(A, x, false, y); });
}

// to = b + A from
PetscErrorCode level_mult_add(Mat matrix, Vec from, Vec b, Vec to)
{
  const LevelMatrix& A = *attached<LevelMatrix>(matrix);
  if (b != to) petsc->VecCopy(b, to);
  return work_on(from, to, [&](const double* x, double* y) { level_multiply(A, x, true, y); });
}

// to = A^T from
PetscErrorCode level_mult_transpose(Mat matrix, Vec from, Vec to)
{
  const LevelMatrix& A = *attached<LevelMatrix>(matrix);
  petsc->VecSet(to, 0.0);
  return work_on(from, to, [&](const double* x, double* y) { level_transposed(A, x, y); });
}

// replaces the products of a sequential matrix of PETSc, in blocks of rows x cols, by those of
// level_product.h if the blocks fit
bool take_products(Mat matrix, int rows, int cols, AmgData& d)
{
  LevelMatrix* A = attached<LevelMatrix>(matrix);
  if (!A) {
    A = new LevelMatrix;
    if (!attach(matrix, A, destroy_level)) return false;
  }
  const int *off = nullptr, *col = nullptr;
  const double* val = nullptr;
  int n = 0, m = 0;
  PetscBool done = PETSC_FALSE;
  if (petsc->MatGetSize(matrix, &n, &m) ||
      petsc->MatGetRowIJ(matrix, 0, PETSC_FALSE, PETSC_FALSE, &n, &off, &col, &done) || !done ||
      petsc->MatSeqAIJGetArrayRead(matrix, &val))
    return false;
  const double before = level_memory(*A);
  const bool fits     = level_fill(rows, cols, n, m, off, col, val, *A);
  d.level_bytes += level_memory(*A) - before;
  if (petsc->MatSeqAIJRestoreArrayRead(matrix, &val) ||
      petsc->MatRestoreRowIJ(matrix, 0, PETSC_FALSE, PETSC_FALSE, &n, &off, &col, &done))
    return false;
  if (!fits) return true;
  return set_operation(matrix, MATOP_MULT, level_mult) &&
         set_operation(matrix, MATOP_MULT_TRANSPOSE, level_mult_transpose) &&
         !petsc->MatSetOperation(matrix, MATOP_MULT_ADD, reinterpret_cast<void (*)()>(level_mult_add));
}

// several ranks: a matrix of PETSc has two sequential ones, for columns of this rank and of others
bool take_products(Mat matrix, AmgData& d)
{
  int rows = 0, cols = 0;
  if (petsc->MatGetBlockSizes(matrix, &rows, &cols)) return false;
  if (!d.own) return take_products(matrix, rows, cols, d);
  Mat here = nullptr, others = nullptr;
  const int* name = nullptr;
  return !petsc->MatMPIAIJGetSeqAIJ(matrix, &here, &others, &name) && take_products(here, rows, cols, d) &&
         take_products(others, rows, cols, d);
}

// ---- the finest level: M and its incomplete factor -------------------------

// copies v of the owned rows into a vector of all rows of M, 0 elsewhere; pick_rows is the inverse
void put_rows(const AmgData& d, const double* v, RealVec& x)
{
  const int D = d.M->dim;
  if (d.own) std::fill(x.begin(), x.end(), 0.0);     // else all rows are owned
  for (size_t l = 0; l < d.row.size(); ++l) std::copy_n(v + l * D, D, &x[static_cast<size_t>(d.row[l]) * D]);
}

void pick_rows(const AmgData& d, const RealVec& x, double* v)
{
  const int D = d.M->dim;
  for (size_t l = 0; l < d.row.size(); ++l) std::copy_n(&x[static_cast<size_t>(d.row[l]) * D], D, v + l * D);
}

// x of all rows of M, from the rows of this rank
void spread(AmgData& d, Vec from)
{
  const double* v = nullptr;
  petsc->VecGetArrayRead(from, &v);
  put_rows(d, v, d.x);
  sys_sum(*d.M, d.x);
  petsc->VecRestoreArrayRead(from, &v);
}

void pick(const AmgData& d, const RealVec& from, Vec to)
{
  double* v = nullptr;
  petsc->VecGetArray(to, &v);
  pick_rows(d, from, v);
  petsc->VecRestoreArray(to, &v);
}

PetscErrorCode multiply(Mat matrix, Vec from, Vec to)
{
  AmgData& d = *attached<AmgData>(matrix);
  if (!d.own)                                        // without a copy
    return work_on(from, to, [&](const double* x, double* y) { sys_multiply(*d.M, d.val, x, y); });
  spread(d, from);
  sys_multiply(*d.M, d.val, d.x.data(), d.y.data());
  sys_sum(*d.M, d.y);
  pick(d, d.y, to);
  return 0;
}

PetscErrorCode smooth(PC pc, Vec from, Vec to)
{
  void* context = nullptr;
  petsc->PCShellGetContext(pc, &context);
  AmgData& d = *static_cast<AmgData*>(context);
  spread(d, from);
  if (d.own) cholesky_apply(*d.M, *d.L, *d.own, d.y, d.x);
  else cholesky_apply(*d.M, *d.L, d.x);
  pick(d, d.x, to);
  return 0;
}

// ---- the hierarchy ---------------------------------------------------------

MPI_Comm comm_of(const AmgData& d) { return d.own ? MPI_Comm_f2c(comm_fortran(true)) : MPI_COMM_SELF; }

bool create_vector(const AmgData& d, const RealVec* values, Vec* v)
{
  const int D = d.M->dim, n = static_cast<int>(d.row.size()) * D;
  const double* a = values ? values->data() : nullptr;
  return !(d.own ? petsc->VecCreateMPIWithArray(comm_of(d), D, n, d.nall * D, a, v)
                 : petsc->VecCreateSeqWithArray(MPI_COMM_SELF, D, n, a, v));
}

bool create_matrices(AmgData& d)
{
  const int D = d.M->dim, n = static_cast<int>(d.row.size()) * D, N = d.nall * D;
  int *off = d.entry_off.data(), *col = d.entry_col.data();
  const MPI_Comm comm = comm_of(d);
  double* a       = d.entry.data();
  const int error = d.own ? petsc->MatCreateMPIAIJWithArrays(comm, n, n, N, N, off, col, a, &d.matrix)
                          : petsc->MatCreateSeqAIJWithArrays(comm, n, n, off, col, a, &d.matrix);
  return !error && !petsc->MatSetBlockSize(d.matrix, D) &&
         !petsc->MatSetOption(d.matrix, MAT_SPD, PETSC_TRUE) && attach(d.matrix, &d, no_destroy) &&
         set_operation(d.matrix, MATOP_MULT, multiply);
}

bool give_motions(AmgData& d, const RealVec* positions)
{
  const std::vector<RealVec> motion = rigid_motions(d, positions);
  std::vector<Vec> v(motion.size(), nullptr);
  bool good = true;
  for (size_t m = 0; m < v.size(); ++m) good = good && create_vector(d, &motion[m], &v[m]);
  MatNullSpace space = nullptr;
  const MPI_Comm comm = comm_of(d);
  const int count = static_cast<int>(v.size());
  good = good && !petsc->MatNullSpaceCreate(comm, PETSC_FALSE, count, v.data(), &space) &&
         !petsc->MatSetNearNullSpace(d.matrix, space) && !petsc->PCSetUp(d.multigrid);
  for (Vec& one : v) petsc->VecDestroy(&one);
  petsc->MatNullSpaceDestroy(&space);
  return good;
}

// sets the products of this program on all levels, on the finest again, since PETSc resets them when it
// assembles a matrix. begin: also those of the interpolation, which is kept
bool take_levels(int levels, bool begin, AmgData& d)
{
  for (int l = 1; l < levels; ++l) {
    Mat P = nullptr, A = nullptr;
    KSP smoother;
    if (begin && (petsc->PCMGGetInterpolation(d.multigrid, l, &P) || !take_products(P, d))) return false;
    if (l < levels - 1 && (petsc->PCMGGetSmoother(d.multigrid, l, &smoother) ||
                           petsc->KSPGetOperators(smoother, nullptr, &A) || !take_products(A, d)))
      return false;
  }
  return set_operation(d.matrix, MATOP_MULT, multiply);
}

// the finest smoother is one Chebyshev step with the incomplete factor; the others are those of GAMG, two
// steps with the diagonal
bool refine(bool begin, AmgData& d)
{
  int levels = 0;
  KSP smoother;
  PC factor;
  if (petsc->PCMGGetLevels(d.multigrid, &levels) || !take_levels(levels, begin, d)) return false;
  if (levels < 2) return true;
  return !petsc->PCMGGetSmoother(d.multigrid, levels - 1, &smoother) &&
         !petsc->KSPGetPC(smoother, &factor) && !petsc->PCSetType(factor, PCSHELL) &&
         !petsc->PCShellSetApply(factor, smooth) && !petsc->PCShellSetContext(factor, &d) &&
         !petsc->KSPSetTolerances(smoother, 0.0, 0.0, 1e30, 1) && !petsc->KSPSetUp(smoother);
}

bool form_hierarchy(AmgData& d, const RealVec* positions)
{
  // one rank: the default takes a third longer; on several ranks there is no choice
  if (!d.own && petsc->PetscOptionsSetValue(nullptr, "-matptap_via", "rap")) return false;
  const MPI_Comm comm = comm_of(d);
  return create_vector(d, nullptr, &d.in) && create_vector(d, nullptr, &d.out) && create_matrices(d) &&
         !petsc->PCCreate(comm, &d.multigrid) && !petsc->PCSetOptionsPrefix(d.multigrid, "mpfe_") &&
         !petsc->PCSetType(d.multigrid, PCGAMG) && !petsc->PCSetFromOptions(d.multigrid) &&
         !petsc->PCSetOperators(d.multigrid, d.matrix, d.matrix) && give_motions(d, positions) &&
         refine(true, d);
}

// recomputes the coarse matrices, with the same interpolation
bool renew_hierarchy(AmgData& d)
{
  const int error = d.own ? petsc->MatUpdateMPIAIJWithArray(d.matrix, d.entry.data())
                          : petsc->MatAssemblyBegin(d.matrix, MAT_FINAL_ASSEMBLY);
  return !error && (d.own || !petsc->MatAssemblyEnd(d.matrix, MAT_FINAL_ASSEMBLY)) &&
         !petsc->PCSetOperators(d.multigrid, d.matrix, d.matrix) && !petsc->PCSetUp(d.multigrid) &&
         refine(false, d);
}

bool same_pattern(const AmgData& d, const SysMatrix& M, const OwnBlock* own)
{
  if (own) return !comm_allreduce_max(static_cast<int>(d.pattern != own->pattern));
  return d.off == M.off && d.col == M.col;
}

void take_matrix(const SysMatrix& M, OwnBlock* own, const Cholesky& L, AmgData& d)
{
  d.M   = &M;
  d.own = own;
  d.L   = &L;
  d.val.assign(M.val.begin(), M.val.end());
}

bool begin(const SysMatrix& M, OwnBlock* own, const Cholesky& L, const std::function<RealVec()>& positions,
           AmgData& d)
{
  take_matrix(M, own, L, d);
  if (comm_allreduce_max(static_cast<int>(2.0 * static_cast<double>(M.val.size()) > INT_MAX))) return false;
  if (own) {
    const RowNumbers rows = sys_number(M);
    d.pattern = own->pattern;
    d.nall    = rows.first.back();
    for (int I = 0; I < M.nrow; ++I)
      if (M.halo.owner[I] == comm_rank()) d.row.push_back(I);
    list_blocks_of_all(M, rows, d);
  } else {
    d.off   = M.off;
    d.col   = M.col;
    d.nall  = M.nrow;
    d.row.resize(M.nrow);
    std::iota(d.row.begin(), d.row.end(), 0);
    list_blocks(M, d.row, d);
  }
  list_entries(M.dim, d);
  d.x.resize(M.neq());
  if (own) {
    d.y.resize(M.neq());
    d.r.resize(d.row.size() * M.dim);
    d.z.resize(d.r.size());
  }
  fill_entries(d);
  const RealVec at = positions ? positions() : RealVec();
  return !comm_allreduce_max(!form_hierarchy(d, positions ? &at : nullptr));
}

}  // namespace

bool amg_there() { return (petsc = petsc_open()) != nullptr; }

// ---------------------------------------------------------------------------
// amg_form : multigrid for M, by smoothed aggregation                                      (8.12)
//
//   in   M       A; several ranks: the contribution of this one
//        L       incomplete factor of M, the smoother of the finest level
//        positions   [neq] positions of the nodes of all rows; empty: unknown
//   out  data    the hierarchy. For the same pattern the coarse matrices are kept until the additional
//                iterations exceed the cost of new ones
//   false: PETSc is not available, or failed
// ---------------------------------------------------------------------------
bool amg_form(const SysMatrix& M, OwnBlock* own, const Cholesky& L, const std::function<RealVec()>& positions,
              long stamp, std::shared_ptr<AmgData>& data)
{
  if (!amg_there()) return false;
  if (!data || !same_pattern(*data, M, own)) {
    data        = std::make_shared<AmgData>();
    data->stamp = stamp;
    if (begin(M, own, L, positions, *data)) return true;
    data.reset();
    return false;
  }
  AmgData& d = *data;
  take_matrix(M, own, L, d);
  d.age.kept     = d.stamp != stamp;
  if (!d.age.kept || d.age.extra <= SETUP_AGAIN) return true;
  d.age.kept  = false;
  d.age.digit = d.age.extra = 0.0;
  d.stamp = stamp;
  fill_entries(d);
  if (!comm_allreduce_max(!renew_hierarchy(d))) return true;
  data.reset();
  return false;
}

// amg_apply : z = multigrid r, rho = r z; several ranks: vectors summed over the ranks
bool amg_apply(AmgData& d, const RealVec& r, RealVec& z, double& rho)
{
  if (d.own) pick_rows(d, r, d.r.data());
  z.resize(r.size());
  const bool good = !petsc->VecPlaceArray(d.in, d.own ? d.r.data() : r.data()) &&
                    !petsc->VecPlaceArray(d.out, d.own ? d.z.data() : z.data()) &&
                    !petsc->PCApply(d.multigrid, d.in, d.out) && !petsc->VecResetArray(d.in) &&
                    !petsc->VecResetArray(d.out);
  if (!d.own) {
    rho = dot(r, z);
    return good;
  }
  if (comm_allreduce_max(!good)) return false;
  rho = dot(d.r, d.z);
  put_rows(d, d.z.data(), z);
  halo_sum(d.M->halo, d.M->dim, z, &rho, 1);
  return true;
}

// amg_count : counts the iterations of a solution. true: it failed with coarse matrices of an earlier matrix,
// and may succeed with new ones
bool amg_count(AmgData& d, const CgDone& done)
{
  if (!done.good) {
    d.age.extra = 2.0 * SETUP_AGAIN;
    return d.age.kept;
  }
  const double digits = done.end > 0.0 ? std::max(1.0, std::log10(done.first / done.end)) : 16.0;
  if (!d.age.kept && d.age.digit == 0.0) d.age.digit = done.iterations / digits;
  d.age.extra += std::max(0.0, done.iterations - d.age.digit * digits);
  return false;
}

double amg_memory(const AmgData& d)
{
  return static_cast<double>((d.source.capacity() + d.number.capacity() + d.entry_col.capacity() +
                              d.entry_off.capacity() + 2 * d.blocks.target.capacity()) * sizeof(int) +
                             d.val.capacity() * sizeof(float) + d.level_bytes +
                             (d.entry.capacity() + d.x.capacity() + d.y.capacity()) * sizeof(double));
}

#else

struct AmgData {};

bool amg_there() { return false; }
bool amg_form(const SysMatrix&, OwnBlock*, const Cholesky&, const std::function<RealVec()>&, long,
              std::shared_ptr<AmgData>&)
{
  return false;
}
bool amg_apply(AmgData&, const RealVec&, RealVec&, double&) { return false; }
bool amg_count(AmgData&, const CgDone&) { return false; }
double amg_memory(const AmgData&) { return 0.0; }

#endif
