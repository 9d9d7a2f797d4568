#!/bin/sh
# Creates a Python virtual environment with pinned packages, unless it exists with these packages.
#
#   scripts/venv.sh FOLDER REQUIREMENTS     such as target/page-venv tests/page/requirements.txt
set -eu
cd "$(dirname "$0")/.."

venv=$1
requirements=$2
if cmp -s "$requirements" "$venv/installed.txt"; then exit; fi
printf 'installing %s into %s\n' "$requirements" "$venv"
python3 -m venv --clear "$venv"
"$venv/bin/pip" install -q --disable-pip-version-check -r "$requirements"
cp "$requirements" "$venv/installed.txt"
