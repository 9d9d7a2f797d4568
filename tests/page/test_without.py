"""What the page does without: the bundled libraries, WebGL, a token; and with 500 flocks."""

import re

import pytest
from playwright.sync_api import expect

from conftest import FILM, token
from steps import LOAD_MS, LONG_MS, choose_film, expect_swimming, flock_canvas, get, heading, open_tray, said, say, settle, until

# A browser without WebGL.
NO_WEBGL = """
    const getContext = HTMLCanvasElement.prototype.getContext;
    HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
        return /webgl|webgpu/.test(kind) ? null : getContext.call(this, kind, ...rest);
    };
"""


def places(address):
    """Addresses of all places that show the film and the flock of the filled service."""
    flock = get(f"{address}/v1/flocks")["items"][-1]
    library = get(f"{address}/v1/libraries/{flock['library_id']}")
    ids = (library["footage_id"], library["id"], library["id"], flock["id"])
    return [address + path for path in ("/", "/films", *map("{}{}{}".format, ("/films/", "/libraries/", "/libraries/", "/flocks/"), ids, ("", "", "/studio", "?t=1")), "/flocks", "/jobs")]


def test_flocks_swim_on_a_plain_canvas_without_webgl(page, filled_service):
    page.add_init_script(NO_WEBGL)
    page.goto(filled_service)
    expect_swimming(page)
    assert page.evaluate("document.createElement('canvas').getContext('webgl2')") is None
    page.goto(f"{filled_service}/studio?count=5&frames=60")
    expect_swimming(page)
    expect(flock_canvas(page)).to_have_accessible_name(said(page, "living.n", n=5))


# The color in the upper left corner of a canvas, right after it was drawn; transparent black if it was not.
CORNER = """(canvas) => new Promise((resolve) => requestAnimationFrame(() => {
    const small = Object.assign(document.createElement("canvas"), { width: 48, height: 36 }).getContext("2d");
    small.drawImage(canvas, 0, 0, 48, 36);
    resolve([...small.getImageData(1, 1, 1, 1).data]);
}))"""


@pytest.mark.parametrize("script", ["", NO_WEBGL], ids=["webgl", "canvas"])
def test_another_background_is_drawn_at_once(page, filled_service, script):
    page.add_init_script(script)
    page.goto(f"{filled_service}/studio?count=2&frames=60")
    expect_swimming(page)

    def shows(is_meant):
        *color, alpha = flock_canvas(page).evaluate(CORNER)
        return alpha == 255 and is_meant(color)

    def is_blue(color):
        # The color that is offered first: #103040.
        return max(abs(a - b) for a, b in zip(color, (16, 48, 64), strict=True)) < 6

    until(page, lambda: shows(lambda color: not is_blue(color)))
    page.get_by_role("radio", name=say(page, "set.background.color"), exact=True).check()
    until(page, lambda: shows(is_blue))
    page.get_by_role("radio", name=say(page, "set.background.transparent")).check()
    # Gray checkers.
    until(page, lambda: shows(lambda color: max(color) - min(color) < 6 and min(color) > 140))
    page.get_by_role("radio", name=say(page, "set.background.plate")).check()
    until(page, lambda: shows(lambda color: max(color) - min(color) > 20 and not is_blue(color)))


def test_lost_graphics_are_drawn_again(page, filled_service):
    page.goto(f"{filled_service}/studio?count=5&frames=60")
    expect_swimming(page)
    script = """(canvas) => {
        const extension = canvas.getContext("webgl2")?.getExtension("WEBGL_lose_context");
        extension?.loseContext();
        setTimeout(() => extension?.restoreContext(), 200);
        return Boolean(extension);
    }"""
    assert flock_canvas(page).evaluate(script)
    expect_swimming(page)


def test_every_place_works_without_the_bundled_libraries(page, filled_service, other_film):
    page.route("**/vendor/**", lambda route: route.abort())
    for address in places(filled_service):
        page.goto(address)
        settle(page)
        expect(page.get_by_role("main").get_by_role("alert")).to_have_count(0)
    page.goto(filled_service)
    with other_film.open("ab") as file:
        file.write((5_000_000).to_bytes(4, "big") + b"free" + bytes(5_000_000 - 8))
    choose_film(page, other_film)
    expect(page).to_have_url(re.compile("/films/"), timeout=LONG_MS)


def test_names_of_files_are_text_in_every_place(page, filled_service):
    name = FILM.removesuffix(".mp4")
    for address in places(filled_service):
        page.goto(address)
        expect(page.get_by_role("main").get_by_text(name).first).to_be_visible(timeout=LOAD_MS)
        assert page.locator('img[src="x"]').count() == 0, address


def flocks_of(address, n):
    """Returns n flocks as the list tells them, like the newest one of the service."""
    flock = get(f"{address}/v1/flocks")["items"][-1]
    ids = [f"{k:08x}-0000-7000-8000-000000000000" for k in range(n)]
    return [{**flock, "id": flock_id, "seed": k + 1000, "params": {}} for k, flock_id in enumerate(ids)]


def test_five_hundred_flocks_are_listed_page_by_page(page, filled_service):
    flocks = flocks_of(filled_service, 500)
    asked = []

    def answer(route):
        limit = int(re.search(r"limit=(\d+)", route.request.url)[1])
        first = int((re.search(r"cursor=(\d+)", route.request.url) or ["", "0"])[1])
        asked.append(first)
        end = first + limit
        route.fulfill(json={"items": flocks[first:end], "next_cursor": str(end) if end < len(flocks) else None})

    page.route("**/v1/flocks?*", answer)
    page.route("**/thumb.webp", lambda route: route.fulfill(body=""))
    page.goto(f"{filled_service}/flocks")
    cards = page.get_by_role("main").get_by_role("listitem")
    expect(cards.first).to_be_visible(timeout=LOAD_MS)
    n_first = cards.count()
    assert n_first < 100
    page.get_by_role("button", name=say(page, "more")).click()
    until(page, lambda: cards.count() > n_first)
    page.get_by_role("searchbox").fill("goldfish")
    until(page, lambda: cards.count() == 500, LOAD_MS / 1000)
    assert sorted(set(asked)) == sorted(asked), "a page was asked for twice"
    page.get_by_role("searchbox").fill("no such film")
    expect(page.get_by_role("main").get_by_role("listitem").filter(visible=True)).to_have_count(0)
    expect(page.get_by_text(say(page, "reels.found", n=0, query="no such film"))).to_be_visible()


def test_a_film_is_measured_however_many_measurements_are_newer(page, filled_service):
    library = get(f"{filled_service}/v1/libraries")["items"][-1]
    others = [{**library, "id": f"{k:08x}-0000-7000-8000-000000000000", "footage_id": f"{k:08x}-0000-7000-8000-000000000001"} for k in range(200)]

    def answer(route):
        if "footage_id=" in route.request.url:
            return route.continue_()
        return route.fulfill(json={"items": others, "next_cursor": library["id"]})

    page.route("**/v1/libraries?*", answer)
    page.goto(f"{filled_service}/films")
    card = page.get_by_role("main").get_by_role("listitem").filter(has=page.locator(f'a[href="/films/{library["footage_id"]}"]'))
    expect(card).to_contain_text(say(page, "film.measured"), timeout=LOAD_MS)


def test_a_film_is_called_deleted_only_if_the_service_says_so(page, filled_service):
    job = next(one for one in get(f"{filled_service}/v1/jobs")["items"] if one["kind"] == "analysis")
    broken = re.compile(r"/v1/(footage|libraries)[?/]")
    page.route("**/v1/jobs?*", lambda route: route.fulfill(json={"items": [job], "next_cursor": None}))
    page.route(broken, lambda route: route.fulfill(status=503, json={"title": "Not now.", "code": "busy"}))
    page.goto(f"{filled_service}/jobs")
    place = page.get_by_role("main")
    expect(place).to_contain_text(say(page, "job.analysis", film=say(page, "film.unnamed")))
    expect(place).not_to_contain_text(say(page, "film.deleted"))
    page.unroute(broken)
    younger = {"id": "ffffffff-ffff-7fff-bfff-ffffffffffff", "name": "younger.mp4"}
    page.route("**/v1/footage?*", lambda route: route.fulfill(json={"items": [younger], "next_cursor": None}))
    page.reload()
    expect(place).to_contain_text(say(page, "job.analysis", film=say(page, "film.deleted")))


def test_a_job_that_waits_tells_how_many_come_before_it(page, filled_service):
    job = get(f"{filled_service}/v1/jobs")["items"][0]
    waiting = [{**job, "id": f"{k:08x}-0000-7000-8000-000000000000", "state": "queued", "started_at": None, "finished_at": None, "progress": 0} for k in (3, 2)]
    running = {**waiting[0], "id": "00000001-0000-7000-8000-000000000000", "state": "running", "progress": 0.1}
    page.route("**/v1/jobs?*", lambda route: route.fulfill(json={"items": [*waiting, running], "next_cursor": None}))
    page.goto(f"{filled_service}/jobs")
    cards = page.get_by_role("main").get_by_role("article")
    expect(cards).to_have_count(3)
    for k, n in enumerate((2, 1)):
        expect(cards.nth(k)).to_contain_text(say(page, "job.ahead", n=n))
    expect(cards.nth(2)).not_to_contain_text(said(page, "job.left"))


def give_token(page, text):
    page.get_by_label(say(page, "session.token"), exact=True).fill(text)
    page.get_by_role("button", name=say(page, "session.begin")).click()


def sign_in(page, text):
    """Gives a valid token, after which the page loads again."""
    with page.expect_navigation():
        give_token(page, text)


def test_a_service_with_tokens_is_signed_in_to_and_out_of(page, closed_service):
    address, key, _ = closed_service
    page.goto(address)
    field = page.get_by_label(say(page, "session.token"), exact=True)
    expect(field).to_be_focused()
    expect(page.get_by_text(say(page, "home.choose"), exact=True)).to_be_hidden()
    give_token(page, key[:-1] + "!")
    expect(page.get_by_role("alert")).to_contain_text("unauthenticated")
    sign_in(page, key)
    expect(page.get_by_role("main")).to_contain_text(say(page, "home.empty"))
    assert page.evaluate("document.cookie") == ""
    assert key not in page.evaluate("JSON.stringify([localStorage, sessionStorage])")
    page.get_by_role("button", name=say(page, "session.end")).click()
    expect(field).to_be_focused()
    expect(page.get_by_text(say(page, "home.choose"), exact=True)).to_be_hidden()


def test_a_session_that_ends_in_the_middle_is_renewed_in_the_same_place(page, closed_service, other_film):
    address, key, data = closed_service
    page.goto(address)
    sign_in(page, key)
    choose_film(page, other_film)
    expect_swimming(page, LONG_MS)
    page.get_by_role("link", name=say(page, "film.studio")).click()
    expect_swimming(page)
    page.get_by_role("spinbutton", name=say(page, "set.count")).fill("4")
    expect(flock_canvas(page)).to_have_accessible_name(said(page, "living.n", n=4), timeout=LOAD_MS)
    place = page.url
    token(data, "revoke", key)
    page.get_by_role("button", name=say(page, "make.film")).click()
    expect(page.get_by_label(say(page, "session.token"), exact=True)).to_be_visible()
    sign_in(page, token(data, "create", "--name", "again", "--owner", "page"))
    expect(page.get_by_role("button", name=say(page, "session.end"))).to_be_visible()
    assert page.url == place
    expect(flock_canvas(page)).to_have_accessible_name(said(page, "living.n", n=4), timeout=LOAD_MS)


def test_a_token_that_may_only_read_is_told_what_it_may_not(page, closed_service, other_film):
    address, _, data = closed_service
    page.goto(address)
    sign_in(page, token(data, "create", "--name", "reader", "--scope", "read"))
    expect(page.get_by_role("button", name=say(page, "session.end"))).to_be_visible()
    choose_film(page, other_film)
    expect(open_tray(page).get_by_role("alert")).to_contain_text("scope_too_small", timeout=LOAD_MS)


@pytest.mark.parametrize("width", [320, 390, 820, 1440, 2560])
def test_no_place_scrolls_sideways(page, filled_service, width):
    page.set_viewport_size({"width": width, "height": 900})
    for address in places(filled_service):
        page.goto(address)
        settle(page)
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), address


def test_the_api_is_described_and_can_be_tried_under_the_policy_of_all_pages(page, filled_service):
    page.goto(f"{filled_service}/docs")
    call = page.locator(".opblock", has_text="/readyz").first
    expect(call).to_be_visible(timeout=LOAD_MS)
    call.locator(".opblock-summary-control").click()
    call.get_by_role("button", name="Try it out").click()
    call.get_by_role("button", name="Execute").click()
    expect(call.locator(".live-responses-table")).to_contain_text('"ready": true')
    page.goto(f"{filled_service}/docs/errors#nothing_moves")
    expect(page.locator("#nothing_moves + dd")).to_have_text("No moving animal was found in the film.")
