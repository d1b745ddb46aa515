// ---------------------------------------------------------------------------
// pack_list.h : elements or points that wait for a full pack. Private to the files of assem/
// ---------------------------------------------------------------------------
#ifndef MPFE_ASSEM_PACK_LIST_H
#define MPFE_ASSEM_PACK_LIST_H

#include "elem/elem.h"

struct PackList {
  int n = 0, slot[PACK];
  const int* map[PACK];        // of a tangent: where its node pairs go
  // true: the pack is full
  bool add(int s, const int* to = nullptr)
  {
    slot[n]  = s;
    map[n++] = to;
    return n == PACK;
  }
  // empty places repeat the first one; their results are left alone
  void fill()
  {
    for (int l = n; l < PACK; ++l) slot[l] = slot[0];
  }
};

#endif
