#include "base/heap.h"

#include <cstdlib>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace {

// bytes of the heap that may be unused: freed memory is used again without new pages  (no test)
const int KEPT = 1 << 30;
// bytes: smaller requests use the heap; the largest value of glibc. The same with PagesApart
// (test: Heap.LargeArraysHavePagesOfTheirOwn)
const std::size_t HEAP = 32 << 20;
const std::size_t APART = 64 << 10;

void take_from_heap(std::size_t size)
{
#ifdef __GLIBC__
  static const bool user = std::getenv("MALLOC_MMAP_THRESHOLD_") != nullptr;
  if (!user) mallopt(M_MMAP_THRESHOLD, static_cast<int>(size));
#else
  (void)size;
#endif
}

}  // namespace

void heap_keep()
{
#ifdef __GLIBC__
  if (!std::getenv("MALLOC_TRIM_THRESHOLD_")) mallopt(M_TRIM_THRESHOLD, KEPT);
#endif
  take_from_heap(HEAP);
}

void heap_give_back()
{
#ifdef __GLIBC__
  malloc_trim(0);
#endif
}

PagesApart::PagesApart(std::size_t bytes) : large(bytes >= APART)
{
  if (large) take_from_heap(APART);
}

PagesApart::~PagesApart()
{
  if (large) take_from_heap(HEAP);
}
