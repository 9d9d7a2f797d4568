#!/usr/bin/env python3
"""Measures the time from a change of one line until the tests can run, in this checkout and in an older commit.

    bench/rebuild.py COMMIT

For each file, the script adds a function, builds the tests, and restores the file. The table has the number of source
lines in the packages that Cargo compiled, with their tests. The older commit is checked out and built in a temporary folder.
"""
import json, pathlib, statistics, subprocess, sys, tempfile, time

import measurements
from service import machine

ROOT = pathlib.Path(__file__).resolve().parents[1]
N_RUNS = 3
# Name of the change; the file and the test options in this checkout; the file and the test options in a commit from
# before the algorithms became a package.
CHANGES = [
    ("a handler of the API", "src/api/paging.rs", ["--lib", "--test", "it"], "src/api/paging.rs", ["--lib", "--test", "it"]),
    ("the path of the animal", "crates/flockreel-core/src/analysis/track/path.rs", ["-p", "flockreel-core", "--lib"],
     "src/analysis/track/path.rs", ["--lib"]),
]


def build(folder, tests):
    """Builds tests. Returns the seconds and the folders of the packages that were compiled."""
    began = time.monotonic()
    command = ["cargo", "test", "--offline", "--no-run", "--message-format=json", *tests]
    done = subprocess.run(command, cwd=folder, check=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    seconds = time.monotonic() - began
    built = [message for message in map(json.loads, done.stdout.splitlines()) if message["reason"] == "compiler-artifact"]
    sources = {pathlib.Path(message["target"]["src_path"]) for message in built if not message["fresh"]}
    return seconds, {source.parent for source in sources if source.is_relative_to(folder)}


def n_lines(folders):
    return sum(len(file.read_bytes().splitlines()) for folder in folders for file in folder.rglob("*.rs"))


def change(folder, file, tests):
    """Returns the median of the seconds, and the lines that were compiled."""
    file = folder / file
    kept = file.read_bytes()
    build(folder, tests)
    try:
        runs = []
        for k in range(N_RUNS):
            file.write_bytes(kept + f"\n/// Run {k}.\npub fn rebuilt_{k}() -> u32 {{ {k} }}\n".encode())
            runs.append(build(folder, tests))
    finally:
        file.write_bytes(kept)
    return statistics.median(seconds for seconds, _ in runs), n_lines(runs[0][1])


def checkout(commit, folder):
    """Checks out a commit outside this checkout, because Cargo would take it for a member of this workspace."""
    subprocess.run(["git", "worktree", "add", "--detach", folder, commit], cwd=ROOT, check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    subprocess.run(["cargo", "fetch", "--locked"], cwd=folder, check=True)
    (folder / "target").mkdir()
    (folder / "target/vendor").symlink_to(ROOT / "target/vendor")


def main(commit):
    rows = []
    with tempfile.TemporaryDirectory() as parent:
        old = pathlib.Path(parent) / "flockreel"
        checkout(commit, old)
        try:
            for what, file, tests, old_file, old_tests in CHANGES:
                (before_s, before), (after_s, after) = change(old, old_file, old_tests), change(ROOT, file, tests)
                rows.append([what, f"{before:,}", f"{after:,}", f"{before_s:.0f} s", f"{after_s:.0f} s", f"{after_s / before_s:.2f}", "<= 0.5"])
                print(" | ".join(rows[-1]), flush=True)
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", old], cwd=ROOT, check=True)
    measurements.save("rebuild", {
        "title": "A change of one line",
        "about": f"Lines that Cargo compiles again, and seconds until the tests run, before the algorithms became a package of their own ({commit}) and now. "
                 f"Median of {N_RUNS} runs on {machine()}.",
        "command": f"bench/rebuild.py {commit}",
        "head": ["change in", "lines before", "lines now", "seconds before", "seconds now", "ratio", "bar"],
        "rows": rows,
    })


if __name__ == "__main__":
    main(*sys.argv[1:])
