// ---------------------------------------------------------------------------
// model.h : the data of the deck. Filled by deck/, const after deck_check.
//
// Labels are the user's, indices start at 0. Coordinates have three components
// also in two dimensions; nodal vectors of the state have Model::dim.
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_MODEL_H
#define MPFE_MODEL_MODEL_H

#include <array>
#include <cmath>
#include <cstdint>
#include <string>
#include <vector>

#include "base/expr.h"
#include "base/halo.h"
#include "base/types.h"
#include "model/element_table.h"

struct DeckLine {                 // line of a deck file, for messages
  std::string file;
  int line = 0;
};

struct Mesh {
  IntVec node_label;           // [nnode]
  RealVec X;                   // [nnode*3] coordinates at t = 0                      length
  IntVec elem_label;           // [nelem]
  IntVec elem_type;            // [nelem] index into elem_table
  IntVec elem_section;         // [nelem] index into Model::section, -1: none yet
  ListTable conn;              // [nelem] nodes of an element
  int nnode() const { return static_cast<int>(node_label.size()); }
  int nelem() const { return static_cast<int>(elem_label.size()); }
};

struct UncoupledPair {         // two parts without contact or bonds between them
  int body = -1;               // a body of points
  int other = -1;              // another body, or
  int section = -1;            // the elements of a section
  bool reported = false;
};

struct Face {
  int elem;                    // element (or material point) that owns the face
  int face;                    // 0-based local face
};

struct OriginalPoint {         // a point of the deck: global number, owning rank
  int point, rank;
  bool operator<(const OriginalPoint& b) const { return point < b.point; }
  bool operator==(const OriginalPoint& b) const { return point == b.point; }
};

// Divided model on several ranks: Mesh, sets, surfaces, loads and supports contain the owned part. Mesh also
// has halo elements of other ranks: those in the estimates of this rank, those with faces that its contact
// may meet, and those at side A of bonds and contact, or converted before the run, that share a node with an
// owned element.
struct MeshPart {
  bool on = false;
  bool points = false;         // each rank stores its own material points only (PointPart)
  bool window = false;         // converted points are stored with their element, halo too (PointPart)
  int nnode = 0, nelem = 0;    // of the mesh of the deck
  // [Mesh::nnode], [Mesh::nelem] global number: elements as in the deck, nodes in the order of
  // model_order_nodes. Ascending; but the node list starts with the nodes of this rank, and smaller numbers
  // follow after the largest
  IntVec node, elem;
  IntVec deck;                 // [Mesh::nnode] node number in the deck
  IntVec rank;                 // [Mesh::nelem] owner of an element
  Halo halo;                   // nodes shared with other ranks
  Halo around;                 // elements shared with other ranks, owner: rank; off: no halo elements
  // window: [Mesh::nelem] this rank stores the converted points of the element; elements for which other
  // ranks do so too, owner: rank
  std::vector<char> with_points;
  Halo around_points;
  // points: points of the deck of other ranks that contact of this rank may meet, ascending
  std::vector<OriginalPoint> near_point;
  // [Mesh::nelem] a notch may end within the estimate of the element, which this rank has complete; empty:
  // use the mesh
  std::vector<char> notch;
  bool joined = false;         // all elements of the deck are connected by faces
  bool tied = false;           // the deck has equations between displacements
  std::vector<UncoupledPair> uncoupled;       // of the whole model (overlap_pairs)
  std::vector<Face> skin;      // general contact: outer faces at t = 0 of the whole mesh
  bool counts(int n) const { return !on || halo.owner[n] == comm_rank(); }     // sum of this rank includes n
  bool stores_points(int e) const { return !window || with_points[e]; }        // of element e
  bool works(int e) const { return !on || rank[e] == comm_rank(); }            // is element e owned?
  // global numbers, and index by global number, -1: not on this rank
  int elem_number(int e) const { return on ? elem[e] : e; }
  int node_number(int n) const { return on ? node[n] : n; }
  int deck_number(int n) const { return on ? deck[n] : n; }
  int elem_here(int number) const;
  int node_here(int number) const;
};

struct Set {                   // nodes or elements, ascending, each once
  std::string name;            // upper case
  IntVec item;
  DeckLine deck_line;
};

struct Member {                // element of a set or a surface, in a divided model
  int elem;
  int at;                      // index in the set
};

struct Surface {
  std::string name;
  std::vector<Face> face;      // faces of finite elements; for a body: filled by point_fill
  // divided model, with bonds or contact: [face] index in the whole list
  std::vector<Member> member;
  int body = -1;               // >= 0: the boundary of this body of material points
  Expr where;                  // body: faces all of whose corners satisfy where != 0 at t = 0
  DeckLine deck_line;
};

// Split of the energy into a part released by a crack and a part kept (doc/theory.md 2.1)
enum Split { SPLIT_RCE, SPLIT_VD, SPLIT_SPECTRAL, SPLIT_PRESSURE, SPLIT_NONE, SPLIT_CRACK, SPLIT_GRANULAR };

// rows of the table in mat/law_step.cpp
enum LawKind {
  LAW_SVK, LAW_NEO_HOOKE, LAW_J2, LAW_DRUCKER_PRAGER, LAW_GRANULAR, LAW_COHESIVE, LAW_COHESIVE_FLOW,
  LAW_SPLIT, LAW_ORTHO, LAW_OTHER, LAW_KINDS
};

// law_flows : is it plasticity?
inline bool law_flows(LawKind law) { return law == LAW_J2 || law == LAW_DRUCKER_PRAGER; }

// law_opens : the laws of cohesive cracks
inline bool law_opens(LawKind kind) { return kind == LAW_COHESIVE || kind == LAW_COHESIVE_FLOW; }

enum Hardening { HARDENING_COMPRESSION, HARDENING_TENSION, HARDENING_SHEAR };

struct Material {
  std::string name;
  LawKind law = LAW_SVK;
  double young   = 0.0;        // force/length^2
  double poisson = 0.0;
  double density = 0.0;        // mass/length^3, 0: not given
  double alpha = 0.0;          // *DAMPING: force alpha M v                                      1/time
  double beta  = 0.0;          // *DAMPING: stress beta D : dE/dt                                time
  // *ELASTIC, TYPE=ENGINEERING CONSTANTS: D [36] in the directions of the model, engineering shear columns
  RealVec elastic;
  // *PLASTIC: yield stress over equivalent plastic strain, piecewise linear, constant beyond the last
  RealVec yield, plastic_strain;
  // *DRUCKER PRAGER: friction and exponent of (2.37): tan(angle) and 1, or 1/a and b of EXPONENT FORM;
  // tangent of the dilation angle; test that yield and plastic_strain belong to
  double friction = 0.0, exponent = 1.0, dilation = 0.0;
  bool gap = false;            // APEX=GAP: parted material closes before it carries pressure          (2.45)
  Hardening hardening = HARDENING_COMPRESSION;
  bool has_elastic = false;    // *ELASTIC, or *HYPERELASTIC: young and poisson are those of small strains
  bool has_damping = false;
  bool used = false;           // by a section or a body
  bool hyper  = false;         // *HYPERELASTIC
  bool breaks = false;         // elements of it can break
  // initial strain of elements or points (2.44); its index in the history of an integration point, -1: none
  bool prestressed = false;
  int initial = -1;
  DeckLine deck_line;
};

// cone_power : q^b of (2.37)
inline double cone_power(const Material& m, double q)
{
  return m.exponent == 1.0 ? q : std::pow(q, m.exponent);
}

// cone_cohesion : *DRUCKER PRAGER: d of (2.37) at the stress y of the test of its table; steep: dd/dy (2.39)
double cone_cohesion(const Material& m, double y, double* steep);

// cone_tension : uniaxial tension at which the material flows, at the stress y of the test of its table
double cone_tension(const Material& m, double y);

struct Section {               // *SOLID SECTION
  int elset;
  int material;
  double thickness = 1.0;      // length
  DeckLine deck_line;
  bool lumped = false;         // mass at the nodes instead of the consistent one
};

enum AmplitudeKind { AMP_TABULAR, AMP_SMOOTH_STEP, AMP_STEFFEN, AMP_AKIMA, AMP_CUBIC, AMP_EXPRESSION };

struct Amplitude {
  std::string name;
  AmplitudeKind kind = AMP_TABULAR;
  bool total_time = false;     // TIME=TOTAL TIME; otherwise the time of the step
  RealVec t, y;                // table
  Expr expr;                   // AMP_EXPRESSION: function of t
  DeckLine deck_line;
};

// ---- material points ------------------------------------------------------

// FILL_CONVERSION: empty until elements become points
enum FillKind { FILL_BLOCK, FILL_ELSET, FILL_REGION, FILL_CONVERSION };

// Ranks of the cells of a box, in runs of cells, first direction fastest: cells from first[k] on belong to
// rank[k], -1: cells without points
struct CellRanks {
  IntVec first, rank;
  bool empty() const { return first.empty(); }
};

struct Body {                  // *MATERIAL POINTS
  std::string name;
  FillKind fill = FILL_BLOCK;
  std::array<double, 3> lo{{0, 0, 0}}, hi{{0, 0, 0}};   // FILL_BLOCK, FILL_REGION: box at t = 0
  std::array<int, 3> cells{{0, 0, 0}};                  // FILL_BLOCK: 0: as many as grid cells fit (rounded)
  int per_cell = 2;            // m x m (x m) points in a cell of the fill, or in an element
  int elset = -1;              // FILL_ELSET: finite elements converted before the run
  Expr where;                  // FILL_REGION: domains with where != 0 at their centre
  int material = -1;
  Plane plane = PLANE_STRAIN;
  double thickness = 1.0;
  int field = 0;               // grid field: bodies with the same number share grid unknowns
  // RESHAPE: each domain has corners of its own, and becomes a square or cube above this stretch (3.20)
  // 0: the domains share their corners
  double reshape = 0.0;
  bool hang = false;           // FILL_CONVERSION: corners may follow nodes of the mesh (7.14)
  int fracture = -1;           // index into Model::fracture of its cohesive cracks, -1: none
  CellRanks rank;              // divided model, FILL_BLOCK, FILL_REGION
  DeckLine deck_line;
};

struct Grid {                  // *GRID : a box of equal cells
  bool given = false;
  std::array<double, 3> lo{{0, 0, 0}};
  std::array<double, 3> h{{0, 0, 0}};     // cell size
  std::array<int, 3> n{{0, 0, 0}};        // cells
  double weak = 0.05;          // extended basis: nodes with max_p S_pv below this are no unknowns; 0: off
  // cells by which a corner may move before the active grid is renewed; 0: every increment
  double keep = 0.1;
  DeckLine deck_line;
  // *GHOST: parts of E and rho that penalise jumps of the gradient at the boundary; 0: off
  double ghost_stiffness = 0.0;
  double ghost_mass      = 0.0;
  DeckLine ghost_place;           // file empty: no *GHOST
};

struct ViscousBoundary {       // *VISCOUS BOUNDARY
  int surface = -1;
  double a = 1.0, b = 1.0;     // factors of the impedance along the normal and across it
  DeckLine deck_line;
};

struct GridBc {                // *GRID BOUNDARY : all grid nodes on a plane
  int axis = 0;                // 0 1 2
  double position = 0.0;
  int first = 0, last = 0;     // dofs, 0-based
  Expr value;                  // displacement, from the start of the run
  int amplitude = -1;
  double friction = 0.0;       // explicit steps: coefficient of friction along the plane
  int side = 0;                // -1: at the lower end of the grid, 1: at the upper, 0: between
  DeckLine deck_line;
};

// treatment of contact surfaces that overlap at the start
enum OverlapPolicy { OVERLAP_PUSH, OVERLAP_ADJUST, OVERLAP_REFUSE };

enum BondKind { BOND_MESH_GRID, BOND_GROUND, BOND_CONTACT };

// A side of a rule of general contact: faces of a surface, an element set or a body; none of them: all
struct ContactSide {
  int surface = -1, elset = -1, body = -1;
  IntVec elem;                 // divided model: elements of elset, halo too
};

struct ContactRule {           // one line of *CONTACT INCLUSIONS, EXCLUSIONS, PROPERTY ASSIGNMENT
  ContactSide a, b;
  double friction = 0.0, stick = 0.0, penalty = 0.0;     // of a property
};

// Data of a contact definition in addition to BondDef
struct ContactDef {            // *CONTACT PAIR, *CONTACT
  int master = -1;             // the master surface; BondDef::surface is the slave
  double friction = 0.0;       // Coulomb
  OverlapPolicy overlap = OVERLAP_PUSH;
  // OVERLAP_ADJUST: initial gaps up to this count as zero too        length
  double adjust = 0.0;
  // contact points inside the slave faces (SURFACE TO SURFACE) instead of nodes
  bool by_face = false;
  // tangential stiffness per area during sticking; 0: equal to the normal one
  double stick = 0.0;
  // *CONTACT: all outer faces, each with contact points, against all; the last property that fits counts
  bool general = false;
  // divided model, contact pair: this rank may own contact points of it, and has their possible faces
  bool present = true;
  double stiff = 0.0;          // divided model: largest mat_stiffness at the master surface, of all ranks
  std::vector<ContactRule> include, exclude, property;
};

struct BondDef {               // *BOND, *CONTACT PAIR, *CONTACT
  std::string name;
  BondKind kind = BOND_MESH_GRID;
  // surface of finite elements; BOND_GROUND: surface of finite elements or of a body
  int surface = -1;
  int body = -1;               // BOND_MESH_GRID: the body of material points on the other side
  int intermediate = -1;       // bonds along an edge between nodes; -1: as dense as the corners of the body
  double penalty = 0.0;        // force/length^3; 0: alpha M/h
  double alpha = 0.0;          // 0: the default of the program
  bool normal_only = false;    // rollers: bond along direction only, or along the face normal if it is zero
  std::array<double, 3> direction{{0, 0, 0}};
  std::array<Expr, 3> motion;  // BOND_GROUND: displacement of the ground
  int amplitude = -1;
  int augment = 0;             // augmented Lagrange updates a step
  ContactDef contact;          // BOND_CONTACT
  DeckLine deck_line;
  bool pair() const { return contact.master >= 0; }          // *CONTACT PAIR
};

struct InitialValue {          // *INITIAL CONDITIONS, TYPE=VELOCITY|DISPLACEMENT
  bool displacement = false;
  IntVec node;                 // finite-element nodes, or
  int body = -1;               // a body
  int dof = 0;
  Expr value;
  DeckLine deck_line;
};

struct InitialStress {         // *INITIAL CONDITIONS, TYPE=STRESS
  IntVec elem;                 // elements, or
  int body = -1;               // a body
  int point = -1;              // integration point of the elements, -1: all
  std::array<Expr, 6> value;   // 11 22 33 12 23 31                               force/length^2
  DeckLine deck_line;
};

// ---- fracture --------------------------------------------------------------

enum Criterion { CRITERION_GRIFFITH, CRITERION_ELEMENT, CRITERION_COHESIVE };
enum Softening { SOFTENING_LINEAR, SOFTENING_BILINEAR, SOFTENING_EXPONENTIAL };
enum Estimate { ESTIMATE_AUTO, ESTIMATE_FORCE, ESTIMATE_BALL };
enum ErosionOrder { ORDER_STRONGEST, ORDER_ALL };

struct FractureDef {           // *EIGENFRACTURE
  int elset = -1;              // elements that may break, or
  int body  = -1;              // CRITERION_COHESIVE: a body of material points
  Criterion criterion = CRITERION_GRIFFITH;
  Estimate estimate   = ESTIMATE_AUTO;   // AUTO: FORCE in statics, BALL in dynamics
  Split drive    = SPLIT_RCE;  // psi+ of the criterion
  Split residual = SPLIT_CRACK;        // part of the stress kept by broken material
  double friction = 0.0;       // SPLIT_GRANULAR: tangent of the angle of internal friction
  ErosionOrder order = ORDER_STRONGEST;
  double gc      = 0.0;        // toughness                                       force/length
  double weibull = 0.0;        // modulus of its scatter, 0: none
  int seed       = 1;
  double epsilon = 0.0;        // radius of the ball in element sizes; 0: the default of the estimate
  // distance of elements that break in one test, in element sizes; -1: default, 0: one element only
  double spacing = -1.0;
  double interval = 0.0;       // time between tests, 0: every increment
  double stiffness = 1e-6;     // c of broken material
  double release  = 0.0;       // dynamics: psi+ of a broken element falls to c in release h/c_R, 0: at once
  double average  = 0.0;       // dynamics: time over which the criterion averages psi+, in h/c_R
  // statics, automatic increments: allowed excess of the criterion, 0: any
  double tolerance = 0.01;
  double fallback = -1.0;      // part of Gc h that breaks an element anywhere; 0: off, -1: default
  bool start = true;           // may a crack initiate?
  // CRITERION_COHESIVE: tensile strength                                      force/length^2
  double ft = 0.0;
  Softening softening = SOFTENING_LINEAR;
  bool track = false;          // CRITERION_COHESIVE: a crack grows from its tips only (frac_track)
  std::vector<Member> member;  // divided model: elements of elset on this rank, halo too
  DeckLine deck_line;
};

enum ConversionTrigger { TRIGGER_EROSION, TRIGGER_DISTORTION, TRIGGER_TIME };

struct ConversionDef {         // *CONVERSION : elements that become material points during the run
  int elset = -1;
  ConversionTrigger trigger = TRIGGER_EROSION;
  // TRIGGER_DISTORTION: det F below this, or aspect of F above its inverse; TRIGGER_TIME: total time
  double limit = 0.0;
  int per_elem = 2;            // m x m (x m) points an element
  int field    = 0;            // grid field
  // largest stretch of a broken point before it is released from its neighbours; 0: never
  double release = 0.0;
  // INTERFACE=BONDS: points are attached to the remaining elements by bonds; else corners hang on their nodes
  bool bonded = false;
  BondDef bond;                // intermediate, penalty and alpha of the bonds
  std::string body_name;
  IntVec elem;                 // divided model: elements of the set, halo too
  IntVec body;                 // [section] body of material points, -1: no element of the section
  IntVec bond_of;              // [section] index into Model::bond
  DeckLine deck_line;
};

struct EquationTerm { int node, dof; double coef; };

// keyword that made an equation
enum EquationOf { EQUATION_GIVEN, EQUATION_TRANSFORM, EQUATION_TIE, EQUATION_COUPLING };

struct Equation {              // *EQUATION : sum of coef u = 0; the first dof is the dependent one
  std::vector<EquationTerm> term;
  DeckLine deck_line;
  EquationOf of = EQUATION_GIVEN;
};

struct Frame {                 // *TRANSFORM : directions of a node
  int node = -1;
  // an auxiliary node with the displacements of node along its own directions, by the equations
  // [equation, equation + dim); -1: not needed by a support, load or equation
  int twin = -1, equation = -1;
  std::array<double, 9> axis;  // component j of direction i: [3*i + j]
  DeckLine deck_line;
};

struct RigidBody {             // *RIGID BODY
  // explicit steps with NLGEOM rotate its nodes as a rigid body (6.41); other steps use equations
  IntVec node;
  int ref = -1, turn = -1;     // reference node; auxiliary node with the rotation as displacements
  DeckLine deck_line;
};

struct BrokenDef {             // pre-cracks: *MODEL CHANGE, REMOVE and *INITIAL CONDITIONS, TYPE=BROKEN
  IntVec elem;
  bool remove = false;
  std::array<double, 3> normal{{0, 0, 0}};
  DeckLine deck_line;
};

struct ModelChange {           // *MODEL CHANGE in a step
  IntVec elem;
  bool add = false;            // else removed
  DeckLine deck_line;
};

// ---- steps ----------------------------------------------------------------

enum LoadKind { LOAD_NODE, LOAD_PRESSURE, LOAD_TRACTION, LOAD_BODY };

// Load history within a step: unchanged; in a static step: from 0 to full; from full to 0
enum Ramp { RAMP_NONE, RAMP_IN, RAMP_OUT };

struct Load {
  LoadKind kind = LOAD_NODE;
  std::string keyword;         // without star
  std::string key;             // keyword, target, kind and direction as in the deck
  IntVec node;                 // LOAD_NODE
  std::vector<Face> face;      // LOAD_PRESSURE, LOAD_TRACTION on finite elements, during reading only
  int surface = -1;            // LOAD_PRESSURE, LOAD_TRACTION: surface of elements or of a body
  IntVec except, only;         // surface of a body: without the faces of these surfaces; only their faces
  IntVec elem;                 // LOAD_BODY: elements
  IntVec body;                 // LOAD_BODY: bodies of material points
  bool per_mass = false;       // LOAD_BODY: gravity (times density)
  int dof = 0;                 // LOAD_NODE
  std::array<double, 3> dir{{0, 0, 0}};   // unit vector of traction, gravity, body force
  Expr value;                  // force, force/area, force/volume, acceleration
  int amplitude = -1;          // index, or -1
  double factor = 1.0;         // last value of an amplitude that ended with its step
  bool of_position = false;       // value depends on position only: it is ramped like a constant
  Ramp ramp = RAMP_NONE;
  double hold = -1.0;          // RAMP_OUT: total time at which the value is taken
  DeckLine deck_line;
};

struct Prescribed {            // *BOUNDARY
  IntVec node;
  int first = 0, last = 0;     // dofs, 0-based, both included
  Expr value;                  // displacement, length; or velocity, length/time
  bool velocity = false;
  int amplitude = -1;
  double factor = 1.0;         // last value of an amplitude that ended with its step
  bool ramp = false;           // from the displacement at the start of the step
  DeckLine deck_line;
};

enum Procedure { PROC_STATIC, PROC_DYNAMIC };
// rows of the table in scheme.cpp
enum TimeScheme { SCHEME_NEWMARK, SCHEME_ENERGY_MOMENTUM, SCHEME_HHT, SCHEME_EXPLICIT };

struct Controls {              // *NEWTON
  double tol_force  = 1e-8;    // residual / force scale
  double tol_energy = 1e-12;   // sum R^2/A_ii over sum f^2/A_ii
  int max_iter = 16;
  int max_cut  = 10;           // cuts of an increment
  bool line_search = true;
};

struct PrintRequest {          // *NODE PRINT, *EL PRINT
  bool element = false;
  int set = -1;                // nset or elset
  std::vector<std::string> what;    // U V A RF | S E ENER
  int frequency = 1;
  bool totals = false;         // TOTALS=YES: the sum of RF as well
  bool global = false;         // components x, y, z also at nodes with their own directions
  bool only = false;           // TOTALS=ONLY: the sum of RF without the forces of the nodes
};

// *STATIC, RIKS: loads follow the cracks that open                                                  (6.39)
struct ArcControl {
  bool on = false;
  // the step ends when the mean displacement of a set in a direction has reached end (set -1: not given),
  // when the load is full, or has fallen to nearly 0
  int nset = -1, direction = 0;
  double end = 0.0;            // length
};

struct Step {
  bool nlgeom = false;
  Procedure proc = PROC_STATIC;
  double period = 1.0, dt = 1.0, dt_min = 1e-6, dt_max = 1.0;
  bool direct = false;         // fixed increments
  ArcControl arc;
  // dynamics, automatic increments: limit of the half-increment residual, as a force (0: not given) and
  // relative to the largest force; both 0: not checked                                                (6.24)
  double half_force = 0.0, half_part = 0.0;
  int max_inc = 1000000;
  TimeScheme scheme = SCHEME_NEWMARK;
  bool scheme_given = false;
  double beta = 0.25, gamma = 0.5;
  double dissipation = 0.0;    // energy-momentum: 0 ... 0.5
  double alpha = 0.0;          // HHT: -1/3 ... 0
  double safety = 0.9;         // explicit: increment over the largest stable one
  double bulk_linear = 0.0, bulk_quadratic = 0.0;      // coefficients of the bulk viscosity (6.35)
  // allowed energy imbalance, relative to the largest energy; 0: the default
  double balance = 0.0;
  bool extrapolate = true;     // statics: initial guess from the rate of the last increment
  Controls ctl;
  std::vector<Load> load;              // all active loads, from earlier steps too
  std::vector<Prescribed> prescribed;  // all active ones; a node and direction appears once
  std::vector<PrintRequest> print;
  IntVec equation;             // indices into Model::equation, active in this step
  std::vector<ModelChange> change;     // at the start of the step
  DeckLine deck_line;
  std::uint64_t hash = 0;      // of the cards of this step and of those before, without output requests
  bool explicit_steps() const { return proc == PROC_DYNAMIC && scheme == SCHEME_EXPLICIT; }
  bool viscous() const { return bulk_linear > 0.0 || bulk_quadratic > 0.0; }
  bool bulk() const { return explicit_steps() && viscous(); }
  bool bulk_mid() const                // energy-momentum
  {
    return proc == PROC_DYNAMIC && scheme == SCHEME_ENERGY_MOMENTUM && viscous();
  }
  bool over(double t) const { return t >= period * (1.0 - 1e-10); }     // is t the end of the step?
};

// ---- output and checks ----------------------------------------------------

enum Reduce { REDUCE_MEAN, REDUCE_SUM, REDUCE_MAX, REDUCE_MIN, REDUCE_ABSMAX };

struct HistoryDef {            // *HISTORY : one column each
  std::string name;
  std::string what;            // U1 V2 A1 RF1 S11 ... E12 ENER X1
  Reduce reduce = REDUCE_MEAN;
  int nset = -1, elset = -1, body = -1;
  int grid_bc = -1;            // GRF: the condition of *GRID BOUNDARY
  int contact = -1;            // CFORCE CGAP CAREA CWORK CPRESS: index into Model::bond
  bool at_point = false;       // at the material point X of t = 0
  std::array<double, 3> X{{0, 0, 0}};
  DeckLine deck_line;
};

struct VtkDef {                // *VTK
  bool on = false;
  bool ascii = false;          // legacy as text
  bool xml = false;            // .vtu
  int frequency = 0;           // every n increments, 0: not by number
  double interval = 0.0;       // every so much time
};

struct FragmentsDef {          // *FRAGMENTS
  bool on = false;
  int frequency = 0;           // every n increments, 0: not by number
  double interval = 0.0;       // every so much time, 0: not by time
  DeckLine deck_line;
};

struct RestartDef {            // *RESTART
  bool read = false, write = false;
  bool overlay = false;        // WRITE: keep the last file only
  int frequency = 0;           // WRITE: every n increments, 0: not by number
  double interval = 0.0;       // WRITE: every so much time
};

enum CheckKind { CHECK_HISTORY, CHECK_FIELD };
enum CheckAt { AT_TIME, AT_END, AT_MAX, AT_MIN, AT_ABSMAX };

struct Check {                 // *CHECK
  std::string name;
  CheckKind kind = CHECK_HISTORY;
  std::string column;          // CHECK_HISTORY: column of the history
  std::string what;            // CHECK_FIELD: U1 V1 S11 ...
  Expr exact;                  // CHECK_FIELD: exact value, function of X (t = 0) and t
  // CHECK_FIELD: stress of elements as the mean of the Gauss points, at the centre
  bool centre = false;
  double scale = 0.0;          // CHECK_FIELD: the error is divided by this; 0: by the L2 norm of exact
  CheckAt at = AT_END;
  double time = 0.0;
  double target = 0.0;         // CHECK_HISTORY
  double tolerance = 0.0;      // absolute; relative tolerances are turned into absolute ones by the reader
  std::string source;          // ANALYTIC PUBLISHED CONVERGED PREVIOUS
  DeckLine deck_line;
};

enum SolverKind { SOLVER_AUTO, SOLVER_SKYLINE, SOLVER_MUMPS, SOLVER_CG, SOLVER_AMG };
enum Preconditioner { PRECOND_AUTO, PRECOND_DIAGONAL, PRECOND_CHOLESKY, PRECOND_FACTORS };

struct SolverDef {             // *SOLVER
  SolverKind kind = SOLVER_AUTO;
  Preconditioner precond = PRECOND_AUTO;   // SOLVER_CG; AUTO: incomplete Cholesky
  bool reuse = true;           // no: a factorisation in each Newton iteration
};

struct HistoryOutput {         // *HISTORY, FREQUENCY=
  int frequency = 0;           // 0: not given: 1, in explicit steps 10
  int every() const { return frequency > 0 ? frequency : 1; }
  int every_explicit() const { return frequency > 0 ? frequency : 10; }
};

struct DeckNotes {             // for the listing
  std::string heading;
  std::string passed;          // cards without effect
  std::vector<std::string> tied;         // nodes of *TIE and *COUPLING
  ParamMap param;
};

struct OutputRequests {
  std::vector<HistoryDef> history;
  HistoryOutput history_at;
  VtkDef vtk;
  FragmentsDef fragments;
  RestartDef restart;
  std::vector<Check> check;
};

struct Model {
  std::string job;             // deck name without folder and extension
  std::string out_dir = ".";
  std::string deck;            // path as given
  DeckNotes notes;
  int dim = 2;
  Mesh mesh;
  MeshPart part;
  std::vector<Set> nset, elset;
  std::vector<Surface> surface;
  std::vector<Material> material;
  std::vector<Section> section;
  std::vector<Amplitude> amplitude;
  std::vector<Body> body;
  Grid grid;
  std::vector<GridBc> grid_bc;
  std::vector<ViscousBoundary> viscous;
  std::vector<BondDef> bond;
  std::vector<InitialValue> initial;
  std::vector<InitialStress> initial_stress;
  std::vector<FractureDef> fracture;
  std::vector<ConversionDef> conversion;
  std::vector<BrokenDef> broken;
  std::vector<Equation> equation;
  std::vector<Frame> frame;
  std::vector<RigidBody> rigid;
  std::vector<Step> step;
  OutputRequests output;
  SolverDef solver;
  std::uint64_t hash = 0;      // of the cards outside steps, without output requests
};

// model_material : material of element e, index into Model::material; -1: the element has no section
inline int model_material(const Model& m, int e)
{
  const int section = m.mesh.elem_section[e];
  return section < 0 ? -1 : m.section[section].material;
}

// model_find_* : index by name (upper case), -1 when there is none
int model_find_nset(const Model& m, const std::string& name);
int model_find_elset(const Model& m, const std::string& name);
int model_find_surface(const Model& m, const std::string& name);
int model_find_material(const Model& m, const std::string& name);
int model_find_amplitude(const Model& m, const std::string& name);
int model_find_body(const Model& m, const std::string& name);

// model_members : elements that may break by a definition, with their index in its set; divided model: those
// on this rank, halo too
std::vector<Member> model_members(const Model& m, const FractureDef& d);

// model_changes : is there a *MODEL CHANGE in a step?
bool model_changes(const Model& m);

// model_general_contact : index into Model::bond of *CONTACT, -1 when there is none
int model_general_contact(const Model& m);

// model_has_pairs : is there a *CONTACT PAIR?
bool model_has_pairs(const Model& m);

// frame_turn : components of a vector v [dim] along the directions of a node, out [dim]; back: transforms
// them back to x, y, z
void frame_turn(const Frame& f, int dim, bool back, const double* v, double* out);

// model_viscous : has any material in use a viscous stress (*DAMPING, BETA=)?
bool model_viscous(const Model& m);

// equations_resolve : the equations of the list with dependent dofs eliminated from the masters. False: a dof
// depends on itself; bad: that equation
struct EquationMaster { int node, dof; double coef; };
struct EquationSolved { int node, dof; std::vector<EquationMaster> master; };
bool equations_resolve(const Model& m, const IntVec& list, std::vector<EquationSolved>& out, int& bad);

// amplitude_eval : y(t); t_step and t_total are the times of the step and of the run
double amplitude_eval(const Amplitude& a, double t_step, double t_total);

// load_value, prescribed_value : value at x at the given time, with amplitude, expression of x y z t (t:
// total time), and the ramp of loads
double load_value(const Model& m, const Step& s, const Load& l, const double x[3], double t_step,
                  double t_total);
// prescribed_travel : displacement by a prescribed velocity over t0 ... t1 of the step doc/theory.md (6.40)
double prescribed_travel(const Model& m, const Prescribed& b, const double x[3], double t0, double t1,
                      double total0);
double prescribed_value(const Model& m, const Prescribed& b, const double x[3], double t_step,
                        double t_total);

// value_text : message of a value of the deck that is not finite
//   in   keyword   without star; where: node, face or element; X: its position at t = 0      [3]
std::string value_text(const Model& m, const char* keyword, const DeckLine& deck_line, const Expr& value,
                       int amplitude, const std::string& where, const double* X, double time);

// position_text : (1, 2), in space (1, 2, 3)
std::string position_text(const double* X, int dim);

// support_value : displacement of grid planes and grounds since the start of the run. A constant is ramped
// over a static first step, and acts at once in a dynamic one.
double support_value(const Model& m, const Expr& value, int amplitude, const double x[3], double t_step,
                     double t_total);

#endif
