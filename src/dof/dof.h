// ---------------------------------------------------------------------------
// dof.h : numbering, equations, constraints, division among ranks (doc/theory.md 5)
//
// Rows of the system: finite-element nodes in use, those far from bonds first, then the unknown grid nodes.
// Vectors of the system have rows*dim entries.
// ---------------------------------------------------------------------------
#ifndef MPFE_DOF_DOF_H
#define MPFE_DOF_DOF_H

#include <set>

#include "base/failure.h"
#include "bond/bond.h"
#include "contact/contact.h"
#include "contact/overlap.h"
#include "elem/elem.h"
#include "frac/frac.h"
#include "point/point.h"
#include "solve/solve.h"

// what a dof of the system is
enum DofKind { DOF_FREE, DOF_FIXED, DOF_TIED };      // TIED: an equation gives it

// Equations of the step: u[dof] = gap + sum of coef u[master], no master is tied itself  doc/theory.md (5.6)
struct Ties {
  IntVec dof;                  // [ntie]
  ListTable master;            // [ntie] dofs
  RealVec coef;                // [master.item]
  RealVec gap;                 // [ntie] what is left of the equation at t(n); rounding
};

// A support that goes on at a corner: its share in a prescribed dof of the grid
struct HeldPart {
  int dof;                     // of the system
  int node_dof;                // node*dim + direction
  double part;                 // of the reaction; adds up to 1 for each dof
};

struct Dofs {
  int dim = 0, nfe = 0, nrow = 0;
  bool numbered = false;       // rows of nodes are those of the elements and bonds of now
  IntVec row_of_node;          // [nnode] row of a node, -1: in no element
  IntVec node_of_row;          // [nfe]
  std::vector<long> row_key;   // [nrow] who a row is: node, or -1 - key of the grid node
  ListTable bond;              // [nbond] rows of both sides
  RealVec bond_w;              // [bond.item] N_a of side A, -N_v of side B
  SysMatrix A;
  RealVec M;                   // [blocks of A] mass, one number serves all directions; of this rank, as A
  // points follow nodes of the mesh: M couples these with each other and with the grid
  bool hung = false;
  RealVec M_elem;              // [blocks of A] then: M of the elements alone
  RealVec M_diag;              // [nrow] its diagonal, of all ranks
  IntVec my_point, my_bond, my_ghost;          // what this rank works on; elements: ElemBlock::mine
  std::vector<char> bond_is_mine;      // [nbond]
  IntVec owner;                // [nrow] rank that a row belongs to; one rank: empty
  IntVec elem_rank, point_rank;        // the division that the pattern was made for
  // block of A for each node pair, 2 k + 1: transposed; elements of this rank, block after block
  IntVec elem_map;
  IntVec point_map, bond_map, ghost_map;       // [my_point], [my_bond], [my_ghost]
  std::vector<size_t> point_map_off, bond_map_off, ghost_map_off;
  ListTable point_rows;        // the lists that the pattern was made for
  ListTable bond_rows, ghost_rows;
  long pattern = 0;            // number of the pattern
  long tangent = 0;            // number of the tangent in A
  Ties tie;
  std::vector<char> bare;      // [nfe] a node of an equation that belongs to no element
  IntVec fixed;                // [nrow*dim] DofKind
  RealVec target;              // [nrow*dim] prescribed increment of the step, 0 at free dofs
  RealVec rate0, rate;         // [nrow*dim] velocity of prescribed dofs at t(n) (grid only), t(n+1)
  IntVec grid_bc;              // [nrow*dim] index of the grid condition, -1
  std::vector<HeldPart> held;  // supports of nodes that have become corners of points
  double h_mean = 0.0;         // mean size of elements and cells at t = 0, for rounding floors
  int neq() const { return nrow * dim; }
};

// The tangent in Dofs::A and what it was made for
struct Frozen {
  bool on = false;             // nothing else can change it: no NLGEOM, contact or fracture
  long pattern = 0;
  double cM = 0.0;
  KernelMode mode;
  IntVec fixed;
  RealVec diag, whole;         // [neq] diagonal before prescribed dofs went, before equations were put in
  // iterations that found their tangent there; that took the one before, which is near
  long kept = 0, near = 0;
};

// Do supports hold everything? As it was when pattern and supports were these
struct Held {
  bool good = false;
  long pattern = -1;
  IntVec fixed;
};

// Everything a step works on
struct Problem {
  Problem(const Model& model, State& state) : m(model), st(state) {}
  const Model& m;
  State& st;
  Elements el;
  std::vector<MatLaw> point_law;
  ActiveGrid grid;
  ContactPairs pairs;
  OverlapWatch watch;          // parts that nothing keeps apart
  FracMesh fm;
  CornerShare share;           // corners that conversion has made
  IntVec follow;               // corners that go on for nodes without elements, see frac_follow
  std::set<std::string> told;  // warnings that are told once
  RealVec contact_s;           // [nbond*dim] relative displacement of contact bonds over the step
  // [nghost*dim] jump of the gradient of du at the faces, times the size of a cell
  RealVec ghost_s;
  Dofs dofs;
  bool ready = false;          // grid, rows, pattern and mass are those of t(n)
  bool opened = false;         // the first step has been prepared
  Solver solver;
  RealVec newton_gain;         // [iteration] residual after and before each iteration of the last increment
  Frozen frozen;
  Held held;
  // [nelem] strain energy of intact elements when the ledger was made, for the test of fracture
  RealVec energy;
};

// dof_divide : whose work is what, and the lists of this rank; fresh: rows or lists have changed. True:
// the division is not the one that the pattern was made for.                                                 
// doc/theory.md 5.1
bool dof_divide(Problem& p, bool fresh);

// dof_lists : calls use(n, rows) for every element, point, bond and ghost, in that order; all: also those
// of other ranks
template <class Use>
void dof_lists(const Problem& p, bool all, Use use)
{
  const Dofs& s = p.dofs;
  IntVec row;
  for (const ElemBlock& b : p.el.block)
    for (int slot : all ? b.live : elem_mine(b)) {
      const int e = b.elem[slot];
      row.clear();
      for (int k = p.m.mesh.conn.off[e]; k < p.m.mesh.conn.off[e + 1]; ++k)
        row.push_back(s.row_of_node[p.m.mesh.conn.item[k]]);
      use(static_cast<int>(row.size()), row.data());
    }
  const auto use_point = [&](int q) {
    row.clear();
    for (int k = p.grid.point.off[q]; k < p.grid.point.off[q + 1]; ++k)
      row.push_back(s.nfe + p.grid.point.item[k]);
    use(static_cast<int>(row.size()), row.data());
  };
  const auto use_ghost = [&](int q) {
    row.clear();
    for (int k = p.grid.ghost.off[q]; k < p.grid.ghost.off[q + 1]; ++k)
      row.push_back(s.nfe + p.grid.ghost.item[k]);
    use(static_cast<int>(row.size()), row.data());
  };
  if (all) {
    for (int q = 0; q < p.st.points.npoint; ++q) use_point(q);
    for (int b = 0; b < s.bond.size(); ++b) use(s.bond.count(b), s.bond.begin(b));
    for (int q = 0; q < p.grid.ghost.size(); ++q) use_ghost(q);
    return;
  }
  for (int q : s.my_point) use_point(q);
  for (int b : s.my_bond) use(s.bond.count(b), s.bond.begin(b));
  for (int q : s.my_ghost) use_ghost(q);
}

// dof_form : rows, lists, equations, and, when a list has changed, division, pattern and scatter maps; the
// mass of an earlier pattern is dropped then
void dof_form(Problem& p, const Step& s);

// ---- equations between dofs (dof_tie.cpp), doc/theory.md (5.6) - (5.8)
// dof_tie : Dofs::tie of the step; true: it is not the one of before
bool dof_tie(Problem& p, const Step& s);

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

// tell_once : a warning of a line of the deck, once for each line and text, that names a node and the time
void tell_once(Problem& p, const char* keyword, const Place& place, int node, double time, const char* what);

// dof_constrain : fixed dofs, their increments between two times of the step and their rates; sets fixed,
// target, rate, rate0, grid_bc. BAD_VALUE
Failure dof_constrain(Problem& p, const Step& s, double t_step0, double t_step1);

#endif
