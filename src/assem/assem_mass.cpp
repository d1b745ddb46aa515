#include <algorithm>
#include <cmath>

#include "assem/assem.h"
#include "base/comm.h"

namespace {

template <int D>
void multiply(const System& s, const double* x, double* y)
{
  for (int r = 0; r < s.nrow; ++r) {
    const int diag = s.A.off[r + 1] - 1;
    double row[D];
    for (int i = 0; i < D; ++i) row[i] = s.M[diag] * x[r * D + i];
    for (int k = s.A.off[r]; k < diag; ++k) {
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

// y = M x for one direction, rows from first on; masked entries of x and y are zero
void multiply_one(const System& s, int first, const RealVec& x, RealVec& y)
{
  std::fill(y.begin() + first, y.end(), 0.0);
  for (int r = first; r < s.nrow; ++r) {
    const int diag = s.A.off[r + 1] - 1;
    y[r] += s.M[diag] * x[r];
    for (int k = s.A.off[r]; k < diag; ++k) {
      const int c = s.A.col[k];
      if (c < first) continue;
      y[r] += s.M[k] * x[c];
      y[c] += s.M[k] * x[r];
    }
  }
  comm_sum(y.data() + first, s.nrow - first);
}

double dot(int first, const RealVec& a, const RealVec& b)
{
  double sum = 0.0;
  for (size_t i = first; i < a.size(); ++i) sum += a[i] * b[i];
  return sum;
}

// one direction d
int solve_one(const System& s, int first, int d, const RealVec& f, RealVec& x)
{
  const int n = s.nrow, dim = s.dim;
  RealVec u(n, 0.0), r(n, 0.0), z(n, 0.0), q(n, 0.0), w(n, 0.0), diag(n, 0.0);
  std::vector<char> free(n, 0);
  double scale = 0.0;
  for (int i = first; i < n; ++i) {
    diag[i] = s.M_diag[i];
    free[i] = !s.fixed[i * dim + d] && diag[i] > 0.0;
    u[i]    = x[i * dim + d];
  }
  multiply_one(s, first, u, q);
  for (int i = first; i < n; ++i) {
    if (!free[i]) continue;
    r[i] = f[i * dim + d] - q[i];
    scale += f[i * dim + d] * f[i * dim + d] / diag[i];
  }
  double rho = 0.0, rho0 = 0.0;
  const double goal = 1e-28 * scale;      // squared, in the norm of D^-1
  for (int it = 0; it <= 1000; ++it) {
    for (int i = first; i < n; ++i) z[i] = free[i] ? r[i] / diag[i] : 0.0;
    rho = dot(first, r, z);
    if (rho <= goal) {
      for (int i = first; i < n; ++i) x[i * dim + d] = u[i];
      return it;
    }
    for (int i = first; i < n; ++i) w[i] = z[i] + (it ? rho / rho0 : 0.0) * w[i];
    multiply_one(s, first, w, q);
    for (int i = first; i < n; ++i)
      if (!free[i]) q[i] = 0.0;
    const double wq = dot(first, w, q);
    if (!(wq > 0.0)) break;                          // M is singular in the direction w
    const double alpha = rho / wq;
    for (int i = first; i < n; ++i) {
      u[i] += alpha * w[i];
      r[i] -= alpha * q[i];
    }
    rho0 = rho;
  }
  for (int i = first; i < n; ++i) x[i * dim + d] = u[i];
  return rho <= 1e-16 * scale ? 1000 : -1;
}

}  // namespace

void mass_part(const System& s, const RealVec& x, RealVec& y)
{
  y.assign(x.size(), 0.0);
  if (s.dim == 2) multiply<2>(s, x.data(), y.data());
  else multiply<3>(s, x.data(), y.data());
}

void mass_multiply(const System& s, const RealVec& x, RealVec& y)
{
  mass_part(s, x, y);
  sys_sum(s.A, y);
}

int mass_solve(const System& s, int first, const RealVec& f, RealVec& x)
{
  int most = 0;
  for (int d = 0; d < s.dim; ++d) {
    const int it = solve_one(s, first, d, f, x);
    if (it < 0) return -1;
    most = std::max(most, it);
  }
  return most;
}

void point_momentum(const Problem& p, const RealVec& vc, RealVec& out)
{
  const RealVec q = point_corner_momentum(p.st.points, p.m.dim, vc);
  assem_scatter_corners(p, q, out);
}
