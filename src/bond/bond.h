// ---------------------------------------------------------------------------
// bond.h : bonds between finite elements, material points and the ground (doc/theory.md 4)
// ---------------------------------------------------------------------------
#ifndef MPFE_BOND_BOND_H
#define MPFE_BOND_BOND_H

#include "model/state.h"

// Default penalty per area is bond_alpha M/h, M (mat_stiffness) of the stiffer side and h the smallest edge
// of a grid cell (without points: the longest edge of the face). Measured: doc/verification.md, sweep S2.
// Contact: contact_alpha M/h.
extern const double bond_alpha, contact_alpha;

// surface_stiffness : largest mat_stiffness behind a surface, of the faces that are here
double surface_stiffness(const Model& m, const Surface& s);

// bond_side_stiffness : the same of the sides of a bond, or of the slave surface of a pair
double bond_side_stiffness(const Model& m, const BondDef& d);

// bond_form : bonds of all definitions at t = 0: at the nodes of the surface and between them, tributary
// areas, normals, penalties. A rank has those at nodes or corners of its elements and points (bond_own), with
// their whole area. Returns the number of errors (messages in the log). Collective.
int bond_form(const Model& m, const Points& pts, Bonds& bonds);

// bond_own : [nodes, then corners] 1: elements that this rank works on have it, or points from the start
std::vector<char> bond_own(const Model& m, const Points& pts);

// A face of a finite element that looks at elements that have become points
struct BondFace {
  int def;                     // index into Model::bond
  Face face;
};

// bond_skin : places of general contact at the nodes of these faces and between them, of elements that this
// rank works on (MeshPart::window). Each side carries half: their area is half of what belongs to them.
void bond_skin(const Model& m, const Points& pts, const std::vector<SkinFace>& skin, Bonds& bonds);

// bond_rebuild : bonds of the interfaces that conversion has made, slave points of contact on points that
// were elements, and those of general contact, from scratch; slips and multipliers of bonds that were there
// before are kept. Bonds of the deck that have lost a node (node_lost [nnode]) tie nothing any more. Returns
// the slave points that were not there before.
IntVec bond_rebuild(const Model& m, const Points& pts, const std::vector<BondFace>& face,
                    const IntVec& node_lost, const std::vector<SkinFace>& skin, Bonds& bonds, Level& l);

// bond_share : divided model: who works on a bond, and who else has it (Bonds::rank, halo, nall), when
// bonds or owners of nodes are others than before. Collective.
void bond_share(const Model& m, const Points& pts, Bonds& bonds);

// bond_tell : divided model: of contact pairs, whose points are searched for by the rank that works on them
// alone: the others get their state. Before bonds or owners of nodes become others. Collective.
void bond_tell(const Model& m, Bonds& bonds, Level& l);

// bond_places : where side A is, from displacements of nodes and corners                          xb
// [nbond*dim]
void bond_places(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& u, const RealVec& uc,
                 RealVec& xb);

// bond_stiffness : C of bond b [dim*dim] = ct I + (cn - ct) n n^T             (4.3)
void bond_stiffness(const Bonds& bonds, int dim, int b, double* C);

// bond_ground_motion : displacement of the ground under bond b at a time          [dim]
void bond_ground_motion(const Model& m, const Bonds& bonds, int b, double t_step, double t_total, double* g);

// bond_sums : of the bonds of one definition, of all ranks. Collective.
struct BondSums {
  double nodal = 0, between = 0;         // at nodes, between them
  double area    = 0;
  double penalty = 0;          // of the first one with an area                        force/length^3
};
BondSums bond_sums(const Bonds& bonds, int def);

// bond_energy : 1/2 slip C slip + lambda slip over all bonds; largest and rms slip. Collective.
double bond_energy(const Bonds& bonds, int dim, const Level& l, double* slip_max, double* slip_rms);

#endif
