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

// what a dof of the system is
enum DofKind { DOF_FREE, DOF_FIXED, DOF_TIED };      // TIED: an equation gives it

// Equations of the step: u[dof] = gap + sum of coef u[master], no master is tied itself  doc/theory.md (5.6)
struct Ties {
  IntVec dof;                  // [ntie]
  ListTable master;            // [ntie] dofs
  RealVec coef;                // [master.item]
  RealVec gap;                 // [ntie] what is left of the equation at t(n); rounding
  bool any = false;            // on any rank
  // [Model::rigid] first ties of bodies that turn by finite angles; they come after all others
  IntVec rigid;
  IntVec list, row;            // equations of the step and rows of nodes that they were made for
};

// A support that goes on at a corner: its share in a prescribed dof of the grid
struct CornerSupport {
  int dof;                     // of the system; divided model: -1: the row is not here
  int node_dof;                // node*dim + direction, -1: the node is not here
  double part;                 // of the reaction; adds up to 1 for each dof
};

struct MassRows;

// ---- rows: what has unknowns, who owns it, which rows a bond, a point or a group of points is tied to
struct DofRows {
  int dim = 0, nfe = 0, nrow = 0;
  bool numbered = false;       // rows of nodes are those of the elements and bonds of now
  // divided model: the last of the nfe rows are of nodes that this rank has no element at; bonds of this rank
  // hold them, or corners of points follow them
  int nguest = 0;
  IntVec row_of_node;          // [nnode] row of a node, -1: in no element
  IntVec node_of_row;          // [nfe]
  std::vector<long> row_key;   // [nrow] who a row is: node, or -1 - key of the grid node
  ListTable group;             // [PointLaws::group] rows of all their points, ascending
  IntVec group_first;          // [PointLaws::group] their first points
  ListTable bond;              // [nbond] rows of both sides
  RealVec bond_w;              // [bond.item] N_a of side A, -N_v of side B
  IntVec bond_acts;            // bonds but for places of contact that meet no face
  bool hung = false;           // points follow nodes of the mesh: mass couples these with one another
  IntVec owned_point;          // points of this rank; of elements, bonds and ghosts it owns all that are here
  IntVec owned_group;          // groups of points (1.14) whose first point this rank owns
  IntVec owner;                // [nrow] rank that a row belongs to; one rank: empty
  Halo halo;                   // split: rows that other ranks have too
  // several ranks: rows are those of this rank, numbered by it, and vectors of the system hold these alone
  bool split = false;
  std::vector<char> once;      // split: [nrow*dim] the row belongs to this rank
  long all = 0;                // split: rows of all ranks, each once
  bool renumbered = false;     // since the last factorisation
  double h_mean = 0.0;         // mean size of elements and cells at t = 0, for rounding floors
  int neq() const { return nrow * dim; }
  int projected_from() const { return hung ? 0 : nfe; }       // the first row that the projection may change
  bool counts(size_t i) const { return !split || once[i]; }   // dof i counts here in a sum
  double neq_all() const { return static_cast<double>(split ? all : nrow) * dim; }    // of all ranks
};

// ---- constraints: supports, and equations between dofs
struct DofConstraints {
  Ties tie;
  std::vector<char> bare;      // [nfe] a node of an equation that belongs to no element of any rank
  IntVec fixed;                // [nrow*dim] DofKind
  RealVec target;              // [nrow*dim] prescribed increment of the step, 0 at free dofs
  RealVec rate0, rate;         // [nrow*dim] velocity of prescribed dofs at t(n) (grid only), t(n+1)
  IntVec grid_bc;              // [nrow*dim] index of the grid condition, -1
  IntVec constrained;          // dofs of which one of these is not that of a free dof
  bool free = false;           // the step prescribes nothing, on no rank
  std::vector<CornerSupport> corner_support;  // supports of nodes that have become corners of points
};

// ---- pattern: the matrix, where each contribution goes, the lists that it was made for
struct DofPattern {
  SysMatrix A;
  // block of A for each node pair, 2 k + 1: transposed; elements of this rank, block after block
  IntVec elem_map;
  // [owned_point], [bond_acts], [nghost]; points with the nodes of the one before share its places
  IntVec point_map, bond_map, ghost_map;
  IntVec group_map;            // [owned_group]
  std::vector<size_t> point_map_off, bond_map_off, ghost_map_off, group_map_off;
  ListTable point_rows;        // the lists that the pattern was made for
  ListTable bond_rows, ghost_rows, group_rows;
  IntVec point_rank;           // of the points, when the pattern was made
  long number = 0;             // of the pattern
  bool lean = false;           // one rank, explicit step: it has no bonds, which act by their forces alone
  long lists_of = -1;          // ActiveGrid::made that the lists of rows belong to
  long tangent = 0;            // number of the tangent in A
};

// ---- mass and damping, and the patterns and grids that they were made for
struct DofMass {
  RealVec M;                   // [blocks of A] mass, one number serves all directions; of this rank, as A
  RealVec M_elem;              // hung: [blocks of A] of the elements alone
  CornerMass corner_mass;      // of the points of this rank, looked at for ActiveGrid::made:
  long corner_mass_made = -1;
  RealVec M_diag;              // [nrow] its diagonal, of all ranks
  std::shared_ptr<const MassRows> mass_rows;         // rows of the projection, for the pattern mass_of
  RealVec lumped;              // explicit step: [nrow] sums of the rows of M, of all ranks; else empty
  // [blocks of A][dim*dim] damping matrix of this rank, as A; empty: there is no damping    (6.18), (6.19)
  RealVec C;
  RealVec C_diag;              // [nrow*dim] its diagonal, of all ranks
  bool damped = false;         // C is there, on any rank
  bool damping_lumped = false; // C is lumped: an explicit step
  long mass_of = 0, damping_of = 0;    // DofPattern::number that M and C were made for, and ActiveGrid::made
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

// Sums over the dofs of the whole system: those of several ranks count on one rank each, and all ranks
// must come here
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
// dof_own : x with zeros where the dof counts on another rank
inline RealVec dof_own(const Dofs& s, RealVec x)
{
  for (size_t i = 0; i < x.size() && s.rows.split; ++i) x[i] = s.rows.once[i] ? x[i] : 0.0;
  return x;
}
inline double dof_norm(const Dofs& s, const RealVec& a) { return __builtin_sqrt(dof_dot(s, a, a)); }
// dof_total : x of this rank, summed over the ranks of a divided model
inline double dof_total(const Dofs& s, double x)
{
  if (s.rows.split) comm_sum(&x, 1);
  return x;
}
// dof_largest, dof_all : the largest of all ranks; true on all
inline double dof_largest(const Dofs& s, double x) { return !s.rows.split ? x : comm_allreduce_max(x); }
inline bool dof_all(const Dofs& s, bool here)
{
  return !s.rows.split ? here : comm_allreduce_max(static_cast<int>(!here)) == 0;
}

// dof_all_free : no dof of any rank is prescribed or tied; false where this rank cannot know
inline bool dof_all_free(const Dofs& s)
{
  if (s.bound.free) return true;
  return !s.rows.split && s.bound.constrained.empty();
}

// Warnings that are given once, each with its key
using Warned = std::set<std::string>;

// What a division goes by, on rank 0
struct DivideBy {
  std::vector<RealVec> work;   // of the elements of the deck [kinds][nelem]; empty: that of intact ones
  IntVec rank;                 // [nelem] whose they are, and stay; empty: it is found
  // faces of all ranks, of general contact and of contact pairs; none of the one or the other: those of t = 0
  std::vector<NearFace> near;
};

// dof_ranks : how many ranks the model of rank 0 is worth; the others wait (comm_keep). Not collective.
int dof_ranks(const Model& m);

// dof_part : the model of rank 0 to all ranks: to each its piece. Collective.
void dof_part(const DivideBy& by, Model& m);

// largest work of a rank over the mean that is as good as even: work is estimated no better
constexpr double WORK_EVEN = 1.05;

// dof_work : of the elements of this rank, [2][nelem]: what rows and iterations go with, as if they were
// intact or by the pairs of nodes of the points that they have become; what broken ones cost above it, and
// points
// dof_excess : the largest work of a rank over the mean, each kind for itself; rank: who works on each
// point [npoint]. Collective.
//   in   uc   displacements of the corners [ncorner*dim]
std::vector<RealVec> dof_work(const Model& m, const Elements& el, const Points& pts, const RealVec& uc);
double dof_excess(const Model& m, const Elements& el, const Points& pts, const RealVec& uc,
                  const IntVec& rank);

// dof_divide : owned points and groups of points. True: the owners are not those that the pattern was made
// for.                                                                                     doc/theory.md 5.1
bool dof_divide(const Model& m, const Points& pts, const ActiveGrid& grid, Division& d, Dofs& s);

// dof_share_points : MeshPart::window: which rank works on each point, when there are more of them. Those
// that were elements go from rank to rank element by element, to one that knows them. Collective.
void dof_share_points(const Model& m, const Elements& el, const RealVec& uc, Points& pts, Division& d);

// dof_share_grid : divided model: the points, corners and bonds that the grid of this rank has lists for
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

// dof_form : rows, lists, equations, and, when a list has changed, division, pattern and scatter maps; the
// mass of an earlier pattern is dropped then
//   writes st.division, the rows of mesh nodes in d.grid
void dof_form(const Model& m, const Step& step, State& st, Discretisation& d, Dofs& s);

// ---- equations between dofs (dof_tie.cpp), doc/theory.md (5.6) - (5.8)
// dof_tie : DofConstraints::tie of the step; true: it is not the one of before
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

// tie_extend : what couples a dependent dof couples its masters
void tie_extend(const Dofs& s, ListTable& lists);

// tie_follow : x = T x, dependent dofs follow their masters; gap: an increment, which also closes what is
// left of the equation
void tie_follow(const Dofs& s, bool gap, RealVec& x);

// tie_force : f = T^T f, forces on dependent dofs go to their masters
void tie_force(const Dofs& s, RealVec& f);

// tie_matrix : A = T^T A T of what this rank has; rows and columns of dependent dofs are zero afterwards
void tie_matrix(Dofs& s);

// Loads and supports are checked where they are evaluated, by all ranks alike. The routines below return
// BAD_VALUE when one is no finite number, with a note that names keyword, line, function, node or face, and
// time.

// warn_once : a warning of a line of the deck, once for each line and text, that names a node and the time
void warn_once(Warned& warned, const Mesh& mesh, const char* keyword, const Place& place, int node,
               double time, const char* what);

// dof_constrain : fixed dofs, their increments between two times of the step and their rates; sets fixed,
// target, rate, rate0, grid_bc. BAD_VALUE
Failure dof_constrain(const Model& m, const Discretisation& d, const State& st, const Step& step,
                      double t_step0, double t_step1, Dofs& s, Warned& warned);

#endif
