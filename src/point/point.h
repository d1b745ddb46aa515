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

const long key_own  = 1L << 60;  // + number of a corner with unknowns of its own (Points::corner_number)
const long key_node = 1L << 61;  // + n: node n of the mesh, which corners follow

struct GridLists {
  ListTable list;
  RealVec w;                   // [list.item]
};

struct GridCount {
  int nodes = 0, cells = 0;    // unknown nodes; active cells
  int weak  = 0;               // touched nodes that are interpolated from others (extended basis)
};

struct MeshItem { int at, node; };     // item at of a list is a node of the mesh

// The active part of the grid in this increment, and the lists of its nodes for corners, points and bonds
struct ActiveGrid {
  int nnode = 0;               // unknown grid nodes
  int ncell = 0;               // cells that hold a corner or the centre of a point
  GridCount of_all;            // of all ranks
  // weak nodes without a good cell within reach: unknowns, or, with next to no support, means of strong nodes
  int nlone = 0;
  bool meets = false;          // points that are not connected near a node of the grid share it
  long lists = 0;              // version of the lists below
  long made  = 0;              // version of the weights below
  // [nnode] field * (nodes of the grid) + node number, ascending; key_own + number of a corner
  std::vector<long> key;
  std::vector<long> cell;      // [ncell] field * (cells of the grid) + cell number, ascending
  // lists of grid nodes; lists of corners and points also contain mesh nodes n as -1 - n, and once the rows
  // are known as (row of n) - (number of rows of nodes), which is negative too
  ListTable corner;            // [ncorner] unknown grid nodes that a corner follows
  std::vector<MeshItem> corner_mesh, point_mesh;     // items of corner and point that are nodes of the mesh
  RealVec corner_w;            // [corner.item] weights, sum 1
  ListTable point;             // [npoint] unknown grid nodes of a point
  // for each corner of each point, and each node of the corner: index of the node in the list of the point
  IntVec slot;
  RealVec dS;                  // [point.item*dim + PACK] dS_pv/dX, padded with zeros 1/length
  ListTable bond;              // [nbond] unknown grid nodes of side B, empty for the ground
  RealVec bond_w;
  ListTable ghost;             // [nghost] unknown grid nodes coupled by an integration point on a cell face
  // [ghost.item] jump of the gradient normal to the face, times the size of a cell
  RealVec ghost_w;
  RealVec ghost_k, ghost_m;    // [nghost] force/length, mass: of that jump
};

// grid_nodes, grid_cells : number of nodes and cells of the whole grid
long grid_nodes(const Grid& g, int dim);
long grid_cells(const Grid& g, int dim);

// grid_unknown_position : position of an unknown of g: of the grid node, or at t(n) of the corner with
// unknowns of its own, which conditions on grid planes prescribe like a node (corner of a released point:
// 1e300); uc [ncorner*dim]
void grid_unknown_position(const Model& m, const Points& pts, const RealVec& uc, const ActiveGrid& g,
                           int node, double x[3]);

// grid_corner : the corner whose own unknown has this key, -1: it is an unknown of the grid
inline int grid_corner(const Points& pts, long key)
{
  return key < key_own ? -1 : pts.corner_here(static_cast<int>(key - key_own));
}

// grid_node_position, grid_cell_position : position of a node (1e300: corner of a released point), lower
// corner of a cell, from a key
void grid_node_position(const Grid& g, int dim, long key, double x[3]);
void grid_cell_position(const Grid& g, int dim, long key, double x[3]);

// point_fill : material points of all bodies (block, element set, region), their boundary and surfaces.
// Messages go to the log; returns the number of errors.
int point_fill(const Model& m, Points& pts);

// point_fill_whole : all points, on a rank with the whole model; errors of the deck are not reported
void point_fill_whole(const Model& m, Points& pts);

// point_fill_cells : cells with points, and elements that are points from the start
long point_fill_cells(const Model& m);

// point_fill_ranks : the owner of the points of each cell: for a box in Body::rank, for elements that are
// points from the start in of_elem [nelem], which holds the ranks of the finite elements. Not collective:
// rank 0 calls it with the whole model
void point_fill_ranks(IntVec& of_elem, Model& m);

// point_fill_homes : owners of points from the start; after point_fill_ranks, on rank 0 with the whole model
//   in   of_elem  [nelem] rank of an element
//        number   numbers of points among the points of all ranks, ascending
IntVec point_fill_homes(const Model& m, const IntVec& of_elem, const IntVec& number);

struct CornerShare {
  CornerNames corner;          // the first corner of each name
  std::map<CornerKey, int> own;   // corners of the last element that it shares with no other
  IntVec made;                 // corners that the last element created,
  ListTable node;              // [made] the nodes that they interpolate
  RealVec weight;              // and their weights, sum 1
};

// point_convert : adds a lattice of points of a body to pts in element e, their parent. Corners at nodes are
// shared with converted neighbours; corners between nodes, which no bond tied to the element, are not (7.9)
//   in   before   points of all ranks before this conversion: releases until then count
void point_convert(const Model& m, int body, int e, int before, CornerShare& share, Points& pts);

// point_ranks : MeshPart::window: owners of the points [npoint]: the owners of their parent elements
IntVec point_ranks(const MeshPart& part, const Points& pts);

// point_number : MeshPart::window: numbers of all ranks for the points and corners of converted elements, and
// the corners shared with other ranks (PointPart). Collective.
//   in   elem, turn   converted elements of this rank, and their positions in the order of all ranks
//        made         [elem] corners that each has created
void point_number(const Model& m, const IntVec& elem, const IntVec& turn, const ListTable& made, Points& pts);

// point_number_released : the same for the corners that released points have got, the last ones of this rank;
// Points::unshared_since is copied from the owners of the corners. Collective.
//   in   which, turn   released points of this rank, and their positions in the order of all ranks
//        fresh         subset of which: points that have got corners
void point_number_released(const Model& m, const IntVec& which, const IntVec& turn, const IntVec& fresh,
                           Points& pts);

// point_find_common : the corners shared with other ranks and their owners, from given numbers: a corner
// belongs to a rank that owns a point with it (rank [npoint]). Collective.
void point_find_common(const MeshPart& mesh, const IntVec& rank, Points& pts);

// point_volume : volume of point p at t = 0, from its mass; V0 of a compressed released point is less
inline double point_volume(const Model& m, const Points& pts, int p)
{
  const double density = m.material[m.body[pts.body[p]].material].density;
  return pts.released[p] && density > 0.0 ? pts.mass[p] / density : pts.V0[p];
}

// point_sample : takes G and V0 of the points of element e from the Gauss points of the element (at_gauss;
// quadrilaterals and bricks), or as means over their domains.  doc/theory.md (7.19), (3.2) - (3.4)
void point_sample(const Model& m, int e, bool at_gauss, Points& pts);

// point_release : gives points corners of their own, copies of the shared ones; neighbours that convert later
// no longer share corners with their parent elements (Points::unshared_since).
//   inout left   [which] their former corners, added to
void point_release(const IntVec& which, int dim, Points& pts, ListTable& left);

// point_stretched : points of bodies with RESHAPE whose largest stretch, or the inverse of the smallest,
// exceeds it. point_reshape : gives their domains the shape of t = 0 about their centres; elastic strain,
// linear and angular momentum are kept. doc/theory.md (3.20)
IntVec point_stretched(const Model& m, const Points& pts, const RealVec& uc);
void point_reshape(const Model& m, const IntVec& which, Points& pts, Level& l);

// point_any_released : is a point of the converted element e released?
bool point_any_released(const Points& pts, int e);

// point_surfaces : boundary of all bodies, and the faces of surfaces on them. Returns the number of errors.
int point_surfaces(const Model& m, Points& pts);

// Divided model: the points, corners and bonds for which this rank has lists of the grid
struct GridShare {
  bool on = false;             // false: not divided
  std::vector<char> point;     // [npoint] owned
  std::vector<char> corner;    // [ncorner] of owned points, and those that owned bonds reach
  std::vector<char> bond;      // [nbond] owned
  IntVec owner;                // [ncorner] rank of the first point with the corner, -1: no point here has it
  bool has_point(int p) const { return !on || point[p]; }
  bool has_corner(int c) const { return !on || corner[c]; }
  bool has_bond(int b) const { return !on || bond[b]; }
};

// grid_activate : cells and nodes touched by corners, displaced by uc [ncorner*dim], and bonds at xb
// [nbond*dim]; weights of corners, points and bonds; extended basis. doc/theory.md (3.8) - (3.12)
// Corners, points and bonds outside share have empty lists.
// OUTSIDE_GRID: *worst is the corner (>= 0) or -1 - bond. Collective where the model is divided; when
// another rank fails, the grid is empty.
Status grid_activate(const Model& m, const Points& pts, const Bonds& bonds, const GridShare& share,
                     const RealVec& uc, const RealVec& xb, ActiveGrid& g, int* worst);

// grid_covers : does the grid have lists exactly for the items of share, as after grid_activate?
bool grid_covers(const Points& pts, const Bonds& bonds, const GridShare& share, const ActiveGrid& g);

// grid_stays : no corner carried by the grid and no bond to it has moved further than Grid::keep since the
// grid was made: the grid can move with them; meets: bodies share nodes of the grid                 (3.18)
bool grid_stays(const Model& m, const Points& pts, const Bonds& bonds, const GridLaid& laid, bool meets,
                const RealVec& uc, const RealVec& xb);

// Laws of the points, and groups of points that share their change of volume            (1.14)
struct PointLaws {
  std::vector<MatLaw> body;    // [Model::body]
  int history = 0;             // history variables of a point
  int viscous = -1;            // cohesive bodies: of them, the pressure of the bulk viscosity (6.35)
  ListTable group;             // intact points of one initial cell or element; empty: no law needs groups
  IntVec group_of;             // [npoint] -1: none; empty: no groups
  // cohesive bodies: [npoint] width of the band of a crack at t(n), 0: not known; empty: no cracks   (2.36b)
  RealVec band;
  bool in_group(int p) const { return !group_of.empty() && group_of[p] >= 0; }
};

// point_laws : law of each body. point_groups : the groups of the points in their present state
PointLaws point_laws(const Model& m);
void point_groups(const Points& pts, PointLaws& law);

// point_stable : the largest stable increment of central differences that the points in owned allow in level
// l; a consistent mass of the grid bounds it by that of each domain on its corners  doc/theory.md (6.34)
//   out   worst    the point, -1: none
double point_stable(const Points& pts, int dim, const PointLaws& laws, const Level& l, const IntVec& owned,
                    int* worst);

// point_corner_force : internal force of the points in owned on their corners, from displacements and
// degradation at t(n), t(n+1); groups: owned ones of PointLaws
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

// point_tangent_pack : the same for PACK intact points of one body with the same number of grid nodes, up to
// POINT_PACK_NODES; ke [pairs][dim*dim][PACK], aligned as Pack
const int POINT_PACK_NODES = 12;
void point_tangent_pack(int dim, const Points& pts, const PointLaws& law, const KernelMode& mode,
                        const RealVec& uc0, const RealVec& uc1, const ActiveGrid& g, const int* point,
                        double* ke);

// point_add_mass : adds the mass of the domains first, first + 1, ... at their corners, sum_d m_cd;
// mass [ncorner]
void point_add_mass(const Points& pts, int first, RealVec& mass);

// point_domain : coordinates of the n corners of a domain relative to the first one, rounded to the digits of
// the absolute coordinates: domains that differ by a translation only then have identical bits
//   out  X [n*dim]
void point_domain(const Points& pts, int dim, const int* corner, int n, double* X);

// point_centre : centre of point p at t = 0, sum_c w_c X_c
void point_centre(const Points& pts, int dim, int p, double X[3]);

// point_corner_in_element : shape functions of element e at corner c at t = 0; false:
// the local coordinates are not found
bool point_corner_in_element(const Model& m, const Points& pts, int e, int c, double* N);

// Consistent mass matrix of the corners, summed over domains: diagonal, and lower triangle row by row
struct CornerMass {
  IntVec off{0}, col;          // [ncorner] lower triangle
  RealVec val, diag;
  // lumps, [ncorner]: diag before; with the mass of corners that follow this one, 0 where it follows others.
  // diag is then that of corners with a motion of their own: neither at nodes nor between them    (6.47)
  RealVec own, carried;
  std::uint64_t made_of = 0;   // checksum of its domains
};

// point_corner_mass : mass matrix of the domains of list; kept if it already belongs to them. lumps: the mass
// of corners between nodes acts at the corners that they follow, and that of corners at nodes at the node
void point_corner_mass(const Points& pts, const IntVec& list, bool lumps, CornerMass& m);

// point_as_elements : [nelem] 1: a converted element all of whose corners follow those at its nodes, so that
// its points move as the element did; 0: elements, and all other converted ones
//   out   all   no converted element is of another kind
std::vector<char> point_as_elements(const Points& pts, int nelem, bool& all);

// point_corner_momentum : q_c = sum_d m_cd v_d                                               [ncorner*dim]
RealVec point_corner_momentum(const CornerMass& m, int dim, const RealVec& vc);

// point_velocities : v_p = sum_c w_c v_c                                                     [npoint*dim]
RealVec point_velocities(const Points& pts, int dim, const RealVec& vc);

// point_history_size : history variables of each point in the level
inline size_t point_history_size(const Points& pts, const Level& l)
{
  return pts.npoint ? l.hp.size() / pts.npoint : 0;
}

// point_crack_law : changes the law of a body with CRITERION_COHESIVE to the cohesive one
void point_crack_law(const Model& m, const Body& body, MatLaw& law);

// point_bands : PointLaws::band from the cracks at t(n) = l, in the cells of the grid; laid: displacements of
// the corners when it was reset [ncorner*dim]. Returns the number of points, of all ranks, that have come
// into cells whose crack is open. Collective                                                        (2.36b)
int point_bands(const Model& m, const Points& pts, const Level& l, const RealVec& laid, PointLaws& law);

// point_crack : the data of the cohesive crack of point p, at t(n) = l, in the law of its body      (2.36a)
void point_crack(const Model& m, const Points& pts, const Level& l, int p, CrackTangent tangent, MatLaw& law);

// point_scatter : WEIBULL: draws the factor of strength and toughness of each initial cell of cracking bodies
//   out  hp   history of the points at t = 0
void point_scatter(const Model& m, const Points& pts, RealVec& hp);

// point_opening : largest opening of the cohesive crack of a point of the deck, relative to that at which
// its traction is zero; 0: it has none. point_open : is there no traction left?
double point_opening(const Model& m, const Points& pts, const Level& l, size_t n, int p);
// point_crack_width : width of its band                                                          length
double point_crack_width(const Model& m, const Points& pts, const Level& l, int p);
inline bool point_open(const Model& m, const Points& pts, const Level& l, int p)
{
  return point_opening(m, pts, l, point_history_size(pts, l), p) >= 1.0;
}

// broken_law : of point p, which is broken, when its stress has gone
MatLaw broken_law(const Model& m, const Points& pts, int p);

// point_material : of the body of point p
inline const Material& point_material(const Model& m, const Points& pts, int p)
{
  return m.material[m.body[pts.body[p]].material];
}

// point_counts : divided model: does this rank own point p and add it to sums?
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

// point_ip_fields : results of a point, from the corner displacements and the degradation of l
void point_ip_fields(const Model& m, const Points& pts, const Level& l, int p, IpFields& out);

// point_copy_corners : copies x [ncorner*dim] from the owners of the corners to all ranks
// that have them. Collective
void point_copy_corners(const Points& pts, int dim, const std::vector<RealVec*>& x);

// point_energy : strain energy of the points in owned
double point_energy(const Model& m, const Points& pts, const Level& l, const IntVec& owned);

// point_bulk_loss : elem_bulk_loss of the points in owned
double point_bulk_loss(const Model& m, const Points& pts, const PointLaws& law, const KernelMode& mode,
                       const Level& l0, Level& l1, const IntVec& owned);

// point_viscous_loss : elem_viscous_loss of the points in owned; law [body]
double point_viscous_loss(const Points& pts, int dim, const PointLaws& law, const Level& l0, const Level& l1,
                          const IntVec& owned);

// point_energy_one : strain energy of the broken point p with displacements of l; c: degradation factor
double point_energy_one(const Model& m, const Points& pts, const Level& l, int p, double c);

// point_copy_history : MeshPart::window: copies l.hp, n numbers a point, from the owner of the point (rank
// [npoint]) to all ranks that store its parent element. Collective
void point_copy_history(const MeshPart& part, const IntVec& rank, const Points& pts, int n, Level& l);

// point_dissipated : as elem_dissipated, in the points in owned
void point_dissipated(const Model& m, const Points& pts, const Level& l, const IntVec& owned, double& plastic,
                      double& cohesive);

#endif
