"""Lets the clock of a service jump while a job runs (docs/explanation/promises.md, "Time jumps"): a day forward, a day
back, ten seconds back. The job must run once.

    time_jumps.py PROGRAM
"""

import json
import struct
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from scenario import Service, compile_steps, ended

DAY_S = 86400
#: Errors of the clock, seconds, one after the other.
JUMPS_S = (DAY_S, 0, -DAY_S, -DAY_S - 10, 0)
#: The service looks for ended leases once a second.
PAUSE_S = 2.5


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
    film, clock = folder / "film.mp4", folder / "clock"
    subprocess.run([program, "sample", "-o", film, "--frames", "3000"], check=True, stderr=subprocess.DEVNULL)
    clock.write_bytes(struct.pack("=q", 0))
    with Service(program, folder / "data", compile_steps(folder), CRASH_CLOCK=str(clock)) as service:
        assert service.is_ready()
        footage = json.loads(service.ask("POST", "/v1/footage", film.read_bytes(), {"Content-Type": "video/mp4"})[2])["id"]
        job = service.post("/v1/analyses", {"footage_id": footage})["job_id"]
        wait_until_it_runs(service, job)
        for error_s in JUMPS_S:
            # The service has mapped the file, which must therefore keep its length.
            with clock.open("r+b") as file:
                file.write(struct.pack("=q", error_s))
            time.sleep(PAUSE_S)
        now = job_of(service, job)
        faults = [] if now["state"] == "running" else [f"the job is {now['state']} before the last jump"]
        state = ended(service, job)
        n_attempts = job_of(service, job)["attempt"]
    if state != "done":
        faults.append(f"the job ended as {state}")
    if n_attempts != 1:
        faults.append(f"the job ran {n_attempts} times")
    return faults


def wait_until_it_runs(service, job):
    while job_of(service, job)["state"] != "running":
        time.sleep(0.1)


def job_of(service, job):
    return json.loads(service.ask("GET", f"/v1/jobs/{job}")[2])


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
