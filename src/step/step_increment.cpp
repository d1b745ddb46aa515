#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "base/timer.h"
#include "model/scheme.h"
#include "step/step.h"

namespace {

// Contact, relative to the face size: a point that penetrates by more than MAX_INCREASE in one increment may
// have missed a face. The search loses it at 0.5 (contact_search), so MAX_DEPTH ends the increment before.
// (test: Increment.PointsThatEnterTooDeep)
const double MAX_INCREASE = 0.25, MAX_DEPTH = 0.45;
// Contacts that close raise the residual for an iteration; full corrections find the set of closed ones
// (no test)
const int PATIENCE = 2;
// Cohesive cracks: factor of the maximum number of iterations; with fewer increments are cut  (no test)
const int OPENING_ITERATIONS = 20;

// augmented Lagrange: the bond force becomes the multiplier (4.6), as does the contact pressure (4.15). In
// motion bonds keep theirs: updates in each increment would add up to an integral control, which is unstable.
// k: updates so far in this step. False: no update is due.
bool update_multipliers(const Model& m, const Bonds& b, const KernelMode& mode, int k, Level& l)
{
  const int dim = m.dim;
  double C[9];
  bool changed = false;
  for (int q = 0; q < b.nbond; ++q) {
    if (m.bond[b.def[q]].augment <= k) continue;
    if (b.side[q] == SIDE_CONTACT) {
      const double next = contact_multiplier(mode, b.cn[q], l.slip[q * dim], l.lambda_n[q]);
      changed = changed || next != l.lambda_n[q];
      l.lambda_n[q] = next;
      continue;
    }
    if (!mode.is_static) continue;
    changed = true;
    bond_stiffness(b, dim, q, C);
    for (int i = 0; i < dim; ++i)
      for (int j = 0; j < dim; ++j) l.lambda[q * dim + i] += C[i * dim + j] * l.slip[q * dim + j];
  }
  return changed;
}

Failure augment(Problem& p, Attempt& a)
{
  const auto due = [&](int k) {
    const bool here = update_multipliers(p.m, p.st.bonds, a.mode, k, p.st.np1);
    return p.m.part.on ? comm_allreduce_max(static_cast<int>(here)) > 0 : here;
  };
  for (int k = 0; due(k); ++k) {
    const Failure failure = step_newton(p, a);
    if (!failure.ok()) return failure;
  }
  return STATUS_OK;
}

// elements only, without NLGEOM, contact and fracture: the tangent does not depend on displacements
bool linear_scene(const Model& m, const FracMesh& fm, const Points& pts, const Step& s)
{
  if (s.nlgeom || fm.on || pts.npoint_all() || s.bulk_mid()) return false;
  for (const BondDef& b : m.bond)
    if (b.kind == BOND_CONTACT) return false;
  for (const Material& a : m.material)
    if (a.used && !law_of(mat_law(a, PLANE_NONE)).linear) return false;
  return true;
}

NewtonControls newton_controls(const Model& m, const Discretisation& d, const State& st, const Step& s,
                               double dt)
{
  NewtonControls c;
  const FracMesh& fm = d.fm;
  c.linear   = linear_scene(m, fm, st.points, s);
  c.breaks   = fm.on;
  c.unsymmetric_flow = step_flow_unsymmetric(m);
  for (const FractureDef& f : m.fracture)
    c.unsymmetric_flow = c.unsymmetric_flow || f.residual == SPLIT_GRANULAR;
  c.opens = (s.proc == PROC_STATIC || (step_tracks(m) && !s.explicit_steps())) && step_opens(m);
  if (s.proc == PROC_STATIC && d.pairs.near) {
    int slips = 0;
    for (double mu : st.bonds.contact.friction) slips = slips || mu > 0.0;
    c.slips = m.part.on ? comm_allreduce_max(slips) > 0 : slips > 0;
    if (!c.breaks) c.patience = PATIENCE;
  }
  c.singular = s.proc == PROC_STATIC && fm.on && st.frac.neroded > 0;
  // equilibrium after fracture (dt = 0) opens and closes many cracks: more iterations
  c.max_iter = dt > 0.0 ? s.ctl.max_iter : 4 * s.ctl.max_iter;
  if (c.opens) c.max_iter *= OPENING_ITERATIONS;
  return c;
}

// initial guess of statics: the rate of the last increment continues, prescribed dofs reach their target
// (6.14). Only with intact elements alone, and not after a cut.
void extrapolate(const Model& m, const State& st, const Dofs& dofs, double dt, Attempt& a)
{
  if (!a.step.extrapolate || a.step.arc.on || st.rate.empty() || st.log.cuts > 0 || !m.bond.empty() ||
      st.points.npoint_all() || (st.frac.neroded > 0 && frac_uses_energy(m)))
    return;
  a.start.guess   = dofs.bound.target;
  a.start.guesses = true;
  const int dim = dofs.rows.dim;
  for (int r = 0; r < dofs.rows.nfe; ++r)
    for (int i = 0; i < dim; ++i)
      if (!dofs.bound.fixed[r * dim + i])
        a.start.guess[r * dim + i] = dt * st.rate[dofs.rows.node_of_row[r] * dim + i];
}

// General contact in statics: a contact point without a face at t(n) that is inside one now came from outside
// the search range  (test: contact/g1_compare)
Failure find_missed_contact(Problem& p)
{
  State& st = p.st;
  const MeshPart& part = p.m.part;
  if (model_general_contact(p.m) < 0 || (st.bonds.contact.skin.empty() && !part.window)) return STATUS_OK;
  if (part.on) halo_copy(part.halo, p.m.dim, st.np1.u);        // nodes of halo elements
  if (part.window) point_copy_corners(st.points, p.m.dim, {&st.np1.uc});
  double largest = step_largest_move(st);
  const int dim  = p.m.dim;
  if (part.on) largest = comm_allreduce_max(largest);
  if (2.0 * std::sqrt(dim) * largest <= scene_reach(part, p.d.scene)) return STATUS_OK;
  ContactScene scene = p.d.scene;
  ContactPairs pairs;
  RealVec xb;
  bond_places(p.m, st.points, st.bonds, st.np1.u, st.np1.uc, xb);
  scene_update(p.m, st.points, st.bonds, st.np1.u, st.np1.uc, true, 0.0, scene);
  if (!step_scene_faces_known(p, scene)) return FACES_UNKNOWN;
  contact_search(p.m, st.points, st.bonds, st.np1, xb, scene, pairs);
  for (int b = 0; b < st.bonds.nbond; ++b) {
    if (st.bonds.contact.skin_of[b] < 0 || p.d.pairs.master.count(b) || !pairs.master.count(b)) continue;
    if (pairs.gap[b] >= -contact_touch(pairs, b)) continue;
    st.np1.slip[b * dim] = pairs.gap[b];
    return {CONTACT_DEPTH, AT_BOND, b};
  }
  return STATUS_OK;
}

// the failure at the contact point that one rank would find first, which other ranks may not have. Collective
Failure agree_on_failure(const Bonds& b, const Failure& own)
{
  Failure f = failure_agree(own);
  if (f.ok() || f.at != AT_BOND) return f;
  std::vector<long> name;
  if (own.at == AT_BOND && own.index >= 0) name.push_back(b.name[own.index]);
  f.index = name.empty() ? -1 : own.index;
  comm_allgatherv(name);
  if (f.index >= 0 && b.name[f.index] > *std::min_element(name.begin(), name.end())) f.index = -1;
  return f;
}

// explicit: are the loads at t(n) known from the end of the last increment, with the same rows?
bool loads_known(Problem& p, const Step& s, RealVec& fext)
{
  StableIncrement& q = p.stable;
  const StepLog& log       = p.st.log;
  if (!s.explicit_steps() || q.step != log.step || q.inc != log.inc - 1) return false;
  if (q.pattern != p.dofs.pattern.number || q.made != p.d.grid.made) return false;
  if (q.fext.size() != static_cast<size_t>(p.dofs.rows.neq())) return false;
  fext.swap(q.fext);           // after a failed attempt they are evaluated again
  return true;
}

void keep_loads(Problem& p, Attempt& a)
{
  StableIncrement& q = p.stable;
  q.fext.swap(a.fext);
  q.spare.swap(a.fext0);
  q.fint.swap(a.fint);
  q.du.swap(a.du);
  q.R.swap(a.R);
  q.pattern = p.dofs.pattern.number;
  q.made    = p.d.grid.made;
  q.step    = p.st.log.step;
  q.inc     = p.st.log.inc;
}

// explicit: reuses the memory of the vectors of the last increment
void take_space(StableIncrement& q, Attempt& a)
{
  a.fext.swap(q.spare);
  a.fint.swap(q.fint);
  a.du.swap(q.du);
  a.R.swap(q.R);
}

// dynamics: level n+1, but for the parts that the increment writes as a whole
void begin_level(const Problem& p, const Step& s, const Level& n, Level& l)
{
  const Dofs& d = p.dofs;
  for (RealVec Level::*x : {&Level::u, &Level::v, &Level::a}) (l.*x).resize(n.u.size());
  if (!s.explicit_steps()) l.u = n.u;
  for (int k = 0; k < p.m.mesh.nnode(); ++k) {
    if (d.rows.row_of_node[k] >= 0) continue;             // in no element
    for (RealVec Level::*x : {&Level::u, &Level::v, &Level::a})
      std::copy_n(&(n.*x)[k * d.rows.dim], d.rows.dim, &(l.*x)[k * d.rows.dim]);
  }
  if (s.explicit_steps()) l.uc.resize(n.uc.size());
  else l.uc = n.uc;
  if (s.explicit_steps()) l.vc.resize(n.vc.size());
  else l.vc = n.vc;
  for (RealVec Level::*x : {&Level::slip, &Level::lambda, &Level::lambda_n, &Level::hp, &Level::degr,
                            &Level::q})
    l.*x = n.*x;
  if (!p.st.frac.tracked.empty()) l.he = n.he;          // marks of elements without a crack      (2.36c)
  elem_copy_history(p.d.el, n, l);
  l.time = n.time;
  if (s.bulk()) l.q.resize(p.m.mesh.nelem(), 0.0);
  else l.q.clear();
}

// level n+1, constraints, loads and predictor of an attempt
//   out  energy   explicit: as step_increment
Failure begin_attempt(Problem& p, const Step& s, Attempt& a, RealVec& energy)
{
  TimerAround timer(PHASE_BEGIN);
  State& st = p.st;
  if (s.explicit_steps() && s.bulk()) st.n.q.resize(p.m.mesh.nelem(), 0.0);
  if (s.proc == PROC_DYNAMIC) begin_level(p, s, st.n, st.np1);
  else st.np1 = st.n;
  if (!p.d.pairs.gap.empty()) contact_forget(st.bonds, p.d.pairs, p.m.dim, st.np1);
  if (p.d.fm.on) frac_degrade(p.m, s, p.d.fm, st.frac, st.n, a.dt, st.np1);
  // dynamics: a multiplier of the last increment would push opening contact and create energy (4.2)
  if (s.proc == PROC_DYNAMIC) std::fill(st.np1.lambda_n.begin(), st.np1.lambda_n.end(), 0.0);
  // of this attempt: none if an error precedes the first iteration
  st.log.iterations = 0;
  st.log.residual   = 0.0;
  if (s.explicit_steps()) take_space(p.stable, a);
  if (s.explicit_steps() && frac_uses_energy(p.m) && step_tests(p, s, a.total1)) a.energy = &energy;
  if (s.proc == PROC_DYNAMIC) a.du.resize(p.dofs.rows.neq());  // written as a whole
  else a.du.assign(p.dofs.rows.neq(), 0.0);
  Failure failure = dof_constrain(p.m, p.d, st, s, a.t0, a.t1, p.dofs, p.warned);
  if (failure.ok() && s.proc == PROC_DYNAMIC && !s.explicit_steps()) ledger_leap(p.dofs, 0.0, st);
  if (failure.ok() && !a.mode.mid && !loads_known(p, s, a.fext0))
    failure = assem_loads(p.m, p.d, p.dofs, st, s, {a.t0, a.total0, 0.0}, p.warned, a.fext0);
  const bool leaps = s.explicit_steps();
  if (failure.ok() && s.proc == PROC_DYNAMIC && !leaps) failure = step_inertia_begin(p, a);
  if (failure.ok() && s.arc.on && a.dt > 0.0) failure = step_arc_begin(p, a);
  return failure;
}

}  // namespace

Failure step_contact_depth(const Bonds& b, const ContactPairs& pairs, const Level& l, int dim)
{
  for (int q = 0; q < b.nbond; ++q) {
    if (b.side[q] != SIDE_CONTACT || !pairs.master.count(q)) continue;
    const double size = std::max(pairs.size[q], b.contact.deep[q] / CONTACT_DEEP);   // crushed debris
    const double gap = l.slip[q * dim] / size, before = pairs.gap[q] / size;
    if (gap > -MAX_DEPTH && (gap > -MAX_INCREASE || before - gap < MAX_INCREASE)) continue;
    return {CONTACT_DEPTH, AT_BOND, q};
  }
  return STATUS_OK;
}

bool step_flow_unsymmetric(const Model& m)
{
  return std::any_of(m.material.begin(), m.material.end(), [](const Material& a) {
    return a.used && a.law == LAW_DRUCKER_PRAGER && (a.exponent != 1.0 || a.friction != a.dilation);
  });
}

bool step_opens(const Model& m)
{
  return std::any_of(m.fracture.begin(), m.fracture.end(),
                     [](const FractureDef& f) { return f.criterion == CRITERION_COHESIVE; });
}

bool step_tracks(const Model& m)
{
  return std::any_of(m.fracture.begin(), m.fracture.end(), [](const FractureDef& f) { return f.track; });
}

KernelMode step_mode(const Step& s)
{
  KernelMode mode;
  mode.finite = s.nlgeom;
  mode.is_static = s.proc == PROC_STATIC;
  mode.mid    = s.proc == PROC_DYNAMIC && scheme_of(s).midpoint;
  mode.s_new  = mode.mid ? 0.5 + s.dissipation : 1.0;
  mode.s_old  = mode.mid ? 0.5 - s.dissipation : 0.0;
  if (s.explicit_steps()) mode.crack = CRACK_MEAN;
  return mode;
}

Failure step_increment(Problem& p, const Step& s, double t0, double dt, RealVec& energy, HalfWatch* half)
{
  State& st = p.st;
  const double total0 = st.n.time;
  const bool mid = step_mode(s).mid;
  const double load = mid ? 0.5 : 1.0;               // position of the loads in the increment
  Attempt a{s, step_mode(s), t0, t0 + dt, dt, total0, total0 + dt, {t0 + load * dt, total0 + load * dt, load},
            newton_controls(p.m, p.d, st, s, dt)};
  if (s.explicit_steps()) a.total1 = a.load.total = st.clock.start + a.t1;   // bitwise t(n) of the next
  if (s.proc == PROC_DYNAMIC) a.mode.rate = scheme_of(s).damping(s, dt);
  if (s.bulk_mid()) {
    step_bulk_means(p, s);
    a.bulk      = {s.bulk_linear, s.bulk_quadratic, dt};
    a.mode.bulk = &a.bulk;
  }
  std::vector<RealVec*> vectors;
  if (s.proc == PROC_DYNAMIC && !s.explicit_steps())
    vectors = {&a.g, &a.momentum, &a.vgrid, &a.fint, &a.fext, &a.du};
  if (s.explicit_steps()) vectors = {&a.vgrid, &a.agrid, &a.leap.acc};
  const Borrowed borrowed(p.newton.spare, vectors);
  Failure failure = begin_attempt(p, s, a, energy);
  if (failure.status == BAD_VALUE) return failure;
  if (dt > 0.0 && s.proc == PROC_STATIC) extrapolate(p.m, st, p.dofs, dt, a);
  const bool guessed = a.start.guesses, leaps = s.explicit_steps();
  if (failure.ok()) failure = leaps ? step_explicit(p, a) : step_newton(p, a);
  if (!failure.ok() && failure.status != BAD_VALUE && guessed) {
    a.du.assign(p.dofs.rows.neq(), 0.0);
    a.start.guesses = false;
    failure = step_newton(p, a);
  }
  if (failure.ok() && st.bonds.nbond_all() && !leaps) failure = augment(p, a);
  const auto agree = [&](const Failure& f) { return p.m.part.on ? agree_on_failure(st.bonds, f) : f; };
  if (failure.ok() && p.d.pairs.near)
    failure = agree(step_contact_depth(st.bonds, p.d.pairs, st.np1, p.m.dim));
  if (failure.ok() && s.proc == PROC_STATIC) failure = agree(find_missed_contact(p));
  if (failure.ok() && half && half->on) {
    failure = step_half(p, a, *half);
    if (failure.ok()) failure = half_judge(s, dt, st.log.cuts, *half);
  }
  if (failure.ok() && a.arc.on) step_arc_end(p, a);
  if (failure.ok()) step_finish(p, a, energy);
  if (failure.ok() && !leaps) step_keep_motion(p, a);
  if (failure.ok() && !std::isfinite(leaps ? st.ledger.external : st.ledger.balance)) failure = BAD_NUMBER;
  if (failure.ok() && leaps) keep_loads(p, a);
  return failure;
}
