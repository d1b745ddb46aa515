# mpfe: build, set-up and tests.  `make help` lists the targets.
#
# What depends on the machine stands in tools/machines/*.mk and is chosen with
# make MACHINE=name. Objects of each machine are kept apart.

MACHINE ?= debian
include tools/machines/$(MACHINE).mk

# as many jobs as cores; a -j of the user wins
ifeq ($(MAKELEVEL),0)
ifeq ($(filter -j%,$(MAKEFLAGS)),)
MAKEFLAGS += -j$(shell nproc 2>/dev/null || echo 2)
endif
endif

# one short line a file; V=1 shows the whole commands
ifeq ($(V),1)
Q    =
say  =
else
Q    = @
say  = @printf '  %-4s %s\n' $(1) $(2)
endif

# where make install puts things, below DESTDIR when a package is made
PREFIX ?= /usr/local
SHARE   = $(DESTDIR)$(PREFIX)/share/mpfe
# where Python looks for the module mpfe below PREFIX: dist-packages on Debian's /usr/local
PYTHON_LIB ?= $(PREFIX)/$(shell python3 -c 'import sys; v = "lib/python%d.%d/" % sys.version_info[:2]; \
  print(v + ("dist" if "$(PREFIX)/" + v + "dist-packages" in sys.path else "site") + "-packages")' 2>/dev/null)

BUILD := build/$(MACHINE)
MPFE  := bin/mpfe$(SUFFIX)
UNIT  := bin/unit$(SUFFIX)
STAMP := $(BUILD)/setup.stamp
READY := $(BUILD)/program.stamp

SRC      := $(wildcard src/*/*.cpp)
UNIT_SRC := $(wildcard verification/unit/*.cpp)
OBJ      := $(SRC:%.cpp=$(BUILD)/%.o)
MAIN_OBJ := $(BUILD)/src/main.o
UNIT_OBJ := $(UNIT_SRC:%.cpp=$(BUILD)/%.o)
# A folder of src as one file costs half the time of a first build, each file as its own is quicker afterwards:
# `make ROOMS=no` once, and it stays so while its objects are there.
ROOMS ?= $(if $(wildcard $(BUILD)/src/deck/*.o),no,yes)
ALONE := src/base/cpu_check.cpp
ifeq ($(ROOMS),yes)
OBJ      := $(patsubst src/%/,$(BUILD)/rooms/%.o,$(sort $(dir $(SRC)))) $(ALONE:%.cpp=$(BUILD)/%.o)
endif

# GCC 12 takes the undefined vectors of its own AVX-512 headers for mistakes of Eigen (GCC bug 105593)
WARNINGS ?= -Wall -Wextra -Wshadow -Wno-maybe-uninitialized -Wno-uninitialized -Werror=switch
COMPILE  = $(CXX) -std=c++17 $(CXXFLAGS) $(WARNINGS) $(DEFINES) -Isrc $(INCLUDE) -MMD -MP

# what a test does is not worth long optimising, the routines it calls are
UNIT_FLAGS ?= -O1
$(UNIT_OBJ): COMMON = $(UNIT_FLAGS)
# looks at the processor before the instructions of MARCH are used
$(BUILD)/src/base/cpu_check.o: COMMON = $(if $(filter x86_64,$(shell uname -m)),-march=x86-64 -mtune=generic)

# What the objects and the programs were made with: the command, and what the compiler behind it says of itself and of the
# processor (native is another one on another machine). When it is not that of the last time, they are made again.
COMPILER  = $(shell $(CXX) $(CXXFLAGS) -dM -E -x c++ /dev/null 2>/dev/null | cksum)
remember  = printf '%s\n' '$(subst ','\'',$(1))' | cmp -s - $@ || printf '%s\n' '$(subst ','\'',$(1))' > $@

.PHONY: all setup demo gallery test verify bench unit install install_files uninstall clean help FORCE
.DEFAULT_GOAL := all

all: $(MPFE)
unit: $(UNIT)

$(MPFE): $(OBJ) $(MAIN_OBJ) $(BUILD)/link.txt
	@mkdir -p $(@D)
	$(call say,LINK,$@)
	$(Q)$(CXX) $(LDFLAGS) $(filter %.o,$^) $(LDLIBS) -o $@

$(UNIT): $(OBJ) $(UNIT_OBJ) $(BUILD)/link.txt
	@mkdir -p $(@D)
	$(call say,LINK,$@)
	$(Q)$(CXX) $(LDFLAGS) $(filter %.o,$^) -lgtest $(LDLIBS) -pthread -o $@

$(BUILD)/compile.txt: FORCE
	@mkdir -p $(@D)
	@$(call remember,$(COMPILE) $(COMPILER))

$(BUILD)/link.txt: FORCE
	@mkdir -p $(@D)
	@$(call remember,$(CXX) $(LDFLAGS) $(LDLIBS) $(COMPILER))

FORCE:

$(BUILD)/%.o: %.cpp $(BUILD)/compile.txt
	@mkdir -p $(@D)
	$(call say,CXX,$<)
	$(Q)$(COMPILE) $(COMMON) -c $< -o $@

ifeq ($(ROOMS),yes)
$(filter $(BUILD)/rooms/%,$(OBJ)): %.o: %.cpp $(BUILD)/compile.txt
	$(call say,CXX,$<)
	$(Q)$(COMPILE) -c $< -o $@

$(patsubst %.o,%.cpp,$(filter $(BUILD)/rooms/%,$(OBJ))): $(BUILD)/rooms/%.cpp: FORCE
	@mkdir -p $(@D)
	@printf '#include "../../../%s"\n' $(filter-out $(ALONE),$(filter src/$*/%,$(SRC))) > $@.now
	@cmp -s $@.now $@ && rm $@.now || mv $@.now $@
endif

# setup looks again; demo, test and verify look once, then trust the stamp. What only tests need waits for them.
# They build in a second make, because setup may bring the compiler.
setup:
	tools/setup MACHINE=$(MACHINE)
	@mkdir -p $(BUILD) && touch $(STAMP)

$(STAMP): tools/setup tools/machines/$(MACHINE).mk
	tools/setup MACHINE=$(MACHINE)
	@mkdir -p $(@D) && touch $@

$(READY): tools/setup tools/machines/$(MACHINE).mk
	tools/setup MACHINE=$(MACHINE) FOR=program
	@mkdir -p $(@D) && touch $@

demo: $(READY)
	@$(MAKE) --no-print-directory all
	MPFE=$(MPFE) tools/demo

test: $(STAMP)
	@$(MAKE) --no-print-directory all unit
	MPFE=$(MPFE) UNIT=$(UNIT) tools/verify --test

verify: $(STAMP)
	@$(MAKE) --no-print-directory all unit
	MPFE=$(MPFE) UNIT=$(UNIT) tools/verify $(CASES)

gallery: $(STAMP)
	@$(MAKE) --no-print-directory all
	MPFE=$(MPFE) tools/gallery $(NAMES)

bench: $(STAMP)
	@$(MAKE) --no-print-directory all
	MPFE=$(MPFE) tools/bench $(ITEMS)

# the program, mpfe-plot and mpfe-fragments, the Python module, pages and decks; install_files does not build
install: all
	@$(MAKE) --no-print-directory install_files

install_files:
	install -d $(DESTDIR)$(PREFIX)/bin $(SHARE)/tools/lib $(SHARE)/doc $(SHARE)/decks
	install -m 755 $(MPFE) $(DESTDIR)$(PREFIX)/bin/mpfe
	install -m 755 tools/plot tools/fragments $(SHARE)/tools
	install -m 644 tools/lib/mpfe.py tools/lib/mpfe_files.py tools/lib/mpfe_scene.py $(SHARE)/tools/lib
	install -d $(DESTDIR)$(PYTHON_LIB)
	install -m 644 tools/lib/mpfe.py $(DESTDIR)$(PYTHON_LIB)
	install -m 644 README.md LICENSE CHANGES $(SHARE)
	cp -r doc/. $(SHARE)/doc
	install -m 644 $(filter-out %_mesh.inp,$(wildcard decks/*.inp decks/*.inc decks/*.geo)) $(SHARE)/decks
	ln -sf ../share/mpfe/tools/plot $(DESTDIR)$(PREFIX)/bin/mpfe-plot
	ln -sf ../share/mpfe/tools/fragments $(DESTDIR)$(PREFIX)/bin/mpfe-fragments

uninstall:
	rm -rf $(SHARE) $(DESTDIR)$(PYTHON_LIB)/mpfe.py $(addprefix $(DESTDIR)$(PREFIX)/bin/,mpfe mpfe-plot mpfe-fragments)

clean:
	rm -rf build bin

help:
	@echo 'make            build $(MPFE)'
	@echo 'make setup      install or look for the libraries'
	@echo 'make demo       set up, build, run the demonstration'
	@echo 'make gallery    the problems of doc/gallery.md with their pictures; NAMES="name ..." picks some'
	@echo 'make test       set up, build, run unit tests, small decks and bad decks'
	@echo 'make verify     the long checks; CASES="name ..." picks some'
	@echo 'make bench      benchmarks into doc/benchmarks.md; ITEMS="name ..." picks some'
	@echo 'make unit       build the unit tests, $(UNIT)'
	@echo 'make install    the program, mpfe-plot, pages and decks to PREFIX (now: $(PREFIX)); make uninstall'
	@echo 'make clean      remove build/ and bin/'
	@echo 'V=1             show the whole commands of the compiler'
	@echo 'MARCH=name      processor to build for, instead of that of the machine file (now: $(MARCH))'
	@echo 'MACHINE=name    $(basename $(notdir $(wildcard tools/machines/*.mk))) (now: $(MACHINE))'

-include $(OBJ:.o=.d) $(MAIN_OBJ:.o=.d) $(UNIT_OBJ:.o=.d)
