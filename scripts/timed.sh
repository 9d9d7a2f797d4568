#!/bin/sh
# Runs a command and prints how long it took.
#
#   scripts/timed.sh TARGET COMMAND...     TARGET: the target of the Makefile
set -eu
target=$1
shift
printf '== make %s: %s\n' "$target" "$*"
began=$(date +%s)
end=0
"$@" || end=$?
printf '== make %s: %s, %d s\n' "$target" "$([ $end -eq 0 ] && echo ok || echo FAILED)" "$(($(date +%s) - began))"
exit $end
