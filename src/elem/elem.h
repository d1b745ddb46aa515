// ---------------------------------------------------------------------------
// elem.h : finite elements: reference data, force, tangent, mass, results
// ---------------------------------------------------------------------------
#ifndef MPFE_ELEM_ELEM_H
#define MPFE_ELEM_ELEM_H

#include "elem/bar_form.h"
#include "model/quantity.h"
#include "elem/kernel.h"
#include "mat/mat.h"
#include "mat/split.h"
#include "model/state.h"

// Elements of one type, material and thickness. Reference gradients are computed once for all elements that
// are equal up to a translation: elements of one kind
struct ElemBlock {
  int type;                    // index into elem_table
  Shape shape;
  MatLaw law;
  double density;
  double alpha = 0.0;          // *DAMPING: force alpha M v                             1/time
  double thickness;
  bool lumped = false;         // diagonal mass
  bool general = false;        // intact elements use elem_form_general, not the short form of the kernel
  bool bar = false;            // the Gauss points of an element share the change of volume (1.14)
  IntVec elem;                 // elements of the block
  IntVec conn;                 // [nelem][nen] nodes, if the order differs from the mesh; else empty
  IntVec live;                 // slots of the elements that still exist and that this rank owns, ascending
  IntVec kind;                 // [nelem]
  RealVec dNdX;                // [kind][ngp][nen][dim]                               1/length
  RealVec w;                   // [kind][ngp] weight x volume                         length^3
  RealVec eas;                 // enhanced types: [kind][eas_size] modes and their inverse stiffness
  RealVec me;                  // [kind][pairs] mass, node pairs a >= b
  RealVec node_offset;         // cohesive: [kind][width nodes][dim] relative to the first one  length
  RealVec scatter;             // cohesive: [nelem] factor of strength and toughness; empty: 1
  RealVec omega2;              // explicit: [kind] square of the frequency of an element at rest (6.30)
  RealVec mean;                // bulk viscosity: [kind][nen*dim + 3] gradient, volume, 2c/omega, L (6.35)
  // cohesive cracks
  bool opens() const { return law_opens(law.kind); }
  // enhanced strains with an initial stress (2.46)
  bool enhanced_start() const { return elem_table[type].enhanced && law.initial >= 0; }
  // uncracked elements use the short form
  bool short_form() const { return !general || (law.kind == LAW_COHESIVE && law.initial < 0); }
  // index of the first Gauss point
  size_t gauss(size_t slot) const { return static_cast<size_t>(kind[slot]) * shape_info[shape].ngp; }
};

struct Elements {
  std::vector<ElemBlock> block;
  // [Mesh::nelem] block, -1: no longer an element, or an outer one; slot in the block
  IntVec block_of, slot_of;
  IntVec initial_block;                 // [Mesh::nelem] block at t = 0
  IntVec gauss_of;             // [Mesh::nelem + 1] first Gauss point of an element in the list of all
  int history = 0;             // history variables of an integration point
  // [Mesh::nelem] divided model: 1: a halo element, owned by another rank; empty: none
  std::vector<char> outer;
  std::vector<char> rigid;     // [Mesh::nelem] 1: in a rigid body, without stress; empty: none
  // explicit, [Mesh::nelem] 1: converted, and its points move as the element did (6.47); empty: none
  std::vector<char> as_points;
  const Fracture* frac = nullptr;   // state of fracture; null: nothing can break
  int broken(int e) const { return frac ? frac->broken[e] : -1; }
  // does element e, or the points that it became, count on this rank?
  bool moves(int e) const
  {
    return block_of[e] >= 0 || (!as_points.empty() && as_points[e] && (outer.empty() || !outer[e]));
  }
};

// elem_setup : blocks and reference gradients of all elements that have a section.
// Returns BAD_JACOBIAN and the element in *worst when det(dX/dxi) <= 0 at a Gauss point.
Status elem_setup(const Model& m, Elements& el, int* worst);

// elem_scatter : factors of strength and toughness of cohesive elements, from the toughness of each   [nelem]
void elem_scatter(const Model& m, const RealVec& gc, Elements& el);

// elem_refresh : lists of the elements that still exist, after Fracture::phase has changed
void elem_refresh(Elements& el);

// elem_rigid : Elements::rigid of a step, for the bodies with finite rotations in it (6.41)
void elem_rigid(const Model& m, const Step& step, Elements& el);

// elem_volume, elem_size : volume at t = 0 of the element in the slot of its block; edge of the square or
// cube that the element is a part of
double elem_volume(const ElemBlock& b, size_t slot);
double elem_size(const ElemBlock& b, size_t slot);

// elem_law : law of the element in the slot of its block, intact, or broken with the degradation factor c
MatLaw elem_law(const Model& m, const Elements& el, const ElemBlock& b, size_t slot, double c);

// elem_history : history of the Gauss points of element e at both ends of the step             [ngp]
void elem_history(const Elements& el, const Level& l0, Level& l1, int e, HistoryStep* h);

// elem_cracked : has a cohesive crack begun to open at a Gauss point of element e?
inline bool elem_cracked(const Level& l, int e) { return !l.cracked.empty() && l.cracked[e]; }

// elem_main_crack : normal of the widest cohesive crack at the Gauss points of element e; null: none  [3]
const double* elem_main_crack(const Elements& el, const Level& l, int e);

// elem_whole : element e is intact, and no cohesive crack has begun to open in it
inline bool elem_whole(const Elements& el, const Level& l, int e)
{
  return el.broken(e) < 0 && !elem_cracked(l, e);
}

// elem_uncracked : no cohesive crack opens in element e in this step: it has no history at its end
void elem_uncracked(const Elements& el, const Level& l0, Level& l1, int e);

// elem_copy_history : he and cracked of level n, to a level of the same elements
void elem_copy_history(const Elements& el, const Level& n, Level& l);

// elem_keeps_none : has intact element e of the block no history? Then it has the short form
inline bool elem_keeps_none(const Elements& el, const ElemBlock& b, const Level& l, int e)
{
  return b.short_form() && elem_whole(el, l, e);
}

// elem_form_general : as elem_form without enhanced strains, for laws without a short form in the kernel
//   in   law       of the element, elem_law
//        h         history of each Gauss point           [ngp]; its np1 is written
Status elem_form_general(const ElemBlock& b, size_t slot, const MatLaw& law, const KernelMode& mode,
                         const double* u0, const double* u1, const HistoryStep* h, double* re,
                         double* ke);

// elem_form : residual and, unless ke is null, tangent of the element in the slot of its block
//   in   u0, u1    nodal displacements at t(n), t(n+1)   [nen*dim]
//   out  re        internal force                        [nen*dim]
//        ke        tangent, node pairs a >= b            [pairs][dim*dim]
//   BAD_JACOBIAN: det F(n+1) <= 0.  doc/theory.md (1.5), (1.6), enhanced types (1.10) - (1.13)
using ElemForm = Status (*)(const ElemBlock& b, size_t slot, const KernelMode& mode,
                            const double* u0, const double* u1, double* re, double* ke);
ElemForm elem_form(const ElemBlock& b);

// elem_form_one : elem_form of an element in its present state, intact or broken; form: elem_form(b)
Status elem_form_one(const Model& m, const Elements& el, const KernelMode& mode, const ElemBlock& b, int slot,
                     ElemForm form, const Level& l0, Level& l1, double* re, double* ke);

// elem_form_pack : elem_form of PACK elements at once, intact and not of an enhanced type; arrays as for
// elem_form, [...][PACK]
//   in   slot      of the elements                       [PACK]
//        u0        read if mode_reads_old; re or ke may be null
//   out  energy    strain energies at t(n+1)             [PACK]; null: not computed
//        opens     a bit for each element in which a crack may begin to open; or null
//   BAD_JACOBIAN: bad has a bit for each element with det F(n+1) <= 0
using ElemFormPack = Status (*)(const ElemBlock& b, const int* slot, const KernelMode& mode, const double* u0,
                                const double* u1, double* re, double* ke, unsigned& bad, double* energy,
                                unsigned* opens);
ElemFormPack elem_form_pack(const ElemBlock& b);   // null: the type has none
ElemForm eas_form(Shape s);

// eas_form_start : eas_form with the initial stresses S0 of the Gauss points [ngp][dim*dim]          (2.46)
using ElemFormStart = Status (*)(const ElemBlock& b, size_t slot, const KernelMode& mode, const double* u0,
                                 const double* u1, const double* S0, double* re, double* ke);
ElemFormStart eas_form_start(Shape s);

// elem_start : stress [6] without strain, and its energy per volume, from the history of an integration
// point (2.44)
double elem_start(const MatLaw& law, const double* h, double* S0);

// by_shape : use(z) with the sizes of a shape as constants: z.D dimensions, z.N nodes, z.NGP Gauss points
template <int DIM, int NODES, int POINTS>
struct ElemSize {
  static constexpr int D = DIM, N = NODES, NGP = POINTS;
};

template <int S = 0, class Use>
auto by_shape(Shape s, Use use)
{
  if constexpr (S + 1 < SHAPES) {
    if (s != S) return by_shape<S + 1>(s, use);
  }
  return use(ElemSize<shape_info[S].dim, shape_info[S].nen, shape_info[S].ngp>());
}

// elem_nodes : nodes of the element in the slot of its block
inline const int* elem_nodes(const Mesh& mesh, const ElemBlock& b, int slot)
{
  return b.conn.empty() ? mesh.conn.begin(b.elem[slot])
                        : &b.conn[static_cast<size_t>(slot) * shape_info[b.shape].nen];
}

// elem_ends : displacements of the nodes of an element at both ends of the step      [nen*dim]
inline void elem_ends(const Level& l0, const Level& l1, const int* node, int nen, int dim, double* u0,
                      double* u1)
{
  for (int a = 0; a < nen; ++a)
    for (int i = 0; i < dim; ++i) {
      u0[a * dim + i] = l0.u[node[a] * dim + i];
      u1[a * dim + i] = l1.u[node[a] * dim + i];
    }
}

// elem_ends_pack : the same for PACK elements; u [nnode*dim]                            [nen*dim][PACK]
inline void elem_ends_pack(const RealVec& u, const Mesh& mesh, const ElemBlock& b, const int* slot, int nen,
                           int dim, double* ul)
{
  const int* node[PACK];
  Pack* out = reinterpret_cast<Pack*>(ul);
  for (int l = 0; l < PACK; ++l) node[l] = elem_nodes(mesh, b, slot[l]);
  for (int a = 0; a < nen; ++a) {
    const double* of[PACK];
    for (int l = 0; l < PACK; ++l) of[l] = &u[static_cast<size_t>(node[l][a]) * dim];
    if (dim == 2) pack_gather_two(of, &out[a * 2]);
    else for (int i = 0; i < dim; ++i) out[a * dim + i] = pack_gather(of, i);
  }
}

// elem_gradients_pack : gradients [N*D] and weight of Gauss point g of PACK elements
template <int D, int N>
inline void elem_gradients_pack(const ElemBlock& b, const int* slot, int g, Pack* dNdX, Pack& w)
{
  const double *dN[PACK], *of[PACK];
  for (int l = 0; l < PACK; ++l) {
    const size_t at = b.gauss(slot[l]) + g;
    dN[l] = &b.dNdX[at * N * D];
    of[l] = &b.w[at];
  }
  pack_rows(dN, N * D, dNdX);
  w = pack_gather(of, 0);
}

// eas_size, eas_setup : enhanced modes of one element from nodal coordinates X [nen*dim] and weights w [ngp];
// [eas_size]
int eas_size(Shape s);
void eas_setup(Shape s, const double* X, const double* w, const MatLaw& law, double* out);

// eas_strain : enhanced part of the strain at Gauss point g, from the compatible strains E [ngp][dim*dim]
void eas_strain(Shape s, const double* eas, const double* w, const MatLaw& law, const double* E, int g,
                double* out);

// elem_gauss_position : coordinates X[3] at t = 0 and shape functions N [nen] of Gauss point g; returns
// weight x volume
double elem_gauss_position(const Model& m, const Elements& el, int e, int g, double* X, double* N);

// elem_mass : mass of an element, node pairs a >= b [pairs], the same in all directions. Consistent, or, if
// the block is lumped, row sums on the diagonal
const double* elem_mass(const ElemBlock& b, int slot);

// elem_mass_form : the same of an element of the block with nodes at X [nen*dim]; me [pairs]
void elem_mass_form(const ElemBlock& b, const double* X, double* me);

// elem_ip_fields : results at Gauss point g of element e, from displacements, history and degradation of l
void elem_ip_fields(const Model& m, const Elements& el, const Level& l, bool nlgeom,
                    int e, int g, IpFields& out);

// ip_fields_from : fills E, sigma, psi of out from out.F, intact St.Venant-Kirchhoff; for elements and points
void ip_fields_from(const MatLaw& law, int dim, bool nlgeom, IpFields& out);

// ip_general_from : E, sigma, psi of out from the strain E [6] and out.F; scale: Fbar = scale F; h: history
void ip_general_from(const MatLaw& law, bool nlgeom, const double* E, double scale, const double* h,
                     IpFields& out);

// ip_stress_from : the same from out.F and out.E
void ip_stress_from(const MatLaw& law, int dim, bool nlgeom, IpFields& out);

// elem_strains : strains at the Gauss points of an intact element e, with their enhanced part and, unless he
// is null, the initial strain of the history he                            [ngp][dim*dim]
void elem_strains(const Model& m, const Elements& el, int e, const RealVec& u, const RealVec* he, bool nlgeom,
                  double* E);

// elem_initial33 : plane strain: component 33 of the initial strain at Gauss point g of element e
double elem_initial33(const Elements& el, const RealVec& he, int e, int g);

// elem_forget_strain : what element e has as strain in level l becomes its strain without stress; its history
// is new
void elem_forget_strain(const Model& m, const Elements& el, int e, bool nlgeom, Level& l);

// elem_energy_one : strain energy of element e in the level; broken: with the degradation factor c
double elem_energy_one(const Model& m, const Elements& el, int e, const Level& l, double c, bool nlgeom);

// elem_stable : stable increment of central differences, by the elements of this rank in level l: 2/omega of
// the critical element, a lower bound for any mesh of these elements    doc/theory.md (6.30), (6.31)
//   out   worst    critical element, -1: no element; ElemBlock::omega2 and mean of new kinds
//   as_points: Elements::as_points take part
double elem_stable(const Model& m, Elements& el, const Level& l, bool nlgeom, int* worst);

// Bulk viscosity over an increment, KernelMode::bulk
struct BulkStep {
  double linear = 0.0, quadratic = 0.0;        // coefficients
  double dt = 0.0;             // length of the increment; 0: the pressures of t(n) act on
  double loss = 0.0;           // explicit: energy dissipated by elements so far
  double xi = 0.0;             // explicit: largest damping ratio so far
};

// bulk_length : length of the linear part in an explicit increment that lasts dt. Lumped masses disperse
// waves by (h/lambda)^2, central differences take (c dt/h)^2 of it back: short increments need more viscosity
//                                                                                  doc/theory.md (6.35)
//   in   size     L of the element;   way   c dt
inline double bulk_length(double size, double way)
{
  const double part = std::min(1.0, way / size);
  return size * std::max(1.0, 2.0 * std::sqrt(1.0 - part * part));
}

// bulk_stress : rho (b1 c length + b2^2 L^2 <-rate>) rate;  rate: change of volume over volume and time,
// c: speed of waves, size: L                                                     doc/theory.md (6.35), (6.36)
//   out  span     over 2 c/omega it is the damping ratio
template <class Real>
inline Real bulk_stress(const BulkStep& k, double density, double c, Real length, Real size, Real rate,
                        Real& span)
{
  const Real zero{}, squeezed = rate < zero ? -rate : zero;
  span = k.linear * length + k.quadratic * k.quadratic * size * size / c * squeezed;
  return density * c * span * rate;
}

// least det F by which the rate is divided: what is turned inside out is refused by its stress  (no test)
const double LEAST_J = 0.01;

// bulk_mid : bulk viscosity over an increment of the energy-momentum scheme, by the gradient at its middle
//                                                                                  doc/theory.md (6.49)
//   in   H0, H1   gradients of the displacement at t(n), t(n+1)   [D*D]
//        length, size   of bulk_stress
//   out  cof      of the gradient at the middle                   [D*D]
//        q        pressure;   slope  dq/d(change of volume)
//   returns       change of volume over volume at t = 0
template <int D>
inline double bulk_mid(const BulkStep& k, double density, double c, double length, double size, bool finite,
                       const double* H0, const double* H1, double* cof, double& q, double& slope)
{
  double H[D * D], change = 0.0, span;
  for (int i = 0; i < D * D; ++i) H[i] = finite ? 0.5 * (H0[i] + H1[i]) : 0.0;
  ip_cofactor<D>(H, cof);
  for (int i = 0; i < D * D; ++i) change += cof[i] * (H1[i] - H0[i]);
  const double scale = std::max(ip_det<D>(H), LEAST_J) * k.dt;
  q     = bulk_stress(k, density, c, length, size, change / scale, span);
  slope = density * c * (2.0 * span - k.linear * length) / scale;
  return change;
}

// g [n*D] = cof dN_a/dX;  n: number of nodes
template <int D>
inline void bulk_rows(const double* cof, const double* dNdX, int n, double* g)
{
  for (int a = 0; a < n; ++a)
    for (int i = 0; i < D; ++i) {
      g[a * D + i] = 0.0;
      for (int j = 0; j < D; ++j) g[a * D + i] += cof[i * D + j] * dNdX[a * D + j];
    }
}

// ke [pairs a >= b][D*D] += slope g g
template <int D>
inline void bulk_tangent(double slope, const double* g, int n, double* ke)
{
  for (int a = 0, pair = 0; a < n; ++a)
    for (int b = 0; b <= a; ++b, ++pair)
      for (int i = 0; i < D; ++i)
        for (int j = 0; j < D; ++j) ke[(pair * D + i) * D + j] += slope * g[a * D + i] * g[b * D + j];
}

// elem_bulk_pack : adds the force of the bulk viscosity of the first n of PACK intact elements to re; u0, u1,
// re as elem_form_pack                                                          doc/theory.md (6.35), (6.36)
//   in   q0    pressures at t(n)     [nelem]
//   out  q1    of t(n+1)             [nelem]
using ElemBulkPack = void (*)(const ElemBlock& b, const int* slot, int n, const double* u0, const double* u1,
                              bool finite, const RealVec& q0, RealVec& q1, BulkStep& k, double* re);
ElemBulkPack elem_bulk_pack(const ElemBlock& b);

// elem_bulk_mid : force and tangent of the bulk viscosity of the element in the slot over an increment of the
// energy-momentum scheme, unless the element is broken, rigid or open at t(n)        doc/theory.md (6.49)
//   in   l0, l1   levels at t(n), t(n+1)
//   out  re       force [nen*dim];   ke  unless null: tangent of node pairs a >= b [pairs][dim*dim]
//        loss     energy that it dissipates
//   false: none
bool elem_bulk_mid(const Mesh& mesh, const Elements& el, const ElemBlock& b, int slot, const Level& l0,
                   const Level& l1, bool finite, const BulkStep& k, double* re, double* ke, double& loss);

// elem_bulk_loss : sum of loss over the elements of this rank
double elem_bulk_loss(const Mesh& mesh, const Elements& el, const Level& l0, const Level& l1, bool finite,
                      const BulkStep& k);

// elem_dissipated : adds the energy that the elements of this rank have dissipated: by plastic flow, by
// cohesive cracks
void elem_dissipated(const Elements& el, const Level& l, double& plastic, double& cohesive);

// elem_viscous_loss : sum beta w dE : D : dE of the intact elements of this rank from l0 to l1; divided by
// the time between them: viscous dissipation                   doc/theory.md (2.20)
double elem_viscous_loss(const Model& m, const Elements& el, const Level& l0, const Level& l1, bool nlgeom);

// elem_energy : strain energy of the elements of this rank; each [nelem], unless null: per intact element, 0
// for broken ones
double elem_energy(const Model& m, const Elements& el, const Level& l, bool nlgeom, RealVec* each = nullptr);

#endif
