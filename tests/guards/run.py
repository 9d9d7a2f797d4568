"""Disables the guards of guards.toml one by one and checks that the test of each fails.

One program is built from a copy of the sources in which every guard has a switch. FLOCKREEL_GUARD_OFF names
the disabled guard. Each test must pass with all guards enabled. Prints a line for each guard, with the
message of the failed test. Exits with 1 if a test passes without its guard, or fails with all guards.

Where several guards stop the same attack, the test of one must look past the others.

  tests/guards/run.py [NAME...]                 guards whose name starts with NAME, or all
  scripts/with-servers.sh tests/guards/run.py   guards whose tests need several machines
"""

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
PLACE = ROOT / "target/guards"
SOURCES = PLACE / "sources"
#: Longest time of a test, seconds. Without its guard it gets five times what it took with all guards, and at least a minute.
LONGEST_S = 600
LEAST_S = 60
SWITCH = """
/// Returns whether the guard with this name is disabled.
#[doc(hidden)]
pub fn guard_off(name: &str) -> bool {
    std::env::var("FLOCKREEL_GUARD_OFF").is_ok_and(|off| off == name)
}
"""


# An attempt at a job has an empty environment. It must know which guard is disabled.
ATTEMPT = ("src/jobs/attempt/process.rs", "        .env_clear()\n", """        .env_clear()
        .envs(std::env::var("FLOCKREEL_GUARD_OFF").ok().filter(|off| !off.is_empty()).map(|off| ("FLOCKREEL_GUARD_OFF", off)))
""")


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*")
    asked = parser.parse_args()
    guards = tomllib.loads(Path(__file__).with_name("guards.toml").read_text())["guard"]
    lay_out(guards)
    programs = build()
    wanted = [g for g in guards if not asked.names or any(g["name"].startswith(n) for n in asked.names)]
    servers = "FLOCKREEL_TEST_POSTGRES" in os.environ
    wanted = [g for g in wanted if servers == g["test"].startswith("scale ")]
    green, longest_s, faults = {}, {}, 0
    for guard in wanted:
        test = guard["test"]
        if test not in green:
            began = time.monotonic()
            green[test] = run(programs, test, None, LONGEST_S)
            longest_s[test] = max(LEAST_S, 5 * (time.monotonic() - began))
            if green[test] is not None:
                print(f"RED WITH ALL GUARDS  {test}: {green[test]}", flush=True)
        began = time.monotonic()
        said = run(programs, test, guard["name"], longest_s[test])
        # A test that also fails with all guards enabled proves nothing about this guard.
        faults += said is None or green[test] is not None
        verdict = "GREEN WITHOUT" if said is None else "red"
        print(f"{verdict:14}{guard['promise']:12}{guard['name']:24}{time.monotonic() - began:6.1f} s  {said or guard['out']}", flush=True)
    sys.exit(1 if faults else 0)


def lay_out(guards):
    """Writes the sources with their switches. Unchanged files keep their modification time."""
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, check=True, capture_output=True, text=True).stdout
    texts = {}
    for name in filter(None, listed.split("\0")):
        path = ROOT / name
        if path.is_file():
            texts[name] = path.read_bytes()
    vendored = ROOT / "target/vendor"
    switched = {}
    for guard in guards:
        for edit in guard.get("edit", []):
            text = switched.get(edit["file"]) or texts[edit["file"]].decode()
            if text.count(edit["old"]) != 1:
                sys.exit(f"guards: {guard['name']}: occurs {text.count(edit['old'])} times in {edit['file']}: {edit['old']}")
            new = re.sub(r"\bOFF\b", f'crate::guard_off("{guard["name"]}")', edit["new"])
            switched[edit["file"]] = text.replace(edit["old"], new)
    file, old, new = ATTEMPT
    switched[file] = switched.get(file, texts[file].decode()).replace(old, new)
    for root in ("src/lib.rs", "crates/flockreel-core/src/lib.rs"):
        switched[root] = switched.get(root, texts[root].decode()) + SWITCH
    texts.update({name: text.encode() for name, text in switched.items()})
    for name, text in texts.items():
        path = SOURCES / name
        if not path.is_file() or path.read_bytes() != text:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(text)
    if vendored.is_dir():
        shutil.copytree(vendored, SOURCES / "target/vendor", dirs_exist_ok=True)


def build():
    """Builds the test programs and returns their paths by kind. Reuses built dependencies by hard links."""
    built, target = ROOT / "target/debug", PLACE / "target"
    if built.is_dir() and not target.is_dir():
        (target / "debug").mkdir(parents=True)
        for part in ("deps", "build", ".fingerprint"):
            subprocess.run(["cp", "-al", built / part, target / "debug" / part], check=True)
    command = ["cargo", "test", "--locked", "--no-run", "--lib", "--test", "it", "--message-format=json"]
    environment = {**os.environ, "CARGO_TARGET_DIR": str(target)}
    done = subprocess.run(command, cwd=SOURCES, env=environment, stdout=subprocess.PIPE, text=True)
    if done.returncode:
        for line in done.stdout.splitlines():
            message = json.loads(line).get("message", {})
            if isinstance(message, dict) and message.get("level") == "error":
                print(message["rendered"])
        sys.exit("guards: the program with switches does not build")
    programs = {}
    for line in done.stdout.splitlines():
        built = json.loads(line)
        if built.get("executable") and built["target"]["name"] in ("flockreel", "it") and built["profile"]["test"]:
            programs["lib" if built["target"]["name"] == "flockreel" else "it"] = built["executable"]
    return programs


def run(programs, test, off, longest_s):
    """Returns why a test fails, or None if it passes."""
    kind, path = test.split(" ")
    if kind in ("contract", "stress"):
        python = ROOT / "target/contract-venv/bin/python" if kind == "contract" else sys.executable
        command = [python, "-B", ROOT / path, PLACE / "target/debug/flockreel"]
    else:
        program = programs["it" if kind == "scale" else kind]
        command = [program, "--exact", path, "--nocapture"] + (["--ignored"] if kind == "scale" else [])
    environment = {**os.environ, "FLOCKREEL_GUARD_OFF": off or "", "CARGO_MANIFEST_DIR": str(SOURCES)}
    # A session of its own, so that the services of a hanging test end with it.
    running = subprocess.Popen(command, cwd=SOURCES, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, errors="replace", start_new_session=True)
    try:
        stdout, stderr = running.communicate(timeout=longest_s)
    except subprocess.TimeoutExpired:
        os.killpg(running.pid, signal.SIGKILL)
        running.communicate()
        return f"did not end in {longest_s:.0f} s"
    if kind not in ("contract", "stress") and "running 1 test" not in stdout:
        sys.exit(f"guards: the test does not exist: {test}")
    return reason(stderr + stdout) if running.returncode else None


def reason(said):
    """Returns the message of the panic in one line."""
    lines = said.splitlines()
    for line in lines:
        # The first fault that schemathesis reports.
        if line.startswith("- "):
            return line[2:].strip()
    at_home = [at for at, line in enumerate(lines) if "panicked at tests/" in line]
    anywhere = [at for at, line in enumerate(lines) if "panicked at " in line]
    for at in (at_home or anywhere)[:1]:
        words = " ".join(lines[at + 1 : at + 4]).split("note: run with")[0].split("stack backtrace")[0]
        words = re.sub(r"(thread '[^']+') \(\d+\)", r"\1", words)
        return re.sub(r"\s+", " ", re.sub(r"[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}", "ID", words)).strip()[:160] or "failed"
    return "failed"


if __name__ == "__main__":
    main()
