#!/bin/sh
# Runs the tests written in Python, and those of the page's modules in node. Each kind has a virtual
# environment with pinned packages below target/. Fails with a reason if a requirement cannot be installed.
# FLOCKREEL_SKIP="page contract truth" skips the named kinds.
#
#   scripts/python-tests.sh KIND PROGRAM     PROGRAM: the flockreel program to test; KIND:
#       truth       tests/truth: reads the ground truth of flocks and data sets with pycocotools and TrackEval
#       readers     tests/readers: reads keypoints and data sets with movement, sleap-io and the label check of
#                   ultralytics; their packages take 2 GB
#       page        tests/page-js: tests the page's modules in node; tests/page: tests the page of a running
#                   service in Debian's chromium
#       contract    tests/contract: runs schemathesis on the OpenAPI document of a running service; no
#                   response has a 5xx status or is undocumented (docs/explanation/promises.md, "Contract")
set -eu
cd "$(dirname "$0")/.."

kind=$1
program=$2
venv=target/$kind-venv

# Tests that cannot run count as failed, unless the caller skips them.
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
readers)
    # Of ultralytics only the check of labels is needed, and the package would install PyTorch.
    export FLOCKREEL_WHEELS="target/readers-wheels"
    [ -e "$FLOCKREEL_WHEELS/ready" ] ||
        "$venv/bin/python" -m pip download -q --no-deps -d "$FLOCKREEL_WHEELS" ultralytics==8.4.190 ||
        missing "the wheel of ultralytics cannot be had here"
    touch "$FLOCKREEL_WHEELS/ready"
    set -- -m pytest -q -p no:cacheprovider -W ignore::DeprecationWarning tests/readers
    ;;
truth) set -- -m pytest -q -p no:cacheprovider -W ignore::DeprecationWarning tests/truth ;;
page)
    # `make vendor` installs node from a wheel if the machine has none.
    PATH=$PATH:$PWD/target/node-venv/bin
    command -v node >/dev/null || missing "node could not be had"
    node --test tests/page-js/*.test.mjs
    # CI leaves out the tests marked as thorough, to stay within half an hour.
    set -- -m pytest -q -p no:cacheprovider --show-capture=no tests/page ${CI:+-m "not thorough"}
    ;;
*) missing "no tests have this name" ;;
esac
exec "$venv/bin/python" -B "$@"
