// ---------------------------------------------------------------------------
// kw_mesh.h : what *BLOCK and *CYLINDER have in common: a structured part with its sides
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_KW_MESH_H
#define MPFE_DECK_KW_MESH_H

#include <map>

#include "deck/card.h"

const int max_sides = 6;

struct Part {
  int type = -1;               // index into elem_table
  std::string name;
  std::vector<std::string> side_name;      // "XMIN", ...; a part makes NAME_XMIN
  IntVec node;                 // the nodes of the part in its own order
  IntVec side;                 // [node] bit s: the node lies on side s
  IntVec elem;
  std::vector<Face> face[max_sides];
  // quadratic types: the position between two nodes of the part, and the nodes that are there already
  std::function<void(int a, int b, double x[3])> between;
  std::map<std::pair<int, int>, int> middle;
  int node_label = 0, elem_label = 0;      // the last ones
  double tol = 0.0;            // MERGE: nodes nearer than this are one; 0: off
  std::unordered_multimap<std::size_t, int> near;   // nodes of before, by cells a little larger than tol
};

// part_open : TYPE, ELSET, MERGE; false when one of them is wrong
bool part_open(Card& card, Model& model, const std::vector<std::string>& sides, Part& p);

// part_room : will the labels do. A part has so many nodes and cells; size: its diagonal, for MERGE.
bool part_room(Card& card, Model& model, double nodes, double cells, double size, Part& p);

// part_node : the next node, at x; side: bits. False when x is not finite (not told).
bool part_node(Card& card, Model& model, const double x[3], int side, Part& p);

// part_cell : a quadrilateral [4] or brick [8] of nodes of the part, cut as the type needs it. Faces join
// their sides. False when a node in the middle of an edge has no finite coordinates (not told).
bool part_cell(Card& card, Model& model, const int* corner, Part& p);

// part_close : sets and surfaces
void part_close(Card& card, Model& model, Part& p);

#endif
