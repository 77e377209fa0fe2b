#!/bin/sh
# The header by itself: compiles in every language version, precision and linkage without a warning, links as promised,
# exports only tlsph_ names, holds no writable data and calls nothing that prints or exits. Compilers that are missing
# are skipped. Two compilations run at a time. Last line: N passed, N failed, N skipped.
#   sh tests/header.sh               from the repository's root; CC names the compiler of what is linked
#   sh tests/header.sh --optimised   only the warnings that come with optimisation: a minute of compiling
optimised=$([ "$1" = --optimised ] && echo yes)
work=build/header${optimised:+_optimised}
root=$(pwd)
rm -rf "$work"
mkdir -p "$work" || exit 1

common="-Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wdouble-promotion -Werror -I$root"
c_only="-Wstrict-prototypes"

# ---- the units that are compiled ----

# The implementation, with the header before, after and again, and what windows.h makes of four names.
cat > "$work/whole.c" <<'END'
#include "tlsph.h"
#define near
#define far
#define small char
#define interface struct
#define TLSPH_IMPLEMENTATION
#include "tlsph.h"
#include "tlsph.h"
END
# The declarations only, used by another unit; creation is what binds the precision.
cat > "$work/user.c" <<'END'
#include "tlsph.h"
#include "tlsph.h"
#include <stddef.h>
int main(void);
int main(void)
{
    tlsph_desc desc = tlsph_desc_default(3);
    tlsph_fill fill = tlsph_fill_default(3);
    tlsph_cloud cloud;
    tlsph_solver *solver = NULL;
    fill.size[0] = fill.size[1] = fill.size[2] = 1;
    fill.spacing = (tlsph_real)0.5;
    if (tlsph_cloud_create(&fill, &cloud, NULL)) return 1;
    if (tlsph_create(&desc, &solver, NULL) == TLSPH_OK) return 2; /* the description is empty */
    tlsph_cloud_destroy(&cloud);
    return solver != NULL;
}
END
# Another unit beside user.c.
cat > "$work/second.c" <<'END'
#include "tlsph.h"
tlsph_material second(void);
tlsph_material second(void) { return tlsph_material_default(TLSPH_MEE); }
END
# Everything in one unit.
{ echo '#define TLSPH_STATIC'; echo '#define TLSPH_IMPLEMENTATION'; cat "$work/user.c"; } > "$work/static.c"
# The program of the banner.
sed -n '/^    #define TLSPH_IMPLEMENTATION$/,/^    }$/p' tlsph.h > "$work/banner.c"
for unit in whole user second static; do cp "$work/$unit.c" "$work/$unit.cpp"; done

# ---- the checks: one line each, "name|command" ----

list="$work/list"
: > "$list"
skips="$work/skips"
: > "$skips"
ok() { printf "%s|%s\n" "$1" "$2" >> "$list"; }
skip() { echo "skip  $1" >> "$skips"; }
have() { command -v "$1" > /dev/null 2>&1; }

# compiler, language version, its own flags, file ending
matrix() {
    for precision in "" -DTLSPH_REAL_FLOAT; do
        for unit in whole static user; do
            ok "$1 $2 ${precision:-double} $unit" "$1 -std=$2 $3 $common $precision -fsyntax-only $work/$unit.$4"
        done
    done
}

cc=${CC:-cc}
banner() {
    ok "the banner's program runs$1" "test -s $work/banner.c && $cc -std=c99 $1 -Wall -Wextra -I$root $work/banner.c -lm -o $work/banner && $work/banner && $work/banner | grep -q 'kinetic energy'"
}
if [ "$optimised" ]; then
    for compiler in gcc clang; do
        have $compiler || { skip "no $compiler"; continue; }
        for build in -O2 "-O1 -DTLSPH_REAL_FLOAT"; do
            ok "$compiler $build" "$compiler -std=c99 $build $c_only $common -c $work/whole.c -o $work/$compiler$(echo "$build" | tr -d ' ').o"
        done
    done
    banner " -O1"
else
    # The longest first. For linking and nm; -fno-pic so that tables of pointers count as constant.
    ok "compile double" "$cc -std=c99 -O1 $c_only $common -fno-pic -c $work/whole.c -o $work/double.o"
    ok "compile float" "$cc -std=c99 -O0 -I$root -DTLSPH_REAL_FLOAT -c $work/whole.c -o $work/float.o"
    ok "one static unit links and runs" "$cc -std=c99 -O0 $common $work/static.c -lm -o $work/linked_static && $work/linked_static"
    banner
    for compiler in gcc clang; do
        have $compiler || { skip "no $compiler"; continue; }
        for version in c99 c11 c17; do matrix $compiler $version "$c_only" c; done
    done
    for compiler in g++ clang++; do
        have $compiler || { skip "no $compiler"; continue; }
        for version in c++11 c++20; do
            echo 'int main(){}' > "$work/probe.cpp"
            if $compiler -std=$version -fsyntax-only "$work/probe.cpp" 2> "$work/log"; then matrix $compiler $version "" cpp
            else skip "$compiler without $version"; fi
        done
    done
fi

# Checks the line of the list whose number it is given.
cat > "$work/one" <<'END'
line=$(sed -n "$2p" "$1/list")
name=${line%%|*} command=${line#*|}
if sh -c "$command" > "$1/log$2" 2>&1; then echo "ok    $name" > "$1/out$2"
else { echo "FAIL  $name: $command"; head -n 20 "$1/log$2"; } > "$1/out$2"; fi
END
phase() {
    numbers=$(awk '{ print NR }' "$list")
    echo "$numbers" | xargs -P 2 -n 1 sh "$work/one" "$work"
    for number in $numbers; do cat "$work/out$number"; done > "$work/out"
    cat "$work/out"
    cat "$work/out" >> "$work/results"
    : > "$list"
}
summary() {
    cat "$skips"
    passed=$(grep -c '^ok ' "$work/results")
    failed=$(grep -c '^FAIL ' "$work/results")
    skipped=$(grep -c . "$skips")
    echo "$passed passed, $failed failed, $skipped skipped"
    [ "$failed" -eq 0 ]
    exit
}
: > "$work/results"
phase
[ "$optimised" ] && summary

# ---- linking: needs the objects from above ----

link="$cc -std=c99 -O0 $common"
ok "two units link and run" "$link -no-pie $work/user.c $work/second.c $work/double.o -lm -o $work/linked && $work/linked"
ok "float units link and run" "$link -DTLSPH_REAL_FLOAT $work/user.c $work/second.c $work/float.o -lm -o $work/linked_float && $work/linked_float"
# The linker must complain, and about the name that binds the precision.
ok "float unit refuses a double library" "$link -DTLSPH_REAL_FLOAT -no-pie $work/user.c $work/double.o -lm -o $work/mixed_float 2>&1 | grep tlsph_create_float && test ! -e $work/mixed_float"
ok "double unit refuses a float library" "$link $work/user.c $work/float.o -lm -o $work/mixed_double 2>&1 | grep 'tlsph_create\b' && test ! -e $work/mixed_double"
if have g++; then
    ok "C++ unit with the C library" "g++ -std=c++11 -I$root -no-pie $work/user.cpp $work/double.o -lm -o $work/linked_cpp && $work/linked_cpp"
else skip "no g++ to link with"; fi

# ---- symbols of the double object ----

if have nm; then
    ok "exports what it declares" "nm $work/double.o | grep ' T tlsph_create\$' && nm $work/double.o | grep ' T tlsph_step\$'"
    # names that are exported: type T, D, B, R, C, ... in upper case but not U
    ok "exports only tlsph_ names" "! nm $work/double.o | awk '\$2 ~ /^[A-TV-Z]\$/ && \$3 !~ /^tlsph_/' | grep ."
    ok "holds no writable data" "! nm $work/double.o | awk '\$2 ~ /^[BbDdCcGgSs]\$/' | grep ."
    ok "does not print, exit or open files" "! nm -u $work/double.o | awk '{print \$NF}' | grep -vE '^(__)?v?snprintf(_chk)?\$' | grep -E 'printf|^(f?put(s|c|char)|putchar|f?write|fopen|exit|_exit|_Exit|abort|raise|__assert_fail|perror|getenv|rand|time|std(out|err))\$'"
else skip "no nm"; fi
phase
summary
