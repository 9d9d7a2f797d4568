"""Data sets on the page: choose films and settings, see samples and size, make one, save the archive, delete it."""

import io
import json
import zipfile

import pytest
from playwright.sync_api import expect

from steps import get
from test_axe import AXE, SIZES, violations

LOAD_MS = 120_000


@pytest.fixture
def place(page, filled_service):
    page.goto(f"{filled_service}/flocks")
    page.get_by_role("link", name="Data sets").click()
    expect(page.get_by_role("heading", name="Data sets")).to_be_visible()
    return page


def small(page):
    """Sets a small data set."""
    for name, value in (("Flocks", "3"), ("Pictures of each flock", "2")):
        page.locator(".control", has_text=name).first.get_by_role("spinbutton").fill(value)
    page.get_by_role("textbox", name="Animals in a flock").fill("1, 3")
    page.get_by_role("textbox", name="Animals in a flock").press("Enter")


def test_a_data_set_is_chosen_seen_made_saved_and_deleted(place, filled_service):
    small(place)
    place.get_by_role("checkbox", name="YOLO boxes").check()
    expect(place.get_by_role("checkbox", name="YOLO keypoints")).not_to_be_checked()
    place.get_by_role("textbox", name="License of the films").fill("CC0")
    place.get_by_role("button", name="See nine samples").click()
    expect(place.get_by_role("img", name="Nine samples with their labels")).to_be_visible(timeout=LOAD_MS)
    expect(place.get_by_role("status").filter(has_text="6 pictures, about")).to_be_visible(timeout=LOAD_MS)
    place.get_by_role("button", name="Make the data set").click()
    card = place.locator(".cards .card-small")
    expect(card).to_have_count(1, timeout=LOAD_MS)
    expect(card).to_contain_text("6 pictures")
    with place.expect_download() as saved:
        card.get_by_role("link", name="Save ZIP").click()
    with zipfile.ZipFile(io.BytesIO(saved.value.path().read_bytes())) as archive:
        assert archive.testzip() is None
        manifest = json.loads(archive.read("manifest.json"))
        assert (manifest["licence"], manifest["params"]["flocks"]) == ("CC0", 3)
        assert "yolo_detect" in manifest["params"]["formats"]
        assert sum(name.endswith(".jpg") for name in archive.namelist()) == 6
    card.get_by_role("button", name="Delete").click()
    expect(card.first).to_be_hidden()


def test_wrong_settings_are_told_and_no_film_makes_no_data_set(place):
    place.get_by_role("textbox", name="Animals in a flock").fill("9, 3")
    place.get_by_role("textbox", name="Animals in a flock").press("Enter")
    place.get_by_role("button", name="Make the data set").click()
    expect(place.get_by_role("alert")).to_contain_text("the smaller first", timeout=LOAD_MS)
    for film in place.locator(".data-film input").all():
        film.uncheck()
    expect(place.get_by_role("button", name="Make the data set")).to_be_disabled()
    expect(place.get_by_role("status").filter(has_text="Choose at least one film")).to_be_visible()


@pytest.mark.parametrize("locale", ["en", "ja"])
def test_no_violations_and_no_sideways_scroll(visitor, filled_service, locale):
    assert AXE.is_file(), "axe-core is missing: run `make vendor`"
    page = visitor(locale=locale, reduced_motion="reduce", viewport=SIZES["phone"])
    library = get(f"{filled_service}/v1/libraries")["items"][-1]["id"]
    page.goto(f"{filled_service}/datasets?library={library}")
    expect(page.locator(".data-form")).to_be_visible(timeout=LOAD_MS)
    for group in page.locator("details.group").all():
        group.locator("summary").focus()
        page.keyboard.press("Enter")
        expect(group).to_have_attribute("open", "")
    for viewport in SIZES.values():
        page.set_viewport_size(viewport)
        assert violations(page) == []
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
