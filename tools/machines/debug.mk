# Like debian, for the search for faults: address and undefined-behaviour sanitizers, checks of the
# standard library and of Eigen. Five to twenty times slower; a fault ends the program at once.
#     make MACHINE=debug unit && bin/unit-debug
# Leaks are not looked for: Open MPI keeps what it has (src/base/sanitize.cpp). Nor is what the address sanitizer or the processor
# finds by itself (null, object-size, alignment, vptr), which makes the build up to twice as long. CI builds
# the serial program with sanitizers, sanitize.mk.

include tools/machines/debian.mk
MARCH    = x86-64-v2
CXXFLAGS = -O1 -g1 -march=$(MARCH) -fsanitize=address,undefined -fno-sanitize-recover=undefined \
           -fno-sanitize=null,object-size,alignment,vptr -fno-omit-frame-pointer -D_GLIBCXX_ASSERTIONS
LDFLAGS  = -fsanitize=address,undefined
SUFFIX   = -debug
ROOMS    = no
