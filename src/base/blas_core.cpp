#include "base/blas_core.h"

#ifdef MPFE_MUMPS

#include <unistd.h>

#include <cstdlib>

namespace {

const char* const STARTED = "MPFE_BLAS_CHOSEN";   // guards against starting again and again

// name of the kernels in OpenBLAS, null: leave the choice to OpenBLAS
const char* core_type()
{
#if defined(__x86_64__)
  __builtin_cpu_init();
  // SkylakeX kernels use all four of these sets
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512bw") &&
      __builtin_cpu_supports("avx512dq") && __builtin_cpu_supports("avx512vl"))
    return "SkylakeX";
  if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma")) return "Haswell";
#endif
  return nullptr;
}

}  // namespace

void blas_choose(int, char** argv)
{
  if (std::getenv(STARTED)) return;
  bool changed = false;
  const char* core = core_type();
  if (core && !std::getenv("OPENBLAS_CORETYPE")) changed = setenv("OPENBLAS_CORETYPE", core, 0) == 0;
  if (!std::getenv("OPENBLAS_NUM_THREADS") && !std::getenv("OMP_NUM_THREADS"))
    changed = setenv("OPENBLAS_NUM_THREADS", "1", 0) == 0 || changed;
  if (!changed || setenv(STARTED, "1", 1) != 0) return;
  execv("/proc/self/exe", argv);
}

#else

void blas_choose(int, char**) {}

#endif
