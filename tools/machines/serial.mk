# One process, no MPI, no MUMPS, no CHOLMOD, no METIS, no PETSc: the skyline solver does the work.
# Needs g++, Eigen, GSL and muParser.

CXX      = g++
MARCH   ?= native
CXXFLAGS = -O3 -march=$(MARCH)
DEFINES  =
INCLUDE  = -isystem /usr/include/eigen3
LDLIBS   = -lgsl -lgslcblas -lmuparser
LDFLAGS  =
SUFFIX   = -serial
