#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "step/step.h"

namespace {

// X x Y, plane problems have only the component 3
void add_cross(const double* x, const double* y, double* out)
{
  out[0] += x[1] * y[2] - x[2] * y[1];
  out[1] += x[2] * y[0] - x[0] * y[2];
  out[2] += x[0] * y[1] - x[1] * y[0];
}

void add_nodes(const Problem& p, const Level& l, Ledger& g)
{
  const int dim = p.m.dim;
  RealVec v(p.dofs.neq(), 0.0), Mv;
  for (int r = 0; r < p.dofs.nfe; ++r)
    for (int i = 0; i < dim; ++i) v[r * dim + i] = l.v[p.dofs.node_of_row[r] * dim + i];
  mass_elements(p.dofs, v, Mv);
  for (int r = 0; r < p.dofs.nfe; ++r) {
    const int node = p.dofs.node_of_row[r];
    double x[3] = {0, 0, 0}, q[3] = {0, 0, 0};
    for (int i = 0; i < dim; ++i) {
      x[i] = p.m.mesh.X[3 * node + i] + l.u[node * dim + i];
      q[i] = Mv[r * dim + i];
      g.kinetic += 0.5 * v[r * dim + i] * q[i];
      g.momentum[i] += q[i];
    }
    add_cross(x, q, g.angular);
  }
}

void sum_motion(Ledger& g)
{
  double sum[7] = {g.kinetic,    g.momentum[0], g.momentum[1], g.momentum[2],
                   g.angular[0], g.angular[1],  g.angular[2]};
  comm_sum(sum, 7);
  g.kinetic = sum[0];
  std::copy(sum + 1, sum + 4, g.momentum);
  std::copy(sum + 4, sum + 7, g.angular);
}

void add_points(const Problem& p, const Level& l, Ledger& g)
{
  const int dim     = p.m.dim;
  const RealVec mom = point_corner_momentum(p.st.points, dim, l.vc, p.dofs.my_point);
  for (int c = 0; c < p.st.points.ncorner; ++c) {
    double x[3] = {0, 0, 0}, q[3] = {0, 0, 0};
    for (int i = 0; i < dim; ++i) {
      x[i] = p.st.points.Xc[c * dim + i] + l.uc[c * dim + i];
      q[i] = mom[c * dim + i];
      g.kinetic += 0.5 * q[i] * l.vc[c * dim + i];
      g.momentum[i] += q[i];
    }
    add_cross(x, q, g.angular);
  }
}

}  // namespace

void ledger_update(Problem& p, const Level& l, bool nlgeom, RealVec* energy)
{
  Ledger& g = p.st.ledger;
  g.kinetic = 0.0;
  for (int i = 0; i < 3; ++i) g.momentum[i] = g.angular[i] = 0.0;
  if (!p.dofs.M.empty()) add_nodes(p, l, g);
  add_points(p, l, g);
  sum_motion(g);
  g.strain = elem_energy(p.m, p.d.el, l, nlgeom, energy) +
             point_energy(p.m, p.st.points, l, p.dofs.my_point);
  comm_sum(&g.strain, 1);
  g.bond    = bond_energy(p.st.bonds, p.m.dim, l, &g.slip_max, &g.slip_rms);
  g.balance = g.kinetic + g.strain + g.bond + g.friction + g.fracture + g.ghost + g.renewal + g.conversion -
              g.total0 - g.external;
  g.scale   = std::max({g.scale, g.kinetic + g.strain, std::fabs(g.external)});
}
