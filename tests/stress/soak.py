"""Runs a service with good and hostile clients for a long time (docs/explanation/promises.md, "Long runs").

In the first tenth of the time the service is killed every KILL_S seconds and started again. Then one process
lives to the end, and its memory, threads, open files and write-ahead log are sampled. All of them must stay flat.
At the end the queue must become empty and the invariants must hold. The samples are kept in target/soak.csv.

    soak.py PROGRAM [--minutes 60] [--result FILE.json]
"""

import argparse
import csv
import json
import os
import random
import resource
import socket
import sqlite3
import subprocess
import sys
import tempfile
import threading
import time
from pathlib import Path

from scenario import Client, Service, make_film

ROOT = Path(__file__).resolve().parents[2]
KILL_S = 20
SAMPLE_S = 5
#: Part of the last process's life in which memory may still grow: caches fill, and the allocator finds its size.
WARM_UP = 1 / 6
#: Names and highest values of the growth in an hour after the warm-up. SQLite empties its log at 4 MB.
GROWTHS = {
    "memory_mb": ("growth of memory, MB per hour", 1.0),
    "threads": ("growth of threads, per hour", 1.0),
    "files": ("growth of open files, per hour", 2.0),
    "wal_mb": ("growth of the write-ahead log, MB per hour", 1.0),
}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program", type=Path)
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--result", type=Path)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        soak = Soak(options.program.resolve(), Path(folder), options.minutes * 60)
        rows = soak.run()
    write_samples(ROOT / "target/soak.csv", soak.samples)
    faults = [name for name, _, _, is_met in rows if not is_met]
    for name, value, bar, is_met in rows:
        print(f"{'ok  ' if is_met else 'FAIL'} {name}: {value} (bar {bar})")
    if options.result:
        write_result(options.result, options.minutes, rows)
    return 1 if faults else 0


def write_samples(path, samples):
    with path.open("w", newline="") as file:
        writer = csv.DictWriter(file, samples[0].keys())
        writer.writeheader()
        writer.writerows(samples)


class Soak:
    def __init__(self, program, folder, seconds):
        self.program = program
        self.folder = folder
        self.data = folder / "data"
        self.seconds = seconds
        self.film = make_film(program, folder)
        self.is_over = threading.Event()
        self.service = None
        self.n_stories = 0
        self.n_attacks = 0
        self.n_server_errors = 0
        self.samples = []

    def run(self):
        n_kills = self.live_and_die(time.monotonic() + self.seconds / 10)
        with self.started() as self.service:
            assert self.service.is_ready()
            clients = self.start_clients()
            end = time.monotonic() + self.seconds * 9 / 10
            while time.monotonic() < end:
                time.sleep(SAMPLE_S)
                self.samples.append(self.sample())
            self.stop(clients)
            n_stuck = self.n_unfinished()
        done = subprocess.run([self.program, "check", "--data", self.data], capture_output=True, text=True, check=False)
        drafts = list((self.data / "tmp").iterdir())
        growths = {key: self.slope(key) for key in GROWTHS}
        rows = [(name, round(growths[key], 2), f"< {bar}", growths[key] < bar) for key, (name, bar) in GROWTHS.items()]
        return [
            ("stories of good clients", self.n_stories, "> 0", self.n_stories > 0),
            ("hostile requests", self.n_attacks, "> 0", self.n_attacks > 0),
            ("kills", n_kills, "> 0", n_kills > 0),
            *rows,
            ("answers with 5xx other than 503", self.n_server_errors, "0", self.n_server_errors == 0),
            ("jobs that did not end", n_stuck, "0", n_stuck == 0),
            ("temporary files left behind", len(drafts), "0", not drafts),
            ("faults that flockreel check finds", done.stderr.count("flockreel: I"), "0", done.returncode == 0),
        ]

    def started(self):
        return Service(self.program, self.data)

    def live_and_die(self, end):
        """Kills the service again and again. Returns how often."""
        n_kills = 0
        while time.monotonic() < end or n_kills == 0:
            with self.started() as self.service:
                assert self.service.is_ready()
                clients = self.start_clients()
                time.sleep(min(KILL_S, self.seconds / 20))
                self.service.process.kill()
                self.stop(clients)
            n_kills += 1
        return n_kills

    def start_clients(self):
        self.is_over.clear()
        clients = [threading.Thread(target=work, daemon=True) for work in (self.be_good, self.be_hostile)]
        for client in clients:
            client.start()
        return clients

    def stop(self, clients):
        self.is_over.set()
        for client in clients:
            client.join(180)
            assert not client.is_alive(), "a client waits for an answer"

    def be_good(self):
        """Uploads a film, measures it, makes a flock, and deletes everything."""
        while not self.is_over.is_set() and self.service.process.poll() is None:
            unused = random.randbytes(8)
            client = Client(self.service, self.film + b"\0\0\0\x10free" + unused)
            client.run()
            for fact in client.facts:
                if fact.kind == "film":
                    self.note(self.service.ask("DELETE", f"/v1/footage/{fact.id}"))
            self.n_stories += 1

    def be_hostile(self):
        attacks = [self.send_garbage, self.cut_an_upload, self.ask_nonsense, self.leave_a_stream, self.send_half_a_request]
        while not self.is_over.is_set() and self.service.process.poll() is None:
            self.note(random.choice(attacks)())
            self.n_attacks += 1
            time.sleep(0.05)

    def note(self, answer):
        if answer and answer[0] >= 500 and answer[0] != 503:
            self.n_server_errors += 1

    def send_garbage(self):
        body = self.film[: random.randrange(len(self.film))] + random.randbytes(1000)
        return self.service.ask("POST", "/v1/footage", body, {"Content-Type": "video/mp4"})

    def ask_nonsense(self):
        path, body = random.choice([("/v1/flocks", b"[" * 500), ("/v1/analyses", random.randbytes(200)), ("/v1/fish", b"{}"), ("/v1/%00", b"")])
        return self.service.ask("POST", path, body, {"Content-Type": "application/json"})

    def cut_an_upload(self):
        self.send_and_leave(b"POST /v1/footage HTTP/1.1\r\nHost: x\r\nContent-Type: video/mp4\r\nContent-Length: 9999999\r\n\r\n" + self.film)

    def leave_a_stream(self):
        self.send_and_leave(b"GET /v1/events HTTP/1.1\r\nHost: x\r\n\r\n")

    def send_half_a_request(self):
        self.send_and_leave(b"GET /v1/jobs HTT")

    def send_and_leave(self, data):
        host, port = self.service.address.removeprefix("http://").split(":")
        try:
            with socket.create_connection((host, int(port)), timeout=5) as connection:
                connection.sendall(data)
                time.sleep(0.2)
        except OSError:
            pass

    def sample(self):
        pid = self.service.process.pid
        status = dict(line.split(":", 1) for line in Path(f"/proc/{pid}/status").read_text().splitlines() if ":" in line)
        wal = self.data / "flockreel.db-wal"
        return {
            "hours": time.monotonic() / 3600,
            "memory_mb": int(status["RssAnon"].split()[0]) / 1024,
            "threads": int(status["Threads"]),
            "files": len(os.listdir(f"/proc/{pid}/fd")),
            "wal_mb": wal.stat().st_size / 2**20 if wal.exists() else 0.0,
        }

    def slope(self, name):
        """Growth per hour after the warm-up, from the medians of the first and the last quarter of the samples."""
        samples = self.samples[int(len(self.samples) * WARM_UP) :]
        quarter = max(1, len(samples) // 4)
        first, last = samples[:quarter], samples[-quarter:]
        hours = median(last, "hours") - median(first, "hours")
        return (median(last, name) - median(first, name)) / max(hours, 1e-9)

    def n_unfinished(self):
        """Waits two minutes for the end of all jobs. Returns how many have not ended."""
        database = sqlite3.connect(f"file:{self.data / 'flockreel.db'}?mode=ro", uri=True)
        for _ in range(120):
            (n_jobs,) = database.execute("select count(*) from jobs where state in ('queued', 'running')").fetchone()
            if n_jobs == 0:
                break
            time.sleep(1)
        database.close()
        return n_jobs


def median(samples, name):
    values = sorted(sample[name] for sample in samples)
    return values[len(values) // 2]


def write_result(file, minutes, rows):
    cells = [[name, str(value) + ("" if is_met else " *"), bar] for name, value, bar, is_met in rows]
    about = f"A service with good and hostile clients for {minutes:g} minutes. It is killed in the first tenth; the growth is that of the process that lives to the end."
    result = {"title": "Long runs", "about": about, "command": "make soak MINUTES=60", "head": ["figure", "measured", "bar"], "rows": cells}
    file.write_text(json.dumps(result, indent=1) + "\n")


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    sys.exit(main())
