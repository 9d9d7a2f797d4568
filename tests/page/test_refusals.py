"""Films that are refused, files that are no films, and jobs that are cancelled: the reason, the advice, and the way on."""

import json
import re
import subprocess

import pytest
from playwright.sync_api import expect

from conftest import make_film
from steps import LONG_MS, choose_film, drop, expect_swimming, get, heading, open_tray, said, say, until

pytestmark = pytest.mark.thorough

# Codes that only a service under load or with other limits gives, and what may mend them.
MENDED = {"animal_too_small": "sprites", "time_limit": "to_s", "memory_limit": "to_s"}
WITHOUT_BUTTON = ["no_transitions", "decoder_crashed"]


@pytest.fixture(scope="session")
def film_of_two(tmp_path_factory):
    """Path of a film of two fish."""
    folder = tmp_path_factory.mktemp("two")
    films = [make_film(folder / f"{seed}.mp4", seed) for seed in (3, 4)]
    path = folder / "two fish.mp4"
    inputs = [word for film in films for word in ("-i", film)]
    subprocess.run(["ffmpeg", "-v", "error", *inputs, "-filter_complex", "hstack", "-c:v", "libx264", "-crf", "16", path], check=True)
    return path


def refuse(page, address, code):
    """Lets the newest job of the service's film fail with a code. Returns the address of the film's place."""
    job = next(one for one in get(f"{address}/v1/jobs")["items"] if one["kind"] == "analysis")
    mends = [{"param": MENDED[code], "value": None}] if code in MENDED else []
    error = {"code": code, "title": f"Reason of {code}.", "detail": "Seen in frame 35.", "advice": "Film it again.", "mends": mends, "params": {}}
    failed = {**job, "state": "failed", "error": error, "finished_at": job["created_at"]}

    def answer(route):
        one = re.search("/v1/jobs/[^?]", route.request.url)
        route.fulfill(json=failed if one else {"items": [failed], "next_cursor": None})

    page.route(re.compile(r"/v1/jobs(\?|/[0-9a-f-]{36}$)"), answer)
    return f"{address}/films/{job['subject']['id']}"


@pytest.mark.parametrize("code", [*MENDED, *WITHOUT_BUTTON])
def test_a_refused_film_tells_the_reason_the_advice_and_offers_what_mends_it(page, filled_service, code):
    page.goto(refuse(page, filled_service, code))
    alert = page.get_by_role("main").get_by_role("alert")
    expect(alert.get_by_role("link", name=re.compile(code))).to_have_attribute("href", f"/docs/errors#{code}")
    assert len(alert.inner_text()) > len(code) + 30
    if code not in MENDED:
        expect(alert.get_by_role("button")).to_have_count(0)
        return
    alert.get_by_role("button").click()
    focused = "(document.activeElement.name || document.activeElement.closest('[data-name]')?.dataset.name)"
    until(page, f"document.querySelector('dialog.editor') && {focused} === '{MENDED[code]}'")


def test_two_animals_are_refused_with_a_picture_and_the_button_follows_one(page, empty_service, film_of_two):
    page.goto(empty_service)
    choose_film(page, film_of_two)
    alert = page.get_by_role("main").get_by_role("alert")
    expect(alert).to_contain_text("several_animals", timeout=LONG_MS)
    picture = alert.get_by_role("img", name=say(page, "problem.picture"))
    picture.scroll_into_view_if_needed()
    until(page, lambda: picture.evaluate("(image) => image.naturalWidth") > 100)
    alert.get_by_role("button", name=say(page, "mend.follow")).click()
    page.get_by_role("button", name=say(page, "editor.start"), exact=True).click()
    expect_swimming(page, LONG_MS)
    expect(alert).to_be_hidden()


def test_a_text_and_an_empty_file_are_refused_in_the_tray(page, empty_service, tmp_path):
    text, nothing = tmp_path / "holiday.mp4", tmp_path / "nothing.mp4"
    text.write_text("not a film at all\n" * 50)
    nothing.write_bytes(b"")
    page.goto(empty_service)
    choose_film(page, text, nothing)
    alerts = open_tray(page).get_by_role("alert")
    expect(alerts).to_have_count(2, timeout=LONG_MS)
    expect(open_tray(page)).to_contain_text("not_a_video")
    for name in ("holiday.mp4", "nothing.mp4"):
        expect(open_tray(page)).to_contain_text(name)
    for n_left in (1, 0):
        open_tray(page).get_by_role("button", name=say(page, "dismiss")).first.click()
        expect(alerts).to_have_count(n_left)
    assert get(f"{empty_service}/v1/footage")["items"] == []
    expect(heading(page)).to_have_text(say(page, "home.title"))


def test_a_film_beside_a_text_is_measured(page, empty_service, other_film, tmp_path):
    text = tmp_path / "notes.txt"
    text.write_text("not a film at all\n" * 50)
    page.goto(empty_service)
    drop(page, text, other_film)
    until(page, lambda: len(get(f"{empty_service}/v1/jobs")["items"]) == 1, LONG_MS / 1000)
    expect(open_tray(page)).to_contain_text("notes.txt")
    expect(open_tray(page).get_by_role("alert")).to_be_visible()


def test_a_film_of_five_gigabytes_is_refused_before_it_is_sent(page, empty_service, tmp_path):
    huge = tmp_path / "huge.mp4"
    with huge.open("wb") as file:
        file.truncate(5_000_000_000)
    pieces = []
    page.on("request", lambda request: pieces.append(request.url) if request.method == "PATCH" else None)
    page.goto(empty_service)
    choose_film(page, huge)
    alert = open_tray(page).get_by_role("alert")
    expect(alert).to_contain_text("too_large", timeout=LONG_MS)
    assert pieces == []


def test_a_dropped_folder_or_text_does_not_leave_the_page(page, empty_service):
    page.goto(f"{empty_service}/jobs")
    script = """() => {
        const transfer = new DataTransfer();
        transfer.setData("text/uri-list", "http://127.0.0.1:1/elsewhere");
        for (const type of ["dragover", "drop"]) document.body.dispatchEvent(new DragEvent(type, { dataTransfer: transfer, bubbles: true, cancelable: true }));
    }"""
    page.evaluate(script)
    drop(page)
    expect(page).to_have_url(re.compile("/jobs$"))
    expect(heading(page)).to_have_text(say(page, "jobs.title"))


def test_a_cancelled_upload_vanishes_and_nothing_is_kept(page, empty_service, other_film):
    page.route("**/v1/footage?*", lambda route: None)  # goes on until it is cancelled
    page.goto(empty_service)
    choose_film(page, other_film)
    tray = open_tray(page)
    expect(tray).to_contain_text(other_film.name)
    tray.get_by_role("button", name=say(page, "cancel")).click()
    expect(tray).not_to_contain_text(other_film.name, timeout=1000)
    assert get(f"{empty_service}/v1/footage")["items"] == []
    page.unroute("**/v1/footage?*")
    page.keyboard.press("Escape")
    choose_film(page, other_film)
    expect(page).to_have_url(re.compile("/films/"), timeout=LONG_MS)


def test_a_cancelled_analysis_stops_soon_and_can_be_tried_again(page, empty_service, tmp_path):
    film = make_film(tmp_path / "carp.mp4", seed=31, frames=240, size="640x480")
    page.goto(empty_service)
    choose_film(page, film)
    place = page.get_by_role("main")
    expect(place.get_by_role("progressbar")).to_be_visible(timeout=LONG_MS)
    place.get_by_role("button", name=say(page, "cancel")).click()
    until(page, lambda: get(f"{empty_service}/v1/jobs")["items"][0]["state"] == "cancelled", 20)
    expect(place.get_by_role("progressbar")).to_be_hidden()
    until(page, "document.activeElement !== document.body")
    page.goto(f"{empty_service}/jobs")
    expect(place).to_contain_text(say(page, "state.cancelled"))
    place.get_by_role("button", name=say(page, "job.retry")).click()
    expect(place.get_by_role("link", name=say(page, "job.open"))).to_be_visible(timeout=LONG_MS)
    assert len(get(f"{empty_service}/v1/jobs")["items"]) == 1


def test_the_reason_of_a_failed_job_is_in_the_list_of_jobs(page, filled_service):
    refuse(page, filled_service, "nothing_moves")
    page.goto(f"{filled_service}/jobs")
    expect(page.get_by_role("main").get_by_role("alert").first).to_contain_text("nothing_moves")
    expect(page.get_by_role("main")).to_contain_text(say(page, "state.failed"))
