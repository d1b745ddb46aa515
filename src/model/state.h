// ---------------------------------------------------------------------------
// state.h : what changes during the run; step/ says when. A new field goes into state_io.h as well.
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_STATE_H
#define MPFE_MODEL_STATE_H

#include "model/domain_kinds.h"
#include "model/model.h"

// Points::field of the corners of released points
enum { FIELD_OWN = -1 };

// What carries a corner: the grid; the node of the mesh where it lies; the corners at the nodes between which
// it lies; unknowns of its own (doc/theory.md 7.14)
enum HangOn { HANG_GRID, HANG_NODE, HANG_CORNERS, HANG_OWN };

// Several ranks, divided model: none has all points.
// on (MeshPart::points): each has points of its own. Those of others are here, to be looked at, where contact
// may meet a face of theirs, or side A of bonds and contact has one with a corner of its own points; others
// that share a corner with what is here are known by their corners.
// window (MeshPart::window): of points that were elements each has those of the elements that it has, its own
// and outer ones, and works on those of its own. Points from the start, if any, are divided as with on.
struct PointPart {
  bool on = false, window = false;
  int npoint = 0, ncorner = 0; // of all ranks
  // [npoint], [ncorner] number among those of all ranks, ascending (not corners of a window)
  IntVec point, corner;
  IntVec rank;                 // on: [points from the start] who works on it
  IntVec numbered;             // window: corners in the order of their numbers
  bool lone_corners = false;   // some rank has a corner of points of other ranks alone
  Halo halo;                   // corners that other ranks have too; their owner has a point with it
  std::vector<char> several;   // window: [ncorner] points of several ranks have it
  Halo start;                  // window: that of the corners that are there from the start
  // corners of halo points: index here, or -1 - index into outer_corner
  ListTable outer_conn;
  IntVec outer_shape;          // [outer_conn] their Shape
  IntVec outer_corner;         // their numbers among the corners of all ranks
};

// Material points: domains of a corner mesh with shared corners (doc/theory.md 3)
struct Points {
  int npoint = 0, ncorner = 0;
  RealVec Xc;                  // [ncorner*dim]  corners at t = 0                     length
  IntVec shape;                // [npoint] Shape of the domain
  ListTable conn;              // [npoint] corners of a domain
  IntVec kind;                 // [npoint] index into kinds
  DomainKinds kinds;           // weights, gradients, consistent masses
  // [npoint] 1: G and V0 belong to a Gauss place of the element that it was, 0: means over the domain
  IntVec sampled;
  RealVec V0;                  // [npoint] volume (area x thickness) at t = 0         length^3
  RealVec mass;                // [npoint]
  IntVec body;                 // [npoint] index into Model::body
  IntVec label;                // [npoint] the user's: 1, 2, ...
  IntVec of_elem;              // [nelem] first point of an element that became points, -1; empty: none did
  IntVec parent;               // [npoint] element that it was, -1: a point from the start
  // [npoint] next one of the points of its initial cell, or of the element that it was; the last leads to the
  // first
  IntVec next;
  IntVec broken;               // [npoint] index into Model::fracture when broken, -1: intact
  RealVec normal;              // [npoint*3] normal of the crack, frozen when it broke
  IntVec released;              // [npoint] 1: released from its neighbours, its corners are its own
  IntVec field;                // [ncorner] grid field of a corner, or FIELD_OWN: it has unknowns of its own
  // [ncorner] the first corner of the same name: itself, or that of an element that became points before
  IntVec first_copy;
  // [ncorner] of corners made by conversion: at a node that node, between nodes -1 - corner of each of them
  ListTable hang;
  RealVec hang_w;              // [hang.item] weights, sum 1
  IntVec hangs;                // [ncorner] HangOn; empty: all on the grid
  // [ncorner], or as many as there were then: corners of elements with a released point, and those of their
  // names: points that there were then, of all ranks; later conversions share them no more. 0: others
  IntVec unshared_since;
  bool shareable(int c, int before) const
  {
    return c >= static_cast<int>(unshared_since.size()) || unshared_since[c] == 0 ||
           unshared_since[c] > before;
  }
  // HangOn of a corner: what carries it                                                 (7.14)
  int carrier(int c) const
  {
    if (field[c] == FIELD_OWN) return HANG_OWN;
    return c < static_cast<int>(hangs.size()) ? hangs[c] : HANG_GRID;
  }
  bool converted(int e) const { return !of_elem.empty() && of_elem[e] >= 0; }
  // carries what broken material still does; a released point is a whole piece of material again
  bool eroded(int p) const { return broken[p] >= 0 && !released[p]; }
  // of a domain: weights w_c [n], gradients G_c [n*dim] (1/length), masses, pairs a >= b
  const double* w(int p) const { return kinds.at(kind[p]); }
  const double* G(int p) const { return w(p) + conn.count(p); }
  const double* mc(int p) const { return G(p) + conn.count(p) * kinds.dim; }
  std::vector<Face> boundary;  // faces with one owner; elem: point, face: local face
  // [Model::surface] faces of points: of surfaces on bodies, and of surfaces on
  std::vector<std::vector<Face>> surface;
                               // elements those that elements which became points have left
  PointPart part;              // made by point_fill and point_number, not saved
  int npoint_all() const { return part.on || part.window ? part.npoint : npoint; }       // of all ranks
  // number of a point among those of all ranks
  int point_number(int p) const { return part.point.empty() ? p : part.point[p]; }
  // number of a corner among those of all ranks, and the way back (-1: it is not here)
  int corner_number(int c) const { return part.corner.empty() ? c : part.corner[c]; }
  int corner_here(int number) const;
  int point_here(int number) const;      // PointPart::on; -1: it is not here
};

// What is on side B of a bond; SIDE_CONTACT: what is met, found in each step
enum BondSide { SIDE_GRID, SIDE_GROUND, SIDE_CONTACT };

// An outer face that takes part in general contact: of a finite element, or of a point
struct SkinFace {
  int elem = -1, face = -1;
  int points = 0;              // 0: of an element, 1: of a point, 2: of a released one
  bool operator==(const SkinFace& b) const { return elem == b.elem && face == b.face && points == b.points; }
  // the element that has it, or had it before it became points; -1: of a point from the start
  int element(const Points& pts) const { return points ? pts.parent[elem] : elem; }
};

// What contact points, the bonds of SIDE_CONTACT, keep besides: arrays of all bonds
struct ContactState {
  RealVec offset;              // [nbond] gap at the start that counts as zero (OVERLAP=ADJUST)   length
  // [nbond] part of the measured gap that is no compression (theory 4.16)   length
  RealVec initial_penetration;
  // [nbond] depth from which the pressure grows faster than the penalty; 0: it stays linear   length
  RealVec deep;
  RealVec friction;            // [nbond] Coulomb
  std::vector<SkinFace> skin;  // general contact: all faces; those of elements first
  RealVec skin_penalty;        // [skin] penalty per area of the face alone          force/length^3
  IntVec skin_of;              // [nbond] general contact: index into skin, -1: none
  // [nbond] general contact: what it pushes on: a face, index into skin, or a *GRID BOUNDARY; -1: none
  IntVec met, wall;
};

// Bonds tie side A (nodes or corners) to the grid or to the ground; contact points keep it off what they meet
// (doc/theory.md 4)
struct Bonds {
  int nbond = 0;
  int nfixed = 0;              // bonds of the deck; those that follow come from conversion
  ListTable a;                 // side A: finite-element node n, or corner c as nnode + c
  RealVec a_w;                 // [a.item] weights, sum 1
  IntVec def;                  // [nbond] index into Model::bond
  IntVec side;                 // [nbond] BondSide
  IntVec field;                // [nbond] SIDE_GRID: the grid field; -1: others
  RealVec area;                // [nbond] tributary area (length x thickness in 2D)
  RealVec X;                   // [nbond*3] place at t = 0
  RealVec normal;              // [nbond*dim] unit normal, from side A outwards
  RealVec cn, ct;              // [nbond] penalty normal and tangential x area        force/length
  IntVec intermediate;         // [nbond] 0: at a node, 1: between nodes
  ContactState contact;
  // divided model, made by bond_share, not saved: [nbond] who works on a bond; names, the same on all ranks
  // that may, ascending as one rank has the bonds; who has them; bonds of all ranks
  IntVec rank;
  std::vector<long> name;
  Halo halo;
  int nall = 0;
  // contact: what goes beyond deep; its cube times growth is the force added (4.21)   length, force/length^3
  double beyond(int b, double gap) const
  {
    const double more = gap + contact.deep[b];
    return more < 0.0 ? more : 0.0;
  }
  double growth(int b) const
  {
    const double deep = contact.deep[b];
    return deep > 0.0 ? 4.0 * cn[b] / (deep * deep) : 0.0;
  }
  bool counts(int b) const { return !halo.on() || rank[b] == comm_rank(); }    // b counts here in a sum
  int nbond_all() const { return halo.on() ? nall : nbond; }                   // of all ranks
};

// What became of the finite elements
enum ElemPhase { AS_ELEMENT, AS_POINTS, AS_NOTHING };

struct Fracture {              // empty arrays: nothing can break or change its form
  IntVec phase;                // [nelem] ElemPhase
  IntVec broken;               // [nelem] index into Model::fracture when broken, -1: intact
  RealVec normal;              // [nelem*3] normal of the crack, frozen when it broke
  RealVec time;                // [nelem] when it broke, -1: intact
  IntVec releasing;            // broken elements whose psi+ has not yet fallen to c, in the order of breaking
  IntVec converted;            // elements that became points, in that order
  // released points, in that order; points that there were then, of all ranks; corners that they had before
  IntVec released, released_at;
  ListTable left;
  int renewed = 0;             // released points whose shape was made anew, so far
  double next_test = 0.0;      // total time of the next test
  // [nelem] dynamics: psi+ / volume, and its average over time (7.26); 0: not followed; empty: none yet
  RealVec drive, mean;
  double drive_time = 0.0;     // total time of both
  int neroded = 0;             // broken by the criterion so far
  // those in releasing, converted and released, of all ranks
  int nreleasing = 0, nconverted = 0, nreleased = 0;
  double area = 0.0;           // crack area: sum of V/h over them                  length x thickness
  bool empty() const { return phase.empty(); }
};

struct Level {                 // one time level
  double time = 0.0;           // total time
  RealVec u, v, a;             // [nnode*dim] finite-element nodes
  RealVec uc;                  // [ncorner*dim] displacement of corners since t = 0   length
  RealVec vc;                  // [ncorner*dim] velocity of corners
  RealVec slip;                // [nbond*dim] side A minus side B; contact: the gap  length
  RealVec lambda;              // [nbond*dim] multiplier of the augmented Lagrange; contact: friction   force
  RealVec lambda_n;            // [nbond] contact: normal multiplier, not positive            force
  // history of the law at the Gauss points of all elements, and of points; empty: no law keeps any
  RealVec he, hp;
  // [nelem] degradation factor of psi+: 1 intact, c when its release is over; empty: nothing can break
  RealVec degr;
  RealVec q;                   // [nelem] pressure of the bulk viscosity (6.35); empty: there is none
};

// degr_of_step : degradation factor of element e that acts over a step from l0 to l1: the mean for the
// energy-momentum scheme, else that of l1
inline double degr_of_step(const Level& l0, const Level& l1, bool mid, int e)
{
  return mid ? 0.5 * (l0.degr[e] + l1.degr[e]) : l1.degr[e];
}

struct Ledger {                // energies and momenta at t(n), [3] in space
  // external: work of loads and moved supports so far
  double kinetic = 0, strain = 0, bond = 0, external = 0;
  double friction = 0;         // dissipated by friction so far
  double plastic = 0;          // dissipated by plastic flow so far
  // released by erosion, in statics also by the equilibrium that follows it, so far
  double fracture = 0;
  double cohesive = 0;         // dissipated by cracks that open against a cohesion so far
  double ghost = 0;            // dissipated by ghost stabilisation so far
  double viscous = 0;          // dissipated by *DAMPING and *VISCOUS BOUNDARY so far
  // statics: lost so far on the way to equilibrium from forces that have lost what held them           (6.15)
  double renewal  = 0;         // of corners on a new grid
  double overlap  = 0;         // of contact that overlaps at the start
  double released = 0;         // of supports that were removed
  double sudden   = 0;         // of loads that act at once
  double stopped  = 0;         // of motion, with its kinetic energy
  double conversion = 0;       // lost when elements became points (averages, bonds), so far
  double total0 = 0;           // kinetic + strain + bond at the start of the run
  // kinetic + strain + bond + all that is lost (ledger_lost) - total0 - external
  double balance = 0;
  double scale = 0;            // largest energy seen so far
  double rounding = 0;         // energies below are rounding of zero
  // of the step under way: balance and external work at its start, largest energy in it
  double balance0 = 0, external0 = 0, step_scale = 0;
  // explicit: length of the increments that the kinetic energy is the product of half steps of, 0: none
  double leap = 0;                                                                             // (6.33)
  int off = 0;                 // steps whose balance was off by more than they allow
  double momentum[3] = {0, 0, 0};
  double angular[3] = {0, 0, 0};
  double slip_max = 0, slip_rms = 0;
};

struct ContactLog {            // one contact pair at t(n+1)
  double force = 0;            // sum of the normal forces
  double gap   = 0;            // deepest penetration (negative), 0: open
  double area  = 0;            // of the closed part
  double peak  = 0;            // largest pressure of a place: normal force / area       force/length^2
  double work  = 0;            // dissipated by friction since the start
};

struct StepClock {             // the step that is under way
  double start = 0;            // total time at its start
  double t = 0;                // done
  double dt = 0;               // of the next attempt
  long nominal = 1;            // DIRECT: end of the increment that is under way, in units of dt
  int easy = 0;                // increments in a row that converged quickly
  // statics: largest dt, that of the first break of the step; 0: nothing has broken in it
  double most = 0;
  // statics: the next increment ends here at the latest, where an element breaks; 0: not known
  double aim = 0;
  // dynamics, automatic increments: sums of F dt and F^2 dt over the force F of inertia, and the largest
  // strain energy, of the step so far                                                        (6.25), (6.26)
  double impulse = 0, square = 0, energy = 0;
  int cuts = 0;                // of all increments so far
  // explicit: largest stable increment of elements, and of the system when the step began, 0: not known; what
  // had broken, become points or been released when it was looked at last                     (6.30) - (6.32)
  double stable = 0, system = 0;
  long broke = 0;
  double xi = 0;               // explicit: largest damping ratio of the bulk viscosity in the last increment
  double held = 0, least = 0;  // explicit: increment of this stage, least stable one in it; 0: none    (6.32)
  // *STATIC, RIKS: time of the step whose loads act, the largest so far; is the step at its end?
  double load = 0, load_most = 0;
  int ended = 0;
};

// clock_over : is the step at its end?
inline bool clock_over(const Step& s, const StepClock& c) { return s.arc.on ? c.ended != 0 : s.over(c.t); }

struct GridLaid {              // where corners and bonds were when the active grid was made
  RealVec uc, xb;              // [ncorner*dim], [nbond*dim]; empty: it must be made anew
  long made = -1;              // ActiveGrid::made; not saved
  // has it been made with so many numbers (a rank may have no corner), or is it to be made anew?
  bool fits(std::size_t nuc, std::size_t nxb) const
  {
    return (uc.empty() && xb.empty()) || (uc.size() == nuc && xb.size() == nxb);
  }
};

struct Division {              // whose work is what; one rank: empty
  int ranks = 1;
  // the model is divided, not the work alone; elem is then that of the pieces while it is saved, else empty
  bool pieces = false;
  IntVec elem, point;          // [nelem], [npoint] rank
  double excess = 0;           // largest work of a rank over the mean, when the division was made
  // MeshPart::window: points and corners of all ranks then; have points been handed from rank to rank?
  int made    = -1;
  bool handed = false;
};

// the work behind a division is that after its first increment
enum { AT_START = -3, DIVIDED = -2, AFTER_DIVISION = -1 };

struct WorkShare {             // how even the work of a divided model is
  int events = AT_START;       // elements that had broken or become points when it was asked last
  double excess = 1.0;         // largest work of a rank over the mean, behind the last division
  double now    = 1.0;         // the same when it was asked last
  double lost   = 0.0;         // increments lost since then to work that has become uneven
};

struct StepLog {               // how the increment went
  int step = 0;                // 1-based
  int inc = 0;                 // increment within the step, 1-based
  int inc_total = 0;
  int iterations = 0, cuts = 0;
  double dt = 0, t_step = 0;
  double residual = 0, scale = 0;   // last residual norm and force scale
  double half = 0, half_limit = 0;  // half-increment residual and what it may be; limit 0: not asked for
  int grid_nodes = 0, grid_cells = 0, weak_nodes = 0, equations = 0;
  long contact_searched = 0, contact_skipped = 0;   // searches of a pair so far; skipped: surfaces apart
};

struct ErosionLog {            // one element that broke
  int elem = -1, label = 0;    // in the mesh of the deck
  double time = 0, value = 0, released = 0;
  double X[3] = {0, 0, 0};     // centre at t = 0
};

struct State {
  Level n, np1;
  Points points;
  Bonds bonds;
  Fracture frac;
  RealVec rf;                  // [nnode*dim] reactions at t(n), 0 at free dofs
  std::vector<ContactLog> contact;   // [Model::bond], of contact pairs
  RealVec grid_rf;             // [Model::grid_bc * dim] sum of the reactions of each grid condition
  // [nnode*dim] displacement over time of the last increment of this static step; first one: empty
  RealVec rate;
  Ledger ledger;
  std::vector<ErosionLog> eroded;    // since the last output
  StepClock clock;
  GridLaid laid;
  Division division;
  WorkShare work;
  StepLog log;
};

#endif
