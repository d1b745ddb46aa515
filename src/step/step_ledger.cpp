#include <algorithm>
#include <cmath>

#include "step/step.h"

namespace {

// x cross y; plane problems have component 3 only
void add_cross(const double* x, const double* y, double* out)
{
  out[0] += x[1] * y[2] - x[2] * y[1];
  out[1] += x[2] * y[0] - x[0] * y[2];
  out[2] += x[0] * y[1] - x[1] * y[0];
}

// local sums stay in registers
template <int D>
void add_nodes(const Mesh& mesh, const Dofs& dofs, const Level& l, Ledger& g)
{
  const bool lumped = !dofs.mass.lumped.empty() && !dofs.rows.hung;
  // implicit steps: rows of nodes without couplings
  const IntVec& coupled = dofs.mass.coupled;
  const bool single = lumped || (!dofs.rows.hung && (coupled.empty() || coupled.front() >= dofs.rows.nfe));
  const RealVec& mass = lumped ? dofs.mass.lumped : dofs.mass.M_here;       // read where single
  RealVec Mv;
  if (!single) mass_elements(dofs, dof_of_nodes(dofs, l.v), Mv);
  double kinetic = 0.0, sum[D] = {}, spin[3] = {};
  for (int r = 0; r < dofs.rows.nfe; ++r) {
    const int node = dofs.rows.node_of_row[r];
    const bool here = !lumped || dofs.rows.counts(r * D);         // the lumped mass is that of all ranks
    double x[D], q[D];
    for (int i = 0; i < D; ++i) {
      const double v = l.v[node * D + i];
      x[i] = mesh.X[3 * node + i] + l.u[node * D + i];
      q[i] = !single ? Mv[r * D + i] : here ? mass[r] * v : 0.0;
      kinetic += 0.5 * v * q[i];
      sum[i] += q[i];
    }
    if (D == 3) add_cross(x, q, spin);
    else spin[2] += x[0] * q[1] - x[1] * q[0];
  }
  g.kinetic += kinetic;
  for (int i = 0; i < D; ++i) g.momentum[i] += sum[i];
  for (int i = 0; i < 3; ++i) g.angular[i] += spin[i];
}

// sums over the ranks, in one message
void sum_ranks(const Dofs& dofs, Ledger& g, double& work)
{
  double sum[11] = {g.kinetic,    g.momentum[0], g.momentum[1], g.momentum[2], g.angular[0], g.angular[1],
                    g.angular[2], g.strain,      g.plastic,     work,          g.cohesive};
  dof_total(dofs, sum, 11);
  g.cohesive = sum[10];
  work      = sum[9];
  g.strain  = sum[7];
  g.plastic = sum[8];
  g.kinetic = sum[0];
  std::copy(sum + 1, sum + 4, g.momentum);
  std::copy(sum + 4, sum + 7, g.angular);
}

// 1/8 a M a of the free dofs of nodes owned by this rank. Times dt^2 it is the difference between the square
// of the velocity at t(n) and the product of the velocities at both half steps               (6.33)
template <int D>
double leap_energy(const Dofs& dofs, const Level& l)
{
  double sum = 0.0;
  if (dofs.mass.lumped.empty() || dofs.rows.hung ||
      dofs.bound.fixed.size() != static_cast<size_t>(dofs.rows.neq())) return 0.0;
  const int *node = dofs.rows.node_of_row.data(), *fixed = dofs.bound.fixed.data();
  const double *mass = dofs.mass.lumped.data(), *acc = l.a.data();
  for (int r = 0; r < dofs.rows.nfe; ++r)
    for (int i = 0; i < D; ++i) {
      const double a = acc[node[r] * D + i];
      if (fixed[r * D + i] != DOF_FIXED && dofs.rows.counts(r * D + i)) sum += mass[r] * a * a;
    }
  return 0.125 * sum;
}

double leap_energy(const Dofs& dofs, const Level& l)
{
  return dofs.rows.dim == 2 ? leap_energy<2>(dofs, l) : leap_energy<3>(dofs, l);
}

// local sums stay in registers
template <int D>
void add_points(const Points& pts, const RealVec& mom, const Level& l, Ledger& g)
{
  double kinetic = 0.0, sum[D] = {}, spin[3] = {};
  for (int c = 0; c < pts.ncorner; ++c) {
    double x[D];
    const double* q = &mom[static_cast<size_t>(c) * D];
    for (int i = 0; i < D; ++i) {
      x[i] = pts.Xc[c * D + i] + l.uc[c * D + i];
      kinetic += q[i] * l.vc[c * D + i];
      sum[i] += q[i];
    }
    if (D == 3) add_cross(x, q, spin);
    else spin[2] += x[0] * q[1] - x[1] * q[0];
  }
  g.kinetic += 0.5 * kinetic;
  for (int i = 0; i < D; ++i) g.momentum[i] += sum[i];
  for (int i = 0; i < 3; ++i) g.angular[i] += spin[i];
}

// Strain of the size of round-off: coordinates have 16 digits, and the element size is a hundredth of them
// (no test)
const double ROUNDING = 1e-14;

// sum of E V over elements and points, of all ranks                                 energy
double stiffness_energy(const Model& m, const Elements& el, const Dofs& dofs, const Points& pts)
{
  double sum = 0.0;
  for (const ElemBlock& b : el.block)
    for (int slot : b.live) {
      sum += elem_volume(b, slot) * m.material[model_material(m, b.elem[slot])].young;
    }
  for (int p : dofs.rows.owned_point) sum += pts.V0[p] * m.material[m.body[pts.body[p]].material].young;
  return dof_total(dofs, sum);
}

}  // namespace

double ledger_lost(const Ledger& g)
{
  return g.plastic + g.friction + g.fracture + g.cohesive + g.ghost + g.viscous + g.renewal + g.overlap +
         g.released + g.sudden + g.stopped + g.conversion + g.removed;
}

void ledger_begin_step(Ledger& g)
{
  g.balance0   = g.balance;
  g.external0  = g.external;
  g.step_scale = g.kinetic + g.strain;
}

namespace {

// strain energy of the elements of this rank; known: of those that were intact            [nelem]
double element_energy(const Model& m, const Elements& el, const Level& l, bool nlgeom, const RealVec& known)
{
  double sum = 0.0;
  for (const ElemBlock& b : el.block)
    for (int slot : b.live) {
      const int e = b.elem[slot];
      sum += el.broken(e) < 0 ? known[e] : elem_energy_one(m, el, e, l, l.degr[e], nlgeom);
    }
  return sum;
}

// all but the strain energy of the elements of this rank, which is given
void sum_others(const Model& m, const Elements& el, const Dofs& dofs, const Level& l, double strain,
                State& st, double& work)
{
  Ledger& g = st.ledger;
  g.kinetic = 0.0;
  for (int i = 0; i < 3; ++i) g.momentum[i] = g.angular[i] = 0.0;
  if (!dofs.mass.M.empty()) {
    if (m.dim == 2) add_nodes<2>(m.mesh, dofs, l, g);
    else add_nodes<3>(m.mesh, dofs, l, g);
  }
  if (g.leap > 0.0) g.kinetic -= g.leap * g.leap * leap_energy(dofs, l);
  const RealVec mom = point_corner_momentum(dofs.mass.corner_mass, m.dim, l.vc);
  if (m.dim == 2) add_points<2>(st.points, mom, l, g);
  else add_points<3>(st.points, mom, l, g);
  g.strain = strain + point_energy(m, st.points, l, dofs.rows.owned_point);
  g.plastic = g.cohesive = 0.0;
  elem_dissipated(el, l, g.plastic, g.cohesive);
  point_dissipated(m, st.points, l, dofs.rows.owned_point, g.plastic, g.cohesive);
  sum_ranks(dofs, g, work);
  g.kinetic -= g.leap * g.leap * g.leap_grid;
}

}  // namespace

void ledger_sums(const Model& m, const Elements& el, const Dofs& dofs, const Level& l, bool nlgeom,
                 State& st, double& work, RealVec* energy)
{
  sum_others(m, el, dofs, l, elem_energy(m, el, l, nlgeom, energy), st, work);
}

void ledger_balance(int dim, const Level& l, State& st)
{
  Ledger& g = st.ledger;
  g.bond    = bond_energy(st.bonds, dim, l, &g.slip_max, &g.slip_rms);
  g.balance = g.kinetic + g.strain + g.bond + ledger_lost(g) - g.total0 - g.external;
  const double energy = g.kinetic + g.strain;
  g.scale      = std::max({g.scale, energy, std::fabs(g.external)});
  g.step_scale = std::max({g.step_scale, energy, std::fabs(g.external - g.external0)});
}

void ledger_leap(const Dofs& dofs, double dt, State& st)
{
  Ledger& g = st.ledger;
  if (g.leap == dt) return;
  const double energy = dof_total(dofs, leap_energy(dofs, st.n));
  const double change = (energy + g.leap_grid) * (g.leap * g.leap - dt * dt);
  g.kinetic += change;
  g.total0 += change;
  g.leap = dt;
}

void ledger_update(const Model& m, const Elements& el, const Dofs& dofs, const Level& l, bool nlgeom,
                   State& st, RealVec* energy)
{
  double none = 0.0;
  ledger_sums(m, el, dofs, l, nlgeom, st, none, energy);
  ledger_balance(m.dim, l, st);
}

void ledger_known(const Model& m, const Elements& el, const Dofs& dofs, const Level& l, bool nlgeom,
                  const RealVec& energy, State& st)
{
  double none = 0.0;
  sum_others(m, el, dofs, l, element_energy(m, el, l, nlgeom, energy), st, none);
  ledger_balance(m.dim, l, st);
}

void ledger_open(const Model& m, const Elements& el, const Dofs& dofs, State& st)
{
  ledger_update(m, el, dofs, st.n, m.step.front().nlgeom, st);
  Ledger& g  = st.ledger;
  g.total0   = g.kinetic + g.strain + g.bond;
  g.balance  = 0.0;
  g.scale    = g.total0;
  g.rounding = ROUNDING * ROUNDING * stiffness_energy(m, el, dofs, st.points);
}
