#!/bin/sh
# Runs tests/truth: the ground truth of a flock read by pycocotools and TrackEval, from a pinned virtual
# environment under target/. Skips, saying why, only when that environment cannot be had.
#
#   scripts/truth-tests.sh PROGRAM     the flockreel program to test
set -eu
cd "$(dirname "$0")/.."

program=$1
venv=target/truth-venv
requirements=tests/truth/requirements.txt

skip() {
    printf 'truth tests: SKIPPED, %s\n' "$1"
    exit 0
}

scripts/system-packages.sh truth-test || skip "python3-venv cannot be installed here"
if ! cmp -s "$requirements" "$venv/installed.txt"; then
    printf 'truth tests: installing %s into %s\n' "$requirements" "$venv"
    python3 -m venv --clear "$venv" || skip "a virtual environment cannot be made here"
    "$venv/bin/pip" install -q --disable-pip-version-check -r "$requirements" || skip "its requirements cannot be installed here"
    cp "$requirements" "$venv/installed.txt"
fi
FLOCKREEL_PROGRAM=$program exec "$venv/bin/python" -B -m pytest -q -p no:cacheprovider -W ignore::DeprecationWarning tests/truth
