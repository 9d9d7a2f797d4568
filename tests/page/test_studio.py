"""The studio: settings in the address, plans while they change, things drawn on the picture, and ways to keep a flock."""

import json
import math
import re
from urllib.parse import parse_qs, urlsplit

import pytest
from playwright.sync_api import expect

from service import post
from steps import fetch, flock_canvas, get, make_film_in_studio, said, say, until

PLAN_MS = 60_000


@pytest.fixture
def studio(page, filled_service):
    """A page that shows the studio, and the bodies of its previews."""
    return opened(page, f"{filled_service}/studio?count=6&frames=60")


def opened(page, address):
    previews = []
    page.on("request", lambda request: previews.append(request) if is_preview(request) else None)
    page.goto(address)
    expect(page.locator(".studio-stage canvas")).to_be_visible(timeout=PLAN_MS)
    return page, previews


def is_preview(request):
    return request.url.endswith("/v1/flocks/preview")


def bodies(previews):
    return [json.loads(request.post_data) for request in previews]


def settings(page):
    """The settings in the address, as the API names them."""
    return {name: values[0] for name, values in parse_qs(urlsplit(page.url).query).items()}


def number(page, name):
    return page.locator(f'[data-name="{name}"] input[type=number]')


def slider(page, name):
    return page.locator(f'[data-name="{name}"] input[type=range]')


def flee(page, what):
    """The choice of what the animals flee from: nothing, hunter or path."""
    return page.locator("#flee").get_by_role("radio", name=say(page, f"flee.{what}"), exact=True)


def expect_animals(page, n):
    expect(flock_canvas(page)).to_have_accessible_name(said(page, "living.n", n=n), timeout=PLAN_MS)
    expect(page.locator(".studio-stage")).to_have_attribute("aria-busy", "false", timeout=PLAN_MS)


def drag(page, points):
    """Drags over the picture; points are shares of its width and height."""
    box = page.locator(".things").bounding_box()
    width, height = map(int, page.locator(".things").get_attribute("viewBox").split()[2:])
    zoom = min(box["width"] / width, box["height"] / height)
    left, top = box["x"] + (box["width"] - width * zoom) / 2, box["y"] + (box["height"] - height * zoom) / 2
    on_page = [(left + x * width * zoom, top + y * height * zoom) for x, y in points]
    page.mouse.move(*on_page[0])
    page.mouse.down()
    for point in on_page[1:]:
        page.mouse.move(*point, steps=6)
    page.mouse.up()
    return width, height


def test_the_last_of_fifty_changes_wins_with_at_most_two_requests_under_way(studio):
    page, previews = studio
    expect_animals(page, 6)
    under_way, most = set(), 0

    def begin(request):
        nonlocal most
        if is_preview(request):
            under_way.add(request)
            most = max(most, len(under_way))

    page.on("request", begin)
    page.on("requestfinished", lambda request: under_way.discard(request))
    page.on("requestfailed", lambda request: under_way.discard(request))
    storm = """async (range) => {
        for (let n = 1; n <= 50; n++) {
            range.value = String(n);
            range.dispatchEvent(new Event("input", { bubbles: true }));
            await new Promise((resolve) => setTimeout(resolve, n % 7 ? 8 : 60));
        }
    }"""
    slider(page, "count").evaluate(storm)
    expect_animals(page, 50)
    assert most <= 2
    assert bodies(previews)[-1]["count"] == 50
    assert settings(page)["count"] == "50"


def test_the_flock_swims_on_while_settings_change(studio):
    page, _ = studio
    expect_animals(page, 6)
    frame = page.locator(".timeline input[type=range]")
    page.route("**/v1/flocks/preview", lambda route: None)  # the plan never arrives
    number(page, "count").fill("9")
    seen = set()

    def moves():
        seen.add(frame.input_value())
        return len(seen) > 3

    until(page, moves)
    expect(page.locator(".studio-stage")).to_have_attribute("aria-busy", "true")
    page.unroute("**/v1/flocks/preview")
    number(page, "count").fill("8")
    expect_animals(page, 8)


def test_a_link_opened_elsewhere_gives_the_same_settings_and_the_same_flock(studio, browser):
    page, previews = studio
    page.get_by_role("radio", name="Swarm").check()
    number(page, "count").fill("7")
    page.get_by_role("radio", name="Transparent").check()
    page.get_by_text("How they move").click()
    slider(page, "rules.wander").fill("1.5")
    expect_animals(page, 7)
    context = browser.new_context()
    other, previews_there = opened(context.new_page(), page.url)
    expect_animals(other, 7)
    assert settings(other) == settings(page)
    expect(other.locator("#group-move > summary")).to_contain_text("changed")
    other.get_by_text("How they move").click()
    expect(number(other, "rules.wander")).to_have_value("1.5")
    expect(other.get_by_role("radio", name="Transparent")).to_be_checked()
    expect(other.get_by_role("radio", name="Swarm")).to_be_checked()
    assert bodies(previews_there)[-1] == bodies(previews)[-1]
    context.close()


def planned(address, body):
    """Returns the flock of a preview as JSON."""
    return post(f"{address}/v1/flocks/preview", body)


def nearest(flock, point):
    """Returns the least distance of a boid to a point of the picture, pixels."""
    return min(math.dist(place[:2], point) for one in flock["individuals"] for place in one["boid"]["position"])


def test_an_obstacle_drawn_on_the_picture_is_not_entered(studio, filled_service):
    page, previews = studio
    expect_animals(page, 6)
    page.get_by_role("button", name=say(page, "tool.circle"), exact=True).click()
    width, height = drag(page, [(0.5, 0.5), (0.6, 0.5)])
    expect(page.locator(".thing-circle")).to_have_count(1)
    expect_animals(page, 6)
    (obstacle,) = bodies(previews)[-1]["obstacles"]
    assert obstacle["circle"]["center_px"] == pytest.approx([width / 2, height / 2], abs=2)
    assert obstacle["circle"]["radius_px"] == pytest.approx(width / 10, abs=3)
    assert json.loads(settings(page)["obstacles"]) == [obstacle]
    middle, radius = obstacle["circle"]["center_px"], obstacle["circle"]["radius_px"]
    body = bodies(previews)[-1]
    assert nearest(planned(filled_service, body), middle) > radius
    assert nearest(planned(filled_service, {**body, "obstacles": []}), middle) < radius


def test_a_drawn_path_becomes_a_predator_for_the_whole_length(studio, filled_service):
    page, previews = studio
    expect_animals(page, 6)
    flee(page, "path").check()
    drag(page, [(0.1, 0.2), (0.4, 0.8), (0.6, 0.2), (0.9, 0.7)])
    expect(page.locator(".thing-predator")).to_have_count(1)
    expect(flee(page, "path")).to_be_checked()
    expect_animals(page, 6)
    path = bodies(previews)[-1]["predator"]["path"]
    assert 4 <= len(path) <= 30
    assert path[0]["time_s"] == 0
    assert path[-1]["time_s"] == pytest.approx(2, abs=0.01)
    hunted = planned(filled_service, bodies(previews)[-1])["predator"]
    assert hunted[0][:2] == pytest.approx(path[0]["at_px"], abs=0.1)
    assert hunted[-1][:2] == pytest.approx(path[-1]["at_px"], abs=25)


def test_things_are_placed_moved_and_removed_by_keys(studio):
    page, previews = studio
    expect_animals(page, 6)
    page.keyboard.press("t")
    page.keyboard.press("Enter")
    goal = page.locator(".thing-goal")
    expect(goal).to_be_focused()
    (x, y) = json.loads(settings(page)["goals"])[0]["at_px"]
    page.keyboard.press("Shift+ArrowLeft")
    page.keyboard.press("ArrowDown")
    assert json.loads(settings(page)["goals"])[0]["at_px"] == [x - 10, y + 1]
    page.keyboard.press("Delete")
    expect(goal).to_have_count(0)
    assert "goals" not in settings(page)


def test_undo_and_redo_go_through_the_settings(studio):
    page, _ = studio
    expect_animals(page, 6)
    number(page, "count").fill("12")
    expect_animals(page, 12)
    flee(page, "hunter").check()
    assert settings(page)["predator"] == "{}"
    page.keyboard.press("Control+z")
    assert "predator" not in settings(page)
    expect(flee(page, "nothing")).to_be_checked()
    page.keyboard.press("Control+z")
    expect_animals(page, 6)
    assert settings(page)["count"] == "6"
    page.keyboard.press("Control+Shift+z")
    expect_animals(page, 12)
    expect(number(page, "count")).to_have_value("12")


def test_holding_b_shows_the_flock_before_the_last_change(studio):
    page, _ = studio
    expect_animals(page, 6)
    number(page, "count").fill("11")
    expect_animals(page, 11)
    page.locator("h1").click()
    page.keyboard.down("b")
    expect_animals(page, 6)
    page.keyboard.up("b")
    expect_animals(page, 11)


def test_long_flocks_show_their_beginning_first_at_the_same_moment(studio):
    page, previews = studio
    number(page, "frames").fill("5")
    expect(page.locator(".time")).to_contain_text("of 0:05", timeout=PLAN_MS)
    page.locator("h1").click()
    page.keyboard.press("End")
    expect(page.locator(".time")).to_contain_text("frame 149")
    before = len(previews)
    number(page, "frames").fill("150")
    expect(page.locator(".time")).to_contain_text("of 2:30", timeout=PLAN_MS)
    expect_animals(page, 6)
    assert [body["frames"] for body in bodies(previews[before:])][-2:] == [60, 4500]
    expect(page.locator(".time")).to_contain_text("frame 149")


def test_a_link_opened_by_two_visitors_makes_the_same_bytes(page, visitor, filled_service):
    library = get(f"{filled_service}/v1/libraries")["items"][-1]["id"]
    link = f"{filled_service}/libraries/{library}/studio?count=3&frames=24&seed=41&rules.wander=0.7&obstacles=[{{%22circle%22:{{%22center_px%22:[320,240],%22radius_px%22:40}}}}]"
    plans = []
    for someone in (page, visitor(locale="ja", viewport={"width": 390, "height": 844})):
        opened(someone, link)
        expect_animals(someone, 3)
        plans.append(fetch(f"{filled_service}/v1/flocks/{make_film_in_studio(someone)}/flock.json"))
    assert plans[0] == plans[1]
    made = json.loads(plans[0])["params"]
    assert (made["count"], made["frames"], made["seed"], made["rules"]["wander"], len(made["obstacles"])) == (3, 24, 41, 0.7, 1)


def test_transparent_flocks_that_flee_are_told_as_commands_and_have_alpha(page, filled_service):
    opened(page, f"{filled_service}/studio?count=2&frames=24")
    flee(page, "hunter").check()
    page.get_by_role("radio", name=say(page, "set.background.transparent")).check()
    page.get_by_text(say(page, "share.title")).click()
    command = page.locator("#group-share pre").nth(2)
    expect(command).to_contain_text("-o flock.webm")
    expect(command).to_contain_text("--set 'predator={}'")
    expect(command).to_contain_text("--set render.background=transparent")
    with page.expect_request(lambda request: request.url.endswith("/v1/flocks")) as made:
        flock = make_film_in_studio(page)
    body = json.loads(made.value.post_data)
    assert body["render"]["background"] == "transparent"
    assert "webm" in body["render"]["formats"]
    assert body["predator"] == {}
    clear, solid = page.evaluate(ALPHA, f"/v1/flocks/{flock}/video.webm")
    assert clear > 0.5
    assert solid > 0.001


def test_backgrounds_are_in_sight_without_opening_a_group(studio):
    page, _ = studio
    for one in ("plate", "transparent", "color"):
        expect(page.get_by_role("radio", name=say(page, f"set.background.{one}"), exact=True)).to_be_visible()
    assert page.locator(".studio-panel details[open]").count() == 0


def test_slider_keeps_the_reach_that_it_once_had(studio):
    page, _ = studio
    number(page, "count").fill("200")
    expect(slider(page, "count")).to_have_attribute("max", "200")
    slider(page, "count").fill("150")
    expect(number(page, "count")).to_have_value("150")
    expect(slider(page, "count")).to_have_attribute("max", "200")


def test_what_the_background_implies_is_no_change_of_the_person(studio):
    page, _ = studio
    background = lambda one: page.get_by_role("radio", name=say(page, f"set.background.{one}"), exact=True)  # noqa: E731
    mark = page.locator("#group-files > summary .mark")
    background("transparent").check()
    assert "webm" in settings(page)["render.formats"]
    # Where the animal was filmed is no longer seen.
    assert settings(page)["tank"] == "picture"
    expect(mark).to_be_empty()
    expect(page.locator("#group-move > summary .mark")).to_be_empty()
    background("plate").check()
    assert not {"render.formats", "tank"} & settings(page).keys()
    background("transparent").check()
    page.locator("#group-files > summary").click()
    page.get_by_role("checkbox", name=say(page, "set.format.gif")).check()
    expect(mark).to_have_text(say(page, "group.changed", n=1))
    background("plate").check()
    assert "gif" in settings(page)["render.formats"]


def test_flight_is_chosen_in_one_place(studio):
    page, _ = studio
    expect(page.locator("#flee").get_by_role("radio")).to_have_count(3)
    tools = page.get_by_role("toolbar", name=say(page, "tool.label"))
    for name in ("predator", "chase"):
        expect(tools.get_by_role("button", name=say(page, f"tool.{name}"))).to_have_count(0)
        expect(page.locator("#flee").get_by_role("button", name=say(page, f"tool.{name}"))).to_be_hidden()
    flee(page, "path").check()
    expect(page.locator("#flee").get_by_role("button", name=say(page, "tool.predator"))).to_have_attribute("aria-pressed", "true")
    page.keyboard.press("Escape")
    expect(flee(page, "nothing")).to_be_checked()
    flee(page, "hunter").check()
    expect(page.locator(".hunter")).to_be_visible(timeout=PLAN_MS)


# The shares of clear and of solid pixels in the middle of a film.
ALPHA = """async (src) => {
    const video = Object.assign(document.createElement("video"), { src, muted: true });
    await new Promise((resolve, reject) => { video.onseeked = resolve; video.onerror = reject; video.onloadeddata = () => { video.currentTime = 0.4; }; });
    const [width, height] = [video.videoWidth, video.videoHeight];
    const context = Object.assign(document.createElement("canvas"), { width, height }).getContext("2d");
    context.drawImage(video, 0, 0);
    const alpha = context.getImageData(0, 0, width, height).data.filter((_, k) => k % 4 === 3);
    return [(value) => value < 10, (value) => value > 245].map((fits) => alpha.filter(fits).length / alpha.length);
}"""


def test_a_link_that_the_service_refuses_can_be_mended(page, filled_service):
    page.goto(f"{filled_service}/studio?frames=60&variation=9&nonsense=1")
    expect(page.locator(".trouble .problem")).to_be_visible(timeout=PLAN_MS)
    expect(page.locator(".advice-line")).to_contain_text("nonsense")
    page.locator(".trouble").get_by_role("button", name="Start over").click()
    expect(page.locator(".studio-stage canvas")).to_be_visible(timeout=PLAN_MS)
    expect(page.locator(".trouble .problem")).to_have_count(0)
    assert settings(page) == {}


def test_reasons_and_help_of_the_service_are_japanese_on_a_japanese_page(visitor, filled_service):
    page = visitor(locale="ja-JP")
    page.goto(f"{filled_service}/studio?frames=60&variation=9")
    box = page.locator(".trouble .problem")
    expect(box.locator("strong")).to_have_text(re.compile("[ぁ-ん]"), timeout=PLAN_MS)
    for text in box.locator("p:not([lang=en], .actions)").all_text_contents():
        assert not re.search("[A-Za-z]", text), text
    assert page.locator(".help").count() > 30
    expect(page.locator(".help[lang=en]")).to_have_count(0)


def test_chasing_with_the_pointer_becomes_a_planned_predator(studio):
    page, previews = studio
    expect_animals(page, 6)
    flee(page, "path").check()
    page.get_by_role("button", name=say(page, "tool.chase")).click()
    box = page.locator(".studio-stage canvas").bounding_box()
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    expect(page.locator(".playing")).to_be_visible(timeout=PLAN_MS)
    for step in range(12):
        page.mouse.move(x + 6 * step, y + (step % 5) * 8)
        page.evaluate("new Promise(requestAnimationFrame)")
    page.mouse.move(2, 2)
    expect(page.locator(".playing")).to_be_hidden()
    expect_animals(page, 6)
    path = bodies(previews)[-1]["predator"]["path"]
    assert len(path) >= 2
    times = [point["time_s"] for point in path]
    assert times == sorted(times) and times[-1] > times[0]
