#!/bin/sh
# Runs tests/page against a server of its own, in Debian's chromium, from a pinned virtual environment
# under target/. Fails, saying why, when the browser or the environment cannot be
# had; FLOCKREEL_SKIP=page leaves it out.
#
#   scripts/page-tests.sh PROGRAM     the flockreel program to test
set -eu
cd "$(dirname "$0")/.."

program=$1
venv=target/venv
requirements=tests/page/requirements.txt

# What did not run is not well: only who says so goes without.
missing() {
    printf 'page tests: CANNOT RUN, %s; FLOCKREEL_SKIP=page leaves them out\n' "$1" >&2
    exit 1
}

case " ${FLOCKREEL_SKIP:-} " in
    *" page "*)
        printf 'page tests: SKIPPED, as FLOCKREEL_SKIP asks\n'
        exit 0
        ;;
esac

scripts/system-packages.sh page-test || missing "chromium or python3-venv cannot be installed here"
if ! cmp -s "$requirements" "$venv/installed.txt"; then
    printf 'page tests: installing %s into %s\n' "$requirements" "$venv"
    python3 -m venv --clear "$venv" || missing "a virtual environment cannot be made here"
    "$venv/bin/pip" install -q --disable-pip-version-check -r "$requirements" || missing "its requirements cannot be installed here"
    cp "$requirements" "$venv/installed.txt"
fi
FLOCKREEL_PROGRAM=$program exec "$venv/bin/python" -B -m pytest -q -p no:cacheprovider tests/page
