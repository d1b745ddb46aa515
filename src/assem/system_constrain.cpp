#include <cmath>

#include "assem/assem.h"

namespace {

void fix(System& s, int dof, double increment, double rate, int grid_bc)
{
  s.fixed[dof]   = 1;
  s.target[dof]  = increment;
  s.rate[dof]    = rate;
  s.grid_bc[dof] = grid_bc;
}

}  // namespace

void system_constrain(Problem& p, const Step& step, double t_step0, double t_step1)
{
  System& s = p.sys;
  const Model& m = p.m;
  const int dim  = m.dim;
  const double total0 = p.st.n.time, total1 = total0 + (t_step1 - t_step0);
  s.fixed.assign(s.neq(), 0);
  s.target.assign(s.neq(), 0.0);
  s.rate.assign(s.neq(), 0.0);
  s.rate0.assign(s.neq(), 0.0);
  s.grid_bc.assign(s.neq(), -1);
  const double dt = t_step1 - t_step0, back = 1e-3 * dt;     // rates by a difference just before t(n+1)
  for (const Prescribed& b : step.prescribed)
    for (int n : b.node) {
      const int r = s.row_of_node[n];
      if (r < 0) continue;
      const double value = prescribed_value(m, step, b, &m.mesh.X[3 * n], t_step1, total1);
      const double before = prescribed_value(m, step, b, &m.mesh.X[3 * n], t_step1 - back, total1 - back);
      const double rate   = dt > 0.0 ? (value - before) / back : 0.0;
      for (int i = b.first; i <= b.last && i < dim; ++i) fix(s, r * dim + i, value - p.st.n.u[n * dim + i], rate, -1);
    }
  for (size_t k = 0; k < m.grid_bc.size(); ++k) {
    const GridBc& b = m.grid_bc[k];
    for (int v = 0; v < p.grid.nnode; ++v) {
      double x[3];
      grid_unknown_place(m, p.st.points, p.st.n.uc, p.grid, v, x);
      if (std::fabs(x[b.axis] - b.position) > 1e-6 * m.grid.h[b.axis]) continue;
      auto at = [&](double t) { return support_value(m, b.value, b.amplitude, x, t_step0 + t, total0 + t); };
      const double d     = at(dt) - at(0.0);
      const double rate  = dt > 0.0 ? (at(dt) - at(dt - back)) / back : 0.0;
      const double rate0 = dt > 0.0 ? (at(back) - at(0.0)) / back : 0.0;
      for (int i = b.first; i <= b.last && i < dim; ++i) {
        const int dof = (s.nfe + v) * dim + i;
        fix(s, dof, d, rate, static_cast<int>(k));
        s.rate0[dof] = rate0;
      }
    }
  }
}
