#!/bin/sh
# Do compilers make vectors of the loops over lanes? Results do not depend on it, but time does: a loop unrolled too early
# has made gcc -O2 2.7 times as slow as -O3, a choice that might trap has made SSE2 slower by a third, and no test failed.
# Counts additions, multiplications and divisions in objdump's listing of the hot functions: those of single numbers may be
# a tenth of those of vectors. x86-64 only. Last line: N passed, N failed, N skipped.
#   sh tests/vectors.sh      from the repository's root; COMPILERS="gcc clang" names others
if [ "$1" = check ]; then # COMPILER FLAGS
    compiler=$2 flags=$3
    object=$(mktemp build/vectors/XXXXXX.o)
    $compiler -std=c99 $flags -I. -c build/vectors/header.c -o "$object" 2> /dev/null ||
        { rm -f "$object"; echo "skip  $compiler $flags"; exit; }
    verdict=ok said=
    for loop in pairs:'flux_slots|add_slots' evaluation:'constitute_tiles|conclude_' gradients:sum_jumps; do
        # clang before 17 takes the first lane that was collected in a cloud by itself, and then the other seven, too.
        case "$compiler $loop" in clang*gradients*) continue ;; esac
        counted=$(objdump -d --no-show-raw-insn "$object" | awk -v wanted="${loop#*:}" '
            /^[0-9a-f]+ <.*>:$/ { inside = $2 ~ wanted }
            inside && $2 ~ /^v?(add|sub|mul|div|fn?m(add|sub)[0-9]+)p[sd]$/ { vectors++ }
            inside && $2 ~ /^v?(add|sub|mul|div|fn?m(add|sub)[0-9]+)s[sd]$/ { singles++ }
            END { print vectors + 0 "/" singles + 0 (vectors < 100 || 10 * singles > vectors ? "!" : "") }')
        case $counted in *!) verdict=FAIL ;; esac
        said="$said ${loop%%:*} $counted"
    done
    rm -f "$object"
    printf '%-5s %s\n' "$verdict" "$compiler $flags:$said"
    exit
fi

rm -rf build/vectors
mkdir -p build/vectors || exit 1
printf '#define TLSPH_IMPLEMENTATION\n#include "tlsph.h"\n' > build/vectors/header.c
if [ "$(uname -m)" = x86_64 ] && command -v objdump > /dev/null; then
    for compiler in ${COMPILERS:-gcc clang}; do
        command -v "$compiler" > /dev/null || { echo "skip  no $compiler" >> build/vectors/missing; continue; }
        for real in "" " -DTLSPH_REAL_FLOAT"; do
            for flags in "-O2" "-O2 -mavx2" "-O3 -march=x86-64-v4"; do echo "$compiler '$flags$real'"; done
        done
    done | xargs -r -P 2 -L 1 sh "$0" check > build/vectors/out
else
    echo "skip  needs x86-64 and objdump" > build/vectors/out
fi
[ -e build/vectors/missing ] && cat build/vectors/missing >> build/vectors/out
cat build/vectors/out
number() { grep -c "^$1" build/vectors/out; }
echo "$(number ok) passed, $(number FAIL) failed, $(number skip) skipped"
[ "$(number FAIL)" -eq 0 ]
