// ---------------------------------------------------------------------------
// contact_scene.h : which faces of general contact come near each other           (doc/theory.md 4.3)
// ---------------------------------------------------------------------------
#ifndef MPFE_CONTACT_CONTACT_SCENE_H
#define MPFE_CONTACT_CONTACT_SCENE_H

#include <cstdint>

#include "contact/contact_meet.h"

using SideBits = std::uint64_t;

// What stays as long as the faces are the same
struct ContactScene {
  IntVec part_of_node;         // connected part of the mesh at t = 0, by node; of the model alone
  std::vector<SkinFace> skin;  // Bonds::skin that the rest belongs to
  // [skin] grid field of points on the grid; -1: elements, corners that follow nodes, released points
  IntVec field;
  IntVec body;                 // [skin] connected part of the mesh; below 0: grid field, released point
  std::vector<char> alone;     // [skin] of a point all of whose faces are outer ones
  std::vector<SideBits> sides; // [skin] bits: sides of the rules of which it is one
  RealVec X, normal, size;     // [skin*3], [skin*3], [skin] centre, unit normal, longest edge at t = 0
  // near faces, found when the places were u, uc
  ListTable near;              // [skin]
  RealVec u, uc;
  double margin = 0.0;         // near holds for motions below half of it             length
  double part = 0.0, travel = 0.0;     // reach of now: part of the size of both faces, what places may move
  double most = 0.0;           // travel that near holds for; what is met depends on the reach of now alone
  long built = 0;              // how often near was made
};

// scene_update : the faces of near within reach; made anew when faces are others, or something has moved.
// Collective with a divided model.
//   in   travel  what a place may move in the increment; is_static: reach of a face, not of a quarter of it
void scene_update(const Model& m, const Points& pts, const Bonds& bonds, const RealVec& u, const RealVec& uc,
                  bool is_static, double travel, ContactScene& scene);

// scene_reach : what two faces of any rank may move towards each other unseen in an increment. Collective
// with MeshPart::window.                                                                           length
double scene_reach(const MeshPart& part, const ContactScene& scene);

// scene_property : the last property of the deck that fits two faces, null: none does
const ContactRule* scene_property(const BondDef& d, const ContactScene& scene, int a, int b);

#endif
