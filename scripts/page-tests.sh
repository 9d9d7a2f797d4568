#!/bin/sh
# Runs tests/page against a server of its own, in Debian's chromium, from a pinned virtual environment
# under target/. Skips, saying why, only when the browser or the environment cannot be had.
#
#   scripts/page-tests.sh PROGRAM     the flockreel program to test
set -eu
cd "$(dirname "$0")/.."

program=$1
venv=target/venv
requirements=tests/page/requirements.txt

skip() {
    printf 'page tests: SKIPPED, %s\n' "$1"
    exit 0
}

scripts/system-packages.sh page-test || skip "chromium or python3-venv cannot be installed here"
if ! cmp -s "$requirements" "$venv/installed.txt"; then
    printf 'page tests: installing %s into %s\n' "$requirements" "$venv"
    python3 -m venv --clear "$venv" || skip "a virtual environment cannot be made here"
    "$venv/bin/pip" install -q --disable-pip-version-check -r "$requirements" || skip "its requirements cannot be installed here"
    cp "$requirements" "$venv/installed.txt"
fi
FLOCKREEL_PROGRAM=$program exec "$venv/bin/python" -B -m pytest -q -p no:cacheprovider tests/page
