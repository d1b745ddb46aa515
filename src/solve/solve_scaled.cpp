#include <cmath>

#include "base/grow.h"
#include "solve/solve_data.h"

#ifdef __SSE2__
#include <xmmintrin.h>
#endif

namespace {

// Relative residual that single precision reaches safely; Newton's method continues from there. Coupled bars
// stall at 2e-7  (test: Krylov.SinglePrecisionWhereInertiaDominates)
const double SINGLE_TOL = 1e-6;
// numbers beyond the end of an array that vector loads may read: one register of Eight
// (test: Krylov.SinglePrecisionWhereInertiaDominates)
const size_t PAD = 8;

typedef float Four __attribute__((vector_size(16)));
typedef float FourAt __attribute__((vector_size(16), aligned(4), may_alias));
typedef double Pair __attribute__((vector_size(16)));
typedef double Number __attribute__((aligned(4), may_alias));        // two numbers in single precision
typedef int FourLanes __attribute__((vector_size(16)));

// Denormal numbers, as far ahead of a wave, cost the processor ten times as much: they become zero
struct NoDenormals {
#ifdef __SSE2__
  unsigned before = _mm_getcsr();
  NoDenormals() { _mm_setcsr(before | 0x8040); }
  ~NoDenormals() { _mm_setcsr(before); }
  NoDenormals(const NoDenormals&) = delete;
  NoDenormals& operator=(const NoDenormals&) = delete;
#endif
};

inline Four four(const float* x) { return *reinterpret_cast<const FourAt*>(x); }

// x[0] x[1] x[0] x[1]
inline Four twice(const float* x)
{
  const double d = *reinterpret_cast<const Number*>(x);
  return reinterpret_cast<Four>(Pair{d, d});
}

// q[0] += x[0], q[1] += x[1]. Always two numbers: a load of both soon after two stores would wait for these
inline void add_two(Four x, float* q)
{
  x += reinterpret_cast<Four>(Pair{*reinterpret_cast<const Number*>(q), 0.0});
  *reinterpret_cast<Number*>(q) = reinterpret_cast<Pair>(x)[0];
}

typedef float Eight __attribute__((vector_size(32)));
typedef float EightAt __attribute__((vector_size(32), aligned(4), may_alias));
typedef double TwoPairs __attribute__((vector_size(32)));
typedef int EightLanes __attribute__((vector_size(32)));

// q += A p of the blocks of 2 x 2, two at a time; returns p A p
double multiply_plane(const SysMatrix& A, const float* a, const float* p, float* q)
{
  const int *off = A.off.data(), *col = A.col.data(), n = A.nrow;
  double pq = 0.0;
  for (int I = 0; I < n; ++I) {
    const float x0 = p[2 * I], x1 = p[2 * I + 1];
    const Four own = {x0, x0, x1, x1};
    const Eight both = {x0, x0, x1, x1, x0, x0, x1, x1};
    Eight sums = {};
    Four sum = {};
    int k = off[I];
    const int last = off[I + 1] - 1;
    for (; k + 1 < last; k += 2, a += 8) {
      const int J = 2 * col[k], K = 2 * col[k + 1];
      const Eight blocks = *reinterpret_cast<const EightAt*>(a);
      const double j = *reinterpret_cast<const Number*>(p + J), l = *reinterpret_cast<const Number*>(p + K);
      sums += blocks * reinterpret_cast<Eight>(TwoPairs{j, j, l, l});
      const Eight w = blocks * both, back = w + __builtin_shuffle(w, EightLanes{2, 3, 2, 3, 6, 7, 6, 7});
      const TwoPairs two = reinterpret_cast<TwoPairs>(back);
      add_two(reinterpret_cast<Four>(Pair{two[0], 0.0}), q + J);
      add_two(reinterpret_cast<Four>(Pair{two[2], 0.0}), q + K);
    }
    for (; k < last; ++k, a += 4) {
      const int J = 2 * col[k];
      const Four block = four(a);
      sum += block * twice(p + J);
      const Four w = block * own;
      add_two(w + __builtin_shuffle(w, FourLanes{2, 3, 2, 3}), q + J);
    }
    const float s0 = sum[0] + sum[1] + (sums[0] + sums[1] + (sums[4] + sums[5])),
                s1 = sum[2] + sum[3] + (sums[2] + sums[3] + (sums[6] + sums[7]));
    const float d0 = a[0] * x0 + a[2] * x1, d1 = a[2] * x0 + a[3] * x1;
    add_two(Four{s0 + d0, s1 + d1, 0.0f, 0.0f}, q + 2 * I);
    pq += static_cast<double>(x0 * (2.0f * s0 + d0) + x1 * (2.0f * s1 + d1));
    a += 4;
  }
  return pq;
}

// the same with blocks of 3 x 3, of which a row is loaded with the number after it
double multiply_space(const SysMatrix& A, const float* a, const float* p, float* q)
{
  const int *off = A.off.data(), *col = A.col.data(), n = A.nrow;
  const Four three = {1.0f, 1.0f, 1.0f, 0.0f};
  double pq = 0.0;
  for (int I = 0; I < n; ++I) {
    const float x0 = p[3 * I], x1 = p[3 * I + 1], x2 = p[3 * I + 2];
    Four s0 = {}, s1 = {}, s2 = {};
    for (int k = off[I], last = off[I + 1] - 1; k < last; ++k, a += 9) {
      const int J = 3 * col[k];
      const Four a0 = four(a), a1 = four(a + 3), a2 = four(a + 6), other = four(p + J) * three;
      s0 += a0 * other;
      s1 += a1 * other;
      s2 += a2 * other;
      *reinterpret_cast<FourAt*>(q + J) += (a0 * x0 + a1 * x1 + a2 * x2) * three;
    }
    const float r0 = s0[0] + s0[1] + s0[2], r1 = s1[0] + s1[1] + s1[2], r2 = s2[0] + s2[1] + s2[2],
                d0 = a[0] * x0 + a[3] * x1 + a[6] * x2, d1 = a[3] * x0 + a[4] * x1 + a[7] * x2,
                d2 = a[6] * x0 + a[7] * x1 + a[8] * x2;
    float* own = q + 3 * I;
    own[0] += r0 + d0;
    own[1] += r1 + d1;
    own[2] += r2 + d2;
    pq += static_cast<double>(x0 * (2.0f * r0 + d0) + x1 * (2.0f * r1 + d1) + x2 * (2.0f * r2 + d2));
    a += 9;
  }
  return pq;
}

// sum of n terms in single precision; parts of LONGEST terms are added in double precision
template <class Term>
double sum_single(size_t n, Term term)
{
  const size_t LANES = 16, LONGEST = 1024;
  double sum = 0.0;
  for (size_t first = 0; first < n; first += LONGEST) {
    const size_t end = std::min(n, first + LONGEST), whole = first + (end - first) / LANES * LANES;
    float part[LANES] = {};
    for (size_t k = first; k < whole; k += LANES)
      for (size_t l = 0; l < LANES; ++l) part[l] += term(k + l);
    for (size_t k = whole; k < end; ++k) part[0] += term(k);
    for (float p : part) sum += static_cast<double>(p);
  }
  return sum;
}

// x += alpha p, r -= alpha q; returns r r
double advance(size_t n, float alpha, const float* __restrict p, const float* __restrict q,
               float* __restrict x, float* __restrict r)
{
  return sum_single(n, [=](size_t k) {
    x[k] += alpha * p[k];
    r[k] -= alpha * q[k];
    return r[k] * r[k];
  });
}

// p = r + beta p, q = 0
void turn(size_t n, float beta, const float* __restrict r, float* __restrict p, float* __restrict q)
{
  for (size_t k = 0; k < n; ++k) {
    p[k] = r[k] + beta * p[k];
    q[k] = 0.0f;
  }
}

// blocks of A between rows divided by the roots of the diagonal
template <int D>
float* scale_blocks(const SysMatrix& A, const double* inverse, float* to)
{
  const double* from = A.val.data();
  for (int I = 0; I < A.nrow; ++I) {
    const double* own = inverse + I * D;
    for (int k = A.off[I]; k < A.off[I + 1]; ++k, from += D * D, to += D * D) {
      const double* other = inverse + A.col[k] * D;
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) to[i * D + j] = static_cast<float>(from[i * D + j] * own[i] * other[j]);
    }
  }
  return to;
}

void fit_zero(std::vector<float>& x, size_t n)
{
  fit_size(x, n + PAD);
  std::fill(x.begin(), x.end(), 0.0f);
}

}  // namespace

// ---------------------------------------------------------------------------
// scaled_form : A with unit diagonal, in single precision                             (8.17)
//
// false: a number on the diagonal is not positive, or blocks are neither 2 x 2 nor 3 x 3
// ---------------------------------------------------------------------------
bool scaled_form(const SysMatrix& A, long stamp, ScaledMatrix& s)
{
  if (s.stamp == stamp) return true;
  s.stamp     = -1;
  const int D = A.dim, DD = D * D;
  if (D < 2) return false;
  fit_size(s.root, A.neq());
  fit_size(s.val, A.val.size() + PAD);
  RealVec inverse(A.neq());
  for (int I = 0; I < A.nrow; ++I)
    for (int i = 0; i < D; ++i) {
      const double d = A.val[static_cast<size_t>(A.off[I + 1] - 1) * DD + i * D + i];
      if (!(d > 0.0) || !std::isfinite(d)) return false;
      s.root[I * D + i]  = std::sqrt(d);
      inverse[I * D + i] = 1.0 / s.root[I * D + i];
    }
  float* const end = D == 2 ? scale_blocks<2>(A, inverse.data(), s.val.data())
                            : scale_blocks<3>(A, inverse.data(), s.val.data());
  std::fill(end, end + PAD, 0.0f);
  s.stamp = stamp;
  return true;
}

// ---------------------------------------------------------------------------
// scaled_solve : conjugate gradients for A x = b with the matrix of scaled_form        (8.17)
//
//   in   goal   as cg_solve; a relative residual of SINGLE_TOL is as good as any smaller one
//   out  x      [neq];   s.r: b - A x, scaled
// ---------------------------------------------------------------------------
CgDone scaled_solve(const SysMatrix& A, const RealVec& b, const CgGoal& goal, ScaledMatrix& s, RealVec& x)
{
  const NoDenormals fast;
  CgDone done;
  const size_t n = b.size();
  const float *root = s.root.data();
  const double* rhs = b.data();
  fit_size(s.p, n + PAD);
  fit_size(s.r, n + PAD);
  float* start = s.r.data();
  const double biggest = std::sqrt(sum_terms(n, [=](size_t k) { return rhs[k] * rhs[k]; })),
               shrink  = biggest > 0.0 ? 1.0 / biggest : 1.0;
  const double whole = biggest * std::sqrt(sum_single(n, [=](size_t k) {
    const float f = static_cast<float>(rhs[k] * shrink) / root[k];
    start[k] = f;
    return f * f;
  }));
  fit_zero(s.x, n);
  fit_zero(s.q, n);
  s.size = whole > 0.0 ? whole : 1.0;
  const float grow = static_cast<float>(biggest / s.size);
  for (size_t k = 0; k < n; ++k) {
    start[k] *= grow;
    s.p[k] = start[k];
  }
  std::fill(s.p.begin() + static_cast<long>(n), s.p.end(), 0.0f);
  const double force = biggest, eta = std::max(goal.eta, SINGLE_TOL),
               energy = std::max(eta * whole, goal.energy), residual = std::max(eta * force, goal.residual);
  double rho = whole > 0.0 ? 1.0 : 0.0;              // r r, relative to whole
  const float* r = s.r.data();
  const auto length = [&] {
    return s.size * std::sqrt(sum_single(n, [=](size_t k) { return r[k] * r[k] * root[k] * root[k]; }));
  };
  done.first = done.start = done.end = whole;
  while (done.end > energy || length() > residual) {
    if (done.iterations >= goal.max_iterations || !std::isfinite(done.end)) return done;
    const double pq = A.dim == 2 ? multiply_plane(A, s.val.data(), s.p.data(), s.q.data())
                                 : multiply_space(A, s.val.data(), s.p.data(), s.q.data());
    done.indefinite = !(pq > 0.0);
    if (done.indefinite) return done;
    const float alpha = static_cast<float>(rho / pq);
    const double next = advance(n, alpha, s.p.data(), s.q.data(), s.x.data(), s.r.data());
    turn(n, static_cast<float>(next / rho), r, s.p.data(), s.q.data());
    rho = next;
    ++done.iterations;
    done.end = whole * std::sqrt(rho);
  }
  x.resize(n);
  for (size_t k = 0; k < n; ++k) x[k] = s.size * static_cast<double>(s.x[k]) / static_cast<double>(root[k]);
  done.good = true;
  return done;
}

// y = A x; vectors of the last solution are overwritten
void scaled_multiply(const SysMatrix& A, ScaledMatrix& s, const RealVec& x, RealVec& y)
{
  const NoDenormals fast;
  const size_t n = x.size();
  fit_zero(s.q, n);
  fit_size(s.p, n + PAD);
  for (size_t k = 0; k < n; ++k) s.p[k] = static_cast<float>(x[k] * static_cast<double>(s.root[k]));
  std::fill(s.p.begin() + static_cast<long>(n), s.p.end(), 0.0f);
  if (A.dim == 2) multiply_plane(A, s.val.data(), s.p.data(), s.q.data());
  else multiply_space(A, s.val.data(), s.p.data(), s.q.data());
  y.resize(n);
  for (size_t k = 0; k < n; ++k) y[k] = static_cast<double>(s.q[k]) * static_cast<double>(s.root[k]);
}
