#!/usr/bin/env bash
# Makes the pictures of the README and the tutorial with flockreel: scripts/pictures.sh [PROGRAM]
set -euo pipefail
cd "$(dirname "$0")/.."
program=$(realpath "${1:-target/release/flockreel}")
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
mkdir -p docs

"$program" sample -o "$work/film.mp4" --truth "$work/truth.json"
"$program" analyze "$work/film.mp4" -o "$work/library"
"$program" flock "$work/library" -o "$work/flock.mp4"
"$program" fish "$work/library" -o "$work/fish.mp4" --side-by-side
"$program" matrix "$work/library" -o "$work/distance.png"

still() { ffmpeg -nostdin -v error -y -i "$1" -vf "select=eq(n\,$2)$4" -frames:v 1 -q:v 4 "docs/$3"; }
still "$work/film.mp4" 400 film.jpg ""
still "$work/flock.mp4" 300 flock.jpg ""
still "$work/fish.mp4" 400 fish.jpg ",scale=800:-2"
ffmpeg -nostdin -v error -y -i "$work/distance.png" -vf scale=360:-2 -q:v 4 docs/distance.jpg
ffmpeg -nostdin -v error -y -i "$work/library/transitions.svg" -vf scale=720:-2 -q:v 5 docs/transitions.jpg
ls -l docs
