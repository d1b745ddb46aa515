#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "base/halo_numbers.h"
#include "base/timer.h"
#include "model/scheme.h"
#include "step/step_turn.h"

namespace {

// velocities and accelerations of dependent dofs from their masters
void finish_ties(const Dofs& s, State& st, RealVec& dv)
{
  const int dim   = s.rows.dim;
  const auto at = [&](int dof) { return s.rows.node_of_row[dof / dim] * dim + dof % dim; };
  const Ties& t      = s.bound.tie;
  // accelerations of rotating rigid bodies are already set
  const size_t turns = t.rigid.empty() ? t.dof.size() : t.rigid.front();
  for (size_t k = 0; k < t.dof.size(); ++k)
    for (RealVec* x : {&st.np1.v, &st.np1.a}) {
      if (k >= turns && x == &st.np1.a) continue;
      double sum = 0.0;
      for (int q = s.bound.tie.master.off[k]; q < s.bound.tie.master.off[k + 1]; ++q)
        sum += s.bound.tie.coef[q] * (*x)[at(s.bound.tie.master.item[q])];
      (*x)[at(s.bound.tie.dof[k])] = sum;
    }
  for (int dof : s.bound.tie.dof) dv[dof] = st.np1.v[at(dof)] - st.n.v[at(dof)];
}

//   in   du   [neq] of dofs
//        acc  [neq] explicit: accelerations at t(n+1); else empty
//   out  dv   [neq] change of the velocities of the nodes
void finish_nodes(const Dofs& dofs, const Attempt& a, const RealVec& du, const RealVec& acc1, State& st,
                  RealVec& dv)
{
  const Step& s = a.step;
  const Scheme& scheme = scheme_of(s);
  const int dim = dofs.rows.dim;
  const double *v_n = st.n.v.data(), *a_n = st.n.a.data(), *vgrid = a.vgrid.data(), *agrid = a.agrid.data();
  double *v_np1 = st.np1.v.data(), *a_np1 = st.np1.a.data(), *change = dv.data();
  for (int r = 0; r < dofs.rows.nfe; ++r)
    for (int i = 0; i < dim; ++i) {
      const int dof = r * dim + i, k = dofs.rows.node_of_row[r] * dim + i;
      const double v   = dofs.rows.hung ? vgrid[dof] : v_n[k],
                   acc = !scheme.acceleration ? 0.0 : dofs.rows.hung ? agrid[dof] : a_n[k];
      double v1, a1;
      if (dofs.bound.fixed[dof] == DOF_FIXED) {           // prescribed motion
        v1 = dofs.bound.rate[dof];
        a1 = (v1 - v) / a.dt;
      } else if (!acc1.empty()) {
        a1 = acc1[dof];
        v1 = v + 0.5 * a.dt * (acc + a1);
      } else {
        scheme.node(s, a.dt, du[dof], v, acc, v1, a1);
      }
      // v is projected; only its change applies to the node
      const bool projected = dofs.rows.hung && !dofs.bound.fixed[dof];
      change[dof] = v1 - (projected ? v : v_n[k]);
      v_np1[k] = projected ? v_n[k] + change[dof] : v1;
      a_np1[k] = a1;
    }
  finish_ties(dofs, st, dv);
}

// energy dissipated by ghost stabilisation: its spring acts with the whole increment, and its mass has no
// motion of its own  (3.17)
double ghost_loss(const ActiveGrid& grid, const Dofs& dofs, const Attempt& a, const RealVec& dv)
{
  const int dim  = dofs.rows.dim;
  const double k = a.mode.mid ? 1.0 : 0.5;
  double loss = 0.0;
  RealVec jump;
  assem_ghost_jump(grid, dofs, dv, jump);
  for (size_t i = 0; i < jump.size(); ++i)
    loss += k * grid.ghost_k[i / dim] * a.jumps.ghost[i] * a.jumps.ghost[i] +
            0.5 * grid.ghost_m[i / dim] * jump[i] * jump[i];
  return loss;
}

void finish_ghosts(const Model& m, const ActiveGrid& grid, const Dofs& dofs, const Attempt& a,
                   const RealVec& dv, Ledger& g)
{
  if (m.grid.ghost_stiffness <= 0.0 && m.grid.ghost_mass <= 0.0) return;
  double loss = ghost_loss(grid, dofs, a, dv);
  comm_sum(&loss, 1);
  g.ghost += loss;
}

// Part of the energy of the viscous stress in an explicit increment that belongs to the rate of the one
// before: it acts at the start                     (6.21) (test: stress/balance_beta.inp)
const double BEFORE_PART = 0.25;

// energy dissipated by damping: du . C du / dt, explicit du . C (v(n) + v(n+1))/2, and by viscous stress
//   in   dv   change of the velocities [neq]                                               (2.20), (6.21)
void finish_damping(const Model& m, const Discretisation& d, const Dofs& dofs, const Attempt& a,
                    const RealVec& dv, State& st)
{
  const bool leaps = a.step.explicit_steps();
  if (a.cM == 0.0) return;
  if (dofs.mass.damped && leaps) {
    RealVec v(a.vgrid), Cv;
    for (int i = 0; i < dofs.rows.neq(); ++i) v[i] += 0.5 * dv[i];
    damping_multiply(dofs, v, Cv);
    st.ledger.viscous += dof_dot(dofs, a.du, Cv);
  } else if (dofs.mass.damped) {
    st.ledger.viscous += damping_work(dofs, a.du) / a.dt;
  }
  const bool viscous = model_viscous(m), bulk = a.step.bulk_mid();
  if (!viscous && !bulk) return;
  double loss[2] = {0.0, 0.0};           // viscous stress, bulk viscosity
  if (viscous)
    loss[0] = (elem_viscous_loss(m, d.el, st.n, st.np1, a.mode.finite) +
               point_viscous_loss(st.points, m.dim, d.point_law, st.n, st.np1, dofs.rows.owned_point)) / a.dt;
  if (bulk)
    loss[1] = elem_bulk_loss(m.mesh, d.el, st.n, st.np1, a.mode.finite, a.bulk) +
              point_bulk_loss(m, st.points, d.point_law, a.mode, st.n, st.np1, dofs.rows.owned_point);
  comm_sum(loss, 2);
  Ledger& g = st.ledger;
  if (leaps) {
    const double power = loss[0] / a.dt;
    if (g.beta_power > 0.0) loss[0] += BEFORE_PART * (g.beta_power * a.dt - loss[0]);
    g.beta_power = power;
  }
  g.viscous += loss[0] + loss[1];
}

//   out  dv   [neq] change of the velocities of the grid
void finish_grid(const Dofs& dofs, const Attempt& a, RealVec& dv)
{
  const Step& s = a.step;
  const int dim = dofs.rows.dim, first = dofs.rows.nfe;
  const Scheme& scheme = scheme_of(s);
  for (int i = first * dim; i < dofs.rows.neq(); ++i) {
    if (dofs.bound.fixed[i])
      dv[i] = dofs.bound.rate[i] - a.vgrid[i];
    else if (!a.leap.acc.empty())
      dv[i] = 0.5 * a.dt * (a.agrid[i] + a.leap.acc[i]);
    else
      dv[i] = scheme.grid(s, a.dt, a.du[i], a.vgrid[i], scheme.acceleration ? a.agrid[i] : 0.0);
  }
}

// plain: changes of the velocity of nodes that corners follow, from st.np1.v
//   out  dv   [neq] only these rows
void followed_nodes(const ActiveGrid& grid, const Dofs& s, const State& st, RealVec& dv)
{
  const int dim = s.rows.dim;
  for (const MeshItem& q : grid.corner_mesh)
    for (int i = 0, r = s.rows.row_of_node[q.node]; i < dim; ++i)
      dv[r * dim + i] = st.np1.v[q.node * dim + i] - st.n.v[q.node * dim + i];
}

// stores v + dv of the grid rows for the next projection; explicit: accelerations and forces too
void keep_velocity(const Dofs& s, long made, int increment, const Attempt& a, const RealVec& dv,
                   GridVelocity& after)
{
  const RealVec& v = a.vgrid;
  after.pattern   = s.pattern.number;
  after.made      = made;
  after.increment = increment;
  after.first     = s.rows.projected_from();
  after.key.assign(s.rows.row_key.begin() + s.rows.nfe, s.rows.row_key.end());
  const int first = after.first * s.rows.dim;
  after.fixed.assign(s.bound.fixed.begin() + first, s.bound.fixed.end());
  after.v.resize(s.rows.neq() - first);
  after.a.clear();
  after.f.clear();
  if (!a.leap.acc.empty()) {
    after.a.assign(a.leap.acc.begin() + first, a.leap.acc.end());
    for (int i = first; i < s.rows.neq(); ++i) after.f.push_back(a.fext[i] - a.fint[i]);
  }
  for (int i = first; i < s.rows.neq(); ++i) after.v[i - first] = s.bound.fixed[i] ? s.bound.rate[i] : v[i] +
      dv[i];
}

// velocities of nodes, corners and grid                                             (6.3), (3.15)
//   out  dv      change of the velocities [neq]
//        after   velocity of the grid, for the next projection; null: not needed
void finish_velocities(const ActiveGrid& grid, const Dofs& dofs, const Attempt& a, State& st, RealVec& dv,
                       GridVelocity* after)
{
  if (a.leap.plain) followed_nodes(grid, dofs, st, dv);
  else finish_nodes(dofs, a, a.du, a.leap.acc, st, dv);
  if (st.points.npoint_all()) finish_grid(dofs, a, dv);
  if (after) keep_velocity(dofs, grid.made, st.log.inc_total + 1, a, dv, *after);
  if (st.points.npoint_all()) assem_gather_corners(grid, dofs, dv, st.n.vc, st.np1.vc);
}

// reactions of supports transferred to corners; all ranks have all entries
void corner_reactions(const Model& m, const Dofs& dofs, const RealVec& R, RealVec& rf)
{
  RealVec force;
  for (const CornerSupport& h : dofs.bound.corner_support) {
    const bool here = h.dof >= 0 && dofs.bound.grid_bc[h.dof] < 0 && (!m.part.on || dofs.rows.counts(h.dof));
    force.push_back(here ? h.part * R[h.dof] : 0.0);
  }
  if (m.part.on && !force.empty()) comm_sum(force);
  for (size_t k = 0; k < force.size(); ++k)
    if (dofs.bound.corner_support[k].node_dof >= 0) rf[dofs.bound.corner_support[k].node_dof] += force[k];
}

//   in   R        [neq] of dofs
//   out  before   not null: the reactions of t(n); empty: they stay
void finish_reactions(const Model& m, const Dofs& dofs, const RealVec& R, State& st, RealVec* before)
{
  const int dim = m.dim;
  const size_t nodal = static_cast<size_t>(m.mesh.nnode()) * dim;
  if (before) before->clear();
  if (before && !dofs.bound.free) before->swap(st.rf);
  if (!dofs.bound.free || st.log.inc <= 1 || st.rf.size() != nodal) st.rf.assign(nodal, 0.0);
  st.grid_rf.assign(m.grid_bc.size() * dim, 0.0);
  for (int i = 0; i < dofs.rows.neq() && !dofs.bound.free; ++i) {
    if (dofs.bound.fixed[i] != DOF_FIXED) continue;
    const int r = i / dim;
    if (r < dofs.rows.nfe) st.rf[dofs.rows.node_of_row[r] * dim + i % dim] = R[i];
    else if (dofs.bound.grid_bc[i] >= 0 && (!m.part.on || dofs.rows.counts(i)))
      st.grid_rf[dofs.bound.grid_bc[i] * dim + i % dim] += R[i];
  }
  if (m.part.on && !st.grid_rf.empty()) comm_sum(st.grid_rf);
  corner_reactions(m, dofs, R, st.rf);
  for (const Frame& f : m.frame) {           // supports along directions of the node
    double r[3];
    if (f.twin < 0) continue;
    frame_turn(f, dim, true, &st.rf[f.twin * dim], r);
    for (int i = 0; i < dim; ++i) st.rf[f.node * dim + i] += r[i];
  }
}

// results of nodes without elements: the motion of the corners that replace them
void finish_followers(const IntVec& follow, const Attempt& a, int dim, State& st)
{
  Level& l = st.np1;
  for (size_t n = 0; n < follow.size(); ++n)
    for (int i = 0; i < dim && follow[n] >= 0; ++i) {
      const size_t k = n * dim + i, c = static_cast<size_t>(follow[n]) * dim + i;
      l.u[k] = l.uc[c];
      if (a.cM == 0.0) continue;
      l.v[k] = l.vc[c];
      l.a[k] = (l.v[k] - st.n.v[k]) / a.dt;
    }
}

// work of loads and moved supports over the step, of this rank                      (6.12)
// explicit: planes of the grid have theirs in Leap::work
//   in   R0   [neq] statics: residual at t(n)
double external_work(const Dofs& dofs, const Attempt& a, const RealVec& rf0, const RealVec& R0)
{
  const int dim  = dofs.rows.dim;
  const bool mid = a.mode.mid;
  double work = 0.0;
  for (int i = 0; i < dofs.rows.neq(); ++i) {
    if (!dofs.rows.counts(i)) continue;
    const double f0 = mid ? a.fext[i] : a.fext0[i];
    work += 0.5 * (f0 + a.fext[i]) * a.du[i];
    if (!a.before.empty()) work += 0.5 * a.before[i] * a.du[i];
    const int r = i / dim, k = r < dofs.rows.nfe ? dofs.rows.node_of_row[r] * dim + i % dim : -1;
    if (dofs.bound.fixed[i] != DOF_FIXED || (k < 0 && a.step.explicit_steps())) continue;
    double r0 = a.R[i];
    if (a.cM == 0.0) r0 = R0[i];
    else if (!a.before.empty()) r0 = 0.0;
    else if (!mid && k >= 0) r0 = rf0[k];
    work += 0.5 * (r0 + a.R[i]) * a.du[i];
  }
  return work;
}

// Explicit: what the kinetic energy of supports, and of the dofs that follow them, changes beyond the work of
// their inertia by the mean of both ends; of this rank
double inertia_of_supports(const Dofs& dofs, const Attempt& a, const State& st)
{
  const int dim = dofs.rows.dim;
  const Ties& t = dofs.bound.tie;
  std::vector<char> led(dofs.rows.neq(), 0);
  for (int i = 0; i < dofs.rows.neq(); ++i) led[i] = dofs.bound.fixed[i] == DOF_FIXED;
  for (size_t k = 0; k < t.dof.size(); ++k)
    for (int q = t.master.off[k]; q < t.master.off[k + 1]; ++q)
      if (dofs.bound.fixed[t.master.item[q]] == DOF_FIXED) led[t.dof[k]] = 1;
  double sum = 0.0;
  for (int i = 0; i < dofs.rows.nfe * dim; ++i) {
    if (!led[i] || !dofs.rows.counts(i)) continue;
    const int k = dofs.rows.node_of_row[i / dim] * dim + i % dim;
    const double v0 = st.n.v[k], v1 = st.np1.v[k], a0 = st.n.a[k], a1 = st.np1.a[k],
                 leap = dofs.bound.fixed[i] == DOF_FIXED ? 0.0 : a.dt * a.dt / 8.0;      // (6.33)
    sum += dofs.mass.lumped[i / dim] *
           (0.5 * (v1 * v1 - v0 * v0) - 0.5 * (a0 + a1) * a.du[i] - leap * (a1 * a1 - a0 * a0));
  }
  return sum;
}

// Implicit steps: energy that supports add to the work of their reactions, of all ranks. At t(n+1) they have
// their own velocity, not that of the scheme; and points move with a plane of the grid by the part of their
// velocity that the grid does not see.
//   in   dv   change of the velocities [neq]
double energy_of_supports(const ActiveGrid& grid, const Dofs& s, const Attempt& a, const State& st,
                          const RealVec& dv)
{
  const Scheme& scheme = scheme_of(a.step);
  const int first = s.rows.nfe * s.rows.dim;
  RealVec jump(s.rows.neq(), 0.0), v(a.vgrid), Mv, p;
  bool none = true, still = true;
  for (int i = 0; i < s.rows.neq(); ++i) {
    v[i] += dv[i];
    if (s.bound.fixed[i] != DOF_FIXED) continue;
    const double acc = scheme.acceleration ? a.agrid[i] : 0.0;
    jump[i] = dv[i] - scheme.grid(a.step, a.dt, a.du[i], a.vgrid[i], acc);
    none    = none && jump[i] == 0.0;
    still   = still && (i < first || dv[i] == 0.0);
  }
  double sum = 0.0;
  if (!dof_all(s, none)) {
    tie_follow(s, false, jump);
    for (int i = 0; i < s.rows.neq(); ++i) v[i] -= 0.5 * jump[i];
    mass_multiply(s, v, Mv);
    sum += dof_dot(s, jump, Mv);
  }
  if (dof_all(s, still)) return sum;
  mass_multiply(s, a.vgrid, Mv);
  mass_elements(s, a.vgrid, p);
  point_momentum(grid, s, st.n.vc, p);
  sys_sum(s.pattern.A, p);
  double unseen = 0.0;
  for (int i = first; i < s.rows.neq(); ++i)
    if (s.bound.fixed[i] == DOF_FIXED && s.rows.counts(i)) unseen += dv[i] * (p[i] - Mv[i]);
  return sum + dof_total(s, unseen);
}

// adds the work of moving grounds through their bonds: the force of the middle, or the mean of both ends
double with_grounds(const Model& m, const State& st, const Attempt& a, double work)
{
  const int dim  = m.dim;
  const bool mid = a.mode.mid;
  const double s_old = mid ? a.mode.s_old : 0.5, s_new = mid ? a.mode.s_new : 0.5;
  const Bonds& b = st.bonds;
  double C[9], g0[3], g1[3], sum = b.halo.on() ? 0.0 : work;
  if (std::none_of(m.bond.begin(), m.bond.end(), [](const BondDef& d) { return d.kind == BOND_GROUND; }))
    return work;
  for (int k = 0; k < b.nbond; ++k) {
    if (b.side[k] != SIDE_GROUND || !b.counts(k)) continue;
    bond_ground_motion(m, b, k, a.t0, a.total0, g0);
    bond_ground_motion(m, b, k, a.t1, a.total1, g1);
    bond_stiffness(b, dim, k, C);
    for (int i = 0; i < dim; ++i) {
      const double l0 = st.n.lambda[k * dim + i], l1 = st.np1.lambda[k * dim + i];
      double f = mid ? l1 : 0.5 * (l0 + l1);
      for (int j = 0; j < dim; ++j)
        f += C[i * dim + j] * (s_old * st.n.slip[k * dim + j] + s_new * st.np1.slip[k * dim + j]);
      sum -= f * (g1[i] - g0[i]);
    }
  }
  if (!b.halo.on()) return sum;
  comm_sum(&sum, 1);
  return work + sum;
}

// energy dissipated by friction at contact point b: its work less the change of the stored stick energy
// (4.11). The mean of the forces at both ends acts where they are not those of the middle
double friction_loss(const Attempt& a, int b, int dim, const State& st)
{
  const double ct = st.bonds.ct[b];
  double work = 0.0, stored = 0.0;
  for (int i = 0; i < dim && ct > 0.0; ++i) {
    const double t0 = st.n.lambda[b * dim + i], t1 = st.np1.lambda[b * dim + i];
    work += (a.mode.mid || a.cM == 0.0 ? t1 : 0.5 * (t0 + t1)) * a.jumps.contact[b * dim + i];
    stored += 0.5 * (t1 * t1 - t0 * t0) / ct;
  }
  return work - stored;
}

// divided model: sums over the contact points of all ranks
//   inout log [Model::bond], friction, wall [grid_rf]
void sum_contact(std::vector<ContactLog>& log, double& friction, RealVec& wall)
{
  RealVec sum = {friction}, largest;
  for (const ContactLog& c : log) {
    sum.insert(sum.end(), {c.force, c.area, c.work});
    largest.insert(largest.end(), {c.peak, -c.gap});
  }
  sum.insert(sum.end(), wall.begin(), wall.end());
  comm_sum(sum);
  comm_max(largest.data(), static_cast<long>(largest.size()));
  const double *s = sum.data(), *x = largest.data();
  friction = *s++;
  for (ContactLog& c : log) {
    c.force = *s++;
    c.area  = *s++;
    c.work  = *s++;
    c.peak  = *x++;
    c.gap   = -*x++;
  }
  std::copy_n(s, wall.size(), wall.begin());
}

// Results of the contact points owned by this rank: forces, gaps, closed area, friction work, in log
// [Model::bond]; multipliers, and normals for the output, of all points
//   out  friction, wall [grid_rf]   added to
void finish_contact_points(const Model& m, const ContactPairs& pairs, const Attempt& a, State& st,
                   std::vector<ContactLog>& log, double& friction, RealVec& wall)
{
  const int dim = m.dim;
  for (int b = 0; b < st.bonds.nbond; ++b) {
    if (st.bonds.side[b] != SIDE_CONTACT) continue;
    if (!pairs.master.count(b) && st.n.slip[b * dim] == CONTACT_OPEN) continue;    // nothing has changed
    const bool general = m.bond[st.bonds.def[b]].contact.general, counts = st.bonds.counts(b);
    double loss = counts ? friction_loss(a, b, dim, st) : 0.0;
    if (counts && a.step.explicit_steps() && pairs.master.count(b))
      loss += step_close_work(st, pairs, a.jumps.contact, dim, b);                                // (6.51)
    friction += loss;
    if (general) {
      const bool pushes = st.np1.slip[b * dim] < 0.0, on_wall = pairs.wall[b] >= 0;
      st.bonds.contact.met[b]  = pushes && !on_wall ? pairs.face[b] : -1;
      st.bonds.contact.wall[b] = pushes ? pairs.wall[b] : -1;
    }
    if (!pairs.master.count(b)) continue;
    double f[3], t1[3], slipped, pressure = 0.0, slide = 0.0;
    const double gap = contact_force(m, st.bonds, pairs, b, a.mode, &a.jumps.contact[b * dim],
                                     &st.n.lambda[b * dim], st.np1.lambda_n[b], f, nullptr, t1, &slipped);
    if (st.np1.lambda_n[b] + st.bonds.cn[b] * gap >= 0.0) st.np1.lambda_n[b] = 0.0;     // open
    for (int i = 0; i < dim; ++i) {
      st.bonds.normal[b * dim + i] = pairs.normal[b * dim + i];
      pressure -= f[i] * pairs.normal[b * dim + i];
      slide += t1[i] * t1[i];
    }
    if (!counts) continue;
    const int plane = general ? pairs.wall[b] : -1;
    for (int i = 0; i < dim && plane >= 0; ++i) wall[plane * dim + i] -= f[i];
    ContactLog& c = log[st.bonds.def[b]];
    c.force += pressure;
    c.gap  = std::min(c.gap, gap + st.bonds.contact.initial_penetration[b]);
    c.peak = std::max(c.peak, pressure / st.bonds.area[b]);
    if (pressure > 0.0) c.area += st.bonds.area[b];
    c.work += a.mode.mid || a.cM == 0.0 ? std::sqrt(slide) * slipped : loss;
  }
}

void finish_contact(const Model& m, const ContactPairs& pairs, const Attempt& a, State& st)
{
  std::vector<ContactLog> log(m.bond.size());
  RealVec wall(st.grid_rf.size(), 0.0);
  double friction = 0.0;
  finish_contact_points(m, pairs, a, st, log, friction, wall);
  if (m.part.on) sum_contact(log, friction, wall);
  st.ledger.friction += friction;
  for (size_t i = 0; i < wall.size(); ++i) st.grid_rf[i] += wall[i];
  for (size_t d = 0; d < log.size() && d < st.contact.size(); ++d) log[d].work += st.contact[d].work;
  st.contact = log;
}

// books what the fall of stresses releases; explicit steps: sums the work over ranks
void book_release(Problem& p, const Attempt& a, bool leaps, double& work)
{
  State& st     = p.st;
  double sum[2] = {0.0, leaps ? work : 0.0};
  if (p.d.fm.on) sum[0] = frac_degraded(p.m, a.step, p.d.el, st.points, st.frac, st.n, st.np1);
  if (p.d.fm.on || leaps) comm_sum(sum, 2);
  st.ledger.fracture += sum[0];
  if (leaps) work = sum[1];
}

// energy dissipated by the bulk viscosity, and its damping ratio for the next increment          (6.35)
void finish_bulk(const Attempt& a, State& st)
{
  double loss = a.bulk.loss;
  comm_sum(&loss, 1);
  st.ledger.viscous += loss;
  st.clock.xi = comm_allreduce_max(a.bulk.xi);
}

}  // namespace

// ---------------------------------------------------------------------------
// step_finish : level n+1 and the ledger after Newton's method                    doc/theory.md 6.5
// ---------------------------------------------------------------------------
void step_finish(Problem& p, Attempt& a, RealVec& energy)
{
  Timer timer(PHASE_COMMIT);
  const Model& m = p.m;
  const Dofs& s = p.dofs;
  State& st      = p.st;
  const bool leaps  = a.step.explicit_steps();
  RealVec rf0;
  const bool mean = !a.leap.plain && !a.mode.mid;         // work by the mean of the forces at both ends
  if (mean) rf0 = st.rf;
  if (mean && rf0.empty()) rf0.assign(static_cast<size_t>(m.mesh.nnode()) * m.dim, 0.0);
  const bool moves = !a.leap.plain || st.points.npoint_all() > 0;       // velocities are to be set here
  RealVec dv;                  // change of the velocities of the unknowns
  const std::vector<RealVec*> none, own = {&dv};
  const Borrowed borrowed(p.newton.spare, a.leap.plain ? own : none);
  if (moves && a.leap.plain) dv.resize(s.rows.neq());     // finish_velocities sets the rows that are read
  else dv.assign(moves ? s.rows.neq() : 0, 0.0);
  st.np1.time = a.total1;
  if (st.points.part.window)
    point_copy_history(m.part, s.pattern.point_rank, st.points, p.d.point_law.history, st.np1);
  // 1. velocities
  // not for small systems and REUSE=NO: a restarted run then repeats every digit
  const bool keeps = ((m.solver.reuse && s.rows.neq_all() >= SMALL_SYSTEM) || leaps) &&
      st.points.npoint_all();
  GridVelocity* const after = keeps ? &p.newton.grid : nullptr;
  if (!after || a.cM == 0.0) p.newton.grid = GridVelocity();
  if (a.cM != 0.0 && moves) finish_velocities(p.d.grid, s, a, st, dv, after);
  point_copy_corners(st.points, m.dim, {&st.np1.uc, &st.np1.vc});
  if (m.part.around.on()) {                          // nodes of halo elements
    std::vector<RealVec*> fields{&st.np1.u};
    if (a.cM != 0.0 && (st.bonds.nbond_all() || !m.conversion.empty()))
      fields.insert(fields.end(), {&st.np1.v, &st.np1.a});
    halo_numbers(m.part.halo, m.dim, fields);
  }
  // 2. dissipation of ghosts and damping                                            (3.17), (6.21)
  finish_ghosts(m, p.d.grid, s, a, dv, st.ledger);
  finish_damping(m, p.d, s, a, dv, st);
  st.ledger.friction += a.leap.friction;
  // 3. results
  finish_followers(p.d.follow, a, m.dim, st);
  finish_reactions(m, s, a.R, st, leaps && p.d.fm.on ? &p.stable.rf : nullptr);
  if (p.d.pairs.near || !st.contact.empty()) finish_contact(m, p.d.pairs, a, st);
  // 4. ledger                                                                       (6.12), (6.15), (7.16)
  RealVec R0;
  if (a.cM == 0.0) R0 = step_residual_at_start(p, a);
  double work = a.leap.plain ? a.leap.work : external_work(s, a, rf0, R0);
  if (!a.leap.plain && leaps) work += inertia_of_supports(s, a, st) + a.leap.work;
  const double supports = a.cM == 0.0 || leaps ? 0.0 : energy_of_supports(p.d.grid, s, a, st, dv);
  if (a.cM == 0.0) step_settle(p, a, rf0, R0);
  if (!a.leap.plain) book_release(p, a, leaps, work);     // else: by step_explicit
  if (leaps) {                 // energies: when they are output (run_step), or for a fracture test
    if (a.step.bulk()) finish_bulk(a, st);
  } else {
    ledger_sums(m, p.d.el, s, st.np1, a.step.nlgeom, st, work, p.d.fm.on ? &energy : nullptr);
  }
  st.ledger.external += with_grounds(m, st, a, work) + supports;
  if (!leaps) ledger_balance(m.dim, st.np1, st);
}
