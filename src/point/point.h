// ---------------------------------------------------------------------------
// point.h : material points: fill, active grid, force, results (doc/theory.md 3)
// ---------------------------------------------------------------------------
#ifndef MPFE_POINT_POINT_H
#define MPFE_POINT_POINT_H

#include <cstdint>
#include <map>

#include "elem/elem.h"
#include "model/state.h"
#include "point/corner_names.h"

const long key_own  = 1L << 60;  // + number of a corner that has unknowns of its own (Points::corner_number)
const long key_node = 1L << 61;  // + n: node n of the mesh, which corners follow

struct GridLists {
  ListTable list;
  RealVec w;                   // [list.item]
};

struct GridCount {
  int nodes = 0, cells = 0;    // unknown nodes; active cells
  int weak  = 0;               // touched nodes that follow others (extended basis)
};

struct MeshItem { int at, node; };     // item at of a list is a node of the mesh

// The part of the grid that exists in this step, and what corners, points and bonds see of it
struct ActiveGrid {
  int nnode = 0;               // unknown grid nodes
  int ncell = 0;               // cells that hold a corner or the centre of a point
  GridCount of_all;            // of all ranks
  // weak nodes without a good cell near: unknowns, or those with next to no support follow strong ones
  int nlone = 0;
  bool meets = false;          // points that share no corner near a node of the grid have it in common
  long lists = 0;              // number of the lists below: the same one, the same lists
  long made  = 0;              // number of the weights below: the same one, the same weights
  // [nnode] field * (nodes of the grid) + node number, ascending; key_own + number of a corner
  std::vector<long> key;
  std::vector<long> cell;      // [ncell] field * (cells of the grid) + cell number, ascending
  // lists of grid nodes; those of corners and points also hold nodes n of the mesh as -1 - n, and once the
  // rows are known as (row of n) - (number of rows of nodes), which is negative too
  ListTable corner;            // [ncorner] unknown grid nodes that a corner follows
  std::vector<MeshItem> corner_mesh, point_mesh;     // items of corner and point that are nodes of the mesh
  RealVec corner_w;            // [corner.item] weights, sum 1
  ListTable point;             // [npoint] unknown grid nodes of a point
  // corner after corner of each point, and node after node of the corner: place of the node in the list of
  // the point
  IntVec slot;
  RealVec dS;                  // [point.item*dim + PACK] dS_pv/dX, zeros behind it   1/length
  ListTable bond;              // [nbond] unknown grid nodes of side B, empty for the ground
  RealVec bond_w;
  ListTable ghost;             // [nghost] unknown grid nodes that a place on a face between cells ties
  // [ghost.item] jump of the gradient normal to the face, times the size of a cell
  RealVec ghost_w;
  RealVec ghost_k, ghost_m;    // [nghost] force/length, mass: of that jump
};

// grid_nodes, grid_cells : how many the whole grid has
long grid_nodes(const Grid& g, int dim);
long grid_cells(const Grid& g, int dim);

// grid_unknown_place : position of an unknown of g: of the grid node, or of the corner at t(n) that has
// unknowns of its own and is not of a released point (1e300 then), which conditions on planes of the grid
// prescribe like a node; uc [ncorner*dim]
void grid_unknown_place(const Model& m, const Points& pts, const RealVec& uc, const ActiveGrid& g, int node,
                        double x[3]);

// grid_corner : the corner that has the unknown with this key for its own, -1: it is one of the grid
inline int grid_corner(const Points& pts, long key)
{
  return key < key_own ? -1 : pts.corner_here(static_cast<int>(key - key_own));
}

// grid_node_place, grid_cell_place : position of a node (1e300: corner of a released point), lower corner of
// a cell, from a key
void grid_node_place(const Grid& g, int dim, long key, double x[3]);
void grid_cell_place(const Grid& g, int dim, long key, double x[3]);

// point_fill : material points of all bodies (block, element set, region), their boundary and surfaces.
// Messages go to the log; returns the number of errors.
int point_fill(const Model& m, Points& pts);

// point_fill_whole : all of them, on a rank that has the whole model; mistakes of the deck are not told
void point_fill_whole(const Model& m, Points& pts);

// point_fill_cells : cells with points, and elements that are points from the start
long point_fill_cells(const Model& m);

// point_fill_ranks : which rank has the points of each cell: those of a box in Body::rank, of elements that
// are points from the start in of_elem [nelem], which holds the ranks of the finite elements. Not collective:
// rank 0 asks with the whole model
void point_fill_ranks(IntVec& of_elem, Model& m);

// point_fill_homes : who works on points from the start; behind point_fill_ranks, on rank 0 with the whole
// model
//   in   of_elem  [nelem] rank of an element
//        number   of points among those of all ranks, ascending
IntVec point_fill_homes(const Model& m, const IntVec& of_elem, const IntVec& number);

struct CornerShare {
  CornerNames corner;          // the first one of each name
  std::map<CornerKey, int> own;   // corners of the last element that it shares with no other
  IntVec made;                 // corners that the last element made,
  ListTable node;              // the nodes they hang on
  RealVec weight;              // and their weights, sum 1
};

// point_convert : the lattice of element e becomes points of a body, added to pts with parent e. Corners at
// nodes that neighbours have made already are shared; those between nodes, which no bond held to the element,
// are not (7.9)
//   in   before   points of all ranks that there were before: releases until then count
void point_convert(const Model& m, int body, int e, int before, CornerShare& share, Points& pts);

// point_ranks : MeshPart::window: ranks of the elements that points were, which know all around them [npoint]
IntVec point_ranks(const MeshPart& part, const Points& pts);

// point_number : MeshPart::window: numbers among those of all ranks for the points and corners of elements
// that have become points, and which corners other ranks have too (PointPart). Collective.
//   in   elem, turn   those that are here, and their place among those of all ranks
//        made         [elem] corners that each has made
void point_number(const Model& m, const IntVec& elem, const IntVec& turn, const ListTable& made, Points& pts);

// point_number_released : the same for the corners that points have got for their own, the last ones here;
// Points::apart as the ranks of the corners have it. Collective.
//   in   which, turn   torn points that are here, and their place among those of all ranks
//        fresh         of which, those that have got corners
void point_number_released(const Model& m, const IntVec& which, const IntVec& turn, const IntVec& fresh,
                           Points& pts);

// point_find_common : the last of this, for numbers that are known: corners belong to ranks that work on a
// point with them (rank [npoint]). Collective.
void point_find_common(const MeshPart& mesh, const IntVec& rank, Points& pts);

// point_volume : volume of point p at t = 0, of its mass; V0 of a squeezed one is less
inline double point_volume(const Model& m, const Points& pts, int p)
{
  const double density = m.material[m.body[pts.body[p]].material].density;
  return pts.released[p] && density > 0.0 ? pts.mass[p] / density : pts.V0[p];
}

// point_sample : G and V0 of the points of element e belong to the Gauss places of the element (at_gauss;
// quadrilaterals and bricks), or are the means over their domains                                            
// doc/theory.md (7.19), (3.2) - (3.4)
void point_sample(const Model& m, int e, bool at_gauss, Points& pts);

// point_release : points get corners of their own, copies of those they shared; of the elements that they
// were, neighbours that convert later share no corner any more (Points::apart).
//   inout left   [which] corners that they had, added to
void point_release(const IntVec& which, int dim, Points& pts, ListTable& left);

// point_any_released : is one of the points that converted element e became released?
bool point_any_released(const Points& pts, int e);

// point_surfaces : boundary of all bodies, and the faces of surfaces on them. Returns the number of errors.
int point_surfaces(const Model& m, Points& pts);

// Several ranks of a divided model: what this one has lists of the grid for
struct GridShare {
  bool on = false;             // false: all is here
  std::vector<char> point;     // [npoint] it works on the point
  std::vector<char> corner;    // [ncorner] of these points, and those that its bonds reach
  std::vector<char> bond;      // [nbond] it works on the bond
  IntVec owner;                // [ncorner] rank of the first point that has it, -1: no point has it here
  bool has_point(int p) const { return !on || point[p]; }
  bool has_corner(int c) const { return !on || corner[c]; }
  bool has_bond(int b) const { return !on || bond[b]; }
};

// grid_activate : cells and nodes that corners, displaced by uc [ncorner*dim], and bonds at xb [nbond*dim]
// touch, weights of corners, points and bonds, extended basis. doc/theory.md (3.8) - (3.12)
// Corners, points and bonds that are not of share have empty lists.
// OUTSIDE_GRID: *worst is the corner (>= 0) or -1 - bond. Collective where the model is divided; when
// another rank fails, the grid is empty.
Status grid_activate(const Model& m, const Points& pts, const Bonds& bonds, const GridShare& share,
                     const RealVec& uc, const RealVec& xb, ActiveGrid& g, int* worst);

// grid_covers : the grid has lists for all that is of share, and for nothing else, as one that is made anew
bool grid_covers(const Points& pts, const Bonds& bonds, const GridShare& share, const ActiveGrid& g);

// grid_stays : no corner that the grid carries and no bond to it has gone further than Grid::keep from where
// the active grid was made, so that it moves with them; meets: bodies have nodes of it in common    (3.18)
bool grid_stays(const Model& m, const Points& pts, const Bonds& bonds, const GridLaid& laid, bool meets,
                const RealVec& uc, const RealVec& xb);

// Laws of the points, and which of them share their change of volume                    (1.14)
struct PointLaws {
  std::vector<MatLaw> body;    // [Model::body]
  int history = 0;             // numbers that a point keeps
  ListTable group;             // intact points of one initial cell or element; empty: no law asks for it
  IntVec group_of;             // [npoint] -1: none; empty: no groups
  bool in_group(int p) const { return !group_of.empty() && group_of[p] >= 0; }
};

// point_laws : law of each body. point_groups : the groups of the points as they are
PointLaws point_laws(const Model& m);
void point_groups(const Points& pts, PointLaws& law);

// point_stable : the largest stable increment of central differences that the points in owned allow in level
// l; a consistent mass of the grid bounds it by that of each domain on its corners  doc/theory.md (6.34)
//   out   worst    the point, -1: none
double point_stable(const Points& pts, int dim, const PointLaws& laws, const Level& l, const IntVec& owned,
                    int* worst);

// point_corner_force : internal force of the points in owned on their corners, from displacements and
// degradation at t(n), t(n+1); groups: of PointLaws, those that this rank works on
//   out l1.hp, fc [ncorner*dim] added to;  BAD_JACOBIAN: *worst is the point
Status point_corner_force(const Model& m, const Points& pts, const PointLaws& law, const KernelMode& mode,
                          const Level& l0, Level& l1, const IntVec& owned, const IntVec& groups, RealVec& fc,
                          int* worst);

// point_tangent : ke += tangent of point p for its grid nodes, pairs a >= b [pairs][dim*dim]; work: scratch
void point_tangent(const Model& m, const Points& pts, const PointLaws& law, const KernelMode& mode,
                   const Level& l0, Level& l1, const ActiveGrid& g, int p, RealVec& work, double* ke);

// point_group_tangent : tangent of the points of group k
//   in   n, row    rows of the nodes of all of them, ascending, counted from first       [n]
//   out  ke        pairs a >= b [pairs][dim*dim]
void point_group_tangent(const Model& m, const Points& pts, const PointLaws& law, const KernelMode& mode,
                         const Level& l0, Level& l1, const ActiveGrid& g, int k, int n, const int* row,
                         int first, double* ke);

// point_tangent_pack : the same for PACK intact points of one body, with as many grid nodes, POINT_PACK_NODES
// at most; ke [pairs][dim*dim][PACK], aligned as Pack
const int POINT_PACK_NODES = 12;
void point_tangent_pack(int dim, const Points& pts, const PointLaws& law, const KernelMode& mode,
                        const RealVec& uc0, const RealVec& uc1, const ActiveGrid& g, const int* point,
                        double* ke);

// point_add_mass : adds the mass of the domains from the first-th on at their corners, sum_d m_cd;
// mass [ncorner]
void point_add_mass(const Points& pts, int first, RealVec& mass);

// point_domain : places of the n corners of a domain, from the first one, to as many digits as all places
// there have: domains that are equal but for their place have the same bits, whatever rounding there was
//   out  X [n*dim]
void point_domain(const Points& pts, int dim, const int* corner, int n, double* X);

// point_place : centre of point p at t = 0, sum_c w_c X_c
void point_place(const Points& pts, int dim, int p, double X[3]);

// point_corner_in_element : shape functions of element e at the place of corner c at t = 0; false when it is
// not found
bool point_corner_in_element(const Model& m, const Points& pts, int e, int c, double* N);

// Mass of corners with each other, summed over domains: what is left of the diagonal, row by row
struct CornerMass {
  IntVec off{0}, col;          // [ncorner] corners before it
  RealVec val, diag;
  std::uint64_t made_of = 0;   // check sum of the domains that it was made from
};

// point_corner_mass : of the domains of list, unless it is that of these already
void point_corner_mass(const Points& pts, const IntVec& list, CornerMass& m);

// point_corner_momentum : q_c = sum_d m_cd v_d                                               [ncorner*dim]
RealVec point_corner_momentum(const CornerMass& m, int dim, const RealVec& vc);

// point_velocities : v_p = sum_c w_c v_c                                                     [npoint*dim]
RealVec point_velocities(const Points& pts, int dim, const RealVec& vc);

// point_history_size : numbers that each point keeps in the level
inline size_t point_history_size(const Points& pts, const Level& l)
{
  return pts.npoint ? l.hp.size() / pts.npoint : 0;
}

// broken_law : of point p, which is broken, when its stress has gone
MatLaw broken_law(const Model& m, const Points& pts, int p);

// point_material : of the body of point p
inline const Material& point_material(const Model& m, const Points& pts, int p)
{
  return m.material[m.body[pts.body[p]].material];
}

// point_counts : divided model: does point p, which several ranks know, count on this one in a sum?
inline bool point_counts(const Model& m, const Points& pts, int p)
{
  if (!m.part.on) return true;
  if (pts.parent[p] >= 0) return m.part.works(pts.parent[p]);
  return pts.part.rank[p] == comm_rank();
}

// point_skin_counts : the same of a face of general contact
inline bool point_skin_counts(const Model& m, const Points& pts, const SkinFace& f)
{
  return f.points ? point_counts(m, pts, f.elem) : m.part.works(f.elem);
}

// point_ip_fields : results of a point; of l displacements of corners and degradation are read
void point_ip_fields(const Model& m, const Points& pts, const Level& l, int p, IpFields& out);

// point_tell_corners : x [ncorner*dim] of corners as the rank has it that they belong to, on all that have
// them. Collective
void point_tell_corners(const Points& pts, int dim, const std::vector<RealVec*>& x);

// point_energy : strain energy of the points in owned
double point_energy(const Model& m, const Points& pts, const Level& l, const IntVec& owned);

// point_viscous_loss : elem_viscous_loss of the points in owned; law [body]
double point_viscous_loss(const Points& pts, int dim, const PointLaws& law, const Level& l0, const Level& l1,
                          const IntVec& owned);

// point_energy_one : strain energy of the broken point p with displacements of l; c: degradation factor
double point_energy_one(const Model& m, const Points& pts, const Level& l, int p, double c);

// point_tell_history : MeshPart::window: l.hp, n numbers a point, as the rank has it that works on the point
// (rank [npoint]), to all that have the element that it was. Collective
void point_tell_history(const MeshPart& part, const IntVec& rank, const Points& pts, int n, Level& l);

// point_dissipated : as elem_dissipated, in the points in mine
void point_dissipated(const Model& m, const Points& pts, const Level& l, const IntVec& mine, double& plastic,
                      double& cohesive);

#endif
