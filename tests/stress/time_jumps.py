"""Lets the clock of a service jump while a job runs (docs/explanation/promises.md, "Time jumps"): a day forward, a day
back, ten seconds back. The process of the job stands still meanwhile. The job must run once.

    time_jumps.py PROGRAM
"""

import json
import os
import signal
import struct
import sys
import tempfile
import time
from pathlib import Path

from scenario import Service, compile_steps, ended, make_film

DAY_S = 86400
#: Errors of the clock, seconds, one after the other.
JUMPS_S = (DAY_S, 0, -DAY_S, -DAY_S - 10, 0)
#: The service looks for ended leases once a second. A media tool may wait for a process that stands still for 10 s.
PAUSE_S = 1.6


def main(program):
    program = Path(program).resolve()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder).resolve()
        faults = run(program, folder)
    for fault in faults:
        print(fault)
    print(f"time jumps: {len(faults)} faults")
    return 1 if faults else 0


def run(program, folder):
    film, clock = make_film(program, folder), folder / "clock"
    clock.write_bytes(struct.pack("=q", 0))
    with Service(program, folder / "data", compile_steps(folder), CRASH_CLOCK=str(clock)) as service:
        assert service.is_ready()
        footage = json.loads(service.ask("POST", "/v1/footage", film, {"Content-Type": "video/mp4"})[2])["id"]
        job = service.post("/v1/analyses", {"footage_id": footage})["job_id"]
        attempt = attempt_of(service)
        os.kill(attempt, signal.SIGSTOP)
        for error_s in JUMPS_S:
            # The service has mapped the file, which must therefore keep its length.
            with clock.open("r+b") as file:
                file.write(struct.pack("=q", error_s))
            time.sleep(PAUSE_S)
        now = job_of(service, job)
        faults = [] if now["state"] == "running" else [f"the job is {now['state']} before the last jump"]
        os.kill(attempt, signal.SIGCONT)
        state = ended(service, job)
        found = job_of(service, job)
    if state != "done":
        faults.append(f"the job ended as {state}: {found['error']}")
    if found["attempt"] != 1:
        faults.append(f"the job ran {found['attempt']} times")
    return faults


def attempt_of(service):
    """Returns the process of the running attempt, once there is one."""
    while True:
        for tasks in Path(f"/proc/{service.process.pid}/task").glob("*/children"):
            for child in map(int, tasks.read_text().split()):
                if b"\0attempt\0" in Path(f"/proc/{child}/cmdline").read_bytes():
                    return child
        time.sleep(0.01)


def job_of(service, job):
    return json.loads(service.ask("GET", f"/v1/jobs/{job}")[2])


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
