#!/bin/sh
# Runs cargo-deny on the dependencies, by the rules of deny.toml. Installs it into target/tools if the machine has none:
# about six minutes on two cores, once. Fails if it cannot be installed.
#
#   scripts/cargo-deny.sh licences      licences, bans and sources, offline
#   scripts/cargo-deny.sh advisories    known weaknesses. The database is the git repository in ADVISORY_DB (an absolute
#                                       path), else it is fetched. Exits with 3 if it cannot be fetched.
set -eu
cd "$(dirname "$0")/.."

version=0.20.2
tools=target/tools
cargo=${CARGO:-cargo}

say() { printf 'cargo deny: %s\n' "$*"; }

find_deny() {
    if [ -x "$tools/bin/cargo-deny" ] && [ "$("$tools/bin/cargo-deny" --version)" = "cargo-deny $version" ]; then
        deny=$tools/bin/cargo-deny
    elif command -v cargo-deny >/dev/null; then
        deny=cargo-deny
    else
        return 1
    fi
}

# The program runs for seconds, so it is built to compile fast. RUSTFLAGS of the caller would build it again.
install() {
    say "installing cargo-deny $version into $tools"
    env -u RUSTFLAGS -u CARGO_TARGET_DIR CARGO_PROFILE_RELEASE_OPT_LEVEL=1 CARGO_PROFILE_RELEASE_LTO=off \
        CARGO_PROFILE_RELEASE_CODEGEN_UNITS=16 CARGO_PROFILE_RELEASE_DEBUG=false \
        "$cargo" install --quiet --locked --root "$tools" --target-dir "$tools/build" "cargo-deny@$version"
    rm -rf "$tools/build"
}

# cargo-deny fetches the database by git, which takes the address of the copy instead.
advisories() {
    log=$tools/advisories.log
    mkdir -p "$tools"
    if [ -n "${ADVISORY_DB:-}" ]; then
        say "database of advisories: $ADVISORY_DB"
        export GIT_CONFIG_COUNT=1 GIT_CONFIG_KEY_0="url.file://$ADVISORY_DB.insteadOf"
        export GIT_CONFIG_VALUE_0=https://github.com/RustSec/advisory-db
    fi
    if "$deny" --log-level error check advisories >"$log" 2>&1; then
        cat "$log"
    elif [ -z "${ADVISORY_DB:-}" ] && grep -q "failed to fetch advisory database" "$log"; then
        say "CANNOT check advisories: their database cannot be fetched here; ADVISORY_DB=folder names a copy" >&2
        exit 3
    else
        cat "$log" >&2
        exit 1
    fi
}

find_deny || { install && find_deny; } || { say "cannot be installed: cargo install cargo-deny@$version" >&2; exit 1; }
case ${1:-licences} in
licences)
    # Those of other systems too, which a build here does not need.
    "$cargo" fetch --quiet --locked
    "$deny" --offline --log-level error check bans licenses sources
    ;;
advisories) advisories ;;
*) say "no such check: $1" >&2; exit 2 ;;
esac
