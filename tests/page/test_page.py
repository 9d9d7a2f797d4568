"""The page from a user's view: upload a film, read the measurements, play and download the flock."""

import json
import re
import time
import urllib.request

from playwright.sync_api import expect

LONG_MS = 240_000  # an unoptimized program on two shared cores


def measure(page, film):
    page.locator("#film-file").set_input_files(film)
    expect(page.locator("#film-job .job")).to_be_visible()
    expect(page.locator("#library")).to_be_visible(timeout=LONG_MS)


def make_a_flock(page, individuals, frames):
    page.get_by_role("spinbutton", name="Individuals").fill(str(individuals))
    page.get_by_role("spinbutton", name="Frames").fill(str(frames))
    page.get_by_role("button", name="Make the flock").click()
    expect(page.locator("#stage-title")).to_have_text(f"A flock of {individuals}", timeout=LONG_MS)


def until(page, script, timeout_s=30):
    """Polls the script until it is true. The page's policy forbids playwright's wait_for_function."""
    end = time.monotonic() + timeout_s
    while not page.evaluate(script):
        assert time.monotonic() < end, f"never came true: {script}"
        page.wait_for_timeout(100)


def fetch(url):
    with urllib.request.urlopen(url) as answer:
        return answer.read()


def test_a_chosen_film_becomes_a_flock_that_plays_and_downloads(page, empty_service, film):
    page.goto(empty_service)
    measure(page, film)
    expect(page.locator("#library-numbers")).to_contain_text("150")
    until(page, "[...document.querySelectorAll('#library img')].every((image) => image.naturalWidth > 0)")
    library = json.loads(fetch(empty_service + "/v1/libraries"))["items"][0]
    expect(page.locator("#library-advice-list li")).to_have_text([one["sentence"] for one in library["advice"]])

    make_a_flock(page, 6, 60)
    until(page, "document.querySelector('#stage-video').currentTime > 0.2")
    assert abs(page.evaluate("document.querySelector('#stage-video').duration") - 2.0) < 0.1

    with page.expect_download() as download:
        page.locator("#stage-video-link").click()
    assert download.value.path().read_bytes()[4:8] == b"ftyp"
    flock = json.loads(fetch(empty_service + page.locator("#stage-plan-link").get_attribute("href")))
    assert len(flock["individuals"]) == 6
    assert all(len(one["source_frame"]) == 60 for one in flock["individuals"])


def test_the_next_visit_shows_the_newest_flock_at_once(page, filled_service):
    page.goto(filled_service)
    expect(page.locator("#stage-title")).to_have_text("A flock of 6")
    until(page, "document.querySelector('#stage-video').readyState >= 2")
    expect(page.locator("#earlier-flocks li")).to_have_count(1)


def test_the_slider_reads_the_heading_moment_by_moment(page, filled_service):
    page.goto(filled_service)
    slider = page.get_by_role("slider", name="Time")
    expect(slider).to_have_attribute("max", "149")
    slider.focus()
    page.keyboard.press("ArrowRight")
    expect(page.locator("#heading-reading")).to_contain_text("frame 1")
    expect(page.locator("#heading-reading")).to_contain_text("°")


def test_the_heading_is_drawn_without_the_vendored_library(page, filled_service):
    page.route("**/vendor/**", lambda route: route.abort())
    page.goto(filled_service)
    expect(page.locator("#heading-plot path.sure")).to_have_attribute("d", re.compile(r"^M[\d.]+ -?[\d.]+L"))


def test_a_file_that_is_no_film_is_refused_in_words_where_it_was_dropped(page, filled_service, tmp_path):
    text = tmp_path / "holiday.mp4"
    text.write_text("not a film at all\n" * 50)
    page.goto(filled_service)
    page.locator("#film-file").set_input_files(text)
    problem = page.locator("#film-job .problem")
    expect(problem).to_be_visible(timeout=60_000)
    expect(problem).to_contain_text("Reason code: not_a_video")
    expect(page.locator("#film-form")).to_be_visible()


def test_a_file_name_is_shown_as_text(page, filled_service):
    page.goto(filled_service)
    expect(page.locator("#earlier-libraries li").first).to_be_visible()
    assert page.locator("#earlier-libraries b").count() == 0


def test_an_empty_service_says_what_to_do(page, empty_service):
    page.goto(empty_service)
    expect(page.locator("#stage-note")).to_contain_text("Choose a film of one animal")
    expect(page.locator("#library")).to_be_hidden()
    expect(page.locator("#make")).to_be_hidden()


def test_every_field_has_a_name_and_the_page_fits_a_phone(page, filled_service):
    page.set_viewport_size({"width": 360, "height": 640})
    page.goto(filled_service)
    expect(page.locator("#make")).to_be_visible()
    unnamed = "[...document.querySelectorAll('input, select')].filter((field) => !field.labels?.length).length"
    assert page.evaluate(unnamed) == 0
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")


def test_whoever_wants_no_motion_gets_none(browser, filled_service):
    context = browser.new_context(reduced_motion="reduce")
    page = context.new_page()
    page.goto(filled_service)
    until(page, "document.querySelector('#stage-video').readyState >= 1")
    page.wait_for_timeout(300)
    assert page.evaluate("document.querySelector('#stage-video').paused")
    context.close()


def test_a_service_that_asks_who_is_there_is_signed_in_to_and_out_of(page, closed_service, film):
    address, token = closed_service
    page.goto(address)
    field = page.get_by_label("Token")
    expect(field).to_be_focused()
    expect(page.locator("#film-form")).to_be_hidden()
    field.fill(token[:-1] + "!")
    page.get_by_role("button", name="Sign in").click()
    expect(page.locator("#sign-in-problem")).to_contain_text("Reason code: unauthenticated")
    field.fill(token)
    page.get_by_role("button", name="Sign in").click()
    expect(page.locator("#stage-note")).to_contain_text("Choose a film of one animal")
    assert page.evaluate("document.cookie") == ""
    measure(page, film)
    until(page, "[...document.querySelectorAll('#library img')].every((image) => image.naturalWidth > 0)")
    page.get_by_role("button", name="Sign out").click()
    expect(page.get_by_label("Token")).to_be_focused()
    expect(page.locator("#library")).to_be_hidden()


def test_the_api_is_described_and_can_be_tried_under_the_policy_of_all_pages(page, filled_service):
    page.goto(filled_service + "/docs")
    call = page.locator(".opblock", has_text="/readyz").first
    expect(call).to_be_visible()
    call.locator(".opblock-summary-control").click()
    call.get_by_role("button", name="Try it out").click()
    call.get_by_role("button", name="Execute").click()
    expect(call.locator(".live-responses-table")).to_contain_text('"ready": true')
    page.goto(filled_service + "/docs/errors#nothing_moves")
    expect(page.locator("#nothing_moves + dd")).to_have_text("No moving animal was found in the film.")


def test_all_tabs_follow_their_jobs_by_one_stream(browser, filled_service):
    context = browser.new_context()
    tabs = [context.new_page(), context.new_page()]
    for number, tab in enumerate(tabs):
        tab.goto(filled_service)
        tab.get_by_role("spinbutton", name="Individuals").fill(str(3 + number))
        tab.get_by_role("spinbutton", name="Frames").fill("40")
        tab.get_by_role("button", name="Make the flock").click()
    for number, tab in enumerate(tabs):
        expect(tab.locator("#stage-title")).to_have_text(f"A flock of {3 + number}", timeout=LONG_MS)
        expect(tab.locator("#earlier-flocks li").filter(has_text=re.compile(r"\b40 frames"))).to_have_count(2, timeout=LONG_MS)
    # No tab shows the flock of the other.
    assert [tab.locator("#stage-title").text_content() for tab in tabs] == ["A flock of 3", "A flock of 4"]
    context.close()
    metrics = fetch(filled_service + "/metrics").decode()
    streams = re.findall(r'requests_total\{route="([^"]*/events)",method="GET",status="200"\} (\d+)', metrics)
    assert [route for route, _ in streams] == ["/v1/events"], streams
