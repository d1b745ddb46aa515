// ---------------------------------------------------------------------------
// frac_scan.h : common routines of the fracture test: state, ball of an element, cracked elements around it,
// configurational force, crack tip  (7.1) - (7.8), (7.35)
// ---------------------------------------------------------------------------
#ifndef MPFE_FRAC_FRAC_SCAN_H
#define MPFE_FRAC_FRAC_SCAN_H

#include "frac/frac.h"
#include "frac/free_face.h"

// Data of one test; expensive quantities are computed on demand
struct Scan {
  const Model& m;
  const Step& step;
  const Elements& el;
  const FracMesh& fm;
  const Fracture& fr;
  const Level& l;
  double start;                // total time at which the step has begun; body forces are those at l.time
  // [nelem] of intact elements: strain energy / volume, or its average; 0 for others
  RealVec W;
  RealVec drive;               // [nelem] psi+ / volume, -1: not yet computed
  // sharp_release over |J| of elements ahead of a tip
  std::vector<std::pair<int, double>> sharp;
  // force of the intact elements on a node [nnode*dim], and whether it is computed [nnode]; on demand
  mutable RealVec node_force = {};
  mutable std::vector<char> node_known = {};
  mutable std::vector<char> given = {};      // [nnode*dim] forces or supports; empty: not yet searched
  std::vector<std::pair<int, double>> notch = {};      // as sharp, of elements ahead of a slit or notch
  mutable std::vector<char> fixed = {};      // [nnode*dim] supports; empty: not yet searched
  RealVec body = {};           // [nelem*3] body force by find_body                            force/volume
  bool dynamic() const { return step.proc == PROC_DYNAMIC; }
  bool averaged(int e) const { return dynamic() && !fr.mean.empty() && fr.mean[e] > 0.0; }
  const FractureDef& def(int e) const { return m.fracture[fm.def[e]]; }
  const MatLaw& law(int e) const { return el.block[el.initial_block[e]].law; }
  bool intact(int e) const
  {
    return fr.phase[e] == AS_ELEMENT && fr.broken[e] < 0 && el.initial_block[e] >= 0;
  }
  bool removed(int e) const { return fr.phase[e] == AS_NOTHING; }
  bool broken(int e) const { return fr.broken[e] >= 0; }
  bool grown(int e) const { return fr.broken[e] >= 0 && fr.time[e] > 0.0; }      // not of the start
  bool cracked(int e) const { return removed(e) || broken(e); }
};

// estimate_of, radius_of : estimate of G, radius of the ball
Estimate estimate_of(const Scan& s, int e);
double radius_of(const Scan& s, int e);

// relative to the radius: centres at it belong to the ball, independently of round-off and units  (no test)
const double AT_RADIUS = 1.0 + 1e-6;

// calls use(o, distance) for the elements with centres in the ball of e
template <class Use>
void in_ball(const Scan& s, int e, Use use)
{
  frac_in_ball(s.fm, &s.fm.centre[3 * e], radius_of(s, e) * AT_RADIUS, use);
}

// mean_strain : of an intact element                                                       [dim*dim]
void mean_strain(const Scan& s, int e, double* E);

// mean_initial : mean initial strain of an intact element                                  [dim*dim]
void mean_initial(const Scan& s, int e, double* E);

// stress_of_33 : what a mean initial strain E33 in plane strain adds to all normal stresses   force/length^2
double stress_of_33(const Scan& s, int e);

// largest_stress : largest principal stress of the mean strain                             force/length^2
double largest_stress(const Scan& s, int e);

// drive_of : psi+ / volume of an intact element by the law of its definition, in dynamics its average
// over time. drive_beside: of a neighbour o of e; if o cannot break, by the law of e
double drive_of(Scan& s, int e);
double drive_beside(Scan& s, int e, int o);

// is there an adjacent element at a face with is(o)?
template <class Is>
bool beside(const Scan& s, int e, Is is)
{
  for (int f = 0; f < 6; ++f)
    if (s.fm.across[6 * e + f] >= 0 && is(s.fm.across[6 * e + f])) return true;
  return false;
}

// touches_broken : does it share a node with a broken element?
bool touches_broken(const Scan& s, int e);

// crack_share : weight of a cracked element o in the ball of e; a removed element has no volume
double crack_share(const Scan& s, int e, int o);

// at_initial : at a removed element, or one that is broken from the start
bool at_initial(const Scan& s, int e);

// at_removed, at_crack : at a removed element; FORCE: adjacent at a face to a broken or removed element,
// BALL: shares a node with a broken element
bool at_removed(const Scan& s, int e);
bool at_crack(const Scan& s, int e);

// free_faces : free faces of the elements in the ball of this radius
void free_faces(const Scan& s, int e, double radius, std::vector<FreeFace>& out);

// at_notch : does the end of a notch lie in the ball?
bool at_notch(const Scan& s, int e, double radius);

// grown_along : unit vector to x from the centre of the cracked elements within radius of e; false: none, or
// nearer than least
bool grown_along(const Scan& s, int e, const double* x, double radius, double least, double* d);

// crack_plane : unit normal of the line or plane of the cracked elements around e, and a point in it; false:
// not flat
bool crack_plane(const Scan& s, int e, double* n, double* mid = nullptr);

// ball_q : q of (7.6) at the distance r
inline double ball_q(double r, double radius)
{
  return std::min(1.0, std::max(0.0, 2.0 * (1.0 - r / radius)));
}

inline double dot3(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// weight_of : q of a node in the ball around c
double weight_of(const Scan& s, int node, const double* c, double radius);

// force_at : force of the intact elements on a node [dim]: that of loads, supports, contact and broken
// elements
const double* force_at(const Scan& s, int node);

// tip_radius : radius within which the ball of e at a crack has one tip: less than radius where its crack is
// shorter, or another one is near
double tip_radius(const Scan& s, int e, double radius);

// take_loads : takes forces on the faces of cracks in the ball of this radius out of J               (7.5a)
void take_loads(const Scan& s, int e, double radius, double* J);

// find_body : body forces of all elements at the time of l. Collective.
void find_body(Scan& s);

// take_body : J -= int q H^T b dV of an intact element, with the weights q of its nodes             (7.5c)
void take_body(const Scan& s, int e, const double* q, double* J);

// body_at : body force on a node [3] from its intact elements, and from its broken ones; false: none
bool body_at(const Scan& s, int node, double* intact, double* broken);

// mark_prescribed : sets dofs [nnode*dim] that the step prescribes to 1
void mark_prescribed(const Scan& s, std::vector<char>& dofs);

// take_supported : takes the part normal to supported outer faces out of the force F [3] of an element at a
// node away from the crack; false: the node has no such face                                        (7.5d)
bool take_supported(const Scan& s, int node, double* F);

// lies_in : does x lie in element e at t = 0?
bool lies_in(const Mesh& mesh, int e, const double* x);

// element_at : element in which x lies at t = 0, -1: none; h: size of an element there
int element_at(const Scan& s, const double* x, double h);

// interface_node, interface_bends : index in FracMesh::between of a node of two materials off cracks and ends
// of notches, -1: none; does the interface bend there?
int interface_node(const Scan& s, int node);
bool interface_bends(const Scan& s, int k);

// take_interfaces : takes the force on interfaces in the ball of this radius around c out of J        (7.36)
void take_interfaces(const Scan& s, const double* c, double radius, double* J);

// force_estimate : |J| of the ball around an element, per thickness or per length of the front  (7.5), (7.6)
//   out   J   with its direction
double force_estimate(const Scan& s, int e, double radius, double* J);

// End of a crack or notch, centre of the faces at which a kink starts, direction so far (unit vector)
struct Tip {
  double end[3] = {0, 0, 0}, face[3], d[3] = {0, 0, 0};
  double n[3] = {0, 0, 0};     // in space: normal of the crack
  int elem = -1;               // ahead of the tip
  double ratio = 0.0;          // K_II/K_I
  double out = 0.0;            // in space: K_III/K_I/sqrt(1 - nu), which counts in G as K_II
  double along = 0.0;          // stress along the crack, T                             force/length^2
  bool given = true;           // of the start: nothing has broken there
  bool straight = true;        // equal direction in the ball and in half of it
};

// notch_end : the end of a notch near e without a crack yet; false: none
bool notch_end(const Scan& s, int e, Tip& t);

// crack_face : the centre of the faces between a crack and e, and the unit vector into e there [3]; false: no
// crack at e
bool crack_face(const Scan& s, int e, double* x, double* into);

// modes_ahead : ratio and along of the tip in front of e
void modes_ahead(const Scan& s, int e, Tip& t);

// crack_tip : the tip of the crack at e, with its modes; false: e is not ahead of it, or it is too short
bool crack_tip(const Scan& s, int e, Tip& t);

// space_tip : the same in space in front of a crack that is a plane there, by J of (7.5) at e: in the plane
// normal to its front
bool space_tip(const Scan& s, int e, const double* J, Tip& t);

// side_normal : unit normal of the sides of the crack at e where it is a single row in space; false: none
bool side_normal(const Scan& s, int e, double* n);

// slot_width : distance of the sides of the slot that ends at t                           length
double slot_width(const Scan& s, const Tip& t);

// along_line : intact elements on a line of this length from x, up to an unbreakable one; false: none
bool along_line(const Scan& s, int e, const double* x, const double* d, double length, IntVec& out);

// along_strip : intact elements that a strip of this length from x along d, with the normal n, cuts within a
// distance of x along the front, up to an unbreakable one; false: none
bool along_strip(const Scan& s, int e, const double* x, const double* d, const double* n, double length,
                 double aside, IntVec& out);

// element_ahead : element ahead, along J, of the foremost cracked element in the ball of e; -1: none
int element_ahead(const Scan& s, int e, const double* J);

// blocked : is the element ahead tougher, or unbreakable?
bool blocked(const Scan& s, int e, const double* J);

// near_interface : is a node between two materials within the distance of x? way: unless the interface runs
// along it
bool near_interface(const Scan& s, const double* x, double distance, const double* way = nullptr);

// sharp_release : energy per area released by a sharp crack that grows from the tip along d by one element
// size, in the plane perpendicular to its front, with the normal n of the crack; e: the element ahead; wide:
// width of the row, or rows, of elements behind it, 0: a slit. <= 0: unknown (7.38)
double sharp_release(const Scan& s, int e, const double* tip, const double* d, const double* n, double wide);

// ball_estimate : G by the mean energy in the ball; bound: an upper bound, from the whole energy      (7.3)
double ball_estimate(Scan& s, int e, bool bound = false);

// sharp_share : energy release of a sharp crack through the element ahead of a tip, over the estimate there;
// 1 away from interfaces
double sharp_share(Scan& s, int ahead);

// rest_share : the same for BALL in the plane, over G of the ball of e, for a tip at rest
double rest_share(Scan& s, int e);

// notch_share : the same for an element near the end of a slit or slot of the mesh without a crack yet
double notch_share(Scan& s, int e);

// end_share : at its flank, behind the end: the share of a kink of 90 degrees                          (7.37)
double end_share(const Scan& s, int e);

// behind_end_of : is o at the flank of a notch at whose end e lies?
bool behind_end_of(const Scan& s, int o, int e);

#endif
