#!/bin/sh
# The quick tests with other compilers, C libraries, word sizes, byte orders and systems, as far as they are installed;
# what is missing is skipped, and said so. Programs for other machines run under qemu or wine.
# Run from the repository's root. Last line: N passed, N failed, N skipped, counting toolchains.
#   sh tests/portability.sh [name ...]     only these
work=build/portability
mkdir -p "$work"
passed=0 failed=0 skipped=0
warnings="-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wdouble-promotion -Wstrict-prototypes"
# All but those that need the scenes.
files=$(grep -L 'scenes\.h\|physics\.h' tests/test_*.c)
topics=$(echo "$files" | sed 's,tests/test_\(.*\)\.c,\1,')
sources="tests/run.c tests/support.c tests/implementation.c $files"

have() { command -v "$1" > /dev/null 2>&1; }
skip() { echo "skip  $1: $2"; skipped=$((skipped + 1)); }

# Compiles all sources, two at a time: compile NAME COMPILER FLAGS
compile() {
    for topic in $topics; do echo "SUITE_NAME($topic)"; done > "$work/$1/suites.h"
    for source in $sources; do
        flags="-O1"
        [ "$source" = tests/implementation.c ] && flags="-O2"
        echo "$2 -std=c99 $flags $3 -I. -I$work/$1  -c $source -o $work/$1/$(echo "$source" | tr / _).o"
    done | xargs -P 2 -I{} sh -c '{} || exit 255' > "$work/$1/log" 2>&1
}

# toolchain NAME COMPILER FLAGS RUNNER: builds the tests and runs them. A runner of "-" runs them as they are; emulators
# are ten to fifty times slower and run what depends on the machine most.
toolchain() {
    name=$1 compiler=$2 flags=$3 runner=$4
    [ -n "$only" ] && case " $only " in *" $name "*) ;; *) return ;; esac
    have "$compiler" || { skip "$name" "no $compiler"; return; }
    filters="checkpoint/ errors/ fill/ kernels/ materials/ limits/ memory/callers memory/measured memory/failing_allocations_leak operators/ portable/ tensors/"
    if [ "$runner" = - ]; then runner= filters=
    else have "$runner" || { skip "$name" "no $runner"; return; }
    fi
    case $compiler in *mingw*) exe=.exe ;; *) exe= ;; esac
    rm -rf "$work/$name"
    mkdir -p "$work/$name"
    echo 'int main(void) { return 0; }' > "$work/$name/probe.c"
    if ! $compiler $flags "$work/$name/probe.c" -o "$work/$name/probe$exe" 2> "$work/$name/log" || ! $runner "$work/$name/probe$exe" \
        > /dev/null 2>&1; then
        skip "$name" "$compiler $flags makes no program that runs"
        return
    fi
    if compile "$name" "$compiler" "$flags" && $compiler $flags "$work/$name"/*.o -lm -lpthread -o "$work/$name/tests$exe" \
        >> "$work/$name/log" 2>&1 && $runner "$work/$name/tests$exe" $filters > "$work/$name/out" 2>&1; then
        echo "ok    $name: $(tail -n 1 "$work/$name/out" | tr -d '\r')$(grep -q 'warning:' "$work/$name/log" && echo ", warnings")"
        passed=$((passed + 1))
    else
        echo "FAIL  $name"
        grep -hE 'FAIL|error|does not hold|expected' "$work/$name/log" "$work/$name/out" 2> /dev/null | head -n 20
        failed=$((failed + 1))
    fi
}

only=$*
exact="-ffp-contract=off"
toolchain gcc gcc "$warnings $exact" -
toolchain gcc_sse2 gcc "-mno-avx $exact" -
grep -qs avx2 /proc/cpuinfo && toolchain gcc_avx2 gcc "-O3 -mavx2 -mfma $exact" -
toolchain clang clang "$warnings $exact" -
toolchain clang_14 clang-14 "$exact" -
toolchain clang_16 clang-16 "$exact" -
toolchain clang_19 clang-19 "$exact" -
toolchain tcc tcc "" -
toolchain musl musl-gcc "$exact -static" -
toolchain m32 gcc "-m32 -msse2 -mfpmath=sse $exact" -
toolchain m32_x87 gcc "-m32 -mfpmath=387" -
toolchain aarch64 aarch64-linux-gnu-gcc "$exact -static" qemu-aarch64-static
toolchain s390x_big_endian s390x-linux-gnu-gcc "$exact -static" qemu-s390x-static
toolchain riscv64 riscv64-linux-gnu-gcc "$exact -static" qemu-riscv64-static
wine=$(command -v wine64 || command -v wine || ls /usr/lib/wine/wine64 2> /dev/null)
toolchain windows x86_64-w64-mingw32-gcc "$exact -static" "${wine:-wine}"
toolchain float_aarch64 aarch64-linux-gnu-gcc "$exact -static -DTLSPH_REAL_FLOAT" qemu-aarch64-static
toolchain float_s390x s390x-linux-gnu-gcc "$exact -static -DTLSPH_REAL_FLOAT" qemu-s390x-static

echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
