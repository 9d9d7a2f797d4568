"""Addresses and visits: back and forward, reloads during a job, second tabs, and interrupted uploads."""

import re

import pytest
from playwright.sync_api import expect

from conftest import PROGRAM, make_film
from service import free_address, post, start
from steps import LOAD_MS, LONG_MS, choose_film, expect_swimming, fetch, flock_canvas, get, heading, open_tray, said, say, until


@pytest.fixture
def slow_film(tmp_path):
    """Path of a film whose analysis takes some seconds."""
    return make_film(tmp_path / "slow trout.mp4", seed=11, frames=120, size="640x480")


def begin_to_measure(page, address, film):
    """Chooses a film and returns the address of its place, while it is measured."""
    page.goto(address)
    choose_film(page, film)
    expect(page).to_have_url(re.compile(r"/films/[0-9a-f-]{36}"), timeout=LONG_MS)
    return page.url


def analyses(address):
    return [job for job in get(f"{address}/v1/jobs")["items"] if job["kind"] == "analysis"]


def test_back_and_forward_go_through_places_with_their_titles(page, filled_service):
    library = get(f"{filled_service}/v1/libraries")["items"][0]
    name = library["name"].removesuffix(".mp4")
    page.goto(filled_service)
    expect_swimming(page)
    menu = page.get_by_role("navigation")
    titles = []

    def arrive(title):
        expect(page).to_have_title(title, timeout=LOAD_MS)
        titles.append((page.title(), heading(page).text_content()))

    arrive("flockreel")
    menu.get_by_role("link", name=say(page, "nav.films")).click()
    arrive(f"{say(page, 'films.title')} · flockreel")
    page.get_by_role("main").get_by_role("link", name=name).click()
    arrive(f"{name} · flockreel")
    page.get_by_role("main").get_by_role("link", name=say(page, "film.desk")).click()
    arrive(f"{say(page, 'desk.title', film=name)} · flockreel")
    page.get_by_role("link", name=say(page, "film.studio")).click()
    arrive(f"{say(page, 'studio.title', film=name)} · flockreel")
    menu.get_by_role("link", name=say(page, "nav.flocks")).click()
    arrive(f"{say(page, 'reels.title')} · flockreel")
    page.get_by_role("main").get_by_role("link", name=name).first.click()
    arrive(said(page, "flock.of", film=name))
    assert len(set(titles)) == 7
    for title, first in titles[-2::-1]:
        page.go_back()
        expect(page).to_have_title(title)
        expect(heading(page)).to_have_text(first, timeout=LOAD_MS)
    for title, first in titles[1:]:
        page.go_forward()
        expect(page).to_have_title(title)
        expect(heading(page)).to_have_text(first, timeout=LOAD_MS)


def test_addresses_of_nothing_say_so(page, filled_service):
    for path in ("/nowhere", "/films/nowhere", "/libraries/nowhere", "/libraries/nowhere/studio", f"/flocks/{'0' * 8}-0000-7000-8000-{'0' * 12}"):
        page.goto(filled_service + path)
        expect(heading(page)).to_have_text(say(page, "missing.title"))
        expect(page).to_have_title(re.compile(".+ · flockreel"))
        page.get_by_role("link", name=say(page, "missing.home")).click()
        expect(heading(page)).to_have_text(say(page, "home.title"))


def test_studio_link_with_a_time_rests_at_that_moment(page, filled_service):
    library = get(f"{filled_service}/v1/libraries")["items"][0]
    page.goto(f"{filled_service}/libraries/{library['id']}/studio?count=3&frames=60&t=1")
    expect(flock_canvas(page)).to_be_visible(timeout=LOAD_MS)
    frame = said(page, "timeline.now", frame=str(round(library["fps"])))
    expect(page.get_by_role("slider", name=say(page, "timeline.slider"))).to_have_attribute("aria-valuetext", frame)
    expect(page.get_by_role("button", name=say(page, "timeline.play"))).to_be_visible()


def test_reload_during_an_analysis_shows_the_same_job_and_its_result(page, filled_service, slow_film):
    place = begin_to_measure(page, filled_service, slow_film)
    n_analyses = len(analyses(filled_service))
    for _ in range(2):
        page.reload()
        expect(heading(page)).to_have_text(slow_film.stem)
        expect(page.get_by_role("main").get_by_role("progressbar")).to_be_visible()
        expect(page.get_by_text(say(page, "film.not_measured"))).to_be_hidden()
    expect_swimming(page, LONG_MS)
    assert page.url == place
    assert len(analyses(filled_service)) == n_analyses
    page.reload()
    expect_swimming(page, LOAD_MS)
    expect(page.get_by_text(say(page, "film.flock"))).to_be_visible()


def test_the_studio_shows_the_first_measurement_and_fills_by_itself(page, empty_service, slow_film):
    page.goto(f"{empty_service}/studio")
    expect(page.get_by_role("main")).to_contain_text(say(page, "studio.empty"))
    begin_to_measure(page, empty_service, slow_film)
    page.get_by_role("navigation").get_by_role("link", name=say(page, "nav.studio")).click()
    place = page.get_by_role("main")
    expect(place).to_contain_text(say(page, "film.wait"))
    expect(place).to_contain_text(say(page, "job.analysis", film=slow_film.stem))
    expect(place.get_by_role("progressbar")).to_be_visible()
    library = get(f"{empty_service}/v1/jobs")["items"][0]["links"]["result"].rsplit("/", 1)[1]
    # The address of its studio waits for it, too.
    page.goto(f"{empty_service}/libraries/{library}/studio?count=4")
    expect_swimming(page, LONG_MS)
    expect(flock_canvas(page)).to_have_accessible_name(said(page, "living.n", n=4))
    expect(heading(page)).to_have_text(say(page, "studio.title", film=slow_film.stem))
    expect(place.get_by_role("progressbar")).to_have_count(0)


def test_the_studio_goes_on_to_a_film_that_was_measured_meanwhile(page, filled_service, tmp_path):
    film = make_film(tmp_path / "young tench.mp4", seed=13, frames=120, size="640x480")
    begin_to_measure(page, filled_service, film)
    page.get_by_role("navigation").get_by_role("link", name=say(page, "nav.studio")).click()
    place = page.get_by_role("main")
    expect(place).to_contain_text(say(page, "job.analysis", film=film.stem))
    expect(heading(page)).to_have_text(say(page, "studio.title", film=film.stem), timeout=LONG_MS)
    expect_swimming(page)


def test_a_person_who_works_in_the_studio_is_offered_the_other_film(page, filled_service, tmp_path):
    film = make_film(tmp_path / "old tench.mp4", seed=14, frames=120, size="640x480")
    begin_to_measure(page, filled_service, film)
    page.goto(f"{filled_service}/studio?count=3&frames=60")
    place = page.get_by_role("main")
    offer = place.get_by_role("status").filter(has_text=say(page, "studio.measured", film=film.stem))
    expect(offer).to_be_visible(timeout=LONG_MS)
    expect(heading(page)).not_to_contain_text(film.stem)
    offer.get_by_role("link", name=say(page, "film.studio")).click()
    expect(heading(page)).to_have_text(say(page, "studio.title", film=film.stem), timeout=LOAD_MS)


def test_reload_during_rendering_shows_the_job_and_then_the_film(page, filled_service):
    page.goto(f"{filled_service}/studio?count=4&frames=300&seed=77")
    expect_swimming(page)
    page.get_by_role("button", name=say(page, "make.film")).click()
    expect(page.get_by_role("main").get_by_role("progressbar")).to_be_visible()
    page.reload()
    tray = open_tray(page)
    expect(tray.get_by_role("progressbar").first).to_be_visible()
    expect(tray.get_by_role("progressbar")).to_have_count(0, timeout=LONG_MS)
    tray.get_by_role("link", name=say(page, "job.open"), exact=True).first.click()
    expect(page).to_have_url(re.compile("/flocks/"))
    made = re.search(r"[0-9a-f-]{36}", page.url)[0]
    assert get(f"{filled_service}/v1/flocks/{made}")["seed"] == 77


def test_a_second_tab_shows_the_same_job_and_result_over_one_stream(page, empty_service, slow_film):
    before = page.context.new_page()
    before.goto(f"{empty_service}/films")
    place = begin_to_measure(page, empty_service, slow_film)
    during = page.context.new_page()
    during.goto(place)
    expect(during.get_by_role("main").get_by_role("progressbar")).to_be_visible()
    expect(open_tray(before)).to_contain_text(slow_film.stem)
    for tab in (page, during):
        expect_swimming(tab, LONG_MS)
    card = before.get_by_role("main").get_by_role("listitem").filter(has_text=slow_film.stem)
    expect(card).to_contain_text(say(page, "film.measured"))
    streams = re.findall(r'requests_total\{route="([^"]*/events)",method="GET",status="200"\} (\d+)', fetch(f"{empty_service}/metrics").decode())
    # The stream itself is counted when it ends: until then none is.
    assert all(route == "/v1/events" for route, _ in streams), streams


def test_a_restart_of_the_service_during_an_analysis_ends_with_its_result(page, tmp_path, slow_film):
    address, data = free_address(), tmp_path / "data"
    service = start(PROGRAM, data, address)
    try:
        begin_to_measure(page, address, slow_film)
        expect(page.get_by_role("main").get_by_role("progressbar")).to_be_visible()
        service.kill()
        service.wait()
        service = start(PROGRAM, data, address)
        expect_swimming(page, LONG_MS)
        assert [job["state"] for job in analyses(address)] == ["done"]
    finally:
        service.kill()
        service.wait()


def padded(film, size):
    """Makes a film as large as asked, by an atom that players skip."""
    missing = size - film.stat().st_size
    with film.open("ab") as file:
        file.write(missing.to_bytes(4, "big") + b"free" + bytes(missing - 8))
    return film


def test_an_upload_goes_on_where_a_reload_cut_it(page, empty_service, other_film):
    padded(other_film, 20_000_000)
    sent = []
    page.on("request", lambda request: sent.append(int(request.headers["upload-offset"])) if request.method == "PATCH" else None)
    page.goto(empty_service)
    # The second piece never arrives.
    page.route("**/v1/uploads/*", lambda route: None if route.request.headers.get("upload-offset") == "8000000" else route.continue_())
    choose_film(page, other_film)
    until(page, lambda: 8_000_000 in sent, LONG_MS / 1000)
    page.reload()
    page.unroute("**/v1/uploads/*")  # lets held requests go on, had the reload not ended them
    sent.clear()
    choose_film(page, other_film)
    expect(page).to_have_url(re.compile("/films/"), timeout=LONG_MS)
    assert min(sent) == 8_000_000, sent


def test_an_upload_goes_on_after_a_cut_connection(page, empty_service, other_film):
    padded(other_film, 20_000_000)
    cuts = []

    def cut_once(route):
        if route.request.method == "PATCH" and not cuts:
            cuts.append(route.request.url)
            return route.abort("connectionreset")
        return route.continue_()

    page.route("**/v1/uploads/*", cut_once)
    page.goto(empty_service)
    choose_film(page, other_film)
    expect(page).to_have_url(re.compile("/films/"), timeout=LONG_MS)
    assert cuts
    assert len(get(f"{empty_service}/v1/footage")["items"]) == 1


def test_a_place_without_connection_says_so(page, empty_service):
    page.goto(empty_service)
    expect(heading(page)).to_have_text(say(page, "home.title"))
    page.context.set_offline(True)
    page.get_by_role("link", name=say(page, "nav.films")).click()
    expect(page.get_by_role("main").get_by_role("alert")).to_contain_text(say(page, "problem.unreachable"))
    expect(heading(page)).not_to_be_empty()
    page.context.set_offline(False)


def test_a_small_upload_without_connection_says_so(page, empty_service, other_film):
    page.goto(empty_service)
    expect(heading(page)).to_have_text(say(page, "home.title"))
    page.context.set_offline(True)
    choose_film(page, other_film)
    alert = open_tray(page).get_by_role("alert")
    expect(alert).to_contain_text(say(page, "problem.unreachable"))
    page.context.set_offline(False)


def test_two_films_are_measured_one_after_the_other(page, empty_service, tmp_path):
    films = [make_film(tmp_path / f"{name}.mp4", seed=seed, frames=60) for name, seed in (("roach", 21), ("perch", 22))]
    page.goto(empty_service)
    choose_film(page, *films)
    until(page, lambda: len(analyses(empty_service)) == 2, LONG_MS / 1000)
    page.goto(f"{empty_service}/films")
    for film in films:
        expect(page.get_by_role("main").get_by_role("listitem").filter(has_text=film.stem)).to_contain_text(say(page, "film.measured"), timeout=LONG_MS)


def test_a_known_film_is_not_stored_twice(page, empty_service, other_film):
    post(f"{empty_service}/v1/footage?name={other_film.name}", other_film.read_bytes(), "video/mp4")
    page.goto(empty_service)
    choose_film(page, other_film)
    expect(page).to_have_url(re.compile("/films/"), timeout=LONG_MS)
    assert len(get(f"{empty_service}/v1/footage")["items"]) == 1
