#include <algorithm>
#include <cmath>

#include <Eigen/Core>

#include "assem/assem.h"
#include "assem/mass_rows.h"
#include "base/comm.h"
#include "base/picked.h"
#include "base/sum.h"

namespace {

// relative to the diagonal: added if M is singular to round-off, with nodes that occur in one combination
// only at all points; removed by at most REFINEMENTS refinements. Without it mass_factor follows: time only
// (no test)
const double SHIFT    = 1e-10;
const int REFINEMENTS = 4;
// pivot of a row that an island leaves undetermined: it stays at rest  (test: fracture/conv_lone.inp)
const double AT_REST  = 1e200;
// relative to the square of the last residual: below, a difference of squares has lost digits  (no test)
const double CANCELS  = 1e-6;

// y += M x, for the couplings among the first rows
template <int D>
void multiply(const Dofs& s, const RealVec& M, int rows, const double* x, double* y)
{
  for (int r = 0; r < rows; ++r) {
    const int diag = s.pattern.A.off[r + 1] - 1;
    double row[D];
    for (int i = 0; i < D; ++i) row[i] = M[diag] * x[r * D + i];
    for (int k = s.pattern.A.off[r]; k < diag; ++k) {
      const int c    = s.pattern.A.col[k] * D;
      const double m = M[k];
      for (int i = 0; i < D; ++i) {
        row[i] += m * x[c + i];
        y[c + i] += m * x[r * D + i];
      }
    }
    for (int i = 0; i < D; ++i) y[r * D + i] += row[i];
  }
}

// y = M x in the first rows, 0 beyond: only coupled rows have more than a diagonal
template <int D>
void multiply_lumped(const Dofs& s, int rows, const double* x, RealVec& y)
{
  const double *M = s.mass.M.data(), *diag = s.mass.M_here.data();
  y.resize(static_cast<size_t>(s.rows.neq()));
  for (int r = 0; r < rows; ++r)
    for (int i = 0; i < D; ++i) y[r * D + i] = diag[r] * x[r * D + i];
  std::fill(y.begin() + static_cast<long>(rows) * D, y.end(), 0.0);
  for (int r : s.mass.coupled) {
    if (r >= rows) break;
    for (int k = s.pattern.A.off[r], last = s.pattern.A.off[r + 1] - 1; k < last; ++k) {
      const int c    = s.pattern.A.col[k] * D;
      const double m = M[k];
      for (int i = 0; i < D; ++i) {
        y[r * D + i] += m * x[c + i];
        y[c + i] += m * x[r * D + i];
      }
    }
  }
}

// M of chosen rows, scaled to a unit diagonal (of all ranks); contribution of this rank
struct MassValues {
  const MassRows& rows;
  bool shared;                 // several ranks
  RealVec all, diag, cross, border, edge;  // as in MassRows
};

// scale [n]
MassValues mass_values(const Dofs& s, const MassRows& rows, const RealVec& scale)
{
  MassValues m{rows, sys_shared(s.pattern.A), {}, {}, {}, {}, {}};
  m.all.resize(rows.all.from.size());
  m.diag.resize(rows.size());
  for (int r = 0; r < rows.size(); ++r) {
    for (int k = rows.all.off[r]; k < rows.all.off[r + 1]; ++k)
      m.all[k] = s.mass.M[rows.all.from[k]] * scale[r] * scale[rows.all.col[k]];
    m.diag[r] = s.mass.M[s.pattern.A.off[rows.row[r] + 1] - 1] * scale[r] * scale[r];
  }
  if (!m.shared) return m;
  m.cross = picked(rows.cross_from, 1, m.all);
  m.edge  = picked(rows.edge_from, 1, m.all);
  m.border.assign(rows.border.col.size(), 0.0);
  std::vector<RealVec> to;
  for (const IntVec& k : rows.border_to) to.push_back(picked(k, 1, m.all));
  const std::vector<RealVec> of = comm_exchange(to);
  for (size_t r = 0; r < of.size(); ++r)             // the same order on all ranks
    for (size_t k = 0; k < of[r].size(); ++k) m.border[rows.border_at[r][k]] += of[r][k];
  return m;
}

// sum over the ranks of v [n*D]
template <int D>
void sum_rows(const MassValues& m, RealVec& v)
{
  if (m.shared) halo_sum(m.rows.halo, D, v);
}

// y = M x, contribution of this rank
template <int D>
void multiply_here(const MassValues& m, const RealVec& x, RealVec& y)
{
  const MassCouplings& all = m.rows.all;
  const int n = m.rows.size();
  for (int r = 0; r < n; ++r)
    for (int i = 0; i < D; ++i) y[r * D + i] = m.diag[r] * x[r * D + i];
  for (int r = 0; r < n; ++r) {
    double row[D] = {};
    for (int k = all.off[r]; k < all.off[r + 1]; ++k)
      for (int i = 0; i < D; ++i) {
        row[i] += m.all[k] * x[all.col[k] * D + i];
        y[all.col[k] * D + i] += m.all[k] * x[r * D + i];
      }
    for (int i = 0; i < D; ++i) y[r * D + i] += row[i];
  }
}

// y = M x
template <int D>
void multiply(const MassValues& m, const RealVec& x, RealVec& y)
{
  multiply_here<D>(m, x, y);
  sum_rows<D>(m, y);
}

// the components of a row, in one vector register
template <int D>
using Dirs = Eigen::Array<double, D, 1>;

template <int D>
Eigen::Map<Dirs<D>> dirs(double* x, int r)
{
  return Eigen::Map<Dirs<D>>(x + static_cast<size_t>(r) * D);
}

template <int D>
Eigen::Map<const Dirs<D>> dirs(const double* x, int r)
{
  return Eigen::Map<const Dirs<D>>(x + static_cast<size_t>(r) * D);
}

// sums of products of vectors of n numbers for each direction; in four partial sums, so
// that additions are independent
template <int D>
struct Sums {
  double part[4 * D] = {};
  void add(const double* a, const double* b, size_t n)
  {
    const size_t whole = n / (4 * D) * (4 * D);
    for (size_t k = 0; k < whole; k += 4 * D)
      for (int l = 0; l < 4 * D; ++l) part[l] += a[k + l] * b[k + l];
    for (size_t k = whole; k < n; ++k) part[k - whole] += a[k] * b[k];
  }
  double of(int i) const { return (part[i] + part[D + i]) + (part[2 * D + i] + part[3 * D + i]); }
};

// Mass of the free dofs for all directions at once, in the variables of symmetric Gauss-Seidel  (3.14)
// Several ranks: first the rows of one rank alone, then the border; L omits couplings of border rows with
// different sets of ranks
template <int D>
struct MassSystem {
  MassValues mass;
  const MassRows& rows;
  RealVec free;                // [n*D] 1: free, 0: prescribed or without mass
  double shift = 0.0;          // the matrix is M + shift I

  // y = (I + L)^-1 x; x and y may be the same vector
  void forward(const RealVec& x, RealVec& y) const
  {
    const RealVec edge = border_of(x);
    forward_here(x, y);
    if (!mass.shared) return;
    cross_forward(y, y);
    sum_rows<D>(mass, y);
    border_forward(edge, y);
  }
  // r = (I + L)^-1 (b - M u), the residual in these variables; several ranks: square = r r
  void start(const RealVec& b, const RealVec& u, RealVec& r, double* square) const
  {
    RealVec q(r.size());
    multiply_here<D>(mass, u, q);
    for (size_t k = 0; k < r.size(); ++k) r[k] = free[k] * (b[k] - q[k]);
    forward_here(r, r);
    if (!mass.shared) return;
    cross_forward(r, r);
    for (size_t k = alone(); k < r.size(); ++k) r[k] -= q[k];
    sum_border(r, square);
    border_forward(border_of(b), r);
    add_border(r, square);
  }
  // y = (I + L)^-T x
  void backward(const RealVec& x, RealVec& y) const
  {
    y = x;
    if (mass.shared) {
      border_backward(y.data() + alone());
      cross_backward(y.data());
    }
    sweep_back(y.data());
  }
  // q = (I + L)^-1 (M + shift I) (I + L)^-T x, in: t = x; t, y: scratch. Since M = (I + L) + (I + L)^T - I,
  // no product with M is needed. Returns x q in each direction. One rank
  Dirs<D> apply(const RealVec& x, RealVec& t, RealVec& y, RealVec& q) const
  {
    double sum[D];
    sweep_back(t.data());
    apply_alone<false>(x, x, t, y, q, sum);
    return Eigen::Map<const Dirs<D>>(sum);
  }
  // the same on several ranks, x = r + turn times the previous x. late [shared*D]: the border of the previous
  // t, then of t; sum [4][D]: x q, r q, r r, q q of all ranks
  void apply(const RealVec& x, const RealVec& r, const double* turn, RealVec& late, RealVec& t, RealVec& y,
             RealVec& q, double* sum) const
  {
    const size_t first = alone();
    const double keep  = 1.0 - shift;
    RealVec back = border_of(r);                     // as t of x: (I + L)^-T r
    border_backward(back.data());
    for (size_t k = 0; k < late.size(); ++k) late[k] = back[k] + turn[k % D] * late[k];
    std::copy(late.begin(), late.end(), t.begin() + static_cast<long>(first));
    cross_backward(t.data());
    sweep_back(t.data());
    apply_alone<true>(x, r, t, y, q, sum);
    cross_forward(y, q);
    for (size_t k = 0; k < rows.edge.size(); ++k) {
      const int a = rows.edge[k][0], b = rows.edge[k][1];
      dirs<D>(q.data(), a) += mass.edge[k] * dirs<D>(t.data(), b);
      dirs<D>(q.data(), b) += mass.edge[k] * dirs<D>(t.data(), a);
    }
    RealVec edge(late.size());
    for (size_t k = 0; k < edge.size(); ++k) {       // the border: contribution of this rank
      const double own = rows.owned[k / D], to = t[first + k], at = r[first + k], of = q[first + k];
      edge[k] = x[first + k] - keep * to;
      sum[k % D] += to * of + own * to * (x[first + k] + edge[k]);
      sum[D + k % D] += back[k] * of + own * (at * to + back[k] * edge[k]);
      sum[2 * D + k % D] += own * at * at;
    }
    halo_sum(rows.halo, D, q, sum, 4 * D);
    border_forward(edge, q);
    for (size_t k = first; k < q.size(); ++k) q[k] += t[k];
    add_border(q, sum + 3 * D);
  }
  // the residual of M from the residual in these variables: out = (I + L) r; square = out out
  void residual(const RealVec& r, RealVec& out, double* square) const
  {
    const MassCouplings& m = rows.all;
    for (int q = 0; q < rows.size(); ++q) {
      double t[D];
      for (int i = 0; i < D; ++i) t[i] = r[q * D + i];
      for (int k = m.off[q], last = m.off[q < rows.alone ? q + 1 : q]; k < last; ++k)
        for (int i = 0; i < D; ++i) t[i] += mass.all[k] * r[m.col[k] * D + i];
      for (int i = 0; i < D; ++i) out[q * D + i] = free[q * D + i] * t[i];
    }
    if (!mass.shared) return dots(out, out, square);
    cross_forward(r, out);
    for (size_t k = alone(); k < out.size(); ++k) out[k] = -out[k];
    sum_border(out, square);
    RealVec edge = border_of(r);
    for (int b = 0; b < rows.border.size(); ++b)
      for (int k = rows.border.off[b]; k < rows.border.off[b + 1]; ++k)
        dirs<D>(edge.data(), b) += mass.border[k] * dirs<D>(r.data(), rows.alone + rows.border.col[k]);
    for (size_t k = alone(); k < out.size(); ++k) out[k] = free[k] * (edge[k - alone()] + out[k]);
    add_border(out, square);
  }
  // a . b in each direction; dots_here: the contribution of this rank
  void dots(const RealVec& a, const RealVec& b, double* sum) const
  {
    dots_here(a, b, sum);
    if (mass.shared) comm_sum(sum, D);
  }
  void dots_here(const RealVec& a, const RealVec& b, double* sum) const
  {
    const size_t first = alone();
    Sums<D> ab;
    ab.add(a.data(), b.data(), first);
    for (int i = 0; i < D; ++i) sum[i] = ab.of(i);
    for (size_t k = first; k < a.size(); ++k)
      sum[(k - first) % D] += rows.owned[(k - first) / D] * a[k] * b[k];
  }

private:
  size_t alone() const { return static_cast<size_t>(rows.alone) * D; }
  // rows of this rank alone, t after the sweep; sum = x q of these, ALL: [4][D] x q, r q, r r, q q
  template <bool ALL>
  void apply_alone(const RealVec& x, const RealVec& r, const RealVec& t, RealVec& y, RealVec& q,
                   double* sum) const
  {
    const int *off = rows.all.off.data(), *col = rows.all.col.data();
    const double *val = mass.all.data(), *f = free.data(), keep = 1.0 - shift;
    Dirs<D> part[4] = {Dirs<D>::Zero(), Dirs<D>::Zero(), Dirs<D>::Zero(), Dirs<D>::Zero()};
    for (int n = 0; n < rows.alone; ++n) {
      const Dirs<D> to = dirs<D>(x.data(), n), add = dirs<D>(t.data(), n);
      Dirs<D> of = to - keep * add;
      for (int k = off[n]; k < off[n + 1]; ++k) of -= val[k] * dirs<D>(y.data(), col[k]);
      of *= dirs<D>(f, n);
      dirs<D>(y.data(), n) = of;
      of += add;
      dirs<D>(q.data(), n) = of;
      part[0] += to * of;
      if (!ALL) continue;
      const Dirs<D> at = dirs<D>(r.data(), n);
      part[1] += at * of;
      part[2] += at * at;
      part[3] += of * of;
    }
    for (int k = 0; k < (ALL ? 4 : 1); ++k)
      for (int i = 0; i < D; ++i) sum[k * D + i] = part[k][i];
  }
  void sweep_back(double* of) const
  {
    const int *off = rows.all.off.data(), *col = rows.all.col.data();
    const double *val = mass.all.data(), *f = free.data();
    for (size_t k = alone(); k < free.size(); ++k) of[k] *= f[k];
    for (int r = rows.alone - 1; r >= 0; --r) {
      const Dirs<D> t = dirs<D>(f, r) * dirs<D>(of, r);
      dirs<D>(of, r)  = t;
      for (int k = off[r]; k < off[r + 1]; ++k) dirs<D>(of, col[k]) -= val[k] * t;
    }
  }
  RealVec border_of(const RealVec& x) const
  {
    return mass.shared ? RealVec(x.begin() + static_cast<long>(alone()), x.end()) : RealVec();
  }
  void forward_here(const RealVec& x, RealVec& y) const
  {
    const int *off = rows.all.off.data(), *col = rows.all.col.data();
    const double *val = mass.all.data(), *to = x.data(), *f = free.data();
    double* of = y.data();
    for (int r = 0; r < rows.alone; ++r) {
      Dirs<D> t = dirs<D>(to, r);
      for (int k = off[r]; k < off[r + 1]; ++k) t -= val[k] * dirs<D>(of, col[k]);
      dirs<D>(of, r) = dirs<D>(f, r) * t;
    }
    for (size_t k = alone(); k < free.size(); ++k) of[k] = f[k] * to[k];
  }
  // rows of the border: y = - L x, contribution of this rank
  void cross_forward(const RealVec& x, RealVec& y) const
  {
    for (int b = 0; b < rows.cross.size(); ++b) {
      Dirs<D> t = Dirs<D>::Zero();
      for (int k = rows.cross.off[b]; k < rows.cross.off[b + 1]; ++k)
        t -= mass.cross[k] * dirs<D>(x.data(), rows.cross.item[k]);
      dirs<D>(y.data(), rows.alone + b) = t;
    }
  }
  // rows of this rank alone: y -= L^T y of the border
  void cross_backward(double* y) const
  {
    for (int b = 0; b < rows.cross.size(); ++b) {
      const int r     = rows.alone + b;
      const Dirs<D> t = dirs<D>(free.data(), r) * dirs<D>(y, r);
      for (int k = rows.cross.off[b]; k < rows.cross.off[b + 1]; ++k)
        dirs<D>(y, rows.cross.item[k]) -= mass.cross[k] * t;
    }
  }
  // y of the border: (I + L)^-1 (edge + y), L of the border
  void border_forward(const RealVec& edge, RealVec& y) const
  {
    double* of = y.data() + alone();
    const double* f = free.data() + alone();
    for (int b = 0; b < rows.border.size(); ++b) {
      Dirs<D> t = dirs<D>(edge.data(), b) + dirs<D>(of, b);
      for (int k = rows.border.off[b]; k < rows.border.off[b + 1]; ++k)
        t -= mass.border[k] * dirs<D>(of, rows.border.col[k]);
      dirs<D>(of, b) = dirs<D>(f, b) * t;
    }
  }
  // y [shared*D] = (I + L)^-T y, L of the border
  void border_backward(double* y) const
  {
    const double* f = free.data() + alone();
    for (int b = rows.border.size() - 1; b >= 0; --b) {
      const Dirs<D> t = dirs<D>(f, b) * dirs<D>(y, b);
      dirs<D>(y, b)   = t;
      for (int k = rows.border.off[b]; k < rows.border.off[b + 1]; ++k)
        dirs<D>(y, rows.border.col[k]) -= mass.border[k] * t;
    }
  }
  // sums rows of the border over the ranks, together with square = y y of the other rows
  void sum_border(RealVec& y, double* square) const
  {
    Sums<D> yy;
    yy.add(y.data(), y.data(), alone());
    for (int i = 0; i < D; ++i) square[i] = yy.of(i);
    halo_sum(rows.halo, D, y, square, D);
  }
  // sum += y y of the border. Two ranks: both have all of it, and add in the same order
  void add_border(const RealVec& y, double* sum) const
  {
    double part[D] = {};
    const bool both = comm_size() == 2;
    for (int r : both ? rows.halo.common[1 - comm_rank()] : rows.halo.shared)
      for (int i = 0; i < D; ++i)
        part[i] += (both ? 1.0 : rows.owned[r - rows.alone]) * y[r * D + i] * y[r * D + i];
    if (!both) comm_sum(part, D);
    for (int i = 0; i < D; ++i) sum[i] += part[i];
  }
};

template <int D>
bool below(const double* value, const double* goal)
{
  for (int i = 0; i < D; ++i)
    if (!(value[i] <= goal[i])) return false;
  return true;
}

// Conjugate gradients for step from 0, all directions together; on return r is the residual. Converged if the
// residual of M itself is small. Returns the iterations; -1: not converged to 1e-8 within 1000.
// Several ranks: known is the square of r; one message per iteration (on more than two ranks: two): the
// square of the next residual follows from products with this one,
// and is computed directly where these nearly cancel.
template <int D>
int iterate(const MassSystem<D>& m, const double* size, const double* known, RealVec& r, RealVec& step)
{
  const bool shared = m.mass.shared;
  const int n = m.rows.size();
  RealVec w(r.size(), 0.0), y(r.size()), q(r.size()), t(r.size()),
      late(shared ? m.rows.halo.shared.size() * D : 0, 0.0);
  double square[D], goal[D], enough[D], sum[4 * D];      // several ranks: w q, r q, r r, q q
  const double *rq = sum + D, *rr = sum + 2 * D, *qq = sum + 3 * D;
  step.assign(r.size(), 0.0);
  for (int i = 0; i < D; ++i) {
    goal[i]   = 1e-28 * size[i];
    enough[i] = 1e-16 * size[i];
  }
  Dirs<D> rho, turn = Dirs<D>::Zero();
  if (shared) std::copy(known, known + D, rho.data());
  else m.dots(r, r, rho.data());
  bool stuck = false;                                // M is singular in the direction w, to round-off
  for (int it = 0; !stuck && it <= 1000; ++it) {
    if (below<D>(rho.data(), goal)) {
      m.residual(r, t, square);
      if (below<D>(square, goal)) return it;
    }
    for (int k = 0; k < n; ++k) {
      const Dirs<D> next = dirs<D>(r.data(), k) + turn * dirs<D>(w.data(), k);
      dirs<D>(w.data(), k) = next;
      dirs<D>(t.data(), k) = next;
    }
    Dirs<D> part, left = Dirs<D>::Zero();
    if (shared) {
      m.apply(w, r, turn.data(), late, t, y, q, sum);
      part = dirs<D>(sum, 0);
      rho  = dirs<D>(sum, 2);
    } else {
      part = m.apply(w, t, y, q);
    }
    stuck = true;
    for (int i = 0; i < D; ++i) {
      if (rho[i] > goal[i] && part[i] > 0.0) stuck = false;
      part[i] = part[i] > 0.0 ? rho[i] / part[i] : 0.0;
    }
    for (int k = 0; k < n; ++k) {
      dirs<D>(step.data(), k) += part * dirs<D>(w.data(), k);
      const Dirs<D> next = dirs<D>(r.data(), k) - part * dirs<D>(q.data(), k);
      dirs<D>(r.data(), k) = next;
      left += next * next;
    }
    bool cancels = false;
    for (int i = 0; shared && i < D; ++i) {
      left[i] = rr[i] - 2.0 * part[i] * rq[i] + part[i] * part[i] * qq[i];
      cancels = cancels || left[i] < CANCELS * rr[i];
    }
    if (cancels) m.dots(r, r, left.data());
    for (int i = 0; i < D; ++i) turn[i] = rho[i] > 0.0 ? left[i] / rho[i] : 0.0;
    rho = left;
  }
  m.residual(r, t, square);
  return below<D>(square, enough) ? 1000 : -1;
}

// If M is singular to round-off: iterative refinement with M + shift I. In: b, and the initial u; out: u
// without the last correction step. Returns the iterations; -1: the residual of M has not converged
template <int D>
int refine(MassSystem<D>& m, const double* size, const RealVec& b, RealVec& u, RealVec& step)
{
  RealVec r(u.size()), q(u.size()), t(u.size());
  double square[D], enough[D], rho[D];
  int all = 0;
  for (int i = 0; i < D; ++i) enough[i] = 1e-24 * size[i];
  m.shift = SHIFT;
  step.assign(u.size(), 0.0);
  for (int k = 0; k <= REFINEMENTS; ++k) {
    m.backward(step, t);
    for (size_t i = 0; i < u.size(); ++i) u[i] += m.free[i] * t[i];
    step.assign(u.size(), 0.0);
    multiply<D>(m.mass, u, q);
    for (size_t i = 0; i < u.size(); ++i) r[i] = m.free[i] * (b[i] - q[i]);
    m.dots(r, r, square);
    if (below<D>(square, enough)) return all;
    m.forward(r, r);
    if (m.mass.shared) m.dots(r, r, rho);
    const int it = k < REFINEMENTS ? iterate<D>(m, size, rho, r, step) : -1;
    if (it < 0) break;
    all += it + 1;
  }
  for (int i = 0; i < D; ++i) enough[i] *= 1e8;
  return below<D>(square, enough) ? all : -1;
}

// contribution of unchanged rows to the others: sum M x of all ranks [n*D], scaled
template <int D>
void rim_parts(const Dofs& s, const MassValues& m, const RealVec& scale, const RealVec& x, RealVec& part)
{
  for (const MassRim& q : m.rows.rim)
    for (int i = 0; i < D; ++i)
      part[q.row * D + i] += s.mass.M[q.from] * scale[q.row] * x[q.beyond * D + i];
  sum_rows<D>(m, part);
}

// is the contribution of the change u to the unchanged rows negligible by (3.14)?
template <int D>
bool rim_stays(const Dofs& s, const MassRows& rows, const double* size, const RealVec& u)
{
  double square[D] = {}, goal[D];
  for (const MassRim& q : rows.rim)
    for (int i = 0; i < D; ++i) {
      const double part = s.bound.fixed[q.beyond * D + i] ? 0.0 : s.mass.M[q.from] * u[q.row * D + i];
      square[i] += part * part / s.mass.M_diag[q.beyond];
    }
  comm_sum(square, D);
  for (int i = 0; i < D; ++i) goal[i] = 1e-28 * size[i];
  return below<D>(square, goal);
}

// M = L L^T of one direction of an island; rows that are not free: unit rows. A row that M leaves
// undetermined, as those of a domain with fewer corners than its cell has nodes, stays at rest
void factor_island(int n, const int* from, const RealVec& M, const bool* free, double* L)
{
  for (int a = 0; a < n; ++a)
    for (int b = 0; b <= a; ++b) {
      const int k = from[pair_index(a, b)];
      double sum  = a == b ? 1.0 : 0.0;
      if (free[a] && free[b]) sum = k < 0 ? 0.0 : M[k];
      const double diag = sum;
      for (int c = 0; c < b; ++c) sum -= L[pair_index(a, c)] * L[pair_index(b, c)];
      if (a == b && !(sum > 1e-12 * diag)) sum = AT_REST;
      L[pair_index(a, b)] = a == b ? std::sqrt(sum) : sum / L[pair_index(b, b)];
    }
}

// rows of islands: elimination
template <int D>
void solve_islands(const Dofs& s, const MassRows& rows, const RealVec& f, RealVec& x)
{
  const int* from = rows.island_from.data();
  double L[MAX_ISLAND * (MAX_ISLAND + 1) / 2], y[MAX_ISLAND];
  bool free[MAX_ISLAND], before[MAX_ISLAND];
  for (int i = 0; i < rows.island.size(); ++i) {
    const int n = rows.island.count(i), *row = rows.island.begin(i);
    for (int d = 0; d < D; ++d) {
      for (int a = 0; a < n; ++a)
        free[a] = !s.bound.fixed[row[a] * D + d] && s.mass.M_diag[row[a]] > 0.0;
      if (d == 0 || !std::equal(free, free + n, before)) {
        factor_island(n, from, s.mass.M, free, L);
        std::copy_n(free, n, before);
      }
      for (int a = 0; a < n; ++a) {
        y[a] = free[a] ? f[row[a] * D + d] : 0.0;
        for (int b = 0; b < n && free[a]; ++b) {     // prescribed rows
          const int k = from[b > a ? pair_index(b, a) : pair_index(a, b)];
          if (!free[b] && k >= 0) y[a] -= s.mass.M[k] * x[row[b] * D + d];
        }
        for (int b = 0; b < a; ++b) y[a] -= L[pair_index(a, b)] * y[b];
        y[a] /= L[pair_index(a, a)];
      }
      for (int a = n - 1; a >= 0; --a) {
        y[a] /= L[pair_index(a, a)];
        for (int b = 0; b < a; ++b) y[b] -= L[pair_index(a, b)] * y[a];
        if (free[a]) x[row[a] * D + d] = y[a];
      }
    }
    from += pair_count(n);
  }
}

// near: the rows are a subset; returns -1 also if rows outside of it would change
template <int D>
int solve(const Dofs& s, const MassRows& rows, int guess, const std::vector<char>& begun, const RealVec& f,
          RealVec& x)
{
  const int n     = rows.size();
  const bool near = rows.of == ROWS_NEAR;
  solve_islands<D>(s, rows, f, x);
  RealVec scale(n), u(n * D), r(n * D), q(n * D), t(n * D), b(n * D), sum(n * D), step;
  for (int k = 0; k < n; ++k) {
    const double diag = s.mass.M_diag[rows.row[k]];
    scale[k] = diag > 0.0 ? 1.0 / std::sqrt(diag) : 0.0;
  }
  MassSystem<D> m{mass_values(s, rows, scale), rows, RealVec(n * D, 0.0)};
  if (near) rim_parts<D>(s, m.mass, scale, x, q);
  const auto begins = [&](int row) { return row < guess || (!begun.empty() && begun[row]); };
  const bool all_begin = !begun.empty() && std::find(begun.begin(), begun.end(), 0) == begun.end();
  // initial guess of the others: f over the row sum, exact for smooth solutions
  for (int k = 0; k < n * D; ++k) {
    const int dof = rows.row[k / D] * D + k % D;
    m.free[k] = !s.bound.fixed[dof] && scale[k / D] > 0.0;
    b[k] = m.free[k] * (f[dof] * scale[k / D] - q[k]);
    t[k] = scale[k / D] > 0.0 ? 1.0 / scale[k / D] : 0.0;
  }
  double size[D], known[D];
  if (!all_begin) multiply_here<D>(m.mass, t, sum);
  m.dots_here(b, b, size);
  if (m.mass.shared) halo_sum(rows.halo, D, sum, size, D);
  for (int k = 0; k < n * D; ++k)
    u[k] = m.free[k] && !begins(rows.row[k / D]) ? b[k] / std::max(1.0, sum[k] * scale[k / D])
           : scale[k / D] > 0.0                  ? x[rows.row[k / D] * D + k % D] / scale[k / D]
                                                 : 0.0;
  m.start(b, u, r, known);
  int it = iterate<D>(m, size, known, r, step);
  if (it < 0) it = refine<D>(m, size, b, u, step);
  m.backward(step, t);
  for (int k = 0; k < n * D; ++k) {
    if (!(m.free[k] > 0.0)) continue;
    double& to = x[rows.row[k / D] * D + k % D];
    const double before = to;
    to   = (u[k] + t[k]) * scale[k / D];
    t[k] = to - before;
  }
  return near && !rim_stays<D>(s, rows, size, t) ? -1 : it;
}

}  // namespace

void mass_part(const Dofs& s, const RealVec& x, RealVec& y)
{
  if (s.rows.dim == 2) multiply_lumped<2>(s, s.rows.nrow, x.data(), y);
  else multiply_lumped<3>(s, s.rows.nrow, x.data(), y);
}

void mass_elements(const Dofs& s, const RealVec& x, RealVec& y)
{
  if (!s.rows.hung) {
    if (s.rows.dim == 2) multiply_lumped<2>(s, s.rows.nfe, x.data(), y);
    else multiply_lumped<3>(s, s.rows.nfe, x.data(), y);
    return;
  }
  const RealVec& M = s.mass.M_elem;
  y.assign(x.size(), 0.0);
  if (s.rows.dim == 2) multiply<2>(s, M, s.rows.nfe, x.data(), y.data());
  else multiply<3>(s, M, s.rows.nfe, x.data(), y.data());
}

void mass_multiply(const Dofs& s, const RealVec& x, RealVec& y)
{
  mass_part(s, x, y);
  sys_sum(s.pattern.A, y);
}

namespace {

// x = f / M in the rows of the grid that are not among rows: nothing couples them                (6.47)
void divide_others(const Dofs& s, const MassRows& rows, const RealVec& f, RealVec& x)
{
  if (!s.rows.lumps || sys_shared(s.pattern.A)) return;
  const int dim = s.rows.dim;
  size_t k = 0;
  for (int r = s.rows.nfe; r < s.rows.nrow; ++r) {
    while (k < rows.row.size() && rows.row[k] < r) ++k;
    if ((k < rows.row.size() && rows.row[k] == r) || !(s.mass.M_diag[r] > 0.0)) continue;
    for (int i = r * dim; i < (r + 1) * dim; ++i)
      if (!s.bound.fixed[i]) x[i] = f[i] / s.mass.M_diag[r];
  }
}

}  // namespace

int mass_solve(const Dofs& s, MassRowsOf of, int guess, const RealVec& f, RealVec& x)
{
  const bool known = s.mass.mass_rows && s.mass.mass_of == s.pattern.number && s.mass.mass_rows->of == of;
  const auto rows  = known ? s.mass.mass_rows : mass_rows_of(s, of);
  divide_others(s, *rows, f, x);
  const int it = s.rows.dim == 2 ? solve<2>(s, *rows, guess, {}, f, x) : solve<3>(s, *rows, guess, {}, f, x);
  return it >= 0 ? it : mass_factor(s, of, f, x);
}

int mass_project(const Dofs& s, const std::vector<char>& begun, const RealVec& momentum, RealVec& v)
{
  const MassRows& rows = *s.mass.mass_rows;
  divide_others(s, rows, momentum, v);
  const int it = s.rows.dim == 2 ? solve<2>(s, rows, s.rows.nfe, begun, momentum, v)
                            : solve<3>(s, rows, s.rows.nfe, begun, momentum, v);
  if (it >= 0) return it;
  return s.rows.hung ? mass_solve(s, ROWS_ALL, s.rows.nfe, momentum, v)
      : mass_factor(s, ROWS_GRID, momentum, v);
}

void point_momentum(const ActiveGrid& grid, const Dofs& s, const RealVec& vc, RealVec& out)
{
  assem_scatter_corners(grid, s, point_corner_momentum(s.mass.corner_mass, s.rows.dim, vc), out);
}
