#!/bin/sh
# Runs the tests that are written in Python, each kind from a pinned virtual environment under target/. Fails, saying
# why, when what they need cannot be had; FLOCKREEL_SKIP="page contract truth" leaves out the kinds it names.
#
#   scripts/python-tests.sh KIND PROGRAM     the flockreel program to test, and of it
#       truth       tests/truth: the ground truth of a flock read by pycocotools and TrackEval
#       page        tests/page: the page against a server of its own, in Debian's chromium
#       contract    tests/contract: schemathesis over the OpenAPI document of a really started service
#                   (RELIABILITY.md, H6): no 5xx, no answer that the document does not name
set -eu
cd "$(dirname "$0")/.."

kind=$1
program=$2
venv=target/$kind-venv

# What did not run is not well: only who says so goes without.
missing() {
    printf '%s tests: CANNOT RUN, %s; FLOCKREEL_SKIP=%s leaves them out\n' "$kind" "$1" "$kind" >&2
    exit 1
}

case " ${FLOCKREEL_SKIP:-} " in
    *" $kind "*)
        printf '%s tests: SKIPPED, as FLOCKREEL_SKIP asks\n' "$kind"
        exit 0
        ;;
esac

scripts/system-packages.sh "$kind-test" || missing "the system packages that they need cannot be installed here"
scripts/venv.sh "$venv" "tests/$kind/requirements.txt" || missing "their virtual environment cannot be had here"
export FLOCKREEL_PROGRAM="$program"
case $kind in
contract) set -- tests/contract/run.py "$program" ;;
truth) set -- -m pytest -q -p no:cacheprovider -W ignore::DeprecationWarning tests/truth ;;
*) set -- -m pytest -q -p no:cacheprovider "tests/$kind" ;;
esac
exec "$venv/bin/python" -B "$@"
