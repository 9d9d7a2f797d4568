#!/usr/bin/env python3
"""Checks the types of the page's modules with tsc, against types made from the OpenAPI document of a running service.

    scripts/page-types.py target/debug/flockreel

Writes target/page-types/openapi.d.ts. web/declarations has the short names of those types, and types of files that the
document does not describe. Needs the packages of web/package.json, which `make vendor` installs below target/web.
FLOCKREEL_SKIP="page" skips the check.
"""
import os
import subprocess
import sys
import tempfile
import urllib.request
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests"))
from service import started  # noqa: E402

TYPES = ROOT / "target/page-types"
PACKAGES = ROOT / "target/web/node_modules"
# `make vendor` installs node from a wheel if the machine has none.
ENVIRONMENT = {**os.environ, "PATH": f"{os.environ['PATH']}:{ROOT}/target/node-venv/bin"}


def node(script, *arguments):
    """Runs a script of an npm package and returns its exit status."""
    return subprocess.run(["node", PACKAGES / script, *arguments], cwd=ROOT, env=ENVIRONMENT, check=False).returncode


def main(program):
    if "page" in os.environ.get("FLOCKREEL_SKIP", "").split():
        print("page types: SKIPPED, as FLOCKREEL_SKIP asks")
        return 0
    if not (PACKAGES / "typescript").is_dir():
        print("page types: CANNOT RUN, the packages of web/package.json could not be had; FLOCKREEL_SKIP=page leaves them out", file=sys.stderr)
        return 1
    TYPES.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as data, started(Path(program).resolve(), data, "--log", "error") as address:
        with urllib.request.urlopen(f"{address}/openapi.json") as answer:
            (TYPES / "openapi.json").write_bytes(answer.read())
    # A property with a default may be left out of a request.
    flags = ["--default-non-nullable=false", "-o", TYPES / "openapi.d.ts"]
    return node("openapi-typescript/bin/cli.js", TYPES / "openapi.json", *flags) or node("typescript/bin/tsc", "-p", "web")


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
