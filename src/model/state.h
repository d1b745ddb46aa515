// ---------------------------------------------------------------------------
// state.h : data that change during the run, by step/. New fields are added to state_io.h too.
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_STATE_H
#define MPFE_MODEL_STATE_H

#include "model/domain_kinds.h"
#include "model/model.h"

// Points::field of the corners of released points
enum { FIELD_OWN = -1 };

// Support of a corner: the grid; the mesh node at its position; the corners at the nodes of its edge; its own
// unknowns (doc/theory.md 7.14)
enum HangOn { HANG_GRID, HANG_NODE, HANG_CORNERS, HANG_OWN };

// Divided model on several ranks: no rank stores all points.
// on (MeshPart::points): each rank owns points. It also stores, read only, points of other ranks whose faces
// its contact may meet, or that are at side A of bonds and contact and share a corner with its points. Of
// other points that share a corner with these it stores the corners.
// window (MeshPart::window): a rank stores the converted points of its own and halo elements and owns those
// of its own. Points of the deck, if any, are divided as with on.
struct PointPart {
  bool on = false, window = false;
  int npoint = 0, ncorner = 0; // totals over ranks
  // [npoint], [ncorner] global number, ascending (not the corners of a window)
  IntVec point, corner;
  IntVec rank;                 // on: [points of the deck] owner
  IntVec numbered;             // window: corners by ascending number
  bool lone_corners = false;   // a rank stores a corner of points of other ranks only
  Halo halo;                   // corners shared with other ranks; the owner has a point of it
  std::vector<char> several;   // window: [ncorner] owned points of several ranks have it
  Halo start;                  // window: halo of the corners of the deck
  // corners of points of other ranks: index here, or -1 - index in outer_corner
  ListTable outer_conn;
  IntVec outer_shape;          // [outer_conn] their Shape
  IntVec outer_corner;         // global number of a corner
};

// Material points: domains of a corner mesh with shared corners (doc/theory.md 3)
struct Points {
  int npoint = 0, ncorner = 0;
  RealVec Xc;                  // [ncorner*dim]  corners at t = 0                     length
  IntVec shape;                // [npoint] Shape of the domain
  ListTable conn;              // [npoint] corners of a domain
  IntVec kind;                 // [npoint] index into kinds
  DomainKinds kinds;           // weights, gradients, consistent masses
  // [npoint] 1: G and V0 are those of a Gauss point of the parent element, 0: means over the domain
  IntVec sampled;
  RealVec V0;                  // [npoint] volume (area x thickness) at t = 0         length^3
  RealVec mass;                // [npoint]
  IntVec body;                 // [npoint] index into Model::body
  IntVec label;                // [npoint] user label: 1, 2, ...
  IntVec of_elem;              // [nelem] first point of a converted element, -1; empty: none converted
  IntVec parent;               // [npoint] element before conversion, -1: a point of the deck
  // [npoint] next point of the same initial cell or parent element, cyclic
  IntVec next;
  IntVec broken;               // [npoint] index into Model::fracture when broken, -1: intact
  RealVec normal;              // [npoint*3] normal of the crack, frozen when it broke
  IntVec released;              // [npoint] 1: released from its neighbours, with its own corners
  IntVec field;                // [ncorner] grid field, or FIELD_OWN: own unknowns
  // [ncorner] first corner of the same name: itself, or a corner of an element converted earlier
  IntVec first_copy;
  // [ncorner] corners made by conversion: at a node, that node; between nodes, -1 - corner of each of them
  ListTable hang;
  RealVec hang_w;              // [hang.item] weights, sum 1
  IntVec hangs;                // [ncorner] HangOn; empty: all on the grid
  // [ncorner], or shorter: for corners of elements with a released point, and corners of the same names:
  // total number of points at the release; later conversions do not share these corners. 0: others
  IntVec unshared_since;
  bool shareable(int c, int before) const
  {
    return c >= static_cast<int>(unshared_since.size()) || unshared_since[c] == 0 ||
           unshared_since[c] > before;
  }
  // HangOn of a corner                                                                  (7.14)
  int carrier(int c) const
  {
    if (field[c] == FIELD_OWN) return HANG_OWN;
    return c < static_cast<int>(hangs.size()) ? hangs[c] : HANG_GRID;
  }
  bool converted(int e) const { return !of_elem.empty() && of_elem[e] >= 0; }
  // broken and not released; a released point is a piece of intact material
  bool eroded(int p) const { return broken[p] >= 0 && !released[p]; }
  // of a domain: weights w_c [n], gradients G_c [n*dim] (1/length), masses, pairs a >= b
  const double* w(int p) const { return kinds.at(kind[p]); }
  const double* G(int p) const { return w(p) + conn.count(p); }
  const double* mc(int p) const { return G(p) + conn.count(p) * kinds.dim; }
  std::vector<Face> boundary;  // faces of one point only; elem: point, face: local face
  // [Model::surface] faces of points: surfaces on bodies; surfaces on elements: faces of their converted ones
  std::vector<std::vector<Face>> surface;
  PointPart part;              // made by point_fill and point_number, not saved
  int npoint_all() const { return part.on || part.window ? part.npoint : npoint; }       // of all ranks
  // global number of a point
  int point_number(int p) const { return part.point.empty() ? p : part.point[p]; }
  // global number of a corner, and index by number (-1: not on this rank)
  int corner_number(int c) const { return part.corner.empty() ? c : part.corner[c]; }
  int corner_here(int number) const;
  int point_here(int number) const;      // PointPart::on; -1: not on this rank
};

// Side B of a bond; SIDE_CONTACT: a face, found in each step
enum BondSide { SIDE_GRID, SIDE_GROUND, SIDE_CONTACT };

// An outer face that takes part in general contact: of a finite element, or of a point
struct SkinFace {
  int elem = -1, face = -1;
  int points = 0;              // 0: of an element, 1: of a point, 2: of a released point
  bool operator==(const SkinFace& b) const { return elem == b.elem && face == b.face && points == b.points; }
  // element of the face, before its conversion too; -1: of a point of the deck
  int element(const Points& pts) const { return points ? pts.parent[elem] : elem; }
};

// Additional data of contact points, the bonds of SIDE_CONTACT: arrays over all bonds
struct ContactState {
  RealVec offset;              // [nbond] initial gap that counts as zero (OVERLAP=ADJUST)       length
  // [nbond] part of the gap without compression (theory 4.16)               length
  RealVec initial_penetration;
  // [nbond] depth above which the pressure increases faster than linearly; 0: always linear   length
  RealVec deep;
  RealVec friction;            // [nbond] Coulomb
  std::vector<SkinFace> skin;  // general contact: all faces; those of elements first
  RealVec skin_penalty;        // [skin] penalty per area of a face              force/length^3
  IntVec skin_of;              // [nbond] general contact: index into skin, -1: none
  // [nbond] general contact: face in contact, index into skin, or *GRID BOUNDARY in contact; -1: none
  IntVec met, wall;
};

// Bonds tie side A (nodes or corners) to the grid or to the ground; contact points prevent its penetration
// (doc/theory.md 4)
struct Bonds {
  int nbond = 0;
  int nfixed = 0;              // bonds of the deck; bonds of conversion follow
  ListTable a;                 // side A: finite-element node n, or corner c as nnode + c
  RealVec a_w;                 // [a.item] weights, sum 1
  IntVec def;                  // [nbond] index into Model::bond
  IntVec side;                 // [nbond] BondSide
  IntVec field;                // [nbond] SIDE_GRID: the grid field; else -1
  RealVec area;                // [nbond] tributary area (length x thickness in 2D)
  RealVec X;                   // [nbond*3] position at t = 0
  RealVec normal;              // [nbond*dim] unit normal, from side A outwards
  RealVec cn, ct;              // [nbond] penalty normal and tangential x area        force/length
  IntVec intermediate;         // [nbond] 0: at a node, 1: between nodes
  ContactState contact;
  // divided model, made by bond_share, not saved: [nbond] owner; names, equal on all ranks, ascending in the
  // order of a single rank; ranks that store a bond; total number
  IntVec rank;
  std::vector<long> name;
  Halo halo;
  int nall = 0;
  // contact: depth beyond deep; its cube times growth is an added force (4.21)        length, force/length^3
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
  bool counts(int b) const { return !halo.on() || rank[b] == comm_rank(); }    // sum of this rank includes b
  int nbond_all() const { return halo.on() ? nall : nbond; }                   // total over ranks
};

// Phase of a finite element
enum ElemPhase { AS_ELEMENT, AS_POINTS, AS_NOTHING };

struct Fracture {              // empty arrays: no fracture, no conversion
  IntVec phase;                // [nelem] ElemPhase
  IntVec broken;               // [nelem] index into Model::fracture when broken, -1: intact
  RealVec normal;              // [nelem*3] normal of the crack, frozen when it broke
  RealVec time;                // [nelem] time of fracture, -1: intact
  IntVec releasing;            // broken elements whose psi+ is above c, in the order of fracture
  IntVec converted;            // converted elements, in their order
  // released points, in their order; total number of points then; their corners before
  IntVec released, released_at;
  ListTable left;
  int renewed = 0;             // released points with a renewed shape so far
  double next_test = 0.0;      // total time of the next test
  // [nelem] dynamics: psi+ / volume, and its time average (7.26); 0: not tracked; empty: none yet
  RealVec drive, mean;
  double drive_time = 0.0;     // total time of both
  int neroded = 0;             // broken by the criterion so far
  // totals of releasing, converted and released over ranks
  int nreleasing = 0, nconverted = 0, nreleased = 0;
  double area = 0.0;           // crack area: sum of V/h over broken elements    length x thickness
  // smallest and largest coordinates of centres of points whose cohesive crack has opened
  double least[3] = {1e300, 1e300, 1e300}, most[3] = {-1e300, -1e300, -1e300};
  // TRACK: [nelem] has a crack from an earlier increment: 1: on the line of a tip, 2: beside, 3: begins as
  // without TRACK; empty: none
  IntVec tracked;
  RealVec tip;                 // [ntip*4] tips of cracks: position and unit direction of growth
  IntVec tip_elem;             // [ntip] element ahead of the tip, -1: the tip has stopped
  bool empty() const { return phase.empty(); }
};

struct Level {                 // one time level
  double time = 0.0;           // total time
  RealVec u, v, a;             // [nnode*dim] finite-element nodes
  RealVec uc;                  // [ncorner*dim] displacement of corners since t = 0   length
  RealVec vc;                  // [ncorner*dim] velocity of corners
  RealVec slip;                // [nbond*dim] side A - side B; contact: the gap     length
  RealVec lambda;              // [nbond*dim] augmented Lagrange multiplier; contact: friction     force
  RealVec lambda_n;            // [nbond] contact: normal multiplier, not positive            force
  // history of the law at the Gauss points of all elements, and of points; empty: no law has any
  RealVec he, hp;
  // [nelem] degradation factor of psi+: 1 intact, c when fully released; empty: no fracture
  RealVec degr;
  IntVec cracked;              // [nelem] 1: a cohesive crack has begun to open; empty: no law has one
  RealVec q;                   // [nelem] pressure of the bulk viscosity (6.35); empty: there is none
};

// degr_of_step : degradation factor of element e in a step from l0 to l1: the mean for the energy-momentum
// scheme, else that of l1
inline double degr_of_step(const Level& l0, const Level& l1, bool mid, int e)
{
  return mid ? 0.5 * (l0.degr[e] + l1.degr[e]) : l1.degr[e];
}

struct Ledger {                // energies and momenta at t(n), [3] in space
  // external: work of loads and moved supports so far
  double kinetic = 0, strain = 0, bond = 0, external = 0;
  double friction = 0;         // dissipated by friction so far
  double plastic = 0;          // dissipated by plastic flow so far
  // released by erosion, and in statics by the equilibrium after it, so far
  double fracture = 0;
  double cohesive = 0;         // dissipated by cohesive cracks so far
  double ghost = 0;            // dissipated by ghost stabilisation so far
  double viscous = 0;          // dissipated by *DAMPING and *VISCOUS BOUNDARY so far
  // statics: lost so far on the way to equilibrium from unbalanced forces                              (6.15)
  double renewal  = 0;         // of the projection to a new grid
  double overlap  = 0;         // of initial contact overlap
  double released = 0;         // of removed supports
  double sudden   = 0;         // of loads applied at once
  double stopped  = 0;         // kinetic energy of stopped motion
  double conversion = 0;       // lost by conversion (averages, bonds), so far
  double removed = 0;          // of elements removed by *MODEL CHANGE in steps, less added ones, so far
  double total0 = 0;           // kinetic + strain + bond at the start of the run
  // kinetic + strain + bond + losses (ledger_lost) - total0 - external
  double balance = 0;
  double scale = 0;            // largest energy so far
  double rounding = 0;         // energies below are round-off
  // present step: balance and external work at its start, largest energy in it
  double balance0 = 0, external0 = 0, step_scale = 0;
  // explicit: increment length of the half steps whose velocity product gives the kinetic energy, 0: none
  double leap = 0;                                                                             // (6.33)
  double leap_grid = 0;        // explicit: 1/8 a M a of the grid at t(n)               energy/time^2
  double beta_power = 0;       // explicit: power of the viscous stress (BETA) in the last increment
  int off = 0;                 // steps whose imbalance exceeds their limit
  double momentum[3] = {0, 0, 0};
  double angular[3] = {0, 0, 0};
  double slip_max = 0, slip_rms = 0;
};

struct ContactLog {            // one contact pair at t(n+1)
  double force = 0;            // sum of the normal forces
  double gap   = 0;            // deepest penetration (negative), 0: open
  double area  = 0;            // closed area
  double peak  = 0;            // largest pressure of a contact point           force/length^2
  double work  = 0;            // dissipated by friction since the start
};

struct StepClock {             // time of the present step
  double start = 0;            // total time at its start
  double t = 0;                // completed time of the step
  double dt = 0;               // of the next attempt
  long nominal = 1;            // DIRECT: end of the present increment, in units of dt
  int easy = 0;                // increments in a row that converged quickly
  // statics: upper limit of dt, set at the first fracture of the step; 0: none yet
  double most = 0;
  // statics: end of the next increment, in which an element breaks; 0: not known
  double aim = 0;
  // dynamics, automatic increments: sums of F dt and F^2 dt of the inertia force F, and the largest strain
  // energy, in the step so far                                                               (6.25), (6.26)
  double impulse = 0, square = 0, energy = 0;
  int cuts = 0;                // cuts of the step so far
  // explicit: stable increment of elements, and of the system at the start of the step, 0: not known; number
  // of converted and released points at the last check                                      (6.30) - (6.32)
  double stable = 0, system = 0;
  long broke = 0;
  int measured = 0;            // explicit: StepLog::inc_total when the system was measured last
  double xi = 0;               // explicit: largest damping ratio of the bulk viscosity in the last increment
  // explicit: increment of the stage, smallest stable one in it; 0: none                   (6.32)
  double stage = 0, stage_least = 0;
  // *STATIC, RIKS: load time, its maximum so far; is the step at its end?
  double load = 0, load_most = 0;
  int ended = 0;
};

// clock_over : is the step at its end?
inline bool clock_over(const Step& s, const StepClock& c) { return s.arc.on ? c.ended != 0 : s.over(c.t); }

struct GridLaid {              // positions of corners and bonds when the active grid was made
  RealVec uc, xb;              // [ncorner*dim], [nbond*dim]; empty: grid to be rebuilt
  int inc = 0;                 // StepLog::inc_total then
  long made = -1;              // ActiveGrid::made; not saved
  // does it fit these sizes (a rank may have no corner), or is the grid to be rebuilt?
  bool fits(std::size_t nuc, std::size_t nxb) const
  {
    return (uc.empty() && xb.empty()) || (uc.size() == nuc && xb.size() == nxb);
  }
};

struct Division {              // owners of elements and points; one rank: empty
  int ranks = 1;
  // the model is divided too, not only its work; elem then has the pieces during saving only, else is empty
  bool pieces = false;
  IntVec elem, point;          // [nelem], [npoint] rank
  double excess = 0;           // largest work of a rank over the mean, at the division
  // MeshPart::window: total points and corners then; have points been transferred between ranks?
  int made    = -1;
  bool handed = false;
};

// State of WorkShare::events; the reference work is that after the first increment
enum { AT_START = -3, DIVIDED = -2, AFTER_DIVISION = -1 };

struct WorkShare {             // work balance of a divided model
  int events = AT_START;       // broken and converted elements at the last check
  double excess = 1.0;         // largest work of a rank over the mean, after the last division
  double now    = 1.0;         // the same at the last check
  double lost   = 0.0;         // increments lost since then to uneven work
};

enum StepBegin { STEP_BEGUN, SUPPORTS_DUE, ELEMENTS_DUE };   // ELEMENTS_DUE: then the supports

struct StepLog {               // data of the increment for the listing
  int step = 0;                // 1-based
  int inc = 0;                 // increment within the step, 1-based
  int inc_total = 0;
  int iterations = 0, cuts = 0;
  double dt = 0, t_step = 0;
  double residual = 0, scale = 0;   // last residual norm and force scale
  double half = 0, half_limit = 0;  // half-increment residual and its limit; limit 0: not requested
  int grid_nodes = 0, grid_cells = 0, weak_nodes = 0, equations = 0;
  long contact_searched = 0, contact_skipped = 0;   // pair searches so far; skipped: surfaces far apart
  int begin = STEP_BEGUN;      // what the step still has to change at its beginning
};

struct ErosionLog {            // a broken element
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
  // [nnode*dim] forces on nodes by elements removed at the start of this static step, with their loads, which
  // decrease to 0 over the step (6.43); else empty
  RealVec left_by_removed;
  // [nnode*dim] displacement rate of the last increment of this static step; first increment: empty
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
