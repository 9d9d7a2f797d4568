#!/bin/sh
# Runs cargo-deny on the dependencies, by the rules of deny.toml. Its program comes from scripts/tools.txt.
#
#   scripts/cargo-deny.sh licences      licences, bans and sources, offline
#   scripts/cargo-deny.sh advisories    known weaknesses. The database is the git repository in ADVISORY_DB (an absolute
#                                       path), else it is fetched. Exits with 3 if it cannot be fetched.
set -eu
cd "$(dirname "$0")/.."

say() { printf 'cargo deny: %s\n' "$*"; }

scripts/system-packages.sh vendor
scripts/venv.sh target/tools-venv scripts/tools.txt
deny=target/tools-venv/bin/cargo-deny

# cargo-deny fetches the database by git, which takes the address of the copy instead.
advisories() {
    log=target/advisories.log
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

case ${1:-licences} in
licences)
    # Those of other systems too, which a build here does not need.
    "${CARGO:-cargo}" fetch --quiet --locked
    "$deny" --offline --log-level error check bans licenses sources
    ;;
advisories) advisories ;;
*) say "no such check: $1" >&2; exit 2 ;;
esac
