"""The page during jobs: on the first visit, after a reload, and in a second tab."""

import re

from playwright.sync_api import expect

from conftest import make_film
from test_page import LONG_MS, until

IN_ANALYSIS = re.compile("Starting|Estimating the background|Following the animal|Comparing moments")
UPLOADING = re.compile("Sending the film|Checking the film")


def begin_to_measure(page, address, film):
    """Uploads a film and returns while its analysis runs."""
    page.goto(address)
    expect(page.locator("#stage-title")).to_have_text(re.compile("A flock of"))
    page.locator("#film-file").set_input_files(film)
    expect(page.locator("#film-job .job strong")).to_have_text(IN_ANALYSIS, timeout=60_000)


def expect_being_measured(page, film):
    expect(page.locator("#stage-note")).to_contain_text(f"“{film.name}” is being measured")
    expect(page.locator("#stage-video")).to_be_hidden()
    expect(page.locator("#film-job .job strong")).to_have_text(IN_ANALYSIS)


def expect_measured(page, film):
    expect(page.locator("#library-title")).to_have_text(film.name, timeout=LONG_MS)
    expect(page.locator("#make-of")).to_have_text(f"Of “{film.name}”")
    expect(page.locator("#stage-note")).to_contain_text(f"“{film.name}” is measured")
    expect(page.locator("#stage-video")).to_be_hidden()
    expect(page.locator("#stage-caption")).to_be_hidden()
    expect(page.locator("#film-job .job")).to_have_count(0)


def test_first_visit_during_the_filming_fills_by_itself(page, starting_service):
    page.goto(starting_service)
    stage, share = page.locator("#film-job .job strong"), page.locator("#film-job .job-line span")
    expect(stage).to_have_text("Filming a virtual goldfish")
    expect(page.locator("#stage-note")).to_contain_text("It will play here")
    expect(share).to_have_text(re.compile(r"[1-9]\d? %"), timeout=LONG_MS)
    expect(stage).to_have_text(IN_ANALYSIS, timeout=LONG_MS)
    expect(page.locator("#library-title")).to_have_text("sample.mp4", timeout=3 * LONG_MS)
    expect(page.locator("#stage-title")).to_have_text("A flock of 20", timeout=LONG_MS)
    until(page, "document.querySelector('#stage-video').currentTime > 0.2")
    expect(page.locator(".job")).to_have_count(0)


def test_jobs_of_others_leave_the_card_of_an_upload_in_its_place(page, starting_service, film):
    page.route("**/v1/footage?*", lambda route: None)  # the upload goes on until it is cancelled
    page.goto(starting_service)
    stage = page.locator("#film-job .job strong")
    expect(stage).to_have_text("Filming a virtual goldfish")
    page.locator("#film-file").set_input_files(film)
    expect(stage).to_have_text(UPLOADING)
    expect(page.locator("#stage-note")).to_contain_text("A flock of this film is being made", timeout=3 * LONG_MS)
    expect(stage).to_have_text(UPLOADING)
    page.locator("#film-job").get_by_role("button", name="Cancel").click()
    expect(page.locator("#film-job .job")).to_have_count(0)
    expect(page.locator("#film-form")).to_be_visible()


def test_reload_during_an_analysis_shows_its_result_when_done(page, filled_service, tmp_path):
    film = make_film(tmp_path / "second.mp4", seed=2)
    begin_to_measure(page, filled_service, film)
    page.reload()
    expect_being_measured(page, film)
    expect_measured(page, film)
    page.reload()
    expect_measured(page, film)


def test_reload_during_rendering_shows_the_flock_of_that_film(page, filled_service, film):
    page.goto(filled_service)
    page.locator("#earlier-libraries button", has_text=film.name).click()
    expect(page.locator("#make-of")).to_have_text(f"Of “{film.name}”")
    page.get_by_role("spinbutton", name="Individuals").fill("8")
    page.get_by_role("spinbutton", name="Frames").fill("2400")
    page.get_by_role("button", name="Make the flock").click()
    expect(page.locator("#flock-job .job strong")).to_have_text("Drawing the flock", timeout=LONG_MS)
    page.reload()
    expect(page.locator("#make-of")).to_have_text(f"Of “{film.name}”")
    expect(page.locator("#flock-job .job")).to_be_visible()
    expect(page.locator("#stage-title")).to_have_text("A flock of 8", timeout=LONG_MS)
    page.reload()
    expect(page.locator("#stage-title")).to_have_text("A flock of 8")
    expect(page.locator("#stage-facts")).to_contain_text(film.name)


def test_other_tabs_show_the_same_job_and_its_result(page, filled_service, tmp_path):
    film = make_film(tmp_path / "third.mp4", seed=3)
    before, during = page.context.new_page(), page.context.new_page()
    before.goto(filled_service)
    expect(before.locator("#stage-title")).to_have_text(re.compile("A flock of"))
    begin_to_measure(page, filled_service, film)
    during.goto(filled_service)
    expect_being_measured(during, film)
    expect(before.locator("#film-job .job strong")).to_have_text(IN_ANALYSIS)
    for tab in (page, before, during):
        expect_measured(tab, film)
