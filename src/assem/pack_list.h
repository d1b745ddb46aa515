// ---------------------------------------------------------------------------
// pack_list.h : elements or points collected for a pack. Private to the files of assem/
// ---------------------------------------------------------------------------
#ifndef MPFE_ASSEM_PACK_LIST_H
#define MPFE_ASSEM_PACK_LIST_H

#include "elem/elem.h"

struct PackList {
  int n = 0, slot[PACK];
  const int* map[PACK];        // tangent: blocks of A of its node pairs
  // true: the pack is full
  bool add(int s, const int* to = nullptr)
  {
    slot[n]  = s;
    map[n++] = to;
    return n == PACK;
  }
  // empty lanes repeat the first one; their results are not used
  void fill()
  {
    for (int l = n; l < PACK; ++l) slot[l] = slot[0];
  }
};

// pack_of : elem_form_pack where it applies: it compares the strength with the stress at t(n+1) only
inline ElemFormPack pack_of(const ElemBlock& b, const KernelMode& mode)
{
  return b.opens() && (mode.mid || b.law.beta * mode.rate != 0.0) ? nullptr : elem_form_pack(b);
}

#endif
