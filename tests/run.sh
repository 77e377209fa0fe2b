#!/bin/sh
# Runs its arguments as commands, one after the other, and adds up their summaries. The last line of each must be
#     N passed, N failed[, N skipped]
# else (a crash, a failed build) it counts as one failure. The last line printed here is the total, in the same form.
#   --beside COMMAND    first: begins at once, beside the others, and is printed after them
# BUDGET=seconds: commands that would start later than that are skipped.
passed=0 failed=0 skipped=0
start=$(date +%s)
log=$(mktemp) || exit 1
trap 'rm -f "$log" "$log".*' EXIT

# Threads that wait must not take the processors from those that work.
export OMP_WAIT_POLICY="${OMP_WAIT_POLICY:-passive}"

run() { sh -c "$1" 2>&1; echo "$?" > "$2"; }

beside=
if [ "$1" = --beside ]; then
    beside=$2
    shift 2
    run "$beside" "$log.beside_code" > "$log.beside" &
    set -- "$@" "$beside"
fi

number() { echo " $summary" | sed -n "s/.* \([0-9][0-9]*\) $1.*/\1/p"; }

for command in "$@"; do
    echo "== $command"
    if [ -n "$BUDGET" ] && [ $(($(date +%s) - start)) -gt "$BUDGET" ]; then
        echo "skipped: no time left"
        skipped=$((skipped + 1))
        continue
    fi
    if [ "$command" = "$beside" ]; then
        wait
        code=$(cat "$log.beside_code")
        tee "$log" < "$log.beside"
    else
        run "$command" "$log.code" | tee "$log"
        code=$(cat "$log.code")
    fi
    summary=$(grep -v '^make' "$log" | tail -n 1 | grep -E '^[0-9]+ passed, [0-9]+ failed(, [0-9]+ skipped)?$')
    if [ -z "$summary" ]; then
        echo "FAIL $command: ended without a summary, exit code $code"
        failed=$((failed + 1))
        continue
    fi
    failures=$(number failed)
    [ "$code" -ne 0 ] && [ "$failures" -eq 0 ] && failures=1 # the exit code counts, too
    passed=$((passed + $(number passed)))
    failed=$((failed + failures))
    more=$(number skipped)
    skipped=$((skipped + ${more:-0}))
done
echo "== $(($(date +%s) - start)) s in all"
echo "$passed passed, $failed failed, $skipped skipped"
[ "$failed" -eq 0 ]
