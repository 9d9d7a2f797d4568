#!/bin/sh
# Runs schemathesis over the OpenAPI document of a really started service (RELIABILITY.md, H6), from a pinned virtual
# environment under target/: no 5xx, no answer that the document does not name. Fails, saying why, when the
# environment cannot be had; FLOCKREEL_SKIP=contract leaves it out.
#
#   scripts/contract-tests.sh PROGRAM     the flockreel program to test
set -eu
cd "$(dirname "$0")/.."

program=$1
venv=target/contract-venv
requirements=tests/contract/requirements.txt

# What did not run is not well: only who says so goes without.
missing() {
    printf 'contract tests: CANNOT RUN, %s; FLOCKREEL_SKIP=contract leaves them out\n' "$1" >&2
    exit 1
}

case " ${FLOCKREEL_SKIP:-} " in
    *" contract "*)
        printf 'contract tests: SKIPPED, as FLOCKREEL_SKIP asks\n'
        exit 0
        ;;
esac

scripts/system-packages.sh contract-test || missing "python3-venv cannot be installed here"
if ! cmp -s "$requirements" "$venv/installed.txt"; then
    printf 'contract tests: installing %s into %s\n' "$requirements" "$venv"
    python3 -m venv --clear "$venv" || missing "a virtual environment cannot be made here"
    "$venv/bin/pip" install -q --disable-pip-version-check -r "$requirements" || missing "its requirements cannot be installed here"
    cp "$requirements" "$venv/installed.txt"
fi
exec "$venv/bin/python" -B tests/contract/run.py "$program"
