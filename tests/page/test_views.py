"""The film of a library that is made after it: its place shows the poster and a sentence, and plays the film when it is
there, without being loaded again."""

import urllib.parse
import urllib.request

import pytest
from playwright.sync_api import expect

from conftest import PROGRAM
from service import post, started, wait_for_job
from steps import LONG_MS, get, say, until

PLAYING = "document.querySelector('{} video').readyState >= 2"


@pytest.fixture
def cancelled(tmp_path, film):
    """Address of a service with one film and its library, whose views were cancelled; address of their job, and the ids
    of the footage and the library."""
    with started(PROGRAM, tmp_path / "data", "--workers", "1") as address:
        name = urllib.parse.quote(film.name)
        footage = post(f"{address}/v1/footage?name={name}", film.read_bytes(), "video/mp4")
        analysis = post(f"{address}/v1/analyses", {"footage_id": footage["id"]})
        # The views wait for the flock.
        post(f"{address}/v1/flocks", {"library_id": analysis["library_id"], "count": 6, "frames": 240})
        wait_for_job(address, analysis["job_id"])
        views = get(f"{address}/v1/libraries/{analysis['library_id']}")["views"]
        job = f"{address}/v1/jobs/{views['job_id']}"
        urllib.request.urlopen(urllib.request.Request(job, method="DELETE")).close()
        yield address, job, footage["id"], analysis["library_id"]


def test_film_plays_where_it_is_awaited_as_soon_as_it_is_made(visitor, cancelled):
    address, job, footage_id, library_id = cancelled
    film_place, desk = visitor(), visitor()
    film_place.goto(f"{address}/films/{footage_id}")
    desk.goto(f"{address}/libraries/{library_id}")
    caption, note = film_place.locator(".hero-one figcaption"), desk.locator(".stage-note")
    overlay = desk.locator(".files").get_by_role("row").filter(has_text="overlay.mp4")
    for place in (caption, note):
        expect(place).to_have_text(say(desk, "views.failed"), timeout=LONG_MS)
    expect(overlay).to_contain_text(say(desk, "views.failed.short"))
    poster = film_place.locator(".hero-one video").get_attribute("poster")
    assert poster == f"/v1/libraries/{library_id}/poster.jpg"

    post(f"{job}/retry", {})
    for place in (caption, note):
        expect(place).to_have_text(say(desk, "views.making"))
    expect(overlay).to_contain_text(say(desk, "views.making.short"))
    expect(overlay.get_by_role("link")).to_have_count(0)

    until(film_place, PLAYING.format(".hero-one"), LONG_MS / 1000)
    until(film_place, "document.querySelector('.hero-one video').currentTime > 0.2")
    expect(caption).to_have_text(say(film_place, "hero.one", time=say(film_place, "unit.seconds", n=5)))
    until(desk, PLAYING.format(".stage"))
    expect(note).to_be_hidden()
    expect(overlay.get_by_role("link")).to_have_attribute("href", f"/v1/libraries/{library_id}/overlay.mp4")
    expect(desk.get_by_role("radio", name=say(desk, "desk.look.film"), exact=True)).to_be_checked()
