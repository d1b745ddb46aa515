// ---------------------------------------------------------------------------
// assem.h : all loops over elements, points and bonds (doc/theory.md 5)
//
// Rows and vectors of the system: dof/dof.h
// ---------------------------------------------------------------------------
#ifndef MPFE_ASSEM_ASSEM_H
#define MPFE_ASSEM_ASSEM_H

#include "dof/dof.h"

// Quantities of an increment du that are not part of a level of the state
struct Jumps {
  RealVec contact;             // [nbond*dim] relative displacement of contact bonds over the step
  // [nghost*dim] jump of the gradient of du at the ghost faces, times the size of a cell
  RealVec ghost;
  RealVec corner;              // [ncorner*dim] work space of assem_internal
};

// assem_move : displacements at t(n+1) from the increment du: writes st.np1.u, uc, slip and the jumps.
//   BAD_VALUE several ranks: of owned items
Failure assem_move(const Model& m, const Discretisation& d, const Dofs& dofs, const RealVec& du,
                   double t_step0, double t_step1, State& st, Jumps& j);

// assem_share_bonds : several ranks: jumps, slips and multipliers at t(n+1) of each bond from its owner to
// the other ranks that have it. Collective.
void assem_share_bonds(State& st, int dim, Jumps& j);

// assem_internal : fint [neq] of elements, points and bonds for the two levels of the state;
// writes gap, friction and multiplier of contact into st.np1
//   inout with   null, or another vector [neq] that is summed over the ranks in the same message
//   out   energy  strain energy of intact elements of this rank at t(n+1) [nelem]; null: not needed
//   BAD_JACOBIAN: with the element or point
Failure assem_internal(const Model& m, const Discretisation& d, const Dofs& dofs, const KernelMode& mode,
                       Jumps& j, State& st, RealVec& fint, RealVec* with = nullptr,
                       RealVec* energy = nullptr);

// Time at which loads are evaluated, in the step and in the run; follower loads act on the configuration
// between t(n), s = 0, and t(n+1), s = 1
struct LoadTime {
  double step, total, s;
};

// assem_loads : fext [neq] of a step at a time. BAD_VALUE
Failure assem_loads(const Model& m, const Discretisation& d, const Dofs& dofs, const State& st,
                    const Step& step, const LoadTime& at, Warned& warned, RealVec& fext);
bool assem_has_followers(const Step& step);

// TANGENT_KEPT: all, and the part of intact elements is stored; TANGENT_LOCAL: with that part as stored
enum TangentPart { TANGENT_ALL, TANGENT_KEPT, TANGENT_LOCAL };

// assem_tangent : A = K + cM M + cC C (all dofs, including fixed ones);
// rewrites the history of laws at t(n+1)
void assem_tangent(TangentPart part, const Model& m, const Discretisation& d, const KernelMode& mode,
                   double cM, double cC, const Jumps& j, State& st, Dofs& s);

// Slipping contact: the remainder of the symmetric tangent, sum of B_k B_l across n^T over bonds      (4.12)
struct SlipTangent {
  IntVec bond;                 // bonds of this rank that slip
  RealVec across;              // [bond.size()*dim]
  bool any = false;            // on any rank
};

// assem_slip : finds these bonds;   slip_multiply : y = product with x [neq], at the free dofs; x is summed
// over the ranks, and 0 or dependent at tied dofs
void assem_slip(const Model& m, const ContactPairs& pairs, const KernelMode& mode, const Jumps& j,
                const State& st, const Dofs& s, SlipTangent& slip);
void slip_multiply(const SlipTangent& slip, const ContactPairs& pairs, const Dofs& s, RealVec x, RealVec& y);

// assem_constrain : f -= A(:, fixed) x(fixed), then removes rows and columns of fixed dofs except for the
// diagonal, and sets f(fixed) = 0: the solution is zero at fixed dofs, and x is added afterwards;
// diagonal [neq] of A
void assem_constrain(Dofs& s, const RealVec& diagonal, const RealVec& x, RealVec& f);

// assem_mass : DofMass::M, unless it is valid for the present pattern and no points move     (3.12), (3.16)
void assem_mass(const Points& pts, const Discretisation& d, Dofs& s);

// mass_diagonals : DofMass::M_here, M_diag and coupled of M. Collective.
void mass_diagonals(Dofs& s);

// mass_damping : M [blocks of A] of this rank with alpha times the density of each material
void mass_damping(const Model& m, const Points& pts, const Discretisation& d, const Dofs& s, RealVec& M);

// assem_damping : DofMass::C of *DAMPING, ALPHA= and *VISCOUS BOUNDARY, unless it is valid for the present
// pattern and no points move; lumped: row sums, a block for each node           doc/theory.md (6.18), (6.19)
void assem_damping(const Model& m, const Points& pts, const Discretisation& d, bool lumped, Dofs& s);

// assem_lumped : DofMass::lumped of an explicit step, after assem_mass. Collective.
void assem_lumped(Dofs& s);

// damping_multiply : y = C x; damping_work : x . C x; both summed over the ranks
void damping_multiply(const Dofs& s, const RealVec& x, RealVec& y);
double damping_work(const Dofs& s, const RealVec& x);

// mass_multiply : y = M x; mass_part : with the contribution of this rank to M,
// mass_elements : of the elements
void mass_elements(const Dofs& s, const RealVec& x, RealVec& y);
void mass_part(const Dofs& s, const RealVec& x, RealVec& y);
void mass_multiply(const Dofs& s, const RealVec& x, RealVec& y);

enum MassRowsOf { ROWS_ALL, ROWS_GRID, ROWS_NEAR };  // rows: all; of the grid; also nodes near points

// mass_solve : M x = f on the free dofs of these rows (not ROWS_NEAR); x at fixed dofs is given, in rows
// below guess it is the initial guess, elsewhere it is not used. Collective.
// Conjugate gradients with symmetric Gauss-Seidel, all directions at once. Returns the iterations; -1: not
// converged.  doc/theory.md (3.14)
int mass_solve(const Dofs& s, MassRowsOf of, int guess, const RealVec& f, RealVec& x);

// mass_project : the same for the velocity v of the grid from its momentum; if points follow nodes, also for
// the nodes whose velocity changes. begun [nrow] 1: v is the initial guess in this row
// of the grid too; empty: in none
int mass_project(const Dofs& s, const std::vector<char>& begun, const RealVec& momentum, RealVec& v);

// mass_solve_tied : (M + half C) x = f in the nodes of elements with equations: T^T (M + half C) T x = T^T f
// on the free dofs, x at fixed dofs is given; C lumped. Returns as mass_solve.                       (6.29)
int mass_solve_tied(const Dofs& s, double half, const RealVec& f, RealVec& x);

// point_momentum : adds p_v = sum_cd N_v(x_c) m_cd v_d of the points of this rank to out [neq]
void point_momentum(const ActiveGrid& grid, const Dofs& s, const RealVec& vc, RealVec& out);

// assem_scatter_corners : transfers forces on corners fc [ncorner*dim] to the grid,
// with the weights of corners
void assem_scatter_corners(const ActiveGrid& grid, const Dofs& dofs, const RealVec& fc, RealVec& f);

// assem_gather_corners : after_c = before_c + sum_v N_v(x_c) x_v, x [neq] of the system, before and after
// [ncorner*dim]
void assem_gather_corners(const ActiveGrid& grid, const Dofs& dofs, const RealVec& x, const RealVec& before,
                          RealVec& after);

// assem_ghost_jump : jump of the gradient of x [neq] normal to the ghost faces, times the size of a cell
//   [nghost*dim]                                                              doc/theory.md (3.16)
void assem_ghost_jump(const ActiveGrid& grid, const Dofs& dofs, const RealVec& x, RealVec& jump);

#endif
