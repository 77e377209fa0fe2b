#!/bin/sh
# usage: bench/study.sh SECONDS [--full]: passes of the study in both precisions in turn, two at least and more while they
# fit into the time, then the report
begin=$(date +%s)
passes=0
rm -f out/bench/runs.csv
while :; do
    build/study $2 && build/study_float $2 || exit 1
    passes=$((passes + 1))
    now=$(date +%s)
    [ $passes -ge 2 ] && [ $(((now - begin) * (passes + 1) / passes)) -gt "$1" ] && break
done
echo "study: $passes passes in $((now - begin)) s"
exec build/study --report
