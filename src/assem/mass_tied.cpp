#include <algorithm>

#include "assem/assem.h"
#include "base/sort_once.h"
#include "base/sum.h"

namespace {

// conjugate gradients with the diagonal for A x = f among n unknowns, to 1e-14 of f, or 1e-8 after 1000
// iterations; returns these, -1: not converged
//   in   counts   this rank adds a free unknown to sums;   r   f
template <class Free, class Counts, class Apply>
int gradients(const Dofs& s, const RealVec& diag, size_t n, Free free, Counts counts, Apply apply, RealVec& r,
              RealVec& x)
{
  RealVec q(x.size()), w(x.size(), 0.0);
  const auto weighed = [&](const RealVec& v) {                 // v^T diag^-1 v
    return dof_total(s, sum_terms(n, [&](size_t i) { return counts(i) ? v[i] * v[i] / diag[i] : 0.0; }));
  };
  const double goal = 1e-28 * weighed(r);
  apply(x, q);
  for (size_t i = 0; i < n; ++i) r[i] -= q[i];
  double rho = weighed(r), before = 0.0;
  int it = 0;
  for (; it <= 1000 && rho > goal; ++it) {
    for (size_t i = 0; i < n; ++i) w[i] = free(i) ? r[i] / diag[i] + (it ? rho / before : 0.0) * w[i] : 0.0;
    apply(w, q);
    const double wq = dof_total(s, sum_terms(n, [&](size_t i) { return counts(i) ? w[i] * q[i] : 0.0; }));
    if (!(wq > 0.0)) break;
    for (size_t i = 0; i < n; ++i) {
      if (!free(i)) continue;
      x[i] += rho / wq * w[i];
      r[i] -= rho / wq * q[i];
    }
    before = rho;
    rho    = weighed(r);
  }
  return rho <= 1e12 * goal ? it : -1;
}

// Masters of ties, where masses are lumped and the rank is alone: they alone depend on one another
struct TiedMasses {
  IntVec dof;                  // of each master
  IntVec at;                   // [Ties::master.item] its index in dof
  RealVec mass, diag;          // [dof] its own; with what its dependent dofs bring
};

TiedMasses tied_masses(const Dofs& s)
{
  const Ties& tie = s.bound.tie;
  TiedMasses t;
  t.dof = tie.master.item;
  sort_once(t.dof);
  for (int m : tie.master.item)
    t.at.push_back(static_cast<int>(std::lower_bound(t.dof.begin(), t.dof.end(), m) - t.dof.begin()));
  for (int m : t.dof) t.mass.push_back(s.mass.lumped[m / s.rows.dim]);
  t.diag = t.mass;
  for (size_t k = 0; k < tie.dof.size(); ++k)
    for (int q = tie.master.off[k]; q < tie.master.off[k + 1]; ++q)
      t.diag[t.at[q]] += tie.coef[q] * tie.coef[q] * s.mass.lumped[tie.dof[k] / s.rows.dim];
  return t;
}

// y = T^T M T x
void tied_multiply(const Dofs& s, const TiedMasses& t, const RealVec& x, RealVec& y)
{
  const Ties& tie = s.bound.tie;
  for (size_t i = 0; i < x.size(); ++i) y[i] = t.mass[i] * x[i];
  for (size_t k = 0; k < tie.dof.size(); ++k) {
    double sum = 0.0;
    for (int q = tie.master.off[k]; q < tie.master.off[k + 1]; ++q) sum += tie.coef[q] * x[t.at[q]];
    sum *= s.mass.lumped[tie.dof[k] / s.rows.dim];
    for (int q = tie.master.off[k]; q < tie.master.off[k + 1]; ++q) y[t.at[q]] += tie.coef[q] * sum;
  }
}

// mass_solve_tied for lumped masses: what no equation holds is a division; conjugate gradients for the
// masters
int solve_tied_lumped(const Dofs& s, const RealVec& f, RealVec& x)
{
  RealVec b = f;
  tie_force(s, b);
  for (int i = 0; i < s.rows.nfe * s.rows.dim; ++i) {
    const double mass = s.mass.lumped[i / s.rows.dim];
    if (s.bound.fixed[i] == DOF_FREE) x[i] = mass > 0.0 ? b[i] / mass : 0.0;
  }
  const TiedMasses t = tied_masses(s);
  const size_t n = t.dof.size();
  RealVec y(n), r(n);
  for (size_t i = 0; i < n; ++i) {
    y[i] = x[t.dof[i]];
    r[i] = b[t.dof[i]];
  }
  const auto free = [&](size_t i) { return s.bound.fixed[t.dof[i]] == DOF_FREE && t.diag[i] > 0.0; };
  const auto apply = [&](const RealVec& in, RealVec& out) { tied_multiply(s, t, in, out); };
  const int it = gradients(s, t.diag, n, free, free, apply, r, y);
  for (size_t i = 0; i < n; ++i)
    if (free(i)) x[t.dof[i]] = y[i];
  tie_follow(s, false, x);
  return it;
}

}  // namespace

int mass_solve_tied(const Dofs& s, double half, const RealVec& f, RealVec& x)
{
  const bool damped = half > 0.0 && s.mass.damped;
  if (!damped && !s.mass.lumped.empty() && !s.rows.split && !s.rows.hung && s.rows.nrow == s.rows.nfe)
    return solve_tied_lumped(s, f, x);
  const Ties& tie = s.bound.tie;
  const int n = s.rows.nfe * s.rows.dim;
  RealVec own(s.rows.neq(), 0.0), Cx, b = f;
  for (int i = 0; i < n; ++i) own[i] = s.mass.M_diag[i / s.rows.dim];
  for (int i = 0; i < n && damped; ++i) own[i] += half * s.mass.C_diag[i];
  RealVec diag = own;
  for (size_t k = 0; k < tie.dof.size(); ++k)
    for (int j = tie.master.off[k]; j < tie.master.off[k + 1]; ++j)
      diag[tie.master.item[j]] += tie.coef[j] * tie.coef[j] * own[tie.dof[k]];
  const auto free = [&](size_t i) { return s.bound.fixed[i] == DOF_FREE && diag[i] > 0.0; };
  const auto apply = [&](RealVec& in, RealVec& out) {          // out = T^T (M + half C) T in
    tie_follow(s, false, in);
    mass_multiply(s, in, out);
    if (damped) {
      damping_multiply(s, in, Cx);
      for (size_t i = 0; i < out.size(); ++i) out[i] += half * Cx[i];
    }
    tie_force(s, out);
  };
  const auto counts = [&](size_t i) { return free(i) && s.rows.counts(i); };
  tie_force(s, b);
  for (int i = 0; i < n; ++i)
    if (s.bound.fixed[i] == DOF_FREE) x[i] = 0.0;
  const int it = gradients(s, diag, n, free, counts, apply, b, x);
  tie_follow(s, false, x);
  return it;
}
