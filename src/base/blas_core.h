// ---------------------------------------------------------------------------
// blas_core.h : the right kernels and threads of OpenBLAS
// ---------------------------------------------------------------------------
#ifndef MPFE_BASE_BLAS_CORE_H
#define MPFE_BASE_BLAS_CORE_H

// blas_choose : first line of main. OpenBLAS reads its environment when it is loaded, before main, and older
// releases use plain SSE kernels on processors that they do not recognise: so the program sets
// OPENBLAS_CORETYPE according to the processor, OPENBLAS_NUM_THREADS to 1, under mpirun to the cores
// available to each rank of the machine, and restarts itself, once. Settings of the user are kept. If both
// are set, without MPFE_MUMPS, or if the restart fails, it returns without effect.
void blas_choose(int argc, char** argv);

#endif
