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

// gap of a contact point without a face, whose force and multipliers are zero, as stored in Level::slip
// (no test)
constexpr double CONTACT_OPEN = 1e300;

// surface_stiffness : largest mat_stiffness of the material at the faces of a surface on this rank
double surface_stiffness(const Model& m, const Surface& s);

// bond_side_stiffness : the same for the sides of a bond, or for the slave surface of a pair
double bond_side_stiffness(const Model& m, const BondDef& d);

// bond_form : bonds of all definitions at t = 0: at the nodes of the surface and between them, tributary
// areas, normals, penalties. A rank has the bonds at nodes or corners of its elements and points (bond_own),
// with their whole area. Returns the number of errors (messages in the log). Collective.
int bond_form(const Model& m, const Points& pts, Bonds& bonds);

// bond_own : [nodes, then corners] 1: belongs to an owned element, or to an owned point from the start
std::vector<char> bond_own(const Model& m, const Points& pts);

// A face of a finite element next to converted elements
struct BondFace {
  int def;                     // index into Model::bond
  Face face;
};

// bond_skin : points of general contact at the nodes of these faces and between them, on owned elements
// (MeshPart::window). Each of the two sides carries half: their area is half of the tributary area.
void bond_skin(const Model& m, const Points& pts, const std::vector<SkinFace>& skin, Bonds& bonds);

// bond_rebuild : rebuilds the bonds of interfaces created by conversion, the slave points of contact on
// converted elements, and the points of general contact; slips and multipliers of existing bonds are kept.
// Bonds of the deck that have lost a node (node_lost [nnode]) no longer tie. Returns the new slave points.
IntVec bond_rebuild(const Model& m, const Points& pts, const std::vector<BondFace>& face,
                    const IntVec& node_lost, const std::vector<SkinFace>& skin, Bonds& bonds, Level& l);

// bond_share : divided model: owner of each bond, and ranks with copies (Bonds::rank, halo, nall), after
// bonds or owners of nodes have changed. Collective.
void bond_share(const Model& m, const Points& pts, Bonds& bonds);

// bond_copy_contact : divided model: copies the state of the points of contact pairs from their owners, which
// alone search for them, to the other ranks. Before bonds or owners of nodes change. Collective.
void bond_copy_contact(const Model& m, Bonds& bonds, Level& l);

// bond_places : positions xb [nbond*dim] of side A, from displacements of nodes and corners
void bond_places(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& u, const RealVec& uc,
                 RealVec& xb);

// bond_stiffness : C of bond b [dim*dim] = ct I + (cn - ct) n n^T             (4.3)
void bond_stiffness(const Bonds& bonds, int dim, int b, double* C);

// bond_ground_motion : displacement of the ground under bond b at a time          [dim]
void bond_ground_motion(const Model& m, const Bonds& bonds, int b, double t_step, double t_total, double* g);

// bond_sums : sums over the bonds of one definition, of all ranks. Collective.
struct BondSums {
  double nodal = 0, between = 0;         // at nodes, between them
  double area    = 0;
  double penalty = 0;          // of the first bond with an area                       force/length^3
};
BondSums bond_sums(const Bonds& bonds, int def);

// bond_energy : 1/2 slip C slip + lambda slip over all bonds; largest and rms slip. Collective.
double bond_energy(const Bonds& bonds, int dim, const Level& l, double* slip_max, double* slip_rms);

#endif
