#!/bin/sh
# Runs tests/truth: the ground truth of a flock read by pycocotools and TrackEval, from a pinned virtual
# environment under target/. Fails, saying why, when that environment cannot be had;
# FLOCKREEL_SKIP=truth leaves it out.
#
#   scripts/truth-tests.sh PROGRAM     the flockreel program to test
set -eu
cd "$(dirname "$0")/.."

program=$1
venv=target/truth-venv
requirements=tests/truth/requirements.txt

# What did not run is not well: only who says so goes without.
missing() {
    printf 'truth tests: CANNOT RUN, %s; FLOCKREEL_SKIP=truth leaves them out\n' "$1" >&2
    exit 1
}

case " ${FLOCKREEL_SKIP:-} " in
    *" truth "*)
        printf 'truth tests: SKIPPED, as FLOCKREEL_SKIP asks\n'
        exit 0
        ;;
esac

scripts/system-packages.sh truth-test || missing "python3-venv cannot be installed here"
if ! cmp -s "$requirements" "$venv/installed.txt"; then
    printf 'truth tests: installing %s into %s\n' "$requirements" "$venv"
    python3 -m venv --clear "$venv" || missing "a virtual environment cannot be made here"
    "$venv/bin/pip" install -q --disable-pip-version-check -r "$requirements" || missing "its requirements cannot be installed here"
    cp "$requirements" "$venv/installed.txt"
fi
FLOCKREEL_PROGRAM=$program exec "$venv/bin/python" -B -m pytest -q -p no:cacheprovider -W ignore::DeprecationWarning tests/truth
