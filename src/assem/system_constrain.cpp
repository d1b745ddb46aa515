#include <algorithm>
#include <cmath>
#include <string>

#include "assem/assem.h"

namespace {

void fix(System& s, int dof, double increment, double rate, int grid_bc)
{
  s.fixed[dof]   = 1;
  s.target[dof]  = increment;
  s.rate[dof]    = rate;
  s.grid_bc[dof] = grid_bc;
}

Status bad_node(Problem& p, const Prescribed& b, int n, double time)
{
  p.note = value_text(p.m, "BOUNDARY", b.place, b.value, b.amplitude, "node " + std::to_string(p.m.mesh.node_label[n]), &p.m.mesh.X[3 * n], time);
  return BAD_VALUE;
}

Status bad_grid_node(Problem& p, const GridBc& b, const double* x, double time)
{
  p.note = value_text(p.m, "GRID BOUNDARY", b.place, b.value, b.amplitude, "the grid node", x, time);
  return BAD_VALUE;
}

}  // namespace

Status system_constrain(Problem& p, const Step& step, double t_step0, double t_step1)
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
  const bool moves = step.proc == PROC_DYNAMIC;
  // a ramp goes straight from where the node is to the value at the end of the step                               (6.16)
  const double part0 = std::min(1.0, t_step0 / step.period), part1 = std::min(1.0, t_step1 / step.period);
  const double ramped = part1 < 1.0 ? (part1 - part0) / (1.0 - part0) : 1.0;
  for (const Prescribed& b : step.prescribed)
    for (int n : b.node) {
      const int r = s.row_of_node[n];
      if (r < 0) continue;
      const double value = prescribed_value(m, b, &m.mesh.X[3 * n], t_step1, total1);
      if (!std::isfinite(value)) return bad_node(p, b, n, total1);
      double rate = 0.0;
      if (moves && dt > 0.0) {
        rate = (value - prescribed_value(m, b, &m.mesh.X[3 * n], t_step1 - back, total1 - back)) / back;
        if (!std::isfinite(rate)) return bad_node(p, b, n, total1 - back);
      }
      for (int i = b.first; i <= b.last && i < dim; ++i) {
        const double increment = value - p.st.n.u[n * dim + i];
        fix(s, r * dim + i, b.ramp ? ramped * increment : increment, rate, -1);
      }
    }
  for (size_t k = 0; k < m.grid_bc.size(); ++k) {
    const GridBc& b = m.grid_bc[k];
    for (int v = 0; v < p.grid.nnode; ++v) {
      double x[3];
      grid_node_place(m.grid, dim, p.grid.key[v], x);
      if (std::fabs(x[b.axis] - b.position) > 1e-6 * m.grid.h[b.axis]) continue;
      auto at = [&](double t) { return support_value(m, b.value, b.amplitude, x, t_step0 + t, total0 + t); };
      const double begin = at(0.0), end = at(dt);
      if (!std::isfinite(begin)) return bad_grid_node(p, b, x, total0);
      if (!std::isfinite(end)) return bad_grid_node(p, b, x, total1);
      const double d     = end - begin;
      const double rate  = moves && dt > 0.0 ? (end - at(dt - back)) / back : 0.0;
      const double rate0 = moves && dt > 0.0 ? (at(back) - begin) / back : 0.0;
      if (!std::isfinite(rate)) return bad_grid_node(p, b, x, total1 - back);
      if (!std::isfinite(rate0)) return bad_grid_node(p, b, x, total0 + back);
      for (int i = b.first; i <= b.last && i < dim; ++i) {
        const int dof = (s.nfe + v) * dim + i;
        fix(s, dof, d, rate, static_cast<int>(k));
        s.rate0[dof] = rate0;
      }
    }
  }
  return STATUS_OK;
}
