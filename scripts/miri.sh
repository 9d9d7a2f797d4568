#!/bin/sh
# Runs tests of the algorithms' `unsafe` code under Miri, an interpreter that finds undefined behaviour. Needs the
# nightly toolchain with its component `miri`. Exits with 3 if this machine has none.
#
#   scripts/miri.sh [TEST...]
set -eu
cd "$(dirname "$0")/.."

cargo=${CARGO:-cargo}
if ! "$cargo" +nightly miri --version >/dev/null 2>&1; then
    echo "miri: CANNOT run: rustup toolchain install nightly --component miri" >&2
    exit 3
fi
# The library of random cases asks for the folder, which Miri hides by default. Few cases, because each is slow.
export MIRIFLAGS=-Zmiri-disable-isolation PROPTEST_CASES=2
[ $# -gt 0 ] || set -- raster:: similarity::kernel:: plan::range_costs:: plan::lanes::
# Miri has no inline assembly, so libm computes without it.
exec "$cargo" +nightly miri test --quiet --locked --package flockreel-core --lib --features libm/force-soft-floats \
    --target-dir target/miri -- "$@"
