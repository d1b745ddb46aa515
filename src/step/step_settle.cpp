#include <algorithm>

#include "base/comm.h"
#include "step/step.h"

namespace {

// [neq] at t(n): loads of this step less those at the end of the last step; 0 within a step
RealVec load_jump(Problem& p, const Attempt& a)
{
  const int number = p.st.log.step;
  RealVec jump = a.fext0, before;
  if (p.st.log.inc > 1) return RealVec(jump.size(), 0.0);
  if (number > 1) {
    const Step& last = p.m.step[number - 2];
    if (!assem_loads(p.m, p.d, p.dofs, p.st, last, {last.period, a.total0, 1.0}, p.warned, before).ok())
      before = a.fext0;
    if (!p.st.left_by_removed.empty()) {             // stand for forces of before
      const RealVec left = dof_of_nodes(p.dofs, p.st.left_by_removed);
      for (size_t i = 0; i < before.size(); ++i) before[i] += left[i];
    }
    for (size_t i = 0; i < jump.size(); ++i) jump[i] -= before[i];
  }
  tie_force(p.dofs, jump);
  return jump;
}

// What multipliers of bonds take that change over the increment, of all ranks: the work of their forces, by
// the mean of both ends, less what the bonds store                                            (4.6), (4.8)
double lost_to_multipliers(const Model& m, const State& st)
{
  const Bonds& b = st.bonds;
  const int dim  = m.dim;
  if (std::none_of(m.bond.begin(), m.bond.end(), [](const BondDef& d) { return d.augment > 0; })) return 0.0;
  double sum = 0.0;
  for (int k = 0; k < b.nbond; ++k) {
    if (b.side[k] == SIDE_CONTACT || !b.counts(k)) continue;
    for (int i = k * dim; i < (k + 1) * dim; ++i)
      sum -= 0.5 * (st.np1.lambda[i] - st.n.lambda[i]) * (st.n.slip[i] + st.np1.slip[i]);
  }
  comm_sum(&sum, 1);
  return sum;
}

// ledger entry of forces that are not due to a load jump or a removed support
double* other_cause(Problem& p)
{
  Ledger& g        = p.st.ledger;
  const int number = p.st.log.step;
  const bool first = p.st.log.inc == 1;
  const bool stressed = number == 1 && !p.m.initial_stress.empty();
  if (first && (stressed || !p.m.step[number - 1].change.empty())) return &g.sudden;
  if (first && number == 1) return &g.overlap;       // no stress yet: contact
  if (first && p.m.step[number - 2].proc == PROC_DYNAMIC) return &g.stopped;
  return p.d.grid.of_all.nodes > 0 ? &g.renewal : nullptr;
}

}  // namespace

namespace {

// a.fint0 is that of du = 0, where grounds have moved already: takes their motion back
void ground_at_start(const Problem& p, const Attempt& a, RealVec& R)
{
  const Dofs& s  = p.dofs;
  const Bonds& b = p.st.bonds;
  const int dim  = s.rows.dim;
  if (std::none_of(p.m.bond.begin(), p.m.bond.end(), [](const BondDef& d) { return d.kind == BOND_GROUND; }))
    return;
  RealVec f(R.size(), 0.0);
  double C[9], g0[3], g1[3];
  for (int k : s.rows.bond_acts) {
    if (b.side[k] != SIDE_GROUND) continue;
    bond_ground_motion(p.m, b, k, a.t0, a.total0, g0);
    bond_ground_motion(p.m, b, k, a.t1, a.total1, g1);
    bond_stiffness(b, dim, k, C);
    for (int q = s.rows.bond.off[k]; q < s.rows.bond.off[k + 1]; ++q)
      for (int i = 0; i < dim; ++i)
        for (int j = 0; j < dim; ++j)
          f[s.rows.bond.item[q] * dim + i] += s.rows.bond_w[q] * C[i * dim + j] * (g1[j] - g0[j]);
  }
  sys_sum(s.pattern.A, f);
  for (size_t i = 0; i < R.size(); ++i) R[i] += f[i];
}

}  // namespace

RealVec step_residual_at_start(const Problem& p, const Attempt& a)
{
  const Dofs& dofs = p.dofs;
  RealVec R(dofs.rows.neq());
  for (int i = 0; i < dofs.rows.neq(); ++i) R[i] = a.fint0[i] - a.fext0[i];
  ground_at_start(p, a, R);
  tie_force(dofs, R);
  return R;
}

// ---------------------------------------------------------------------------
// step_settle : energy loss while R0 falls to 0 over the displacement du           doc/theory.md (6.15)
//
// The forces left by broken elements are counted in step_fracture (dt = 0).
// ---------------------------------------------------------------------------
void step_settle(Problem& p, const Attempt& a, const RealVec& rf0, const RealVec& R0)
{
  const Dofs& dofs = p.dofs;
  const int dim    = dofs.rows.dim;
  if (a.dt > 0.0) p.st.ledger.sudden += lost_to_multipliers(p.m, p.st);
  if (a.dt == 0.0 || (p.st.log.inc > 1 && p.d.grid.of_all.nodes == 0)) return;
  const RealVec jump = load_jump(p, a);
  double lost[3]     = {0.0, 0.0, 0.0};              // loads, supports, others
  for (int i = 0; i < dofs.rows.neq(); ++i) {
    if (dofs.bound.fixed[i] || !dofs.rows.counts(i)) continue;
    const int r     = i / dim;
    const bool support = p.st.log.inc == 1 && r < dofs.rows.nfe &&
        rf0[dofs.rows.node_of_row[r] * dim + i % dim] != 0.0;
    lost[0] += 0.5 * jump[i] * a.du[i];
    lost[support ? 1 : 2] -= 0.5 * (R0[i] + jump[i]) * a.du[i];
  }
  for (double& x : lost) x = dof_total(dofs, x);
  p.st.ledger.sudden += lost[0];
  p.st.ledger.released += lost[1];
  if (double* other = other_cause(p)) *other += lost[2];
}
