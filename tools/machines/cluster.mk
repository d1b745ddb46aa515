# A cluster with modules. Load the modules, then
#     make MACHINE=cluster
# The paths below come from variables that modules commonly set; give your own
# on the command line (make MACHINE=cluster MUMPS=/path) or edit them here.

EIGEN    ?= $(EIGEN_HOME)
MUMPS    ?= $(MUMPS_HOME)
METIS    ?= $(METIS_HOME)
SUITESPARSE ?= $(SUITESPARSE_HOME)
OPENBLAS ?= $(OPENBLAS_HOME)
GSL      ?= $(GSL_HOME)
MUPARSER ?= $(MUPARSER_HOME)
GTEST    ?= $(GTEST_HOME)
PREFIXES  = $(MUMPS) $(METIS) $(SUITESPARSE) $(OPENBLAS) $(GSL) $(MUPARSER) $(GTEST)

# Processors of compute nodes differ, and from that of the node you compile on:
# x86-64-v3 (AVX2) runs on all of the last ten years. Name yours for more speed,
# MARCH=icelake-server, znver3, native, ...
MARCH   ?= x86-64-v3
CXX      = mpicxx
CXXFLAGS = -O3 -march=$(MARCH)
DEFINES  = -DMPFE_MPI -DMPFE_MUMPS -DMPFE_METIS -DMPFE_CHOLMOD -DOMPI_SKIP_MPICXX -DMPICH_SKIP_MPICXX
INCLUDE  = $(if $(EIGEN),-isystem $(EIGEN)/include/eigen3) \
           $(if $(SUITESPARSE),-isystem $(SUITESPARSE)/include/suitesparse) \
           $(foreach p,$(PREFIXES),-isystem $(p)/include)

# Static MUMPS needs its own libraries named: PORD, ScaLAPACK, Fortran and MPI
# for Fortran. With Intel MKL write the MKL link line in place of BLAS_LIBS.
BLAS_LIBS  = -lscalapack -lopenblas
MUMPS_LIBS = -ldmumps -lmumps_common -lpord
MPI_LIBS   = -lmpi_mpifh -lgfortran
LDFLAGS  = $(foreach p,$(PREFIXES),-L$(p)/lib -Wl,-rpath,$(p)/lib)
# Algebraic multigrid (*SOLVER, TYPE=AMG): add -DMPFE_PETSC to DEFINES and $(PETSC_HOME)/include to INCLUDE; the
# library of the same version, libpetsc.so.3.18 or so, must be found in LD_LIBRARY_PATH.
LDLIBS   = $(MUMPS_LIBS) -lcholmod -lgomp -lmetis -lgsl -lmuparser $(BLAS_LIBS) $(MPI_LIBS) -lm
SUFFIX   =
