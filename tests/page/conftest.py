"""Fixtures: running services, films made by flockreel, and Debian's chromium."""

import json
import os
import re
import shutil
import subprocess
import sys
import urllib.parse
import urllib.request
from pathlib import Path

import pytest
from playwright.sync_api import sync_playwright

sys.path.insert(0, str(Path(__file__).parents[1]))
from service import post, started, wait_for_job  # noqa: E402, of the folder above

PROGRAM = str(Path(os.environ["FLOCKREEL_PROGRAM"]).resolve())
CHROMIUM = os.environ.get("CHROMIUM", "/usr/bin/chromium")
# A page that parses this name as HTML asks for /x and opens a dialog. Both are faults.
FILM = "goldfish <img src=x onerror=alert(1)>.mp4"
# Software rendering, so that WebGL works without a graphics card.
ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--autoplay-policy=no-user-gesture-required"]


def pytest_configure(config):
    config.addinivalue_line("markers", "thorough: left out in CI, because all tests of the page take ten minutes")


def make_film(path, seed, frames=60, size="320x240"):
    """Makes a film of the virtual fish, which depends on the seed, and returns its path."""
    settings = ["--frames", str(frames), "--size", size, "--seed", str(seed)]
    subprocess.run([PROGRAM, "--log", "error", "sample", "-o", path, *settings], check=True, capture_output=True)
    return path


@pytest.fixture(scope="session")
def film(tmp_path_factory):
    """Path of a film of 150 frames."""
    return make_film(tmp_path_factory.mktemp("film") / FILM, seed=1, frames=150, size="640x480")


@pytest.fixture(scope="session")
def small_film(tmp_path_factory):
    """Path of a film of 60 frames."""
    return make_film(tmp_path_factory.mktemp("small") / "small.mp4", seed=2)


@pytest.fixture
def other_film(tmp_path, small_film):
    """Path of a copy of the small film."""
    return Path(shutil.copy(small_film, tmp_path / "minnow.mp4"))


@pytest.fixture(scope="module")
def filled_service(tmp_path_factory, film):
    """Address of a service with one film and one flock of 6, made through the API. Each file of tests has its own,
    because tests add to it."""
    with started(PROGRAM, tmp_path_factory.mktemp("filled") / "data") as address:
        fill(address, film)
        yield address


def fill(address, film):
    """Measures a film and makes a flock of it. Returns the ids of the footage, the library and the flock, when the library
    has its views."""
    name = urllib.parse.quote(film.name)
    footage = post(f"{address}/v1/footage?name={name}", film.read_bytes(), "video/mp4")
    analysis = post(f"{address}/v1/analyses", {"footage_id": footage["id"]})
    flock = post(f"{address}/v1/flocks", {"library_id": analysis["library_id"], "count": 6, "frames": 60})
    wait_for_job(address, flock["job_id"])
    library = json.load(urllib.request.urlopen(f"{address}/v1/libraries/{analysis['library_id']}"))
    wait_for_job(address, library["views"]["job_id"])
    return footage["id"], analysis["library_id"], flock["flock_id"]


@pytest.fixture
def empty_service(tmp_path):
    """Address of a service without data."""
    with started(PROGRAM, tmp_path / "data") as address:
        yield address


@pytest.fixture
def closed_service(tmp_path):
    """Address of a service that requires tokens, a valid token, and its data folder."""
    data = tmp_path / "data"
    with started(PROGRAM, data, "--auth", "required") as address:
        yield address, token(data, "create", "--name", "page", "--owner", "page"), data


def token(data, *arguments):
    """Runs a command of `flockreel token` and returns what it prints."""
    return subprocess.run([PROGRAM, "token", *arguments, "--data", data], check=True, capture_output=True, text=True).stdout.strip()


@pytest.fixture(scope="session")
def browser():
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        yield browser
        browser.close()


@pytest.fixture
def visitor(browser):
    """Opens a page for a new visitor. The test fails on script errors, dialogs, requests to other servers, and
    pictures, styles or scripts that do not exist."""
    contexts, faults = [], []

    def open_page(**options):
        context = browser.new_context(**{"viewport": {"width": 1280, "height": 900}, "locale": "en-US", **options})
        contexts.append(context)
        context.on("page", lambda page: watch(page, faults))
        return context.new_page()

    yield open_page
    for context in contexts:
        context.close()
    assert faults == []


@pytest.fixture
def page(visitor):
    """The page of a visitor who reads English."""
    return visitor()


def watch(page, faults):
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda message: faults.append(message.text) if is_fault(message) else None)
    page.on("dialog", lambda dialog: (faults.append(dialog.message), dialog.dismiss()))
    page.on("request", lambda request: faults.append(request.url) if is_elsewhere(request.url) else None)
    page.on("response", lambda answer: faults.append(f"{answer.status} {answer.url}") if is_missing(answer) else None)


def is_fault(message):
    # The browser also logs error responses, which are not faults of the page.
    return message.type == "error" and "Failed to load resource" not in message.text


def is_elsewhere(url):
    return not re.match(r"http://127\.0\.0\.1:\d+/|blob:|data:|about:", url)


def is_missing(answer):
    # The bundled libraries may be missing, and a film has no picture before it was read.
    may_be_missing = re.search("/vendor/|/v1/footage/", answer.url)
    return answer.status in (404, 500) and answer.request.resource_type in ("image", "script", "stylesheet", "media") and not may_be_missing
