// ---------------------------------------------------------------------------
// petsc_load.h : the routines of PETSc used by algebraic multigrid (precond_amg.cpp)
//
// libpetsc depends on a hundred libraries, which take 0.06 s of CPU time and 0.15 s to load: they are loaded
// on demand, not in a run without multigrid.
// ---------------------------------------------------------------------------
#ifndef MPFE_SOLVE_PETSC_LOAD_H
#define MPFE_SOLVE_PETSC_LOAD_H

#include <petscksp.h>

#define MPFE_PETSC_ROUTINES(use)                                                             \
  use(KSPGetOperators) use(KSPGetPC) use(KSPSetTolerances) use(KSPSetUp)                     \
  use(MatAssemblyBegin) use(MatAssemblyEnd) use(MatCreateMPIAIJWithArrays)                   \
  use(MatCreateSeqAIJWithArrays) use(MatDestroy) use(MatGetBlockSizes) use(MatGetRowIJ)      \
  use(MatGetSize) use(MatMPIAIJGetSeqAIJ) use(MatNullSpaceCreate) use(MatNullSpaceDestroy)   \
  use(MatRestoreRowIJ) use(MatSeqAIJGetArrayRead) use(MatSeqAIJRestoreArrayRead)             \
  use(MatSetBlockSize) use(MatSetNearNullSpace) use(MatSetOperation) use(MatSetOption)       \
  use(MatUpdateMPIAIJWithArray) use(PCApply) use(PCCreate) use(PCDestroy)                    \
  use(PCMGGetInterpolation) use(PCMGGetLevels) use(PCMGGetSmoother) use(PCSetFromOptions)    \
  use(PCSetOperators) use(PCSetOptionsPrefix) use(PCSetType) use(PCSetUp)                    \
  use(PCShellGetContext) use(PCShellSetApply) use(PCShellSetContext)                         \
  use(PetscContainerCreate) use(PetscContainerDestroy) use(PetscContainerGetPointer)         \
  use(PetscContainerSetPointer) use(PetscContainerSetUserDestroy)                            \
  use(PetscInitializeNoArguments) use(PetscObjectCompose) use(PetscObjectQuery)              \
  use(PetscOptionsSetValue) use(PetscPushErrorHandler) use(PetscReturnErrorHandler)          \
  use(VecCopy) use(VecCreateMPIWithArray) use(VecCreateSeqWithArray) use(VecDestroy) use(VecGetArray)     \
  use(VecGetArrayRead) use(VecPlaceArray) use(VecResetArray) use(VecRestoreArray)            \
  use(VecRestoreArrayRead) use(VecSet)

// each under its own name, with the type that the headers of PETSc give it
struct Petsc {
#define MPFE_PETSC_MEMBER(name) decltype(&::name) name = nullptr;
  MPFE_PETSC_ROUTINES(MPFE_PETSC_MEMBER)
#undef MPFE_PETSC_MEMBER
};

// petsc_open : loads and starts PETSc, once and for the whole run; null: not available. Collective
const Petsc* petsc_open();

#endif
