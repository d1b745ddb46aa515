// ---------------------------------------------------------------------------
// elem_share.h : bound of the stable increment by elements that share the mass of their nodes
// ---------------------------------------------------------------------------
#ifndef MPFE_ELEM_ELEM_SHARE_H
#define MPFE_ELEM_ELEM_SHARE_H

#include "elem/elem.h"

// elem_share : replaces ElemBlock::omega2, by the own masses of the elements (6.30), by the smaller one with
// the masses of nodes divided among their elements by stiffness            doc/theory.md (6.46). Collective.
void elem_share(const Model& m, Elements& el);

// elem_share_end : the own masses again: elements have gone, and the mass they left at nodes with them
void elem_share_end(Elements& el);

#endif
