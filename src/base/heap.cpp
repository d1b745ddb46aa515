#include "base/heap.h"

#include <cstdlib>

#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace {

const int KEPT = 1 << 30;      // byte of the heap that may lie idle
const int HEAP = 32 << 20;     // byte: smaller requests come from the heap; glibc takes no more

}  // namespace

void heap_keep()
{
#ifdef __GLIBC__
  if (!std::getenv("MALLOC_TRIM_THRESHOLD_")) mallopt(M_TRIM_THRESHOLD, KEPT);
  if (!std::getenv("MALLOC_MMAP_THRESHOLD_")) mallopt(M_MMAP_THRESHOLD, HEAP);
#endif
}
