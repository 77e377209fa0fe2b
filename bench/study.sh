#!/bin/sh
# usage: bench/study.sh SECONDS [--full]: passes of the study in both precisions in turn, two at least and more while they
# fit into the time, then the report
seconds=$1
shift
begin=$(date +%s)
passes=0
rm -f out/bench/runs.csv
while :; do
    build/study "$@" && build/study_float "$@" || exit 1
    passes=$((passes + 1))
    now=$(date +%s)
    [ $passes -ge 2 ] && [ $(((now - begin) * (passes + 1) / passes)) -gt "$seconds" ] && break
done
echo "study: $passes passes in $((now - begin)) s"
exec build/study --report
