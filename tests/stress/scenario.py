"""What a client of the service does while it crashes, and what must then be true.

Every answer that the client receives is a fact with the time of its arrival. Facts hold forever, unless the
client itself changes them later.
"""

import json
import os
import subprocess
import sys
import time
import urllib.error
import urllib.request
from dataclasses import dataclass, field
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from service import free_address, wait_until_ready  # noqa: E402, of the folder above

HERE = Path(__file__).parent
#: Longest wait for an answer and for a job, seconds. A delayed step takes 1.5 s.
ANSWER_S, JOB_S = 30, 120
#: Makes another file of the same film. The service recognizes equal files.
EMPTY_BOX = b"\x00\x00\x00\x08free"
TUS = {"Tus-Resumable": "1.0.0", "Content-Type": "application/offset+octet-stream"}


@dataclass
class Fact:
    """`kind` is film, job, done or gone. `until_ns` is the time of the request that changes it again."""

    kind: str
    id: str
    time_ns: int = field(default_factory=time.time_ns)
    until_ns: int | None = None


def compile_steps(folder):
    """Compiles the library that stands between the service and the C library."""
    library = folder / "steps.so"
    subprocess.run(["cc", "-O1", "-Wall", "-shared", "-fPIC", "-o", library, HERE / "steps.c", "-ldl", "-lpthread"], check=True)
    return library


def make_film(program, folder):
    film = folder / "film.mp4"
    command = [program, "sample", "-o", film, "--frames", "120", "--size", "160x120"]
    subprocess.run(command, check=True, stderr=subprocess.DEVNULL)
    return film.read_bytes()


class Service:
    """A running service whose calls that change files pass through steps.so."""

    def __init__(self, program, data, library=None, **variables):
        self.address = free_address()
        bind = self.address.removeprefix("http://")
        command = [program, "serve", "--bind", bind, "--data", data, "--no-sample", "--log", "warn"]
        steps = {"LD_PRELOAD": str(library), "CRASH_ROOT": str(data), **variables} if library else {}
        # Tests of the guards name the one that is disabled.
        kept = {name: os.environ[name] for name in ("PATH", "FLOCKREEL_GUARD_OFF") if name in os.environ}
        self.process = subprocess.Popen(command, env={**kept, **steps})

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.terminate()
        try:
            self.process.wait(30)
        except subprocess.TimeoutExpired:
            self.process.kill()
            self.process.wait()
            raise

    def is_ready(self):
        """Waits until the service answers. Returns false if its process ended before."""
        try:
            wait_until_ready(self.process, self.address)
        except AssertionError:
            return False
        return True

    def ask(self, method, path, body=None, headers=None):
        """Returns the status, the headers and the body of the answer; `None` if the service is gone."""
        request = urllib.request.Request(self.address + path, body, headers or {}, method=method)
        try:
            with urllib.request.urlopen(request, timeout=ANSWER_S) as answer:
                return answer.status, answer.headers, answer.read()
        except urllib.error.HTTPError as refusal:
            return refusal.code, refusal.headers, refusal.read()
        except OSError as error:
            if isinstance(getattr(error, "reason", error), TimeoutError):
                raise
            return None

    def post(self, path, body):
        answer = self.ask("POST", path, json.dumps(body).encode(), {"Content-Type": "application/json"})
        return json.loads(answer[2]) if answer and answer[0] < 300 else None


class Client:
    """Runs the story and remembers the facts. Requests that fail are given up."""

    def __init__(self, service, film):
        self.service = service
        self.film = film
        self.facts = []

    def run(self):
        first = self.upload()
        second = self.upload_in_pieces()
        library = self.make("/v1/analyses", {"footage_id": first}, "library_id") if first else None
        if library:
            self.make("/v1/flocks", {"library_id": library, "count": 2, "frames": 10}, "flock_id")
        if second:
            self.delete(second)

    def know(self, kind, name):
        self.facts.append(Fact(kind, name))

    def upload(self):
        answer = self.service.ask("POST", "/v1/footage", self.film, {"Content-Type": "video/mp4"})
        return self.film_of(answer)

    def film_of(self, answer):
        if not answer or answer[0] != 201:
            return None
        footage = json.loads(answer[2])["id"]
        self.know("film", footage)
        return footage

    def upload_in_pieces(self):
        film = self.film + EMPTY_BOX
        create = {**TUS, "Upload-Length": str(len(film))}
        answer = self.service.ask("POST", "/v1/uploads", b"", create)
        if not answer or answer[0] != 201:
            return None
        path, half = answer[1]["Location"], len(film) // 2
        for begin, piece in ((0, film[:half]), (half, film[half:])):
            answer = self.service.ask("PATCH", path, piece, {**TUS, "Upload-Offset": str(begin)})
            if not answer or answer[0] >= 300:
                return None
        footage = answer[1]["Link"].partition("/v1/footage/")[2].partition(">")[0]
        self.know("film", footage)
        return footage

    def make(self, path, body, name):
        """Creates a job and waits for its end. Returns the id of its result if it is done."""
        job = self.service.post(path, body)
        if job is None:
            return None
        self.know("job", job["job_id"])
        state = ended(self.service, job["job_id"])
        if state != "done":
            return None
        self.know("done", job["job_id"])
        return job[name]

    def delete(self, footage):
        started_ns = time.time_ns()
        for fact in self.facts:
            if fact.id == footage:
                fact.until_ns = started_ns
        answer = self.service.ask("DELETE", f"/v1/footage/{footage}")
        if answer and answer[0] == 204:
            self.know("gone", footage)


def ended(service, job):
    """Waits for the end of a job and returns its state; `None` if the service is gone."""
    for _ in range(JOB_S * 20):
        answer = service.ask("GET", f"/v1/jobs/{job}")
        if answer is None:
            return None
        if answer[0] == 200 and json.loads(answer[2])["finished_at"]:
            return json.loads(answer[2])["state"]
        time.sleep(0.05)
    raise TimeoutError(f"the job did not end within {JOB_S} s: {job}")
