#include <algorithm>
#include <cmath>

#include "step/step.h"

bool step_grid_rubs(const Model& m)
{
  return std::any_of(m.grid_bc.begin(), m.grid_bc.end(), [](const GridBc& b) { return b.friction > 0.0; });
}

// ---------------------------------------------------------------------------
// step_grid_friction : *GRID BOUNDARY, FRICTION                                       doc/theory.md (6.48)
//
//   in   f     forces of the rows without friction  [neq]
//        v     velocity that the accelerations change by dt acc  [neq]
//   in/out acc accelerations  [neq]
// ---------------------------------------------------------------------------
double step_grid_friction(const Problem& p, const RealVec& f, const RealVec& v, double dt, RealVec& acc)
{
  const Dofs& s   = p.dofs;
  const int dim   = s.rows.dim;
  const auto& all = p.m.grid_bc;
  if (!step_grid_rubs(p.m)) return 0.0;
  // 1. forces of the planes
  RealVec R, change(s.rows.neq(), 0.0), taken;
  mass_multiply(s, acc, R);
  for (int i = s.rows.nfe * dim; i < s.rows.neq(); ++i) R[i] -= f[i];
  // 2. accelerations along them, by the lumped mass
  for (int r = s.rows.nfe; r < s.rows.nrow; ++r) {
    const double mass = s.mass.lumped[r];
    if (mass <= MIN_ROW_SUM * s.mass.M_diag[r]) continue;
    double along[3] = {}, speed = 0.0, rubs = 0.0;
    for (int j = 0; j < dim; ++j) {
      const int i = r * dim + j, k = s.bound.grid_bc[i];
      if (k >= 0 && j == all[k].axis) rubs += all[k].friction * std::max(0.0, -all[k].side * R[i]);
      if (s.bound.fixed[i] != DOF_FREE) continue;
      along[j] = v[i] + dt * acc[i];
      speed += along[j] * along[j];
    }
    speed = std::sqrt(speed);
    if (speed == 0.0 || rubs == 0.0) continue;
    const double part = std::min(rubs / mass, speed / dt) / speed;
    for (int j = 0; j < dim; ++j) change[r * dim + j] = -part * along[j];
  }
  // 3. the power that they take, of all ranks
  mass_multiply(s, change, taken);
  double power = 0.0;
  for (int i = 0; i < s.rows.neq(); ++i) {
    acc[i] += change[i];
    if (s.rows.counts(i)) power -= taken[i] * v[i];
  }
  return dof_total(s, power);
}
