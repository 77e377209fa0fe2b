#!/bin/sh
# Lines and branches of tlsph.h that the tests took, by gcov; then the branches that none took, by function.
# Run from the repository's root after build/test_coverage has run. GCOV names the program.
out=build/obj/coverage/tlsph.gcov
${GCOV:-gcov} -b -t -o build/obj/coverage/tests tests/implementation.c > $out 2> /dev/null
awk '
/:Source:/ { header = /tlsph\.h$/ }
!header { next }
/^function / { name = $2; next }
/^branch/ { all++; of[name]++; if ($0 ~ /never executed|taken 0%/) { none++; un[name]++; where[name] = where[name] (line == last[name] ? "" : " " line); last[name] = line } next }
/^ *[0-9#=-]+\*?: *[0-9]+:/ { split($0, part, ":"); line = part[2] + 0; if (part[1] ~ /#/) skipped++; if (part[1] !~ /-/) lines++ }
END {
    for (name in un) printf "%4d of %4d  %-36s line%s\n", un[name], of[name], name, where[name] | "sort -rn"
    close("sort -rn")
    printf "result line_coverage %.2f %%\nresult branch_coverage %.2f %%  (%d of %d not taken)\n", 100 * (lines - skipped) / lines, 100 * (all - none) / all, none, all
}' $out
