// ---------------------------------------------------------------------------
// heap.h : what the C library does with memory that has been freed
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_HEAP_H
#define MPFE_BASE_HEAP_H

#include <cstddef>

// heap_keep : freed memory stays with the process. Vectors of a model's length are made and freed in every
// solution; glibc would give each of them back to the system and get it again page by page (P7: 4 % of the
// run on one rank; P8: a quarter on two and four, and P9 4 %, for 3 % less memory). What the user has set in
// MALLOC_* stays.
void heap_keep();

// heap_give_back : all pages that are free, also those between others
void heap_give_back();

// PagesApart : while there is one, a request of so many bytes, 64 kB and more, that fits into no hole of the
// heap gets pages of its own. For arrays that stay, and become larger at times: the place where they were
// would be another hole that nothing fills (P9: 74 MB on one rank, 79 without; 43.6 on the largest of four,
// 47 without).
struct PagesApart {
  explicit PagesApart(std::size_t bytes);
  ~PagesApart();
  PagesApart(const PagesApart&) = delete;
  PagesApart& operator=(const PagesApart&) = delete;
  bool large;
};

#endif
