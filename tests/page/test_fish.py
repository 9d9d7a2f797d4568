"""The virtual fish: film, 3-D view and wireframe in step, turning, options, downloads, and browsers without WebGL."""

import json
import math
import re

import pytest
from playwright.sync_api import expect

from conftest import CHROMIUM
from service import post, wait_for_job
from steps import fetch, say, until

pytestmark = pytest.mark.thorough

LOAD_MS = 60_000
FPS = 30
N_FRAMES = 150


@pytest.fixture(scope="session")
def gl_browser(browser):
    """A browser that draws WebGL in software."""
    arguments = ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--autoplay-policy=no-user-gesture-required"]
    gl_browser = browser.browser_type.launch(executable_path=CHROMIUM, args=arguments)
    yield gl_browser
    gl_browser.close()


@pytest.fixture
def gl_page(gl_browser):
    """A page that fails on script errors, on requests to other servers and on breaches of the content security policy."""
    context = gl_browser.new_context(viewport={"width": 1280, "height": 900}, reduced_motion="reduce")
    page = context.new_page()
    faults = []
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda message: faults.append(message.text) if message.type == "error" else None)
    page.on("request", lambda request: faults.append(request.url) if "127.0.0.1" not in request.url else None)
    yield page
    context.close()
    assert faults == []


@pytest.fixture(scope="module")
def fish(filled_service):
    """Address of the service, id of the library, and id of its virtual fish."""
    library = json.loads(fetch(f"{filled_service}/v1/libraries"))["items"][-1]["id"]
    made = post(f"{filled_service}/v1/fish", {"library_id": library})
    wait_for_job(filled_service, made["job_id"])
    return filled_service, library, made["fish_id"]


def open_fish(page, fish, query=""):
    address, library, _ = fish
    page.goto(f"{address}/libraries/{library}/fish{query}")
    expect(page.locator(".fish-options")).to_be_visible(timeout=LOAD_MS)
    return page


def drawn(page, selector, only_orange=False):
    """Colored pixels of a WebGL canvas: their number, and their middle as shares of its width and height."""
    script = """(canvas, onlyOrange) => new Promise((resolve) => {
      // A step on and back asks for a drawing, which can be read only until the browser shows it.
      for (const key of ["ArrowRight", "ArrowLeft"]) document.dispatchEvent(new KeyboardEvent("keydown", { key }));
      requestAnimationFrame(() => {
        const copy = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
        const context = copy.getContext("2d");
        context.drawImage(canvas, 0, 0);
        const { data } = context.getImageData(0, 0, copy.width, copy.height);
        let [n, x, y] = [0, 0, 0];
        for (let k = 0; k < data.length; k += 4) {
          if (data[k + 3] < 20 || (onlyOrange && !(data[k] > 120 && data[k + 2] < 0.6 * data[k] && data[k + 3] > 250))) continue;
          n += 1;
          x += (k >> 2) % copy.width;
          y += Math.floor((k >> 2) / copy.width);
        }
        resolve({ n, x: x / n / copy.width, y: y / n / copy.height });
      });
    })"""
    return page.locator(selector).evaluate(script, only_orange)


def poses_of(fish):
    address, library, _ = fish
    return json.loads(fetch(f"{address}/v1/libraries/{library}/poses.json"))


def test_a_film_without_a_fish_has_one_button_that_makes_it(gl_page, empty_service, film):
    footage = post(f"{empty_service}/v1/footage?name=one.mp4", film.read_bytes(), "video/mp4")
    analysis = post(f"{empty_service}/v1/analyses", {"footage_id": footage["id"]})
    wait_for_job(empty_service, analysis["job_id"])
    gl_page.goto(f"{empty_service}/libraries/{analysis['library_id']}/fish")
    gl_page.get_by_role("button", name="Make the virtual fish").click()
    expect(gl_page.locator("canvas.space")).to_be_visible(timeout=2 * LOAD_MS)
    expect(gl_page).to_have_title(re.compile("^Virtual fish: one"))


def test_a_link_with_a_moment_shows_that_frame_at_rest(gl_page, fish):
    open_fish(gl_page, fish, "?t=2")
    expect(gl_page.locator(".time")).to_contain_text("frame 60")
    until(gl_page, f"Math.floor(document.querySelector('.film-stage video').currentTime * {FPS}) === 60")


@pytest.mark.parametrize("frame", [0, 40, 90, 149])
def test_the_fish_has_the_heading_of_the_animal_at_the_same_frame(gl_page, fish, frame):
    open_fish(gl_page, fish, f"?t={frame / FPS + 0.001:.3f}")
    poses = poses_of(fish)["frames"]
    # The motion is smoothed, and a fish that turns toward the camera hardly has a heading.
    near = [pose["heading_rad"] for pose in poses[max(0, frame - 4) : frame + 5] if pose["heading_rad"] is not None]
    text = gl_page.locator(".reading").text_content()
    told = math.radians(float(re.search(r"[Hh]eading (−?\d+)°", text)[1].replace("−", "-")))
    assert min(abs(math.remainder(told - one, math.tau)) for one in near) < 0.25, text


def test_keys_move_film_and_fish_by_exact_frames(gl_page, fish):
    open_fish(gl_page, fish, "?t=1")
    gl_page.locator("h1").click()
    for key, frame in [("ArrowRight", 31), ("Shift+ArrowRight", 41), ("ArrowLeft", 40), ("End", N_FRAMES - 1), ("Home", 0)]:
        gl_page.keyboard.press(key)
        expect(gl_page.locator(".time")).to_contain_text(f"frame {frame}")
        until(gl_page, f"Math.floor(document.querySelector('.film-stage video').currentTime * {FPS}) === {frame}")
    gl_page.keyboard.press("Space")
    expect(gl_page.locator(".time")).not_to_contain_text("frame 0", timeout=5000)
    gl_page.keyboard.press("Space")
    expect(gl_page).to_have_url(re.compile(r"\?t=[\d.]+$"))


@pytest.mark.parametrize("frame", [20, 120])
def test_the_wireframe_lies_on_the_animal(gl_page, fish, frame):
    open_fish(gl_page, fish, f"?t={frame / FPS + 0.001:.3f}")
    poses = poses_of(fish)
    width, height = poses["image_size_px"]
    x, y = poses["frames"][frame]["centroid_px"]
    seen = drawn(gl_page, "canvas.wireframe")
    assert seen["n"] > 200
    assert abs(seen["x"] * width - x) < 12
    assert abs(seen["y"] * height - y) < 12
    gl_page.get_by_label("Wireframe over the film").uncheck()
    expect(gl_page.locator("canvas.wireframe")).to_be_hidden()


def test_as_filmed_the_fish_is_where_the_film_shows_it(gl_page, fish):
    open_fish(gl_page, fish, "?t=1")
    gl_page.get_by_text("As filmed").click()
    wireframe = drawn(gl_page, "canvas.wireframe")
    space = drawn(gl_page, "canvas.space", only_orange=True)
    assert space["n"] > 100
    assert abs(space["x"] - wireframe["x"]) < 0.05
    assert abs(space["y"] - wireframe["y"]) < 0.05


def test_drag_wheel_buttons_and_keys_turn_the_fish(gl_page, fish):
    open_fish(gl_page, fish, "?t=1")
    canvas = gl_page.locator("canvas.space")
    canvas.scroll_into_view_if_needed()
    box = canvas.bounding_box()
    middle = (box["x"] + box["width"] / 2, box["y"] + box["height"] / 2)
    pictures = [drawn(gl_page, "canvas.space")]

    def changed():
        for _ in range(20):
            gl_page.wait_for_timeout(100)
            if drawn(gl_page, "canvas.space") != pictures[-1]:
                break
        pictures.append(drawn(gl_page, "canvas.space"))
        assert pictures[-1] != pictures[-2]

    gl_page.mouse.move(*middle)
    gl_page.mouse.down()
    gl_page.mouse.move(middle[0] + 120, middle[1] + 30, steps=4)
    gl_page.mouse.up()
    changed()
    gl_page.mouse.wheel(0, -300)
    changed()
    gl_page.get_by_role("button", name="Turn up").click()
    changed()
    gl_page.keyboard.press("-")
    changed()
    gl_page.get_by_role("button", name="Reset the view").click()
    for _ in range(50):
        gl_page.wait_for_timeout(100)
        if drawn(gl_page, "canvas.space") == pictures[0]:
            break
    assert drawn(gl_page, "canvas.space") == pictures[0]


def test_another_fish_is_made_with_other_options_and_saved_under_a_human_name(gl_page, fish):
    open_fish(gl_page, fish)
    gl_page.get_by_label("Body", exact=True).select_option("goldfish")
    gl_page.get_by_label("Colors of the goldfish", exact=True).select_option("silver")
    gl_page.get_by_role("button", name="As in the paper").click()
    expect(gl_page.get_by_role("checkbox", name="The body bends")).not_to_be_checked()
    gl_page.get_by_role("button", name="Make this fish too").click()
    expect(gl_page.locator(".files tr[aria-current]")).to_contain_text("Silver, stiff, upright", timeout=2 * LOAD_MS)
    with gl_page.expect_download() as saved:
        gl_page.locator("tr[aria-current]").get_by_role("link", name="Save GLB").click()
    assert re.fullmatch(r"goldfish.*-virtual-fish-silver-rigid\.glb", saved.value.suggested_filename)
    assert saved.value.path().read_bytes()[:4] == b"glTF"
    gl_page.locator("tr[aria-current]").get_by_role("button", name="Delete").click()
    expect(gl_page.locator(".files tbody tr")).to_have_count(1)
    gl_page.goto("about:blank")


def test_a_goldfish_is_offered_where_the_animal_is_too_small(page, fish):
    open_fish(page, fish)
    asked = []

    def refuse(route):
        asked.append(route.request.post_data_json)
        code = "animal_too_small" if len(asked) == 1 else "queue_full"
        route.fulfill(status=422, json={"code": code, "title": code, "detail": code, "advice": "", "mends": []})

    page.route("**/v1/fish", refuse)
    page.locator(".make-fish").click()
    offer = page.get_by_role("button", name=say(page, "fish.goldfish"))
    offer.click()
    expect(page.locator(".make-state")).to_contain_text("queue_full")
    expect(offer).to_have_count(0)
    assert [one.get("body") for one in asked] == [None, "goldfish"]


def test_without_webgl_the_film_of_the_fish_runs_in_step(page, fish):
    page.add_init_script("HTMLCanvasElement.prototype.getContext = new Proxy(HTMLCanvasElement.prototype.getContext, { apply: (call, canvas, given) => (given[0].startsWith('webgl') ? null : Reflect.apply(call, canvas, given)) });")
    open_fish(page, fish, "?t=1")
    expect(page.get_by_text("This browser has no WebGL 2")).to_be_visible()
    page.locator("h1").click()
    page.keyboard.press("ArrowRight")
    until(page, f"[...document.querySelectorAll('.stage video')].every((video) => Math.floor(video.currentTime * {FPS}) === 31) && document.querySelectorAll('.stage video').length === 2")


def test_a_model_that_cannot_be_read_leaves_the_film(gl_page, fish):
    gl_page.route("**/model.glb", lambda route: route.fulfill(body="no model"))
    open_fish(gl_page, fish, "?t=1")
    expect(gl_page.get_by_text("The 3-D model cannot be read")).to_be_visible()
    expect(gl_page.locator(".stage video")).to_have_count(2)


@pytest.mark.parametrize("width", [320, 390, 820, 1440, 2560])
def test_no_width_scrolls_sideways(gl_page, fish, width):
    gl_page.set_viewport_size({"width": width, "height": 900})
    open_fish(gl_page, fish, "?t=1")
    assert gl_page.evaluate("document.documentElement.scrollWidth <= innerWidth")
