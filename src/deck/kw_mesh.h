// ---------------------------------------------------------------------------
// kw_mesh.h : structured meshes with named sides, for *BLOCK and *CYLINDER
// ---------------------------------------------------------------------------
#ifndef MPFE_DECK_KW_MESH_H
#define MPFE_DECK_KW_MESH_H

#include <map>

#include "deck/card.h"

const int max_sides = 6;

struct Part {
  int type = -1;               // index into elem_table
  std::string name;
  std::vector<std::string> side_name;      // "XMIN", ...; the set is NAME_XMIN
  IntVec node;                 // nodes of the part, in the order of the part
  IntVec side;                 // [node] bit s: on side s
  IntVec elem;
  std::vector<Face> face[max_sides];
  // quadratic types: position midway between two nodes of the part; existing midside nodes
  std::function<void(int a, int b, double x[3])> between;
  std::map<std::pair<int, int>, int> middle;
  int node_label = 0, elem_label = 0;      // last labels given
  double tol = 0.0;            // MERGE: nodes closer than this are merged; 0: off
  std::unordered_multimap<std::size_t, int> close_nodes;  // earlier nodes by cell of size 4 tol
};

// part_open : reads TYPE and ELSET; false: error
bool part_open(Card& card, Model& model, const std::vector<std::string>& sides, Part& p);

// part_room : checks that the labels of so many nodes and cells fit; reads MERGE. size: diagonal of the part
bool part_room(Card& card, Model& model, double nodes, double cells, double size, Part& p);

// part_node : adds a node at x; side: bits. False: x is not finite (not reported).
bool part_node(Card& card, Model& model, const double x[3], int side, Part& p);

// part_cell : cuts a quadrilateral [4] or brick [8] of nodes of the part into elements and adds their faces
// to the sides. False: a midside node has no finite coordinates (not reported).
bool part_cell(Card& card, Model& model, const int* corner, Part& p);

// part_close : creates sets and surfaces
void part_close(Card& card, Model& model, Part& p);

#endif
