#include "assem/assem.h"
#include "base/comm.h"

void assem_slip(const Model& m, const ContactPairs& pairs, const KernelMode& mode, const Jumps& j,
                const State& st, const Dofs& s, SlipTangent& slip)
{
  const int dim = s.rows.dim;
  double f[3], t1[3], slipped, across[3];
  slip = SlipTangent();
  for (int b : s.rows.bond_acts) {
    if (st.bonds.side[b] != SIDE_CONTACT || !pairs.master.count(b)) continue;
    if (st.bonds.contact.friction[b] == 0.0) continue;
    contact_force(m, st.bonds, pairs, b, mode, &j.contact[b * dim], &st.n.lambda[b * dim],
                  st.np1.lambda_n[b], f, nullptr, t1, &slipped, across);
    if (slipped == 0.0) continue;
    slip.bond.push_back(b);
    slip.across.insert(slip.across.end(), across, across + dim);
  }
  slip.any = comm_allreduce_max(static_cast<int>(slip.bond.size())) > 0;
}

void slip_multiply(const SlipTangent& slip, const ContactPairs& pairs, const Dofs& s, RealVec x, RealVec& y)
{
  const int dim = s.rows.dim;
  tie_follow(s, false, x);
  y.assign(s.rows.neq(), 0.0);
  for (size_t q = 0; q < slip.bond.size(); ++q) {
    const int b = slip.bond[q];
    double jump = 0.0;
    for (int k = s.rows.bond.off[b]; k < s.rows.bond.off[b + 1]; ++k)
      for (int i = 0; i < dim; ++i)
        jump += pairs.normal[b * dim + i] * s.rows.bond_w[k] * x[s.rows.bond.item[k] * dim + i];
    for (int k = s.rows.bond.off[b]; k < s.rows.bond.off[b + 1]; ++k)
      for (int i = 0; i < dim; ++i)
        y[s.rows.bond.item[k] * dim + i] += s.rows.bond_w[k] * jump * slip.across[q * dim + i];
  }
  sys_sum(s.pattern.A, y);
  tie_force(s, y);
  for (int i = 0; i < s.rows.neq(); ++i)
    if (s.bound.fixed[i]) y[i] = 0.0;
}
