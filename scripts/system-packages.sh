#!/bin/sh
# Installs the Debian packages that flockreel needs and that are missing. `make`, the Dockerfile and CI share
# this list.
#
#   scripts/system-packages.sh GROUP...     GROUP: build | vendor | run | health | test | scale-test |
#                                           truth-test | readers-test | page-test | screenshots | contract-test | fuzz |
#                                           bench | arm-test
#
# Prints the packages that it installs. Uses sudo if it does not run as root. Exits with 1 if a package is
# still missing afterwards.
set -eu

# One requirement per line: group, command that must exist, packages that provide it.
needs() {
    cat <<'LIST'
build     cc        gcc libc6-dev
vendor    python3   python3-venv
run       ffmpeg    ffmpeg
run       ffprobe   ffmpeg
health    curl      curl
test      cc        gcc libc6-dev
test      ffmpeg    ffmpeg
test      ffprobe   ffmpeg
test      strace    strace
scale-test initdb   postgresql
scale-test python3  python3-venv
scale-test openssl  openssl
truth-test python3  python3-venv
truth-test ffmpeg   ffmpeg
readers-test python3 python3-venv
readers-test ffmpeg ffmpeg
page-test python3   python3-venv
page-test ffmpeg    ffmpeg
contract-test python3 python3-venv
contract-test ffmpeg  ffmpeg
fuzz      c++       g++
fuzz      ffmpeg    ffmpeg
fuzz      ffprobe   ffmpeg
bench     wrk       wrk
bench     nginx     nginx-light
bench     curl      curl
page-test chromium  chromium
screenshots /usr/share/fonts/opentype/ipafont-gothic/ipag.ttf fonts-ipafont-gothic
arm-test  aarch64-linux-gnu-gcc gcc-aarch64-linux-gnu
arm-test  /usr/aarch64-linux-gnu/lib/libc.so.6 libc6-dev-arm64-cross
arm-test  qemu-aarch64 qemu-user
LIST
}

say() { printf 'system packages: %s\n' "$*"; }

has() {
    case $1 in
        # Debian packages the venv module separately from the interpreter.
        python3) command -v python3 >/dev/null && python3 -c 'import ensurepip, venv' 2>/dev/null ;;
        # Debian keeps the programs of the server outside PATH, in one folder per version.
        initdb) ls /usr/lib/postgresql/*/bin/initdb >/dev/null 2>&1 ;;
        /*) [ -e "$1" ] ;;
        *) command -v "$1" >/dev/null ;;
    esac
}

# Prints the packages of the given groups whose command is missing, each once.
missing_packages() {
    needs | while read -r group command package; do
        for wanted in "$@"; do
            if [ "$wanted" = "$group" ] && ! has "$command"; then echo "$package"; fi
        done
    done | sort -u | tr '\n' ' '
}

as_root() {
    if [ "$(id -u)" -eq 0 ]; then "$@"; else sudo "$@"; fi
}

if [ $# -eq 0 ]; then
    say "no group given; see the head of this script" >&2
    exit 2
fi

packages=$(missing_packages "$@")
if [ -z "$packages" ]; then exit 0; fi

if ! command -v apt-get >/dev/null; then
    say "this system has no apt-get; install by its own package manager: $packages" >&2
    exit 1
fi
if [ "$(id -u)" -ne 0 ] && ! command -v sudo >/dev/null; then
    say "neither root nor sudo here; ask an administrator to install: $packages" >&2
    exit 1
fi

say "installing by apt-get: $packages"
as_root env DEBIAN_FRONTEND=noninteractive apt-get update -q
# shellcheck disable=SC2086 # a list of words on purpose
as_root env DEBIAN_FRONTEND=noninteractive apt-get install -q -y --no-install-recommends $packages

packages=$(missing_packages "$@")
if [ -n "$packages" ]; then
    say "still missing after the installation: $packages" >&2
    exit 1
fi
say "done"
