// ---------------------------------------------------------------------------
// step.h : increments, Newton's method, explicit steps, cuts, ledger, repartitioning (doc/theory.md 6)
// ---------------------------------------------------------------------------
#ifndef MPFE_STEP_STEP_H
#define MPFE_STEP_STEP_H

#include <array>
#include <functional>

#include "assem/assem.h"
#include "out/out.h"

// The tangent in DofPattern::A and the data it was formed with
struct ReusedTangent {
  bool on = false;             // reusable: no NLGEOM, contact or fracture
  long pattern = 0;
  double cM = 0.0, cC = 0.0;
  KernelMode mode;
  IntVec fixed;
  RealVec diag;                // [neq] diagonal before prescribed dofs
  RealVec whole;               // [neq] the same before equations; without equations: empty
  // iterations that reused the same tangent, and that of the iteration before
  long same = 0, near = 0;
  // dynamics: serves for later iterations and increments while these converge                   (8.18)
  bool keeps = false;
  int broken = 0;              // elements that were broken when it was formed
  long made = -1;              // ActiveGrid::made then
  int age = 0;                 // solutions with it
  int wait = 0, pause = 0;     // increments until it is kept again, after it has failed soon
  long kept = 0;               // iterations that it saved
};

// Is the static tangent known to be regular from the supports alone, for this pattern and these supports?
struct KnownRegular {
  bool good = false;
  long pattern = -1;
  IntVec fixed;
};

// Velocity at the end of the last increment, of the grid rows and, where points follow nodes, of the node
// rows: initial guess or result of the next projection                                    (3.14), (3.19)
struct GridVelocity {
  long pattern = -1, made = -1;  // DofPattern::number, ActiveGrid::made
  int increment = 0;           // StepLog::inc_total at the end of that increment
  int first = 0;               // the first of these rows
  std::vector<long> key;       // row_key of the rows of the grid, descending
  RealVec v;                   // [rows*dim]
  RealVec a;                   // [rows*dim] explicit step: acceleration; else empty
  RealVec f;                   // [rows*dim] explicit step: loads less internal forces; else empty
  IntVec fixed;                // [rows*dim] DofKind
};

// Means of the accelerations over the last increments: 2 (du - dt v)/dt^2 of the unknowns, the newest first
//                                                                                               (6.44)
struct Motion {
  static const int ORDERS = 3;
  std::vector<float> node[ORDERS], grid[ORDERS];     // [nnode*dim], [rows of the grid*dim]
  std::vector<long> key;       // row_key of the rows of the grid, descending
  int known = 0;               // number of stored increments
  int order = 0;               // used for the next predictor
  int wait = 0;                // increments until it is tried again, after free flight was as good
  // of the last increment, for the first residual of the next one (6.45)          [neq]
  RealVec du, fint;
  long pattern = -1, made = -1;          // DofPattern::number, ActiveGrid::made
  int linear_wait = 0;         // increments until it is used again, after it was inaccurate
  int step = 0, increment = 0; // StepLog::step, inc_total
  double dt = 0.0;
};

// Data of Newton's method reused in the next increment; they change results by round-off only
struct NewtonMemory {
  Solver solver;
  RealVec gain;                // [iteration] ratio of the residuals after and before, last increment
  // [iteration] part of the residual that a correction leaves beyond what the solver leaves, last increment
  RealVec beyond;
  ReusedTangent tangent;
  Motion motion;
  std::vector<RealVec> spare;  // vectors of the system that are not in use, for their memory
  KnownRegular regular;
  GridVelocity grid;
};

// Data for the next repartitioning of a divided model
struct NextDivision {
  bool stays = false;          // the model cannot be repartitioned
  long lists = 0;              // ContactScene::built at the last check of the near faces
  std::vector<NearFace> faces; // faces of this rank with near faces missing on this rank
};

// Last contact search of an explicit step, with the displacements then; size: of the smallest face
struct ContactFound {
  int step = -1, bonds = 0, changes = 0;
  RealVec u, uc;               // [nnode*dim], [ncorner*dim]
  double size = 0.0, time = 0.0;
};

// Data of explicit steps between increments. They are not in the restart file; after writing it the run
// discards them too (discard_grid)
struct StableIncrement {
  ContactFound found;
  double crossing = 0.0;       // wave transit time of the smallest element size; 0: unknown
  bool shares = false;         // elements share the mass of their nodes                        (6.46)
  bool whole = true;           // the points of all converted elements move as these
  long whole_of = -1;          // conversions and releases for which this is known
  // [nnode + ncorner] work space: contact stiffness over mass (1/time^2), and mass
  RealVec push, mass;
  // [(nnode + ncorner)*dim] contact forces at t(n) before the search, not summed over ranks; empty: none
  RealVec before;
  bool apart = false;          // the model was repartitioned: accelerations at t(n) are those without contact
  // loads at the end of increment inc of step, for these rows
  RealVec fext;
  long pattern = -1, made = -1;          // DofPattern::number, ActiveGrid::made
  int step = 0, inc = 0;
  RealVec spare, fint, du, R;  // reused for their memory only
  RealVec rf;                  // [nnode*dim] reactions at the start of the last increment; empty: none
  // numbers of converted elements and released points that Discretisation::follow was made with
  std::array<size_t, 2> followed{{0, 0}};
};

// reason of a repartitioning: uneven work; near contact faces missing on a rank
enum Again { AGAIN_NOT, AGAIN_WORK, AGAIN_FACES };

// All data of a run
struct Problem {
  Problem(Model& model, State& state) : m(model), piece(model), st(state) {}
  const Model& m;
  Model& piece;                // the same, writable: a divided model receives elements (step_fracture)
  State& st;
  Discretisation d;
  Dofs dofs;
  bool ready = false;          // grid, rows, pattern and mass belong to t(n)
  NewtonMemory newton;
  Warned warned;
  size_t warned_all = 0;       // several ranks: number of entries of warned that all ranks have
  NextDivision next;
  StableIncrement stable;      // explicit steps
  Again again = AGAIN_NOT;     // reason to repartition when step_run returns
};

// Vectors of the system in the memory of earlier ones, until the end of the block. Their values are arbitrary
struct Borrowed {
  Borrowed(std::vector<RealVec>& from, const std::vector<RealVec*>& vectors) : spare(from), all(vectors)
  {
    for (RealVec* v : all)
      if (!spare.empty()) {
        v->swap(spare.back());
        spare.pop_back();
      }
  }
  ~Borrowed()
  {
    for (RealVec* v : all)
      if (!v->empty()) spare.push_back(std::move(*v));
  }
  Borrowed(const Borrowed&) = delete;
  Borrowed& operator=(const Borrowed&) = delete;
  std::vector<RealVec>& spare;
  std::vector<RealVec*> all;
};

// Properties of the material for Newton's method, set by step_increment
struct NewtonControls {
  bool linear   = false;       // the tangent does not depend on du and may be reused
  bool breaks   = false;       // broken material: kinks in the residual, hardly any stiffness
  bool unsymmetric_flow = false;         // non-associated flow: the matrix is symmetrised
  bool slips    = false;       // statics with friction in contact: the tangent may be unsymmetric   (6.23)
  bool opens    = false;       // statics with cohesive cracks: the tangent may be indefinite
  bool singular = false;       // statics with broken material: the tangent is nearly singular
  int max_iter  = 0;
  int patience  = 0;           // iterations without a smaller residual before the line search starts  (6.6)
};

// *STATIC, RIKS: an element whose extension is prescribed                                 (6.39)
struct ArcElement {
  int e = -1;
  std::array<double, 3> N{{0, 0, 0}};        // crack normal
  double width = 0.0;                        // size of the element along N
  bool cracked = false;
  double max_extension = 0.0;                // in an increment of dt of the deck
};
struct Arc {
  bool on = false;
  std::vector<ArcElement> element;           // elements of this rank with prescribed extension
  bool any = false;                          // any rank has one; else the loads grow by dt
  bool cracked = false;                      // one of them is cracked
  double from = 0.0, at = 0.0;               // load time at t(n), and now
  double length = 0.0;                       // prescribed sum of extensions over the increment
  bool last     = false;                     // length is the remaining displacement of the set
  RealVec load, support;                     // [neq] load and prescribed displacement per load time
};

// Secants of earlier iterations, for a tangent whose unsymmetric part is not in the matrix      (6.22)
struct Secants {
  std::vector<RealVec> du, dx;         // differences between iterations
  RealVec last_du, last_dx;            // [neq] last iterate, and its correction by the matrix
};

// step_product : a . diag b with the positive part of diag [neq]; several ranks: diag is zero in rows owned
// by others (dof_own)
double step_product(const RealVec& a, const RealVec& b, const RealVec& diag);

// step_secant : replaces the correction dx at du by that of Anderson's method
void step_secant(Secants& h, const RealVec& du, const RealVec& diag, RealVec& dx);

// step_slip : solves (A + E) x = f, where E is the unsymmetric part of slipping contact               (6.23)
//   in   eta    tolerance of the residual, relative to f;   out  left  relative residual
struct SlipSystem {
  RealVec weight;              // [neq] inverse diagonal; several ranks: zero in rows owned by others
  std::function<void(const RealVec& x, RealVec& y)> multiply;              // y = (A + E) x
  std::function<Status(const RealVec& v, RealVec& z)> precondition;        // z, approximately A^-1 v
};
Status step_slip(const SlipSystem& system, const RealVec& f, double eta, RealVec& x, double& left);

// Where Newton's method starts from
struct Start {
  bool left = false;             // Newton's method has begun: du is not the predictor any more
  double predicted = 0.0;        // energy of the predictor beyond free flight; 0: free flight
  RealVec guess;                 // [neq] statics: initial guess of du
  bool guesses = false;          // there is a guess; a rank may have no rows
};

// Data of an explicit attempt                                                     (6.28), (6.29)
struct Leap {
  RealVec acc;                 // acceleration at t(n+1) [neq]
  bool plain  = false;         // no ties, no dampers: v and a of nodes are written to st.np1
  double work = 0.0;           // plain: work of loads and supports over the increment
  double friction  = 0.0;      // energy that friction on planes of the grid takes
  double leap_grid = 0.0;      // Ledger::leap_grid at t(n+1), of this rank
};

// Data of one attempt of an increment                                              (6.1)
//   residual  R = fint + cM M du + cC C du - g - fext
struct Attempt {
  const Step& step;
  KernelMode mode;
  double t0, t1, dt;           // times of the step
  double total0, total1;       // times of the run
  LoadTime load;               // t1, or the middle
  NewtonControls newton;
  double cM = 0.0, cC = 0.0;
  RealVec g{};                   // [neq] part of inertia and damping independent of du
  RealVec momentum{};            // [neq] M v of nodes, sum m S v of points
  // [neq] velocity at t(n): of nodes; projected for the grid, and for nodes that points follow
  RealVec vgrid{};
  RealVec agrid{};             // [neq] acceleration of the grid at t(n), rows of the grid (Newmark)
  RealVec fint0{}, fext0{};        // [neq] at t(n) with the weights of this step (statics, Newmark)
  RealVec fint{}, fext{}, R{};       // [neq] at the solution; R: forces of equations moved to masters
  // [neq] Newmark, supports that move: M a + C v + fint - fext at t(n); else empty
  RealVec before{};
  RealVec du{};                  // [neq]
  BulkStep bulk{};               // bulk viscosity
  RealVec* energy = nullptr;     // explicit: [nelem] energy of intact elements, if fracture is tested
  Leap leap{};
  Jumps jumps{};               // of du
  Start start{};
  Arc arc{};
};

// step_open : state at t = 0: points, bonds, elements, initial velocities. Returns the number of errors.
int step_open(Problem& p);

// step_supports : dynamics: dofs first prescribed in step k, which starts at time, get the velocity of their
// support at once. A jump within the first increment would change the energy by that of their mass.
// True: a velocity in v changed. Collective.
// (test: stress/velocity_on_support.inp, stress/support_begins.inp)
bool step_supports(const Model& m, int k, double time, RealVec& v);

// step_initial_stress : initial strains of integration points, from *INITIAL CONDITIONS, TYPE=STRESS; returns
// the number of errors                                                                            (2.44)
int step_initial_stress(Problem& p);

// step_change : elements that step k, which begins, removes and adds. Collective.                 (6.43)
Failure step_change(Problem& p, int k);

// Explicit: conversion and release of points only every so many increments, since each one rebuilds grid,
// masses, bonds and surfaces; until then broken elements stay elements  (test: paper/p9_explicit.inp)
const int EXPLICIT_BATCH = 4;

// step_converts : may elements be converted and points be released at the end of this increment?
// step_searches : is it the increment after, in which a grid shared by bodies that meet is reset after a
// tenth of KEEP? In between it follows KEEP
inline bool step_converts(const Step& s, const StepLog& log)
{
  return !s.explicit_steps() || log.inc % EXPLICIT_BATCH == 0;
}
inline bool step_searches(const Step& s, const StepLog& log)
{
  return !s.explicit_steps() || log.inc % EXPLICIT_BATCH == 1;
}

// step_prepare : active grid, rows, pattern and mass of the next increment, once for all attempts
Failure step_prepare(Problem& p, const Step& s);

// ---- the clock of a step (step_clock.cpp): nominal increments, cuts, and times to be hit
// clock_stops : step times of field checks and conversions, at which automatic increments end
std::vector<double> clock_stops(const Model& m, const Step& s, double start);

// clock_next : length of the next attempt
double clock_next(const Step& s, const StepClock& c, const std::vector<double>& stops);

// clock_accept : advances the clock by a converged increment. Automatic increments choose the next length by
// the iterations, and by half, the half-increment residual over its limit (0: not requested)
void clock_accept(const Step& s, double used, int iterations, double half, StepClock& c);

// The half-increment residual in the attempts of one increment                              (6.24), (6.25)
struct HalfWatch {
  bool on = false;             // requested
  double residual = 0.0, limit = 0.0;        // of this attempt: largest entry, and its limit            force
  double force = 0.0;          // largest inertia force at its ends
  double before = 0.0, dt_before = 0.0;      // of the attempt before: residual, length; 0: none
  int kept = 0;                // cuts in a row that hardly reduced the residual
  double shorter = 0.0;        // length of the next attempt
  bool jumps = false;          // accepted above the limit: jump of the force
  bool least = false;          // accepted above the limit: no further cut allowed
};

// step_half : residual, force and limit of the converged attempt a; st.np1 is restored
Failure step_half(Problem& p, const Attempt& a, HalfWatch& w);

// half_judge : HALF_RESIDUAL when a shorter attempt is required; cuts: number of cuts of this increment
Failure half_judge(const Step& s, double dt, int cuts, HalfWatch& w);

// step_largest_move : largest displacement of a node or a corner of this rank in the increment so far
double step_largest_move(const State& st);

// step_increment : one attempt from t(n) over dt; result in st.np1. Never changes st.n.
//   out  energy   with fracture: strain energy of intact elements at t(n+1), of this rank  [nelem]
//   inout half    not null and on: HALF_RESIDUAL rejects attempts that are too long
Failure step_increment(Problem& p, const Step& s, double t0, double dt, RealVec& energy,
                       HalfWatch* half = nullptr);

// The linear system of a Newton iteration                                          (6.2)
struct LinearSystem {
  explicit LinearSystem(ReusedTangent& z) : diag(z.diag), whole(z.whole) {}
  RealVec f, dx;               // [neq] right-hand side, correction
  RealVec &diag, &whole;       // of the tangent
  double residual = 0.0, energy = 0.0;   // largest norm of R and sqrt(f dx) so far, scales of accuracy
  double own_energy = 0.0;     // f dx of this rank
  bool secant = false;         // A has the secants of cohesive cracks (6.38)
  RealVec g, along;            // [neq] RIKS: right-hand side per load time, and its correction
};

// With a kept tangent the last residual may be just below the tolerance; Newton's method leaves much less:
// factor of the tolerance (8.18)  (test: speed/reuse)
const double KEPT_PART = 0.3;

// step_tangent : A = K + cM M of iteration it and f = -R with the prescribed corrections inserted; A is
// reused in linear models, and in the last iteration when it is accurate enough (8.11)
//   in   residual, accepted   norm of R, and its tolerance
void step_tangent(Problem& p, const Attempt& a, int it, double residual, double accepted, const RealVec& R,
                  const RealVec& pending, LinearSystem& l);

// step_solve : dx of iteration it, as accurate as Newton's method needs (8.6)
//   in   residual, accepted   norm of R, and its tolerance
Failure step_solve(Problem& p, const Attempt& a, int it, double residual, double accepted,
                   const RealVec& pending, LinearSystem& l);

// step_solve_arc : solves for l.along with the factorisation of step_solve
Failure step_solve_arc(Problem& p, const Attempt& a, int it, double residual, double accepted,
                       LinearSystem& l);

// step_supports_fix : do the supports restrain all six rigid motions of every part of solid elements in
// space? Elements that share faces form a part. True: the static matrix is known to be regular without
// factorisation; false: not known
bool step_supports_fix(const Model& m, const Elements& el, const Dofs& dofs);

// step_free_motion : text of the free rigid motions of the part with this node; empty: none
std::string step_free_motion(const Model& m, const Elements& el, const Dofs& dofs, int node);

// step_memory : bytes of the data kept during the run
void step_memory(const Problem& p, std::vector<MemoryUse>& out);

// step_solved_well : was the correction accurate enough for the last iteration?
bool step_solved_well(const Solver& solver, const LinearSystem& l);

// step_gain : stores the ratio of the residuals of iteration it
void step_gain(NewtonMemory& memory, int it, double gain);

// step_judge_tangent : after a whole correction: NewtonMemory::beyond, and whether the tangent is kept
//   in   before, R, now   norm of the residual before; the residual and its norm
void step_judge_tangent(Problem& p, int it, double before, const RealVec& R, double now);

// step_linear_force : a.fint at the predictor from that of the last increment and the kept tangent; false:
// not known well enough                                                                        (6.45)
// step_judge_linear : gain: ratio of the residuals of the first iteration after that; part: of the forces
bool step_linear_force(Problem& p, Attempt& a);
void step_judge_linear(Problem& p, double gain, double part);

// step_same_system : does the tangent in A belong to the system of the attempt?
bool step_same_system(const ReusedTangent& z, const Dofs& dofs, const Attempt& a);

// step_predict : adds the acceleration expected from the last increments to the predictor a.du. Collective.
// step_keep_motion : stores that of the increment. Collective.                                  (6.44)
void step_predict(Problem& p, Attempt& a);
void step_keep_motion(Problem& p, Attempt& a);

// step_flow_unsymmetric : is the plastic flow of a material non-associated, its tangent unsymmetric?
bool step_flow_unsymmetric(const Model& m);

// step_opens : can cohesive cracks open?
bool step_opens(const Model& m);

// step_tracks : do cohesive cracks grow along lines (TRACK)?
bool step_tracks(const Model& m);

// step_mode : data of the scheme for the kernel: S of energy-momentum, or all at t(n+1)
KernelMode step_mode(const Step& s);

// step_contact_depth : CONTACT_DEPTH when a contact point penetrated by more than a quarter of the face size
// in one increment, and may have missed another face; or by nearly half, the limit of the search: the
// penalty is far too soft then.   l: level n+1
Failure step_contact_depth(const Bonds& b, const ContactPairs& pairs, const Level& l, int dim);

// step_newton : solves R(du) = 0 for the attempt. After a failure with a guess, repeat without it
Failure step_newton(Problem& p, Attempt& a);

// step_arc_begin : *STATIC, RIKS: selects the elements with prescribed extension, and the load rates
// step_arc_force : g [neq], right-hand side per load time, with A before prescribed dofs
// step_arc_advance : advance of the load time in the correction dx; along: correction per load time
// step_arc_load : advances loads and supports by a load time
// step_arc_end : end of the increment, in the clock: is the step at its end?
Failure step_arc_begin(Problem& p, Attempt& a);
void step_arc_force(const Dofs& s, const Arc& arc, RealVec& g);
double step_arc_advance(const Problem& p, Attempt& a, int it, const RealVec& dx, const RealVec& along);
void step_arc_load(Problem& p, Attempt& a, double advance);
void step_arc_end(Problem& p, const Attempt& a);

// step_explicit : the attempt by central differences: du, forces and acceleration at t(n+1) (6.28), (6.29)
Failure step_explicit(Problem& p, Attempt& a);

// step_stable : explicit: sets st.clock.dt to the stable increment at t(n), or to that of the deck if it is
// shorter. Collective.                                                         doc/theory.md (6.30) - (6.32)
Failure step_stable(Problem& p, const Step& s);

// Rows with a smaller row sum of the mass relative to its diagonal take no part in what is distributed by the
// lumped mass: weights of opposite sign cancel there  (no test)
const double MIN_ROW_SUM = 0.05;

// step_keep_momentum : distributes the residual of M a = f in the rows of the grid to a by the lumped mass,
// so that the change of momentum is f to round-off
void step_keep_momentum(const Dofs& s, const RealVec& f, RealVec& acc);

// step_accelerations : explicit: accelerations of free dofs from the forces f, with dampers over half (dt/2);
// step_accelerations_turning : nodes of rigid bodies also have w x (w x r)                          (6.41)
//   in   acc   those of fixed dofs
//        u     displacements at the time of f   [nnode*dim]
//        v     velocities at that time          [neq]
Failure step_accelerations(const Problem& p, const RealVec& f, double half, RealVec& acc);
Failure step_accelerations_turning(const Problem& p, const RealVec& u, const RealVec& v, const RealVec& f,
                                   double half, RealVec& acc);

// step_on_grid : do rows of the grid, or corners that follow nodes, take part in the motion?
inline bool step_on_grid(const Discretisation& d, const Dofs& s)
{
  return d.grid.of_all.nodes > 0 || s.rows.hung;
}

// step_turn_begin : explicit: stores the contact forces at t(n) before the new contact search
// step_turn : updates the accelerations at t(n) to the contact found now: the force has one direction at both
// ends of an increment, and its work is the energy that contact stores. Collective.               (6.37)
// step_turn_apart : explicit: removes the contact forces from the accelerations at t(n) before the model is
// repartitioned, since the contact found does not move to other ranks: StableIncrement::apart. Collective.
// step_turn_back : explicit, before a restart file: takes back now what the next increment would (6.51): the
// file has no forces; with rows of the grid the accelerations start anew. Collective.
// step_contact_stays : explicit: may contact points keep their faces? Collective.
void step_turn_begin(Problem& p, const Step& s);
void step_turn_apart(Problem& p, const Step& s);
void step_turn_back(Problem& p);
bool step_contact_stays(const Problem& p, const Step& s);
Failure step_turn(Problem& p);

// step_corners_shared : are there corners shared by several ranks?
inline bool step_corners_shared(const Points& pts)
{
  return (pts.part.on || pts.part.window) && pts.npoint_all() > 0 && pts.part.halo.on();
}

// step_bulk_means : ElemBlock::mean, for the bulk viscosity
void step_bulk_means(Problem& p, const Step& s);

// step_hold_bulk : explicit: mode with the pressures of the bulk viscosity at t(n)
void step_hold_bulk(Problem& p, const Step& s, BulkStep& bulk, KernelMode& mode);

// step_leap_of_grid : explicit: 1/8 a M a of the free rows of the grid, acc [neq]. Collective.     (6.33)
double step_leap_of_grid(const Problem& p, const RealVec& acc);

// step_motion_begin : explicit: velocities and accelerations of nodes and grid at t(n)
Failure step_motion_begin(Problem& p, Attempt& a);

// step_damping : damping force at t(n) of velocities v [neq]: C v and that of the viscous stress. Changes
// st.np1.   t_step: time of the step
// step_damps: is there any damping?
Failure step_damping(Problem& p, bool finite, double t_step, double dt, const RealVec& v, RealVec& f);
bool step_damps(const Problem& p);

// step_inertia_begin : momentum, projected velocity, g, cM of a dynamic step
Failure step_inertia_begin(Problem& p, Attempt& a);

// step_finish : velocities, reactions, energies at t(n+1) into st.np1 and st.ledger; energy as
// step_increment
void step_finish(Problem& p, Attempt& a, RealVec& energy);

// step_residual_at_start : statics: fint - fext at t(n) on the weights of this step, [neq]. Collective
RealVec step_residual_at_start(const Problem& p, const Attempt& a);

// step_settle : statics: adds the energy lost by unbalanced forces at t(n) to st.ledger, by cause    (6.15)
void step_settle(Problem& p, const Attempt& a, const RealVec& rf0, const RealVec& R0);

bool step_grid_rubs(const Model& m);       // *GRID BOUNDARY, FRICTION
// step_grid_friction : explicit: *GRID BOUNDARY, FRICTION changes the accelerations acc of the grid, and
// reduces no velocity v + dt acc beyond zero; f: forces without it [neq]. Returns the power that it takes
// at the velocity v                                                                                  (6.48)
double step_grid_friction(const Problem& p, const RealVec& f, const RealVec& v, double dt, RealVec& acc);

// step_initial_acceleration : a = M^-1 (fext - fint), at the start of a Newmark step and after fracture
Failure step_initial_acceleration(Problem& p, const Step& s, double t_step);

// step_warn_missed : at the start of a step: warns of peaks of loads and supports between fixed increments
//   in   mid   loads are taken at the middle of the increment
void step_warn_missed(const Model& m, const Step& s, double start, bool mid);

// ledger_sums : energies and momenta of the level; energy: strain energy of intact elements [nelem]; work: in
// of this rank, out of all ranks
// ledger_energy : kinetic and stored energy, with what plastic flow and cohesive cracks have dissipated
// ledger_lost : sum of all energy dissipated or lost, by known cause
// ledger_balance : energy of bonds, and the imbalance;   ledger_update : both; ledger_known: with the strain
// energies of the elements that were intact when energy was formed with the forces of l
// ledger_open : at the start of the run, with the round-off level;   ledger_begin_step : of a step
void ledger_sums(const Model& m, const Elements& el, const Dofs& dofs, const Level& l, bool nlgeom,
                 State& st, double& work, RealVec* energy);
inline double ledger_energy(const Ledger& g)
{
  return g.kinetic + g.strain + g.bond + g.plastic + g.cohesive;
}
double ledger_lost(const Ledger& g);
void ledger_balance(int dim, const Level& l, State& st);
void ledger_open(const Model& m, const Elements& el, const Dofs& dofs, State& st);
void ledger_begin_step(Ledger& g);

// ledger_leap : kinetic energy of explicit increments of length dt, or of the velocities at t(n) (0); changes
// the energy at the start of the run by the same amount. Called with 0 before the accelerations at t(n)
// change without motion, and with dt after it. Collective.                                      (6.33)
void ledger_leap(const Dofs& dofs, double dt, State& st);
void ledger_update(const Model& m, const Elements& el, const Dofs& dofs, const Level& l, bool nlgeom,
                   State& st, RealVec* energy = nullptr);
void ledger_known(const Model& m, const Elements& el, const Dofs& dofs, const Level& l, bool nlgeom,
                  const RealVec& energy, State& st);

// First fracture in an automatic static increment                                                 (7.25)
struct BreakWatch {
  bool on = false;             // the increment may be cut
  double value0 = 0.0;         // criterion of first at the start of the increment
  FirstBreak first;            // first element to break, at the end of the increment
  bool shortens = false;       // TRACK: the increment may be cut to half
  TrackResult track;           // of the increment
};

// step_undo_point, step_undo : save and restore the state before an increment, with elements, points and
// bonds. Level n is copied (statics, where grid and contact are found again), or kept by step_undo_keep
// before it is overwritten (dynamics). Points are saved by step_undo_points before they change
struct UndoPoint {
  // explicit: results of contact at the start of the increment, which its end writes before state is saved
  struct Contact {
    IntVec met, wall;
    RealVec normal, grid_rf;
    std::vector<ContactLog> log;
  } contact;
  bool later = false;          // contact is saved; reactions: StableIncrement::rf
  State state;                 // without levels
  bool whole = true;           // state is saved; explicit steps save it before it changes
  bool points = false;         // state has the points, and share belongs to them
  Level n;                     // the copy, or the level kept
  bool copy = false, kept = false;
  CornerShare share;
};
void step_undo_point(State& st, bool copy, UndoPoint& u);
// explicit: step_undo_state saves the state before it changes
void step_undo_later(const State& st, UndoPoint& u);
void step_undo_state(State& st, UndoPoint& u);
void step_undo_points(const State& st, const CornerShare& share, UndoPoint& u);
void step_undo_keep(State& st, UndoPoint& u);
void step_undo(Problem& p, UndoPoint& u);

// step_tests : is a fracture test due at time? Explicit: conversion and release of points wait for it
bool step_tests(const Problem& p, const Step& s, double time);

// step_can_undo : can the state be restored? Not if points changed that were not saved before
bool step_can_undo(const State& st, const UndoPoint& u);

// step_reshape : reshapes domains of *MATERIAL POINTS, RESHAPE at t(n), just converged               (3.20)
Failure step_reshape(Problem& p, const Step& s, double t_step);

// step_warn_lost : warns once of a line of TRACK that ends in an element before others that cannot break, or
// are stronger, or has no room to turn; -1: none. Collective
void step_warn_lost(Problem& p, int elem);

// step_fracture : fracture, conversion and release at t(n), just converged; statics: equilibrium at the same
// load, until nothing breaks any more. Not ok: the state is that of a failed attempt.
// INTERRUPTED: a signal came between two equilibria.
//   inout before  the state before the increment; it receives the elements that the model receives
//   watch         CRITERION_EXCEEDED: the increment exceeds the load of the first fracture; nothing has
//                 broken yet
//   inout energy  as of step_increment; of the last equilibrium
Failure step_fracture(Problem& p, const Step& s, double t_step, UndoPoint& before, BreakWatch& watch,
                      RealVec& energy, Output& out);

// step_signalled : was a signal received on any rank? Collective.
bool step_signalled();

// step_warn_compressed : warns of elements and points compressed below the stretch at which
// St.Venant-Kirchhoff softens: number and worst one, repeated when the number doubles
void step_warn_compressed(const Model& m, const Elements& el, const PointLaws& laws, const State& st,
                          const Step& s, Warned& warned);

// step_warn_loose : statics: warns of the share of loads carried by the STIFFNESS of broken material alone
void step_warn_loose(const Model& m, const Discretisation& d, const Dofs& dofs, const State& st,
                     const Step& s, Warned& warned);

// step_warn_bridged : warns where the residual stiffness of open cracks stores a part of their toughness
void step_warn_bridged(const Model& m, const Discretisation& d, const State& st, const Step& s,
                       Warned& warned);

// step_divides_again : does the work of a divided model with fracture or conversion need repartitioning?
// Called once an increment, before it begins; updates State::work, and first assigns new points to ranks.
// Collective.
bool step_divides_again(Problem& p, const Step& s);

// step_contact_faces_known : has this rank all faces that its points of general contact may meet until the
// lists of near faces are rebuilt? Call after step_prepare. Collective.
bool step_contact_faces_known(Problem& p);

// step_scene_faces_known : the same for the lists of a scene. Collective.
bool step_scene_faces_known(Problem& p, const ContactScene& scene);

// step_divide_by : data of the repartitioning p.again. Collective.
DivideBy step_divide_by(const Problem& p);

// step_free_memory : frees the data that step_prepare and Newton's method rebuild; the grid cells stay
void step_free_memory(Problem& p);

// How a run starts: at t = 0; from a restart file f; after a repartitioning, from the file of out_hold; or,
// if it was not possible, without a file
enum RunFrom { RUN_BEGIN, RUN_FILE, RUN_DIVIDED, RUN_ON };

// step_run : the remaining steps of the model; returns an exit code, or none when the model must be
// repartitioned first (p.again)
int step_run(Problem& p, RunFrom from, Archive& f, Output& out);

// step_explain : text of the failure: cause, location, remedy
std::string step_explain(const Problem& p, const Failure& failure);

#endif
