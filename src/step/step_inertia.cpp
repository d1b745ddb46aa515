#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "base/timer.h"
#include "model/scheme.h"
#include "step/step.h"

namespace {

// v of the nodes as a vector of the system
RealVec node_vector(const Problem& p, const RealVec& v)
{
  const int dim = p.m.dim;
  RealVec out(p.dofs.neq(), 0.0);
  for (int r = 0; r < p.dofs.nfe; ++r)
    for (int i = 0; i < dim; ++i) out[r * dim + i] = v[p.dofs.node_of_row[r] * dim + i];
  return out;
}

// velocity of the grid: M-orthogonal projection of the velocities of the points    (3.13)
//   out  momentum   [neq] M v of nodes, sum m S v of points
//        vgrid      [neq] velocity of nodes and of the grid
Failure velocity_at_start(Problem& p, RealVec& momentum, RealVec& vgrid)
{
  vgrid = node_vector(p, p.st.n.v);
  mass_elements(p.dofs, vgrid, momentum);
  point_momentum(p.st.points, p.d.grid, p.dofs, p.st.n.vc, momentum);
  sys_sum(p.dofs.A, momentum);
  if (!p.d.grid.nnode && !p.dofs.hung) return STATUS_OK;
  Timer timer(PHASE_PROJECT);
  const Dofs& s = p.dofs;
  const int first = s.hung ? 0 : s.nfe;
  for (int i = s.nfe * s.dim; i < s.neq(); ++i)
    if (s.fixed[i]) vgrid[i] = s.rate0[i];
  if (mass_solve(s, first, s.nfe, momentum, vgrid) < 0) return MASS_FAILED;
  RealVec Mv;                  // supports: the momentum that goes with their motion
  mass_multiply(s, vgrid, Mv);
  for (int i = first * s.dim; i < s.neq(); ++i)
    if (s.fixed[i] == DOF_FIXED) momentum[i] = Mv[i];
  return STATUS_OK;
}

// internal force at t(n) on the weights of this step: the grid has no acceleration of its own
Failure force_at_start(Problem& p, Attempt& a)
{
  const RealVec zero(p.dofs.neq(), 0.0);
  KernelMode mode;
  mode.finite = a.mode.finite;
  const Failure failure = assem_move(p.m, p.d.grid, p.dofs, zero, a.t0, a.t0, p.st, a.jumps);
  return failure.ok() ? assem_internal(p.m, p.d, p.dofs, mode, a.jumps, p.st, a.fint0) : failure;
}

bool damps(const Problem& p) { return !p.dofs.C.empty() || model_viscous(p.m); }

// Part of the increment in which the nodes go on at their velocities, to get the viscous stress of t(n):
// small against 1, and far above the rounding of strains
const double GLANCE = 1e-3;

// damping force at t(n) of the velocities v [neq]: C v, and that of the viscous stress, as the difference of
// the internal force with and without it; t_step: time of the step. Writes st.np1.
Failure damping_at_start(Problem& p, bool finite, double t_step, double dt, const RealVec& v, RealVec& f)
{
  f.assign(p.dofs.neq(), 0.0);
  if (!p.dofs.C.empty()) damping_multiply(p.dofs, v, f);
  if (!model_viscous(p.m)) return STATUS_OK;
  RealVec ahead = v, with, without;
  for (double& x : ahead) x *= GLANCE * dt;
  Jumps jumps;
  KernelMode mode;
  mode.finite = finite;
  Failure failure = assem_move(p.m, p.d.grid, p.dofs, ahead, t_step, t_step, p.st, jumps);
  if (failure.ok()) failure = assem_internal(p.m, p.d, p.dofs, mode, jumps, p.st, without);
  mode.rate = 1.0 / (GLANCE * dt);
  if (failure.ok()) failure = assem_internal(p.m, p.d, p.dofs, mode, jumps, p.st, with);
  if (!failure.ok()) return failure;
  for (int i = 0; i < p.dofs.neq(); ++i) f[i] += with[i] - without[i];
  return STATUS_OK;
}

// damping at the velocity of the end of the increment, as far as it is known                (6.20)
Failure begin_damping(Problem& p, Attempt& a)
{
  const Scheme& scheme = scheme_of(a.step);
  if (!p.dofs.C.empty()) a.cC = scheme.damping(a.step, a.dt);
  if (a.mode.mid) return STATUS_OK;
  RealVec v(p.dofs.neq()), f;
  for (int i = 0; i < p.dofs.neq(); ++i)
    v[i] = scheme.damping_known(a.step, a.dt, a.vgrid[i], a.agrid.empty() ? 0.0 : a.agrid[i]);
  const Failure failure = damping_at_start(p, a.mode.finite, a.t0, a.dt, v, f);
  for (int i = 0; i < p.dofs.neq() && failure.ok(); ++i) a.g[i] -= f[i];
  return failure;
}

// M a(n): from the accelerations of the nodes, for the grid from its forces: M a = fext - fint on free dofs,
// and from that solution the rows of its supports, whose reaction is not known otherwise. Where points follow
// nodes all forces are asked: the accelerations of the nodes belong to the grid of the step before.
Failure inertia_at_start(Problem& p, Attempt& a, RealVec& Ma)
{
  const Dofs& s = p.dofs;
  const int first = s.hung ? 0 : s.nfe, grid = s.nfe * s.dim;
  a.agrid = node_vector(p, p.st.n.a);
  if (p.d.grid.nnode || s.hung) {
    RealVec f(s.neq(), 0.0), damping(s.neq(), 0.0);
    if (damps(p)) {
      const Failure failure = damping_at_start(p, a.mode.finite, a.t0, a.dt, a.vgrid, damping);
      if (!failure.ok()) return failure;
    }
    Timer timer(PHASE_PROJECT);
    for (int i = first * s.dim; i < s.neq(); ++i) {
      f[i] = a.fext0[i] - a.fint0[i] - damping[i];
      if (s.fixed[i] && i >= grid) a.agrid[i] = (s.rate[i] - s.rate0[i]) / a.dt;
    }
    if (mass_solve(s, first, s.nfe, f, a.agrid) < 0) return MASS_FAILED;
  }
  mass_multiply(s, a.agrid, Ma);
  return STATUS_OK;
}

// fint - fext - reactions at t(n): M a of a scheme that weighs forces of both ends
void unbalanced_at_start(const Problem& p, const Attempt& a, RealVec& f)
{
  const Dofs& s = p.dofs;
  f.resize(s.neq());
  for (int i = 0; i < s.neq(); ++i) {
    f[i] = a.fint0[i] - a.fext0[i];
    if (s.fixed[i] == DOF_FIXED && i / s.dim < s.nfe && !p.st.rf.empty())
      f[i] -= p.st.rf[s.node_of_row[i / s.dim] * s.dim + i % s.dim];
  }
}

}  // namespace

Failure step_inertia_begin(Problem& p, Attempt& a)
{
  const Step& s = a.step;
  Failure failure = velocity_at_start(p, a.momentum, a.vgrid);
  if (!failure.ok()) return failure;

  const Scheme& scheme = scheme_of(s);
  RealVec Ma, force;
  if (scheme.acceleration) {
    if (p.d.grid.nnode || p.dofs.hung || scheme.force) failure = force_at_start(p, a);
    if (failure.ok()) failure = inertia_at_start(p, a, Ma);
    if (!failure.ok()) return failure;
  }
  if (scheme.force) unbalanced_at_start(p, a, force);
  a.cM = scheme.mass(s, a.dt);
  a.g.resize(p.dofs.neq());
  for (int i = 0; i < p.dofs.neq(); ++i)
    a.g[i] = scheme.known(s, a.dt, a.momentum[i], Ma.empty() ? 0.0 : Ma[i], force.empty() ? 0.0 : force[i]);
  if (damps(p)) failure = begin_damping(p, a);
  // predictor: free flight
  for (int i = 0; i < p.dofs.neq(); ++i)
    a.du[i] = p.dofs.fixed[i] ? 0.0 : a.dt * a.vgrid[i];
  return failure;
}

Failure step_initial_acceleration(Problem& p, const Step& s, double t_step)
{
  Dofs& dofs = p.dofs;
  if (dofs.nfe == 0) return STATUS_OK;
  RealVec zero(dofs.neq(), 0.0), fint, f, acc(dofs.neq(), 0.0), momentum, v, damping(dofs.neq(), 0.0);
  Jumps jumps;
  p.st.np1 = p.st.n;
  KernelMode mode;
  mode.finite = s.nlgeom;
  Failure failure = dof_constrain(p.m, p.d, p.st, s, t_step, t_step, dofs, p.warned);
  if (failure.ok()) failure = assem_move(p.m, p.d.grid, dofs, zero, t_step, t_step, p.st, jumps);
  if (failure.ok()) failure = assem_internal(p.m, p.d, dofs, mode, jumps, p.st, fint);
  if (failure.ok())
    failure = assem_loads(p.m, p.d, dofs, p.st, s, {t_step, p.st.n.time, 0.0}, p.warned, f);
  if (failure.ok() && damps(p)) failure = velocity_at_start(p, momentum, v);
  if (failure.ok() && damps(p)) failure = damping_at_start(p, s.nlgeom, t_step, s.dt, v, damping);
  if (!failure.ok()) return failure;
  for (int i = 0; i < dofs.neq(); ++i) f[i] -= fint[i] + damping[i];
  for (int i = 0; i < dofs.nfe * dofs.dim; ++i)
    if (dofs.fixed[i] == DOF_FIXED)
      acc[i] = p.st.n.a[dofs.node_of_row[i / dofs.dim] * dofs.dim + i % dofs.dim];
  if ((dofs.tie.dof.empty() ? mass_solve(dofs, 0, 0, f, acc) : mass_solve_tied(dofs, f, acc)) < 0)
    return MASS_FAILED;
  for (int r = 0; r < dofs.nfe; ++r)
    for (int i = 0; i < dofs.dim; ++i) p.st.n.a[dofs.node_of_row[r] * dofs.dim + i] = acc[r * dofs.dim + i];
  return STATUS_OK;
}

namespace {

// dependent dofs move as their masters do
void finish_ties(Problem& p, RealVec& dv)
{
  const Dofs& s = p.dofs;
  const int dim   = s.dim;
  const auto at = [&](int dof) { return s.node_of_row[dof / dim] * dim + dof % dim; };
  for (size_t k = 0; k < s.tie.dof.size(); ++k)
    for (RealVec* x : {&p.st.np1.v, &p.st.np1.a}) {
      double sum = 0.0;
      for (int q = s.tie.master.off[k]; q < s.tie.master.off[k + 1]; ++q)
        sum += s.tie.coef[q] * (*x)[at(s.tie.master.item[q])];
      (*x)[at(s.tie.dof[k])] = sum;
    }
  for (int dof : s.tie.dof) dv[dof] = p.st.np1.v[at(dof)] - p.st.n.v[at(dof)];
}

//   out  dv   change of the velocities of the nodes
void finish_nodes(Problem& p, const Attempt& a, RealVec& dv)
{
  const Step& s = a.step;
  const Scheme& scheme = scheme_of(s);
  const int dim = p.m.dim;
  for (int r = 0; r < p.dofs.nfe; ++r)
    for (int i = 0; i < dim; ++i) {
      const int dof = r * dim + i, k = p.dofs.node_of_row[r] * dim + i;
      const double v = a.vgrid[dof], acc = scheme.acceleration ? a.agrid[dof] : 0.0, du = a.du[dof];
      double v1, a1;
      if (p.dofs.fixed[dof] == DOF_FIXED) {           // prescribed motion: its own rate
        v1 = p.dofs.rate[dof];
        a1 = (v1 - v) / a.dt;
      } else {
        scheme.node(s, a.dt, du, v, acc, v1, a1);
      }
      // v is not that of the node, but the change is its change
      const bool projected = p.dofs.hung && !p.dofs.fixed[dof];
      dv[dof] = v1 - (projected ? v : p.st.n.v[k]);
      p.st.np1.v[k] = projected ? p.st.n.v[k] + dv[dof] : v1;
      p.st.np1.a[k] = a1;
    }
  finish_ties(p, dv);
}

// what the ghosts have taken: their spring acts with the whole increment, their mass does not keep its own
// motion  (3.17)
void finish_ghosts(Problem& p, const Attempt& a, const RealVec& dv)
{
  const int dim  = p.m.dim;
  const double k = a.mode.mid ? 1.0 : 0.5;
  RealVec jump;
  assem_ghost_jump(p.d.grid, p.dofs, dv, jump);
  for (size_t i = 0; i < jump.size(); ++i)
    p.st.ledger.ghost += k * p.d.grid.ghost_k[i / dim] * a.jumps.ghost[i] * a.jumps.ghost[i] +
                         0.5 * p.d.grid.ghost_m[i / dim] * jump[i] * jump[i];
}

// what damping has taken: du . C du / dt, and viscous stress              (2.20), (6.21)
void finish_damping(Problem& p, const Attempt& a)
{
  if (a.cM == 0.0) return;
  if (!p.dofs.C.empty()) p.st.ledger.viscous += damping_work(p.dofs, a.du) / a.dt;
  if (!model_viscous(p.m)) return;
  double loss = elem_viscous_loss(p.m, p.d.el, p.st.n, p.st.np1, a.mode.finite) +
                point_viscous_loss(p.st.points, p.m.dim, p.d.point_law, p.st.n, p.st.np1, p.dofs.owned_point);
  comm_sum(&loss, 1);
  p.st.ledger.viscous += loss / a.dt;
}

// v_c += sum_v N_v(x_c) dv_v                                                       (3.15)
void finish_points(Problem& p, const Attempt& a, RealVec& dv)
{
  const Step& s = a.step;
  const int dim = p.m.dim, first = p.dofs.nfe;
  const Scheme& scheme = scheme_of(s);
  for (int i = first * dim; i < p.dofs.neq(); ++i) {
    if (p.dofs.fixed[i])
      dv[i] = p.dofs.rate[i] - a.vgrid[i];
    else
      dv[i] = scheme.grid(s, a.dt, a.du[i], a.vgrid[i], scheme.acceleration ? a.agrid[i] : 0.0);
  }
  assem_gather_corners(p.d.grid, p.dofs, dv, p.st.n.vc, p.st.np1.vc);
  point_velocities(p.st.points, dim, p.st.np1.vc, p.st.np1.vp);
}

void finish_reactions(Problem& p, const Attempt& a)
{
  const int dim = p.m.dim;
  State& st = p.st;
  st.rf.assign(static_cast<size_t>(p.m.mesh.nnode()) * dim, 0.0);
  st.grid_rf.assign(p.m.grid_bc.size() * dim, 0.0);
  for (int i = 0; i < p.dofs.neq(); ++i) {
    if (p.dofs.fixed[i] != DOF_FIXED) continue;
    const int r = i / dim;
    if (r < p.dofs.nfe) st.rf[p.dofs.node_of_row[r] * dim + i % dim] = a.R[i];
    else if (p.dofs.grid_bc[i] >= 0) st.grid_rf[p.dofs.grid_bc[i] * dim + i % dim] += a.R[i];
  }
  for (const CornerSupport& h : p.dofs.corner_support)
    if (p.dofs.grid_bc[h.dof] < 0) st.rf[h.node_dof] += h.part * a.R[h.dof];
}

// nodes without elements move with the corners that go on for them, for the results
void finish_followers(Problem& p, const Attempt& a)
{
  const int dim = p.m.dim;
  Level& l = p.st.np1;
  for (size_t n = 0; n < p.d.follow.size(); ++n)
    for (int i = 0; i < dim && p.d.follow[n] >= 0; ++i) {
      const size_t k = n * dim + i, c = static_cast<size_t>(p.d.follow[n]) * dim + i;
      l.u[k] = l.uc[c];
      if (a.cM == 0.0) continue;
      l.v[k] = l.vc[c];
      l.a[k] = (l.v[k] - p.st.n.v[k]) / a.dt;
    }
}

// statics: R at t(n) on the weights of this step
RealVec residual_at_start(const Problem& p, const Attempt& a)
{
  RealVec R(p.dofs.neq());
  for (int i = 0; i < p.dofs.neq(); ++i) R[i] = a.fint0[i] - a.fext0[i];
  tie_force(p.dofs, R);
  return R;
}

// work of loads and moved supports over the step                                   (6.12)
double external_work(const Problem& p, const Attempt& a, const RealVec& rf0)
{
  const int dim  = p.m.dim;
  const bool mid = a.mode.mid;
  double work = 0.0;
  RealVec R0;                  // statics: at t(n)
  if (a.cM == 0.0) R0 = residual_at_start(p, a);
  for (int i = 0; i < p.dofs.neq(); ++i) {
    const double f0 = mid ? a.fext[i] : a.fext0[i];
    work += 0.5 * (f0 + a.fext[i]) * a.du[i];
    if (p.dofs.fixed[i] != DOF_FIXED || a.du[i] == 0.0) continue;
    const int r = i / dim;
    double r0   = a.R[i];
    if (a.cM == 0.0) r0 = R0[i];
    else if (!mid && r < p.dofs.nfe) r0 = rf0[p.dofs.node_of_row[r] * dim + i % dim];
    work += 0.5 * (r0 + a.R[i]) * a.du[i];
  }
  // grounds that move push through their bonds
  const Bonds& b = p.st.bonds;
  double C[9], g0[3], g1[3];
  for (int k = 0; k < b.nbond; ++k) {
    if (b.field[k] != SIDE_GROUND) continue;
    bond_ground_motion(p.m, b, k, a.t0, a.total0, g0);
    bond_ground_motion(p.m, b, k, a.t1, a.total1, g1);
    bond_stiffness(b, dim, k, C);
    for (int i = 0; i < dim; ++i) {
      double f = p.st.np1.lambda[k * dim + i];
      for (int j = 0; j < dim; ++j)
        f += 0.5 * C[i * dim + j] * (p.st.n.slip[k * dim + j] + p.st.np1.slip[k * dim + j]);
      work -= f * (g1[i] - g0[i]);
    }
  }
  return work;
}

// statics: corners follow other nodes than in the step before, whose equilibrium is none on these; what the
// forces that are left do on the way to the new one is lost. Elements that break leave forces too, which are
// counted there (dt = 0).  (6.15)
double work_of_renewal(const Problem& p, const Attempt& a)
{
  if (a.cM != 0.0 || a.dt == 0.0 || p.d.grid.nnode == 0) return 0.0;
  double work = 0.0;
  const RealVec R0 = residual_at_start(p, a);
  for (int i = 0; i < p.dofs.neq(); ++i)
    if (!p.dofs.fixed[i]) work -= 0.5 * R0[i] * a.du[i];
  return work;
}

// what the pairs did in this step: forces, gaps, closed area, work of friction; normals for the output
void finish_contact(Problem& p, const Attempt& a)
{
  State& st     = p.st;
  const int dim = p.m.dim;
  std::vector<ContactLog> log(p.m.bond.size());
  for (size_t d = 0; d < log.size() && d < st.contact.size(); ++d) log[d].work = st.contact[d].work;
  for (int b = 0; b < st.bonds.nbond; ++b) {
    if (st.bonds.field[b] != SIDE_CONTACT || !p.d.pairs.master.count(b)) continue;
    ContactLog& c = log[st.bonds.def[b]];
    double f[3], t1[3], slipped, pressure = 0.0, friction = 0.0;
    const double gap = contact_force(p.m, st.bonds, p.d.pairs, b, a.mode, &a.jumps.contact[b * dim],
                                     &st.n.lambda[b * dim], st.np1.lambda_n[b], f, nullptr, t1, &slipped);
    if (st.np1.lambda_n[b] + st.bonds.cn[b] * gap >= 0.0) st.np1.lambda_n[b] = 0.0;     // open: forgotten
    for (int i = 0; i < dim; ++i) {
      st.bonds.normal[b * dim + i] = p.d.pairs.normal[b * dim + i];
      pressure -= f[i] * p.d.pairs.normal[b * dim + i];
      friction += t1[i] * t1[i];
    }
    c.force += pressure;
    c.gap  = std::min(c.gap, gap + st.bonds.initial_penetration[b]);
    c.peak = std::max(c.peak, pressure / st.bonds.area[b]);
    if (pressure > 0.0) c.area += st.bonds.area[b];
    c.work += std::sqrt(friction) * slipped;
    st.ledger.friction += std::sqrt(friction) * slipped;
  }
  st.contact = log;
}

}  // namespace

void step_finish(Problem& p, Attempt& a, RealVec& energy)
{
  Timer timer(PHASE_COMMIT);
  const RealVec rf0 = p.st.rf.empty() ? RealVec(static_cast<size_t>(p.m.mesh.nnode()) * p.m.dim, 0.0)
                                      : p.st.rf;
  RealVec dv(p.dofs.neq(), 0.0);        // change of the velocities of the unknowns
  p.st.np1.time = a.total1;
  if (a.cM != 0.0) {
    finish_nodes(p, a, dv);
    if (p.st.points.npoint) finish_points(p, a, dv);
  }
  if (p.d.grid.ghost.size()) finish_ghosts(p, a, dv);
  finish_damping(p, a);
  finish_followers(p, a);
  finish_reactions(p, a);
  if (p.d.pairs.near || !p.st.contact.empty()) finish_contact(p, a);
  p.st.ledger.external += external_work(p, a, rf0);
  p.st.ledger.renewal += work_of_renewal(p, a);
  if (p.d.fm.on)
    p.st.ledger.fracture += frac_degraded(p.m, a.step, p.d.el, p.st.points, p.st.frac, p.st.n, p.st.np1);
  ledger_update(p.m, p.d.el, p.dofs, p.st.np1, a.step.nlgeom, p.st, p.d.fm.on ? &energy : nullptr);
}
