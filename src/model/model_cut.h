// ---------------------------------------------------------------------------
// model_cut.h : the whole model of rank 0 into pieces, one after the other                doc/theory.md 5.1
// ---------------------------------------------------------------------------
#ifndef MPFE_MODEL_MODEL_CUT_H
#define MPFE_MODEL_MODEL_CUT_H

#include "model/state.h"

template <class T>
struct OfRanks {               // what belongs to rank r: item[off[r]] ... item[off[r+1]-1]
  IntVec off;
  std::vector<T> item;
};

// each_node : calls use(node) for the nodes of the elements of rank r, as often as they have them
template <class Use>
void each_node(const Mesh& mesh, const OfRanks<int>& elem, int r, Use use)
{
  for (int k = elem.off[r]; k < elem.off[r + 1]; ++k)
    for (int i = mesh.conn.off[elem.item[k]]; i < mesh.conn.off[elem.item[k] + 1]; ++i)
      use(mesh.conn.item[i]);
}

struct PieceLists {            // lists that grow with the mesh, in the order of the deck
  std::vector<OfRanks<int>> node, elem;
  std::vector<OfRanks<Face>> face;
  std::vector<OfRanks<Member>> member;
};

struct ModelCut {              // the whole model, taken apart
  Model rest;                  // without the mesh and the lists that grow with it
  Mesh mesh;
  IntVec rank;                 // [nelem] that works on an element
  OfRanks<int> elem, node;     // index in the mesh that is divided, ascending; with outer elements
  OfRanks<int> near;           // outer elements whose points each rank knows; empty: no MeshPart::window
  std::vector<std::vector<PointHome>> point;         // [ranks] MeshPart::near_point; empty: none
  std::vector<IntVec> present; // [ranks] ContactDef::present, for each of bond; empty: all are
  std::vector<char> notch;     // [nelem] MeshPart::notch of the mesh that is divided; empty: nothing breaks
  PieceLists work, all;        // of what each rank works on; with outer elements
  IntVec elem_index, node_index;       // index in the piece that is cut
  IntVec deck;                 // MeshPart::deck of the whole mesh; empty: nodes stand as in the deck
  IntVec first;                // [ranks] the first node of a piece; empty: that with the smallest number
};

// The lists of a model that grow with the mesh, always in the same order. A face goes with its element.
struct ModelLists {
  std::vector<IntVec*> node, elem;
  std::vector<std::vector<Face>*> face;
  std::vector<std::vector<Member>*> member;
};

// model_lists_of_work, model_lists_of_all : those of what a rank works on, those of outer elements too
ModelLists model_lists_of_work(Model& m);
ModelLists model_lists_of_all(Model& m);

// model_bonded_surfaces : [surface] 1: side A or the master of bonds or contact pairs, or named by general
// contact
IntVec model_bonded_surfaces(const Model& m);

// model_removed : [nelem] 1: *MODEL CHANGE, REMOVE takes it away
IntVec model_removed(const Model& m);

// model_order_nodes : nodes in the order in which ranks eliminate them; rank, outer, ranks as for
// model_cut_open
void model_order_nodes(const IntVec& rank, const OfRanks<int>& outer, int ranks, Model& m);

// model_cut_open : takes the model apart by rank[e] [nelem]; whole is empty behind it
//   in   outer   elements of others that a rank looks at, ascending; no items: none
ModelCut model_cut_open(Model& whole, const IntVec& rank, const OfRanks<int>& outer, int ranks);

// model_cut_piece : what a rank has of it, with MeshPart::window cut.near must be there; Model::part says
// what it is, but for its halo
Model model_cut_piece(ModelCut& c, int r);

// model_cut_close : what the pieces have in common, when all ranks have theirs. Collective.
void model_cut_close(Model& m);

// model_find_common : which nodes and elements other ranks have too, and whose they are; gone as for
// model_owners. Collective.
void model_find_common(const IntVec& gone, Model& m);

// model_owners : rank that a node belongs to, one of those where it moves with an element that is not gone
// [nelem]. Collective.
void model_owners(const IntVec& gone, Model& m);

// model_join_ranks : divided model: root [nodes, then corners, other things] of the part that a rank sees
// becomes the smallest number of that part on all ranks: of nodes in the mesh of the deck, corners behind;
// others have none. Collective.
//   in   other   which of the other things ranks have in common
void model_join_ranks(const MeshPart& part, const PointPart& points, const Halo& other, IntVec& root);

#endif
