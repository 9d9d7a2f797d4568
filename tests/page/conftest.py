"""Fixtures: running services, films made by flockreel, and Debian's chromium."""

import os
import re
import subprocess
import sys
import urllib.parse
from pathlib import Path

import pytest
from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).parents[1]))
from service import post, started, wait_for_job  # noqa: E402, of the folder above

PROGRAM = str(Path(os.environ["FLOCKREEL_PROGRAM"]).resolve())
CHROMIUM = os.environ.get("CHROMIUM", "/usr/bin/chromium")


@pytest.fixture(scope="session")
def film(tmp_path_factory):
    """Path of a short film of the virtual fish."""
    return make_film(tmp_path_factory.mktemp("film") / "goldfish <b>one.mp4", seed=1)


def make_film(path, seed):
    """Makes a film of 150 frames, which depends on the seed, and returns its path."""
    subprocess.run([PROGRAM, "sample", "-o", path, "--frames", "150", "--seed", str(seed)], check=True)
    return path


@pytest.fixture(scope="session")
def filled_service(tmp_path_factory, film):
    """Address of a service with one film and one flock of 6, made through the API."""
    with started(PROGRAM, tmp_path_factory.mktemp("filled") / "data") as address:
        name = urllib.parse.quote(film.name)
        footage = post(f"{address}/v1/footage?name={name}", film.read_bytes(), "video/mp4")
        analysis = post(f"{address}/v1/analyses", {"footage_id": footage["id"]})
        flock = post(f"{address}/v1/flocks", {"library_id": analysis["library_id"], "count": 6, "frames": 60})
        wait_for_job(address, flock["job_id"])
        yield address


@pytest.fixture
def empty_service(tmp_path):
    """Address of a service without data."""
    with started(PROGRAM, tmp_path / "data") as address:
        yield address


@pytest.fixture
def starting_service(tmp_path):
    """Address of a service that is filming its sample."""
    with started(PROGRAM, tmp_path / "data", sample=True) as address:
        yield address


@pytest.fixture(scope="session")
def browser():
    with sync_playwright() as playwright:
        arguments = ["--no-sandbox", "--disable-gpu", "--autoplay-policy=no-user-gesture-required"]
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=arguments)
        yield browser
        browser.close()


@pytest.fixture
def page(browser):
    """A browser page. Its test fails on script errors and on requests to other servers."""
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
    # The browser also logs error responses, which are not faults of the page.
    return message.type == "error" and "Failed to load resource" not in message.text


def is_elsewhere(url):
    return not re.match(r"http://127\.0\.0\.1:\d+/|blob:|data:", url)


@pytest.fixture
def closed_service(tmp_path):
    """Address of a service that requires tokens, and a valid token."""
    data = tmp_path / "data"
    command = [PROGRAM, "token", "create", "--name", "page", "--data", data]
    token = subprocess.run(command, check=True, capture_output=True, text=True).stdout.strip()
    with started(PROGRAM, data, "--auth", "required") as address:
        yield address, token
