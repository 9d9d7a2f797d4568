"""Starts the real service for the Python tests, with its own data folder and port."""

import contextlib
import json
import socket
import subprocess
import time
import urllib.request


@contextlib.contextmanager
def started(program, data, *flags, sample=False):
    """Runs the service and yields its address. Asserts exit code 0 at the end."""
    address = free_address()
    service = start(program, data, address, *flags, sample=sample)
    try:
        yield address
    finally:
        service.terminate()
        code = service.wait(timeout=30)
    assert code == 0, f"the service ended with {code}"


def free_address():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"http://127.0.0.1:{probe.getsockname()[1]}"


def start(program, data, address, *flags, sample=False):
    """Starts the service and returns its process once it answers. `sample` fills an empty data folder."""
    flags = flags if sample else ("--no-sample", *flags)
    arguments = ["serve", "--bind", address.removeprefix("http://"), "--data", data, *flags]
    service = subprocess.Popen([program, *arguments], stdin=subprocess.DEVNULL)
    wait_until_ready(service, address)
    return service


def wait_until_ready(service, address):
    for _ in range(300):
        assert service.poll() is None, "the service ended by itself"
        try:
            urllib.request.urlopen(f"{address}/healthz", timeout=1).close()
            return
        except OSError:
            time.sleep(0.1)
    raise TimeoutError("the service did not answer within 30 s")


def post(url, body, media_type="application/json"):
    data = body if isinstance(body, bytes) else json.dumps(body).encode()
    request = urllib.request.Request(url, data, {"Content-Type": media_type})
    with urllib.request.urlopen(request) as answer:
        return json.load(answer)


def wait_for_job(address, job_id):
    for _ in range(2400):
        with urllib.request.urlopen(f"{address}/v1/jobs/{job_id}") as answer:
            job = json.load(answer)
        if job["finished_at"]:
            assert job["state"] == "done", job["error"]
            return
        time.sleep(0.1)
    raise TimeoutError("the job did not end within 240 s")
