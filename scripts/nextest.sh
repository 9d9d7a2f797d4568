#!/bin/sh
# Runs the Rust tests with cargo-nextest of scripts/tools.txt, and prints the slowest.
#
#   scripts/nextest.sh [ARGUMENT...]     arguments of `cargo nextest run`, such as -E 'test(boids)'
set -eu
cd "$(dirname "$0")/.."
scripts/system-packages.sh vendor
scripts/venv.sh target/tools-venv scripts/tools.txt
profile=default
case " $* " in *" --profile scale "*) profile=scale ;; esac
end=0
PATH=$PWD/target/tools-venv/bin:$PATH cargo nextest run --locked --workspace "$@" || end=$?
report=target/nextest/$profile/junit.xml
if [ -f "$report" ]; then python3 -B scripts/slowest.py "$report"; fi
exit $end
