"""The editor opens over every film. For each reason to refuse a film, its controls lead to a measurement, or the page says
that none does."""

import re

import pytest
from playwright.sync_api import expect

import films
from conftest import PROGRAM, post, started
from steps import LONG_MS, choose_film, get, open_tray, said, say, until

pytestmark = pytest.mark.thorough

# The words of the button that mends a refused film, and what the editor then shows in its sentence.
MENDED = {
    "several_animals": ("mend.animal_at.value", "set.animal_at"),
    "background_not_static": ("mend.ignore", "set.ignore"),
    "camera_moved": ("mend.to_s.value", "editor.part.of"),
    "light_changes": ("mend.to_s.value", "editor.part.of"),
    "scene_changes": ("mend.to_s.value", "editor.part.of"),
    "nothing_moves": ("mend.threshold.value", "set.threshold"),
}
# A flag of the command line begins with a dash.
FLAG = r"(^|\s)--?[a-z]"
# Buttons that would not help.
USELESS = {"background_not_static": "mend.follow", "nothing_moves": "mend.animal_at", "camera_moved": "mend.follow"}


@pytest.fixture(scope="module")
def service(tmp_path_factory):
    """Address of a service for the films of this file."""
    with started(PROGRAM, tmp_path_factory.mktemp("editor") / "data") as address:
        yield address


def send(page, address, film):
    """Sends a film, which is refused. Returns the alert that says why."""
    page.goto(address)
    choose_film(page, film)
    expect(page).to_have_url(re.compile("/films/"), timeout=LONG_MS)
    alert = page.get_by_role("main").get_by_role("alert")
    expect(alert).to_contain_text(re.compile("Error code"), timeout=LONG_MS)
    assert not re.search(FLAG, alert.inner_text()), alert.inner_text()
    return alert


def measure(page, address):
    """Starts the measurement of the open editor, and waits for its library."""
    page.get_by_role("dialog").get_by_role("button", name=say(page, "editor.start"), exact=True).click()
    expect(page.get_by_role("dialog")).to_be_hidden(timeout=LONG_MS)
    # The place of a masked film has another address, which appears a moment later.
    job = until(page, lambda: [one for one in get(f"{address}/v1/jobs")["items"][:1] if one["finished_at"]], LONG_MS / 1000)[0]
    assert job["state"] == "done", job["error"]
    return get(address + job["links"]["result"])


@pytest.mark.parametrize("code", MENDED)
def test_one_button_and_measure_mend_a_refused_film(page, service, tmp_path, code):
    alert = send(page, service, films.write(tmp_path / f"{code}.mp4", getattr(films, code)()))
    expect(alert).to_contain_text(code)
    if code in USELESS:
        expect(alert.get_by_role("button", name=said(page, USELESS[code]))).to_have_count(0)
    button, shown = MENDED[code]
    alert.get_by_role("button", name=said(page, button)).first.click()
    expect(page.locator(".editor-foot")).to_contain_text(said(page, shown))
    library = measure(page, service)
    assert library["detected_share"] > (0.3 if "part" in shown else 0.8)


def test_the_editor_shows_what_would_be_found_and_what_would_be_refused(page, service, tmp_path):
    alert = send(page, service, films.write(tmp_path / "two.mp4", films.several_animals(seed=9)))
    alert.get_by_role("button", name=say(page, "mend.follow")).click()
    seen = page.locator(".editor-seen")
    expect(seen).to_contain_text(say(page, "editor.seen", found=40, of=40), timeout=LONG_MS)
    expect(seen.get_by_role("alert")).to_have_count(0)
    moment = int(page.get_by_label(say(page, "desk.frame"), exact=True).input_value())
    # The outline of the larger animal is drawn over the film, where it is.
    x, y = films.path(moment)
    def is_colored_near(reach):
        """Returns whether a color is drawn over the gray film, at most `reach` pixels of the film from the animal."""
        script = """(canvas, [x, y, reach, width, height]) => {
            const zoom = Math.min(canvas.width / width, canvas.height / height);
            const [left, top] = [(canvas.width - zoom * width) / 2, (canvas.height - zoom * height) / 2];
            const box = [left + zoom * (x - reach), top + zoom * (y - reach), 2 * zoom * reach, 2 * zoom * reach];
            return [...canvas.getContext("2d").getImageData(...box).data];
        }"""
        data = page.locator(".editor-picture").evaluate(script, [x, y, reach, films.WIDTH, films.HEIGHT])
        return any(max(data[k:k + 3]) - min(data[k:k + 3]) > 40 for k in range(0, len(data), 4))

    until(page, lambda: is_colored_near(14))
    assert not is_colored_near(4)
    page.get_by_label(say(page, "set.follow"), exact=True).select_option("one")
    expect(seen.get_by_role("alert")).to_contain_text("several_animals", timeout=LONG_MS)
    assert not re.search(FLAG, seen.inner_text()), seen.inner_text()
    seen.get_by_role("button", name=said(page, "mend.animal_at.value")).first.click()
    expect(seen.get_by_role("alert")).to_have_count(0, timeout=LONG_MS)
    expect(page.locator(".editor-marks")).to_contain_text("in frame ")


def test_a_large_animal_is_measured_with_masks(page, service, tmp_path):
    masks = films.write(tmp_path / "masks.mkv", films.masks_of_the_large_animal())
    alert = send(page, service, films.write(tmp_path / "large.mp4", films.animal_too_large()))
    expect(alert).to_contain_text("animal_too_large")
    alert.get_by_role("button", name=say(page, "mend.masks")).click()
    expect(page.get_by_label(say(page, "editor.masks"))).to_be_focused()
    page.get_by_label(say(page, "editor.masks")).set_input_files(masks)
    library = measure(page, service)
    assert library["detected_share"] > 0.9


def test_a_wrong_point_is_followed_by_the_right_one(page, service, tmp_path):
    alert = send(page, service, films.write(tmp_path / "point.mp4", films.several_animals(seed=5)))
    page.locator("#change-settings").click()
    picture = page.locator(".editor-picture")
    box = picture.bounding_box()
    zoom = box["height"] / films.HEIGHT
    left = (box["width"] - zoom * films.WIDTH) / 2
    picture.click(position={"x": left + 3, "y": 3})
    expect(page.locator(".editor-marks")).to_contain_text("in frame ")
    page.get_by_role("button", name=say(page, "editor.start"), exact=True).click()
    expect(alert).to_contain_text("nothing_at_point", timeout=LONG_MS)
    alert.get_by_role("button", name=say(page, "mend.animal_at")).click()
    x, y = films.path(int(page.get_by_label(say(page, "desk.frame"), exact=True).input_value()))
    picture.click(position={"x": left + zoom * x, "y": zoom * y})
    assert measure(page, service)["detected_share"] > 0.8


def test_a_film_of_too_few_frames_is_told_to_be_filmed_again(page, service, tmp_path):
    alert = send(page, service, films.write(tmp_path / "short.mp4", films.too_few_frames()))
    expect(alert).to_contain_text("too_few_frames")
    expect(alert.get_by_role("button")).to_have_count(0)
    expect(page.get_by_text(say(page, "mend.none"))).to_be_visible()


def test_a_part_of_too_few_frames_is_mended_at_its_handles(page, service, tmp_path):
    send(page, service, films.write(tmp_path / "part.mp4", films.several_animals(seed=2)))
    page.locator("#change-settings").click()
    page.get_by_label(say(page, "set.follow"), exact=True).select_option("largest")
    end = page.get_by_label(say(page, "set.to_s"), exact=True)
    end.focus()
    page.keyboard.press("Home")
    page.get_by_role("button", name=say(page, "editor.start"), exact=True).click()
    alert = page.get_by_role("main").get_by_role("alert")
    expect(alert).to_contain_text("too_few_frames", timeout=LONG_MS)
    alert.get_by_role("button", name=say(page, "mend.from_s")).click()
    expect(page.get_by_label(say(page, "set.from_s"), exact=True)).to_be_focused()
    end.focus()
    page.keyboard.press("End")
    assert measure(page, service)["detected_share"] > 0.8


def test_a_film_that_was_cut_off_says_that_it_must_be_copied_again(page, service, tmp_path):
    whole = films.write(tmp_path / "whole.mp4", films.animal(), "-movflags", "+faststart").read_bytes()
    film = tmp_path / "cut.mp4"
    film.write_bytes(whole[: len(whole) // 2])
    page.goto(service)
    choose_film(page, film)
    alert = open_tray(page).get_by_role("alert").filter(has_text="truncated")
    expect(alert).to_contain_text("truncated", timeout=LONG_MS)
    expect(alert).to_contain_text("Copy the file from the camera again.")
    assert not re.search(FLAG, alert.inner_text())
    expect(alert.get_by_role("button")).to_have_count(0)


def test_every_parameter_of_an_analysis_has_a_control(page, service, tmp_path):
    send(page, service, films.write(tmp_path / "all.mp4", films.too_few_frames(level=60)))
    schema = get(f"{service}/openapi.json")["components"]["schemas"]["AnalysisParams"]["properties"]
    page.locator("#change-settings").click()
    page.get_by_text(say(page, "editor.more"), exact=True).click()
    shown = page.locator("dialog.editor").evaluate("(dialog) => [...dialog.querySelectorAll('[data-name], [name]')].map((one) => (one.dataset.name ?? one.name).split('.')[0])")
    assert len(schema) == 24
    drawn = {"animal_at", "head", "ignore"}
    assert set(schema) <= set(shown) | drawn
    assert page.locator("[name=editor-tool]").count() == len(drawn)


def test_an_orange_region_is_taken_with_its_time(page, service, tmp_path):
    alert = send(page, service, films.write(tmp_path / "clouds.mp4", films.background_not_static(seed=3)))
    sent = []
    page.route("**/v1/analyses", lambda route: (sent.append(route.request.post_data_json), route.fulfill(status=422, body="{}")))
    alert.get_by_role("button", name=say(page, "mend.to_s")).click()
    page.get_by_role("button", name=said(page, "editor.take")).click()
    page.get_by_label(say(page, "editor.ignore.to_s")).fill("2.5")
    page.get_by_role("button", name=say(page, "editor.start"), exact=True).click()
    until(page, lambda: sent)
    [ignored] = sent[0]["params"]["ignore"]
    assert ignored["to_s"] == 2.5 and ignored["from_s"] is None and ignored["box_px"][0] > 60


def test_no_advice_of_any_code_shows_a_flag(page, service):
    page.goto(service)
    script = "(texts) => import('/static/js/parts/problem.js').then(({ withoutCommands }) => texts.map(withoutCommands))"
    texts = page.evaluate(script, [one["advice"] for one in get(f"{service}/v1/errors")])
    assert len(texts) > 60
    assert [text for text in texts if re.search(FLAG, text)] == []


def test_a_refusal_is_one_line_in_the_studio_and_can_be_put_away(page, filled_service, tmp_path):
    page.goto(f"{filled_service}/studio")
    expect(page.locator(".studio-view")).to_be_visible(timeout=LONG_MS)
    film = films.write(tmp_path / "moth.mp4", films.several_animals(seed=7)).read_bytes()
    footage = post(f"{filled_service}/v1/footage?name=moth.mp4", film, "video/mp4")["id"]
    post(f"{filled_service}/v1/analyses", {"footage_id": footage})
    line = page.locator(".refused")
    expect(line).to_contain_text(say(page, "studio.refused", film="moth"), timeout=LONG_MS)
    expect(page.get_by_role("main").get_by_role("alert")).to_have_count(0)
    expect(line.get_by_role("link", name=say(page, "job.mend"))).to_have_attribute("href", f"/films/{footage}")
    assert line.bounding_box()["height"] < 80
    line.get_by_role("button", name=say(page, "dismiss")).click()
    expect(line).to_have_count(0)
    expect(open_tray(page)).not_to_contain_text("several_animals")
    page.goto(f"{filled_service}/jobs")
    expect(page.get_by_role("main")).to_contain_text("several_animals", timeout=LONG_MS)
