"""A really started service, a film made by the program, and Debian's chromium."""

import json
import os
import re
import socket
import subprocess
import time
import urllib.parse
import urllib.request
from pathlib import Path

import pytest
from playwright.sync_api import sync_playwright

PROGRAM = str(Path(os.environ["FLOCKREEL_PROGRAM"]).resolve())
CHROMIUM = os.environ.get("CHROMIUM", "/usr/bin/chromium")


@pytest.fixture(scope="session")
def film(tmp_path_factory):
    """A short film of the virtual fish."""
    path = tmp_path_factory.mktemp("film") / "goldfish <b>one.mp4"
    subprocess.run([PROGRAM, "sample", "-o", path, "--frames", "150", "--seed", "1"], check=True)
    return path


@pytest.fixture(scope="session")
def filled_service(tmp_path_factory, film):
    """The address of a service that holds one film and one flock of 6, made by its API."""
    for address in started(tmp_path_factory.mktemp("filled") / "data"):
        name = urllib.parse.quote(film.name)
        footage = post(f"{address}/v1/footage?name={name}", film.read_bytes(), "video/mp4")
        analysis = post(f"{address}/v1/analyses", {"footage_id": footage["id"]})
        flock = post(f"{address}/v1/flocks", {"library_id": analysis["library_id"], "count": 6, "frames": 60})
        wait_for_job(address, flock["job_id"])
        yield address


@pytest.fixture
def empty_service(tmp_path):
    """The address of a service that holds nothing yet."""
    yield from started(tmp_path / "data")


@pytest.fixture(scope="session")
def browser():
    with sync_playwright() as playwright:
        arguments = ["--no-sandbox", "--disable-gpu", "--autoplay-policy=no-user-gesture-required"]
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=arguments)
        yield browser
        browser.close()


@pytest.fixture
def page(browser):
    """A page that fails its test when a script fails or when anything is fetched from elsewhere."""
    context = browser.new_context(viewport={"width": 1280, "height": 900})
    page = context.new_page()
    faults = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda message: faults.append(message.text) if is_fault(message) else None)
    page.on("request", lambda request: faults.append(request.url) if is_elsewhere(request.url) else None)
    yield page
    context.close()
    assert faults == []


def is_fault(message):
    # The browser logs every answer that is not a success; the page's own faults are others.
    return message.type == "error" and "Failed to load resource" not in message.text


def is_elsewhere(url):
    return not re.match(r"http://127\.0\.0\.1:\d+/|blob:|data:", url)


@pytest.fixture
def closed_service(tmp_path):
    """The address of a service that demands tokens, and one that it takes."""
    data = tmp_path / "data"
    command = [PROGRAM, "token", "create", "--name", "page", "--data", data]
    token = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    for address in started(data, "--auth", "required"):
        yield address, token


def started(data, *flags):
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    address = f"http://127.0.0.1:{port}"
    arguments = ["serve", "--bind", f"127.0.0.1:{port}", "--data", data.name, "--no-sample", *flags]
    service = subprocess.Popen([PROGRAM, *arguments], cwd=data.parent, stdin=subprocess.DEVNULL)
    try:
        wait_until_ready(service, address)
        yield address
    finally:
        service.terminate()
        service.wait(timeout=30)


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
