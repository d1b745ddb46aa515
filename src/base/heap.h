// ---------------------------------------------------------------------------
// heap.h : settings of the C library for freed memory
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_HEAP_H
#define MPFE_BASE_HEAP_H

#include <cstddef>

// heap_keep : keeps freed memory in the process. Vectors of the size of the model are allocated and freed in
// every solution; glibc would return each to the system and get it again page by page (P7: 4 % of the run on
// one rank; P8: a quarter on two and four, and P9 4 %, for 3 % less memory). Settings of the user
// in MALLOC_* are kept.
void heap_keep();

// heap_give_back : returns all free pages to the system, also those between used ones
void heap_give_back();

// PagesApart : during its life requests of 64 kB and more that fit into no hole of the heap get pages of
// their own. For arrays that stay and sometimes grow: their old memory would become a hole of the heap that
// is never filled (P9: 74 MB on one rank, 79 without; 43.6 on the largest of four, 47 without).
struct PagesApart {
  explicit PagesApart(std::size_t bytes);
  ~PagesApart();
  PagesApart(const PagesApart&) = delete;
  PagesApart& operator=(const PagesApart&) = delete;
  bool large;
};

#endif
