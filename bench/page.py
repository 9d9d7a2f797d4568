#!/usr/bin/env python3
"""Measures the page in Chromium, on a service of its own, and stores the figures in bench/results/page.json.

    bench/page.py PROGRAM

Times are medians of several runs. Chromium draws with SwiftShader, which is WebGL on the processor, so the service and
the drawing share the cores. Runs with the environment of the page's tests (`target/page-venv`).
"""
import json, os, pathlib, platform, statistics, subprocess, sys, tempfile

from playwright.sync_api import expect, sync_playwright

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests/page"), str(ROOT / "tests")]
from service import post, started, wait_for_job  # noqa: E402
from steps import LONG_MS, PICTURE, expect_swimming, flock_canvas, get, settle, until  # noqa: E402

CHROMIUM = "/usr/bin/chromium"
ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--js-flags=--expose-gc", "--enable-precise-memory-info"]
N_RUNS = 5
# Seconds over which frames are counted.
COUNTED_S = 4
# Frames of the long film: that of an hour at less than three frames per second.
LONG_FRAMES = 10_000

# Changes a setting and returns the milliseconds until the canvas shows as many animals as `n`.
REPLAN = """([selector, n]) => new Promise((resolve, reject) => {
    const range = document.querySelector(selector), begun = performance.now();
    range.value = String(n);
    range.dispatchEvent(new Event("input", { bubbles: true }));
    const look = () => {
        const name = document.querySelector("canvas[role=img]")?.getAttribute("aria-label") ?? "";
        if (name.includes(String(n))) requestAnimationFrame(() => resolve(performance.now() - begun));
        else if (performance.now() - begun > 30_000) reject(Error(`the canvas still shows: ${name}`));
        else requestAnimationFrame(look);
    };
    look();
})"""
FRAMES = """(seconds) => new Promise((resolve) => {
    const begun = performance.now();
    let n = 0;
    const count = (now) => { n++; if (now - begun < 1000 * seconds) requestAnimationFrame(count); else resolve(n / ((now - begun) / 1000)); };
    requestAnimationFrame(count);
})"""
# Presses a key and returns the milliseconds until the reading shows another frame and the browser has drawn it.
SCRUB = """() => new Promise((resolve) => {
    const reading = document.querySelector("p.reading"), before = reading.textContent, begun = performance.now();
    document.dispatchEvent(new KeyboardEvent("keydown", { key: "ArrowRight" }));
    const look = () => {
        if (reading.textContent !== before) requestAnimationFrame(() => resolve(performance.now() - begun));
        else if (performance.now() - begun > 3000) resolve(Infinity);
        else requestAnimationFrame(look);
    };
    look();
})"""


def measure(address, film, playwright):
    """Returns the rows of the table: what, figure, bar."""
    browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
    footage = post(f"{address}/v1/footage?name=goldfish.mp4", film.read_bytes(), "video/mp4")["id"]
    page = browser.new_page(viewport={"width": 1280, "height": 800}, locale="en-US")
    rows = [measured_to_swimming(page, address, footage)]
    library = get(f"{address}/v1/libraries")["items"][0]["id"]
    wait_for_job(address, post(f"{address}/v1/flocks", {"library_id": library, "count": 20, "frames": 200})["job_id"])
    # The flock of this page would share the cores.
    page.goto("about:blank")
    rows += home(browser, address)
    for count, frames, replan_ms, least_fps in ((20, 400, 150, 55), (200, 300, 350, 40)):
        page.goto(f"{address}/libraries/{library}/studio?count={count}&frames={frames}")
        expect_swimming(page)
        settle(page)
        rows += studio(page, count, frames, replan_ms, least_fps)
    page.goto(f"{address}/libraries/{library}")
    loaded(page)
    rows.append(row("key pressed until the desk shows the frame, ms", [page.evaluate(SCRUB) for _ in range(2 * N_RUNS)], 50))
    rows.append(memory(page, address, library))
    browser.close()
    return rows


def row(name, values, bar, at_least=False):
    value = statistics.median(values)
    missed = value < bar if at_least else value > bar
    return [name, f"{value:.3g}{'*' if missed else ''}", f"{'>=' if at_least else '<='} {bar}"]


def measured_to_swimming(page, address, footage):
    page.goto(f"{address}/films/{footage}")
    settle(page)
    job = post(f"{address}/v1/analyses", {"footage_id": footage})["job_id"]
    page.reload()
    script = """async (job) => {
        const canvas = () => document.querySelector("canvas[role=img]");
        const ended = async () => (await (await fetch("/v1/jobs/" + job)).json()).state === "done";
        while (!(await ended())) await new Promise((resolve) => setTimeout(resolve, 20));
        const begun = performance.now();
        while (!canvas()) await new Promise(requestAnimationFrame);
        return performance.now() - begun;
    }"""
    shown_s = page.evaluate(script, job) / 1000
    expect_swimming(page, LONG_MS)
    return row("analysis done until its flock is shown, s", [shown_s], 1.0)


def home(browser, address):
    times = []
    for _ in range(N_RUNS):
        page = browser.new_context().new_page()
        page.goto(address)
        canvas = flock_canvas(page)
        canvas.wait_for(timeout=LONG_MS)
        until(page, lambda: canvas.evaluate(PICTURE))  # noqa: B023
        times.append(page.evaluate("performance.now() / 1000"))
        entries = page.evaluate("""performance.getEntries().filter(({ initiatorType, name, entryType }) =>
            entryType === "navigation" || ["script", "link", "other"].includes(initiatorType) && /\\.(js|css|json)$|words/.test(name)).map(({ encodedBodySize }) => encodedBodySize)""")
        page.context.close()
    return [
        row("Home until its flock is drawn, s", times, 1.0),
        row("code, styles and words of Home, compressed, kB", [sum(entries) / 1000], 90),
        row("files of these", [len(entries)], 25),
    ]


def studio(page, count, frames, replan_ms, least_fps):
    rates, times = [], []
    for k in range(N_RUNS):
        rates.append(page.evaluate(FRAMES, COUNTED_S))
        times.append(page.evaluate(REPLAN, ['[data-name="count"] input[type=range]', count - 1 - k % 2]))
        page.wait_for_timeout(1000)
    size = f"{count} animals, {frames} frames"
    return [
        row(f"slider moved until the new flock is shown, {size}, ms", times, replan_ms),
        row(f"pictures per second of the living flock, {size}", rates, least_fps, at_least=True),
    ]


def loaded(page):
    until(page, "document.querySelector('#place').dataset.loaded === 'true'", LONG_MS / 1000)
    settle(page)


def memory(page, address, library):
    """Growth of the page's heap over fifty new plans and twenty places."""
    heap = "(gc(), gc(), performance.memory.usedJSHeapSize / 1e6)"
    visit = [f"/libraries/{library}/studio?count=20&frames=200", "/flocks", f"/libraries/{library}", "/"]

    def wander(n):
        for k in range(n):
            page.evaluate("(address) => { const link = Object.assign(document.createElement('a'), { href: address }); document.body.append(link); link.click(); link.remove(); }", visit[k % 4])
            settle(page)

    page.goto(address + visit[0])
    wander(4)
    wander(1)
    expect_swimming(page)
    before = page.evaluate(heap)
    for k in range(50):
        page.evaluate(REPLAN, ['[data-name="count"] input[type=range]', 10 + k % 7])
    wander(20)
    wander(1)
    expect_swimming(page)
    return row("growth of the heap over 50 plans and 20 places, MB", [page.evaluate(heap) - before], 20)


def long_film(address, film, playwright):
    footage = post(f"{address}/v1/footage?name=long.mp4", film.read_bytes(), "video/mp4")["id"]
    analysis = post(f"{address}/v1/analyses", {"footage_id": footage})
    wait_for_job(address, analysis["job_id"])
    browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
    times = []
    for _ in range(3):
        page = browser.new_context().new_page()
        page.goto(f"{address}/libraries/{analysis['library_id']}")
        until(page, "document.querySelector('#place').dataset.loaded === 'true'", LONG_MS / 1000)
        times.append(page.evaluate("performance.now() / 1000"))
        page.context.close()
    browser.close()
    return row(f"desk of {LONG_FRAMES} frames until it is complete, s", times, 1.5)


def make_film(program, path, n_frames, size):
    command = [program, "--log", "error", "sample", "-o", path, "--frames", str(n_frames), "--size", size]
    subprocess.run(command, check=True, stdin=subprocess.DEVNULL)
    return path


def main():
    program = sys.argv[1]
    load = os.getloadavg()[0]
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        folder = pathlib.Path(folder)
        film = make_film(program, folder / "goldfish.mp4", 600, "640x480")
        long = make_film(program, folder / "long.mp4", LONG_FRAMES, "320x240")
        with started(program, folder / "data") as address:
            rows = measure(address, film, playwright)
            rows.append(long_film(address, long, playwright))
    about = (f"A `*` marks a missed bar. Measured on {os.cpu_count()} cores ({platform.machine()}), with a load of {load:.1f} at the beginning, "
             "in Chromium with WebGL on the processor.")
    result = {"title": "The page", "about": about, "command": "make page-bench", "head": ["measure", "figure", "bar"], "rows": rows}
    (ROOT / "bench/results/page.json").write_text(json.dumps(result, indent=1, ensure_ascii=False) + "\n")
    for one in rows:
        print(" | ".join(one))


if __name__ == "__main__":
    main()
