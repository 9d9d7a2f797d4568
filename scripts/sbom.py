#!/usr/bin/env python3
"""Writes the bill of materials of the program in the format CycloneDX 1.6: every crate and every library of the page
that is built into it, with version, licence and hash, and what depends on what. Test and build tools of the page are
left out.

    scripts/sbom.py target/sbom.json        equal sources give equal bytes
"""
import base64
import json
import re
import subprocess
import sys
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
TARGET = "x86_64-unknown-linux-gnu"


def purl(kind, name, version):
    """Returns the package URL. A scope such as `@types` has its sign encoded."""
    return f"pkg:{kind}/{name.replace('@', '%40')}@{version}"


def component(kind, name, version, licence, algorithm=None, digest=None):
    reference = purl(kind, name, version)
    found = {"type": "library", "bom-ref": reference, "name": name, "version": version, "purl": reference}
    if licence:
        found["licenses"] = [{"expression": re.sub(r"\s*/\s*", " OR ", licence)}]
    else:
        print(f"sbom: the package states no licence: {name} {version}")
    if digest:
        found["hashes"] = [{"alg": algorithm, "content": digest}]
    return found


def crates():
    """Returns the program, the crates built into it, and the dependencies of each."""
    command = ["cargo", "metadata", "--locked", "--format-version", "1", "--filter-platform", TARGET]
    metadata = json.loads(subprocess.run(command, cwd=ROOT, check=True, capture_output=True).stdout)
    packages = {package["id"]: package for package in metadata["packages"]}
    nodes = {node["id"]: node for node in metadata["resolve"]["nodes"]}
    lock = tomllib.loads((ROOT / "Cargo.lock").read_text())
    digests = {(one["name"], one["version"]): one.get("checksum") for one in lock["package"]}

    def used(identity):
        return [dep["pkg"] for dep in nodes[identity]["deps"]
                if any(kind["kind"] in (None, "build") for kind in dep["dep_kinds"])]

    root = metadata["resolve"]["root"]
    reached, waiting = {root}, [root]
    while waiting:
        new = set(used(waiting.pop())) - reached
        reached |= new
        waiting += sorted(new)

    def reference(identity):
        return purl("cargo", packages[identity]["name"], packages[identity]["version"])

    found, dependencies = [], []
    for identity in reached:
        package = packages[identity]
        name, version = package["name"], package["version"]
        found.append(component("cargo", name, version, package["license"], "SHA-256", digests[name, version]))
        dependencies.append({"ref": reference(identity), "dependsOn": sorted(map(reference, used(identity)))})
    return reference(root), found, dependencies


def page_libraries():
    """Returns the libraries of the page, which the program embeds."""
    lock = json.loads((ROOT / "web/package-lock.json").read_text())
    found = []
    for path, package in lock["packages"].items():
        name = path.rpartition("node_modules/")[2]
        if not name or package.get("dev"):
            continue
        algorithm, _, digest = package["integrity"].partition("-")
        algorithm = re.sub(r"sha(\d+)", r"SHA-\1", algorithm)
        digest = base64.b64decode(digest).hex()
        found.append(component("npm", name, package["version"], package.get("license"), algorithm, digest))
    return found


def main():
    output = Path(sys.argv[1])
    root, found, dependencies = crates()
    libraries = page_libraries()
    by_reference = {one["bom-ref"]: one for one in found + libraries}
    program = by_reference.pop(root) | {"type": "application"}
    for dependency in dependencies:
        if dependency["ref"] == root:
            dependency["dependsOn"] += sorted(one["bom-ref"] for one in libraries)
    bill = {"bomFormat": "CycloneDX", "specVersion": "1.6", "version": 1, "metadata": {"component": program},
            "components": [by_reference[reference] for reference in sorted(by_reference)],
            "dependencies": sorted(dependencies, key=lambda one: one["ref"])}
    output.parent.mkdir(parents=True, exist_ok=True)
    output.write_text(json.dumps(bill, indent=1) + "\n")
    print(f"sbom: {len(by_reference)} components, {len(libraries)} of them of the page: {output}")


main()
