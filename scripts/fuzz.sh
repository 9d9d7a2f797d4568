#!/bin/sh
# Runs fuzz targets under libFuzzer, with the stable compiler. An input that panics, aborts, maps too much memory or takes
# more than 20 s ends its target; it is kept in fuzz/artifacts. The mutations follow from the seed 1.
#
#   scripts/fuzz.sh [TARGET...]     FUZZ_SECONDS=60: time for each target, by default all of fuzz/fuzz_targets
#
# After a fault is mended, its input goes to fuzz/corpus/TARGET, where the tests replay it. Inputs that reach new code are
# kept in target/fuzz/corpus.
set -eu
cd "$(dirname "$0")/.."

scripts/system-packages.sh fuzz
seconds=${FUZZ_SECONDS:-60}
host=$(rustc -vV | sed -n 's/^host: //p')
if [ $# -eq 0 ]; then
    for file in fuzz/fuzz_targets/*.rs; do set -- "$@" "$(basename "$file" .rs)"; done
fi
bins=$(for target in "$@"; do printf ' --bin %s' "$target"; done)

# The flags with which cargo-fuzz builds without a sanitizer. Sanitizers need a nightly compiler.
coverage="-Cpasses=sancov-module -Cllvm-args=-sanitizer-coverage-level=4
    -Cllvm-args=-sanitizer-coverage-inline-8bit-counters -Cllvm-args=-sanitizer-coverage-pc-table
    -Cllvm-args=-sanitizer-coverage-trace-compares --cfg=fuzzing"
# The versions of the workspace. Cargo adds those of libFuzzer.
cp Cargo.lock fuzz/Cargo.lock
# shellcheck disable=SC2086 # lists of words on purpose
RUSTFLAGS=$(echo $coverage) ${CARGO:-cargo} build --release --manifest-path fuzz/Cargo.toml --target "$host" \
    --target-dir target/fuzz $bins

# Targets write folders with small files. In memory they cost no time of the disk.
memory=/dev/shm
if [ ! -w "$memory" ]; then memory=/tmp; fi
TMPDIR=$(mktemp -d "$memory/flockreel-fuzz.XXXXXX")
# Threads reserve address space, which is limited, for stacks and arenas.
export TMPDIR MALLOC_ARENA_MAX=2 RAYON_NUM_THREADS=2
trap 'rm -rf "$TMPDIR"' EXIT

faults=
for target in "$@"; do
    kept=target/fuzz/corpus/$target
    mkdir -p "$kept" "fuzz/artifacts/$target"
    printf 'fuzz %s: ' "$target"
    # The program ends with a status other than 0 at the first fault.
    if "target/fuzz/$host/release/$target" "$kept" "fuzz/corpus/$target" -seed=1 -max_total_time="$seconds" -timeout=20 \
        -max_len=65536 -rss_limit_mb=3072 -artifact_prefix="fuzz/artifacts/$target/" -dict=fuzz/dictionary.txt \
        -print_final_stats=1 >"target/fuzz/$target.log" 2>&1; then
        awk '/number_of_executed_units/ { n = $2 } /cov: / { sub(/.*cov: /, ""); cov = $1 }
            END { print n " inputs, " cov " edges" }' "target/fuzz/$target.log"
    else
        faults="$faults $target"
        echo "FAULT, see target/fuzz/$target.log"
        grep -a 'panicked at' -A 2 "target/fuzz/$target.log" | head -n 4 || true
        grep -a 'Test unit written' "target/fuzz/$target.log" || true
    fi
    rm -rf "${TMPDIR:?}"/*
done
if [ -n "$faults" ]; then
    echo "fuzz: faults in$faults"
    exit 1
fi
