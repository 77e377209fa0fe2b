# GNU make. Needs cc and make only; everything else (OpenMP, clang, C++, valgrind, nm) is looked for and used if present.
#
#   make            examples -> build/<example>         make test    unit and physics tests, 2 minutes
#   make demo       the L-shaped block                  make check   test and the slow ones, sanitizers, valgrind
#   make bench      timings and short study, 10 min     make bench-full    the whole study, 2 hours
#   make extremes   how far it goes, a table, 6 min     make coverage, make clean
#   make portability    the tests with other compilers, C libraries, machines and systems, as far as installed
#
# CFLAGS are yours (default -O3 -march=native); threads: OMP_NUM_THREADS or --threads of the examples.

CC ?= cc
CFLAGS ?= -O3 -march=native
WARNINGS := -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wdouble-promotion -Wstrict-prototypes
BASE := -std=c99 $(WARNINGS) -I. -MMD -MP
LDLIBS := -lm
REFERENCES := $(CURDIR)/tests/references

# Does the compiler take these flags, and does a program link that holds this line?
takes = $(shell printf '%s\nint main(void) { return 0; }\n' '$(2)' | $(CC) $(1) -x c - -o /dev/null 2> /dev/null && echo yes)
comma := ,
OPENMP := $(if $(call takes,-fopenmp,int omp_get_max_threads(void); int (*probe)(void) = omp_get_max_threads;),-fopenmp)
SANITIZE := $(if $(call takes,-fsanitize=address$(comma)undefined),-fsanitize=address$(comma)undefined -fno-sanitize-recover=all)
THREAD_SANITIZE := $(if $(call takes,-fsanitize=thread),-fsanitize=thread)
VALGRIND := $(shell command -v valgrind 2> /dev/null)

EXAMPLES := $(patsubst examples/%.c,build/%,$(wildcard examples/*.c))
# One archive a flavour: the library and what examples, tests and benches share. A program takes from it what it needs.
SHARED := $(wildcard examples/common/*.c examples/scenes/*.c) tests/implementation.c
TESTS := $(filter-out tests/implementation.c tests/fuzz.c tests/extremes.c,$(wildcard tests/*.c))
TOPICS := $(patsubst tests/test_%.c,%,$(wildcard tests/test_*.c))
BENCHES := $(wildcard bench/*.c)
BENCH_PROGRAMS := $(addprefix build/,bench multirate textbook scaling scaling_float study study_float)

all: $(EXAMPLES)
	@echo "examples are in build/ (each tells its options with --help)"

# Waiting threads spin for a moment only, then sleep: on a machine that does other work too, they would hold it up.
demo: build/l_block
	GOMP_SPINCOUNT=10000 build/l_block

# ---- flavours: $(call flavour,name,flags of the library,flags of the tests) ----

define flavour
build/obj/$(1)/tests/%.o: tests/%.c build/suites.h
	@mkdir -p $$(@D)
	$$(CC) $(BASE) $(3) -DREFERENCES='"$(REFERENCES)"' -Ibuild -c $$< -o $$@
build/obj/$(1)/%.o: %.c
	@mkdir -p $$(@D)
	$$(CC) $(BASE) $(2) -c $$< -o $$@
build/obj/$(1)/tests/implementation.o: tests/implementation.c
	@mkdir -p $$(@D)
	$$(CC) $(BASE) $(2) -c $$< -o $$@
build/obj/$(1)/shared.a: $(SHARED:%.c=build/obj/$(1)/%.o)
	@rm -f $$@
	$$(AR) rcs $$@ $$^
build/extremes_$(1): build/obj/$(1)/tests/extremes.o build/obj/$(1)/shared.a
	$$(CC) $(2) $$^ -o $$@ $(LDLIBS)
build/test_$(1): $(TESTS:%.c=build/obj/$(1)/%.o) build/obj/$(1)/shared.a
	$$(CC) $(2) $$^ -o $$@ $(LDLIBS)
endef

FLOAT := -DTLSPH_REAL_FLOAT
ASSERT := -DCHECK_INVARIANTS -DTLSPHI_CACHED=0
$(eval $(call flavour,double,$(CFLAGS) $(OPENMP),-O1))
$(eval $(call flavour,float,$(CFLAGS) $(OPENMP) $(FLOAT),-O1 $(FLOAT)))
$(eval $(call flavour,sanitized,-O1 -g $(SANITIZE) $(ASSERT),-O1 -g $(SANITIZE)))
$(eval $(call flavour,sanitized_float,-O1 -g $(SANITIZE) $(ASSERT) $(FLOAT),-O1 -g $(SANITIZE) $(FLOAT)))
$(eval $(call flavour,valgrind,-O1 -g,-O1 -g))
# The header promises to find values that are not finite even so.
$(eval $(call flavour,fast_math,-Ofast $(OPENMP),-O1))
# Threads of the host only: the sanitizer does not know those of OpenMP's library.
$(eval $(call flavour,threads,-O1 -g $(THREAD_SANITIZE) -DTLSPHI_CACHED=0,-O1 -g $(THREAD_SANITIZE)))
# A function that is inlined everywhere counts once, as it stands in the source.
$(eval $(call flavour,coverage,-O0 -g --coverage -Dalways_inline=unused,-O0))

# ---- programs ----

$(EXAMPLES): build/%: build/obj/double/examples/%.o build/obj/double/shared.a
	$(CC) $(CFLAGS) $(OPENMP) $^ -o $@ $(LDLIBS)

build/bench build/multirate build/textbook build/scaling: build/%: build/obj/double/bench/%.o \
    build/obj/double/bench/machine.o build/obj/double/shared.a
	$(CC) $(CFLAGS) $(OPENMP) $^ -o $@ $(LDLIBS)
build/bench: build/obj/double/bench/bound.o
build/scaling_float: build/obj/float/bench/scaling.o build/obj/float/bench/machine.o build/obj/float/shared.a
	$(CC) $(CFLAGS) $(OPENMP) $^ -o $@ $(LDLIBS)
build/study: build/obj/double/bench/study.o build/obj/double/bench/runs.o build/obj/double/shared.a
	$(CC) $(CFLAGS) $(OPENMP) $^ -o $@ $(LDLIBS)
build/study_float: build/obj/float/bench/study.o build/obj/float/bench/runs.o build/obj/float/shared.a
	$(CC) $(CFLAGS) $(OPENMP) $^ -o $@ $(LDLIBS)

bench bench-full: $(BENCH_PROGRAMS)
	build/bench $(if $(filter bench,$@),--quick)
	build/textbook
	build/multirate $(if $(filter bench,$@),--quick)
	build/scaling $(if $(filter bench,$@),--quick,--large)
	build/scaling_float --memory
	sh bench/study.sh $(if $(filter bench,$@),400,5400 --full)

# Scenes and checkpoints of random bytes; tests/fuzz.c tells how libFuzzer and AFL++ run it.
build/fuzz: tests/fuzz.c tlsph.h
	@mkdir -p $(@D)
	$(CC) -std=c99 $(WARNINGS) -O1 -g $(SANITIZE) -I. $< -o $@ $(LDLIBS)
CLANG ?= clang
build/fuzz_libfuzzer: tests/fuzz.c tlsph.h
	$(CLANG) -std=c99 -O1 -g -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all -DFUZZ_ENTRY -I. $< -o $@ $(LDLIBS)
build/fuzz_afl: tests/fuzz.c tlsph.h
	AFL_USE_ASAN=1 AFL_USE_UBSAN=1 afl-clang-fast -std=c99 -O1 -g -I. $< -o $@ $(LDLIBS)

# The list of test files; rewritten only when it changes.
build/suites.h: FORCE
	@mkdir -p build
	@for topic in $(TOPICS); do echo "SUITE_NAME($$topic)"; done > $@.new
	@cmp -s $@.new $@ && rm $@.new || mv $@.new $@

# ---- tests: tests/run.sh adds up the summaries of its arguments ----

QUICK := $(filter-out physics%,$(TOPICS))
SKIPPED = echo "$(1)"; echo "0 passed, 0 failed, 1 skipped"
HEADER = "CC='$(CC)' sh tests/header.sh$(1)"
FAST_STEPS := "build/test_double" "build/test_float"
SANITIZED := $(if $(SANITIZE),sanitized sanitized_float)
SLOW_STEPS := $(call HEADER, --optimised) "sh tests/vectors.sh" "build/test_double --slow" "build/test_fast_math" \
  $(if $(THREAD_SANITIZE),"build/test_threads embedding/","$(call SKIPPED,no thread sanitizer)") \
  $(if $(SANITIZE),"build/test_sanitized $(QUICK:%=%/)" "build/test_sanitized_float $(QUICK:%=%/)",\
    "$(call SKIPPED,no sanitizers)") \
  "build/fuzz 50000" "build/extremes_double --quick" \
  $(if $(VALGRIND),"valgrind -q --error-exitcode=9 --leak-check=full build/test_valgrind checkpoint/continues memory/ errors/ limits/counts limits/surfaces limits/forged operators/cells fill/refusals",\
    "$(call SKIPPED,no valgrind)")
SLOW_PROGRAMS := build/fuzz build/extremes_double build/test_double build/test_fast_math $(if $(THREAD_SANITIZE),build/test_threads) \
  $(SANITIZED:%=build/test_%) $(if $(VALGRIND),build/test_valgrind)

# Two processors: two compilers at a time unless make was told otherwise, then the header's own beside the tests.
test: by_two build/test_double build/test_float
	@sh tests/run.sh --beside $(call HEADER) $(FAST_STEPS)
by_two:
	@$(if $(findstring jobserver,$(MAKEFLAGS)),:,$(MAKE) --no-print-directory -j2 build/test_double build/test_float)

check: build/test_float $(SLOW_PROGRAMS)
	@sh tests/run.sh --beside $(call HEADER) $(FAST_STEPS) $(SLOW_STEPS)

# What check does beside test (for .ci/run).
check-only: $(SLOW_PROGRAMS)
	@sh tests/run.sh $(SLOW_STEPS)

# Lines and branches of the header that the tests take, as gcov counts them.
coverage: build/test_coverage
	@find build/obj/coverage -name '*.gcda' -delete
	build/test_coverage
	@sh tests/coverage.sh

# Other compilers, C libraries, word sizes, byte orders, Windows.
portability:
	@sh tests/portability.sh

clean:
	rm -rf build out

FORCE:
.PHONY: all demo bench bench-full test by_two check check-only coverage extremes portability clean FORCE
.SECONDARY:

-include $(shell find build/obj -name '*.d' 2> /dev/null)
