#include <algorithm>
#include <array>
#include <cmath>

#include "assem/assem.h"

namespace {

// y += M x of the rows from first on and their columns from there on
template <int D>
void multiply(const System& s, int first, const double* x, double* y)
{
  for (int r = first; r < s.nrow; ++r) {
    const int diag = s.A.off[r + 1] - 1;
    double row[D];
    for (int i = 0; i < D; ++i) row[i] = s.M[diag] * x[r * D + i];
    for (int k = s.A.off[r]; k < diag; ++k) {
      if (s.A.col[k] < first) continue;
      const int c    = s.A.col[k] * D;
      const double m = s.M[k];
      for (int i = 0; i < D; ++i) {
        row[i] += m * x[c + i];
        y[c + i] += m * x[r * D + i];
      }
    }
    for (int i = 0; i < D; ++i) y[r * D + i] += row[i];
  }
}

template <int D>
using Each = std::array<double, D>;    // a number for each direction

// a b of each direction, from the row first on
template <int D>
Each<D> dot(int first, const RealVec& a, const RealVec& b)
{
  Each<D> sum{};
  for (size_t i = static_cast<size_t>(first) * D; i < a.size(); i += D)
    for (int d = 0; d < D; ++d) sum[d] += a[i + d] * b[i + d];
  return sum;
}

// conjugate gradients; a direction that has arrived waits for the others
template <int D>
int solve(const System& s, int first, const RealVec& f, RealVec& x)
{
  const int n = s.neq(), begin = first * D;
  RealVec r(n, 0.0), z(n, 0.0), q(n, 0.0), w(n, 0.0), inverse(n, 0.0);     // inverse of the diagonal, 0: held
  const auto multiply_by = [&](const RealVec& v) {
    std::fill(q.begin(), q.end(), 0.0);
    multiply<D>(s, first, v.data(), q.data());
    sys_sum(s.A, q);
  };
  Each<D> goal{}, rho{}, before{};       // goal: squared, in the norm of D^-1
  std::array<bool, D> on;
  on.fill(true);
  multiply_by(x);
  for (int i = begin; i < n; ++i) {
    const double m = s.M_diag[i / D];
    if (s.fixed[i] || !(m > 0.0)) continue;
    inverse[i] = 1.0 / m;
    r[i]       = f[i] - q[i];
    goal[i % D] += 1e-28 * f[i] * f[i] / m;
  }
  int it = 0;
  for (; it <= 1000; ++it) {
    for (int i = begin; i < n; ++i) z[i] = r[i] * inverse[i];
    rho = dot<D>(first, r, z);
    Each<D> turn{}, part{};
    for (int d = 0; d < D; ++d) {
      on[d]   = on[d] && rho[d] > goal[d];
      turn[d] = it && on[d] ? rho[d] / before[d] : 0.0;
    }
    if (std::none_of(on.begin(), on.end(), [](bool yes) { return yes; })) break;
    for (int i = begin; i < n; ++i) w[i] = z[i] + turn[i % D] * w[i];
    multiply_by(w);
    for (int i = begin; i < n; ++i)
      if (inverse[i] == 0.0) q[i] = 0.0;
    const Each<D> wq = dot<D>(first, w, q);
    for (int d = 0; d < D; ++d) {
      on[d]   = on[d] && wq[d] > 0.0;                // else M is singular in the direction w
      part[d] = on[d] ? rho[d] / wq[d] : 0.0;
    }
    for (int i = begin; i < n; ++i) {
      x[i] += part[i % D] * w[i];
      r[i] -= part[i % D] * q[i];
    }
    before = rho;
  }
  for (int d = 0; d < D; ++d)
    if (!(rho[d] <= 1e12 * goal[d])) return -1;
  return it;
}

}  // namespace

void mass_part(const System& s, const RealVec& x, RealVec& y)
{
  y.assign(x.size(), 0.0);
  if (s.dim == 2) multiply<2>(s, 0, x.data(), y.data());
  else multiply<3>(s, 0, x.data(), y.data());
}

void mass_multiply(const System& s, const RealVec& x, RealVec& y)
{
  mass_part(s, x, y);
  sys_sum(s.A, y);
}

int mass_solve(const System& s, int first, const RealVec& f, RealVec& x)
{
  return s.dim == 2 ? solve<2>(s, first, f, x) : solve<3>(s, first, f, x);
}

void point_momentum(const Problem& p, const RealVec& vc, RealVec& out)
{
  const RealVec q = point_corner_momentum(p.st.points, p.m.dim, vc, p.sys.my_point);
  assem_scatter_corners(p, q, out);
}
