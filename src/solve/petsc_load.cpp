#ifdef MPFE_PETSC

#include "solve/petsc_load.h"

#include <dlfcn.h>

#include <cstdlib>
#include <string>

#include "base/comm.h"

namespace {

#define MPFE_TEXT_OF(x) #x
#define MPFE_TEXT(x) MPFE_TEXT_OF(x)

// the library of the same version as the headers, by its name in Debian or its original name
void* load()
{
  const std::string version = MPFE_TEXT(PETSC_VERSION_MAJOR) "." MPFE_TEXT(PETSC_VERSION_MINOR);
  for (const char* name : {"libpetsc_real.so.", "libpetsc.so."})
    if (void* const library = dlopen((name + version).c_str(), RTLD_LAZY | RTLD_LOCAL)) return library;
  return nullptr;
}

bool find_routines(void* library, Petsc& p)
{
  bool all = true;
#define MPFE_PETSC_FIND(name)                                          \
  p.name = reinterpret_cast<decltype(p.name)>(dlsym(library, #name)); \
  all    = all && p.name;
  MPFE_PETSC_ROUTINES(MPFE_PETSC_FIND)
#undef MPFE_PETSC_FIND
  return all;
}

// Uses the options of this program only, not those of .petscrc or of the environment; leaves signal handlers
// unchanged, and returns errors as numbers
bool start(void* library, const Petsc& p)
{
  // idle ranks do not start PETSc
  if (void* const comm = dlsym(library, "PETSC_COMM_WORLD"))
    *static_cast<MPI_Comm*>(comm) = MPI_Comm_f2c(comm_fortran(true));
  const char* const set     = std::getenv("PETSC_OPTIONS");
  const std::string options = set ? set : "";
  unsetenv("PETSC_OPTIONS");
  const bool good = !p.PetscOptionsSetValue(nullptr, "-skip_petscrc", "1") &&
                    !p.PetscOptionsSetValue(nullptr, "-no_signal_handler", "1") &&
                    !p.PetscInitializeNoArguments() &&
                    !p.PetscPushErrorHandler(p.PetscReturnErrorHandler, nullptr);
  if (set) setenv("PETSC_OPTIONS", options.c_str(), 1);
  return good;
}

}  // namespace

const Petsc* petsc_open()
{
  static Petsc petsc;
  static bool tried = false, there = false;
  if (!tried) {
    tried = true;
    comm_fortran(true);                          // starts MPI
    void* const library = load();
    there = !comm_allreduce_max(!(library && find_routines(library, petsc)));
    there = there && !comm_allreduce_max(!start(library, petsc));
  }
  return there ? &petsc : nullptr;
}

#endif
