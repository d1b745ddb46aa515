// ---------------------------------------------------------------------------
// dof.h : numbering, equations, constraints, division among ranks (doc/theory.md 5)
//
// Rows of the system: finite-element nodes in use, those far from bonds first, then the unknown grid nodes.
// Vectors of the system have rows*dim entries.
// ---------------------------------------------------------------------------
#ifndef MPFE_DOF_DOF_H
#define MPFE_DOF_DOF_H

#include <memory>
#include <set>

#include "base/comm.h"
#include "base/failure.h"
#include "base/sum.h"
#include "contact/contact_near.h"
#include "dof/discretisation.h"
#include "solve/solve.h"

// kinds of dofs
enum DofKind { DOF_FREE, DOF_FIXED, DOF_TIED };      // TIED: dependent dof of an equation

// Equations of the step: u[dof] = gap + sum of coef u[master]; no master is dependent    doc/theory.md (5.6)
struct Ties {
  IntVec dof;                  // [ntie]
  ListTable master;            // [ntie] dofs
  RealVec coef;                // [master.item]
  RealVec gap;                 // [ntie] residual of the equation at t(n), from round-off
  bool any = false;            // on any rank
  // [Model::rigid] first ties of bodies that turn by finite angles; they come after all others
  IntVec rigid;
  IntVec list, row;            // equations of the step and rows of nodes that they were made for
};

// A support transferred to a corner: its share in a prescribed dof of the grid
struct CornerSupport {
  int dof;                     // of the system; divided model: -1: not on this rank
  int node_dof;                // node*dim + direction, -1: not on this rank
  double part;                 // fraction of the reaction; the sum is 1 for each dof
};

struct MassRows;

// ---- rows: unknowns, their owners, and the rows of bonds, points and groups of points
struct DofRows {
  int dim = 0, nfe = 0, nrow = 0;
  bool numbered = false;       // rows of nodes are valid for the present elements and bonds
  // divided model: the last of the nfe rows belong to nodes without elements on this rank; bonds of this rank
  // are attached to them, or corners of points follow them
  int nguest = 0;
  IntVec row_of_node;          // [nnode] row of a node, -1: in no element
  IntVec node_of_row;          // [nfe]
  std::vector<long> row_key;   // [nrow] identity of a row: node, or -1 - key of the grid node
  ListTable group;             // [PointLaws::group] rows of all their points, ascending
  IntVec group_first;          // [PointLaws::group] their first points
  ListTable bond;              // [nbond] rows of both sides
  RealVec bond_w;              // [bond.item] N_a of side A, -N_v of side B
  IntVec bond_acts;            // bonds without contact points that meet no face
  bool hung = false;           // points follow nodes of the mesh: mass couples these nodes
  // explicit: the mass of corners that follow others is lumped at these, so it couples no nodes       (6.47)
  bool lumps = false;
  IntVec owned_point;          // points of this rank; all its elements, bonds and ghosts are owned
  IntVec owned_group;          // groups of points (1.14) whose first point this rank owns
  IntVec owner;                // [nrow] rank that owns a row; one rank: empty
  Halo halo;                   // split: rows shared with other ranks
  // several ranks: rows and vectors of the system are those of this rank, in its own numbering
  bool split = false;
  std::vector<char> once;      // split: [nrow*dim] this rank owns the row
  long all = 0;                // split: rows of all ranks, each once
  bool renumbered = false;     // since the last factorisation
  double h_mean = 0.0;         // mean size of elements and cells at t = 0, for round-off tolerances
  int neq() const { return nrow * dim; }
  int projected_from() const { return hung ? 0 : nfe; }       // the first row that the projection may change
  bool counts(size_t i) const { return !split || once[i]; }   // this rank adds dof i to sums
  bool owns(int r) const { return !split || owner[r] == comm_rank(); }                // the row
  double neq_all() const { return static_cast<double>(split ? all : nrow) * dim; }    // of all ranks
};

// ---- constraints: supports, and equations between dofs
struct DofConstraints {
  Ties tie;
  std::vector<char> bare;      // [nfe] a node of an equation that is in no element of any rank
  IntVec fixed;                // [nrow*dim] DofKind
  RealVec target;              // [nrow*dim] prescribed displacement increment, 0 at free dofs
  RealVec rate0, rate;         // [nrow*dim] velocity of prescribed dofs at t(n) (grid only), t(n+1)
  IntVec grid_bc;              // [nrow*dim] index of the grid condition, -1
  IntVec constrained;          // dofs with entries other than those of a free dof
  bool free = false;           // the step prescribes nothing on any rank
  std::vector<CornerSupport> corner_support;  // supports of nodes that were replaced by corners of points
};

// ---- pattern: the matrix, the target of each contribution, the lists for which it is valid
struct DofPattern {
  SysMatrix A;
  // block of A for each node pair, 2 k + 1: transposed; elements of this rank, block after block
  IntVec elem_map;
  // [owned_point], [bond_acts], [nghost]; points with the same nodes as the previous one share its entries
  IntVec point_map, bond_map, ghost_map;
  IntVec group_map;            // [owned_group]
  std::vector<size_t> point_map_off, bond_map_off, ghost_map_off, group_map_off;
  ListTable point_rows;        // the lists for which the pattern is valid
  ListTable bond_rows, ghost_rows, group_rows;
  IntVec point_rank;           // owners of the points for which the pattern is valid; empty: this rank
  bool owns_point(int q) const { return point_rank.empty() || point_rank[q] == comm_rank(); }
  long number = 0;             // of the pattern
  bool lean = false;           // one rank, explicit step: without bonds, which contribute forces only
  long lists_of = -1;          // ActiveGrid::made of the lists of rows
  long tangent = 0;            // number of the tangent in A
  // part of A of intact elements, mass and damping, for kept tangents (8.18); empty: not stored
  RealVec whole;
};

// ---- mass and damping, and the patterns and grids for which they are valid
struct DofMass {
  RealVec M;                   // [blocks of A] mass, one number for all directions; of this rank, as A
  RealVec M_elem;              // hung: [blocks of A] of the elements only
  CornerMass corner_mass;      // of the points of this rank, checked for ActiveGrid::made:
  long corner_mass_made = -1;
  RealVec M_diag;              // [nrow] its diagonal, of all ranks
  RealVec M_here;              // [nrow] its diagonal, of this rank
  IntVec coupled;              // rows with other numbers in M: the others are lumped
  std::shared_ptr<const MassRows> mass_rows;         // rows of the projection, for the pattern mass_of
  RealVec lumped;              // explicit step: [nrow] sums of the rows of M, of all ranks; else empty
  // [blocks of A][dim*dim] damping matrix of this rank, as A; empty: no damping             (6.18), (6.19)
  RealVec C;
  RealVec C_diag;              // [nrow*dim] its diagonal, of all ranks
  bool damped = false;         // C is not empty on some rank
  bool damping_lumped = false; // C is lumped: an explicit step
  long mass_of = 0, damping_of = 0;    // DofPattern::number for which M and C are valid, and ActiveGrid::made
  long mass_made = -1, damping_made = -1;
};

// The system of a step
struct Dofs {
  DofRows rows;
  DofConstraints bound;
  DofPattern pattern;
  DofMass mass;
};

// dof_of_nodes : x of the nodes [nnode*dim] as a vector of the system [neq], 0 in the rows of the grid
inline RealVec dof_of_nodes(const Dofs& s, const RealVec& x)
{
  RealVec out(s.rows.neq(), 0.0);
  for (int r = 0; r < s.rows.nfe; ++r)
    for (int i = 0; i < s.rows.dim; ++i) out[r * s.rows.dim + i] = x[s.rows.node_of_row[r] * s.rows.dim + i];
  return out;
}

// Sum over the dofs of the whole system; shared dofs count on one rank only. Collective
template <class Term>
double dof_sum(const Dofs& s, Term term)
{
  if (!s.rows.split) return sum_terms(s.rows.neq(), term);
  double sum = sum_terms(s.rows.neq(), [&](size_t i) { return s.rows.once[i] ? term(i) : 0.0; });
  comm_sum(&sum, 1);
  return sum;
}
inline double dof_dot(const Dofs& s, const RealVec& a, const RealVec& b)
{
  const double *x = a.data(), *y = b.data();
  return dof_sum(s, [=](size_t i) { return x[i] * y[i]; });
}
// dof_own : x with zeros at dofs that count on another rank
inline RealVec dof_own(const Dofs& s, RealVec x)
{
  for (size_t i = 0; i < x.size() && s.rows.split; ++i) x[i] = s.rows.once[i] ? x[i] : 0.0;
  return x;
}
// dof_total : x of this rank, or x[0] ... x[n-1], summed over the ranks of a divided model
inline double dof_total(const Dofs& s, double x)
{
  if (s.rows.split) comm_sum(&x, 1);
  return x;
}
inline void dof_total(const Dofs& s, double* x, long n)
{
  if (s.rows.split) comm_sum(x, n);
}
// dof_largest, dof_all : maximum over the ranks; true on all ranks
inline double dof_largest(const Dofs& s, double x) { return !s.rows.split ? x : comm_allreduce_max(x); }
inline bool dof_all(const Dofs& s, bool here)
{
  return !s.rows.split ? here : comm_allreduce_max(static_cast<int>(!here)) == 0;
}

// dof_all_free : no dof of any rank is prescribed or tied; false if this rank cannot decide
inline bool dof_all_free(const Dofs& s)
{
  if (s.bound.free) return true;
  return !s.rows.split && s.bound.constrained.empty();
}

// Keys of the warnings that have been given
using Warned = std::set<std::string>;

// Input of a division, on rank 0
struct DivideBy {
  std::vector<RealVec> work;   // of the elements of the deck [kinds][nelem]; empty: as of intact elements
  IntVec rank;                 // [nelem] given owners; empty: to be found
  // faces of all ranks, of general contact and of contact pairs; without faces of one kind: those of t = 0
  std::vector<NearFace> near;
};

// dof_ranks : number of ranks that pays off for the model of rank 0;
// the others wait (comm_keep). Not collective.
int dof_ranks(const Model& m);

// dof_part : divides the model of rank 0 and sends each rank its piece. Collective.
void dof_part(const DivideBy& by, Model& m);

// largest work of a rank over the mean that counts as even: work is not estimated more accurately (no test)
constexpr double WORK_EVEN = 1.05;

// dof_work : work of the elements of this rank, [2][nelem]: the work that scales with rows and iterations, as
// if all were intact or by the node pairs of their points; the additional work of broken elements and points
// dof_excess : largest work of a rank over the mean, sum of both kinds; rank: owner
// of each point [npoint]. Collective.
//   in   uc   displacements of the corners [ncorner*dim]
std::vector<RealVec> dof_work(const Model& m, const Elements& el, const Points& pts, const RealVec& uc);
double dof_excess(const Model& m, const Elements& el, const Points& pts, const RealVec& uc,
                  const IntVec& rank);

// dof_divide : owned points and groups of points. True: the owners have changed since the pattern was formed.
//                                                                                          doc/theory.md 5.1
bool dof_divide(const Model& m, const Points& pts, const ActiveGrid& grid, Division& d, Dofs& s);

// dof_share_points : MeshPart::window: owner of each point, when their number has grown. Points of elements
// move between ranks element by element, to a rank that stores them. Collective.
void dof_share_points(const Model& m, const Elements& el, const RealVec& uc, Points& pts, Division& d);

// dof_share_grid : divided model: the points, corners and bonds for which the grid of this rank has lists
void dof_share_grid(const Model& m, const Points& pts, const Bonds& bonds, const ContactPairs& pairs,
                    const Division& d, GridShare& g);

// dof_lists : calls use(n, rows) for every element, point, bond, ghost and group of points that this rank
// owns, in that order
template <class Use>
void dof_lists(const Mesh& mesh, const Elements& el, const ActiveGrid& grid, const Dofs& s, Use use)
{
  IntVec row;
  for (const ElemBlock& b : el.block)
    for (int slot : b.live) {
      const int *node = elem_nodes(mesh, b, slot), nen = mesh.conn.count(b.elem[slot]);
      row.clear();
      for (int a = 0; a < nen; ++a) row.push_back(s.rows.row_of_node[node[a]]);
      use(static_cast<int>(row.size()), row.data());
    }
  const auto use_point = [&](int q) {
    row.clear();
    for (int k = grid.point.off[q]; k < grid.point.off[q + 1]; ++k)
      row.push_back(s.rows.nfe + grid.point.item[k]);
    use(static_cast<int>(row.size()), row.data());
  };
  const auto use_ghost = [&](int q) {
    row.clear();
    for (int k = grid.ghost.off[q]; k < grid.ghost.off[q + 1]; ++k)
      row.push_back(s.rows.nfe + grid.ghost.item[k]);
    use(static_cast<int>(row.size()), row.data());
  };
  for (int q : s.rows.owned_point) use_point(q);
  for (size_t k = 0; k < s.rows.bond_acts.size() && !s.pattern.lean; ++k)
    use(s.rows.bond.count(s.rows.bond_acts[k]), s.rows.bond.begin(s.rows.bond_acts[k]));
  for (int q = 0; q < grid.ghost.size(); ++q) use_ghost(q);
  for (int k : s.rows.owned_group) use(s.rows.group.count(k), s.rows.group.begin(k));
}

// dof_form : rows, lists, equations, and, if a list has changed, division, pattern and scatter maps; the mass
// of the earlier pattern is deleted then
//   writes st.division, the rows of mesh nodes in d.grid
void dof_form(const Model& m, const Step& step, State& st, Discretisation& d, Dofs& s);

// ---- equations between dofs (dof_tie.cpp), doc/theory.md (5.6) - (5.8)
// dof_tie : DofConstraints::tie of the step; true: it has changed
//   in   u   displacements at t(n)   [nnode*dim]
bool dof_tie(const Model& m, const Step& step, const RealVec& u, Dofs& s);

// ---- rigid bodies that turn by finite angles (dof_rigid.cpp), doc/theory.md (6.41)
// u [nnode*dim], all others [neq]
// rigid_ties : ties of their nodes, after all others
// rigid_arms : coefficients of these, as the nodes lie in u
// rigid_leap : increments of the nodes from those of the reference nodes, du
// rigid_centripetal : adds w x (w x r) to acc, with the w of v
// rigid_start : v [nnode*dim] becomes that of bodies
void rigid_ties(const Model& m, const Step& step, const DofRows& rows, Ties& t);
void rigid_arms(const Model& m, const RealVec& u, Ties& t);
void rigid_leap(const Model& m, const RealVec& u, const Dofs& s, RealVec& du);
void rigid_centripetal(const Model& m, const RealVec& u, const Dofs& s, const RealVec& v, RealVec& acc);
void rigid_start(const Model& m, const RealVec& u, RealVec& v);

// tie_extend : adds to each list with a dependent dof the rows of its masters
void tie_extend(const Dofs& s, ListTable& lists);

// tie_follow : x = T x, dependent dofs follow their masters; gap: x is an increment, which also removes the
// residual of the equation
void tie_follow(const Dofs& s, bool gap, RealVec& x);

// tie_force : f = T^T f, transfers forces on dependent dofs to their masters
void tie_force(const Dofs& s, RealVec& f);

// tie_matrix : A = T^T A T for the contribution of this rank; rows and columns of dependent dofs become zero
void tie_matrix(Dofs& s);

// Loads and supports are checked when they are evaluated, by all ranks alike. The routines below return
// BAD_VALUE if a value is not finite, with a note of keyword, line, function, node or face, and time.

// warn_once : warns of a line of the deck, once for each line and text, with node and time
void warn_once(Warned& warned, const Mesh& mesh, const char* keyword, const DeckLine& deck_line, int node,
               double time, const char* what);

// dof_constrain : fixed dofs, their increments between two times of the step and their rates; sets fixed,
// target, rate, rate0, grid_bc. BAD_VALUE
Failure dof_constrain(const Model& m, const Discretisation& d, const State& st, const Step& step,
                      double t_step0, double t_step1, Dofs& s, Warned& warned);

#endif
