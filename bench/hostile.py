"""Measures what one hostile token costs another (docs/explanation/promises.md, "Overload").

    bench/hostile.py target/release/flockreel [SECONDS]    also writes bench/results/hostile.json

One token uses everything at full force: event streams, idle connections, previews, large flocks, uploads, signed links
and slow downloads. Meanwhile another token asks for small JSON and makes a flock of 20 individuals. Its times are
compared with those of an idle service. Exits with 1 if a bar is missed.
"""

import asyncio
import collections
import json
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

import measurements
from service import machine, start

N_STREAMS = 2100
N_IDLE = 500
N_OF_EACH = 25
SMALL_PER_S = 50
FLOCK = {"count": 20, "frames": 400, "seed": 1}
PREVIEW = {"count": 1000, "frames": 200}
LARGE_FLOCK = {"count": 400, "frames": 9990}


def main(program, seconds="30"):
    seconds = float(seconds)
    raise_descriptor_limit()
    with tempfile.TemporaryDirectory(dir=os.environ.get("BENCH_DIR")) as folder:
        film = Path(folder) / "film.mp4"
        subprocess.run([program, "sample", "-o", film, "--frames", "600"], check=True, stderr=subprocess.DEVNULL)
        data = Path(folder) / "data"
        hostile, other = (token(program, data, name) for name in ("hostile", "other"))
        service, address = start(program, data, "--auth", "required")
        try:
            ours, theirs = (library(address, key, film) for key in (other, hostile))
            idle_s, idle = flock_s(address, other, ours, 1), small_times(address, other, seconds)
            attack = subprocess.Popen([sys.executable, __file__, "attack", address, hostile, theirs, film], stdin=subprocess.DEVNULL)
            try:
                time.sleep(5)
                busy, busy_s = small_times(address, other, seconds), flock_s(address, other, ours, 2)
            finally:
                attack.send_signal(signal.SIGINT)
                attack.wait(timeout=60)
        finally:
            service.terminate()
            service.wait(timeout=60)
    rows = [["idle", *told(idle), f"{idle_s:.1f} s"], ["during the attack", *told(busy), f"{busy_s:.1f} s"],
            ["bar", "", "< 200 ms", "", "all 200", "3 times"]]
    measurements.save("hostile", {
        "title": "One hostile token",
        "about": f"One token uses everything at full force: {N_STREAMS} event streams, {N_IDLE} idle connections, and {N_OF_EACH} each of previews, "
                 "large flocks, uploads, signed links and slow downloads, again and again. Another token asks for small JSON "
                 f"{SMALL_PER_S} times a second and makes a flock of {FLOCK['count']} x {FLOCK['frames']}. Measured on {machine()}.",
        "command": "make hostile",
        "head": ["service", "requests", "p99", "longest", "answers", "flock"],
        "rows": rows,
    })
    print("\n".join(" | ".join(row) for row in rows))
    sys.exit(0 if set(busy[1]) == {200} and p99_ms(busy[0]) < 200 and busy_s < 3 * idle_s else 1)


def raise_descriptor_limit():
    _, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (hard, hard))


def token(program, data, name):
    command = [program, "token", "create", "--data", data, "--name", name, "--scope", "write"]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return next(word for word in said.split() if word.startswith("frl_"))


def ask(address, key, path, body=None, media_type="application/json"):
    data = body if body is None or isinstance(body, bytes) else json.dumps(body).encode()
    headers = {"Authorization": f"Bearer {key}", "Content-Type": media_type}
    request = urllib.request.Request(f"{address}{path}", data, headers)
    with urllib.request.urlopen(request, timeout=120) as answer:
        return json.load(answer)


def library(address, key, film):
    footage = ask(address, key, "/v1/footage", Path(film).read_bytes(), "video/mp4")["id"]
    made = ask(address, key, "/v1/analyses", {"footage_id": footage})
    wait_for(address, key, made["job_id"])
    return made["library_id"]


def flock_s(address, key, library_id, seed):
    begun = time.monotonic()
    made = ask(address, key, "/v1/flocks", {**FLOCK, "library_id": library_id, "seed": seed})
    wait_for(address, key, made["job_id"])
    return time.monotonic() - begun


def wait_for(address, key, job):
    while True:
        found = ask(address, key, f"/v1/jobs/{job}")
        if found["finished_at"]:
            assert found["state"] == "done", found
            return
        time.sleep(0.1)


def small_times(address, key, seconds):
    """Returns the times of requests at a steady rate, ms, and the number of each status."""
    return asyncio.run(steady(address, key, seconds))


async def steady(address, key, seconds):
    times_ms, statuses, under_way = [], collections.Counter(), set()

    async def one():
        begun = time.monotonic()
        try:
            status, _ = await asyncio.wait_for(request(address, key, "GET", "/v1/jobs?limit=1"), 30)
        except (OSError, asyncio.TimeoutError, asyncio.IncompleteReadError) as error:
            status = type(error).__name__
        times_ms.append(1000 * (time.monotonic() - begun))
        statuses[status] += 1

    begun = time.monotonic()
    for turn in range(int(seconds * SMALL_PER_S)):
        await asyncio.sleep(max(0, begun + turn / SMALL_PER_S - time.monotonic()))
        task = asyncio.create_task(one())
        under_way.add(task)
        task.add_done_callback(under_way.discard)
    await asyncio.gather(*under_way)
    return times_ms, statuses


def p99_ms(times_ms):
    return sorted(times_ms)[int(0.99 * len(times_ms))]


def told(measured):
    times_ms, statuses = measured
    answers = ", ".join(f"{n} x {status}" for status, n in statuses.items())
    return [str(len(times_ms)), f"{p99_ms(times_ms):.1f} ms", f"{max(times_ms):.1f} ms", answers]


async def request(address, key, method, path, body=b"", media_type="application/json"):
    """Sends a request on a new connection. Returns the status and the body."""
    reader, writer = await connect(address)
    try:
        writer.write(head(key, method, path, len(body), media_type) + body)
        await writer.drain()
        status = int((await reader.readline()).split()[1])
        return status, (await reader.read()).partition(b"\r\n\r\n")[2]
    finally:
        writer.close()


async def connect(address):
    host, port = address.removeprefix("http://").split(":")
    return await asyncio.open_connection(host, int(port))


def head(key, method, path, n_bytes, media_type="application/json", more=""):
    credential = f"Authorization: Bearer {key}\r\n" if key else ""
    return (f"{method} {path} HTTP/1.1\r\nHost: 127.0.0.1\r\n{credential}Content-Type: {media_type}\r\n"
            f"Content-Length: {n_bytes}\r\nConnection: close\r\n{more}\r\n").encode()


async def attack(address, key, library_id, film):
    """Attacks until SIGINT. Prints the number of each answer."""
    answers = collections.Counter()
    film = Path(film).read_bytes()
    flock = ask(address, key, "/v1/flocks", {**FLOCK, "library_id": library_id, "frames": 30})
    wait_for(address, key, flock["job_id"])
    link = ask(address, key, f"/v1/flocks/{flock['flock_id']}/links", {"file": "video.mp4"})["url"]

    async def again(what, act):
        while True:
            try:
                answers[what, await act()] += 1
            except (OSError, ValueError, IndexError, asyncio.IncompleteReadError) as error:
                answers[what, type(error).__name__] += 1
                await asyncio.sleep(0.1)

    async def stream():
        reader, writer = await connect(address)
        try:
            writer.write(head(key, "GET", "/v1/events", 0))
            status = int((await reader.readline()).split()[1])
            while status == 200 and await reader.read(1 << 16):
                pass
            await asyncio.sleep(1)
            return status
        finally:
            writer.close()

    async def idle():
        reader, writer = await connect(address)
        try:
            await reader.read()
            return "closed"
        finally:
            writer.close()

    async def slow_download():
        reader, writer = await connect(address)
        try:
            writer.write(head(None, "GET", link, 0))
            status = int((await reader.readline()).split()[1])
            while await reader.read(1024):
                await asyncio.sleep(1)
            return status
        finally:
            writer.close()

    def post(path, body):
        async def act():
            return (await request(address, key, "POST", path, json.dumps({**body, "library_id": library_id}).encode()))[0]
        return act

    async def upload():
        tail = os.urandom(16)
        body = film + (8 + len(tail)).to_bytes(4, "big") + b"free" + tail
        return (await request(address, key, "POST", "/v1/footage", body, "video/mp4"))[0]

    async def follow_link():
        return (await request(address, None, "GET", link))[0]

    kinds = [("stream", stream, N_STREAMS), ("idle", idle, N_IDLE)] + [
        (what, act, N_OF_EACH) for what, act in (
            ("preview", post("/v1/flocks/preview", PREVIEW)), ("flock", post("/v1/flocks", LARGE_FLOCK)),
            ("upload", upload), ("link", follow_link), ("slow download", slow_download))]
    tasks = [asyncio.create_task(again(what, act)) for what, act, n in kinds for _ in range(n)]
    stop = asyncio.Event()
    asyncio.get_running_loop().add_signal_handler(signal.SIGINT, stop.set)
    await stop.wait()
    for task in tasks:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)
    for (what, answer), n in sorted(answers.items(), key=str):
        print(f"attack: {n:7} x {what}: {answer}")


if __name__ == "__main__":
    if sys.argv[1] == "attack":
        raise_descriptor_limit()
        asyncio.run(attack(*sys.argv[2:]))
    else:
        main(*sys.argv[1:])
