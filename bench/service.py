"""Measures the speed of the service against common tools (docs/explanation/promises.md, "Overload").

    bench/service.py target/release/flockreel [FILM] [--write]

- Upload of 1 GiB over loopback, against cp and fsync to the same disk, and the memory that it adds.
- Requests for small JSON, per second and 99th percentile, idle and while analyses run.
- Download of a film in ranges, against nginx.

FILM is the film of the analyses; without it, the program makes one. Requires wrk, nginx and curl. Each figure
is the median of three runs; an upload is compared with the copy just before it. The downloads are the best of
three runs. --write writes bench/results/service.json and its section of docs/measurements.md.
"""

import hashlib
import json
import os
import platform
import re
import socket
import statistics
import subprocess
import sys
import tempfile
import threading
import time
import urllib.request
from pathlib import Path

import measurements
from table import starred

GIB = 1 << 30
WRK_S = 5
RUNS = 3
ROWS = []


def main(program, *more):
    film = more[0] if more and more[0] != "--write" else None
    with tempfile.TemporaryDirectory(dir=os.environ.get("BENCH_DIR")) as folder:
        folder = Path(folder)
        if film is None:
            film = folder / "film.mp4"
            subprocess.run([program, "sample", "-o", film, "--frames", "600"], check=True, stderr=subprocess.DEVNULL)
        service, address = start(program, folder / "data")
        try:
            footage = upload_speed(service, address, film, folder)
            json_speed(address, film)
            range_speed(address, footage, folder)
        finally:
            service.terminate()
            service.wait(timeout=60)
    if "--write" in more:
        measurements.save("service", result())


def start(program, data, *flags):
    port = free_port()
    arguments = [program, "serve", "--bind", f"127.0.0.1:{port}", "--data", data, "--no-sample", "--log", "warn", *flags]
    service = subprocess.Popen(arguments, stdin=subprocess.DEVNULL)
    address = f"http://127.0.0.1:{port}"
    for _ in range(100):
        try:
            urllib.request.urlopen(f"{address}/healthz", timeout=1).close()
            return service, address
        except OSError:
            time.sleep(0.1)
    raise TimeoutError("the service did not answer")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def upload_speed(service, address, film, folder):
    """Uploads a film with a box of 1 GiB at its end, which players ignore."""
    large = folder / "large.mp4"
    small = Path(film).read_bytes()
    with large.open("wb") as out:
        out.write(small + (1).to_bytes(4, "big") + b"free" + (GIB + 16).to_bytes(8, "big"))
        block = os.urandom(1 << 20)
        for index in range(1024):
            out.write(hashlib.sha256(index.to_bytes(4, "big")).digest() + block[32:])
    Path(f"/proc/{service.pid}/clear_refs").write_text("5")
    before = memory_mb(service.pid, "VmRSS")
    copied, uploaded, busy, answer = [], [], [], None
    # Copy and upload in turns, each after a sync, because disks slow down after some gigabytes.
    for run in range(RUNS):
        with large.open("r+b") as out:  # make the bytes differ: equal uploads are stored once
            out.seek(-1, os.SEEK_END)
            out.write(bytes([run]))
        os.sync()
        copied.append(timed(lambda: copy(large, folder / f"copy{run}")))
        os.sync()
        start, busy_before = time.monotonic(), processor_s(service.pid)
        command = ["curl", "-sS", "-X", "POST", "-H", "Content-Type: video/mp4", "-T", large, f"{address}/v1/footage"]
        answer = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
        uploaded.append(time.monotonic() - start)
        busy.append(processor_s(service.pid) - busy_before)
    added = memory_mb(service.pid, "VmHWM") - before
    runs = ", ".join(f"{ours:.1f} s and {theirs:.1f} s" for ours, theirs in zip(uploaded, copied))
    ratio = statistics.median(theirs / ours for ours, theirs in zip(uploaded, copied))
    line("rate of an upload of 1 GiB, relative to cp and fsync", f"{ratio:.0%}", runs, "> 60%", ratio > .6)
    zeros = bytes(GIB)
    hashing = statistics.median(timed(lambda: hashlib.sha256(zeros)) for _ in range(RUNS))
    line("processor time of the service for this upload", f"{statistics.median(busy):.1f} s", f"SHA-256 of 1 GiB alone: {hashing:.1f} s", "", True)
    line("memory added by the upload", f"{added:.1f} MB", "", "< 16 MB", added < 16)
    return answer


def copy(source, target):
    subprocess.run(["cp", source, target], check=True)
    with target.open("rb") as file:
        os.fsync(file.fileno())


def timed(work):
    start = time.monotonic()
    work()
    return time.monotonic() - start


def processor_s(pid):
    user, system = Path(f"/proc/{pid}/stat").read_text().rsplit(")", 1)[1].split()[11:13]
    return (int(user) + int(system)) / os.sysconf("SC_CLK_TCK")


def memory_mb(pid, field):
    status = Path(f"/proc/{pid}/status").read_text()
    return int(re.search(rf"{field}:\s+(\d+) kB", status)[1]) / 1024


def json_speed(address, film):
    footage = post(f"{address}/v1/footage", Path(film).read_bytes(), "video/mp4")
    url = f"{address}/v1/footage/{footage['id']}"
    tell_requests("requests for small JSON, idle", url, "> 9000/s", lambda rate, p99_ms: rate > 9000)
    stop = threading.Event()
    working = threading.Thread(target=keep_busy, args=(address, footage["id"], stop))
    working.start()
    time.sleep(1)
    tell_requests("requests for small JSON, during analyses", url, "p99 < 20 ms", lambda rate, p99_ms: p99_ms < 20)
    stop.set()
    working.join()


def tell_requests(what, url, bar, holds):
    rates, p99s_ms = zip(*(wrk(url) for _ in range(RUNS)))
    each = ", ".join(f"{rate:.0f}/s and {p99_ms:.1f} ms" for rate, p99_ms in zip(rates, p99s_ms))
    rate, p99_ms = statistics.median(rates), statistics.median(p99s_ms)
    line(what, f"{rate:.0f}/s, p99 {p99_ms:.1f} ms", each, bar, holds(rate, p99_ms))


def keep_busy(address, footage_id, stop):
    while not stop.is_set():
        job = post(f"{address}/v1/analyses", {"footage_id": footage_id})["job_id"]
        while not json.load(urllib.request.urlopen(f"{address}/v1/jobs/{job}"))["finished_at"] and not stop.is_set():
            time.sleep(0.2)
    urllib.request.urlopen(urllib.request.Request(f"{address}/v1/jobs/{job}", method="DELETE")).close()


def range_speed(address, footage, folder):
    ours = f"{address}/v1/footage/{footage['id']}/file"
    port = free_port()
    [blob] = (folder / "data/blobs/footage").glob(f"{footage['id']}*/video")
    (folder / "www").mkdir()
    (folder / "www/video").symlink_to(blob)
    config = folder / "nginx.conf"
    config.write_text(
        f"worker_processes 1; daemon off; pid {folder}/nginx.pid; error_log stderr crit; events {{}}\n"
        f"http {{ access_log off; sendfile on; client_body_temp_path {folder}/b; proxy_temp_path {folder}/p;\n"
        f"fastcgi_temp_path {folder}/f; uwsgi_temp_path {folder}/u; scgi_temp_path {folder}/s;\n"
        f"server {{ listen 127.0.0.1:{port}; location / {{ root {folder}/www; }} }} }}\n"
    )
    folder.chmod(0o755)
    command = ["nginx", "-e", "stderr", "-c", config, "-g", "user root;"]
    nginx = subprocess.Popen(command, stdin=subprocess.DEVNULL)
    try:
        time.sleep(0.5)
        theirs = f"http://127.0.0.1:{port}/video"
        rates = {url: max(mb_per_s(url) for _ in range(RUNS)) for url in (ours, theirs)}
    finally:
        nginx.terminate()
        nginx.wait()
    ratio = rates[ours] / rates[theirs]
    line("rate of downloads in ranges of 8 MiB, relative to nginx", f"{ratio:.0%}", f"{rates[ours]:.0f} MB/s and {rates[theirs]:.0f} MB/s",
         "> 80%", ratio > .8)


def wrk(url, *more):
    command = ["wrk", "-t1", "-c16", f"-d{WRK_S}s", "--latency", *more, url]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert "Non-2xx" not in said, said
    rate = float(re.search(r"Requests/sec:\s+([\d.]+)", said)[1])
    value, unit = re.search(r"99%\s+([\d.]+)(us|ms|s)", said).groups()
    return rate, float(value) * {"us": 0.001, "ms": 1, "s": 1000}[unit]


def mb_per_s(url):
    command = ["wrk", "-t1", "-c4", "-d4s", "-H", "Range: bytes=1048576-9437183", url]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    value, unit = re.search(r"Transfer/sec:\s+([\d.]+)(KB|MB|GB)", said).groups()
    return float(value) * {"KB": 1 / 1024, "MB": 1, "GB": 1024}[unit]


def post(url, body, media_type="application/json"):
    data = body if isinstance(body, bytes) else json.dumps(body).encode()
    request = urllib.request.Request(url, data, {"Content-Type": media_type})
    with urllib.request.urlopen(request) as answer:
        return json.load(answer)


def line(what, measured, runs, bar, is_met):
    ROWS.append([what, starred(measured, is_met), runs, bar])
    print(f"{what:56} {ROWS[-1][1]} (bar: {bar}) {runs}", flush=True)


def machine():
    cpu = re.search(r"model name\s*: (.*)", Path("/proc/cpuinfo").read_text())
    return f"{os.cpu_count()} cores ({cpu[1] if cpu else platform.machine()})"


def result():
    return {
        "title": "Speed of the service",
        "about": f"Requests and transfers over loopback, on {machine()}. The cores are shared "
                 "with wrk, nginx and curl. Runs of transfers list flockreel first and the other program second.",
        "command": "make service",
        "head": ["what", "measured", "runs", "bar"],
        "rows": ROWS,
    }


if __name__ == "__main__":
    main(*sys.argv[1:])
