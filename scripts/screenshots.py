#!/usr/bin/env python3
"""Makes pictures of the page of a running service, to be looked at.

    scripts/screenshots.py PROGRAM OUT [sheets] [tour]

sheets: OUT/<place>.png shows a place in both themes, at three widths and in both languages. tour: OUT/tour.mp4 is a
recording of about 20 s: a film is dropped, its flock swims, the pointer chases it, its film is made. A still of it is
written to docs/page.jpg. Runs with the environment of the page's tests (`target/page-venv`). PROGRAM serves an example of its own.
"""
import base64, pathlib, subprocess, sys, tempfile, time

from playwright.sync_api import expect, sync_playwright

ROOT = pathlib.Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "tests/page"), str(ROOT / "tests")]
from service import post, started, wait_for_job  # noqa: E402
from steps import LONG_MS, drop, expect_swimming, flock_canvas, heading, make_film_in_studio, say, settle, until  # noqa: E402

CHROMIUM = "/usr/bin/chromium"
ARGUMENTS = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--autoplay-policy=no-user-gesture-required"]
WIDTHS, THEMES, LOCALES = (390, 820, 1440), ("light", "dark"), ("en", "ja")
# Height of one picture of a sheet, pixels.
SHEET_HEIGHT = 900
TOUR_SIZE = {"width": 1280, "height": 800}
TOUR_FPS = 12


def fill(address, film):
    """Measures a film, and makes a flock and a virtual fish of it. Returns the addresses of the places."""
    footage = post(f"{address}/v1/footage?name=goldfish.mp4", film.read_bytes(), "video/mp4")["id"]
    analysis = post(f"{address}/v1/analyses", {"footage_id": footage})
    library = analysis["library_id"]
    wait_for_job(address, analysis["job_id"])
    flock = post(f"{address}/v1/flocks", {"library_id": library, "count": 20, "frames": 200})
    wait_for_job(address, post(f"{address}/v1/fish", {"library_id": library})["job_id"])
    wait_for_job(address, flock["job_id"])
    return {
        "home": "/", "films": "/films", "film": f"/films/{footage}", "desk": f"/libraries/{library}", "studio": f"/libraries/{library}/studio",
        "fish": f"/libraries/{library}/fish", "reels": "/flocks", "reel": f"/flocks/{flock['flock_id']}", "jobs": "/jobs", "missing": "/nowhere", "docs": "/docs",
    }


def sheets(browser, address, places, out):
    """Writes a sheet of every place: a row for each language, and in it each width in both themes."""
    for name, path in places.items():
        pictures = []
        for locale in LOCALES:
            page = browser.new_context(locale=locale).new_page()
            for width in WIDTHS:
                page.set_viewport_size({"width": width, "height": SHEET_HEIGHT})
                page.goto(address + path)
                page.wait_for_timeout(1500)
                if name != "docs":
                    settle(page)
                for theme in THEMES:
                    page.emulate_media(color_scheme=theme)
                    page.wait_for_timeout(300)
                    pictures.append(page.screenshot())
            page.context.close()
        join(pictures, out / f"{name}.png")
        print(out / f"{name}.png")


def join(pictures, path):
    """Writes pictures of the same height to one, with a row for each language."""
    n_columns = len(pictures) // len(LOCALES)
    with tempfile.TemporaryDirectory() as folder:
        files = [pathlib.Path(folder) / f"{k}.png" for k in range(len(pictures))]
        for file, picture in zip(files, pictures, strict=True):
            file.write_bytes(picture)
        rows = [f"{''.join(f'[{row * n_columns + k}]' for k in range(n_columns))}hstack={n_columns}[row{row}]" for row in range(len(LOCALES))]
        stacked = f"{''.join(f'[row{row}]' for row in range(len(LOCALES)))}vstack={len(LOCALES)}"
        inputs = [argument for file in files for argument in ("-i", file)]
        run(["ffmpeg", "-nostdin", "-v", "error", "-y", *inputs, "-filter_complex", ";".join([*rows, stacked]), path])


def run(command, **options):
    subprocess.run(command, check=True, stdin=subprocess.DEVNULL, **options)


class Recording:
    """The frames that the browser draws, with their times."""

    def __init__(self, page):
        self.frames, self.session = [], page.context.new_cdp_session(page)
        self.session.on("Page.screencastFrame", self.add)
        self.session.send("Page.startScreencast", {"format": "jpeg", "quality": 85})

    def add(self, frame):
        self.frames.append((time.monotonic(), base64.b64decode(frame["data"])))
        self.session.send("Page.screencastFrameAck", {"sessionId": frame["sessionId"]})

    def write(self, path, cuts):
        """Writes the frames to a film, without the seconds between the two times of each cut."""
        kept = [(at, data) for at, data in self.frames if not any(begin < at < end for begin, end in cuts)]
        command = ["ffmpeg", "-nostdin", "-v", "error", "-y", "-f", "concat", "-safe", "0", "-i", "list.txt", "-vf", "scale=trunc(iw/2)*2:trunc(ih/2)*2",
                   "-r", str(TOUR_FPS), "-pix_fmt", "yuv420p", str(path.resolve())]
        with tempfile.TemporaryDirectory() as folder:
            lines = []
            for k, (at, data) in enumerate(kept):
                (pathlib.Path(folder) / f"{k}.jpg").write_bytes(data)
                length_s = min(kept[k + 1][0] - at, 0.5) if k + 1 < len(kept) else 1.0
                lines.append(f"file {k}.jpg\nduration {length_s:.3f}\n")
            (pathlib.Path(folder) / "list.txt").write_text("".join(lines))
            run(command, cwd=folder)


def tour(browser, address, film, out):
    """Records a visit: drop, swim, chase, keep. The waits for the measurement and for the film are cut."""
    page = browser.new_context(viewport=TOUR_SIZE, locale="en", color_scheme="dark").new_page()
    page.goto(address)
    heading(page).wait_for()
    recording, cuts = Recording(page), []
    page.wait_for_timeout(2000)
    drop(page, film)
    page.wait_for_timeout(2500)
    begun = time.monotonic()
    page.get_by_text(say(page, "film.flock")).wait_for(timeout=LONG_MS)
    cuts.append((begun, time.monotonic() - 0.5))
    expect_swimming(page)
    page.wait_for_timeout(2000)
    box = flock_canvas(page).bounding_box()
    for step in range(60):
        turn = abs(step % 40 - 20) / 20
        page.mouse.move(box["x"] + box["width"] * (0.2 + 0.6 * turn), box["y"] + box["height"] * (0.3 + 0.3 * (step % 30) / 30))
        page.wait_for_timeout(80)
    page.mouse.move(4, 4)
    page.get_by_role("link", name=say(page, "film.studio")).click()
    expect_swimming(page)
    page.wait_for_timeout(2500)
    page.screenshot(path=ROOT / "docs/page.jpg", quality=80)
    count = page.locator('[data-name="count"] input[type=range]')
    for n in (25, 30, 35, 40):
        count.fill(str(n))
        page.wait_for_timeout(500)
    expect_swimming(page)
    page.wait_for_timeout(1500)
    begun = time.monotonic()
    make_film_in_studio(page)
    cuts.append((begun + 1.5, time.monotonic() - 0.5))
    expect(page.locator("video").first).to_be_visible(timeout=LONG_MS)
    page.wait_for_timeout(3000)
    recording.write(out / "tour.mp4", cuts)
    page.context.close()
    print(out / "tour.mp4")


def main():
    program, out = sys.argv[1], pathlib.Path(sys.argv[2])
    wanted = sys.argv[3:] or ["sheets", "tour"]
    out.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, sync_playwright() as playwright:
        film = pathlib.Path(folder) / "goldfish.mp4"
        run([program, "--log", "error", "sample", "-o", film, "--frames", "600"])
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        if "sheets" in wanted:
            with started(program, pathlib.Path(folder) / "data") as address:
                sheets(browser, address, fill(address, film), out)
        if "tour" in wanted:
            with started(program, pathlib.Path(folder) / "tour") as address:
                tour(browser, address, film, out)
        browser.close()


if __name__ == "__main__":
    main()
