#include <algorithm>
#include <cmath>

#include "base/comm.h"
#include "base/log.h"
#include "base/timer.h"
#include "contact/contact_masters.h"
#include "step/step.h"

namespace {

// the value at X; if it is not finite: 0 and a message, one for each line of the deck
double start_value(const Model& m, const InitialValue& iv, const std::string& where, const double* X,
                   int& errors)
{
  const double value = expr_eval(iv.value, X, 0.0);
  if (std::isfinite(value)) return value;
  if (errors++ == 0)
    log_error("%s", value_text(m, "INITIAL CONDITIONS", iv.deck_line, iv.value, -1, where, X, 0.0).c_str());
  return 0.0;
}

// u or v of the corners of a body, which it may share with another one
void start_body(const Model& m, const InitialValue& iv, State& st, int& errors)
{
  const Points& pts = st.points;
  const int dim     = m.dim;
  RealVec& field    = iv.displacement ? st.n.uc : st.n.vc;
  const std::string where = "a corner of body " + m.body[iv.body].name;
  RealVec of_body(pts.ncorner, 0.0);
  for (int q = 0; q < pts.npoint; ++q)
    for (int k = pts.conn.off[q]; k < pts.conn.off[q + 1] && pts.body[q] == iv.body; ++k)
      of_body[pts.conn.item[k]] = 1.0;
  if (pts.part.on) halo_sum(pts.part.halo, 1, of_body);        // points of all ranks
  for (int c = 0; c < pts.ncorner; ++c) {
    if (of_body[c] == 0.0) continue;
    double X[3] = {0, 0, 0};
    for (int i = 0; i < dim; ++i) X[i] = pts.Xc[c * dim + i];
    field[c * dim + iv.dof] = start_value(m, iv, where, X, errors);
  }
}

int start_values(const Model& m, State& st)
{
  int wrong = 0;               // lines
  for (const InitialValue& iv : m.initial) {
    if (iv.dof >= m.dim) continue;
    int errors = 0;
    RealVec& field = iv.displacement ? st.n.u : st.n.v;
    for (int n : iv.node) {
      const std::string where = "node " + std::to_string(m.mesh.node_label[n]);
      field[n * m.dim + iv.dof] = start_value(m, iv, where, &m.mesh.X[3 * n], errors);
    }
    if (iv.body >= 0) start_body(m, iv, st, errors);
    wrong += errors > 0;
  }
  for (const Frame& f : m.frame)
    for (RealVec* field : {&st.n.u, &st.n.v})
      if (f.twin >= 0) frame_turn(f, m.dim, false, &(*field)[f.node * m.dim], &(*field)[f.twin * m.dim]);
  return wrong;
}

// values of dependent dofs by a list of equations   x [nnode*dim]
void follow_equations(const Model& m, const IntVec& list, RealVec& x)
{
  std::vector<EquationSolved> solved;
  int bad;
  if (!equations_resolve(m, list, solved, bad)) return;
  for (const EquationSolved& e : solved) {
    double sum = 0.0;
    for (const EquationMaster& q : e.master) sum += q.coef * x[q.node * m.dim + q.dof];
    x[e.node * m.dim + e.dof] = sum;
  }
}

// slave nodes of *TIE start with the motion of their masters
void start_ties(const Model& m, Level& l)
{
  IntVec list;
  for (int k : m.step.empty() ? IntVec() : m.step[0].equation)
    if (m.equation[k].of == EQUATION_TIE) list.push_back(k);
  for (RealVec* x : {&l.u, &l.v}) follow_equations(m, list, *x);
}

// equations of the first step hold at the start
int start_equations(const Model& m, const Level& l)
{
  int errors = 0;
  if (m.step.empty()) return 0;
  for (int k : m.step[0].equation)
    for (const bool velocity : {false, true}) {
      const Equation& e = m.equation[k];
      double sum = 0.0, size = 0.0;
      for (const EquationTerm& t : e.term) {
        const double x = t.coef * (velocity ? l.v : l.u)[t.node * m.dim + t.dof];
        sum += x;
        size = std::max(size, std::fabs(x));
      }
      if (std::fabs(sum) <= 1e-9 * size) continue;
      if (errors++ < 10)
        log_error("%s line %d, *EQUATION: the initial %s do not satisfy it (sum %g of terms up to %g): "
                  "*INITIAL CONDITIONS must give consistent values at all its nodes, also those without "
                  "elements",
                  e.deck_line.file.c_str(), e.deck_line.line, velocity ? "velocities" : "displacements", sum,
                  size);
    }
  return errors;
}

// One *BOUNDARY whose initial velocities differ from *INITIAL CONDITIONS, on all ranks
struct OtherVelocity {
  double nodes = 0.0;
  double label = 1e300, line = 0.0;    // smallest node label, last line of *INITIAL CONDITIONS
};

// [nnode*dim] line of *INITIAL CONDITIONS with the velocity of a dof before step k, 0: none
IntVec lines_of_velocity(const Model& m, int k)
{
  IntVec line(static_cast<size_t>(m.mesh.nnode()) * m.dim, 0);
  if (k > 0) return line;
  for (const InitialValue& iv : m.initial)
    for (int n : iv.node)
      if (!iv.displacement && iv.dof < m.dim) line[n * m.dim + iv.dof] = iv.deck_line.line;
  return line;
}

void warn_other_velocity(const Prescribed& b, const OtherVelocity& x)
{
  if (x.nodes == 0.0) return;
  log_warn("%s line %d, *BOUNDARY: %.0f nodes from node %.0f on have the velocity of their support from the "
           "start of the run, not the one of *INITIAL CONDITIONS, line %.0f",
           b.deck_line.file.c_str(), b.deck_line.line, x.nodes, x.label, x.line);
}

// dofs prescribed in the last step already [nnode*dim]; static: none, as they have no velocity
std::vector<char> supported_before(const Model& m, int k)
{
  std::vector<char> before(static_cast<size_t>(m.mesh.nnode()) * m.dim, 0);
  if (k == 0 || m.step[k - 1].proc != PROC_DYNAMIC) return before;
  for (const Prescribed& b : m.step[k - 1].prescribed)
    for (int n : b.node)
      for (int i = b.first; i <= b.last && i < m.dim; ++i) before[n * m.dim + i] = 1;
  return before;
}

// Sets v to the rates of one *BOUNDARY at the start of the step; other: nodes where *INITIAL CONDITIONS
// differ. True: v has changed
bool support_velocities(const Model& m, const Step& step, const Prescribed& b, double time,
                        const std::vector<char>& before, const IntVec& line, RealVec& v, OtherVelocity& other)
{
  const double later = 1e-3 * step.dt;
  bool any = false;
  for (int n : b.node) {
    const double* X   = &m.mesh.X[3 * n];
    const double x0   = prescribed_value(m, b, X, 0.0, time);
    const double rate = b.velocity ? x0 : (prescribed_value(m, b, X, later, time + later) - x0) / later;
    bool given = false;
    for (int dof = n * m.dim + b.first; dof <= n * m.dim + std::min(b.last, m.dim - 1); ++dof) {
      if (!std::isfinite(rate) || before[dof] || std::fabs(v[dof] - rate) <= 1e-6 * std::fabs(rate)) continue;
      any    = true;
      v[dof] = rate;
      if (line[dof] == 0) continue;
      given      = true;
      other.line = std::max(other.line, static_cast<double>(line[dof]));
    }
    if (!given) continue;
    other.nodes += m.part.counts(n);
    other.label = std::min(other.label, static_cast<double>(m.mesh.node_label[n]));
  }
  return any;
}

bool has_contact(const Model& m)
{
  for (const BondDef& d : m.bond)
    if (d.kind == BOND_CONTACT) return true;
  return false;
}

// finds overlapping surfaces at the start. Touching contact points get stiffness and friction of their face
// before they push
int start_contact(const Model& m, State& st, ContactScene& scene, ContactPairs& pairs)
{
  RealVec xb;
  bond_places(m, st.points, st.bonds, st.n.u, st.n.uc, xb);
  scene_update(m, st.points, st.bonds, st.n.u, st.n.uc, true, 0.0, scene);
  contact_search(m, st.points, st.bonds, st.n, xb, scene, pairs);
  contact_stiffness(st.n, m.dim, !m.step.empty() && m.step.front().proc == PROC_DYNAMIC, pairs, st.bonds);
  const int errors = contact_start(m, st.bonds, pairs, xb);
  for (int b = 0; b < st.bonds.nbond; ++b)
    if (st.bonds.side[b] == SIDE_CONTACT) {
      // surfaces that touch do not push each other apart  (test: contact/touch_rest.inp)
      const double gap = pairs.gap[b] - st.bonds.contact.offset[b];
      st.n.slip[b * m.dim] = gap < 0.0 && gap >= -contact_touch(pairs, b) ? 0.0 : gap;
    }
  return errors;
}

}  // namespace

bool step_supports(const Model& m, int k, double time, RealVec& v)
{
  if (m.step.empty() || m.step[k].proc != PROC_DYNAMIC) return false;
  const Step& step = m.step[k];
  const IntVec line = lines_of_velocity(m, k);
  const std::vector<char> before = supported_before(m, k);
  int any = 0;
  for (const Prescribed& b : step.prescribed) {
    OtherVelocity other;
    if (support_velocities(m, step, b, time, before, line, v, other)) any = 1;
    if (m.part.on) {
      comm_sum(&other.nodes, 1);
      other.label = -comm_allreduce_max(-other.label);
      other.line  = comm_allreduce_max(other.line);
    }
    warn_other_velocity(b, other);
  }
  if (m.part.on) any = comm_allreduce_max(any);
  if (any && !step.equation.empty()) follow_equations(m, step.equation, v);
  return any > 0;
}

int step_open(Problem& p)
{
  Timer timer(PHASE_SETUP);
  const Model& m = p.m;
  State& st      = p.st;
  int worst      = -1;
  if (elem_setup(m, p.d.el, &worst) != STATUS_OK) {
    log_error("element %d has det(dX/dxi) <= 0: its nodes are not counter-clockwise, or it is degenerate",
              m.mesh.elem_label[worst]);
    return 1;
  }
  int errors = frac_mesh(m, p.d.el, p.d.fm);
  if (errors) return errors;
  elem_scatter(m, p.d.fm.gc, p.d.el);
  frac_begin(m, p.d.fm, st.frac, st.n);
  if (!st.frac.empty()) p.d.el.frac = &st.frac;
  elem_refresh(p.d.el);
  errors = point_fill(m, st.points);
  if (errors) return errors;
  errors = bond_form(m, st.points, st.bonds);
  if (errors) return errors;
  bond_skin(m, st.points, contact_skin(m, st.frac, st.points, {}), st.bonds);
  bond_share(m, st.points, st.bonds);
  p.d.point_law = point_laws(m);
  const size_t nodal = static_cast<size_t>(m.mesh.nnode()) * m.dim;
  st.n.u.assign(nodal, 0.0);
  st.n.v = st.n.a = st.rf = st.n.u;
  st.n.uc.assign(st.points.Xc.size(), 0.0);
  st.n.vc.assign(st.n.uc.size(), 0.0);
  st.n.slip.assign(static_cast<size_t>(st.bonds.nbond) * m.dim, 0.0);
  st.n.lambda = st.n.slip;
  st.n.lambda_n.assign(st.bonds.nbond, 0.0);
  st.n.he.assign(static_cast<size_t>(p.d.el.gauss_of.back()) * p.d.el.history, 0.0);
  if (step_opens(m)) st.n.cracked.assign(m.mesh.nelem(), 0);
  st.n.hp.assign(static_cast<size_t>(st.points.npoint) * p.d.point_law.history, 0.0);
  point_scatter(m, st.points, st.n.hp);
  st.grid_rf.assign(m.grid_bc.size() * m.dim, 0.0);
  errors = start_values(m, st) + step_initial_stress(p);
  point_copy_corners(st.points, m.dim, {&st.n.uc, &st.n.vc});
  rigid_start(m, st.n.u, st.n.v);
  start_ties(m, st.n);
  if (errors == 0) errors = start_equations(m, st.n);
  if (errors) return errors;
  step_supports(m, 0, 0.0, st.n.v);
  if (has_contact(m)) errors = start_contact(m, st, p.d.scene, p.d.pairs);
  if (errors) return errors;
  overlap_pairs(m, p.d.watch);
  overlap_start(m, p.d.el, st.points, st.n.u, st.n.uc, p.d.watch);
  st.np1 = st.n;
  if (!solve_open(p.newton.solver, m.solver)) {
    log_error(m.solver.kind == SOLVER_AMG
                  ? "*SOLVER, TYPE=AMG: the PETSc library cannot be loaded; install it (tools/setup), or "
                    "use TYPE=AUTO"
                  : "the solver requested by *SOLVER is not part of this build (see tools/machines)");
    return 1;
  }
  return 0;
}

namespace {

// largest velocity component; in statics: rate of nodes in the last increment
double fastest(const MeshPart& part, const State& st, bool is_static)
{
  double largest = 0.0;
  for (const RealVec* v : {is_static ? &st.rate : &st.n.v, &st.n.vc})
    for (double x : *v) largest = std::max(largest, std::fabs(x));
  return part.on ? comm_allreduce_max(largest) : largest;
}

// does an exclusion of *CONTACT stand for a *CONTACT PAIR?
bool of_pair(const Model& m, const ContactRule& r)
{
  return std::any_of(m.bond.begin(), m.bond.end(), [&](const BondDef& b) {
    return b.pair() && b.surface == r.a.surface && b.contact.master == r.b.surface;
  });
}

// explicit, with *CONTACT of all faces: parts meet by these, and may share nodes of the grid. Bodies of the
// deck in one field, and what *CONTACT leaves out, meet through the grid alone
bool meet_by_faces(const Model& m, const Step& s)
{
  const int general = model_general_contact(m);
  if (!s.explicit_steps() || general < 0) return false;
  const ContactDef& c = m.bond[general].contact;
  const auto all      = [](const ContactSide& x) { return x.surface < 0 && x.elset < 0 && x.body < 0; };
  return std::all_of(m.body.begin(), m.body.end(), [](const Body& b) { return b.fill == FILL_CONVERSION; }) &&
         std::any_of(c.include.begin(), c.include.end(),
                     [&](const ContactRule& r) { return all(r.a) && all(r.b); }) &&
         std::all_of(c.exclude.begin(), c.exclude.end(),
                     [&](const ContactRule& r) { return of_pair(m, r); });
}

// stays: the active grid moves with corners and bonds; known: this rank has it, with all lists needed.
// The same on all ranks
void grid_serves(const Problem& p, const Step& s, const RealVec& xb, bool& stays, bool& known)
{
  const State& st = p.st;
  const bool here  = st.laid.made == p.d.grid.made;
  const bool meets = here && p.d.grid.meets && !meet_by_faces(p.m, s) &&
      step_searches(s, st.log);
  stays = st.points.npoint_all() && grid_stays(p.m, st.points, st.bonds, st.laid, meets, st.n.uc, xb);
  known = stays && here && grid_covers(st.points, st.bonds, p.d.owned, p.d.grid);
  if (!p.m.part.on || st.points.npoint_all() == 0) return;
  double no[2] = {stays ? 0.0 : 1.0, known ? 0.0 : 1.0};
  comm_max(no, 2);
  stays = no[0] == 0.0;
  known = no[1] == 0.0;
}

// the active grid, at its last position or, if it does not stay, at the present positions of corners and
// bonds. A grid rebuilt after a restart or a repartitioning shows only then whether bodies share it; then it
// may not stay
Failure lay_grid(Problem& p, const Step& s, const RealVec& xb, bool stays)
{
  State& st = p.st;
  for (bool again = true; again;) {
    int worst = 0;
    if (!stays) st.laid = {st.n.uc, xb, st.log.inc_total};
    const Status status =
        grid_activate(p.m, st.points, st.bonds, p.d.owned, st.laid.uc, st.laid.xb, p.d.grid, &worst);
    st.laid.made = p.d.grid.made;
    Failure failure = status;
    if (!failure.ok()) failure = {status, worst < 0 ? AT_BOND : AT_CORNER, worst < 0 ? -1 - worst : worst};
    if (p.m.part.on) failure = failure_agree(failure);
    if (!failure.ok()) return failure;
    again = stays && p.d.grid.meets && !meet_by_faces(p.m, s) && step_searches(s, st.log);
    bool known;
    if (again) grid_serves(p, s, xb, stays, known);
    again = again && !stays;
  }
  return STATUS_OK;
}

// Explicit steps keep contact faces until a node moved by this part of the smallest face since the search
// (test: contact/x2_discs.inp)
const double SEARCH_MOVE = 0.02;

// Factor of the depth from which the contact pressure grows, in explicit steps: otherwise a point that
// penetrates so far in one increment would be rejected faster than is stable
// (test: contact/g2_explicit.inp)
const double DEPTH_FACTOR = 4.0;

}  // namespace

bool step_contact_stays(const Problem& p, const Step& s)
{
  const ContactFound& f = p.stable.found;
  const State& st = p.st;
  bool stays = s.explicit_steps() && f.step == st.log.step && f.bonds == st.bonds.nbond_all() &&
               f.changes == st.frac.nconverted + st.frac.nreleased && f.u.size() == st.n.u.size() &&
               f.uc.size() == st.n.uc.size() && p.d.pairs.gap.size() == static_cast<size_t>(st.bonds.nbond);
  double largest[2] = {stays ? 0.0 : 1.0, 0.0};
  if (stays)
    largest[1] = std::max(contact_largest_way(p.m.dim, f.u, st.n.u),
                          contact_largest_way(p.m.dim, f.uc, st.n.uc));
  if (p.m.part.on) comm_max(largest, 2);
  return largest[0] == 0.0 && largest[1] < SEARCH_MOVE * f.size;
}

namespace {

void note_contact(Problem& p)
{
  ContactFound& f = p.stable.found;
  const State& st = p.st;
  f.step    = st.log.step;
  f.time    = st.n.time;
  f.bonds   = st.bonds.nbond_all();
  f.changes = st.frac.nconverted + st.frac.nreleased;
  f.u       = st.n.u;
  f.uc      = st.n.uc;
  f.size    = 1e300;
  const RealVec& general = p.d.scene.size;           // at t = 0: crushed debris does not count
  const auto& skin = p.d.scene.skin;
  const bool grains = std::all_of(skin.begin(), skin.end(), [](const SkinFace& k) { return k.points == 2; });
  for (int b = 0; b < st.bonds.nbond && general.empty(); ++b)
    if (st.bonds.side[b] == SIDE_CONTACT && p.d.pairs.master.count(b))
      f.size = std::min(f.size, p.d.pairs.size[b]);
  for (size_t k = 0; k < general.size(); ++k)        // nor do points squeezed at their release
    if (grains || skin[k].points != 2) f.size = std::min(f.size, general[k]);
  if (p.m.part.on) f.size = -comm_allreduce_max(-f.size);
}

// faces and stiffness of contact points. FACES_UNKNOWN
Failure find_contact(Problem& p, const Step& s, const RealVec& xb)
{
  State& st = p.st;
  if (step_contact_stays(p, s)) {
    if (!p.stable.before.empty()) step_turn_begin(p, s);
    for (int b = 0; b < st.bonds.nbond && st.n.time > p.stable.found.time; ++b)
      if (p.d.pairs.master.count(b)) p.d.pairs.gap[b] = st.n.slip[b * p.m.dim];
    p.d.pairs.searched = p.d.pairs.skipped = 0;      // faces are kept
    timer_skip(PHASE_CONTACT);
    return STATUS_OK;
  }
  Timer timer(PHASE_CONTACT);
  step_turn_begin(p, s);
  if (!masters_known(p.m, st.points, st.bonds, st.n.u, st.n.uc, xb, p.d.masters, p.next.faces))
    return FACES_UNKNOWN;
  const bool is_static = s.proc == PROC_STATIC;
  const double travel  = 2.0 * st.clock.dt * fastest(p.m.part, st, is_static);
  scene_update(p.m, st.points, st.bonds, st.n.u, st.n.uc, is_static, travel, p.d.scene);
  contact_search(p.m, st.points, st.bonds, st.n, xb, p.d.scene, p.d.pairs);
  for (double& deep : p.d.pairs.deep)
    if (s.explicit_steps()) deep *= DEPTH_FACTOR;
  contact_stiffness(st.n, p.m.dim, !is_static, p.d.pairs, st.bonds);
  contact_initial(st.n, p.m.dim, !is_static, st.bonds, p.d.pairs);
  st.log.contact_searched += p.d.pairs.searched;
  st.log.contact_skipped += p.d.pairs.skipped;
  if (s.explicit_steps()) note_contact(p);
  return STATUS_OK;
}

// widths of the cracks of points; warns once of a body that moves through the grid while it cracks
void open_bands(Problem& p)
{
  const State& st = p.st;
  const int came  = point_bands(p.m, st.points, st.n, st.laid.uc, p.d.point_law);
  if (came == 0 || !p.warned.insert("points came into open cells").second) return;
  log_warn("time %.8g: %d material points begin to crack in grid cells whose crack is open: their body "
           "moves through the grid while it cracks, or E Gc/ft^2 is less than three cells; the crack "
           "dissipates 0.7 to 1.3 times the toughness. Use smaller cells, or elements",
           st.n.time, came);
}

}  // namespace

Failure step_prepare(Problem& p, const Step& s)
{
  if (p.ready) return STATUS_OK;
  State& st = p.st;
  elem_rigid(p.m, s, p.d.el);
  const std::array<size_t, 2> counts{{st.frac.converted.size(), st.frac.released.size()}};
  if (!s.explicit_steps() || counts != p.stable.followed)
    frac_follow(p.m, st.frac, st.points, p.d.follow);
  p.stable.followed = counts;
  RealVec xb;
  if (st.bonds.nbond_all()) {
    Timer timer(PHASE_BOND);
    bond_places(p.m, st.points, st.bonds, st.n.u, st.n.uc, xb);
  } else {
    timer_skip(PHASE_BOND);
  }
  if (has_contact(p.m)) {
    const Failure failure = find_contact(p, s, xb);
    if (!failure.ok()) return failure;
  } else {
    timer_skip(PHASE_CONTACT);
  }
  point_groups(st.points, p.d.point_law);
  if (p.m.part.window) dof_share_points(p.m, p.d.el, st.n.uc, st.points, st.division);
  dof_share_grid(p.m, st.points, st.bonds, p.d.pairs, st.division, p.d.owned);
  bool stays, known;
  grid_serves(p, s, xb, stays, known);
  if (known) {
    timer_skip(PHASE_GRID);
  } else if (st.points.npoint_all()) {
    Timer timer(PHASE_GRID);
    const Failure failure = lay_grid(p, s, xb, stays);
    if (!failure.ok()) return failure;
  } else {
    timer_skip(PHASE_GRID);
    timer_skip(PHASE_PROJECT);
    p.d.grid = ActiveGrid();
    p.d.grid.bond.off.assign(st.bonds.nbond + 1, 0);    // only bonds to the ground and contact
  }
  open_bands(p);
  dof_form(p.m, s, st, p.d, p.dofs);
  if (s.proc == PROC_DYNAMIC) {
    const long of = p.dofs.mass.mass_of, made = p.dofs.mass.mass_made;
    assem_mass(st.points, p.d, p.dofs);
    assem_damping(p.m, st.points, p.d, s.explicit_steps(), p.dofs);
    if (!s.explicit_steps()) p.dofs.mass.lumped.clear();
    else if (p.dofs.mass.lumped.empty() || of != p.dofs.mass.mass_of || made != p.dofs.mass.mass_made)
      assem_lumped(p.dofs);
  } else {
    p.dofs.mass.lumped.clear();
    timer_skip(PHASE_MASS);
  }
  st.log.grid_nodes = p.d.grid.of_all.nodes;
  st.log.grid_cells = p.d.grid.of_all.cells;
  st.log.weak_nodes = p.d.grid.of_all.weak;
  st.log.equations  = static_cast<int>(p.dofs.rows.neq_all());
  p.ready = true;
  return STATUS_OK;
}
