// ---------------------------------------------------------------------------
// petsc_load.h : the routines of PETSc that the algebraic multigrid takes (precond_amg.cpp)
//
// libpetsc brings a hundred libraries, which take 0.06 s of the processor and 0.15 s to load: they come when
// they are asked for, and a run without multigrid does not see them.
// ---------------------------------------------------------------------------
#ifndef MPFE_SOLVE_PETSC_LOAD_H
#define MPFE_SOLVE_PETSC_LOAD_H

#include <petscksp.h>

#define MPFE_PETSC_ROUTINES(use)                                                             \
  use(KSPGetPC) use(KSPSetTolerances) use(KSPSetUp) use(MatAssemblyBegin) use(MatAssemblyEnd) \
  use(MatCreateMPIAIJWithArrays) use(MatCreateSeqAIJWithArrays) use(MatCreateShell)          \
  use(MatDestroy) use(MatNullSpaceCreate) use(MatNullSpaceDestroy) use(MatSetBlockSize)      \
  use(MatSetNearNullSpace) use(MatSetOption) use(MatShellGetContext)                         \
  use(MatShellSetOperation) use(MatUpdateMPIAIJWithArray) use(PCApply) use(PCCreate)         \
  use(PCDestroy) use(PCMGGetLevels) use(PCMGGetSmoother) use(PCSetFromOptions)               \
  use(PCSetOperators) use(PCSetOptionsPrefix) use(PCSetType) use(PCSetUp) use(PCSetUseAmat)  \
  use(PCShellGetContext) use(PCShellSetApply) use(PCShellSetContext)                         \
  use(PetscInitializeNoArguments) use(PetscOptionsSetValue) use(PetscPushErrorHandler)       \
  use(PetscReturnErrorHandler) use(VecCreateMPIWithArray) use(VecCreateSeqWithArray)         \
  use(VecDestroy) use(VecGetArray) use(VecGetArrayRead) use(VecPlaceArray) use(VecResetArray) \
  use(VecRestoreArray) use(VecRestoreArrayRead)

// each under its own name, with the type that the headers of PETSc give it
struct Petsc {
#define MPFE_PETSC_MEMBER(name) decltype(&::name) name = nullptr;
  MPFE_PETSC_ROUTINES(MPFE_PETSC_MEMBER)
#undef MPFE_PETSC_MEMBER
};

// petsc_open : loads and starts PETSc, once; null: it is not there. Collective. It stays to the end
const Petsc* petsc_open();

#endif
