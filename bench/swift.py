#!/usr/bin/env python3
"""Measures the way from a film that is dropped on the page to its living flock, stage by stage.

    bench/swift.py PROGRAM OLDER FILM... [--runs N] [--write]

Uploads each film to a service of PROGRAM and to one of OLDER, in turns, measures it with the default parameters, and asks
for what the flock of the page needs: the atlas with its first page, and a plan. Each stage has its seconds, and the
largest memory of the service with its jobs and media tools (PSS). Stages of a job are those that it tells. `film` is the time
from the living flock until film.mp4 can be played, and `preview` that of the first answer of the editor after a change. Each figure is the median of N runs (3). --write writes
bench/results/swift.json and its section of docs/measurements.md. Needs no other load on the machine.
"""

import argparse
import json
import os
import statistics
import subprocess
import tempfile
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path

import measurements
from service import machine, start
from table import table

# Interval between two looks at the job and at the memory, seconds. Stages that are shorter may be missed. Free choice.
LOOK_S = 0.05
# Plan of the flock that the page asks for when a film is measured (static/js/places/film.js).
FLOCK = {"frames": 300}
PLAN = "application/vnd.flockreel.plan"
TOTAL = "drop to living flock"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("older")
    parser.add_argument("films", nargs="+", type=Path)
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--write", action="store_true")
    asked = parser.parse_args()
    rows = []
    for film in asked.films:
        runs = {asked.program: [], asked.older: []}
        for _ in range(asked.runs):
            for program, found in runs.items():
                found.append(measure(program, film))
        rows += compared(film, runs[asked.older], runs[asked.program])
    result = {
        "title": "From a film to its living flock",
        "about": f"Seconds and memory of each stage, medians of {asked.runs} runs, in turns with the older program "
                 f"({version(asked.older)}). {machine()}.",
        "command": "make swift OLD=program FILMS=films", "head": ["film", "stage", "older", "this", "older, MB", "this, MB"], "rows": rows}
    if asked.write:
        measurements.save("swift", result)
    print("\n".join(table(result["head"], rows)))


def measure(program, film):
    """Returns (seconds, bytes) by stage."""
    with tempfile.TemporaryDirectory(dir=os.environ.get("BENCH_DIR")) as folder:
        service, address = start(program, Path(folder) / "data")
        stages, memory = {}, Memory(service.pid)
        try:
            begun = time.monotonic()
            footage = memory.during(stages, "upload", lambda: post(f"{address}/v1/footage", film.read_bytes(), "video/mp4"))
            analysis = post(f"{address}/v1/analyses", {"footage_id": footage["id"]})
            follow(f"{address}/v1/jobs/{analysis['job_id']}", stages, memory)
            library = f"{address}/v1/libraries/{analysis['library_id']}"
            memory.during(stages, "flock", lambda: flock(address, library))
            stages[TOTAL] = (time.monotonic() - begun, max(n_bytes for _, n_bytes in stages.values()))
            memory.during(stages, "film", lambda: until_played(f"{library}/film.mp4"))
            first_answer(address, footage["id"], stages, memory)
        finally:
            memory.stop()
            service.terminate()
            service.wait(timeout=60)
    return stages


def follow(job_url, stages, memory):
    """Waits for the end of a job. Adds its stages, and the time before the first one as `queued`."""
    stage, since = "queued", time.monotonic()
    memory.reset()
    while True:
        job = get(job_url)
        now = job["stage"] or ("queued" if job["state"] in ("queued", "running") else "")
        if now != stage:
            seconds, n_bytes = stages.get(stage, (0, 0))
            stages[stage] = (seconds + time.monotonic() - since, max(n_bytes, memory.reset()))
            stage, since = now, time.monotonic()
        if job["finished_at"]:
            assert job["state"] == "done", job["error"]
            return
        time.sleep(LOOK_S)


def flock(address, library):
    body = json.dumps({"library_id": library.rsplit("/", 1)[1], **FLOCK}).encode()
    headers = {"Content-Type": "application/json", "Accept": PLAN}
    read(urllib.request.Request(f"{address}/v1/flocks/preview", body, headers))
    for file in ("atlas.json", "atlas-0.webp"):
        read(f"{library}/{file}")


def first_answer(address, footage_id, stages, memory):
    """Adds the time of a preview of the measurement, which older programs do not have."""
    request = {"footage_id": footage_id, "params": {"threshold": 20}}
    try:
        memory.during(stages, "preview", lambda: post(f"{address}/v1/analyses/preview", request))
    except urllib.error.HTTPError as error:
        if error.code not in (404, 405):
            raise


def until_played(url):
    while True:
        try:
            return read(urllib.request.Request(url, method="HEAD"))
        except urllib.error.HTTPError as error:
            if error.code != 409:
                raise
        time.sleep(LOOK_S)


class Memory:
    """The largest memory of a process and its descendants, looked at by a thread."""

    def __init__(self, pid):
        self.pid, self.most, self.is_over = pid, 0, threading.Event()
        self.thread = threading.Thread(target=self.look, daemon=True)
        self.thread.start()

    def look(self):
        while not self.is_over.wait(LOOK_S):
            self.most = max(self.most, sum(map(pss, family(self.pid))))

    def reset(self):
        most, self.most = self.most, 0
        return most

    def during(self, stages, stage, work):
        self.reset()
        begun = time.monotonic()
        done = work()
        stages[stage] = (time.monotonic() - begun, self.reset())
        return done

    def stop(self):
        self.is_over.set()
        self.thread.join()


def family(pid):
    """Returns a process and its descendants."""
    parents = {}
    for status in Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(status.parent.name)] = int(status.read_text().rsplit(")", 1)[1].split()[1])
        except (OSError, IndexError):
            continue
    found = [pid]
    for one in found:
        found += [child for child, parent in parents.items() if parent == one]
    return found


def pss(pid):
    """Returns the memory of a process in bytes, with its share of pages that others use too."""
    try:
        lines = Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines()
    except OSError:
        return 0
    return sum(int(line.split()[1]) << 10 for line in lines if line.startswith("Pss:"))


def compared(film, older, newer):
    """Returns the rows of one film, with the stages in the order of the newer program."""
    rows = []
    for stage in dict.fromkeys([*newer[0], *older[0]]):
        cells = []
        for unit, form in ((0, "{:.1f} s"), (1, "{:.0f}")):
            for runs in (older, newer):
                values = [run[stage][unit] for run in runs if stage in run]
                value = statistics.median(values) / (1e6 if unit else 1) if values else None
                cells.append("" if value is None else form.format(value))
        rows.append([film.name, stage, *cells])
    return rows


def version(program):
    return subprocess.run([program, "--version"], check=True, capture_output=True, text=True).stdout.strip()


def get(url):
    return json.loads(read(url))


def post(url, body, media_type="application/json"):
    data = body if isinstance(body, bytes) else json.dumps(body).encode()
    return json.loads(read(urllib.request.Request(url, data, {"Content-Type": media_type})))


def read(request):
    with urllib.request.urlopen(request) as answer:
        return answer.read()


if __name__ == "__main__":
    main()
