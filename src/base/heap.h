// ---------------------------------------------------------------------------
// heap.h : what the C library does with memory that has been freed
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_HEAP_H
#define MPFE_BASE_HEAP_H

// heap_keep : freed memory stays with the process. Vectors of a model's length are made and freed in every
// solution; glibc would give each of them back to the system and get it again page by page (P7: 4 % of the
// run on one rank; P8: a quarter on two and four, and P9 4 %, for 3 % less memory). What the user has set in
// MALLOC_* stays.
void heap_keep();

#endif
