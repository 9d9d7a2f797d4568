"""Sends a service four times the permitted rate of requests (docs/explanation/promises.md, "Overload"). Those that are
accepted must be fast, and the others must be refused at once.

    overload.py PROGRAM
"""

import asyncio
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from scenario import Service

#: Requests a second that one owner may send, and how many are sent for how long.
RATE, FACTOR, SECONDS = 200, 4, 10
ACCEPTED_P99_S, REFUSED_P99_S = 1.0, 1.0


def main(program):
    with tempfile.TemporaryDirectory() as folder, Service(Path(program).resolve(), Path(folder) / "data") as service:
        assert service.is_ready()
        token = create_token(program, Path(folder) / "data")
        checks = asyncio.run(overload(service, token))
    for what, value, bar in checks:
        print(f"{'ok  ' if value <= bar else 'FAIL'} {what}: {value:.3f} (bar {bar})")
    return 1 if any(value > bar for _, value, bar in checks) else 0


def create_token(program, data):
    """Requests without a token have no limit on this machine."""
    command = [program, "token", "create", "--name", "overload", "--data", data]
    return subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()


async def overload(service, token):
    """Requests start at a fixed rate, whether or not earlier ones are answered."""
    asked = []
    begun = time.monotonic()
    for number in range(RATE * FACTOR * SECONDS):
        await asyncio.sleep(max(0, begun + number / (RATE * FACTOR) - time.monotonic()))
        asked.append(asyncio.create_task(ask(service, "/v1/footage?limit=1", token)))
    answers = await asyncio.gather(*asked)
    accepted = [seconds for status, seconds in answers if status == 200]
    refused = [seconds for status, seconds in answers if status in (429, 503)]
    assert accepted and refused
    return [
        ("p99 of accepted requests at 4 times the rate, s", p99(accepted), ACCEPTED_P99_S),
        ("p99 of refused requests, s", p99(refused), REFUSED_P99_S),
        ("requests with another answer", len(answers) - len(accepted) - len(refused), 0),
    ]


async def ask(service, path, token=None):
    """Returns the status and the seconds until the whole answer was there; status 0 if there was none."""
    begun = time.monotonic()
    try:
        reader, writer = await connect(service)
        proof = f"Authorization: Bearer {token}\r\n" if token else ""
        writer.write(f"GET {path} HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n{proof}\r\n".encode())
        answer = await asyncio.wait_for(reader.read(), 60)
        writer.close()
        status = int(answer.split(b" ", 2)[1]) if answer else 0
    except OSError:
        status = 0
    return status, time.monotonic() - begun


async def connect(service):
    host, port = service.address.removeprefix("http://").split(":")
    return await asyncio.open_connection(host, int(port))


def p99(seconds):
    return sorted(seconds)[int(len(seconds) * 0.99)]


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
