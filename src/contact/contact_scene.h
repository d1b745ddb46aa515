// ---------------------------------------------------------------------------
// contact_scene.h : lists of neighbouring faces of general contact                (doc/theory.md 4.3)
// ---------------------------------------------------------------------------
#ifndef MPFE_CONTACT_CONTACT_SCENE_H
#define MPFE_CONTACT_CONTACT_SCENE_H

#include <cstdint>

#include "base/box_tree.h"
#include "contact/contact_meet.h"

using SideBits = std::uint64_t;

// Kept as long as the faces are the same
struct ContactScene {
  IntVec part_of_node;         // connected part of the mesh at t = 0, by node; depends on the model only
  std::vector<SkinFace> skin;  // Bonds::skin for which the rest is valid
  // [skin] grid field of points on the grid; -1: elements, corners that follow nodes, released points
  IntVec field;
  IntVec body;                 // [skin] connected part of the mesh; below 0: grid field, released point
  std::vector<char> alone;     // [skin] its point has only outer faces
  std::vector<SideBits> sides; // [skin] bits: sides of rules that include the face
  RealVec X, normal, size;     // [skin*3], [skin*3], [skin] centre, unit normal, longest edge at t = 0
  std::vector<FaceHeight> height;        // [skin] of its element or point
  IntVec node, corner;         // nodes and corners of the faces, ascending
  // near faces, found at the displacements u, uc; corners that conversion added: where they were then
  ListTable near;              // [skin]
  std::vector<BoundingBox> box;          // [skin] face there, enlarged by half of the search range
  RealVec u, uc;
  double margin = 0.0;         // near holds for motions below half of it             length
  double part = 0.0, travel = 0.0;     // present reach: fraction of the size of both faces, motion of points
  double max_travel = 0.0;     // travel for which near holds; contact depends on the present reach only
  long built = 0;              // number of times near has changed
};

// contact_largest_way : largest distance between positions a and b [n*dim]
double contact_largest_way(int dim, const RealVec& a, const RealVec& b);

// scene_update : rebuilds near when faces have moved too far, and renews lists of faces that have changed.
// Collective with a divided model.
//   in   travel  motion of a point in the increment; is_static: reach of a face size, not of a quarter of it
void scene_update(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& u, const RealVec& uc,
                  bool is_static, double travel, ContactScene& scene);

// scene_forget : points, and with them faces, may have other numbers: nothing of the faces is kept
void scene_forget(ContactScene& scene);

// scene_reach : distance by which two faces of any rank may approach in an increment without being missed.
// Collective with MeshPart::window.                                                                length
double scene_reach(const MeshPart& part, const ContactScene& scene);

// scene_property : the last property of the deck that fits two faces, null: none does
const ContactRule* scene_property(const BondDef& d, const ContactScene& scene, int a, int b);

#endif
