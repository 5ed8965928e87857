# make             build libvg and the programs into build/$(CONFIG)
# make deps        install the Debian packages of debian-packages.txt (root or sudo; nothing when all are there)
# make demo        transfer an animation onto another body and draw it: says where to look
# make check       all tests                    make CONFIG=asan check    the same under ASan and UBSan
# make coverage    lines of lib that make check runs, file by file
# make check-aarch64   the kernels' tests on an emulated ARM processor, where its tools are installed
# make lint        the static analysers that are installed
# make bench-train accuracy and speed of networks on the kit (VG_DATA) beside their bounds: some minutes; ONLY="walk keys": parts
# make bench       throughput of every stage beside its limit; BENCH=full: up to 1,000,002 vertices; JSON=FILE: also as JSON;
#                 PAGE=BENCHMARKS.md: put its tables there; VG_DATA=DIR: rows of pins, on the kit
# make fuzz        search for input that breaks the readers (clang; FUZZ_SECONDS=60 each)
# make install     PREFIX=/usr/local LIBDIR=$(PREFIX)/lib DESTDIR=   make uninstall, make clean
# make dist        build/vg-VERSION.tar.xz, the same bytes each time; make distcheck builds and tests from it (TESTS=)
# make blender     build/vg_tools.zip, the add-on for Blender, the same bytes each time
# make deb         Debian packages into build/deb (what it takes: debian/control)
.DEFAULT_GOAL := all
.SUFFIXES:
.DELETE_ON_ERROR:
.SECONDARY:

CONFIG ?= release
PREFIX ?= /usr/local
LIBDIR ?= $(PREFIX)/lib
FUZZ_SECONDS ?= 60
WERROR ?= 0
CC ?= cc
CFLAGS ?= -O2 -g
PKG_CONFIG ?= pkg-config
VERSION := $(shell sed -n 's/^\#define VG_VERSION "\(.*\)"/\1/p' lib/vg.h)

B := build/$(CONFIG)

CHOLMOD_CFLAGS ?= -I/usr/include/suitesparse
CHOLMOD_LIBS ?= -lcholmod
BLAS_LIBS ?= -lopenblas
LAPACKE_LIBS ?= -llapacke
ARCHIVE_CFLAGS ?= $(shell $(PKG_CONFIG) --cflags libarchive 2>/dev/null)
ARCHIVE_LIBS ?= $(shell $(PKG_CONFIG) --libs libarchive 2>/dev/null || echo -larchive)
XXHASH_LIBS ?= -lxxhash
PNG_CFLAGS ?= $(shell $(PKG_CONFIG) --cflags libpng 2>/dev/null)
PNG_LIBS ?= $(shell $(PKG_CONFIG) --libs libpng 2>/dev/null || echo -lpng)
WEBP_LIBS ?= $(shell $(PKG_CONFIG) --libs libwebpmux libwebp 2>/dev/null || echo -lwebpmux -lwebp)
FONT_CFLAGS ?= $(shell $(PKG_CONFIG) --cflags freetype2 fontconfig 2>/dev/null || echo -I/usr/include/freetype2)
FONT_LIBS ?= $(shell $(PKG_CONFIG) --libs freetype2 fontconfig 2>/dev/null || echo -lfreetype -lfontconfig)
ZLIB_LIBS ?= $(shell $(PKG_CONFIG) --libs zlib 2>/dev/null || echo -lz)
JANSSON_LIBS ?= $(shell $(PKG_CONFIG) --libs jansson 2>/dev/null || echo -ljansson)

# Compressed glTF is read where these libraries are installed (WITH_DRACO=0 WITH_MESHOPT=0: without them).
CXX ?= g++
has_header = $(shell $(CXX) $(CPPFLAGS) -include $(1) -E -x c++ /dev/null >/dev/null 2>&1 && echo 1 || echo 0)
WITH_DRACO ?= $(call has_header,draco/draco_features.h)
WITH_MESHOPT ?= $(call has_header,meshoptimizer.h)
CODEC_CPPFLAGS := $(if $(filter 1,$(WITH_DRACO)),-DVG_DRACO) $(if $(filter 1,$(WITH_MESHOPT)),-DVG_MESHOPT)
CODEC_LIBS := $(if $(filter 1,$(WITH_DRACO)),-ldraco -lstdc++) $(if $(filter 1,$(WITH_MESHOPT)),-lmeshoptimizer)

ALL_CPPFLAGS := -D_GNU_SOURCE -Ilib -include lib/core/banned.h $(CHOLMOD_CFLAGS) $(ARCHIVE_CFLAGS) $(PNG_CFLAGS) $(CPPFLAGS)
ALL_CFLAGS := -std=gnu11 -fPIC -Wall -Wextra -Wshadow -Wvla -Wstrict-prototypes -Wmissing-prototypes -Wpointer-arith -Wwrite-strings -Wno-psabi
ifeq ($(WERROR),1)
ALL_CFLAGS += -Werror
endif
ifeq ($(filter $(CONFIG),release asan cov fuzz),)
$(error CONFIG is release, asan, cov or fuzz, not '$(CONFIG)')
endif
ifeq ($(CONFIG),asan)
ALL_CFLAGS += -fsanitize=address,undefined -fno-sanitize-recover=undefined -fno-omit-frame-pointer
ALL_LDFLAGS := -fsanitize=address,undefined
else ifeq ($(CONFIG),cov)
ALL_CFLAGS += --coverage -O0
ALL_LDFLAGS := --coverage -Wl,-u,__gcov_dump
else ifeq ($(CONFIG),fuzz)
CC := clang
CXX := clang++
ALL_CFLAGS += -fsanitize=fuzzer-no-link,address,undefined -fno-sanitize-recover=undefined
ALL_LDFLAGS := -fsanitize=address,undefined
endif
# MPI=1: vg-train may be started by mpirun, each process with some of the chains
MPI ?= 0
ifeq ($(MPI),1)
ALL_CPPFLAGS += -DVG_MPI $(shell $(PKG_CONFIG) --cflags ompi-c)
MPI_LIBS ?= $(shell $(PKG_CONFIG) --libs ompi-c)
endif
ALL_CFLAGS += $(CFLAGS)
# Numeric kernels are compiled once for each instruction set of the target (lib/core/isa.h); the compiler may unroll and
# vectorise them and what else is listed; nothing here reorders sums.
TARGET := $(shell $(CC) -dumpmachine 2>/dev/null)
SETS := $(if $(filter x86_64%,$(TARGET)),sse2 avx2 avx512,$(if $(filter aarch64%,$(TARGET)),neon,plain))
SET_avx2 := -mavx2 -mfma
SET_avx512 := -mavx512f -mavx512dq -mfma -mprefer-vector-width=512
FAST := -O3 -fno-math-errno -fno-trapping-math
FAST_SRC := $(addprefix lib/,method/vectors/reconstruct method/pairs/transfer method/patches/segment signal/plane signal/spline_pose model/graph model/measures)
# what a program does not call is not loaded: OpenBLAS starts threads that spin for a while as soon as it is there
ALL_LDFLAGS += -Wl,--as-needed $(LDFLAGS)
ALL_LIBS := $(CHOLMOD_LIBS) $(LAPACKE_LIBS) $(BLAS_LIBS) $(ARCHIVE_LIBS) $(XXHASH_LIBS) $(PNG_LIBS) $(WEBP_LIBS) $(FONT_LIBS) $(ZLIB_LIBS) $(JANSSON_LIBS) $(MPI_LIBS) -lpthread -lm $(LDLIBS)

KERNEL_SRC := $(sort $(wildcard lib/*/*_kernel.c lib/*/*/*_kernel.c))
LIB_SRC := $(filter-out $(KERNEL_SRC),$(sort $(wildcard lib/*/*.c lib/*/*/*.c)))
KERNEL_OBJ := $(foreach set,$(SETS),$(KERNEL_SRC:%.c=$(B)/%.$(set).o))
CODEC_OBJ := $(if $(filter 1,$(WITH_DRACO)),$(B)/lib/io/codec_draco.o)
LIB_OBJ := $(LIB_SRC:%.c=$(B)/%.o) $(CODEC_OBJ) $(KERNEL_OBJ) $(B)/page_text.o
PROGRAMS := $(patsubst cmd/%.c,%,$(sort $(wildcard cmd/vg-*.c)))
# The shared library, for programs of others: only vg_* is seen. Its number changes when a program would have to be compiled again.
SO := 0
SHARED := $(if $(filter fuzz,$(CONFIG)),,$(B)/libvg.so.$(VERSION))
CMD_SHARED := $(filter-out cmd/vg-%.c,$(sort $(wildcard cmd/*.c)))
CMD_OBJ := $(CMD_SHARED:%.c=$(B)/%.o)
UNITS := $(patsubst tests/unit/%.c,%,$(sort $(wildcard tests/unit/test_*.c)))
FUZZERS := $(patsubst tests/fuzz/%.c,%,$(sort $(wildcard tests/fuzz/fuzz_*.c)))
BENCHES := $(patsubst tests/bench/%.c,%,$(sort $(wildcard tests/bench/*.c)))

.PHONY: all
all: $(PROGRAMS:%=$(B)/bin/%) $(B)/bin/vg $(B)/libvg.a $(SHARED) $(B)/vg-api.html

# objects depend on the flags they were made with
FLAGS_NOW := $(CC) $(ALL_CPPFLAGS) $(ALL_CFLAGS) $(FAST) $(SET_avx2) $(SET_avx512) $(ALL_LDFLAGS) $(ALL_LIBS)
$(B)/flags: FORCE
	@mkdir -p $(B)
	@echo '$(FLAGS_NOW)' | cmp -s - $@ || echo '$(FLAGS_NOW)' > $@
.PHONY: FORCE
FORCE:

$(FAST_SRC:%=$(B)/%.o) $(KERNEL_OBJ): ALL_CFLAGS += $(FAST)

# which codecs there are, these files alone ask for
$(B)/codecs: FORCE
	@mkdir -p $(B)
	@echo '$(CXX) $(CODEC_CPPFLAGS) $(CODEC_LIBS)' | cmp -s - $@ || echo '$(CXX) $(CODEC_CPPFLAGS) $(CODEC_LIBS)' > $@
CODEC_C_OBJ := $(addprefix $(B)/lib/io/,codec_meshopt.o codec_none.o)
$(CODEC_C_OBJ): $(B)/codecs
$(CODEC_C_OBJ): ALL_CPPFLAGS += $(CODEC_CPPFLAGS)
$(B)/lib/view/text.o: ALL_CPPFLAGS += $(FONT_CFLAGS)
$(B)/%.o: %.cc $(B)/flags $(B)/codecs
	@mkdir -p $(@D)
	$(CXX) -Ilib $(CPPFLAGS) $(CODEC_CPPFLAGS) -std=c++17 -fPIC -Wall -Wextra $(filter -Werror -O% -g% -fsanitize% -fno-% --coverage,$(ALL_CFLAGS)) -MMD -MP -c -o $@ $<

$(B)/%.o: %.c $(B)/flags
	@mkdir -p $(@D)
	$(CC) $(ALL_CPPFLAGS) $(ALL_CFLAGS) -MMD -MP -c -o $@ $<

define kernel_of_set
$(B)/%_kernel.$(1).o: %_kernel.c $(B)/flags
	@mkdir -p $$(@D)
	$$(CC) $$(ALL_CPPFLAGS) $$(ALL_CFLAGS) $$(SET_$(1)) -DVGI_SET=$(1) -MMD -MP -c -o $$@ $$<
endef
$(foreach set,$(SETS),$(eval $(call kernel_of_set,$(set))))

# what the pages of vg-view are made of, as strings of C; all ASCII
# A script is several files: the first opens its scope, the last closes it and starts it.
PART_page_html := lib/view/page.html
PART_page_css := lib/view/page.css
PART_page_js := $(addprefix lib/view/page_,read.js skin.js draw.js pick.js play.js)
PART_pairs_css := lib/view/page.css lib/view/pairs.css
PART_pairs_js := $(addprefix lib/view/page_,read.js skin.js draw.js pick.js pairs_fit.js pairs.js play.js)
PART_signal_html := lib/view/signal.html
PART_signal_css := lib/view/page.css lib/view/signal.css
PART_signal_js := $(addprefix lib/view/,page_read.js page_skin.js page_draw.js page_pick.js signal_math.js signal_edit.js signal_live.js \
    signal_plane.js signal_time.js signal_play.js)
PAGE_PARTS := page_html page_css page_js pairs_css pairs_js signal_html signal_css signal_js
$(B)/page_text.c: $(foreach part,$(PAGE_PARTS),$(PART_$(part))) Makefile
	@mkdir -p $(@D)
	@{ echo '#include "view/page.h"'; \
	   $(foreach part,$(PAGE_PARTS),echo 'const char vgi_$(part)[] = {'; \
	       cat $(PART_$(part)) | od -An -v -tu1 | sed 's/[0-9][0-9]*/&,/g'; echo '0};';) } > $@

$(B)/page_text.o: $(B)/page_text.c $(B)/flags
	$(CC) $(ALL_CPPFLAGS) $(ALL_CFLAGS) -MMD -MP -c -o $@ $<

$(B)/libvg.a: $(LIB_OBJ) $(B)/codecs
	@rm -f $@
	$(AR) rcs $@ $(LIB_OBJ)

$(B)/libvg.so.$(VERSION): $(LIB_OBJ) $(B)/codecs lib/libvg.map
	$(CC) $(ALL_CFLAGS) -shared -Wl,-soname,libvg.so.$(SO) -Wl,--version-script=lib/libvg.map $(ALL_LDFLAGS) -o $@ $(LIB_OBJ) $(CODEC_LIBS) $(ALL_LIBS)
	@ln -sf $(@F) $(B)/libvg.so.$(SO)

# the pages of the library's functions: what the headers say
$(B)/vg-api.html: lib/api.awk lib/vg.h $(wildcard lib/vg/*.h)
	@mkdir -p $(@D)
	awk -v version='$(VERSION)' -f lib/api.awk lib/vg.h $(sort $(wildcard lib/vg/*.h)) > $@

$(B)/shared.a: $(CMD_OBJ)
	@rm -f $@
	$(AR) rcs $@ $^

$(B)/bin/%: $(B)/cmd/%.o $(B)/shared.a $(B)/libvg.a
	@mkdir -p $(@D)
	$(CC) $(ALL_CFLAGS) $(ALL_LDFLAGS) -o $@ $^ $(CODEC_LIBS) $(ALL_LIBS)

$(B)/bin/vg: cmd/vg
	@mkdir -p $(@D)
	@install -m 755 $< $@

$(B)/unit/%: $(B)/tests/unit/%.o $(B)/libvg.a
	@mkdir -p $(@D)
	$(CC) $(ALL_CFLAGS) $(ALL_LDFLAGS) -o $@ $^ $(CODEC_LIBS) $(ALL_LIBS)

$(B)/bench/%: $(B)/tests/bench/%.o $(B)/libvg.a
	@mkdir -p $(@D)
	$(CC) $(ALL_CFLAGS) $(ALL_LDFLAGS) -o $@ $^ $(CODEC_LIBS) $(ALL_LIBS)

# with CONFIG=fuzz the engine brings main; otherwise replay.c does, and the same files run over the corpora
ifeq ($(CONFIG),fuzz)
FUZZ_MAIN :=
FUZZ_LINK := -fsanitize=fuzzer -fsanitize-link-c++-runtime
else
FUZZ_MAIN := $(B)/tests/fuzz/replay.o
FUZZ_LINK :=
endif
$(B)/fuzz/%: $(B)/tests/fuzz/%.o $(FUZZ_MAIN) $(B)/libvg.a
	@mkdir -p $(@D)
	$(CC) $(ALL_CFLAGS) $(FUZZ_LINK) $(ALL_LDFLAGS) -o $@ $^ $(CODEC_LIBS) $(ALL_LIBS)

# preloaded into the programs by tests/alloc.bats; without sanitizers, whatever they have
$(B)/tools/%.so: tests/tools/%.c $(B)/flags
	@mkdir -p $(@D)
	$(CC) -std=gnu11 -D_GNU_SOURCE -Wall -Wextra -Wshadow -fPIC -shared -O1 -g -o $@ $< -ldl

.PHONY: deps
deps:
	@sh tests/install-packages.sh debian-packages.txt

# with TESTS only what these need is built
TESTS ?= all
CHECK_UNITS := $(if $(filter all unit,$(TESTS)),$(UNITS),$(filter $(TESTS),$(UNITS)))
CHECK_FUZZERS := $(if $(filter all fuzz,$(TESTS)),$(FUZZERS),$(filter $(TESTS),$(FUZZERS)))
.PHONY: check
check: all $(CHECK_UNITS:%=$(B)/unit/%) $(CHECK_FUZZERS:%=$(B)/fuzz/%) $(B)/tools/fail_malloc.so
	@BUILD=$(B) CONFIG=$(CONFIG) TESTS='$(TESTS)' sh tests/run.sh

# The kernels' tests, compiled for ARM of 64 bits and run by an emulator: what they link needs neither CHOLMOD nor BLAS.
ARM_CC ?= aarch64-linux-gnu-gcc
ARM_RUN ?= qemu-aarch64 -L /usr/aarch64-linux-gnu
ARM_OBJ = $(patsubst %.c,$(B)/%.o,$(wildcard lib/core/*.c) $(addprefix lib/numeric/,polar.c rotation.c stats.c) tests/unit/test_isa.c)
.PHONY: check-aarch64 check-kernels
check-aarch64:
	@if ! command -v $(firstword $(ARM_CC)) >/dev/null || ! command -v $(firstword $(ARM_RUN)) >/dev/null; then \
	    echo 'skipped: this takes $(firstword $(ARM_CC)) and $(firstword $(ARM_RUN)), of gcc-aarch64-linux-gnu and qemu-user'; \
	else $(MAKE) CC='$(ARM_CC)' CPPFLAGS= B=build/aarch64 RUN='$(ARM_RUN)' check-kernels; fi

check-kernels: $(B)/check-kernels
	$(RUN) $(B)/check-kernels
$(B)/check-kernels: $(ARM_OBJ) $(KERNEL_OBJ)
	$(CC) $(ALL_CFLAGS) $(ALL_LDFLAGS) -o $@ $^ -lpthread -lm

.PHONY: coverage
coverage:
	@$(MAKE) CONFIG=cov check
	@BUILD=$(B:$(CONFIG)=cov) sh tests/coverage.sh

.PHONY: lint
lint:
	@sh tests/lint.sh

.PHONY: demo
demo: all
	@BUILD=$(B) sh examples/demo.sh $(B)/demo

.PHONY: bench
bench: all $(BENCHES:%=$(B)/bench/%)
	@BUILD=$(B) BENCH='$(BENCH)' RUNS='$(RUNS)' JSON='$(JSON)' PAGE='$(PAGE)' sh tests/bench/run.sh

.PHONY: bench-train
bench-train: all
	@PATH=$(abspath $(B))/bin:$$PATH ONLY='$(ONLY)' python3 tests/bench/train.py

.PHONY: fuzz
fuzz:
	@$(MAKE) CONFIG=fuzz fuzz-run
.PHONY: fuzz-run
fuzz-run: $(FUZZERS:%=$(B)/fuzz/%)
	@for f in $(FUZZERS); do \
	    mkdir -p build/fuzz/corpus/$$f; \
	    dict=tests/fuzz/$$f.dict; test -f $$dict && dict=-dict=$$dict || dict=; \
	    echo "== $$f"; \
	    $(B)/fuzz/$$f -max_total_time=$(FUZZ_SECONDS) -max_len=16384 -rss_limit_mb=4096 -print_final_stats=1 $$dict \
	        build/fuzz/corpus/$$f tests/corpus/accept tests/corpus/reject $$(test -d tests/corpus/$$f && echo tests/corpus/$$f) || exit 1; \
	done

BIN_TO := $(DESTDIR)$(PREFIX)/bin
LIB_TO := $(DESTDIR)$(LIBDIR)
INCLUDE_TO := $(DESTDIR)$(PREFIX)/include
MAN_TO := $(DESTDIR)$(PREFIX)/share/man
SHARE_TO := $(DESTDIR)$(PREFIX)/share
COMPLETION_TO := $(SHARE_TO)/bash-completion/completions
ZSH_TO := $(SHARE_TO)/zsh/site-functions
FISH_TO := $(SHARE_TO)/fish/vendor_completions.d
DOC_TO := $(SHARE_TO)/doc/vg
# what is installed of examples/: all but pictures that only the README shows
EXAMPLES := $(filter-out examples/pictures/% %.pyc,$(shell find examples -type f ! -path '*/__pycache__/*' ! -path 'examples/asset-build/out/*'))

.PHONY: install
install: all
	install -d $(BIN_TO) $(LIB_TO)/pkgconfig $(INCLUDE_TO)/vg $(MAN_TO)/man1 $(MAN_TO)/man5 $(MAN_TO)/man7 $(COMPLETION_TO) $(ZSH_TO) $(FISH_TO) $(DOC_TO)
	install -m 755 $(PROGRAMS:%=$(B)/bin/%) $(B)/bin/vg $(BIN_TO)
	install -m 644 $(B)/libvg.a $(SHARED) $(LIB_TO)
	ln -sf libvg.so.$(VERSION) $(LIB_TO)/libvg.so.$(SO)
	ln -sf libvg.so.$(SO) $(LIB_TO)/libvg.so
	install -m 644 lib/vg.h $(INCLUDE_TO)
	install -m 644 $(sort $(wildcard lib/vg/*.h)) $(INCLUDE_TO)/vg
	sed -e 's|@PREFIX@|$(PREFIX)|' -e 's|@LIBDIR@|$(LIBDIR)|' -e 's|@VERSION@|$(VERSION)|' \
	    -e 's|@LIBS@|$(strip $(CODEC_LIBS) $(ALL_LIBS))|' lib/libvg.pc.in > $(LIB_TO)/pkgconfig/libvg.pc
	for page in man/*.[1-9]; do install -m 644 $$page $(MAN_TO)/man$${page##*.} || exit 1; done
	install -m 644 completion/vg.bash $(COMPLETION_TO)/vg
	for program in $(PROGRAMS); do ln -sf vg $(COMPLETION_TO)/$$program || exit 1; done
	install -m 644 completion/_vg $(ZSH_TO)
	install -m 644 completion/vg.fish $(FISH_TO)
	for program in $(PROGRAMS); do ln -sf vg.fish $(FISH_TO)/$$program.fish || exit 1; done
	install -m 644 $(B)/vg-api.html README.md $(DOC_TO)
	for file in $(EXAMPLES); do mkdir -p $(DOC_TO)/$${file%/*} && cp -f $$file $(DOC_TO)/$$file || exit 1; done
	mkdir -p $(DOC_TO)/examples/data $(DOC_TO)/examples/pictures
	install -m 644 $(filter-out tests/data/reports tests/data/licences,$(wildcard tests/data/*)) $(DOC_TO)/examples/data
	install -m 644 $(wildcard examples/pictures/tutorial-*) $(DOC_TO)/examples/pictures

.PHONY: uninstall
uninstall:
	rm -f $(PROGRAMS:%=$(BIN_TO)/%) $(BIN_TO)/vg $(LIB_TO)/libvg.a $(LIB_TO)/libvg.so* $(INCLUDE_TO)/vg.h $(patsubst lib/%,$(INCLUDE_TO)/%,$(wildcard lib/vg/*.h)) $(LIB_TO)/pkgconfig/libvg.pc \
	    $(foreach page,$(notdir $(wildcard man/*.[1-9])),$(MAN_TO)/man$(subst .,,$(suffix $(page)))/$(page)) \
	    $(COMPLETION_TO)/vg $(PROGRAMS:%=$(COMPLETION_TO)/%) $(ZSH_TO)/_vg $(FISH_TO)/vg.fish $(PROGRAMS:%=$(FISH_TO)/%.fish)
	rm -rf $(DOC_TO)
	rmdir $(INCLUDE_TO)/vg 2>/dev/null || :

# The same tree gives the same bytes: names sorted, nobody's user and mask, one time for all files. DIST tells where it is.
DIST := build/vg-$(VERSION).tar.xz
.PHONY: dist
dist:
	@sh tests/dist.sh pack $(DIST) vg-$(VERSION)

.PHONY: distcheck
distcheck: dist
	@MAKE='$(MAKE)' sh tests/dist.sh check $(DIST) vg-$(VERSION)

.PHONY: blender
blender: build/vg_tools.zip
build/vg_tools.zip: $(wildcard examples/blender/vg_tools/*.py) examples/python/vgstream.py examples/blender/pack.py COPYING
	@python3 examples/blender/pack.py $@

.PHONY: deb
deb: dist
	@sh tests/dist.sh deb $(DIST) vg-$(VERSION)

.PHONY: clean
clean:
	rm -rf build

-include $(shell find $(B) -name '*.d' 2>/dev/null)
