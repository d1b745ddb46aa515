# The program that CI searches for faults: serial.mk, with address and undefined-behaviour sanitizers and the checks of the
# standard library and of Eigen. One build proves two things: that the program does without MPI, MUMPS, CHOLMOD and METIS, and
# that its unit tests and the decks of tools/sanitize touch no memory that is not theirs.
#     make MACHINE=sanitize all unit && tools/sanitize
# Made to be built quickly: a folder is one file (names that two of its files have for different things are errors), checks of
# addresses are calls, unit tests are not optimised; warnings are those of the other builds.
# debug.mk is the same with all libraries, file by file.

include tools/machines/serial.mk
MARCH    = x86-64-v2
CXXFLAGS = -O1 -march=$(MARCH) -fsanitize=address,undefined -fno-sanitize-recover=undefined \
           -fno-sanitize=null,object-size,alignment,vptr,pointer-overflow \
           --param asan-instrumentation-with-call-threshold=0 -D_GLIBCXX_ASSERTIONS
LDFLAGS  = -fsanitize=address,undefined
SUFFIX   = -sanitize
ROOMS    = yes
UNIT_FLAGS = -O0
WARNINGS = -w
