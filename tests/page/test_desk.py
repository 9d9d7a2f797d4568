"""The desk: film, plots, matrix and reading show one moment; a film is measured again with other settings."""

import json
import re
import subprocess

import pytest
from playwright.sync_api import expect

from steps import fetch, said, say, until

pytestmark = pytest.mark.thorough

LOADED = "document.querySelector('#place').dataset.loaded === 'true'"
FRAME = "document.querySelector('#place').dataset.frame"
# The film of the filled service: 150 frames, 30 a second.
FPS = 30


@pytest.fixture
def library(filled_service):
    """Address of the desk, address of the files, and library.json of its film."""
    found = next(one for one in json.loads(fetch(filled_service + "/v1/libraries"))["items"] if one["n_frames"] == 150)
    files = f"{filled_service}/v1/libraries/{found['id']}"
    return f"{filled_service}/libraries/{found['id']}", files, json.loads(fetch(files + "/library.json"))


def make_numbered_film(path, first, n_frames):
    """Returns a film whose frames are as bright as their numbers, which begin at `first`."""
    source = f"color=black:size=64x48:rate={FPS}:duration={n_frames / FPS},format=yuv420p,geq=lum={16 + first}+N:cb=128:cr=128"
    command = ["ffmpeg", "-v", "error", "-f", "lavfi", "-i", source, "-c:v", "libx264", "-crf", "4", "-g", "10", "-bf", "0"]
    subprocess.run([*command, "-pix_fmt", "yuv420p", "-movflags", "+faststart", path], check=True)
    return path.read_bytes()


@pytest.fixture(scope="session")
def numbered_film(tmp_path_factory):
    """A film whose frame k is as bright as k."""
    return make_numbered_film(tmp_path_factory.mktemp("numbered") / "film.mp4", 0, 150)


def open_desk(page, address):
    page.goto(address)
    until(page, LOADED)


def serve(page, pattern, body, media_type):
    """Answers requests with bytes, or with the part of them that is asked for."""

    def answer(route):
        asked = re.match(r"bytes=(\d+)-(\d*)", route.request.headers.get("range", ""))
        if not asked:
            return route.fulfill(body=body, headers={"Content-Type": media_type, "Accept-Ranges": "bytes"})
        first, last = int(asked[1]), int(asked[2] or len(body) - 1)
        headers = {"Content-Type": media_type, "Accept-Ranges": "bytes", "Content-Range": f"bytes {first}-{last}/{len(body)}"}
        return route.fulfill(status=206, body=body[first : last + 1], headers=headers)

    page.route(pattern, answer)


def shown_frame(page):
    """Number of the frame that the numbered film shows."""
    luma = page.evaluate(
        """() => {
          const context = Object.assign(document.createElement("canvas"), { width: 8, height: 8 }).getContext("2d");
          context.drawImage(document.querySelector(".stage video"), 0, 0, 8, 8);
          return context.getImageData(4, 4, 1, 1).data[1];
        }"""
    )
    return round(luma * 219 / 255)


def cursor_frame(page, first=0, n_frames=150):
    """Frame at which the cursor of the time axis is, from its place on the screen."""
    x, width = page.evaluate(
        """() => {
          const axis = document.querySelector(".axis").getBoundingClientRect();
          return [document.querySelector(".axis .now").getBoundingClientRect().left - axis.left - 66, axis.width - 78];
        }"""
    )
    return first + int(x / width * n_frames)


def test_a_film_that_was_not_played_shows_its_first_frame(page, library):
    open_desk(page, library[0])
    video = page.locator("video")
    until(page, "document.querySelector('video').readyState >= 2")
    page.wait_for_timeout(300)
    first = video.screenshot()
    for key, frame in (("ArrowRight", 1), ("ArrowLeft", 0)):
        page.keyboard.press(key)
        until(page, f"Math.floor(document.querySelector('video').currentTime * {FPS}) === {frame} && !document.querySelector('video').seeking")
        page.wait_for_timeout(300)
    assert video.screenshot() == first


def test_each_key_shows_its_frame_in_film_plots_and_reading(page, library, numbered_film):
    serve(page, "**/film.mp4", numbered_film, "video/mp4")
    open_desk(page, library[0])
    until(page, "document.querySelector('.stage video').readyState >= 2")
    steps = [("ArrowRight", 1), ("ArrowRight", 2), ("Shift+ArrowRight", 12), ("ArrowLeft", 11), ("End", 149), ("Shift+ArrowLeft", 139), ("Home", 0)]
    for key, frame in steps:
        page.keyboard.press(key)
        assert page.evaluate(FRAME) == str(frame)
        expect(page.locator(".reading")).to_contain_text(f"frame {frame} ·")
        expect(page.locator(".axis")).to_have_attribute("aria-valuenow", str(frame))
        assert cursor_frame(page) == frame
        until(page, f"Math.abs(document.querySelector('.stage video').currentTime * {FPS} - {frame} - 0.5) < 0.1")
        until(page, "!document.querySelector('.stage video').seeking")
        until(page, lambda: shown_frame(page) == frame)


def test_part_of_a_film_keeps_the_numbers_of_the_whole_film(page, library, tmp_path):
    # Frames 60 to 119 were measured: film.mp4 begins with them, and n_frames counts only them.
    measured = json.loads(fetch(library[1])) | {"n_frames": 60}
    measured["params"] |= {"from_s": 2.0, "to_s": 4.0}
    page.route(library[1], lambda route: route.fulfill(body=json.dumps(measured), content_type="application/json"))
    serve(page, "**/film.mp4", make_numbered_film(tmp_path / "part.mp4", 60, 60), "video/mp4")
    open_desk(page, library[0])
    until(page, "document.querySelector('.stage video').readyState >= 2")
    for key, frame in [("End", 119), ("Shift+ArrowLeft", 109), ("Home", 60), ("ArrowLeft", 60), ("ArrowRight", 61)]:
        page.keyboard.press(key)
        assert page.evaluate(FRAME) == str(frame)
        assert cursor_frame(page, 60, 60) == frame
        until(page, "!document.querySelector('.stage video').seeking")
        page.wait_for_timeout(100)
        assert shown_frame(page) == frame


def test_patches_lead_from_one_to_the_next(page, library):
    first = library[2]["patches"][0]
    open_desk(page, f"{library[0]}?t={first['start'] / FPS + 0.001:.3f}&tab=patches")
    expect(page.locator(".patch-now")).to_contain_text("Patch 0:")
    expect(page.locator(".patch-ways").first.locator("button")).to_have_count(min(9, len(first["next"])))
    page.locator(".patch-ways").first.get_by_role("button", name="goes on").click()
    assert page.evaluate(FRAME) == str(first["end"])
    expect(page.locator(".patch-now")).to_contain_text("Patch 1:")


def test_view_guess_is_mended_with_one_click(page, library):
    open_desk(page, library[0])
    page.get_by_role("button", name="No, from above").click()
    expect(page.locator(".editor").get_by_label("Filmed", exact=True)).to_have_value("top")
    expect(page.locator(".editor-foot")).to_contain_text("Filmed: from above")


def test_other_mover_is_ignored_in_its_place_and_time(page, library):
    mover = {"kind": "in_place", "from_s": 1.0, "to_s": 2.5, "box_px": [10, 20, 60, 40]}
    poses = fetch(library[1] + "/poses.json").replace(b'"frames":[\n', b'"other_movers":[' + json.dumps(mover).encode() + b'],"frames":[\n', 1)
    serve(page, "**/poses.json", poses, "application/json")
    sent = []
    page.route("**/v1/analyses", lambda route: (sent.append(route.request.post_data_json), route.fulfill(status=422, body="{}")))
    open_desk(page, library[0])
    card = page.locator(".is-mover")
    expect(card).to_contain_text("Something moves but stays in its place, from 1.0 to 2.5 s")
    card.get_by_role("button", name="Ignore it").click()
    page.get_by_role("button", name="Measure", exact=True).click()
    until(page, "document.querySelector('.editor .problem') !== null")
    assert sent[0]["params"]["ignore"] == [{key: mover[key] for key in ("box_px", "from_s", "to_s")}]


def test_film_that_plays_moves_plots_and_reading(page, library, numbered_film):
    serve(page, "**/film.mp4", numbered_film, "video/mp4")
    open_desk(page, library[0])
    page.keyboard.press("Space")
    until(page, f"Number({FRAME}) > 15")
    page.keyboard.press("Space")
    until(page, "document.querySelector('.stage video').paused && !document.querySelector('.stage video').seeking")
    until(page, lambda: shown_frame(page) == int(page.evaluate(FRAME)) == cursor_frame(page))


def test_link_with_a_time_opens_at_that_moment_and_follows_it(page, library):
    open_desk(page, library[0] + "?t=2&tab=pose")
    assert page.evaluate(FRAME) == "60"
    expect(page.get_by_role("tab", name="Path")).to_have_attribute("aria-selected", "true")
    page.keyboard.press("ArrowRight")
    until(page, "location.search === '?t=2.034&tab=pose'")
    page.reload()
    until(page, LOADED)
    assert page.evaluate(FRAME) == "61"


def test_click_on_the_matrix_plays_the_jump_from_one_moment_to_the_other(page, library):
    address, _, measured = library
    plain = [one for one in measured["transitions"] if not one["mirrored"]]
    if not plain:
        pytest.skip("the film has no plain jump")
    one = min(plain, key=lambda jump: jump["distance"])
    half = measured["clip_frames"] // 2
    n_clips = 150 - measured["clip_frames"] + 1
    open_desk(page, address)
    page.get_by_label("mirrored jumps").uncheck()
    page.evaluate(
        """() => {
          window.frames_seen = [];
          const place = document.querySelector("#place");
          new MutationObserver(() => frames_seen.push(Number(place.dataset.frame))).observe(place, { attributeFilter: ["data-frame"] });
        }"""
    )
    box = page.locator(".matrix").bounding_box()
    position = {"x": (one["to"] + 0.5) / n_clips * box["width"], "y": (one["from"] + 0.5) / n_clips * box["height"]}
    page.locator(".matrix").click(position=position)
    before, after = one["from"] + half - 1, one["to"] + half
    until(page, f"frames_seen.includes({after}) && frames_seen.at(-1) === {min(149, after + FPS)}")
    seen = page.evaluate("frames_seen")
    cut = seen.index(after)
    assert seen[cut - 1] == max(1, before)
    assert seen[0] == max(0, before - FPS)
    assert seen[cut:] == sorted(seen[cut:])


def headings_with_a_gap(files):
    """Poses that swing over the border of 180 degrees before and after a gap of frames 60 to 89."""
    poses = json.loads(fetch(files + "/poses.json"))
    frames = poses.pop("frames")
    for pose in frames:
        k = pose["frame"]
        is_seen = not 60 <= k < 90
        pose.update(detected=is_seen, head_confidence=1.0 if is_seen else None, heading_rad=(3.1 if k % 3 else -3.1) if is_seen else None)
    return json.dumps(poses)[:-1] + ', "frames": [\n' + ",\n".join(json.dumps(pose, separators=(",", ":")) for pose in frames) + "\n]}\n"


INK_IN_THE_GAP = """() => {
  // Columns from the middle of the gap: nothing but the grid is there.
  const canvas = document.querySelector(".plot-heading canvas");
  const probe = document.createElement("span");
  document.body.append(probe);
  const colorOf = (name) => { probe.style.color = `var(--${name})`; return getComputedStyle(probe).color.match(/\\d+/g).map(Number); };
  const inks = [colorOf("accent"), colorOf("line-strong")];
  const ratio = canvas.width / canvas.clientWidth;
  const [left, width] = [66 * ratio, canvas.width - 78 * ratio];
  const count = (from, to) => {
    const x = Math.round(left + width * from);
    const { data } = canvas.getContext("2d").getImageData(x, 0, Math.round(width * (to - from)), canvas.height);
    let n = 0;
    for (let k = 0; k < data.length; k += 4) if (data[k + 3] > 60 && inks.some((ink) => ink.every((value, c) => Math.abs(value - data[k + c]) < 30))) n += 1;
    return n;
  };
  return { gap: count(61 / 150, 89 / 150), before: count(40 / 150, 59 / 150) };
}"""


def test_heading_plot_has_no_line_in_a_gap(page, library):
    serve(page, "**/poses.json", headings_with_a_gap(library[1]).encode(), "application/json")
    open_desk(page, library[0])
    until(page, "document.querySelector('.plot-heading canvas')?.width > 100")
    until(page, f"({INK_IN_THE_GAP})().before > 0")
    assert page.evaluate(INK_IN_THE_GAP)["gap"] == 0


def test_heading_plot_is_drawn_without_the_vendored_library(page, library):
    page.route("**/vendor/**", lambda route: route.abort())
    serve(page, "**/poses.json", headings_with_a_gap(library[1]).encode(), "application/json")
    open_desk(page, library[0])
    line = "document.querySelector('.plot-heading path.sure')"
    until(page, f"({line}?.getAttribute('d') ?? '').length > 20")
    hits = f"""(() => {{
      const [path, width, height] = [{line}, {line}.ownerSVGElement.viewBox.baseVal.width, {line}.ownerSVGElement.viewBox.baseVal.height];
      let n = 0;
      for (let x = width * 61 / 150; x < width * 89 / 150; x += 4) for (let y = 0; y < height; y += 1) if (path.isPointInStroke(new DOMPoint(x, y))) n += 1;
      return n;
    }})()"""
    assert page.evaluate(hits) == 0


def test_measuring_again_sends_only_changed_settings(page, library):
    sent = []
    problem = {"title": "Several animals move.", "code": "several_animals", "detail": "", "advice": ""}

    def answer(route):
        sent.append(route.request.post_data_json)
        route.fulfill(status=422, body=json.dumps(problem), content_type="application/problem+json")

    page.route("**/v1/analyses", answer)
    open_desk(page, library[0])
    page.get_by_role("button", name="Measure again").click()
    page.get_by_label("When several animals move", exact=True).select_option("largest")
    picture = page.locator(".editor-picture")
    picture.click(position={"x": 60, "y": 50})
    expect(page.locator(".editor-marks li")).to_contain_text("in frame 0")
    page.get_by_role("button", name="Measure", exact=True).click()
    expect(page.locator(".editor .problem")).to_contain_text("Several animals move.")
    assert set(sent[0]["params"]) == {"follow", "animal_at"}
    assert sent[0]["params"]["animal_at"]["frame"] == 0


def test_frame_field_takes_a_number_and_keys_stay_out_of_fields(page, library):
    open_desk(page, library[0])
    page.keyboard.press("g")
    page.keyboard.type("42")
    page.keyboard.press("Enter")
    assert page.evaluate(FRAME) == "42"
    page.keyboard.press("ArrowLeft")
    assert page.evaluate(FRAME) == "42"


def test_tables_say_what_the_pictures_show(page, library):
    open_desk(page, library[0])
    page.get_by_text("The plots as a table").click()
    expect(page.locator(".desk-time table tbody tr").first).to_contain_text("0.00")
    page.get_by_text("The 20 best jumps").first.click()
    n_jumps = min(20, len(library[2]["transitions"]))
    expect(page.locator("table.jumps tbody tr")).to_have_count(n_jumps)
    expect(page.locator("table.files tbody tr").filter(has_text="poses.csv")).to_have_count(1)


def test_ruler_changes_plot_numbers_and_csv_to_centimetres(page, library):
    address, files, _ = library
    open_desk(page, address + "?t=2&tab=size")
    panel, title, distance = page.locator("#panel-size"), page.locator(".plot-speed .plot-title"), page.locator(".motion-numbers dd").first
    in_body_lengths = say(page, "desk.plot.speed", unit=say(page, "unit.speed.bl"))
    expect(title).to_have_text(in_body_lengths)
    expect(distance).to_have_text(said(page, "unit.bl"))
    panel.locator("[name=line_cm]").fill("10")
    box = panel.locator("canvas").bounding_box()
    page.mouse.move(box["x"] + box["width"] * 0.25, box["y"] + box["height"] / 2)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] * 0.75, box["y"] + box["height"] / 2)
    page.mouse.up()
    expect(title).to_have_text(say(page, "desk.plot.speed", unit="cm/s"))
    expect(distance).to_have_text(said(page, "unit.cm"))
    measured = json.loads(fetch(files))
    assert measured["px_per_cm"] == pytest.approx(measured["image_size_px"][0] / 20, rel=0.02)
    header, *rows = [line.split(",") for line in fetch(files + "/motion.csv").decode().splitlines()]
    shown = float(re.search(r"([\d.]+) cm/s", page.locator(".reading").inner_text())[1])
    assert shown == pytest.approx(float(rows[2 * FPS][header.index("speed_cm_per_s")]), rel=0.02, abs=0.06)
    panel.get_by_role("button", name=say(page, "desk.scale.none")).click()
    expect(title).to_have_text(in_body_lengths)
    expect(distance).to_have_text(said(page, "unit.bl"))
    assert json.loads(fetch(files))["px_per_cm"] is None


def test_a_zone_that_is_drawn_is_counted_and_stays_for_the_next_film(page, library):
    address, files, _ = library
    open_desk(page, address + "?tab=zones")
    panel = page.locator("#panel-zones")
    expect(panel).to_contain_text(say(page, "desk.zone.none"))
    box = panel.locator("canvas").bounding_box()
    # The corners are round.
    page.mouse.move(box["x"] + 9, box["y"] + 9)
    page.mouse.down()
    page.mouse.move(box["x"] + box["width"] - 9, box["y"] + box["height"] - 9)
    page.mouse.up()
    row = panel.locator("tbody tr")
    expect(row).to_contain_text("100%")
    row.locator("input").fill("arena")
    row.locator("input").press("Tab")
    expect(panel.get_by_role("link")).to_have_attribute("href", re.compile("zones=arena%3Arect%3A"))
    header, values = [line.split(",") for line in fetch(f"{address.split('/libraries')[0]}{panel.get_by_role('link').get_attribute('href')}").decode().splitlines()]
    assert float(values[header.index("arena_share")]) == 1
    page.reload()
    expect(row.locator("input")).to_have_value("arena")
    row.get_by_role("button").click()
    expect(panel).to_contain_text(say(page, "desk.zone.none"))
