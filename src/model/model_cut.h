// ---------------------------------------------------------------------------
// model_cut.h : cuts the whole model of rank 0 into pieces, one after the other           doc/theory.md 5.1
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_MODEL_CUT_H
#define MPFE_MODEL_MODEL_CUT_H

#include "model/state.h"

template <class T>
struct OfRanks {               // items of rank r: item[off[r]] ... item[off[r+1]-1]
  IntVec off;
  std::vector<T> item;
};

// each_node : calls use(node) for the nodes of each element of rank r, with repetitions
template <class Use>
void each_node(const Mesh& mesh, const OfRanks<int>& elem, int r, Use use)
{
  for (int k = elem.off[r]; k < elem.off[r + 1]; ++k)
    for (int i = mesh.conn.off[elem.item[k]]; i < mesh.conn.off[elem.item[k] + 1]; ++i)
      use(mesh.conn.item[i]);
}

struct PieceLists {            // lists of mesh items by rank, in the order of the deck
  std::vector<OfRanks<int>> node, elem;
  std::vector<OfRanks<Face>> face;
  std::vector<OfRanks<Member>> member;
};

struct ModelCut {              // the whole model, in parts
  Model rest;                  // without the mesh and its lists
  Mesh mesh;
  IntVec rank;                 // [nelem] owner of an element
  OfRanks<int> elem, node;     // index in the whole mesh, ascending; with halo elements
  OfRanks<int> near;           // halo elements whose points each rank stores; empty: no MeshPart::window
  std::vector<std::vector<OriginalPoint>> point;         // [ranks] MeshPart::near_point; empty: none
  std::vector<IntVec> present; // [ranks][bond] ContactDef::present; empty: all are
  std::vector<char> notch;     // [nelem] MeshPart::notch of the whole mesh; empty: no fracture
  PieceLists work, all;        // of owned elements; with halo elements
  IntVec elem_index, node_index;       // index in the present piece
  IntVec deck;                 // MeshPart::deck of the whole mesh; empty: nodes are in deck order
  IntVec first;                // [ranks] first node of a piece; empty: the smallest number
};

// The lists of mesh items in a model, always in the same order. A face belongs to its element.
struct ModelLists {
  std::vector<IntVec*> node, elem;
  std::vector<std::vector<Face>*> face;
  std::vector<std::vector<Member>*> member;
};

// model_lists_of_work, model_lists_of_all : lists of owned items; lists that include halo elements
ModelLists model_lists_of_work(Model& m);
ModelLists model_lists_of_all(Model& m);

// model_bonded_surfaces : [surface] 1: used by a bond, a contact pair or general contact
IntVec model_bonded_surfaces(const Model& m);

// model_removed : [nelem] 1: removed by *MODEL CHANGE, REMOVE
IntVec model_removed(const Model& m);

// model_order_nodes : sorts the nodes into the elimination order of the ranks; rank, outer, ranks as in
// model_cut_open
void model_order_nodes(const IntVec& rank, const OfRanks<int>& outer, int ranks, Model& m);

// model_cut_open : prepares the cut by rank[e] [nelem]; whole is empty afterwards
//   in   outer   halo elements of each rank, ascending; no items: none
ModelCut model_cut_open(Model& whole, const IntVec& rank, const OfRanks<int>& outer, int ranks);

// model_cut_piece : the piece of a rank; MeshPart::window needs cut.near. Sets Model::part but for its halo
Model model_cut_piece(ModelCut& c, int r);

// model_cut_close : shared nodes and elements, when all ranks have their pieces. Collective.
void model_cut_close(Model& m);

// model_find_common : shared nodes and elements and their owners; gone as in model_owners. Collective.
void model_find_common(const IntVec& gone, Model& m);

// model_owners : owner of each node, a rank with an element of it that is not gone [nelem] if there is one.
// Collective.
void model_owners(const IntVec& gone, Model& m);

// model_join_ranks : divided model: connected parts over all ranks. root [nodes, then corners, other items]:
// in the root of the part on this rank, out the smallest global number in the part: nodes, then corners;
// other items have none. Collective.
//   in   other   sharing of the other items
void model_join_ranks(const MeshPart& part, const PointPart& points, const Halo& other, IntVec& root);

#endif
