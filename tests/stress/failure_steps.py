"""Lets the steps of a service and of its attempts at jobs that change data fail, one at a time
(docs/explanation/promises.md, "Failure steps"). The process of the step, which is the service or an attempt, dies
before or after it, the step and those after it fail for a moment, or it is slow.
Then what was answered must be there, all jobs must end, and the service must work, after a failed call without a
restart.

    failure_steps.py PROGRAM [--cases N] [--seed 1]     without --cases: every step with every action
"""

import argparse
import itertools
import json
import random
import shutil
import struct
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from scenario import Client, Service, compile_steps, ended, make_film

ACTIONS = ("kill-before", "kill-after", "EIO", "ENOSPC", "delay")
#: A dead worker's job waits for the end of its lease, 15 s, without using the processor.
N_AT_ONCE = 4
#: The file in which steps.c counts: steps, and the time until which they fail.
COUNT = struct.Struct("=qq")
#: Time in which the service works again once calls no longer fail, seconds (promise "Full disk"), and a margin for
#: machines that are busy.
RECOVERY_S = 2 + 8


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=Path)
    parser.add_argument("--cases", type=int)
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        walk = Walk(options.program.resolve(), Path(folder).resolve())
        cases = list(itertools.product(range(1, walk.n_steps + 1), ACTIONS))
        if options.cases is not None:
            cases = sorted(random.Random(options.seed).sample(cases, options.cases))
        with ThreadPoolExecutor(N_AT_ONCE) as pool:
            n_faults = sum(pool.map(lambda case: walk.fails(*case), cases))
    print(f"failure steps: {len(cases)} cases of {walk.n_steps} steps: {n_faults} with faults")
    return 1 if n_faults else 0


class Walk:
    """A prepared data folder, and the number of steps of an undisturbed story on it."""

    def __init__(self, program, folder):
        self.program = program
        self.folder = folder
        self.library = compile_steps(folder)
        self.film = make_film(program, folder)
        with Service(program, folder / "start") as service:
            assert service.is_ready()
        shutil.copytree(folder / "start", folder / "whole")
        count = folder / "count"
        count.write_bytes(COUNT.pack(0, 0))
        with Service(program, folder / "whole", self.library, CRASH_COUNT=str(count)) as service:
            assert service.is_ready()
            Client(service, self.film).run()
        self.n_steps, _ = COUNT.unpack(count.read_bytes())

    def fails(self, step, action):
        """Runs one case and prints its faults."""
        data = self.folder / f"{step}-{action}"
        shutil.copytree(self.folder / "start", data)
        faults = self.run(data, step, action)
        for fault in faults:
            print(f"step {step}, {action}: {fault}", flush=True)
        shutil.rmtree(data)
        return bool(faults)

    def run(self, data, step, action):
        facts, faults = [], []
        count = data.with_suffix(".count")
        count.write_bytes(COUNT.pack(0, 0))
        variables = {"CRASH_STEP": str(step), "CRASH_ACTION": action, "CRASH_COUNT": str(count)}
        with Service(self.program, data, self.library, **variables) as service:
            if service.is_ready():
                client = Client(service, self.film)
                client.run()
                facts = client.facts
                if not action.startswith("kill") and not works(service, self.film):
                    faults.append("the service does not work after the failure, without a restart")
        with Service(self.program, data) as service:
            if not service.is_ready():
                return [*faults, "the service does not start"]
            faults += [f"lost after its answer: {fact.kind} {fact.id}" for fact in facts if not holds(service, fact)]
        done = subprocess.run([self.program, "check", "--data", data], capture_output=True, text=True, check=False)
        return faults + (done.stderr.splitlines() if done.returncode else [])


def works(service, film):
    """Whether a new film and its deletion are accepted soon."""
    end = time.monotonic() + RECOVERY_S
    while time.monotonic() < end:
        if accepts(service, film):
            return True
        time.sleep(0.2)
    return False


def accepts(service, film):
    answer = service.ask("POST", "/v1/footage", film + b"\0\0\0\x10free" + bytes(8), {"Content-Type": "video/mp4"})
    if not answer or answer[0] not in (200, 201):
        return False
    footage = json.loads(answer[2])["id"]
    return service.ask("DELETE", f"/v1/footage/{footage}")[0] == 204


def holds(service, fact):
    if fact.kind in ("film", "gone"):
        status = service.ask("GET", f"/v1/footage/{fact.id}/file" if fact.kind == "film" else f"/v1/footage/{fact.id}")[0]
        return fact.until_ns is not None or status == (200 if fact.kind == "film" else 404)
    state = ended(service, fact.id)
    return state is not None if fact.kind == "job" else state == "done"


if __name__ == "__main__":
    sys.exit(main())
