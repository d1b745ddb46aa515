// ---------------------------------------------------------------------------
// blas_core.h : the right kernels and threads of OpenBLAS
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_BLAS_CORE_H
#define MPFE_BASE_BLAS_CORE_H

// blas_choose : first line of main. OpenBLAS reads its environment while it is loaded, before main, and
// older releases take plain SSE kernels on processors they do not know: so the program sets OPENBLAS_CORETYPE
// by what the processor can do, OPENBLAS_NUM_THREADS to 1, under mpirun to the cores that each rank of the
// machine may use, and starts itself again, once. What the user has set stays. When both are set, without
// MPFE_MUMPS, or when the start fails, it returns and nothing has happened.
void blas_choose(int argc, char** argv);

#endif
