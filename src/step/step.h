// ---------------------------------------------------------------------------
// step.h : Newton, static and dynamic increments, cuts, commit, ledger (doc/theory.md 6)
// ---------------------------------------------------------------------------
#ifndef MPFE_STEP_STEP_H
#define MPFE_STEP_STEP_H

#include <array>
#include <functional>

#include "assem/assem.h"
#include "out/out.h"

// The tangent in DofPattern::A and what it was made for
struct ReusedTangent {
  bool on = false;             // nothing else can change it: no NLGEOM, contact or fracture
  long pattern = 0;
  double cM = 0.0, cC = 0.0;
  KernelMode mode;
  IntVec fixed;
  RealVec diag, whole;         // [neq] diagonal before prescribed dofs went, before equations were put in
  // iterations that found their tangent there; that took the one before, which is near
  long same = 0, near = 0;
};

// Is the tangent of statics known to be regular, from the supports alone? As it was when pattern and supports
// were these
struct KnownRegular {
  bool good = false;
  long pattern = -1;
  IntVec fixed;
};

// Projected velocity at the end of the last increment, of the rows of the grid and, where points follow
// nodes, of those of nodes: where the projection of the next one begins, or what it gives  (3.14), (3.19)
struct GridVelocity {
  long pattern = -1, made = -1;  // DofPattern::number, ActiveGrid::made
  int increment = 0;           // StepLog::inc_total at that end
  int first = 0;               // the first of these rows
  std::vector<long> key;       // row_key of the rows of the grid, descending
  RealVec v;                   // [rows*dim]
  RealVec a;                   // [rows*dim] explicit step: acceleration; else empty
  IntVec fixed;                // [rows*dim] DofKind
};

// What Newton's method keeps from one increment to the next; results do not depend on it, but for rounding
struct NewtonMemory {
  Solver solver;
  RealVec gain;                // [iteration] residual after and before each iteration of the last increment
  ReusedTangent tangent;
  KnownRegular regular;
  GridVelocity grid;
};

// What a divided model is asked before it is divided again
struct NextDivision {
  bool stays = false;          // it cannot be divided again
  long lists = 0;              // ContactScene::built when it was asked last who is near
  std::vector<NearFace> faces; // of this rank, where others come near that are not known
};

// When an explicit step has searched for contact, and how things lay then; size: of the smallest face
struct ContactFound {
  int step = -1, bonds = 0, changes = 0;
  RealVec u, uc;               // [nnode*dim], [ncorner*dim]
  double size = 0.0, time = 0.0;
};

// What an explicit step keeps; a run that goes on from a restart file has none of it, and so has the one that
// wrote it (forget_grid)
struct StableIncrement {
  ContactFound found;
  double crossing = 0.0;       // time in which a wave crosses the smallest element at rest; 0: not known
  // [nnode + ncorner] work space: stiffness of contact over mass, of nodes and corners       1/time^2; mass
  RealVec push, mass;
  // forces of contact at t(n) before it was searched for anew, in parts [(nnode + ncorner)*dim]; empty: kept
  RealVec before;
  bool apart = false;          // the model was divided again: accelerations of t(n) are those without contact
  // loads at the end of the increment before, for these rows; step, increment: when
  RealVec fext;
  long pattern = -1, made = -1;          // DofPattern::number, ActiveGrid::made
  int step = 0, inc = 0;
  RealVec spare, fint, du, R;  // their memory alone
  // Discretisation::follow is that of so many converted elements and released points
  std::array<size_t, 2> followed{{0, 0}};
};

// work has become uneven; faces of general contact have come near that are not known
enum Again { AGAIN_NOT, AGAIN_WORK, AGAIN_NEAR };

// Everything a run holds
struct Problem {
  Problem(Model& model, State& state) : m(model), piece(model), st(state) {}
  const Model& m;
  Model& piece;                // the same: of a divided model, which gets elements of others (step_fracture)
  State& st;
  Discretisation d;
  Dofs dofs;
  bool ready = false;          // grid, rows, pattern and mass are those of t(n)
  NewtonMemory newton;
  Warned warned;
  size_t warned_all = 0;       // several ranks: how many of these all know
  NextDivision next;
  StableIncrement stable;      // explicit steps
  Again again = AGAIN_NOT;     // why step_run has stopped for another division
};

// What Newton's method is told of the material, by step_increment
struct NewtonControls {
  bool linear   = false;       // the tangent does not depend on du: it may be reused
  bool breaks   = false;       // material may break: it then kinks the residual, and has next to no stiffness
  bool rubs     = false;       // material with friction: the matrix is but the symmetric part of the tangent
  bool slips    = false;       // statics with friction in contact: the tangent may be unsymmetric   (6.23)
  bool opens    = false;       // statics: cracks open against a cohesion: the tangent may be indefinite
  bool singular = false;       // statics with broken material: the tangent is nearly singular
  int max_iter  = 0;
  int patience  = 0;           // iterations without a smaller residual before corrections are searched  (6.6)
};

// *STATIC, RIKS: what opens by how much in an increment, and the loads that follow        (6.39)
struct ArcElement {
  int e = -1;
  std::array<double, 3> N{{0, 0, 0}};        // the axis along which it opens
  double width = 0.0;                        // along it
  bool cracked = false;
  double most  = 0.0;                        // by which it may extend in an increment of dt of the deck
};
struct Arc {
  bool on = false;
  std::vector<ArcElement> element;           // of this rank, whose extensions are prescribed
  bool any = false;                          // on any rank; else the loads grow by dt
  bool cracked = false;                      // one of them has a crack
  double from = 0.0, at = 0.0;               // time of the step whose loads act: at t(n), now
  double length = 0.0;                       // sum of the extensions over the increment
  bool last     = false;                     // length is that of the set, to its displacement at the end
  RealVec load, support;                     // [neq] external force, displacement over time of the loads
};

// What earlier iterations tell of a tangent that the symmetric matrix does not hold      (6.22)
struct Secants {
  std::vector<RealVec> du, dx;         // differences between iterations
  RealVec last_du, last_dx;            // [neq] the last iterate, and what the matrix made of it
};

// step_product : product of two corrections in the norm of the positive part of diag              [neq]
// Several ranks: diag is zero in rows of others (dof_own).
double step_product(const RealVec& a, const RealVec& b, const RealVec& diag);

// step_secant : the correction dx of the matrix at du becomes that of Anderson's method
void step_secant(Secants& h, const RealVec& du, const RealVec& diag, RealVec& dx);

// step_slip : (A + E) x = f, where E is what slipping contact adds that is not symmetric              (6.23)
//   in   eta    what may be left of f;   out  left  what is left, a part of f
struct SlipSystem {
  RealVec weight;              // [neq] of forces in their norm; several ranks: zero in rows of others
  std::function<void(const RealVec& x, RealVec& y)> multiply;              // y = (A + E) x
  std::function<Status(const RealVec& v, RealVec& z)> precondition;        // z, nearly A^-1 v
};
Status step_slip(const SlipSystem& system, const RealVec& f, double eta, RealVec& x, double& left);

// What one attempt of an increment needs to know                                   (6.1)
//   residual  R = fint + cM M du + cC C du - g - fext
struct Attempt {
  const Step& step;
  KernelMode mode;
  double t0, t1, dt;           // times of the step
  double total0, total1;       // times of the run
  LoadTime load;               // t1, or the middle
  NewtonControls newton;
  double cM = 0.0, cC = 0.0;
  RealVec g{};                   // [neq] inertia and damping that do not depend on du
  RealVec momentum{};            // [neq] M v of nodes, sum m S v of points
  // [neq] velocity at t(n) of nodes, and of the grid by projection; of nodes too where points follow them
  RealVec vgrid{};
  RealVec agrid{};             // [neq] acceleration of the grid at t(n), rows of the grid (Newmark)
  RealVec fint0{}, fext0{};        // [neq] at t(n) on the weights of this step (statics, Newmark)
  RealVec fint{}, fext{}, R{};       // [neq] at the solution; R with the forces of equations at their masters
  RealVec du{};                  // [neq]
  RealVec acc{};               // explicit: acceleration at t(n+1) [neq]
  double work = 0.0;             // with plain: of loads and supports over the increment
  RealVec* energy = nullptr;     // explicit: [nelem] of intact elements at t(n+1), where a test needs them
  bool plain = false;            // explicit, nodes alone, no dampers: st.np1 has velocities and accelerations
  BulkStep bulk{};               // explicit: bulk viscosity
  Jumps jumps{};               // of du
  RealVec guess{};               // [neq] statics: where Newton's method begins, when it does not at rest
  bool guesses = false;          // it does so; a rank may have no rows
  Arc arc{};
};

// step_open : state at t = 0: points, bonds, elements, initial velocities. Returns the number of errors.
int step_open(Problem& p);

// step_supports : in motion dofs that step k, which begins at time, prescribes, and the step before did not,
// have the velocity of their support at once: a jump in the first increment would make or lose the energy of
// their mass. True: v was another. Collective.
// Tests: A6 (stress/velocity_on_support.inp, stress/support_begins.inp)
bool step_supports(const Model& m, int k, double time, RealVec& v);

// step_prepare : active grid, rows, pattern, mass of the coming step (once for all attempts)
Failure step_prepare(Problem& p, const Step& s);

// ---- the clock of a step (step_clock.cpp): nominal increments, cuts, and times that must be hit
// clock_stops : times of the step of field checks and of conversions: automatic increments end on them
std::vector<double> clock_stops(const Model& m, const Step& s, double start);

// clock_next : length of the next attempt
double clock_next(const Step& s, const StepClock& c, const std::vector<double>& stops);

// clock_accept : an increment of this length was good; automatic increments choose the next length by its
// iterations, and by half, the half-increment residual over its limit (0: not asked for)
void clock_accept(const Step& s, double used, int iterations, double half, StepClock& c);

// The half-increment residual in the attempts of one increment                              (6.24), (6.25)
struct HalfWatch {
  bool on = false;             // it is asked for
  double residual = 0.0, limit = 0.0;        // of this attempt: largest entry, and what it may be     force
  double force = 0.0;          // of inertia at its ends: largest entry
  double before = 0.0, dt_before = 0.0;      // residual and length of the attempt before; 0: the first
  int kept = 0;                // cuts in a row that hardly changed the residual
  double shorter = 0.0;        // length of the next attempt
  bool jumps = false;          // accepted above the limit: the force jumps
  bool least = false;          // accepted above the limit: it may not be cut any more
};

// step_half : residual, force and limit of the converged attempt a; st.np1 is as it was afterwards
Failure step_half(Problem& p, const Attempt& a, HalfWatch& w);

// half_judge : HALF_RESIDUAL when a shorter attempt is asked for; cuts: of this increment so far
Failure half_judge(const Step& s, double dt, int cuts, HalfWatch& w);

// step_increment : one attempt from t(n) over dt; st.np1 holds the result. Never touches st.n.
//   out  energy   with fracture: strain energy of intact elements at t(n+1), of this rank  [nelem]
//   inout half    not null and on: HALF_RESIDUAL ends attempts that are too long
Failure step_increment(Problem& p, const Step& s, double t0, double dt, RealVec& energy,
                       HalfWatch* half = nullptr);

// The linear system of a Newton iteration                                          (6.2)
struct LinearSystem {
  RealVec f, dx;               // [neq] right-hand side, correction
  RealVec diag;                // [neq] diagonal of A before prescribed dofs went
  RealVec whole;               // [neq] diagonal before equations were put in; without equations: empty
  double residual = 0.0, energy = 0.0;   // the largest norm of R and sqrt(f dx) so far, the scale of accuracy
  double own_energy = 0.0;     // f dx of this rank
  RealVec g, along;            // [neq] RIKS: right-hand side of a unit of time of the loads, its correction
};

// step_tangent : A = K + cM M of iteration it and f = -R with the prescribed corrections put in; A stays when
// the scene is linear, or when the tangent of the iteration before is near enough for the last one (8.11)
//   in   residual, accepted   norm of R, and that which ends the iteration
void step_tangent(Problem& p, const Attempt& a, int it, double residual, double accepted, const RealVec& R,
                  const RealVec& pending, LinearSystem& l);

// step_solve : dx of iteration it, as exactly as Newton's method can use it (8.6)
//   in   residual, accepted   norm of R, and that which ends the iteration
Failure step_solve(Problem& p, const Attempt& a, int it, double residual, double accepted,
                   const RealVec& pending, LinearSystem& l);

// step_solve_arc : l.along, with the factors of step_solve
Failure step_solve_arc(Problem& p, const Attempt& a, int it, double residual, double accepted,
                       LinearSystem& l);

// step_supports_fix : do the supports fix every part of bodies of solid elements in space? false: not known.
// Parts are elements that share faces; their supports must take all six rigid motions. Then a matrix of
// statics is known to be regular without being factorised.
bool step_supports_fix(const Model& m, const Elements& el, const Dofs& dofs);

// step_free_motion : the rigid motions that the supports leave to the part of elements of this node, in
// words; empty: none
std::string step_free_motion(const Model& m, const Elements& el, const Dofs& dofs, int node);

// step_memory : bytes of what lives through the run
void step_memory(const Problem& p, std::vector<MemoryUse>& out);

// step_solved_well : was the correction exact enough for the last one?
bool step_solved_well(const Solver& solver, const LinearSystem& l);

// step_gain : iteration it has changed the norm of R by this factor
void step_gain(NewtonMemory& memory, int it, double gain);

// step_flow_lopsided : does a material flow with friction that is not its dilation? Its tangent is lopsided
bool step_flow_lopsided(const Model& m);

// step_mode : what the kernel is told of the scheme: S of energy-momentum, or everything at t(n+1)
KernelMode step_mode(const Step& s);

// step_contact_depth : CONTACT_DEPTH when a point has entered its face by more than a quarter of the size in
// one increment, and may have missed another; or by nearly half, where the search would lose it: the penalty
// is far too soft then.   l: level n+1
Failure step_contact_depth(const Bonds& b, const ContactPairs& pairs, const Level& l, int dim);

// step_newton : solves R(du) = 0 for the attempt. Not good with a guess: it may be without.
Failure step_newton(Problem& p, Attempt& a);

// step_arc_begin : *STATIC, RIKS: what is prescribed in this increment, and how the loads grow
// step_arc_force : g [neq], what A x of a unit of time of the loads is, A before prescribed dofs went
// step_arc_advance : time of the loads over the correction dx; along: the correction that a unit of it makes
// step_arc_load : loads and supports go on by so much
// step_arc_end : of the increment, in the clock: is the step at its end?
Failure step_arc_begin(Problem& p, Attempt& a);
void step_arc_force(const Dofs& s, const Arc& arc, RealVec& g);
double step_arc_advance(const Problem& p, Attempt& a, int it, const RealVec& dx, const RealVec& along);
void step_arc_load(Problem& p, Attempt& a, double advance);
void step_arc_end(Problem& p, const Attempt& a);

// step_explicit : the attempt by central differences: du, forces and acceleration at t(n+1) (6.28), (6.29)
Failure step_explicit(Problem& p, Attempt& a);

// step_stable : explicit: st.clock.dt becomes the length that is stable at t(n), or that of the deck when it
// is shorter. Collective.                                                     doc/theory.md (6.30) - (6.32)
Failure step_stable(Problem& p, const Step& s);

// step_keep_momentum : what conjugate gradients have left of M a = f goes to a by the lumped mass, so that
// the momentum changes by f to rounding
void step_keep_momentum(const Dofs& s, const RealVec& f, RealVec& acc);

// step_accelerations : explicit: of free dofs from their forces f, with dampers over half (dt/2); those of
// fixed ones stand in acc
Failure step_accelerations(const Problem& p, const RealVec& f, double half, RealVec& acc);

// step_turn_begin : explicit: notes the forces of contact at t(n) before it is searched for anew
// step_turn : the accelerations of t(n) become those of what contact meets now: the force at both ends of an
// increment has one direction then, and does the work that contact stores. Collective.            (6.37)
// step_turn_apart : explicit: takes the forces of contact out of the accelerations of t(n) before the model is
// divided again, since the ranks then no longer know what contact met: StableIncrement::apart. Collective.
// step_contact_stays : explicit: may contact keep what it meets? Collective.
void step_turn_begin(Problem& p, const Step& s);
void step_turn_apart(Problem& p, const Step& s);
bool step_contact_stays(const Problem& p, const Step& s);
Failure step_turn(Problem& p);

// step_corners_shared : do several ranks have corners of the same points?
inline bool step_corners_shared(const Points& pts)
{
  return (pts.part.on || pts.part.window) && pts.npoint_all() > 0 && pts.part.halo.on();
}

// step_hold_bulk : explicit: the pressures of the bulk viscosity at t(n) act on in mode
void step_hold_bulk(Problem& p, const Step& s, BulkStep& bulk, KernelMode& mode);

// step_motion_begin : explicit: velocity and acceleration at t(n) of nodes and grid
Failure step_motion_begin(Problem& p, Attempt& a);

// step_damping : damping force at t(n) of velocities v [neq]: C v, and that of the viscous stress. Writes
// st.np1. step_damps: is there any?   t_step: time of the step
Failure step_damping(Problem& p, bool finite, double t_step, double dt, const RealVec& v, RealVec& f);
bool step_damps(const Problem& p);

// step_inertia_begin : momentum, projected velocity, g, cM of a dynamic step
Failure step_inertia_begin(Problem& p, Attempt& a);

// step_finish : velocities, reactions, energies at t(n+1) into st.np1 and st.ledger; energy as
// step_increment
void step_finish(Problem& p, Attempt& a, RealVec& energy);

// step_residual_at_start : statics: fint - fext at t(n) on the weights of this step, [neq]
RealVec step_residual_at_start(const Dofs& dofs, const Attempt& a);

// step_settle : statics: energy lost on the way to equilibrium from forces that nothing holds any more, into
// st.ledger by its cause                                                            (6.15)
//   in   rf0  [nnode*dim] reactions at t(n);  R0  [neq] residual at t(n)
void step_settle(Problem& p, const Attempt& a, const RealVec& rf0, const RealVec& R0);

// step_initial_acceleration : a = M^-1 (fext - fint) of the nodes, at the start of a Newmark step and after
// elements broke
Failure step_initial_acceleration(Problem& p, const Step& s, double t_step);

// step_warn_missed : at the start of a step: warns of loads and supports that fixed increments step over
//   in   mid   loads are asked for in the middle of an increment
void step_warn_missed(const Model& m, const Step& s, double start, bool mid);

// ledger_sums : energies and momenta of the level; energy: strain energy of intact elements [nelem]; work: of
// this rank, becomes that of all
// ledger_lost : all that has been dissipated or lost, of known cause
// ledger_balance : energy of bonds, and what is missing;   ledger_update : both
// ledger_open : at the start of the run, with what is rounding;   ledger_begin_step : of a step
void ledger_sums(const Model& m, const Elements& el, const Dofs& dofs, const Level& l, bool nlgeom,
                 State& st, double& work, RealVec* energy);
double ledger_lost(const Ledger& g);
void ledger_balance(int dim, const Level& l, State& st);
void ledger_open(const Model& m, const Elements& el, const Dofs& dofs, State& st);
void ledger_begin_step(Ledger& g);

// ledger_leap : the kinetic energy becomes that of explicit increments of length dt, or that of t(n) (0); the
// energy at the start of the run becomes another by the same. Collective.                       (6.33)
void ledger_leap(const Dofs& dofs, double dt, State& st);
void ledger_update(const Model& m, const Elements& el, const Dofs& dofs, const Level& l, bool nlgeom,
                   State& st, RealVec* energy = nullptr);

// What an automatic increment of statics asks of the first break in it                             (7.25)
struct BreakWatch {
  bool on = false;             // the increment may be cut
  double value0 = 0.0;         // of first at the start of the increment
  FirstBreak first;            // what breaks at its end
};

// step_undo_point, step_undo : the state with its elements, points and bonds before an increment, and back to
// it. Level n is copied (statics, where the grid and contact are found anew), or stays where it is until
// step_undo_keep, before another one takes its place (motion); points stay where they are until
// step_undo_points, before they change
struct UndoPoint {
  State state;                 // without levels
  bool whole = true;           // state is there; explicit steps copy it before it changes
  bool points = false;         // with points, and share is that of them
  Level n;                     // a copy, or the one that was kept
  bool copy = false, kept = false;
  CornerShare share;
};
void step_undo_point(State& st, bool copy, UndoPoint& u);
// explicit: the state is copied by step_undo_state, before it changes
void step_undo_later(UndoPoint& u);
void step_undo_state(State& st, UndoPoint& u);
void step_undo_points(const State& st, const CornerShare& share, UndoPoint& u);
void step_undo_keep(State& st, UndoPoint& u);
void step_undo(Problem& p, UndoPoint& u);

// step_tests : do tests of fracture look at time? Explicit: conversion and release of points wait for them
bool step_tests(const Problem& p, const Step& s, double time);

// step_can_undo : is there a way back? Not from points that have changed where they were not copied before
bool step_can_undo(const State& st, const UndoPoint& u);

// step_fracture : at t(n), just converged: what breaks, breaks and becomes points; in statics equilibrium
// follows at the same load, until nothing breaks any more. Not good: the state is that of a failed attempt.
// INTERRUPTED: a signal came between two equilibria.
//   inout before  the state at the start of the increment; it gets the elements that the model gets
//   watch         CRITERION_EXCEEDED: the increment steps over the load of the first break; nothing has
//                 broken yet
//   inout energy  of step_increment; that of the last equilibrium
Failure step_fracture(Problem& p, const Step& s, double t_step, UndoPoint& before, BreakWatch& watch,
                      RealVec& energy, Output& out);

// step_signalled : has a signal come, on any rank? Collective.
bool step_signalled();

// step_warn_compressed : warns when elements or points are compressed below the stretch at which
// St.Venant-Kirchhoff softens: how many, the worst one, and again whenever twice as many are
void step_warn_compressed(const Model& m, const Elements& el, const PointLaws& laws, const State& st,
                          const Step& s, Warned& warned);

// step_warn_loose : statics: warns when loads rest on broken material alone: the share that its STIFFNESS
// carries
void step_warn_loose(const Model& m, const Discretisation& d, const Dofs& dofs, const State& st,
                     const Step& s, Warned& warned);

// step_divides_again : divided model whose elements break or become points where they are: has its work
// become so uneven that it is to be divided again? Asked once an increment, before it begins; writes
// State::work, and shares out new points first. Collective.
bool step_divides_again(Problem& p, const Step& s);

// step_knows_near : are all faces here that places of general contact of this rank may meet, until lists of
// near faces are made anew? Behind step_prepare. Collective.
bool step_knows_near(Problem& p);

// step_knows_faces : the same for the lists of scene. Collective.
bool step_knows_faces(Problem& p, const ContactScene& scene);

// step_divide_by : what the division after p.again goes by. Collective.
DivideBy step_divide_by(const Problem& p);

// step_forget : what step_prepare and Newton's method make again is given back; cells of the grid stay
void step_forget(Problem& p);

// How a run begins: at t = 0; with a restart file f; after another division, with the file of out_hold, or
// without one, where that was not possible
enum RunFrom { RUN_BEGIN, RUN_FILE, RUN_DIVIDED, RUN_ON };

// step_run : all steps of the model, or those that are left; returns an exit code, or, when the model is to
// be divided again before it goes on (p.again), none
int step_run(Problem& p, RunFrom from, Archive& f, Output& out);

// step_explain : what failed, where, and what to try
std::string step_explain(const Problem& p, const Failure& failure);

#endif
