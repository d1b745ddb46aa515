// ---------------------------------------------------------------------------
// elem.h : finite elements: reference data, force, tangent, mass, results
// ---------------------------------------------------------------------------
#ifndef MPFE_ELEM_ELEM_H
#define MPFE_ELEM_ELEM_H

#include "mat/mat.h"
#include "model/state.h"

// What an integration point holds, for output and checks. Plane problems fill 33 as well.
// Order of the six: 11 22 33 12 23 31, tensor components.
struct IpFields {
  double X[3] = {0, 0, 0}, x[3] = {0, 0, 0};   // place at t = 0 and now
  double F[9] = {1, 0, 0, 0, 1, 0, 0, 0, 1};   // row by row
  double sig[6] = {0, 0, 0, 0, 0, 0};          // Cauchy stress
  double E[6]   = {0, 0, 0, 0, 0, 0};          // Green-Lagrange strain (linear strain without NLGEOM)
  double psi = 0.0;                            // strain energy / volume at t = 0
  double V0  = 0.0;                            // volume of the point at t = 0
};

// Elements of one type, material and thickness; reference gradients are computed once
struct ElemBlock {
  int type;                    // index into elem_table
  MatLaw law;
  double density;
  double thickness;
  IntVec elem;                 // elements of the block
  RealVec dNdX;                // [nelem][ngp][nen][dim]                              1/length
  RealVec w;                   // [nelem][ngp] weight x volume                        length^3
};

struct Elements {
  std::vector<ElemBlock> block;
  IntVec block_of, slot_of;    // [Mesh::nelem] block and place in it, -1: no longer an element
};

// elem_setup : blocks and reference gradients of all elements that have a section.
// Returns BAD_JACOBIAN and the element in *worst when det(dX/dxi) <= 0 at a Gauss point.
Status elem_setup(const Model& m, Elements& el, int* worst);

// elem_ip_fields : results at Gauss point g of element e; u [nnode*dim]
void elem_ip_fields(const Model& m, const Elements& el, const RealVec& u, bool nlgeom,
                    int e, int g, IpFields& out);

// elem_energy : strain energy of all elements
double elem_energy(const Model& m, const Elements& el, const RealVec& u, bool nlgeom);

#endif
