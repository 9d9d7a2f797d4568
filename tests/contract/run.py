"""Runs schemathesis on the OpenAPI document of a running service that holds one object of every kind.

One run generates random requests, a second run uses the ids of stored objects. A third calls every operation
with valid input (walk.py), and operations that never succeed are faults. Endless event streams are excluded;
tests/it/api/events.rs tests them.
"""

import os
import subprocess
import sys
import tempfile
from pathlib import Path

import hooks  # noqa: F401 (importing registers the hooks in this process too)
from walk import Walk, tell

sys.path.insert(0, str(Path(__file__).parents[1]))
from service import post, started, wait_for_job  # noqa: E402, of the folder above

SEED = "6"
EXAMPLES = "12"
CHECKS = "not_a_server_error,status_code_conformance,content_type_conformance,response_headers_conformance,response_schema_conformance"
HOOKS = "hooks"
FILES = {"libraries": "poses.json", "flocks": "flock.json", "fish": "model.glb", "datasets": "dataset.zip"}


def main(program):
    program = str(Path(program).resolve())
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        os.environ["CONTRACT_SEEN"] = str(folder / "seen")
        with started(program, folder / "data", "--log", "warn", "--max-queued", "20") as address:
            ids = furnish(program, address, folder)
            faults = run(address, folder, "random requests", "")
            faults += run(address, folder, "stored objects", known(ids))
            faults += walk_through(program, address, folder)
        checked = subprocess.run([program, "check", "--data", folder / "data"], check=False)
        sys.exit(1 if faults or checked.returncode else 0)


def furnish(program, address, folder):
    """Creates one object of each kind through the API and returns their ids."""
    film = folder / "film.mp4"
    size = ["--size", "160x120"]
    subprocess.run([program, "sample", "-o", film, "--frames", "120", *size], check=True, stderr=subprocess.DEVNULL)
    footage = post(f"{address}/v1/footage", film.read_bytes(), "video/mp4")["id"]
    analysis = post(f"{address}/v1/analyses", {"footage_id": footage})
    library = analysis["library_id"]
    flock = post(f"{address}/v1/flocks", {"library_id": library, "count": 2, "frames": 10})
    fish = post(f"{address}/v1/fish", {"library_id": library})
    wait_for_job(address, analysis["job_id"])
    dataset = post(f"{address}/v1/datasets", {"library_ids": [library], "flocks": 1, "pictures": 2, "count": [1, 2]})
    for made in (flock, fish, dataset):
        wait_for_job(address, made["job_id"])
    ids = {"libraries": library, "flocks": flock["flock_id"], "fish": fish["fish_id"], "datasets": dataset["dataset_id"]}
    return {**ids, "footage": footage, "jobs": analysis["job_id"]}


def known(ids):
    """Returns settings that use existing ids as path parameters of GET operations."""
    lines = []
    for noun, thing in ids.items():
        lines.append(f'[[operations]]\ninclude-path-regex = "^/v1/{noun}/"\ninclude-method = "GET"')
        file = f', "path.file" = "{FILES[noun]}"' if noun in FILES else ""
        lines.append(f'parameters = {{ "path.id" = "{thing}"{file} }}')
    return "\n".join(lines) + "\n"


def run(address, folder, what, settings):
    """Runs schemathesis. Returns its exit code, 0 without faults."""
    config = folder / "schemathesis.toml"
    config.write_text(settings)
    command = [Path(sys.prefix) / "bin/schemathesis", "--config-file", config, "run", f"{address}/openapi.json"]
    command += ["--url", address, "--checks", CHECKS, "--phases", "examples,coverage,fuzzing", "--seed", SEED]
    command += ["--max-examples", EXAMPLES, "--request-timeout", "20", "--workers", "1", "--no-color"]
    command += ["--exclude-path-regex", "/events$", "--suppress-health-check", "all"]
    print(f"contract tests: {what}", flush=True)
    return subprocess.run(command, check=False, cwd=folder, env={**os.environ, "SCHEMATHESIS_HOOKS": HOOKS, "PYTHONPATH": str(Path(__file__).parent)}).returncode


def walk_through(program, address, folder):
    """Calls every operation with valid input. Returns the number of operations that never succeeded."""
    print("contract tests: one valid call of each operation", flush=True)
    film, data = folder / "another.mp4", folder / "data"
    command = [program, "sample", "-o", film, "--frames", "120", "--size", "160x120", "--seed", "2"]
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
    command = [program, "token", "create", "--name", "walk", "--data", data]
    token = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    moving = folder / "moving.mp4"
    picture = "mandelbrot=size=640x480:rate=25,scroll=h=0.013:v=0.007,scale=160:120"
    subprocess.run(["ffmpeg", "-v", "error", "-f", "lavfi", "-i", picture, "-frames:v", "60", moving], check=True)
    walk = Walk(address, (film, moving), token)
    walk.whole()
    never = tell(folder / "seen", walk.document.raw_schema)
    for operation in never:
        print(f"contract tests: never succeeded: {operation}")
    return len(never)


if __name__ == "__main__":
    main(*sys.argv[1:])
