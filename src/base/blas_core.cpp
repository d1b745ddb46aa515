#include "base/blas_core.h"

#ifdef MPFE_MUMPS

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <initializer_list>
#include <string>

namespace {

const char* const STARTED = "MPFE_BLAS_CHOSEN";   // prevents repeated restarts

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

// number of ranks on this machine according to the launcher, 0: started without one
long local_ranks()
{
  for (const char* launcher : {"OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS", "SLURM_NTASKS_PER_NODE"})
    if (const char* number = std::getenv(launcher)) return std::strtol(number, nullptr, 10);
  return 0;
}

// one thread without a launcher; else the cores of the machine per rank, limited to those that it is bound to
long threads()
{
  const long ranks = local_ranks();
  if (ranks <= 0) return 1;
  cpu_set_t allowed;
  const long bound = sched_getaffinity(0, sizeof allowed, &allowed) == 0 ? CPU_COUNT(&allowed) : 1;
  return std::max(1L, std::min(bound, sysconf(_SC_NPROCESSORS_ONLN) / ranks));
}

}  // namespace

void blas_choose(int, char** argv)
{
  if (std::getenv(STARTED)) return;
  bool changed = false;
  const char* core = core_type();
  if (core && !std::getenv("OPENBLAS_CORETYPE")) changed = setenv("OPENBLAS_CORETYPE", core, 0) == 0;
  if (!std::getenv("OPENBLAS_NUM_THREADS") && !std::getenv("OMP_NUM_THREADS"))
    changed = setenv("OPENBLAS_NUM_THREADS", std::to_string(threads()).c_str(), 0) == 0 || changed;
  if (!changed || setenv(STARTED, "1", 1) != 0) return;
  char path[4096] = "";                  // by its name, so that ps and top show it
  if (readlink("/proc/self/exe", path, sizeof path - 1) > 0) execv(path, argv);
  execv("/proc/self/exe", argv);         // the file was deleted
}

#else

void blas_choose(int, char**) {}

#endif
