#!/bin/sh
# Runs schemathesis over the OpenAPI document of a really started service (RELIABILITY.md, H6), from a pinned virtual
# environment under target/: no 5xx, no answer that the document does not name. Skips, saying why, only when the
# environment cannot be had.
#
#   scripts/contract-tests.sh PROGRAM     the flockreel program to test
set -eu
cd "$(dirname "$0")/.."

program=$1
venv=target/contract-venv
requirements=tests/contract/requirements.txt

skip() {
    printf 'contract tests: SKIPPED, %s\n' "$1"
    exit 0
}

scripts/system-packages.sh contract-test || skip "python3-venv cannot be installed here"
if ! cmp -s "$requirements" "$venv/installed.txt"; then
    printf 'contract tests: installing %s into %s\n' "$requirements" "$venv"
    python3 -m venv --clear "$venv" || skip "a virtual environment cannot be made here"
    "$venv/bin/pip" install -q --disable-pip-version-check -r "$requirements" || skip "its requirements cannot be installed here"
    cp "$requirements" "$venv/installed.txt"
fi
exec "$venv/bin/python" -B tests/contract/run.py "$program"
