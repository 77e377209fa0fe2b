#!/bin/sh
# usage: bench/study.sh SECONDS [--full]: passes of the study in both precisions in turn, one at least and as many more as
# fit into the time, then the report
seconds=$1
shift
begin=$(date +%s)
passes=0
rm -f out/bench/runs.csv
while :; do
    build/study "$@" && build/study_float "$@" || exit 1
    passes=$((passes + 1))
    elapsed=$(($(date +%s) - begin))
    [ $((elapsed * (passes + 1) / passes)) -gt "$seconds" ] && break
done
echo "study: $passes passes in $elapsed s"
exec build/study --report
