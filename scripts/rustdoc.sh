#!/bin/sh
# Runs rustdoc for `cargo test --doc`, which names it in RUSTDOC. Before the tests of a crate it writes its documentation
# from the same compiled libraries to target/doc, with warnings as errors. `cargo doc` would first check all
# dependencies again, which takes longer than everything else that it does.
set -eu

case " $* " in
*" --test "*) ;;
*) exec rustdoc "$@" ;;
esac

# Repeats the arguments without those of tests.
document() {
    n=$#
    while [ "$n" -gt 0 ]; do
        case $1 in
        --test) ;;
        --test-run-directory) shift && n=$((n - 1)) ;;
        *) set -- "$@" "$1" ;;
        esac
        shift
        n=$((n - 1))
    done
    rustdoc "$@" --document-private-items -D warnings --out-dir "$(dirname "$0")/../target/doc"
}
document "$@"
exec rustdoc "$@"
