// ---------------------------------------------------------------------------
// heap.h : what the C library does with memory that has been freed
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_HEAP_H
#define MPFE_BASE_HEAP_H

// heap_keep : freed memory stays with the process. Vectors of a model's length are made and freed in every
// solution; glibc would give each of them back to the system and get it again page by page (P7: 4 % of the
// run on one rank, P9: 4 % on two). On more than two ranks, where memory counts, those of more than 128 kB go
// back (P9 on four ranks: 3 % of the memory at 256 kB, 1.6 % more at 128). What the user has set in MALLOC_*
// stays.
void heap_keep(int ranks);

#endif
