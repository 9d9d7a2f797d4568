#!/bin/sh
# Makes a virtual environment of Python under target/ with pinned packages, or leaves it as it is where it has them.
#
#   scripts/venv.sh FOLDER REQUIREMENTS     target/page-venv tests/page/requirements.txt
set -eu
cd "$(dirname "$0")/.."

venv=$1
requirements=$2
if cmp -s "$requirements" "$venv/installed.txt"; then exit; fi
printf 'installing %s into %s\n' "$requirements" "$venv"
python3 -m venv --clear "$venv"
"$venv/bin/pip" install -q --disable-pip-version-check -r "$requirements"
cp "$requirements" "$venv/installed.txt"
