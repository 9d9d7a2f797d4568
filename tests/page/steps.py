"""Steps of a person on the page: words in the page's language, files chosen or dropped, and conditions to wait for."""

import base64
import json
import re
import time
import urllib.request
from pathlib import Path

from playwright.sync_api import expect

# An unoptimized program on two busy cores.
LONG_MS = 240_000
# A place of the page with its data.
LOAD_MS = 60_000


def say(page, key, **values):
    """Returns the words of a key in the language of the page, which must be open."""
    script = "([key, values]) => import('/static/js/app/words.js').then(({ say }) => say(key, values))"
    return page.evaluate(script, [key, values])


def said(page, key, **values):
    """Returns a pattern for the words of a key. Values that are not given may be anything."""
    script = """([key, given]) => import("/static/js/app/words.js").then(({ say }) =>
        say(key, new Proxy(given, { get: (values, name) => (name in values ? values[name] : "\\u0001") })))"""
    return re.compile(re.escape(page.evaluate(script, [key, values])).replace("\x01", ".+"))


def until(page, condition, timeout_s=30):
    """Polls a script, or a function of Python, until it is true, and returns its value. The page's policy forbids
    playwright's wait_for_function."""
    end = time.monotonic() + timeout_s
    while True:
        value = condition() if callable(condition) else page.evaluate(condition)
        if value:
            return value
        assert time.monotonic() < end, f"never came true: {condition}"
        page.wait_for_timeout(50)


def settle(page, quiet_s=0.5):
    """Waits until the place has a heading and has asked for nothing more for a while. Videos never end their requests, so
    playwright's networkidle does not come."""
    expect(heading(page)).not_to_be_empty(timeout=LOAD_MS)
    asked, since = -1, time.monotonic()

    def is_quiet():
        nonlocal asked, since
        count = page.evaluate("performance.getEntriesByType('resource').filter(({ initiatorType }) => initiatorType !== 'video').length")
        if count != asked:
            asked, since = count, time.monotonic()
        return time.monotonic() - since > quiet_s

    until(page, is_quiet)


def fetch(address):
    with urllib.request.urlopen(address) as answer:
        return answer.read()


def get(address):
    return json.loads(fetch(address))


def choose_film(page, *films):
    """Chooses films by the first button for it."""
    with page.expect_file_chooser() as chooser:
        page.get_by_text(say(page, "home.choose"), exact=True).first.click()
    chooser.value.set_files([str(film) for film in films])


def drop(page, *films):
    """Drops films on the middle of the page."""
    files = [[film.name, base64.b64encode(film.read_bytes()).decode()] for film in map(Path, films)]
    script = """(files) => {
        const transfer = new DataTransfer();
        for (const [name, text] of files) transfer.items.add(new File([Uint8Array.from(atob(text), (c) => c.charCodeAt(0))], name));
        const target = document.elementFromPoint(innerWidth / 2, innerHeight / 2);
        for (const type of ["dragenter", "dragover", "drop"]) target.dispatchEvent(new DragEvent(type, { dataTransfer: transfer, bubbles: true, cancelable: true }));
    }"""
    page.evaluate(script, files)


def heading(page):
    return page.get_by_role("heading", level=1)


def flock_canvas(page):
    """The canvas on which a flock swims. Its name says how many swim, and where to."""
    return page.get_by_role("img", name=re.compile(f"{said(page, 'living.n', n=1).pattern}|{said(page, 'living.n').pattern}")).first


PICTURE = """(canvas) => new Promise((resolve) => requestAnimationFrame(() => {
    const small = Object.assign(document.createElement("canvas"), { width: 48, height: 36 }).getContext("2d", { willReadFrequently: true });
    small.drawImage(canvas, 0, 0, 48, 36);
    const { data } = small.getImageData(0, 0, 48, 36);
    resolve(data.some((value) => value) ? data.join() : "");
}))"""


def expect_swimming(page, timeout_ms=LOAD_MS):
    """Waits until a flock is on the page and its picture changes by itself."""
    canvas = flock_canvas(page)
    expect(canvas).to_be_visible(timeout=timeout_ms)
    seen = set()

    def changes():
        seen.add(canvas.evaluate(PICTURE))
        return len(seen - {""}) >= 3

    until(page, changes, timeout_ms / 1000)


def expect_still(page):
    """Asserts that the flock of the page does not move."""
    canvas = flock_canvas(page)
    expect(canvas).to_be_visible(timeout=LOAD_MS)
    pictures = {canvas.evaluate(PICTURE) for _ in range(10)} - {""}
    assert len(pictures) <= 1


def expect_playing(page, video):
    expect(video).to_be_visible(timeout=LOAD_MS)
    begin = video.evaluate("(video) => video.currentTime")
    until(page, lambda: video.evaluate("(video) => !video.paused && video.currentTime") not in (False, begin), LOAD_MS / 1000)


def open_tray(page):
    """Opens the tray of jobs if it is closed, and returns it."""
    tray = page.get_by_role("complementary", name=say(page, "tray.title"))
    if not tray.is_visible():
        page.locator("#tray-button").click()
    expect(tray).to_be_visible()
    return tray


def make_film_in_studio(page):
    """Makes the film of the studio and opens its reel. Returns the id of the flock."""
    page.get_by_role("button", name=say(page, "make.film")).click()
    page.get_by_role("link", name=say(page, "make.open")).click(timeout=LONG_MS)
    expect(page).to_have_url(re.compile(r"/flocks/[0-9a-f-]{36}"))
    return re.search(r"[0-9a-f-]{36}", page.url)[0]
