# Debian or Ubuntu with the packages of tools/setup.
# Headers of others come by -isystem: warnings stay about our code.

CXX      = mpicxx
MARCH   ?= native
CXXFLAGS = -O3 -march=$(MARCH)
DEFINES  = -DMPFE_MPI -DMPFE_MUMPS -DMPFE_METIS -DMPFE_CHOLMOD -DOMPI_SKIP_MPICXX
# algebraic multigrid; its library is loaded when it is asked for, and not linked
PETSC   := $(wildcard /usr/lib/petscdir/petsc-real/include)
DEFINES += $(if $(PETSC),-DMPFE_PETSC)
INCLUDE  = -isystem /usr/include/eigen3 -isystem /usr/include/suitesparse \
           $(if $(PETSC),-isystem $(PETSC)) \
           $(addprefix -isystem ,$(shell $(CXX) --showme:incdirs 2>/dev/null))

# OpenBLAS first and kept, so that MUMPS and CHOLMOD find their BLAS there whatever the
# alternative libblas.so.3 points to; GSL takes its CBLAS from it too.
LDLIBS   = -Wl,--no-as-needed -lopenblas -Wl,--as-needed \
           -ldmumps -lmumps_common -lcholmod -lgomp -lmetis -lgsl -lmuparser
LDFLAGS  =
SUFFIX   =
